//! How many rods stand for a strip between two marks, where the file does not say.
//!
//! The error of a chain of n rods is in proportion to 1/n², and a wide swing with little noise shows it: the strip seems softer or stiffer than it is, and the recording
//! is not reproduced. Near the hinge a strip bends within √(EI/T), T being the tension there, which may be less than one rod.

use super::interval::Estimate;
use super::{Fit, Problem, Record, fit_watched};
use crate::error::Result;
use crate::experiment::Experiment;
use crate::identify::estimate::NORMAL_QUANTILE;
use crate::model::Parameter;
use crate::model::modes::linear::Linearised;
use crate::model::modes::poles::Modes;
use crate::progress::Progress;

/// Counts that are tried, finer or coarser ones, for as long as each leaves less than the one before (cost).
const TRIED: [&[usize]; 2] = [&[12, 16, 20], &[6, 4]];
/// By so much a strip is made stiffer to see what that changes (numerics).
const STIFFER: f64 = 1.01;
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
            // where far more than noise is left, a little less of it is no sign of anything
            let scatter = (chi2(&best) / values(&best)).max(1.0);
            if !(chi2(&fit) < chi2(&best) - LESS * scatter) {
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

/// The bending stiffness with what the number of rods may be wrong by: so much that the frequency of the last mode that the marks show becomes that of a strip that bends
/// everywhere,
///
/// ```text
/// δEI/EI = ln(f_∞/f_N) / (∂ ln f/∂ ln EI)       f_∞ = f_2N + (f_2N − f_N)/3
/// ```
pub(super) fn with_error_of_rods(estimate: Estimate, problem: &Problem<'_>) -> Estimate {
    if estimate.parameter != Parameter::BendingStiffness {
        return estimate;
    }
    let frequency_hz = |pieces: usize, bending_n_m2: f64| {
        let mut strip = problem.experiment.clone();
        strip.model.pieces = pieces;
        strip.model.effects.distributed_flexibility = Some(bending_n_m2);
        let modes = Modes::of(&Linearised::of(&strip).ok()?).ok()?;
        modes.modes.get(problem.marks().checked_sub(1)?).map(|mode| mode.frequency_hz)
    };
    let (pieces, value) = (problem.experiment.model.pieces, estimate.value);
    let of = |pieces, times: f64| frequency_hz(pieces, times * value);
    let relative = || {
        let (coarse, fine, stiffer) = (of(pieces, 1.0)?, of(2 * pieces, 1.0)?, of(pieces, STIFFER)?);
        let limit = fine + (fine - coarse) / 3.0;
        Some((limit / coarse).ln() / ((stiffer / coarse).ln() / STIFFER.ln()))
    };
    let error = relative().filter(|error: &f64| error.is_finite()).map_or(0.0, |error| (error * value).abs());
    let widened = |end: f64| value + (end - value).signum() * (end - value).hypot(NORMAL_QUANTILE * error);
    Estimate { sd: estimate.sd.hypot(error), low: widened(estimate.low), high: widened(estimate.high), ..estimate }
}

/// Number of values of a fit.
fn values(fit: &Fit) -> f64 {
    fit.residuals.iter().flat_map(|residuals| &residuals.values).map(Vec::len).sum::<usize>() as f64
}

/// What a fit leaves, over the variance of the noise.
fn chi2(fit: &Fit) -> f64 {
    let of_record = |residuals: &super::Residuals| {
        let each = residuals.values.iter().zip(residuals.rmse_rad.iter().zip(&residuals.noise_rad));
        each.map(|(values, (rmse, noise))| values.len() as f64 * (rmse / noise).powi(2)).sum::<f64>()
    };
    fit.residuals.iter().map(of_record).sum()
}
