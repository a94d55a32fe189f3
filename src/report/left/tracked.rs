//! `angles.json`, as far as it is shown.

use serde::Deserialize;

use crate::video::Timing;

/// `angles.json`.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub struct Track {
    pub version: String,
    pub source: Source,
    pub options: TrackOptions,
    pub video: Video,
    pub time_stamps: Timing,
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

/// Noise of one angle.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub struct TrackedAngle {
    pub frames_measured: usize,
    pub noise_rad: Option<f64>,
}
