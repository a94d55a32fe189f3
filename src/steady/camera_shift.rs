//! Where the camera looks in one picture, against another.

use nalgebra::{Matrix3, Vector3};

/// Where the camera looks in one picture, against the reference picture.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct CameraShift {
    /// What lay at p lies at p + shift, at the centre of the picture.
    pub shift_px: [f64; 2],
    /// Turn about the centre.
    pub turn_rad: f64,
    /// Centre of the picture.
    pub centre_px: [f64; 2],
    /// Covariance of shift (px) and turn (rad), from how far the patches disagree.
    pub(super) covariance: Matrix3<f64>,
    /// Patches that agree.
    pub patches: usize,
}

impl CameraShift {
    /// The shift of a point of the reference picture.
    pub(super) fn at(&self, p: [f64; 2]) -> [f64; 2] {
        let [x, y] = [p[0] - self.centre_px[0], p[1] - self.centre_px[1]];
        [self.shift_px[0] - self.turn_rad * y, self.shift_px[1] + self.turn_rad * x]
    }

    /// Where a point of the reference picture lies in this one.
    pub fn apply(&self, p: [f64; 2]) -> [f64; 2] {
        let shift = self.at(p);
        [p[0] + shift[0], p[1] + shift[1]]
    }

    /// Where a point of this picture lies in the reference picture.
    pub fn undo(&self, p: [f64; 2]) -> [f64; 2] {
        let shift = self.at(p);
        [p[0] - shift[0], p[1] - shift[1]]
    }

    /// Length of the shift.
    pub fn size_px(&self) -> f64 {
        self.shift_px[0].hypot(self.shift_px[1])
    }

    /// Standard deviation of the shift of the picture's centre, the mean of both directions.
    pub fn sd_px(&self) -> f64 {
        (0.5 * (self.covariance[(0, 0)] + self.covariance[(1, 1)])).sqrt()
    }

    /// Variances along x and y, and covariance, of the shift of a point (px²).
    pub fn variance_px2(&self, p: [f64; 2]) -> [f64; 3] {
        let [x, y] = [p[0] - self.centre_px[0], p[1] - self.centre_px[1]];
        let (along_x, along_y) = (Vector3::new(1.0, 0.0, -y), Vector3::new(0.0, 1.0, x));
        let of = |a: &Vector3<f64>, b: &Vector3<f64>| (a.transpose() * self.covariance * b)[0];
        [of(&along_x, &along_x), of(&along_y, &along_y), of(&along_x, &along_y)]
    }
}
