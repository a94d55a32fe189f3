//! What is drawn at the marks: rectangles (Fig. 8 of the paper), numbers, trails, links.

use opencv::core::{Point, Scalar, Vector};
use opencv::imgproc;

use super::Look;
use super::canvas::{Bounds, Canvas, Ink, Stencil};
use super::lettering::{FULL, SHIFT, fixed};
use crate::error::Result;

/// The rectangle of a measured mark.
const MEASURED: Ink = Ink::opaque([30, 90, 255]);
/// The rectangle of a lost mark, where the filter takes it to be.
const LOST: Ink = Ink::opaque([255, 170, 0]);
const TRAIL: Ink = Ink::opaque([110, 190, 255]);
const LINK: Ink = Ink::opaque([255, 255, 255]).at(0.8);
const PIVOT: Ink = Ink::opaque([255, 255, 255]).at(0.9);
/// Behind numbers and lines, so that they are seen on any ground.
const SHADE: Ink = Ink::opaque([0, 0, 0]).at(0.55);

/// A mark in one frame, as it is drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Seen {
    /// Displayed pixels.
    pub centre_px: [f64; 2],
    /// Half a side.
    pub half_px: f64,
    /// Seen in this frame, or only believed to be here.
    pub measured: bool,
}

/// A thin line from mark to mark.
pub(super) fn link(canvas: &mut Canvas, look: &Look, upper_px: [f64; 2], lower_px: [f64; 2]) -> Result<()> {
    seamed(canvas, look, LINK, &[[upper_px, lower_px]])
}

/// A cross at the fixed, unmarked pivot.
pub(super) fn pivot(canvas: &mut Canvas, look: &Look, [x, y]: [f64; 2]) -> Result<()> {
    let arm = 5.0 * look.line_px;
    seamed(canvas, look, PIVOT, &[[[x - arm, y], [x + arm, y]], [[x, y - arm], [x, y + arm]]])
}

/// Thin lines with a dark seam.
fn seamed(canvas: &mut Canvas, look: &Look, ink: Ink, lines_px: &[[[f64; 2]; 2]]) -> Result<()> {
    let bounds = Bounds::around(lines_px.iter().flatten().copied(), look.line_px + 4.0);
    for (ink, width) in [(SHADE, look.thin() + 2), (ink, look.thin())] {
        canvas.lay(bounds, ink, |stencil| {
            for [from, to] in lines_px {
                let (from, to) = (within(stencil, *from), within(stencil, *to));
                imgproc::line(&mut stencil.mat, from, to, FULL, width, imgproc::LINE_AA, SHIFT)?;
            }
            Ok(())
        })?;
    }
    Ok(())
}

/// Where a mark came from, fading with age; `None` is a gap.
pub(super) fn trail(canvas: &mut Canvas, look: &Look, steps_px: &[(f64, Option<[f64; 2]>)]) -> Result<()> {
    let bounds = Bounds::around(steps_px.iter().filter_map(|(_, p)| *p), look.line_px + 2.0);
    canvas.lay(bounds, TRAIL, |stencil| {
        for pair in steps_px.windows(2) {
            if let [(_, Some(from)), (age, Some(to))] = *pair {
                let (from, to) = (within(stencil, from), within(stencil, to));
                let fresh = Scalar::new(220.0 * (1.0 - age).clamp(0.0, 1.0), 0.0, 0.0, 0.0);
                imgproc::line(&mut stencil.mat, from, to, fresh, look.thick(), imgproc::LINE_AA, SHIFT)?;
            }
        }
        Ok(())
    })
}

/// The rectangle, whole where the mark was measured and dashed where it is lost, and the mark's number.
pub(super) fn mark(canvas: &mut Canvas, look: &Look, number: usize, mark: Seen) -> Result<()> {
    let ([x, y], half) = (mark.centre_px, mark.half_px);
    let ink = if mark.measured { MEASURED } else { LOST };
    let corners = [[x - half, y - half], [x + half, y - half], [x + half, y + half], [x - half, y + half]];
    let bounds = Bounds::around(corners, look.line_px + 4.0);
    for (ink, width) in [(SHADE.at(0.4), look.thick() + 2), (ink, look.thick())] {
        canvas.lay(bounds, ink, |stencil| {
            if mark.measured {
                let outline: Vector<Point> = corners.iter().map(|c| within(stencil, *c)).collect();
                imgproc::polylines(&mut stencil.mat, &outline, true, FULL, width, imgproc::LINE_AA, SHIFT)
            } else {
                dashes(stencil, corners, width, 3.0 * look.line_px)
            }
        })?;
    }
    let lettering = look.lettering();
    let gap = 2.0 * look.line_px;
    let [width, _] = canvas.size_px();
    // beside the upper right corner, on the other side where the picture ends
    let room = x + half + gap + 2.0 * lettering.cell_px() < width as f64;
    let text = number.to_string();
    let wide = lettering.cell_px() * text.len() as f64;
    let left = if room { x + half + gap } else { x - half - gap - wide };
    super::panel::shaded_text(
        canvas,
        lettering,
        &text,
        [left, y - half + look.letter_px],
        if mark.measured { TRAIL } else { LOST },
    )
}

fn dashes(stencil: &mut Stencil<'_>, corners: [[f64; 2]; 4], width: i32, dash_px: f64) -> opencv::Result<()> {
    for (i, from) in corners.iter().enumerate() {
        let to = corners[(i + 1) % 4];
        let length = (to[0] - from[0]).hypot(to[1] - from[1]);
        // an odd number of equal strokes and gaps: each side begins and ends with a stroke
        let count = (2.0 * (0.5 * length / dash_px).round() + 1.0).clamp(3.0, 41.0);
        let at = |k: f64| [0, 1].map(|axis| from[axis] + (to[axis] - from[axis]) * k / count);
        for k in (0..count as usize).step_by(2) {
            let (a, b) = (within(stencil, at(k as f64)), within(stencil, at(k as f64 + 1.0)));
            imgproc::line(&mut stencil.mat, a, b, FULL, width, imgproc::LINE_AA, SHIFT)?;
        }
    }
    Ok(())
}

/// A displayed point in the stencil's fixed-point coordinates, kept where they cannot overflow.
fn within(stencil: &Stencil<'_>, p: [f64; 2]) -> Point {
    fixed([0, 1].map(|k| (p[k] - f64::from(stencil.origin_px[k])).clamp(-1e6, 1e6)))
}
