//! The numbers of a model that a fit may change.

use std::fmt;

/// A coefficient of the equations of motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Parameter {
    /// K, the joint's spring.
    JointStiffness,
    /// C, the joint's damper.
    JointDamping,
    /// κ.
    RestCurl,
    /// EI, in place of K.
    BendingStiffness,
    /// k₃.
    JointCubicStiffness,
    /// Largest hysteretic torque.
    HysteresisTorque,
    /// Angle at which the hysteresis yields.
    HysteresisYield,
    /// c of the hinge.
    HingeViscous,
    /// τ of the hinge.
    HingeCoulomb,
    /// k of the hinge.
    HingeStiffness,
    /// c of the linear drag.
    AirLinear,
    /// c of the quadratic drag.
    AirQuadratic,
    /// mₐ.
    AddedMass,
    /// a.
    SideForce,
    /// Sine part of the pivot's motion.
    SupportSine,
    /// Cosine part of the pivot's motion.
    SupportCosine,
    /// Frequency of the pivot's motion.
    SupportFrequency,
}

impl Parameter {
    /// The name in files: the key of `[model]`, or the effect's identifier.
    pub fn id(self) -> &'static str {
        match self {
            Self::JointStiffness => "k_eq_n_m_per_rad",
            Self::JointDamping => "c_eq_n_m_s_per_rad",
            Self::RestCurl => "rest_curl",
            Self::BendingStiffness => "distributed_flexibility",
            Self::JointCubicStiffness => "joint_cubic_stiffness",
            Self::HysteresisTorque => "joint_hysteretic.torque_n_m",
            Self::HysteresisYield => "joint_hysteretic.yield_rad",
            Self::HingeViscous => "hinge_viscous",
            Self::HingeCoulomb => "hinge_coulomb",
            Self::HingeStiffness => "hinge_stiffness",
            Self::AirLinear => "air_linear",
            Self::AirQuadratic => "air_quadratic",
            Self::AddedMass => "added_mass",
            Self::SideForce => "side_force",
            Self::SupportSine => "support_motion.sine_m",
            Self::SupportCosine => "support_motion.cosine_m",
            Self::SupportFrequency => "support_motion.frequency_hz",
        }
    }

    /// The unit.
    pub fn unit(self) -> &'static str {
        match self {
            Self::JointStiffness | Self::HingeStiffness => "N m/rad",
            Self::JointDamping | Self::HingeViscous => "N m s/rad",
            Self::RestCurl | Self::HysteresisYield => "rad",
            Self::BendingStiffness => "N m2",
            Self::JointCubicStiffness => "N m/rad3",
            Self::HysteresisTorque | Self::HingeCoulomb => "N m",
            Self::AirLinear => "N s/m2",
            Self::AirQuadratic => "kg/m2",
            Self::AddedMass => "kg/m",
            Self::SideForce => "m/s2",
            Self::SupportSine | Self::SupportCosine => "m",
            Self::SupportFrequency => "Hz",
        }
    }

    /// Whether nature allows only values from zero upwards.
    pub fn is_not_negative(self) -> bool {
        !matches!(
            self,
            Self::RestCurl | Self::JointCubicStiffness | Self::SideForce | Self::SupportSine | Self::SupportCosine
        )
    }
}

impl fmt::Display for Parameter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.id())
    }
}
