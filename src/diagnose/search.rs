//! The search: the fits of all hypotheses, with the file at its word and, where they leave far more than noise, loosely.

use super::ground::{self, Ground, Hypothesis};
use super::preparation::Prepared;
use super::refit::{self, Refit};
use super::{Cause, growing, pieces, second_look, selection, stepwise, verdict};
use crate::error::{Error, Result};
use crate::experiment::Experiment;
use crate::fit::{Belief, Problem, Record, base_parameters};
use crate::model::{ForwardModel, Parameter};
use crate::progress::Progress;

/// A length or an inertia of a rig is known to this share.
const GEOMETRY_SHARE: f64 = 0.1;

/// How the file is taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Taken {
    /// At its word: the geometry is what it states, and one link has a damper where it states one.
    AtItsWord,
    /// Loosely: inertias and centres of mass of general links were measured to about a tenth, and whatever swings has a damper.
    Loosely,
}

/// The base model's parameters and what is known of them.
pub(super) fn base_of(experiment: &Experiment, marks: usize, taken: Taken) -> Result<(Vec<Parameter>, Vec<Belief>)> {
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
            beliefs.push(Belief { parameter: *parameter, value, sd: GEOMETRY_SHARE * value.abs().max(1e-12) });
        }
    }
    Ok((base, beliefs))
}

/// Whether the file of a single link, which has no joint, states no damper: neither the hinge's nor a C.
fn lacks_a_damper(experiment: &Experiment, marks: usize) -> bool {
    marks == 1 && !experiment.model.states_damping && experiment.model.effects.hinge_viscous.is_none()
}

/// What a search ends with.
pub(super) struct Found<'a> {
    pub ground: Ground<'a>,
    /// The candidates.
    pub causes: Vec<Cause>,
    /// The fits of all hypotheses.
    pub fits: Vec<Refit<'a>>,
}

impl Found<'_> {
    /// Whether the best of the fits leaves so much that the noise does not matter.
    pub fn leaves_more_than_noise(&self) -> bool {
        refit::least(&self.fits).is_some_and(verdict::leaves_more_than_noise)
    }
}

/// The hypotheses with the file at its word; of a strip with as many rods as the recordings ask for.
pub(super) fn at_its_word<'a>(
    prepared: &'a Prepared,
    experiment: &'a Experiment,
    progress: &dyn Progress,
) -> Result<Found<'a>> {
    let found = fitted(prepared, experiment, Taken::AtItsWord, progress)?;
    let Some(count) = pieces::preferred(&found.ground, &found.fits) else { return Ok(found) };
    let counted = prepared.counted.get_or_init(|| pieces::with(experiment, count));
    let again = fitted(prepared, counted, Taken::AtItsWord, progress)?;
    Ok(if pieces::is_kept(&found.ground, &found.fits, &again.fits) { again } else { found })
}

/// The same with the file taken loosely where it may be doubted, from the beginning of the recordings on where they leave far more than noise, and with more
/// effects beside them.
pub(super) fn doubted<'a>(
    prepared: &'a Prepared,
    experiment: &'a Experiment,
    found: Found<'a>,
    progress: &dyn Progress,
) -> Found<'a> {
    let marks = found.ground.records[0].links();
    let has_slack = !experiment.specimen.links.is_empty() || lacks_a_damper(experiment, marks);
    let loosely = (has_slack && found.leaves_more_than_noise())
        .then(|| fitted(prepared, experiment, Taken::Loosely, progress).ok())
        .flatten();
    let found = loosely.unwrap_or(found);
    let leaves_more = found.leaves_more_than_noise();
    let Found { ground, causes, mut fits } = found;
    let mut ground = ground.plain();
    if leaves_more {
        let grown = growing::grown(&ground, &fits, &causes, progress);
        fits = refit::merged(fits, grown);
    }
    let fits = stepwise::with_more_and_fewer(&mut ground, fits, &causes, progress);
    let fits = selection::with_errors_in_step(&mut ground, fits);
    Found { ground, causes, fits }
}

/// Where a base model's descent begins: what was not free when the start was sought, where the file has it.
fn beginning(prepared: &Prepared, experiment: &Experiment, base: &[Parameter]) -> Result<Vec<f64>> {
    let stated = Problem::new(&prepared.records, experiment, base)?.start_values()?;
    let sought = |parameter: &Parameter| prepared.base.iter().position(|p| p == parameter);
    let parameters =
        base.iter().zip(stated).map(|(parameter, stated)| sought(parameter).map_or(stated, |at| prepared.x[at]));
    Ok(parameters.chain(prepared.x[prepared.base.len()..].iter().copied()).collect())
}

fn fitted<'a>(
    prepared: &'a Prepared,
    experiment: &'a Experiment,
    taken: Taken,
    progress: &dyn Progress,
) -> Result<Found<'a>> {
    let records = &prepared.records;
    let marks = records.first().map_or(0, Record::links);
    let (base, beliefs) = base_of(experiment, marks, taken)?;
    let begun = beginning(prepared, experiment, &base)?;
    let causes: Vec<Cause> = Cause::ALL.into_iter().filter(|c| c.may_be_missing(experiment, &base, marks)).collect();
    let mut ground = Ground {
        records,
        experiment,
        base,
        beliefs,
        noise: prepared.noise.clone(),
        step_error_rad: prepared.step_error_rad,
        begun: begun.clone(),
        fine_strip: None,
    };
    let refused = || Error::Simulation {
        detail: "no motion near the start values follows the recording; check [specimen] and [model]".into(),
    };
    let nothing = Hypothesis::default();
    let null = ground.descend_from(&nothing, begun, ground::MOST_STEPS).ok_or_else(refused)?;
    let null = selection::from_weaker_dampers(&ground, null);
    let null =
        if ground.refine_noise(&null) { ground.again(&null, ground::MOST_STEPS).ok_or_else(refused)? } else { null };
    let fits = selection::fits(&mut ground, null, &causes, progress);
    if taken == Taken::Loosely {
        // they are followed from the beginning next
        return Ok(Found { ground, causes, fits });
    }
    let fits = second_look::second_look(&mut ground, fits, &causes, progress);
    let fits = selection::with_errors_in_step(&mut ground, fits);
    Ok(Found { ground, causes, fits })
}
