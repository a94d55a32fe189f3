//! The torques beyond gravity, one law each. Identifiers are those of `[model.effects]`.
//!
//! | file | effects |
//! |---|---|
//! | [`hinge`] | `hinge_viscous`, `hinge_coulomb`, `hinge_stiffness` |
//! | [`joint`] | the joint's spring and damper, `rest_curl`, `joint_cubic_stiffness`, `joint_hysteretic` |
//! | [`air`] | `air_linear`, `air_quadratic`, `added_mass` |
//! | [`formula`] | those that a file states by a formula |
//! | [`bearing`] | the load that a formula may go with |
//! | [`outside`] | `side_force`, `support_motion`, nodal forces |
//! | [`support`] | `support_flexibility` |
//!
//! `distributed_flexibility` is a chain of more links, see [`Chain::continuous`](super::Chain::continuous). Camera effects (`time_base`, `dropped_frames`,
//! `camera_tilt`, `angle_gain`, `camera_oblique`, `encoder_error`, `differential_lag`, `differential_zero`) change the observation, not the motion.

pub mod air;
pub mod bearing;
pub mod formula;
pub mod hinge;
pub mod joint;
pub mod load;
pub mod outside;
pub mod support;

use super::{Chain, Motion, Parameter, Partials};
use crate::experiment::Model;

/// One law: what it adds to the sum of torques Q = 0 (d'Alembert: inertia is a torque, too).
///
/// `q` and the rows of the partials are the n links' equations (N·m), then those of the laws' own variables.
pub trait Effect: std::fmt::Debug + Send + Sync {
    /// Adds its generalised torques, of the work Qᵢ δθᵢ.
    fn add_torque(&self, chain: &Chain, motion: &Motion, q: &mut [f64]);

    /// Adds the derivatives of these torques.
    fn add_partials(&self, chain: &Chain, motion: &Motion, partials: &mut Partials);

    /// Its coefficients.
    fn parameters(&self) -> Vec<(Parameter, f64)> {
        Vec::new()
    }

    /// Sets a coefficient; those of other laws are left alone.
    fn set(&mut self, _parameter: Parameter, _value: f64) {}

    /// Adds ∂Q/∂coefficient.
    fn add_sensitivity(&self, _parameter: Parameter, _chain: &Chain, _motion: &Motion, _q: &mut [f64]) {}

    /// Adds ∂Q/∂(a parameter of a link), where its torques depend on the links' masses and lengths.
    fn add_sensitivity_of_links(&self, _parameter: Parameter, _chain: &Chain, _motion: &Motion, _q: &mut [f64]) {}

    /// Whether its torques are linear in the accelerations.
    fn is_linear_in_accelerations(&self) -> bool {
        true
    }

    /// What the hinge's dry friction can hold (N·m), where it is such a law.
    fn friction_n_m(&self, _chain: &Chain, _motion: &Motion) -> Option<f64> {
        None
    }

    /// The sideways acceleration that all masses feel from it (m/s²), on which the derivatives with masses and lengths depend.
    fn sideways_m_s2(&self, _motion: &Motion) -> f64 {
        0.0
    }

    /// Energy it stores (J).
    fn energy_j(&self, _chain: &Chain, _motion: &Motion) -> f64 {
        0.0
    }

    /// Number of variables it keeps in mind between instants.
    fn hidden(&self, _chain: &Chain) -> usize {
        0
    }

    /// The torque (N·m) of a unit of those variables, and the angle (rad) that it moves at most.
    fn of_hidden(&self, _chain: &Chain) -> [f64; 2] {
        [0.0; 2]
    }

    /// Whether its variables are a coordinate and its rate, which may have any value where a motion starts; others start at zero.
    fn begins_free(&self) -> bool {
        false
    }

    /// What it adds to the cost of a step, where that is not next to nothing, in the unit of [`Work`](crate::model::Work).
    fn work(&self, _chain: &Chain) -> u64 {
        0
    }

    /// Instants at which it changes suddenly.
    fn discontinuities_s(&self) -> Vec<f64> {
        Vec::new()
    }

    /// Quantities at whose zeros it has corners, of the rates alone: adds them in an order that does not change, in pairs of a rate and what follows it.
    fn add_switching_functions(&self, _chain: &Chain, _motion: &Motion, _corners: &mut Vec<f64>) {}

    /// Quantities at whose zeros its force bends, of the angles and rates: adds them in an order that does not change.
    fn add_kinks(&self, _chain: &Chain, _motion: &Motion, _kinks: &mut Vec<f64>) {}

    /// The pivot's motion, from the law that prescribes it.
    fn pivot(&self) -> Option<&outside::SupportMotion> {
        None
    }
}

/// A law that is proportional to one coefficient.
pub trait Law: std::fmt::Debug + Send + Sync {
    /// The coefficient.
    const PARAMETER: Parameter;

    /// Adds its torques for a coefficient.
    fn add_torque(&self, chain: &Chain, motion: &Motion, coefficient: f64, q: &mut [f64]);

    /// Adds their derivatives.
    fn add_partials(&self, chain: &Chain, motion: &Motion, coefficient: f64, partials: &mut Partials);

    /// Energy it stores (J).
    fn energy_j(&self, _chain: &Chain, _motion: &Motion, _coefficient: f64) -> f64 {
        0.0
    }

    /// What the hinge's dry friction can hold (N·m), where it is such a law.
    fn friction_n_m(&self, _coefficient: f64) -> Option<f64> {
        None
    }

    /// The sideways acceleration that all masses feel from it (m/s²).
    fn sideways_m_s2(&self, _coefficient: f64) -> f64 {
        0.0
    }

    /// What it adds to the cost of a step, where that is not next to nothing.
    fn work(&self, _chain: &Chain) -> u64 {
        0
    }
}

/// A [`Law`] with its coefficient.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Proportional<L> {
    /// The law.
    pub law: L,
    /// In the unit of its [`Parameter`].
    pub coefficient: f64,
}

impl<L: Law> Effect for Proportional<L> {
    fn add_torque(&self, chain: &Chain, motion: &Motion, q: &mut [f64]) {
        self.law.add_torque(chain, motion, self.coefficient, q);
    }

    fn add_partials(&self, chain: &Chain, motion: &Motion, partials: &mut Partials) {
        self.law.add_partials(chain, motion, self.coefficient, partials);
    }

    fn parameters(&self) -> Vec<(Parameter, f64)> {
        vec![(L::PARAMETER, self.coefficient)]
    }

    fn set(&mut self, parameter: Parameter, value: f64) {
        if parameter == L::PARAMETER {
            self.coefficient = value;
        }
    }

    fn add_sensitivity(&self, parameter: Parameter, chain: &Chain, motion: &Motion, q: &mut [f64]) {
        if parameter == L::PARAMETER {
            self.law.add_torque(chain, motion, 1.0, q);
        }
    }

    fn energy_j(&self, chain: &Chain, motion: &Motion) -> f64 {
        self.law.energy_j(chain, motion, self.coefficient)
    }

    fn friction_n_m(&self, _: &Chain, _: &Motion) -> Option<f64> {
        self.law.friction_n_m(self.coefficient)
    }

    fn sideways_m_s2(&self, _: &Motion) -> f64 {
        self.law.sideways_m_s2(self.coefficient)
    }

    fn work(&self, chain: &Chain) -> u64 {
        self.law.work(chain)
    }
}

/// The laws switched on in a model; `mark_length_m` is the length between marks, of which EI = Kℓ.
pub fn effects_of(model: &Model, mark_length_m: f64) -> Vec<Box<dyn Effect>> {
    fn add<L: Law + 'static>(effects: &mut Vec<Box<dyn Effect>>, law: L, coefficient: Option<f64>) {
        if let Some(coefficient) = coefficient {
            effects.push(Box::new(Proportional { law, coefficient }));
        }
    }
    let on = &model.effects;
    let stiffness = on.distributed_flexibility.map(|bending| bending / mark_length_m);
    let mut effects: Vec<Box<dyn Effect>> = vec![Box::new(joint::SpringDamper {
        stiffness_n_m_per_rad: stiffness.unwrap_or(model.k_eq_n_m_per_rad),
        damping_n_m_s_per_rad: model.c_eq_n_m_s_per_rad,
        rest_rad: on.rest_curl.unwrap_or(0.0),
        length_m: mark_length_m,
    })];
    add(&mut effects, hinge::Viscous, on.hinge_viscous);
    add(&mut effects, hinge::Coulomb, on.hinge_coulomb);
    add(&mut effects, hinge::Stiffness, on.hinge_stiffness);
    add(&mut effects, joint::CubicSpring, on.joint_cubic_stiffness);
    add(&mut effects, air::LinearDrag, on.air_linear);
    add(&mut effects, air::QuadraticDrag, on.air_quadratic);
    add(&mut effects, air::AddedMass, on.added_mass);
    add(&mut effects, outside::SideForce, on.side_force);
    if let Some(law) = on.joint_hysteretic {
        effects.push(Box::new(joint::Hysteresis { torque_n_m: law.torque_n_m, yield_rad: law.yield_rad }));
    }
    if let Some(support) = on.support_motion {
        let (sin, cos) = support.phase_rad.sin_cos();
        effects.push(Box::new(outside::SupportMotion {
            sine_m: support.amplitude_m * cos,
            cosine_m: support.amplitude_m * sin,
            frequency_hz: support.frequency_hz,
        }));
    }
    let stand = on.support_flexibility.map(|stand| support::SupportFlexibility {
        compliance_m_per_n: stand.compliance_m_per_n,
        frequency_hz: stand.frequency_hz,
        damping_ratio: stand.damping_ratio,
    });
    effects.extend(stand.map(|stand| Box::new(stand) as Box<dyn Effect>));
    effects.extend(model.law.iter().filter_map(formula::Formula::of).map(|law| Box::new(law) as Box<dyn Effect>));
    effects
}
