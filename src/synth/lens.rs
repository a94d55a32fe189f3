//! Radial lens distortion.

use crate::experiment::{Lens, Render};

/// Maps the undistorted picture to the one the camera sees.
///
/// ```text
/// r_d = r (1 + k₁ρ² + k₂ρ⁴)     ρ = r / focal length, from the picture's centre
/// ```
///
/// OpenCV's model with p₁ = p₂ = k₃ = 0 and the principal point at the centre.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Distortion {
    lens: Option<Lens>,
    centre_px: [f64; 2],
}

impl Distortion {
    /// The lens of a recording.
    pub fn of(render: &Render) -> Self {
        let centre = |side: u32| (f64::from(side) - 1.0) / 2.0;
        Self {
            lens: render.lens.filter(|l| l.k1 != 0.0 || l.k2 != 0.0),
            centre_px: [centre(render.width_px), centre(render.height_px)],
        }
    }

    /// There is none.
    pub fn is_identity(&self) -> bool {
        self.lens.is_none()
    }

    /// Undistorted → seen.
    pub fn distort(&self, p: [f64; 2]) -> [f64; 2] {
        let Some(lens) = self.lens else { return p };
        let [x, y] = [p[0] - self.centre_px[0], p[1] - self.centre_px[1]];
        let rho2 = (x * x + y * y) / (lens.focal_px * lens.focal_px);
        let gain = 1.0 + lens.k1 * rho2 + lens.k2 * rho2 * rho2;
        [self.centre_px[0] + gain * x, self.centre_px[1] + gain * y]
    }

    /// Seen → undistorted, by Newton's method on the radius.
    pub fn undistort(&self, p: [f64; 2]) -> [f64; 2] {
        let Some(lens) = self.lens else { return p };
        let [x, y] = [p[0] - self.centre_px[0], p[1] - self.centre_px[1]];
        let seen = x.hypot(y) / lens.focal_px;
        if seen == 0.0 {
            return p;
        }
        let mut rho = seen;
        for _ in 0..20 {
            let rho2 = rho * rho;
            let excess = rho * (1.0 + lens.k1 * rho2 + lens.k2 * rho2 * rho2) - seen;
            let slope = 1.0 + 3.0 * lens.k1 * rho2 + 5.0 * lens.k2 * rho2 * rho2;
            let step = excess / slope.max(0.1);
            rho -= step;
            if step.abs() < 1e-14 {
                break;
            }
        }
        [self.centre_px[0] + x * rho / seen, self.centre_px[1] + y * rho / seen]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_inverse_undoes_the_lens_to_the_corner() {
        for (k1, k2) in [(-0.2, 0.03), (0.3, 0.1), (-0.3, 0.0)] {
            let lens = Some(Lens { focal_px: 900.0, k1, k2 });
            let distortion = Distortion::of(&Render { lens, ..Render::default() });
            for p in [[0.0, 0.0], [640.0, 96.0], [639.5, 359.5], [1279.0, 719.0], [700.3, 10.0]] {
                let q = distortion.undistort(distortion.distort(p));
                assert!((p[0] - q[0]).hypot(p[1] - q[1]) < 1e-9, "{p:?} {q:?}");
            }
        }
    }
}
