//! Two modes closer than a spectrum of the record separates.
//!
//! Their sum is one line that beats, and one damped sinusoid fitted to it has the frequency and the damping of neither. Least squares over the record has no
//! limit of resolution but the noise: two damped sinusoids are fitted from poles on both sides of the line. The same beat, over less than a period of it, can
//! be one oscillation whose frequency and damping go with its amplitude; what is told is therefore
//!
//! - no pair that leaves more than noise near its lines, unless one oscillation leaves ten times its power (a wide swing has amplitudes that act on both); none whose frequencies differ by less than they are known, or by less than a half-power bandwidth: two
//!   modes that overlap so far are not told from one that is no sinusoid;
//! - no pair where one such oscillation describes the record as well ([`super::modulated`], by the Bayesian information criterion).

use super::excess::Excess;
use super::mode::Mode;
use super::modulated::Modulated;
use super::pencil::matrix_pencil;
use super::pole::Pole;
use super::signal::Signal;
use super::sinusoids::SinusoidFit;
use crate::series::Measured;

/// Distances of the second pole from the first at the start, over 1/T.
const DISTANCES: [f64; 5] = [0.4, 0.8, 1.4, 2.2, 3.4];
/// So many standard deviations of their difference lie between two frequencies that are told apart, and of an amplitude above zero (statistics).
const APART: f64 = 5.0;
/// By how much the Bayesian information criterion of a pair lies below that of one oscillation (very strong evidence: Kass and Raftery, J. Am. Stat. Assoc. 90
/// (1995) 773).
const VERY_STRONG: f64 = 10.0;
/// Where a pair leaves more than noise, the most of one oscillation's residual that it leaves, in power (judgement).
const MOST_LEFT: f64 = 0.1;
/// The higher frequency over the lower one, at most: what lies further apart has a line of its own.
const FARTHEST: f64 = 1.3;
/// A damping ratio of a mode lies between these (an oscillation that grows more is none of a free swing).
const DAMPING_RATIOS: [f64; 2] = [-1e-3, 0.2];

/// The pair that is in the place of this one damped sinusoid, if there is one.
pub(super) fn close_pair(signal: &Signal, one: &SinusoidFit, measured: Measured) -> Option<SinusoidFit> {
    let [pole] = one.poles[..] else { return None };
    let drift_terms = one.drift_terms();
    let averaged = &signal.averaged(pole.omega_rad_s);
    let fit = |start: Vec<Pole>| SinusoidFit::with_drift(averaged, one.origin_s, &start, drift_terms);
    let line_rad_s = std::f64::consts::TAU / signal.duration_s();
    let beside = |lines: f64| Pole { omega_rad_s: pole.omega_rad_s + lines * line_rad_s, ..pole };
    let starts = DISTANCES.iter().flat_map(|d| [-*d, *d]).map(|d| vec![beside(-0.3 * d), beside(0.7 * d)]);
    let pencil = matrix_pencil(&one.without_drift(signal), 2, 1.5 * pole.frequency_hz());
    let fits = starts.chain([pencil]).filter(|start| start.len() == 2).filter_map(fit);
    let pair = fits.min_by(|a, b| a.deviance.total_cmp(&b.deviance))?;
    pair.is_two_modes().then_some(())?;
    let (own, values) = (pair.criterion(averaged), averaged.values() as f64);
    let least = if leaves_noise(averaged, &pair) { VERY_STRONG } else { -values * MOST_LEFT.ln() };
    let better = |than: f64| own + least < than;
    let is_better = better(fit(vec![pole])?.criterion(averaged))
        && Modulated::criterion(averaged, one, measured).is_none_or(better);
    let pair = is_better.then_some(pair)?;
    SinusoidFit::with_drift(signal, one.origin_s, &pair.poles, drift_terms)
}

/// What two modes so close of a single link mean, which in one plane has but one.
pub(super) fn of_one_link(modes: &[Mode]) -> Option<String> {
    let [a, b] = modes else { return None };
    let [low_hz, high_hz] =
        [a.frequency_hz.value.min(b.frequency_hz.value), a.frequency_hz.value.max(b.frequency_hz.value)];
    (high_hz < FARTHEST * low_hz).then(|| {
        format!(
            "one link has one mode in one plane, and two are seen {:.1} % apart: it swings in two planes and is seen from one side, as a string whose ellipse turns, or a neighbouring part vibrates with it; look at it from below, or let it swing on two strings, before using either damping ratio",
            100.0 * (high_hz / low_hz - 1.0)
        )
    })
}

fn leaves_noise(signal: &Signal, fit: &SinusoidFit) -> bool {
    let residual = fit.residuals(signal);
    fit.poles.iter().all(|pole| Excess::of(&residual, pole.omega_rad_s).power <= 1.0)
}

impl SinusoidFit {
    /// Whether both modes of a pair are seen, each for itself.
    fn is_two_modes(&self) -> bool {
        let [low, high] = DAMPING_RATIOS;
        let damped = self.poles.iter().all(|pole| low < pole.damping_ratio() && pole.damping_ratio() < high);
        let seen = (0..2).all(|mode| {
            self.links.iter().any(|link| link.amplitudes_rad[mode].norm() > APART * link.amplitude_sd_rad[mode])
        });
        let c = &self.covariance;
        let variance = c[(0, 0)] + c[(2, 2)] - 2.0 * c[(0, 2)];
        let distance = (self.poles[0].omega_rad_s - self.poles[1].omega_rad_s).abs();
        let widest = self.poles.iter().map(|pole| 2.0 * pole.decay_per_s).fold(0.0, f64::max);
        let close =
            distance < (FARTHEST - 1.0) * self.poles.iter().map(|p| p.omega_rad_s).fold(f64::INFINITY, f64::min);
        damped && seen && close && distance > widest && distance > APART * variance.max(0.0).sqrt()
    }
}
