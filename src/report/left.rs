//! What a run left in its folder, read back: each part if it is there, and if not, why.
//!
//! Of the JSON files only the fields that the page shows are read. A field that is absent leaves its line out, a file of another format its part.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::Deserialize;
use serde::de::DeserializeOwned;
use sha2::{Digest, Sha256};

use super::curves::Curves;
use crate::error::{Error, Result};
use crate::series::AngleSeries;

/// Everything in the folder that the page can show.
#[derive(Debug, Default)]
pub struct Left {
    /// The folder.
    pub folder: PathBuf,
    /// `angles.csv`.
    pub angles: Option<AngleSeries>,
    /// `angles.json`.
    pub track: Option<Track>,
    /// `identify.json`.
    pub identified: Option<Identified>,
    /// `fit.json`.
    pub fit: Option<Fitted>,
    /// `diagnosis.json`.
    pub diagnosis: Option<Diagnosed>,
    /// `figures/fit.csv`.
    pub fit_curves: Option<Curves>,
    /// `figures/diagnosis.csv`.
    pub diagnosis_curves: Option<Curves>,
    /// `figures/where.csv`.
    pub where_curves: Option<Curves>,
    /// `experiment.toml` as it stands.
    pub configuration: Option<String>,
    /// `log.txt`.
    pub log: Option<Log>,
    /// Bytes of `overlay.mp4`.
    pub overlay_bytes: Option<u64>,
    /// SHA-256 of each file.
    pub digests: Vec<(String, String)>,
    /// What is not there, and why.
    pub missing: Vec<Missing>,
}

/// A part of the page that cannot be shown.
#[derive(Debug)]
pub struct Missing {
    /// The file it is read from.
    pub file: &'static str,
    /// What it holds.
    pub holds: &'static str,
    /// Why it is not there.
    pub why: String,
}

/// A value with its 95 % interval; what is not finite is absent.
#[derive(Debug, Clone, Copy, Default, Deserialize)]
#[serde(default)]
pub struct Interval {
    pub value: Option<f64>,
    pub sd: Option<f64>,
    pub low: Option<f64>,
    pub high: Option<f64>,
}

/// `angles.json`.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub struct Track {
    pub version: String,
    pub source: Source,
    pub options: TrackOptions,
    pub video: Video,
    pub time_stamps: TimeStamps,
    pub angles: Vec<TrackedAngle>,
    pub warnings: Vec<String>,
}

/// The recording.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub struct Source {
    pub file: String,
    pub bytes: u64,
    pub sha256: String,
}

/// What of the options moves the clock.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub struct TrackOptions {
    pub time_scale: Option<f64>,
    pub mirrored: bool,
}

/// The stream.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub struct Video {
    pub container: String,
    pub codec: String,
    pub width_px: u64,
    pub height_px: u64,
}

/// The audit of the time stamps.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub struct TimeStamps {
    pub frames: usize,
    pub first_s: f64,
    pub last_s: f64,
    pub nominal_rate_hz: Option<f64>,
    pub real_rate_hz: Option<f64>,
    pub median_step_s: f64,
    pub shortest_step_s: f64,
    pub longest_step_s: f64,
    pub jitter_sd_s: f64,
    pub repeated_or_backward_frames: Vec<usize>,
    pub gap_count: usize,
    pub missing_frames: u64,
}

/// Noise of one angle.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub struct TrackedAngle {
    pub frames_measured: usize,
    pub noise_rad: Option<f64>,
}

/// `identify.json`.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub struct Identified {
    pub summary: String,
    pub record: Recorded,
    pub spectrum: SpectrumFound,
    pub drift_rad: Vec<Option<f64>>,
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
    pub damping: Damping,
    pub basis: String,
    pub shape: Vec<LinkMotion>,
    pub estimators: Vec<Estimator>,
    pub frequency_consistency: Option<Consistency>,
    pub damping_consistency: Option<Consistency>,
    pub envelope: Option<Envelope>,
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

/// `fit.json`.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub struct Fitted {
    pub specimen: String,
    pub parameters: BTreeMap<String, FittedParameter>,
    pub coloured_residuals: bool,
    pub converged: Option<bool>,
    pub recordings: Vec<FittedRecording>,
}

/// A fitted parameter.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub struct FittedParameter {
    pub value: Option<f64>,
    pub sd: Option<f64>,
    pub low95: Option<f64>,
    pub high95: Option<f64>,
    pub start: Option<f64>,
    pub unit: String,
    pub determined: Option<bool>,
}

/// A recording that was fitted.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub struct FittedRecording {
    pub fitted: FitSide,
    pub pace: Option<PaceFound>,
}

/// What the fitted model leaves.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub struct FitSide {
    pub rmse_rad: Vec<Option<f64>>,
    pub noise_rad: Vec<Option<f64>>,
    pub reproduced: Option<bool>,
    pub statement: String,
}

/// How fast it swings beside the specimen.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub struct PaceFound {
    pub statement: Option<String>,
}

/// `diagnosis.json`.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub struct Diagnosed {
    pub specimen: String,
    pub baseline: Baseline,
    #[serde(rename = "where")]
    pub location: Location,
    pub candidates: Vec<Candidate>,
    pub verdict: Verdict,
    pub heldout: Option<HeldOut>,
    pub detectable: BTreeMap<String, Detectable>,
    pub undecided: Vec<String>,
}

/// The base model.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub struct Baseline {
    pub rmse_rad: Vec<Option<f64>>,
    pub noise_rad: Vec<Option<f64>>,
    pub adequate: Option<bool>,
    pub p_value: Option<f64>,
}

/// Where it departs.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub struct Location {
    pub place: Option<String>,
    pub energy_share: BTreeMap<String, Option<f64>>,
    pub statement: String,
    pub missing_torque: Option<MissingTorque>,
    pub unknown: Vec<Unknown>,
}

/// The torque that the base model lacks.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub struct MissingTorque {
    pub place: String,
}

/// An unknown at some place.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub struct Unknown {
    pub place: String,
    pub form: String,
    pub log_likelihood_gain: Option<f64>,
}

/// A value with its unit.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub struct Quantity {
    pub value: Option<f64>,
    pub sd: Option<f64>,
    pub unit: String,
}

/// An explanation.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub struct Candidate {
    pub effects: Vec<String>,
    pub probability: Option<f64>,
    pub parameters: BTreeMap<String, Quantity>,
    pub rmse_rad: Vec<Option<f64>>,
}

/// The verdict.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub struct Verdict {
    pub status: String,
    pub effects: Vec<String>,
    pub further_effects: Vec<String>,
    pub class: Vec<String>,
    pub probability: Option<f64>,
    pub unknown_probability: Option<f64>,
    pub inclusion: BTreeMap<String, Option<f64>>,
    pub remainder: Option<Remainder>,
    pub law: Option<Law>,
    pub statement: String,
    pub to_decide: Option<String>,
}

/// What the names leave.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub struct Remainder {
    pub present: Option<f64>,
    pub place: Option<String>,
    pub phase: Option<String>,
    pub frequency_hz: Option<f64>,
    pub rms_rad: Vec<Option<f64>>,
    pub over_noise: Vec<Option<f64>>,
    pub share: Option<f64>,
}

/// A law that was learnt.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub struct Law {
    pub place: String,
    pub formula: String,
    pub unit: String,
    pub alternatives: Vec<Alternative>,
    pub toml: String,
}

/// Another formula.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub struct Alternative {
    pub formula: String,
}

/// The prediction of what was not fitted.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub struct HeldOut {
    pub from_s: Option<f64>,
    pub baseline_rmse_rad: Vec<Option<f64>>,
    pub named_rmse_rad: Vec<Option<f64>>,
    pub augmented_rmse_rad: Vec<Option<f64>>,
}

/// From which amount on an effect would have been seen.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub struct Detectable {
    pub smallest: Option<f64>,
    pub named_from: Option<f64>,
    pub unit: String,
    pub confused_with: Vec<String>,
}

/// `log.txt`: what was called, and what was said.
#[derive(Debug, Default)]
pub struct Log {
    /// As it stands.
    pub text: String,
    /// Lines that begin with `$`, without it.
    pub commands: Vec<String>,
    /// What follows `warning:`, each once.
    pub warnings: Vec<String>,
    /// What follows the last `error:`.
    pub error: Option<String>,
}

impl Log {
    fn of(text: String) -> Self {
        let mut log = Self::default();
        for line in text.lines() {
            let after = |mark: &str| line.split_once(mark).map(|(_, rest)| rest.trim().to_owned());
            if let Some(command) = line.strip_prefix("$ ") {
                log.commands.push(command.trim().to_owned());
            } else if let Some(error) = after("error: ") {
                log.error = Some(error);
            } else if let Some(warning) = after("warning: ").filter(|w| !log.warnings.contains(w)) {
                log.warnings.push(warning);
            }
        }
        Self { text, ..log }
    }
}

impl Left {
    /// Reads what is there.
    ///
    /// # Errors
    /// [`Error::Unreadable`] and, of a folder without any of the files or a JSON file that is none, [`Error::Left`].
    pub fn read(folder: &Path) -> Result<Self> {
        let entries = std::fs::read_dir(folder).map_err(|e| Error::unreadable(folder, e))?;
        drop(entries);
        let mut left = Self { folder: folder.to_owned(), ..Self::default() };
        left.log = left.text("log.txt")?.map(Log::of);
        left.track = left.json("angles.json", "the audit of the time stamps")?;
        left.angles = left.angles()?;
        left.identified = left.json("identify.json", "frequencies and damping")?;
        left.fit = left.json("fit.json", "the model beside the measurement")?;
        left.diagnosis = left.json("diagnosis.json", "what the model lacks")?;
        if left.fit.is_some() {
            left.fit_curves = left.curves("figures/fit.csv", "the curves of the fitted model")?;
        }
        if left.diagnosis.is_some() {
            left.diagnosis_curves = left.curves("figures/diagnosis.csv", "the curves before and after")?;
            left.where_curves = left.text("figures/where.csv")?.map(|text| Curves::parse(&text));
        }
        left.configuration = left.text("experiment.toml")?;
        left.overlay_bytes = std::fs::metadata(left.path("overlay.mp4")).ok().filter(|m| m.is_file()).map(|m| m.len());
        if left.overlay_bytes.is_none() {
            left.miss("overlay.mp4", "the recording with the marks drawn in", None);
        }
        let known = left.angles.is_some() || left.track.is_some() || left.identified.is_some();
        if !(known || left.fit.is_some() || left.diagnosis.is_some() || left.log.is_some()) {
            let message = "holds nothing that a run leaves (angles.csv, identify.json, fit.json, diagnosis.json, log.txt); give the folder \
                           of `freeswing run --out`";
            return Err(Error::Left { path: folder.to_owned(), line: None, message: message.to_owned() });
        }
        Ok(left)
    }

    /// The name to head the page with: the specimen's, else the folder's.
    pub fn title(&self) -> String {
        let named = [self.fit.as_ref().map(|f| &f.specimen), self.diagnosis.as_ref().map(|d| &d.specimen)];
        let named = named.into_iter().flatten().find(|name| !name.trim().is_empty()).cloned();
        let whole = || self.folder.canonicalize().unwrap_or_else(|_| self.folder.clone());
        named.unwrap_or_else(|| {
            whole().file_name().map_or_else(|| "Recording".to_owned(), |n| n.to_string_lossy().into_owned())
        })
    }

    /// Lengths of the links as the experiment file states them.
    pub fn link_lengths_m(&self) -> Vec<f64> {
        let Some(table) = self.configuration.as_ref().and_then(|text| text.parse::<toml::Table>().ok()) else {
            return Vec::new();
        };
        let specimen = table.get("specimen");
        let number = |value: &toml::Value| value.as_float().or_else(|| value.as_integer().map(|n| n as f64));
        let stated = specimen.and_then(|s| s.get("link_lengths_m")).and_then(toml::Value::as_array);
        let links = specimen.and_then(|s| s.get("links")).and_then(toml::Value::as_array);
        match (stated, links) {
            (Some(lengths), _) => lengths.iter().filter_map(number).collect(),
            (None, Some(links)) => links.iter().filter_map(|l| l.get("length_m").and_then(number)).collect(),
            (None, None) => Vec::new(),
        }
    }

    /// A file of the folder.
    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.join(name)
    }

    fn miss(&mut self, file: &'static str, holds: &'static str, why: Option<String>) {
        let stopped = self.log.as_ref().and_then(|log| log.error.clone());
        let why = why.or(stopped).unwrap_or_else(|| "the folder does not hold it".to_owned());
        self.missing.push(Missing { file, holds, why });
    }

    /// The bytes of a file that may be absent; its digest is kept.
    fn bytes(&mut self, name: &str) -> Result<Option<Vec<u8>>> {
        let path = self.path(name);
        match std::fs::read(&path) {
            Ok(bytes) => {
                let digest = Sha256::digest(&bytes).iter().map(|b| format!("{b:02x}")).collect();
                self.digests.push((name.to_owned(), digest));
                Ok(Some(bytes))
            }
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(None),
            Err(error) => Err(Error::unreadable(&path, error)),
        }
    }

    fn text(&mut self, name: &str) -> Result<Option<String>> {
        Ok(self.bytes(name)?.map(|bytes| String::from_utf8_lossy(&bytes).into_owned()))
    }

    /// A table that cannot be used, as one without angles, is no obstacle to the rest.
    fn angles(&mut self) -> Result<Option<AngleSeries>> {
        let (file, holds) = ("angles.csv", "the measured angles");
        let Some(bytes) = self.bytes(file)? else {
            self.miss(file, holds, None);
            return Ok(None);
        };
        match AngleSeries::parse(&bytes, Path::new(file)) {
            Ok(series) => Ok(Some(series)),
            Err(error) => {
                self.miss(file, holds, Some(error.to_string()));
                Ok(None)
            }
        }
    }

    fn curves(&mut self, file: &'static str, holds: &'static str) -> Result<Option<Curves>> {
        let curves = self.text(file)?.map(|text| Curves::parse(&text));
        if curves.is_none() {
            self.miss(file, holds, Some("the folder does not hold it; freeswing run writes it".to_owned()));
        }
        Ok(curves)
    }

    fn json<T: DeserializeOwned>(&mut self, file: &'static str, holds: &'static str) -> Result<Option<T>> {
        let Some(bytes) = self.bytes(file)? else {
            self.miss(file, holds, None);
            return Ok(None);
        };
        let broken = |e: serde_json::Error| Error::Left {
            path: self.path(file),
            line: Some(e.line()),
            message: "is no JSON, or only a part of it; remove it, or let its command write it again".to_owned(),
        };
        let value: serde_json::Value = serde_json::from_slice(&bytes).map_err(broken)?;
        match serde_json::from_value(value) {
            Ok(read) => Ok(Some(read)),
            Err(error) => {
                self.miss(file, holds, Some(format!("another version of this program wrote it ({error})")));
                Ok(None)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_log_tells_commands_warnings_and_the_last_error() {
        let log = Log::of(
            "$ track a.mp4\nwarning: dark\nfit: warning: dark\n$ freeswing fit\nerror: no\nerror: yes\n".into(),
        );
        assert_eq!(log.commands, ["track a.mp4", "freeswing fit"]);
        assert_eq!(log.warnings, ["dark"]);
        assert_eq!(log.error.as_deref(), Some("yes"));
    }

    #[test]
    fn fields_of_another_version_are_passed_over() {
        let mode: Mode = serde_json::from_str(r#"{"number": 1, "new": [], "frequency_hz": {"value": null}}"#).unwrap();
        assert!(mode.number == 1 && mode.frequency_hz.value.is_none());
    }
}
