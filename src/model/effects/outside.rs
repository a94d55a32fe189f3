//! What the surroundings do to the whole chain.

use nalgebra::DVector;

use super::Effect;
use crate::model::chain::{Chain, Motion};

/// `side_force`: a steady sideways acceleration a, Qᵢ = a hᵢ cos θᵢ, energy −a Σ hᵢ sin θᵢ.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SideForce {
    /// a, positive towards +x.
    pub acceleration_m_s2: f64,
}

impl Effect for SideForce {
    fn add_torque(&self, chain: &Chain, motion: &Motion, torque_n_m: &mut DVector<f64>) {
        for i in 0..chain.count() {
            torque_n_m[i] += self.acceleration_m_s2 * chain.static_moment_kg_m(i) * motion.cos[i];
        }
    }

    fn energy_j(&self, chain: &Chain, motion: &Motion) -> f64 {
        -(0..chain.count()).map(|i| self.acceleration_m_s2 * chain.static_moment_kg_m(i) * motion.sin[i]).sum::<f64>()
    }
}

/// `support_motion`: in the pivot's frame its acceleration is a side force, Qᵢ = −ẍₚ hᵢ cos θᵢ. The motion itself is in [`Motion`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SupportMotion;

impl Effect for SupportMotion {
    fn add_torque(&self, chain: &Chain, motion: &Motion, torque_n_m: &mut DVector<f64>) {
        for i in 0..chain.count() {
            torque_n_m[i] -= motion.pivot_m_s2 * chain.static_moment_kg_m(i) * motion.cos[i];
        }
    }
}
