//! The rows of the table: what is particular to each effect and needs no fit.

use super::set_up::SetUp;
use crate::experiment::Sensor;
use crate::model::{EncoderShape, Parameter};

/// Where an effect acts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, serde::Serialize)]
#[serde(rename_all = "snake_case")]
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

/// Whether a torque acts with the position or with the velocity.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Phase {
    /// It stores energy.
    Position,
    /// It takes energy away, or gives it.
    Velocity,
}

impl Phase {
    /// The name in files.
    pub fn id(self) -> &'static str {
        match self {
            Self::Position => "position",
            Self::Velocity => "velocity",
        }
    }

    /// What it means.
    pub fn words(self) -> &'static str {
        match self {
            Self::Position => "in phase with the angle, as a spring does",
            Self::Velocity => "in phase with the velocity, as a damper does",
        }
    }
}

/// What makes an effect cost more than one motion a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cost {
    /// Nothing.
    Ordinary,
    /// It is looked for at every instant, but a motion serves them all.
    EveryInstant,
    /// It is looked for at every frequency.
    EveryFrequency,
    /// Every corner of its law ends a step of the integration.
    Corners,
    /// It makes the specimen a chain of many rods.
    ManyRods,
}

/// The main action of an effect on the motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Acts {
    /// It takes energy away, as the base model's own damper does.
    Loss,
    /// It changes the frequency, and so can put the base model out of step.
    Pace,
    /// Neither.
    Otherwise,
    /// It is a motion from outside, and exerts no torque of its own.
    Motion,
}

/// What a specimen must have for an effect to mean anything.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Requires {
    /// Nothing.
    Nothing,
    /// No angle but one.
    OneAngle,
    /// A joint.
    Joint,
    /// A specimen so heavy that a stand may yield to it.
    Weight,
    /// A joint with a spring.
    Spring,
    /// A joint with a spring that stands for the bending of a strip.
    Strip,
}

/// One row of the table.
#[derive(Debug)]
pub struct Entry {
    /// The identifier in files.
    pub id: &'static str,
    /// Its coefficients, the one in proportion to which it acts first.
    pub parameters: &'static [Parameter],
    /// Where it acts.
    pub place: Place,
    /// With what it goes.
    pub phase: Option<Phase>,
    /// What it costs.
    pub cost: Cost,
    /// What it does.
    pub acts: Acts,
    /// Whether it means anything.
    pub needs: Requires,
    /// The sensor that alone can have it; `None` where any can.
    pub sensor: Option<Sensor>,
    /// The part of its own torque by which its law may be wrong before something else is suspected beside it. That of friction and of hysteresis is larger: how they go
    /// with speed, and over from sticking to slip, has as many forms as there are authors.
    pub law_error: f64,
    /// Shapes of the grammar's terms that are this law, or within its error where no law is exact; of the angle where it goes with the position, of the rate elsewhere.
    pub shapes: &'static [&'static str],
    /// Whether it can stop a swing, at an instant that no derivative foretells.
    pub can_stop: bool,
    /// What a problem needs beyond its coefficients being free.
    pub(super) set_up: fn(&mut SetUp<'_>),
    /// In words, with an article.
    pub words: &'static str,
}

impl Entry {
    /// Whether it changes a frequency, or the scale of the angles at which that is seen.
    pub fn is_of_frequency(&self) -> bool {
        self.acts == Acts::Pace || self.sensor.is_some() && self.phase == Some(Phase::Position)
    }
}

/// Shapes of springs and dampers.
const PROPORTIONAL: &[&str] = &["in proportion"];
/// Shapes of dry friction, which may weaken with speed.
const DRY: &[&str] = &["sign", "sign that fades with speed"];
/// Of a law that is right to this part of its torque.
const EXACT: f64 = 0.002;
/// Of one that is a first approximation of what surfaces and fibres do (judgement).
const APPROXIMATE: f64 = 0.05;

const fn entry(parameters: &'static [Parameter], place: Place, acts: Acts, words: &'static str) -> Entry {
    let (cost, needs, law_error) = (Cost::Ordinary, Requires::Nothing, EXACT);
    let set_up: fn(&mut SetUp<'_>) = |_| {};
    Entry {
        id: "",
        parameters,
        place,
        phase: None,
        cost,
        acts,
        needs,
        sensor: None,
        law_error,
        shapes: &[],
        can_stop: false,
        set_up,
        words,
    }
}

const fn position(entry: Entry) -> Entry {
    Entry { phase: Some(Phase::Position), ..entry }
}

const fn of_camera(entry: Entry) -> Entry {
    Entry { sensor: Some(Sensor::Camera), ..entry }
}

const fn velocity(entry: Entry) -> Entry {
    Entry { phase: Some(Phase::Velocity), ..entry }
}

/// The table, those of the camera first: an error of measurement is not to be blamed on physics.
pub(super) static TABLE: [Entry; 21] = {
    use Acts::{Loss, Motion, Otherwise, Pace};
    use Parameter as P;
    use Place::{Air, Camera, Hinge, Joint};
    [
        of_camera(velocity(entry(&[P::TimeBase], Camera, Pace, "a wrong time base"))),
        Entry {
            cost: Cost::EveryInstant,
            ..velocity(entry(&[P::DroppedFrames], Camera, Otherwise, "frames or samples missing at one time"))
        },
        entry(&[P::CameraTilt], Camera, Otherwise, "a tilted camera, or a sensor with a wrong zero"),
        of_camera(position(entry(&[P::AngleGain], Camera, Otherwise, "a scale error common to all angles"))),
        Entry {
            id: "camera_oblique",
            set_up: |problem| problem.add_oblique_view(),
            ..of_camera(position(entry(&[P::ViewStretch, P::ViewShear], Camera, Otherwise, "an oblique camera view")))
        },
        Entry {
            id: "encoder_error",
            needs: Requires::OneAngle,
            sensor: Some(Sensor::Encoder),
            set_up: |problem| problem.add_encoder_error(),
            ..position(entry(
                &[
                    P::Encoder(EncoderShape::Sine),
                    P::Encoder(EncoderShape::Cosine),
                    P::Encoder(EncoderShape::Sine2),
                    P::Encoder(EncoderShape::Cosine2),
                    P::Encoder(EncoderShape::Zero),
                ],
                Camera,
                Otherwise,
                "an encoder off its axis or askew on it",
            ))
        },
        Entry {
            needs: Requires::Joint,
            ..of_camera(velocity(entry(
                &[P::DifferentialLag],
                Camera,
                Otherwise,
                "a time offset between θ1 and the other angles",
            )))
        },
        Entry {
            needs: Requires::Joint,
            ..entry(&[P::DifferentialZero], Camera, Otherwise, "a constant offset between θ1 and the other angles")
        },
        Entry {
            shapes: PROPORTIONAL,
            ..velocity(entry(&[P::HingeViscous], Hinge, Loss, "viscous friction of the hinge"))
        },
        Entry {
            can_stop: true,
            law_error: APPROXIMATE,
            shapes: DRY,
            ..velocity(entry(&[P::HingeCoulomb], Hinge, Loss, "dry friction of the hinge"))
        },
        Entry { shapes: PROPORTIONAL, ..position(entry(&[P::HingeStiffness], Hinge, Pace, "a spring at the hinge")) },
        Entry {
            needs: Requires::Joint,
            shapes: &["cube"],
            ..position(entry(&[P::JointCubicStiffness], Joint, Pace, "a joint whose stiffness changes with the bend"))
        },
        Entry {
            id: "joint_hysteretic",
            cost: Cost::Corners,
            needs: Requires::Joint,
            law_error: APPROXIMATE,
            set_up: |problem| problem.yields(),
            shapes: DRY,
            ..velocity(entry(&[P::HysteresisTorque, P::HysteresisYield], Joint, Loss, "hysteresis of the joint"))
        },
        Entry {
            needs: Requires::Spring,
            ..position(entry(&[P::RestCurl], Joint, Otherwise, "a strip that is curled at rest"))
        },
        Entry {
            shapes: PROPORTIONAL,
            ..velocity(entry(&[P::AirLinear], Air, Loss, "air drag in proportion to speed"))
        },
        Entry {
            shapes: &["square with its sign", "cube"],
            ..velocity(entry(&[P::AirQuadratic], Air, Loss, "air drag in proportion to speed squared"))
        },
        position(entry(&[P::AddedMass], Air, Pace, "added mass of the air")),
        entry(&[P::SideForce], Air, Otherwise, "a steady side force (light, a draught)"),
        Entry {
            id: "support_motion",
            cost: Cost::EveryFrequency,
            ..entry(&[P::SupportSine, P::SupportCosine, P::SupportFrequency], Hinge, Motion, "a moving support")
        },
        Entry {
            id: "support_flexibility",
            cost: Cost::EveryFrequency,
            needs: Requires::Weight,
            ..entry(
                &[P::SupportCompliance, P::SupportOwnFrequency, P::SupportDampingRatio],
                Hinge,
                Pace,
                "a stand that yields",
            )
        },
        Entry {
            cost: Cost::ManyRods,
            needs: Requires::Strip,
            set_up: |problem| problem.bend(),
            ..position(entry(&[P::BendingStiffness], Joint, Otherwise, "bending all along the strip"))
        },
    ]
};
