//! Two uniform rods in closed form: paper Eq. 33 and 34.

use std::f64::consts::TAU;

/// Two uniform rods hung one below the other.
///
/// det(K − ω²M) = 0 expands, with k₁, k₅ the gravity stiffnesses and k₂, k₄, k₆ the inertias, to
///
/// ```text
/// ω±² = (k₁k₄ + k₂k₅ ± √((k₁k₄ − k₂k₅)² + 4k₁k₅k₆²)) / (2(k₂k₄ − k₆²))
/// k₁ = g L₁(m₂ + m₁/2)     k₂ = I₁ + m₂L₁² + m₁(L₁/2)²     k₄ = m₂(L₂/2)² + I₂
/// k₅ = m₂ g L₂/2           k₆ = L₁ m₂ L₂/2                  I = mL²/12
/// (A₁/A₂)± = −k₅k₆ / (ω±²(k₂k₄ − k₆²) − k₁k₄)
/// ```
///
/// The paper prints 2k₁k₅k₆² under the root, m₁L₁² in k₂, and k₅, k₆ negative; the labels below its Eq. 34 are exchanged: the + root is the
/// fast mode, rods opposed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TwoRods {
    /// Upper and lower.
    pub mass_kg: [f64; 2],
    /// Upper and lower.
    pub length_m: [f64; 2],
    /// g.
    pub gravity_m_s2: f64,
    /// Spring at the joint.
    pub joint_stiffness_n_m_per_rad: f64,
    /// Spring at the hinge.
    pub hinge_stiffness_n_m_per_rad: f64,
}

/// A root of the closed form.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct RodMode {
    /// ω²; a negative one is no vibration but a fall.
    pub omega_squared_rad2_s2: f64,
    /// ω/2π, none where ω² is negative.
    pub frequency_hz: Option<f64>,
    /// A₁/A₂, positive where the rods swing together.
    pub amplitude_ratio: f64,
}

/// k₁ to k₆.
struct Coefficients {
    k1: f64,
    k2: f64,
    k4: f64,
    k5: f64,
    k6: f64,
}

impl TwoRods {
    /// The slow and the fast mode of the corrected equations. A spring k at the joint and k₀ at the hinge turn the stiffness into
    ///
    /// ```text
    /// K = | k₁ + k₀ + k    −k   |
    ///     |      −k      k₅ + k |
    /// ```
    pub fn modes(&self) -> [RodMode; 2] {
        let Coefficients { k1, k2, k4, k5, k6 } = self.coefficients();
        let k = self.joint_stiffness_n_m_per_rad;
        let (k11, k22) = (k1 + self.hinge_stiffness_n_m_per_rad + k, k5 + k);
        let inertia = k2 * k4 - k6 * k6;
        let trace = k11 * k4 + k22 * k2 + 2.0 * k * k6;
        let root = (trace * trace - 4.0 * inertia * (k11 * k22 - k * k)).sqrt();
        let fast = (trace + root) / (2.0 * inertia);
        // The product of the roots: a difference would lose the slow mode's digits where the spring is stiff.
        let slow = (k11 * k22 - k * k) / (inertia * fast);
        [slow, fast].map(|square| RodMode::new(square, (square * k6 + k) / (k11 - square * k2)))
    }

    /// Eq. 33 and 34 letter by letter, the − root first; springs have no place in them.
    pub fn as_printed(&self) -> [RodMode; 2] {
        let [m1, m2] = self.mass_kg;
        let [l1, _] = self.length_m;
        let half = l1 / 2.0;
        let (i1, i2) = (m1 * l1 * l1 / 12.0, m2 * l1 * l1 / 12.0);
        let k1 = self.gravity_m_s2 * (m2 * l1 + m1 * half);
        let k2 = i1 + m1 * l1 * l1 + m1 * half * half;
        let k4 = m2 * half * half + i2;
        let k5 = -m2 * self.gravity_m_s2 * half;
        let k6 = -l1 * m2 * half;
        let inertia = k2 * k4 - k6 * k6;
        let root = ((k1 * k4 - k2 * k5).powi(2) + 2.0 * k1 * k5 * k6 * k6).sqrt();
        [-root, root].map(|root| {
            let square = (k1 * k4 + k2 * k5 + root) / (2.0 * inertia);
            RodMode::new(square, -k5 * k6 / (square * inertia - k1 * k4))
        })
    }

    fn coefficients(&self) -> Coefficients {
        let [m1, m2] = self.mass_kg;
        let [l1, l2] = self.length_m;
        let g = self.gravity_m_s2;
        Coefficients {
            k1: g * l1 * (m2 + m1 / 2.0),
            k2: m1 * l1 * l1 / 12.0 + m2 * l1 * l1 + m1 * l1 * l1 / 4.0,
            k4: m2 * l2 * l2 / 4.0 + m2 * l2 * l2 / 12.0,
            k5: m2 * g * l2 / 2.0,
            k6: l1 * m2 * l2 / 2.0,
        }
    }
}

impl RodMode {
    fn new(square: f64, amplitude_ratio: f64) -> Self {
        let frequency_hz = (square >= 0.0).then(|| square.sqrt() / TAU);
        Self { omega_squared_rad2_s2: square, frequency_hz, amplitude_ratio }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::experiment::{Experiment, Rig};
    use crate::model::modes::{Linearised, Modes};

    fn paper(gravity_m_s2: f64) -> TwoRods {
        TwoRods {
            mass_kg: [0.5, 0.5],
            length_m: [0.1, 0.1],
            gravity_m_s2,
            joint_stiffness_n_m_per_rad: 0.0,
            hinge_stiffness_n_m_per_rad: 0.0,
        }
    }

    #[test]
    fn the_corrected_form_gives_1_3489_and_3_6180_hz() {
        let [slow, fast] = paper(9.81).modes().map(|m| m.frequency_hz.unwrap());
        assert!((slow - 1.3489).abs() < 5e-5 && (fast - 3.6180).abs() < 5e-5);
        let [slow, fast] = paper(9.80665).modes().map(|m| m.frequency_hz.unwrap());
        assert!((slow - 1.3486).abs() < 5e-5 && (fast - 3.6174).abs() < 5e-5);
    }

    #[test]
    fn it_equals_eq_33_with_the_four_under_the_root() {
        let rods = TwoRods { mass_kg: [0.3, 0.9], length_m: [0.07, 0.15], ..paper(9.81) };
        let Coefficients { k1, k2, k4, k5, k6 } = rods.coefficients();
        let root = ((k1 * k4 - k2 * k5).powi(2) + 4.0 * k1 * k5 * k6 * k6).sqrt();
        for (mode, sign) in rods.modes().iter().zip([-1.0, 1.0]) {
            let square = (k1 * k4 + k2 * k5 + sign * root) / (2.0 * (k2 * k4 - k6 * k6));
            assert!((mode.omega_squared_rad2_s2 / square - 1.0).abs() < 1e-12);
            let ratio = -k5 * k6 / (square * (k2 * k4 - k6 * k6) - k1 * k4);
            assert!((mode.amplitude_ratio / ratio - 1.0).abs() < 1e-10);
        }
    }

    #[test]
    fn springs_and_unequal_rods_agree_with_the_eigenvalues_of_the_chain() {
        let mut experiment = Experiment { rig: Rig { gravity_m_s2: 9.81, ..Rig::default() }, ..Experiment::default() };
        experiment.specimen.link_lengths_m = vec![0.07, 0.13];
        experiment.model.c_eq_n_m_s_per_rad = 0.0;
        experiment.model.effects.hinge_stiffness = Some(3e-5);
        let mass_kg = experiment.specimen.mass_kg;
        for k in [0.0, 1e-4, 0.0258] {
            experiment.model.k_eq_n_m_per_rad = k;
            let chain = Modes::of(&Linearised::of(&experiment).unwrap()).unwrap().modes;
            let rods = TwoRods {
                mass_kg: [0.35 * mass_kg, 0.65 * mass_kg],
                length_m: [0.07, 0.13],
                joint_stiffness_n_m_per_rad: k,
                hinge_stiffness_n_m_per_rad: 3e-5,
                ..paper(9.81)
            };
            for (closed, pole) in rods.modes().iter().zip(&chain) {
                assert!((closed.frequency_hz.unwrap() / pole.frequency_hz - 1.0).abs() < 1e-10);
                let sign = if pole.shape[0].phase_rad.abs() + pole.shape[1].phase_rad.abs() > 1.0 { -1.0 } else { 1.0 };
                let ratio = sign * pole.shape[0].amplitude / pole.shape[1].amplitude;
                assert!((closed.amplitude_ratio / ratio - 1.0).abs() < 1e-8);
            }
        }
    }

    #[test]
    fn the_printed_form_lets_one_mode_fall() {
        let [minus, plus] = paper(9.81).as_printed();
        assert!(minus.frequency_hz.is_none() && minus.omega_squared_rad2_s2 < 0.0);
        assert!((plus.frequency_hz.unwrap() - 2.2979).abs() < 5e-5);
    }

    #[test]
    fn the_slow_mode_swings_together_and_the_fast_one_opposed() {
        let [slow, fast] = paper(9.81).modes();
        assert!(slow.amplitude_ratio > 0.0 && fast.amplitude_ratio < 0.0);
    }
}
