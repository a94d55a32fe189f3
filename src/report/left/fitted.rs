//! `fit.json`, as far as it is shown.

use std::collections::BTreeMap;

use serde::Deserialize;

/// `fit.json`.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub struct Fitted {
    pub specimen: String,
    pub parameters: BTreeMap<String, FittedParameter>,
    pub coloured_residuals: bool,
    pub intervals_valid: Option<bool>,
    pub converged: Option<bool>,
    pub recordings: Vec<FittedRecording>,
}

/// A fitted parameter.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub struct FittedParameter {
    pub value: Option<f64>,
    pub sd: Option<f64>,
    pub low95: Option<f64>,
    pub high95: Option<f64>,
    pub start: Option<f64>,
    pub unit: String,
    pub determined: Option<bool>,
}

/// A recording that was fitted.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub struct FittedRecording {
    pub file: String,
    pub fitted: FitSide,
    pub pace: Option<PaceFound>,
}

/// What the fitted model leaves.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub struct FitSide {
    pub rmse_rad: Vec<Option<f64>>,
    pub noise_rad: Vec<Option<f64>>,
    pub reproduced: Option<bool>,
    pub statement: String,
}

/// How fast it swings beside the specimen.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub struct PaceFound {
    pub statement: Option<String>,
}
