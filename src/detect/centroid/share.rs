//! The share of mark in a pixel of the boundary band.

use super::outline::Outline;
use super::patch::Patch;
use super::surroundings::Surroundings;

/// Error of a coded sample at an edge, as a share of the edge's height.
const EDGE_ERROR: f32 = 0.04;
/// Luma pixels that share one independent chroma error, as a variance factor (4 samples and interpolation).
const COMPONENT_SHARING: f32 = 4.0;

/// Mean share of mark in half-pixel steps of depth.
pub struct Profile {
    band_px: f32,
    bins: Vec<(f32, u32)>,
}

impl Profile {
    /// Over the band's pixels that can be such a mixture.
    pub fn of(patch: &Patch, outline: &Outline, surroundings: &Surroundings, shares: &[Share]) -> Self {
        let band_px = outline.band_px;
        let mut profile = Self { band_px, bins: vec![(0.0, 0); (4.0 * band_px) as usize + 2] };
        for sample in &patch.samples {
            let sector = usize::from(sample.sector);
            let depth = sample.distance_px - outline.radii_px[sector];
            if depth.abs() <= band_px
                && let Some(share) = shares[sector].of(sample.levels, surroundings.background_at(sector, sample))
            {
                profile.add(depth, share);
            }
        }
        profile.finish()
    }

    fn bin(&self, depth: f32) -> usize {
        (((depth + self.band_px) * 2.0).max(0.0) as usize).min(self.bins.len() - 1)
    }

    fn add(&mut self, depth: f32, share: f32) {
        let bin = self.bin(depth);
        self.bins[bin].0 += share;
        self.bins[bin].1 += 1;
    }

    /// Sums → means; an empty bin takes the straight fall from mark to background.
    fn finish(mut self) -> Self {
        let last = self.bins.len() as f32 - 1.0;
        for (i, bin) in self.bins.iter_mut().enumerate() {
            bin.0 = if bin.1 >= 3 { bin.0 / bin.1 as f32 } else { 1.0 - i as f32 / last };
        }
        self
    }

    /// The mean share at a depth.
    pub fn at(&self, depth: f32) -> f32 {
        self.bins[self.bin(depth)].0
    }
}

/// How luma and component of a pixel in one sector give its share of mark.
pub struct Share {
    /// Factors of (luma − background) and (component − background).
    factors: [f32; 2],
    /// Contrasts of the mark against the background.
    contrasts: [f32; 2],
    /// Variance of the share.
    pub variance: f32,
    /// Channels with enough contrast to judge whether a pixel is a mixture at all.
    telling: [bool; 2],
}

/// A mixture of mark and background has a share in 0..1; this much beyond is noise, more is a foreign thing.
const BEYOND_MIXTURE: f32 = 0.3;
/// Shares by luma and by component differ by their different sharpness; more is a foreign thing.
const DISAGREEMENT: f32 = 0.65;

impl Share {
    /// Of a sector.
    pub fn new(mark: [f32; 2], background: [f32; 2], noise: [f32; 2]) -> Self {
        let contrasts = [mark[0] - background[0], mark[1] - background[1]];
        let sharing = [1.0, COMPONENT_SHARING];
        let weight = [0, 1].map(|k| 1.0 / ((noise[k] * noise[k] + (EDGE_ERROR * contrasts[k]).powi(2)) * sharing[k]));
        let information = weight[0] * contrasts[0] * contrasts[0] + weight[1] * contrasts[1] * contrasts[1];
        let telling = [0, 1].map(|k| contrasts[k].abs() > 8.0 * noise[k].max(1.0));
        if information <= 1e-6 {
            return Self { factors: [0.0; 2], contrasts, variance: f32::INFINITY, telling };
        }
        let factors = [0, 1].map(|k| weight[k] * contrasts[k] / information);
        Self { factors, contrasts, variance: 1.0 / information, telling }
    }

    /// The share, or `None` for a pixel that is no mixture of mark and background.
    #[inline]
    pub fn of(&self, levels: [f32; 2], background: [f32; 2]) -> Option<f32> {
        let above = [levels[0] - background[0], levels[1] - background[1]];
        let single = [0, 1].map(|k| self.telling[k].then(|| above[k] / self.contrasts[k]));
        let foreign = |s: &f32| *s < -BEYOND_MIXTURE || *s > 1.0 + BEYOND_MIXTURE;
        let differ = matches!(single, [Some(a), Some(b)] if (a - b).abs() > DISAGREEMENT);
        if differ || single.iter().flatten().any(foreign) {
            return None;
        }
        Some(self.factors[0] * above[0] + self.factors[1] * above[1])
    }
}
