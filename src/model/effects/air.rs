//! Forces of the air along the strip.
//!
//! At distance s down link i the strip's speed across itself is, with nᵢ = (cos θᵢ, sin θᵢ) and u the velocity of the link's upper end,
//!
//! ```text
//! vₙ(s) = u·nᵢ + s θ̇ᵢ = Σₖ Jₖ θ̇ₖ + ẋₚ cos θᵢ        Jₖ = Lₖ cos(θᵢ−θₖ) for k < i,  Jᵢ = s
//! ```
//!
//! A force per length f(s) across the strip works on θₖ as Qₖ = ∫ f Jₖ ds (virtual work), taken by Gauss–Legendre quadrature on each link.

use nalgebra::{DMatrix, DVector};

use super::Effect;
use crate::model::chain::{Chain, Motion};

/// Five-point Gauss–Legendre nodes on 0..1 and their weights: exact to the ninth power.
const GAUSS: [(f64, f64); 5] = [
    (0.046_910_077_030_668, 0.118_463_442_528_094_54),
    (0.230_765_344_947_158_45, 0.239_314_335_249_683_23),
    (0.5, 0.284_444_444_444_444_44),
    (0.769_234_655_052_841_6, 0.239_314_335_249_683_23),
    (0.953_089_922_969_332, 0.118_463_442_528_094_54),
];

/// `air_linear`: f = −c vₙ.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinearDrag {
    /// c.
    pub drag_n_s_m2: f64,
}

impl Effect for LinearDrag {
    fn add_torque(&self, chain: &Chain, motion: &Motion, torque_n_m: &mut DVector<f64>) {
        add_force_per_length(chain, motion, torque_n_m, |v_m_s| -self.drag_n_s_m2 * v_m_s);
    }
}

/// `air_quadratic`: f = −c |vₙ| vₙ, c = ½ρC_D·width.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct QuadraticDrag {
    /// c.
    pub drag_kg_m2: f64,
}

impl Effect for QuadraticDrag {
    fn add_torque(&self, chain: &Chain, motion: &Motion, torque_n_m: &mut DVector<f64>) {
        add_force_per_length(chain, motion, torque_n_m, |v_m_s| -self.drag_kg_m2 * v_m_s.abs() * v_m_s);
    }
}

/// `added_mass`: kinetic energy ½∫mₐvₙ²ds of the air that moves with the strip.
///
/// Lagrange's equations give, with tᵢ = dnᵢ/dθᵢ, nₖ·tᵢ = −sin(θᵢ−θₖ) and b the part of the upper end's acceleration without θ̈:
///
/// ```text
/// Σⱼ mₐ∫JₖJⱼds θ̈ⱼ = −mₐ∫[Jₖ(b·nᵢ + θ̇ᵢ u·tᵢ) + vₙwₖ]ds      wₖ = θ̇ᵢLₖ nₖ·tᵢ for k < i,  wᵢ = −u·tᵢ
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AddedMass {
    /// mₐ.
    pub mass_kg_m: f64,
}

impl Effect for AddedMass {
    fn add_torque(&self, chain: &Chain, motion: &Motion, torque_n_m: &mut DVector<f64>) {
        for i in 0..chain.count() {
            let link = LinkAir::new(chain, motion, i);
            let bias_m_s2 = link.bias_across_m_s2 + motion.omega_rad_s[i] * link.end_along_m_s;
            for (s_m, weight_m) in link.stations() {
                let v_m_s = link.speed_m_s(motion, s_m);
                for k in 0..=i {
                    let turn = if k < i {
                        motion.omega_rad_s[i] * -chain.links()[k].length_m * motion.sin_difference(i, k)
                    } else {
                        -link.end_along_m_s
                    };
                    let arm_m = link.arm_m(chain, motion, k, s_m);
                    torque_n_m[k] -= self.mass_kg_m * weight_m * (arm_m * bias_m_s2 + v_m_s * turn);
                }
            }
        }
    }

    fn add_inertia(&self, chain: &Chain, motion: &Motion, inertia_kg_m2: &mut DMatrix<f64>) {
        for i in 0..chain.count() {
            let link = LinkAir::new(chain, motion, i);
            for (s_m, weight_m) in link.stations() {
                for k in 0..=i {
                    for j in 0..=i {
                        let arms_m2 = link.arm_m(chain, motion, k, s_m) * link.arm_m(chain, motion, j, s_m);
                        inertia_kg_m2[(k, j)] += self.mass_kg_m * weight_m * arms_m2;
                    }
                }
            }
        }
    }

    fn energy_j(&self, chain: &Chain, motion: &Motion) -> f64 {
        let of_link = |i: usize| -> f64 {
            let link = LinkAir::new(chain, motion, i);
            link.stations().map(|(s_m, weight_m)| weight_m * link.speed_m_s(motion, s_m).powi(2)).sum()
        };
        0.5 * self.mass_kg_m * (0..chain.count()).map(of_link).sum::<f64>()
    }
}

/// What the air sees of one link.
struct LinkAir {
    i: usize,
    length_m: f64,
    /// u·nᵢ.
    end_across_m_s: f64,
    /// u·tᵢ.
    end_along_m_s: f64,
    /// b·nᵢ.
    bias_across_m_s2: f64,
}

impl LinkAir {
    fn new(chain: &Chain, motion: &Motion, i: usize) -> Self {
        let mut link = Self {
            i,
            length_m: chain.links()[i].length_m,
            end_across_m_s: motion.pivot_m_s * motion.cos[i],
            end_along_m_s: -motion.pivot_m_s * motion.sin[i],
            bias_across_m_s2: motion.pivot_m_s2 * motion.cos[i],
        };
        for k in 0..i {
            let (length_m, omega_rad_s) = (chain.links()[k].length_m, motion.omega_rad_s[k]);
            link.end_across_m_s += length_m * omega_rad_s * motion.cos_difference(i, k);
            link.end_along_m_s -= length_m * omega_rad_s * motion.sin_difference(i, k);
            link.bias_across_m_s2 += length_m * omega_rad_s.powi(2) * motion.sin_difference(i, k);
        }
        link
    }

    /// Quadrature stations: (s, weight), both in metres.
    fn stations(&self) -> impl Iterator<Item = (f64, f64)> + use<> {
        let length_m = self.length_m;
        GAUSS.iter().map(move |(node, weight)| (node * length_m, weight * length_m))
    }

    /// vₙ(s).
    fn speed_m_s(&self, motion: &Motion, s_m: f64) -> f64 {
        self.end_across_m_s + s_m * motion.omega_rad_s[self.i]
    }

    /// Jₖ(s).
    fn arm_m(&self, chain: &Chain, motion: &Motion, k: usize, s_m: f64) -> f64 {
        if k < self.i { chain.links()[k].length_m * motion.cos_difference(self.i, k) } else { s_m }
    }
}

fn add_force_per_length(chain: &Chain, motion: &Motion, torque_n_m: &mut DVector<f64>, law: impl Fn(f64) -> f64) {
    for i in 0..chain.count() {
        let link = LinkAir::new(chain, motion, i);
        for (s_m, weight_m) in link.stations() {
            let force_n = weight_m * law(link.speed_m_s(motion, s_m));
            for k in 0..=i {
                torque_n_m[k] += force_n * link.arm_m(chain, motion, k, s_m);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::experiment::Specimen;

    fn one_rod() -> Chain {
        Chain::of(&Specimen { link_lengths_m: vec![0.2], ..Specimen::default() }).unwrap()
    }

    #[test]
    fn drag_on_one_rod_is_the_hand_integral() {
        let (chain, motion) = (one_rod(), Motion::new(0.0, &[0.3], &[2.0]));
        let mut torque = DVector::zeros(1);
        LinearDrag { drag_n_s_m2: 0.7 }.add_torque(&chain, &motion, &mut torque);
        assert!((torque[0] + 0.7 * 2.0 * 0.2f64.powi(3) / 3.0).abs() < 1e-15);
        torque.fill(0.0);
        QuadraticDrag { drag_kg_m2: 0.7 }.add_torque(&chain, &motion, &mut torque);
        assert!((torque[0] + 0.7 * 4.0 * 0.2f64.powi(4) / 4.0).abs() < 1e-15);
    }

    #[test]
    fn added_mass_on_one_rod_is_a_uniform_rod_of_that_mass() {
        let (chain, motion) = (one_rod(), Motion::new(0.0, &[0.3], &[2.0]));
        let (mut inertia, mut torque) = (DMatrix::zeros(1, 1), DVector::zeros(1));
        let air = AddedMass { mass_kg_m: 0.6 };
        air.add_inertia(&chain, &motion, &mut inertia);
        air.add_torque(&chain, &motion, &mut torque);
        assert!((inertia[(0, 0)] - 0.6 * 0.2f64.powi(3) / 3.0).abs() < 1e-15);
        assert_eq!(torque[0], 0.0);
    }

    #[test]
    fn the_power_of_the_drag_is_its_work_along_the_strip() {
        let chain = Chain::of(&Specimen::default()).unwrap();
        let motion = Motion::new(0.0, &[0.3, -0.4], &[2.0, -5.0]);
        let mut torque = DVector::zeros(2);
        QuadraticDrag { drag_kg_m2: 0.01 }.add_torque(&chain, &motion, &mut torque);
        let power: f64 = torque[0] * 2.0 + torque[1] * -5.0;
        let station = |i: usize, s: f64| {
            let end = if i == 0 { 0.0 } else { 0.1 * 2.0 * 0.7f64.cos() };
            (end + s * motion.omega_rad_s[i]).abs().powi(3)
        };
        let steps = 20_000;
        let direct: f64 = (0..2)
            .flat_map(|i| (0..steps).map(move |k| (i, (k as f64 + 0.5) * 0.1 / steps as f64)))
            .map(|(i, s)| -0.01 * station(i, s) * 0.1 / steps as f64)
            .sum();
        // The lower link's speed changes sign along it, where |v|v is not a polynomial.
        assert!((power - direct).abs() < 5e-3 * direct.abs(), "{power} {direct}");
    }
}
