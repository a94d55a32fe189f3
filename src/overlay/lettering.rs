//! Letters, digits and the few signs of the panel that OpenCV's stroke font lacks: θ, ±, °, − and small digits.
//!
//! Every character takes a cell of the same width, so that changing numbers stand still.

use opencv::core::{Point, Scalar, Size};
use opencv::imgproc;

use super::canvas::Stencil;

/// Height of a capital and width of a cell in OpenCV's stroke font at scale 1, px.
const CAPITAL_PX: f64 = 21.0;
const CELL_PX: f64 = 19.0;
/// Bits behind the point in OpenCV's drawing coordinates.
pub(super) const SHIFT: i32 = 4;
/// Full coverage.
pub(super) const FULL: Scalar = Scalar::new(255.0, 0.0, 0.0, 0.0);

/// The size and weight of a line of text.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Lettering {
    /// Height of a capital.
    pub height_px: f64,
    /// Width of a stroke.
    pub stroke_px: i32,
}

impl Lettering {
    /// Width of a cell.
    pub fn cell_px(&self) -> f64 {
        (CELL_PX * self.scale()).round().max(1.0)
    }

    fn scale(&self) -> f64 {
        self.height_px / CAPITAL_PX
    }

    /// Writes `text` with its baseline's left end at a displayed pixel.
    pub fn write(&self, stencil: &mut Stencil<'_>, text: &str, baseline_px: [f64; 2]) -> opencv::Result<()> {
        for (i, sign) in text.chars().enumerate() {
            let left = baseline_px[0] + self.cell_px() * i as f64;
            self.sign(
                stencil,
                sign,
                [left - f64::from(stencil.origin_px[0]), baseline_px[1] - f64::from(stencil.origin_px[1])],
            )?;
        }
        Ok(())
    }

    fn sign(&self, stencil: &mut Stencil<'_>, sign: char, [left, base]: [f64; 2]) -> opencv::Result<()> {
        let unit = self.scale();
        let at = |x: f64, y: f64| fixed([left + unit * x, base - unit * y]);
        let mut stroke = |from: Point, to: Point| {
            imgproc::line(&mut stencil.mat, from, to, FULL, self.stroke_px, imgproc::LINE_AA, SHIFT)
        };
        match sign {
            ' ' => Ok(()),
            '−' => stroke(at(3.0, 9.0), at(15.0, 9.0)),
            '+' => {
                stroke(at(3.0, 9.0), at(15.0, 9.0))?;
                stroke(at(9.0, 3.0), at(9.0, 15.0))
            }
            '±' => {
                stroke(at(3.0, 11.0), at(15.0, 11.0))?;
                stroke(at(9.0, 5.0), at(9.0, 17.0))?;
                stroke(at(3.0, 0.5), at(15.0, 0.5))
            }
            'θ' => {
                stroke(at(3.5, 10.5), at(14.5, 10.5))?;
                self.ring(stencil, at(9.0, 10.5), [6.0, 10.5])
            }
            '°' => self.ring(stencil, at(5.0, 18.0), [3.5, 3.5]),
            '₀'..='₉' => {
                let digit = char::from(b'0' + (sign as u32 - '₀' as u32) as u8);
                self.glyph(stencil, digit, [left - unit, base + 6.0 * unit], 0.62)
            }
            other => self.glyph(stencil, other, [left, base], 1.0),
        }
    }

    fn ring(&self, stencil: &mut Stencil<'_>, centre: Point, half: [f64; 2]) -> opencv::Result<()> {
        let axes = fixed(half.map(|v| v * self.scale()));
        let axes = Size::new(axes.x, axes.y);
        imgproc::ellipse(&mut stencil.mat, centre, axes, 0.0, 0.0, 360.0, FULL, self.stroke_px, imgproc::LINE_AA, SHIFT)
    }

    /// A character of the stroke font, in the middle of its cell.
    fn glyph(&self, stencil: &mut Stencil<'_>, sign: char, [left, base]: [f64; 2], size: f64) -> opencv::Result<()> {
        let text = sign.to_string();
        let (font, scale) = (imgproc::FONT_HERSHEY_SIMPLEX, self.scale() * size);
        let wide = imgproc::get_text_size(&text, font, scale, self.stroke_px, &mut 0)?.width;
        let x = left + 0.5 * (self.cell_px() * size - f64::from(wide));
        let at = Point::new(x.round() as i32, base.round() as i32);
        imgproc::put_text(&mut stencil.mat, &text, at, font, scale, FULL, self.stroke_px, imgproc::LINE_AA, false)
    }
}

/// A point for OpenCV's drawing functions, with [`SHIFT`] bits behind the point.
pub(super) fn fixed([x, y]: [f64; 2]) -> Point {
    let one = f64::from(1 << SHIFT);
    Point::new((x * one).round() as i32, (y * one).round() as i32)
}
