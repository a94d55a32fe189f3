//! Damping from the half-power bandwidth.
//!
//! ```text
//! ξ = (ω₂ − ω₁) / 2ωₙ          (paper Eq. 28)
//! ```
//! ω₁, ω₂ are where the *power* |X|² falls to ½ of its peak, the amplitude to 1/√2. The spectrum of a free decay of length T, unwindowed, is
//!
//! ```text
//! |X(ω)|² ∝ |1 − e^{−(σ+iδ)T}|² / (σ² + δ²),   δ = ω − ω_d
//! ```
//! A long record (σT ≫ 1) shows the width 2σ of Eq. 28; a short one shows about 0.89/T, whatever the damping. σ is solved from the measured
//! width by the formula above, so that the record's end does not pass for damping, and the literal Eq. 28 stands beside it. Where less than
//! half of the width is the motion's own, the method cannot tell damping from the record's end and says so. The line's mirror image at −ω_d reaches
//! into it with a relative amplitude of σ/2ω = ξ/2 and a phase that nobody knows: an uncertainty of ξ of about ξ, of f about ξ²/2, which
//! the intervals hold.

use nalgebra::Complex;
use serde::Serialize;

use super::estimate::Estimate;
use super::pole::Pole;
use super::signal::Signal;
use super::spectrum::{Window, line_sd_hz};

/// Width at half power, in 1/T, of a steady oscillation cut off by the record.
const CUT_OFF_WIDTH: f64 = 0.8859;
/// The motion's own bandwidth 2ξf that can be resolved, in 1/T; below, more than half of the measured width is the record's end.
const LEAST_BANDWIDTH: f64 = 0.6;

/// A resolved resonance curve.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct HalfPower {
    /// Width at half power as measured.
    pub width_hz: f64,
    /// The literal Eq. 28, record's end included.
    pub damping_ratio_literal: f64,
    /// The record's end allowed for.
    pub damping_ratio: Estimate,
    /// Undamped natural frequency from the peak.
    pub frequency_hz: Estimate,
}

impl HalfPower {
    /// Of a signal with only one mode in it, near this pole, with this noise in each link.
    ///
    /// # Errors
    /// In words, with the width against the resolution, when the record is too short.
    pub fn of(signal: &Signal, near: Pole, noise_rad: &[f64]) -> Result<Self, String> {
        let duration_s = signal.duration_s();
        let resolution_hz = 1.0 / duration_s;
        let cells: Vec<Vec<f64>> = signal.links.iter().map(|l| l.cells(signal.step_s)).collect();
        let power = |f_hz: f64| line_power(signal, &cells, f_hz);
        let near_hz = near.omega_rad_s / std::f64::consts::TAU;
        let reach_hz = resolution_hz.max(2.0 * near.decay_per_s.abs() / std::f64::consts::TAU);
        let peak_hz = maximum(&power, near_hz - reach_hz, near_hz + reach_hz);
        let half = 0.5 * power(peak_hz);
        let crossing = |direction: f64| crossing(&power, peak_hz, direction * 0.25 * reach_hz, half);
        let (Some(low_hz), Some(high_hz)) = (crossing(-1.0), crossing(1.0)) else {
            return Err("the resonance curve does not fall to half power beside its peak".to_owned());
        };
        let width_hz = high_hz - low_hz;
        let own_hz = decay_of_width(width_hz, duration_s).unwrap_or(0.0) / std::f64::consts::PI;
        if own_hz < LEAST_BANDWIDTH * resolution_hz {
            return Err(format!(
                "not resolved: the peak is {width_hz:.4} Hz wide, the record's length alone gives {:.4} Hz; record at least {:.0} s",
                CUT_OFF_WIDTH * resolution_hz,
                LEAST_BANDWIDTH / (near.decay_per_s.abs() / std::f64::consts::PI).max(1e-6)
            ));
        }
        let decay = std::f64::consts::PI * own_hz;
        let natural_rad_s = (std::f64::consts::TAU * peak_hz).hypot(decay);
        // noise of X: s √(N/2) in each of its two directions, against |X| at the peak
        let noise2: f64 = signal.links.iter().zip(noise_rad).map(|(l, s)| 0.5 * s * s * l.t_s.len() as f64).sum();
        let relative = (noise2 / signal.links.len() as f64 / power(peak_hz)).sqrt();
        let stretch = width_hz / own_hz;
        let (ratio, literal) = (decay / natural_rad_s, std::f64::consts::PI * width_hz / natural_rad_s);
        let damping = Estimate::new(ratio, ratio * (2.5 * relative * stretch).hypot(ratio), 1e6);
        let frequency_sd_hz = line_sd_hz(signal, Window::Flat, peak_hz, noise_rad)
            .unwrap_or(own_hz)
            .hypot(0.4 * literal * literal * peak_hz);
        Ok(Self {
            width_hz,
            damping_ratio_literal: literal,
            damping_ratio: damping,
            frequency_hz: Estimate::new(natural_rad_s / std::f64::consts::TAU, frequency_sd_hz, 1e6),
        })
    }
}

/// |X(f)|² of a signal at some frequencies, as a share of the largest: the curve whose width is measured.
pub fn resonance_curve(signal: &Signal, frequencies_hz: &[f64]) -> Vec<f64> {
    let cells: Vec<Vec<f64>> = signal.links.iter().map(|l| l.cells(signal.step_s)).collect();
    let power: Vec<f64> = frequencies_hz.iter().map(|f| line_power(signal, &cells, *f)).collect();
    let most = power.iter().fold(f64::MIN_POSITIVE, |most, p| most.max(*p));
    power.into_iter().map(|p| p / most).collect()
}

/// |X(f)|² over the true time stamps, each sample standing for the time around it, summed over the links.
fn line_power(signal: &Signal, cells: &[Vec<f64>], f_hz: f64) -> f64 {
    let omega = std::f64::consts::TAU * f_hz;
    let each = signal.links.iter().zip(cells).map(|(link, cells)| {
        let samples = link.t_s.iter().zip(&link.theta_rad).zip(cells);
        let turned = samples.map(|((t, a), cell)| Complex::from_polar(a * cell, -omega * (t - signal.span_s[0])));
        turned.sum::<Complex<f64>>().norm_sqr()
    });
    each.sum()
}

/// Width at half power of a decay of rate σ cut off after T.
fn width_of_decay_hz(decay_per_s: f64, duration_s: f64) -> f64 {
    let power = |delta: f64| {
        let s = Complex::new(decay_per_s, delta) * duration_s;
        if s.norm() < 1e-6 { 1.0 } else { ((Complex::new(1.0, 0.0) - (-s).exp()) / s).norm_sqr() }
    };
    let half = 0.5 * power(0.0);
    let (mut low, mut high) = (0.0, std::f64::consts::PI / duration_s + 1.1 * decay_per_s);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if power(middle) > half { low = middle } else { high = middle }
    }
    (low + high) / std::f64::consts::TAU
}

/// σ of a measured width; `None` when the record's end alone is wider.
fn decay_of_width(width_hz: f64, duration_s: f64) -> Option<f64> {
    let (mut low, mut high) = (0.0, std::f64::consts::PI * width_hz * 1.2);
    if width_of_decay_hz(low, duration_s) >= width_hz {
        return None;
    }
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if width_of_decay_hz(middle, duration_s) < width_hz { low = middle } else { high = middle }
    }
    Some(0.5 * (low + high))
}

fn maximum(power: &impl Fn(f64) -> f64, low_hz: f64, high_hz: f64) -> f64 {
    let steps = 24;
    let step = (high_hz - low_hz) / f64::from(steps);
    let grid = (0..=steps).map(|k| low_hz + f64::from(k) * step).map(|f| (power(f), f));
    let best = grid.max_by(|a, b| a.0.total_cmp(&b.0)).map_or(low_hz, |(_, f)| f);
    let (mut low, mut high) = (best - step, best + step);
    for _ in 0..40 {
        let third = (high - low) / 3.0;
        if power(low + third) < power(high - third) { low += third } else { high -= third }
    }
    0.5 * (low + high)
}

/// Where the power first falls to `level` in steps from the peak.
fn crossing(power: &impl Fn(f64) -> f64, peak_hz: f64, step_hz: f64, level: f64) -> Option<f64> {
    let (mut inside, mut outside) = (peak_hz, peak_hz + step_hz);
    let mut steps = 0;
    while power(outside) > level {
        (inside, outside) = (outside, outside + step_hz);
        steps += 1;
        if steps > 80 || outside <= 0.0 {
            return None;
        }
    }
    for _ in 0..45 {
        let middle = 0.5 * (inside + outside);
        if power(middle) > level { inside = middle } else { outside = middle }
    }
    Some(0.5 * (inside + outside))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_record_has_the_width_of_eq_28_and_a_short_one_that_of_its_end() {
        let sigma = 0.4;
        assert!((width_of_decay_hz(sigma, 100.0) - sigma / std::f64::consts::PI).abs() < 1e-9);
        assert!((width_of_decay_hz(1e-9, 20.0) - CUT_OFF_WIDTH / 20.0).abs() < 1e-5);
        let width = width_of_decay_hz(sigma, 8.0);
        assert!((decay_of_width(width, 8.0).unwrap() - sigma).abs() < 1e-9);
        assert_eq!(decay_of_width(0.8 / 20.0, 20.0), None);
    }
}
