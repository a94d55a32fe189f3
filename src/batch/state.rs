//! What was finished: `run.json` in the folder of a recording, written last. A folder without it is not finished, whatever else it holds.

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::find::Found;
use super::layers;
use crate::digest;
use crate::error::{Error, Result};
use crate::output::OutputFile;

/// The file.
pub const FILE: &str = "run.json";

/// How a run ended.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Status {
    /// Every stage.
    Done,
    /// A stage ended with an error.
    Failed,
    /// It was not run.
    #[default]
    Skipped,
}

impl Status {
    /// As it stands in tables.
    pub fn id(self) -> &'static str {
        match self {
            Self::Done => "done",
            Self::Failed => "failed",
            Self::Skipped => "skipped",
        }
    }
}

/// What a result depends on.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Fingerprint {
    /// Of the recording: SHA-256 of a file; of stills that of all in order; of several tables that of their digests.
    pub recording_sha256: String,
    /// Of the experiment file, or of several put together; empty where there is none.
    pub config_sha256: String,
    /// What the run was asked for besides.
    pub words: Vec<String>,
    /// The program's.
    pub version: String,
}

/// A finished run.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Finished {
    /// `freeswing.run/1`.
    pub schema: String,
    /// Of what.
    pub fingerprint: Fingerprint,
    /// How it ended.
    pub status: Status,
    /// The line with which it failed; of one that is done what was left out of it.
    pub reason: String,
}

impl Fingerprint {
    /// Of a recording as it stands now.
    ///
    /// # Errors
    /// [`Error::Unreadable`], and what the experiment files report.
    pub fn of(found: &Found, words: &[String]) -> Result<Self> {
        let digest = |path: &std::path::PathBuf| Ok(digest::of_recording(path)?.0);
        let digests = found.paths.iter().map(digest).collect::<Result<Vec<String>>>()?;
        let config = layers::together(&found.configs)?.contents()?;
        Ok(Self {
            recording_sha256: match &digests[..] {
                [one] => one.clone(),
                several => digest::of_bytes(several.concat().as_bytes()),
            },
            config_sha256: if config.is_empty() { String::new() } else { digest::of_bytes(&config) },
            words: words.to_owned(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
        })
    }

    /// What differs, in words.
    pub fn changed_to(&self, now: &Self) -> String {
        if *self == Self::default() {
            return "it was ended from outside, or changed meanwhile".to_owned();
        }
        let version = format!("version {} did it", self.version);
        let differences = [
            (self.recording_sha256 != now.recording_sha256, "the recording has changed"),
            (self.config_sha256 != now.config_sha256, "its experiment file has changed"),
            (self.words != now.words, "other options were given"),
            (self.version != now.version, &version),
        ];
        differences.into_iter().filter_map(|(is, what)| is.then_some(what)).collect::<Vec<_>>().join(", ")
    }
}

/// What was finished in a folder; nothing where that cannot be read.
pub fn read(folder: &Path) -> Option<Finished> {
    let text = std::fs::read_to_string(folder.join(FILE)).ok()?;
    serde_json::from_str(&text).ok()
}

/// Writes that a run is finished.
///
/// # Errors
/// [`Error::Unwritable`].
pub fn write(folder: &Path, finished: &Finished) -> Result<()> {
    // strings serialise
    let text = serde_json::to_string_pretty(finished).unwrap_or_default() + "\n";
    OutputFile::create(&folder.join(FILE))?.commit(text.as_bytes())
}

/// From here on nothing in a folder is finished. A file of that name that says nothing of a run is another's.
///
/// # Errors
/// [`Error::Unwritable`].
pub fn forget(folder: &Path) -> Result<()> {
    if read(folder).is_none() {
        return Ok(());
    }
    let path = folder.join(FILE);
    std::fs::remove_file(&path).map_err(|e| Error::unwritable(&path, e))
}
