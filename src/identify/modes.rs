//! How many modes the data show, and their damped sinusoids.

use serde::Serialize;

use super::close_pair::close_pair;
use super::estimate::{f_tail, probability};
use super::estimators::is_on_third_harmonic;
use super::excess::Excess;
use super::modulated::Modulated;
use super::pencil::matrix_pencil;
use super::pole::{FEWEST_CYCLES, Pole};
use super::signal::Signal;
use super::sinusoids::SinusoidFit;
use super::spectrum::Spectrum;
use super::windows::Windows;
use crate::series::Measured;

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

/// The damped sinusoids that a recording shows.
pub struct Chosen {
    /// Lowest frequency first.
    pub fit: SinusoidFit,
    /// One mode or two.
    pub count: ModeCount,
    /// Amplitude of what swings three times as fast as the slowest mode, whether it is one or that mode's harmonic; 0 where nothing does.
    pub third_rad: f64,
}

/// Terms of drift, half a cycle each, at most: what makes fewer than three cycles in a record is not told from a drift.
const MOST_DRIFT_TERMS: usize = 6;
/// A mode that noise makes in more than one of a thousand records is none.
const LEAST_P: f64 = 1e-3;
/// Windows in a row from the record's start in which a swing must be clear.
const FEWEST_WINDOWS: usize = 3;
/// Spectral lines tried as the strongest oscillation, where slow ones may be a drift.
const LINES_TRIED: usize = 4;

/// Damped sinusoids of as many modes as the data show, lowest frequency first, beside a drift of each link.
///
/// # Errors
/// In words, when nothing oscillates.
pub fn choose_modes(signal: &Signal, spectrum: &Spectrum, measured: Measured) -> Result<Chosen, String> {
    let one = strongest(signal, spectrum)?;
    let drift_terms = one.drift_terms();
    let highest_hz = spectrum.significant().map(|p| p.frequency_hz.value).fold(0.0, f64::max);
    let f1_hz = one.poles[0].frequency_hz();
    let guard_hz = (4.0 * spectrum.resolution_hz).max(0.12 * f1_hz);
    let apart = |p: &[Pole]| (p[0].frequency_hz() - p[1].frequency_hz()).abs() > 0.75 * guard_hz;

    let rest = Spectrum::of(&one.residuals(signal), 0.0);
    let slowest_hz = (1.0 + 0.5 * drift_terms as f64).max(2.0) * spectrum.resolution_hz;
    let far = |f_hz: f64| (f_hz - f1_hz).abs() > guard_hz && f_hz > slowest_hz;
    let second = rest.peaks.iter().find(|p| far(p.frequency_hz.value));
    let mut starts: Vec<Vec<Pole>> = Vec::new();
    if let Some(peak) = second {
        starts.extend(DAMPING_STARTS.iter().map(|xi| vec![one.poles[0], Pole::of(peak.frequency_hz.value, *xi)]));
    }
    let alone = one.without_drift(signal);
    let pencil = matrix_pencil(&alone, 2, highest_hz.max(second.map_or(0.0, |p| p.frequency_hz.value)));
    if pencil.len() == 2 && apart(&pencil) {
        starts.push(pencil);
    }
    let damped = |p: &Pole| p.damping_ratio() < 0.4 && p.damping_ratio() > -0.02;
    let faster_than_drift = |p: &Pole| p.frequency_hz() > slowest_hz;
    let sound = |fit: &SinusoidFit| apart(&fit.poles) && fit.poles.iter().all(|p| damped(p) && faster_than_drift(p));
    let chosen = match best(signal, &starts, drift_terms, sound) {
        Some(two) => decide(signal, spectrum, measured, one, two),
        None => {
            let statement = "one mode; no second one is seen".to_owned();
            Chosen { fit: one, count: ModeCount { modes: 1, bic_gain: None, p_value: None, statement }, third_rad: 0.0 }
        }
    };
    Ok(chosen.separated(signal, measured))
}

impl Chosen {
    /// With two modes in the place of one that beats.
    fn separated(self, signal: &Signal, measured: Measured) -> Self {
        let Some(pair) = close_pair(signal, &self.fit, measured) else { return self };
        let bic_gain = self.fit.criterion(signal) - pair.criterion(signal);
        let apart_hz = (pair.poles[0].frequency_hz() - pair.poles[1].frequency_hz()).abs();
        let statement = format!(
            "two modes {apart_hz:.4} Hz apart, a beat of {:.3} s: the second lowers the information criterion by {bic_gain:.0}",
            apart_hz.recip()
        );
        Self {
            fit: sorted(pair, signal),
            count: ModeCount { modes: 2, bic_gain: Some(bic_gain), p_value: None, statement },
            third_rad: 0.0,
        }
    }
}

/// The oscillation that moves most, beside as much drift as the data ask for.
fn strongest(signal: &Signal, spectrum: &Spectrum) -> Result<SinusoidFit, String> {
    let Some(first) = spectrum.significant().next() else {
        return Err(format!(
            "the highest peak is {:.1} times the median power, as noise alone gives",
            spectrum.peaks.first().map_or(0.0, |p| p.over_floor)
        ));
    };
    // a line of few cycles may be a drift that a faster, weaker line outlives
    let slow = |hz: f64| hz < (MOST_DRIFT_TERMS as f64) * spectrum.resolution_hz;
    let tried = if slow(first.frequency_hz.value) { LINES_TRIED } else { 1 };
    let duration_s = signal.duration_s();
    let fits = spectrum.significant().take(tried).filter_map(|p| one_mode(signal, p.frequency_hz.value));
    let fits = fits.filter(|fit| {
        let before = fit.deviance_without_modes(signal);
        let parameters = 2.0 + 2.0 * signal.links.len() as f64;
        let clear = Improvement { signal, spectrum, before, parameters, mode: 0 }.p_value(fit) < LEAST_P;
        // a wide swing, whose frequency moves with its amplitude, is none over the record but one over a few cycles
        clear || Windows::of(&fit.without_drift(signal), fit).is_ok_and(|w| w.moments[0].len() >= FEWEST_WINDOWS)
    });
    fits.max_by(|a, b| a.strength(0, duration_s).total_cmp(&b.strength(0, duration_s))).ok_or_else(|| {
        format!(
            "the strongest line, {:.4} Hz, is no damped swing of at least {FEWEST_CYCLES:.0} cycles in {duration_s:.3} s that stands clear of the motion around it: a drift, or a motion without a steady frequency",
            first.frequency_hz.value
        )
    })
}

fn one_mode(signal: &Signal, near_hz: f64) -> Option<SinusoidFit> {
    let mut starts: Vec<Vec<Pole>> = DAMPING_STARTS.iter().map(|xi| vec![Pole::of(near_hz, *xi)]).collect();
    starts.push(matrix_pencil(signal, 1, near_hz));
    // half a cycle a term: the fastest drift stays below half the oscillation's frequency
    let cycles = near_hz * signal.duration_s();
    let most = MOST_DRIFT_TERMS.min((cycles - 1.0).max(0.0) as usize);
    let fit = best(signal, &starts, most, |_| true).or_else(|| best(signal, &starts, 0, |_| true))?;
    let wanted = fit.wanted_drift(signal);
    Some(fit.with_drift_terms(signal, wanted))
}

fn best(
    signal: &Signal,
    starts: &[Vec<Pole>],
    drift_terms: usize,
    sound: impl Fn(&SinusoidFit) -> bool,
) -> Option<SinusoidFit> {
    let fit = |start: &Vec<Pole>| SinusoidFit::with_drift(signal, signal.span_s[0], start, drift_terms);
    let fits = starts.iter().filter_map(fit);
    fits.filter(sound).min_by(|a, b| a.deviance.total_cmp(&b.deviance))
}

/// A mode's share in a fit.
struct Improvement<'a> {
    signal: &'a Signal,
    spectrum: &'a Spectrum,
    /// Deviance without the mode.
    before: f64,
    /// What the mode has more.
    parameters: f64,
    mode: usize,
}

impl Improvement<'_> {
    /// Probability that noise alone improves the fit as much, at any of the record's independent frequencies: the F-test.
    ///
    /// It holds for white residuals. What the residual has beyond white noise near the line, a drift or the misfit of a large swing, is no evidence for a
    /// mode: the ratio is taken against the residual's power there.
    fn p_value(&self, fit: &SinusoidFit) -> f64 {
        let n = self.signal.values() as f64;
        // the links' weighted sums of squares: exp of the mean deviance
        let ratio = ((self.before - fit.deviance) / n).exp();
        let excess = Excess::of(&fit.residuals(self.signal), fit.poles[self.mode].omega_rad_s).power;
        let f = (ratio - 1.0) * fit.degrees_of_freedom / self.parameters / excess;
        let frequencies =
            self.spectrum.amplitude_rad.len() as f64 * self.spectrum.step_hz / self.spectrum.resolution_hz;
        (f_tail(f, self.parameters, fit.degrees_of_freedom) * frequencies).min(1.0)
    }
}

/// Whether one oscillation whose frequency and damping go with its amplitude, with its harmonics, describes the record as well as two modes do. Of a chain
/// that tells nothing: one of its modes may lie at the multiple, and a harmonic drives it.
fn single_oscillation_suffices(signal: &Signal, one: &SinusoidFit, two: &SinusoidFit, measured: Measured) -> bool {
    if signal.links.len() > 1 {
        return false;
    }
    let averaged = &signal.averaged(one.poles[0].omega_rad_s);
    let drift_terms = two.drift_terms();
    let of_two = SinusoidFit::with_drift(averaged, two.origin_s, &two.poles, drift_terms);
    let of_two = of_two.map(|fit| fit.criterion(averaged));
    Modulated::criterion(averaged, one, measured).is_some_and(|own| of_two.is_none_or(|two| own <= two))
}

/// F-test and information criterion.
fn decide(signal: &Signal, spectrum: &Spectrum, measured: Measured, one: SinusoidFit, two: SinusoidFit) -> Chosen {
    let more = (two.parameters() - one.parameters()) as f64;
    let bic_gain = one.deviance - two.deviance - more * (signal.values() as f64).ln();
    let duration_s = signal.duration_s();
    let [strong, weak] = if two.strength(0, duration_s) >= two.strength(1, duration_s) { [0, 1] } else { [1, 0] };
    let improvement = Improvement { signal, spectrum, before: one.deviance, parameters: more, mode: weak };
    let p_value = improvement.p_value(&two);
    let times = two.poles[weak].frequency_hz() / two.poles[strong].frequency_hz();
    let (large, small) = (two.amplitude_rad(strong), two.amplitude_rad(weak));
    // sin θ gives a third harmonic of A³/192, a chain a few times that; an error that goes with the place in the picture gives others, no larger than what a value errs
    let noise_rad = two.links.iter().map(|link| link.noise_rad).fold(0.0, f64::max);
    let of_swing = match measured {
        Measured::Angles => 0.05 * large.powi(3),
        // of whatever angle up to a right one: J₃(π/2)/J₁(π/2)
        Measured::Displacement => 0.12 * large,
    };
    let is_small = small < noise_rad.max(of_swing);
    let is_multiple = (times - times.round()).abs() < 0.03 && times.round() >= 2.0;
    let harmonic = is_multiple && (is_small || single_oscillation_suffices(signal, &one, &two, measured));
    let is_seen = p_value < LEAST_P && bic_gain > 10.0;
    let modes = if is_seen && !harmonic { 2 } else { 1 };
    let statement = if harmonic {
        format!(
            "one mode; the line at {:.4} Hz is its harmonic number {times:.0}, {:.1e} of its amplitude",
            two.poles[weak].frequency_hz(),
            small / large
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
    if !is_seen {
        return Chosen { fit: one, count, third_rad: 0.0 };
    }
    let two = sorted(two, signal);
    let third_rad = if is_on_third_harmonic(&two, 1) { two.amplitude_rad(1) } else { 0.0 };
    Chosen { fit: if modes == 2 { two } else { one }, count, third_rad }
}

/// Lowest frequency first.
fn sorted(fit: SinusoidFit, signal: &Signal) -> SinusoidFit {
    let mut poles = fit.poles.clone();
    poles.sort_by(|a, b| a.omega_rad_s.total_cmp(&b.omega_rad_s));
    let drift_terms = fit.drift_terms();
    if poles == fit.poles {
        return fit;
    }
    SinusoidFit::with_drift(signal, fit.origin_s, &poles, drift_terms).unwrap_or(fit)
}
