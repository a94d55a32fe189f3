//! The panel in a corner: time, and each angle with its standard deviation.

use opencv::core::MatTrait;

use super::Look;
use super::canvas::{Bounds, Canvas, Ink};
use super::lettering::{FULL, Lettering};
use crate::angles::{Angle, Angles};
use crate::error::Result;

const GROUND: Ink = Ink::opaque([8, 12, 20]).at(0.86);
const TEXT: Ink = Ink::opaque([240, 244, 250]);
const ABSENT: Ink = Ink::opaque([255, 170, 0]);
const SHADE: Ink = Ink::opaque([0, 0, 0]).at(0.6);

/// Where the panel stands and how its numbers are written, the same for a whole recording.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Panel {
    lettering: Lettering,
    left_px: f64,
    top_px: f64,
    padding_px: f64,
    width_px: f64,
    height_px: f64,
    line_px: f64,
    decimals: usize,
}

impl Panel {
    /// In the corner that hides the fewest of `points_px`, and of those the plainest one of the first picture.
    pub fn new(look: &Look, first: &Canvas, angles: &Angles, points_px: &[[f64; 2]]) -> Self {
        let size_px = first.size_px();
        let lettering = look.lettering();
        let decimals = decimals(angles);
        let (padding_px, line_px) = (0.9 * look.letter_px, 1.9 * look.letter_px);
        let cells = angle_text(1, Some(&Angle { theta_rad: 0.0, sd_rad: 0.0 }), decimals).chars().count();
        let width_px = lettering.cell_px() * cells as f64 + 2.0 * padding_px;
        let height_px = line_px * angles.links.len() as f64 + look.letter_px + 2.0 * padding_px;
        let [right, bottom] = [size_px[0] as f64 - width_px - padding_px, size_px[1] as f64 - height_px - padding_px];
        let corners = [[padding_px, padding_px], [right, padding_px], [padding_px, bottom], [right, bottom]];
        let hidden = |[left, top]: [f64; 2]| {
            let inside =
                |p: &&[f64; 2]| (left..left + width_px).contains(&p[0]) && (top..top + height_px).contains(&p[1]);
            (points_px.iter().filter(inside).count(), first.spread([left, top], [width_px, height_px]))
        };
        let [left_px, top_px] = corners.into_iter().min_by_key(|c| hidden(*c)).unwrap_or(corners[0]);
        Self { lettering, left_px, top_px, padding_px, width_px, height_px, line_px, decimals }
    }

    /// Draws the panel of one frame.
    pub fn draw(&self, canvas: &mut Canvas, t_s: f64, angles: &[Option<Angle>]) -> Result<()> {
        let (left, top) = (self.left_px, self.top_px);
        let bounds = Bounds::around([[left, top], [left + self.width_px, top + self.height_px]], 0.0);
        canvas.lay(bounds, GROUND, |stencil| stencil.mat.set_to_def(&FULL).map(|_| ()))?;
        let base = top + self.padding_px + self.lettering.height_px;
        let mut lines = vec![(format!("t  {t_s:>8.3} s"), TEXT)];
        lines.extend(angles.iter().enumerate().map(|(i, angle)| {
            let ink = if angle.is_some() { TEXT } else { ABSENT };
            (angle_text(i + 1, angle.as_ref(), self.decimals), ink)
        }));
        for (i, (text, ink)) in lines.iter().enumerate() {
            let at = [left + self.padding_px, base + self.line_px * i as f64];
            shaded_text(canvas, self.lettering, text, at, *ink)?;
        }
        Ok(())
    }
}

/// So many decimals that the usual standard deviation, in degrees, has one that counts.
fn decimals(angles: &Angles) -> usize {
    let mut sd: Vec<f64> = angles.links.iter().flatten().flatten().map(|a| a.sd_rad.to_degrees()).collect();
    sd.sort_by(f64::total_cmp);
    match sd.get(sd.len() / 2) {
        Some(median) if *median > 0.0 => (-median.log10()).ceil().clamp(1.0, 4.0) as usize,
        _ => 2,
    }
}

/// `θ₁   −12.34 ±0.02°`, or that the angle is missing.
fn angle_text(link: usize, angle: Option<&Angle>, decimals: usize) -> String {
    let name: String =
        link.to_string().chars().map(|d| char::from_u32('₀' as u32 + d as u32 - '0' as u32).unwrap_or(d)).collect();
    let width = 6 + decimals;
    match angle {
        Some(a) => {
            let theta = format!("{:+.decimals$}", a.theta_rad.to_degrees()).replace('-', "−");
            format!("θ{name:<2}{theta:>width$} ±{:.decimals$}°", a.sd_rad.to_degrees())
        }
        None => format!("θ{name:<2}{:>width$}", "lost"),
    }
}

/// Text with a dark seam, legible on any ground; `baseline_px` is the left end of its baseline.
pub(super) fn shaded_text(
    canvas: &mut Canvas,
    lettering: Lettering,
    text: &str,
    baseline_px: [f64; 2],
    ink: Ink,
) -> Result<()> {
    let [left, base] = baseline_px.map(f64::round);
    let right = left + lettering.cell_px() * text.chars().count() as f64;
    let bounds = Bounds::around([[left, base - lettering.height_px], [right, base + 0.4 * lettering.height_px]], 4.0);
    let seam = Lettering { stroke_px: lettering.stroke_px + 2, ..lettering };
    canvas.lay(bounds, SHADE, |stencil| seam.write(stencil, text, [left, base]))?;
    canvas.lay(bounds, ink, |stencil| lettering.write(stencil, text, [left, base]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_are_written_in_degrees_with_a_true_minus_and_the_same_width() {
        let angle = Angle { theta_rad: -0.1, sd_rad: 0.0004 };
        assert_eq!(angle_text(1, Some(&angle), 2), "θ₁    −5.73 ±0.02°");
        assert_eq!(angle_text(12, Some(&angle), 2), "θ₁₂   −5.73 ±0.02°");
        assert_eq!(angle_text(2, None, 2), "θ₂     lost");
    }

    #[test]
    fn the_panel_avoids_the_marks_and_shows_as_many_decimals_as_count() {
        let link = vec![Some(Angle { theta_rad: 0.0, sd_rad: 0.003f64.to_radians() })];
        let angles = Angles { t_s: vec![0.0], links: vec![link] };
        let layout = crate::experiment::Render::default().codec.layout(640, 480);
        let picture = crate::video::OwnedPicture::black(layout);
        let canvas = Canvas::of(&picture.view(), crate::video::Orientation::default());
        let look = Look::for_size([640, 480]);
        let panel = Panel::new(&look, &canvas, &angles, &[[30.0, 30.0], [600.0, 30.0]]);
        assert_eq!(panel.decimals, 3);
        assert!(panel.left_px < 320.0 && panel.top_px > 240.0, "{panel:?}");
    }
}
