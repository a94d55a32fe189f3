//! A second look where the best fit leaves more than noise: it may stand in a false minimum, or its partner have been sought from the wrong place.

use rayon::prelude::*;

use super::ground::{self, Ground};
use super::noise::BEYOND_NOISE;
use super::refit::{Refit, best, least, least_chi2, merged};
use super::selection;
use super::single::{self, Lacks};
use super::{Cause, hysteresis};
use crate::fit::Record;
use crate::progress::Progress;

/// The best effects, beside each of which every other one is sought from all its starts.
const SEEDS: usize = 2;
/// The best fits, which are made anew from the first part of the recordings.
const ANEW: usize = 4;
/// That part: of the rows, and while the swing is still this large a part of its largest.
const FIRST_PART: f64 = 0.5;
const STILL_SWINGS: f64 = 0.25;

/// The fits, and better ones of the same hypotheses or of further pairs, where the best of them leaves more than noise.
pub fn second_look<'a>(
    ground: &mut Ground<'a>,
    fits: Vec<Refit<'a>>,
    causes: &[Cause],
    progress: &dyn Progress,
) -> Vec<Refit<'a>> {
    let lacks = least(&fits).map(|best| Lacks::of(ground, best, &[]));
    if ground.is_strip() || !lacks.is_some_and(|lacks| lacks.unexplained) {
        return fits;
    }
    let fits = from_the_first_part(ground, fits, |fits| seeds(ground, fits));
    let seeds: Vec<&Refit<'a>> = seeds(ground, &fits).into_iter().map(|i| &fits[i]).collect();
    progress.begin("second look", Some((seeds.len() * causes.len()) as u64));
    let mut others: Vec<Refit<'a>> =
        seeds.iter().flat_map(|seed| single::beside(ground, seed, causes, None, progress)).collect();
    if causes.contains(&Cause::JointHysteretic) {
        let lacking = seeds.iter().filter(|seed| !seed.hypothesis.causes.contains(&Cause::JointHysteretic));
        let bases = lacking.copied().chain(fits.first());
        others.extend(bases.filter_map(|base| hysteresis::anywhere(ground, base)));
    }
    let all = merged(fits, others);
    let all = from_the_first_part(ground, all, |fits| {
        let mut chosen = best(fits, ANEW, |_| true, |fit| fit.chi2);
        if ground.records.iter().any(comes_to_rest) {
            let can_stop = |fit: &Refit<'a>| fit.hypothesis.causes.contains(&Cause::HingeCoulomb);
            chosen.extend((0..fits.len()).filter(|i| can_stop(&fits[*i])));
        }
        chosen
    });
    selection::with_refined_noise(ground, all)
}

/// The best fits of a kind anew from where the first part of each recording leads: when a dry hinge stops, and where, no derivative tells, and early on it
/// has not.
fn from_the_first_part<'a>(
    ground: &Ground<'a>,
    fits: Vec<Refit<'a>>,
    choose: impl Fn(&[Refit<'a>]) -> Vec<usize>,
) -> Vec<Refit<'a>> {
    let early: Vec<Record> = ground.records.iter().map(|r| r.until(first_part(r))).collect();
    if early.iter().any(|record| record.len() < crate::series::FEWEST_ROWS) {
        return fits;
    }
    let part = ground.on(&early);
    let mut chosen = choose(&fits);
    chosen.sort_unstable();
    chosen.dedup();
    let again = |index: &usize| {
        let fit = &fits[*index];
        let x = part.refit(&fit.hypothesis, fit, &[])?.x;
        ground.descend_from(&fit.hypothesis, x, ground::MOST_STEPS)
    };
    let others: Vec<Refit<'a>> = chosen.par_iter().with_max_len(1).filter_map(again).collect();
    merged(fits, others)
}

/// The single effects that leave least; where that is far more than noise, its colour does not count.
fn seeds(ground: &Ground<'_>, fits: &[Refit<'_>]) -> Vec<usize> {
    let beyond_noise = least_chi2(fits) > BEYOND_NOISE * BEYOND_NOISE * ground.values() as f64;
    let left = |fit: &Refit<'_>| if beyond_noise { fit.left_share() } else { fit.chi2 };
    best(fits, SEEDS, |fit| fit.hypothesis.causes.len() == 1, left)
}

/// Whether the swing has died away long before the recording ends.
fn comes_to_rest(record: &Record) -> bool {
    first_part(record) + 1 < (FIRST_PART * record.len() as f64) as usize
}

fn first_part(record: &Record) -> usize {
    let still = STILL_SWINGS * record.largest_angle_rad();
    let swings =
        |row: usize| record.theta_rad.iter().any(|angles| angles[row].is_some_and(|angle| angle.abs() > still));
    let last = (0..record.len()).rev().find(|row| swings(*row)).unwrap_or(0);
    last.min((FIRST_PART * record.len() as f64) as usize)
}
