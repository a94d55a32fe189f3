//! The base model: what a fit leaves free unless told otherwise.

use crate::experiment::Experiment;
use crate::model::{EncoderShape, Parameter};

/// The joint's spring (where it has one) and damper, or of one link the hinge's viscous damper; and every effect named in `[model.effects]` or law stated in `[[model.law]]`.
///
/// A joint whose `k_eq_n_m_per_rad` is 0 has no spring; a strip with `distributed_flexibility` has EI in place of K.
pub fn base_parameters(experiment: &Experiment, marks: usize) -> Vec<Parameter> {
    let effects = &experiment.model.effects;
    let mut free = Vec::new();
    if marks > 1 {
        if effects.distributed_flexibility.is_some() {
            free.push(Parameter::BendingStiffness);
        } else if experiment.model.k_eq_n_m_per_rad > 0.0 {
            free.push(Parameter::JointStiffness);
        }
        free.push(Parameter::JointDamping);
    } else {
        free.push(Parameter::HingeViscous);
    }
    let named = [
        (effects.rest_curl, Parameter::RestCurl),
        (effects.joint_cubic_stiffness, Parameter::JointCubicStiffness),
        (effects.joint_hysteretic.map(|h| h.torque_n_m), Parameter::HysteresisTorque),
        (effects.joint_hysteretic.map(|h| h.yield_rad), Parameter::HysteresisYield),
        (effects.hinge_viscous, Parameter::HingeViscous),
        (effects.hinge_coulomb, Parameter::HingeCoulomb),
        (effects.hinge_stiffness, Parameter::HingeStiffness),
        (effects.air_linear, Parameter::AirLinear),
        (effects.air_quadratic, Parameter::AirQuadratic),
        (effects.added_mass, Parameter::AddedMass),
        (effects.side_force, Parameter::SideForce),
        (effects.support_motion.map(|s| s.amplitude_m), Parameter::SupportSine),
        (effects.support_motion.map(|s| s.amplitude_m), Parameter::SupportCosine),
        (effects.support_motion.map(|s| s.frequency_hz), Parameter::SupportFrequency),
        (effects.support_flexibility.map(|s| s.compliance_m_per_n), Parameter::SupportCompliance),
        (effects.support_flexibility.map(|s| s.frequency_hz), Parameter::SupportOwnFrequency),
        (effects.support_flexibility.map(|s| s.damping_ratio), Parameter::SupportDampingRatio),
        (effects.time_base, Parameter::TimeBase),
        (effects.camera_tilt, Parameter::CameraTilt),
        (effects.angle_gain, Parameter::AngleGain),
        (effects.camera_oblique.map(|view| view.stretch), Parameter::ViewStretch),
        (effects.camera_oblique.map(|view| view.shear), Parameter::ViewShear),
        (effects.differential_lag, Parameter::DifferentialLag),
        (effects.differential_zero, Parameter::DifferentialZero),
    ];
    let named = named.into_iter().filter_map(|(value, parameter)| value.map(|_| parameter));
    let of_encoder = effects.encoder_error.iter().flat_map(|_| EncoderShape::ALL.map(Parameter::Encoder));
    let named = named.chain(of_encoder);
    let stated = experiment.model.law.iter().flat_map(|law| law.coefficients().map(|(parameter, _)| parameter));
    let named = named.chain(stated);
    free.extend(named.filter(|p| !free.contains(p)).collect::<Vec<_>>());
    free
}
