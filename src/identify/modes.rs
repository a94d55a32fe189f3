//! How many modes the data show, and their damped sinusoids.

use serde::Serialize;

use super::estimate::{f_tail, probability};
use super::pencil::matrix_pencil;
use super::signal::Signal;
use super::sinusoids::{Pole, SinusoidFit};
use super::spectrum::Spectrum;

/// Damping ratios tried at a spectral peak.
const DAMPING_STARTS: [f64; 3] = [0.001, 0.008, 0.05];

/// The choice between one mode and two.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ModeCount {
    /// Modes taken.
    pub modes: usize,
    /// By how much the Bayesian information criterion of two modes lies below that of one; positive speaks for two.
    pub bic_gain: Option<f64>,
    /// Probability that noise alone improves the fit as much, all frequencies considered.
    pub p_value: Option<f64>,
    /// In words.
    pub statement: String,
}

/// Damped sinusoids of as many modes as the data show, lowest frequency first; `None` when nothing oscillates.
pub fn choose_modes(signal: &Signal, spectrum: &Spectrum) -> Option<(SinusoidFit, ModeCount)> {
    let strongest = spectrum.significant().next()?;
    let highest_hz = spectrum.significant().map(|p| p.frequency_hz.value).fold(0.0, f64::max);
    let mut starts: Vec<Vec<Pole>> =
        DAMPING_STARTS.iter().map(|xi| vec![Pole::of(strongest.frequency_hz.value, *xi)]).collect();
    starts.push(matrix_pencil(signal, 1, strongest.frequency_hz.value));
    let one = best(signal, &starts, |_| true)?;
    let f1_hz = one.poles[0].frequency_hz();
    let guard_hz = (4.0 * spectrum.resolution_hz).max(0.12 * f1_hz);
    let apart = |p: &[Pole]| (p[0].frequency_hz() - p[1].frequency_hz()).abs() > 0.75 * guard_hz;

    let rest = Spectrum::of(&one.residuals(signal), 0.0);
    let far = |f_hz: f64| (f_hz - f1_hz).abs() > guard_hz && f_hz > 2.0 * spectrum.resolution_hz;
    let second = rest.peaks.iter().find(|p| far(p.frequency_hz.value));
    let mut starts: Vec<Vec<Pole>> = Vec::new();
    if let Some(peak) = second {
        starts.extend(DAMPING_STARTS.iter().map(|xi| vec![one.poles[0], Pole::of(peak.frequency_hz.value, *xi)]));
    }
    let pencil = matrix_pencil(signal, 2, highest_hz.max(second.map_or(0.0, |p| p.frequency_hz.value)));
    if pencil.len() == 2 && apart(&pencil) {
        starts.push(pencil);
    }
    let damped = |p: &Pole| p.damping_ratio() < 0.4 && p.damping_ratio() > -0.02;
    let two = best(signal, &starts, |fit| apart(&fit.poles) && fit.poles.iter().all(damped));
    let Some(two) = two else {
        let statement = "one mode; no second one is seen".to_owned();
        return Some((one, ModeCount { modes: 1, bic_gain: None, p_value: None, statement }));
    };
    Some(decide(signal, spectrum, one, two))
}

fn best(signal: &Signal, starts: &[Vec<Pole>], sound: impl Fn(&SinusoidFit) -> bool) -> Option<SinusoidFit> {
    let fits = starts.iter().filter_map(|start| SinusoidFit::from_start(signal, signal.span_s[0], start));
    fits.filter(sound).min_by(|a, b| a.deviance.total_cmp(&b.deviance))
}

/// F-test over all independent frequencies, and the information criterion.
fn decide(signal: &Signal, spectrum: &Spectrum, one: SinusoidFit, two: SinusoidFit) -> (SinusoidFit, ModeCount) {
    let n = signal.values() as f64;
    let more = (two.parameters() - one.parameters()) as f64;
    let bic_gain = one.deviance - two.deviance - more * n.ln();
    // the links' weighted sums of squares: exp of the mean deviance
    let ratio = ((one.deviance - two.deviance) / n).exp();
    let f = (ratio - 1.0) * two.degrees_of_freedom / more;
    let frequencies = spectrum.amplitude_rad.len() as f64 * spectrum.step_hz / spectrum.resolution_hz;
    let p_value = (f_tail(f, more, two.degrees_of_freedom) * frequencies).min(1.0);
    let [strong, weak] = if two.amplitude_rad(0) >= two.amplitude_rad(1) { [0, 1] } else { [1, 0] };
    let times = two.poles[weak].frequency_hz() / two.poles[strong].frequency_hz();
    let (large, small) = (two.amplitude_rad(strong), two.amplitude_rad(weak));
    // sin θ gives a third harmonic of A³/192, a chain a few times that
    let harmonic = (times - times.round()).abs() < 0.03 && times.round() >= 2.0 && small < 0.05 * large.powi(3);
    let modes = if p_value < 1e-3 && bic_gain > 10.0 && !harmonic { 2 } else { 1 };
    let statement = if harmonic {
        format!(
            "one mode; the line at {:.4} Hz is its harmonic number {:.0} ({small:.1e} rad)",
            two.poles[weak].frequency_hz(),
            times
        )
    } else if modes == 2 {
        format!("two modes: the second lowers the information criterion by {bic_gain:.0} ({})", probability(p_value))
    } else {
        format!(
            "one mode; a second would change the information criterion by {:.0} ({})",
            -bic_gain,
            probability(p_value)
        )
    };
    let count = ModeCount { modes, bic_gain: Some(bic_gain), p_value: Some(p_value), statement };
    (if modes == 2 { sorted(two, signal) } else { one }, count)
}

/// Lowest frequency first.
fn sorted(fit: SinusoidFit, signal: &Signal) -> SinusoidFit {
    let mut poles = fit.poles.clone();
    poles.sort_by(|a, b| a.omega_rad_s.total_cmp(&b.omega_rad_s));
    if poles == fit.poles { fit } else { SinusoidFit::from_start(signal, fit.origin_s, &poles).unwrap_or(fit) }
}
