//! How the file is taken: the base model's parameters, and what is known of them.

use super::settings::SearchSettings;
use crate::error::Result;
use crate::experiment::{Experiment, Sensor};
use crate::fit::{Belief, base_parameters};
use crate::model::{Chain, LinkProperty, Parameter};

/// Whether a single link for which the file states no damper gets a free one at its hinge.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DampingAssumption {
    /// At its word: there is none, and what damps it is missing from the model.
    AsStated,
    /// Loosely: whatever swings has a damper.
    WithDamper,
}

impl DampingAssumption {
    /// At first as stated, and with a damper only if much is left then; with a damper at once where the budget allows only one search.
    pub fn at_first(experiment: &Experiment, marks: usize, is_expensive: bool) -> Self {
        if is_expensive && lacks_a_damper(experiment, marks) { Self::WithDamper } else { Self::AsStated }
    }
}

/// The base model's parameters and what is known of them. Inertias, centres of mass and lengths of general links were measured, and so are free within what such
/// measurements are worth: an inertia that is off by a hundredth would otherwise pass for a clock or a spring. So is an encoder's zero, which lies anywhere within a step.
///
/// # Errors
/// [`crate::error::Error::Simulation`] for a specimen that cannot swing.
pub fn base_with_priors(
    experiment: &Experiment,
    marks: usize,
    taken: DampingAssumption,
    settings: &SearchSettings,
) -> Result<(Vec<Parameter>, Vec<Belief>)> {
    let mut base = stated(experiment, marks, taken);
    let mut beliefs = Vec::new();
    if !experiment.specimen.links.is_empty() {
        let chain = Chain::of(&experiment.specimen)?;
        let share = |of: LinkProperty| match of {
            LinkProperty::Inertia => settings.inertia_share,
            // a single weight on a thread hangs where a ruler says
            LinkProperty::Com if chain.count() == 1 => settings.length_share,
            LinkProperty::Com => settings.com_share,
            LinkProperty::Length => settings.length_share,
        };
        for parameter in chain.parameters() {
            let Parameter::Link(_, of) = parameter else { continue };
            let value = chain.value(parameter).unwrap_or(0.0);
            base.push(parameter);
            beliefs.push(Belief { parameter, value, sd: share(of) * value.abs().max(1e-12) });
        }
    }
    if experiment.rig.sensor == Sensor::Encoder {
        let zeros = [Parameter::CameraTilt, Parameter::DifferentialZero].into_iter().take(marks.min(2));
        for parameter in zeros.filter(|zero| !stated(experiment, marks, taken).contains(zero)) {
            base.push(parameter);
            beliefs.push(Belief { parameter, value: 0.0, sd: settings.encoder_zero_rad });
        }
    }
    Ok((base, beliefs))
}

/// The base model's parameters with the geometry as stated.
pub fn stated(experiment: &Experiment, marks: usize, taken: DampingAssumption) -> Vec<Parameter> {
    let mut base = base_parameters(experiment, marks);
    if taken == DampingAssumption::AsStated && lacks_a_damper(experiment, marks) {
        base.retain(|parameter| *parameter != Parameter::HingeViscous);
    }
    base
}

/// Whether the file of a single link, which has no joint, states no damper: neither the hinge's nor a C.
pub fn lacks_a_damper(experiment: &Experiment, marks: usize) -> bool {
    marks == 1 && !experiment.model.states_damping && experiment.model.effects.hinge_viscous.is_none()
}
