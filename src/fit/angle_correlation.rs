//! Correlations of the noise of a recording's angles at one row.
//!
//! The mark between two angles is seen once, so that what tilts one tilts the other back; an angle that is summed from encoders of several joints holds the errors of all of them. Of the noise of an
//! angle i that which the angles before it do not foretell is
//!
//! ```text
//! r_i ← (r_i − βᵀ r_before) / √(1 − βᵀ c),   C β = c,   C: correlations of those before,   c: theirs with i
//! ```

use nalgebra::{DMatrix, DVector};
use smallvec::SmallVec;

/// Least variance, of noise of variance 1, that is left in any direction: correlations that leave less are made smaller (judgement).
const LEAST: f64 = 0.05;

/// The correlation of every two angles.
#[derive(Debug, Clone, PartialEq)]
pub struct Across(DMatrix<f64>);

/// What the angles before one say of it.
#[derive(Debug, Clone, Default)]
pub struct Conditional {
    /// β, of each of them.
    pub beta: SmallVec<[f64; 2]>,
    /// What is left of a standard deviation of one.
    pub sd: f64,
}

impl Across {
    /// None, of so many angles.
    pub fn none(angles: usize) -> Self {
        Self(DMatrix::identity(angles, angles))
    }

    /// With the correlation of every two that `between` tells, the upper one first.
    pub fn of(angles: usize, mut between: impl FnMut(usize, usize) -> f64) -> Self {
        let mut all = DMatrix::identity(angles, angles);
        for j in 1..angles {
            for i in 0..j {
                let own = Some(between(i, j)).filter(|own| own.is_finite()).unwrap_or(0.0);
                (all[(i, j)], all[(j, i)]) = (own, own);
            }
        }
        // found two by two, they need not go together
        let least = all.clone().symmetric_eigenvalues().min();
        let part = if least < LEAST { (1.0 - LEAST) / (1.0 - least) } else { 1.0 };
        (0..angles).for_each(|i| (0..angles).filter(|j| *j != i).for_each(|j| all[(i, j)] *= part));
        Self(all)
    }

    /// Whether no angle says anything of another.
    pub fn is_none(&self) -> bool {
        self.0.iter().filter(|value| **value != 0.0).count() == self.0.nrows()
    }

    /// Of two angles.
    pub fn between(&self, one: usize, other: usize) -> f64 {
        self.0[(one, other)]
    }

    /// Of any two, the strongest.
    pub fn strongest(&self) -> f64 {
        let pairs = (0..self.0.ncols()).flat_map(|j| (0..j).map(move |i| (i, j)));
        pairs.map(|pair| self.0[pair]).max_by(|a, b| a.abs().total_cmp(&b.abs())).unwrap_or(0.0)
    }

    /// The largest difference from others.
    pub fn difference(&self, other: &Self) -> f64 {
        (&self.0 - &other.0).amax()
    }

    /// What those `before` say of an angle.
    pub fn given(&self, angle: usize, before: &[usize]) -> Conditional {
        let own = DVector::from_iterator(before.len(), before.iter().map(|i| self.0[(*i, angle)]));
        let among = DMatrix::from_fn(before.len(), before.len(), |i, j| self.0[(before[i], before[j])]);
        let beta = among.cholesky().map_or_else(|| DVector::zeros(before.len()), |c| c.solve(&own));
        let left = (1.0 - beta.dot(&own)).max(LEAST);
        Conditional { sd: left.sqrt(), beta: beta.iter().copied().collect() }
    }
}

/// What was found of angles before, of which most rows ask the same.
pub struct ConditionalCache<'a> {
    across: &'a Across,
    known: Vec<(usize, SmallVec<[usize; 4]>, Conditional)>,
}

impl<'a> ConditionalCache<'a> {
    /// Of nothing yet.
    pub fn new(across: &'a Across) -> Self {
        Self { across, known: Vec::new() }
    }

    /// What those `before` say of an angle.
    pub fn given(&mut self, angle: usize, before: &[usize]) -> &Conditional {
        let place = self.known.iter().position(|own| own.0 == angle && own.1[..] == *before);
        let place = place.unwrap_or_else(|| {
            self.known.push((angle, SmallVec::from_slice(before), self.across.given(angle, before)));
            self.known.len() - 1
        });
        &self.known[place].2
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_of_independent_errors_are_foretold_by_the_last_of_them_alone() {
        // angles of three joints: each holds the errors of those before it
        let across = Across::of(3, |i, j| ((i + 1) as f64 / (j + 1) as f64).sqrt());
        let third = across.given(2, &[0, 1]);
        assert!(third.beta[0].abs() < 1e-12 && (third.beta[1] - (2.0f64 / 3.0).sqrt()).abs() < 1e-12);
        assert!((third.sd - (1.0f64 / 3.0).sqrt()).abs() < 1e-12);
        // where that one is missing the first one says what it can
        let third = across.given(2, &[0]);
        assert!((third.beta[0] - (1.0f64 / 3.0).sqrt()).abs() < 1e-12);
        assert!(across.given(0, &[]).beta.is_empty());
    }

    #[test]
    fn correlations_that_do_not_go_together_become_smaller() {
        let across = Across::of(3, |i, j| if (i, j) == (0, 2) { -0.9 } else { 0.9 });
        assert!((across.0.clone().symmetric_eigenvalues().min() - LEAST).abs() < 1e-12);
        assert!((across.between(0, 1) + across.between(0, 2)).abs() < 1e-12);
        assert_eq!(across.strongest().abs(), across.between(1, 2));
        assert!(Across::none(3).is_none() && !across.is_none());
    }
}
