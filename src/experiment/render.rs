//! `[render]`: how a synthetic recording is made.

use serde::Deserialize;

/// How a synthetic recording is made.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Render {}

/// Codec.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
pub struct Codec {}
/// Distractor.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
pub struct Distractor {}
/// Lens.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
pub struct Lens {}

impl Render {
    pub(super) fn validate(&self) -> Result<(), String> {
        Ok(())
    }
}
