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

/// The identifier of an effect, and what switches it off.
type SwitchOff = (&'static str, fn(&mut Effects));

/// The effects that act on the motion and may have no linear part at rest.
const MAY_LEAVE_NO_TRACE: [SwitchOff; 5] = [
    ("hinge_coulomb", |effects| effects.hinge_coulomb = None),
    ("air_quadratic", |effects| effects.air_quadratic = None),
    ("joint_cubic_stiffness", |effects| effects.joint_cubic_stiffness = None),
    ("support_motion", |effects| effects.support_motion = None),
    ("support_flexibility", |effects| effects.support_flexibility = None),
];

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

    /// Of the experiment that was linearised, the effects and the stated laws that leave no trace in it: those without which it is the same.
    ///
    /// # Errors
    /// As [`Linearised::of`].
    pub fn left_out(&self, experiment: &Experiment) -> Result<Vec<String>> {
        let mut left_out = Vec::new();
        for (id, switch_off) in MAY_LEAVE_NO_TRACE {
            let mut without = experiment.clone();
            switch_off(&mut without.model.effects);
            if without.model.effects != experiment.model.effects && Self::of(&without)? == *self {
                left_out.push(id.to_owned());
            }
        }
        for (place, law) in experiment.model.law.iter().enumerate() {
            let mut without = experiment.clone();
            without.model.law.remove(place);
            if Self::of(&without)? == *self {
                left_out.push(format!("law {:?}", law.name));
            }
        }
        Ok(left_out)
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
        let left_out = |effects: Effects| {
            let mut experiment = Experiment::default();
            experiment.model.effects = effects;
            Linearised::of(&experiment).unwrap().left_out(&experiment).unwrap()
        };
        assert_eq!(left_out(effects), ["hinge_coulomb", "air_quadratic"]);
        // about a bent rest a cubic spring is a spring
        let bent = Effects { joint_cubic_stiffness: Some(1e-3), rest_curl: Some(0.2), ..Effects::default() };
        let straight = Effects { rest_curl: None, ..bent.clone() };
        assert!(left_out(bent).is_empty() && left_out(straight) == ["joint_cubic_stiffness"]);
    }

    #[test]
    fn a_chain_without_a_rest_position_is_refused() {
        let mut experiment = Experiment::default();
        experiment.model.k_eq_n_m_per_rad = 1.0;
        experiment.model.effects.rest_curl = Some(40.0);
        assert!(Linearised::of(&experiment).unwrap_err().to_string().contains("no stable rest position"));
    }
}
