//! The mean share of mark at every depth of the boundary band.

use super::outline::Outline;
use super::share::Share;
use super::surroundings::Surroundings;
use super::zones::Zones;

/// Mean share of mark in half-pixel steps of depth.
pub struct Profile {
    band_px: f32,
    bins: Vec<(f32, u32)>,
}

impl Profile {
    /// Over the band's pixels that can be such a mixture.
    pub fn of(zones: &Zones<'_>, outline: &Outline, surroundings: &Surroundings, shares: &[Share]) -> Self {
        let band_px = outline.bands_px.iter().copied().fold(0.0, f32::max);
        let mut profile = Self { band_px, bins: vec![(0.0, 0); (4.0 * band_px) as usize + 2] };
        for sample in &zones.band {
            let sector = usize::from(sample.sector);
            let depth = sample.depth_px(outline);
            if let Some((share, _)) = shares[sector].of(sample.levels, surroundings.background_at(sector, sample)) {
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
