//! What the data say without a model: frequencies and dampings, every estimator side by side with its interval.
//!
//! | file | method |
//! |---|---|
//! | [`spectrum`] | amplitude spectrum, interpolated peaks |
//! | [`half_power`] | bandwidth at half power (paper Eq. 28) |
//! | [`decrement`] | logarithmic decrement over all peaks (Eq. 27) |
//! | [`sinusoids`], [`pencil`], [`modes`] | damped sinusoids by least squares, started from a matrix pencil; one mode or two |
//! | [`windows`], [`envelope`], [`decay_law`] | frequency and damping as functions of amplitude |
//! | [`estimators`], [`Mode`] | all of them side by side, and which to take |
//! | [`equivalents`] | K_eq, C_eq (Eq. 29, 30) |
//! | [`mod@floor`] | the frequency below which nothing hung can swing |
//! | [`consistency`] | whether the estimators agree |

pub mod consistency;
pub mod decay_law;
pub mod decrement;
pub mod envelope;
pub mod equivalents;
pub mod estimate;
pub mod estimators;
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
pub use estimators::{Estimator, Method};
pub use mode::{Damping, LinkMotion, Mode};

use crate::error::Result;
use crate::experiment::{Experiment, Rig};
use crate::model::chain::Chain;
use crate::series::AngleSeries;
use equivalents::Equivalents;
use estimators::Whole;
use floor::Floor;
use modes::ModeCount;
use signal::Signal;
use sinusoids::SinusoidFit;
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
    let body = experiment.map(|e| Ok(Body { experiment: e, chain: Chain::of(&e.specimen)? })).transpose()?;
    let signal = Signal::of(series);
    let mut found = Identification::of_record(series, &signal);
    match modes::choose_modes(&signal, &found.spectrum) {
        Some((fit, count)) => found.add_modes(&signal, &fit, count, body.as_ref()),
        None => found.notes.push(format!(
            "no oscillation is identifiable: the highest peak is {:.1} times the median power, as noise alone gives",
            found.spectrum.peaks.first().map_or(0.0, |p| p.over_floor)
        )),
    }
    Ok(found)
}

/// What swings, where the experiment file tells it.
struct Body<'a> {
    experiment: &'a Experiment,
    chain: Chain,
}

impl Identification {
    /// What can be said before anything is fitted.
    fn of_record(series: &AngleSeries, signal: &Signal) -> Self {
        let record = Record {
            source: series.path.display().to_string(),
            rows: series.len(),
            values: signal.links.iter().map(|l| l.t_s.len()).collect(),
            duration_s: series.duration_s(),
            step_s: series.step_s(),
            irregular_share: series.irregular_share(),
            noise_rad: Vec::new(),
        };
        let spectrum = Spectrum::of(signal, record.irregular_share);
        Self {
            schema: "freeswing.identify/1",
            notes: record_notes(&record, &spectrum),
            record,
            spectrum,
            mode_count: None,
            modes: Vec::new(),
            floor: None,
            equivalents: None,
        }
    }

    fn add_modes(&mut self, signal: &Signal, fit: &SinusoidFit, count: ModeCount, body: Option<&Body>) {
        let windows = Windows::of(signal, fit);
        self.record.noise_rad = match &windows {
            Ok(windows) => windows.noise_rad.clone(),
            Err(_) => fit.links.iter().map(|l| l.noise_rad).collect(),
        };
        let noise_rad = &self.record.noise_rad;
        let whole = Whole { signal, spectrum: &self.spectrum, fit, windows: &windows, noise_rad };
        let gravity_m_s2 = body.map_or(Rig::default().gravity_m_s2, |b| b.experiment.rig.gravity_m_s2);
        let same_links = body.map(|b| &b.chain).filter(|chain| chain.count() == signal.links.len());
        self.modes = (0..fit.poles.len()).map(|m| Mode::of(&whole, m, same_links, gravity_m_s2)).collect();
        self.mode_count = Some(count);
        if body.is_some() && same_links.is_none() {
            let message = "the experiment file has another number of links than the table; its own links make the floor and the equivalents";
            self.notes.push(message.to_owned());
        }
        if let (Some(body), Some(slowest)) = (body, self.modes.first()) {
            let frequency_hz = slowest.small_amplitude_hz(slowest.expected_kappa_per_rad2.unwrap_or(1.0 / 16.0));
            let damping_ratio = slowest.damping.estimate().copied();
            let floor = Floor::of(&body.experiment.specimen, &body.chain, gravity_m_s2, frequency_hz);
            self.notes.extend(floor.below.then(|| floor.statement.clone()));
            self.floor = Some(floor);
            self.equivalents = Some(Equivalents::of(&body.chain, gravity_m_s2, frequency_hz, damping_ratio));
        }
        let findings = self.modes.iter().flat_map(|m| m.notes.iter().cloned());
        self.notes.extend(findings);
    }
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
