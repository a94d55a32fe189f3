//! What long work tells, and whether it should stop: a trait here, the bar in the command line.

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

/// Tells nobody.
#[derive(Debug, Clone, Copy, Default)]
pub struct Silent;

impl Progress for Silent {}
