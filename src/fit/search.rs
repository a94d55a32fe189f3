//! Several beginnings, the best end.

use super::descent::{Descent, Outcome};
use super::problem::switch_on;
use super::record::refuse_empty;
use super::shooting::{self, STATE_WINDOW_RAD, ShootingResult};
use super::{Problem, Record, start_values, transformed};
use crate::error::{Error, Result};
use crate::experiment::{Experiment, Hysteresis, SupportMotion};
use crate::model::{Parameter, Work};
use crate::progress::Progress;
use crate::series::FEWEST_ROWS;

/// Mean χ² that a descent may leave in the whole and in so many values in a row, before another beginning is tried. The noise is known to a tenth; of 40 values
/// the mean scatters by 0.22. Outliers count no more than their bound (statistics).
const LEFT: f64 = 1.4;
const LEFT_ANYWHERE: f64 = 2.5;
const IN_A_ROW: usize = 40;
const BOUND: f64 = 4.0;
/// A descent that leaves more than this, over the variance of the noise, is tried from the values as they are, too (judgement: five times the noise).
const POOR_FIT: f64 = 25.0;
/// Beginnings of a hysteresis: its yield angle as part of the bend that every joint reaches, its share of the spring (start values); and the part of the recordings that chooses
/// (cost).
const YIELDS: [f64; 3] = [0.05, 0.2, 0.6];
const SPRINGS: [f64; 2] = [0.4, 0.9];
const BEGINNING: f64 = 0.15;
/// Parts of the rows that are followed one after the other, before all of them (numerics: each at most twice the one before).
pub const PARTS: [f64; 4] = [0.1, 0.2, 0.35, 0.6];
/// Frequencies of what is left are looked at this finely for the length of the recording, up to this one; and so many of the strongest are begun with (cost).
const FINENESS: f64 = 2.0;
const HIGHEST_HZ: f64 = 20.0;
const PEAKS: usize = 4;
/// Frequencies of a stand over the swing's, with which it is begun (start values).
const STANDS: [f64; 5] = [1.5, 3.0, 5.0, 9.0, 16.0];
/// Another end is better where it leaves less by this part (judgement).
const BETTER: f64 = 1e-3;
/// Beginnings, each of which is a stage.
pub const STAGES: u64 = start_values::MOST + 1;

/// What all beginnings share.
#[derive(Clone, Copy)]
struct Search<'a, 's> {
    records: &'a [Record],
    free: &'s [Parameter],
    noise_rad: &'s [Vec<f64>],
    /// What all of them have cost.
    work: &'s Work,
    /// What they may.
    most_work: u64,
}

/// Where a descent ended.
#[derive(Debug, Clone)]
pub struct End<'a> {
    /// What was fitted.
    pub problem: Problem<'a>,
    /// With which result.
    pub outcome: Outcome,
    /// Where it began: where short stretches led to.
    pub shot: ShootingResult,
    /// The experiment with the values from which those began.
    pub begun: Experiment,
    /// Whether the descent from those values ended there, too.
    agreed: bool,
    /// What it has cost.
    cost: u64,
}

/// The best of the descents from the file's values, from those of the recordings' modes where these leave more than noise, and from those of a hysteresis. No descent is begun
/// that would lead beyond so much work.
///
/// # Errors
/// [`Error::Simulation`] where the specimen cannot swing, or no motion near any beginning follows the recordings.
pub fn best_robust_fit<'a>(
    records: &'a [Record],
    experiment: &Experiment,
    free: &[Parameter],
    (noise_rad, most_work): (&[Vec<f64>], u64),
    progress: &dyn Progress,
) -> Result<End<'a>> {
    refuse_empty(records)?;
    let work = Work::default();
    let search = Search { records, free, noise_rad, work: &work, most_work };
    let order = start_values::start_experiments(records, experiment, free);
    let (mut best, mut failed): (Option<End<'a>>, Option<Error>) = (None, None);
    for begun in &order {
        if search.may_find_more(best.as_ref()) {
            match search.from(begun) {
                Ok(end) => best = better(best, end),
                Err(error) => failed = failed.or(Some(error)),
            }
        }
        progress.advance(1);
    }
    progress.advance(start_values::MOST.saturating_sub(order.len() as u64));
    if free.contains(&Parameter::HysteresisTorque) && search.may_find_more(best.as_ref()) {
        let yielding = search.with_hysteresis(order.last().unwrap_or(experiment), best.as_ref())?;
        best = better(best, yielding.map_or(Ok(None), |begun| search.from(&begun))?);
    }
    if free.contains(&Parameter::SupportFrequency) && search.may_find_more(best.as_ref()) {
        for end in search.with_support(experiment)? {
            best = better(best, Some(end));
        }
    }
    if free.contains(&Parameter::SupportCompliance) && search.may_find_more(best.as_ref()) {
        for end in search.with_stand(experiment)? {
            best = better(best, Some(end));
        }
    }
    if search.may_find_more(best.as_ref()) {
        let continued = best.as_ref().and_then(|end| search.continued(end));
        best = better(best, continued);
    }
    progress.advance(1);
    best.ok_or_else(|| failed.unwrap_or_else(refused))
}

/// The end that leaves less; the first where there is next to no difference.
fn better<'a>(first: Option<End<'a>>, other: Option<End<'a>>) -> Option<End<'a>> {
    match (first, other) {
        (Some(first), Some(other)) if other.outcome.cost < (1.0 - BETTER) * first.outcome.cost => Some(other),
        (Some(first), _) => Some(first),
        (None, other) => other,
    }
}

/// What to say where nothing can be descended from.
pub fn refused() -> Error {
    Error::Simulation {
        detail: "no motion near the start values follows the recording; check [specimen] and [model]".into(),
    }
}

/// Descends in the variables that suit the problem; the blocks at the end are those of its own.
pub fn descend(problem: &Problem<'_>, descent: &Descent, x: Vec<f64>) -> Option<Outcome> {
    let outcome = transformed::descend(problem, descent, x)?;
    let blocks = problem.blocks(&outcome.x)?;
    Some(Outcome { blocks, ..outcome })
}

impl<'a> Search<'a, '_> {
    fn from(&self, experiment: &Experiment) -> Result<Option<End<'a>>> {
        let before = self.work.done();
        let mut problem = self.problem(experiment)?;
        // without parameters nothing but the starts is sought, which the recording shows
        let shot = if self.free.is_empty() {
            ShootingResult { x: observed_starts(&problem)?, noise: problem.noise.clone(), residuals: Vec::new() }
        } else {
            shooting::multiple_shooting(&mut problem)?
        };
        for (noise, sd_rad) in problem.noise.iter_mut().zip(self.noise_rad) {
            noise.sd_rad.clone_from(sd_rad);
        }
        problem.integrate_below_the_noise();
        let within = problem.accuracy_of(problem.longest_s(), problem.accuracy.step_error_rad);
        problem.accuracy = within;
        let robust = Descent::robust(30, 0.03);
        // stretches that a model cannot follow may lead astray from values that were near
        let stated = [problem.start_values()?, shot.x[self.free.len()..].to_vec()].concat();
        let from_stretches = descend(&problem, &robust, shot.x.clone());
        let is_astray = |end: &Outcome| {
            // a stop has a false minimum at every turn: no end is worse than where it could have begun
            end.cost > POOR_FIT * end.residuals() as f64 || problem.cost(&stated) < end.cost
        };
        let may_again = !self.free.is_empty() && self.allows(self.work.done() - before);
        let again = may_again && from_stretches.as_ref().is_none_or(is_astray);
        let from_stated = if again { descend(&problem, &robust, stated) } else { None };
        let ends: Vec<Outcome> = [from_stretches, from_stated].into_iter().flatten().collect();
        let agreed = matches!(&ends[..], [one, other] if (one.cost - other.cost).abs() < BETTER * one.cost);
        let best = ends.into_iter().min_by(|a, b| a.cost.total_cmp(&b.cost));
        Ok(best.map(|outcome| {
            let (problem, outcome) = transformed::update_strip_modes(problem, &robust, outcome);
            let cost = self.work.done() - before;
            End { problem, outcome, shot, begun: experiment.clone(), agreed, cost }
        }))
    }

    fn problem(&self, experiment: &Experiment) -> Result<Problem<'a>> {
        Ok(Problem { work: self.work.clone(), ..Problem::new(self.records, experiment, self.free)? })
    }

    /// Whether as much work again as something has cost is allowed.
    fn allows(&self, cost: u64) -> bool {
        self.work.done().saturating_add(cost) <= self.most_work
    }

    /// Whether another beginning may lead further, and may be tried: more is left than noise, and not because the model has no lower minimum, where two descents have met.
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
        end.is_none_or(|end| !end.agreed && self.allows(end.cost) && of_recordings(&end.outcome))
    }

    /// The experiment with a hysteresis in place of a part of its spring: of several the one that follows the beginning of the recordings best.
    fn with_hysteresis(&self, experiment: &Experiment, best: Option<&End<'_>>) -> Result<Option<Experiment>> {
        let Some(End { problem, outcome: end, .. }) = best else { return Ok(None) };
        let beginning: Vec<Record> =
            self.records.iter().map(|record| record.until((BEGINNING * record.len() as f64) as usize)).collect();
        if beginning.iter().any(|record| record.values(0..record.len()) < 4 * end.x.len()) {
            return Ok(None);
        }
        let common_rad = self.records.iter().map(Record::common_bend_rad).fold(0.0, f64::max);
        let mut found: Option<(f64, Experiment)> = None;
        for (share_of_bend, share_of_spring) in YIELDS.iter().flat_map(|y| SPRINGS.iter().map(move |s| (y, s))) {
            let mut tried = experiment.clone();
            let (model, yield_rad) = (&mut tried.model, share_of_bend * common_rad);
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

impl<'a> Search<'a, '_> {
    /// Horizon continuation: the best end's own problem on the first part of the recordings, from there on the next, and so to the whole. The sum of squares of a
    /// long recording has many false minima, that of its beginning few.
    fn continued(&self, end: &End<'a>) -> Option<End<'a>> {
        let free = self.free.len();
        let mut x = [&end.outcome.x[..free], &end.shot.x[free..]].concat();
        for part in PARTS {
            let rows = |record: &Record| ((part * record.len() as f64) as usize).max(FEWEST_ROWS).min(record.len());
            let early: Vec<Record> = self.records.iter().map(|record| record.until(rows(record))).collect();
            let problem = Problem { records: &early, ..end.problem.clone() };
            let robust = Descent::robust(20, 0.1);
            x = transformed::descend(&problem, &robust, x)?.x;
        }
        let robust = Descent::robust(30, 0.03);
        let outcome = descend(&end.problem, &robust, x)?;
        Some(End { outcome, ..end.clone() })
    }

    /// A support that moves, begun at the frequencies at which the fit without it leaves most: no derivative leads from one frequency to another.
    fn with_support(&self, experiment: &Experiment) -> Result<Vec<End<'a>>> {
        let of_support = |p: &Parameter| {
            matches!(p, Parameter::SupportSine | Parameter::SupportCosine | Parameter::SupportFrequency)
        };
        let mut still = experiment.clone();
        still.model.effects.support_motion = None;
        let begun = |end: &End<'a>| {
            let of = |frequency_hz| SupportMotion { amplitude_m: 0.0, frequency_hz, phase_rad: 0.0 };
            let with = |hz: f64| {
                let mut tried = end.begun.clone();
                tried.model.effects.support_motion = Some(of(hz));
                tried
            };
            Ok(strongest_hz(end).into_iter().map(with).collect())
        };
        self.beside(&still, of_support, begun)
    }

    /// A stand that yields, begun rigid and with several frequencies of its own, none of which a derivative tells of a rigid one.
    fn with_stand(&self, experiment: &Experiment) -> Result<Vec<End<'a>>> {
        let of_stand = |p: &Parameter| {
            matches!(p, Parameter::SupportCompliance | Parameter::SupportOwnFrequency | Parameter::SupportDampingRatio)
        };
        let mut rigid = experiment.clone();
        rigid.model.effects.support_flexibility = None;
        let begun = |end: &End<'a>| {
            let swing_hz = end.problem.model(0, &[])?.0.characteristic_rad_s() / std::f64::consts::TAU;
            let with = |times: f64| {
                let mut tried = end.begun.clone();
                switch_on(&mut tried, Parameter::SupportCompliance);
                let stand = tried.model.effects.support_flexibility.iter_mut();
                stand.for_each(|stand| stand.frequency_hz = times * swing_hz);
                tried
            };
            Ok(STANDS.into_iter().map(with).collect())
        };
        self.beside(&rigid, of_stand, begun)
    }

    /// A law beside the fit without it, begun with the values of each of several experiments.
    fn beside(
        &self,
        without_it: &Experiment,
        of_law: impl Fn(&Parameter) -> bool,
        begun: impl Fn(&End<'a>) -> Result<Vec<Experiment>>,
    ) -> Result<Vec<End<'a>>> {
        let free: Vec<Parameter> = self.free.iter().copied().filter(|p| !of_law(p)).collect();
        let without = Search { free: &free, ..*self };
        let Some(end) = without.from(without_it)? else { return Ok(Vec::new()) };
        let mut ends = Vec::new();
        for tried in begun(&end)? {
            let mut problem = self.problem(&tried)?;
            problem.noise.clone_from(&end.problem.noise);
            problem.accuracy = end.problem.accuracy;
            let mut x = problem.start_values()?;
            for (value, parameter) in x.iter_mut().zip(self.free).filter(|(_, p)| !of_law(p)) {
                *value = free.iter().position(|p| p == parameter).map_or(*value, |place| end.outcome.x[place]);
            }
            x.extend(problem.starts_from(&end.problem, &end.outcome.x));
            let robust = Descent { damping: 1e-8, ..Descent::robust(30, 0.03) };
            let outcome = descend(&problem, &robust, x.clone());
            let shot = ShootingResult { x, ..end.shot.clone() };
            ends.extend(outcome.map(|outcome| End { problem, outcome, shot, begun: tried, agreed: false, cost: 0 }));
        }
        Ok(ends)
    }
}

/// The frequencies at which what is left of the first angle of the longest recording is strongest.
fn strongest_hz(end: &End<'_>) -> Vec<f64> {
    let records = end.problem.records;
    let Some(longest) = (0..records.len()).max_by_key(|record| records[*record].len()) else { return Vec::new() };
    let record = &records[longest];
    let rows = (0..record.len()).filter(|row| record.theta_rad[0][*row].is_some());
    let left: Vec<(f64, f64)> =
        rows.map(|row| record.t_s[row]).zip(end.outcome.blocks[longest].residual.iter().copied()).collect();
    let span_s = record.t_s[record.len() - 1] - record.t_s[0];
    let nyquist_hz = 0.5 * record.len() as f64 / span_s;
    let count = (FINENESS * span_s * HIGHEST_HZ.min(nyquist_hz)) as usize;
    let power = |k: usize| {
        let rate = std::f64::consts::TAU * k as f64 / (FINENESS * span_s);
        let sum = left.iter().fold([0.0; 2], |sum, (t_s, r)| {
            let (sin, cos) = (rate * t_s).sin_cos();
            [sum[0] + r * sin, sum[1] + r * cos]
        });
        sum[0] * sum[0] + sum[1] * sum[1]
    };
    let powers: Vec<f64> = (0..count).map(power).collect();
    let is_peak = |k: &usize| powers[*k] > powers[k - 1] && powers[*k] >= powers[k + 1];
    let mut peaks: Vec<usize> = (1..count.max(2) - 1).filter(is_peak).collect();
    peaks.sort_by(|a, b| powers[*b].total_cmp(&powers[*a]));
    peaks.into_iter().take(PEAKS).map(|k| k as f64 / (FINENESS * span_s)).collect()
}

/// Each recording's start as its first values show it.
///
/// # Errors
/// [`Error::Simulation`] where the specimen cannot swing.
pub fn observed_starts(problem: &Problem<'_>) -> Result<Vec<f64>> {
    let reach_s = STATE_WINDOW_RAD / problem.model(0, &[])?.0.characteristic_rad_s();
    let further = vec![0.0; problem.further()];
    let of = |record: &Record| {
        let near = record.state_near(0, reach_s);
        let column = |i: usize| near.iter().map(move |n| n[i]).collect::<Vec<_>>();
        [column(0), further.clone(), column(1), further.clone()].concat()
    };
    Ok(problem.records.iter().flat_map(of).collect())
}
