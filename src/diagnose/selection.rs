//! Which hypotheses are fitted in full: the base model, every effect alone, and the pairs that promise most.

use rayon::prelude::*;

use super::ground::{self, Ground, Hypothesis};
use super::refit::{OUT_OF_STEP, Refit, least, least_chi2};
use super::screen::{Score, Screen};
use super::{Cause, dropped, fine_strip, hysteresis};
use crate::model::Parameter;
use crate::progress::Progress;

/// Fits from which pairs are built.
const SEEDS: usize = 6;
/// χ² beyond its expectation by this many standard deviations is worth a dear hypothesis.
const SOMETHING_LEFT: f64 = 4.0;
/// A pair that promises more than this many times the least χ² is not fitted.
const PROMISING: f64 = 3.0;
/// A base model that leaves this part of the swing lacks something, whatever the noise.
const MUCH_LEFT: f64 = 0.05;
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
/// Of these, the ones beside which a moving support is looked for.
const SCANNED: usize = 3;
/// Pairs fitted in full.
const MOST_PAIRS: usize = 20;
/// A dear pair must lower the best χ² by this.
const WORTH: f64 = 9.0;
/// A χ² that was this many times as large was not yet a minimum's.
const FAR_DOWN: f64 = 3.0;
/// Pairs fitted even where they promise little.
const FEWEST_PAIRS: usize = 6;

/// The fits of all hypotheses, the base model first; what the best of them leaves refines the noise.
pub fn fits<'a>(ground: &mut Ground<'a>, null: Refit<'a>, causes: &[Cause], progress: &dyn Progress) -> Vec<Refit<'a>> {
    let scores = Screen::at(ground, &null).map(|s| s.scores(&cheap(ground, causes))).unwrap_or_default();
    let lacks = Lacks::of(ground, &null, &scores);
    progress.begin("effects", Some(causes.len() as u64));
    let singles = causes.par_iter().with_max_len(1).filter_map(|cause| {
        let fit = single(ground, &null, *cause, scores.iter().find(|s| s.cause == *cause), lacks);
        progress.advance(1);
        fit
    });
    let singles: Vec<Refit<'a>> = singles.collect();
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
        .filter_map(|part| ground.refit(&null.hypothesis, &null, &[(damper, part * strong)]));
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

/// How much a fit lacks, which decides from how many starts an effect is fitted.
#[derive(Debug, Clone, Copy)]
pub(super) struct Lacks {
    /// χ² from which on a fit leaves more than noise.
    too_much: f64,
    /// It leaves more than noise.
    pub unexplained: bool,
    /// Its motion has lost step with a recording.
    out_of_step: bool,
    /// An effect that is not scanned for would explain some of it.
    pub seen: bool,
}

impl Lacks {
    pub fn of(ground: &Ground<'_>, null: &Refit<'_>, scores: &[Score]) -> Self {
        let values = ground.values() as f64;
        let too_much = values + SOMETHING_LEFT * (2.0 * values).sqrt();
        let left_share = null.left_share();
        Self {
            too_much,
            unexplained: left_share > MUCH_LEFT || null.chi2 > too_much,
            out_of_step: left_share > OUT_OF_STEP,
            seen: scores.iter().any(|s| s.gain > WORTH && !s.cause.is_scanned()),
        }
    }
}

/// One effect beside a fit, from every start that may lead to its minimum.
pub(super) fn single<'a>(
    ground: &Ground<'a>,
    null: &Refit<'a>,
    cause: Cause,
    score: Option<&Score>,
    lacks: Lacks,
) -> Option<Refit<'a>> {
    if cause == Cause::JointHysteretic {
        return hysteresis::alone(ground, null, score, lacks);
    }
    let Lacks { too_much, unexplained, out_of_step, .. } = lacks;
    let mut tries = Vec::new();
    match (cause, score) {
        (Cause::DistributedFlexibility, _) => {
            // many links are dear: only where there is something to explain
            if unexplained {
                let hypothesis = null.hypothesis.and(cause, None);
                let begun = ground.begin(&hypothesis, null, &[]).filter(|b| b.chi2 < ground::BEYOND_HOPE * null.chi2);
                let begun = begun.and_then(|b| ground.again(&b, ground::FEW_STEPS));
                let begun = begun.filter(|b| b.chi2 < ground::HOPEFUL * null.chi2);
                tries.push(begun.and_then(|b| if b.converged { Some(b) } else { ground.again(&b, ground::FEW_STEPS) }));
                if out_of_step && tries.iter().flatten().all(Refit::is_out_of_step) {
                    tries.push(ground.refit_anew(&hypothesis, &[], null.chi2));
                }
            }
        }
        (Cause::DroppedFrames, _) => {
            tries.push(dropped::alone(ground, null));
            let scored = score.and_then(|s| ground.refit(&s.hypothesis(&null.hypothesis), null, &s.start));
            tries.push(scored.map(|fit| dropped::settled(ground, fit)));
        }
        (_, Some(score)) => {
            let hypothesis = score.hypothesis(&null.hypothesis);
            let near = ground.refit(&hypothesis, null, &score.start);
            let lost = out_of_step && changes_pace(cause) && near.as_ref().is_none_or(Refit::is_out_of_step);
            // a base model may have damped away what a better one keeps: short stretches remember it
            let slow = unexplained && is_loss(cause) && near.as_ref().is_none_or(|n| !n.converged);
            if lost || slow {
                tries.push(ground.refit_anew(&hypothesis, &score.start, null.chi2));
            }
            if unexplained && near.as_ref().is_none_or(|n| n.chi2 > too_much) {
                tries.extend(score.further.iter().map(|start| ground.refit(&hypothesis, null, start)));
            }
            tries.push(near);
        }
        (_, None) => {}
    }
    let unsolved = unexplained && tries.iter().flatten().all(|t| t.chi2 > too_much);
    if cause == Cause::RestCurl && unsolved {
        // a base model that has given its second mode up is no place to start from
        tries.push(ground.refit_anew(&null.hypothesis.and(cause, None), &[], null.chi2));
    }
    tries.into_iter().flatten().min_by(|a, b| a.chi2.total_cmp(&b.chi2))
}

/// Other effects beside a fit: every one, or as many as are asked of those that promise most.
pub(super) fn beside<'a>(
    ground: &Ground<'a>,
    fit: &Refit<'a>,
    causes: &[Cause],
    most: Option<usize>,
    progress: &dyn Progress,
) -> Vec<Refit<'a>> {
    let Some(screen) = Screen::at(ground, fit) else { return Vec::new() };
    let scores: Vec<Score> = screen.scores(causes);
    let lacks = Lacks::of(ground, fit, &scores);
    let score = |cause: Cause| scores.iter().find(|score| score.cause == cause);
    let promised = |cause: Cause| score(cause).map_or(0.0, |score| score.gain);
    let mut others: Vec<Cause> = causes.iter().copied().filter(|c| !fit.hypothesis.causes.contains(c)).collect();
    if let Some(most) = most {
        others.retain(|cause| promised(*cause) > WORTH);
        others.sort_by(|a, b| promised(*b).total_cmp(&promised(*a)));
        others.truncate(most);
    }
    let of = |cause: &Cause| {
        let found = single(ground, fit, *cause, score(*cause), lacks);
        progress.advance(1);
        found
    };
    others.par_iter().with_max_len(1).filter_map(of).collect()
}

/// Whether an effect can put the base model out of step by its frequency.
fn changes_pace(cause: Cause) -> bool {
    matches!(cause, Cause::TimeBase | Cause::HingeStiffness | Cause::AddedMass | Cause::JointCubicStiffness)
}

/// Whether an effect takes energy away, as the base model's own damper does.
fn is_loss(cause: Cause) -> bool {
    matches!(cause, Cause::HingeViscous | Cause::HingeCoulomb | Cause::AirLinear | Cause::AirQuadratic)
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
            // every frequency of a moving support is dear
            let few: Vec<Cause> =
                further.iter().copied().filter(|c| rank < SCANNED || *c != Cause::SupportMotion).collect();
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
