//! Where a model differs from a recording: time, amplitude, phase, frequency.

use super::effect::{Phase, Place};
use super::latent_forces::place_of_all;
use super::posterior::Posterior;
use super::refit::Refit;
use super::settings::Settings;
use crate::fit::{Residuals, Verdict, recordings};

/// What makes fewer cycles in a recording has no frequency.
pub const FEWEST_CYCLES: usize = 2;

/// Where something unknown acts: sought around the base model, near the effect that explains most.
pub fn place_of_unknown(posterior: &Posterior<'_>, settings: &Settings) -> Option<Place> {
    let of_nearest = posterior.by_contribution(posterior.best()).first().map(|effect| effect.place());
    place_of_all(posterior.base(), of_nearest, settings.verdict.places)
}

/// Where, when and how the base model departs from the first recording that it does not reproduce.
#[derive(Debug, Clone, Default)]
pub struct Departure {
    /// From and until when.
    pub time_s: Option<[f64; 2]>,
    /// Amplitudes there.
    pub amplitude_rad: Option<[f64; 2]>,
    /// Strongest frequency of what is left.
    pub frequency_hz: Option<f64>,
    /// Phase with which the residual goes: with the velocity (a delay) or with the position (a gain).
    pub goes_with: Option<Phase>,
}

/// The departure of the base model.
pub fn departure(null: &Refit<'_>) -> Departure {
    for pieces in recordings(null.problem.records) {
        let first = pieces.start;
        let Some(residuals) = null.residuals_of(pieces) else { continue };
        let Ok((model, _)) = null.problem.model(first, &null.x[..null.problem.free.len()]) else { continue };
        let window_s = std::f64::consts::TAU / model.characteristic_rad_s();
        let verdict = Verdict::of(&residuals, window_s);
        let wrong: Vec<_> = verdict.windows.iter().filter(|w| w.links.iter().any(|l| l.misfit)).collect();
        let (Some(first), Some(last)) = (wrong.first(), wrong.last()) else { continue };
        let amplitudes = wrong.iter().flat_map(|w| w.links.iter().map(|l| l.amplitude_rad));
        let (least, most) = amplitudes.fold((f64::INFINITY, 0.0f64), |(a, b), v| (a.min(v), b.max(v)));
        // a window's amplitude is that of a sine, which a wide swing is not
        let seen = residuals.values.iter().flatten().map(|r| (r.predicted_rad + r.left_rad()).abs());
        let largest = seen.fold(0.0, f64::max);
        let (least, most) = (least.min(largest), most.min(largest));
        return Departure {
            time_s: Some([first.from_s, last.until_s]),
            amplitude_rad: Some([least, most]),
            frequency_hz: strongest_hz(&residuals, model.characteristic_rad_s()),
            goes_with: goes_with(&residuals),
        };
    }
    Departure::default()
}

/// Which explains more of what is left: a delay or a gain, window by window taken together.
fn goes_with(residuals: &Residuals) -> Option<Phase> {
    let (mut delay, mut gain, mut rates, mut angles) = (0.0, 0.0, 0.0, 0.0);
    for r in residuals.values.iter().flatten() {
        delay += r.left_rad() * r.rate_rad_s;
        gain += r.left_rad() * r.predicted_rad;
        rates += r.rate_rad_s * r.rate_rad_s;
        angles += r.predicted_rad * r.predicted_rad;
    }
    (rates > 0.0 && angles > 0.0).then(|| {
        // a torque in phase with the velocity changes the amplitude, one with the position the phase
        if delay * delay / rates > gain * gain / angles { Phase::Position } else { Phase::Velocity }
    })
}

/// The frequency at which what is left is strongest, up to half the rate of the rows; `None` of what makes less than two cycles: that is an offset or a drift.
fn strongest_hz(residuals: &Residuals, characteristic_rad_s: f64) -> Option<f64> {
    let values = residuals.values.iter().max_by_key(|v| v.len())?;
    let span_s = values.last()?.t_s - values.first()?.t_s;
    let swing_hz = characteristic_rad_s / std::f64::consts::TAU;
    let count = ((8.0 * swing_hz * span_s) as usize).min(values.len() / 2);
    let power = |k: usize| {
        let rate = std::f64::consts::TAU * k as f64 / span_s;
        let sum = values.iter().fold([0.0; 2], |s, r| {
            let (sin, cos) = (rate * r.t_s).sin_cos();
            [s[0] + r.left_rad() * sin, s[1] + r.left_rad() * cos]
        });
        // an offset has twice the sum of a sine of its size
        (sum[0] * sum[0] + sum[1] * sum[1]) / if k == 0 { 4.0 } else { 1.0 }
    };
    let best = (0..count).map(|k| (k, power(k))).max_by(|a, b| a.1.total_cmp(&b.1))?.0;
    (best >= FEWEST_CYCLES).then(|| best as f64 / span_s)
}
