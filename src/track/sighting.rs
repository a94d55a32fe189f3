//! What the detection hands over: the blobs of a frame, in displayed pixels.

use super::Measured;

/// A blob in displayed pixels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sighting {
    /// Which hue.
    pub hue: u8,
    /// Where and how well.
    pub measured: Measured,
    /// Reaches over the picture's edge.
    pub cut: bool,
}

/// The blobs of one frame.
#[derive(Debug, Clone, PartialEq)]
pub struct FrameBlobs {
    /// Presentation time stamp.
    pub t_s: f64,
    /// The decoder reported damage; the frame is not measured.
    pub damaged: bool,
    /// What was seen.
    pub sightings: Vec<Sighting>,
}

impl FrameBlobs {
    /// With its columns this many times as wide: the shapes that pixels show which are not square.
    #[must_use]
    pub fn widened(mut self, times: f64) -> Self {
        for sighting in &mut self.sightings {
            sighting.measured.widen(times);
        }
        self
    }
}
