//! Step after step, with the step's length fitted to the error, from one reversal of a dry hinge to the next.

use nalgebra::{DMatrix, DVector};

use super::balance::Balance;
use super::collocation::{RADAU, STAGES};
use super::forward::Bearers;
use super::step::{Slopes, Stages, Start, Step};
use super::{ForwardModel, Hinge, Parameter};
use crate::error::{Error, Result};

/// How exact a motion is to be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Accuracy {
    /// Error allowed in a step's angles.
    pub step_error_rad: f64,
    /// Longest step: even a motion that begins at rest is looked at this often.
    pub longest_step_s: f64,
    /// Most steps in one motion.
    pub most_steps: usize,
    /// Where a link turns further, the motion is given up: a softening spring without end has let go.
    pub most_angle_rad: f64,
}

impl Default for Accuracy {
    fn default() -> Self {
        Self { step_error_rad: 1e-10, longest_step_s: 0.1, most_steps: 2_000_000, most_angle_rad: 1e4 }
    }
}

/// What the derivatives of a motion are taken with.
#[derive(Debug, Clone, PartialEq)]
pub struct Directions {
    /// The first columns.
    pub parameters: Vec<Parameter>,
    /// ∂θ at the start with the initial values, n × further columns.
    pub theta: DMatrix<f64>,
    /// ∂rate at the start, m × further columns.
    pub rate: DMatrix<f64>,
}

/// Where a motion is.
pub(super) struct Place {
    pub t_s: f64,
    pub theta: Vec<f64>,
    pub rate: Vec<f64>,
}

/// Where the laws have more corners than this, steps do not end at each of them.
const MOST_CORNERS: usize = 4;
/// Nor where a force bends in more places (cost: each is the end of a step).
const MOST_KINKS: usize = 12;
/// Points of a step where a reversal is looked for.
const LOOKS: usize = 12;
/// How well the instant is known at which something turns, of a step.
const ROOT_WIDTH: f64 = 1e-13;
/// A law's corner, or a kink, at every so many of these: what it depends on is as smooth as the step.
const LOOK_AHEAD: usize = 3;

/// Runs the model from `place` to `until_s`, handing every accepted step to `visit`.
pub(super) fn integrate(
    model: &ForwardModel,
    place: Place,
    until_s: f64,
    directions: Option<&Directions>,
    accuracy: &Accuracy,
    visit: &mut dyn FnMut(Step),
) -> Result<()> {
    let mut run = Run::new(model, place, directions, accuracy)?;
    let columns = run.slopes.as_ref().map_or(0, |(theta, _)| theta.ncols());
    let ended = run.go_to(until_s, visit);
    model.work().add(run.steps, model.work_of_step(run.balance.rates()), columns);
    ended
}

struct Run<'a> {
    model: &'a ForwardModel,
    accuracy: &'a Accuracy,
    stages: Stages<'a>,
    /// At whatever instant is looked at.
    balance: Balance<'a>,
    discontinuities_s: Vec<f64>,
    place: Place,
    /// Whether the hinge has dry friction.
    is_dry: bool,
    hinge: Hinge,
    /// Sides of the laws' corners; empty where there are none, or too many to stop at.
    sides: Vec<f64>,
    /// Sides of the places at which a force bends; empty where there are none, or too many to stop at.
    kinks: Vec<f64>,
    /// Accelerations at the place.
    first: Vec<f64>,
    length_s: f64,
    /// The step before, whose polynomial goes on into the next.
    last: Option<Step>,
    /// Attempts at a step so far.
    steps: usize,
    parameters: Vec<Bearers>,
    /// ∂θ and ∂rate at the place.
    slopes: Option<(DMatrix<f64>, DMatrix<f64>)>,
}

/// What ends a step early.
#[derive(Clone, Copy, PartialEq)]
enum Turn {
    Reverses,
    Lets,
    Corner(usize),
    Kink(usize),
}

impl<'a> Run<'a> {
    fn new(
        model: &'a ForwardModel,
        place: Place,
        directions: Option<&Directions>,
        accuracy: &'a Accuracy,
    ) -> Result<Self> {
        let balance = Balance::new(model);
        let slopes = directions.map(|d| {
            let start = d.parameters.len();
            let with_parameters = |initial: &DMatrix<f64>| {
                let initial = balance.coordinates(initial.clone());
                let mut slopes = DMatrix::zeros(initial.nrows(), start + initial.ncols());
                slopes.columns_mut(start, initial.ncols()).copy_from(&initial);
                slopes
            };
            (with_parameters(&d.theta), with_parameters(&d.rate))
        });
        let along = |values: &[f64]| {
            balance.coordinates(DMatrix::from_column_slice(values.len(), 1, values)).as_slice().to_vec()
        };
        let place = Place { t_s: place.t_s, theta: along(&place.theta), rate: along(&place.rate) };
        let rates = place.rate.len();
        let mut run = Self {
            model,
            accuracy,
            stages: Stages::new(model),
            balance,
            discontinuities_s: model.discontinuities_s(),
            place,
            is_dry: model.is_dry(),
            hinge: Hinge::SlidesForward,
            sides: Vec::new(),
            kinks: Vec::new(),
            first: vec![0.0; rates],
            length_s: 0.1 * accuracy.longest_step_s,
            last: None,
            steps: 0,
            parameters: directions.map_or_else(Vec::new, |d| d.parameters.iter().map(|p| model.bearers(*p)).collect()),
            slopes,
        };
        run.hinge = run.hinge_at_start()?;
        run.first = run.accelerations(run.hinge)?;
        run.sides = run.sides_at_start();
        run.kinks = run.kinks_at_start();
        Ok(run)
    }

    /// Step after step until then, each accepted one handed to `visit`.
    fn go_to(&mut self, until_s: f64, visit: &mut dyn FnMut(Step)) -> Result<()> {
        while !(self.place.t_s >= until_s) {
            self.steps += 1;
            if self.steps > self.accuracy.most_steps {
                let detail = format!(
                    "more than {} steps up to t = {:.4} s; shorten the recording, or lower the largest coefficient of [model]",
                    self.accuracy.most_steps, self.place.t_s
                );
                return Err(Error::Simulation { detail });
            }
            if let Some(step) = self.advance(until_s)? {
                visit(match self.model.shapes() {
                    Some(shapes) => step.of_links(shapes),
                    None => step,
                });
            }
        }
        Ok(())
    }

    /// One attempt at a step; `None` where it was too long and is to be tried again.
    fn advance(&mut self, until_s: f64) -> Result<Option<Step>> {
        let target_s =
            self.discontinuities_s.iter().copied().find(|b| *b > self.place.t_s).map_or(until_s, |b| b.min(until_s));
        let left_s = target_s - self.place.t_s;
        let mut h = self.length_s.min(self.accuracy.longest_step_s);
        if left_s < 2.0 * h {
            h = if left_s <= h * (1.0 + 1e-9) { left_s } else { 0.5 * left_s };
        }
        let mut k = self.guess(h);
        let tolerance_rad = self.accuracy.step_error_rad;
        let start = start_of(&self.place, self.hinge, &self.sides);
        let Some(()) = self.stages.solve(&start, h, &mut k, tolerance_rad) else { return self.retry(h) };
        let error = self.stages.error_rad(&start, h, &k, &self.first) / tolerance_rad;
        let factor = 0.9 * error.max(1e-12).powf(-1.0 / (STAGES + 1) as f64);
        if !(error <= 1.0) {
            return self.shorten(h * factor.clamp(0.1, 0.9)).map(|()| None);
        }
        self.length_s = (h * factor.clamp(0.2, 5.0)).min(self.accuracy.longest_step_s).max(self.length_s.min(h));
        let mut step = self.step(h, &k);
        let turn = self.turn_in(&step);
        if let Some((tau, turn)) = turn {
            let Some(ended) = self.end_at(step, tau, turn) else { return self.retry(h) };
            step = ended;
        }
        if let Some((theta, rate)) = &self.slopes {
            let k = DVector::from_column_slice(&step.stages);
            let stages = self.stages.slopes(
                &start_of(&self.place, self.hinge, &self.sides),
                step.length_s,
                &k,
                &self.parameters,
                (theta, rate),
            );
            let stages = stages.ok_or_else(|| self.stuck("no derivatives"))?;
            step.slopes = Some(Slopes { theta: theta.clone(), rate: rate.clone(), stages });
        }
        self.place = Place {
            t_s: if turn.is_none() && h == left_s { target_s } else { step.from_s + step.length_s },
            theta: step.theta_rad(1.0),
            rate: step.rate(1.0),
        };
        // of shapes only the first is an angle
        let angles = if self.model.shapes().is_some() { 1 } else { self.place.theta.len() };
        if self.place.theta[..angles].iter().any(|theta| theta.abs() > self.accuracy.most_angle_rad) {
            return Err(self.stuck("the motion runs away"));
        }
        self.slopes = step.slopes(1.0);
        self.first = step.last_acceleration().to_vec();
        let jump = turn.is_some() || self.place.t_s == target_s;
        if let Some((_, turn)) = turn {
            self.change(turn)?;
        } else if self.place.t_s == target_s && target_s < until_s {
            self.first = self.accelerations(self.hinge)?;
        }
        self.last = if jump { None } else { Some(Step { slopes: None, ..step.clone() }) };
        Ok(Some(step))
    }

    /// No step yet, and a far shorter one next, after one of this length whose equations were not solved: its guess may have been to blame.
    fn retry(&mut self, length_s: f64) -> Result<Option<Step>> {
        self.last = None;
        self.shorten(0.3 * length_s).map(|()| None)
    }

    fn shorten(&mut self, length_s: f64) -> Result<()> {
        self.length_s = length_s;
        if length_s < 1e-12 * (1.0 + self.place.t_s.abs()) {
            Err(self.stuck("no step is short enough"))
        } else {
            Ok(())
        }
    }

    fn stuck(&self, what: &str) -> Error {
        Error::Simulation {
            detail: format!(
                "{what} at t = {:.4} s; lower the largest coefficient of [model] or the release",
                self.place.t_s
            ),
        }
    }

    fn step(&self, length_s: f64, k: &DVector<f64>) -> Step {
        Step {
            from_s: self.place.t_s,
            length_s,
            theta_rad: self.place.theta.clone(),
            rate: self.place.rate.clone(),
            stages: k.as_slice().to_vec(),
            hinge: self.hinge,
            slopes: None,
        }
    }

    /// The polynomial of the step before goes on; after a jump the accelerations are taken as constant.
    fn guess(&self, length_s: f64) -> DVector<f64> {
        let m = self.first.len();
        let mut k = DVector::zeros(STAGES * m);
        for (stage, node) in RADAU.nodes.iter().enumerate() {
            let guess = match &self.last {
                Some(last) if length_s < 2.0 * last.length_s => {
                    last.acceleration(1.0 + node * length_s / last.length_s)
                }
                _ => self.first.clone(),
            };
            k.rows_mut(stage * m, m).copy_from_slice(&guess);
        }
        k
    }

    fn accelerations(&mut self, hinge: Hinge) -> Result<Vec<f64>> {
        // just after a break of the forces, should there be one here
        let t_s = self.place.t_s + 1e-12 * (1.0 + self.place.t_s.abs());
        self.balance.go_to(t_s, &self.place.theta, (&self.place.rate, &self.first), hinge, &[]);
        self.balance.accelerations()
    }

    /// What friction bears while the hinge is held at the place (N·m).
    fn sticking_torque_n_m(&mut self) -> Result<f64> {
        let held = self.accelerations(Hinge::Sticks)?;
        self.balance.go_to(self.place.t_s, &self.place.theta, (&self.place.rate, &held), Hinge::Sticks, &[]);
        Ok(self.balance.sticking_torque_n_m())
    }

    /// Whether friction can bear that where the balance was looked at last.
    fn holds(&self, sticking_torque_n_m: f64) -> bool {
        self.balance.friction_n_m().is_some_and(|friction_n_m| sticking_torque_n_m.abs() <= friction_n_m)
    }

    fn hinge_at_start(&mut self) -> Result<Hinge> {
        if !self.is_dry {
            return Ok(Hinge::SlidesForward);
        }
        if self.place.rate[0] != 0.0 {
            return Ok(Hinge::sliding(self.place.rate[0]));
        }
        let sticking_torque_n_m = self.sticking_torque_n_m()?;
        Ok(if self.holds(sticking_torque_n_m) { Hinge::Sticks } else { Hinge::sliding(sticking_torque_n_m) })
    }

    /// Where in the step the hinge first reverses or is let go, or a law comes to a corner or a kink.
    fn turn_in(&mut self, step: &Step) -> Option<(f64, Turn)> {
        let turn = if self.hinge == Hinge::Sticks { Turn::Lets } else { Turn::Reverses };
        if !self.is_dry && self.sides.is_empty() && self.kinks.is_empty() {
            return None;
        }
        let (mut inside, mut ahead_inside) = (0.0, 0.0);
        for look in 1..=LOOKS {
            let tau = look as f64 / LOOKS as f64;
            let mut first: Option<(f64, Turn)> = None;
            if self.is_dry && self.hinge_goes_on(step, tau, turn) < 0.0 {
                first = Some((root(inside, tau, |tau| self.hinge_goes_on(step, tau, turn)), turn));
            }
            // up to the hinge's own turn, where it has one
            if first.is_some() || look % LOOK_AHEAD == 0 {
                let until = first.map_or(tau, |(at, _)| at);
                let ahead = self.ahead(step, until);
                for which in (0..ahead.len()).filter(|which| ahead[*which].0 < 0.0) {
                    let at = root(ahead_inside, until, |tau| self.ahead(step, tau)[which].0);
                    if first.is_none_or(|(earliest, _)| at < earliest) {
                        first = Some((at, ahead[which].1));
                    }
                }
                ahead_inside = tau;
            }
            if first.is_some() {
                return first;
            }
            inside = tau;
        }
        None
    }

    /// Positive as long as the hinge goes on as it is.
    fn hinge_goes_on(&mut self, step: &Step, tau: f64, turn: Turn) -> f64 {
        if turn == Turn::Reverses {
            return self.hinge.sign() * step.one_rate(0, tau);
        }
        let (rate, acceleration) = (step.rate(tau), step.acceleration(tau));
        let t_s = step.from_s + tau * step.length_s;
        self.balance.go_to(t_s, &step.theta_rad(tau), (&rate, &acceleration), Hinge::Sticks, &[]);
        self.balance.friction_n_m().unwrap_or(0.0) - self.balance.sticking_torque_n_m().abs()
    }

    /// Of every corner, then of every kink, a quantity that is positive up to there.
    fn ahead(&mut self, step: &Step, tau: f64) -> Vec<(f64, Turn)> {
        let mut ahead = Vec::new();
        if self.sides.is_empty() && self.kinks.is_empty() {
            return ahead;
        }
        let rate = step.rate(tau);
        if !self.sides.is_empty() {
            let corners = self.balance.corners(&rate).into_iter().zip(&self.sides).enumerate();
            ahead.extend(corners.map(|(which, (corner, side))| (corner * side, Turn::Corner(which))));
        }
        if !self.kinks.is_empty() {
            let kinks = self.balance.kinks(step.from_s + tau * step.length_s, &step.theta_rad(tau), &rate);
            let kinks = kinks.into_iter().zip(&self.kinks).enumerate();
            ahead.extend(kinks.map(|(which, (kink, side))| (kink * side, Turn::Kink(which))));
        }
        ahead
    }

    /// The sides of the kinks at the outset.
    fn kinks_at_start(&mut self) -> Vec<f64> {
        let now = self.balance.kinks(self.place.t_s, &self.place.theta, &self.place.rate);
        if now.len() > MOST_KINKS { Vec::new() } else { now.into_iter().map(f64::signum).collect() }
    }

    /// The sides of the corners at the outset; at a corner itself the one to which the motion goes: in pairs of a rate and of what has followed it.
    fn sides_at_start(&mut self) -> Vec<f64> {
        let now = self.balance.corners(&self.place.rate);
        if now.is_empty() || now.len() > MOST_CORNERS {
            return Vec::new();
        }
        let soon: Vec<f64> =
            self.place.rate.iter().zip(&self.first).map(|(rate, change)| rate + 1e-9 * change).collect();
        let next = self.balance.corners(&soon);
        let mut sides: Vec<f64> = now.iter().zip(&next).map(|(a, b)| if *a == 0.0 { *b } else { *a }).collect();
        for pair in sides.chunks_exact_mut(2) {
            pair[0] = pair[0].signum();
            pair[1] = if pair[1] == 0.0 { pair[0] } else { pair[1].signum() };
        }
        sides
    }

    /// The same step, ended where something turns; `None` where no such step is found.
    fn end_at(&mut self, step: Step, tau: f64, turn: Turn) -> Option<Step> {
        let mut step = step;
        let mut end = tau;
        // the polynomial's root first; a second pass lands on the reversal of the shorter step itself
        for _ in 0..2 {
            let length_s = step.length_s * end;
            if !(length_s > 1e-13) {
                return Some(step_of_no_length(step));
            }
            let mut k = DVector::zeros(step.stages.len());
            let m = self.first.len();
            for (stage, node) in RADAU.nodes.iter().enumerate() {
                k.rows_mut(stage * m, m).copy_from_slice(&step.acceleration(node * end));
            }
            let start = start_of(&self.place, self.hinge, &self.sides);
            let tolerance_rad = self.accuracy.step_error_rad;
            self.stages.solve(&start, length_s, &mut k, tolerance_rad)?;
            step = self.step(length_s, &k);
            // a corner only bends the force: to have ended close by is enough
            if turn != Turn::Reverses {
                break;
            }
            let correction_s = step.one_rate(0, 1.0) / step.last_acceleration()[0];
            end = 1.0 - correction_s / length_s;
            if !((end - 1.0).abs() < 0.1) || correction_s.abs() < 1e-13 {
                break;
            }
        }
        Some(step)
    }

    fn change(&mut self, turn: Turn) -> Result<()> {
        match turn {
            Turn::Corner(which) => self.sides[which] = -self.sides[which],
            Turn::Kink(which) => self.kinks[which] = -self.kinks[which],
            Turn::Lets => {
                self.hinge = Hinge::sliding(self.sticking_torque_n_m()?);
                self.first = self.accelerations(self.hinge)?;
            }
            Turn::Reverses => {
                let before = self.first.clone();
                let back = Hinge::sliding(-self.hinge.sign());
                self.place.rate[0] = 0.0;
                let slid = self.accelerations(back)?;
                let sticking_torque_n_m = self.sticking_torque_n_m()?;
                self.hinge = if slid[0] * back.sign() > 0.0 {
                    back
                } else if self.holds(sticking_torque_n_m) {
                    Hinge::Sticks
                } else {
                    Hinge::sliding(sticking_torque_n_m)
                };
                self.first = if self.hinge == back { slid } else { self.accelerations(self.hinge)? };
                self.jump_slopes(&before);
            }
        }
        Ok(())
    }

    /// The instant of the reversal depends on the parameters: ∂rate⁺ = ∂rate⁻ + (α⁻ − α⁺) ∂t, with ∂t = −∂ω₁/α₁⁻.
    fn jump_slopes(&mut self, before: &[f64]) {
        let Some((_, rate)) = &mut self.slopes else { return };
        if before[0].abs() < 1e-9 * self.model.characteristic_rad_s().powi(2) {
            return;
        }
        for mut column in rate.column_iter_mut() {
            let instant = -column[0] / before[0];
            for row in 0..before.len() {
                column[row] += (before[row] - self.first[row]) * instant;
            }
        }
    }
}

fn start_of<'p>(place: &'p Place, hinge: Hinge, sides: &'p [f64]) -> Start<'p> {
    Start { from_s: place.t_s, theta: &place.theta, rate: &place.rate, hinge, sides }
}

fn step_of_no_length(step: Step) -> Step {
    Step { length_s: 0.0, ..step }
}

/// The root of a function that is not negative at `inside` and negative at `outside`, from outside: by false position, where the weight of a bound that stays
/// twice is halved (the Illinois rule), and every third time by halving the bracket, so that it always closes.
fn root(mut inside: f64, mut outside: f64, mut value: impl FnMut(f64) -> f64) -> f64 {
    let mut at_bounds = [value(inside), value(outside)];
    let mut moved_last = None;
    for round in 0..150 {
        let length = outside - inside;
        if length < ROOT_WIDTH {
            break;
        }
        let share = at_bounds[0] / (at_bounds[0] - at_bounds[1]);
        let share = if round % 3 == 2 || !share.is_finite() { 0.5 } else { share };
        // a root at a bound is enclosed from both sides
        let least = 0.25 * ROOT_WIDTH / length;
        let middle = inside + length * share.clamp(least, 1.0 - least);
        let here = value(middle);
        let moves = usize::from(here < 0.0);
        if moves == 1 {
            outside = middle
        } else {
            inside = middle
        }
        at_bounds[moves] = here;
        if moved_last == Some(moves) {
            at_bounds[1 - moves] *= 0.5;
        }
        moved_last = Some(moves);
    }
    outside
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_root_is_found_from_outside_with_few_looks() {
        type Case<'f> = (f64, usize, &'f dyn Fn(f64) -> f64);
        let cases: [Case<'_>; 5] = [
            (0.3, 10, &|x| 0.3 - x),
            (0.7, 20, &|x| (0.7 - x) * (1.0 + x).powi(3)),
            (0.5, 140, &|x| (0.5 - x).powi(3)),
            (0.0, 140, &|x| -x),
            (0.25, 140, &|x| if x <= 0.25 { 1e-9 } else { -1e9 }),
        ];
        for (expected, most, function) in cases {
            let mut looks = 0;
            let found = root(0.0, 1.0, |x| {
                looks += 1;
                function(x)
            });
            assert!(found >= expected && found - expected <= ROOT_WIDTH, "{found} for {expected}");
            assert!(looks < most, "{looks} for {expected}");
        }
    }
}
