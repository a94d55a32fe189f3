//! `identify.json`, as far as it is shown.

use serde::Deserialize;

use super::Interval;

/// `identify.json`.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub struct Identified {
    pub summary: String,
    pub record: Recorded,
    pub spectrum: SpectrumFound,
    pub drift_rad: Vec<Option<f64>>,
    pub used_s: Option<[f64; 2]>,
    pub modes: Vec<Mode>,
    pub swing_mode: Option<usize>,
    pub floor: Option<Statement>,
    pub equivalents: Option<Equivalents>,
    pub notes: Vec<String>,
}

/// The table that was identified.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub struct Recorded {
    pub rows: usize,
    pub duration_s: Option<f64>,
    pub step_s: Option<f64>,
    pub noise_rad: Vec<Option<f64>>,
}

/// What of the spectrum is in the file.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub struct SpectrumFound {
    pub resolution_hz: Option<f64>,
    pub window_width_hz: Option<f64>,
    pub peaks: Vec<Peak>,
}

/// A peak.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub struct Peak {
    pub frequency_hz: Interval,
    pub amplitude_rad: Option<f64>,
}

/// Words alone.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub struct Statement {
    pub statement: String,
}

/// A mode.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub struct Mode {
    pub number: usize,
    pub frequency_hz: Interval,
    pub frequency_at_amplitude_rad: Option<f64>,
    pub damping: Damping,
    pub basis: String,
    pub shape: Vec<LinkMotion>,
    pub estimators: Vec<Estimator>,
    pub frequency_consistency: Option<Consistency>,
    pub damping_consistency: Option<Consistency>,
    pub envelope: Option<Envelope>,
    pub modulated: Option<Modulated>,
}

impl Mode {
    /// How its frequency goes with amplitude, by the method that the answer is from.
    pub fn frequency_law(&self) -> Option<&FrequencyLaw> {
        let modulated = self.modulated.as_ref().map(|own| &own.frequency);
        modulated.or(self.envelope.as_ref().and_then(|own| own.frequency.as_ref()))
    }
}

/// One oscillation through the whole record.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub struct Modulated {
    pub frequency: FrequencyLaw,
}

/// ξ, or why there is none.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub struct Damping {
    pub identified: Option<Interval>,
    pub not_identifiable: Option<NotIdentifiable>,
}

/// Why there is no ξ.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub struct NotIdentifiable {
    pub estimate: Option<Interval>,
    pub reason: String,
}

/// One link's part in a mode.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub struct LinkMotion {
    pub amplitude_rad: Option<f64>,
    pub ratio_to_first: Interval,
    pub phase_to_first_rad: Interval,
}

/// What one method says.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub struct Estimator {
    pub method: String,
    pub frequency_hz: Option<Interval>,
    pub damping_ratio: Option<Interval>,
    pub note: Option<String>,
}

/// Whether the methods agree.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub struct Consistency {
    pub agree: bool,
}

/// A mode from window to window.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub struct Envelope {
    pub window_s: Option<f64>,
    pub steps: Vec<Step>,
    pub frequency: Option<FrequencyLaw>,
}

/// From one window to the next.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub struct Step {
    pub t_s: Option<f64>,
    pub amplitude_rad: Option<f64>,
    pub frequency_hz: Interval,
    pub damping_ratio: Interval,
}

/// f = f₀ (1 − κA²).
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub struct FrequencyLaw {
    pub f0_hz: Interval,
    pub kappa_per_rad2: Interval,
}

/// The equivalent oscillator.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub struct Equivalents {
    pub k_eq_n_per_m: Interval,
    pub c_eq_n_s_per_m: Option<Interval>,
    pub k_rot_n_m_per_rad: Interval,
    pub c_rot_n_m_s_per_rad: Option<Interval>,
    pub k_gravity_n_m_per_rad: Option<f64>,
}
