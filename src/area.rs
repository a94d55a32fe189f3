//! Which part of the picture is looked at.

use std::path::Path;

use crate::error::{Error, Result};
use crate::experiment::Rig;
use crate::video::{Layout, Orientation};

/// Half the side of the patch that is found again around a reference mark.
pub const PATCH_HALF_PX: f64 = 15.0;

/// The part of the picture in which marks are sought.
#[derive(Debug, Clone, Default)]
pub struct Area {
    roi_px: Option<[f64; 4]>,
    /// Width, and what may be looked at, row by row, of the displayed picture.
    mask: Option<(usize, Vec<bool>)>,
}

impl Area {
    /// Of the rig; a mask's path is relative to `folder`, its size that of the displayed picture.
    ///
    /// # Errors
    /// [`Error::Config`] for a mask that cannot be read or has another size, [`Error::Option`] for a region beside
    /// the picture.
    pub fn new(rig: &Rig, folder: &Path, size: (usize, usize)) -> Result<Self> {
        if let Some([x, y, width, height]) = rig.roi_px
            && (x >= size.0 as f64 || y >= size.1 as f64 || x + width <= 0.0 || y + height <= 0.0)
        {
            let message = format!(
                "{x},{y},{width},{height} lies beside the picture of {}×{} px; give left,top,width,height in it",
                size.0, size.1
            );
            return Err(Error::Option { option: "--roi".to_owned(), message });
        }
        let margin = PATCH_HALF_PX + 2.0;
        let reaches = |p: &&[f64; 2]| {
            let held = |v: f64, side: usize| (margin..=side as f64 - margin).contains(&v);
            !(held(p[0], size.0) && held(p[1], size.1))
        };
        if let Some([x, y]) = rig.reference_marks.iter().find(reaches) {
            let message = format!(
                "({x}, {y}) px is not in the picture of {}×{} px, or nearer to its edge than {margin} px; name a fixed point with clear edges farther inside",
                size.0, size.1
            );
            return Err(Error::Option { option: "--reference".to_owned(), message });
        }
        let mask = rig.mask.as_ref().map(|mask| read_mask(&folder.join(mask), size)).transpose()?;
        Ok(Self { roi_px: rig.roi_px, mask })
    }

    /// Everything is looked at.
    pub fn is_whole(&self) -> bool {
        self.roi_px.is_none() && self.mask.is_none()
    }

    /// A displayed point is looked at.
    pub fn holds(&self, [x, y]: [f64; 2]) -> bool {
        let in_roi = self.roi_px.is_none_or(|[left, top, width, height]| {
            (left..left + width).contains(&x) && (top..top + height).contains(&y)
        });
        in_roi
            && self.mask.as_ref().is_none_or(|(width, rows)| {
                x >= -0.5
                    && y >= -0.5
                    && x.round() < *width as f64
                    && rows.get(y.round() as usize * width + x.round() as usize).copied().unwrap_or(false)
            })
    }

    /// Which chroma samples are looked at; `None` where all are.
    pub fn samples(&self, layout: &Layout, orientation: Orientation) -> Option<Vec<bool>> {
        if self.is_whole() {
            return None;
        }
        let (width, height) = layout.chroma_size();
        let size = (layout.width_px, layout.height_px);
        let at = |x: usize, y: usize| {
            let (x, y) = layout.chroma_to_luma(x as f64, y as f64);
            self.holds(orientation.point([x, y], size))
        };
        Some((0..height).flat_map(|y| (0..width).map(move |x| (x, y))).map(|(x, y)| at(x, y)).collect())
    }
}

fn read_mask(path: &Path, size: (usize, usize)) -> Result<(usize, Vec<bool>)> {
    let wrong = |message: String| Error::Config { path: path.to_owned(), line: None, message };
    let picture = image::open(path)
        .map_err(|e| wrong(format!("not a picture that can be read ({e}); give a PNG, white where marks are sought")))?
        .into_luma8();
    let (width, height) = (picture.width() as usize, picture.height() as usize);
    if (width, height) != size {
        return Err(wrong(format!(
            "the mask is {width}×{height} px, the picture {}×{}; make it as large as the picture",
            size.0, size.1
        )));
    }
    let white: Vec<bool> = picture.pixels().map(|p| p.0[0] > 127).collect();
    if !white.contains(&true) {
        return Err(wrong("the mask is dark all over; paint it white where marks are sought".to_owned()));
    }
    Ok((width, white))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_region_holds_what_lies_in_it() {
        let rig = Rig { roi_px: Some([10.0, 20.0, 30.0, 40.0]), ..Rig::default() };
        let area = Area::new(&rig, Path::new(""), (100, 100)).unwrap();
        assert!(area.holds([10.0, 20.0]) && area.holds([39.0, 59.0]));
        assert!(!area.holds([9.0, 30.0]) && !area.holds([20.0, 61.0]));
        let reference = |p: [f64; 2]| Rig { reference_marks: vec![p], ..Rig::default() };
        assert!(Area::new(&reference([40.0, 60.0]), Path::new(""), (100, 100)).is_ok());
        assert!(Area::new(&reference([40.0, 99.0]), Path::new(""), (100, 100)).is_err());
        let beside = Rig { roi_px: Some([200.0, 0.0, 10.0, 10.0]), ..Rig::default() };
        assert!(Area::new(&beside, Path::new(""), (100, 100)).is_err());
    }
}
