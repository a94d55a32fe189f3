//! What a recording shows without the model: how fast it swings, and how fast that dies away.

use std::f64::consts::FRAC_PI_2;

use nalgebra::Complex;

use super::Record;
use crate::identify::envelope::PENDULUM;
use crate::identify::{Identification, Method, Mode, identify};
use crate::series::AngleSeries;

/// Rows that suffice for frequencies and decay.
const ENOUGH_ROWS: usize = 4000;
/// A mode with less than this part of the largest amplitude is a drift, or no mode.
const WEAK: f64 = 0.05;
/// Periods of the slow mode in which a second one is looked for that soon dies away, and how much faster it is.
const EARLY_PERIODS: f64 = 8.0;
const FASTER: f64 = 1.5;
/// A frequency known to a worse part than this is none.
const VAGUE: f64 = 0.05;

/// One mode as it was seen.
#[derive(Debug, Clone, PartialEq)]
pub struct ObservedMode {
    /// Natural frequency at small amplitude.
    pub frequency_hz: f64,
    /// Half its 95 % interval, which what amplitude may do to it widens.
    pub frequency_half_hz: f64,
    /// Half the interval of the mean frequency, as a share.
    pub(super) relative_half_width: f64,
    /// Of the whole recording, whatever its amplitude.
    pub mean_frequency_hz: f64,
    /// ξ, where the decay is told from none.
    pub damping_ratio: Option<f64>,
    /// Largest amplitude of any angle, at the start.
    pub amplitude_rad: f64,
    /// θᵢ/θ₁.
    pub shape: Vec<Complex<f64>>,
}

/// The modes of a recording.
#[derive(Debug, Clone, PartialEq)]
pub struct Seen {
    /// The slow one.
    pub slow: ObservedMode,
    /// The next, where one is seen.
    pub fast: Option<ObservedMode>,
    /// Half the rate.
    pub nyquist_hz: f64,
    /// Frequencies of all that stands out.
    pub peaks_hz: Vec<f64>,
}

impl Seen {
    /// Of the first rows of a recording; `None` where nothing oscillates, or too irregularly for a frequency.
    pub fn of(record: &Record) -> Option<Self> {
        let series = AngleSeries {
            path: record.path.clone(),
            t_s: record.t_s.clone(),
            theta_rad: record.theta_rad.clone(),
            sd_rad: vec![vec![None; record.len()]; record.links()],
            tracked: false,
            warnings: Vec::new(),
        };
        let found = identify(&series.slice(0..record.len().min(ENOUGH_ROWS)), None).ok()?;
        let mut modes = clear_modes(&found);
        if modes.is_empty() {
            modes = modes_of_degrees(&series);
        }
        let largest_rad = modes.iter().map(|m| m.amplitude_rad).fold(0.0, f64::max);
        let slow = modes.iter().find(|m| m.amplitude_rad >= WEAK * largest_rad)?.clone();
        let second = |modes: Vec<ObservedMode>| modes.into_iter().find(|m| m.frequency_hz > FASTER * slow.frequency_hz);
        let early = || {
            let until_s = record.t_s[0] + EARLY_PERIODS / slow.frequency_hz;
            let early = series.slice(series.rows(f64::NEG_INFINITY, until_s)).checked().ok()?;
            second(clear_modes(&identify(&early, None).ok()?))
        };
        let peaks_hz = found.spectrum.significant().map(|p| p.frequency_hz.value).collect();
        Some(Self { fast: second(modes).or_else(early), slow, nyquist_hz: series.nyquist_hz(), peaks_hz })
    }
}

/// The modes of angles beyond 90°, taken for degrees, of which they are a small swing; their amplitudes as in the table.
fn modes_of_degrees(series: &AngleSeries) -> Vec<ObservedMode> {
    let mut series = series.slice(0..series.t_s.len().min(ENOUGH_ROWS));
    let angles = || series.theta_rad.iter().flatten().flatten();
    if !angles().any(|a| a.abs() > FRAC_PI_2) {
        return Vec::new();
    }
    series.theta_rad.iter_mut().flatten().flatten().for_each(|a| *a = a.to_radians());
    let mut modes = identify(&series, None).map_or_else(|_| Vec::new(), |found| clear_modes(&found));
    modes.iter_mut().for_each(|m| m.amplitude_rad = m.amplitude_rad.to_degrees());
    modes
}

/// The modes of a known frequency, slowest first.
fn clear_modes(found: &Identification) -> Vec<ObservedMode> {
    let mut modes: Vec<ObservedMode> =
        found.modes.iter().chain(&found.may_be_harmonics).map(ObservedMode::of).collect();
    modes.retain(|mode| mode.frequency_hz > 0.0 && mode.relative_half_width < VAGUE);
    modes.sort_by(|a, b| a.frequency_hz.total_cmp(&b.frequency_hz));
    modes
}

impl ObservedMode {
    fn of(mode: &Mode) -> Self {
        let small = mode.small_amplitude_hz(PENDULUM);
        let whole = mode.estimators.iter().find(|e| e.method == Method::Sinusoids).and_then(|e| e.frequency_hz);
        let of_link = |link: &crate::identify::LinkMotion| {
            Complex::from_polar(link.ratio_to_first.value, link.phase_to_first_rad.value)
        };
        Self {
            frequency_hz: small.value,
            frequency_half_hz: 0.5 * (small.high - small.low),
            relative_half_width: whole.map_or(f64::INFINITY, |f| 0.5 * (f.high - f.low) / f.value.abs().max(1e-12)),
            mean_frequency_hz: whole.map_or(small.value, |w| w.value),
            damping_ratio: mode.damping.estimate().map(|xi| xi.value),
            amplitude_rad: mode.shape.iter().map(|l| l.amplitude_rad).fold(0.0, f64::max),
            shape: mode.shape.iter().map(of_link).collect(),
        }
    }
}
