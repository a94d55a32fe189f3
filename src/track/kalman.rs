//! The constant-velocity Kalman filter of one mark (paper Eq. 35–39).
//!
//! State X = (x, y, ẋ, ẏ) in px and px/s. Acceleration is white noise of spectral density q (px²/s³), so that over
//! a step Δt, always the true one between two time stamps,
//!
//! ```text
//! Φ = | I  Δt·I |     Q = q | Δt³/3·I  Δt²/2·I |     H = | I  0 |
//!     | 0     I |           | Δt²/2·I  Δt·I    |
//! ```
//! R (px²) is the centroid's own covariance.

use nalgebra::{Matrix2, Matrix2x4, Matrix4, Vector2, Vector4};

/// What the filter believes of one mark at one instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Belief {
    /// (x, y, ẋ, ẏ): px, px/s.
    pub state: Vector4<f64>,
    /// Covariance of the state.
    pub covariance: Matrix4<f64>,
}

/// A position with its covariance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measurement {
    /// px.
    pub position_px: Vector2<f64>,
    /// R, px².
    pub covariance_px2: Matrix2<f64>,
}

/// The process noise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motion {
    /// Spectral density q of the acceleration, px²/s³, positive.
    pub acceleration_psd_px2_s3: f64,
}

fn observation() -> Matrix2x4<f64> {
    Matrix2x4::new(1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0)
}

impl Motion {
    /// Φ over `dt_s`.
    pub fn transition(dt_s: f64) -> Matrix4<f64> {
        let mut phi = Matrix4::identity();
        phi[(0, 2)] = dt_s;
        phi[(1, 3)] = dt_s;
        phi
    }

    /// Q over `dt_s`.
    pub fn noise(&self, dt_s: f64) -> Matrix4<f64> {
        let q = self.acceleration_psd_px2_s3;
        let (a, b, c) = (q * dt_s.powi(3) / 3.0, q * dt_s.powi(2) / 2.0, q * dt_s);
        Matrix4::new(a, 0.0, b, 0.0, 0.0, a, 0.0, b, b, 0.0, c, 0.0, 0.0, b, 0.0, c)
    }
}

impl Belief {
    /// At rest at a measurement, the velocity unknown to `speed_sd_px_s`.
    pub fn from_measurement(z: &Measurement, speed_sd_px_s: f64) -> Self {
        let mut covariance = Matrix4::zeros();
        covariance.fixed_view_mut::<2, 2>(0, 0).copy_from(&z.covariance_px2);
        covariance[(2, 2)] = speed_sd_px_s.powi(2);
        covariance[(3, 3)] = speed_sd_px_s.powi(2);
        Self { state: Vector4::new(z.position_px.x, z.position_px.y, 0.0, 0.0), covariance }
    }

    /// Position.
    pub fn position_px(&self) -> Vector2<f64> {
        self.state.fixed_rows::<2>(0).into_owned()
    }

    /// Covariance of the position.
    pub fn position_covariance_px2(&self) -> Matrix2<f64> {
        self.covariance.fixed_view::<2, 2>(0, 0).into_owned()
    }

    /// Prediction over `dt_s` ≥ 0.
    pub fn predict(&self, motion: &Motion, dt_s: f64) -> Self {
        let phi = Motion::transition(dt_s);
        // Eq. 35: X̄ᵢ₊₁ = Φ X̂ᵢ
        let state = phi * self.state;
        // Eq. 36: P̄ᵢ₊₁ = Φ P̂ᵢ Φᵀ + Q
        let covariance = phi * self.covariance * phi.transpose() + motion.noise(dt_s);
        Self { state, covariance }
    }

    /// Innovation and its covariance S = H P̄ Hᵀ + R.
    pub fn innovation(&self, z: &Measurement) -> (Vector2<f64>, Matrix2<f64>) {
        let h = observation();
        (z.position_px - h * self.state, h * self.covariance * h.transpose() + z.covariance_px2)
    }

    /// Correction by a measurement; `None` where S is not positive definite.
    pub fn update(&self, z: &Measurement) -> Option<Self> {
        let h = observation();
        let (innovation, s) = self.innovation(z);
        // Eq. 37: K = P̄ Hᵀ (H P̄ Hᵀ + R)⁻¹
        let gain = self.covariance * h.transpose() * s.try_inverse()?;
        // Eq. 38: X̂ = X̄ + K (z − H X̄)
        let state = self.state + gain * innovation;
        // Eq. 39: P̂ = (I − K H) P̄, in Joseph's form (I − KH) P̄ (I − KH)ᵀ + K R Kᵀ, which stays symmetric and positive
        let keep = Matrix4::identity() - gain * h;
        let covariance = keep * self.covariance * keep.transpose() + gain * z.covariance_px2 * gain.transpose();
        Some(Self { state, covariance })
    }

    /// Squared Mahalanobis distance of a measurement, and ln det S.
    pub fn distance2(&self, z: &Measurement) -> Option<(f64, f64)> {
        let (innovation, s) = self.innovation(z);
        let inverse = s.try_inverse()?;
        Some(((innovation.transpose() * inverse * innovation)[(0, 0)], s.determinant().max(1e-300).ln()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(x: f64, y: f64, sd: f64) -> Measurement {
        Measurement { position_px: Vector2::new(x, y), covariance_px2: Matrix2::identity() * sd * sd }
    }

    #[test]
    fn a_uniform_motion_over_uneven_steps_is_followed_without_lag() {
        let motion = Motion { acceleration_psd_px2_s3: 1e-6 };
        let mut belief = Belief::from_measurement(&at(0.0, 0.0, 0.1), 1e3);
        let mut t = 0.0;
        for dt in [0.02, 0.05, 0.033, 0.3, 0.01, 0.04, 0.033, 0.2] {
            t += dt;
            belief = belief.predict(&motion, dt).update(&at(30.0 * t, -10.0 * t, 0.1)).unwrap();
        }
        assert!((belief.state[2] - 30.0).abs() < 1e-3 && (belief.state[3] + 10.0).abs() < 1e-3, "{belief:?}");
    }

    #[test]
    fn two_steps_grow_the_noise_as_one() {
        let motion = Motion { acceleration_psd_px2_s3: 5.0 };
        let start = Belief::from_measurement(&at(1.0, 2.0, 0.3), 7.0);
        let once = start.predict(&motion, 0.5);
        let twice = start.predict(&motion, 0.2).predict(&motion, 0.3);
        assert!((once.covariance - twice.covariance).norm() < 1e-12 && (once.state - twice.state).norm() < 1e-12);
    }

    #[test]
    fn the_covariance_stays_symmetric_and_positive() {
        let motion = Motion { acceleration_psd_px2_s3: 1e7 };
        let mut belief = Belief::from_measurement(&at(0.0, 0.0, 0.01), 1e4);
        for i in 0..2000 {
            belief = belief.predict(&motion, 1.0 / 30.0).update(&at((i as f64).sin(), 0.0, 0.01)).unwrap();
        }
        let skew = (belief.covariance - belief.covariance.transpose()).abs().max();
        assert!(skew < 1e-12 * belief.covariance.norm(), "{skew}");
        assert!(belief.covariance.cholesky().is_some());
    }
}
