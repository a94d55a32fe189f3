//! Work: what integrations have cost, counted alike on every machine and however many threads share it.
//!
//! The unit is a fifth of a microsecond of one core of the machine on which the costs here and in the laws' files were measured, for chains of one to eighteen links and each
//! kind of law, with derivatives in none to sixteen directions. Within a third they are right for all of these.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// A step's work beside that for each pair of a rate and a rate that is sought…
const OF_STEP: u64 = 10;
/// … and for four such pairs, without laws.
const OF_FOUR_PAIRS: u64 = 7;
/// With derivatives a step costs so many times as much…
const WITH_DERIVATIVES: f64 = 1.7;
/// … and more for each direction in which they are taken.
const A_DIRECTION: f64 = 0.04;

/// The work done on some problem, shared by all that comes of it. A bound on it ends a search at the same place on every machine, as no clock would.
#[derive(Debug, Clone, Default)]
pub struct Work {
    done: Arc<AtomicU64>,
    /// Of one descent within it, and the most that it may do.
    own: Option<(Arc<AtomicU64>, u64)>,
}

impl Work {
    /// What a step costs, of so many rates of links and laws, sought by so many along coordinates (fewer where a strip is a sum of shapes), without laws.
    pub fn of_step(rates: usize, sought: usize) -> u64 {
        OF_STEP + OF_FOUR_PAIRS * (rates * sought) as u64 / 4
    }

    /// Adds an integration's steps of such a cost each, with derivatives in so many directions.
    pub fn add(&self, steps: usize, each: u64, directions: usize) {
        let derivatives = if directions > 0 { WITH_DERIVATIVES + A_DIRECTION * directions as f64 } else { 1.0 };
        let done = (steps as f64 * each as f64 * derivatives) as u64;
        let counts = std::iter::once(&self.done).chain(self.own.as_ref().map(|(own, _)| own));
        counts.for_each(|count| _ = count.fetch_add(done, Ordering::Relaxed));
    }

    /// The work done so far.
    pub fn done(&self) -> u64 {
        self.done.load(Ordering::Relaxed)
    }

    /// The same count for one descent, which may do so much. What others do meanwhile does not end it.
    #[must_use]
    pub fn of_descent(&self, most: u64) -> Self {
        Self { done: self.done.clone(), own: Some((Arc::default(), most)) }
    }

    /// Whether a descent has done what it may.
    pub fn is_spent(&self) -> bool {
        self.own.as_ref().is_some_and(|(own, most)| own.load(Ordering::Relaxed) >= *most)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_descent_has_its_own_end_and_counts_for_all() {
        let whole = Work::default();
        let (one, other) = (whole.of_descent(1000), whole.of_descent(1000));
        one.add(10, 60, 0);
        assert!(!one.is_spent() && whole.done() == 600);
        other.add(10, 60, 0);
        // what the other has done does not end it
        assert!(!one.is_spent() && one.done() == 1200);
        one.add(10, 60, 0);
        assert!(one.is_spent() && !other.is_spent() && !whole.is_spent());
    }
}
