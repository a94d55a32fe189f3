//! A picture that can be drawn on: 8 bit, 4:2:0, even sides, as it is displayed.
//!
//! Every shape is drawn by OpenCV into a stencil, a map of how much of each pixel it covers, and the stencil is then
//! laid on luma and on both colour differences. So edges are smooth in all three, and nothing passes through R′G′B′.

use opencv::boxed_ref::BoxedRefMut;
use opencv::core::{Mat, Size};
use opencv::imgproc;

use crate::error::{Error, Result};
use crate::video::{Layout, Orientation, OwnedPicture, Picture};

/// A colour and how much of it is laid on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ink {
    /// R′G′B′.
    pub rgb: [u8; 3],
    /// 0 leaves the picture as it is, 1 covers it.
    pub opacity: f64,
}

impl Ink {
    /// A covering colour.
    pub const fn opaque(rgb: [u8; 3]) -> Self {
        Self { rgb, opacity: 1.0 }
    }

    /// The same colour, laid on thinner.
    pub const fn at(self, opacity: f64) -> Self {
        Self { opacity, ..self }
    }
}

/// A rectangle of displayed pixels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds {
    /// Least x and y.
    pub least_px: [f64; 2],
    /// Greatest x and y.
    pub most_px: [f64; 2],
}

impl Bounds {
    /// Around points, and `margin_px` more; `None` without points or where one is not finite.
    pub fn around(points_px: impl IntoIterator<Item = [f64; 2]>, margin_px: f64) -> Option<Self> {
        let mut bounds: Option<Self> = None;
        for p in points_px {
            if !(p[0].is_finite() && p[1].is_finite()) {
                return None;
            }
            let b = bounds.get_or_insert(Self { least_px: p, most_px: p });
            b.least_px = [0, 1].map(|k| b.least_px[k].min(p[k]));
            b.most_px = [0, 1].map(|k| b.most_px[k].max(p[k]));
        }
        bounds.map(|b| Self { least_px: b.least_px.map(|v| v - margin_px), most_px: b.most_px.map(|v| v + margin_px) })
    }
}

/// Where a shape is drawn: coverage 0 to 255, one byte a pixel.
pub struct Stencil<'a> {
    /// For OpenCV's drawing functions.
    pub mat: BoxedRefMut<'a, Mat>,
    /// The displayed pixel of its first sample.
    pub origin_px: [i32; 2],
}

/// A picture being drawn on.
#[derive(Debug, Clone)]
pub struct Canvas {
    picture: OwnedPicture,
}

impl Canvas {
    /// How the canvas of a recording lies in memory: sides of the displayed picture, an odd one padded by a pixel.
    pub fn layout(source: &Layout, orientation: Orientation) -> Layout {
        let (width, height) = orientation.size((source.width_px, source.height_px));
        Layout {
            width_px: width.next_multiple_of(2),
            height_px: height.next_multiple_of(2),
            bits: 8,
            low_bits: 0,
            chroma_shift_x: 1,
            chroma_shift_y: 1,
            chroma_site_px: [0.0, 0.5],
            ..*source
        }
    }

    /// A copy of a picture, turned as it is displayed.
    pub fn of(source: &Picture<'_>, orientation: Orientation) -> Self {
        let layout = Self::layout(&source.layout, orientation);
        let mut canvas = Self { picture: OwnedPicture::black(layout) };
        let plain = orientation == Orientation::default() && source.layout == layout;
        if plain && source.luma.step == 1 && source.cb.step == 1 {
            canvas.copy_rows(source);
        } else {
            canvas.resample(source, orientation);
        }
        canvas
    }

    /// The finished picture.
    pub fn picture(&self) -> &OwnedPicture {
        &self.picture
    }

    /// The picture at another size, sides even; each pixel is the mean of those that it stands for.
    ///
    /// # Errors
    /// [`Error::OpenCv`].
    pub fn at_size(&self, [width_px, height_px]: [usize; 2]) -> Result<OwnedPicture> {
        let from = self.picture.layout;
        let layout = Layout { width_px, height_px, ..from };
        let mut smaller = OwnedPicture::black(layout);
        let sizes = [(from.width_px, from.height_px), from.chroma_size(), from.chroma_size()];
        let targets = [(width_px, height_px), layout.chroma_size(), layout.chroma_size()];
        for (plane, (from, to)) in sizes.into_iter().zip(targets).enumerate() {
            let source = Mat::new_rows_cols_with_data(from.1 as i32, from.0 as i32, &self.picture.planes[plane]);
            let target = Mat::new_rows_cols_with_data_mut(to.1 as i32, to.0 as i32, &mut smaller.planes[plane]);
            let resized = source.and_then(|source| {
                let size = Size::new(to.0 as i32, to.1 as i32);
                imgproc::resize(&source, &mut target?, size, 0.0, 0.0, imgproc::INTER_AREA)
            });
            resized.map_err(Error::opencv("making the overlay smaller"))?;
        }
        Ok(smaller)
    }

    /// Width and height.
    pub fn size_px(&self) -> [usize; 2] {
        [self.picture.layout.width_px, self.picture.layout.height_px]
    }

    /// How much luma varies in a rectangle, in tenths of the whole range: plain ground is 0.
    pub fn spread(&self, least_px: [f64; 2], size_px: [f64; 2]) -> u64 {
        let [width, height] = self.size_px();
        let span = |k: usize, side: usize| {
            let edge = |v: f64| v.clamp(0.0, side as f64) as usize;
            edge(least_px[k])..edge(least_px[k] + size_px[k])
        };
        let luma = &self.picture.planes[0];
        let (mut n, mut sum, mut squares) = (0.0, 0.0, 0.0);
        for y in span(1, height) {
            for code in &luma[y * width..][span(0, width)] {
                let code = f64::from(*code);
                (n, sum, squares) = (n + 1.0, sum + code, squares + code * code);
            }
        }
        let n = f64::max(n, 1.0);
        ((squares / n - (sum / n).powi(2)).max(0.0).sqrt() / 25.5) as u64
    }

    fn copy_rows(&mut self, source: &Picture<'_>) {
        let (chroma_width, _) = self.picture.layout.chroma_size();
        let widths = [self.picture.layout.width_px, chroma_width, chroma_width];
        for ((to, from), width) in self.picture.planes.iter_mut().zip([source.luma, source.cb, source.cr]).zip(widths) {
            for (row, bytes) in to.chunks_exact_mut(width).zip(from.bytes.chunks(from.stride)) {
                row.copy_from_slice(&bytes[..width]);
            }
        }
    }

    /// Any layout and orientation: each displayed pixel reads its stored one, each chroma sample the mean of four.
    fn resample(&mut self, source: &Picture<'_>, orientation: Orientation) {
        let from = source.layout;
        let size = (from.width_px, from.height_px);
        let displayed = orientation.size(size);
        let stored = |x: usize, y: usize| {
            // the padding repeats the last row and column
            let p = [x.min(displayed.0 - 1) as f64, y.min(displayed.1 - 1) as f64];
            orientation.stored_point(p, size).map(|v| v as usize)
        };
        let down = from.low_bits + from.bits - 8;
        let wide = source.wide();
        let to = self.picture.layout;
        for y in 0..to.height_px {
            for x in 0..to.width_px {
                let [sx, sy] = stored(x, y);
                self.picture.planes[0][y * to.width_px + x] = (source.luma.code(wide, sx, sy) >> down) as u8;
            }
        }
        let (chroma_width, chroma_height) = to.chroma_size();
        for y in 0..chroma_height {
            for x in 0..chroma_width {
                let mut sums = [0u32; 2];
                for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                    let [sx, sy] = stored(2 * x + dx, 2 * y + dy);
                    let (cx, cy) = (sx >> from.chroma_shift_x, sy >> from.chroma_shift_y);
                    for (sum, plane) in sums.iter_mut().zip([&source.cb, &source.cr]) {
                        *sum += u32::from(plane.code(wide, cx, cy) >> down);
                    }
                }
                self.picture.planes[1][y * chroma_width + x] = ((sums[0] + 2) / 4) as u8;
                self.picture.planes[2][y * chroma_width + x] = ((sums[1] + 2) / 4) as u8;
            }
        }
    }

    /// Lets `draw` draw a shape within `bounds` and lays it on in `ink`. A shape outside the picture is nothing.
    ///
    /// # Errors
    /// [`Error::OpenCv`].
    pub fn lay(
        &mut self,
        bounds: Option<Bounds>,
        ink: Ink,
        draw: impl FnOnce(&mut Stencil<'_>) -> opencv::Result<()>,
    ) -> Result<()> {
        let [width, height] = self.size_px();
        let Some(bounds) = bounds else { return Ok(()) };
        // whole chroma samples: even left and top, even sides
        let low = |v: f64, side: usize| (v.floor().clamp(0.0, side as f64) as usize) & !1;
        let high = |v: f64, side: usize| ((v.ceil() + 1.0).clamp(0.0, side as f64) as usize).next_multiple_of(2);
        let (left, top) = (low(bounds.least_px[0], width), low(bounds.least_px[1], height));
        let (right, bottom) = (high(bounds.most_px[0], width), high(bounds.most_px[1], height));
        if right <= left || bottom <= top {
            return Ok(());
        }
        let mut cover = vec![0u8; (right - left) * (bottom - top)];
        {
            let mat = Mat::new_rows_cols_with_data_mut((bottom - top) as i32, (right - left) as i32, &mut cover);
            let drawn = mat.and_then(|mat| draw(&mut Stencil { mat, origin_px: [left as i32, top as i32] }));
            drawn.map_err(Error::opencv("drawing the overlay"))?;
        }
        self.blend(&cover, [left, top, right, bottom], ink);
        Ok(())
    }

    fn blend(&mut self, cover: &[u8], [left, top, right, bottom]: [usize; 4], ink: Ink) {
        let layout = self.picture.layout;
        let colour = layout.matrix.ycbcr(ink.rgb.map(|c| f64::from(c) / 255.0));
        let ((black, span), (neutral, chroma_span)) = (layout.luma_scale(), layout.chroma_scale());
        let codes = [black + span * colour[0], neutral + chroma_span * colour[1], neutral + chroma_span * colour[2]];
        let mix = |sample: &mut u8, code: f64, share: f64| {
            *sample = (f64::from(*sample) + (code - f64::from(*sample)) * share).round().clamp(0.0, 255.0) as u8;
        };
        let stride = right - left;
        for (y, row) in cover.chunks_exact(stride).enumerate() {
            let luma = &mut self.picture.planes[0][(top + y) * layout.width_px + left..][..stride];
            for (sample, c) in luma.iter_mut().zip(row).filter(|(_, c)| **c > 0) {
                mix(sample, codes[0], ink.opacity * f64::from(*c) / 255.0);
            }
        }
        let (chroma_width, _) = layout.chroma_size();
        for y in 0..(bottom - top) / 2 {
            let (upper, lower) = (&cover[2 * y * stride..][..stride], &cover[(2 * y + 1) * stride..][..stride]);
            for x in 0..stride / 2 {
                let four = [upper[2 * x], upper[2 * x + 1], lower[2 * x], lower[2 * x + 1]];
                let sum: u32 = four.into_iter().map(u32::from).sum();
                if sum > 0 {
                    let index = (top / 2 + y) * chroma_width + left / 2 + x;
                    let share = ink.opacity * f64::from(sum) / 1020.0;
                    mix(&mut self.picture.planes[1][index], codes[1], share);
                    mix(&mut self.picture.planes[2][index], codes[2], share);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn layout(width_px: usize, height_px: usize) -> Layout {
        crate::experiment::Render::default().codec.layout(width_px as u32, height_px as u32)
    }

    #[test]
    fn a_shape_half_outside_is_clipped_and_one_outside_is_nothing() {
        let mut canvas = Canvas { picture: OwnedPicture::black(layout(32, 16)) };
        let fill = |stencil: &mut Stencil<'_>| {
            use opencv::core::MatTrait;
            stencil.mat.set_to_def(&opencv::core::Scalar::all(255.0)).map(|_| ())
        };
        let blue = Ink::opaque([0, 0, 255]);
        canvas.lay(Bounds::around([[-90.0, -90.0], [-50.0, -50.0]], 1.0), blue, fill).unwrap();
        assert_eq!(canvas.picture, OwnedPicture::black(layout(32, 16)));
        canvas.lay(Bounds::around([[-4.0, -4.0], [2.0, 2.0]], 1.0), blue, fill).unwrap();
        let (cb, _) = canvas.picture.view().chroma(0, 0);
        assert!(cb > 0.45, "{cb}");
        assert!(canvas.picture.view().chroma(6, 6).0.abs() < 0.01);
        assert_eq!(Bounds::around([[f64::NAN, 0.0]], 1.0), None);
    }

    #[test]
    fn an_odd_turned_picture_is_padded_and_keeps_its_corners() {
        let mut source = OwnedPicture::black(layout(5, 3));
        source.planes[0][4] = 200; // top right of the stored picture
        let bytes: Vec<u8> =
            [0i32, 1 << 16, 0, -(1 << 16), 0, 0, 0, 0, 1 << 30].iter().flat_map(|w| w.to_ne_bytes()).collect();
        let turned = Orientation::from_display_matrix(&bytes).unwrap();
        let canvas = Canvas::of(&source.view(), turned);
        assert_eq!(canvas.size_px(), [4, 6]);
        // the stored top right is the displayed bottom right, repeated into the padding
        assert_eq!(canvas.picture.planes[0][4 * 4 + 2], 200);
        assert_eq!(canvas.picture.planes[0][5 * 4 + 3], 200);
    }
}
