//! Several beginnings, the best end.

use super::descent::{Descent, Outcome};
use super::{Problem, Record, Seen, begin, shooting, straight};
use crate::error::{Error, Result};
use crate::experiment::{Experiment, Hysteresis};
use crate::model::Parameter;
use crate::progress::Progress;

/// Mean χ² that a descent may leave in the whole and in so many values in a row, before another beginning is tried. The noise is known to a tenth; of 40 values
/// the mean scatters by 0.22. Outliers count no more than their bound.
const LEFT: f64 = 1.4;
const LEFT_ANYWHERE: f64 = 2.5;
const IN_A_ROW: usize = 40;
const BOUND: f64 = 4.0;
/// A descent that leaves more than this, over the variance of the noise, is tried from the values as they are, too.
const ASTRAY: f64 = 25.0;
/// A spring that differs from the seen one by more than this factor is not where to begin.
const FAR_OFF: f64 = 1.5;
/// Beginnings of a hysteresis: its yield angle as part of the largest bend, its share of the spring; and the part of the recordings that chooses.
const YIELDS: [f64; 3] = [0.05, 0.2, 0.6];
const SPRINGS: [f64; 2] = [0.4, 0.9];
const BEGINNING: f64 = 0.15;
/// A start is read off values this near, in radians of the model's pace: wide enough to even out the noise, short enough for a cubic to follow the second mode.
const STATE_NEAR: f64 = 0.35;
/// Beginnings, each of which is a stage.
pub const STAGES: u64 = ORDERLY + 1;
const ORDERLY: u64 = 3;

/// What all beginnings share.
struct Search<'a, 's> {
    records: &'a [Record],
    free: &'s [Parameter],
    noise_rad: &'s [Vec<f64>],
}

/// Beginnings that the recordings' modes say, and whether the second mode is among them: without it they come after the file's values, for they are vague, and a
/// stiff joint with little damping ends on a line in the noise.
struct Modes {
    begun: Vec<Experiment>,
    rings: bool,
}

/// Where a descent ended, and of what.
type End<'a> = (Problem<'a>, Outcome);

/// The best of the descents from the file's values, from those of the recordings' modes where these leave more than noise, and from those of a hysteresis. Where
/// the file's spring is far from the seen one, the order is turned.
pub fn best_end<'a>(
    records: &'a [Record],
    experiment: &Experiment,
    free: &[Parameter],
    noise_rad: &[Vec<f64>],
    progress: &dyn Progress,
) -> Result<End<'a>> {
    let search = Search { records, free, noise_rad };
    let Modes { begun, rings } = search.modes(experiment);
    let mut order = vec![experiment];
    order.extend(&begun);
    let springs = order.iter().map(|begun| begin::spring_of(begun, free)).collect::<Option<Vec<_>>>();
    if springs.is_some_and(|springs| springs[1..].iter().all(|spring| is_far_off(*spring, springs[0]))) && rings {
        order.rotate_left(1);
    }
    let mut best: Option<End<'a>> = None;
    for begun in order {
        if search.may_find_more(best.as_ref()) {
            best = better(best, search.from(begun)?);
        }
        progress.advance(1);
    }
    progress.advance(ORDERLY.saturating_sub(1 + begun.len() as u64));
    if free.contains(&Parameter::HysteresisTorque) && search.may_find_more(best.as_ref()) {
        let yielding = search.with_hysteresis(begun.first().unwrap_or(experiment), best.as_ref())?;
        best = better(best, yielding.map_or(Ok(None), |begun| search.from(&begun))?);
    }
    progress.advance(1);
    best.ok_or_else(refused)
}

/// Whether the file's spring is far from the seen one.
fn is_far_off(seen: f64, stated: f64) -> bool {
    (seen / stated.max(f64::MIN_POSITIVE)).ln().abs() > FAR_OFF.ln()
}

fn better<'a>(a: Option<End<'a>>, b: Option<End<'a>>) -> Option<End<'a>> {
    a.into_iter().chain(b).min_by(|a, b| a.1.cost.total_cmp(&b.1.cost))
}

/// What to say where nothing can be descended from.
pub fn refused() -> Error {
    Error::Simulation {
        detail: "no motion near the start values follows the recording; check [specimen] and [model]".into(),
    }
}

/// Descends in the variables that suit the problem; the blocks at the end are those of its own.
pub fn descend(problem: &Problem<'_>, descent: &Descent, x: Vec<f64>) -> Option<Outcome> {
    let outcome = straight::descend(problem, descent, x)?;
    let blocks = problem.blocks(&outcome.x)?;
    Some(Outcome { blocks, ..outcome })
}

impl<'a> Search<'a, '_> {
    fn from(&self, experiment: &Experiment) -> Result<Option<End<'a>>> {
        let mut problem = Problem::new(self.records, experiment, self.free)?;
        // without parameters nothing but the starts is sought, which the recording shows
        let shot =
            if self.free.is_empty() { seen_starts(&problem)? } else { shooting::multiple_shooting(&mut problem)?.x };
        for (noise, sd_rad) in problem.noise.iter_mut().zip(self.noise_rad) {
            noise.sd_rad.clone_from(sd_rad);
        }
        problem.integrate_below_the_noise();
        let within = problem.accuracy_of(problem.longest_s(), problem.accuracy.step_error_rad);
        problem.accuracy = within;
        let robust = Descent { huber: 4.0, most_steps: 30, enough: 0.03, ..Descent::default() };
        // stretches that a model cannot follow may lead astray from values that were near
        let stated = [problem.start_values()?, shot[self.free.len()..].to_vec()].concat();
        let from_stretches = descend(&problem, &robust, shot);
        let astray = from_stretches.as_ref().is_none_or(|end| end.cost > ASTRAY * end.residuals() as f64);
        let from_stated = if astray && !self.free.is_empty() { descend(&problem, &robust, stated) } else { None };
        let ends = [from_stretches, from_stated].into_iter().flatten();
        Ok(ends.min_by(|a, b| a.cost.total_cmp(&b.cost)).map(|end| (problem, end)))
    }

    /// Whether another beginning may lead further: more is left than noise.
    fn may_find_more(&self, end: Option<&End<'_>>) -> bool {
        let square = |r: &f64| r.abs().min(BOUND).powi(2);
        let mean = |values: &[f64]| values.iter().map(square).sum::<f64>() / values.len().max(1) as f64;
        let of_recordings = |end: &Outcome| {
            let blocks = &end.blocks[..self.records.len().min(end.blocks.len())];
            blocks.iter().any(|block| {
                let values = block.residual.as_slice();
                mean(values) > LEFT || values.chunks_exact(IN_A_ROW).any(|few| mean(few) > LEFT_ANYWHERE)
            })
        };
        end.is_none_or(|(_, end)| of_recordings(end))
    }

    /// The experiment as the modes of the longest recording have it, where a spring or a damper is free.
    fn modes(&self, experiment: &Experiment) -> Modes {
        let begun_with = |p: &Parameter| {
            p.is_spring() || matches!(p, Parameter::JointDamping | Parameter::HingeViscous | Parameter::AirLinear)
        };
        let longest = self.records.iter().max_by_key(|record| record.len());
        match longest.filter(|_| self.free.iter().any(begun_with)).and_then(Seen::of) {
            Some(seen) => Modes { begun: begin::from_modes(experiment, self.free, &seen), rings: seen.fast.is_some() },
            None => Modes { begun: Vec::new(), rings: false },
        }
    }

    /// The experiment with a hysteresis in place of a part of its spring: of several the one that follows the beginning of the recordings best.
    fn with_hysteresis(&self, experiment: &Experiment, best: Option<&End<'_>>) -> Result<Option<Experiment>> {
        let Some((problem, end)) = best else { return Ok(None) };
        let beginning: Vec<Record> =
            self.records.iter().map(|record| record.until((BEGINNING * record.len() as f64) as usize)).collect();
        if beginning.iter().any(|record| record.values(0..record.len()) < 4 * end.x.len()) {
            return Ok(None);
        }
        let largest_rad = self.records.iter().map(largest_bend_rad).fold(0.0, f64::max);
        let mut found: Option<(f64, Experiment)> = None;
        for (share_of_bend, share_of_spring) in YIELDS.iter().flat_map(|y| SPRINGS.iter().map(move |s| (y, s))) {
            let mut tried = experiment.clone();
            let (model, yield_rad) = (&mut tried.model, share_of_bend * largest_rad);
            let torque_n_m = share_of_spring * model.k_eq_n_m_per_rad * yield_rad;
            model.effects.joint_hysteretic = Some(Hysteresis { torque_n_m, yield_rad });
            model.k_eq_n_m_per_rad *= 1.0 - share_of_spring;
            model.c_eq_n_m_s_per_rad *= 1.0 - share_of_spring;
            let mut of_beginning = Problem::new(&beginning, &tried, self.free)?;
            of_beginning.noise.clone_from(&problem.noise);
            of_beginning.accuracy = of_beginning.accuracy_of(of_beginning.longest_s(), 1e-5);
            let x = [of_beginning.start_values()?, end.x[self.free.len()..].to_vec()].concat();
            let cost = of_beginning.cost(&x);
            if found.as_ref().is_none_or(|(least, _)| cost < *least) {
                found = Some((cost, tried));
            }
        }
        Ok(found.map(|(_, begun)| begun))
    }
}

/// Each recording's start as its first values show it.
fn seen_starts(problem: &Problem<'_>) -> Result<Vec<f64>> {
    let reach_s = STATE_NEAR / problem.model(0, &[])?.0.pace_rad_s();
    let further = vec![0.0; problem.further_shapes];
    let of = |record: &Record| {
        let near = record.state_near(0, reach_s);
        let column = |i: usize| near.iter().map(move |n| n[i]).collect::<Vec<_>>();
        [column(0), further.clone(), column(1), further.clone()].concat()
    };
    Ok(problem.records.iter().flat_map(of).collect())
}

/// Largest measured difference of two neighbouring angles.
fn largest_bend_rad(record: &Record) -> f64 {
    let of = |pair: &[Vec<Option<f64>>]| {
        let bends = pair[0].iter().zip(&pair[1]).filter_map(|(upper, lower)| Some(((*lower)? - (*upper)?).abs()));
        bends.fold(0.0, f64::max)
    };
    record.theta_rad.windows(2).map(of).fold(1e-6, f64::max)
}
