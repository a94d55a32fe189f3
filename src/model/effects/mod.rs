//! The torques beyond gravity, one law each. Identifiers are those of `[model.effects]`.
//!
//! | file | effects |
//! |---|---|
//! | [`hinge`] | `hinge_viscous`, `hinge_coulomb`, `hinge_stiffness` |
//! | [`joint`] | the joint's spring and damper, `rest_curl`, `joint_cubic_stiffness` |
//! | [`air`] | `air_linear`, `air_quadratic`, `added_mass` |
//! | [`outside`] | `side_force`, `support_motion` |
//!
//! `joint_hysteretic` and `distributed_flexibility` are not simulated. Camera effects (`time_base`, `dropped_frames`, `camera_tilt`,
//! `angle_gain`, `differential_lag`) change the observation, not the motion: see [`crate::synth::swing`].

pub mod air;
pub mod hinge;
pub mod joint;
pub mod outside;

use nalgebra::{DMatrix, DVector};

use super::chain::{Chain, Motion};
use crate::error::{Error, Result};
use crate::experiment::Model;

/// One law: what it adds to the equations of motion.
pub trait Effect: std::fmt::Debug + Send + Sync {
    /// Adds its generalised torques Qᵢ (N·m), of the work Qᵢ δθᵢ.
    fn add_torque(&self, chain: &Chain, motion: &Motion, torque_n_m: &mut DVector<f64>);

    /// Adds to the inertia matrix (kg·m²).
    fn add_inertia(&self, _chain: &Chain, _motion: &Motion, _inertia_kg_m2: &mut DMatrix<f64>) {}

    /// Energy it stores (J).
    fn energy_j(&self, _chain: &Chain, _motion: &Motion) -> f64 {
        0.0
    }
}

/// The laws switched on in a model.
///
/// # Errors
/// [`Error::Simulation`] for a law that is not simulated.
pub fn effects_of(model: &Model) -> Result<Vec<Box<dyn Effect>>> {
    let on = &model.effects;
    for (id, present) in [
        ("joint_hysteretic", on.joint_hysteretic.is_some()),
        ("distributed_flexibility", on.distributed_flexibility.is_some()),
    ] {
        if present {
            return Err(Error::Simulation { detail: format!("model.effects.{id} is not simulated; remove it") });
        }
    }
    let mut effects: Vec<Box<dyn Effect>> = vec![Box::new(joint::SpringDamper {
        stiffness_n_m_per_rad: model.k_eq_n_m_per_rad,
        damping_n_m_s_per_rad: model.c_eq_n_m_s_per_rad,
        rest_rad: on.rest_curl.unwrap_or(0.0),
    })];
    let mut add = |effect: Box<dyn Effect>| effects.push(effect);
    if let Some(damping_n_m_s_per_rad) = on.hinge_viscous {
        add(Box::new(hinge::Viscous { damping_n_m_s_per_rad }));
    }
    if let Some(torque_n_m) = on.hinge_coulomb {
        add(Box::new(hinge::Coulomb { torque_n_m }));
    }
    if let Some(stiffness_n_m_per_rad) = on.hinge_stiffness {
        add(Box::new(hinge::Stiffness { stiffness_n_m_per_rad }));
    }
    if let Some(stiffness_n_m_per_rad3) = on.joint_cubic_stiffness {
        let rest_rad = on.rest_curl.unwrap_or(0.0);
        add(Box::new(joint::CubicSpring { stiffness_n_m_per_rad3, rest_rad }));
    }
    if let Some(drag_n_s_m2) = on.air_linear {
        add(Box::new(air::LinearDrag { drag_n_s_m2 }));
    }
    if let Some(drag_kg_m2) = on.air_quadratic {
        add(Box::new(air::QuadraticDrag { drag_kg_m2 }));
    }
    if let Some(mass_kg_m) = on.added_mass {
        add(Box::new(air::AddedMass { mass_kg_m }));
    }
    if let Some(acceleration_m_s2) = on.side_force {
        add(Box::new(outside::SideForce { acceleration_m_s2 }));
    }
    if on.support_motion.is_some() {
        add(Box::new(outside::SupportMotion));
    }
    Ok(effects)
}
