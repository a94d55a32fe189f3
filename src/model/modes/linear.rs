//! The chain near its rest position.

use nalgebra::{DMatrix, DVector};

use crate::error::{Error, Result};
use crate::experiment::{Effects, Experiment, Model};
use crate::model::Chain;

/// Largest correction (rad) that still counts as rest.
const AT_REST_RAD: f64 = 1e-14;

/// The chain's equations of motion linearised at its rest position: M δ̈ + C δ̇ + K δ = 0 (paper Eq. 26), δ = θ − θ₀.
#[derive(Debug, Clone, PartialEq)]
pub struct Linearised {
    /// θ₀.
    pub rest_rad: Vec<f64>,
    /// M.
    pub inertia_kg_m2: DMatrix<f64>,
    /// C.
    pub damping_n_m_s: DMatrix<f64>,
    /// K.
    pub stiffness_n_m: DMatrix<f64>,
}

impl Linearised {
    /// Linearises an experiment's chain: gravity, joint spring and damper, and every effect with a linear part.
    ///
    /// # Errors
    /// [`Error::Simulation`] when the specimen cannot swing or has no rest position near the vertical.
    pub fn of(experiment: &Experiment) -> Result<Self> {
        let chain = Chain::of(&experiment.specimen)?;
        let laws = LinearLaws { chain: &chain, model: &experiment.model, gravity_m_s2: experiment.rig.gravity_m_s2 };
        let rest_rad = laws.rest_rad()?;
        let effects = &experiment.model.effects;
        let strip_m3 = strip_integrals_m3(&chain, &rest_rad);
        let chain_kg_m2 = chain.inertia_kg_m2().map_with_location(|i, j, a| a * (rest_rad[i] - rest_rad[j]).cos());
        let mut damping_n_m_s = difference_matrix(chain.count(), |_| experiment.model.c_eq_n_m_s_per_rad);
        damping_n_m_s[(0, 0)] += effects.hinge_viscous.unwrap_or(0.0);
        Ok(Self {
            inertia_kg_m2: chain_kg_m2 + &strip_m3 * effects.added_mass.unwrap_or(0.0),
            damping_n_m_s: damping_n_m_s + &strip_m3 * effects.air_linear.unwrap_or(0.0),
            stiffness_n_m: laws.stiffness_n_m(&rest_rad),
            rest_rad: rest_rad.as_slice().to_vec(),
        })
    }

    /// Identifiers of the effects that are switched on but have no linear part at rest.
    pub fn left_out(effects: &Effects) -> Vec<&'static str> {
        [
            ("hinge_coulomb", effects.hinge_coulomb.is_some()),
            ("joint_hysteretic", effects.joint_hysteretic.is_some()),
            ("air_quadratic", effects.air_quadratic.is_some()),
        ]
        .into_iter()
        .filter_map(|(id, on)| on.then_some(id))
        .collect()
    }
}

/// The torques that hold the chain, and their slopes.
struct LinearLaws<'a> {
    chain: &'a Chain,
    model: &'a Model,
    gravity_m_s2: f64,
}

impl LinearLaws<'_> {
    /// θ₀ by Newton's method from the vertical.
    fn rest_rad(&self) -> Result<DVector<f64>> {
        let none = || Error::Simulation {
            detail:
                "the chain has no rest position near the vertical; lower rest_curl, side_force or a negative stiffness"
                    .into(),
        };
        let mut theta = DVector::zeros(self.chain.count());
        for _ in 0..50 {
            let step = self.stiffness_n_m(&theta).cholesky().ok_or_else(none)?.solve(&self.torque_n_m(&theta));
            theta += &step;
            if step.amax() <= AT_REST_RAD {
                return Ok(theta);
            }
        }
        Err(none())
    }

    /// Generalised torques at rest.
    fn torque_n_m(&self, theta: &DVector<f64>) -> DVector<f64> {
        let effects = &self.model.effects;
        let mut torque = DVector::from_fn(theta.len(), |i, _| {
            let sideways_m_s2 = effects.side_force.unwrap_or(0.0);
            let pull_m_s2 = sideways_m_s2 * theta[i].cos() - self.gravity_m_s2 * theta[i].sin();
            self.chain.static_moment_kg_m(i) * pull_m_s2
        });
        torque[0] -= effects.hinge_stiffness.unwrap_or(0.0) * theta[0];
        for j in 1..theta.len() {
            let bend = self.bend_rad(theta, j);
            let spring =
                self.joint_stiffness_n_m(j) * bend + effects.joint_cubic_stiffness.unwrap_or(0.0) * bend.powi(3);
            torque[j - 1] += spring;
            torque[j] -= spring;
        }
        torque
    }

    /// −∂Q/∂θ.
    fn stiffness_n_m(&self, theta: &DVector<f64>) -> DMatrix<f64> {
        let effects = &self.model.effects;
        let mut stiffness = difference_matrix(theta.len(), |j| {
            let bend = self.bend_rad(theta, j);
            self.joint_stiffness_n_m(j) + 3.0 * effects.joint_cubic_stiffness.unwrap_or(0.0) * bend * bend
        });
        for i in 0..theta.len() {
            let sideways_m_s2 = effects.side_force.unwrap_or(0.0);
            let hold_m_s2 = self.gravity_m_s2 * theta[i].cos() + sideways_m_s2 * theta[i].sin();
            stiffness[(i, i)] += self.chain.static_moment_kg_m(i) * hold_m_s2;
        }
        stiffness[(0, 0)] += effects.hinge_stiffness.unwrap_or(0.0);
        stiffness
    }

    /// Δ − κ at joint `j`, between the links j − 1 and j.
    fn bend_rad(&self, theta: &DVector<f64>, j: usize) -> f64 {
        theta[j] - theta[j - 1] - self.model.effects.rest_curl.unwrap_or(0.0)
    }

    /// The joint's spring and, of a bending stiffness EI, EI/ℓ with ℓ the mean of the links it joins.
    fn joint_stiffness_n_m(&self, j: usize) -> f64 {
        let links = self.chain.links();
        let spacing_m = 0.5 * (links[j - 1].length_m + links[j].length_m);
        self.model.k_eq_n_m_per_rad + self.model.effects.distributed_flexibility.unwrap_or(0.0) / spacing_m
    }
}

/// Σⱼ kⱼ (δⱼ − δⱼ₋₁)² as a matrix: what each joint's coefficient contributes.
fn difference_matrix(count: usize, coefficient: impl Fn(usize) -> f64) -> DMatrix<f64> {
    let mut matrix = DMatrix::zeros(count, count);
    for j in 1..count {
        let k = coefficient(j);
        matrix[(j - 1, j - 1)] += k;
        matrix[(j, j)] += k;
        matrix[(j - 1, j)] -= k;
        matrix[(j, j - 1)] -= k;
    }
    matrix
}

/// ∫ Jₖ Jⱼ ds over all links, with the arms Jₖ of [`crate::model::effects::air`]: drag and added mass are multiples of it.
fn strip_integrals_m3(chain: &Chain, theta: &DVector<f64>) -> DMatrix<f64> {
    let count = chain.count();
    let mut integrals = DMatrix::zeros(count, count);
    for i in 0..count {
        let length_m = chain.links()[i].length_m;
        let arm_m = |k: usize| chain.links()[k].length_m * (theta[i] - theta[k]).cos();
        for k in 0..=i {
            for j in 0..=i {
                integrals[(k, j)] += match (k < i, j < i) {
                    (true, true) => arm_m(k) * arm_m(j) * length_m,
                    (true, false) => arm_m(k) * length_m.powi(2) / 2.0,
                    (false, true) => arm_m(j) * length_m.powi(2) / 2.0,
                    (false, false) => length_m.powi(3) / 3.0,
                };
            }
        }
    }
    integrals
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::ForwardModel;

    #[test]
    fn it_is_the_forward_model_near_rest() {
        let mut experiment = Experiment::default();
        experiment.model.effects = Effects {
            hinge_viscous: Some(1e-6),
            hinge_stiffness: Some(2e-5),
            joint_cubic_stiffness: Some(1e-3),
            rest_curl: Some(0.2),
            air_linear: Some(1e-3),
            added_mass: Some(3e-4),
            side_force: Some(0.8),
            ..Effects::default()
        };
        let model = ForwardModel::of(&experiment).unwrap();
        let linear = Linearised::of(&experiment).unwrap();
        let inverse = linear.inertia_kg_m2.clone().cholesky().unwrap();
        let acceleration = |theta: &[f64], omega: &[f64]| model.acceleration(&model.motion(0.0, theta, omega)).unwrap();
        assert!(acceleration(&linear.rest_rad, &[0.0; 2]).norm() < 1e-8);
        let small = 1e-6;
        for i in 0..2 {
            let (mut up, mut down) = (linear.rest_rad.clone(), linear.rest_rad.clone());
            up[i] += small;
            down[i] -= small;
            let slope = (acceleration(&up, &[0.0; 2]) - acceleration(&down, &[0.0; 2])) / (2.0 * small);
            let expected = -inverse.solve(&linear.stiffness_n_m.column(i));
            assert!((slope - &expected).norm() < 1e-7 * expected.norm());
            let omega = DVector::from_fn(2, |k, _| if k == i { small } else { 0.0 });
            let rate = (acceleration(&linear.rest_rad, omega.as_slice())
                - acceleration(&linear.rest_rad, (-omega).as_slice()))
                / (2.0 * small);
            let expected = -inverse.solve(&linear.damping_n_m_s.column(i));
            assert!((rate - &expected).norm() < 1e-6 * expected.norm());
        }
    }

    #[test]
    fn a_chain_without_a_rest_position_is_refused() {
        let mut experiment = Experiment::default();
        experiment.model.k_eq_n_m_per_rad = 1.0;
        experiment.model.effects.rest_curl = Some(40.0);
        assert!(Linearised::of(&experiment).unwrap_err().to_string().contains("no rest position"));
    }

    #[test]
    fn effects_without_a_linear_part_are_named() {
        let effects = Effects { hinge_coulomb: Some(1e-7), air_linear: Some(1e-4), ..Effects::default() };
        assert_eq!(Linearised::left_out(&effects), ["hinge_coulomb"]);
    }
}
