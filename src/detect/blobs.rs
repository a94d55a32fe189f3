//! Frame → blobs: the scan for the hue, the binary mask, its connected regions.

use std::rc::Rc;

use super::centroid::{self, Centroid, Channels, Conditions, Shading, Silhouette};
use super::component::HueAxis;
use super::mask::{Mask, Part};
use super::plane::Plane;
use super::region::regions;
use crate::error::Result;
use crate::video::{Layout, Picture};

/// A region of a mark's colour, measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Blob {
    /// Which hue (index into the detector's hues).
    pub hue: u8,
    /// Where it is.
    pub centroid: Centroid,
    /// Mean of the binary mask, for comparison: what a plain chain would report.
    pub binary_px: [f64; 2],
    /// Samples of the mask.
    pub samples: u32,
}

impl Blob {
    /// The same mask of the same picture gave both.
    pub fn has_mask_of(&self, other: &Self) -> bool {
        (self.hue, self.binary_px) == (other.hue, other.binary_px)
    }
}

/// What is looked for.
#[derive(Debug, Clone, Copy)]
pub(super) struct Target {
    /// Index of the hue.
    pub hue: u8,
    /// Its direction.
    pub axis: HueAxis,
    /// Least component, 64ths of a code.
    pub threshold: i16,
    /// Marks are so small that lines cannot be told from them.
    pub thin: bool,
    /// 2^level chroma samples per sample.
    pub level: u32,
    /// Only round spots count.
    pub round: bool,
    /// Marks are black and white targets.
    pub quadrants: bool,
    /// Least and greatest number of samples.
    pub samples: [usize; 2],
    /// How its levels differ around its edge.
    pub shading: Shading,
}

impl Target {
    /// The mask covers the whole picture: at a coarse scale, or against the surroundings.
    pub fn is_sought_everywhere(&self) -> bool {
        self.level > 0 || self.axis.is_luma()
    }

    /// What every frame has many of is told from a mark by its shape: a mark without a hue is round.
    fn accepts(&self, part: &Part) -> bool {
        let [least, most] = self.samples;
        let size = part.points.len();
        (least..=most).contains(&size) && (!self.round || part.shape() >= LEAST_ROUNDNESS)
    }
}

/// A disc has 1, as has a black and white target; a line next to nothing.
pub(super) const LEAST_ROUNDNESS: f64 = 0.4;
/// Blobs of one hue that are measured in a frame, the largest ones.
const MOST_BLOBS: usize = 40;

/// Finds and measures the blobs of one hue.
pub(super) fn find(
    picture: &Picture<'_>,
    target: &Target,
    conditions: &Conditions<'_>,
    planes: &mut Planes,
    blobs: &mut Vec<Blob>,
) -> Result<()> {
    let (parts, plane) = parts(picture, target, planes)?;
    for part in &parts {
        let silhouette = silhouette(picture, target, part, plane.as_deref());
        let samples = part.points.len() as u32;
        let binary_px = silhouette.centre_px;
        let centroid = match conditions.channels {
            Channels::Chroma => None,
            _ if target.quadrants || part.is_target() => centroid::of_target(picture, &silhouette),
            _ => None,
        };
        let measure = || centroid::measure(picture, target.axis, &silhouette, conditions);
        if let Some(centroid) = centroid.or_else(measure) {
            blobs.push(Blob { hue: target.hue, centroid, binary_px, samples });
        }
    }
    Ok(())
}

/// How the levels of the round spots of one hue differ around their edges.
pub(super) fn limbs(picture: &Picture<'_>, target: &Target, planes: &mut Planes) -> Result<Vec<Shading>> {
    let (parts, plane) = parts(picture, target, planes)?;
    let is_disc = |part: &&Part| part.shape() >= LEAST_ROUNDNESS && !part.is_target();
    let discs = parts.iter().filter(is_disc);
    let limb = |part: &Part| {
        let silhouette = silhouette(picture, target, part, plane.as_deref());
        centroid::limb::of(picture, target.axis, target.threshold, &silhouette)
    };
    Ok(discs.filter_map(limb).collect())
}

/// Finds the spots of one hue; their places come from the mask's samples alone.
pub(super) fn glance(picture: &Picture<'_>, target: &Target, planes: &mut Planes, blobs: &mut Vec<Blob>) -> Result<()> {
    let (parts, plane) = parts(picture, target, planes)?;
    let layout = &picture.layout;
    let sides_px = [layout.chroma_shift_x, layout.chroma_shift_y].map(|shift| f64::from(1u32 << shift));
    for part in &parts {
        let silhouette = silhouette(picture, target, part, plane.as_deref());
        let samples = silhouette.points_px.len() as f64;
        let binary_px = silhouette.centre_px;
        // a coarse plane has been interpolated; samples at full resolution count by what they have above the threshold
        let [x_px, y_px] = match &plane {
            Some(plane) if plane.level > 0 => binary_px,
            Some(plane) => weighted(part, layout, &|[x, y]| plane.values[y * plane.width + x] - target.threshold),
            None => weighted(part, layout, &|[x, y]| target.axis.at(picture, x, y) - target.threshold),
        };
        // the rim's samples are known to a sample's width, each by itself
        let variance = |side_px: f64| side_px.powi(2) / 12.0 / samples.max(1.0).sqrt();
        let centroid = Centroid {
            x_px,
            y_px,
            variance_px2: [variance(sides_px[0]), variance(sides_px[1]), 0.0],
            area_px2: samples * sides_px[0] * sides_px[1],
            chroma_share: 0.0,
            cut: false,
            known_behind: None,
            misfit: 0.0,
        };
        if samples > 0.0 {
            blobs.push(Blob { hue: target.hue, centroid, binary_px, samples: part.points.len() as u32 });
        }
    }
    Ok(())
}

/// The samples of a region in the picture, at full resolution also where it was found in a coarse plane.
fn silhouette(picture: &Picture<'_>, target: &Target, part: &Part, plane: Option<&Plane>) -> Silhouette {
    match plane {
        Some(plane) => part.finer_silhouette(picture, plane, target.threshold),
        None => part.silhouette(picture),
    }
}

/// Mean of a region's samples in luma pixels, each with a weight of at least 1.
fn weighted(part: &Part, layout: &Layout, weight: &dyn Fn([usize; 2]) -> i16) -> [f64; 2] {
    let [mut sum, mut sum_x, mut sum_y] = [0.0; 3];
    for p in &part.points {
        let weight = f64::from(weight(*p).max(1));
        (sum, sum_x, sum_y) = (sum + weight, sum_x + weight * p[0] as f64, sum_y + weight * p[1] as f64);
    }
    layout.chroma_to_luma(sum_x / sum, sum_y / sum).into()
}

/// The regions of a target's colour, and the plane they were found in where the whole picture was searched.
fn parts(picture: &Picture<'_>, target: &Target, planes: &mut Planes) -> Result<(Vec<Part>, Option<Rc<Plane>>)> {
    let mut parts: Vec<Part> = Vec::new();
    let mut plane = None;
    let accepted = |mask: Mask| mask.parts().into_iter().filter(|p| target.accepts(p));
    if target.is_sought_everywhere() {
        let whole = planes.of(picture, target)?;
        let mask = Mask::of_plane(&whole, target.threshold, target.thin).bridged(target.axis.is_luma());
        parts.extend(accepted(mask));
        plane = Some(whole);
    } else {
        for region in regions(picture, target.axis, target.threshold) {
            parts.extend(accepted(Mask::of(picture, target.axis, target.threshold, target.thin, region)));
        }
    }
    if parts.len() > MOST_BLOBS {
        parts.sort_by_key(|part| std::cmp::Reverse(part.points.len()));
        parts.truncate(MOST_BLOBS);
    }
    Ok((parts, plane))
}

/// Planes of one picture: hues that differ in their threshold alone share one.
#[derive(Default)]
pub(super) struct Planes(Vec<(HueAxis, Rc<Plane>)>);

impl Planes {
    fn of(&mut self, picture: &Picture<'_>, target: &Target) -> Result<Rc<Plane>> {
        let known = self.0.iter().find(|(axis, plane)| *axis == target.axis && plane.level == target.level);
        if let Some((_, plane)) = known {
            return Ok(Rc::clone(plane));
        }
        let plane = Rc::new(Plane::of(picture, target.axis, target.level)?);
        self.0.push((target.axis, Rc::clone(&plane)));
        Ok(plane)
    }
}
