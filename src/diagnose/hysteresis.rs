//! The joint's hysteresis needs starts of its own, beside variables of its own ([`crate::fit::straight`]).

use rayon::prelude::*;

use super::ground::{self, Ground};
use super::refit::Refit;
use super::screen::Score;
use super::single::Lacks;
use super::{Cause, growing};
use crate::model::Parameter;

/// Starts: yield angles as parts of the largest bend, and the hysteresis' part of the spring.
const YIELD_SHARES: [f64; 3] = [0.05, 0.2, 0.6];
const SPRING_SHARES: [f64; 2] = [0.4, 0.9];
/// The same where everything else has failed, and how much stiffer the joint may then be; how many of them begin a descent, and how many end it.
const EVERY_YIELD: [f64; 5] = [0.03, 0.1, 0.25, 0.5, 0.9];
const EVERY_SHARE: [f64; 4] = [0.1, 0.4, 0.7, 0.95];
const STIFFER: [f64; 3] = [1.0, 2.0, 8.0];
const BEGUN: usize = 12;
const ENDED: usize = 3;
/// Parts of the recordings that are followed before the whole is.
const PARTS: [f64; 2] = [0.15, 0.5];

/// The hysteresis alone, from every start that may lead to its minimum: where the score points, as a part of the spring where there is something to explain,
/// and from short stretches, which do not know what the base model has given up, where nothing else explains it.
pub(super) fn alone<'a>(
    ground: &Ground<'a>,
    null: &Refit<'a>,
    score: Option<&Score>,
    lacks: Lacks,
) -> Option<Refit<'a>> {
    let hypothesis = null.hypothesis.and(Cause::JointHysteretic, None);
    let near = || score.and_then(|score| ground.refit_below(lacks.leads, &hypothesis, null, &score.start));
    let softened = || (lacks.unexplained || lacks.seen).then(|| softened(ground, null, lacks.leads)).flatten();
    // in every joint of a strip, and from no memory in each stretch, it is too dear
    let anew =
        || (lacks.unsolved && !ground.is_strip()).then(|| ground.refit_anew(&hypothesis, &[], null.chi2)).flatten();
    let (near, (softened, anew)) = rayon::join(near, || rayon::join(softened, anew));
    [near, softened, anew].into_iter().flatten().min_by(|a, b| a.chi2.total_cmp(&b.chi2))
}

/// The hysteresis where it makes up a part of what the base model takes for the spring: from the best of several such starts, if that leads below `bound`.
fn softened<'a>(ground: &Ground<'a>, null: &Refit<'a>, bound: f64) -> Option<Refit<'a>> {
    let hypothesis = null.hypothesis.and(Cause::JointHysteretic, None);
    let starts = starts(ground, null, &YIELD_SHARES, &SPRING_SHARES, &[1.0])?;
    let costed = starts.into_iter().map(|start| (ground.cost_at(&hypothesis, null, &start), start));
    let (_, best) = costed.min_by(|a, b| a.0.total_cmp(&b.0))?;
    if ground.is_strip() {
        return ground.begin(&hypothesis, null, &best);
    }
    ground.refit_below(bound, &hypothesis, null, &best)
}

/// Where a hysteresis beside a fit may start: with these yield angles, as parts of the largest bend, as these parts of the spring, the spring being as many times
/// as stiff before it yields as that fit has it.
fn starts(
    ground: &Ground<'_>,
    fit: &Refit<'_>,
    yield_shares: &[f64],
    spring_shares: &[f64],
    stiffer: &[f64],
) -> Option<Vec<Vec<(Parameter, f64)>>> {
    let spring = fit.problem.free.iter().copied().find(|parameter| parameter.is_spring())?;
    let stiffness = fit.problem.model(0, &fit.x[..fit.problem.free.len()]).ok()?.0.value(Parameter::JointStiffness)?;
    // a base model that has locked its joint is no guide to the damper
    let damping = fit.value(Parameter::JointDamping).unwrap_or(0.0).min(ground.experiment.model.c_eq_n_m_s_per_rad);
    let mut starts = Vec::new();
    for yield_rad in yield_shares.iter().map(|share| share * ground.largest_bend_rad()) {
        for (share, scale) in spring_shares.iter().flat_map(|share| stiffer.iter().map(move |scale| (share, scale))) {
            starts.push(vec![
                (spring, (1.0 - share) * scale * fit.value(spring).unwrap_or(0.0)),
                // what it loses the base model took for the damper's
                (Parameter::JointDamping, (1.0 - share) * damping),
                (Parameter::HysteresisTorque, share * scale * stiffness * yield_rad),
                (Parameter::HysteresisYield, yield_rad),
            ]);
        }
    }
    Some(starts)
}

/// The hysteresis beside a fit from wherever it may be: its sum of squares has many false minima, of a whole recording far more than of its beginning.
pub(super) fn anywhere<'a>(ground: &Ground<'a>, fit: &Refit<'a>) -> Option<Refit<'a>> {
    let hypothesis = fit.hypothesis.and(Cause::JointHysteretic, None);
    let starts = starts(ground, fit, &EVERY_YIELD, &EVERY_SHARE, &STIFFER)?;
    let fit = &ground.seen_to_start(fit);
    let [beginning, first_half] = PARTS.map(|part| growing::first_part(ground.records, part));
    let (beginning, first_half) = (ground.on(&beginning), ground.on(&first_half));
    let cost = |start: Vec<(Parameter, f64)>| (beginning.cost_at(&hypothesis, fit, &start), start);
    let mut costed: Vec<_> = starts.into_par_iter().with_max_len(1).map(cost).collect();
    costed.sort_by(|a, b| a.0.total_cmp(&b.0));
    costed.truncate(BEGUN);
    let begun = costed.par_iter().with_max_len(1).filter_map(|(_, start)| {
        let begun = beginning.begin(&hypothesis, fit, start)?;
        beginning.again(&begun, ground::FEW_STEPS)
    });
    let mut begun: Vec<(f64, Vec<f64>)> = begun.map(|begun| (begun.chi2, begun.x)).collect();
    begun.sort_by(|a, b| a.0.total_cmp(&b.0));
    begun.truncate(ENDED);
    let ended = begun.into_par_iter().with_max_len(1).filter_map(|(_, x)| {
        let half = first_half.descend_from(&hypothesis, x, ground::FEW_STEPS)?;
        ground.descend_from(&hypothesis, half.x, ground::MOST_STEPS)
    });
    ended.min_by(|a, b| a.chi2.total_cmp(&b.chi2))
}
