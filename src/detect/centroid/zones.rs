//! The pixels of a patch by where they lie: in the mark, in the band where it fades, in the ring around it, beyond.

use super::outline::{Outline, Zone};
use super::patch::{Patch, Sample};
use crate::video::Picture;

/// The pixels of a patch, sorted out by an outline.
pub struct Zones<'a> {
    /// All mark.
    pub core: Vec<&'a Sample>,
    /// Mixtures of mark and background.
    pub band: Vec<&'a Sample>,
    /// Where the background is read.
    pub ring: Vec<&'a Sample>,
    /// Farther away.
    pub beyond: Vec<&'a Sample>,
    /// Pixels that one of core and band stands for.
    pub pixels_each: f32,
}

impl<'a> Zones<'a> {
    /// Where chroma has half the samples, luma is as soft as chroma, so that every second pixel of core and band, as on
    /// a chessboard, says all there is.
    pub fn of(patch: &'a Patch, outline: &Outline) -> Self {
        let every = !patch.is_soft();
        let room = || Vec::with_capacity(patch.samples.len() / 2);
        let mut zones = [room(), room(), room(), Vec::new()];
        for sample in &patch.samples {
            let zone = sample.zone(outline);
            if every || sample.is_white() || matches!(zone, Zone::Ring | Zone::Beyond) {
                zones[zone as usize].push(sample);
            }
        }
        let [core, band, ring, beyond] = zones;
        Self { core, band, ring, beyond, pixels_each: if every { 1.0 } else { 2.0 } }
    }

    /// The boundary band reaches over the picture's edge.
    pub fn are_cut(&self, outline: &Outline, picture: &Picture<'_>) -> bool {
        let (right, bottom) = (picture.layout.width_px as f32 - 1.0, picture.layout.height_px as f32 - 1.0);
        self.core.iter().chain(&self.band).any(|s| {
            let (x, y) = (outline.centre_px[0] as f32 + s.dx_px, outline.centre_px[1] as f32 + s.dy_px);
            x <= 0.0 || y <= 0.0 || x >= right || y >= bottom
        })
    }
}
