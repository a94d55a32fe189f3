//! `angles.json`, as far as it is shown.

use serde::Deserialize;

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
