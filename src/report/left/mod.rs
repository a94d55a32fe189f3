//! What a run left in its folder, read back: each part if it is there, and if not, why.
//!
//! Of the JSON files only the fields that the page shows are read. A field that is absent leaves its line out, a file of another format its part.

mod diagnosed;
mod fitted;
mod identified;
mod tracked;

use std::path::{Path, PathBuf};

use serde::Deserialize;
use serde::de::DeserializeOwned;

use super::curves::Curves;
use crate::digest;
use crate::error::{Error, Result};
use crate::series::AngleSeries;

pub use diagnosed::{Candidate, Diagnosed, HeldOut, Law, Remainder, Verdict};
pub use fitted::{FitSide, Fitted, FittedRecording};
pub use identified::{Estimator, Identified, Mode, Step};
pub use tracked::Track;

/// Why most parts are missing.
const NOT_HELD: &str = "the folder does not hold it";
/// What a run of several recordings together does not leave.
const OF_ONE_RECORDING: [&str; 4] = ["angles.csv", "angles.json", "identify.json", "overlay.mp4"];

/// A report of a stage from a folder, of which single values are wanted; nothing where there is none, or none that can be read.
pub fn report_of<T: DeserializeOwned>(path: &Path) -> Option<T> {
    serde_json::from_slice(&std::fs::read(path).ok()?).ok()
}

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

impl Interval {
    /// Half of its width.
    pub fn half(&self) -> Option<f64> {
        Some(0.5 * (self.high? - self.low?))
    }
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
            // where there are angles, no error kept it from being drawn
            let why = left.angles.as_ref().map(|_| NOT_HELD.to_owned());
            left.miss("overlay.mp4", "the recording with the marks drawn in", why);
        }
        if !left.together().is_empty() {
            // each has its own page
            left.missing.retain(|part| !OF_ONE_RECORDING.contains(&part.file));
        }
        let known = left.angles.is_some() || left.track.is_some() || left.identified.is_some();
        if !(known || left.fit.is_some() || left.diagnosis.is_some() || left.log.is_some()) {
            let message = "holds nothing that a run leaves (angles.csv, identify.json, fit.json, diagnosis.json, log.txt); give the folder \
                           of `freeswing run --out`, or that of one recording of a batch";
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

    /// The error that stopped the run.
    pub fn stopped(&self) -> Option<&str> {
        self.log.as_ref()?.error.as_deref()
    }

    /// The tables of several recordings that were fitted together; none of a run of one.
    pub fn together(&self) -> Vec<&str> {
        let files: Vec<&str> = self.fit.iter().flat_map(|fit| &fit.recordings).map(|own| own.file.as_str()).collect();
        if files.len() > 1 { files } else { Vec::new() }
    }

    fn miss(&mut self, file: &'static str, holds: &'static str, why: Option<String>) {
        let stopped = self.stopped().map(|_| "the run stopped before it".to_owned());
        let why = why.or(stopped).unwrap_or_else(|| NOT_HELD.to_owned());
        self.missing.push(Missing { file, holds, why });
    }

    /// The bytes of a file that may be absent; its digest is kept.
    fn bytes(&mut self, name: &str) -> Result<Option<Vec<u8>>> {
        let path = self.path(name);
        match std::fs::read(&path) {
            Ok(bytes) => {
                self.digests.push((name.to_owned(), digest::of_bytes(&bytes)));
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
