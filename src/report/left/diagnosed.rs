//! `diagnosis.json`, as far as it is shown.

use std::collections::BTreeMap;

use serde::Deserialize;

/// `diagnosis.json`.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub struct Diagnosed {
    pub specimen: String,
    pub baseline: Baseline,
    #[serde(rename = "where")]
    pub location: Location,
    pub candidates: Vec<Candidate>,
    pub verdict: Verdict,
    pub heldout: Option<HeldOut>,
    pub detectable: BTreeMap<String, Detectable>,
    pub undecided: Vec<String>,
}

/// The base model.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub struct Baseline {
    pub rmse_rad: Vec<Option<f64>>,
    pub noise_rad: Vec<Option<f64>>,
    pub adequate: Option<bool>,
    pub p_value: Option<f64>,
}

/// Where it departs.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub struct Location {
    pub place: Option<String>,
    pub energy_share: BTreeMap<String, Option<f64>>,
    pub statement: String,
    pub missing_torque: Option<MissingTorque>,
    pub unknown: Vec<Unknown>,
}

/// The torque that the base model lacks.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub struct MissingTorque {
    pub place: String,
}

/// An unknown at some place.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub struct Unknown {
    pub place: String,
    pub form: String,
    pub log_likelihood_gain: Option<f64>,
}

/// A value with its unit.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub struct Quantity {
    pub value: Option<f64>,
    pub sd: Option<f64>,
    pub unit: String,
}

/// An explanation.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub struct Candidate {
    pub effects: Vec<String>,
    pub probability: Option<f64>,
    pub probability_if_named: Option<f64>,
    pub parameters: BTreeMap<String, Quantity>,
    pub rmse_rad: Vec<Option<f64>>,
}

/// The verdict.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub struct Verdict {
    pub status: String,
    pub effects: Vec<String>,
    pub further_effects: Vec<String>,
    pub class: Vec<String>,
    pub probability: Option<f64>,
    pub unknown_probability: Option<f64>,
    pub inclusion: BTreeMap<String, Option<f64>>,
    pub remainder: Option<Remainder>,
    pub law: Option<Law>,
    pub statement: String,
    pub to_decide: Option<String>,
    pub among_themselves: bool,
}

/// What the names leave.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub struct Remainder {
    pub present: Option<f64>,
    pub place: Option<String>,
    pub phase: Option<String>,
    pub frequency_hz: Option<f64>,
    pub rms_rad: Vec<Option<f64>>,
    pub over_noise: Vec<Option<f64>>,
    pub share: Option<f64>,
}

/// A law that was learnt.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub struct Law {
    pub place: String,
    pub formula: String,
    pub unit: String,
    pub alternatives: Vec<Alternative>,
    pub toml: String,
}

/// Another formula.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub struct Alternative {
    pub formula: String,
}

/// The prediction of what was not fitted.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub struct HeldOut {
    pub from_s: Option<f64>,
    pub recording: String,
    pub whole_recording: bool,
    pub baseline_rmse_rad: Vec<Option<f64>>,
    pub named_rmse_rad: Vec<Option<f64>>,
    pub augmented_rmse_rad: Vec<Option<f64>>,
}

/// From which amount on an effect would have been seen.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub struct Detectable {
    pub smallest: Option<f64>,
    pub named_from: Option<f64>,
    pub unit: String,
    pub confused_with: Vec<String>,
}
