//! The share of mark in a pixel, from all three channels.
//!
//! A pixel near a mark holds the mark's colour F, its background's B, and whatever else the surroundings hold
//! there, such as the edge of a strip, whose scatter about B is S. With the noise N of the channels, the share of
//! mark α in a pixel of colour V is that of generalised least squares,
//!
//! ```text
//! α = n·(V − B),   n = M⁻¹ c / (cᵀ M⁻¹ c),   var α = 1 / (cᵀ M⁻¹ c),   M = N + S,   c = F − B
//! ```
//! so a direction in which the surroundings vary counts for nothing, and luma counts where one background explains it.

use nalgebra::{Matrix3, Vector3};

use super::patch::Levels;

/// How the three channels of a pixel in one sector give its share of mark.
#[derive(Debug, Clone, Copy)]
pub struct Share {
    /// n.
    factors: Vector3<f32>,
    /// c.
    contrast: Vector3<f32>,
    /// M⁻¹.
    weight: Matrix3<f32>,
    /// Variance of the share.
    pub variance: f32,
}

/// A mixture of mark and background has a share in 0..1; this much beyond is noise, more is a foreign thing.
const BEYOND_MIXTURE: f32 = 0.3;
/// Squared standard deviations between a pixel and the nearest mixture beyond which it is a foreign thing.
const FOREIGN: f32 = 100.0;

impl Share {
    /// For a mark of colour `mark` before `background`, with the covariance `M` of what is neither.
    pub fn new(mark: Levels, background: Levels, covariance: &Matrix3<f32>) -> Self {
        let contrast = Vector3::from(mark) - Vector3::from(background);
        let weight = covariance.try_inverse().unwrap_or_else(Matrix3::zeros);
        let direction = weight * contrast;
        let information = contrast.dot(&direction);
        if !(information > 1e-6) {
            return Self { factors: Vector3::zeros(), contrast, weight, variance: f32::INFINITY };
        }
        Self { factors: direction / information, contrast, weight, variance: 1.0 / information }
    }

    /// The share, or `None` for a pixel that is no mixture of mark and background.
    #[inline]
    pub fn of(&self, levels: Levels, background: Levels) -> Option<f32> {
        let above = Vector3::from(levels) - Vector3::from(background);
        let share = self.factors.dot(&above);
        let rest = above - share * self.contrast;
        let foreign =
            !(-BEYOND_MIXTURE..=1.0 + BEYOND_MIXTURE).contains(&share) || rest.dot(&(self.weight * rest)) > FOREIGN;
        (!foreign).then_some(share)
    }

    /// What a pixel holds beside `share` of the mark.
    #[inline]
    pub fn rest(&self, levels: Levels, background: Levels, share: f32) -> Vector3<f32> {
        Vector3::from(levels) - Vector3::from(background) - share * self.contrast
    }
}

/// How much of a position comes from the colour differences: the mean over the sectors, each with its information.
pub fn of_chroma(shares: &[Share]) -> f64 {
    let (mut chroma, mut all) = (0.0, 0.0);
    for share in shares.iter().filter(|s| s.variance.is_finite()) {
        let information = 1.0 / share.variance;
        chroma += information * (1.0 - share.factors[0] * share.contrast[0]);
        all += information;
    }
    f64::from(if all > 0.0 { chroma / all } else { 0.0 }).clamp(0.0, 1.0)
}
