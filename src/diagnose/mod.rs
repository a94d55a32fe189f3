//! What the model lacks: where simulation and recording differ, the physics left out, and the proof that it was that.
//!
//! | file | holds |
//! |---|---|
//! | [`cause`] | the table of effects |
//! | [`noise`] | the noise, from where the motion has no power |
//! | [`ground`] | what all fits share, and the ways to make one |
//! | [`refit`] | the base model with some effects, fitted |
//! | [`dropped`] | at which instant frames are missing |
//! | [`hysteresis`] | where its fit starts, and in which variables |
//! | [`pieces`] | how many rods stand for a strip |
//! | [`screen`] | which would lower the residuals |
//! | [`preparation`] | outliers, noise, where the base model's descent starts |
//! | [`search`] | the way through what follows, with the file at its word or loosely |
//! | [`selection`] | which are fitted in full |
//! | [`single`] | one effect beside a fit, from every start that may lead to it |
//! | [`fine_strip`] | a strip that bends everywhere, as finely as it needs |
//! | [`second_look`] | from further starts, where much is left |
//! | [`growing`] | from the beginning of the recordings on, where still more is |
//! | [`stepwise`] | more effects than two |
//! | [`evidence`] | how probable each is |
//! | [`surroundings`] | what a small torque would have done |
//! | [`latent`] | the unknown torque, of any course |
//! | [`any_law`] | the same, as a law of any form |
//! | [`torque`] | its course |
//! | [`energy`] | the work of the laws |
//! | [`locate`] | place, time, amplitude, phase |
//! | [`verdict`] | the answer, its class, what would decide |
//! | [`heldout`] | the proof |
//! | [`mod@adequacy`] | is the base model enough? |
//! | [`plan`] | the same before an experiment |

pub mod adequacy;
pub mod any_law;
pub mod cause;
pub mod dropped;
pub mod energy;
pub mod evidence;
pub mod fine_strip;
pub mod ground;
pub mod growing;
pub mod heldout;
pub mod hysteresis;
pub mod latent;
pub mod locate;
pub mod noise;
pub mod pieces;
pub mod plan;
pub mod preparation;
pub mod refit;
pub mod screen;
pub mod search;
pub mod second_look;
pub mod selection;
pub mod single;
pub mod stepwise;
pub mod surroundings;
pub mod torque;
pub mod verdict;

use crate::error::Result;
use crate::experiment::Experiment;
use crate::progress::Progress;
use search::Found;

pub use adequacy::Detectable;
pub use cause::{Cause, Place};
pub use ground::{Ground, Hypothesis};
pub use heldout::HeldOut;
pub use latent::{Assumed, Beyond, Form, Latent};
pub use locate::Departure;
pub use plan::{Plan, planned};
pub use preparation::{Prepared, prepare};
pub use refit::Refit;
pub use torque::{MissingTorque, Phase};
pub use verdict::{Status, Verdict, Weighed, Weighing};

/// Effects that an answer has at first, those that explain most; further ones stand beside them.
pub const MAIN_EFFECTS: usize = 2;
/// Where far more than noise is left, a further one must leave at most this part of what they do of what was not fitted.
const BORNE_OUT: f64 = 0.9;
/// What is at least this probable counts.
const EVEN: f64 = 0.5;
/// Everything a diagnosis says.
#[derive(Debug)]
pub struct Diagnosis<'a> {
    /// The hypotheses, likeliest first.
    pub weighed: Vec<Weighed<'a>>,
    /// The unknown around the likeliest one, at each place, likeliest first.
    pub unknowns: Vec<Latent>,
    /// Root mean square of the torque of the likeliest one's effects (N·m).
    pub added_torque_n_m: f64,
    /// The verdict.
    pub verdict: Verdict,
    /// Where and when the base model departs.
    pub departure: Departure,
    /// Where the unknown acts, where it is at least as likely as any name.
    pub unknown_at: Option<Place>,
    /// The torque that the base model lacks, there or where it explains most.
    pub missing_torque: Option<MissingTorque>,
    /// Share of hinge, joint and air in the energy lost, by the likeliest model.
    pub energy_shares: [f64; 3],
    /// The prediction of what was not fitted.
    pub held_out: Option<HeldOut>,
    /// What could have been seen.
    pub detectable: Vec<Detectable>,
    /// p of the base model.
    pub p_value: f64,
    /// What all fits share: the noise, and how much of it is correlated from row to row.
    pub ground: Ground<'a>,
}

impl<'a> Diagnosis<'a> {
    /// The base model.
    pub fn null(&self) -> &Refit<'a> {
        base_model(&self.weighed)
    }

    /// The part of what the base model leaves beyond the noise that the named fit explains.
    pub fn explained(&self) -> f64 {
        let values: usize = self.null().problem.records.iter().map(|r| r.values(0..r.len())).sum();
        let beyond = |fit: &Refit<'_>| (fit.chi2 - values as f64).max(0.0);
        1.0 - beyond(self.named()) / beyond(self.null()).max(1.0)
    }

    /// The effects named, the one that explains most first.
    pub fn named_effects(&self) -> Vec<Cause> {
        by_what_they_explain(&self.weighed, self.named())
    }

    /// Where what is missing acts.
    pub fn place(&self) -> Option<Place> {
        match self.verdict.status {
            Status::Adequate => None,
            _ => self.unknown_at.or_else(|| self.named_effects().first().map(|cause| cause.place())),
        }
    }

    /// The fit that the verdict names; the likeliest of the table where something else is at work; the base model where that is enough.
    pub fn named(&self) -> &Refit<'a> {
        match self.verdict.status {
            Status::Adequate => self.null(),
            _ => &self.weighed[0].fit,
        }
    }
}

/// What may be asked of a diagnosis.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Options {
    /// Recordings made anew from the base model and fitted, to judge it by; with none, residuals are made anew to first order.
    pub bootstraps: usize,
    /// The stamp from which on a single recording is predicted; two thirds through it otherwise.
    pub predict_from_s: Option<f64>,
}

/// Diagnoses recordings of one specimen.
///
/// # Errors
/// [`crate::error::Error::Simulation`] where the specimen cannot swing, or no motion near the start values follows the recording.
pub fn diagnose<'a>(
    prepared: &'a Prepared,
    experiment: &'a Experiment,
    options: &Options,
    progress: &dyn Progress,
) -> Result<Diagnosis<'a>> {
    let mut found = search::at_its_word(prepared, experiment, progress)?;
    let weigh = |found: &Found<'a>| {
        verdict::weigh(found.fits.clone(), found.ground.values(), found.causes.len(), |fit, variance| {
            (locate::unknowns(fit, variance, Assumed::BESIDE), energy::added_torque_n_m(fit))
        })
    };
    progress.begin("weighing", None);
    let mut answer = weigh(&found);
    // a strip's fits are too dear to be followed from the beginning
    if !found.ground.is_strip() && (answer.unknown > EVEN || found.leaves_more_than_noise()) {
        found = search::doubted(prepared, experiment, found, progress);
        answer = weigh(&found);
    }
    let best = &answer.weighed[0].fit;
    let fewer = (best.hypothesis.causes.len() > MAIN_EFFECTS && verdict::is_beyond_noise(best)).then(|| {
        found.fits.retain(|fit| fit.hypothesis.causes.len() <= MAIN_EFFECTS);
        weigh(&found)
    });
    let Found { ground, causes, .. } = found;
    progress.begin("proof", None);
    let (proofs, adequacy) = {
        let null = base_model(&answer.weighed);
        let named: Vec<&Refit<'a>> = std::iter::once(&answer).chain(&fewer).map(|a| &a.weighed[0].fit).collect();
        rayon::join(
            || heldout::held_out(&ground.plain(), null, &named, options.predict_from_s),
            || adequacy::adequacy(&ground, null, &causes, options.bootstraps, progress),
        )
    };
    let (Weighing { weighed, unknown, unknowns }, held_out) = borne_out(answer, fewer, proofs);
    let marks = ground.records[0].links();
    let null = base_model(&weighed);
    let best = &weighed[0].fit;
    let verdict = Verdict::of(&weighed, unknown, marks, held_out.as_ref());
    let of_nearest = by_what_they_explain(&weighed, best).first().map(|cause| cause.place());
    let unknown_at = if verdict.leaves_it_open() { locate::place_of_all(null, of_nearest) } else { None };
    Ok(Diagnosis {
        verdict,
        unknown_at,
        departure: locate::departure(null),
        missing_torque: torque::missing(best, null, unknown_at),
        added_torque_n_m: energy::added_torque_n_m(best),
        energy_shares: energy::energy_shares(best),
        p_value: adequacy.p_value,
        detectable: adequacy.detectable,
        held_out,
        unknowns,
        weighed,
        ground,
    })
}

/// The answer, or that with fewer effects unless the further one predicts what was not fitted much better; and its proof. Where the model's own error is far
/// above the noise, that of what was fitted always falls.
fn borne_out<'a>(
    answer: Weighing<'a>,
    fewer: Option<Weighing<'a>>,
    proofs: Vec<Option<HeldOut>>,
) -> (Weighing<'a>, Option<HeldOut>) {
    let mut proofs = proofs.into_iter();
    let proof = proofs.next().flatten();
    let leaves = |proof: &Option<HeldOut>| proof.as_ref().map_or(f64::INFINITY, HeldOut::leaves);
    match (fewer, proofs.next().flatten()) {
        (Some(fewer), other) if leaves(&proof) > BORNE_OUT * leaves(&other) => (fewer, other),
        _ => (answer, proof),
    }
}

/// The base model's fit, which every selection holds.
fn base_model<'w, 'a>(weighed: &'w [Weighed<'a>]) -> &'w Refit<'a> {
    weighed.iter().find(|w| w.fit.hypothesis.causes.is_empty()).map_or(&weighed[0].fit, |w| &w.fit)
}

/// A fit's effects, the one that explains most first: without which it would be worst.
fn by_what_they_explain(weighed: &[Weighed<'_>], fit: &Refit<'_>) -> Vec<Cause> {
    let mut causes = fit.hypothesis.causes.clone();
    let left_without = |cause: &Cause| {
        let others: Vec<Cause> = fit.hypothesis.causes.iter().copied().filter(|c| c != cause).collect();
        weighed.iter().find(|w| w.fit.hypothesis.causes == others).map_or(f64::INFINITY, |w| w.fit.chi2)
    };
    causes.sort_by(|a, b| left_without(b).total_cmp(&left_without(a)));
    causes
}
