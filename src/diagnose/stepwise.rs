//! More effects than two: one more beside the best fits, one fewer, and another in its place, in turns, until nothing new leads the way.
//!
//! A rig has several losses, and what the best pair leaves may be a third one's. What is added is weighed by its coefficients, not by its names: a support that
//! moves has three, and follows almost anything a little.

use rayon::prelude::*;

use super::ground::{self, Ground};
use super::growing;
use super::refit::{self, Refit, least, merged};
use super::screen::{Score, Screen};
use super::selection;
use super::single;
use super::verdict::leaves_more_than_noise;
use super::{Cause, MAIN_EFFECTS};
use crate::progress::{Progress, Silent};

/// Most effects of one hypothesis, and most coefficients.
const MOST: usize = 3;
pub(super) const MOST_COEFFICIENTS: usize = 5;
/// Effects that are tried beside a fit.
const TRIED: usize = 6;
/// A fit that leaves more than this many times what the best one does leads nowhere.
const LEADS: f64 = 2.0;
/// Part of what one effect promises that another in its place must.
const MOST_OF: f64 = 0.5;
/// Turns of more and fewer.
const TURNS: u64 = 4;

/// The fits, and those of more effects that the best of them lead to, with their rivals: what is not needed is no part of an answer, and what does as well is
/// another.
pub fn with_more_and_fewer<'a>(
    ground: &mut Ground<'a>,
    mut fits: Vec<Refit<'a>>,
    causes: &[Cause],
    progress: &dyn Progress,
) -> Vec<Refit<'a>> {
    progress.begin("more effects", Some(TURNS));
    let (mut led, mut rivalled) = (Vec::new(), Vec::new());
    for turn in 0..TURNS {
        let seeds = not_yet(leading(&fits), &mut led);
        if turn > 0 && seeds.is_empty() {
            break;
        }
        let more: Vec<Refit<'a>> = seeds.into_iter().flat_map(|seed| with_one_more(ground, seed, causes)).collect();
        fits = merged(fits, more);
        let seeds = not_yet(best_of_each_count(&fits), &mut rivalled);
        let rivals: Vec<Refit<'a>> = seeds.into_iter().flat_map(|seed| rivals(ground, seed, causes)).collect();
        fits = selection::with_refined_noise(ground, merged(fits, rivals));
        progress.advance(1);
        if turn > 0 && !least(&fits).is_some_and(leaves_more_than_noise) {
            break;
        }
    }
    fits
}

/// The best fit of each number of coefficients but none.
pub(super) fn best_of_each_count<'f, 'a>(fits: &'f [Refit<'a>]) -> Vec<&'f Refit<'a>> {
    let of_count = |count: usize| refit::best(fits, 1, |fit| fit.coefficients() == count, |fit| fit.chi2);
    (1..=MOST_COEFFICIENTS).flat_map(of_count).map(|place| &fits[place]).collect()
}

/// Those that leave little more than the best of them all.
fn leading<'f, 'a>(fits: &'f [Refit<'a>]) -> Vec<&'f Refit<'a>> {
    let best_of_all = least(fits).map_or(0.0, Refit::left_share);
    let mut leading = best_of_each_count(fits);
    leading.retain(|fit| fit.left_share() <= LEADS * best_of_all);
    leading
}

/// The fits whose effects have not yet had their turn, which then have.
fn not_yet<'f, 'a>(fits: Vec<&'f Refit<'a>>, had: &mut Vec<Vec<Cause>>) -> Vec<&'f Refit<'a>> {
    let new: Vec<&Refit<'a>> = fits.into_iter().filter(|fit| !had.contains(&fit.hypothesis.causes)).collect();
    had.extend(new.iter().map(|fit| fit.hypothesis.causes.clone()));
    new
}

/// A fit with one effect more, of those that promise most.
pub(super) fn with_one_more<'b>(ground: &Ground<'b>, fit: &Refit<'b>, causes: &[Cause]) -> Vec<Refit<'b>> {
    if fit.hypothesis.causes.len() >= MOST {
        return Vec::new();
    }
    let room = MOST_COEFFICIENTS.saturating_sub(fit.coefficients());
    let causes: Vec<Cause> = causes.iter().copied().filter(|cause| cause.parameters().len() <= room).collect();
    single::beside(ground, fit, &causes, Some(TRIED), &Silent)
}

/// A fit without each of its effects, and of three with another in its place. (Pairs have been sought from every side, and where far more than noise is left
/// nothing does as well.)
fn rivals<'a>(ground: &Ground<'a>, fit: &Refit<'a>, causes: &[Cause]) -> Vec<Refit<'a>> {
    let may_have_equals = fit.hypothesis.causes.len() > MAIN_EFFECTS && !leaves_more_than_noise(fit);
    let of = |cause: &Cause| {
        let fewer = without(ground, fit, *cause)?;
        let mut others = if may_have_equals { in_its_place(ground, fit, &fewer, causes) } else { Vec::new() };
        others.push(fewer);
        Some(others)
    };
    fit.hypothesis.causes.par_iter().with_max_len(1).filter_map(of).flatten().collect()
}

/// A fit without one of its effects, from where it is or from the beginning.
fn without<'a>(ground: &Ground<'a>, fit: &Refit<'a>, cause: Cause) -> Option<Refit<'a>> {
    let mut fewer = fit.clone();
    fewer.hypothesis.causes.retain(|other| *other != cause);
    let near = ground.refit(&fewer.hypothesis, &fewer, &[]);
    let best = near.into_iter().chain(growing::grown_alone(ground, &fewer)).min_by(|a, b| a.chi2.total_cmp(&b.chi2))?;
    if best.converged { Some(best) } else { ground.again(&best, ground::MOST_STEPS) }
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
