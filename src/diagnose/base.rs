//! The base model: its context, and its fit.

use rayon::prelude::*;

use super::base_priors::{DampingAssumption, base_with_priors};
use super::context::FitContext;
use super::effect::Effect;
use super::hypothesis::Hypothesis;
use super::misfit::leaves_more_than_noise;
use super::preparation::Prepared;
use super::refit::Refit;
use super::residual_noise::residual_noise;
use super::settings::Settings;
use crate::error::{Error, Result};
use crate::experiment::Experiment;
use crate::fit::{Problem, Record};
use crate::model::Parameter;

/// Dampers to start the base model from, over the one it found (start values).
const WEAKER: [f64; 2] = [0.1, 0.01];

/// The effects that may be missing from a context's base model.
pub fn candidates(context: &FitContext<'_>) -> Vec<Effect> {
    let may_be = |effect: &Effect| effect.is_applicable(context.experiment, &context.base, context.marks());
    Effect::ALL.into_iter().filter(may_be).collect()
}

/// The context of a diagnosis with the file taken in some way.
///
/// # Errors
/// As [`base_with_priors`].
pub fn context<'a>(
    prepared: &'a Prepared,
    experiment: &'a Experiment,
    taken: DampingAssumption,
    settings: &'a Settings,
) -> Result<FitContext<'a>> {
    let records = &prepared.records;
    let marks = records.first().map_or(0, Record::links);
    let (base, beliefs) = base_with_priors(experiment, marks, taken, &settings.search)?;
    let begun = beginning(prepared, &prepared.begun, experiment, &base)?;
    let step_error_rad = prepared.step_error_rad;
    let work = prepared.work.clone();
    Ok(FitContext {
        records,
        experiment,
        settings,
        base,
        beliefs,
        step_error_rad,
        begun,
        identified_strip: None,
        laws: Vec::new(),
        work,
        most_work: u64::MAX,
    })
}

/// The start of the base model's fit: values of the preparation where a parameter was free there, else those of the file; a strip of fewer rods may start in
/// fewer modes.
fn beginning(prepared: &Prepared, x: &[f64], experiment: &Experiment, base: &[Parameter]) -> Result<Vec<f64>> {
    let problem = Problem::new(&prepared.records, experiment, base)?;
    let stated = problem.start_values()?;
    let sought = |parameter: &Parameter| prepared.base.iter().position(|p| p == parameter);
    let parameters = base.iter().zip(stated).map(|(parameter, stated)| sought(parameter).map_or(stated, |at| x[at]));
    let starts = &x[prepared.base.len()..];
    let shapes = starts.len() / (2 * prepared.records.len());
    Ok(parameters.chain(problem.starts_in_shapes(starts, shapes)).collect())
}

/// The base model's fit, with the noise that it leaves. Where it has gone astray, more steps only bend its parameters to what it lacks.
///
/// # Errors
/// [`Error::Simulation`] where no motion near the start values follows the recordings.
pub fn fitted<'a>(context: &FitContext<'a>, prepared: &Prepared) -> Result<Refit<'a>> {
    let refused = || Error::Simulation {
        detail: "no motion near the start values follows the recording; check [specimen] and [model]".into(),
    };
    let (nothing, steps) = (Hypothesis::default(), &context.settings.descent);
    // from where short stretches led, and from where `fit` ended from there
    let ended = beginning(prepared, &prepared.ended, context.experiment, &context.base)?;
    let from = |x: Vec<f64>| context.descend_from(&nothing, &prepared.noise, x, steps.few_steps);
    let mut starts = vec![context.begun.clone(), ended];
    if prepared.part < 1.0 {
        // whole recordings are dear: only from the one that leaves less
        let problem = context.problem(&nothing, &prepared.noise)?;
        let costs: Vec<f64> = starts.iter().map(|x| problem.cost(x)).collect();
        starts.swap_remove(usize::from(costs[0] < costs[1]));
    }
    let begun: Vec<Refit<'a>> = starts.into_par_iter().with_max_len(1).filter_map(from).collect();
    let first = context.best_gone_on(begun, steps.most_steps - steps.few_steps, |fit| !is_astray(context, fit));
    with_its_noise(context, from_weaker_dampers(context, first.ok_or_else(refused)?)).ok_or_else(refused)
}

/// The same near another fit of it, with another number of rods.
///
/// # Errors
/// As [`fitted`].
pub fn fitted_near<'a>(context: &FitContext<'a>, near: &Refit<'_>, prepared: &Prepared) -> Result<Refit<'a>> {
    let found = context.begin(&Hypothesis::default(), near, &[]).and_then(|fit| with_its_noise(context, fit));
    found.map_or_else(|| fitted(context, prepared), Ok)
}

/// Whether its motion has lost step; of a strip, whose steps are dear, whether it leaves far more than noise.
fn is_astray(context: &FitContext<'_>, fit: &Refit<'_>) -> bool {
    let settings = context.settings;
    fit.has_lost_step(&settings.misfit) || context.is_strip() && leaves_more_than_noise(fit, &settings.noise)
}

/// A fit judged by the noise that it leaves.
fn with_its_noise<'a>(context: &FitContext<'a>, fit: Refit<'a>) -> Option<Refit<'a>> {
    let descent = &context.settings.descent;
    let steps = if is_astray(context, &fit) { descent.first_steps } else { descent.most_steps };
    match residual_noise(context, &fit) {
        Some(noise) => context.with_noise(&noise, &fit, steps),
        None => Some(fit),
    }
}

/// The base model fitted again from dampers ten and a hundred times weaker, where it leaves much and damps more than short stretches say: a missing effect can
/// raise the damper until a mode is overdamped, and no descent leads back.
fn from_weaker_dampers<'a>(context: &FitContext<'a>, fit: Refit<'a>) -> Refit<'a> {
    let damper = Parameter::JointDamping;
    let of_stretches = context.base.iter().position(|p| *p == damper).map_or(0.0, |place| context.begun[place]);
    let damps_more = |value: &f64| *value > of_stretches && fit.relative_residual() > context.settings.misfit.much;
    let Some(strong) = fit.value(damper).filter(damps_more) else { return fit };
    let weaker = WEAKER
        .par_iter()
        .with_max_len(1)
        .filter_map(|part| context.refit_below(fit.chi2, &fit.hypothesis, &fit, &[(damper, part * strong)]));
    let best = weaker.min_by(|a, b| a.chi2.total_cmp(&b.chi2));
    match best {
        Some(best) if best.chi2 < fit.chi2 => best,
        _ => fit,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::Record;
    use crate::model::Work;

    #[test]
    fn a_strip_counted_anew_begins_in_as_many_shapes_as_it_has() {
        let record = Record::uniform("made", (0..30).map(f64::from).collect(), vec![vec![Some(0.1); 30]; 2]);
        let mut experiment = Experiment::default();
        experiment.model.effects.distributed_flexibility = Some(1e-5);
        let problem =
            |experiment: &Experiment| Problem::new(std::slice::from_ref(&record), experiment, &[]).unwrap().shapes();
        let usual = problem(&experiment);
        // two angles and three further shapes, then their rates
        let prepared = Prepared {
            records: vec![record.clone()],
            part: 1.0,
            noise: Vec::new(),
            step_error_rad: 1e-6,
            experiment: experiment.clone(),
            base: Vec::new(),
            begun: vec![0.1, 0.2, 0.3, 0.4, 0.5, 1.0, 2.0, 3.0, 4.0, 5.0],
            ended: Vec::new(),
            work: Work::default(),
            budget: 0,
        };
        assert_eq!(usual, 5);
        assert_eq!(beginning(&prepared, &prepared.begun, &experiment, &[]).unwrap(), prepared.begun);
        experiment.model.pieces = 1;
        assert_eq!(problem(&experiment), 2);
        assert_eq!(beginning(&prepared, &prepared.begun, &experiment, &[]).unwrap(), [0.1, 0.2, 1.0, 2.0]);
    }
}
