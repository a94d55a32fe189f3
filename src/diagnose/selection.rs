//! Which hypotheses are fitted in full: the base model, every effect alone, and the pairs that promise most.

use rayon::prelude::*;

use super::ground::{self, Ground, Hypothesis};
use super::refit::{MUCH_LEFT, Refit, least, least_chi2};
use super::screen::{Score, Screen};
use super::single::{self, Lacks, WORTH};
use super::{Cause, dropped, fine_strip};
use crate::model::Parameter;
use crate::progress::Progress;

/// Fits from which pairs are built.
const SEEDS: usize = 6;
/// A pair that promises more than this many times the least χ² is not fitted.
const PROMISING: f64 = 3.0;
/// Dampers to start the base model from, over the one it found.
const WEAKER: [f64; 2] = [0.1, 0.01];
/// An effect explains much where it leaves less than this part of the base model's χ², and leads elsewhere where a base parameter differs by
/// more than this part.
const EXPLAINS: f64 = 0.5;
const ELSEWHERE: f64 = 0.3;
/// A fit whose χ² is this many times the best one's (and this much more) is not made any better.
const HOPELESS: f64 = 10.0;
/// A fit that is worse by this than one that only adds an effect may be in a false minimum.
const STRAGGLES: f64 = 9.0;
/// Fits that leave this many times the best one's χ² are no seeds, and no pair is promised less than this part of its seed's χ².
const FAR: f64 = 100.0;
const AFAR: f64 = 0.01;
/// Of these, the ones beside which what is dear to score is looked for.
const SCANNED: usize = 3;
/// Pairs fitted in full.
const MOST_PAIRS: usize = 20;
/// A χ² that was this many times as large was not yet a minimum's.
const FAR_DOWN: f64 = 3.0;
/// Pairs fitted even where they promise little.
const FEWEST_PAIRS: usize = 6;

/// The fits of all hypotheses, the base model first; what the best of them leaves refines the noise.
pub fn fits<'a>(ground: &mut Ground<'a>, null: Refit<'a>, causes: &[Cause], progress: &dyn Progress) -> Vec<Refit<'a>> {
    let scores = Screen::at(ground, &null).map(|s| s.scores(&cheap(ground, causes))).unwrap_or_default();
    let lacks = Lacks::of(ground, &null, &scores);
    progress.begin("effects", Some(causes.len() as u64));
    let fitted = |causes: &[Cause], lacks: Lacks| -> Vec<Refit<'a>> {
        let of = |cause: &Cause| {
            let fit = single::single(ground, &null, *cause, scores.iter().find(|s| s.cause == *cause), lacks);
            progress.advance(1);
            fit
        };
        causes.par_iter().with_max_len(1).filter_map(of).collect()
    };
    // what is dear to fit is sought the longer the less the others explain
    let (dear, others): (Vec<Cause>, Vec<Cause>) = causes.iter().partition(|cause| comes_last(**cause));
    let mut singles = fitted(&others, lacks);
    singles.extend(fitted(&dear, lacks.beside(&singles)));
    singles.sort_by(|a, b| a.hypothesis.causes.cmp(&b.hypothesis.causes));
    let mut all = vec![null];
    all.extend(singles);
    let all = from_the_best_single(ground, all);
    let mut all = with_refined_noise(ground, all);
    let (null, singles) = (&all[0], &all[1..]);
    let pairs = promising(ground, null, singles, causes);
    progress.begin("pairs", Some(pairs.len() as u64));
    let pairs = pairs.par_iter().with_max_len(1).filter_map(|(seed, score)| {
        let fit = ground.refit(&score.hypothesis(&seed.hypothesis), seed, &score.start);
        progress.advance(1);
        fit.map(|fit| dropped::settled(ground, fit))
    });
    let pairs: Vec<Refit<'a>> = pairs.collect();
    all.extend(pairs);
    let all = with_refined_noise(ground, all);
    let least = least_chi2(&all);
    let all = without_stragglers(ground, all);
    let all = if least_chi2(&all) < least { with_refined_noise(ground, all) } else { all };
    fine_strip::with_fine_strip(ground, all, causes, progress)
}

/// The base model anew from weaker dampers, where it leaves much: what it lacks can have driven its own damper so high that a mode is gone, and no
/// descent leads back.
pub fn from_weaker_dampers<'a>(ground: &Ground<'a>, null: Refit<'a>) -> Refit<'a> {
    let damper = Parameter::JointDamping;
    let Some(strong) = null.value(damper).filter(|_| null.left_share() > MUCH_LEFT) else { return null };
    let weaker = WEAKER
        .par_iter()
        .with_max_len(1)
        .filter_map(|part| ground.refit_below(null.chi2, &null.hypothesis, &null, &[(damper, part * strong)]));
    let best = weaker.min_by(|a, b| a.chi2.total_cmp(&b.chi2));
    match best {
        Some(best) if best.chi2 < null.chi2 => best,
        _ => null,
    }
}

/// Where one effect explains most of what the base model leaves, with another spring or damper than the base model's own fit has, the others too
/// are fitted from there.
fn from_the_best_single<'a>(ground: &Ground<'a>, fits: Vec<Refit<'a>>) -> Vec<Refit<'a>> {
    let null = &fits[0];
    let Some(best) = least(&fits).filter(|b| b.chi2 < EXPLAINS * null.chi2) else {
        return fits;
    };
    let moved = |parameter: &Parameter| {
        let (before, after) = (null.value(*parameter).unwrap_or(0.0), best.value(*parameter).unwrap_or(0.0));
        (after - before).abs() > ELSEWHERE * before.abs()
    };
    if !ground.base.iter().any(moved) {
        return fits;
    }
    let again = |fit: &Refit<'a>| {
        if fit.hypothesis.is_dear() || std::ptr::eq(fit, best) {
            return None;
        }
        elsewhere(ground, fit, &fit.hypothesis, best)
    };
    let again: Vec<Option<Refit<'a>>> = fits.par_iter().with_max_len(1).map(again).collect();
    fits.into_iter().zip(again).map(|(fit, again)| again.unwrap_or(fit)).collect()
}

/// A fit anew from where another one is, with its own coefficients, if that is a better place to begin from than where it ended.
fn elsewhere<'a>(
    ground: &Ground<'a>,
    fit: &Refit<'a>,
    hypothesis: &Hypothesis,
    place: &Refit<'a>,
) -> Option<Refit<'a>> {
    let added = fit.added();
    let own: Vec<(Parameter, f64)> =
        added.iter().filter(|p| place.value(**p).is_none()).filter_map(|p| Some((*p, fit.value(*p)?))).collect();
    if !(ground.cost_at(hypothesis, place, &own) < fit.chi2) {
        return None;
    }
    ground.refit(hypothesis, place, &own).filter(|again| again.chi2 < fit.chi2 - 1.0)
}

/// Where a pair has found a better minimum of a simpler hypothesis, one of its effects being next to nothing, that hypothesis starts anew from it.
fn without_stragglers<'a>(ground: &Ground<'a>, mut fits: Vec<Refit<'a>>) -> Vec<Refit<'a>> {
    let better: Vec<Option<Refit<'a>>> = fits
        .par_iter()
        .with_max_len(1)
        .map(|fit| {
            let richer = |other: &&Refit<'a>| {
                let (few, many) = (&fit.hypothesis.causes, &other.hypothesis.causes);
                many.len() > few.len() && few.iter().all(|c| many.contains(c)) && other.chi2 < fit.chi2 - STRAGGLES
            };
            let best = fits.iter().filter(richer).min_by(|a, b| a.chi2.total_cmp(&b.chi2))?;
            let hypothesis = Hypothesis { dropped: best.hypothesis.dropped, ..fit.hypothesis.clone() };
            elsewhere(ground, fit, &hypothesis, best)
        })
        .collect();
    for (fit, better) in fits.iter_mut().zip(better) {
        if let Some(better) = better {
            *fit = better;
        }
    }
    fits
}

/// The same fits with the noise that the best of them leaves; those that have not yet converged, and are worth it, go on. Where that led far down, the noise is
/// what is left there.
pub(super) fn with_refined_noise<'a>(ground: &mut Ground<'a>, fits: Vec<Refit<'a>>) -> Vec<Refit<'a>> {
    let before = least_chi2(&fits);
    let fits = refined_once(ground, fits);
    if FAR_DOWN * least_chi2(&fits) < before { refined_once(ground, fits) } else { fits }
}

fn refined_once<'a>(ground: &mut Ground<'a>, fits: Vec<Refit<'a>>) -> Vec<Refit<'a>> {
    let best = least(&fits);
    let changed = best.is_some_and(|best| ground.refine_noise(best));
    let ground = &*ground;
    let (least, null) = (best.map_or(0.0, |best| best.chi2), fits[0].chi2);
    let again = |fit: Refit<'a>| {
        let dear = fit.hypothesis.causes.contains(&Cause::JointHysteretic);
        // in every joint of a strip it has only begun
        let bound = if dear && ground.is_strip() { ground::HOPEFUL } else { HOPELESS };
        let worth = fit.hypothesis.causes.is_empty()
            || fit.chi2 < bound * (least + HOPELESS) && !(dear && fit.chi2 > null - WORTH);
        match (changed, worth) {
            (true, _) => ground.again(&fit, if worth { ground::MOST_STEPS } else { 0 }).unwrap_or(fit),
            (false, true) if !fit.converged => ground.again(&fit, ground::MOST_STEPS).unwrap_or(fit),
            _ => fit,
        }
    };
    fits.into_par_iter().with_max_len(1).map(again).collect()
}

/// The same fits beside the errors in step with the swing that a tracked angle may have; those that are near the noise go on from where they are.
pub(super) fn with_errors_in_step<'a>(ground: &mut Ground<'a>, fits: Vec<Refit<'a>>) -> Vec<Refit<'a>> {
    for (noise, record) in ground.noise.iter_mut().zip(ground.records) {
        noise.in_step = record.in_step;
    }
    if ground.noise.iter().all(|noise| noise.in_step == 0.0) {
        return fits;
    }
    let least = least_chi2(&fits);
    let again = |fit: Refit<'a>| {
        let worth = fit.chi2 < HOPELESS * (least + HOPELESS);
        ground.again(&fit, if worth { ground::FEW_STEPS } else { 0 }).unwrap_or(fit)
    };
    fits.into_par_iter().with_max_len(1).map(again).collect()
}

/// Whether an effect costs many times what others do.
fn comes_last(cause: Cause) -> bool {
    matches!(
        cause,
        Cause::JointHysteretic | Cause::DistributedFlexibility | Cause::SupportMotion | Cause::DroppedFrames
    )
}

/// The effects that are screened: a hysteresis in each joint of a strip of many links costs more than all others, and is only fitted alone.
pub(super) fn cheap(ground: &Ground<'_>, causes: &[Cause]) -> Vec<Cause> {
    let strip = ground.is_strip();
    causes.iter().copied().filter(|c| !(strip && *c == Cause::JointHysteretic)).collect()
}

/// The pairs whose χ² promises to be lowest, each from the better of its two singles.
fn promising<'s, 'a>(
    ground: &Ground<'a>,
    null: &Refit<'a>,
    singles: &'s [Refit<'a>],
    causes: &[Cause],
) -> Vec<(&'s Refit<'a>, Score)> {
    let further = cheap(ground, causes);
    let mut seeds: Vec<&Refit<'a>> = singles.iter().filter(|s| s.chi2 < null.chi2 - 4.0).collect();
    seeds.sort_by(|a, b| a.chi2.total_cmp(&b.chi2));
    seeds.truncate(SEEDS);
    let least = seeds.first().map_or(0.0, |s| s.chi2);
    seeds.retain(|s| s.chi2 < FAR * least);
    let scored: Vec<(&Refit<'a>, Vec<Score>)> = seeds
        .par_iter()
        .with_max_len(1)
        .enumerate()
        .filter_map(|(rank, seed)| {
            // every frequency of a moving support is dear, and every corner of a hysteresis
            let dear = |cause: &Cause| matches!(cause, Cause::SupportMotion | Cause::JointHysteretic);
            let few: Vec<Cause> = further.iter().copied().filter(|c| rank < SCANNED || !dear(c)).collect();
            Some((*seed, Screen::at(ground, seed)?.scores(&few)))
        })
        .collect();
    let mut pairs: Vec<(f64, &Refit<'a>, Score)> = Vec::new();
    for (seed, scores) in scored {
        for score in scores.into_iter().filter(|s| s.gain > 4.0) {
            // a promise from afar is worth little
            let promised = (seed.chi2 - score.gain).max(AFAR * seed.chi2);
            let hypothesis = score.hypothesis(&seed.hypothesis);
            let same = pairs.iter_mut().find(|p| p.2.hypothesis(&p.1.hypothesis).causes == hypothesis.causes);
            match same {
                Some(known) if promised < known.0 => *known = (promised, seed, score),
                Some(_) => {}
                None => pairs.push((promised, seed, score)),
            }
        }
    }
    // a hysteresis is dear: only where it promises what a further effect must gain
    let alone = singles.iter().map(|s| s.chi2).fold(null.chi2, f64::min);
    let is_dear = |pair: &(f64, &Refit<'a>, Score)| {
        pair.2.cause == Cause::JointHysteretic || pair.1.hypothesis.causes.contains(&Cause::JointHysteretic)
    };
    pairs.retain(|pair| !is_dear(pair) || pair.0 < alone - WORTH);
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
    pairs.truncate(MOST_PAIRS);
    let least = pairs.first().map_or(0.0, |p| p.0);
    let mut kept = 0;
    pairs.retain(|p| {
        kept += 1;
        kept <= FEWEST_PAIRS || p.0 < PROMISING * least + 100.0
    });
    pairs.into_iter().map(|(_, seed, score)| (seed, score)).collect()
}
