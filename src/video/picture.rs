//! One decoded picture: luma and two colour-difference planes, as the decoder left them.

/// Which luma–colour-difference matrix the picture was coded with.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Matrix {
    /// ITU-R BT.601.
    #[default]
    Bt601,
    /// ITU-R BT.709.
    Bt709,
    /// ITU-R BT.2020, non-constant luminance.
    Bt2020,
}

impl Matrix {
    /// The luma weights (K_r, K_b); K_g = 1 − K_r − K_b.
    pub fn luma_weights(self) -> (f64, f64) {
        match self {
            Self::Bt601 => (0.299, 0.114),
            Self::Bt709 => (0.2126, 0.0722),
            Self::Bt2020 => (0.2627, 0.0593),
        }
    }

    /// R′G′B′ in 0..1 → (Y′ in 0..1, C_b and C_r in −½..½).
    pub fn ycbcr(self, [r, g, b]: [f64; 3]) -> [f64; 3] {
        let (kr, kb) = self.luma_weights();
        let y = kr * r + (1.0 - kr - kb) * g + kb * b;
        [y, (b - y) / (2.0 * (1.0 - kb)), (r - y) / (2.0 * (1.0 - kr))]
    }

    /// The inverse of [`Matrix::ycbcr`].
    pub fn rgb(self, [y, cb, cr]: [f64; 3]) -> [f64; 3] {
        let (kr, kb) = self.luma_weights();
        let r = y + 2.0 * (1.0 - kr) * cr;
        let b = y + 2.0 * (1.0 - kb) * cb;
        [r, (y - kr * r - kb * b) / (1.0 - kr - kb), b]
    }
}

/// How the samples of a picture lie in memory and in the image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Layout {
    /// Luma size.
    pub width_px: usize,
    /// Luma size.
    pub height_px: usize,
    /// Significant bits of a sample (8 to 16).
    pub bits: u32,
    /// Bits below the significant ones (P010 keeps its 10 bits at the top of 16).
    pub low_bits: u32,
    /// log₂ of luma columns per chroma column.
    pub chroma_shift_x: u32,
    /// log₂ of luma rows per chroma row.
    pub chroma_shift_y: u32,
    /// Where chroma sample (0, 0) lies, in luma pixels from the centre of luma sample (0, 0).
    pub chroma_site_px: [f64; 2],
    /// 0..255 rather than 16..235 and 16..240.
    pub full_range: bool,
    /// The matrix.
    pub matrix: Matrix,
}

impl Layout {
    /// Chroma plane size.
    pub fn chroma_size(&self) -> (usize, usize) {
        (
            (self.width_px + (1 << self.chroma_shift_x) - 1) >> self.chroma_shift_x,
            (self.height_px + (1 << self.chroma_shift_y) - 1) >> self.chroma_shift_y,
        )
    }

    /// Chroma sample coordinates → luma pixel coordinates.
    pub fn chroma_to_luma(&self, x: f64, y: f64) -> (f64, f64) {
        (
            x * f64::from(1u32 << self.chroma_shift_x) + self.chroma_site_px[0],
            y * f64::from(1u32 << self.chroma_shift_y) + self.chroma_site_px[1],
        )
    }

    /// Luma pixel coordinates → chroma sample coordinates.
    pub fn luma_to_chroma(&self, x: f64, y: f64) -> (f64, f64) {
        (
            (x - self.chroma_site_px[0]) / f64::from(1u32 << self.chroma_shift_x),
            (y - self.chroma_site_px[1]) / f64::from(1u32 << self.chroma_shift_y),
        )
    }

    /// Code value of black, and codes from black to white.
    pub fn luma_scale(&self) -> (f64, f64) {
        let unit = f64::from(1u32 << (self.bits - 8));
        if self.full_range { (0.0, f64::from((1u32 << self.bits) - 1)) } else { (16.0 * unit, 219.0 * unit) }
    }

    /// Code value of neutral, and codes for a colour difference of 1 (−½ to ½).
    pub fn chroma_scale(&self) -> (f64, f64) {
        let unit = f64::from(1u32 << (self.bits - 8));
        let span = if self.full_range { f64::from((1u32 << self.bits) - 1) } else { 224.0 * unit };
        (128.0 * unit, span)
    }
}

#[cfg(test)]
impl Layout {
    /// 4:2:0 as most files have it: limited range, BT.709, chroma to the left.
    pub const fn subsampled(width_px: usize, height_px: usize, bits: u32) -> Self {
        Self {
            width_px,
            height_px,
            bits,
            low_bits: 0,
            chroma_shift_x: 1,
            chroma_shift_y: 1,
            chroma_site_px: [0.0, 0.5],
            full_range: false,
            matrix: Matrix::Bt709,
        }
    }
}

/// One plane of samples, borrowed.
#[derive(Debug, Clone, Copy)]
pub struct Plane<'a> {
    /// The bytes, from the first sample.
    pub bytes: &'a [u8],
    /// Bytes from a row to the next.
    pub stride: usize,
    /// Bytes from a sample to the next (1, or 2 where interleaved or 16-bit, or 4 where both).
    pub step: usize,
}

impl Plane<'_> {
    /// The sample at column `x`, row `y`, as an 8-bit or a 16-bit code.
    #[inline]
    pub fn code(&self, wide: bool, x: usize, y: usize) -> u16 {
        let i = y * self.stride + x * self.step;
        if wide { u16::from_le_bytes([self.bytes[i], self.bytes[i + 1]]) } else { u16::from(self.bytes[i]) }
    }

    /// The samples row after row, without padding.
    fn packed(&self, wide: bool, width: usize, height: usize) -> Vec<u8> {
        let size = if wide { 2 } else { 1 };
        let mut packed = Vec::with_capacity(width * height * size);
        for y in 0..height {
            let row = &self.bytes[y * self.stride..];
            if self.step == size {
                packed.extend_from_slice(&row[..width * size]);
            } else {
                (0..width).for_each(|x| packed.extend_from_slice(&row[x * self.step..][..size]));
            }
        }
        packed
    }
}

/// A picture whose samples belong to a decoder or to an [`OwnedPicture`].
#[derive(Debug, Clone, Copy)]
pub struct Picture<'a> {
    /// How the samples lie.
    pub layout: Layout,
    /// Luma.
    pub luma: Plane<'a>,
    /// Blue difference.
    pub cb: Plane<'a>,
    /// Red difference.
    pub cr: Plane<'a>,
}

impl Picture<'_> {
    /// Samples take two bytes.
    pub fn wide(&self) -> bool {
        self.layout.bits > 8
    }

    /// A copy of all its samples.
    pub fn to_owned(&self) -> OwnedPicture {
        let (cw, ch) = self.layout.chroma_size();
        let planes = [
            self.luma.packed(self.wide(), self.layout.width_px, self.layout.height_px),
            self.cb.packed(self.wide(), cw, ch),
            self.cr.packed(self.wide(), cw, ch),
        ];
        OwnedPicture { layout: self.layout, planes }
    }

    /// Y′ in 0..1 at a luma pixel.
    pub fn y(&self, x: usize, y: usize) -> f64 {
        let (black, span) = self.layout.luma_scale();
        (f64::from(self.luma.code(self.wide(), x, y) >> self.layout.low_bits) - black) / span
    }

    /// (C_b, C_r) in −½..½ at a chroma sample.
    pub fn chroma(&self, x: usize, y: usize) -> (f64, f64) {
        let (neutral, span) = self.layout.chroma_scale();
        let value = |p: &Plane| (f64::from(p.code(self.wide(), x, y) >> self.layout.low_bits) - neutral) / span;
        (value(&self.cb), value(&self.cr))
    }
}

/// A picture that owns its samples: planar, 8 bit in bytes or 9 to 16 bit in little-endian pairs.
#[derive(Debug, Clone, PartialEq)]
pub struct OwnedPicture {
    /// How the samples lie.
    pub layout: Layout,
    /// Luma, C_b, C_r, each row after row without padding.
    pub planes: [Vec<u8>; 3],
}

impl OwnedPicture {
    /// A black picture.
    pub fn black(layout: Layout) -> Self {
        let (cw, ch) = layout.chroma_size();
        let size = |w: usize, h: usize| w * h * if layout.bits > 8 { 2 } else { 1 };
        let mut picture = Self {
            layout,
            planes: [vec![0; size(layout.width_px, layout.height_px)], vec![0; size(cw, ch)], vec![0; size(cw, ch)]],
        };
        let (black, _) = layout.luma_scale();
        let (neutral, _) = layout.chroma_scale();
        for (plane, code) in [(0, black as u16), (1, neutral as u16), (2, neutral as u16)] {
            let (w, h) = if plane == 0 { (layout.width_px, layout.height_px) } else { (cw, ch) };
            for i in 0..w * h {
                picture.set(plane, i, code);
            }
        }
        picture
    }

    /// Sets sample `index` (row-major) of a plane to a code.
    #[inline]
    pub fn set(&mut self, plane: usize, index: usize, code: u16) {
        let code = code << self.layout.low_bits;
        if self.layout.bits > 8 {
            self.planes[plane][2 * index..2 * index + 2].copy_from_slice(&code.to_le_bytes());
        } else {
            self.planes[plane][index] = code as u8;
        }
    }

    /// The picture, borrowed.
    pub fn view(&self) -> Picture<'_> {
        let step = if self.layout.bits > 8 { 2 } else { 1 };
        let (cw, _) = self.layout.chroma_size();
        let plane = |i: usize, w: usize| Plane { bytes: &self.planes[i], stride: w * step, step };
        Picture { layout: self.layout, luma: plane(0, self.layout.width_px), cb: plane(1, cw), cr: plane(2, cw) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn red_has_the_textbook_colour_differences() {
        let [y, cb, cr] = Matrix::Bt601.ycbcr([1.0, 0.0, 0.0]);
        assert!((y - 0.299).abs() < 1e-12 && (cr - 0.5).abs() < 1e-12 && (cb + 0.299 / 1.772).abs() < 1e-12);
    }

    #[test]
    fn the_matrices_invert() {
        for matrix in [Matrix::Bt601, Matrix::Bt709, Matrix::Bt2020] {
            let rgb = matrix.rgb(matrix.ycbcr([0.2, 0.7, 0.4]));
            for (a, b) in rgb.iter().zip([0.2, 0.7, 0.4]) {
                assert!((a - b).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn siting_maps_chroma_to_luma_and_back() {
        let layout = Layout::subsampled(7, 5, 8);
        assert_eq!(layout.chroma_size(), (4, 3));
        assert_eq!(layout.chroma_to_luma(3.0, 2.0), (6.0, 4.5));
        assert_eq!(layout.luma_to_chroma(6.0, 4.5), (3.0, 2.0));
    }
}
