//! How many rods stand for a strip between two marks, where the file does not say.
//!
//! The error of a chain of n rods is in proportion to 1/n², and a wide swing with little noise shows it: the strip seems softer or stiffer than it is, and the recording
//! is not reproduced. Near the hinge a strip bends within √(EI/T), T being the tension there, which may be less than one rod.

use super::{Fit, Record, fit_watched};
use crate::error::Result;
use crate::experiment::Experiment;
use crate::model::Parameter;
use crate::progress::Progress;

/// Counts that are tried, finer or coarser ones, for as long as each leaves less than the one before (cost).
const TRIED: [&[usize]; 2] = [&[12, 16, 20], &[6, 4]];
/// By so much less, over the variance of the noise, that it is no chance (statistics: three standard deviations, of one count among some).
const LESS: f64 = 9.0;

/// The fit with the number of rods that leaves least, and that number; `usual` is the fit with the file's.
///
/// # Errors
/// As [`super::fit`].
pub fn with_best_rods(
    usual: Fit,
    records: &[Record],
    experiment: &Experiment,
    free: &[Parameter],
    progress: &dyn Progress,
) -> Result<(Fit, usize)> {
    let (mut best, mut count) = (usual, experiment.model.pieces);
    for counts in TRIED {
        let begun = count;
        for pieces in counts {
            let mut other = experiment.clone();
            other.model.pieces = *pieces;
            let fit = fit_watched(records, &other, free, progress)?;
            if !(chi2(&fit) < chi2(&best) - LESS) {
                break;
            }
            (best, count) = (fit, *pieces);
        }
        // finer ones have done better
        if count != begun {
            break;
        }
    }
    Ok((best, count))
}

/// What a fit leaves, over the variance of the noise.
fn chi2(fit: &Fit) -> f64 {
    let of_record = |residuals: &super::Residuals| {
        let each = residuals.values.iter().zip(residuals.rmse_rad.iter().zip(&residuals.noise_rad));
        each.map(|(values, (rmse, noise))| values.len() as f64 * (rmse / noise).powi(2)).sum::<f64>()
    };
    fit.residuals.iter().map(of_record).sum()
}
