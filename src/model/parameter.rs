//! The numbers of a model that a fit may change.

use std::collections::BTreeSet;
use std::fmt;
use std::hash::{Hash, Hasher};
use std::sync::{Mutex, PoisonError};

use super::EncoderShape;

/// A coefficient of a law that a file states by a formula.
#[derive(Debug, Clone, Copy, Eq, PartialOrd, Ord)]
pub struct LawCoefficient {
    id: &'static str,
    unit: &'static str,
}

/// Equal texts are kept once, so that they are the same where they stand in the same place: this is asked at every stage of every step.
impl PartialEq for LawCoefficient {
    fn eq(&self, other: &Self) -> bool {
        std::ptr::eq(self.id, other.id) && std::ptr::eq(self.unit, other.unit)
    }
}

impl Hash for LawCoefficient {
    fn hash<H: Hasher>(&self, state: &mut H) {
        self.id.hash(state);
    }
}

impl LawCoefficient {
    /// By the names of the law and the coefficient, which make its identifier `law.name`. Names and units are kept as long as the program runs, once each.
    pub fn new(law: &str, name: &str, unit: &str) -> Self {
        Self { id: kept(&format!("{law}.{name}")), unit: kept(unit) }
    }
}

/// The text, kept as long as the program runs.
fn kept(text: &str) -> &'static str {
    static KEPT: Mutex<BTreeSet<&'static str>> = Mutex::new(BTreeSet::new());
    let mut kept = KEPT.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(known) = kept.get(text) {
        return known;
    }
    let text: &'static str = Box::leak(text.to_owned().into_boxed_str());
    kept.insert(text);
    text
}

/// What of a general link was measured before it swung.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum LinkProperty {
    /// Inertia about the centre of mass.
    Inertia,
    /// Distance of the centre of mass from the pivot.
    Com,
    /// Distance of the next link's pivot.
    Length,
}

/// A coefficient of the equations of motion, or of the camera.
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
    /// s of a stand that yields.
    SupportCompliance,
    /// f of that stand.
    SupportOwnFrequency,
    /// ζ of that stand.
    SupportDampingRatio,
    /// Of a link, the uppermost being 0.
    Link(u8, LinkProperty),
    /// ε of the camera's clock.
    TimeBase,
    /// Time of the frames missing at one instant.
    DroppedFrames,
    /// Common offset of the angles.
    CameraTilt,
    /// Common gain of the angles.
    AngleGain,
    /// s of a view askew.
    ViewStretch,
    /// b of a view askew.
    ViewShear,
    /// Of the error of an encoder.
    Encoder(EncoderShape),
    /// All angles but θ₁ are sampled later than that.
    DifferentialLag,
    /// Offset of all angles but θ₁.
    DifferentialZero,
    /// Of a law that the file states.
    Law(LawCoefficient),
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
            Self::SupportCompliance => "support_flexibility.compliance_m_per_n",
            Self::SupportOwnFrequency => "support_flexibility.frequency_hz",
            Self::SupportDampingRatio => "support_flexibility.damping_ratio",
            Self::Link(link, LinkProperty::Inertia) => kept(&format!("links.{}.inertia_kg_m2", link + 1)),
            Self::Link(link, LinkProperty::Com) => kept(&format!("links.{}.com_m", link + 1)),
            Self::Link(link, LinkProperty::Length) => kept(&format!("links.{}.length_m", link + 1)),
            Self::TimeBase => "time_base",
            Self::DroppedFrames => "dropped_frames",
            Self::CameraTilt => "camera_tilt",
            Self::AngleGain => "angle_gain",
            Self::ViewStretch => "camera_oblique.stretch",
            Self::ViewShear => "camera_oblique.shear",
            Self::Encoder(EncoderShape::Zero) => "encoder_error.zero_rad",
            Self::Encoder(EncoderShape::Sine) => "encoder_error.sine_rad",
            Self::Encoder(EncoderShape::Cosine) => "encoder_error.cosine_rad",
            Self::Encoder(EncoderShape::Sine2) => "encoder_error.sine_2_rad",
            Self::Encoder(EncoderShape::Cosine2) => "encoder_error.cosine_2_rad",
            Self::DifferentialLag => "differential_lag",
            Self::DifferentialZero => "differential_zero",
            Self::Law(coefficient) => coefficient.id,
        }
    }

    /// The unit.
    pub fn unit(self) -> &'static str {
        match self {
            Self::JointStiffness | Self::HingeStiffness => "N m/rad",
            Self::JointDamping | Self::HingeViscous => "N m s/rad",
            Self::RestCurl | Self::HysteresisYield | Self::CameraTilt | Self::DifferentialZero | Self::Encoder(_) => {
                "rad"
            }
            Self::BendingStiffness => "N m2",
            Self::JointCubicStiffness => "N m/rad3",
            Self::HysteresisTorque | Self::HingeCoulomb => "N m",
            Self::AirLinear => "N s/m2",
            Self::AirQuadratic => "kg/m2",
            Self::AddedMass => "kg/m",
            Self::SideForce => "m/s2",
            Self::SupportSine | Self::SupportCosine | Self::Link(_, LinkProperty::Com | LinkProperty::Length) => "m",
            Self::Link(_, LinkProperty::Inertia) => "kg m2",
            Self::SupportFrequency | Self::SupportOwnFrequency => "Hz",
            Self::SupportCompliance => "m/N",
            Self::SupportDampingRatio | Self::TimeBase | Self::AngleGain | Self::ViewStretch | Self::ViewShear => "1",
            Self::DroppedFrames | Self::DifferentialLag => "s",
            Self::Law(coefficient) => coefficient.unit,
        }
    }

    /// Whether it is the spring between two links, or along a strip.
    pub fn is_spring(self) -> bool {
        matches!(self, Self::JointStiffness | Self::BendingStiffness)
    }

    /// Whether only a specimen with a joint has it.
    pub fn is_of_joint(self) -> bool {
        matches!(
            self,
            Self::JointStiffness
                | Self::JointDamping
                | Self::RestCurl
                | Self::JointCubicStiffness
                | Self::HysteresisTorque
                | Self::HysteresisYield
                | Self::DifferentialLag
                | Self::DifferentialZero
        )
    }

    /// Whether its law is proportional to it, and gone at zero; a yield angle or a frequency only shapes a law.
    pub fn is_proportional(self) -> bool {
        let shapes =
            [Self::HysteresisYield, Self::SupportFrequency, Self::SupportOwnFrequency, Self::SupportDampingRatio];
        !shapes.contains(&self)
    }

    /// Whether nature allows only values from zero upwards.
    pub fn is_not_negative(self) -> bool {
        match self {
            Self::RestCurl
            | Self::JointCubicStiffness
            | Self::SideForce
            | Self::SupportSine
            | Self::SupportCosine
            | Self::TimeBase
            | Self::DroppedFrames
            | Self::CameraTilt
            | Self::AngleGain
            | Self::ViewStretch
            | Self::ViewShear
            | Self::Encoder(_)
            | Self::DifferentialLag
            | Self::DifferentialZero
            | Self::Law(_) => false,
            Self::JointStiffness
            | Self::JointDamping
            | Self::BendingStiffness
            | Self::HysteresisTorque
            | Self::HysteresisYield
            | Self::HingeViscous
            | Self::HingeCoulomb
            | Self::HingeStiffness
            | Self::AirLinear
            | Self::AirQuadratic
            | Self::AddedMass
            | Self::SupportFrequency
            | Self::SupportCompliance
            | Self::SupportOwnFrequency
            | Self::SupportDampingRatio
            | Self::Link(..) => true,
        }
    }

    /// The least value that it may take in a fit.
    pub fn least(self) -> f64 {
        match self {
            // seen from its edge, a plane is a line
            Self::ViewStretch => -0.99,
            // a yield angle or a frequency of zero has no meaning
            Self::HysteresisYield | Self::SupportFrequency | Self::SupportOwnFrequency => 1e-4,
            other if other.is_not_negative() => 0.0,
            _ => f64::NEG_INFINITY,
        }
    }

    /// Every parameter but those of links and of stated laws.
    pub const ALL: [Self; 33] = [
        Self::JointStiffness,
        Self::JointDamping,
        Self::RestCurl,
        Self::BendingStiffness,
        Self::JointCubicStiffness,
        Self::HysteresisTorque,
        Self::HysteresisYield,
        Self::HingeViscous,
        Self::HingeCoulomb,
        Self::HingeStiffness,
        Self::AirLinear,
        Self::AirQuadratic,
        Self::AddedMass,
        Self::SideForce,
        Self::SupportSine,
        Self::SupportCosine,
        Self::SupportFrequency,
        Self::SupportCompliance,
        Self::SupportOwnFrequency,
        Self::SupportDampingRatio,
        Self::TimeBase,
        Self::DroppedFrames,
        Self::CameraTilt,
        Self::AngleGain,
        Self::ViewStretch,
        Self::ViewShear,
        Self::Encoder(EncoderShape::Zero),
        Self::Encoder(EncoderShape::Sine),
        Self::Encoder(EncoderShape::Cosine),
        Self::Encoder(EncoderShape::Sine2),
        Self::Encoder(EncoderShape::Cosine2),
        Self::DifferentialLag,
        Self::DifferentialZero,
    ];
}

impl fmt::Display for Parameter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.id())
    }
}
