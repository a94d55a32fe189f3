//! The proof: fit on one part, predict the other with every coefficient frozen.

use rayon::prelude::*;

use super::ground::{Ground, Hypothesis};
use super::growing;
use super::refit::Refit;
use super::verdict::leaves_more_than_noise;
use crate::fit::{Belief, Record};

/// Part of a recording that is fitted; the rest is predicted.
const FITTED: f64 = 2.0 / 3.0;
/// A frozen coefficient may move by this part of itself.
const FROZEN: f64 = 1e-9;

/// Root mean square errors of what was not fitted.
#[derive(Debug, Clone, PartialEq)]
pub struct HeldOut {
    /// The recording that was predicted.
    pub record: usize,
    /// From which stamp on it was not fitted.
    pub from_s: f64,
    /// By the base model, each angle.
    pub baseline_rad: Vec<f64>,
    /// By the model with the effects named.
    pub augmented_rad: Vec<f64>,
}

impl HeldOut {
    /// What the names leave, as a part of what the base model leaves: root mean squares of all angles.
    pub fn leaves(&self) -> f64 {
        let square = |of: &[f64]| of.iter().map(|r| r * r).sum::<f64>();
        (square(&self.augmented_rad) / square(&self.baseline_rad).max(1e-300)).sqrt()
    }
}

/// Predicts, by the base model and by each of some fits, the last third of a single recording from the first two; of several, the last recording from the others,
/// of which only the start is then fitted. `from_s` moves the border of a single one.
pub fn held_out(
    ground: &Ground<'_>,
    null: &Refit<'_>,
    fits: &[&Refit<'_>],
    from_s: Option<f64>,
) -> Vec<Option<HeldOut>> {
    if ground.records.len() > 1 { across(ground, null, fits) } else { along(ground, null, fits, from_s) }
}

fn along(ground: &Ground<'_>, null: &Refit<'_>, fits: &[&Refit<'_>], from_s: Option<f64>) -> Vec<Option<HeldOut>> {
    let record = &ground.records[0];
    let (first_s, last_s) = (record.t_s[0], record.t_s[record.len() - 1]);
    let border_s = from_s.unwrap_or(first_s + FITTED * (last_s - first_s));
    let rows = record.t_s.partition_point(|t| *t < border_s);
    if rows < crate::series::FEWEST_ROWS || rows + crate::series::FEWEST_ROWS > record.len() {
        return vec![None; fits.len()];
    }
    let early = [record.until(rows)];
    let part = ground.on(&early);
    let predicted = |fit: &Refit<'_>| {
        let refitted = part.refit(&fit.hypothesis, fit, &[])?;
        // what leaves far more than noise may have lost step between here and there
        let grown = leaves_more_than_noise(&refitted).then(|| growing::grown_alone(&part, &refitted)).flatten();
        let refitted = grown.into_iter().chain([refitted]).min_by(|a, b| a.chi2.total_cmp(&b.chi2))?;
        let whole = ground.problem(&fit.hypothesis).ok()?;
        errors(&whole.predict(0, &refitted.x, false).ok()?.values, record, rows)
    };
    beside_the_base(null, fits, predicted, (0, border_s))
}

fn across(ground: &Ground<'_>, null: &Refit<'_>, fits: &[&Refit<'_>]) -> Vec<Option<HeldOut>> {
    let last = ground.records.len() - 1;
    let others = ground.on(&ground.records[..last]);
    let alone = ground.on(&ground.records[last..]);
    let predicted = |fit: &Refit<'_>| {
        let starts = 2 * fit.problem.shapes();
        let hypothesis =
            Hypothesis { dropped: fit.hypothesis.dropped.filter(|d| d.0 < last), ..fit.hypothesis.clone() };
        let mut near = fit.clone();
        near.x.truncate(fit.x.len() - starts);
        let fitted = others.refit(&hypothesis, &near, &[])?;
        // on the last one only the start is free
        let frozen: Vec<Belief> = (fitted.problem.free.iter().zip(&fitted.x))
            .map(|(p, value)| Belief { parameter: *p, value: *value, sd: FROZEN * value.abs().max(1e-12) })
            .collect();
        let alone = Ground { beliefs: frozen, ..alone.clone() };
        let mut start = fitted.clone();
        start.x.truncate(fitted.problem.free.len());
        start.x.extend_from_slice(&fit.x[fit.x.len() - starts..]);
        let hypothesis = Hypothesis { dropped: None, ..hypothesis };
        let seen = alone.refit(&hypothesis, &start, &[])?;
        errors(&seen.problem.predict(0, &seen.x, false).ok()?.values, &ground.records[last], 0)
    };
    beside_the_base(null, fits, predicted, (last, ground.records[last].t_s[0]))
}

/// What each fit leaves of a recording from a stamp on, beside what the base model does.
fn beside_the_base(
    null: &Refit<'_>,
    fits: &[&Refit<'_>],
    predicted: impl Fn(&Refit<'_>) -> Option<Vec<f64>> + Sync,
    (record, from_s): (usize, f64),
) -> Vec<Option<HeldOut>> {
    let of_fits = || fits.par_iter().with_max_len(1).map(|fit| predicted(fit)).collect::<Vec<_>>();
    let (baseline, augmented) = rayon::join(|| predicted(null), of_fits);
    let proof = |augmented_rad: Option<Vec<f64>>| {
        Some(HeldOut { record, from_s, baseline_rad: baseline.clone()?, augmented_rad: augmented_rad? })
    };
    augmented.into_iter().map(proof).collect()
}

/// Root mean square error of each angle from a row on.
fn errors(values: &[crate::fit::predict::Value], record: &Record, from_row: usize) -> Option<Vec<f64>> {
    (0..record.links())
        .map(|link| {
            let left = values.iter().filter(|v| v.link == link && v.row >= from_row);
            let squares: Vec<f64> =
                left.filter_map(|v| Some((record.theta_rad[link][v.row]? - v.predicted_rad).powi(2))).collect();
            (!squares.is_empty()).then(|| (squares.iter().sum::<f64>() / squares.len() as f64).sqrt())
        })
        .collect()
}
