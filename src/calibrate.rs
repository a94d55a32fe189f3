//! Pixels, y down → directions and metres, y up. The only place where the picture's y axis is turned.

use std::path::Path;

use opencv::calib3d;
use opencv::core::{
    FileNodeTraitConst, FileStorage, FileStorageTraitConst, Mat, Point2d, TermCriteria, TermCriteria_Type, Vector,
};

use crate::error::{Error, Result};
use crate::experiment::Rig;

/// A camera's matrix and distortion, from an OpenCV calibration file.
#[derive(Debug, Clone)]
pub struct Lens {
    camera: Mat,
    distortion: Mat,
}

impl Lens {
    /// Reads `camera_matrix` and `distortion_coefficients` (the names OpenCV's own calibration writes).
    ///
    /// # Errors
    /// [`Error::Unreadable`] and [`Error::Config`].
    pub fn read(path: &Path) -> Result<Self> {
        std::fs::File::open(path).map_err(|e| Error::unreadable(path, e))?;
        let invalid = |message: String| Error::Config { path: path.to_owned(), line: None, message };
        let storage = FileStorage::new(&path.to_string_lossy(), 0, "")
            .map_err(|e| invalid(format!("not an OpenCV calibration file: {}", e.message.replace('\n', " "))))?;
        let matrix = |names: &[&str]| -> Result<Mat> {
            for name in names {
                let node = storage.get(name).map_err(Error::opencv("reading a calibration file"))?;
                if let Ok(mat) = node.mat()
                    && opencv::core::MatTraitConst::total(&mat) > 0
                {
                    return Ok(mat);
                }
            }
            Err(invalid(format!("holds no `{}`; write it with OpenCV's calibration, FileStorage format", names[0])))
        };
        let camera = matrix(&["camera_matrix", "cameraMatrix", "K"])?;
        let distortion = matrix(&["distortion_coefficients", "dist_coeffs", "distCoeffs", "D"])?;
        if opencv::core::MatTraitConst::rows(&camera) != 3 || opencv::core::MatTraitConst::cols(&camera) != 3 {
            return Err(invalid("`camera_matrix` must be 3×3".to_owned()));
        }
        Ok(Self { camera, distortion })
    }

    /// Where the points would lie if the lens were straight, in the same pixels.
    ///
    /// # Errors
    /// [`Error::OpenCv`].
    pub fn straighten(&self, points_px: &[[f64; 2]]) -> Result<Vec<[f64; 2]>> {
        if points_px.is_empty() {
            return Ok(Vec::new());
        }
        let source: Vector<Point2d> = points_px.iter().map(|p| Point2d::new(p[0], p[1])).collect();
        let mut straight: Vector<Point2d> = Vector::new();
        let none = Mat::default();
        // OpenCV stops after five iterations by default, which leaves hundredths of a pixel at the corners
        let until = TermCriteria::new((TermCriteria_Type::COUNT as i32) | (TermCriteria_Type::EPS as i32), 60, 1e-10)
            .map_err(Error::opencv("straightening points"))?;
        calib3d::undistort_points_iter(
            &source,
            &mut straight,
            &self.camera,
            &self.distortion,
            &none,
            &self.camera,
            until,
        )
        .map_err(Error::opencv("straightening points"))?;
        Ok(straight.iter().map(|p| [p.x, p.y]).collect())
    }
}

/// How a vector in the picture becomes an angle from the downward vertical.
#[derive(Debug, Clone)]
pub struct Calibration {
    /// Width of a displayed pixel over its height.
    pub pixel_aspect: f64,
    /// The camera looks into a mirror: x changes its sign.
    pub mirrored: bool,
    /// Angle of true down from the picture's down, positive towards the picture's right.
    pub plumb_rad: f64,
    /// The lens.
    pub lens: Option<Lens>,
}

impl Calibration {
    /// From the rig, with the pixel aspect that the file states.
    ///
    /// # Errors
    /// From reading the lens calibration, a path relative to `folder`.
    pub fn new(rig: &Rig, stated_aspect: f64, folder: &Path) -> Result<Self> {
        let pixel_aspect = rig.pixel_aspect.unwrap_or(stated_aspect);
        let plumb_rad = rig
            .plumb_px
            .map_or(0.0, |[upper, lower]| (pixel_aspect * (lower[0] - upper[0])).atan2(lower[1] - upper[1]));
        let lens = rig.lens_calibration.as_ref().map(|p| Lens::read(&folder.join(p))).transpose()?;
        Ok(Self { pixel_aspect, mirrored: rig.mirrored, plumb_rad, lens })
    }

    /// The vector `from` → `to` (px, y down) in the rig's frame: x right as seen from the front, y up, in units of
    /// pixel heights, the plumb line pointing down.
    pub fn vector(&self, from_px: [f64; 2], to_px: [f64; 2]) -> [f64; 2] {
        let x = self.pixel_aspect * (to_px[0] - from_px[0]);
        let y = -(to_px[1] - from_px[1]);
        let (sin, cos) = self.plumb_rad.sin_cos();
        let upright = [x * cos + y * sin, y * cos - x * sin];
        if self.mirrored { [-upright[0], upright[1]] } else { upright }
    }

    /// Angle of a vector of [`Calibration::vector`] from the downward vertical, positive towards +x.
    pub fn angle_rad([x, y]: [f64; 2]) -> f64 {
        x.atan2(-y)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plain() -> Calibration {
        Calibration { pixel_aspect: 1.0, mirrored: false, plumb_rad: 0.0, lens: None }
    }

    fn degrees(c: &Calibration, to: [f64; 2]) -> f64 {
        Calibration::angle_rad(c.vector([100.0, 100.0], to)).to_degrees()
    }

    #[test]
    fn down_is_zero_right_is_positive() {
        let c = plain();
        assert!(degrees(&c, [100.0, 200.0]).abs() < 1e-12);
        assert!((degrees(&c, [200.0, 100.0]) - 90.0).abs() < 1e-12);
        assert!((degrees(&c, [0.0, 100.0]) + 90.0).abs() < 1e-12);
    }

    #[test]
    fn a_mirror_changes_the_sign_and_a_plumb_line_the_zero() {
        let mirrored = Calibration { mirrored: true, ..plain() };
        assert!((degrees(&mirrored, [200.0, 200.0]) + 45.0).abs() < 1e-12);
        let rig = Rig { plumb_px: Some([[0.0, 0.0], [10.0, 100.0]]), ..Rig::default() };
        let plumbed = Calibration::new(&rig, 1.0, Path::new(".")).unwrap();
        assert!(degrees(&plumbed, [110.0, 200.0]).abs() < 1e-12);
        assert!(degrees(&plumbed, [200.0, 100.0]) < 90.0);
    }

    #[test]
    fn wide_pixels_widen_the_angle() {
        let wide = Calibration { pixel_aspect: 2.0, ..plain() };
        assert!((degrees(&wide, [150.0, 200.0]) - 45.0).abs() < 1e-12);
    }
}
