//! The component of a whole picture, at the scale at which a mark is some ten samples wide.
//!
//! Level ℓ holds the means of 2^ℓ × 2^ℓ chroma samples: of a large mark the texture averages out, and looking costs
//! less. A mark without a hue stands out only against what lies around it, so its component is taken as a top hat
//! (Serra, Image Analysis and Mathematical Morphology, 1982, ch. XII):
//!
//! ```text
//! dark:  (Y • B) − Y      (closing, less the picture)
//! light: Y − (Y ∘ B)      (the picture, less its opening),     B a square of 2·10 + 1 samples
//! ```
//! A spot smaller than B keeps its contrast; a dark chamber or a bright wall, however large, is nothing.

use opencv::core::{
    BORDER_CONSTANT, BORDER_REPLICATE, Mat, MatTraitConstManual, Point, Scalar, Size, copy_make_border,
};
use opencv::imgproc;

use super::component::HueAxis;
use super::region::Region;
use super::samples::Samples;
use crate::error::{Error, Result};
use crate::video::Picture;

/// Half the side of the top hat's square: more than the width of a mark at its level.
const HALF_HAT: i32 = 10;

/// The component, sample by sample.
#[derive(Debug, Clone)]
pub struct Plane {
    pub width: usize,
    pub height: usize,
    /// 2^level chroma samples per sample.
    pub level: u32,
    /// 64ths of an 8-bit code.
    pub values: Vec<i16>,
}

impl Plane {
    /// Of a picture.
    pub fn of(picture: &Picture<'_>, axis: HueAxis, level: u32) -> Result<Self> {
        let (width, height) = picture.layout.chroma_size();
        let rows = |y: usize, row: &mut Vec<i16>| axis.row(picture, y, 0..width, row);
        Self::from_rows(width, height, level, &rows).against_surroundings(axis)
    }

    /// Of a picture that was kept.
    pub fn of_samples(samples: &Samples, axis: HueAxis, level: u32) -> Result<Self> {
        let rows = |y: usize, row: &mut Vec<i16>| samples.row(axis, y, row);
        Self::from_rows(samples.width, samples.height, level, &rows).against_surroundings(axis)
    }

    fn from_rows(width: usize, height: usize, level: u32, fill: &dyn Fn(usize, &mut Vec<i16>)) -> Self {
        let (columns, rows) = ((width >> level).max(1), (height >> level).max(1));
        let mut values = Vec::with_capacity(columns * rows);
        if level == 0 {
            (0..height).for_each(|y| fill(y, &mut values));
            return Self { width, height, level, values };
        }
        let side = 1usize << level;
        let mut row = Vec::with_capacity(width);
        for y in 0..rows {
            let mut sums = vec![0i32; columns];
            for k in y * side..((y + 1) * side).min(height) {
                row.clear();
                fill(k, &mut row);
                for (sum, run) in sums.iter_mut().zip(row.chunks(side)) {
                    *sum += run.iter().map(|v| i32::from(*v)).sum::<i32>();
                }
            }
            values.extend(sums.iter().map(|sum| (sum >> (2 * level)) as i16));
        }
        Self { width: columns, height: rows, level, values }
    }

    /// The rectangle around all samples above `floor`, with a margin of some samples; empty where there is none.
    pub(super) fn extent(&self, floor: i16, margin: usize) -> Region {
        let is_above = |value: &i16| *value > floor;
        let rows = || self.values.chunks_exact(self.width).enumerate();
        let hit = |(y, row): (usize, &[i16])| (row.iter().fold(i16::MIN, |m, v| m.max(*v)) > floor).then_some(y);
        let Some(top) = rows().find_map(hit) else { return Region { left: 0, top: 0, right: 0, bottom: 0 } };
        let (mut left, mut right, mut bottom) = (self.width, 0, top + 1);
        for (y, row) in rows().skip(top).filter(|row| hit(*row).is_some()) {
            left = left.min(row[..left].iter().position(is_above).unwrap_or(left));
            right = row[right..].iter().rposition(is_above).map_or(right, |at| right + at + 1);
            bottom = y + 1;
        }
        Region {
            left: left.saturating_sub(margin),
            top: top.saturating_sub(margin),
            right: (right + margin).min(self.width),
            bottom: (bottom + margin).min(self.height),
        }
    }

    /// The samples of a rectangle, row by row.
    pub(super) fn within(&self, region: Region) -> Vec<i16> {
        let rows = self.values.chunks_exact(self.width).take(region.bottom).skip(region.top);
        rows.flat_map(|row| &row[region.left..region.right]).copied().collect()
    }

    fn against_surroundings(mut self, axis: HueAxis) -> Result<Self> {
        if axis.is_luma() {
            self.values = self.top_hat().map_err(Error::opencv("comparing with the surroundings"))?;
        }
        Ok(self)
    }

    /// Beyond the edge the picture goes on as it ends there: what lies between a thing and the edge is no spot.
    fn top_hat(&self) -> opencv::Result<Vec<i16>> {
        let picture = Mat::new_rows_cols_with_data(self.height as i32, self.width as i32, &self.values)?;
        let (mut wide, mut hat) = (Mat::default(), Mat::default());
        let (half, side) = (HALF_HAT, 2 * HALF_HAT + 1);
        copy_make_border(&picture, &mut wide, half, half, half, half, BORDER_REPLICATE, Scalar::default())?;
        let kernel = imgproc::get_structuring_element(imgproc::MORPH_RECT, Size::new(side, side), Point::new(-1, -1))?;
        let border = imgproc::morphology_default_border_value()?;
        let (kind, anchor) = (imgproc::MORPH_TOPHAT, Point::new(-1, -1));
        imgproc::morphology_ex(&wide, &mut hat, kind, &kernel, anchor, 1, BORDER_CONSTANT, border)?;
        let (row, margin) = (self.width + 2 * half as usize, half as usize);
        let rows = hat.data_typed::<i16>()?.chunks_exact(row).skip(margin).take(self.height);
        Ok(rows.flat_map(|r| &r[margin..margin + self.width]).copied().collect())
    }
}
