//! What a search may cost.

/// By so much of the whole a phase may go beyond its end (cost).
const OVERRUN: f64 = 0.1;
/// Of the whole, what one descent may cost (cost).
const OF_A_DESCENT: f64 = 0.1;

/// The work that a search may do, and how much of it its present phase may ([`crate::model::Work`] counts it).
#[derive(Debug, Clone, Copy)]
pub(super) struct Budget {
    /// After which no further fit is begun, whoever did it.
    whole: u64,
    /// What had been done when the search began, the base model's fit included.
    at_start: u64,
    /// Where the present phase ends.
    limit: u64,
}

impl Budget {
    /// Of a search that begins; nothing is allowed yet.
    pub fn from(at_start: u64, whole: u64) -> Self {
        Self { whole, at_start, limit: at_start }
    }

    /// Allows a share of what was left when the search began.
    pub fn allow(&mut self, share: f64) {
        self.limit = self.at(share);
    }

    /// The work at which a share is spent of what was left when the search began.
    pub fn at(&self, share: f64) -> u64 {
        self.at_start + (share * self.whole.saturating_sub(self.at_start) as f64) as u64
    }

    /// What each descent may cost of so many that run together: its part of what the present phase may still do, and a little more, for what is begun is not cut short
    /// for that; and no more than a part of all, which others need.
    pub fn of_descent(&self, together: usize, done: u64) -> u64 {
        let left = (self.limit + (OVERRUN * self.whole as f64) as u64).saturating_sub(done);
        (left / together.max(1) as u64).min((OF_A_DESCENT * self.whole as f64) as u64)
    }

    /// Whether the present phase has done the work it was allowed.
    pub fn is_spent(&self, done: u64) -> bool {
        done >= self.limit
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_are_of_what_was_left_at_the_start() {
        let mut budget = Budget::from(40, 100);
        assert!(budget.is_spent(40));
        budget.allow(0.5);
        assert!(!budget.is_spent(69) && budget.is_spent(70));
        assert_eq!(budget.at(1.0), 100);
        assert_eq!([budget.of_descent(2, 50), budget.of_descent(6, 50)], [10, 5]);
        assert_eq!(budget.of_descent(1, 90), 0);
        // what began too late has nothing
        let mut late = Budget::from(120, 100);
        late.allow(1.0);
        assert!(late.is_spent(120));
    }
}
