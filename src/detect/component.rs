//! The colour component of a picture: how much of the marks' hue each chroma sample carries.
//!
//! The paper takes the red component less the grey one (Fig. 8 b). In Y′C_bC_r that difference already stands in
//! the file: R′ − Y′ is proportional to C_r. For any hue the component is the projection on the hue's direction,
//! less what lies across it, so that a sample more than 45° away from the hue counts for nothing:
//!
//! ```text
//! component = u·C_b + v·C_r − |u·C_r − v·C_b|,   (u, v) the unit vector of the mark's hue
//! ```
//! A mark without a hue is dark or light; its component is −Y′ or Y′, and only means something against what lies
//! around it (see [`super::plane`]).

use crate::experiment::{Look, MarkColour};
use crate::video::{Matrix, Picture};

/// Fixed-point ones in [`HueAxis`].
const ONE: f64 = 64.0;

/// Columns of chroma samples that are judged together in the scan.
pub(super) const BLOCK: usize = 32;

/// The direction of a hue in the plane of the colour differences, in 64ths.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct HueAxis {
    u: i16,
    v: i16,
    /// ±64ths of luma for a mark without a hue, else 0.
    luma: i16,
}

impl HueAxis {
    /// The hue of `colour` as `matrix` codes it.
    pub fn new(colour: &MarkColour, matrix: Matrix) -> Self {
        match colour.look() {
            Look::Dark => Self::of_luma_sign(true),
            Look::Light => Self::of_luma_sign(false),
            Look::Hue => Self::at_angle(hue_angle_rad(colour, matrix)),
        }
    }

    /// The hue at an angle from C_b towards C_r.
    pub fn at_angle(angle_rad: f64) -> Self {
        let (sin, cos) = angle_rad.sin_cos();
        Self { u: (ONE * cos).round() as i16, v: (ONE * sin).round() as i16, luma: 0 }
    }

    /// Of a mark without a hue, darker than its surroundings or lighter.
    pub fn of_luma_sign(dark: bool) -> Self {
        Self { u: 0, v: 0, luma: if dark { -(ONE as i16) } else { ONE as i16 } }
    }

    /// The mark is dark or light and has no hue.
    pub fn is_luma(self) -> bool {
        self.luma != 0
    }

    /// The unit vector (C_b, C_r); (0, 0) for a mark without a hue.
    pub fn unit(self) -> (f64, f64) {
        let (u, v) = (f64::from(self.u), f64::from(self.v));
        let norm = u.hypot(v).max(1.0);
        (u / norm, v / norm)
    }

    /// The component of 8-bit codes, in 64ths of a code.
    #[inline]
    pub(super) fn of(self, cb: u8, cr: u8) -> i16 {
        let (b, r) = (i16::from(cb) - 128, i16::from(cr) - 128);
        self.along(cb, cr) - (self.u * r - self.v * b).abs()
    }

    /// Its first term, the projection on the hue's direction.
    #[inline]
    fn along(self, cb: u8, cr: u8) -> i16 {
        self.u * (i16::from(cb) - 128) + self.v * (i16::from(cr) - 128)
    }

    /// The component of a luma code, for a mark without a hue.
    #[inline]
    pub(super) fn of_luma(self, luma: u8) -> i16 {
        self.luma * (i16::from(luma) - 128)
    }

    /// The component at chroma sample (x, y), in 64ths of an 8-bit code.
    #[inline]
    pub fn at(self, picture: &Picture<'_>, x: usize, y: usize) -> i16 {
        if self.is_luma() {
            return self.of_luma(luma_at(picture, x, y));
        }
        let wide = picture.wide();
        let down = picture.layout.low_bits + picture.layout.bits - 8;
        let code = |p: &crate::video::Plane<'_>| (p.code(wide, x, y) >> down) as u8;
        self.of(code(&picture.cb), code(&picture.cr))
    }

    /// The components of chroma row `y` in `columns`, added to `row`.
    pub(super) fn row(self, picture: &Picture<'_>, y: usize, columns: std::ops::Range<usize>, row: &mut Vec<i16>) {
        if self.is_luma() {
            luma_row(picture, y, columns, row, |code| self.of_luma(code));
            return;
        }
        if picture.wide() || picture.cb.step != 1 {
            row.extend(columns.map(|x| self.at(picture, x, y)));
            return;
        }
        let cb = &picture.cb.bytes[y * picture.cb.stride..][columns.clone()];
        let cr = &picture.cr.bytes[y * picture.cr.stride..][columns];
        row.extend(cb.iter().zip(cr).map(|(b, r)| self.of(*b, *r)));
    }

    /// Marks each run of [`BLOCK`] samples of chroma row `y` in which a component is above `threshold`.
    pub(super) fn mark_hits(self, picture: &Picture<'_>, y: usize, threshold: i16, hits: &mut [bool]) {
        let (width, _) = picture.layout.chroma_size();
        if self.is_luma() || picture.wide() || picture.cb.step != 1 {
            for (block, hit) in hits.iter_mut().enumerate() {
                let mut columns = block * BLOCK..((block + 1) * BLOCK).min(width);
                *hit |= columns.any(|x| self.at(picture, x, y) > threshold);
            }
            return;
        }
        let cb = &picture.cb.bytes[y * picture.cb.stride..][..width];
        let cr = &picture.cr.bytes[y * picture.cr.stride..][..width];
        for ((cb, cr), hit) in cb.chunks(BLOCK).zip(cr.chunks(BLOCK)).zip(hits) {
            // plain folds over bytes, which the compiler turns into vector instructions; a component is never larger
            // than its first term, and in most blocks that is enough to know
            let may_hit = || cb.iter().zip(cr).fold(i16::MIN, |m, (b, r)| m.max(self.along(*b, *r))) > threshold;
            let does_hit = || cb.iter().zip(cr).fold(i16::MIN, |m, (b, r)| m.max(self.of(*b, *r))) > threshold;
            *hit = *hit || may_hit() && does_hit();
        }
    }
}

/// Mean luma of the pixels at every chroma sample of a row, 8-bit codes; what is made of each is added to `row`.
pub(super) fn luma_row<T>(
    picture: &Picture<'_>,
    y: usize,
    columns: std::ops::Range<usize>,
    row: &mut Vec<T>,
    of: impl Fn(u8) -> T,
) {
    let layout = &picture.layout;
    let plain = !picture.wide() && picture.luma.step == 1 && layout.low_bits == 0 && layout.bits == 8;
    let halved = (layout.chroma_shift_x, layout.chroma_shift_y) == (1, 1);
    let whole = 2 * y + 1 < layout.height_px && 2 * columns.end <= layout.width_px;
    if !(plain && halved && whole) {
        row.extend(columns.map(|x| of(luma_at(picture, x, y))));
        return;
    }
    // the usual layout, pair by pair: this runs over whole pictures
    let pairs = |y: usize| {
        let bytes = &picture.luma.bytes[y * picture.luma.stride..][2 * columns.start..2 * columns.end];
        bytes.as_chunks::<2>().0
    };
    row.extend(pairs(2 * y).iter().zip(pairs(2 * y + 1)).map(|(upper, lower)| {
        let sum = upper.iter().chain(lower).map(|code| u16::from(*code)).sum::<u16>();
        of((sum / 4) as u8)
    }));
}

/// Mean luma of the pixels at chroma sample (x, y), 8-bit code.
pub(super) fn luma_at(picture: &Picture<'_>, x: usize, y: usize) -> u8 {
    let layout = &picture.layout;
    let (sx, sy) = (layout.chroma_shift_x, layout.chroma_shift_y);
    let down = layout.low_bits + layout.bits - 8;
    let (mut sum, mut count) = (0u32, 0u32);
    for j in (y << sy)..(((y + 1) << sy).min(layout.height_px)) {
        for i in (x << sx)..(((x + 1) << sx).min(layout.width_px)) {
            sum += u32::from(picture.luma.code(picture.wide(), i, j) >> down);
            count += 1;
        }
    }
    (sum / count.max(1)) as u8
}

/// The angle of a colour's hue, from C_b towards C_r.
pub(super) fn hue_angle_rad(colour: &MarkColour, matrix: Matrix) -> f64 {
    let [_, cb, cr] = matrix.ycbcr(colour.rgb.map(|c| f64::from(c) / 255.0));
    cr.atan2(cb)
}

/// Codes (in 64ths) → the scale on which a fully saturated colour counts about 255.
pub fn to_255(component: f64) -> f64 {
    component / ONE * 255.0 / 112.0
}

/// The inverse of [`to_255`], as the integer that a component must exceed.
pub fn from_255(value: f64) -> i16 {
    (value * 112.0 / 255.0 * ONE).clamp(0.0, f64::from(i16::MAX)) as i16
}

#[cfg(test)]
mod tests {
    use super::*;

    fn codes(rgb: [u8; 3]) -> (u8, u8) {
        let [_, cb, cr] = Matrix::Bt601.ycbcr(rgb.map(|c| f64::from(c) / 255.0));
        ((128.0 + 224.0 * cb).round() as u8, (128.0 + 224.0 * cr).round() as u8)
    }

    #[test]
    fn a_pure_colour_counts_in_full_and_greys_and_opposites_do_not() {
        let axis = HueAxis::new(&MarkColour::red(), Matrix::Bt601);
        let value = |rgb| {
            let (cb, cr) = codes(rgb);
            to_255(f64::from(axis.of(cb, cr)))
        };
        assert!(value([255, 0, 0]) > 240.0);
        assert!(value([200, 200, 200]).abs() < 6.0);
        assert!(value([0, 0, 255]) < 0.0 && value([0, 255, 0]) < 0.0 && value([255, 200, 0]) < 0.0);
        assert!(value([208, 128, 32]) < 0.3 * value([200, 30, 30]), "amber film is not red");
    }

    #[test]
    fn the_scale_inverts() {
        assert!((to_255(f64::from(from_255(80.0))) - 80.0).abs() < 0.1);
    }
}
