//! A second look where the best fit leaves more than noise: it may stand in a false minimum, or its partner have been sought from the wrong place.

use rayon::prelude::*;

use super::Cause;
use super::ground::{self, Ground};
use super::refit::Refit;
use super::screen::{Score, Screen};
use super::selection::{self, Lacks};
use crate::fit::Record;
use crate::progress::Progress;

/// The best effects, beside each of which every other one is sought from all its starts.
const SEEDS: usize = 2;
/// The best fits, which are made anew from the first part of the recordings.
const ANEW: usize = 4;
/// That part.
const FIRST_PART: f64 = 0.5;

/// The fits, and better ones of the same hypotheses or of further pairs, where the best of them leaves more than noise.
pub fn second_look<'a>(
    ground: &mut Ground<'a>,
    fits: Vec<Refit<'a>>,
    causes: &[Cause],
    progress: &dyn Progress,
) -> Vec<Refit<'a>> {
    let lacks = fits.iter().min_by(|a, b| a.chi2.total_cmp(&b.chi2)).map(|best| Lacks::of(ground, best, &[]));
    if ground.is_strip() || !lacks.is_some_and(|lacks| lacks.unexplained) {
        return fits;
    }
    let mut seeds: Vec<&Refit<'a>> = fits.iter().filter(|fit| fit.hypothesis.causes.len() == 1).collect();
    seeds.sort_by(|a, b| a.chi2.total_cmp(&b.chi2));
    seeds.truncate(SEEDS);
    progress.begin("second look", Some((seeds.len() * causes.len()) as u64));
    let pairs: Vec<Refit<'a>> = seeds.iter().flat_map(|seed| beside(ground, seed, causes, progress)).collect();
    let all = merged(fits, pairs);
    let all = from_the_first_part(ground, all);
    selection::with_refined_noise(ground, all)
}

/// Every other effect beside a fit.
fn beside<'a>(ground: &Ground<'a>, seed: &Refit<'a>, causes: &[Cause], progress: &dyn Progress) -> Vec<Refit<'a>> {
    let Some(screen) = Screen::at(ground, seed) else { return Vec::new() };
    let scores: Vec<Score> = screen.scores(causes);
    let lacks = Lacks::of(ground, seed, &scores);
    let of = |cause: &Cause| {
        progress.advance(1);
        if seed.hypothesis.causes.contains(cause) {
            return None;
        }
        selection::single(ground, seed, *cause, scores.iter().find(|s| s.cause == *cause), lacks)
    };
    causes.par_iter().with_max_len(1).filter_map(of).collect()
}

/// The better one of each hypothesis.
fn merged<'a>(mut fits: Vec<Refit<'a>>, others: Vec<Refit<'a>>) -> Vec<Refit<'a>> {
    for other in others {
        match fits.iter_mut().find(|fit| fit.hypothesis.causes == other.hypothesis.causes) {
            Some(known) if other.chi2 < known.chi2 => *known = other,
            Some(_) => {}
            None => fits.push(other),
        }
    }
    fits
}

/// The best fits anew from where the first part of each recording leads: when a dry hinge stops, and where, no derivative tells, and early on it has not.
fn from_the_first_part<'a>(ground: &Ground<'a>, fits: Vec<Refit<'a>>) -> Vec<Refit<'a>> {
    let early: Vec<Record> = ground.records.iter().map(|r| r.until((FIRST_PART * r.len() as f64) as usize)).collect();
    if early.iter().any(|record| record.len() < crate::series::FEWEST_ROWS) {
        return fits;
    }
    let part = ground.on(&early);
    let mut order: Vec<usize> = (0..fits.len()).collect();
    order.sort_by(|a, b| fits[*a].chi2.total_cmp(&fits[*b].chi2));
    order.truncate(ANEW);
    let again = |index: &usize| {
        let fit = &fits[*index];
        let x = part.refit(&fit.hypothesis, fit, &[])?.x;
        ground.descend_from(&fit.hypothesis, x, ground::MOST_STEPS)
    };
    let others: Vec<Refit<'a>> = order.par_iter().with_max_len(1).filter_map(again).collect();
    merged(fits, others)
}
