//! Work: what integrations have cost, counted alike on every machine and however many threads share it.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// A step's work beside that for each pair of a rate and a coordinate's rate, which is 1.
const OF_STEP: u64 = 12;
/// In a sum of shapes so many pairs cost as much as one of a chain, which solves for every link. Right for eight links; of sixteen it counts too little, a third without laws
/// of the air and down to a tenth with them (measured).
const PAIRS_OF_SHAPES: u64 = 3;
/// Derivatives in so many directions cost as much as the step itself.
const DIRECTIONS_PER_STEP: u64 = 4;

/// The work done on some problem, shared by all that comes of it. A bound on it ends a search at the same place on every machine, as no clock would.
///
/// Its unit is about a microsecond of one core.
#[derive(Debug, Clone, Default)]
pub struct Work(Arc<AtomicU64>);

impl Work {
    /// Adds an integration's steps, of so many rates of links and laws sought by so many along coordinates (fewer where a strip is a sum of shapes), with
    /// derivatives in so many directions.
    pub fn add(&self, steps: usize, (rates, sought): (usize, usize), directions: usize) {
        let (steps, pairs) = (steps as u64, (rates * sought) as u64);
        let pairs = if sought < rates { pairs / PAIRS_OF_SHAPES } else { pairs };
        self.0.fetch_add(steps * (OF_STEP + pairs) * (1 + directions as u64 / DIRECTIONS_PER_STEP), Ordering::Relaxed);
    }

    /// The work done so far.
    pub fn done(&self) -> u64 {
        self.0.load(Ordering::Relaxed)
    }
}
