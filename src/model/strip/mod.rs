//! The strip as a continuum: a geometrically exact planar beam that does not stretch, by finite elements.
//!
//! With s along the strip from its support, θ(s) its angle from the downward vertical, κ = θ′ its curvature, κ₀ that at rest and μ its mass per
//! length, a point of it lies at
//!
//! ```text
//! x(s) = ∫₀ˢ sin θ ds        d(s) = ∫₀ˢ cos θ ds        (d down)
//! ```
//!
//! and the strip's energy and the virtual work of forces f per length are
//!
//! ```text
//! U = ½∫ EI (κ − κ₀)² ds + ½ k (θ(0) − θₛ)²        T = ½∫ μ (ẋ² + ḋ²) ds        δW = ∫ (f + (0, μg))·δ(x, d) ds
//! ```
//!
//! Shear, stretch and rotary inertia are left out: a film is far too thin for them. Angles may be large.
//!
//! In each element the curvature is linear, so that θ is a quadratic and, for small angles, x a cubic: the space of Hermite's beam element. The freedoms are
//! θ(0) and two of the curvature an element. A rigid strip is then no limit in which digits are lost: bending and turning are freedoms apart. Integrals
//! are Gauss's with four points an element; displacements are integrated at the same points, so that forces and masses follow from one discrete
//! energy. Angles converge with the third power of an element's length, displacements and frequencies with the fourth.
//!
//! | file | holds |
//! |---|---|
//! | [`mesh`] | elements, points, and what is integrated along them |
//! | [`load`] | forces per length, and curls that come with them |
//! | [`rest`] | the loaded strip at rest |
//! | [`vibration`] | small vibrations about it |
//! | [`motion`] | the motion in time, in its lowest modes |

pub mod load;
pub mod mesh;
pub mod motion;
pub mod rest;
#[cfg(test)]
mod tests;
pub mod vibration;

pub use load::{Load, LocalForce};
pub use mesh::Mesh;
pub use rest::Rest;

use crate::experiment::{self, Experiment, Specimen};

/// How the strip is held at its upper end.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Support {
    /// Held, and turned back by a spring k (N·m/rad), which may be zero.
    Hinged {
        /// k.
        stiffness_n_m_per_rad: f64,
    },
    /// Held, and its direction kept.
    Clamped,
}

impl Support {
    /// Free to turn.
    pub const HINGED: Self = Self::Hinged { stiffness_n_m_per_rad: 0.0 };
}

/// A uniform strip held at its upper end.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Strip {
    /// L.
    pub length_m: f64,
    /// μ.
    pub mass_per_length_kg_m: f64,
    /// EI, zero for a limp strip.
    pub bending_stiffness_n_m2: f64,
    /// g.
    pub gravity_m_s2: f64,
    /// κ₀.
    pub curl_per_m: f64,
    /// At s = 0.
    pub support: Support,
    /// θₛ, direction of the clamp, or of the hinge's spring at rest.
    pub support_angle_rad: f64,
}

impl Strip {
    /// A straight strip at a hinge without spring.
    pub fn hung(length_m: f64, mass_per_length_kg_m: f64, bending_stiffness_n_m2: f64, gravity_m_s2: f64) -> Self {
        Self {
            length_m,
            mass_per_length_kg_m,
            bending_stiffness_n_m2,
            gravity_m_s2,
            curl_per_m: 0.0,
            support: Support::HINGED,
            support_angle_rad: 0.0,
        }
    }

    /// The strip of a specimen, straight and at a hinge; its bending stiffness is EI = E w t³/12. None where modulus or thickness are not given.
    pub fn of(specimen: &Specimen, gravity_m_s2: f64) -> Option<Self> {
        let bending_stiffness_n_m2 = specimen.bending_stiffness_n_m2()?;
        let mass_per_length_kg_m = specimen.mass_kg / specimen.length_m;
        Some(Self::hung(specimen.length_m, mass_per_length_kg_m, bending_stiffness_n_m2, gravity_m_s2))
    }

    /// The same with the curl and the support that an experiment states.
    pub fn of_experiment(experiment: &Experiment) -> Option<Self> {
        let rig = &experiment.rig;
        let support = match rig.support {
            experiment::Support::Hinged => Support::Hinged { stiffness_n_m_per_rad: rig.support_stiffness_n_m_per_rad },
            experiment::Support::Clamped => Support::Clamped,
        };
        let strip = Self::of(&experiment.specimen, rig.gravity_m_s2)?;
        Some(Self { curl_per_m: experiment.specimen.curl_per_m, support, ..strip })
    }

    /// The same strip, clamped.
    pub fn clamped(self) -> Self {
        Self { support: Support::Clamped, ..self }
    }

    /// Over this length the bending at a clamp dies away (m): √(EI/T) with the tension T at the support; none without gravity.
    pub fn boundary_layer_m(&self) -> f64 {
        let tension_n = self.mass_per_length_kg_m * self.gravity_m_s2 * self.length_m;
        (self.bending_stiffness_n_m2 / tension_n).sqrt()
    }

    /// Over this length the bending at the free end dies away (m): (EI/μg)^⅓; none without gravity.
    pub fn free_end_layer_m(&self) -> f64 {
        (self.bending_stiffness_n_m2 / (self.mass_per_length_kg_m * self.gravity_m_s2)).cbrt()
    }
}
