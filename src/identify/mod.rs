//! What the data say without a model: frequencies and dampings, every estimator side by side with its interval.
//!
//! | file | method |
//! |---|---|
//! | [`spectrum`] | amplitude spectrum, interpolated peaks |
//! | [`half_power`] | bandwidth at half power (paper Eq. 28) |
//! | [`decrement`] | logarithmic decrement over all peaks (Eq. 27) |
//! | [`sinusoids`], [`pencil`], [`modes`] | damped sinusoids by least squares, started from a matrix pencil; one mode or two |
//! | [`windows`], [`envelope`], [`decay_law`] | frequency and damping as functions of amplitude |
//! | [`equivalents`] | K_eq, C_eq (Eq. 29, 30) |
//! | [`mod@floor`] | the frequency below which nothing hung can swing |
//! | [`consistency`] | whether the estimators agree |

pub mod consistency;
pub mod decay_law;
pub mod decrement;
pub mod envelope;
pub mod equivalents;
pub mod estimate;
pub mod floor;
pub mod half_power;
mod mode;
pub mod modes;
pub mod pencil;
pub mod signal;
pub mod sinusoids;
pub mod spectrum;
mod table;
pub mod windows;

use serde::Serialize;

pub use estimate::Estimate;
pub use mode::{Damping, Estimator, LinkMotion, Method, Mode};

use crate::error::Result;
use crate::experiment::Experiment;
use crate::model::chain::Chain;
use crate::series::AngleSeries;
use equivalents::Equivalents;
use floor::Floor;
use modes::ModeCount;
use signal::Signal;
use spectrum::Spectrum;
use windows::Windows;

/// What was recorded.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Record {
    /// Where it came from.
    pub source: String,
    /// Rows of the table.
    pub rows: usize,
    /// Values of each angle.
    pub values: Vec<usize>,
    /// From the first to the last.
    pub duration_s: f64,
    /// Median step.
    pub step_s: f64,
    /// Share of steps that differ from it by more than 5 %.
    pub irregular_share: f64,
    /// Noise of each angle, from what fits over a few cycles leave over.
    pub noise_rad: Vec<f64>,
}

/// Everything the data say without a model.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Identification {
    /// `freeswing.identify/1`.
    pub schema: &'static str,
    /// What was recorded.
    pub record: Record,
    /// Its spectrum.
    pub spectrum: Spectrum,
    /// How many modes it shows; absent when nothing oscillates.
    pub mode_count: Option<ModeCount>,
    /// Lowest frequency first; empty when nothing oscillates.
    pub modes: Vec<Mode>,
    /// Needs the experiment file.
    pub floor: Option<Floor>,
    /// Needs the experiment file.
    pub equivalents: Option<Equivalents>,
    /// What the reader should know.
    pub notes: Vec<String>,
}

/// Identifies a recording; the experiment file adds the floor and the equivalent constants.
///
/// # Errors
/// [`crate::Error::Simulation`] when the experiment's specimen cannot swing. What the data cannot tell is no error but says so in the result.
pub fn identify(series: &AngleSeries, experiment: Option<&Experiment>) -> Result<Identification> {
    let body = experiment.map(|e| Chain::of(&e.specimen).map(|chain| (e, chain))).transpose()?;
    let signal = Signal::of(series);
    let spectrum = Spectrum::of(&signal, series.irregular_share());
    let found = modes::choose_modes(&signal, &spectrum);
    let mut record = Record {
        source: series.path.display().to_string(),
        rows: series.len(),
        values: signal.links.iter().map(|l| l.t_s.len()).collect(),
        duration_s: series.duration_s(),
        step_s: series.step_s(),
        irregular_share: series.irregular_share(),
        noise_rad: Vec::new(),
    };
    let mut notes = record_notes(&record, &spectrum);
    let Some((fit, count)) = found else {
        let highest = spectrum.peaks.first().map_or(0.0, |p| p.over_floor);
        notes.push(format!(
            "no oscillation is identifiable: the highest peak is {highest:.1} times the median power, as noise alone gives"
        ));
        let (mode_count, modes, floor, equivalents) = (None, Vec::new(), None, None);
        let schema = "freeswing.identify/1";
        return Ok(Identification { schema, record, spectrum, mode_count, modes, floor, equivalents, notes });
    };
    let windows = Windows::of(&signal, &fit);
    record.noise_rad = match &windows {
        Ok(windows) => windows.noise_rad.clone(),
        Err(_) => fit.links.iter().map(|l| l.noise_rad).collect(),
    };
    let whole = mode::Whole {
        signal: &signal,
        spectrum: &spectrum,
        fit: &fit,
        windows: &windows,
        noise_rad: &record.noise_rad,
    };
    let chain = body.as_ref().filter(|(_, chain)| chain.count() == series.links());
    let gravity_m_s2 = experiment.map_or(9.80665, |e| e.rig.gravity_m_s2);
    let modes: Vec<Mode> =
        (0..fit.poles.len()).map(|m| Mode::of(&whole, m, chain.map(|(_, c)| c), gravity_m_s2)).collect();
    if body.is_some() && chain.is_none() {
        notes.push("the experiment file has another number of links than the table: floor and equivalents are of the file's links".to_owned());
    }
    let (mut floor, mut equivalents) = (None, None);
    if let (Some((experiment, chain)), Some(lowest)) = (&body, modes.first()) {
        let f = lowest.small_amplitude_hz(lowest.expected_kappa_per_rad2.unwrap_or(1.0 / 16.0));
        let own = Floor::of(&experiment.specimen, chain, gravity_m_s2, f);
        if own.below {
            notes.push(own.statement.clone());
        }
        floor = Some(own);
        let damping = lowest.damping.estimate().copied();
        equivalents = Some(Equivalents::of(chain, gravity_m_s2, f, damping));
    }
    notes.extend(modes.iter().flat_map(|m| m.notes.iter().cloned()));
    let schema = "freeswing.identify/1";
    Ok(Identification { schema, record, spectrum, mode_count: Some(count), modes, floor, equivalents, notes })
}

fn record_notes(record: &Record, spectrum: &Spectrum) -> Vec<String> {
    let mut notes = Vec::new();
    if record.irregular_share > 0.02 {
        notes.push(format!(
            "{:.0} % of the time steps are irregular: least-squares methods use the exact times, the spectrum is interpolated to an even step and its peaks refined on the exact times",
            100.0 * record.irregular_share
        ));
    }
    if spectrum.missing_share > 0.02 {
        notes.push(format!("{:.0} % of the record is missing; gaps carry no weight", 100.0 * spectrum.missing_share));
    }
    notes
}
