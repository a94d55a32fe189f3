//! What a problem needs before an effect is fitted, beyond its coefficients being free.

use crate::experiment::{Experiment, Hysteresis};
use crate::fit::Belief;
use crate::model::{EncoderShape, Parameter};

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
    /// Standard deviation of each part of an encoder's error to expect.
    pub encoder_rad: f64,
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
    pub(super) fn bend(&mut self) {
        self.free.retain(|p| *p != Parameter::JointStiffness);
        let model = &mut self.experiment.model;
        model.pieces = self.strip.rods;
        let as_stiff = bending_n_m2(model.k_eq_n_m_per_rad, self.experiment);
        self.experiment.model.effects.distributed_flexibility = Some(self.strip.bending_n_m2.unwrap_or(as_stiff));
    }

    /// A hysteresis yields somewhere near a usual angle.
    pub(super) fn yields(&mut self) {
        let (yield_rad, sd) = self.yield_rad;
        self.beliefs.push(Belief { parameter: Parameter::HysteresisYield, value: yield_rad, sd });
        self.experiment.model.effects.joint_hysteretic = Some(Hysteresis { torque_n_m: 0.0, yield_rad });
    }

    /// A camera looks askew by no more than its owner fails to see.
    pub(super) fn add_oblique_view(&mut self) {
        let of = |parameter| Belief { parameter, value: 0.0, sd: self.view };
        self.beliefs.extend([Parameter::ViewStretch, Parameter::ViewShear].map(of));
    }

    /// An encoder errs by no more than those who build one allow.
    pub(super) fn add_encoder_error(&mut self) {
        let of = |shape| Belief { parameter: Parameter::Encoder(shape), value: 0.0, sd: self.encoder_rad };
        self.beliefs.extend(EncoderShape::ALL.map(of));
    }
}
