//! The equations of motion of the chain with its effects.

use nalgebra::{DMatrix, DVector};

use super::chain::{Chain, Motion};
use super::effects::{Effect, effects_of};
use crate::error::{Error, Result};
use crate::experiment::{Experiment, SupportMotion};

/// A chain under gravity, with its effects.
///
/// ```text
/// Σⱼ aᵢⱼ cos(θᵢ−θⱼ) θ̈ⱼ = −Σⱼ aᵢⱼ sin(θᵢ−θⱼ) θ̇ⱼ² − g hᵢ sin θᵢ + Qᵢ
/// ```
#[derive(Debug)]
pub struct ForwardModel {
    chain: Chain,
    gravity_m_s2: f64,
    support: Option<SupportMotion>,
    effects: Vec<Box<dyn Effect>>,
}

impl ForwardModel {
    /// The model an experiment describes.
    ///
    /// # Errors
    /// [`Error::Simulation`] when the specimen cannot swing or an effect is not simulated.
    pub fn of(experiment: &Experiment) -> Result<Self> {
        Ok(Self {
            chain: Chain::of(&experiment.specimen)?,
            gravity_m_s2: experiment.rig.gravity_m_s2,
            support: experiment.model.effects.support_motion,
            effects: effects_of(&experiment.model)?,
        })
    }

    /// The links.
    pub fn chain(&self) -> &Chain {
        &self.chain
    }

    /// Sideways position of the pivot (m): A sin(2πft + φ).
    pub fn pivot_m(&self, t_s: f64) -> f64 {
        self.support.map_or(0.0, |s| s.amplitude_m * phase_rad(&s, t_s).sin())
    }

    /// Everything the laws need at one instant; θ and θ̇ top to bottom.
    pub fn motion(&self, t_s: f64, theta_rad: &[f64], omega_rad_s: &[f64]) -> Motion {
        let mut motion = Motion::new(t_s, theta_rad, omega_rad_s);
        if let Some(support) = &self.support {
            let rate_rad_s = std::f64::consts::TAU * support.frequency_hz;
            motion.pivot_m_s = support.amplitude_m * rate_rad_s * phase_rad(support, t_s).cos();
            motion.pivot_m_s2 = -support.amplitude_m * rate_rad_s.powi(2) * phase_rad(support, t_s).sin();
        }
        motion
    }

    /// θ̈ (rad/s²).
    ///
    /// # Errors
    /// [`Error::Simulation`] when the inertia matrix is not positive (a negative added mass).
    pub fn acceleration(&self, motion: &Motion) -> Result<DVector<f64>> {
        let torque_n_m = self.torque(motion);
        let singular = || Error::Simulation { detail: format!("no inertia left at t = {:.3} s", motion.t_s) };
        Ok(self.inertia(motion).cholesky().ok_or_else(singular)?.solve(&torque_n_m))
    }

    /// Kinetic energy in the pivot's frame, gravity's from the hanging position, and what the effects store (J).
    pub fn energy_j(&self, motion: &Motion) -> f64 {
        let omega = DVector::from_column_slice(&motion.omega_rad_s);
        let kinetic_j = 0.5 * omega.dot(&(self.chain.inertia_at(motion) * &omega));
        let height_j = |i: usize| self.gravity_m_s2 * self.chain.static_moment_kg_m(i) * (1.0 - motion.cos[i]);
        let stored_j: f64 = self.effects.iter().map(|e| e.energy_j(&self.chain, motion)).sum();
        kinetic_j + (0..self.chain.count()).map(height_j).sum::<f64>() + stored_j
    }

    fn inertia(&self, motion: &Motion) -> DMatrix<f64> {
        let mut inertia_kg_m2 = self.chain.inertia_at(motion);
        for effect in &self.effects {
            effect.add_inertia(&self.chain, motion, &mut inertia_kg_m2);
        }
        inertia_kg_m2
    }

    fn torque(&self, motion: &Motion) -> DVector<f64> {
        let mut torque_n_m = self.chain.rotation_torque(motion);
        for i in 0..self.chain.count() {
            torque_n_m[i] -= self.gravity_m_s2 * self.chain.static_moment_kg_m(i) * motion.sin[i];
        }
        for effect in &self.effects {
            effect.add_torque(&self.chain, motion, &mut torque_n_m);
        }
        torque_n_m
    }
}

fn phase_rad(support: &SupportMotion, t_s: f64) -> f64 {
    std::f64::consts::TAU * support.frequency_hz * t_s + support.phase_rad
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::experiment::{Model, Rig};

    #[test]
    fn two_limp_rods_swing_at_1_3489_and_3_6180_hz() {
        let experiment = Experiment {
            rig: Rig { gravity_m_s2: 9.81, ..Rig::default() },
            model: Model { k_eq_n_m_per_rad: 0.0, c_eq_n_m_s_per_rad: 0.0, ..Model::default() },
            ..Experiment::default()
        };
        let model = ForwardModel::of(&experiment).unwrap();
        let tiny = 1e-6;
        let stiffness = DMatrix::from_columns(&[
            -model.torque(&model.motion(0.0, &[tiny, 0.0], &[0.0; 2])) / tiny,
            -model.torque(&model.motion(0.0, &[0.0, tiny], &[0.0; 2])) / tiny,
        ]);
        let inertia = model.inertia(&model.motion(0.0, &[0.0; 2], &[0.0; 2]));
        let squares = (inertia.try_inverse().unwrap() * stiffness).complex_eigenvalues();
        let mut hz: Vec<f64> = squares.iter().map(|l| l.re.sqrt() / std::f64::consts::TAU).collect();
        hz.sort_by(f64::total_cmp);
        assert!((hz[0] - 1.3489).abs() < 5e-5 && (hz[1] - 3.6180).abs() < 5e-5, "{hz:?}");
    }

    #[test]
    fn a_steady_side_force_turns_gravity() {
        let mut experiment = Experiment::default();
        experiment.model.effects.side_force = Some(1.3);
        let model = ForwardModel::of(&experiment).unwrap();
        let rest = (1.3f64 / experiment.rig.gravity_m_s2).atan();
        let alpha = model.acceleration(&model.motion(0.0, &[rest; 2], &[0.0; 2])).unwrap();
        assert!(alpha.norm() < 1e-9);
    }

    #[test]
    fn an_effect_that_is_not_simulated_is_refused() {
        let mut experiment = Experiment::default();
        experiment.model.effects.distributed_flexibility = Some(1e-6);
        let error = ForwardModel::of(&experiment).unwrap_err().to_string();
        assert!(error.contains("model.effects.distributed_flexibility is not simulated; remove it"), "{error}");
    }
}
