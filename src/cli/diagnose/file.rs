//! The JSON of a diagnosis, freeswing.diagnosis/1.

use serde_json::{Map, Value, json};

use super::rmse_rad;
use super::words::Statements;
use crate::diagnose::{Cause, Detectable, Diagnosis, MAIN_EFFECTS, Phase, Place, Refit, Status, Weighed};
use crate::model::Parameter;

/// Candidates written.
const WRITTEN: usize = 25;

/// All of it.
pub(super) fn diagnosis(diagnosis: &Diagnosis<'_>, specimen: &str) -> Value {
    let statements = Statements { diagnosis };
    let null = diagnosis.null();
    let verdict = &diagnosis.verdict;
    let departure = &diagnosis.departure;
    // the format gives two names; what a rig has beside them stands by itself
    let explaining = diagnosis.named_effects();
    let is_main = |cause: &&Cause| explaining.iter().take(MAIN_EFFECTS).any(|main| main == *cause);
    let (effects, further): (Vec<&Cause>, Vec<&Cause>) = verdict.effects.iter().partition(is_main);
    let shares: Map<String, Value> =
        Place::OF_LOSSES.iter().zip(diagnosis.energy_shares).map(|(p, s)| (p.id().to_owned(), json!(s))).collect();
    json!({
        "schema": "freeswing.diagnosis/1",
        "specimen": specimen,
        "baseline": {
            "parameters": parameters_json(null, &null.problem.free),
            "rmse_rad": rmse_rad(null),
            "noise_rad": diagnosis.ground.noise[0].sd_rad,
            "noise_correlation": diagnosis.ground.noise[0].colour.iter().map(|c| c.rho).collect::<Vec<_>>(),
            "noise_share_correlated": diagnosis.ground.noise[0].colour.iter().map(|c| c.share).collect::<Vec<_>>(),
            "noise_correlation_across": diagnosis.ground.noise[0].across,
            "adequate": verdict.status == Status::Adequate,
            "p_value": diagnosis.p_value,
        },
        "where": {
            "place": diagnosis.place().map(Place::id),
            "energy_share": shares,
            "time_s": departure.time_s,
            "amplitude_rad": departure.amplitude_rad,
            "phase": statements.phase().map(Phase::id),
            "frequency_hz": departure.frequency_hz,
            "statement": statements.place(),
            "missing_torque": diagnosis.missing_torque.as_ref().map(|m| json!({
                "place": m.place.id(), "rms": m.rms, "unit": if m.place == Place::Camera { "rad" } else { "N m" }, "phase": m.phase.map(Phase::id),
                "frequency_hz": m.frequency_hz, "energy_share": m.energy_share,
            })),
            "named_torque_n_m": diagnosis.added_torque_n_m,
            "unknown": diagnosis.unknowns.iter().map(|u| json!({"place": u.place().id(), "form": u.form.id(), "size": u.size, "log_likelihood_gain": u.gain, "tried": u.tried})).collect::<Vec<_>>(),
        },
        "candidates": diagnosis.weighed.iter().take(WRITTEN).map(candidate_json).collect::<Vec<_>>(),
        "verdict": {
            "status": verdict.status.id(),
            "effects": effects.iter().map(|c| c.id()).collect::<Vec<_>>(),
            "further_effects": further.iter().map(|c| c.id()).collect::<Vec<_>>(),
            "class": verdict.class.iter().map(|c| c.id()).collect::<Vec<_>>(),
            "probability": verdict.probability,
            "class_probability": verdict.class_probability,
            "unknown_probability": verdict.unknown,
            "statement": statements.verdict(),
            "to_decide": verdict.to_decide,
        },
        "heldout": diagnosis.held_out.as_ref().map(|h| {
            let recording = &null.problem.records[h.record].path;
            json!({
                "from_s": h.from_s, "recording": recording,
                "baseline_rmse_rad": h.baseline_rad, "augmented_rmse_rad": h.augmented_rad,
            })
        }),
        "detectable": limits(&diagnosis.detectable),
    })
}

/// What each effect could be seen and named from.
pub(super) fn limits(limits: &[Detectable]) -> Value {
    let one = |d: &Detectable| {
        let value = json!({
            "smallest": d.smallest.is_finite().then_some(d.smallest),
            "named_from": d.named.is_finite().then_some(d.named),
            "unit": d.parameter.unit(),
            "confused_with": d.confused_with.iter().map(|c| c.id()).collect::<Vec<_>>(),
        });
        (d.cause.id().to_owned(), value)
    };
    Value::Object(limits.iter().map(one).collect())
}

fn parameters_json(fit: &Refit<'_>, of: &[Parameter]) -> Value {
    let covariance = fit.covariance(of);
    let one = |(i, p): (usize, &Parameter)| {
        let value = json!({"value": fit.value(*p), "sd": covariance[(i, i)].sqrt(), "unit": p.unit()});
        (p.id().to_owned(), value)
    };
    Value::Object(of.iter().enumerate().map(one).collect())
}

fn candidate_json(weighed: &Weighed<'_>) -> Value {
    let fit = &weighed.fit;
    let values: usize = fit.problem.records.iter().map(|r| r.values(0..r.len())).sum();
    json!({
        "effects": fit.hypothesis.causes.iter().map(|c| c.id()).collect::<Vec<_>>(),
        "probability": weighed.probability,
        "probability_if_named": weighed.if_named,
        "parameters": parameters_json(fit, &fit.added()),
        "dropped_at_s": fit.hypothesis.dropped.map(|d| d.1),
        "rmse_rad": rmse_rad(fit),
        "chi2": fit.chi2,
        "bic": fit.chi2 + fit.x.len() as f64 * (values as f64).ln(),
    })
}
