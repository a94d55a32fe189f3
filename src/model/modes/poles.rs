//! The eigenvalues of M δ̈ + C δ̇ + K δ = 0.

use std::f64::consts::TAU;

use nalgebra::{Complex, DMatrix, DVector};

use super::Linearised;
use crate::error::{Error, Result};

/// One link's part of a mode shape.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Component {
    /// Relative to the link that moves most.
    pub amplitude: f64,
    /// Lead over that link.
    pub phase_rad: f64,
}

/// A vibration λ = −ξω ± iω√(1−ξ²).
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Mode {
    /// Natural frequency ω/2π.
    pub frequency_hz: f64,
    /// Frequency of the damped swing, |Im λ|/2π (paper Eq. 27).
    pub damped_frequency_hz: f64,
    /// ξ = −Re λ/|λ|.
    pub damping_ratio: f64,
    /// θᵢ, top to bottom.
    pub shape: Vec<Component>,
}

/// A motion λ < 0 that only decays.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Overdamped {
    /// −1/λ.
    pub time_constant_s: f64,
    /// |λ|.
    pub rate_rad_s: f64,
    /// θᵢ, top to bottom.
    pub shape: Vec<Component>,
}

/// All motions of a chain near its rest position: every solution is a sum of them.
///
/// ```text
/// δ = v e^(λt)        (λ²M + λC + K) v = 0
/// ```
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Modes {
    /// By frequency.
    pub modes: Vec<Mode>,
    /// Slowest first.
    pub overdamped: Vec<Overdamped>,
}

impl Modes {
    /// Solves the quadratic eigenvalue problem.
    ///
    /// The eigenvalues of the state matrix are improved by inverse iteration on λ²M + λC + K and by the quadratic Rayleigh quotient of
    /// each vector, so a damping ratio of 10⁻⁶ keeps its digits and one of zero is zero.
    ///
    /// # Errors
    /// [`Error::Simulation`] when M is not positive or an eigenvalue is not found.
    pub fn of(linear: &Linearised) -> Result<Self> {
        let failed = || Error::Simulation {
            detail: "the modes cannot be computed; check masses, lengths and the effects' coefficients".into(),
        };
        let states = state_matrix(linear).ok_or_else(failed)?;
        let mut found = Self { modes: Vec::new(), overdamped: Vec::new() };
        for start in states.eigenvalues_rad_s() {
            if start.im < -1e-9 * start.norm() {
                continue;
            }
            let (lambda, shape) = refined(linear, start).ok_or_else(failed)?;
            if lambda.im > 1e-9 * lambda.norm() {
                found.modes.push(Mode {
                    frequency_hz: lambda.norm() / TAU,
                    damped_frequency_hz: lambda.im / TAU,
                    damping_ratio: -lambda.re / lambda.norm(),
                    shape,
                });
            } else {
                found.overdamped.push(Overdamped {
                    time_constant_s: -1.0 / lambda.re,
                    rate_rad_s: lambda.norm(),
                    shape,
                });
            }
        }
        found.modes.sort_by(|a, b| a.frequency_hz.total_cmp(&b.frequency_hz));
        found.overdamped.sort_by(|a, b| a.rate_rad_s.total_cmp(&b.rate_rad_s));
        Ok(found)
    }
}

/// d/dτ (δ, δ′) = A (δ, δ′) with τ = s t, so that positions and rates are of one size.
struct StateMatrix {
    matrix: DMatrix<f64>,
    rate_rad_s: f64,
}

impl StateMatrix {
    fn eigenvalues_rad_s(&self) -> Vec<Complex<f64>> {
        self.matrix.complex_eigenvalues().iter().map(|l| l * self.rate_rad_s).collect()
    }
}

fn state_matrix(linear: &Linearised) -> Option<StateMatrix> {
    let n = linear.rest_rad.len();
    let inertia = linear.inertia_kg_m2.clone().cholesky()?;
    let stiffness = inertia.solve(&linear.stiffness_n_m);
    let damping = inertia.solve(&linear.damping_n_m_s);
    let rate_rad_s = stiffness.norm().sqrt();
    let mut matrix = DMatrix::zeros(2 * n, 2 * n);
    matrix.view_mut((0, n), (n, n)).fill_with_identity();
    matrix.view_mut((n, 0), (n, n)).copy_from(&(-stiffness / rate_rad_s.powi(2)));
    matrix.view_mut((n, n), (n, n)).copy_from(&(-damping / rate_rad_s));
    matrix.iter().all(|v| v.is_finite()).then_some(StateMatrix { matrix, rate_rad_s })
}

/// The eigenvalue next to `start`, with its vector.
fn refined(linear: &Linearised, start: Complex<f64>) -> Option<(Complex<f64>, Vec<Component>)> {
    let [inertia, damping, stiffness] =
        [&linear.inertia_kg_m2, &linear.damping_n_m_s, &linear.stiffness_n_m].map(|m| m.map(Complex::from));
    let n = linear.rest_rad.len();
    // A little off the eigenvalue, where the matrix can still be inverted and its inverse is all eigenvector.
    let near = start * Complex::from(1.0 + 1e-9) + Complex::from(1e-12 * start.norm());
    let factor = (&inertia * (near * near) + &damping * near + &stiffness).lu();
    // With the derivative on the right the distance to the eigenvalue enters the vector squared.
    let derivative = &inertia * (near * 2.0) + &damping;
    // Components of different size and sign: no mode is at right angles to it.
    let mut vector = DVector::from_fn(n, |i, _| Complex::from(((i as f64 + 1.0) * 0.754_877).sin()));
    for _ in 0..4 {
        vector = factor.solve(&(&derivative * &vector))?;
        vector /= Complex::from(vector.norm());
    }
    let form = |matrix: &DMatrix<Complex<f64>>| vector.dotc(&(matrix * &vector)).re;
    let (m, c, k) = (form(&inertia), form(&damping), form(&stiffness));
    let root = Complex::from(c * c - 4.0 * m * k).sqrt();
    let roots = [(-root - c) / (2.0 * m), (root - c) / (2.0 * m)];
    let lambda = roots.into_iter().min_by(|a, b| (a - start).norm().total_cmp(&(b - start).norm()))?;
    let largest = vector.iter().copied().max_by(|a, b| a.norm().total_cmp(&b.norm()))?;
    let component = |v: &Complex<f64>| Component { amplitude: (v / largest).norm(), phase_rad: (v / largest).arg() };
    lambda.is_finite().then(|| (lambda, vector.iter().map(component).collect()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::experiment::{Effects, Experiment, Inertia, Specimen};
    use crate::model::modes::limp_frequency_hz;

    fn strip(k: f64, c: f64) -> Experiment {
        let mut experiment = Experiment::default();
        experiment.model.k_eq_n_m_per_rad = k;
        experiment.model.c_eq_n_m_s_per_rad = c;
        experiment
    }

    fn modes(experiment: &Experiment) -> Modes {
        Modes::of(&Linearised::of(experiment).unwrap()).unwrap()
    }

    #[test]
    fn two_limp_rods_swing_at_1_3489_and_3_6180_hz_whatever_their_mass() {
        for mass_kg in [1e-5, 0.3606e-3, 2.0] {
            let mut experiment = strip(0.0, 0.0);
            experiment.rig.gravity_m_s2 = 9.81;
            experiment.specimen.mass_kg = mass_kg;
            let found = modes(&experiment).modes;
            assert!((found[0].frequency_hz - 1.3489).abs() < 5e-5 && (found[1].frequency_hz - 3.6180).abs() < 5e-5);
            assert_eq!([found[0].damping_ratio, found[1].damping_ratio], [0.0, 0.0]);
        }
    }

    #[test]
    fn the_joint_of_table_2_takes_next_to_nothing_out_of_the_first_mode() {
        let pet_1_mil =
            Experiment { specimen: Specimen { mass_kg: 0.3530e-3, ..Specimen::default() }, ..strip(0.0258, 2.467e-4) };
        let found = modes(&pet_1_mil);
        assert_eq!((found.modes.len(), found.overdamped.len()), (1, 2));
        let first = &found.modes[0];
        assert!(first.damping_ratio > 1e-7 && first.damping_ratio < 5e-6, "{}", first.damping_ratio);
        assert!((first.frequency_hz - 1.3649).abs() < 1e-4);
    }

    #[test]
    fn one_link_with_a_damper_is_the_textbook_oscillator() {
        let mut experiment = strip(0.0, 0.0);
        experiment.specimen.link_lengths_m = vec![0.2];
        let inertia = 0.3606e-3 * 0.04 / 3.0;
        let omega = (0.3606e-3f64 * 9.80665 * 0.1 / inertia).sqrt();
        experiment.model.effects.hinge_viscous = Some(2.0 * 0.03 * inertia * omega);
        let found = modes(&experiment);
        assert!((found.modes[0].damping_ratio - 0.03).abs() < 1e-14);
        assert!((found.modes[0].frequency_hz * TAU / omega - 1.0).abs() < 1e-14);
        assert!((found.modes[0].damped_frequency_hz * TAU / omega - (1.0f64 - 9e-4).sqrt()).abs() < 1e-14);
        experiment.model.effects.hinge_viscous = Some(2.0 * 1.25 * inertia * omega);
        let found = modes(&experiment);
        assert!(found.modes.is_empty() && found.overdamped.len() == 2);
        // λ = −ω (ξ ∓ √(ξ²−1)) = −ω/2, −2ω
        assert!((found.overdamped[0].time_constant_s * omega - 2.0).abs() < 1e-9);
        assert!((found.overdamped[1].time_constant_s * omega - 0.5).abs() < 1e-9);
    }

    #[test]
    fn drag_in_proportion_to_mass_damps_every_mode_by_c_over_2_mu_omega() {
        let mut experiment = strip(1e-4, 0.0);
        experiment.model.effects = Effects { air_linear: Some(1e-3), ..Effects::default() };
        let per_length_kg_m = 0.3606e-3 / 0.2;
        for mode in modes(&experiment).modes {
            let expected = 1e-3 / (2.0 * per_length_kg_m * mode.frequency_hz * TAU);
            assert!((mode.damping_ratio / expected - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn a_chain_of_many_limp_links_approaches_the_hanging_chain() {
        let mut experiment = strip(0.0, 0.0);
        experiment.specimen.link_lengths_m = vec![0.01; 20];
        let found = modes(&experiment).modes;
        assert_eq!(found.len(), 20);
        for (k, mode) in found.iter().take(2).enumerate() {
            let limit_hz = limp_frequency_hz(k, 0.2, 9.80665);
            assert!((mode.frequency_hz / limit_hz - 1.0).abs() < 5e-3, "{k} {} {limit_hz}", mode.frequency_hz);
        }
    }

    #[test]
    fn shapes_solve_the_equations_they_came_from() {
        let mut experiment = strip(2e-4, 3e-6);
        experiment.specimen.inertia = Inertia::Lumps;
        let linear = Linearised::of(&experiment).unwrap();
        for mode in Modes::of(&linear).unwrap().modes {
            let omega = TAU * mode.frequency_hz;
            let lambda = Complex::new(-mode.damping_ratio * omega, TAU * mode.damped_frequency_hz);
            let v = DVector::from_iterator(2, mode.shape.iter().map(|c| Complex::from_polar(c.amplitude, c.phase_rad)));
            let [m, c, k] =
                [&linear.inertia_kg_m2, &linear.damping_n_m_s, &linear.stiffness_n_m].map(|m| m.map(Complex::from));
            let rest = (&m * (lambda * lambda) + &c * lambda + &k) * &v;
            let share = rest.norm() / (&k * &v).norm();
            assert!(share < 1e-12, "{share} {mode:?}");
        }
    }
}
