//! Frame → blobs: the scan for the hue, the binary mask, its connected regions.

use std::ops::Range;

use opencv::core::{CV_32S, Mat, MatTraitConstManual};
use opencv::imgproc;

use super::centroid::{self, Centroid, Silhouette};
use super::component::{BLOCK, HueAxis};
use super::morphology::{dilate, erode};
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
        let mask = Mask::of(picture, target.axis, target.threshold, target.thin, region);
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
    pub(super) fn of(picture: &Picture<'_>, axis: HueAxis, threshold: i16, thin: bool, region: Region) -> Self {
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
        if !thin {
            erode(&mut bytes, width, 1);
            dilate(&mut bytes, width, 3);
            erode(&mut bytes, width, 2);
        }
        Self { region, bytes }
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
        let failed = |error| Error::opencv("labelling the binary picture")(error);
        let Labelled { labels, parts } = self.labelled().map_err(failed)?;
        let labels = labels.data_typed::<i32>().map_err(failed)?;
        let layout = picture.layout;
        let half_sample_px =
            [0.5 * f64::from(1u32 << layout.chroma_shift_x), 0.5 * f64::from(1u32 << layout.chroma_shift_y)];
        let width = self.region.right - self.region.left;
        let mut silhouettes = Vec::new();
        for part in parts.iter().filter(|part| part.samples >= least_samples as usize) {
            let mut points_px: Vec<[f64; 2]> = Vec::with_capacity(part.samples);
            for y in part.rows.clone() {
                let row = &labels[y * width..][..width];
                for x in part.columns.clone().filter(|x| row[*x] == part.label) {
                    let (x, y) = (x + self.region.left, y + self.region.top);
                    let (x_px, y_px) = layout.chroma_to_luma(x as f64, y as f64);
                    points_px.push([x_px, y_px]);
                }
            }
            let n = points_px.len().max(1) as f64;
            let centre_px = [0, 1].map(|axis| points_px.iter().map(|p| p[axis]).sum::<f64>() / n);
            silhouettes.push(Silhouette { centre_px, points_px, half_sample_px });
        }
        Ok(silhouettes)
    }

    /// Labels the connected regions of the mask.
    fn labelled(&self) -> opencv::Result<Labelled> {
        let (rows, columns) = self.size();
        let mask = Mat::new_rows_cols_with_data(rows, columns, &self.bytes)?;
        let (mut labels, mut stats, mut centroids) = (Mat::default(), Mat::default(), Mat::default());
        imgproc::connected_components_with_stats(&mask, &mut labels, &mut stats, &mut centroids, 8, CV_32S)?;
        let of_label = |(label, stats): (usize, &[i32])| {
            let stat = |column: i32| stats[column as usize] as usize;
            let (left, top) = (stat(imgproc::CC_STAT_LEFT), stat(imgproc::CC_STAT_TOP));
            Part {
                label: label as i32,
                samples: stat(imgproc::CC_STAT_AREA),
                columns: left..left + stat(imgproc::CC_STAT_WIDTH),
                rows: top..top + stat(imgproc::CC_STAT_HEIGHT),
            }
        };
        // label 0 is the background
        let stats = stats.data_typed::<i32>()?.chunks_exact(imgproc::CC_STAT_MAX as usize);
        let parts = stats.enumerate().skip(1).map(of_label).collect();
        Ok(Labelled { labels, parts })
    }
}

/// The connected regions of a mask.
struct Labelled {
    /// The label of every sample, row by row.
    labels: Mat,
    parts: Vec<Part>,
}

/// One connected region.
struct Part {
    label: i32,
    samples: usize,
    columns: Range<usize>,
    rows: Range<usize>,
}
