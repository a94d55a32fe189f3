//! The evidence of each hypothesis, by Laplace's approximation.
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

use super::effect::{Effect, Place};
use super::hypothesis::Hypothesis;
use super::laws::{Estimates, law_of};
use super::noise;
use super::refit::Refit;
use super::settings::PriorSettings;
use crate::model::Parameter;

/// Largest correlation from row to row of what a fit leaves (numerics: (1 + ρ)/(1 − ρ) is at most 199).
const MOST_RHO: f64 = 0.99;

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
        let rho = noise::of_all(left.as_slice()).colour.rho.clamp(0.0, MOST_RHO);
        Self { of_values: 1.0 + excess, of_all: 1.0 + excess * (1.0 + rho) / (1.0 - rho) }
    }
}

/// ln of the prior probability of a hypothesis, of `candidates` effects.
pub fn ln_prior(hypothesis: &Hypothesis, candidates: usize, settings: &PriorSettings) -> f64 {
    let count = candidates.max(1) as f64;
    // in doubt it is the camera
    let of_camera = hypothesis.effects.iter().filter(|c| c.place() == Place::Camera).count() as f64;
    of_camera * settings.camera_first.ln()
        + match hypothesis.effects.len() {
            0 => settings.none.ln(),
            1 => (settings.one / count).ln(),
            many => (settings.two * settings.further.powi(many as i32 - 2) / ways(count, many)).ln(),
        }
}

/// Of how many kinds `chosen` effects of `count` can be.
fn ways(count: f64, chosen: usize) -> f64 {
    (0..chosen).map(|k| (count - k as f64).max(1.0) / (k + 1) as f64).product::<f64>().max(1.0)
}

/// Whether its coefficients may be what the effects are named for, whatever they leave.
pub fn is_possible(fit: &Refit<'_>, settings: &PriorSettings) -> bool {
    fit.hypothesis.effects.iter().all(|effect| law_of(*effect).is_possible(fit, settings))
}

/// ln Z of a fitted hypothesis; −∞ where a coefficient is not told from zero. `least_without` is the least χ² of all hypotheses that lack an effect of
/// it: where far more than noise is left, it says better than the tangent whether that effect is needed (a fall by `counts` variances).
pub fn ln_evidence(
    fit: &Refit<'_>,
    scatter: Scatter,
    least_without: impl Fn(Effect) -> f64,
    settings: &PriorSettings,
    counts: f64,
) -> f64 {
    let likelihood = -0.5 * fit.chi2 / scatter.of_all;
    let estimates = Estimates::of(fit, scatter.of_values);
    if estimates.effects.is_empty() {
        return likelihood;
    }
    let determinant = (estimates.covariance.clone() * std::f64::consts::TAU).determinant();
    let mut ln_volume = 0.5 * determinant.max(1e-300).ln();
    let of = |parameter: Parameter| estimates.value(parameter);
    let mut not_told = 0;
    for effect in estimates.effects.iter().copied() {
        let law = law_of(effect);
        let Some((value, _)) = law.strength(effect, &of).filter(|_| law.is_possible(fit, settings)) else {
            return f64::NEG_INFINITY;
        };
        let fall = (least_without(effect) - fit.chi2) / scatter.of_all;
        let needed = scatter.of_values > settings.much_left && fall > counts;
        let is_told = estimates.tells(effect, settings);
        not_told += usize::from(!is_told);
        // a law of no size is none, however much more is left without it; and two of any size, as long as they grow together, are none
        if value == 0.0 || !(needed || is_told) || not_told > 1 {
            return f64::NEG_INFINITY;
        }
        ln_volume -= (value.abs() * settings.sizes).ln() + law.ln_multiplicity(fit, effect, &of, settings);
    }
    let ln = likelihood + ln_volume;
    if ln.is_nan() { f64::NEG_INFINITY } else { ln }
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
    use crate::diagnose::refit::Certificate;
    use crate::experiment::Experiment;
    use crate::fit::{Problem, Record};

    fn records() -> [Record; 1] {
        let t_s: Vec<f64> = (0..30).map(|k| k as f64 / 30.0).collect();
        let theta_rad = vec![vec![Some(0.1); 30]; 2];
        [Record::uniform("made", t_s, theta_rad)]
    }

    /// A fit with one effect of this size and standard deviation, that leaves so much in 60 values.
    fn with(records: &[Record], effect: Effect, (value, sd): (f64, f64), chi2: f64) -> Refit<'_> {
        let problem = Problem::new(records, &Experiment::default(), &effect.parameters()[..1]).unwrap();
        let mut x = vec![value];
        x.resize(problem.variables(), 0.3);
        let mut normal = DMatrix::identity(x.len(), x.len());
        normal[(0, 0)] = 1.0 / (sd * sd);
        let hypothesis = Hypothesis { effects: vec![effect], dropped: None };
        let certificate = Certificate { starts_agreeing: 1, nested_ok: true };
        Refit { hypothesis, problem, x, chi2, normal, steps: 1, damping: 0.0, converged: true, certificate }
    }

    #[test]
    fn a_gain_that_no_sensor_has_is_none() {
        let records = records();
        let with_gain = |gain: f64| {
            let fit = with(&records, Effect::AngleGain, (gain, 1e-4), 60.0);
            ln_evidence(&fit, Scatter::NOISE, |_| 1e6, &PriorSettings::default(), 9.0)
        };
        assert!(with_gain(0.08).is_finite() && with_gain(-0.11).is_finite());
        assert_eq!(with_gain(-0.16), f64::NEG_INFINITY);
    }

    #[test]
    fn a_law_of_no_size_is_none_however_much_is_left_without_it() {
        let records = records();
        let with_friction = |torque_n_m: f64| with(&records, Effect::HingeCoulomb, (torque_n_m, 1e-8), 240.0);
        let scatter = Scatter { of_values: 5.0, of_all: 5.0 };
        let needed =
            |torque_n_m: f64| ln_evidence(&with_friction(torque_n_m), scatter, |_| 1e6, &PriorSettings::default(), 9.0);
        assert_eq!(needed(0.0), f64::NEG_INFINITY);
        // far more than noise is left: what is needed is not held against its own standard deviation
        assert!(needed(1e-8).is_finite());
        let not_needed = ln_evidence(&with_friction(1e-8), scatter, |_| 241.0, &PriorSettings::default(), 9.0);
        assert_eq!(not_needed, f64::NEG_INFINITY);
    }
}
