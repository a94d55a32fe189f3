//! The amplitude spectrum: Hann window, mean removed, zero padded, peaks interpolated and refined on the true time stamps.
//!
//! ```text
//! X(ω) = Σₖ w(tₖ) θ(tₖ) e^{−iωtₖ},   w = ½ − ½ cos 2π(t − t₀)/T,   amplitude = 2|X| / Σ w
//! ```
//! The transform runs on an even grid of the median step. Between neighbours at most three steps apart the grid is filled by interpolation (four
//! points, cubic); across longer gaps it carries no weight, which is what a missing sample means in the sum above. The peaks found there
//! are then moved to the maximum of the sum on the true time stamps, so that neither grid nor interpolation biases a frequency.

use nalgebra::Complex;
use rustfft::FftPlanner;
use serde::Serialize;

use super::estimate::Estimate;
use super::signal::{BRIDGE_STEPS, LinkSamples, Signal};
use crate::statistics::median;

/// Least ratio of the padded length to the record.
const PADDING: usize = 4;
/// Main lobe of the Hann window from zero to zero, in 1/T.
const HANN_LOBE: f64 = 4.0;
/// Width of the Hann window's main lobe at half power, in 1/T.
const HANN_HALF_POWER: f64 = 1.44;

/// How samples are weighted over the record; an offset is taken away only with the Hann window.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Window {
    Hann,
    Flat,
}

/// A peak of the spectrum.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Peak {
    /// Where it is.
    pub frequency_hz: Estimate,
    /// Amplitude of a steady sinusoid that would give it, the root of the sum of squares over the links.
    pub amplitude_rad: f64,
    /// Power over the median power around: see [`Spectrum::significant`].
    pub over_floor: f64,
}

/// Amplitude spectrum of all links together.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Spectrum {
    /// 1/T: two modes closer than this cannot be told apart.
    pub resolution_hz: f64,
    /// Width at half power that the window gives to a pure line.
    pub window_width_hz: f64,
    /// Share of steps that differ from the median by more than 5 %.
    pub irregular_share: f64,
    /// Share of grid points without weight.
    pub missing_share: f64,
    /// Highest first.
    pub peaks: Vec<Peak>,
    /// Spacing of `amplitude_rad`.
    #[serde(skip)]
    pub step_hz: f64,
    /// From 0 Hz to the Nyquist frequency.
    #[serde(skip)]
    pub amplitude_rad: Vec<f64>,
}

impl Spectrum {
    /// The spectrum of a signal; the share of irregular steps is only kept beside it.
    pub fn of(signal: &Signal, irregular_share: f64) -> Self {
        let duration_s = signal.duration_s().max(signal.step_s);
        let points = (duration_s / signal.step_s).round() as usize + 1;
        let padded = (PADDING * points).next_power_of_two();
        let transform = FftPlanner::new().plan_fft_forward(padded);
        let mut power = vec![0.0; padded / 2 + 1];
        let mut missing = 0;
        for link in &signal.links {
            let (mut buffer, weight, absent) = windowed_grid(link, signal, points);
            missing += absent;
            buffer.resize(padded, Complex::new(0.0, 0.0));
            transform.process(&mut buffer);
            for (p, x) in power.iter_mut().zip(&buffer) {
                *p += x.norm_sqr() * (2.0 / weight).powi(2);
            }
        }
        let step_hz = 1.0 / (padded as f64 * signal.step_s);
        let resolution_hz = 1.0 / duration_s;
        let mut spectrum = Self {
            resolution_hz,
            window_width_hz: HANN_HALF_POWER * resolution_hz,
            irregular_share,
            missing_share: missing as f64 / (points * signal.links.len()) as f64,
            peaks: Vec::new(),
            step_hz,
            amplitude_rad: power.iter().map(|p| p.sqrt()).collect(),
        };
        spectrum.peaks = spectrum.find_peaks(signal, &power);
        spectrum
    }

    /// The maximum of a signal's windowed sum near a frequency, with the interval that this noise of each link gives it; `None` where there is
    /// no maximum.
    pub fn line(signal: &Signal, near_hz: f64, noise_rad: &[f64]) -> Option<Estimate> {
        let resolution_hz = 1.0 / signal.duration_s();
        let (frequency_hz, _) = refine(signal, near_hz, resolution_hz);
        let inside = (frequency_hz - near_hz).abs() < 0.49 * resolution_hz;
        let sd_hz = line_sd_hz(signal, Window::Hann, frequency_hz, noise_rad).filter(|_| inside)?;
        Some(Estimate::new(frequency_hz, sd_hz, 1e6))
    }

    fn find_peaks(&self, signal: &Signal, power: &[f64]) -> Vec<Peak> {
        let lobe = (0.5 * HANN_LOBE * self.resolution_hz / self.step_hz).round() as usize;
        let first = (1.5 * self.resolution_hz / self.step_hz).ceil() as usize;
        let floor = median(&mut power.to_vec()).unwrap_or(0.0).max(f64::MIN_POSITIVE);
        let is_peak = |k: usize| {
            let around = k.saturating_sub(lobe).max(1)..(k + lobe + 1).min(power.len());
            around.clone().all(|j| power[j] <= power[k])
        };
        let mut found: Vec<usize> = (first..power.len().saturating_sub(1)).filter(|k| is_peak(*k)).collect();
        found.sort_by(|a, b| power[*b].total_cmp(&power[*a]));
        found.truncate(8);
        // the median of a sum of n exponentials is its mean times about 1 − 1/3n
        let links = signal.links.len() as f64;
        let noise_power = floor / (1.0 - 1.0 / (3.0 * links)) / links;
        let noise_rad: Vec<f64> = signal.links.iter().map(|link| noise_of_power(link, signal, noise_power)).collect();
        let peak = |k: &usize| {
            let refined = refine(signal, *k as f64 * self.step_hz, self.resolution_hz);
            // what is not a line is known to half the resolution
            let sd_hz = line_sd_hz(signal, Window::Hann, refined.0, &noise_rad).unwrap_or(0.25 * self.resolution_hz);
            Peak {
                frequency_hz: Estimate::new(refined.0, sd_hz, 1e6),
                amplitude_rad: refined.1,
                over_floor: power[*k] / floor,
            }
        };
        found.iter().map(peak).collect()
    }

    /// The peaks that noise alone would show in one of a thousand records.
    pub fn significant(&self) -> impl Iterator<Item = &Peak> {
        // power over its median is exponential with mean 1/ln 2; (number of independent frequencies) e^{−P ln 2} = 0.001
        let independent = self.amplitude_rad.len() as f64 * self.step_hz / self.resolution_hz;
        let least = (independent / 1e-3).ln() / std::f64::consts::LN_2;
        self.peaks.iter().filter(move |p| p.over_floor > least)
    }
}

/// The Hann window at each sample times the share of time that the sample stands for.
fn weights(link: &LinkSamples, signal: &Signal) -> Vec<f64> {
    link.cells(signal.step_s).iter().zip(&link.t_s).map(|(cell, t)| cell * hann(signal, *t)).collect()
}

/// The Hann window of a signal at an instant.
fn hann(signal: &Signal, t_s: f64) -> f64 {
    let phase = (t_s - signal.span_s[0]) / signal.duration_s().max(f64::MIN_POSITIVE);
    0.5 - 0.5 * (std::f64::consts::TAU * phase).cos()
}

/// Windowed values on the grid, the sum of their weights, and how many carry none.
fn windowed_grid(link: &LinkSamples, signal: &Signal, points: usize) -> (Vec<Complex<f64>>, f64, usize) {
    let mean = weighted_mean(link, signal);
    let (mut weight, mut absent) = (0.0, 0);
    let mut grid = Vec::with_capacity(points);
    for k in 0..points {
        let t = signal.span_s[0] + k as f64 * signal.step_s;
        let value = match link.interpolated(t, BRIDGE_STEPS * signal.step_s) {
            Some(theta) => {
                let w = hann(signal, t);
                weight += w;
                w * (theta - mean)
            }
            None => {
                absent += 1;
                0.0
            }
        };
        grid.push(Complex::new(value, 0.0));
    }
    (grid, weight.max(f64::MIN_POSITIVE), absent)
}

fn weighted_mean(link: &LinkSamples, signal: &Signal) -> f64 {
    let weights = weights(link, signal);
    let sum: f64 = weights.iter().zip(&link.theta_rad).map(|(w, a)| w * a).sum();
    sum / weights.iter().sum::<f64>().max(f64::MIN_POSITIVE)
}

/// The maximum of the windowed sum on the true time stamps near a frequency, with the amplitude there: golden-section search.
fn refine(signal: &Signal, near_hz: f64, resolution_hz: f64) -> (f64, f64) {
    let links: Vec<(&LinkSamples, Vec<f64>, f64)> =
        signal.links.iter().map(|link| (link, weights(link, signal), weighted_mean(link, signal))).collect();
    let power = |f_hz: f64| {
        let each = links.iter().map(|(link, weights, mean)| {
            let samples = link.t_s.iter().zip(&link.theta_rad).zip(weights);
            let turned = samples.map(|((t, a), w)| {
                Complex::from_polar(w * (a - mean), -std::f64::consts::TAU * f_hz * (t - signal.span_s[0]))
            });
            turned.sum::<Complex<f64>>().norm_sqr() * (2.0 / weights.iter().sum::<f64>()).powi(2)
        });
        each.sum::<f64>()
    };
    let golden = 0.5 * (5f64.sqrt() - 1.0);
    let (mut low, mut high) = (near_hz - 0.5 * resolution_hz, near_hz + 0.5 * resolution_hz);
    let (mut a, mut b) = (high - golden * (high - low), low + golden * (high - low));
    let (mut pa, mut pb) = (power(a), power(b));
    while high - low > 1e-5 * resolution_hz {
        if pa > pb {
            (high, b, pb) = (b, a, pa);
            a = high - golden * (high - low);
            pa = power(a);
        } else {
            (low, a, pa) = (a, b, pb);
            b = low + golden * (high - low);
            pb = power(b);
        }
    }
    let best = 0.5 * (low + high);
    (best, power(best).sqrt())
}

/// Standard deviation of an interpolated peak in white noise of variance s², from the first-order shift of the maximum of |X|²:
///
/// ```text
/// δω = s √(½ Σ w²(t−t̄)²) / (|X| V),   t̄ = Re(X₁/X),  V = Re(X₂/X) − t̄²,   Xₖ = Σ w tᵏ θ e^{−iωt}
/// ```
/// V is the spread in time of the windowed oscillation, so that damping is allowed for. With a flat window and no damping it is the Cramér–Rao
/// bound √24 s/(A√N T). `None` where the curvature has the wrong sign: no single line.
pub(super) fn line_sd_hz(signal: &Signal, window: Window, f_hz: f64, noise_rad: &[f64]) -> Option<f64> {
    let (mut variance, mut curvature) = (0.0, 0.0);
    for (link, noise_rad) in signal.links.iter().zip(noise_rad) {
        let (weights, mean) = match window {
            Window::Hann => (weights(link, signal), weighted_mean(link, signal)),
            Window::Flat => (link.cells(signal.step_s), 0.0),
        };
        let mut moments = [Complex::new(0.0, 0.0); 3];
        let mut squares = [0.0; 3];
        for ((t, a), w) in link.t_s.iter().zip(&link.theta_rad).zip(weights) {
            let tau = t - signal.span_s[0];
            let x = Complex::from_polar(w * (a - mean), -std::f64::consts::TAU * f_hz * tau);
            for (k, power) in [1.0, tau, tau * tau].into_iter().enumerate() {
                moments[k] += x * power;
                squares[k] += w * w * power;
            }
        }
        let centre = (moments[1] / moments[0]).re;
        let spread = (moments[2] / moments[0]).re - centre * centre;
        let lever = squares[2] - 2.0 * centre * squares[1] + centre * centre * squares[0];
        variance += moments[0].norm_sqr() * 0.5 * noise_rad * noise_rad * lever;
        curvature += moments[0].norm_sqr() * spread;
    }
    (curvature > 0.0).then(|| variance.max(0.0).sqrt() / curvature / std::f64::consts::TAU)
}

/// s of white noise whose mean power on the spectrum's scale is 4 s² Σw²/(Σw)².
fn noise_of_power(link: &LinkSamples, signal: &Signal, power: f64) -> f64 {
    let (sum, squares) = weights(link, signal).iter().fold((0.0, 0.0), |(s, q), w| (s + w, q + w * w));
    (power * sum * sum / (4.0 * squares.max(f64::MIN_POSITIVE))).sqrt()
}
