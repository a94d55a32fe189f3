//! Before an experiment: what a planned recording could show, and what it could tell apart.

use super::adequacy::{Detectable, detectable};
use super::base::candidates;
use super::base_priors::{DampingAssumption, base_with_priors};
use super::context::FitContext;
use super::hypothesis::Hypothesis;
use super::laws;
use super::screen::Screen;
use super::settings::Settings;
use crate::error::{Error, Result};
use crate::experiment::Experiment;
use crate::fit::Record;
use crate::fit::problem::step_error_rad;
use crate::fit::whitening::RecordNoise;
use crate::model::observe::chord_angles_rad;
use crate::model::{ForwardModel, State, Trajectory, Work};

/// A recording that is planned.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plan {
    /// Its length.
    pub duration_s: f64,
    /// Rows per second.
    pub rate_hz: f64,
    /// Standard deviation of the noise of every angle.
    pub noise_rad: f64,
}

/// What a recording of the experiment's own release would show of every effect that its base model lacks.
///
/// # Errors
/// [`Error::Simulation`] where the specimen cannot swing.
pub fn planned(experiment: &Experiment, plan: &Plan) -> Result<Vec<Detectable>> {
    let record = [recorded(experiment, plan)?];
    let marks = record[0].links();
    let settings = Settings::default();
    let (base, beliefs) = base_with_priors(experiment, marks, DampingAssumption::AsStated, &settings.search)?;
    let context = FitContext {
        records: &record,
        experiment,
        settings: &settings,
        base,
        beliefs,
        step_error_rad: step_error_rad(plan.noise_rad),
        begun: Vec::new(),
        identified_strip: None,
        laws: Vec::new(),
        work: Work::default(),
        most_work: u64::MAX,
    };
    let nothing = Hypothesis::default();
    let problem = context.problem(&nothing, &[RecordNoise::white(vec![plan.noise_rad; marks])])?;
    let mut x = problem.start_values()?;
    x.extend(&experiment.model.release_rad);
    x.resize(problem.variables(), 0.0);
    let refused = || Error::Simulation { detail: "the planned swing cannot be integrated; check [model]".into() };
    let base = context.descend(&nothing, problem, x, 1).ok_or_else(refused)?;
    let screen = Screen::at(&context, &base).ok_or_else(refused)?;
    let effects = candidates(&context);
    Ok(detectable(&laws::scores(&screen, &effects), &effects, &settings.verdict))
}

/// The base model's own swing, released at rest, without noise.
fn recorded(experiment: &Experiment, plan: &Plan) -> Result<Record> {
    let model = ForwardModel::of(experiment)?;
    let release = State::released(&model, &experiment.model.release_rad)?;
    let swing = Trajectory::swing(&model, &release, 0.0, plan.duration_s)?;
    let rows = (plan.duration_s * plan.rate_hz).floor() as usize + 1;
    let t_s: Vec<f64> = (0..rows).map(|row| row as f64 / plan.rate_hz).collect();
    let chords: Vec<Vec<f64>> = t_s.iter().map(|t| chord_angles_rad(model.chain(), &swing.at(*t).theta_rad)).collect();
    let marks = model.chain().groups().len();
    Ok(Record::uniform(
        "a planned recording",
        t_s,
        (0..marks).map(|link| chords.iter().map(|c| Some(c[link])).collect()).collect(),
    ))
}
