//! Missing frames: at which instant, and how many.
//!
//! No derivative leads from one instant to another, and a jump of several frames is no small thing. So the fitted motion is looked at twice, with the jump
//! before everything (b) and after everything (a), and the instant is the row k that makes
//!
//! ```text
//! Σ_{row < k} (measured − a)²/σ² + Σ_{row ≥ k} (measured − b)²/σ²
//! ```
//!
//! least. That costs two motions for any number of instants, and one more for any other number of frames.

use nalgebra::DMatrix;

use super::super::context::FitContext;
use super::super::effect::Effect;
use super::super::hypothesis::Hypothesis;
use super::super::refit::Refit;
use super::super::screen::{Score, Screen};
use super::super::settings::{PriorSettings, Settings};
use super::{Coefficients, FitRequest, Law};
use crate::fit::whitening::Whitening;
use crate::fit::{Problem, Record};
use crate::model::Parameter;
use crate::statistics::median_step_s;

/// Frames that may be missing at once (judgement).
const MOST_FRAMES: usize = 5;
/// Instants are looked for anew this many times (cost).
const ROUNDS: usize = 4;
/// A jump is of whole frames if it is by so many standard deviations (statistics: 3 σ), or by this part of a frame (judgement).
const WHOLE_SD: f64 = 3.0;
const WHOLE: f64 = 0.05;
/// Values on each side of an instant without which nothing is said about it (judgement).
const FEWEST: usize = 8;
/// Of the square of what a jump does less than this part is left by the projection: nothing can be said about it (numerics).
const NOTHING_LEFT: f64 = 1e-4;

/// The law.
pub struct MissingFrames;

impl Law for MissingFrames {
    fn beside<'a>(&self, sought: &FitRequest<'_, 'a>) -> Option<Refit<'a>> {
        let FitRequest { context, base, score, .. } = *sought;
        let scored = score.and_then(|s| context.refit(&s.hypothesis(&base.hypothesis), base, &s.start));
        context.best_of([alone(context, base), scored.map(|fit| settled(context, fit))])
    }

    fn scan(&self, screen: &Screen<'_, '_>) -> Option<Score> {
        scanned(screen)
    }

    fn settled<'a>(&self, context: &FitContext<'a>, fit: Refit<'a>) -> Refit<'a> {
        settled(context, fit)
    }

    /// Any instant.
    fn ln_multiplicity(
        &self,
        fit: &Refit<'_>,
        _effect: Effect,
        _of: &Coefficients<'_>,
        _settings: &PriorSettings,
    ) -> f64 {
        let rows: usize = fit.problem.records.iter().map(Record::len).sum();
        (rows as f64).ln()
    }

    /// Frames are missing whole. A jump of the clock by another part of them can be meant, or stand for a knock, or for a part that fell off.
    fn odds(&self, fit: &Refit<'_>, _others: &[&Refit<'_>], settings: &Settings) -> f64 {
        if misses_part_of_a_frame(fit) { settings.prior.part_of_a_frame } else { 1.0 }
    }
}

/// A place to jump at.
#[derive(Debug, Clone, Copy)]
struct Jump {
    record: usize,
    at_s: f64,
    /// Missing time.
    missing_s: f64,
    /// Σ of the squares with it.
    left: f64,
}

/// Missing frames alone, from the base model's fit and from where its descent started: short stretches have no jump, and there the first of them still
/// follows the recording up to it.
fn alone<'a>(context: &FitContext<'a>, null: &Refit<'a>) -> Option<Refit<'a>> {
    let begun = Refit { x: context.begun.clone(), ..null.clone() };
    let starts = [null, &begun];
    let jumps = starts.into_iter().filter(|start| start.x.len() == null.x.len()).filter_map(|start| {
        let jump = likeliest(context, start)?;
        Some((start, jump))
    });
    let fits = jumps.filter_map(|(start, jump)| {
        let hypothesis = null.hypothesis.and(Effect::DroppedFrames, Some((jump.record, jump.at_s)));
        let fit = context.refit(&hypothesis, start, &[(Parameter::DroppedFrames, jump.missing_s)])?;
        Some(settled(context, fit))
    });
    fits.min_by(|a, b| a.chi2.total_cmp(&b.chi2))
}

/// The likeliest jump of whole frames for parameters and starts of a fit.
fn likeliest(context: &FitContext<'_>, fit: &Refit<'_>) -> Option<Jump> {
    let mut jumps = Vec::new();
    for record in 0..context.records.len() {
        let hypothesis = fit.hypothesis.and(Effect::DroppedFrames, Some((record, 0.0)));
        let problem = context.problem_near(&hypothesis, fit).ok()?;
        let step_s = median_step_s(&context.records[record].t_s)?;
        let before = squares(&fit.problem, record, &fit.x)?;
        for frames in 1..=MOST_FRAMES {
            for missing_s in [frames as f64 * step_s, -(frames as f64) * step_s] {
                let mut x = fit.x.clone();
                x.insert(problem.place(Parameter::DroppedFrames)?, missing_s);
                jumps.extend(best_instant(&problem, record, &x, &before));
            }
        }
    }
    jumps.into_iter().min_by(|a, b| a.left.total_cmp(&b.left))
}

/// A fit with missing frames, at the instant that is best for it, fitted again for as long as that moves.
fn settled<'a>(context: &FitContext<'a>, fit: Refit<'a>) -> Refit<'a> {
    let steps = context.settings.descent.few_steps;
    let mut fit = fit;
    for _ in 0..ROUNDS {
        let Some((record, at_s)) = fit.hypothesis.dropped else { break };
        let Some(jump) = better_instant(&fit, record).filter(|jump| jump.at_s != at_s) else { break };
        let hypothesis = Hypothesis { dropped: Some((record, jump.at_s)), ..fit.hypothesis.clone() };
        let again = context.descend_from(&hypothesis, &fit.problem.noise, fit.x.clone(), steps);
        let Some(again) = again.filter(|again| again.chi2 < fit.chi2) else { break };
        fit = again;
    }
    fit
}

/// The instant at which a fit's own jump fits best.
fn better_instant(fit: &Refit<'_>, record: usize) -> Option<Jump> {
    let mut never = fit.problem.clone();
    never.dropped_at_s[record] = f64::INFINITY;
    best_instant(&fit.problem, record, &fit.x, &squares(&never, record, &fit.x)?)
}

/// The instant, between two rows, at which a given jump fits best; `before` are the squares of a motion without it.
fn best_instant(problem: &Problem<'_>, record: usize, x: &[f64], before: &[f64]) -> Option<Jump> {
    let t_s = &problem.records[record].t_s;
    let between = |row: usize| 0.5 * (t_s[row - 1] + t_s[row]);
    // the first row's state is where the motion begins, so it lies before any jump
    let mut jumped = problem.clone();
    jumped.dropped_at_s[record] = between(1);
    let after = squares(&jumped, record, x)?;
    let mut left: f64 = before[0] + after[1..].iter().sum::<f64>();
    let mut best = (left, 1);
    for row in 2..t_s.len() {
        left += before[row - 1] - after[row - 1];
        if left < best.0 {
            best = (left, row);
        }
    }
    let place = problem.place(Parameter::DroppedFrames)?;
    Some(Jump { record, at_s: between(best.1), missing_s: x[place], left: best.0 })
}

/// Σ over the marks of the squares of what is left at every row, over the noise.
fn squares(problem: &Problem<'_>, record: usize, x: &[f64]) -> Option<Vec<f64>> {
    let data = &problem.records[record];
    let mut squares = vec![0.0; data.len()];
    for value in problem.predict(record, x, false).ok()?.values {
        if let Some(measured_rad) = data.theta_rad[value.link][value.row] {
            let sd_rad = problem.sd_rad(record, value.link, value.row);
            squares[value.row] += ((measured_rad - value.predicted_rad) / sd_rad).powi(2);
        }
    }
    Some(squares)
}

/// Frames missing before each row in turn: the angles after it are ahead.
fn scanned(screen: &Screen<'_, '_>) -> Option<Score> {
    let problem = &screen.fit.problem;
    let values: usize = screen.context.values();
    let mut best: Option<(f64, usize, f64)> = None;
    let mut first = 0;
    let mut of_record = Vec::new();
    for (record, data) in problem.records.iter().enumerate() {
        let prediction = problem.predict(record, &screen.fit.x, false).ok()?;
        let before = first;
        first += prediction.values.len();
        let rates: Vec<(f64, f64)> = prediction
            .values
            .iter()
            .map(|v| {
                let sd = problem.sd_rad(record, v.link, v.row);
                (data.t_s[v.row], v.rate_rad_s / sd)
            })
            .collect();
        of_record.push((before, prediction.values, rates));
    }
    for (record, data) in problem.records.iter().enumerate() {
        let (first, _, rates) = &of_record[record];
        let p = screen.projection.basis.ncols();
        // sums over the rows from each instant on, by adding one instant after another from the last
        let mut order: Vec<usize> = (0..rates.len()).collect();
        order.sort_by(|a, b| rates[*b].0.total_cmp(&rates[*a].0));
        let (mut square, mut pull, mut along) = (0.0, 0.0, vec![0.0; p]);
        let mut k = 0;
        for row in (1..data.len()).rev() {
            while k < order.len() && rates[order[k]].0 >= data.t_s[row] {
                let at = first + order[k];
                let rate = rates[order[k]].1;
                square += rate * rate;
                pull += rate * screen.projection.residual[at];
                (0..p).for_each(|i| along[i] += rate * screen.projection.basis[(at, i)]);
                k += 1;
            }
            let left = square - along.iter().map(|a| a * a).sum::<f64>();
            if left > NOTHING_LEFT * square && k > FEWEST && k + FEWEST < order.len() {
                let gain = pull * pull / left;
                if best.is_none_or(|(most, _, _)| gain > most) {
                    // between the two rows
                    best = Some((gain, record, 0.5 * (data.t_s[row] + data.t_s[row - 1])));
                }
            }
        }
    }
    let (_, record, at_s) = best?;
    let (first, seen, _) = &of_record[record];
    let data = &problem.records[record];
    let mut column = DMatrix::zeros(screen.projection.residual.len().max(values), 1);
    let mut after: Vec<f64> = seen.iter().map(|v| if data.t_s[v.row] >= at_s { v.rate_rad_s } else { 0.0 }).collect();
    Whitening::of(problem, record, seen).whiten(&mut after);
    column.view_mut((*first, 0), (after.len(), 1)).copy_from_slice(&after);
    screen.score(Effect::DroppedFrames, column, &[Parameter::DroppedFrames], Some((record, at_s)))
}

/// Whether a fit misses frames, and not a whole number of them, one or more.
fn misses_part_of_a_frame(fit: &Refit<'_>) -> bool {
    let (Some(missing_s), Some((record, _))) = (fit.value(Parameter::DroppedFrames), fit.hypothesis.dropped) else {
        return false;
    };
    let Some(frame_s) = median_step_s(&fit.problem.records[record].t_s) else { return false };
    let sd = fit.covariance(&[Parameter::DroppedFrames])[(0, 0)].sqrt() / frame_s;
    let frames = missing_s / frame_s;
    let whole = frames.round().max(1.0);
    (frames - whole).abs() > (WHOLE_SD * sd).max(WHOLE)
}
