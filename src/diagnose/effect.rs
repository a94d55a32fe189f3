//! What a base model may lack: the table of effects. All that is particular to a law and needs no fit stands in its entry; how it is sought, in
//! [`super::laws`].

use std::fmt;

use crate::experiment::{Experiment, Hysteresis, Sensor};
use crate::fit::Belief;
use crate::model::Parameter;

/// An effect of the table, by the identifier it has in files.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Effect {
    /// True time runs faster or slower than the stamps.
    TimeBase,
    /// Frames are missing at one instant.
    DroppedFrames,
    /// A common offset of the angles.
    CameraTilt,
    /// A common gain of the angles.
    AngleGain,
    /// A camera that looks at the plane of the swing askew.
    CameraOblique,
    /// θ₂ is sampled later than θ₁.
    DifferentialLag,
    /// An offset of θ₂ that θ₁ does not have.
    DifferentialZero,
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
    /// A joint.
    Joint,
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
    /// Whether it is excluded where the sensor is an encoder.
    pub of_camera: bool,
    /// The part of its own torque by which its law may be wrong before something else is suspected beside it. That of friction and of hysteresis is larger: how they go
    /// with speed, and over from sticking to slip, has as many forms as there are authors.
    pub law_error: f64,
    /// Shapes of the grammar's terms that are this law, or within its error where no law is exact; of the angle where it goes with the position, of the rate elsewhere.
    pub shapes: &'static [&'static str],
    /// Whether it can stop a swing, at an instant that no derivative foretells.
    pub can_stop: bool,
    /// What a problem needs beyond its coefficients being free.
    set_up: fn(&mut SetUp<'_>),
    /// In words, with an article.
    pub words: &'static str,
}

impl Entry {
    /// Whether it changes a frequency, or the scale of the angles at which that is seen.
    pub fn is_of_frequency(&self) -> bool {
        self.acts == Acts::Pace || self.of_camera && self.phase == Some(Phase::Position)
    }
}

/// A problem that is being set up, and what of the recordings that may depend on.
pub struct SetUp<'s> {
    /// Free parameters.
    pub free: &'s mut Vec<Parameter>,
    /// What is known of them.
    pub beliefs: &'s mut Vec<Belief>,
    /// The model.
    pub experiment: &'s mut Experiment,
    /// A yield angle to expect, and its standard deviation.
    pub yield_rad: (f64, f64),
    /// Standard deviation of the stretch and of the shear of a view to expect.
    pub view: f64,
    /// The strip that bends everywhere.
    pub strip: BendingStrip,
}

/// A strip that bends everywhere, before it is fitted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BendingStrip {
    /// Rods between two marks.
    pub rods: usize,
    /// EI at which its shapes are taken; where it is not known, as stiff as the joint whose place it takes.
    pub bending_n_m2: Option<f64>,
}

/// EI of a strip that is as stiff between two marks as a joint.
pub fn bending_n_m2(joint_n_m_per_rad: f64, experiment: &Experiment) -> f64 {
    let lengths_m = experiment.specimen.lengths_m();
    joint_n_m_per_rad * lengths_m.iter().sum::<f64>() / lengths_m.len() as f64
}

impl SetUp<'_> {
    /// A strip that bends everywhere takes the place of the joint's spring, and begins as stiff.
    fn bend(&mut self) {
        self.free.retain(|p| *p != Parameter::JointStiffness);
        let model = &mut self.experiment.model;
        model.pieces = self.strip.rods;
        let as_stiff = bending_n_m2(model.k_eq_n_m_per_rad, self.experiment);
        self.experiment.model.effects.distributed_flexibility = Some(self.strip.bending_n_m2.unwrap_or(as_stiff));
    }

    /// A hysteresis yields somewhere near a usual angle.
    fn yields(&mut self) {
        let (yield_rad, sd) = self.yield_rad;
        self.beliefs.push(Belief { parameter: Parameter::HysteresisYield, value: yield_rad, sd });
        self.experiment.model.effects.joint_hysteretic = Some(Hysteresis { torque_n_m: 0.0, yield_rad });
    }

    /// A camera looks askew by no more than its owner fails to see.
    fn add_oblique_view(&mut self) {
        let of = |parameter| Belief { parameter, value: 0.0, sd: self.view };
        self.beliefs.extend([Parameter::ViewStretch, Parameter::ViewShear].map(of));
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
        of_camera: false,
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
    Entry { of_camera: true, ..entry }
}

const fn velocity(entry: Entry) -> Entry {
    Entry { phase: Some(Phase::Velocity), ..entry }
}

/// The table, those of the camera first: an error of measurement is not to be blamed on physics.
static TABLE: [Entry; 19] = {
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
            cost: Cost::ManyRods,
            needs: Requires::Strip,
            set_up: |problem| problem.bend(),
            ..position(entry(&[P::BendingStiffness], Joint, Otherwise, "bending all along the strip"))
        },
    ]
};

impl Effect {
    /// Every effect, in the order of the table.
    pub const ALL: [Self; 19] = [
        Self::TimeBase,
        Self::DroppedFrames,
        Self::CameraTilt,
        Self::AngleGain,
        Self::CameraOblique,
        Self::DifferentialLag,
        Self::DifferentialZero,
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

    /// Its row of the table.
    pub fn entry(self) -> &'static Entry {
        &TABLE[self as usize]
    }

    /// The identifier in files: that of its coefficient, unless it has several.
    pub fn id(self) -> &'static str {
        let entry = self.entry();
        if entry.id.is_empty() { entry.parameters[0].id() } else { entry.id }
    }

    /// Its coefficients, the one in proportion to which it acts first.
    pub fn parameters(self) -> &'static [Parameter] {
        self.entry().parameters
    }

    /// Where it acts.
    pub fn place(self) -> Place {
        self.entry().place
    }

    /// In words, with an article.
    pub fn words(self) -> &'static str {
        self.entry().words
    }

    /// Whether it has no derivative at the outset and is looked for at every instant, or frequency: the best of many gains by chance alone.
    pub fn is_scanned(self) -> bool {
        matches!(self.entry().cost, Cost::EveryInstant | Cost::EveryFrequency)
    }

    /// Whether a motion with it costs many times what others do.
    pub fn is_expensive(self) -> bool {
        matches!(self.entry().cost, Cost::Corners | Cost::ManyRods)
    }

    /// Whether its score costs many times what others do.
    pub fn is_expensive_to_score(self) -> bool {
        matches!(self.entry().cost, Cost::Corners | Cost::EveryFrequency)
    }

    /// Whether every corner of its law ends a step.
    pub fn has_switching(self) -> bool {
        self.entry().cost == Cost::Corners
    }

    /// Whether it makes another chain of the specimen, of which the base model is no special case.
    pub fn changes_chain(self) -> bool {
        self.entry().cost == Cost::ManyRods
    }

    /// Makes a problem ready for it.
    pub fn set_up(self, problem: &mut SetUp<'_>) {
        (self.entry().set_up)(problem);
        problem.free.extend(self.parameters());
    }

    /// Whether it is missing from the base model of an experiment with this many angles, and can be missing at all.
    pub fn is_applicable(self, experiment: &Experiment, base: &[Parameter], marks: usize) -> bool {
        let strip = experiment.specimen.links.is_empty();
        let meaningful = match self.entry().needs {
            Requires::Nothing => true,
            Requires::Joint => marks > 1,
            Requires::Spring => base.iter().any(|parameter| parameter.is_spring()),
            Requires::Strip => marks > 1 && strip && base.contains(&Parameter::JointStiffness),
        };
        let meaningful = meaningful && !(self.entry().of_camera && experiment.rig.sensor == Sensor::Encoder);
        // a camera that misses frames, and the first coefficient of a named effect
        meaningful && !self.parameters().iter().any(|p| base.contains(p)) && !self.is_set(experiment)
    }

    fn is_set(self, experiment: &Experiment) -> bool {
        self == Self::DroppedFrames && experiment.model.effects.dropped_frames.is_some()
    }

    /// The laws that take energy away, the joint's own damper among them, and where.
    pub fn losses() -> Vec<(Parameter, Place)> {
        let of_table = Self::ALL.into_iter().filter(|effect| effect.entry().acts == Acts::Loss);
        let of_table = of_table.map(|effect| (effect.parameters()[0], effect.place()));
        std::iter::once((Parameter::JointDamping, Place::Joint)).chain(of_table).collect()
    }
}

impl fmt::Display for Effect {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.id())
    }
}

impl serde::Serialize for Effect {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.id())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_effect_finds_its_own_row_by_its_identifier() {
        let expected = [
            "time_base",
            "dropped_frames",
            "camera_tilt",
            "angle_gain",
            "camera_oblique",
            "differential_lag",
            "differential_zero",
            "hinge_viscous",
            "hinge_coulomb",
            "hinge_stiffness",
            "joint_cubic_stiffness",
            "joint_hysteretic",
            "rest_curl",
            "air_linear",
            "air_quadratic",
            "added_mass",
            "side_force",
            "support_motion",
            "distributed_flexibility",
        ];
        assert_eq!(Effect::ALL.map(Effect::id), expected);
    }
}
