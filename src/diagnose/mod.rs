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
//! | [`selection`] | which are fitted in full |
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
pub mod refit;
pub mod screen;
pub mod second_look;
pub mod selection;
pub mod stepwise;
pub mod surroundings;
pub mod torque;
pub mod verdict;

use std::sync::OnceLock;

use crate::error::{Error, Result};
use crate::experiment::Experiment;
use crate::fit::shooting::multiple_shooting;
use crate::fit::whitening::{Colour, RecordNoise};
use crate::fit::{Belief, Problem, Record, base_parameters};
use crate::model::{ForwardModel, Parameter};
use crate::progress::Progress;

pub use adequacy::Detectable;
pub use cause::{Cause, Place};
pub use ground::{Ground, Hypothesis};
pub use heldout::HeldOut;
pub use latent::{Assumed, Beyond, Form, Latent};
pub use locate::Departure;
pub use plan::{Plan, planned};
pub use refit::Refit;
pub use torque::{MissingTorque, Phase};
pub use verdict::{Status, Verdict, Weighed, Weighing};

/// A length or an inertia of a rig is known to this share.
const GEOMETRY_SHARE: f64 = 0.1;
/// Effects that an answer has at first, those that explain most; further ones stand beside them.
pub const MAIN_EFFECTS: usize = 2;
/// Where far more than noise is left, a further one must leave at most this part of what they do of what was not fitted.
const BORNE_OUT: f64 = 0.9;
/// What is at least this probable counts.
const EVEN: f64 = 0.5;
/// Springs to start from, over the file's, where that leads nowhere.
const SPRINGS: [f64; 3] = [0.03, 30.0, 1e-3];
/// Correlation of the noise from row to row that counts as colour.
const COLOURED: f64 = 0.12;

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

/// What the recordings, cleaned of outliers, are held against.
pub struct Prepared {
    /// Cleaned.
    pub records: Vec<Record>,
    pub noise: Vec<RecordNoise>,
    step_error_rad: f64,
    /// Parameters of the base model, taken at the file's word.
    base: Vec<Parameter>,
    /// Their values and the starts to descend from.
    x: Vec<f64>,
    /// The experiment with as many rods as the recordings ask for, where they do.
    counted: OnceLock<Experiment>,
}

/// How the file is taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Taken {
    /// At its word: the geometry is what it states, and one link has a damper where it states one.
    AtItsWord,
    /// Loosely: inertias and centres of mass of general links were measured to about a tenth, and whatever swings has a damper.
    Loosely,
}

/// The base model's parameters and what is known of them.
fn base_of(experiment: &Experiment, marks: usize, taken: Taken) -> Result<(Vec<Parameter>, Vec<Belief>)> {
    let mut base = base_parameters(experiment, marks);
    if taken == Taken::AtItsWord {
        if lacks_a_damper(experiment, marks) {
            base.retain(|parameter| *parameter != Parameter::HingeViscous);
        }
        return Ok((base, Vec::new()));
    }
    let mut beliefs = Vec::new();
    if !experiment.specimen.links.is_empty() {
        let model = ForwardModel::of(experiment)?;
        let uncertain: &[Parameter] = match marks {
            1 => &[Parameter::FirstInertia],
            _ => &[Parameter::FirstInertia, Parameter::FirstCom, Parameter::SecondInertia, Parameter::SecondCom],
        };
        for parameter in uncertain {
            let value = model.value(*parameter).unwrap_or(0.0);
            base.push(*parameter);
            beliefs.push(Belief { parameter: *parameter, value, sd: GEOMETRY_SHARE * value.abs().max(1e-12) });
        }
    }
    Ok((base, beliefs))
}

/// Whether the file of a single link, which has no joint, states no damper: neither the hinge's nor a C.
fn lacks_a_damper(experiment: &Experiment, marks: usize) -> bool {
    marks == 1 && !experiment.model.states_damping && experiment.model.effects.hinge_viscous.is_none()
}

/// Learns the noise, leaves outliers out, and finds where the base model's descent is to start: near the file's values, and where no motion near them can
/// follow the recordings, from softer and stiffer springs.
///
/// # Errors
/// [`Error::Simulation`] where the specimen cannot swing.
pub fn prepare(records: &[Record], experiment: &Experiment) -> Result<Prepared> {
    let marks = records.first().map_or(0, Record::links);
    let (base, _) = base_of(experiment, marks, Taken::AtItsWord)?;
    let from = |spring: &f64| {
        let mut experiment = experiment.clone();
        experiment.model.k_eq_n_m_per_rad *= spring;
        if let Some(bending) = &mut experiment.model.effects.distributed_flexibility {
            *bending *= spring;
        }
        let mut problem = Problem::new(records, &experiment, &base)?;
        let shot = multiple_shooting(&mut problem)?;
        problem.integrate_below_the_noise();
        let step_error_rad = problem.accuracy.step_error_rad;
        problem.accuracy = problem.accuracy_of(problem.longest_s(), step_error_rad);
        let (kept, _) = crate::fit::without_outliers(&problem, &shot.x)?;
        Ok(Prepared {
            noise: coloured(&shot.residuals, &problem.noise),
            step_error_rad,
            base: base.clone(),
            x: shot.x,
            records: kept,
            counted: OnceLock::new(),
        })
    };
    let as_stated = from(&1.0);
    if as_stated.is_ok() {
        as_stated
    } else {
        SPRINGS.iter().find_map(|spring| from(spring).ok()).map_or(as_stated, Ok)
    }
}

/// Noise with the correlation of neighbouring residuals of each angle, where it is more than chance and the stretches' own starts make of it.
fn coloured(residuals: &[(usize, usize, f64)], white: &[RecordNoise]) -> Vec<RecordNoise> {
    let of = |record: usize, link: usize| {
        let r: Vec<f64> = residuals.iter().filter(|r| r.0 == record && r.1 == link).map(|r| r.2).collect();
        let power: f64 = r.iter().map(|v| v * v).sum();
        let rho = r.windows(2).map(|w| w[0] * w[1]).sum::<f64>() / power.max(1e-300);
        if rho > COLOURED { Colour { rho: (rho + 0.05).min(0.9), share: 1.0 } } else { Colour::default() }
    };
    let with_colour = |(record, white): (usize, &RecordNoise)| {
        let colour = (0..white.sd_rad.len()).map(|link| of(record, link)).collect();
        RecordNoise { colour, ..white.clone() }
    };
    white.iter().enumerate().map(with_colour).collect()
}

/// Diagnoses recordings of one specimen.
///
/// # Errors
/// [`Error::Simulation`] where the specimen cannot swing, or no motion near the start values follows the recording.
pub fn diagnose<'a>(
    prepared: &'a Prepared,
    experiment: &'a Experiment,
    options: &Options,
    progress: &dyn Progress,
) -> Result<Diagnosis<'a>> {
    let mut found = fitted(prepared, experiment, Taken::AtItsWord, progress)?;
    if let Some(count) = pieces::preferred(&found.0, &found.2) {
        let counted = prepared.counted.get_or_init(|| pieces::with(experiment, count));
        let again = fitted(prepared, counted, Taken::AtItsWord, progress)?;
        if pieces::is_kept(&found.0, &found.2, &again.2) {
            found = again;
        }
    }
    let weigh = |ground: &Ground<'a>, causes: &[Cause], fits: Vec<Refit<'a>>| {
        verdict::weigh(fits, ground.values(), causes.len(), |fit, variance| {
            (locate::unknowns(fit, variance, Assumed::BESIDE), energy::added_torque_n_m(fit))
        })
    };
    let mut answer = weigh(&found.0, &found.1, found.2.clone());
    // a strip's fits are too dear to be followed from the beginning
    if !found.0.is_strip() && (answer.unknown > EVEN || leaves_more_than_noise(&found.2)) {
        found = doubted(prepared, experiment, found, progress)?;
        answer = weigh(&found.0, &found.1, found.2.clone());
    }
    let (ground, causes, mut fits) = found;
    let best = &answer.weighed[0].fit;
    let fewer = (best.hypothesis.causes.len() > MAIN_EFFECTS && verdict::is_beyond_noise(best)).then(|| {
        fits.retain(|fit| fit.hypothesis.causes.len() <= MAIN_EFFECTS);
        weigh(&ground, &causes, fits)
    });
    let (proofs, adequacy) = {
        let null = base_model(&answer.weighed);
        let named: Vec<&Refit<'a>> =
            [Some(&answer), fewer.as_ref()].into_iter().flatten().map(|a| &a.weighed[0].fit).collect();
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

/// Whether the best of some fits leaves so much that the noise does not matter.
fn leaves_more_than_noise(fits: &[Refit<'_>]) -> bool {
    refit::least(fits).is_some_and(verdict::leaves_more_than_noise)
}

/// The hypotheses with the file taken loosely where it may be doubted, from the beginning of the recordings on where they leave far more than noise, and with
/// more effects beside them.
fn doubted<'a>(
    prepared: &'a Prepared,
    experiment: &'a Experiment,
    mut found: Fitted<'a>,
    progress: &dyn Progress,
) -> Result<Fitted<'a>> {
    let marks = found.0.records[0].links();
    let has_slack = !experiment.specimen.links.is_empty() || lacks_a_damper(experiment, marks);
    if has_slack && leaves_more_than_noise(&found.2) {
        found = fitted(prepared, experiment, Taken::Loosely, progress)?;
    }
    let (ground, causes, mut fits) = found;
    let mut ground = ground.plain();
    if leaves_more_than_noise(&fits) {
        let grown = growing::grown(&ground, &fits, &causes, progress);
        fits = refit::merged(fits, grown);
    }
    let fits = stepwise::with_more_and_fewer(&mut ground, fits, &causes, progress);
    let fits = selection::with_errors_in_step(&mut ground, fits);
    Ok((ground, causes, fits))
}

/// Where a base model's descent begins: what was not free when the start was sought, where the file has it.
fn begun(prepared: &Prepared, experiment: &Experiment, base: &[Parameter]) -> Result<Vec<f64>> {
    let stated = Problem::new(&prepared.records, experiment, base)?.start_values()?;
    let sought = |parameter: &Parameter| prepared.base.iter().position(|p| p == parameter);
    let parameters =
        base.iter().zip(stated).map(|(parameter, stated)| sought(parameter).map_or(stated, |at| prepared.x[at]));
    Ok(parameters.chain(prepared.x[prepared.base.len()..].iter().copied()).collect())
}

/// Ground, effects and fits of all hypotheses.
type Fitted<'a> = (Ground<'a>, Vec<Cause>, Vec<Refit<'a>>);

fn fitted<'a>(
    prepared: &'a Prepared,
    experiment: &'a Experiment,
    taken: Taken,
    progress: &dyn Progress,
) -> Result<Fitted<'a>> {
    let records = &prepared.records;
    let marks = records.first().map_or(0, Record::links);
    let (base, beliefs) = base_of(experiment, marks, taken)?;
    let begun = begun(prepared, experiment, &base)?;
    let causes: Vec<Cause> = Cause::ALL.into_iter().filter(|c| c.may_be_missing(experiment, &base, marks)).collect();
    let mut ground = Ground {
        records,
        experiment,
        base,
        beliefs,
        noise: prepared.noise.clone(),
        step_error_rad: prepared.step_error_rad,
        begun: begun.clone(),
        fine_strip: None,
    };
    let refused = || Error::Simulation {
        detail: "no motion near the start values follows the recording; check [specimen] and [model]".into(),
    };
    let nothing = Hypothesis::default();
    let null = ground.descend_from(&nothing, begun, ground::MOST_STEPS).ok_or_else(refused)?;
    let null = selection::from_weaker_dampers(&ground, null);
    let null =
        if ground.refine_noise(&null) { ground.again(&null, ground::MOST_STEPS).ok_or_else(refused)? } else { null };
    let fits = selection::fits(&mut ground, null, &causes, progress);
    if taken == Taken::Loosely {
        // they are followed from the beginning next
        return Ok((ground, causes, fits));
    }
    let fits = second_look::second_look(&mut ground, fits, &causes, progress);
    let fits = selection::with_errors_in_step(&mut ground, fits);
    Ok((ground, causes, fits))
}
