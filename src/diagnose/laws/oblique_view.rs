//! A camera that looks askew: a stretch and a shear of the picture; a sensor whose scale is wrong.
//!
//! Turned aside by α and down by β, both small, it has s = (β² − α²)/2 and b = αβ: half the square of α + iβ but for signs. If no direction of α + iβ is likelier
//! than another, none of (s, b) is: so the size is ρ = √(s² + b²), and the direction any.

use super::super::effect::Effect;
use super::super::refit::Refit;
use super::super::settings::{PriorSettings, Settings};
use super::{Coefficients, FARTHEST, Law};
use crate::model::Parameter;

/// Of the larger of a gain and a stretch the part up to which their sum is next to none (judgement: chance does that once in ten times).
const UNDONE: f64 = 0.25;

/// A camera that looks askew.
pub struct ObliqueView;
/// A gain of all angles.
pub struct WrongScale;

impl Law for ObliqueView {
    /// ρ, as many standard deviations from zero as the stretch or the shear.
    fn strength(&self, _effect: Effect, of: &Coefficients<'_>) -> Option<(f64, f64)> {
        let ((stretch, of_stretch), (shear, of_shear)) = (of(Parameter::ViewStretch), of(Parameter::ViewShear));
        let size = stretch.hypot(shear);
        let deviations = (stretch / of_stretch).abs().max((shear / of_shear).abs());
        Some((size, size / deviations.max(f64::MIN_POSITIVE)))
    }

    /// Any direction.
    fn ln_multiplicity(
        &self,
        _fit: &Refit<'_>,
        effect: Effect,
        of: &Coefficients<'_>,
        _settings: &PriorSettings,
    ) -> f64 {
        let size = self.strength(effect, of).map_or(0.0, |strength| strength.0);
        (std::f64::consts::TAU * size).ln()
    }

    fn is_possible(&self, fit: &Refit<'_>, prior: &PriorSettings) -> bool {
        let size = |parameter| fit.value(parameter).unwrap_or(0.0);
        size(Parameter::ViewStretch).hypot(size(Parameter::ViewShear)) < FARTHEST * prior.view
    }

    fn odds(&self, fit: &Refit<'_>, others: &[&Refit<'_>], settings: &Settings) -> f64 {
        super::odds_of_what_completes_a_law(fit, others, settings)
    }
}

impl Law for WrongScale {
    fn is_possible(&self, fit: &Refit<'_>, prior: &PriorSettings) -> bool {
        fit.value(Parameter::AngleGain).is_none_or(|gain| gain.abs() < FARTHEST * prior.view)
    }

    /// A gain and a stretch that undo each other leave only what they do to large angles, which a torque does, too.
    fn odds(&self, fit: &Refit<'_>, others: &[&Refit<'_>], settings: &Settings) -> f64 {
        let [gain, stretch] = [Parameter::AngleGain, Parameter::ViewStretch].map(|p| fit.value(p).unwrap_or(0.0));
        let undone = (gain + stretch).abs() < UNDONE * gain.abs().max(stretch.abs());
        let alone = super::odds_of_what_completes_a_law(fit, others, settings);
        if undone { alone.min(settings.prior.within_law_error) } else { alone }
    }
}
