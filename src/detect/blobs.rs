//! Frame → blobs: the scan for the hue, the binary mask, its connected regions.

use opencv::core::{CV_8U, CV_32S, Mat, MatTraitConst, MatTraitConstManual, Point, Rect};
use opencv::imgproc;

use super::centroid::{self, Centroid, Silhouette};
use super::component::{BLOCK, HueAxis};
use crate::error::{Error, Result};
use crate::video::Picture;

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

/// Chroma rows of one block of the scan.
const BLOCK_ROWS: usize = 16;
/// Only every second chroma row is scanned: a mark is taller than that.
const SCAN_STEP: usize = 2;

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
    /// Least number of samples.
    pub least_samples: u32,
}

/// Samples around a hit block: a mark that ends in the next block is whole, and mending its outline does not meet
/// the region's edge.
const MARGIN: usize = 6;

/// Finds and measures the blobs of one hue.
pub(super) fn find(picture: &Picture<'_>, target: &Target, blobs: &mut Vec<Blob>) -> Result<()> {
    for region in regions(picture, target.axis, target.threshold) {
        let mask = Mask::of(picture, target.axis, target.threshold, target.thin, region)?;
        for silhouette in mask.silhouettes(picture, target.least_samples)? {
            let samples = silhouette.points_px.len() as u32;
            let binary_px = silhouette.centre_px;
            if let Some(centroid) = centroid::measure(picture, target.axis, &silhouette) {
                blobs.push(Blob { hue: target.hue, centroid, binary_px, samples });
            }
        }
    }
    Ok(())
}

/// A rectangle of chroma samples: left, top, right, bottom (exclusive).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Region {
    pub left: usize,
    pub top: usize,
    pub right: usize,
    pub bottom: usize,
}

/// Rectangles around everything that the scan hits, none touching another.
pub(super) fn regions(picture: &Picture<'_>, axis: HueAxis, threshold: i16) -> Vec<Region> {
    let (width, height) = picture.layout.chroma_size();
    let (columns, rows) = (width.div_ceil(BLOCK), height.div_ceil(BLOCK_ROWS));
    let mut hit = vec![false; columns * rows];
    let mut maxima = vec![i16::MIN; columns];
    for y in (0..height).step_by(SCAN_STEP) {
        axis.block_maxima(picture, y, &mut maxima);
        for (h, m) in hit[y / BLOCK_ROWS * columns..].iter_mut().zip(&maxima) {
            *h |= *m > threshold;
        }
    }
    let mut regions: Vec<Region> = Vec::new();
    for row in 0..rows {
        for column in 0..columns {
            if hit[row * columns + column] {
                let grown = Region {
                    left: (column * BLOCK).saturating_sub(MARGIN),
                    top: (row * BLOCK_ROWS).saturating_sub(MARGIN),
                    right: ((column + 1) * BLOCK + MARGIN).min(width),
                    bottom: ((row + 1) * BLOCK_ROWS + MARGIN).min(height),
                };
                merge(&mut regions, grown);
            }
        }
    }
    regions
}

/// Adds a rectangle, uniting it with every one it touches.
fn merge(regions: &mut Vec<Region>, mut region: Region) {
    while let Some(i) = regions.iter().position(|r| {
        r.left <= region.right && region.left <= r.right && r.top <= region.bottom && region.top <= r.bottom
    }) {
        let other = regions.swap_remove(i);
        region = Region {
            left: region.left.min(other.left),
            top: region.top.min(other.top),
            right: region.right.max(other.right),
            bottom: region.bottom.max(other.bottom),
        };
    }
    regions.push(region);
}

/// The binary picture of one region (Fig. 8 c).
pub(super) struct Mask {
    region: Region,
    bytes: Vec<u8>,
}

impl Mask {
    /// Smooths the component over a plus of five samples against camera noise, compares, and mends the outline:
    /// opening takes away lines of up to two samples (burnt-in graphics), closing heals a mark that one crosses.
    pub(super) fn of(picture: &Picture<'_>, axis: HueAxis, threshold: i16, thin: bool, region: Region) -> Result<Self> {
        let (width, height) = (region.right - region.left, region.bottom - region.top);
        let mut component = Vec::with_capacity(width * height);
        for y in region.top..region.bottom {
            axis.row(picture, y, region.left..region.right, &mut component);
        }
        let mut bytes = vec![0u8; width * height];
        // the outermost samples stay outside: the region has a margin
        for y in 1..height.saturating_sub(1) {
            let row = |y: usize| &component[y * width..(y + 1) * width];
            let (above, here, below) = (row(y - 1), row(y), row(y + 1));
            let out = &mut bytes[y * width..(y + 1) * width];
            for x in 1..width.saturating_sub(1) {
                let sides = i32::from(here[x - 1]) + i32::from(here[x + 1]) + i32::from(above[x]) + i32::from(below[x]);
                out[x] = if 4 * i32::from(here[x]) + sides > 8 * i32::from(threshold) { 255 } else { 0 };
            }
        }
        let mut mask = Self { region, bytes };
        if !thin {
            mask.mend().map_err(Error::opencv("mending the binary picture"))?;
        }
        Ok(mask)
    }

    fn mend(&mut self) -> opencv::Result<()> {
        let anchor = Point::new(-1, -1);
        let kernel = imgproc::get_structuring_element(imgproc::MORPH_RECT, opencv::core::Size::new(3, 3), anchor)?;
        let border = imgproc::morphology_default_border_value()?;
        let (rows, columns) = self.size();
        let mask = Mat::new_rows_cols_with_data(rows, columns, &self.bytes)?;
        let (mut opened, mut closed) = (Mat::default(), Mat::default());
        let constant = opencv::core::BORDER_CONSTANT;
        imgproc::morphology_ex(&mask, &mut opened, imgproc::MORPH_OPEN, &kernel, anchor, 1, constant, border)?;
        imgproc::morphology_ex(&opened, &mut closed, imgproc::MORPH_CLOSE, &kernel, anchor, 2, constant, border)?;
        self.bytes = closed.data_bytes()?.to_vec();
        Ok(())
    }

    fn size(&self) -> (i32, i32) {
        ((self.region.bottom - self.region.top) as i32, (self.region.right - self.region.left) as i32)
    }

    /// The mask, row by row, 255 inside.
    pub(super) fn rows(&self) -> impl Iterator<Item = (usize, &[u8])> {
        let width = self.region.right - self.region.left;
        self.bytes.chunks(width).enumerate().map(|(i, row)| (self.region.top + i, row))
    }

    /// First column of [`Mask::rows`].
    pub(super) fn left(&self) -> usize {
        self.region.left
    }

    /// The connected regions (8 neighbours) of at least `least_samples` samples.
    fn silhouettes(&self, picture: &Picture<'_>, least_samples: u32) -> Result<Vec<Silhouette>> {
        let failed = |e| Error::opencv("labelling the binary picture")(e);
        let (rows, columns) = self.size();
        let mask = Mat::new_rows_cols_with_data(rows, columns, &self.bytes).map_err(failed)?;
        debug_assert_eq!(mask.typ(), CV_8U);
        let (mut labels, mut stats, mut centroids) = (Mat::default(), Mat::default(), Mat::default());
        let count = imgproc::connected_components_with_stats(&mask, &mut labels, &mut stats, &mut centroids, 8, CV_32S)
            .map_err(failed)?;
        let layout = picture.layout;
        let half_sample_px =
            [0.5 * f64::from(1u32 << layout.chroma_shift_x), 0.5 * f64::from(1u32 << layout.chroma_shift_y)];
        let mut silhouettes = Vec::new();
        for label in 1..count {
            let stat = |column: i32| stats.at_2d::<i32>(label, column).copied().map_err(failed);
            if (stat(imgproc::CC_STAT_AREA)? as u32) < least_samples {
                continue;
            }
            let frame = Rect::new(
                stat(imgproc::CC_STAT_LEFT)?,
                stat(imgproc::CC_STAT_TOP)?,
                stat(imgproc::CC_STAT_WIDTH)?,
                stat(imgproc::CC_STAT_HEIGHT)?,
            );
            let mut points_px = Vec::new();
            for y in frame.y..frame.y + frame.height {
                for x in frame.x..frame.x + frame.width {
                    if *labels.at_2d::<i32>(y, x).map_err(failed)? == label {
                        let at = Point::new(x + self.region.left as i32, y + self.region.top as i32);
                        let (px, py) = layout.chroma_to_luma(f64::from(at.x), f64::from(at.y));
                        points_px.push([px, py]);
                    }
                }
            }
            let n = points_px.len().max(1) as f64;
            let centre_px = [0, 1].map(|axis| points_px.iter().map(|p: &[f64; 2]| p[axis]).sum::<f64>() / n);
            silhouettes.push(Silhouette { centre_px, points_px, half_sample_px });
        }
        Ok(silhouettes)
    }
}
