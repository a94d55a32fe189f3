//! What long work tells, and whether it should stop: a trait here, the bar in the command line.

use serde::{Deserialize, Serialize};

/// Hears how far the work is.
pub trait Progress: Sync {
    /// A stage begins, of `total` steps where that is known.
    fn begin(&self, _stage: &'static str, _total: Option<u64>) {}
    /// Steps done since the last call.
    fn advance(&self, _steps: u64) {}
    /// The user wants to stop.
    fn is_cancelled(&self) -> bool {
        false
    }
}

/// What a program that watches another one's progress hears, a line of JSON each.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ProgressEvent {
    /// A stage begins.
    Began {
        /// Which.
        stage: String,
        /// Its steps, where that is known.
        total: Option<u64>,
    },
    /// A stage goes on.
    Stands {
        /// Steps done.
        at: u64,
    },
}

/// Tells nobody.
#[derive(Debug, Clone, Copy, Default)]
pub struct Silent;

impl Progress for Silent {}
