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

use super::Cause;
use super::ground::{self, Ground, Hypothesis};
use super::refit::Refit;
use crate::fit::Problem;
use crate::model::Parameter;
use crate::statistics::median_step_s;

/// Frames that may be missing at once.
const MOST_FRAMES: usize = 5;
/// Instants are looked for anew this many times.
const ROUNDS: usize = 4;

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
pub fn alone<'a>(ground: &Ground<'a>, null: &Refit<'a>) -> Option<Refit<'a>> {
    let begun = Refit { x: ground.begun.clone(), ..null.clone() };
    let starts = [null, &begun];
    let jumps = starts.into_iter().filter(|start| start.x.len() == null.x.len()).filter_map(|start| {
        let jump = likeliest(ground, start)?;
        Some((start, jump))
    });
    let fits = jumps.filter_map(|(start, jump)| {
        let hypothesis = null.hypothesis.and(Cause::DroppedFrames, Some((jump.record, jump.at_s)));
        let fit = ground.refit(&hypothesis, start, &[(Parameter::DroppedFrames, jump.missing_s)])?;
        Some(settled(ground, fit))
    });
    fits.min_by(|a, b| a.chi2.total_cmp(&b.chi2))
}

/// The likeliest jump of whole frames for parameters and starts of a fit.
fn likeliest(ground: &Ground<'_>, fit: &Refit<'_>) -> Option<Jump> {
    let mut jumps = Vec::new();
    for record in 0..ground.records.len() {
        let hypothesis = fit.hypothesis.and(Cause::DroppedFrames, Some((record, 0.0)));
        let problem = ground.problem(&hypothesis).ok()?;
        let step_s = median_step_s(&ground.records[record].t_s)?;
        let before = squares(&fit.problem, record, &fit.x)?;
        for frames in 1..=MOST_FRAMES {
            for missing_s in [frames as f64 * step_s, -(frames as f64) * step_s] {
                let mut x = fit.x.clone();
                x.insert(problem.free.iter().position(|p| *p == Parameter::DroppedFrames)?, missing_s);
                jumps.extend(best_instant(&problem, record, &x, &before));
            }
        }
    }
    jumps.into_iter().min_by(|a, b| a.left.total_cmp(&b.left))
}

/// A fit with missing frames, at the instant that is best for it, fitted again for as long as that moves.
pub fn settled<'a>(ground: &Ground<'a>, fit: Refit<'a>) -> Refit<'a> {
    let mut fit = fit;
    for _ in 0..ROUNDS {
        let Some((record, at_s)) = fit.hypothesis.dropped else { break };
        let Some(jump) = better_instant(&fit, record).filter(|jump| jump.at_s != at_s) else { break };
        let hypothesis = Hypothesis { dropped: Some((record, jump.at_s)), ..fit.hypothesis.clone() };
        let again = ground.descend_from(&hypothesis, fit.x.clone(), ground::FEW_STEPS);
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
    let place = problem.free.iter().position(|p| *p == Parameter::DroppedFrames)?;
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
