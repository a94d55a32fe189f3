//! Trajectory least squares: the forward model's parameters from one or several recordings of one specimen.
//!
//! | file | holds |
//! |---|---|
//! | [`base`] | what is free unless told otherwise |
//! | [`record`] | the angles of a recording |
//! | [`noise`] | its noise, from the table alone |
//! | [`observed_modes`] | its modes, without the model |
//! | [`frequency_check`] | how fast it swings beside the specimen: wrong lengths, clocks and units |
//! | [`predictability`] | how far a motion can be foretold |
//! | [`predict`] | what the model says the camera sees |
//! | [`problem`] | what is fitted to what |
//! | [`angle_correlation`] | how the noise of its angles goes together |
//! | [`start_values`] | where a fit begins: with the seen modes |
//! | [`shooting`] | multiple shooting: start values that cannot be out of step |
//! | [`search`] | several beginnings, the best end: the robust fit of `fit` and of a diagnosis' base model |
//! | [`descent`] | Levenberg–Marquardt with bounds |
//! | [`transformed`] | the variables in which a hysteresis is fitted |
//! | [`interval`] | standard deviations and 95 % intervals |
//! | [`whitening`] | residuals in units of their noise |
//! | [`verdict`] | does the model reproduce the recording? |
//!
//! Output error: the motion from the first row on is the model's own, and the residual is what the recording shows beyond it. Each recording's
//! initial angles and rates are free.

pub mod angle_correlation;
pub mod base;
pub mod descent;
pub mod frequency_check;
pub mod interval;
pub mod noise;
mod noise_beside_swing;
pub mod observed_modes;
pub mod predict;
pub mod predictability;
pub mod problem;
pub mod record;
pub mod rod_count;
pub mod search;
pub mod shooting;
pub mod start_values;
pub mod transformed;
pub mod verdict;
pub mod whitening;

use crate::error::Result;
use crate::experiment::Experiment;
use crate::model::Parameter;
use crate::progress::{Progress, Silent};
use crate::statistics::median;

pub use base::base_parameters;
pub use descent::{Descent, Ending};
pub use frequency_check::{Pace, check_angles, check_frequency};
pub use interval::Estimate;
pub use observed_modes::Seen;
pub use predict::Prediction;
pub use problem::{Belief, Problem};
pub use record::{Record, recordings};
pub use rod_count::with_best_rods;
pub use verdict::Verdict;

/// Residuals beyond this many standard deviations of their neighbours are outliers.
const OUTLIER: f64 = 6.0;
/// Scatter of a distance from what the values to one side say, over that from the middle of both sides (statistics: of normal noise).
const SCATTER_AT_ENDS: f64 = 1.4;
/// Where a larger part of the values are, that is how the noise is (judgement).
const MOST_OUTLIERS: f64 = 0.1;

/// A fitted model.
#[derive(Debug, Clone)]
pub struct Fit {
    /// The free parameters.
    pub estimates: Vec<Estimate>,
    /// Correlation of every pair of them.
    pub correlation: nalgebra::DMatrix<f64>,
    /// Combinations of parameters that the recordings do not determine: the logarithmic share of each parameter.
    pub undetermined: Vec<Vec<(Parameter, f64)>>,
    /// Angles between marks and their rates at each recording's first row.
    pub starts: Vec<Vec<f64>>,
    /// What each recording shows beyond the model.
    pub residuals: Vec<Residuals>,
    /// Values left out, of each recording.
    pub outliers: Vec<Vec<Outlier>>,
    /// Steps of the last descent.
    pub steps: usize,
    /// How it ended.
    pub ending: Ending,
    /// Whether the residuals are correlated in time, so that the intervals are widened.
    pub coloured: bool,
}

/// A value left out, for it stands apart from its neighbours.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Outlier {
    /// Which angle.
    pub link: usize,
    /// Which row.
    pub row: usize,
}

/// The residuals of one recording.
#[derive(Debug, Clone, PartialEq)]
pub struct Residuals {
    /// Stamp, measured, predicted and predicted rate of every value, `[link]`.
    pub values: Vec<Vec<Residual>>,
    /// Root mean square of each angle.
    pub rmse_rad: Vec<f64>,
    /// Noise of each angle, from the table alone ([`noise`]).
    pub noise_rad: Vec<f64>,
}

/// One measured angle beside the model's.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Residual {
    /// Stamp.
    pub t_s: f64,
    /// Measured angle.
    pub measured_rad: f64,
    /// The model's.
    pub predicted_rad: f64,
    /// The model's rate.
    pub rate_rad_s: f64,
}

impl Residual {
    /// Measured less predicted.
    pub fn left_rad(&self) -> f64 {
        self.measured_rad - self.predicted_rad
    }
}

impl Residuals {
    fn of(values: Vec<Vec<Residual>>, noise_rad: Vec<f64>) -> Self {
        let rmse_rad = values.iter().map(|own| rms(own.iter().map(Residual::left_rad))).collect();
        Self { values, rmse_rad, noise_rad }
    }

    /// Those of pieces of one recording, together; `None` of none.
    pub fn joined(pieces: Vec<Self>) -> Option<Self> {
        let links = pieces.first()?.values.len();
        let noise_rad = rms_of_pieces(&pieces.iter().map(|piece| &piece.noise_rad[..]).collect::<Vec<_>>());
        let mut values = vec![Vec::new(); links];
        for piece in pieces {
            values.iter_mut().zip(piece.values).for_each(|(all, own)| all.extend(own));
        }
        Some(Self::of(values, noise_rad))
    }
}

/// Of each angle the root mean square over pieces of about as many rows.
pub(crate) fn rms_of_pieces(pieces: &[&[f64]]) -> Vec<f64> {
    let links = pieces.first().map_or(0, |piece| piece.len());
    (0..links).map(|link| rms(pieces.iter().map(|piece| piece[link]))).collect()
}

fn rms(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let count = values.len().max(1) as f64;
    (values.map(|v| v * v).sum::<f64>() / count).sqrt()
}

impl Fit {
    /// The estimate of a parameter.
    pub fn estimate(&self, parameter: Parameter) -> Option<&Estimate> {
        self.estimates.iter().find(|e| e.parameter == parameter)
    }
}

/// Fits the free parameters and every recording's start.
///
/// It begins with the values of `experiment.model` and, where these lead nowhere, with those that the recordings' modes say ([`start_values`]): each time first
/// multiple shooting ([`shooting`]), then whole recordings as one motion each. The best end is descended from once more with outliers left out.
///
/// # Errors
/// [`crate::Error::Option`], [`crate::Error::Simulation`]: see [`Problem::new`]; and where no motion near the start values can be integrated.
pub fn fit(records: &[Record], experiment: &Experiment, free: &[Parameter]) -> Result<Fit> {
    fit_watched(records, experiment, free, &Silent)
}

/// Stages that [`fit_watched`] tells of.
pub fn stages(free: &[Parameter]) -> u64 {
    search::STAGES + 1 + free.len() as u64
}

/// The same, telling how far it is: [`stages`] steps.
///
/// # Errors
/// As [`fit`].
pub fn fit_watched(
    records: &[Record],
    experiment: &Experiment,
    free: &[Parameter],
    progress: &dyn Progress,
) -> Result<Fit> {
    let noise_rad: Vec<Vec<f64>> = records.iter().map(noise::noise_rad).collect();
    let search::End { problem, outcome: first, .. } =
        search::best_robust_fit(records, experiment, free, (&noise_rad, u64::MAX), progress)?;
    let (kept, outliers) = without_outliers(&problem, &first.x)?;
    let problem = Problem { records: &kept, ..problem };
    let descent = Descent { most_steps: 30, enough: 1e-3, ..Descent::default() };
    let outcome = search::descend(&problem, &descent, first.x).ok_or_else(search::refused)?;
    progress.advance(1);
    let uncertainty = interval::uncertainty(&problem, &outcome, progress);
    let residuals = residuals(&problem, &outcome.x, &noise_rad)?;
    Ok(Fit {
        starts: (0..kept.len()).map(|record| problem.seen_start(&outcome.x, record)).collect(),
        estimates: uncertainty.estimates.into_iter().map(|own| rod_count::with_error_of_rods(own, &problem)).collect(),
        correlation: uncertainty.correlation,
        undetermined: uncertainty.undetermined,
        coloured: uncertainty.coloured,
        residuals,
        outliers,
        steps: first.steps + outcome.steps,
        ending: outcome.ending,
    })
}

/// The recordings without values that stand out from their neighbours: whose residual is further from the median of three on each side
/// than six robust standard deviations of that distance, here and in the recording as a whole. A misfit of the model is smooth in time and
/// moves neighbours together. Where more than one value in ten stands out, that is how the noise is, and none is left out.
pub(crate) fn without_outliers(problem: &Problem<'_>, x: &[f64]) -> Result<(Vec<Record>, Vec<Vec<Outlier>>)> {
    let mut kept = problem.records.to_vec();
    let mut outliers = vec![Vec::new(); kept.len()];
    for (index, record) in kept.iter_mut().enumerate() {
        let prediction = problem.predict(index, x, false)?;
        let block = problem.block(index, &prediction, Vec::new());
        for link in 0..record.links() {
            let own: Vec<(usize, f64)> = (prediction.values.iter().zip(block.residual.iter()))
                .filter(|(value, _)| value.link == link)
                .map(|(value, r)| (value.row, *r))
                .collect();
            for row in outlier_rows(own) {
                record.theta_rad[link][row] = None;
                outliers[index].push(Outlier { link, row });
            }
        }
    }
    Ok((kept, outliers))
}

/// Rows whose residual stands out; the farthest first, as it moves its neighbours' medians.
fn outlier_rows(mut own: Vec<(usize, f64)>) -> Vec<usize> {
    let most = (MOST_OUTLIERS * own.len() as f64) as usize;
    let sizes: Vec<f64> = (0..own.len()).map(|i| apart(&own, i).abs()).collect();
    let scale = |sizes: &[f64]| 1.4826 * median(&mut sizes.to_vec()).unwrap_or(0.0);
    let everywhere = scale(&sizes);
    let here: Vec<f64> =
        (0..own.len()).map(|i| scale(&sizes[i.saturating_sub(30)..(i + 31).min(sizes.len())])).collect();
    let mut limits: Vec<f64> = here.iter().map(|here| OUTLIER * here.max(everywhere)).collect();
    let mut rows = Vec::new();
    loop {
        let beyond = (0..own.len()).map(|i| (i, apart(&own, i).abs() - limits[i])).max_by(|a, b| a.1.total_cmp(&b.1));
        let Some((i, _)) = beyond.filter(|(_, beyond)| *beyond > 0.0) else { return rows };
        if rows.len() == most {
            return Vec::new();
        }
        rows.push(own.remove(i).0);
        limits.remove(i);
    }
}

/// How far a residual is from the median of the three before and the three after it; at the ends from the line through the medians of the three next to it and of the three
/// beyond, over how much more that scatters; zero of so few.
fn apart(own: &[(usize, f64)], i: usize) -> f64 {
    let median_of = |places: [usize; 3]| {
        let mut few = places.map(|place| own[place].1);
        few.sort_by(f64::total_cmp);
        few[1]
    };
    let beyond = |next: [usize; 3], further: [usize; 3]| {
        let (next, further) = (median_of(next), median_of(further));
        (own[i].1 - next - (next - further) * 2.0 / 3.0) / SCATTER_AT_ENDS
    };
    if own.len() < 9 {
        0.0
    } else if i < 3 {
        beyond([1, 2, 3].map(|k| i + k), [4, 5, 6].map(|k| i + k))
    } else if i + 3 >= own.len() {
        beyond([1, 2, 3].map(|k| i - k), [4, 5, 6].map(|k| i - k))
    } else {
        let mut near = [own[i - 3].1, own[i - 2].1, own[i - 1].1, own[i + 1].1, own[i + 2].1, own[i + 3].1];
        near.sort_by(f64::total_cmp);
        own[i].1 - 0.5 * (near[2] + near[3])
    }
}

fn residuals(problem: &Problem<'_>, x: &[f64], noise_rad: &[Vec<f64>]) -> Result<Vec<Residuals>> {
    let of = |record| residuals_of(problem, x, record).map(|r| Residuals { noise_rad: noise_rad[record].clone(), ..r });
    (0..problem.records.len()).map(of).collect()
}

/// What is left of one recording, beside the problem's own noise.
pub(crate) fn residuals_of(problem: &Problem<'_>, x: &[f64], index: usize) -> Result<Residuals> {
    let record = &problem.records[index];
    let mut values = vec![Vec::new(); record.links()];
    for value in problem.predict(index, x, false)?.values {
        if let Some(measured_rad) = record.theta_rad[value.link][value.row] {
            let t_s = record.t_s[value.row];
            let (predicted_rad, rate_rad_s) = (value.predicted_rad, value.rate_rad_s);
            values[value.link].push(Residual { t_s, measured_rad, predicted_rad, rate_rad_s });
        }
    }
    Ok(Residuals::of(values, problem.noise[index].sd_rad.clone()))
}
