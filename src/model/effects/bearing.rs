//! The load of a bearing: the force between a link and what it hangs on.
//!
//! It bears the weight of the links below and what accelerates them. With the directions across a link and back along it, uₗ = (cos θₗ, sin θₗ) and
//! wₗ = (−sin θₗ, cos θₗ), y up, the force at the upper end of link i is
//!
//! ```text
//! R = Σₗ kₗ (θ̈ₗ uₗ + θ̇ₗ² wₗ) + M (ẍₚ, g)      kₗ = hₗ for l ≥ i,  M Lₗ for l < i;   M = Σ_{l≥i} mₗ
//! N = |R|
//! ```
//!
//! What the air, a force from the side and a support of a stated law do to it is left out: a small part of the weight.

use nalgebra::Vector2;

use crate::model::{Chain, Motion, Parameter};

/// The load of the bearing at the upper end of a link, at one instant.
#[derive(Debug, Clone, Copy)]
pub struct BearingLoad<'a> {
    chain: &'a Chain,
    motion: &'a Motion,
    link: usize,
    /// N.
    pub load_n: f64,
    /// The direction of R.
    along: Vector2<f64>,
}

impl<'a> BearingLoad<'a> {
    /// Of a link of a moving chain.
    pub fn of(chain: &'a Chain, motion: &'a Motion, link: usize) -> Self {
        let field = Vector2::new(motion.pivot_m_s2, motion.gravity_m_s2) * chain.mass_from_kg(link);
        let swing = (0..chain.count()).map(|l| turning(motion, l) * chain.borne_moment_kg_m(link, l));
        let force_n = swing.fold(field, |sum, own| sum + own);
        let load_n = force_n.norm();
        Self { chain, motion, link, load_n, along: force_n / load_n.max(f64::MIN_POSITIVE) }
    }

    /// ∂N/∂θ, ∂N/∂θ̇, ∂N/∂θ̈ of a link.
    pub fn slopes(&self, l: usize) -> [f64; 3] {
        let (rate, acceleration) = (self.motion.rate[l], self.motion.acceleration[l]);
        let moment_kg_m = self.chain.borne_moment_kg_m(self.link, l);
        let (across, back) = directions(self.motion, l).map(|d| moment_kg_m * self.along.dot(&d)).into();
        [acceleration * back - rate * rate * across, 2.0 * rate * back, across]
    }

    /// ∂N/∂ẍₚ (kg).
    pub fn with_pivot_kg(&self) -> f64 {
        self.chain.mass_from_kg(self.link) * self.along.x
    }

    /// ∂N/∂(a parameter of a link).
    pub fn with_parameter(&self, parameter: Parameter) -> f64 {
        let of_link = |l: usize| {
            let moment_kg = self.chain.borne_moment_slope_kg(self.link, l, parameter);
            moment_kg * self.along.dot(&turning(self.motion, l))
        };
        (0..self.chain.count()).map(of_link).sum()
    }
}

/// u and w of a link.
fn directions(motion: &Motion, l: usize) -> [Vector2<f64>; 2] {
    let (sin, cos) = (motion.sin[l], motion.cos[l]);
    [Vector2::new(cos, sin), Vector2::new(-sin, cos)]
}

/// θ̈ u + θ̇² w of a link.
fn turning(motion: &Motion, l: usize) -> Vector2<f64> {
    let [across, back] = directions(motion, l);
    across * motion.acceleration[l] + back * motion.rate[l].powi(2)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::experiment::Link;

    fn two_links() -> Chain {
        let link = |length_m, mass_kg, com_m| Link { length_m, mass_kg, com_m, inertia_kg_m2: 1e-3 };
        Chain::new(vec![link(0.3, 0.2, 0.1), link(0.4, 0.1, 0.25)]).unwrap()
    }

    fn at(theta_rad: &[f64]) -> Motion {
        let mut motion = Motion::zero(2, 0);
        motion.place(theta_rad);
        motion.gravity_m_s2 = 9.81;
        motion
    }

    #[test]
    fn a_bearing_at_rest_bears_the_weight_below() {
        let (chain, motion) = (two_links(), at(&[0.0, 0.0]));
        assert!((BearingLoad::of(&chain, &motion, 0).load_n - 0.3 * 9.81).abs() < 1e-12);
        assert!((BearingLoad::of(&chain, &motion, 1).load_n - 0.1 * 9.81).abs() < 1e-12);
    }

    #[test]
    fn a_chain_that_turns_as_one_pulls_outwards_and_one_that_falls_freely_not_at_all() {
        let chain = two_links();
        let mut turns = at(&[0.0, 0.0]);
        turns.rate.copy_from_slice(&[5.0, 5.0]);
        let outwards_n = 25.0 * (0.1 * (0.3 + 0.25));
        assert!((BearingLoad::of(&chain, &turns, 1).load_n - 0.1 * 9.81 - outwards_n).abs() < 1e-12);
        let mut falls = at(&[0.7, -0.3]);
        falls.gravity_m_s2 = 0.0;
        assert_eq!(BearingLoad::of(&chain, &falls, 0).load_n, 0.0);
    }
}
