//! Frame → blobs (paper Section III.II, Fig. 8): colour component → filtered → binary → connected regions → one
//! centroid a region, each with its variance.

mod blobs;
mod centroid;
mod component;
pub mod debug;
mod morphology;
mod threshold;

pub use blobs::Blob;
pub use centroid::Centroid;
pub use threshold::LEAST_COMPONENT;

use blobs::Target;
use component::{HueAxis, from_255};

use crate::error::Result;
use crate::experiment::MarkColour;
use crate::video::Picture;

/// One hue to look for.
#[derive(Debug, Clone, PartialEq)]
pub struct Hue {
    /// The colour.
    pub colour: MarkColour,
    /// How many marks have it.
    pub marks: usize,
    /// Least component of a mark, on the scale to 255.
    pub threshold: f64,
    /// The marks are a few samples wide, so lines are not filtered out.
    pub thin: bool,
}

/// Finds marks in pictures.
#[derive(Debug, Clone)]
pub struct Detector {
    hues: Vec<Hue>,
    least_area_px2: f64,
}

/// Smallest mark that is looked for.
pub const LEAST_AREA_PX2: f64 = 20.0;

impl Detector {
    /// A detector for `hues`.
    pub fn new(hues: Vec<Hue>) -> Self {
        Self { hues, least_area_px2: LEAST_AREA_PX2 }
    }

    /// The hues it looks for.
    pub fn hues(&self) -> &[Hue] {
        &self.hues
    }

    /// All blobs of all hues in a picture.
    ///
    /// # Errors
    /// [`crate::Error::OpenCv`].
    pub fn detect(&self, picture: &Picture<'_>) -> Result<Vec<Blob>> {
        let mut blobs = Vec::new();
        for (index, hue) in self.hues.iter().enumerate() {
            blobs::find(picture, &self.target(index, hue, picture), &mut blobs)?;
        }
        Ok(blobs)
    }

    fn target(&self, index: usize, hue: &Hue, picture: &Picture<'_>) -> Target {
        Target {
            hue: index as u8,
            axis: HueAxis::new(&hue.colour, picture.layout.matrix),
            threshold: from_255(hue.threshold),
            thin: hue.thin,
            least_samples: least_samples(picture, self.least_area_px2) as u32,
        }
    }
}

/// Thresholds chosen from pictures of the recording.
#[derive(Debug, Clone, Default)]
pub struct Calibration {
    /// For each hue, for each picture: summits without thin lines, and with them.
    summits: Vec<[Vec<Vec<threshold::Summit>>; 2]>,
}

impl Calibration {
    /// For `hues` hues.
    pub fn new(hues: usize) -> Self {
        Self { summits: vec![[Vec::new(), Vec::new()]; hues] }
    }

    /// Learns from a picture.
    pub fn see(&mut self, picture: &Picture<'_>, colours: &[MarkColour]) {
        let least = least_samples(picture, LEAST_AREA_PX2);
        for (seen, colour) in self.summits.iter_mut().zip(colours) {
            let mut relief = threshold::Relief::new(picture, HueAxis::new(colour, picture.layout.matrix));
            seen[1].push(relief.summits(least));
            relief.open();
            seen[0].push(relief.summits(least));
        }
    }

    /// The threshold of hue `index` with `marks` marks, on the scale to 255, and whether the marks are thin; `None`
    /// where nothing has that hue.
    pub fn threshold(&self, index: usize, marks: usize) -> Option<(f64, bool)> {
        let [opened, raw] = self.summits.get(index)?;
        match threshold::choose(opened, marks) {
            Some(threshold) => Some((threshold, false)),
            None => threshold::choose(raw, marks).map(|t| (t, true)),
        }
    }

    /// The strongest component of hue `index` in any picture, on the scale to 255.
    pub fn strongest(&self, index: usize) -> f64 {
        let raw = self.summits.get(index).map(|s| &s[1]);
        raw.into_iter().flatten().flatten().map(|s| s.top).fold(0.0, f64::max)
    }
}

/// Chroma samples of an area in luma pixels.
fn least_samples(picture: &Picture<'_>, area_px2: f64) -> usize {
    let sample = f64::from(1u32 << (picture.layout.chroma_shift_x + picture.layout.chroma_shift_y));
    ((area_px2 / sample) as usize).max(4)
}
