//! One mode: every estimator side by side, which one to take, and why.

use nalgebra::Complex;
use serde::Serialize;

use super::consistency::Consistency;
use super::decrement::Decrement;
use super::envelope::Envelope;
use super::estimate::{Estimate, chi_squared_tail, probability};
use super::floor::amplitude_dependence;
use super::half_power::HalfPower;
use super::signal::Signal;
use super::sinusoids::SinusoidFit;
use super::spectrum::Spectrum;
use super::windows::Windows;
use crate::model::chain::Chain;

/// A way to a frequency or a damping ratio.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// Peak of the amplitude spectrum.
    Spectrum,
    /// Bandwidth at half power.
    HalfPower,
    /// Logarithmic decrement over all peaks.
    Decrement,
    /// Damped sinusoids over the whole record.
    Sinusoids,
    /// Amplitudes and phases of windows; the frequency at small amplitude.
    Envelope,
}

/// What one method says.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Estimator {
    /// Which.
    pub method: Method,
    /// Undamped natural frequency.
    pub frequency_hz: Option<Estimate>,
    /// ξ.
    pub damping_ratio: Option<Estimate>,
    /// Why a number is absent, or what to know about it.
    pub note: Option<String>,
}

/// ξ, or why the data do not tell it.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Damping {
    /// Its interval stays clear of zero.
    Identified(Estimate),
    /// Its interval reaches zero.
    NotIdentifiable {
        /// 95 % interval.
        estimate: Estimate,
        /// With the number that makes it so.
        reason: String,
    },
}

impl Damping {
    fn of(estimate: Estimate, duration_s: f64) -> Self {
        if estimate.low > 0.0 {
            return Self::Identified(estimate);
        }
        let reason = format!(
            "the decay over {duration_s:.0} s is within the noise: ξ ≤ {:.2e} is all that can be said",
            estimate.high.max(0.0)
        );
        Self::NotIdentifiable { estimate, reason }
    }

    /// The identified value.
    pub fn estimate(&self) -> Option<&Estimate> {
        match self {
            Self::Identified(estimate) => Some(estimate),
            Self::NotIdentifiable { .. } => None,
        }
    }

    /// The interval, identified or not.
    pub fn interval(&self) -> &Estimate {
        match self {
            Self::Identified(estimate) | Self::NotIdentifiable { estimate, .. } => estimate,
        }
    }
}

/// One link's part in a mode.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct LinkMotion {
    /// Amplitude at the start of the record.
    pub amplitude_rad: f64,
    /// |θᵢ/θ₁|.
    pub ratio_to_first: Estimate,
    /// arg θᵢ/θ₁: 0 together, π against each other, anything between tells of uneven damping or of a lag.
    pub phase_to_first_rad: Estimate,
}

/// One mode.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Mode {
    /// Undamped natural frequency to take.
    pub frequency_hz: Estimate,
    /// ξ to take.
    pub damping: Damping,
    /// Where the two come from.
    pub basis: String,
    /// Top to bottom.
    pub shape: Vec<LinkMotion>,
    /// By how much the residual near this frequency exceeds white noise, in power; 1 when it does not.
    pub residual_excess: f64,
    /// Every method.
    pub estimators: Vec<Estimator>,
    /// Whether the frequencies agree.
    pub frequency_consistency: Option<Consistency>,
    /// Whether the dampings agree.
    pub damping_consistency: Option<Consistency>,
    /// Frequency and damping against amplitude.
    pub envelope: Option<Envelope>,
    /// κ that a swing of this shape has without any missing physics.
    pub expected_kappa_per_rad2: Option<f64>,
    /// What the reader should know.
    pub notes: Vec<String>,
}

/// What all modes share.
pub(super) struct Whole<'a> {
    pub signal: &'a Signal,
    pub spectrum: &'a Spectrum,
    pub fit: &'a SinusoidFit,
    pub windows: &'a Result<Windows, String>,
    pub noise_rad: &'a [f64],
}

impl Mode {
    pub(super) fn of(whole: &Whole, mode: usize, chain: Option<&Chain>, gravity_m_s2: f64) -> Self {
        let fit = whole.fit;
        let envelope = whole.windows.as_ref().map_err(Clone::clone).and_then(|w| Envelope::of(w, mode));
        let excesses: Vec<f64> =
            fit.poles.iter().map(|p| residual_excess(&fit.residuals(whole.signal), p.omega_rad_s)).collect();
        let misfits = excesses.iter().any(|e| *e > 1.0);
        // where the whole record is no sum of damped sinusoids, the other modes are taken away window by window
        let alone = match whole.windows {
            Ok(windows) if misfits => windows.isolate(whole.signal, fit, mode),
            _ => fit.isolate(whole.signal, mode),
        };
        let excess = excesses[mode];
        let filled = alone.bridged();
        let raw = [fit.frequency_hz(mode), fit.damping_ratio(mode)];
        let estimators = vec![
            spectral(whole, &filled, mode, raw[1].value),
            half_power(whole, &filled, mode),
            decrement(whole, &alone, mode),
            sinusoids(raw, excess, envelope.as_ref().ok()),
            windowed(&envelope),
        ];
        // as noise alone has it: the damped sinusoids before any widening
        let compare = |of: fn(&Estimator) -> Option<Estimate>, own: Estimate| {
            let each = estimators.iter().filter(|e| e.method != Method::Sinusoids).filter_map(of);
            Consistency::of(&each.chain([own]).collect::<Vec<_>>())
        };
        let shape = shape(whole, mode);
        let expected = match chain {
            Some(chain) => {
                let complex: Vec<Complex<f64>> = shape
                    .iter()
                    .map(|l| Complex::from_polar(l.ratio_to_first.value, l.phase_to_first_rad.value))
                    .collect();
                Some(amplitude_dependence(chain, gravity_m_s2, raw[0].value, &complex))
            }
            None => (shape.len() == 1).then_some(1.0 / 16.0),
        };
        let (frequency_hz, damping_ratio, basis) = choose(&estimators[3], envelope.as_ref().ok(), excess);
        let mut this = Self {
            frequency_hz,
            damping: Damping::of(damping_ratio, whole.signal.duration_s()),
            basis,
            shape,
            residual_excess: excess,
            frequency_consistency: compare(|e| e.frequency_hz, raw[0]),
            damping_consistency: compare(|e| e.damping_ratio, raw[1]),
            estimators,
            envelope: envelope.ok(),
            expected_kappa_per_rad2: expected,
            notes: Vec::new(),
        };
        this.notes = this.findings(mode);
        this
    }

    /// The frequency at small amplitude; where the data do not tell how it depends on amplitude, with this κ.
    pub fn small_amplitude_hz(&self, kappa_per_rad2: f64) -> Estimate {
        match self.envelope.as_ref().and_then(|e| e.frequency) {
            Some(law) => law.f0_hz,
            None => {
                let amplitude_rad = self.shape.iter().map(|l| l.amplitude_rad).fold(0.0, f64::max);
                let highest = self.frequency_hz.high / (1.0 - kappa_per_rad2 * amplitude_rad * amplitude_rad).max(0.5);
                self.frequency_hz.covering(self.frequency_hz.low, highest)
            }
        }
    }

    /// What disagreement and dependence on amplitude mean, in words.
    fn findings(&self, mode: usize) -> Vec<String> {
        let name = format!("mode {}", mode + 1);
        let mut notes = Vec::new();
        let law = self.envelope.as_ref().and_then(|e| e.frequency);
        let bends = law.is_some_and(|l| l.p_constant < 0.01);
        if let (Some(law), Some(expected)) = (law, self.expected_kappa_per_rad2) {
            let k = law.kappa_per_rad2;
            let amplitude_rad = self.shape.iter().map(|l| l.amplitude_rad).fold(0.0, f64::max);
            if amplitude_rad > 0.8 && expected > 0.03 && k.high < 0.3 * expected {
                notes.push(format!(
                    "{name}: the frequency does not fall with amplitude (κ = {:.4} ± {:.4}, a pendulum has {expected:.4}) although θ reaches {amplitude_rad:.1} rad: are the angles in degrees?",
                    k.value, k.sd
                ));
            } else if k.holds(expected) && bends {
                notes.push(format!("{name}: the frequency falls with amplitude as a pendulum's does (κ = {:.4}, expected {expected:.4}): no missing stiffness", k.value));
            } else if !k.holds(expected) {
                notes.push(format!(
                    "{name}: f = f₀(1 − κA²) has κ = {:.4} ± {:.4} /rad², a pendulum of this shape {expected:.4}: a nonlinear stiffness is at work, or all angles are {:.3} of what is stated",
                    k.value,
                    k.sd,
                    (k.value / expected).max(0.0).sqrt()
                ));
            }
        }
        if let Some(test) = self.frequency_consistency.filter(|t| !t.agree) {
            let meaning = if bends {
                "the frequency depends on amplitude, which each estimator weighs differently; take f₀ of the envelope"
            } else {
                "amplitude does not explain it; look for dropped frames, a neighbouring mode or forcing"
            };
            notes.push(format!(
                "{name}: the frequencies disagree (χ² = {:.0} of {}, p = {}): {meaning}",
                test.chi2,
                test.estimators - 1,
                probability(test.p_value)
            ));
        }
        let decay = self.envelope.as_ref().and_then(|e| e.decay);
        let varies = decay.is_some_and(|d| d.p_viscous < 0.01);
        if let Some(test) = self.damping_consistency.filter(|t| !t.agree) {
            let meaning = if varies {
                "the damping depends on amplitude: friction or drag, not one ξ"
            } else {
                "the decay is no exponential; look at the envelope before using one ξ"
            };
            notes.push(format!(
                "{name}: the damping ratios disagree (χ² = {:.0} of {}, p = {}): {meaning}",
                test.chi2,
                test.estimators - 1,
                probability(test.p_value)
            ));
        } else if varies {
            notes.push(format!(
                "{name}: the damping depends on amplitude (p = {:.1e}): friction or drag, not one ξ",
                decay.map_or(0.0, |d| d.p_viscous)
            ));
        }
        if let Damping::NotIdentifiable { reason, .. } = &self.damping {
            notes.push(format!("{name}: damping not identifiable: {reason}"));
        }
        notes
    }
}

/// The damped sinusoids while they describe the record; else the envelope's laws.
fn choose(sinusoids: &Estimator, envelope: Option<&Envelope>, excess: f64) -> (Estimate, Estimate, String) {
    let nowhere = Estimate::new(f64::NAN, f64::NAN, 1.0);
    let (f, xi) = (sinusoids.frequency_hz.unwrap_or(nowhere), sinusoids.damping_ratio.unwrap_or(nowhere));
    let law = envelope.and_then(|e| e.frequency);
    let varies = excess > 1.0 || law.is_some_and(|l| l.p_constant < 0.01);
    match (varies, envelope) {
        (true, Some(envelope)) => {
            let xi = envelope.damping_range();
            match law {
                Some(law) => (
                    law.f0_hz,
                    xi,
                    "envelope: f at small amplitude, ξ as if viscous; one damped sinusoid does not describe the record"
                        .to_owned(),
                ),
                None => (f, xi, "damped sinusoids, widened; ξ of the envelope".to_owned()),
            }
        }
        (true, None) => (f, xi, "damped sinusoids, intervals widened: they do not describe the record".to_owned()),
        (false, _) => (f, xi, "damped sinusoids".to_owned()),
    }
}

fn spectral(whole: &Whole, alone: &Signal, mode: usize, xi: f64) -> Estimator {
    let near_hz = whole.fit.poles[mode].omega_rad_s / std::f64::consts::TAU;
    let natural = 1.0 / (1.0 - xi * xi).max(0.1).sqrt();
    let line = Spectrum::line(alone, near_hz, whole.noise_rad);
    Estimator {
        method: Method::Spectrum,
        frequency_hz: line.map(|f| f.times(natural)),
        damping_ratio: None,
        note: Some(match line {
            Some(_) => format!("resolution {:.4} Hz", whole.spectrum.resolution_hz),
            None => format!("no single peak within {:.4} Hz", whole.spectrum.resolution_hz),
        }),
    }
}

fn half_power(whole: &Whole, alone: &Signal, mode: usize) -> Estimator {
    let found = HalfPower::of(alone, whole.fit.poles[mode], whole.noise_rad);
    Estimator {
        method: Method::HalfPower,
        frequency_hz: found.as_ref().ok().map(|h| h.frequency_hz),
        damping_ratio: found.as_ref().ok().map(|h| h.damping_ratio),
        note: Some(match found {
            Ok(h) => format!("Eq. 28 to the letter: ξ = {:.5}", h.damping_ratio_literal),
            Err(reason) => reason,
        }),
    }
}

fn decrement(whole: &Whole, alone: &Signal, mode: usize) -> Estimator {
    let clearness = |link: usize| whole.fit.links[link].amplitudes_rad[mode].norm() / whole.noise_rad[link];
    let link = (0..alone.links.len()).max_by(|a, b| clearness(*a).total_cmp(&clearness(*b))).unwrap_or(0);
    let frequency_hz = whole.fit.poles[mode].omega_rad_s / std::f64::consts::TAU;
    let found = Decrement::of(&alone.links[link], frequency_hz, whole.noise_rad[link]);
    Estimator {
        method: Method::Decrement,
        frequency_hz: found.as_ref().ok().map(|d| d.frequency_hz),
        damping_ratio: found.as_ref().ok().map(|d| d.damping_ratio),
        note: Some(match found {
            Ok(d) => format!("θ{}, {} peaks, δ = {:.5}", link + 1, d.peaks, d.decrement.value),
            Err(reason) => reason,
        }),
    }
}

/// Widened where the residual near the mode exceeds white noise, and to what the frequency and damping were in the windows.
fn sinusoids([f, xi]: [Estimate; 2], excess: f64, envelope: Option<&Envelope>) -> Estimator {
    let widen = |e: Estimate| {
        let factor = excess.sqrt();
        Estimate {
            sd: e.sd * factor,
            low: e.value + (e.low - e.value) * factor,
            high: e.value + (e.high - e.value) * factor,
            ..e
        }
    };
    let (mut f, mut xi) = (widen(f), widen(xi));
    let misfits = excess > 1.0;
    if let Some(envelope) = envelope.filter(|_| misfits) {
        for step in &envelope.steps {
            f = f.covering(step.frequency_hz.value, step.frequency_hz.value);
            xi = xi.covering(step.damping_ratio.value, step.damping_ratio.value);
        }
    }
    let note = misfits.then(|| {
        format!("residual {excess:.1} × white noise near the mode: intervals widened to the range over the record")
    });
    Estimator { method: Method::Sinusoids, frequency_hz: Some(f), damping_ratio: Some(xi), note }
}

fn windowed(envelope: &Result<Envelope, String>) -> Estimator {
    let law = envelope.as_ref().ok().and_then(|e| e.frequency);
    Estimator {
        method: Method::Envelope,
        frequency_hz: law.map(|l| l.f0_hz),
        damping_ratio: envelope.as_ref().ok().map(|e| e.damping_ratio),
        note: Some(match envelope {
            Ok(e) => match law {
                Some(l) => format!(
                    "{} windows; f at small amplitude, κ = {:.4} ± {:.4} /rad²",
                    e.windows, l.kappa_per_rad2.value, l.kappa_per_rad2.sd
                ),
                None => format!("{} windows are too few for f against amplitude", e.windows),
            },
            Err(reason) => reason.clone(),
        }),
    }
}

fn shape(whole: &Whole, mode: usize) -> Vec<LinkMotion> {
    let fit = whole.fit;
    let first = fit.links[0].amplitudes_rad[mode];
    let each = |link: usize| {
        let own = &fit.links[link];
        let (ratio, sd) = match whole.windows {
            Ok(w) => (w.shapes[mode][link], w.shape_sd[mode][link]),
            Err(_) => {
                let ratio = own.amplitudes_rad[mode] / first;
                (
                    ratio,
                    (own.amplitude_sd_rad[mode].hypot(ratio.norm() * fit.links[0].amplitude_sd_rad[mode]))
                        / first.norm(),
                )
            }
        };
        LinkMotion {
            amplitude_rad: own.amplitudes_rad[mode].norm(),
            ratio_to_first: Estimate::new(ratio.norm(), sd, fit.degrees_of_freedom),
            phase_to_first_rad: Estimate::new(
                ratio.arg(),
                sd / ratio.norm().max(f64::MIN_POSITIVE),
                fit.degrees_of_freedom,
            ),
        }
    };
    (0..fit.links.len()).map(each).collect()
}

/// Power of the residual in the lines beside a mode (2/T to 9/T away on both sides) over that of white noise of the same variance; 1 unless the
/// excess would come about by chance less than once in a thousand records. Least squares sees only that part of the residual.
fn residual_excess(residual: &Signal, omega_rad_s: f64) -> f64 {
    let line = std::f64::consts::TAU / residual.duration_s();
    let (mut sum, mut lines) = (0.0, 0.0);
    for link in &residual.links {
        let n = link.t_s.len() as f64;
        let variance = link.theta_rad.iter().map(|r| r * r).sum::<f64>() / n;
        for k in (2..10).flat_map(|k| [f64::from(k), -f64::from(k)]) {
            let omega = omega_rad_s + k * line;
            if omega < 2.0 * line {
                continue;
            }
            let turns = link.t_s.iter().zip(&link.theta_rad).map(|(t, r)| Complex::from_polar(*r, -omega * t));
            sum += turns.sum::<Complex<f64>>().norm_sqr() / (n * variance.max(f64::MIN_POSITIVE));
            lines += 1.0;
        }
    }
    // each line's power is half a χ² of two degrees of freedom
    let p_value = chi_squared_tail(2.0 * sum, 2.0 * lines);
    if p_value < 1e-3 { (sum / lines).max(1.0) } else { 1.0 }
}
