//! The chain near its rest position.

use nalgebra::{DMatrix, DVector};

use crate::error::Result;
use crate::experiment::{Effects, Experiment};
use crate::model::ForwardModel;

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
    /// Linearises an experiment's chain by the forward model's own derivatives, with every effect that has a linear part.
    ///
    /// A yielding joint (`joint_hysteretic`) has not yet yielded in a small motion: z = Δ/Δ_y makes it a spring T_h/Δ_y. A moving pivot
    /// and dry friction are left out.
    ///
    /// # Errors
    /// [`crate::Error::Simulation`] when the specimen cannot swing or has no rest position near the vertical.
    pub fn of(experiment: &Experiment) -> Result<Self> {
        let model = ForwardModel::still(experiment)?;
        let (n, hidden) = (model.chain().count(), model.rates() - model.chain().count());
        let rest_rad = model.rest_rad(DVector::zeros(n), |_, _, _| {})?;
        let partials = model.partials_at_rest(rest_rad.as_slice());
        // A law's own variable z has ż = R ω at rest, so z = R δ: what it does to the torques is a stiffness.
        let of_hidden = partials.rate.view((0, n), (n, hidden)) * partials.rate.view((n, 0), (hidden, n));
        Ok(Self {
            inertia_kg_m2: -partials.acceleration.view((0, 0), (n, n)).into_owned(),
            damping_n_m_s: -partials.rate.view((0, 0), (n, n)).into_owned(),
            stiffness_n_m: -partials.theta.rows(0, n) - of_hidden,
            rest_rad: rest_rad.as_slice().to_vec(),
        })
    }

    /// Identifiers of the effects that are switched on but have no linear part at rest.
    pub fn left_out(effects: &Effects) -> Vec<&'static str> {
        [("hinge_coulomb", effects.hinge_coulomb), ("air_quadratic", effects.air_quadratic)]
            .into_iter()
            .filter_map(|(id, coefficient)| coefficient.map(|_| id))
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::experiment::Hysteresis;

    fn linear(effects: Effects) -> Linearised {
        let mut experiment = Experiment::default();
        experiment.model.effects = effects;
        Linearised::of(&experiment).unwrap()
    }

    #[test]
    fn a_side_force_turns_the_rest_position() {
        let turned = linear(Effects { side_force: Some(1.3), ..Effects::default() });
        assert!(turned.rest_rad.iter().all(|a| (a - (1.3f64 / 9.80665).atan()).abs() < 1e-14), "{turned:?}");
    }

    #[test]
    fn a_yielding_joint_is_a_spring_to_small_motions() {
        let law = Hysteresis { torque_n_m: 3e-5, yield_rad: 0.02 };
        let plain = linear(Effects::default());
        let yielding = linear(Effects { joint_hysteretic: Some(law), ..Effects::default() });
        let added = yielding.stiffness_n_m - plain.stiffness_n_m;
        let expected = DMatrix::from_row_slice(2, 2, &[1.0, -1.0, -1.0, 1.0]) * (3e-5 / 0.02);
        assert!((added - expected).norm() < 1e-16);
    }

    #[test]
    fn added_mass_of_half_the_strips_adds_half_its_inertia() {
        let plain = linear(Effects::default());
        let heavier = linear(Effects { added_mass: Some(0.5 * 0.3606e-3 / 0.2), ..Effects::default() });
        assert!((&heavier.inertia_kg_m2 - 1.5 * &plain.inertia_kg_m2).norm() < 1e-12 * plain.inertia_kg_m2.norm());
        assert_eq!(heavier.stiffness_n_m, plain.stiffness_n_m);
    }

    #[test]
    fn friction_and_a_moving_pivot_leave_no_trace() {
        let effects = Effects { hinge_coulomb: Some(1e-6), air_quadratic: Some(1e-3), ..Effects::default() };
        assert_eq!(linear(effects.clone()), linear(Effects::default()));
        assert_eq!(Linearised::left_out(&effects), ["hinge_coulomb", "air_quadratic"]);
    }

    #[test]
    fn a_chain_without_a_rest_position_is_refused() {
        let mut experiment = Experiment::default();
        experiment.model.k_eq_n_m_per_rad = 1.0;
        experiment.model.effects.rest_curl = Some(40.0);
        assert!(Linearised::of(&experiment).unwrap_err().to_string().contains("no stable rest position"));
    }
}
