//! The chain of links under the push of light: the paper's multibody model.
//!
//! ```text
//! Qᵢ(θ) + ∫ f·∂r/∂θᵢ ds = 0        ∂r/∂θᵢ = (cos θᵢ, −sin θᵢ)·(what of link i lies above the point)
//! ```
//!
//! with Q the chain's own torques: gravity, joints, and every effect that acts at rest.

use nalgebra::{DMatrix, DVector};

use super::Setup;
use crate::error::Result;
use crate::experiment::Support;
use crate::model::light::Beam;
use crate::model::{Chain, ForwardModel};

/// Parts of a link, so that the edge of a spot is seen.
const PARTS: usize = 16;
/// The chain of an experiment at rest.
#[derive(Debug)]
pub struct LitChain {
    model: ForwardModel,
    /// θ in the dark.
    dark_rad: DVector<f64>,
}

impl LitChain {
    /// The chain, with the spring that the strip's hinge has; none where the strip is clamped, which a chain cannot be.
    ///
    /// # Errors
    /// [`crate::Error::Simulation`].
    pub fn of(setup: &Setup) -> Result<Option<Self>> {
        let mut experiment = setup.experiment.clone();
        if experiment.rig.support == Support::Clamped {
            return Ok(None);
        }
        let spring = experiment.rig.support_stiffness_n_m_per_rad;
        if spring > 0.0 {
            let effects = &mut experiment.model.effects;
            effects.hinge_stiffness.get_or_insert(spring);
        }
        let model = ForwardModel::still(&experiment)?;
        let dark_rad = model.rest_rad(DVector::zeros(model.chain().count()), |_, _, _| {})?;
        Ok(Some(Self { model, dark_rad }))
    }

    /// How far light moves a point along x (m).
    ///
    /// # Errors
    /// [`crate::Error::Simulation`].
    pub fn moved_m(&self, beam: &Beam, s_m: f64) -> Result<f64> {
        let lit_rad = self.model.rest_rad(self.dark_rad.clone(), |theta, torque, stiffness| {
            add_push(self.model.chain(), beam, theta, torque, stiffness);
        })?;
        Ok(self.x_m(&lit_rad, s_m) - self.x_m(&self.dark_rad, s_m))
    }

    fn x_m(&self, theta_rad: &DVector<f64>, s_m: f64) -> f64 {
        let mut left_m = s_m;
        let mut x_m = 0.0;
        for (i, angle) in theta_rad.iter().enumerate() {
            let on_m = left_m.min(self.model.chain().length_m(i));
            x_m += on_m * angle.sin();
            left_m -= on_m;
        }
        x_m
    }
}

/// Adds the torques of light, and takes their derivatives from the stiffness.
fn add_push(chain: &Chain, beam: &Beam, theta: &DVector<f64>, torque: &mut DVector<f64>, stiffness: &mut DMatrix<f64>) {
    let mut above_m = 0.0;
    for j in 0..chain.count() {
        let length_m = chain.length_m(j);
        let part_m = length_m / PARTS as f64;
        for part in 0..PARTS {
            let on_m = (part as f64 + 0.5) * part_m;
            let push = beam.push(above_m + on_m, theta[j]);
            for i in 0..=j {
                let arm_m = part_m * if i == j { on_m } else { chain.length_m(i) };
                let (sin, cos) = theta[i].sin_cos();
                torque[i] += arm_m * (push.force_n_m[0] * cos - push.force_n_m[1] * sin);
                stiffness[(i, i)] += arm_m * (push.force_n_m[0] * sin + push.force_n_m[1] * cos);
                stiffness[(i, j)] -= arm_m * (push.slope_n_m_rad[0] * cos - push.slope_n_m_rad[1] * sin);
            }
        }
        above_m += length_m;
    }
}
