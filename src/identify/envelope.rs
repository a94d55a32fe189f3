//! Frequency and damping as functions of amplitude: the sign of missing physics.
//!
//! The record is cut into windows of a few cycles, in each of which damped sinusoids are fitted on their own. Amplitude A and phase φ at each
//! window's middle are independent of one another and of the other windows', and between neighbours
//!
//! ```text
//! f = Δφ / 2πΔt,   σ = ln(A/A') / Δt
//! ```
//! which is far sharper than a frequency or damping fitted within a window. Two laws are then laid through all windows by weighted least squares:
//!
//! ```text
//! φ(t) = φ₀ + 2π ∫ f₀ (1 − κA² − κ'A'²) dt        κ = 1/16 for a rigid pendulum; A' belongs to the other mode
//! dA/dt = −(b₀ + b₁A + b₂A²)                       friction, viscous, quadratic (physics.md)
//! ```
//! The second is for a picture and a first guess, never to decide: Coulomb friction and quadratic drag together imitate a viscous damper.

use nalgebra::{DMatrix, DVector};
use serde::Serialize;

use super::decay_law::{DecayFit, DecayLaw, Widening};
use super::estimate::{Estimate, chi_squared_tail, f_tail};
use super::windows::{Moment, Windows};

/// From here on the frequency within a window is trusted to join it to the next.
const CLEAR_OF_UNWRAPPING: f64 = 15.0;

/// A step from one window to the next.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Step {
    /// Halfway between the windows' middles.
    pub t_s: f64,
    /// Amplitude of the link that moves most.
    pub amplitude_rad: f64,
    /// Undamped natural frequency.
    pub frequency_hz: Estimate,
    /// ξ.
    pub damping_ratio: Estimate,
}

/// f = f₀ (1 − κA²).
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct FrequencyLaw {
    /// Undamped natural frequency at small amplitude.
    pub f0_hz: Estimate,
    /// κ (1/rad²).
    pub kappa_per_rad2: Estimate,
    /// Probability that noise alone makes so much dependence on this and the other mode's amplitude; small: the frequency is not constant.
    pub p_constant: f64,
    /// Probability that the phases scatter so far about the law by noise.
    pub p_value: f64,
}

/// One mode's history.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Envelope {
    /// Number of windows in which the mode stands clear of the noise.
    pub windows: usize,
    /// Length of each.
    pub window_s: f64,
    /// From window to window.
    pub steps: Vec<Step>,
    /// ξ when dA/dt = −b₁A.
    pub damping_ratio: Estimate,
    /// Probability that the amplitudes scatter so far about an exponential by noise.
    pub p_exponential: f64,
    /// Frequency against amplitude, from five windows on.
    pub frequency: Option<FrequencyLaw>,
    /// Decay against amplitude, from six windows on.
    pub decay: Option<DecayLaw>,
}

impl Envelope {
    /// Of one mode.
    ///
    /// # Errors
    /// In words, when the mode is clear of the noise in fewer than three windows.
    pub fn of(windows: &Windows, mode: usize) -> Result<Self, String> {
        let moments = &windows.moments[mode];
        if moments.len() < 3 {
            return Err(format!(
                "the mode stands clear of the noise in {} window{} of {:.2} s; at least 3 are needed",
                moments.len(),
                if moments.len() == 1 { "" } else { "s" },
                windows.window_s
            ));
        }
        let others: Vec<&[Moment]> =
            windows.moments.iter().enumerate().filter(|(m, _)| *m != mode).map(|(_, w)| w.as_slice()).collect();
        let exponential =
            DecayFit::of(moments, [false, true, false]).ok_or("the amplitudes do not converge to a decay")?;
        let phases = unwrapped(moments);
        let b1 = exponential.estimate(2);
        let omega = (phases[phases.len() - 1] - phases[0]) / (moments[moments.len() - 1].t_s - moments[0].t_s);
        let damping_ratio = b1.map(|s| s / s.hypot(omega), omega * omega / b1.value.hypot(omega).powi(3));
        let xi = damping_ratio.value;
        Ok(Self {
            windows: moments.len(),
            window_s: windows.window_s,
            steps: steps(moments, &phases),
            damping_ratio,
            p_exponential: exponential.p_value,
            frequency: frequency_law(moments, &phases, &others, xi),
            decay: DecayLaw::of(moments, &exponential),
        })
    }
}

impl Envelope {
    /// ξ as if viscous; where the decay is not exponential, stretched to what the steps show that tell it to a tenth.
    pub fn damping_range(&self) -> Estimate {
        let certain = |s: &&Step| self.p_exponential < 0.01 && s.damping_ratio.sd < 0.1 * s.damping_ratio.value;
        let steps = self.steps.iter().filter(certain).map(|s| s.damping_ratio.value);
        steps.fold(self.damping_ratio, |range, xi| range.covering(xi, xi))
    }
}

/// Phases without jumps. Neighbours are joined by the frequency found within their windows; where the mode has become weak, by that of the step
/// before, which is sharper.
fn unwrapped(moments: &[Moment]) -> Vec<f64> {
    let mut phases: Vec<f64> = moments.first().map(|m| m.amplitude_rad.arg()).into_iter().collect();
    let mut before: Option<f64> = None;
    for pair in moments.windows(2) {
        let span_s = pair[1].t_s - pair[0].t_s;
        let weak = pair.iter().any(|m| m.amplitude_rad() < CLEAR_OF_UNWRAPPING * m.sd_rad);
        let omega = before.filter(|_| weak).unwrap_or(0.5 * (pair[0].omega_rad_s + pair[1].omega_rad_s));
        let expected = phases[phases.len() - 1] + omega * span_s;
        let turns = ((expected - pair[1].amplitude_rad.arg()) / std::f64::consts::TAU).round();
        let phase = pair[1].amplitude_rad.arg() + turns * std::f64::consts::TAU;
        before = Some((phase - phases[phases.len() - 1]) / span_s);
        phases.push(phase);
    }
    phases
}

fn steps(moments: &[Moment], phases: &[f64]) -> Vec<Step> {
    let pair = |k: usize| {
        let (a, b) = (&moments[k], &moments[k + 1]);
        let (from, to) = (a.amplitude_rad(), b.amplitude_rad());
        let span_s = b.t_s - a.t_s;
        let relative = (a.sd_rad / from).hypot(b.sd_rad / to);
        let (omega, decay) = ((phases[k + 1] - phases[k]) / span_s, (from / to).ln() / span_s);
        let natural = omega.hypot(decay);
        let sd = relative / span_s;
        Step {
            t_s: 0.5 * (a.t_s + b.t_s),
            amplitude_rad: (from * to).sqrt(),
            frequency_hz: Estimate::new(natural / std::f64::consts::TAU, sd / std::f64::consts::TAU, 1e6),
            damping_ratio: Estimate::new(decay / natural, sd * omega * omega / natural.powi(3), 1e6),
        }
    };
    (0..moments.len() - 1).map(pair).collect()
}

/// φ(t) = φ₀ + Ω (t − κ∫A² − κ'∫A'²), weighted linear least squares; `None` when there are too few windows for all that is felt.
fn frequency_law(moments: &[Moment], phases: &[f64], others: &[&[Moment]], xi: f64) -> Option<FrequencyLaw> {
    let own = squares(moments, moments);
    let mut columns = vec![own];
    for other in others {
        let column = squares(moments, other);
        let felt = column.last().copied().unwrap_or(0.0) > 0.01 * columns[0].last().copied().unwrap_or(0.0);
        if felt {
            columns.push(column);
        }
    }
    let free = moments.len().checked_sub(2 + columns.len()).filter(|f| *f > 1)? as f64;
    let weight = |k: usize| moments[k].amplitude_rad() / moments[k].sd_rad;
    let basis = DMatrix::from_fn(moments.len(), 2 + columns.len(), |k, j| {
        weight(k)
            * match j {
                0 => 1.0,
                1 => moments[k].t_s - moments[0].t_s,
                _ => -columns[j - 2][k],
            }
    });
    let values = DVector::from_fn(moments.len(), |k, _| weight(k) * phases[k]);
    let fit = basis.clone().svd(true, true).solve(&values, 1e-14).ok()?;
    let chi2 = (&basis * &fit - &values).norm_squared();
    let p_value = chi_squared_tail(chi2, free);
    let scale = Widening::of(chi2, free, p_value);
    let covariance = basis.tr_mul(&basis).try_inverse()? * scale.variance;
    let omega = fit[1];
    let natural = std::f64::consts::TAU * (1.0 - xi * xi).max(1e-9).sqrt();
    let dependence = fit.rows(2, columns.len());
    let information = covariance.view((2, 2), (columns.len(), columns.len())).into_owned().try_inverse()?;
    let wald = dependence.dot(&(information * dependence)) / columns.len() as f64;
    let kappa = fit[2] / omega;
    let kappa_variance =
        (covariance[(2, 2)] - 2.0 * kappa * covariance[(1, 2)] + kappa * kappa * covariance[(1, 1)]) / (omega * omega);
    Some(FrequencyLaw {
        f0_hz: Estimate::new(omega / natural, covariance[(1, 1)].sqrt() / natural, scale.degrees_of_freedom),
        kappa_per_rad2: Estimate::new(kappa, kappa_variance.max(0.0).sqrt(), scale.degrees_of_freedom),
        p_constant: f_tail(wald, columns.len() as f64, scale.degrees_of_freedom),
        p_value,
    })
}

/// ∫A² dt from the first of `moments` to each of them, A taken from `source`; zero where `source` has died away.
fn squares(moments: &[Moment], source: &[Moment]) -> Vec<f64> {
    let amplitude = |t: f64| source.iter().find(|m| (m.t_s - t).abs() < 1e-9).map_or(0.0, Moment::amplitude_rad);
    let mut sum = 0.0;
    let mut integral = vec![0.0];
    for pair in moments.windows(2) {
        let (a, b) = (amplitude(pair[0].t_s).powi(2), amplitude(pair[1].t_s).powi(2));
        // exponential between the two: the logarithmic mean
        let ratio = if a > 0.0 && b > 0.0 { (a / b).ln() } else { 0.0 };
        let mean = if ratio.abs() > 1e-3 { (a - b) / ratio } else { 0.5 * (a + b) };
        sum += mean * (pair[1].t_s - pair[0].t_s);
        integral.push(sum);
    }
    integral
}
