//! A candidate – some forms beside the push – fitted: amplitudes by least squares of the whitened, shapes by Gauss and Newton, and its evidence.

use std::borrow::Cow;

use nalgebra::DMatrix;

use super::filter::{Filter, Noise};
use super::forms::{Effect, Form, Setting};
use super::learn::lamp_columns;
use super::solve::solve;

/// Most steps of a descent.
const STEPS: usize = 14;
/// χ² by which the last step of a descent may still have come down.
const CONVERGED: f64 = 0.05;
/// Amplitudes are as likely in each of so many e-foldings: four decades, from the noise to what a sensor's range holds.
const EFOLDINGS: f64 = 9.2;
/// ln of the prior's width over that of a walk's likelihood.
const WALK_COST: f64 = 2.5;
/// Noise and swings are taken at their likeliest, which makes intervals narrower than they are; by so much on the records of `fixtures/laser`, seeds 2 and 3 and 33 of seed 1001.
const NOISE_LEARNT: f64 = 1.25;
/// Standard deviation of a swing that an effect excites, over the effect's size: a force that is switched at once excites one of its own size.
const SWING_OF_SIZE: f64 = 1.5;
/// How well an edge is known (s), and the part of a curl that is in higher modes than the first.
const EDGE_S: f64 = 0.01;
const HIGHER_MODES: f64 = 0.2;
/// Most that a size which cannot be costs.
const IMPOSSIBLE: f64 = 30.0;

/// A form with the numbers of its shape.
#[derive(Debug, Clone, PartialEq)]
pub struct Member {
    /// The form.
    pub form: Form,
    /// Coordinates of its shape.
    pub shape: Vec<f64>,
}

/// A fitted candidate.
#[derive(Debug, Clone)]
pub struct Fit {
    /// Its forms.
    pub members: Vec<Member>,
    /// Random walk of the level (m²/s); 0 but where the form `walk` is among the members.
    pub walk_m2_s: f64,
    /// Amplitudes: light, swings of the lamp, then those of each member.
    pub amplitude: Vec<f64>,
    /// Of the amplitudes, then of all shapes' coordinates.
    pub covariance: DMatrix<f64>,
    /// Sum of squares of the innovations.
    pub chi2: f64,
    /// Of the record, all amplitudes and shapes integrated out.
    pub ln_evidence: f64,
    /// Innovations that are left.
    pub left: Vec<f64>,
    /// Variance of the push for what is not known of how heat begins.
    pub heat_m2: f64,
}

impl Fit {
    /// The push and its standard deviation, with what an edge a hundredth of a second off and the higher modes' part in a curl make of heat.
    pub fn push(&self) -> [f64; 2] {
        [self.amplitude[0], (NOISE_LEARNT * NOISE_LEARNT * self.covariance[(0, 0)].max(0.0) + self.heat_m2).sqrt()]
    }

    /// The effects of its members.
    pub fn effects(&self) -> Vec<Effect> {
        let mut effects: Vec<Effect> = self.members.iter().map(|m| m.form.effect()).collect();
        effects.sort();
        effects.dedup();
        effects
    }
}

/// A record, its lamp, its noise, and what is the same for every candidate.
#[derive(Debug)]
pub struct Bench<'a> {
    /// What forms are columns over.
    pub with: Setting<'a>,
    /// With the walk as learnt.
    pub noise: &'a Noise,
    /// Light, and the swings of the lamp.
    pub base: Vec<Vec<f64>>,
    /// Without a walk.
    pub still: Stage,
    /// How far the record reaches in means over a period.
    pub reach_m: f64,
}

/// A filter, and through it the record and the base columns.
#[derive(Debug, Clone)]
pub struct Stage {
    /// Random walk of its noise.
    pub walk_m2_s: f64,
    /// The filter.
    pub filter: Filter,
    /// The base columns, whitened.
    pub base: Vec<Vec<f64>>,
    /// The record, whitened.
    pub y: Vec<f64>,
}

impl<'a> Bench<'a> {
    /// Of a record with its noise.
    pub fn of(with: Setting<'a>, noise: &'a Noise) -> Self {
        let base = lamp_columns(with.lamp, with.grid, &noise.swings);
        let still = stage(&base, with, noise, 0.0);
        let calm = with.smoothed(&with.grid.y_m);
        let mean = calm.iter().sum::<f64>() / calm.len() as f64;
        let reach_m =
            (calm.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / calm.len() as f64).sqrt().max(noise.white_m);
        Self { with, noise, base, still, reach_m }
    }

    /// White noise of a mean over a cell.
    pub fn cell_m(&self) -> f64 {
        let grid = self.with.grid;
        self.noise.white_m / (grid.count.iter().sum::<f64>() / grid.held().max(1) as f64).sqrt()
    }

    /// With another walk; what was made already where there is none.
    pub fn stage(&self, walk_m2_s: f64) -> Cow<'_, Stage> {
        if walk_m2_s == 0.0 {
            return Cow::Borrowed(&self.still);
        }
        Cow::Owned(stage(&self.base, self.with, self.noise, walk_m2_s))
    }

    /// The columns of some members, whitened.
    pub fn whitened(&self, stage: &Stage, members: &[Member]) -> Vec<Vec<f64>> {
        stage.filter.whiten_all(&columns_of(members, &self.with))
    }

    /// A candidate from a start of its shapes; a walk among its members is led to its likeliest size.
    pub fn fit(&self, members: Vec<Member>) -> Option<Fit> {
        if !members.iter().any(|m| m.form == Form::Walk) {
            return self.fit_on(&self.still, members);
        }
        let first = self.fit_on(&self.stage(self.noise.walk_m2_s), members)?;
        // the shapes hardly hang on the walk: its size is sought with them held
        let value = |ln_walk: f64| {
            let stage = self.stage(ln_walk.exp());
            State::of(self, &stage, first.members.clone())
                .map_or(f64::INFINITY, |s| s.chi2 + stage.filter.ln_determinant)
        };
        let (mut at, mut step) = (first.walk_m2_s.max(f64::MIN_POSITIVE).ln(), 1.6);
        let mut here = value(at);
        for _ in 0..6 {
            let tried = [at + step, at - step].map(|x| (value(x), x));
            match tried.into_iter().min_by(|a, b| a.0.total_cmp(&b.0)) {
                Some((lower, x)) if lower < here => (here, at) = (lower, x),
                _ => step *= 0.4,
            }
            if step < 0.2 {
                break;
            }
        }
        self.fit_on(&self.stage(at.exp()), first.members)
    }

    /// The same on a stage.
    pub fn fit_on(&self, stage: &Stage, members: Vec<Member>) -> Option<Fit> {
        let mut state = State::of(self, stage, members)?;
        for _ in 0..STEPS {
            if state.shapes().is_empty() {
                break;
            }
            let before = state.chi2;
            state = state.stepped(self, stage)?;
            if before - state.chi2 < CONVERGED {
                break;
            }
        }
        state.finished(self, stage)
    }
}

/// The columns of some members.
pub fn columns_of(members: &[Member], with: &Setting<'_>) -> Vec<Vec<f64>> {
    members.iter().flat_map(|member| member.form.columns(&member.shape, with)).collect()
}

fn stage(base: &[Vec<f64>], with: Setting<'_>, noise: &Noise, walk_m2_s: f64) -> Stage {
    let filter = Filter::of(&noise.with_walk(walk_m2_s), with.grid);
    let base = filter.whiten_all(base);
    Stage { walk_m2_s, base, y: filter.whiten(&with.grid.y_m), filter }
}

/// A point of a descent.
struct State {
    members: Vec<Member>,
    /// Of all members, raw.
    raw: Vec<Vec<Vec<f64>>>,
    white: Vec<Vec<f64>>,
    amplitude: Vec<f64>,
    chi2: f64,
    /// How far the swings that each member excites may reach.
    reach_m: Vec<f64>,
}

impl State {
    fn of(bench: &Bench<'_>, stage: &Stage, members: Vec<Member>) -> Option<Self> {
        let raw: Vec<Vec<Vec<f64>>> = members.iter().map(|m| m.form.columns(&m.shape, &bench.with)).collect();
        let white = stage.filter.whiten_all(&raw.iter().flatten().collect::<Vec<_>>());
        let reach_m = vec![bench.reach_m; members.len()];
        let mut state = Self { members, raw, white, amplitude: Vec::new(), chi2: 0.0, reach_m };
        let solution = solve(&columns(stage, &state.white, &[]), &stage.y, &state.known(bench))?;
        // once its size is known
        let mut place = bench.base.len();
        for (reach_m, raw) in state.reach_m.iter_mut().zip(&state.raw) {
            if !raw.is_empty() {
                let sd = solution.covariance[(place, place)].max(0.0).sqrt();
                *reach_m = SWING_OF_SIZE * solution.amplitude[place].abs().max(sd);
            }
            place += raw.len();
        }
        let solution = solve(&columns(stage, &state.white, &[]), &stage.y, &state.known(bench))?;
        (state.chi2, state.amplitude) = (solution.chi2, solution.amplitude);
        Some(state)
    }

    /// What is known of the amplitudes beforehand, as inverse variances: swings that an effect excites are of its size.
    fn known(&self, bench: &Bench<'_>) -> Vec<f64> {
        let of = |((member, raw), reach_m): ((&Member, &Vec<Vec<f64>>), &f64)| {
            let known = |k: usize| if member.form.is_size(k) { 0.0 } else { reach_m.powi(-2) };
            (0..raw.len()).map(known).collect::<Vec<_>>()
        };
        let members = self.members.iter().zip(&self.raw).zip(&self.reach_m).flat_map(of);
        std::iter::repeat_n(0.0, bench.base.len()).chain(members).collect()
    }

    /// (member, number of its shape) of every coordinate.
    fn shapes(&self) -> Vec<(usize, usize)> {
        let of = |(m, member): (usize, &Member)| (0..member.shape.len()).map(move |k| (m, k)).collect::<Vec<_>>();
        self.members.iter().enumerate().flat_map(of).collect()
    }

    /// Derivatives of the model with the coordinates, whitened, and what is known of each coordinate beforehand.
    fn slopes(&self, bench: &Bench<'_>, stage: &Stage) -> (Vec<Vec<f64>>, Vec<f64>) {
        let mut first = bench.base.len();
        let mut slopes = Vec::new();
        let mut known = Vec::new();
        for (member, raw) in self.members.iter().zip(&self.raw) {
            let shapes = member.form.shapes(&bench.with);
            for (k, shape) in shapes.iter().enumerate() {
                let mut step = if shape.key == "at_s" { 0.25 * bench.with.grid.step_s } else { 1e-3 * shape.width() };
                if member.shape[k] + step > shape.bounds[1] {
                    step = -step;
                }
                let mut moved = member.shape.clone();
                moved[k] += step;
                let mut slope = vec![0.0; bench.with.grid.len()];
                for (j, (there, here)) in member.form.columns(&moved, &bench.with).iter().zip(raw).enumerate() {
                    let amplitude = self.amplitude[first + j] / step;
                    slope.iter_mut().zip(there.iter().zip(here)).for_each(|(s, (t, h))| *s += amplitude * (t - h));
                }
                slopes.push(slope);
                known.push(12.0 / shape.width().powi(2));
            }
            first += raw.len();
        }
        (stage.filter.whiten_all(&slopes), known)
    }

    fn stepped(self, bench: &Bench<'_>, stage: &Stage) -> Option<Self> {
        let (slopes, known) = self.slopes(bench, stage);
        let all = columns(stage, &self.white, &slopes);
        let linear = all.len() - slopes.len();
        debug_assert_eq!(linear, self.amplitude.len());
        let known: Vec<f64> = self.known(bench).into_iter().chain(known).collect();
        let solution = solve(&all, &stage.y, &known)?;
        let mut share = 1.0;
        for _ in 0..5 {
            let mut members = self.members.clone();
            for ((m, k), shift) in self.shapes().iter().zip(&solution.amplitude[linear..]) {
                let shape = members[*m].form.shapes(&bench.with)[*k];
                let most = if shape.key == "at_s" { 1.0 } else { 0.25 * shape.width() };
                let moved = members[*m].shape[*k] + share * shift.clamp(-most, most);
                members[*m].shape[*k] = moved.clamp(shape.bounds[0], shape.bounds[1]);
            }
            let next = Self::of(bench, stage, members)?;
            if next.chi2 < self.chi2 {
                return Some(next);
            }
            share *= 0.3;
        }
        Some(self)
    }

    fn finished(self, bench: &Bench<'_>, stage: &Stage) -> Option<Fit> {
        let (slopes, known) = self.slopes(bench, stage);
        let all = columns(stage, &self.white, &slopes);
        let linear = all.len() - slopes.len();
        let own = self.known(bench);
        let known: Vec<f64> = own.iter().copied().chain(known).collect();
        let joint = solve(&all, &stage.y, &known)?;
        let plain = solve(&all[..linear], &stage.y, &own)?;
        let walks = self.members.iter().any(|m| m.form == Form::Walk);
        let mut fit = Fit {
            walk_m2_s: stage.walk_m2_s,
            amplitude: self.amplitude,
            covariance: joint.covariance,
            chi2: plain.chi2,
            ln_evidence: -0.5 * (plain.chi2 + stage.filter.ln_determinant + joint.ln_fisher),
            left: plain.left,
            members: self.members,
            heat_m2: 0.0,
        };
        fit.heat_m2 = heat_m2(&fit, bench);
        fit.ln_evidence += ln_prior(&fit, &self.reach_m, bench) - if walks { WALK_COST } else { 0.0 };
        Some(fit)
    }
}

/// exp(−t/τ) a time δ later is that by exp(δ/τ): an error of the edge, or of the part κ that the strip's inertia carries, changes the amplitude of warmth's
/// beginning and so the push.
fn heat_m2(fit: &Fit, bench: &Bench<'_>) -> f64 {
    let mut place = bench.base.len();
    let mut sum = 0.0;
    for member in &fit.members {
        if member.form == Form::Warmth {
            let tau_s = member.shape[0].exp();
            let inertia = HIGHER_MODES * (1.0 - bench.with.swings[0].carried(tau_s)).abs();
            sum += fit.amplitude[place].powi(2) * ((EDGE_S / tau_s).powi(2) + inertia.powi(2));
        }
        place += member.form.count(&bench.with);
    }
    sum
}

fn columns<'c>(stage: &'c Stage, white: &'c [Vec<f64>], slopes: &'c [Vec<f64>]) -> Vec<&'c [f64]> {
    stage.base.iter().chain(white).chain(slopes).map(Vec::as_slice).collect()
}

/// Prior densities at the fit, with the Gaussian integral's 2π: amplitudes as likely in each e-folding, shapes anywhere within their bounds.
fn ln_prior(fit: &Fit, reach_m: &[f64], bench: &Bench<'_>) -> f64 {
    let [push, _] = fit.push();
    let sd = |k: usize| fit.covariance[(k, k)].max(0.0).sqrt();
    let two_pi = 0.5 * std::f64::consts::TAU.ln();
    let mut place = bench.base.len();
    let mut sum = 0.0;
    for (member, reach_m) in fit.members.iter().zip(reach_m) {
        let count = member.form.count(&bench.with);
        if count > 0 {
            let size = fit.amplitude[place];
            for (k, amplitude) in fit.amplitude[place..place + count].iter().enumerate() {
                sum += match member.form.is_size(k) {
                    true => two_pi - (2.0 * EFOLDINGS * amplitude.abs().max(sd(place + k))).ln(),
                    // a Gaussian of this reach
                    false => -reach_m.ln() - 0.5 * (amplitude / reach_m).powi(2),
                };
            }
            // light that is missing is part of the push, and gas pushes where light does
            let against = if size * push < 0.0 { size.abs() } else { 0.0 };
            let beyond = (size.abs() - push.abs()).max(0.0);
            let wrong = match member.form {
                Form::Lag => against.max(beyond),
                Form::Pulse | Form::Train => against,
                _ => 0.0,
            };
            sum -= (0.5 * (wrong / sd(place).max(f64::MIN_POSITIVE)).powi(2)).min(IMPOSSIBLE);
        }
        sum += member.form.shapes(&bench.with).iter().map(|shape| two_pi - shape.width().ln()).sum::<f64>();
        place += count;
    }
    sum
}
