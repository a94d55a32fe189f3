//! Torques at the hinge: they act on θ₁ alone.

use nalgebra::DVector;

use super::Effect;
use crate::model::chain::{Chain, Motion};

/// `hinge_viscous`: Q₁ = −c θ̇₁.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Viscous {
    /// c.
    pub damping_n_m_s_per_rad: f64,
}

impl Effect for Viscous {
    fn add_torque(&self, _: &Chain, motion: &Motion, torque_n_m: &mut DVector<f64>) {
        torque_n_m[0] -= self.damping_n_m_s_per_rad * motion.omega_rad_s[0];
    }
}

/// `hinge_coulomb`: dry friction, Q₁ = −τ sgn θ̇₁, smoothed to −τ tanh(θ̇₁/ω₀).
///
/// Below ω₀ it is the viscous damper τ/ω₀: a hinge that dry friction would hold creeps towards its rest slower than ω₀.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Coulomb {
    /// τ.
    pub torque_n_m: f64,
}

impl Coulomb {
    /// ω₀: a swing of 1 mrad at 1.3 Hz is eight times faster.
    pub const SMOOTHING_RAD_S: f64 = 1e-3;
}

impl Effect for Coulomb {
    fn add_torque(&self, _: &Chain, motion: &Motion, torque_n_m: &mut DVector<f64>) {
        torque_n_m[0] -= self.torque_n_m * (motion.omega_rad_s[0] / Self::SMOOTHING_RAD_S).tanh();
    }
}

/// `hinge_stiffness`: Q₁ = −k θ₁, energy ½ k θ₁².
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stiffness {
    /// k.
    pub stiffness_n_m_per_rad: f64,
}

impl Effect for Stiffness {
    fn add_torque(&self, _: &Chain, motion: &Motion, torque_n_m: &mut DVector<f64>) {
        torque_n_m[0] -= self.stiffness_n_m_per_rad * motion.theta_rad[0];
    }

    fn energy_j(&self, _: &Chain, motion: &Motion) -> f64 {
        0.5 * self.stiffness_n_m_per_rad * motion.theta_rad[0].powi(2)
    }
}
