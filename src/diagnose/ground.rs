//! What every fit of one diagnosis shares, and the ways to make one: near another fit, anew, again.

use super::noise::BEYOND_NOISE;
use super::refit::Refit;
use super::{Cause, noise};
use crate::error::Result;
use crate::experiment::{Experiment, Hysteresis};
use crate::fit::descent::Descent;
use crate::fit::shooting::multiple_shooting;
use crate::fit::whitening::{Colour, RecordNoise};
use crate::fit::{Belief, Problem, Record, straight};
use crate::model::Parameter;
use crate::model::observe::chord_angles_rad;

/// A yield angle of the joint's hysteresis to start from, as a part of the largest bend, and how far from it that may be, as a part of itself.
const YIELD: (f64, f64) = (0.2, 2.5);
/// The same of a joint that has no spring: a bearing, whose friction is dry.
const DRY_YIELD: (f64, f64) = (1e-3, 0.5);
/// A fit from short stretches, or of a strip, goes on where its first steps lead below this multiple of the base model's χ².
pub(super) const BEYOND_HOPE: f64 = 10.0;
/// A dear hypothesis goes on where its first steps lead below this multiple of the base model's χ².
pub(super) const HOPEFUL: f64 = 1.2;
/// Rods between two marks while bending all along the strip is only a candidate.
const CANDIDATE_PIECES: usize = 3;
/// Noise that is learnt again from a better fit is at most this many times as large.
const GROWS: f64 = 1.5;
/// Losses imitate each other closely: only a weakly damped step goes along the valley between them.
const FIRST_DAMPING: f64 = 1e-8;
/// Steps of a dear hypothesis before it is known to be worth any, of a first descent, and of one that is worth it.
const FIRST_STEPS: usize = 4;
pub(super) const FEW_STEPS: usize = 12;
pub(super) const MOST_STEPS: usize = 30;

/// What every fit of one diagnosis shares.
#[derive(Debug, Clone)]
pub struct Ground<'a> {
    /// The recordings.
    pub records: &'a [Record],
    /// Specimen, rig and start values.
    pub experiment: &'a Experiment,
    /// The base model's parameters.
    pub base: Vec<Parameter>,
    /// What is known of them.
    pub beliefs: Vec<Belief>,
    /// Noise of each recording. While the fits are sought it has no errors in step with the swing: what a model lacks is in step as well, and no descent must
    /// be told not to mind it.
    pub noise: Vec<RecordNoise>,
    /// Of the integration.
    pub step_error_rad: f64,
    /// Where the base model's descent began: parameters and starts that short stretches led to. Empty where that is not known.
    pub begun: Vec<f64>,
    /// Rods between two marks of a strip that bends everywhere, which may then start in as many shapes as one that is the base model: it is dear, and worth it
    /// where such a strip is the answer ([`super::fine_strip`]). Few, and no further shapes, where it is only a candidate.
    pub fine_strip: Option<usize>,
}

/// The base model with some effects.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Hypothesis {
    /// The effects added.
    pub causes: Vec<Cause>,
    /// From which stamp on frames are missing, and in which recording.
    pub dropped: Option<(usize, f64)>,
}

impl Hypothesis {
    /// Whether its motion costs many times what others do.
    pub fn is_dear(&self) -> bool {
        self.causes.iter().any(|cause| matches!(cause, Cause::JointHysteretic | Cause::DistributedFlexibility))
    }

    /// With one effect more.
    #[must_use]
    pub fn and(&self, cause: Cause, dropped: Option<(usize, f64)>) -> Self {
        let mut causes = self.causes.clone();
        causes.push(cause);
        causes.sort_unstable();
        Self { causes, dropped: if cause == Cause::DroppedFrames { dropped } else { self.dropped } }
    }
}

impl<'a> Ground<'a> {
    /// The problem of a hypothesis.
    ///
    /// # Errors
    /// As [`Problem::new`].
    pub fn problem(&self, hypothesis: &Hypothesis) -> Result<Problem<'a>> {
        let mut free = self.base.clone();
        let mut beliefs = self.beliefs.clone();
        let mut experiment = self.experiment.clone();
        for cause in &hypothesis.causes {
            if *cause == Cause::DistributedFlexibility {
                free.retain(|p| *p != Parameter::JointStiffness);
                experiment.model.pieces = self.fine_strip.unwrap_or(CANDIDATE_PIECES);
                let lengths_m = experiment.specimen.lengths_m();
                let mark_m = lengths_m.iter().sum::<f64>() / lengths_m.len() as f64;
                experiment.model.effects.distributed_flexibility = Some(experiment.model.k_eq_n_m_per_rad * mark_m);
            }
            if *cause == Cause::JointHysteretic {
                let (yield_rad, sd) = self.yield_rad();
                beliefs.push(Belief { parameter: Parameter::HysteresisYield, value: yield_rad, sd });
                experiment.model.effects.joint_hysteretic = Some(Hysteresis { torque_n_m: 0.0, yield_rad });
            }
            free.extend(cause.parameters());
        }
        let mut problem = Problem::new(self.records, &experiment, &free)?;
        problem.noise.clone_from(&self.noise);
        problem.beliefs = beliefs;
        if hypothesis.causes.contains(&Cause::DistributedFlexibility) && self.fine_strip.is_none() {
            // no more is free at its start than in the rods it is compared with
            problem.further_shapes = 0;
        }
        problem.accuracy = problem.accuracy_of(problem.longest_s(), self.step_error_rad);
        if let Some((record, at_s)) = hypothesis.dropped {
            problem.dropped_at_s[record] = at_s;
        }
        Ok(problem)
    }

    /// Fits a hypothesis from the parameters of another fit; `start` gives values of further ones.
    pub fn refit(&self, hypothesis: &Hypothesis, near: &Refit<'_>, start: &[(Parameter, f64)]) -> Option<Refit<'a>> {
        self.refit_by(descent(FEW_STEPS), hypothesis, near, start)
    }

    /// The same, which ends after its first steps unless they lead below `bound`.
    pub fn refit_below(
        &self,
        bound: f64,
        hypothesis: &Hypothesis,
        near: &Refit<'_>,
        start: &[(Parameter, f64)],
    ) -> Option<Refit<'a>> {
        self.refit_by(descent_below(bound), hypothesis, near, start)
    }

    fn refit_by(
        &self,
        descent: Descent,
        hypothesis: &Hypothesis,
        near: &Refit<'_>,
        start: &[(Parameter, f64)],
    ) -> Option<Refit<'a>> {
        let (problem, x) = self.start(hypothesis, near, start)?;
        // a score is linear: where it overshoots, start from nothing
        let mut careful = x.clone();
        let given = hypothesis.causes.iter().flat_map(|cause| cause.parameters());
        let given = given.filter(|p| p.is_proportional() && start.iter().any(|(given, _)| given == *p));
        for place in given.filter_map(|p| problem.free.iter().position(|free| free == p)) {
            careful[place] = 0.0;
        }
        if careful == x {
            return self.descend_by(descent, hypothesis, problem, x);
        }
        // without what is given it is the fit nearby
        let is_near = near.is_part_of(hypothesis, &problem) && start.iter().all(|(p, _)| near.value(*p).is_none());
        let worst_start = if is_near { near.chi2 } else { problem.cost(&careful) };
        self.descend_by(Descent { worst_start, ..descent }, hypothesis, problem.clone(), x)
            .or_else(|| self.descend_by(descent, hypothesis, problem, careful))
    }

    /// The first steps of a refit.
    pub fn begin(&self, hypothesis: &Hypothesis, near: &Refit<'_>, start: &[(Parameter, f64)]) -> Option<Refit<'a>> {
        let (problem, x) = self.start(hypothesis, near, start)?;
        self.descend(hypothesis, problem, x, FIRST_STEPS)
    }

    /// Σr² where a refit would start.
    pub fn cost_at(&self, hypothesis: &Hypothesis, near: &Refit<'_>, start: &[(Parameter, f64)]) -> f64 {
        self.start(hypothesis, near, start).map_or(f64::INFINITY, |(problem, x)| problem.cost(&x))
    }

    /// The problem of a hypothesis, and its variables from another fit and some given values.
    fn start(
        &self,
        hypothesis: &Hypothesis,
        near: &Refit<'_>,
        start: &[(Parameter, f64)],
    ) -> Option<(Problem<'a>, Vec<f64>)> {
        let problem = self.problem(hypothesis).ok()?;
        let mut x = problem.start_values().ok()?;
        for (value, parameter) in x.iter_mut().zip(&problem.free) {
            let given = start.iter().find(|(p, _)| p == parameter).map(|(_, v)| *v);
            let inherited = near.value(*parameter);
            *value = given.or(inherited).unwrap_or(*value);
        }
        // a strip that bends everywhere begins as stiff as the joint it replaces
        let bending = problem.free.iter().position(|p| *p == Parameter::BendingStiffness);
        let begins = bending.filter(|_| near.value(Parameter::BendingStiffness).is_none());
        if let (Some(k), Some(place)) = (near.value(Parameter::JointStiffness), begins) {
            let lengths_m = self.experiment.specimen.lengths_m();
            x[place] = k * lengths_m.iter().sum::<f64>() / lengths_m.len() as f64;
        }
        let lower = problem.lower();
        x.iter_mut().zip(&lower).for_each(|(x, low)| *x = x.max(*low));
        x.extend(problem.starts_from(&near.problem, &near.x));
        Some((problem, x))
    }

    /// Fits a hypothesis from the start values of the experiment, by multiple shooting first: for a base model whose motion is out of step.
    /// It ends after its first steps unless they lead below a multiple of `known`, what is known to be left without.
    pub fn refit_anew(&self, hypothesis: &Hypothesis, start: &[(Parameter, f64)], known: f64) -> Option<Refit<'a>> {
        let mut problem = self.problem(hypothesis).ok()?;
        for (parameter, value) in start {
            set(&mut problem.experiment, *parameter, *value);
        }
        let accuracy = problem.accuracy;
        let x = multiple_shooting(&mut problem).ok()?.x;
        problem.noise.clone_from(&self.noise);
        problem.accuracy = accuracy;
        self.descend_by(descent_below(BEYOND_HOPE * known), hypothesis, problem, x)
    }

    /// The same hypothesis with the noise as it is known now.
    pub fn again(&self, fit: &Refit<'a>, steps: usize) -> Option<Refit<'a>> {
        let mut problem = fit.problem.clone();
        problem.noise.clone_from(&self.noise);
        self.descend(&fit.hypothesis, problem, fit.x.clone(), steps)
    }

    /// Takes the noise from what a fit leaves where the motion has no power, if that changes anything that counts, and says so: all fits that are to be
    /// compared must then be made anew.
    pub fn refine_noise(&mut self, by: &Refit<'_>) -> bool {
        let mut all = self.noise.clone();
        let mut changed = false;
        for (record, known) in all.iter_mut().enumerate() {
            let Ok(prediction) = by.problem.predict(record, &by.x, false) else { return false };
            let Some((model, swing, true_s)) = by.motion(record) else { return false };
            let data = &self.records[record];
            let ticks = noise::ticks(&data.t_s);
            // the motion's own lines, without what a jump of the stamps would make of them
            let last = data.len() - 1;
            let tick_s = (true_s[last] - true_s[0]) / ticks[last] as f64;
            let chords: Vec<Vec<f64>> = (0..=ticks[last])
                .map(|k| chord_angles_rad(model.chain(), &swing.at(true_s[0] + tick_s * k as f64).theta_rad))
                .collect();
            let mut angles = vec![(vec![0.0; chords.len()], Vec::new()); data.links()];
            for value in &prediction.values {
                let measured_rad = data.theta_rad[value.link][value.row].unwrap_or(value.predicted_rad);
                angles[value.link].0[ticks[value.row]] =
                    (measured_rad - value.predicted_rad) / data.relative_sd[value.link][value.row];
            }
            for (link, (left, motion)) in angles.iter_mut().enumerate() {
                motion.extend(chords.iter().map(|chord| chord[link]));
                let (known_rad, known_colour) = (&mut known.sd_rad[link], &mut known.colour[link]);
                let whole = noise::of_all(left);
                let noise = match noise::off_the_lines(left, motion) {
                    // a fit that has lost step leaves something at every frequency
                    Some(noise) if !by.hypothesis.causes.is_empty() && noise.sd > GROWS * *known_rad => continue,
                    Some(noise) => noise,
                    // a motion with power everywhere, as one with a jump has: what is left at most
                    None if whole.sd < *known_rad => whole,
                    None => continue,
                };
                // where far more is left its colour is no weight for the rows
                let colour = if whole.sd > BEYOND_NOISE * noise.sd { Colour::default() } else { noise.colour };
                changed |= (noise.sd / *known_rad - 1.0).abs() > 0.03 || colour.differs_from(*known_colour);
                (*known_rad, *known_colour) = (noise.sd, colour);
            }
            if let [first, second] = &angles[..] {
                let across = noise::across([first, second].map(|(left, motion)| (&left[..], &motion[..])));
                changed |= (across - known.across).abs() > 0.03;
                known.across = across;
            }
        }
        if changed {
            self.noise = all;
        }
        changed
    }

    /// Descends from given variables of a hypothesis.
    pub fn descend_from(&self, hypothesis: &Hypothesis, x: Vec<f64>, most_steps: usize) -> Option<Refit<'a>> {
        self.descend(hypothesis, self.problem(hypothesis).ok()?, x, most_steps)
    }

    /// The same with a problem at hand.
    pub fn descend(
        &self,
        hypothesis: &Hypothesis,
        problem: Problem<'a>,
        x: Vec<f64>,
        most_steps: usize,
    ) -> Option<Refit<'a>> {
        self.descend_by(descent(most_steps), hypothesis, problem, x)
    }

    fn descend_by(
        &self,
        descent: Descent,
        hypothesis: &Hypothesis,
        problem: Problem<'a>,
        x: Vec<f64>,
    ) -> Option<Refit<'a>> {
        let outcome = straight::descend(&problem, &descent, x)?;
        Some(Refit::of(hypothesis.clone(), problem, outcome))
    }

    /// The same with other recordings of it.
    #[must_use]
    pub fn on<'b>(&self, records: &'b [Record]) -> Ground<'b>
    where
        'a: 'b,
    {
        let place = |record: &Record| self.records.iter().position(|own| own.path == record.path).unwrap_or(0);
        Ground {
            records,
            experiment: self.experiment,
            base: self.base.clone(),
            beliefs: self.beliefs.clone(),
            noise: records.iter().map(|r| self.noise[place(r)].clone()).collect(),
            step_error_rad: self.step_error_rad,
            begun: if records.len() == self.records.len() { self.begun.clone() } else { Vec::new() },
            fine_strip: self.fine_strip,
        }
    }

    /// The same without errors in step with the swing: a prediction is held against what was seen, whoever erred.
    #[must_use]
    pub fn plain(&self) -> Self {
        let noise = self.noise.iter().map(|noise| RecordNoise { in_step: 0.0, ..noise.clone() }).collect();
        Self { noise, ..self.clone() }
    }

    /// A fit whose motions start as short stretches show them to, whatever it makes of them.
    pub fn seen_to_start<'b>(&self, fit: &Refit<'b>) -> Refit<'b> {
        let mut fit = fit.clone();
        let starts = fit.x.len() - fit.problem.free.len();
        if let Some(seen) = self.begun.len().checked_sub(starts) {
            fit.x.truncate(fit.problem.free.len());
            fit.x.extend_from_slice(&self.begun[seen..]);
        }
        fit
    }

    /// Largest measured difference of two neighbouring angles; of one link the largest angle.
    pub fn largest_bend_rad(&self) -> f64 {
        let of = |record: &Record| {
            let rows = 0..record.len();
            let bend = |row: usize| match &record.theta_rad[..] {
                [first, second, ..] => Some((second[row]? - first[row]?).abs()),
                [only] => only[row].map(f64::abs),
                [] => None,
            };
            rows.filter_map(bend).fold(0.0, f64::max)
        };
        self.records.iter().map(of).fold(1e-6, f64::max)
    }

    /// Whether the base model's joint has a spring.
    pub fn has_spring(&self) -> bool {
        self.base.iter().any(|parameter| parameter.is_spring())
    }

    /// What is believed of a hysteresis' yield angle, and its standard deviation.
    pub fn yield_rad(&self) -> (f64, f64) {
        let (share, scatter) = if self.has_spring() { YIELD } else { DRY_YIELD };
        let yield_rad = share * self.largest_bend_rad();
        (yield_rad, scatter * yield_rad)
    }

    /// Whether the base model bends all along the strip.
    pub fn is_strip(&self) -> bool {
        self.base.contains(&Parameter::BendingStiffness)
    }

    /// Number of values.
    pub fn values(&self) -> usize {
        self.records.iter().map(|r| r.values(0..r.len())).sum()
    }
}

fn descent(most_steps: usize) -> Descent {
    Descent { most_steps, enough: 0.02, damping: FIRST_DAMPING, ..Descent::default() }
}

/// One that ends after its first steps unless they lead below a bound.
fn descent_below(bound: f64) -> Descent {
    Descent { judged: Some((FIRST_STEPS, bound)), ..descent(FEW_STEPS) }
}

/// Sets a start value where the experiment holds it.
fn set(experiment: &mut Experiment, parameter: Parameter, value: f64) {
    let model = &mut experiment.model;
    match parameter {
        Parameter::JointStiffness => model.k_eq_n_m_per_rad = value,
        Parameter::JointDamping => model.c_eq_n_m_s_per_rad = value,
        Parameter::HysteresisYield => {
            if let Some(law) = &mut model.effects.joint_hysteretic {
                law.yield_rad = value;
            }
        }
        Parameter::SupportFrequency => {
            if let Some(law) = &mut model.effects.support_motion {
                law.frequency_hz = value;
            }
        }
        _ => {}
    }
}
