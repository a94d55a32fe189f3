//! Fits that begin with the beginning of each recording and follow it as it grows, where the best leave far more than noise.
//!
//! The sum of squares of a long recording has many false minima, that of its beginning few. Where each part leads is where the next begins, so that no
//! motion has to lose step. What two effects leave there may be a third one's: a real rig has several.

use rayon::prelude::*;

use super::Cause;
use super::ground::{self, Ground, Hypothesis};
use super::refit::{self, Refit, merged};
use super::stepwise::{self, MOST_COEFFICIENTS};
use crate::fit::Record;
use crate::model::Parameter;
use crate::progress::{Progress, Silent};
use crate::series::FEWEST_ROWS;

/// Parts of the rows, one after the other; then all of them.
const PARTS: [f64; 4] = [0.1, 0.2, 0.35, 0.6];
/// A part of fewer swings tells losses and clocks from nothing.
const FEWEST_SWINGS: f64 = 5.0;
/// The best fits, which are followed from the beginning.
const BEGUN: usize = 12;
/// Fits of each number of coefficients that are followed further, unless they leave more than this many times what the best of them does: what is free to move
/// a support anywhere must not displace a law.
const FOLLOWED: usize = 3;
const KEEPS_UP: f64 = 2.0;

/// The hypotheses of some fits from the beginning of the recordings on, those of each number of coefficients that keep up with the best; and beside the best
/// of each part other effects, of `causes`.
pub fn grown<'a>(ground: &Ground<'a>, fits: &[Refit<'a>], causes: &[Cause], progress: &dyn Progress) -> Vec<Refit<'a>> {
    progress.begin("from the beginning", Some(PARTS.len() as u64 + 1));
    let mut followed: Vec<(Hypothesis, Vec<f64>)> = Vec::new();
    for part in PARTS.into_iter().filter(|part| part * swings(fits) > FEWEST_SWINGS) {
        let records = first_part(ground.records, part);
        let early = ground.on(&records);
        let there: Vec<Refit<'_>> = if followed.is_empty() {
            let mut chosen = refit::best(fits, BEGUN, |_| true, Refit::left_share);
            chosen.extend((0..fits.len()).filter(|place| fits[*place].hypothesis.causes.is_empty()));
            chosen.sort_unstable();
            chosen.dedup();
            chosen
                .par_iter()
                .with_max_len(1)
                .filter_map(|place| on_the_beginning(ground, &early, &fits[*place]))
                .collect()
        } else {
            descended(&early, followed, ground::FEW_STEPS)
        };
        let more: Vec<Refit<'_>> = stepwise::best_of_each_count(&there)
            .into_iter()
            .flat_map(|best| stepwise::with_one_more(&early, best, causes))
            .collect();
        followed = foremost(merged(there, more)).into_iter().map(|fit| (fit.hypothesis, fit.x)).collect();
        progress.advance(1);
    }
    descended(ground, followed, ground::MOST_STEPS)
}

/// A hypothesis by itself from the beginning of the recordings on.
pub fn grown_alone<'a>(ground: &Ground<'a>, fit: &Refit<'a>) -> Option<Refit<'a>> {
    grown(ground, std::slice::from_ref(fit), &[], &Silent).pop()
}

/// The first part of each recording.
pub fn first_part(records: &[Record], part: f64) -> Vec<Record> {
    let rows = |record: &Record| ((part * record.len() as f64) as usize).max(FEWEST_ROWS).min(record.len());
    records.iter().map(|record| record.until(rows(record))).collect()
}

/// How often the longest recording swings.
fn swings(fits: &[Refit<'_>]) -> f64 {
    let of = |fit: &Refit<'_>| {
        let (model, _) = fit.problem.model(0, &[]).ok()?;
        Some(fit.problem.longest_s() * model.pace_rad_s() / std::f64::consts::TAU)
    };
    fits.first().and_then(of).unwrap_or(0.0)
}

/// The best of each number of coefficients.
fn foremost<'b>(fits: Vec<Refit<'b>>) -> Vec<Refit<'b>> {
    let of_count = |count: usize| {
        let mut best = refit::best(&fits, FOLLOWED, |fit| fit.coefficients() == count, |fit| fit.chi2);
        let most = KEEPS_UP * best.first().map_or(0.0, |place| fits[*place].left_share());
        best.retain(|place| fits[*place].left_share() <= most);
        best
    };
    let kept: Vec<usize> = (0..=MOST_COEFFICIENTS).flat_map(of_count).collect();
    fits.into_iter().enumerate().filter(|(place, _)| kept.contains(place)).map(|(_, fit)| fit).collect()
}

fn descended<'b>(ground: &Ground<'b>, from: Vec<(Hypothesis, Vec<f64>)>, most_steps: usize) -> Vec<Refit<'b>> {
    let descend = |(hypothesis, x)| ground.descend_from(&hypothesis, x, most_steps);
    from.into_par_iter().with_max_len(1).filter_map(descend).collect()
}

/// A fit's hypothesis on the beginning, from its own parameters or from those that short stretches led to, whichever leads further.
fn on_the_beginning<'b>(ground: &Ground<'_>, early: &Ground<'b>, fit: &Refit<'_>) -> Option<Refit<'b>> {
    let fit = ground.seen_to_start(fit);
    let stretches: Vec<(Parameter, f64)> = ground.base.iter().copied().zip(ground.begun.iter().copied()).collect();
    let from = |start: &[(Parameter, f64)]| early.refit(&fit.hypothesis, &fit, start);
    [from(&[]), from(&stretches)].into_iter().flatten().min_by(|a, b| a.chi2.total_cmp(&b.chi2))
}
