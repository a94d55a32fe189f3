//! How probable each hypothesis is: its likelihood, weighed by how much of what it could have been it had to be.
//!
//! Laplace's approximation of the evidence, with the coefficients' sizes log-uniform over ln R (no size is likelier than another):
//!
//! ```text
//! ln Z = −½χ²/s² + ½ ln det 2πΣ − Σ ln(|β| ln R)      Σ: covariance of the coefficients, everything else being free
//! s² = 1 + (v − 1)(1 + ρ)/(1 − ρ)                     v = max(1, χ²/N) of the best hypothesis, ρ its correlation from row to row
//! ```
//!
//! Σ is scaled by v. What the best hypothesis leaves beyond the noise goes on from row to row, so that fewer values count than there are. A support's
//! frequency, a joint's yield angle and the instant of missing frames count as any value within their range.

use super::ground::Hypothesis;
use super::refit::Refit;
use super::screen::LOWEST;
use super::{Cause, Place, noise};
use crate::model::Parameter;

/// ln R: sizes over four decades.
const SIZES: f64 = 9.2;
/// Yield angles over a factor of thirty.
const YIELDS: f64 = 3.4;
/// Coefficients of less than this many standard deviations are not told from zero.
const TOLD_FROM_ZERO: f64 = 1.5;

/// From this variance on, over the noise's, a fall of χ² by this many variances counts instead.
const MUCH_LEFT: f64 = 4.0;
const NEEDED: f64 = 9.0;

/// Prior probabilities before anything is measured.
const PRIOR_NULL: f64 = 0.25;
const PRIOR_ONE: f64 = 0.40;
const PRIOR_TWO: f64 = 0.25;
/// Three are this much less probable than two, and so on.
const FURTHER: f64 = 0.2;
/// An effect of the camera is this much likelier than one of physics.
const CAMERA_FIRST: f64 = 2.0;
/// Of physics outside the table.
pub const PRIOR_UNKNOWN: f64 = 0.10;

/// How much the best hypothesis leaves, over the variance of the noise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scatter {
    /// v, of one value.
    pub of_values: f64,
    /// s², of as many values as there are.
    pub of_all: f64,
}

impl Scatter {
    /// Nothing but noise.
    pub const NOISE: Self = Self { of_values: 1.0, of_all: 1.0 };

    /// Of a fit to so many values.
    pub fn of(fit: &Refit<'_>, values: usize) -> Self {
        let excess = fit.chi2 / values as f64 - 1.0;
        let Some((left, _)) = (excess > 0.0).then(|| fit.linearised()).flatten() else { return Self::NOISE };
        let rho = noise::of_all(left.as_slice()).colour.rho.clamp(0.0, 0.99);
        Self { of_values: 1.0 + excess, of_all: 1.0 + excess * (1.0 + rho) / (1.0 - rho) }
    }
}

/// ln of the prior probability of a hypothesis, of `candidates` effects.
pub fn ln_prior(hypothesis: &Hypothesis, candidates: usize) -> f64 {
    let count = candidates.max(1) as f64;
    // in doubt it is the camera
    let camera = hypothesis.causes.iter().filter(|c| c.place() == Place::Camera).count() as f64 * CAMERA_FIRST.ln();
    camera
        + match hypothesis.causes.len() {
            0 => PRIOR_NULL.ln(),
            1 => (PRIOR_ONE / count).ln(),
            many => (PRIOR_TWO * FURTHER.powi(many as i32 - 2) / ways(count, many)).ln(),
        }
}

/// Of how many kinds `chosen` effects of `count` can be.
fn ways(count: f64, chosen: usize) -> f64 {
    (0..chosen).map(|k| (count - k as f64).max(1.0) / (k + 1) as f64).product::<f64>().max(1.0)
}

/// ln Z of a fitted hypothesis; −∞ where a coefficient is not told from zero. `least_without` is the least χ² of all hypotheses that lack an effect of
/// it: where far more than noise is left, it says better than the tangent whether that effect is needed.
pub fn ln_evidence(fit: &Refit<'_>, scatter: Scatter, least_without: impl Fn(Cause) -> f64) -> f64 {
    let likelihood = -0.5 * fit.chi2 / scatter.of_all;
    let added: Vec<Parameter> = fit.added().into_iter().filter(|p| *p != Parameter::BendingStiffness).collect();
    if added.is_empty() {
        return likelihood;
    }
    let covariance = fit.covariance(&added) * scatter.of_values;
    let mut ln_volume = 0.5 * (covariance.clone() * std::f64::consts::TAU).determinant().max(1e-300).ln();
    let of = |parameter: Parameter| {
        let i = added.iter().position(|p| *p == parameter).unwrap_or(0);
        (fit.value(parameter).unwrap_or(0.0), covariance[(i, i)].sqrt())
    };
    for cause in &fit.hypothesis.causes {
        let (value, sd) = match cause {
            Cause::DistributedFlexibility => continue,
            Cause::SupportMotion if only_leans(fit) => return f64::NEG_INFINITY,
            Cause::SupportMotion => {
                let ((sine, sd), (cosine, _)) = (of(Parameter::SupportSine), of(Parameter::SupportCosine));
                (sine.hypot(cosine), sd)
            }
            one => of(one.parameters()[0]),
        };
        let fall = (least_without(*cause) - fit.chi2) / scatter.of_all;
        let needed = scatter.of_values > MUCH_LEFT && fall > NEEDED;
        // a law of no size is none, however much more is left without it
        if value == 0.0 || !(needed || value.abs() > TOLD_FROM_ZERO * sd) {
            return f64::NEG_INFINITY;
        }
        ln_volume -= (value.abs() * SIZES).ln();
        match cause {
            Cause::SupportMotion => {
                // direction of the phase, and any frequency up to a multiple of the swing's
                ln_volume -= (std::f64::consts::TAU * value.abs()).ln();
                let highest_hz = 10.0;
                ln_volume -= f64::ln(highest_hz);
            }
            Cause::JointHysteretic => {
                let (yield_rad, sd) = of(Parameter::HysteresisYield);
                // a yield angle that the recording does not tell can be any
                ln_volume -= (yield_rad * YIELDS).ln().max(sd.ln());
            }
            Cause::DroppedFrames => {
                let rows: usize = fit.problem.records.iter().map(crate::fit::Record::len).sum();
                ln_volume -= (rows as f64).ln();
            }
            // either sign
            one if !one.parameters()[0].is_not_negative() => ln_volume -= std::f64::consts::LN_2,
            _ => {}
        }
    }
    let ln = likelihood + ln_volume;
    if ln.is_nan() { f64::NEG_INFINITY } else { ln }
}

/// Whether the support of a fit moves so slowly beside the swing that nothing moves but the angles' zero.
fn only_leans(fit: &Refit<'_>) -> bool {
    let Ok((model, _)) = fit.problem.model(0, &fit.x[..fit.problem.free.len()]) else { return false };
    let swing_hz = model.pace_rad_s() / std::f64::consts::TAU;
    fit.value(Parameter::SupportFrequency).is_some_and(|hz| hz < LOWEST * swing_hz)
}

/// Probabilities from logarithms, which need not be normalised.
pub fn normalised(ln: &[f64]) -> Vec<f64> {
    let most = ln.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let sum: f64 = ln.iter().map(|l| (l - most).exp()).sum();
    ln.iter().map(|l| (l - most).exp() / sum).collect()
}

#[cfg(test)]
mod tests {
    use nalgebra::DMatrix;

    use super::*;
    use crate::experiment::Experiment;
    use crate::fit::{Problem, Record};

    /// A fit with dry friction of this size, its standard deviation 10⁻⁸ N·m, that leaves four times the noise's variance in 60 values.
    fn with_friction(records: &[Record], torque_n_m: f64) -> Refit<'_> {
        let free = [Parameter::HingeCoulomb];
        let problem = Problem::new(records, &Experiment::default(), &free).unwrap();
        let mut x = vec![torque_n_m];
        x.resize(problem.variables(), 0.3);
        let mut normal = DMatrix::identity(x.len(), x.len());
        normal[(0, 0)] = 1e16;
        let hypothesis = Hypothesis { causes: vec![Cause::HingeCoulomb], dropped: None };
        Refit { hypothesis, problem, x, chi2: 240.0, normal, steps: 1, converged: true }
    }

    #[test]
    fn a_law_of_no_size_is_none_however_much_is_left_without_it() {
        let t_s: Vec<f64> = (0..30).map(|k| k as f64 / 30.0).collect();
        let theta_rad = vec![vec![Some(0.1); 30]; 2];
        let records =
            [Record { path: "made".into(), theta_rad, relative_sd: vec![vec![1.0; 30]; 2], t_s, in_step: 0.0 }];
        let scatter = Scatter { of_values: 5.0, of_all: 5.0 };
        let needed = |torque_n_m: f64| ln_evidence(&with_friction(&records, torque_n_m), scatter, |_| 1e6);
        assert_eq!(needed(0.0), f64::NEG_INFINITY);
        // far more than noise is left: what is needed is not held against its own standard deviation
        assert!(needed(1e-8).is_finite());
        let not_needed = ln_evidence(&with_friction(&records, 1e-8), scatter, |_| 241.0);
        assert_eq!(not_needed, f64::NEG_INFINITY);
    }
}
