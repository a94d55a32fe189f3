//! The answer: a diagnosis that owns all it says, and is written as it stands, freeswing.diagnosis/1.

use std::collections::BTreeMap;
use std::path::PathBuf;

use serde::Serialize;

use super::adequacy::Detectable;
use super::effect::{Effect, Phase, Place};
use super::findings::Findings;
use super::latent::Latent;
use super::law_report::LearntLaw;
use super::misfit::is_beyond_noise;
use super::posterior::{Candidate, left_of_excess};
pub use super::quantity::{Parameters, Quantity};
use super::refit::Refit;
use super::search::RoundEnd;
use super::settings::CertificateSettings;
use super::torque::MissingTorque;
use super::verdict::Status;
use super::{energy, locate};
use crate::fit::Residuals;
use crate::model::Parameter;

/// Candidates written.
const WRITTEN: usize = 25;

/// The answer.
#[derive(Debug, Clone, Serialize)]
pub struct Diagnosis {
    /// The format.
    pub schema: &'static str,
    /// Its name.
    pub specimen: String,
    /// The base model.
    pub baseline: Baseline,
    /// Where it differs from the recordings.
    #[serde(rename = "where")]
    pub location: Location,
    /// The hypotheses, likeliest first.
    pub candidates: Vec<Hypothetical>,
    /// The verdict.
    pub verdict: Answer,
    /// The prediction of what was not fitted.
    pub heldout: Option<Proof>,
    /// What could have been seen.
    pub detectable: Limits,
    /// What each round of the search came to.
    pub search: Vec<RoundEnd>,
    /// Rounds of the search that its budget did not allow.
    pub undecided: Vec<&'static str>,
    /// What a figure shows.
    #[serde(skip)]
    pub drawn: Option<Drawn>,
}

/// The base model beside the first recording.
#[derive(Debug, Clone, Serialize)]
pub struct Baseline {
    /// As fitted.
    pub parameters: Parameters,
    /// What it leaves of each angle.
    pub rmse_rad: Vec<f64>,
    /// Noise of each angle.
    pub noise_rad: Vec<f64>,
    /// How it goes on from row to row…
    pub noise_correlation: Vec<f64>,
    /// … and which share of it does.
    pub noise_share_correlated: Vec<f64>,
    /// Its correlation from angle to angle.
    pub noise_correlation_across: f64,
    /// Whether the base model is enough.
    pub adequate: bool,
    /// How often chance alone leaves residuals as conspicuous.
    pub p_value: f64,
}

/// Where the base model differs from the recordings.
#[derive(Debug, Clone, Serialize)]
pub struct Location {
    /// Where what is missing acts.
    pub place: Option<Place>,
    /// Share of each place in the energy lost, by the likeliest model.
    pub energy_share: BTreeMap<&'static str, f64>,
    /// From and until when the base model departs.
    pub time_s: Option<[f64; 2]>,
    /// Amplitudes there.
    pub amplitude_rad: Option<[f64; 2]>,
    /// With what the missing torque goes.
    pub phase: Option<Phase>,
    /// Strongest frequency of what the base model leaves.
    pub frequency_hz: Option<f64>,
    /// The same in words.
    pub statement: String,
    /// The torque that the base model lacks.
    pub missing_torque: Option<Lacking>,
    /// Root mean square of the torque of the likeliest effects.
    pub named_torque_n_m: f64,
    /// The unknown around the likeliest hypothesis.
    pub unknown: Vec<Unknown>,
}

/// The torque that the base model lacks, in numbers.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Lacking {
    /// Where.
    pub place: Place,
    /// Root mean square.
    pub rms: f64,
    /// Of it.
    pub unit: &'static str,
    /// With what it goes.
    pub phase: Option<Phase>,
    /// Its strongest frequency.
    pub frequency_hz: Option<f64>,
    /// What it takes of the energy lost.
    pub energy_share: Option<f64>,
}

/// An unknown of some form at some place.
#[derive(Debug, Clone, Serialize)]
pub struct Unknown {
    /// Where.
    pub place: Place,
    /// `course` or `law`.
    pub form: &'static str,
    /// Its likeliest size.
    pub size: f64,
    /// How much likelier it makes the recordings.
    pub log_likelihood_gain: f64,
    /// The same of each size tried.
    pub tried: Vec<(f64, f64)>,
}

/// A hypothesis, fitted and weighed.
#[derive(Debug, Clone, Serialize)]
pub struct Hypothetical {
    /// The effects beside the base model.
    pub effects: Vec<Effect>,
    /// Its posterior probability.
    pub probability: f64,
    /// The same where nothing outside the table is at work.
    pub probability_if_named: f64,
    /// The effects' coefficients.
    pub parameters: Parameters,
    /// From which stamp on frames are missing.
    pub dropped_at_s: Option<f64>,
    /// What it leaves of each angle.
    pub rmse_rad: Vec<f64>,
    /// Over the noise.
    pub chi2: f64,
    /// Schwarz's criterion.
    pub bic: f64,
    /// How far the fit may be trusted to be the best of its hypothesis.
    pub fit: Trust,
    /// The coefficients in the order of the effects.
    #[serde(skip)]
    pub coefficients: Vec<(Parameter, Quantity)>,
}

/// How far a fit may be trusted to be the best of its hypothesis.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Trust {
    /// Nothing is to be gained where it stands.
    pub converged: bool,
    /// Independent starts that ended there.
    pub starts_agreeing: usize,
    /// It leaves no more than any fit of a hypothesis within its own.
    pub nested_ok: bool,
    /// All of that, of as many starts as it takes: it counts.
    pub certified: bool,
}

/// The verdict.
#[derive(Debug, Clone, Serialize)]
pub struct Answer {
    /// What kind.
    pub status: Status,
    /// The names that explain most, at most two.
    pub effects: Vec<Effect>,
    /// Those beside them.
    pub further_effects: Vec<Effect>,
    /// All that the recordings do not tell from them.
    pub class: Vec<Effect>,
    /// Of the answer as it is given.
    pub probability: f64,
    /// That probability with every rival whose fit is not certified as good as the best, and without them.
    pub probability_interval: [f64; 2],
    /// Those rivals.
    pub uncertified: Vec<Vec<Effect>>,
    /// That the truth is in the class.
    pub class_probability: f64,
    /// Of anything outside the table.
    pub unknown_probability: f64,
    /// How probable each effect of the table is, over all sets of names that hold it, whatever remains beside them.
    pub inclusion: BTreeMap<&'static str, f64>,
    /// What remains beside the names.
    pub remainder: Remainder,
    /// What that was learnt to be.
    pub law: Option<LearntLaw>,
    /// The same in words.
    pub statement: String,
    /// The measurement that would split the class.
    pub to_decide: Option<String>,
    /// Whether the names leave so much more than noise that they are weighed among themselves.
    #[serde(skip)]
    pub among_themselves: bool,
}

/// What the names leave of the first recording, or the base model where there are none.
#[derive(Debug, Clone, Serialize)]
pub struct Remainder {
    /// The probability that it is more than noise.
    pub present: f64,
    /// Where it would act.
    pub place: Option<Place>,
    /// With what it goes.
    pub phase: Option<Phase>,
    /// Its strongest frequency.
    pub frequency_hz: Option<f64>,
    /// Of each angle, noise included.
    pub rms_rad: Vec<f64>,
    /// The same over the noise.
    pub over_noise: Vec<f64>,
    /// Its part of what the base model leaves beyond the noise.
    pub share: f64,
}

impl Remainder {
    fn of(findings: &Findings<'_>) -> Self {
        let named = findings.named();
        let rms_rad = rmse_rad(named);
        let over_noise = rms_rad.iter().zip(&named.problem.noise[0].sd_rad).map(|(rms, noise)| rms / noise).collect();
        let locate::Departure { goes_with, frequency_hz, .. } = findings.remaining;
        let present = findings.posterior.remains;
        Self {
            present,
            place: findings.remains_at(),
            phase: goes_with,
            frequency_hz,
            rms_rad,
            over_noise,
            share: left_of_excess(named, findings.posterior.base()).min(1.0),
        }
    }
}

/// What was not fitted, predicted.
#[derive(Debug, Clone, Serialize)]
pub struct Proof {
    /// From which stamp on.
    pub from_s: f64,
    /// Of which recording.
    pub recording: PathBuf,
    /// What the base model leaves of each angle.
    pub baseline_rmse_rad: Vec<f64>,
    /// What the whole answer does: the names, and the law that was learnt beside them.
    pub augmented_rmse_rad: Vec<f64>,
    /// What the names do without it.
    pub named_rmse_rad: Vec<f64>,
    /// Noise of each angle.
    #[serde(skip)]
    pub noise_rad: Vec<f64>,
}

/// What could have been seen, by the effects' identifiers in the order of the table.
#[derive(Debug, Clone)]
pub struct Limits(pub Vec<Detectable>);

impl Serialize for Limits {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(self.0.iter().map(|limit| (limit.effect, Limit::of(limit))))
    }
}

/// What of one effect could have been seen.
#[derive(Serialize)]
struct Limit<'l> {
    smallest: Option<f64>,
    named_from: Option<f64>,
    unit: &'static str,
    confused_with: &'l [Effect],
}

impl<'l> Limit<'l> {
    fn of(limit: &'l Detectable) -> Self {
        Self {
            smallest: limit.smallest.is_finite().then_some(limit.smallest),
            named_from: limit.named.is_finite().then_some(limit.named),
            unit: limit.parameter.unit(),
            confused_with: &limit.confused_with,
        }
    }
}

/// Both models beside the first recording.
#[derive(Debug, Clone)]
pub struct Drawn {
    /// What the base model leaves.
    pub before: Residuals,
    /// The effects named, and what is left with them.
    pub after: Option<(Vec<Effect>, Residuals)>,
    /// What is left with the law that was learnt as well.
    pub learnt: Option<Residuals>,
    /// From here on both are predictions.
    pub border_s: Option<f64>,
    /// Period of the swing.
    pub swing_s: f64,
    /// What the base model lacks, of the model and not of the camera.
    pub torque: Option<MissingTorque>,
}

impl Diagnosis {
    /// From all that was found about a specimen of some name.
    pub fn of(findings: &Findings<'_>, specimen: &str) -> Self {
        let best = findings.posterior.best();
        let candidates = findings.posterior.candidates.iter().take(WRITTEN);
        let certificate = &findings.context.settings.certificate;
        let energy_shares = energy::energy_shares(best);
        Self {
            schema: "freeswing.diagnosis/1",
            specimen: specimen.to_owned(),
            baseline: Baseline::of(findings),
            location: Location::of(findings, energy_shares),
            candidates: candidates.map(|candidate| Hypothetical::of(candidate, certificate)).collect(),
            verdict: Answer::of(findings),
            heldout: Proof::of(findings),
            detectable: Limits(findings.adequacy.detectable.clone()),
            search: findings.rounds.clone(),
            undecided: findings.undecided.clone(),
            drawn: Drawn::of(findings),
        }
    }
}

impl Baseline {
    fn of(findings: &Findings<'_>) -> Self {
        let base = findings.posterior.base();
        let noise = &base.problem.noise[0];
        Self {
            parameters: quantities(base, &base.problem.free).into_iter().map(|(p, q)| (p.id(), q)).collect(),
            rmse_rad: rmse_rad(base),
            noise_rad: noise.sd_rad.clone(),
            noise_correlation: noise.colour.iter().map(|colour| colour.rho).collect(),
            noise_share_correlated: noise.colour.iter().map(|colour| colour.share).collect(),
            noise_correlation_across: noise.across,
            adequate: findings.verdict.status == Status::Adequate,
            p_value: findings.adequacy.p_value,
        }
    }
}

impl Location {
    fn of(findings: &Findings<'_>, energy_shares: [f64; 3]) -> Self {
        let locate::Departure { time_s, amplitude_rad, frequency_hz, .. } = findings.departure;
        Self {
            place: findings.place(),
            energy_share: Place::OF_LOSSES
                .iter()
                .zip(energy_shares)
                .map(|(place, share)| (place.id(), share))
                .collect(),
            time_s,
            amplitude_rad,
            phase: findings.phase(),
            frequency_hz,
            statement: findings.place_statement(energy_shares),
            missing_torque: findings.missing_torque.as_ref().map(Lacking::of),
            named_torque_n_m: energy::added_torque_n_m(findings.posterior.best()),
            unknown: findings.posterior.unknowns.iter().map(Unknown::of).collect(),
        }
    }
}

impl Lacking {
    fn of(torque: &MissingTorque) -> Self {
        Self {
            place: torque.place,
            rms: torque.rms,
            unit: if torque.place == Place::Camera { "rad" } else { "N m" },
            phase: torque.phase,
            frequency_hz: torque.frequency_hz,
            energy_share: torque.energy_share,
        }
    }
}

impl Unknown {
    fn of(latent: &Latent) -> Self {
        Self {
            place: latent.place(),
            form: latent.form.id(),
            size: latent.size,
            log_likelihood_gain: latent.gain,
            tried: latent.tried.clone(),
        }
    }
}

impl Hypothetical {
    fn of(candidate: &Candidate<'_>, settings: &CertificateSettings) -> Self {
        let fit = &candidate.fit;
        let coefficients = quantities(fit, &fit.added());
        Self {
            effects: fit.hypothesis.effects.clone(),
            probability: candidate.probability,
            probability_if_named: candidate.if_named,
            parameters: coefficients.iter().map(|(parameter, quantity)| (parameter.id(), *quantity)).collect(),
            dropped_at_s: fit.hypothesis.dropped.map(|dropped| dropped.1),
            rmse_rad: rmse_rad(fit),
            chi2: fit.chi2,
            bic: fit.chi2 + fit.x.len() as f64 * (fit.values() as f64).ln(),
            fit: Trust {
                converged: fit.converged,
                starts_agreeing: fit.certificate.starts_agreeing,
                nested_ok: fit.certificate.nested_ok,
                certified: fit.is_certified(settings),
            },
            coefficients,
        }
    }
}

impl Answer {
    fn of(findings: &Findings<'_>) -> Self {
        let verdict = &findings.verdict;
        let settings = findings.context.settings;
        // the format gives two names; what a rig has beside them stands by itself
        let explaining = findings.named_effects();
        let main: Vec<Effect> = explaining.into_iter().take(settings.search.main_effects).collect();
        let (effects, further_effects) = verdict.effects.iter().partition(|effect| main.contains(effect));
        Self {
            status: verdict.status,
            effects,
            further_effects,
            class: verdict.class.clone(),
            probability: verdict.probability,
            probability_interval: findings.probability_interval(),
            uncertified: findings.posterior.uncertified.clone(),
            class_probability: verdict.class_probability,
            unknown_probability: verdict.unknown,
            inclusion: Effect::ALL.iter().map(|effect| (effect.id(), findings.posterior.inclusion(*effect))).collect(),
            remainder: Remainder::of(findings),
            law: findings.learnt.as_ref().and_then(LearntLaw::of),
            statement: findings.verdict_statement(),
            to_decide: verdict.to_decide.clone(),
            among_themselves: is_beyond_noise(findings.named(), &settings.noise),
        }
    }
}

impl Proof {
    fn of(findings: &Findings<'_>) -> Option<Self> {
        let held_out = findings.held_out.as_ref()?;
        let named_rmse_rad = held_out.augmented.rmse_rad.clone();
        let of_learnt = findings.learnt.as_ref().map(|learnt| learnt.prediction.rmse_rad.clone());
        Some(Self {
            from_s: held_out.from_s,
            recording: findings.context.records[held_out.record].path.clone(),
            baseline_rmse_rad: held_out.baseline.rmse_rad.clone(),
            augmented_rmse_rad: of_learnt.unwrap_or_else(|| named_rmse_rad.clone()),
            named_rmse_rad,
            noise_rad: findings.posterior.base().problem.noise[held_out.record].sd_rad.clone(),
        })
    }
}

impl Drawn {
    fn of(findings: &Findings<'_>) -> Option<Self> {
        let (base, named) = (findings.posterior.base(), findings.named());
        let (model, _) = base.problem.model(0, &base.x[..base.problem.free.len()]).ok()?;
        let predicted = findings.held_out.as_ref().and_then(|held_out| {
            let after = if named.hypothesis.effects.is_empty() { &held_out.baseline } else { &held_out.augmented };
            Some((held_out.baseline.left.clone()?, after.left.clone()?, Some(held_out.from_s)))
        });
        let fitted = || Some((base.residuals(0)?, named.residuals(0)?, None));
        let (before, after, border_s) = predicted.or_else(fitted)?;
        let effects = named.hypothesis.effects.clone();
        let learnt = findings.learnt.as_ref().and_then(|learnt| match border_s {
            Some(_) => learnt.prediction.left.clone(),
            None => learnt.fit.residuals(0),
        });
        Some(Self {
            learnt,
            before,
            after: (!effects.is_empty()).then_some((effects, after)),
            border_s,
            swing_s: std::f64::consts::TAU / model.pace_rad_s(),
            torque: findings.missing_torque.clone().filter(|torque| !torque.works_on.is_empty()),
        })
    }
}

fn quantities(fit: &Refit<'_>, of: &[Parameter]) -> Vec<(Parameter, Quantity)> {
    let covariance = fit.covariance(of);
    let one = |(i, p): (usize, &Parameter)| {
        (*p, Quantity { value: fit.value(*p), sd: covariance[(i, i)].sqrt(), unit: p.unit() })
    };
    of.iter().enumerate().map(one).collect()
}

fn rmse_rad(fit: &Refit<'_>) -> Vec<f64> {
    fit.residuals(0).map(|left| left.rmse_rad).unwrap_or_default()
}
