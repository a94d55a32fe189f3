//! What a base model may lack: the table of effects. All that is particular to a law and needs no fit stands in its entry; how it is sought, in
//! [`super::laws`].
//!
//! | file | holds |
//! |---|---|
//! | `table` | the rows |
//! | `set_up` | what a problem needs beyond free coefficients |

mod set_up;
mod table;

use std::fmt;

use crate::experiment::Experiment;
use crate::model::Parameter;
use table::TABLE;

pub use set_up::{BendingStrip, SetUp, bending_n_m2};
pub use table::{Acts, Cost, Entry, Phase, Place, Requires};

/// Compliance of the softest stand (judgement: a force of ten newtons moves it by ten centimetres).
pub const SOFTEST_M_PER_N: f64 = 0.01;
/// A stand that the whole weight, pulling sideways, moves by less than this part of the specimen's length changes the swing by too little to be told (judgement).
const YIELDS: f64 = 1e-3;

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
    /// An encoder off its axis, or askew on it.
    EncoderError,
    /// All angles but θ₁ are sampled later than that.
    DifferentialLag,
    /// An offset of all angles but θ₁.
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
    /// The stand yields.
    SupportFlexibility,
    /// The strip bends everywhere.
    DistributedFlexibility,
}

impl Effect {
    /// Every effect, in the order of the table.
    pub const ALL: [Self; 21] = [
        Self::TimeBase,
        Self::DroppedFrames,
        Self::CameraTilt,
        Self::AngleGain,
        Self::CameraOblique,
        Self::EncoderError,
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
        Self::SupportFlexibility,
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
            Requires::OneAngle => marks == 1,
            Requires::Joint => marks > 1,
            Requires::Weight => is_heavy(experiment),
            Requires::Spring => base.iter().any(|parameter| parameter.is_spring()),
            Requires::Strip => marks > 1 && strip && base.contains(&Parameter::JointStiffness),
        };
        let meaningful = meaningful && self.entry().sensor.is_none_or(|sensor| experiment.rig.sensor == sensor);
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

/// Whether the softest stand would yield to the specimen's swing by a good part of its length.
fn is_heavy(experiment: &Experiment) -> bool {
    let specimen = &experiment.specimen;
    let weight_n = specimen.whole_mass_kg() * experiment.rig.gravity_m_s2;
    SOFTEST_M_PER_N * weight_n > YIELDS * specimen.lengths_m().iter().sum::<f64>()
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
            "encoder_error",
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
            "support_flexibility",
            "distributed_flexibility",
        ];
        assert_eq!(Effect::ALL.map(Effect::id), expected);
    }
}
