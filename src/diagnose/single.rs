//! One effect beside a fit, from every start that may lead to its minimum; and how much there is to explain, which decides from how many.

use rayon::prelude::*;

use super::ground::{self, Ground};
use super::refit::{MUCH_LEFT, OUT_OF_STEP, Refit, least_chi2};
use super::screen::{Score, Screen};
use super::{Cause, dropped, hysteresis};
use crate::progress::Progress;

/// An effect beside another must lower χ² by this to be worth much.
pub(super) const WORTH: f64 = 9.0;
/// χ² beyond its expectation by this many standard deviations is worth a dear hypothesis.
const SOMETHING_LEFT: f64 = 4.0;
/// Where less than this many times the noise is left, in χ², many laws do as well as each other.
const LITTLE: f64 = 2.0;
/// The part of what a fit leaves beyond the noise that the first steps from a dear start must explain.
const LEADS: f64 = 0.005;

/// How much a fit lacks, which decides from how many starts an effect is fitted.
#[derive(Debug, Clone, Copy)]
pub(super) struct Lacks {
    /// χ² from which on a fit leaves more than noise.
    too_much: f64,
    /// It leaves more than noise.
    pub unexplained: bool,
    /// And so does every other effect beside it, as far as that is known; or it leaves so little that many may explain it.
    pub unsolved: bool,
    /// It leaves little.
    little: bool,
    /// Its motion has lost step with a recording.
    out_of_step: bool,
    /// An effect that is not scanned for would explain some of it.
    pub seen: bool,
    /// A dear start leads somewhere where its first steps leave less than this χ².
    pub leads: f64,
}

impl Lacks {
    pub fn of(ground: &Ground<'_>, null: &Refit<'_>, scores: &[Score]) -> Self {
        let values = ground.values() as f64;
        let too_much = values + SOMETHING_LEFT * (2.0 * values).sqrt();
        let left_share = null.left_share();
        let out_of_step = left_share > OUT_OF_STEP;
        let unexplained = left_share > MUCH_LEFT || null.chi2 > too_much;
        let least_fall = LEADS * (null.chi2 - values);
        Self {
            too_much,
            unexplained,
            unsolved: unexplained,
            little: null.chi2 < LITTLE * values,
            out_of_step,
            leads: if unexplained && !out_of_step { null.chi2 - least_fall } else { ground::BEYOND_HOPE * null.chi2 },
            seen: scores.iter().any(|s| s.gain > WORTH && !s.cause.is_scanned()),
        }
    }

    /// The same where these are fits of other effects.
    pub fn beside(self, others: &[Refit<'_>]) -> Self {
        Self { unsolved: self.unexplained && (self.little || least_chi2(others) > self.too_much), ..self }
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
    let Lacks { too_much, unexplained, out_of_step, leads, .. } = lacks;
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
                tries.extend(score.further.iter().map(|start| ground.refit_below(leads, &hypothesis, null, start)));
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
