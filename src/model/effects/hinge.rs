//! Torques at the hinge: they act on θ₁ alone.

use super::Law;
use crate::model::{Chain, Motion, Parameter, Partials};

/// `hinge_viscous`: Q₁ = −c θ̇₁.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Viscous;

impl Law for Viscous {
    const PARAMETER: Parameter = Parameter::HingeViscous;

    fn add_torque(&self, _: &Chain, motion: &Motion, c: f64, q: &mut [f64]) {
        q[0] -= c * motion.rate[0];
    }

    fn add_partials(&self, _: &Chain, _: &Motion, c: f64, partials: &mut Partials) {
        partials.rate[(0, 0)] -= c;
    }
}

/// `hinge_coulomb`: dry friction, Q₁ = −τ sgn θ̇₁ while it slides; it holds as long as it takes no more than τ to hold.
///
/// The sign is not smoothed: the integrator steps from reversal to reversal, and there asks whether the hinge holds
/// ([`Hinge`](crate::model::Hinge)).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Coulomb;

impl Law for Coulomb {
    const PARAMETER: Parameter = Parameter::HingeCoulomb;

    fn add_torque(&self, _: &Chain, motion: &Motion, tau: f64, q: &mut [f64]) {
        q[0] -= tau * motion.hinge.sign();
    }

    fn add_partials(&self, _: &Chain, _: &Motion, _: f64, _: &mut Partials) {}

    fn friction_n_m(&self, tau: f64) -> Option<f64> {
        Some(tau)
    }
}

/// `hinge_stiffness`: Q₁ = −k θ₁, energy ½ k θ₁².
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stiffness;

impl Law for Stiffness {
    const PARAMETER: Parameter = Parameter::HingeStiffness;

    fn add_torque(&self, _: &Chain, motion: &Motion, k: f64, q: &mut [f64]) {
        q[0] -= k * motion.theta_rad[0];
    }

    fn add_partials(&self, _: &Chain, _: &Motion, k: f64, partials: &mut Partials) {
        partials.theta[(0, 0)] -= k;
    }

    fn energy_j(&self, _: &Chain, motion: &Motion, k: f64) -> f64 {
        0.5 * k * motion.theta_rad[0].powi(2)
    }
}
