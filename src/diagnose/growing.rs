//! Fits that begin with the beginning of each recording and follow it as it grows, where the best leave far more than noise.
//!
//! The sum of squares of a long recording has many false minima, that of its beginning few. Where each part leads is where the next begins, so that no
//! motion has to lose step. What two effects leave there may be a third one's: a real rig has several.

use rayon::prelude::*;

use super::Cause;
use super::ground::{self, Ground, Hypothesis};
use super::refit::{self, Refit, least, merged};
use super::screen::{Score, Screen};
use super::selection::{self, Lacks};
use super::verdict::leaves_more_than_noise;
use crate::fit::Record;
use crate::model::Parameter;
use crate::progress::{Progress, Silent};
use crate::series::FEWEST_ROWS;

/// Parts of the rows, one after the other; then all of them.
const PARTS: [f64; 4] = [0.1, 0.2, 0.35, 0.6];
/// A part of fewer swings tells losses and clocks from nothing.
const FEWEST_SWINGS: f64 = 5.0;
/// A hypothesis that leaves more than this many times what the best one does is followed no further.
const FOLLOWED: f64 = 2.0;
/// Effects that are tried beside a fit, and the fall of χ² that each must promise.
const TRIED: usize = 6;
const WORTH: f64 = 9.0;
/// The best fits, which are followed from the beginning.
const BEGUN: usize = 12;
/// Part of what one effect promises that another in its place must.
const MOST_OF: f64 = 0.5;
/// Most effects of one hypothesis.
const MOST: usize = 4;

/// The hypotheses of some fits from the beginning of the recordings on, the base model and those that keep up with the best; and beside the best of each part
/// every other effect, of `causes`, where it leaves more than noise.
pub fn grown<'a>(ground: &Ground<'a>, fits: &[Refit<'a>], causes: &[Cause], progress: &dyn Progress) -> Vec<Refit<'a>> {
    progress.begin("from the beginning", Some(PARTS.len() as u64 + 1));
    let mut followed: Vec<(Hypothesis, Vec<f64>)> = Vec::new();
    for part in PARTS.into_iter().filter(|part| part * swings(fits) > FEWEST_SWINGS) {
        let records = first_part(ground.records, part);
        let early = ground.on(&records);
        let mut there: Vec<Refit<'_>> = if followed.is_empty() {
            let mut chosen = refit::best(fits, BEGUN, |_| true, Refit::left_share);
            chosen.extend((0..fits.len()).filter(|place| fits[*place].hypothesis.causes.is_empty()));
            chosen.sort_unstable();
            chosen.dedup();
            chosen.par_iter().with_max_len(1).filter_map(|place| begun(ground, &early, &fits[*place])).collect()
        } else {
            descended(&early, followed, ground::FEW_STEPS)
        };
        there = with_more(&early, there, causes);
        let most = FOLLOWED * least(&there).map_or(0.0, Refit::left_share);
        there.retain(|fit| fit.hypothesis.causes.is_empty() || fit.left_share() <= most);
        followed = there.into_iter().map(|fit| (fit.hypothesis, fit.x)).collect();
        progress.advance(1);
    }
    if followed.is_empty() {
        return with_more(ground, fits.to_vec(), causes);
    }
    with_more(ground, descended(ground, followed, ground::MOST_STEPS), causes)
}

/// How often the longest recording swings.
fn swings(fits: &[Refit<'_>]) -> f64 {
    let of = |fit: &Refit<'_>| {
        let (model, _) = fit.problem.model(0, &[]).ok()?;
        Some(fit.problem.longest_s() * model.pace_rad_s() / std::f64::consts::TAU)
    };
    fits.first().and_then(of).unwrap_or(0.0)
}

/// The fits, and the best of them with one effect more, of those that promise most.
pub fn with_more<'b>(ground: &Ground<'b>, fits: Vec<Refit<'b>>, causes: &[Cause]) -> Vec<Refit<'b>> {
    let may_have_more = |best: &&Refit<'_>| !causes.is_empty() && best.hypothesis.causes.len() < MOST;
    let Some(best) = least(&fits).filter(may_have_more) else { return fits };
    let mut scores = Screen::at(ground, best).map(|screen| screen.scores(causes)).unwrap_or_default();
    let lacks = Lacks::of(ground, best, &scores);
    scores.retain(|score| score.gain > WORTH);
    scores.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    scores.truncate(TRIED);
    let more = scores.par_iter().with_max_len(1);
    let more = more.filter_map(|score| selection::single(ground, best, score.cause, Some(score), lacks)).collect();
    merged(fits, more)
}

/// A hypothesis by itself from the beginning of the recordings on.
pub fn grown_alone<'a>(ground: &Ground<'a>, fit: &Refit<'a>) -> Option<Refit<'a>> {
    grown(ground, std::slice::from_ref(fit), &[], &Silent).pop()
}

/// The fits, and beside the best of each number of effects those without one of them, and those with another in its place: what is not needed is no part of
/// an answer, and what does as well is another.
pub fn with_rivals<'a>(ground: &Ground<'a>, fits: Vec<Refit<'a>>, causes: &[Cause]) -> Vec<Refit<'a>> {
    let most = least(&fits).map_or(0, |best| best.hypothesis.causes.len());
    (1..=most).rev().fold(fits, |fits, count| {
        let of_count = fits.iter().filter(|fit| fit.hypothesis.causes.len() == count);
        let Some(best) = of_count.min_by(|a, b| a.chi2.total_cmp(&b.chi2)).cloned() else { return fits };
        let left_far_more = leaves_more_than_noise(&best);
        let (fewer, others): (Vec<_>, Vec<_>) = (best.hypothesis.causes.par_iter().with_max_len(1))
            .filter_map(|cause| without(ground, &best, *cause))
            .map(|fewer| {
                // pairs have been sought from every side, and where far more than noise is left nothing does as well
                let others =
                    if count > 2 && !left_far_more { in_its_place(ground, &best, &fewer, causes) } else { Vec::new() };
                (fewer, others)
            })
            .unzip();
        merged(merged(fits, fewer), others.into_iter().flatten().collect())
    })
}

/// A fit without one of its effects, from where it is or from the beginning.
fn without<'a>(ground: &Ground<'a>, fit: &Refit<'a>, cause: Cause) -> Option<Refit<'a>> {
    let mut fewer = fit.clone();
    fewer.hypothesis.causes.retain(|other| *other != cause);
    let near = ground.refit(&fewer.hypothesis, &fewer, &[]);
    near.into_iter().chain(grown_alone(ground, &fewer)).min_by(|a, b| a.chi2.total_cmp(&b.chi2))
}

/// A fit with fewer effects and another one instead, where that promises most of what the one left out would from there.
fn in_its_place<'a>(ground: &Ground<'a>, best: &Refit<'a>, fewer: &Refit<'a>, causes: &[Cause]) -> Vec<Refit<'a>> {
    let scores = Screen::at(ground, fewer).map(|screen| screen.scores(causes)).unwrap_or_default();
    let (own, others): (Vec<Score>, Vec<Score>) =
        scores.into_iter().partition(|score| best.hypothesis.causes.contains(&score.cause));
    let promised = own.iter().map(|score| score.gain).fold(0.0, f64::max);
    let other = |score: Score| ground.refit(&score.hypothesis(&fewer.hypothesis), fewer, &score.start);
    others.into_iter().filter(|score| score.gain > MOST_OF * promised).filter_map(other).collect()
}

/// The first part of each recording.
pub fn first_part(records: &[Record], part: f64) -> Vec<Record> {
    let rows = |record: &Record| ((part * record.len() as f64) as usize).max(FEWEST_ROWS).min(record.len());
    records.iter().map(|record| record.until(rows(record))).collect()
}

fn descended<'b>(ground: &Ground<'b>, from: Vec<(Hypothesis, Vec<f64>)>, most_steps: usize) -> Vec<Refit<'b>> {
    let descend = |(hypothesis, x)| ground.descend_from(&hypothesis, x, most_steps);
    from.into_par_iter().with_max_len(1).filter_map(descend).collect()
}

/// A fit's hypothesis on the beginning, from its own parameters or from those that short stretches led to, whichever leads further.
fn begun<'b>(ground: &Ground<'_>, early: &Ground<'b>, fit: &Refit<'_>) -> Option<Refit<'b>> {
    let fit = ground.seen_to_start(fit);
    let stretches: Vec<(Parameter, f64)> = ground.base.iter().copied().zip(ground.begun.iter().copied()).collect();
    let from = |start: &[(Parameter, f64)]| early.refit(&fit.hypothesis, &fit, start);
    [from(&[]), from(&stretches)].into_iter().flatten().min_by(|a, b| a.chi2.total_cmp(&b.chi2))
}
