//! The chain at rest.

use nalgebra::{DMatrix, DVector};

use super::{ForwardModel, Hinge, Motion, Partials};
use crate::error::{Error, Result};
use crate::experiment::Experiment;

/// Newton's steps.
const STEPS: usize = 50;
/// Largest correction (rad) that still counts as rest.
const AT_REST_RAD: f64 = 1e-14;

impl ForwardModel {
    /// The model of an experiment as far as it acts at rest: without a moving pivot.
    ///
    /// # Errors
    /// As [`ForwardModel::of`].
    pub fn still(experiment: &Experiment) -> Result<Self> {
        let mut still = experiment.clone();
        still.model.effects.support_motion = None;
        Self::of(&still)
    }

    /// Angles θ₀ of a stable rest where dry friction bears nothing, Q(θ₀) = 0, by Newton's method from an angle near by. `further` adds torques that are not the
    /// chain's own to Q(θ), and takes their derivatives from −∂Q/∂θ.
    ///
    /// # Errors
    /// [`Error::Simulation`] where there is none.
    pub fn rest_rad(
        &self,
        from_rad: DVector<f64>,
        further: impl Fn(&DVector<f64>, &mut DVector<f64>, &mut DMatrix<f64>),
    ) -> Result<DVector<f64>> {
        let none = || {
            Error::Simulation {
            detail: "the chain has no stable rest position near the vertical; lower rest_curl, side_force, the light or a negative stiffness"
                .into(),
        }
        };
        let n = self.chain().count();
        let mut theta = from_rad;
        let mut torque_n_m = vec![0.0; self.rates()];
        for _ in 0..STEPS {
            self.torque_while_held(&self.motion(0.0, theta.as_slice(), &vec![0.0; n]), &mut torque_n_m);
            let mut torque = DVector::from_column_slice(&torque_n_m[..n]);
            let mut stiffness = -self.partials_at_rest(theta.as_slice()).theta.rows(0, n);
            further(&theta, &mut torque, &mut stiffness);
            let step = stiffness.cholesky().ok_or_else(none)?.solve(&torque);
            theta += &step;
            if step.amax() <= AT_REST_RAD {
                return Ok(theta);
            }
        }
        Err(none())
    }

    /// Derivatives of the torques where nothing moves.
    pub fn partials_at_rest(&self, theta_rad: &[f64]) -> Partials {
        let n = self.chain().count();
        let mut partials = Partials::zero(n, self.rates());
        let still = Motion { hinge: Hinge::Sticks, ..self.motion(0.0, theta_rad, &vec![0.0; n]) };
        self.free_partials(&still, &mut partials);
        partials
    }
}
