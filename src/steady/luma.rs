//! The luma of a picture, read at pixels and between them.

use crate::video::Picture;

/// Half the side of a patch.
pub(super) const HALF: i64 = crate::area::PATCH_HALF_PX as i64;

/// The luma of a picture as 8-bit codes, row by row: each is read some hundred times.
pub(super) struct Luma {
    codes: Vec<f32>,
    pub width: usize,
    pub height: usize,
}

impl Luma {
    pub fn of(picture: &Picture<'_>) -> Self {
        let layout = picture.layout;
        let scale = 1.0 / f32::from(1u16 << (layout.bits - 8)) / f32::from(1u16 << layout.low_bits);
        let (width, height, wide) = (layout.width_px, layout.height_px, picture.wide());
        let mut codes = Vec::with_capacity(width * height);
        (0..height).for_each(|y| codes.extend((0..width).map(|x| f32::from(picture.luma.code(wide, x, y)) * scale)));
        Self { codes, width, height }
    }

    #[inline]
    pub fn code(&self, x: i64, y: i64) -> f32 {
        self.codes[y as usize * self.width + x as usize]
    }

    /// A row from a pixel on.
    #[inline]
    pub fn row(&self, x: i64, y: i64) -> &[f32] {
        &self.codes[y as usize * self.width + x as usize..]
    }

    /// A patch about this pixel lies inside.
    pub fn holds(&self, x: i64, y: i64) -> bool {
        x > HALF && y > HALF && x + HALF + 2 < self.width as i64 && y + HALF + 2 < self.height as i64
    }

    /// The patch about a point between pixels.
    pub fn read(&self, x: f64, y: f64, values: &mut Vec<f32>) -> Option<()> {
        let (i, j) = (x.floor() as i64, y.floor() as i64);
        if !self.holds(i, j) {
            return None;
        }
        let (s, t) = ((x - i as f64) as f32, (y - j as f64) as f32);
        values.clear();
        for b in j - HALF..=j + HALF {
            for a in i - HALF..=i + HALF {
                let upper = self.code(a, b) + s * (self.code(a + 1, b) - self.code(a, b));
                let lower = self.code(a, b + 1) + s * (self.code(a + 1, b + 1) - self.code(a, b + 1));
                values.push(upper + t * (lower - upper));
            }
        }
        Some(())
    }
}
