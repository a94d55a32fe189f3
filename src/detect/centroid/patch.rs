//! The pixels around a mark: luma and both colour differences at luma resolution, in polar coordinates.

use std::ops::Range;

use super::outline::{Outline, RING_PX, Zone};
use crate::video::{Picture, Plane};

/// Luma, C_b and C_r as 8-bit codes, all equally sharp.
pub const CHANNELS: usize = 3;
/// One value a channel.
pub type Levels = [f32; CHANNELS];

/// One pixel.
#[derive(Debug, Clone, Copy)]
pub struct Sample {
    /// From the outline's centre.
    pub dx_px: f32,
    /// Downwards.
    pub dy_px: f32,
    /// From the outline's centre.
    pub distance_px: f32,
    /// Sector of the outline.
    pub sector: u16,
    /// Place in the planes of the patch.
    place: u32,
    /// The pixel's codes.
    pub levels: Levels,
}

impl Sample {
    /// A white field, were the pixels a chessboard.
    #[inline]
    pub fn is_white(&self) -> bool {
        (self.dx_px as i32 + self.dy_px as i32) & 1 == 0
    }

    /// How far outside the boundary a pixel lies.
    #[inline]
    pub fn depth_px(&self, outline: &Outline) -> f32 {
        self.distance_px - outline.radii_px[usize::from(self.sector)]
    }

    /// Where a pixel lies.
    #[inline]
    pub fn zone(&self, outline: &Outline) -> Zone {
        let (depth, band) = (self.depth_px(outline), outline.bands_px[usize::from(self.sector)]);
        // counted rather than asked one by one: which zone comes next cannot be foretold
        let boundaries = [depth >= -band, depth > band, depth > band + RING_PX];
        [Zone::Core, Zone::Band, Zone::Ring, Zone::Beyond][boundaries.map(usize::from).iter().sum::<usize>()]
    }
}

/// How much farther a refined outline may reach.
const REFINED_PX: f32 = 3.0;

fn reach_of(outline: &Outline) -> f32 {
    (outline.reach_px() + REFINED_PX).ceil()
}

/// The pixels within reach of a mark.
pub struct Patch {
    left: usize,
    top: usize,
    width: usize,
    height: usize,
    soft: bool,
    planes: [Vec<f32>; CHANNELS],
    /// Core, band and ring; the corners beyond are left out.
    pub samples: Vec<Sample>,
}

impl Patch {
    /// Reads core, band and ring, and a little more for an outline that is refined later.
    pub fn read(picture: &Picture<'_>, outline: &Outline) -> Self {
        let mut patch = Self::planes_of(picture, outline);
        patch.gather(outline, reach_of(outline));
        patch
    }

    /// The planes alone, no samples.
    pub fn planes_of(picture: &Picture<'_>, outline: &Outline) -> Self {
        let layout = picture.layout;
        let reach = reach_of(outline);
        let from = |c: f64, size: usize| (c - f64::from(reach)).clamp(0.0, size as f64) as usize;
        let to = |c: f64, size: usize| (c + f64::from(reach) + 1.0).clamp(0.0, size as f64) as usize;
        let [cx, cy] = outline.centre_px;
        let (left, top) = (from(cx, layout.width_px), from(cy, layout.height_px));
        let (width, height) = (to(cx, layout.width_px) - left, to(cy, layout.height_px) - top);
        let soft = layout.chroma_shift_x > 0 && layout.chroma_shift_y > 0;
        let mut patch = Self { left, top, width, height, soft, planes: Default::default(), samples: Vec::new() };
        if width > 0 && height > 0 {
            patch.planes =
                [patch.luma(picture), patch.chroma(picture, &picture.cb), patch.chroma(picture, &picture.cr)];
        }
        patch
    }

    /// What lies at the place of another patch's sample, which was read around the same outline.
    #[inline]
    pub fn levels_at(&self, sample: &Sample) -> Levels {
        [0, 1, 2].map(|k: usize| self.planes[k][sample.place as usize])
    }

    /// Luma is softened along both axes.
    pub fn is_soft(&self) -> bool {
        self.soft
    }

    /// How far from the centre a centroid can be.
    pub fn reach_px(&self) -> f64 {
        self.width.max(self.height) as f64
    }

    /// Gradients of all channels at a sample, codes in two pixels.
    pub fn gradients(&self, sample: &Sample) -> [[f32; 2]; CHANNELS] {
        let place = sample.place as usize;
        let (i, row) = (place % self.width, place - place % self.width);
        let (left, right) = (row + i.max(1) - 1, row + (i + 1).min(self.width - 1));
        let above = if row > 0 { place - self.width } else { place };
        let below = if row + self.width < self.planes[0].len() { place + self.width } else { place };
        [0, 1, 2].map(|k: usize| {
            let plane = &self.planes[k];
            [plane[right] - plane[left], plane[below] - plane[above]]
        })
    }

    fn gather(&mut self, outline: &Outline, reach: f32) {
        if self.width == 0 || self.height == 0 {
            return;
        }
        self.samples.reserve(self.width * self.height);
        // whole rows first, in loops that the compiler can turn into vector instructions
        let dx: Vec<f32> = (0..self.width).map(|i| ((self.left + i) as f64 - outline.centre_px[0]) as f32).collect();
        let (mut squares, mut sectors) = (vec![0.0; self.width], vec![0u16; self.width]);
        for j in 0..self.height {
            let dy = ((self.top + j) as f64 - outline.centre_px[1]) as f32;
            for ((square, sector), dx) in squares.iter_mut().zip(&mut sectors).zip(&dx) {
                *square = dx * dx + dy * dy;
                *sector = outline.sector(*dx, dy) as u16;
            }
            for i in (0..self.width).filter(|i| squares[*i] <= reach * reach) {
                let place = j * self.width + i;
                let levels = [0, 1, 2].map(|k: usize| self.planes[k][place]);
                let (distance_px, sector, place) = (squares[i].sqrt(), sectors[i], place as u32);
                self.samples.push(Sample { dx_px: dx[i], dy_px: dy, distance_px, sector, place, levels });
            }
        }
    }

    /// Luma, as soft as the colour differences are after subsampling and interpolation: where a strip's edge is
    /// cancelled between luma and colour, both must fade alike.
    fn luma(&self, picture: &Picture<'_>) -> Vec<f32> {
        let layout = picture.layout;
        let (wide, scale) = (picture.wide(), code_scale(picture));
        // two more pixels on every side, the picture's border repeated
        let row = |j: usize| (self.top + j).saturating_sub(2).min(layout.height_px - 1);
        let (width, height) = (self.width + 4, self.height + 4);
        let inside = self.left.saturating_sub(2)..(self.left + self.width + 2).min(layout.width_px);
        let before = 2usize.saturating_sub(self.left);
        let (across, down) = (softening(layout.chroma_shift_x), softening(layout.chroma_shift_y));
        let mut raw = Vec::with_capacity(width);
        let mut rows = vec![0.0; self.width * height];
        for (j, out) in rows.chunks_exact_mut(self.width).enumerate() {
            raw.clear();
            raw.resize(before, f32::from(picture.luma.code(wide, 0, row(j))) * scale);
            read(&picture.luma, wide, row(j), inside.clone(), scale, &mut raw);
            raw.resize(width, raw[raw.len() - 1]);
            (0..across.len()).for_each(|k| add(out, across[k], &raw[k..]));
        }
        let mut soft = vec![0.0; self.width * self.height];
        for (j, out) in soft.chunks_exact_mut(self.width).enumerate() {
            (0..down.len()).for_each(|k| add(out, down[k], &rows[(j + k) * self.width..]));
        }
        soft
    }

    /// A colour difference (8-bit codes about 0), interpolated between the chroma sites.
    fn chroma(&self, picture: &Picture<'_>, plane: &Plane<'_>) -> Vec<f32> {
        let layout = picture.layout;
        let (cw, ch) = layout.chroma_size();
        let scale = code_scale(picture);
        let (x0, y0) = layout.luma_to_chroma(self.left as f64, self.top as f64);
        let (x1, y1) = layout.luma_to_chroma((self.left + self.width) as f64, (self.top + self.height) as f64);
        let first = |v: f64, size: usize| (v.floor().max(0.0) as usize).min(size - 1);
        let (cx0, cy0) = (first(x0, cw), first(y0, ch));
        let (cx1, cy1) = ((first(x1, cw) + 2).min(cw), (first(y1, ch) + 2).min(ch));
        let columns = cx1 - cx0;
        let mut coarse = Vec::with_capacity(columns * (cy1 - cy0));
        for y in cy0..cy1 {
            read(plane, picture.wide(), y, cx0..cx1, scale, &mut coarse);
        }
        coarse.iter_mut().for_each(|code| *code -= 128.0);
        let taps = |at: f64, from: usize, to: usize| {
            let at = at.clamp(from as f64, (to - 1) as f64);
            let i = (at as usize).min(to.saturating_sub(2).max(from));
            (i - from, (i + 1).min(to - 1) - from, (at - i as f64) as f32)
        };
        let across: Vec<_> =
            (0..self.width).map(|i| taps(layout.luma_to_chroma((self.left + i) as f64, 0.0).0, cx0, cx1)).collect();
        // along the rows first: a coarse row lies between several fine ones
        let mut rows = Vec::with_capacity(self.width * (cy1 - cy0));
        for row in coarse.chunks_exact(columns) {
            rows.extend(across.iter().map(|&(l, r, s)| row[l] + s * (row[r] - row[l])));
        }
        let mut fine = Vec::with_capacity(self.width * self.height);
        for j in 0..self.height {
            let (a, b, t) = taps(layout.luma_to_chroma(0.0, (self.top + j) as f64).1, cy0, cy1);
            let [upper, lower] = [a, b].map(|row| &rows[row * self.width..][..self.width]);
            fine.extend(upper.iter().zip(lower).map(|(up, down)| up + t * (down - up)));
        }
        fine
    }
}

/// 8-bit codes per code of the file.
fn code_scale(picture: &Picture<'_>) -> f32 {
    1.0 / f32::from(1u16 << (picture.layout.bits - 8)) / f32::from(1u16 << picture.layout.low_bits)
}

/// The binomial kernel of variance 1 px², that of averaging pairs and interpolating between them, where chroma has
/// half the samples; nothing where it has all.
fn softening(shift: u32) -> [f32; 5] {
    if shift == 0 { [0.0, 0.0, 1.0, 0.0, 0.0] } else { [0.0625, 0.25, 0.375, 0.25, 0.0625] }
}

/// Reads some columns of a row as 8-bit codes.
fn read(plane: &Plane<'_>, wide: bool, y: usize, columns: Range<usize>, scale: f32, codes: &mut Vec<f32>) {
    if wide || plane.step != 1 {
        codes.extend(columns.map(|x| f32::from(plane.code(wide, x, y)) * scale));
    } else {
        let row = &plane.bytes[y * plane.stride..][columns];
        codes.extend(row.iter().map(|code| f32::from(*code) * scale));
    }
}

/// Adds a row, weighted.
fn add(sums: &mut [f32], weight: f32, row: &[f32]) {
    sums.iter_mut().zip(row).for_each(|(sum, value)| *sum += weight * value);
}
