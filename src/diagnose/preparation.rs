//! What all searches begin with: recordings without outliers, their noise, and where the base model's descent starts.

use super::base_priors::{DampingAssumption, stated};
use super::context::first_part;
use super::settings::{SearchSettings, Settings};
use crate::error::Result;
use crate::experiment::Experiment;
use crate::fit::noise::noise_rad;
use crate::fit::problem::step_error_rad;
use crate::fit::record::refuse_empty;
use crate::fit::search::{End, best_robust_fit, observed_starts};
use crate::fit::shooting::STATE_WINDOW_RAD;
use crate::fit::whitening::{Colour, RecordNoise};
use crate::fit::{Problem, Record, Seen, check_angles, check_frequency};
use crate::model::{Parameter, Work};
use crate::progress::Silent;
use crate::series::FEWEST_ROWS;

/// Of fewer pieces none would be left to be predicted.
const FEWEST_PIECES: usize = 3;
/// What the starts of short stretches take from the correlation of neighbouring residuals (judgement)…
const OF_STARTS: f64 = 0.05;
/// … which is at most this with it (judgement).
const MOST_RHO: f64 = 0.9;

/// What the recordings, cleaned of outliers, are held against.
pub struct Prepared {
    /// Cleaned.
    pub records: Vec<Record>,
    /// The first part of their rows on which the budget allows a search; 1 where that is all of them.
    pub part: f64,
    /// Learnt from short stretches.
    pub noise: Vec<RecordNoise>,
    /// Of the integration.
    pub step_error_rad: f64,
    /// The experiment, its spring and dampers as the file or the recordings' modes have them, whichever led further.
    pub experiment: Experiment,
    /// Parameters of the base model, taken at the file's word.
    pub base: Vec<Parameter>,
    /// Their values and the starts to descend from: where short stretches led to.
    pub begun: Vec<f64>,
    /// The same where the robust descent from there ended.
    pub ended: Vec<f64>,
    /// What all fits to them have cost.
    pub work: Work,
    /// What a search of them may cost, its beginnings included.
    pub budget: u64,
}

impl Prepared {
    /// The same with every recording cut in pieces of some swings at a pace, integrated as exactly as is worth it where models leave far more than noise; `None`
    /// where that makes fewer than three of each.
    pub fn in_pieces(&self, settings: &Settings, characteristic_rad_s: f64) -> Option<Self> {
        let (swings, beyond) = (settings.search.piece_swings, settings.noise.beyond);
        let least_rad = self.noise.iter().flat_map(|own| &own.sd_rad).copied().fold(f64::INFINITY, f64::min);
        let (length_s, reach_s) =
            (swings * std::f64::consts::TAU / characteristic_rad_s, STATE_WINDOW_RAD / characteristic_rad_s);
        let (mut records, mut noise, mut starts) = (Vec::new(), Vec::new(), Vec::new());
        for (record, own_noise) in self.records.iter().zip(&self.noise) {
            let pieces = record.pieces(length_s);
            if pieces.len() < FEWEST_PIECES || pieces.iter().any(|piece| piece.len() < FEWEST_ROWS) {
                return None;
            }
            let mut row = 0;
            for piece in pieces {
                starts.extend(record.start_near(row, reach_s));
                row += piece.len();
                noise.push(own_noise.clone());
                records.push(piece);
            }
        }
        let begun = |x: &[f64]| [&x[..self.base.len()], &starts].concat();
        Some(Self {
            part: 1.0,
            begun: begun(&self.begun),
            ended: begun(&self.ended),
            experiment: self.experiment.clone(),
            base: self.base.clone(),
            work: self.work.clone(),
            budget: self.budget,
            step_error_rad: step_error_rad(beyond * least_rad),
            records,
            noise,
        })
    }

    /// How a search takes the file at first.
    pub fn initial_damping(&self) -> DampingAssumption {
        let marks = self.records.first().map_or(0, Record::links);
        DampingAssumption::at_first(&self.experiment, marks, self.part < 1.0)
    }
}

/// Learns the noise, leaves outliers out, and finds where the base model's descent is to start: where `fit` ends, which begins with the file's values and with
/// those that the recordings' modes say.
///
/// # Errors
/// [`crate::error::Error::Table`] for a recording that swings at another pace than the specimen can, or in angles that it cannot; [`crate::error::Error::Simulation`] where the specimen
/// cannot swing, or no motion near any start follows the recordings.
pub fn prepare(records: &[Record], experiment: &Experiment, settings: &Settings) -> Result<Prepared> {
    let budget = settings.search.budget_of(experiment.model.effects.distributed_flexibility.is_some());
    prepare_within(budget, records, experiment, settings)
}

/// The same for a search that may cost so much.
///
/// # Errors
/// As [`prepare`].
pub fn prepare_within(
    budget: u64,
    records: &[Record],
    experiment: &Experiment,
    settings: &Settings,
) -> Result<Prepared> {
    refuse_empty(records)?;
    for record in records {
        if let Some(seen) = Seen::of(record) {
            check_frequency(record, &seen, experiment)?;
            check_angles(record, &seen, experiment)?;
        }
    }
    let marks = records.first().map_or(0, Record::links);
    let base = stated(experiment, marks, DampingAssumption::AsStated);
    let noise_rad: Vec<Vec<f64>> = records.iter().map(noise_rad).collect();
    let part = affordable_part(records, experiment, &base, (&noise_rad, budget), &settings.search)?;
    let most_work = (settings.search.shares.prepared * budget as f64) as u64;
    let early = if part < 1.0 { first_part(records, part) } else { records.to_vec() };
    let End { mut problem, outcome, shot, begun, .. } =
        best_robust_fit(&early, experiment, &base, (&noise_rad, most_work), &Silent)?;
    problem.noise.clone_from(&shot.noise);
    problem.integrate_below_the_noise();
    let step_error_rad = problem.accuracy.step_error_rad;
    let mut problem = Problem { records, ..problem };
    problem.accuracy = problem.accuracy_of(problem.longest_s(), step_error_rad);
    // where short stretches led: a whole motion that has bent to a jump of the clock would take the rows beside that for outliers
    let (kept, _) = crate::fit::without_outliers(&problem, &shot.x)?;
    Ok(Prepared {
        noise: coloured(&shot.residuals, &shot.noise, settings.noise.stretches_coloured),
        step_error_rad,
        part,
        experiment: begun,
        base,
        begun: shot.x,
        ended: outcome.x,
        records: kept,
        work: problem.work,
        budget,
    })
}

/// The part of the rows of which the budget allows a search, where that is not next to all of them: a search makes so many motions with derivatives.
fn affordable_part(
    records: &[Record],
    experiment: &Experiment,
    base: &[Parameter],
    (noise_rad, budget): (&[Vec<f64>], u64),
    settings: &SearchSettings,
) -> Result<f64> {
    let mut problem = Problem::new(records, experiment, base)?;
    let least_rad = noise_rad.iter().flatten().copied().fold(f64::INFINITY, f64::min);
    problem.accuracy = problem.accuracy_of(problem.longest_s(), step_error_rad(least_rad));
    let x = [problem.start_values()?, observed_starts(&problem)?].concat();
    let swings = problem.longest_s() * problem.model(0, &[])?.0.characteristic_rad_s() / std::f64::consts::TAU;
    // a motion that runs away has cost what it has
    _ = problem.blocks(&x);
    let affordable = budget as f64 / (settings.evaluations * problem.work.done().max(1) as f64);
    let part = affordable.max(settings.early_swings / swings.max(1.0));
    Ok(if part < settings.part_worth { part } else { 1.0 })
}

/// Noise with the correlation of neighbouring residuals of each angle, where it is more than chance and the stretches' own starts make of it.
fn coloured(residuals: &[(usize, usize, f64)], white: &[RecordNoise], least: f64) -> Vec<RecordNoise> {
    let of = |record: usize, link: usize| {
        let r: Vec<f64> = residuals.iter().filter(|r| r.0 == record && r.1 == link).map(|r| r.2).collect();
        let power: f64 = r.iter().map(|v| v * v).sum();
        let rho = r.windows(2).map(|w| w[0] * w[1]).sum::<f64>() / power.max(1e-300);
        if rho > least { Colour { rho: (rho + OF_STARTS).min(MOST_RHO), share: 1.0 } } else { Colour::default() }
    };
    let with_colour = |(record, white): (usize, &RecordNoise)| {
        let colour = (0..white.sd_rad.len()).map(|link| of(record, link)).collect();
        RecordNoise { colour, ..white.clone() }
    };
    white.iter().enumerate().map(with_colour).collect()
}
