//! The frequency floor: gravity alone makes a hung body swing at least so fast.

use nalgebra::{Complex, DMatrix};
use serde::Serialize;

use super::estimate::Estimate;
use crate::experiment::Specimen;
use crate::model::chain::Chain;
use crate::model::modes::{limp_frequency_hz, rigid_frequency_hz};

/// How near the frequency of a weight on a thread one must lie for that to hang there: a length to the weight's middle that is stated to some per cent, a swing of 30°.
const LIKE_A_WEIGHT: f64 = 0.03;
/// How far below the floor a frequency must lie, relative to it, before anything is called wrong: a length stated to 1 %.
const TOLERANCE: f64 = 0.005;

/// The lowest frequency that a specimen can have, and whether the measured one is below it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Floor {
    /// What swings at it.
    pub body: &'static str,
    /// The floor at small amplitude.
    pub floor_hz: f64,
    /// The rigid strip of the same length, for a strip.
    pub rigid_hz: Option<f64>,
    /// Whether the whole 95 % interval lies below the floor by more than 0.5 %, which a length stated to 1 % explains.
    pub below: bool,
    /// What would mend it.
    pub remedy: Option<Remedy>,
    /// In words.
    pub statement: String,
}

/// Factors any one of which lifts the measured frequency to the floor.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Remedy {
    /// True seconds a stated second, at most.
    pub time: f64,
    /// True length over the stated one, at least.
    pub length: f64,
    /// True gravity over the stated one, at most.
    pub gravity: f64,
}

impl Floor {
    /// The floor of a specimen, against its lowest frequency at small amplitude.
    ///
    /// ```text
    /// limp strip (hanging chain)   f = (j₀,₁/4π) √(g/L)         any stiffness only raises it
    /// rigid strip                  f = √(3g/2L) / 2π
    /// given links                  lowest root of det(diag(g hᵢ) − ω² a) = 0, the joints free
    /// ```
    pub fn of(specimen: &Specimen, chain: &Chain, gravity_m_s2: f64, frequency_hz: Estimate) -> Self {
        let is_strip = specimen.links.is_empty();
        // a strip may go on below its last mark
        let length_m = if is_strip { specimen.length_m } else { chain.links().iter().map(|l| l.length_m).sum() };
        let (body, floor_hz, rigid_hz) = if is_strip {
            let rigid_hz = rigid_frequency_hz(length_m, gravity_m_s2);
            ("the limp strip", limp_frequency_hz(0, length_m, gravity_m_s2), Some(rigid_hz))
        } else {
            ("the given links with free joints", lowest_chain_hz(chain, gravity_m_s2), None)
        };
        let below = frequency_hz.high < floor_hz * (1.0 - TOLERANCE);
        let ratio = frequency_hz.value / floor_hz;
        let remedy = below.then(|| Remedy { time: ratio, length: ratio.powi(-2), gravity: ratio.powi(2) });
        let weight_hz = (gravity_m_s2 / length_m).sqrt() / std::f64::consts::TAU;
        let is_weight = is_strip && (frequency_hz.value / weight_hz - 1.0).abs() < LIKE_A_WEIGHT;
        let statement = match remedy {
            Some(_) if is_weight => format!(
                "{:.4} Hz is below the floor of {floor_hz:.4} Hz ({body}), but a weight on a thread of {length_m} m swings at {weight_hz:.4} Hz: if that is what hangs there, describe it with [[specimen.links]], its com_m from the hinge",
                frequency_hz.value
            ),
            Some(r) => {
                let other = if is_strip {
                    "it is no strip of even mass (weights at the joints, a rigid body that goes on below its last mark: describe these with [[specimen.links]]), or it is so light that the air it moves weighs as much (fit --free added_mass)"
                } else {
                    "a centre of mass or an inertia is"
                };
                format!(
                    "{:.4} Hz is below the floor of {floor_hz:.4} Hz ({body}): time base, length or gravity is wrong, or {other}; mended by time × {:.3}, or length × {:.3}, or gravity × {:.3}",
                    frequency_hz.value, r.time, r.length, r.gravity
                )
            }
            None if frequency_hz.high < floor_hz => format!(
                "{:.4} Hz is {:.2} % below the floor of {floor_hz:.4} Hz ({body}): no more than an error of {:.2} % in length or gravity",
                frequency_hz.value,
                100.0 * (1.0 - ratio),
                100.0 * (ratio.powi(-2) - 1.0)
            ),
            None => format!("{:.4} Hz is not below the floor of {floor_hz:.4} Hz ({body})", frequency_hz.value),
        };
        Self { body, floor_hz, rigid_hz, below, remedy, statement }
    }
}

/// The slowest mode of a chain whose joints are free.
pub fn lowest_chain_hz(chain: &Chain, gravity_m_s2: f64) -> f64 {
    // the largest eigenvalue of G^{-1/2} a G^{-1/2} is 1/ω² of the slowest mode
    let root = |i: usize| (gravity_m_s2 * chain.static_moment_kg_m(i)).sqrt();
    let a = chain.inertia_kg_m2();
    let scaled = DMatrix::from_fn(chain.count(), chain.count(), |i, j| a[(i, j)] / (root(i) * root(j)));
    scaled.symmetric_eigenvalues().max().sqrt().recip() / std::f64::consts::TAU
}

/// κ of f = f₀(1 − κA²) for a mode of a chain, A being the amplitude of the link that moves most.
///
/// With θ = s q, gravity's potential Σ g hᵢ(1 − cos sᵢq) and the inertia ½ Σ aᵢⱼ sᵢsⱼ cos((sᵢ−sⱼ)q) q̇² expanded to the fourth order, harmonic
/// balance gives
///
/// ```text
/// κ = g Σ hᵢsᵢ⁴ / (16 k) − Σ aᵢⱼ sᵢsⱼ (sᵢ−sⱼ)² / (8 m),   m = Σ aᵢⱼ sᵢsⱼ,   k = ω² m
/// ```
/// 1/16 for one link. Springs in the joints enter through the measured ω, and only add to gravity's stiffness: where ω says less, the links are not what the file says, as a
/// weight on a thread described as a rod, and gravity alone is taken.
pub fn amplitude_dependence(chain: &Chain, gravity_m_s2: f64, frequency_hz: f64, shape: &[Complex<f64>]) -> f64 {
    // the part of the shape that moves together
    let largest =
        shape.iter().fold(Complex::new(0.0, 0.0), |l: Complex<f64>, s| if s.norm() > l.norm() { *s } else { l });
    let s: Vec<f64> = shape.iter().map(|v| (v / largest).re).collect();
    let a = chain.inertia_kg_m2();
    let (mut mass, mut curve, mut quartic, mut by_gravity) = (0.0, 0.0, 0.0, 0.0);
    for i in 0..chain.count() {
        quartic += gravity_m_s2 * chain.static_moment_kg_m(i) * s[i].powi(4);
        by_gravity += gravity_m_s2 * chain.static_moment_kg_m(i) * s[i].powi(2);
        for j in 0..chain.count() {
            mass += a[(i, j)] * s[i] * s[j];
            curve += a[(i, j)] * s[i] * s[j] * (s[i] - s[j]).powi(2);
        }
    }
    let stiffness = ((std::f64::consts::TAU * frequency_hz).powi(2) * mass).max(by_gravity);
    quartic / (16.0 * stiffness) - curve / (8.0 * mass)
}

#[cfg(test)]
mod tests {
    use super::*;

    const G: f64 = 9.80665;

    #[test]
    fn the_strips_have_the_frequencies_of_the_handbook() {
        assert!((limp_frequency_hz(0, 0.2, 9.81) - 1.3403).abs() < 5e-5);
        assert!((rigid_frequency_hz(0.2, G) - 1.3649).abs() < 5e-5);
        let rods = Chain::of(&Specimen::default()).unwrap();
        assert!((lowest_chain_hz(&rods, 9.81) - 1.3489).abs() < 5e-5);
    }

    #[test]
    fn a_weight_described_as_a_rod_falls_behind_with_amplitude_as_every_pendulum_does() {
        let rod = Specimen { link_lengths_m: vec![0.6], length_m: 0.6, ..Specimen::default() };
        let chain = Chain::of(&rod).unwrap();
        let shape = [Complex::new(1.0, 0.0)];
        let kappa = |hz: f64| amplitude_dependence(&chain, G, hz, &shape);
        let own_hz = rigid_frequency_hz(0.6, G);
        assert!((kappa(own_hz) - 1.0 / 16.0).abs() < 1e-3);
        // the weight hangs lower than the rod's middle, and swings more slowly
        assert_eq!(kappa(0.82 * own_hz), 1.0 / 16.0);
        // a spring adds
        assert!((kappa(1.2 * own_hz) * 1.44 - 1.0 / 16.0).abs() < 1e-3);
    }

    #[test]
    fn many_links_approach_the_limp_strip() {
        let strip = Specimen { link_lengths_m: vec![0.01; 20], ..Specimen::default() };
        let many = lowest_chain_hz(&Chain::of(&strip).unwrap(), G);
        assert!((many / limp_frequency_hz(0, 0.2, G) - 1.0).abs() < 1e-3, "{many}");
    }

    #[test]
    fn a_frequency_below_the_floor_is_mended_by_a_factor() {
        let strip = Specimen::default();
        let chain = Chain::of(&strip).unwrap();
        let low = Floor::of(&strip, &chain, G, Estimate::new(0.5156, 0.001, 100.0));
        let remedy = low.remedy.unwrap();
        assert!(low.below && (remedy.time - 0.5156 / 1.3400).abs() < 1e-4);
        assert!((limp_frequency_hz(0, 0.2 * remedy.length, G) - 0.5156).abs() < 1e-9);
        assert!((limp_frequency_hz(0, 0.2, G * remedy.gravity) - 0.5156).abs() < 1e-9);
        let sound = Floor::of(&strip, &chain, G, Estimate::new(1.3400, 0.001, 100.0));
        assert!(!sound.below && sound.remedy.is_none());
    }

    #[test]
    fn one_link_loses_a_sixteenth_of_its_amplitude_squared() {
        let strip = Specimen { link_lengths_m: vec![0.2], ..Specimen::default() };
        let chain = Chain::of(&strip).unwrap();
        let f = lowest_chain_hz(&chain, G);
        assert!((amplitude_dependence(&chain, G, f, &[Complex::new(-2.0, 0.0)]) - 0.0625).abs() < 1e-12);
    }
}
