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
//!
//! A camera adds up light and then codes it, nearly as its square root, so that a pixel half mark and half bright background is brighter than the mean of their codes.
//! With m what the code of an even mixture is above that mean,
//!
//! ```text
//! V(α) ≈ B + α c + 4 α (1 − α) m,   n·(V − B) = α + κ α (1 − α),   κ = 4 n·m
//! ```

use nalgebra::{Matrix3, Vector3};

use super::patch::Levels;
use crate::video::{Layout, Matrix};

/// How mark and background mix in a pixel.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Mixing {
    /// By their codes, as in most drawn pictures.
    #[default]
    Codes,
    /// By their light, which is coded afterwards, as in a camera.
    Light,
}

/// Mixing, and how colours are coded.
#[derive(Debug, Clone, Copy)]
pub struct Mixture {
    mixing: Mixing,
    matrix: Matrix,
    /// Codes of black, and from black to white.
    luma: (f64, f64),
    /// Codes from neutral to a colour difference of 1.
    chroma: f64,
}

impl Mixture {
    /// In a picture of this layout.
    pub fn new(mixing: Mixing, layout: &Layout) -> Self {
        // levels are 8-bit codes, whatever the picture's are
        let eight = Layout { bits: 8, ..*layout };
        let (_, chroma) = eight.chroma_scale();
        Self { mixing, matrix: layout.matrix, luma: eight.luma_scale(), chroma }
    }

    /// m of two colours.
    fn bow(&self, mark: &Vector3<f32>, background: &Vector3<f32>) -> Vector3<f32> {
        if self.mixing == Mixing::Codes {
            return Vector3::zeros();
        }
        let (black, span) = self.luma;
        let rgb = |codes: &Vector3<f32>| {
            let [y, cb, cr] = [codes[0], codes[1], codes[2]].map(f64::from);
            self.matrix.rgb([(y - black) / span, cb / self.chroma, cr / self.chroma]).map(|c| c.max(0.0))
        };
        let (mark, background) = (rgb(mark), rgb(background));
        let above =
            |k: usize| (0.5 * (mark[k].powi(2) + background[k].powi(2))).sqrt() - 0.5 * (mark[k] + background[k]);
        let [y, cb, cr] = self.matrix.ycbcr([0, 1, 2].map(above));
        Vector3::new((span * y) as f32, (self.chroma * cb) as f32, (self.chroma * cr) as f32)
    }
}

/// How the three channels of a pixel in one sector give its share of mark.
#[derive(Debug, Clone, Copy)]
pub struct Share {
    /// F.
    mark: Vector3<f32>,
    /// n.
    factors: Vector3<f32>,
    /// c.
    contrast: Vector3<f32>,
    mixture: Mixture,
    /// 4 m.
    bow: Vector3<f32>,
    /// κ.
    curvature: f32,
    /// M⁻¹.
    weight: Matrix3<f32>,
    /// Variance of the share.
    pub variance: f32,
}

/// A mixture of mark and background has a share in 0..1; this much beyond is noise, more is a foreign thing.
const BEYOND_MIXTURE: f32 = 0.3;
/// Squared standard deviations between a pixel and the nearest mixture beyond which it is a foreign thing.
const FOREIGN: f32 = 100.0;

/// κ, at most: below 1 the mixture rises from background to mark all the way.
const MOST_CURVATURE: f32 = 0.9;

impl Share {
    /// For a mark of colour `mark` before `background`, with the covariance `M` of what is neither.
    pub fn new(mark: Levels, background: Levels, covariance: &Matrix3<f32>, mixture: Mixture) -> Self {
        let weight = covariance.try_inverse().unwrap_or_else(Matrix3::zeros);
        Self::weighted(Vector3::from(mark), background, weight, mixture)
    }

    /// The same before another background.
    #[inline]
    pub fn before(&self, background: Levels) -> Self {
        Self::weighted(self.mark, background, self.weight, self.mixture)
    }

    #[inline]
    fn weighted(mark: Vector3<f32>, background: Levels, weight: Matrix3<f32>, mixture: Mixture) -> Self {
        let background = Vector3::from(background);
        let contrast = mark - background;
        let direction = weight * contrast;
        let information = contrast.dot(&direction);
        let (factors, variance) = if information > 1e-6 {
            (direction / information, 1.0 / information)
        } else {
            (Vector3::zeros(), f32::INFINITY)
        };
        let bow = 4.0 * mixture.bow(&mark, &background);
        let curvature = factors.dot(&bow);
        // beyond, the parabola is none any more that rises all the way
        let part = if curvature.abs() > MOST_CURVATURE { MOST_CURVATURE / curvature.abs() } else { 1.0 };
        Self { mark, factors, contrast, mixture, bow: part * bow, curvature: part * curvature, weight, variance }
    }

    /// What a share of mark adds to the background; beyond 0 and 1 as it goes on there.
    #[inline]
    fn added(&self, share: f32) -> Vector3<f32> {
        let within = share.clamp(0.0, 1.0);
        let slope = self.contrast + (1.0 - 2.0 * within) * self.bow;
        within * self.contrast + within * (1.0 - within) * self.bow + (share - within) * slope
    }

    /// The share and its variance, or `None` for a pixel that is no mixture of mark and background.
    #[inline]
    pub fn of(&self, levels: Levels, background: Levels) -> Option<(f32, f32)> {
        let above = Vector3::from(levels) - Vector3::from(background);
        let seen = self.factors.dot(&above);
        let within = seen.clamp(0.0, 1.0);
        // of α + κ α (1 − α) = seen, the root between 0 and 1; beyond as it goes on there
        let linear = 1.0 + self.curvature;
        let root = 2.0 * within / (linear + (linear * linear - 4.0 * self.curvature * within).max(0.0).sqrt());
        let slope = 1.0 + self.curvature * (1.0 - 2.0 * root);
        let share = root + (seen - within) / slope;
        let rest = above - self.added(share);
        let foreign =
            !(-BEYOND_MIXTURE..=1.0 + BEYOND_MIXTURE).contains(&share) || rest.dot(&(self.weight * rest)) > FOREIGN;
        (!foreign).then_some((share, self.variance / (slope * slope)))
    }

    /// 1 / variance of the share before another background, as far as it is that of codes.
    #[inline]
    pub fn information_before(&self, background: Levels) -> f32 {
        let contrast = self.mark - Vector3::from(background);
        contrast.dot(&(self.weight * contrast))
    }

    /// What a pixel holds beside `share` of the mark.
    #[inline]
    pub fn rest(&self, levels: Levels, background: Levels, share: f32) -> Vector3<f32> {
        Vector3::from(levels) - Vector3::from(background) - self.added(share)
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
