//! How much a fit lacks: it decides from how many starts an effect is sought beside it.

use super::context::FitContext;
use super::refit::{Refit, least_chi2};
use super::screen::Score;
use super::settings::{MisfitSettings, NoiseSettings};

/// How much a fit lacks.
#[derive(Debug, Clone, Copy)]
pub struct Misfit {
    /// χ² from which on a fit leaves more than noise.
    pub chi2_limit: f64,
    /// It leaves more than noise.
    pub unexplained: bool,
    /// And no further effect that was fitted beside it brings χ² down to the noise; or χ² is so small that many may.
    pub unexplained_by_any: bool,
    /// It leaves little.
    little: bool,
    /// Its motion has lost step with a recording.
    pub out_of_step: bool,
    /// A spring of the base model has drifted far from what the file and the recordings' modes say: it compensates for something missing, and is no start for
    /// anything else.
    pub spring_drifted: bool,
    /// An effect that is not scanned for would explain some of it.
    pub seen: bool,
    /// An expensive start is given up unless its first steps lead below this χ².
    pub leads: f64,
}

impl Misfit {
    /// Of a fit, with what other effects promise beside it.
    pub fn of(context: &FitContext<'_>, fit: &Refit<'_>, scores: &[Score]) -> Self {
        let settings = &context.settings.misfit;
        let values = context.values() as f64;
        let chi2_limit = chi2_noise_limit(context.values(), settings);
        let relative_residual = fit.relative_residual();
        let out_of_step = relative_residual > settings.out_of_step;
        let unexplained = relative_residual > settings.much || fit.chi2 > chi2_limit;
        let least_fall = settings.leads * (fit.chi2 - values);
        let hopeless_chi2 = context.settings.descent.hopeless_ratio * fit.chi2;
        Self {
            chi2_limit,
            unexplained,
            unexplained_by_any: unexplained,
            little: fit.chi2 < settings.little * values,
            out_of_step,
            spring_drifted: unexplained && has_drifted(fit, settings.strays),
            leads: if unexplained && !out_of_step { fit.chi2 - least_fall } else { hopeless_chi2 },
            seen: scores.iter().any(|s| s.gain > settings.counts && !s.effect.is_scanned()),
        }
    }

    /// The same where these are fits of other effects.
    #[must_use]
    pub fn beside(self, others: &[Refit<'_>]) -> Self {
        Self { unexplained_by_any: self.unexplained && (self.little || least_chi2(others) > self.chi2_limit), ..self }
    }
}

/// Whether a spring of the file's has become so many times as stiff, or as soft.
fn has_drifted(fit: &Refit<'_>, times: f64) -> bool {
    let Ok(stated) = fit.problem.start_values() else { return false };
    let pairs =
        fit.problem.free.iter().zip(stated).filter(|(parameter, stated)| parameter.is_spring() && *stated > 0.0);
    let mut ratios = pairs.filter_map(|(parameter, stated)| Some(fit.value(*parameter)? / stated));
    ratios.any(|ratio| ratio > times || ratio < 1.0 / times)
}

/// The largest χ² of so many values that is still noise.
pub fn chi2_noise_limit(values: usize, settings: &MisfitSettings) -> f64 {
    let values = values as f64;
    values + settings.deviations * (2.0 * values).sqrt()
}

/// Whether a fit leaves no more than noise.
pub fn leaves_only_noise(fit: &Refit<'_>, settings: &MisfitSettings) -> bool {
    fit.chi2 < chi2_noise_limit(fit.values(), settings)
}

/// The part of what the base model leaves beyond the noise that a fit leaves, too.
pub fn left_of_excess(fit: &Refit<'_>, base: &Refit<'_>) -> f64 {
    let beyond = |fit: &Refit<'_>| (fit.chi2 - fit.values() as f64).max(0.0);
    beyond(fit) / beyond(base).max(1.0)
}

/// χ² over the variance that the best fit leaves, plus a penalty for each effect.
pub fn needs(fit: &Refit<'_>, best: &Refit<'_>, settings: &MisfitSettings) -> f64 {
    fit.chi2 / best.variance_ratio() + settings.counts * fit.hypothesis.effects.len() as f64
}

/// Whether a fit leaves so much that the noise does not matter.
pub fn leaves_more_than_noise(fit: &Refit<'_>, settings: &NoiseSettings) -> bool {
    fit.over_noise() > settings.beyond
}

/// The same of a fit with names.
pub fn is_beyond_noise(fit: &Refit<'_>, settings: &NoiseSettings) -> bool {
    !fit.hypothesis.effects.is_empty() && leaves_more_than_noise(fit, settings)
}
