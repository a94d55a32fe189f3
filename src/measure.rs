//! A recording → tracks and angles, with everything a reader of the table should know beside it.

use std::path::Path;

use crate::angles::{AngleSource, Angles, angles_from_tracks};
use crate::calibrate::Calibration;
use crate::detect::{Album, Blob, Detector, Hue};
use crate::error::{Error, Result};
use crate::experiment::{MarkColour, Rig};
use crate::progress::Progress;
use crate::track::{FrameBlobs, MarkSlot, Measured, Sighting, Tracker, Tracks};
use crate::video::{DamageSpread, Decoded, Frame, Orientation, Outcome, Recording, StillTimes, StreamInfo, Timing};

/// How a recording is measured.
#[derive(Debug, Clone)]
pub struct Options {
    /// One colour a mark, top to bottom.
    pub marks: Vec<MarkColour>,
    /// Mirror, pivot, plumb line, lens.
    pub rig: Rig,
    /// Threshold on the colour component, 0 to 255; chosen from the recording where absent.
    pub threshold: Option<f64>,
    /// Measured or smoothed positions.
    pub angle_source: AngleSource,
    /// The mean of the binary mask instead of the sub-pixel centroid, for comparison.
    pub binary_centroid: bool,
    /// When the stills of a folder were taken.
    pub still_times: StillTimes,
    /// Cores.
    pub workers: usize,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            marks: vec![MarkColour::red(); 3],
            rig: Rig::default(),
            threshold: None,
            angle_source: AngleSource::default(),
            binary_centroid: false,
            still_times: StillTimes::default(),
            workers: std::thread::available_parallelism().map_or(1, std::num::NonZero::get),
        }
    }
}

/// What came of a recording.
#[derive(Debug, Clone)]
pub struct Measurement {
    /// What the container says.
    pub stream: StreamInfo,
    /// What decoding met.
    pub decoded: Decoded,
    /// What the time stamps look like.
    pub timing: Timing,
    /// The hues with their thresholds.
    pub hues: Vec<Hue>,
    /// One track a mark.
    pub tracks: Tracks,
    /// One angle a link.
    pub angles: Angles,
}

impl Measurement {
    /// Time stamp of a frame.
    pub fn timing_at(&self, frame: usize) -> f64 {
        self.tracks.t_s.get(frame).copied().unwrap_or(self.timing.last_s)
    }
}

/// Pictures from which the thresholds are chosen.
const SAMPLE_PICTURES: usize = 8;

/// Measures a recording. Paths in the rig are relative to `folder`.
///
/// # Errors
/// Whatever makes the recording unusable; see [`Error`].
pub fn measure(path: &Path, options: &Options, folder: &Path, progress: &dyn Progress) -> Result<Measurement> {
    let mut recording = Recording::open(path, &options.still_times)?;
    let stream = recording.info().clone();
    let calibration = Calibration::new(&options.rig, stream.pixel_aspect, folder)?;
    let (hues, slots) = hues_of(&options.marks);
    let (hues, strongest) = calibrate_hues(&recording, hues, options.threshold)?;
    let detector = Detector::new(hues.clone());
    let mut tracker = Tracker::new(slots.clone(), options.rig.pivot_px);
    progress.begin("tracking", stream.stated_frames);
    let view = View { orientation: stream.orientation, size: stream.stored_size_px, binary: options.binary_centroid };
    let mut spread = DamageSpread::new(stream.delay_frames);
    let see = |frame: Frame<'_>| view.sightings(&detector, &frame);
    let decoded = recording.decode_in_order(options.workers, &see, &mut |outcome| {
        if progress.is_cancelled() {
            return Err(Error::Interrupted);
        }
        progress.advance(1);
        if let Some(certain) = spread.push(outcome?) {
            tracker.push(frame_blobs(certain));
        }
        Ok(())
    })?;
    spread.finish().for_each(|certain| tracker.push(frame_blobs(certain)));
    if decoded.frames == 0 {
        return Err(Error::NoFrames { path: path.to_owned(), packets: decoded.packets });
    }
    let (tracks, found) = tracker.finish();
    for (index, hue) in hues.iter().enumerate() {
        let seen = found.iter().filter(|f| usize::from(f.hue) == index && f.frames > 0).count();
        let colour = hue.colour.name.clone();
        if seen == 0 {
            let strongest = strongest[index];
            let (frames, threshold) = (decoded.frames, hue.threshold);
            return Err(Error::NoMarks { path: path.to_owned(), colour, frames, strongest, threshold });
        }
        if seen < hue.marks {
            return Err(Error::TooFewMarks { path: path.to_owned(), colour, found: seen, wanted: hue.marks });
        }
    }
    let angles = angles_from_tracks(&tracks, &calibration, options.rig.pivot_px, options.angle_source)?;
    let timing = Timing::audit(&tracks.t_s, stream.nominal_rate_hz, stream.tick_s);
    Ok(Measurement { stream, decoded, timing, hues, tracks, angles })
}

/// What was seen in a frame and when; nothing is measured in a damaged one.
fn frame_blobs(frame: Outcome<(f64, Vec<Sighting>)>) -> FrameBlobs {
    let (t_s, seen) = frame.value;
    FrameBlobs { t_s, damaged: frame.damaged, sightings: if frame.damaged { Vec::new() } else { seen } }
}

/// One hue for each distinct colour, and each mark's hue.
fn hues_of(marks: &[MarkColour]) -> (Vec<Hue>, Vec<MarkSlot>) {
    let mut hues: Vec<Hue> = Vec::new();
    let mut slots = Vec::new();
    for colour in marks {
        let index = hues.iter().position(|h| h.colour.rgb == colour.rgb).unwrap_or_else(|| {
            hues.push(Hue { colour: colour.clone(), ..Hue::default() });
            hues.len() - 1
        });
        hues[index].marks += 1;
        slots.push(MarkSlot { hue: index as u8 });
    }
    (hues, slots)
}

/// Looks at pictures spread over the recording and learns how each hue is found. Returns the strongest component of
/// each as well.
fn calibrate_hues(recording: &Recording, mut hues: Vec<Hue>, fixed: Option<f64>) -> Result<(Vec<Hue>, Vec<f64>)> {
    let mut album = Album::default();
    recording.sample(SAMPLE_PICTURES, &mut |frame| album.see(&frame.picture))?;
    album.compare();
    album.calibrate(&mut hues, fixed)?;
    let strongest = hues.iter().map(|hue| album.strongest(hue)).collect::<Result<_>>()?;
    Ok((hues, strongest))
}

/// From stored to displayed pixels.
struct View {
    orientation: Orientation,
    size: (usize, usize),
    binary: bool,
}

impl View {
    /// Time stamp and blobs of a frame, as displayed.
    fn sightings(&self, detector: &Detector, frame: &Frame<'_>) -> Result<Outcome<(f64, Vec<Sighting>)>> {
        let blobs = if frame.damaged { Vec::new() } else { detector.detect(&frame.picture)? };
        let sightings = blobs.iter().map(|b| self.sighting(b)).collect();
        Ok(Outcome { key: frame.key, damaged: frame.damaged, value: (frame.t_s, sightings) })
    }

    fn sighting(&self, blob: &Blob) -> Sighting {
        let c = &blob.centroid;
        let stored = if self.binary { blob.binary_px } else { [c.x_px, c.y_px] };
        let [xx, yy, xy] = c.variance_px2;
        let (right, down) = (self.orientation.turn([1.0, 0.0]), self.orientation.turn([0.0, 1.0]));
        let covariance = |i: usize, j: usize| {
            right[i] * right[j] * xx + down[i] * down[j] * yy + (right[i] * down[j] + down[i] * right[j]) * xy
        };
        Sighting {
            hue: blob.hue,
            measured: Measured {
                position_px: self.orientation.point(stored, self.size),
                covariance_px2: [covariance(0, 0), covariance(1, 1), covariance(0, 1)],
                area_px2: c.area_px2 as f32,
            },
            cut: c.cut,
        }
    }
}
