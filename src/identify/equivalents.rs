//! Equivalent stiffness and damping (paper Eq. 29, 30), in their true units.

use serde::Serialize;

use super::estimate::Estimate;
use crate::model::chain::Chain;

/// A single oscillator with the measured frequency and damping.
///
/// ```text
/// K_eq = ωₙ² M          C_eq = 2 M ωₙ ξ            N/m, N·s/m: the whole mass on a spring (Eq. 29, 30)
/// K_rot = ωₙ² I         C_rot = 2 I ωₙ ξ           N·m/rad, N·m·s/rad: the straight specimen about its hinge
/// ```
/// The paper prints N·m/rad and N·m·s/rad beside Eq. 29 and 30; their units are N/m and N·s/m. A rotational constant needs the moment
/// of inertia about the hinge, I = Σᵢⱼ aᵢⱼ. Gravity alone makes K_g = g Σᵢ hᵢ of K_rot. None of the four is the joint's spring or damper between the links: that
/// takes the forward model.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Equivalents {
    /// M.
    pub mass_kg: f64,
    /// I.
    pub inertia_kg_m2: f64,
    /// Eq. 29.
    pub k_eq_n_per_m: Estimate,
    /// Eq. 30; absent when the damping is not identifiable.
    pub c_eq_n_s_per_m: Option<Estimate>,
    /// About the hinge.
    pub k_rot_n_m_per_rad: Estimate,
    /// About the hinge.
    pub c_rot_n_m_s_per_rad: Option<Estimate>,
    /// Gravity's part of `k_rot_n_m_per_rad`.
    pub k_gravity_n_m_per_rad: f64,
}

impl Equivalents {
    /// Of the slowest mode.
    pub fn of(chain: &Chain, gravity_m_s2: f64, frequency_hz: Estimate, damping_ratio: Option<Estimate>) -> Self {
        let mass_kg = chain.links().iter().map(|l| l.mass_kg).sum::<f64>();
        let inertia_kg_m2 = chain.inertia_kg_m2().sum();
        let omega = |f: f64| std::f64::consts::TAU * f;
        let stiffness = |inertia: f64| {
            frequency_hz.map(|f| inertia * omega(f).powi(2), 2.0 * inertia * omega(1.0).powi(2) * frequency_hz.value)
        };
        // the frequency is so much better known than the damping that its share of the error does not show
        let damping = |inertia: f64| damping_ratio.map(|xi| xi.times(2.0 * inertia * omega(frequency_hz.value)));
        Self {
            mass_kg,
            inertia_kg_m2,
            k_eq_n_per_m: stiffness(mass_kg),
            c_eq_n_s_per_m: damping(mass_kg),
            k_rot_n_m_per_rad: stiffness(inertia_kg_m2),
            c_rot_n_m_s_per_rad: damping(inertia_kg_m2),
            k_gravity_n_m_per_rad: gravity_m_s2 * (0..chain.count()).map(|i| chain.static_moment_kg_m(i)).sum::<f64>(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::experiment::{Link, Specimen};

    #[test]
    fn table_2_follows_from_eq_29_and_30() {
        // Kapton 1 mil: ωₙ = 8.549 rad/s, M = 0.3606 g (audit A9)
        let chain = Chain::of(&Specimen::default()).unwrap();
        let f = Estimate::new(8.549 / std::f64::consts::TAU, 0.001, 100.0);
        let xi = Estimate::new(0.04, 0.001, 100.0);
        let e = Equivalents::of(&chain, 9.80665, f, Some(xi));
        assert!((e.k_eq_n_per_m.value - 8.549f64.powi(2) * 0.3606e-3).abs() < 1e-9);
        let c_eq = e.c_eq_n_s_per_m.unwrap();
        assert!((c_eq.value - 2.0 * 0.3606e-3 * 8.549 * 0.04).abs() < 1e-12);
        assert!((c_eq.sd / c_eq.value - 0.025).abs() < 1e-9);
        assert!((e.k_eq_n_per_m.sd / e.k_eq_n_per_m.value - 2.0 * 0.001 / f.value).abs() < 1e-9);
    }

    #[test]
    fn gravity_makes_the_whole_stiffness_of_a_free_rod() {
        let rod = Link { length_m: 0.2, mass_kg: 0.05, com_m: 0.1, inertia_kg_m2: 0.05 * 0.04 / 12.0 };
        let chain = Chain::new(vec![rod]).unwrap();
        let f = (3.0f64 * 9.80665 / 0.4).sqrt() / std::f64::consts::TAU;
        let e = Equivalents::of(&chain, 9.80665, Estimate::new(f, 0.0, 10.0), None);
        assert!((e.k_rot_n_m_per_rad.value - e.k_gravity_n_m_per_rad).abs() < 1e-12);
        assert!((e.inertia_kg_m2 - 0.05 * 0.04 / 3.0).abs() < 1e-12);
    }
}
