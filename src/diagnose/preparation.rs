//! What all searches begin with: recordings without outliers, their noise, and where the base model's descent starts.

use super::base::{Taken, base_of};
use super::settings::Settings;
use crate::error::Result;
use crate::experiment::Experiment;
use crate::fit::shooting::multiple_shooting;
use crate::fit::whitening::{Colour, RecordNoise};
use crate::fit::{Problem, Record};
use crate::model::Parameter;

/// Springs to start from, over the file's, where that leads nowhere.
const SPRINGS: [f64; 3] = [0.03, 30.0, 1e-3];

/// What the recordings, cleaned of outliers, are held against.
pub struct Prepared {
    /// Cleaned.
    pub records: Vec<Record>,
    /// Learnt from short stretches.
    pub noise: Vec<RecordNoise>,
    /// Of the integration.
    pub step_error_rad: f64,
    /// Parameters of the base model, taken at the file's word.
    pub base: Vec<Parameter>,
    /// Their values and the starts to descend from.
    pub x: Vec<f64>,
}

/// Learns the noise, leaves outliers out, and finds where the base model's descent is to start: near the file's values, and where no motion near them can
/// follow the recordings, from softer and stiffer springs.
///
/// # Errors
/// [`crate::error::Error::Simulation`] where the specimen cannot swing.
pub fn prepare(records: &[Record], experiment: &Experiment, settings: &Settings) -> Result<Prepared> {
    let marks = records.first().map_or(0, Record::links);
    let (base, _) = base_of(experiment, marks, Taken::AtItsWord, &settings.search)?;
    let from = |spring: &f64| {
        let mut experiment = experiment.clone();
        experiment.model.k_eq_n_m_per_rad *= spring;
        if let Some(bending) = &mut experiment.model.effects.distributed_flexibility {
            *bending *= spring;
        }
        let mut problem = Problem::new(records, &experiment, &base)?;
        let shot = multiple_shooting(&mut problem)?;
        problem.integrate_below_the_noise();
        let step_error_rad = problem.accuracy.step_error_rad;
        problem.accuracy = problem.accuracy_of(problem.longest_s(), step_error_rad);
        let (kept, _) = crate::fit::without_outliers(&problem, &shot.x)?;
        Ok(Prepared {
            noise: coloured(&shot.residuals, &problem.noise, settings.noise.stretches_coloured),
            step_error_rad,
            base: base.clone(),
            x: shot.x,
            records: kept,
        })
    };
    let as_stated = from(&1.0);
    if as_stated.is_ok() {
        as_stated
    } else {
        SPRINGS.iter().find_map(|spring| from(spring).ok()).map_or(as_stated, Ok)
    }
}

/// Noise with the correlation of neighbouring residuals of each angle, where it is more than chance and the stretches' own starts make of it.
fn coloured(residuals: &[(usize, usize, f64)], white: &[RecordNoise], least: f64) -> Vec<RecordNoise> {
    let of = |record: usize, link: usize| {
        let r: Vec<f64> = residuals.iter().filter(|r| r.0 == record && r.1 == link).map(|r| r.2).collect();
        let power: f64 = r.iter().map(|v| v * v).sum();
        let rho = r.windows(2).map(|w| w[0] * w[1]).sum::<f64>() / power.max(1e-300);
        if rho > least { Colour { rho: (rho + 0.05).min(0.9), share: 1.0 } } else { Colour::default() }
    };
    let with_colour = |(record, white): (usize, &RecordNoise)| {
        let colour = (0..white.sd_rad.len()).map(|link| of(record, link)).collect();
        RecordNoise { colour, ..white.clone() }
    };
    white.iter().enumerate().map(with_colour).collect()
}
