//! The binary picture of a region, or of the whole picture at a coarse scale (Fig. 8 c), and its connected parts.

use std::ops::Range;

use opencv::core::{CV_32S, Mat, MatTraitConstManual};
use opencv::imgproc;

use super::blobs::Region;
use super::centroid::Silhouette;
use super::component::HueAxis;
use super::morphology::{dilate, erode};
use super::plane::Plane;
use crate::error::{Error, Result};
use crate::video::Picture;

/// What is above the threshold.
pub struct Mask {
    region: Region,
    bytes: Vec<u8>,
    /// Parts that almost touch are one.
    bridged: bool,
}

impl Mask {
    /// Of one region at the scale of the chroma samples.
    pub fn of(picture: &Picture<'_>, axis: HueAxis, threshold: i16, thin: bool, region: Region) -> Self {
        let mut component = Vec::with_capacity((region.right - region.left) * (region.bottom - region.top));
        for y in region.top..region.bottom {
            axis.row(picture, y, region.left..region.right, &mut component);
        }
        Self::of_component(&component, threshold, thin, region)
    }

    /// Of a whole picture at its scale.
    pub fn of_plane(plane: &Plane, threshold: i16, thin: bool) -> Self {
        let region = Region { left: 0, top: 0, right: plane.width, bottom: plane.height };
        Self::of_component(&plane.values, threshold, thin, region)
    }

    /// Takes parts up to two samples apart for one: the quadrants of a target touch at a point, in which neither is dark.
    pub fn bridged(self, bridged: bool) -> Self {
        Self { bridged, ..self }
    }

    /// Smooths the component over a plus of five samples against camera noise, compares, and mends the outline:
    /// opening takes away lines of up to two samples (burnt-in graphics), closing heals a mark that one crosses.
    fn of_component(component: &[i16], threshold: i16, thin: bool, region: Region) -> Self {
        let (width, height) = (region.right - region.left, region.bottom - region.top);
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
        Self { region, bytes, bridged: false }
    }

    /// The mask, row by row, 255 inside.
    pub fn rows(&self) -> impl Iterator<Item = (usize, &[u8])> {
        let width = self.region.right - self.region.left;
        self.bytes.chunks(width).enumerate().map(|(i, row)| (self.region.top + i, row))
    }

    /// First column of [`Mask::rows`].
    pub fn left(&self) -> usize {
        self.region.left
    }

    /// The connected regions (8 neighbours).
    pub fn parts(&self) -> Result<Vec<Part>> {
        let failed = |error| Error::opencv("labelling the binary picture")(error);
        let (labels, boxes) = self.labelled().map_err(failed)?;
        let labels = labels.data_typed::<i32>().map_err(failed)?;
        let width = self.region.right - self.region.left;
        let mut parts = Vec::with_capacity(boxes.len());
        for bounds in boxes {
            let mut points = Vec::with_capacity(bounds.samples);
            for y in bounds.rows.clone() {
                let row = &labels[y * width..][..width];
                let mask = &self.bytes[y * width..][..width];
                let inside = bounds.columns.clone().filter(|x| row[*x] == bounds.label && mask[*x] > 0);
                points.extend(inside.map(|x| [x + self.region.left, y + self.region.top]));
            }
            parts.push(Part { points });
        }
        Ok(parts)
    }

    /// Labels the connected regions of the mask.
    fn labelled(&self) -> opencv::Result<(Mat, Vec<Bounds>)> {
        let (rows, columns) = (self.region.bottom - self.region.top, self.region.right - self.region.left);
        let mut grown;
        let mut bytes = &self.bytes;
        if self.bridged {
            grown = self.bytes.clone();
            dilate(&mut grown, columns, 1);
            bytes = &grown;
        }
        let mask = Mat::new_rows_cols_with_data(rows as i32, columns as i32, bytes)?;
        let (mut labels, mut stats, mut centroids) = (Mat::default(), Mat::default(), Mat::default());
        imgproc::connected_components_with_stats(&mask, &mut labels, &mut stats, &mut centroids, 8, CV_32S)?;
        let of_label = |(label, stats): (usize, &[i32])| {
            let stat = |column: i32| stats[column as usize] as usize;
            let (left, top) = (stat(imgproc::CC_STAT_LEFT), stat(imgproc::CC_STAT_TOP));
            Bounds {
                label: label as i32,
                samples: stat(imgproc::CC_STAT_AREA),
                columns: left..left + stat(imgproc::CC_STAT_WIDTH),
                rows: top..top + stat(imgproc::CC_STAT_HEIGHT),
            }
        };
        // label 0 is the background
        let stats = stats.data_typed::<i32>()?.chunks_exact(imgproc::CC_STAT_MAX as usize);
        Ok((labels, stats.enumerate().skip(1).map(of_label).collect()))
    }
}

/// Where a label is found.
struct Bounds {
    label: i32,
    samples: usize,
    columns: Range<usize>,
    rows: Range<usize>,
}

/// One connected region: the columns and rows of its samples.
#[derive(Debug, Clone, PartialEq)]
pub struct Part {
    pub points: Vec<[usize; 2]>,
}

impl Part {
    /// Mean column and row.
    pub fn centre(&self) -> [f64; 2] {
        let n = self.points.len().max(1) as f64;
        [0, 1].map(|axis| self.points.iter().map(|p| p[axis] as f64).sum::<f64>() / n)
    }

    /// Area over that of a disc with the same second moments: 1 for a disc, 0.95 for a square, 0.8 for an ellipse
    /// of 2 : 1, 0.5 for two opposite quadrants.
    ///
    /// ```text
    /// roundness = A / (2π (μ_xx + μ_yy)),   μ about the centre, the samples' own extent included
    /// ```
    pub fn roundness(&self) -> f64 {
        let [cx, cy] = self.centre();
        let n = self.points.len() as f64;
        let squares: f64 = self.points.iter().map(|p| (p[0] as f64 - cx).powi(2) + (p[1] as f64 - cy).powi(2)).sum();
        n / (std::f64::consts::TAU * (squares / n + 1.0 / 6.0))
    }

    /// Its samples in the picture.
    pub fn silhouette(&self, picture: &Picture<'_>) -> Silhouette {
        let layout = picture.layout;
        let points_px: Vec<[f64; 2]> =
            self.points.iter().map(|p| layout.chroma_to_luma(p[0] as f64, p[1] as f64).into()).collect();
        silhouette(picture, points_px)
    }

    /// The same from a coarse plane, interpolated to the chroma samples, so that its outline is no coarse staircase.
    pub fn finer_silhouette(&self, picture: &Picture<'_>, plane: &Plane, threshold: i16) -> Silhouette {
        if plane.level == 0 {
            return self.silhouette(picture);
        }
        let layout = picture.layout;
        let (side, threshold) = (1usize << plane.level, f32::from(threshold));
        let bound = |axis: usize, last: usize| {
            let values = || self.points.iter().map(|p| p[axis]);
            values().min().unwrap_or(0).saturating_sub(1)..(values().max().unwrap_or(0) + 2).min(last)
        };
        let (columns, rows) = (bound(0, plane.width), bound(1, plane.height));
        let width = columns.len();
        let mut near = vec![false; width * rows.len()];
        for [x, y] in &self.points {
            for j in (y.saturating_sub(1)..=y + 1).filter(|j| rows.contains(j)) {
                for i in (x.saturating_sub(1)..=x + 1).filter(|i| columns.contains(i)) {
                    near[(j - rows.start) * width + i - columns.start] = true;
                }
            }
        }
        let mut points_px = Vec::new();
        for y in rows.start * side..rows.end * side {
            for x in columns.start * side..columns.end * side {
                let inside = near[(y / side - rows.start) * width + x / side - columns.start];
                if inside && interpolated(plane, x, y) > threshold {
                    points_px.push(layout.chroma_to_luma(x as f64, y as f64).into());
                }
            }
        }
        silhouette(picture, points_px)
    }
}

/// The coarse plane at a chroma sample.
fn interpolated(plane: &Plane, x: usize, y: usize) -> f32 {
    let side = (1usize << plane.level) as f32;
    let split = |at: usize, size: usize| {
        let at = ((at as f32 + 0.5) / side - 0.5).clamp(0.0, size as f32 - 1.0);
        let low = at as usize;
        (low, (low + 1).min(size - 1), at - low as f32)
    };
    let ((left, right, s), (top, bottom, t)) = (split(x, plane.width), split(y, plane.height));
    let value = |x: usize, y: usize| f32::from(plane.values[y * plane.width + x]);
    let row = |y: usize| value(left, y) + s * (value(right, y) - value(left, y));
    row(top) + t * (row(bottom) - row(top))
}

fn silhouette(picture: &Picture<'_>, points_px: Vec<[f64; 2]>) -> Silhouette {
    let layout = picture.layout;
    let half_sample_px = [layout.chroma_shift_x, layout.chroma_shift_y].map(|shift| 0.5 * f64::from(1u32 << shift));
    let n = points_px.len().max(1) as f64;
    let centre_px = [0, 1].map(|axis| points_px.iter().map(|p| p[axis]).sum::<f64>() / n);
    Silhouette { centre_px, points_px, half_sample_px }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn part(inside: impl Fn(f64, f64) -> bool) -> Part {
        let at = |v: usize| v as f64 - 30.0;
        let points = (0..61).flat_map(|y| (0..61).map(move |x| [x, y])).filter(|p| inside(at(p[0]), at(p[1])));
        Part { points: points.collect() }
    }

    #[test]
    fn a_disc_is_round_and_a_line_is_not() {
        assert!((part(|x, y| x.hypot(y) < 20.5).roundness() - 1.0).abs() < 0.02);
        assert!((part(|x, y| (x / 2.0).hypot(y) < 12.0).roundness() - 0.8).abs() < 0.03);
        let quadrants = part(|x, y| x.hypot(y) < 20.5 && x * y >= 0.0).roundness();
        // the two lines of samples on the axes belong to it as well
        assert!((quadrants - 0.5).abs() < 0.05, "{quadrants}");
        assert!(part(|x, y| x.abs() < 28.0 && y.abs() < 3.0).roundness() < 0.3);
    }
}
