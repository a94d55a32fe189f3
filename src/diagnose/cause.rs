//! What a base model may lack: the table of effects.

use std::fmt;

use crate::experiment::Experiment;
use crate::model::Parameter;

/// An effect of the table, by the identifier it has in files.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Cause {
    /// True time runs faster or slower than the stamps.
    TimeBase,
    /// Frames are missing at one instant.
    DroppedFrames,
    /// A common offset of the angles.
    CameraTilt,
    /// A common gain of the angles.
    AngleGain,
    /// θ₂ is sampled later than θ₁.
    DifferentialLag,
    /// Viscous friction of the hinge.
    HingeViscous,
    /// Dry friction of the hinge.
    HingeCoulomb,
    /// A spring at the hinge.
    HingeStiffness,
    /// A joint that stiffens or softens with the bend.
    JointCubicStiffness,
    /// A loss in the joint that does not depend on frequency.
    JointHysteretic,
    /// A joint that rests bent.
    RestCurl,
    /// Drag in proportion to speed.
    AirLinear,
    /// Drag in proportion to speed squared.
    AirQuadratic,
    /// Air carried along.
    AddedMass,
    /// A steady sideways acceleration.
    SideForce,
    /// The pivot moves to and fro.
    SupportMotion,
    /// The strip bends everywhere.
    DistributedFlexibility,
}

/// Where an effect acts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Place {
    /// The hinge, and the pivot that carries it.
    Hinge,
    /// The joint between two links, or the strip's own bending.
    Joint,
    /// Along the strip, from outside.
    Air,
    /// The camera.
    Camera,
}

impl Place {
    /// The places of losses.
    pub const OF_LOSSES: [Self; 3] = [Self::Hinge, Self::Joint, Self::Air];

    /// The name in files.
    pub fn id(self) -> &'static str {
        match self {
            Self::Hinge => "hinge",
            Self::Joint => "joint",
            Self::Air => "air",
            Self::Camera => "camera",
        }
    }
}

impl Cause {
    /// Every effect, those of the camera first: an error of measurement is not to be blamed on physics.
    pub const ALL: [Self; 17] = [
        Self::TimeBase,
        Self::DroppedFrames,
        Self::CameraTilt,
        Self::AngleGain,
        Self::DifferentialLag,
        Self::HingeViscous,
        Self::HingeCoulomb,
        Self::HingeStiffness,
        Self::JointCubicStiffness,
        Self::JointHysteretic,
        Self::RestCurl,
        Self::AirLinear,
        Self::AirQuadratic,
        Self::AddedMass,
        Self::SideForce,
        Self::SupportMotion,
        Self::DistributedFlexibility,
    ];

    /// The identifier in files.
    pub fn id(self) -> &'static str {
        match self {
            Self::JointHysteretic => "joint_hysteretic",
            Self::SupportMotion => "support_motion",
            one => one.parameters()[0].id(),
        }
    }

    /// Its coefficients, the one in proportion to which it acts first.
    pub fn parameters(self) -> &'static [Parameter] {
        match self {
            Self::TimeBase => &[Parameter::TimeBase],
            Self::DroppedFrames => &[Parameter::DroppedFrames],
            Self::CameraTilt => &[Parameter::CameraTilt],
            Self::AngleGain => &[Parameter::AngleGain],
            Self::DifferentialLag => &[Parameter::DifferentialLag],
            Self::HingeViscous => &[Parameter::HingeViscous],
            Self::HingeCoulomb => &[Parameter::HingeCoulomb],
            Self::HingeStiffness => &[Parameter::HingeStiffness],
            Self::JointCubicStiffness => &[Parameter::JointCubicStiffness],
            Self::JointHysteretic => &[Parameter::HysteresisTorque, Parameter::HysteresisYield],
            Self::RestCurl => &[Parameter::RestCurl],
            Self::AirLinear => &[Parameter::AirLinear],
            Self::AirQuadratic => &[Parameter::AirQuadratic],
            Self::AddedMass => &[Parameter::AddedMass],
            Self::SideForce => &[Parameter::SideForce],
            Self::SupportMotion => &[Parameter::SupportSine, Parameter::SupportCosine, Parameter::SupportFrequency],
            Self::DistributedFlexibility => &[Parameter::BendingStiffness],
        }
    }

    /// Whether it has no derivative at the outset and is looked for at every instant, or frequency: the best of many gains by chance alone.
    pub fn is_scanned(self) -> bool {
        matches!(self, Self::DroppedFrames | Self::SupportMotion)
    }

    /// Where it acts.
    pub fn place(self) -> Place {
        match self {
            Self::TimeBase | Self::DroppedFrames | Self::CameraTilt | Self::AngleGain | Self::DifferentialLag => {
                Place::Camera
            }
            Self::HingeViscous | Self::HingeCoulomb | Self::HingeStiffness | Self::SupportMotion => Place::Hinge,
            Self::JointCubicStiffness | Self::JointHysteretic | Self::RestCurl | Self::DistributedFlexibility => {
                Place::Joint
            }
            Self::AirLinear | Self::AirQuadratic | Self::AddedMass | Self::SideForce => Place::Air,
        }
    }

    /// In words, with an article.
    pub fn words(self) -> &'static str {
        match self {
            Self::TimeBase => "a camera clock that runs wrong",
            Self::DroppedFrames => "frames missing at one instant",
            Self::CameraTilt => "a tilted camera",
            Self::AngleGain => "a common gain of the angles (oblique view, pixels that are not square)",
            Self::DifferentialLag => "a lag of θ2 behind θ1 (rolling shutter, filter)",
            Self::HingeViscous => "viscous friction of the hinge",
            Self::HingeCoulomb => "dry friction of the hinge",
            Self::HingeStiffness => "a spring at the hinge",
            Self::JointCubicStiffness => "a joint whose stiffness changes with the bend",
            Self::JointHysteretic => "hysteresis of the joint",
            Self::RestCurl => "a strip that is curled at rest",
            Self::AirLinear => "air drag in proportion to speed",
            Self::AirQuadratic => "air drag in proportion to speed squared",
            Self::AddedMass => "air that swings along",
            Self::SideForce => "a steady side force (light, a draught)",
            Self::SupportMotion => "a support that moves",
            Self::DistributedFlexibility => "bending all along the strip",
        }
    }

    /// Whether it is missing from the base model of an experiment with this many angles, and can be missing at all.
    pub fn may_be_missing(self, experiment: &Experiment, base: &[Parameter], marks: usize) -> bool {
        let strip = experiment.specimen.links.is_empty();
        let meaningful = match self {
            Self::DifferentialLag | Self::JointCubicStiffness | Self::JointHysteretic => marks > 1,
            Self::RestCurl => base.iter().any(|parameter| parameter.is_spring()),
            Self::DistributedFlexibility => marks > 1 && strip && base.contains(&Parameter::JointStiffness),
            _ => true,
        };
        // a camera that misses frames, and the first coefficient of a named effect
        meaningful && !self.parameters().iter().any(|p| base.contains(p)) && !self.is_set(experiment)
    }

    fn is_set(self, experiment: &Experiment) -> bool {
        self == Self::DroppedFrames && experiment.model.effects.dropped_frames.is_some()
    }
}

impl fmt::Display for Cause {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.id())
    }
}
