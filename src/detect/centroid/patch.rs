//! The pixels around a mark: luma and colour component at luma resolution, in polar coordinates.

use super::super::component::HueAxis;
use super::outline::Outline;
use crate::video::Picture;

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
    /// Luma and component, 8-bit codes.
    pub levels: [f32; 2],
}

/// The pixels within reach of a mark.
pub struct Patch {
    left: usize,
    top: usize,
    width: usize,
    height: usize,
    /// Core, band and ring; the corners beyond are left out.
    pub samples: Vec<Sample>,
}

impl Patch {
    /// Reads everything up to `ring_px` beyond the band.
    pub fn read(picture: &Picture<'_>, axis: HueAxis, outline: &Outline, ring_px: f32) -> Self {
        let layout = picture.layout;
        let reach = (outline.reach_px() + outline.band_px + ring_px + 1.0).ceil();
        let from = |c: f64, size: usize| (c - f64::from(reach)).clamp(0.0, size as f64) as usize;
        let to = |c: f64, size: usize| (c + f64::from(reach) + 1.0).clamp(0.0, size as f64) as usize;
        let [cx, cy] = outline.centre_px;
        let (left, top) = (from(cx, layout.width_px), from(cy, layout.height_px));
        let (width, height) = (to(cx, layout.width_px) - left, to(cy, layout.height_px) - top);
        let mut patch = Self { left, top, width, height, samples: Vec::new() };
        let component = patch.component(picture, axis);
        patch.gather(picture, outline, reach, &component);
        patch
    }

    /// How far from the centre a centroid can be.
    pub fn reach_px(&self) -> f64 {
        self.width.max(self.height) as f64
    }

    fn gather(&mut self, picture: &Picture<'_>, outline: &Outline, reach: f32, component: &[f32]) {
        let wide = picture.wide();
        let scale = 1.0 / f32::from(1u16 << (picture.layout.bits - 8)) / f32::from(1u16 << picture.layout.low_bits);
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
                let luma = f32::from(picture.luma.code(wide, self.left + i, self.top + j)) * scale;
                let levels = [luma, component[j * self.width + i]];
                let (distance_px, sector) = (squares[i].sqrt(), sectors[i]);
                self.samples.push(Sample { dx_px: dx[i], dy_px: dy, distance_px, sector, levels });
            }
        }
    }

    /// The projection on the hue (8-bit codes), interpolated between the chroma sites.
    fn component(&self, picture: &Picture<'_>, axis: HueAxis) -> Vec<f32> {
        let layout = picture.layout;
        let (u, v) = axis.unit();
        let (u, v) = (u as f32, v as f32);
        let (cw, ch) = layout.chroma_size();
        let scale = 1.0 / f32::from(1u16 << (layout.bits - 8)) / f32::from(1u16 << layout.low_bits);
        let (x0, y0) = layout.luma_to_chroma(self.left as f64, self.top as f64);
        let (x1, y1) = layout.luma_to_chroma((self.left + self.width) as f64, (self.top + self.height) as f64);
        let first = |v: f64| v.floor().max(0.0) as usize;
        let (cx0, cy0) = (first(x0), first(y0));
        let (cx1, cy1) = ((first(x1) + 2).min(cw), (first(y1) + 2).min(ch));
        let columns = cx1.saturating_sub(cx0);
        let mut coarse = Vec::with_capacity(columns * cy1.saturating_sub(cy0));
        for y in cy0..cy1 {
            for x in cx0..cx1 {
                let b = f32::from(picture.cb.code(picture.wide(), x, y)) * scale - 128.0;
                let r = f32::from(picture.cr.code(picture.wide(), x, y)) * scale - 128.0;
                coarse.push(u * b + v * r);
            }
        }
        let taps = |at: f64, from: usize, to: usize| {
            let at = at.clamp(from as f64, (to - 1) as f64);
            let i = (at as usize).min(to.saturating_sub(2).max(from));
            (i - from, (i + 1).min(to - 1) - from, (at - i as f64) as f32)
        };
        let across: Vec<_> =
            (0..self.width).map(|i| taps(layout.luma_to_chroma((self.left + i) as f64, 0.0).0, cx0, cx1)).collect();
        let mut component = Vec::with_capacity(self.width * self.height);
        for j in 0..self.height {
            let (a, b, t) = taps(layout.luma_to_chroma(0.0, (self.top + j) as f64).1, cy0, cy1);
            let (upper, lower) = (&coarse[a * columns..(a + 1) * columns], &coarse[b * columns..(b + 1) * columns]);
            for &(l, r, s) in &across {
                let up = upper[l] + s * (upper[r] - upper[l]);
                let down = lower[l] + s * (lower[r] - lower[l]);
                component.push(up + t * (down - up));
            }
        }
        component
    }
}
