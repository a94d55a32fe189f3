//! All that was found → the answer.

use super::context::FitContext;
use super::effect::{Effect, Place};
use super::findings::Findings;
use super::latent::LatentForce;
use super::law_report::LearntLaw;
use super::misfit::is_beyond_noise;
use super::misfit::left_of_excess;
use super::posterior::Candidate;
use super::refit::Refit;
use super::report::{
    Answer, Baseline, CandidateReport, Diagnosis, Drawn, FitQuality, HoldoutResult, Limits, Location,
    MissingTorqueSummary, Pieces, Quantity, Remainder, Unknown,
};
use super::settings::CertificateSettings;
use super::torque::MissingTorque;
use super::verdict::Status;
use super::{energy, evidence, locate};
use crate::fit::Record;
use crate::model::Parameter;

/// Candidates written.
const WRITTEN: usize = 25;

impl Remainder {
    fn of(findings: &Findings<'_>) -> Self {
        let named = findings.named();
        let left = named.residuals_of_first();
        let (rms_rad, noise_rad) = left.map(|left| (left.rmse_rad, left.noise_rad)).unwrap_or_default();
        let over_noise = rms_rad.iter().zip(&noise_rad).map(|(rms, noise)| rms / noise).collect();
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

impl Diagnosis {
    /// From all that was found about a specimen of some name.
    pub fn of(findings: &Findings<'_>, specimen: &str) -> Self {
        let best = findings.posterior.best();
        let settings = &findings.context.settings;
        let is_possible = |candidate: &&Candidate<'_>| evidence::is_possible(&candidate.fit, &settings.prior);
        let candidates = findings.posterior.candidates.iter().filter(is_possible).take(WRITTEN);
        let energy_shares = energy::energy_shares(best);
        Self {
            schema: "freeswing.diagnosis/1",
            specimen: specimen.to_owned(),
            baseline: Baseline::of(findings),
            location: Location::of(findings, energy_shares),
            candidates: candidates.map(|candidate| CandidateReport::of(candidate, &settings.certificate)).collect(),
            verdict: Answer::of(findings),
            heldout: HoldoutResult::of(findings),
            detectable: Limits(findings.adequacy.detectable.clone()),
            search: findings.rounds.clone(),
            undecided: findings.undecided.clone(),
            pieces: Pieces::of(&findings.context),
            drawn: Drawn::of(findings),
        }
    }
}

impl Pieces {
    fn of(context: &FitContext<'_>) -> Option<Self> {
        let count = context.records.len();
        let whole_s: f64 = context.records.iter().map(Record::span_s).sum();
        context.is_in_pieces().then(|| Self { count, length_s: whole_s / count as f64 })
    }
}

impl Baseline {
    fn of(findings: &Findings<'_>) -> Self {
        let base = findings.posterior.base();
        let noise = &base.problem.noise[0];
        Self {
            parameters: quantities(base, &base.problem.free).into_iter().map(|(p, q)| (p.id(), q)).collect(),
            rmse_rad: rmse_rad(base),
            noise_rad: base.noise_rad(0),
            noise_correlation: noise.colour.iter().map(|colour| colour.rho).collect(),
            noise_share_correlated: noise.colour.iter().map(|colour| colour.share).collect(),
            noise_correlation_across: noise.across.strongest(),
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
            missing_torque: findings.missing_torque.as_ref().map(MissingTorqueSummary::of),
            named_torque_n_m: energy::added_torque_n_m(findings.posterior.best()),
            unknown: findings.posterior.unknowns.iter().map(Unknown::of).collect(),
        }
    }
}

impl MissingTorqueSummary {
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
    fn of(latent: &LatentForce) -> Self {
        Self {
            place: latent.place(),
            form: latent.form.id(),
            size: latent.size,
            log_likelihood_gain: latent.gain,
            tried: latent.tried.clone(),
        }
    }
}

impl CandidateReport {
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
            fit: FitQuality {
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
        let others = verdict.effects.iter().filter(|effect| !explaining.contains(effect));
        let explaining_first = explaining.iter().filter(|effect| verdict.effects.contains(effect)).chain(others);
        let main: Vec<Effect> = explaining_first.take(settings.search.main_effects).copied().collect();
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
            inclusion: findings
                .inclusions()
                .into_iter()
                .map(|(effect, probability)| (effect.id(), probability))
                .collect(),
            remainder: Remainder::of(findings),
            law: findings.learnt.as_ref().and_then(LearntLaw::of),
            statement: findings.verdict_statement(),
            to_decide: verdict.to_decide.clone(),
            among_themselves: is_beyond_noise(findings.named(), &settings.noise)
                || !verdict.effects.is_empty() && findings.posterior.unknown > settings.verdict.even,
        }
    }
}

impl HoldoutResult {
    fn of(findings: &Findings<'_>) -> Option<Self> {
        let held_out = findings.held_out.as_ref()?;
        let named_rmse_rad = held_out.augmented.rmse_rad.clone();
        let of_learnt = findings.learnt.as_ref().map(|learnt| learnt.prediction.rmse_rad.clone());
        Some(Self {
            from_s: held_out.from_s,
            recording: findings.context.records[held_out.record].path.clone(),
            whole_recording: findings.context.recordings() > 1,
            baseline_rmse_rad: held_out.baseline.rmse_rad.clone(),
            augmented_rmse_rad: of_learnt.unwrap_or_else(|| named_rmse_rad.clone()),
            named_rmse_rad,
            noise_rad: findings.posterior.base().noise_rad(held_out.record),
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
        let fitted = || Some((base.residuals_of_first()?, named.residuals_of_first()?, None));
        let (before, after, border_s) = predicted.or_else(fitted)?;
        let effects = named.hypothesis.effects.clone();
        let learnt = findings.learnt.as_ref().and_then(|learnt| match border_s {
            Some(_) => learnt.prediction.left.clone(),
            None => learnt.fit.residuals_of_first(),
        });
        Some(Self {
            learnt,
            before,
            after: (!effects.is_empty()).then_some((effects, after)),
            border_s,
            swing_s: std::f64::consts::TAU / model.characteristic_rad_s(),
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
    fit.residuals_of_first().map(|left| left.rmse_rad).unwrap_or_default()
}
