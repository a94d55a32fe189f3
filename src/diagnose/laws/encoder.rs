//! An encoder that sits off its shaft's axis, or askew on it.
//!
//! Once a turn and twice a turn, each with a sine and a cosine, and its zero: five coefficients. Nobody knows where on the shaft it was fixed, so that no direction of the five is
//! likelier than another: the size ρ is the root of the sum of their squares, and the direction any, of an area 8π² ρ⁴/3.

use super::super::effect::Effect;
use super::super::misfit::leaves_only_noise;
use super::super::refit::Refit;
use super::super::settings::{PriorSettings, Settings};
use super::{Coefficients, FARTHEST, Law};
use crate::model::{EncoderShape, Parameter};

/// The error of an encoder.
pub struct EncoderError;

impl Law for EncoderError {
    /// ρ, as many standard deviations from zero as the clearest of them but the zero.
    fn strength(&self, _effect: Effect, of: &Coefficients<'_>) -> Option<(f64, f64)> {
        let parts = EncoderShape::ALL.map(|shape| of(Parameter::Encoder(shape)));
        let size = parts.iter().map(|(value, _)| value * value).sum::<f64>().sqrt();
        let of_turn = EncoderShape::ALL.iter().zip(parts).filter(|(shape, _)| **shape != EncoderShape::Zero);
        let deviations = of_turn.map(|(_, (value, sd))| (value / sd).abs()).fold(f64::MIN_POSITIVE, f64::max);
        Some((size, size / deviations))
    }

    /// Any direction of the five.
    fn ln_multiplicity(
        &self,
        _fit: &Refit<'_>,
        effect: Effect,
        of: &Coefficients<'_>,
        _settings: &PriorSettings,
    ) -> f64 {
        let size = self.strength(effect, of).map_or(0.0, |strength| strength.0);
        (8.0 / 3.0 * std::f64::consts::PI.powi(2) * size.powi(4)).ln()
    }

    /// Its five free numbers complete any law that is only nearly right: where more than noise is left, something else is at work, and may be all.
    fn odds(&self, fit: &Refit<'_>, _others: &[&Refit<'_>], settings: &Settings) -> f64 {
        if leaves_only_noise(fit, &settings.misfit) { 1.0 } else { settings.prior.within_law_error }
    }

    fn is_possible(&self, fit: &Refit<'_>, prior: &PriorSettings) -> bool {
        let parts = EncoderShape::ALL.map(|shape| fit.value(Parameter::Encoder(shape)).unwrap_or(0.0));
        parts.iter().all(|part| part.abs() < FARTHEST * prior.encoder_rad)
    }
}
