//! Torques between consecutive links. With Δ = θᵢ₊₁ − θᵢ, a torque T(Δ, Δ̇) turns the upper link by +T and the lower by −T.

use nalgebra::DVector;

use super::Effect;
use crate::model::chain::{Chain, Motion};

/// The joint of the base model: T = K(Δ − κ) + CΔ̇, κ being `rest_curl`; energy ½K(Δ − κ)².
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpringDamper {
    /// K.
    pub stiffness_n_m_per_rad: f64,
    /// C.
    pub damping_n_m_s_per_rad: f64,
    /// κ.
    pub rest_rad: f64,
}

impl Effect for SpringDamper {
    fn add_torque(&self, _: &Chain, motion: &Motion, torque_n_m: &mut DVector<f64>) {
        add_joint_torque(motion, torque_n_m, |angle_rad, rate_rad_s| {
            self.stiffness_n_m_per_rad * (angle_rad - self.rest_rad) + self.damping_n_m_s_per_rad * rate_rad_s
        });
    }

    fn energy_j(&self, _: &Chain, motion: &Motion) -> f64 {
        joint_angles(motion).map(|a| 0.5 * self.stiffness_n_m_per_rad * (a - self.rest_rad).powi(2)).sum()
    }
}

/// `joint_cubic_stiffness`: T = k₃(Δ − κ)³, energy ¼k₃(Δ − κ)⁴.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CubicSpring {
    /// k₃.
    pub stiffness_n_m_per_rad3: f64,
    /// κ.
    pub rest_rad: f64,
}

impl Effect for CubicSpring {
    fn add_torque(&self, _: &Chain, motion: &Motion, torque_n_m: &mut DVector<f64>) {
        add_joint_torque(motion, torque_n_m, |angle_rad, _| {
            self.stiffness_n_m_per_rad3 * (angle_rad - self.rest_rad).powi(3)
        });
    }

    fn energy_j(&self, _: &Chain, motion: &Motion) -> f64 {
        joint_angles(motion).map(|a| 0.25 * self.stiffness_n_m_per_rad3 * (a - self.rest_rad).powi(4)).sum()
    }
}

/// Δ of every joint, top to bottom.
fn joint_angles(motion: &Motion) -> impl Iterator<Item = f64> + '_ {
    motion.theta_rad.windows(2).map(|pair| pair[1] - pair[0])
}

fn add_joint_torque(motion: &Motion, torque_n_m: &mut DVector<f64>, law: impl Fn(f64, f64) -> f64) {
    for upper in 0..motion.theta_rad.len().saturating_sub(1) {
        let angle_rad = motion.theta_rad[upper + 1] - motion.theta_rad[upper];
        let rate_rad_s = motion.omega_rad_s[upper + 1] - motion.omega_rad_s[upper];
        let joint_n_m = law(angle_rad, rate_rad_s);
        torque_n_m[upper] += joint_n_m;
        torque_n_m[upper + 1] -= joint_n_m;
    }
}
