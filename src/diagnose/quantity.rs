//! A fitted number as it is written.

use std::collections::BTreeMap;

use serde::Serialize;

/// Fitted parameters by their identifiers.
pub type Parameters = BTreeMap<&'static str, Quantity>;

/// A fitted parameter.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Quantity {
    /// Its value.
    pub value: Option<f64>,
    /// Standard deviation.
    pub sd: f64,
    /// Of both.
    pub unit: &'static str,
}
