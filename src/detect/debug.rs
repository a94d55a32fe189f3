//! Each step from frame to marks, as pictures to look at (paper Fig. 8).
//!
//! | file | shows |
//! |---|---|
//! | `n_1_picture.png` | frame n as it was recorded |
//! | `n_2_component.png` | the colour component of the marks, black where there is none |
//! | `n_3_binary.png` | the component compared with the threshold, the outlines mended |
//! | `n_4_marks.png` | every blob found: a cross at its centroid, a ring of its area, its number |
//!
//! All stand as displayed, and share the picture's pixels.

use std::io::Cursor;
use std::path::{Path, PathBuf};

use image::{DynamicImage, GrayImage, ImageFormat, Luma, Rgb, RgbImage};
use opencv::core::{Mat, Point, Scalar, Vec3b};
use opencv::imgproc;

use super::blobs::Target;
use super::component::to_255;
use super::mask::Mask;
use super::plane::Plane;
use super::region::regions;
use super::{Blob, Detector, Hue};
use crate::error::{Error, Result};
use crate::output::{self, OutputFile};
use crate::progress::Progress;
use crate::video::{Frame, Orientation, Picture, Recording};

/// The steps of one frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Steps {
    /// The frame.
    pub picture: RgbImage,
    /// Component of the marks' hues, the strongest where there are several.
    pub component: GrayImage,
    /// White where a mark may be.
    pub binary: GrayImage,
    /// The blobs, drawn.
    pub marks: RgbImage,
    /// The blobs, stored pixels.
    pub blobs: Vec<Blob>,
}

impl Steps {
    /// Runs the chain on a picture and keeps what lies between.
    ///
    /// # Errors
    /// [`Error::OpenCv`].
    pub fn of(detector: &Detector, picture: &Picture<'_>, orientation: Orientation) -> Result<Self> {
        let targets: Vec<Target> =
            detector.hues().iter().enumerate().map(|(i, hue)| detector.target(i, hue, picture)).collect();
        let blobs = detector.detect(picture)?;
        let rgb = View { picture, orientation }.rgb();
        let mut steps = Self {
            component: View { picture, orientation }.component(&targets)?,
            binary: View { picture, orientation }.binary(&targets)?,
            marks: rgb.clone(),
            picture: rgb,
            blobs,
        };
        let size = (picture.layout.width_px, picture.layout.height_px);
        for (i, blob) in steps.blobs.iter().enumerate() {
            let at = orientation.point([blob.centroid.x_px, blob.centroid.y_px], size);
            draw(&mut steps.marks, i + 1, at, blob.centroid.area_px2).map_err(Error::opencv("drawing the marks"))?;
        }
        Ok(steps)
    }

    /// File names' endings and contents, in the order of the chain.
    fn pngs(self) -> [(&'static str, DynamicImage); 4] {
        [
            ("1_picture", DynamicImage::ImageRgb8(self.picture)),
            ("2_component", DynamicImage::ImageLuma8(self.component)),
            ("3_binary", DynamicImage::ImageLuma8(self.binary)),
            ("4_marks", DynamicImage::ImageRgb8(self.marks)),
        ]
    }
}

/// The folder for the pictures.
#[derive(Debug, Clone)]
pub struct DebugFolder {
    folder: PathBuf,
}

impl DebugFolder {
    /// Makes the folder and makes sure that it can be written, before any work is done.
    ///
    /// # Errors
    /// [`Error::Unwritable`].
    pub fn create(folder: &Path) -> Result<Self> {
        output::make_folder(folder)?;
        OutputFile::create(&folder.join("1_picture.png"))?;
        Ok(Self { folder: folder.to_owned() })
    }

    /// Shows `count` frames, evenly spread over those with the stamps `t_s`.
    ///
    /// # Errors
    /// [`Error::Unwritable`], [`Error::Interrupted`], and whatever decoding reports.
    pub fn show(
        &self,
        recording: &Recording,
        hues: &[Hue],
        t_s: &[f64],
        count: usize,
        progress: &dyn Progress,
    ) -> Result<()> {
        let detector = Detector::new(hues.to_vec());
        let orientation = recording.info().orientation;
        let frames = evenly_spread(t_s.len(), count);
        progress.begin("debug", Some(frames.len() as u64));
        for n in frames {
            if progress.is_cancelled() {
                return Err(Error::Interrupted);
            }
            let mut steps = None;
            let mut see = |frame: &Frame<'_>| steps = Some(Steps::of(&detector, &frame.picture, orientation));
            recording.show(t_s[n], &mut see)?;
            if let Some(steps) = steps {
                self.write(n, steps?)?;
            }
            progress.advance(1);
        }
        Ok(())
    }

    fn write(&self, n: usize, steps: Steps) -> Result<()> {
        for (step, picture) in steps.pngs() {
            let path = self.folder.join(format!("{n:05}_{step}.png"));
            let mut bytes = Cursor::new(Vec::new());
            let encoded = picture.write_to(&mut bytes, ImageFormat::Png);
            encoded.map_err(|e| Error::unwritable(&path, std::io::Error::other(e)))?;
            OutputFile::create(&path)?.commit(bytes.get_ref())?;
        }
        Ok(())
    }
}

/// Frame numbers: the middles of `count` equal stretches.
fn evenly_spread(frames: usize, count: usize) -> Vec<usize> {
    let count = count.min(frames);
    (0..count).map(|i| (2 * i + 1) * frames / (2 * count)).collect()
}

/// A picture as it is displayed.
#[derive(Clone, Copy)]
struct View<'a> {
    picture: &'a Picture<'a>,
    orientation: Orientation,
}

impl View<'_> {
    fn size(&self) -> (u32, u32) {
        let layout = self.picture.layout;
        let (width, height) = self.orientation.size((layout.width_px, layout.height_px));
        (width as u32, height as u32)
    }

    /// The stored pixel under a displayed one.
    fn stored(&self, x: u32, y: u32) -> [usize; 2] {
        let layout = self.picture.layout;
        let p = self.orientation.stored_point([f64::from(x), f64::from(y)], (layout.width_px, layout.height_px));
        p.map(|v| v as usize)
    }

    /// The chroma sample under a displayed pixel.
    fn chroma(&self, x: u32, y: u32) -> [usize; 2] {
        let [sx, sy] = self.stored(x, y);
        [sx >> self.picture.layout.chroma_shift_x, sy >> self.picture.layout.chroma_shift_y]
    }

    fn rgb(self) -> RgbImage {
        let (width, height) = self.size();
        RgbImage::from_fn(width, height, |x, y| {
            let ([sx, sy], [cx, cy]) = (self.stored(x, y), self.chroma(x, y));
            let (cb, cr) = self.picture.chroma(cx, cy);
            let rgb = self.picture.layout.matrix.rgb([self.picture.y(sx, sy), cb, cr]);
            Rgb(rgb.map(|v| (255.0 * v).round().clamp(0.0, 255.0) as u8))
        })
    }

    fn component(self, targets: &[Target]) -> Result<GrayImage> {
        let planes = targets.iter().map(|t| Plane::of(self.picture, t.axis, t.level)).collect::<Result<Vec<_>>>()?;
        let (width, height) = self.size();
        Ok(GrayImage::from_fn(width, height, |x, y| {
            let [cx, cy] = self.chroma(x, y);
            let at = |p: &Plane| {
                let (i, j) = ((cx >> p.level).min(p.width - 1), (cy >> p.level).min(p.height - 1));
                p.values[j * p.width + i]
            };
            let strongest = planes.iter().map(at).max().unwrap_or(0);
            Luma([to_255(f64::from(strongest)).round().clamp(0.0, 255.0) as u8])
        }))
    }

    fn binary(self, targets: &[Target]) -> Result<GrayImage> {
        let (columns, rows) = self.picture.layout.chroma_size();
        let mut samples = vec![0u8; columns * rows];
        for target in targets.iter().filter(|t| !t.is_sought_everywhere()) {
            for region in regions(self.picture, target.axis, target.threshold) {
                let mask = Mask::of(self.picture, target.axis, target.threshold, target.thin, region);
                for (y, row) in mask.rows() {
                    let to = &mut samples[y * columns + mask.left()..][..row.len()];
                    to.iter_mut().zip(row).for_each(|(t, m)| *t |= *m);
                }
            }
        }
        for target in targets.iter().filter(|t| t.is_sought_everywhere()) {
            let plane = Plane::of(self.picture, target.axis, target.level)?;
            let mask = Mask::of_plane(&plane, target.threshold, target.thin);
            for (y, row) in mask.rows() {
                for j in (y << target.level)..((y + 1) << target.level).min(rows) {
                    let to = &mut samples[j * columns..(j + 1) * columns];
                    let sample = |i: usize| (i >> target.level).min(plane.width - 1).checked_sub(mask.left());
                    let at = |i: usize| sample(i).and_then(|x| row.get(x)).copied().unwrap_or_default();
                    to.iter_mut().enumerate().for_each(|(i, t)| *t |= at(i));
                }
            }
        }
        let (width, height) = self.size();
        Ok(GrayImage::from_fn(width, height, |x, y| {
            let [cx, cy] = self.chroma(x, y);
            Luma([samples[cy * columns + cx]])
        }))
    }
}

/// Bits behind the point in OpenCV's drawing coordinates.
const SHIFT: i32 = 4;

/// A cross at the centroid, a ring around the area, and a number.
fn draw(image: &mut RgbImage, number: usize, [x, y]: [f64; 2], area_px2: f64) -> opencv::Result<()> {
    let (columns, rows) = (image.width() as i32, image.height() as i32);
    let mut pixels: Vec<Vec3b> = image.pixels().map(|p| Vec3b::from(p.0)).collect();
    {
        let mut mat = Mat::new_rows_cols_with_data_mut(rows, columns, &mut pixels)?;
        let fixed = |v: f64| (v * f64::from(1 << SHIFT)).round() as i32;
        let at = |x: f64, y: f64| Point::new(fixed(x), fixed(y));
        let (white, blue) = (Scalar::new(255.0, 255.0, 255.0, 0.0), Scalar::new(30.0, 90.0, 255.0, 0.0));
        let radius = (area_px2.max(0.0) / std::f64::consts::PI).sqrt();
        imgproc::circle(&mut mat, at(x, y), fixed(radius), blue, 1, imgproc::LINE_AA, SHIFT)?;
        let arm = 0.6 * radius + 2.0;
        let beside = Point::new((x + radius + 4.0) as i32, (y - 0.5 * radius) as i32);
        let (font, text) = (imgproc::FONT_HERSHEY_SIMPLEX, number.to_string());
        // a dark seam first, so that white is seen on white
        for (colour, width) in [(Scalar::all(0.0), 3), (white, 1)] {
            imgproc::line(&mut mat, at(x - arm, y), at(x + arm, y), colour, width, imgproc::LINE_AA, SHIFT)?;
            imgproc::line(&mut mat, at(x, y - arm), at(x, y + arm), colour, width, imgproc::LINE_AA, SHIFT)?;
            imgproc::put_text(&mut mat, &text, beside, font, 0.6, colour, width, imgproc::LINE_AA, false)?;
        }
    }
    for (to, from) in image.pixels_mut().zip(&pixels) {
        to.0 = [from[0], from[1], from[2]];
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_evenly_spread_and_never_more_than_there_are() {
        assert_eq!(evenly_spread(100, 4), [12, 37, 62, 87]);
        assert_eq!(evenly_spread(2, 8), [0, 1]);
        assert_eq!(evenly_spread(0, 8), Vec::<usize>::new());
        assert_eq!(evenly_spread(5, 0), Vec::<usize>::new());
    }
}
