//! How the file is taken: the base model's parameters, and what is known of them.

use super::settings::SearchSettings;
use crate::error::Result;
use crate::experiment::Experiment;
use crate::fit::{Belief, base_parameters};
use crate::model::{ForwardModel, Parameter};

/// How the file is taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Taken {
    /// At its word: the geometry is what it states, and one link has a damper where it states one.
    AtItsWord,
    /// Loosely: inertias and centres of mass of general links were measured to about a tenth, and whatever swings has a damper.
    Loosely,
}

impl Taken {
    /// How a search takes the file at first: at its word, and loosely only if much is left then; loosely at once where there is no time for both.
    pub fn at_first(experiment: &Experiment, marks: usize, is_dear: bool) -> Self {
        if is_dear && has_slack(experiment, marks) { Self::Loosely } else { Self::AtItsWord }
    }
}

/// The base model's parameters and what is known of them.
///
/// # Errors
/// [`crate::error::Error::Simulation`] for a specimen that cannot swing.
pub fn base_of(
    experiment: &Experiment,
    marks: usize,
    taken: Taken,
    settings: &SearchSettings,
) -> Result<(Vec<Parameter>, Vec<Belief>)> {
    let mut base = base_parameters(experiment, marks);
    if taken == Taken::AtItsWord {
        if lacks_a_damper(experiment, marks) {
            base.retain(|parameter| *parameter != Parameter::HingeViscous);
        }
        return Ok((base, Vec::new()));
    }
    let mut beliefs = Vec::new();
    if !experiment.specimen.links.is_empty() {
        let model = ForwardModel::of(experiment)?;
        let uncertain: &[Parameter] = match marks {
            1 => &[Parameter::FirstInertia],
            _ => &[Parameter::FirstInertia, Parameter::FirstCom, Parameter::SecondInertia, Parameter::SecondCom],
        };
        for parameter in uncertain {
            let value = model.value(*parameter).unwrap_or(0.0);
            base.push(*parameter);
            beliefs.push(Belief { parameter: *parameter, value, sd: settings.geometry_share * value.abs().max(1e-12) });
        }
    }
    Ok((base, beliefs))
}

/// Whether taking the file loosely frees anything: a geometry, or a damper that it does not state.
pub fn has_slack(experiment: &Experiment, marks: usize) -> bool {
    !experiment.specimen.links.is_empty() || lacks_a_damper(experiment, marks)
}

/// Whether the file of a single link, which has no joint, states no damper: neither the hinge's nor a C.
fn lacks_a_damper(experiment: &Experiment, marks: usize) -> bool {
    marks == 1 && !experiment.model.states_damping && experiment.model.effects.hinge_viscous.is_none()
}
