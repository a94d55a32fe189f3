//! How much a fit lacks: it decides from how many starts an effect is sought beside it.

use super::context::FitContext;
use super::refit::{Refit, least_chi2};
use super::screen::Score;
use super::settings::{MisfitSettings, NoiseSettings};

/// How much a fit lacks.
#[derive(Debug, Clone, Copy)]
pub struct Misfit {
    /// χ² from which on a fit leaves more than noise.
    pub too_much: f64,
    /// It leaves more than noise.
    pub unexplained: bool,
    /// And so does every other effect beside it, as far as that is known; or it leaves so little that many may explain it.
    pub unsolved: bool,
    /// It leaves little.
    little: bool,
    /// Its motion has lost step with a recording.
    pub out_of_step: bool,
    /// A spring of the base model has gone far from what the file and the recordings' modes say: it stands for what is missing, and is no place to start from.
    pub strayed: bool,
    /// An effect that is not scanned for would explain some of it.
    pub seen: bool,
    /// A dear start leads somewhere where its first steps leave less than this χ².
    pub leads: f64,
}

impl Misfit {
    /// Of a fit, with what other effects promise beside it.
    pub fn of(context: &FitContext<'_>, fit: &Refit<'_>, scores: &[Score]) -> Self {
        let settings = &context.settings.misfit;
        let values = context.values() as f64;
        let too_much = most_of_noise(context.values(), settings);
        let left_share = fit.left_share();
        let out_of_step = left_share > settings.out_of_step;
        let unexplained = left_share > settings.much || fit.chi2 > too_much;
        let least_fall = settings.leads * (fit.chi2 - values);
        let beyond_hope = context.settings.descent.beyond_hope * fit.chi2;
        Self {
            too_much,
            unexplained,
            unsolved: unexplained,
            little: fit.chi2 < settings.little * values,
            out_of_step,
            strayed: unexplained && has_strayed(fit, settings.strays),
            leads: if unexplained && !out_of_step { fit.chi2 - least_fall } else { beyond_hope },
            seen: scores.iter().any(|s| s.gain > settings.counts && !s.effect.is_scanned()),
        }
    }

    /// The same where these are fits of other effects.
    #[must_use]
    pub fn beside(self, others: &[Refit<'_>]) -> Self {
        Self { unsolved: self.unexplained && (self.little || least_chi2(others) > self.too_much), ..self }
    }
}

/// Whether a spring of the file's has become so many times as stiff, or as soft.
fn has_strayed(fit: &Refit<'_>, times: f64) -> bool {
    let Ok(stated) = fit.problem.start_values() else { return false };
    let pairs =
        fit.problem.free.iter().zip(stated).filter(|(parameter, stated)| parameter.is_spring() && *stated > 0.0);
    let mut ratios = pairs.filter_map(|(parameter, stated)| Some(fit.value(*parameter)? / stated));
    ratios.any(|ratio| ratio > times || ratio < 1.0 / times)
}

/// The largest χ² of so many values that is still noise.
pub fn most_of_noise(values: usize, settings: &MisfitSettings) -> f64 {
    let values = values as f64;
    values + settings.deviations * (2.0 * values).sqrt()
}

/// What a fit leaves, in variances of what the best one leaves, and what its effects must gain.
pub fn needs(fit: &Refit<'_>, best: &Refit<'_>, settings: &MisfitSettings) -> f64 {
    let variance = (best.chi2 / best.values().max(1) as f64).max(1.0);
    fit.chi2 / variance + settings.counts * fit.hypothesis.effects.len() as f64
}

/// Whether a motion has lost step with a recording: what is left is a good part of the swing.
pub fn is_out_of_step(fit: &Refit<'_>, settings: &MisfitSettings) -> bool {
    fit.left_share() > settings.out_of_step
}

/// Whether a fit leaves so much that the noise does not matter.
pub fn leaves_more_than_noise(fit: &Refit<'_>, settings: &NoiseSettings) -> bool {
    fit.over_noise() > settings.beyond
}

/// The same of a fit with names.
pub fn is_beyond_noise(fit: &Refit<'_>, settings: &NoiseSettings) -> bool {
    !fit.hypothesis.effects.is_empty() && leaves_more_than_noise(fit, settings)
}
