//! What was found, drawn into an early picture of the free swing: marks with their paths, numbers, links, pivot.

use std::io::Cursor;

use image::{DynamicImage, ImageFormat, RgbImage};
use opencv::core::{Mat, Point, Scalar, Vec3b};
use opencv::imgproc;

use super::Finding;
use crate::error::{Error, Result};

/// Bits behind the point in OpenCV's drawing coordinates.
const SHIFT: i32 = 4;
const WHITE: [f64; 3] = [255.0, 255.0, 255.0];
const BLACK: [f64; 3] = [0.0, 0.0, 0.0];
const BLUE: [f64; 3] = [30.0, 90.0, 255.0];
const ORANGE: [f64; 3] = [255.0, 140.0, 0.0];

/// The preview as a PNG.
///
/// # Errors
/// [`Error::OpenCv`].
pub fn preview(finding: &Finding) -> Result<Vec<u8>> {
    let (stored_width, stored_height) = finding.stream.stored_size_px;
    let (width, height) = finding.stream.orientation.size((stored_width, stored_height));
    let mut image = RgbImage::new(width as u32, height as u32);
    let background = &finding.background;
    for (x, y, pixel) in image.enumerate_pixels_mut() {
        let stored =
            finding.stream.orientation.stored_point([f64::from(x), f64::from(y)], (stored_width, stored_height));
        let [i, j] = [0, 1].map(|axis| (stored[axis].max(0.0) as usize) >> background.shifts[axis]);
        let at = j * background.width + i.min(background.width.saturating_sub(1));
        pixel.0 = background.rgb.get(at).copied().unwrap_or_default();
    }
    draw(&mut image, finding).map_err(Error::opencv("drawing the preview"))?;
    let mut bytes = Cursor::new(Vec::new());
    let encoded = DynamicImage::ImageRgb8(image).write_to(&mut bytes, ImageFormat::Png);
    encoded.map_err(|e| Error::Encode { path: "preview".into(), detail: e.to_string() })?;
    Ok(bytes.into_inner())
}

fn draw(image: &mut RgbImage, finding: &Finding) -> opencv::Result<()> {
    let (columns, rows) = (image.width() as i32, image.height() as i32);
    let mut pixels: Vec<Vec3b> = image.pixels().map(|p| Vec3b::from(p.0)).collect();
    {
        let mut mat = Mat::new_rows_cols_with_data_mut(rows, columns, &mut pixels)?;
        let mut pen = Pen { mat: &mut mat };
        for mark in &finding.marks {
            for pair in mark.thing.path.windows(2) {
                if let [Some(a), Some(b)] = pair {
                    pen.line(*a, *b, ORANGE, 1)?;
                }
            }
        }
        let nodes: Vec<[f64; 2]> = finding.marks.iter().map(|m| seen(&m.thing.path, finding.pictured)).collect();
        let pivot = finding.arc.filter(|_| !finding.hinge_marked).map(|arc| arc.centre_px);
        for pair in pivot.iter().chain(&nodes).collect::<Vec<_>>().windows(2) {
            pen.line(*pair[0], *pair[1], WHITE, 1)?;
        }
        for (i, mark) in finding.marks.iter().enumerate() {
            let radius = mark.thing.radius_px();
            pen.ring(nodes[i], radius + 2.0, BLUE)?;
            pen.text(&format!("{} {}", i + 1, mark.colour), [nodes[i][0] + radius + 6.0, nodes[i][1] + 5.0])?;
        }
        if let Some(arc) = finding.arc {
            let [x, y] = arc.centre_px;
            pen.line([x - 9.0, y], [x + 9.0, y], BLUE, 2)?;
            pen.line([x, y - 9.0], [x, y + 9.0], BLUE, 2)?;
            let words = format!("pivot {x:.0}, {y:.0} +- {:.1}, {:.1} px", arc.sd_px[0], arc.sd_px[1]);
            // a pivot outside the picture is named at its edge
            let place = [x.clamp(8.0, f64::from(columns) - 260.0) + 12.0, y.clamp(20.0, f64::from(rows) - 10.0) - 6.0];
            pen.text(&words, place)?;
        }
    }
    for (to, from) in image.pixels_mut().zip(&pixels) {
        to.0 = [from[0], from[1], from[2]];
    }
    Ok(())
}

/// Where a mark is in a frame, or first seen after it.
fn seen(path: &[Option<[f64; 2]>], frame: usize) -> [f64; 2] {
    let from = path.get(frame..).unwrap_or_default();
    from.iter().chain(path).flatten().next().copied().unwrap_or_default()
}

struct Pen<'a, 'm> {
    mat: &'a mut opencv::boxed_ref::BoxedRefMut<'m, Mat>,
}

fn fixed(v: f64) -> i32 {
    (v.clamp(-4000.0, 20000.0) * f64::from(1 << SHIFT)).round() as i32
}

fn scalar([r, g, b]: [f64; 3]) -> Scalar {
    Scalar::new(r, g, b, 0.0)
}

impl Pen<'_, '_> {
    fn line(&mut self, a: [f64; 2], b: [f64; 2], colour: [f64; 3], width: i32) -> opencv::Result<()> {
        let at = |p: [f64; 2]| Point::new(fixed(p[0]), fixed(p[1]));
        imgproc::line(self.mat, at(a), at(b), scalar(colour), width, imgproc::LINE_AA, SHIFT)
    }

    fn ring(&mut self, centre: [f64; 2], radius: f64, colour: [f64; 3]) -> opencv::Result<()> {
        let at = Point::new(fixed(centre[0]), fixed(centre[1]));
        imgproc::circle(self.mat, at, fixed(radius), scalar(colour), 2, imgproc::LINE_AA, SHIFT)
    }

    /// With a dark seam, so that white is seen on white.
    fn text(&mut self, text: &str, [x, y]: [f64; 2]) -> opencv::Result<()> {
        let (font, at) = (imgproc::FONT_HERSHEY_SIMPLEX, Point::new(x as i32, y as i32));
        for (colour, width) in [(BLACK, 3), (WHITE, 1)] {
            imgproc::put_text(self.mat, text, at, font, 0.5, scalar(colour), width, imgproc::LINE_AA, false)?;
        }
        Ok(())
    }
}
