//! Frame → blobs (paper Section III.II, Fig. 8): colour component → filtered → binary → connected regions → one
//! centroid a region, each with its variance.

mod blobs;
mod calibration;
mod centroid;
mod component;
pub mod debug;
mod mask;
mod morphology;
mod plane;
mod region;
mod samples;
mod scene;
mod shading;
mod siting;
mod threshold;

pub use blobs::Blob;
pub use calibration::{COUNTS, Spot, Trial};
use centroid::Conditions;
pub use centroid::{Centroid, Channels, Mixing, Shading};
pub use mask::Part;
pub use samples::{Album, HuePeak};
pub use scene::scene;
pub use shading::ShadingSurvey;
pub use siting::{Siting, SitingSurvey};
pub use threshold::LEAST_COMPONENT;

use std::sync::Arc;

use blobs::{Planes, Target};
use component::{HueAxis, from_255};

use crate::error::Result;
use crate::experiment::MarkColour;
use crate::video::{Layout, Matrix, OwnedPicture, Picture};

/// What marks look like, and how they are found.
#[derive(Debug, Clone, PartialEq)]
pub struct Hue {
    /// The colour as it was asked for.
    pub colour: MarkColour,
    /// How many marks have it.
    pub marks: usize,
    /// Least component of a mark, on the scale to 255.
    pub threshold: f64,
    /// The marks are a few samples wide, so lines are not filtered out.
    pub thin: bool,
    /// Its hue as the recording shows it, from C_b towards C_r; that of the colour where it is not known.
    pub angle_rad: Option<f64>,
    /// The scale at which it is looked for: 2^level chroma samples.
    pub level: u32,
    /// Usual area of a mark, where it is known.
    pub area_px2: Option<f64>,
    /// Only round spots count, and of that area: what the marks stand on may have their hue.
    pub round: bool,
    /// Marks are black and white targets.
    pub quadrants: bool,
    /// How a mark's levels differ around its edge, where it is lit from one side.
    pub shading: Shading,
}

impl Default for Hue {
    fn default() -> Self {
        Self {
            colour: MarkColour::red(),
            marks: 0,
            threshold: LEAST_COMPONENT,
            thin: false,
            angle_rad: None,
            level: 0,
            area_px2: None,
            round: false,
            quadrants: false,
            shading: Shading::default(),
        }
    }
}

impl Hue {
    fn axis(&self, matrix: Matrix) -> HueAxis {
        self.angle_rad.map_or_else(|| HueAxis::new(&self.colour, matrix), HueAxis::at_angle)
    }

    /// Takes over what a trial showed.
    pub fn adopt(&mut self, trial: &Trial, sample_px2: f64) {
        (self.threshold, self.thin, self.level) = (trial.threshold, trial.thin, trial.level);
        self.angle_rad = trial.angle_rad;
        self.quadrants = trial.shows_targets();
        self.area_px2 = trial.usual_samples().map(|n| n * sample_px2 * f64::from(1u32 << (2 * trial.level)));
    }

    /// It is looked for in another way.
    pub fn is_sought_otherwise(&self, other: &Self) -> bool {
        (self.threshold, self.thin, self.level) != (other.threshold, other.thin, other.level)
            || (self.angle_rad, self.area_px2) != (other.angle_rad, other.area_px2)
    }
}

/// Finds marks in pictures.
#[derive(Debug, Clone)]
pub struct Detector {
    hues: Vec<Hue>,
    least_area_px2: f64,
    siting: Option<Siting>,
    scene: Option<Arc<OwnedPicture>>,
    mixing: Mixing,
}

/// Smallest mark that is looked for.
pub const LEAST_AREA_PX2: f64 = 12.0;

impl Detector {
    /// A detector for `hues`.
    pub fn new(hues: Vec<Hue>) -> Self {
        Self { hues, least_area_px2: LEAST_AREA_PX2, siting: None, scene: None, mixing: Mixing::default() }
    }

    /// With chroma samples where the recording shows them to lie.
    pub fn with_siting(self, siting: Option<Siting>) -> Self {
        Self { siting, ..self }
    }

    /// With marks that mix in this way with what is behind them.
    pub const fn with_mixing(mut self, mixing: Mixing) -> Self {
        self.mixing = mixing;
        self
    }

    /// With a picture of what stands still.
    pub fn with_scene(self, scene: Option<Arc<OwnedPicture>>) -> Self {
        Self { scene, ..self }
    }

    /// Where it takes the chroma samples to lie.
    pub const fn siting(&self) -> Option<Siting> {
        self.siting
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
        let Some(siting) = &self.siting else { return self.detect_by(picture, Channels::All) };
        let layout = Layout { chroma_site_px: siting.used_px, ..picture.layout };
        // a mark without a hue has luma alone
        let by_colour = |axis: HueAxis| siting.contradicted && !axis.is_luma();
        let channels = |axis| if by_colour(axis) { Channels::Chroma } else { Channels::All };
        let mut blobs = self.detect_each_by(&Picture { layout, ..*picture }, channels)?;
        for centroid in blobs.iter_mut().map(|b| &mut b.centroid) {
            for axis in 0..2 {
                centroid.variance_px2[axis] += (centroid.chroma_share * siting.sd_px[axis]).powi(2);
            }
        }
        Ok(blobs)
    }

    /// All blobs, measured by some channels alone, the chroma samples where the file states them.
    ///
    /// # Errors
    /// As [`Detector::detect`].
    pub fn detect_by(&self, picture: &Picture<'_>, channels: Channels) -> Result<Vec<Blob>> {
        self.detect_each_by(picture, |_| channels)
    }

    /// The same, each hue by channels of its own.
    fn detect_each_by(&self, picture: &Picture<'_>, channels: impl Fn(HueAxis) -> Channels) -> Result<Vec<Blob>> {
        let (mut blobs, mut planes) = (Vec::new(), Planes::default());
        let site = picture.layout.chroma_site_px;
        let is_alike = |layout: &Layout| Layout { chroma_site_px: site, ..*layout } == picture.layout;
        let scene = self.scene.as_ref().filter(|scene| is_alike(&scene.layout));
        let scene = scene.map(|scene| Picture { layout: picture.layout, ..scene.view() });
        for (index, hue) in self.hues.iter().enumerate() {
            let target = self.target(index, hue, picture);
            let (shading, mixing, scene) = (target.shading, self.mixing, scene.as_ref());
            let conditions = Conditions { channels: channels(target.axis), shading, mixing, scene };
            blobs::find(picture, &target, &conditions, &mut planes, &mut blobs)?;
        }
        Ok(blobs)
    }

    /// How the marks' levels differ around their edges, by hue.
    fn limbs(&self, picture: &Picture<'_>) -> Result<Vec<Vec<Shading>>> {
        let mut planes = Planes::default();
        let limbs = |(index, hue)| blobs::limbs(picture, &self.target(index, hue, picture), &mut planes);
        self.hues.iter().enumerate().map(limbs).collect()
    }

    /// All blobs, to some tenths of a chroma sample and many times as fast: enough to see what moves and how.
    ///
    /// # Errors
    /// As [`Detector::detect`].
    pub fn glance(&self, picture: &Picture<'_>) -> Result<Vec<Blob>> {
        let (mut blobs, mut planes) = (Vec::new(), Planes::default());
        for (index, hue) in self.hues.iter().enumerate() {
            blobs::glance(picture, &self.target(index, hue, picture), &mut planes, &mut blobs)?;
        }
        Ok(blobs)
    }

    fn target(&self, index: usize, hue: &Hue, picture: &Picture<'_>) -> Target {
        let axis = hue.axis(picture.layout.matrix);
        let samples = |area_px2: f64| least_samples(picture, area_px2) >> (2 * hue.level);
        // a mark that is partly hidden is smaller, one that is blurred or merged with another larger
        let round = hue.round || axis.is_luma();
        let [smaller, larger] = if round { ROUND_SPOT } else { COLOURED_SPOT };
        let least = hue.area_px2.map_or(0.0, |a| a / smaller).max(self.least_area_px2);
        Target {
            hue: index as u8,
            axis,
            threshold: from_255(hue.threshold),
            thin: hue.thin,
            level: hue.level,
            round,
            quadrants: hue.quadrants,
            samples: [samples(least).max(3), hue.area_px2.map_or(usize::MAX, |a| samples(larger * a))],
            shading: hue.shading,
        }
    }
}

/// Factors by which a spot may be smaller and larger than a mark: one that is told by its shape alone,
const ROUND_SPOT: [f64; 2] = [4.0, 4.0];
/// and one that is told by its hue.
const COLOURED_SPOT: [f64; 2] = [30.0, 30.0];

/// Chroma samples of an area in luma pixels.
fn least_samples(picture: &Picture<'_>, area_px2: f64) -> usize {
    let sample = f64::from(1u32 << (picture.layout.chroma_shift_x + picture.layout.chroma_shift_y));
    ((area_px2 / sample) as usize).max(3)
}
