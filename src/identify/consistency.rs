//! Whether the estimators agree, and what it means when they do not.

use serde::Serialize;

use super::estimate::{Estimate, chi_squared_tail};

/// Estimators that differ by more than noise explains once in a hundred recordings disagree.
const LEAST_P: f64 = 0.01;

/// A test of several estimates of one quantity.
///
/// ```text
/// χ² = Σ (xᵢ − x̄)² / sdᵢ²,   x̄ = Σ xᵢ/sdᵢ² / Σ 1/sdᵢ²,   n − 1 degrees of freedom
/// ```
/// All estimators see the same samples, so their errors go together and χ² comes out smaller than for independent ones: the test accuses
/// too rarely rather than too often. It uses the intervals that noise alone gives, before any widening.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Consistency {
    /// How many were compared.
    pub estimators: usize,
    /// χ².
    pub chi2: f64,
    /// Probability of so large a χ² by noise.
    pub p_value: f64,
    /// p ≥ 0.01.
    pub agree: bool,
}

impl Consistency {
    /// Compares estimates; `None` for fewer than two.
    pub fn of(estimates: &[Estimate]) -> Option<Self> {
        let certain: Vec<&Estimate> = estimates.iter().filter(|e| e.sd > 0.0 && e.sd.is_finite()).collect();
        if certain.len() < 2 {
            return None;
        }
        let total: f64 = certain.iter().map(|e| e.sd.powi(-2)).sum();
        let mean = certain.iter().map(|e| e.value * e.sd.powi(-2)).sum::<f64>() / total;
        let chi2 = certain.iter().map(|e| ((e.value - mean) / e.sd).powi(2)).sum();
        let p_value = chi_squared_tail(chi2, certain.len() as f64 - 1.0);
        Some(Self { estimators: certain.len(), chi2, p_value, agree: p_value >= LEAST_P })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn estimates_within_their_intervals_agree_and_others_do_not() {
        let at = |value| Estimate::new(value, 0.01, 1e6);
        assert!(Consistency::of(&[at(1.0), at(1.01), at(0.995)]).unwrap().agree);
        let apart = Consistency::of(&[at(1.0), at(1.06)]).unwrap();
        assert!(!apart.agree && (apart.chi2 - 18.0).abs() < 1e-9);
        assert_eq!(Consistency::of(&[at(1.0)]), None);
    }
}
