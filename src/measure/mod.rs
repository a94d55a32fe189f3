//! A recording → tracks and angles, with everything a reader of the table should know beside it.

mod glance;
mod survey;
mod trials;
mod view;

use std::path::{Path, PathBuf};

use crate::angles::{AngleSource, Angles, angles_from_tracks};
use crate::area::Area;
use crate::calibrate::Calibration;
use crate::detect::{Album, Detector, Hue, Siting};
use crate::error::{Error, Result};
use crate::experiment::{MarkColour, Rig};
use crate::progress::Progress;
use crate::rejected::Rejected;
use crate::steady::{Background, CameraShift};
use crate::track::{FrameBlobs, MarkSlot, TrackedObject, Tracker, Tracks};
use crate::video::{DamageSpread, Decoded, Outcome, OwnedPicture, Recording, StillTimes, StreamInfo, Timing};
use survey::SurveyedCamera;
use view::{Seen, View, Watch, frame_blobs};

/// Whether the camera's own motion is taken out.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Steadying {
    /// Where the pictures show that the camera moves, or reference marks are named.
    #[default]
    WhereNeeded,
    /// Always.
    Always,
    /// Never.
    Never,
}

/// How a recording is measured.
#[derive(Debug, Clone)]
pub struct Options {
    /// One colour a mark, top to bottom.
    pub marks: Vec<MarkColour>,
    /// There may be more or fewer, all of the first one's colour: as many as hang together and swing.
    pub count_marks: bool,
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
    /// Whether the camera's own motion is taken out.
    pub steadying: Steadying,
    /// Cores.
    pub workers: usize,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            marks: vec![MarkColour::red(); 3],
            count_marks: false,
            rig: Rig::default(),
            threshold: None,
            angle_source: AngleSource::default(),
            binary_centroid: false,
            still_times: StillTimes::default(),
            steadying: Steadying::default(),
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
    /// One colour a mark, top to bottom.
    pub marks: Vec<MarkColour>,
    /// One track a mark.
    pub tracks: Tracks,
    /// One angle a link.
    pub angles: Angles,
    /// The stamps of the rows as they stand in the file, where `true_rate_hz` makes them others.
    pub file_t_s: Vec<f64>,
    /// Seconds of the recording's own time in a second of the file's.
    pub time_scale: f64,
    /// How far the camera moved.
    pub camera: Camera,
    /// Where the chroma samples lie.
    pub siting: Option<Siting>,
}

/// What is known of the camera's own motion.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Camera {
    /// Greatest shift, px, that two of the pictures looked at beforehand show or, where it is taken out, in any frame.
    pub greatest_shift_px: f64,
    /// The pictures looked at beforehand tell whether it moves.
    pub is_told: bool,
    /// It is taken out of the marks' positions.
    pub taken_out: bool,
    /// Frames in which too little of the background was found again; nothing is measured in them.
    pub lost_frames: usize,
    /// Usual number of background patches that agree.
    pub patches: usize,
    /// Root mean square of the shift's own standard deviation.
    pub sd_px: f64,
}

impl Measurement {
    /// Time stamp of a frame.
    pub fn timing_at(&self, frame: usize) -> f64 {
        self.tracks.t_s.get(frame).copied().unwrap_or(self.timing.last_s)
    }
}

/// Measures a recording. Paths in the rig are relative to `folder`.
///
/// # Errors
/// Whatever makes the recording unusable; see [`Error`].
pub fn measure(path: &Path, options: &Options, folder: &Path, progress: &dyn Progress) -> Result<Measurement> {
    Session::open(path, options, folder, progress)?.run(progress)
}

/// Frames in which the camera is watched where it seems to stand still (cost: each takes as long as some ten frames).
const WATCHED: u32 = 8;
/// Pictures that tell whether a thing makes a difference where it is, at least (judgement: of one or two chance decides).
const FEWEST_TELLING: usize = 3;
/// So many points around a thing are looked at, so far from its middle in its radii (judgement: what it is painted on reaches so far beyond it).
const AROUND: u32 = 8;
const OUTSIDE: f64 = 1.5;

/// A recording that is about to be measured: what is sought is known.
pub struct Session<'a> {
    path: PathBuf,
    options: &'a Options,
    recording: Recording,
    stream: StreamInfo,
    calibration: Calibration,
    area: Area,
    album: Album,
    /// Stamps of its pictures.
    sampled_s: Vec<f64>,
    /// Its pictures, where it is not known yet what is sought.
    pictures: Vec<OwnedPicture>,
    hues: Vec<Hue>,
    /// It knows what the pictures show of all marks.
    detector: Detector,
    slots: Vec<MarkSlot>,
    background: Option<Background>,
    /// Against what the camera is watched, as long as nothing is taken out.
    watch: Option<Background>,
    /// The camera stands still.
    still: bool,
    /// As the pictures looked at beforehand show it.
    first_camera: Camera,
    camera: Camera,
    /// Where the camera looked in the frames in which it was watched.
    watched: Vec<CameraShift>,
    stamps_s: Vec<f64>,
}

impl<'a> Session<'a> {
    /// Looks at pictures spread over the recording and learns how each hue is found, and whether the camera moves.
    ///
    /// # Errors
    /// As [`measure`].
    pub fn open(path: &Path, options: &'a Options, folder: &Path, progress: &dyn Progress) -> Result<Self> {
        let recording = Recording::open(path, &options.still_times)?;
        let stream = recording.info().clone();
        let calibration = Calibration::new(&options.rig, stream.pixel_aspect, folder)?;
        let area = Area::new(&options.rig, folder, stream.orientation.size(stream.stored_size_px))?;
        let (mut hues, slots) = hues_of(&options.marks);
        let (pictures, sampled_s) = survey::pictures(&recording, &options.rig)?;
        let mut album = survey::album(&pictures, &area, stream.orientation);
        let sought = hues.clone();
        let marks = || album.calibrate(&mut hues, options.threshold);
        let (trials, surveyed) = rayon::join(marks, || survey::camera(&pictures, options, &stream));
        let mut trials = trials?;
        let SurveyedCamera { background, camera, watch, still, shifts } = surveyed;
        if options.steadying == Steadying::Always && !camera.taken_out {
            return Err(nothing_steady());
        }
        if album.steady(shifts) {
            hues = sought;
            trials = album.calibrate(&mut hues, options.threshold)?;
        }
        let (path, stamps_s) = (path.to_owned(), Vec::new());
        let mut session = Self {
            path,
            options,
            recording,
            stream,
            calibration,
            area,
            album,
            sampled_s,
            pictures,
            hues,
            detector: Detector::new(Vec::new()),
            slots,
            background,
            watch,
            still,
            first_camera: camera,
            camera,
            watched: Vec::new(),
            stamps_s,
        };
        if !session.hues.is_empty() {
            if options.threshold.is_none() || options.count_marks {
                session.settle(&trials, false, progress)?;
            }
            session.survey_light()?;
        }
        Ok(session)
    }

    /// Shading of the marks, siting of the chroma and what lies behind, from pictures that are not needed any more.
    fn survey_light(&mut self) -> Result<()> {
        self.detector = survey::detector(&self.pictures, self.hues.clone(), self.still)?;
        self.hues = self.detector.hues().to_vec();
        self.pictures.clear();
        Ok(())
    }

    /// What is sought.
    pub fn hues(&self) -> &[Hue] {
        &self.hues
    }

    /// Stamps of the frames measured so far, as they stand in the file.
    pub fn stamps_s(&self) -> &[f64] {
        &self.stamps_s
    }

    /// Pictures spread over the recording.
    pub fn album(&self) -> &Album {
        &self.album
    }

    /// Their stamps.
    pub fn sampled_s(&self) -> &[f64] {
        &self.sampled_s
    }

    /// Whether a thing, whose path goes through frames of these stamps, makes a difference where it is: in most of the pictures spread over the recording, against those
    /// that show it elsewhere. What is still there, and only covered now and then, does not. A mark as dark as the wall behind it makes one by what it is painted on:
    /// around it. `None` where no pictures tell.
    pub fn makes_a_difference(&self, t_s: &[f64], thing: &TrackedObject) -> Option<bool> {
        let stream = &self.stream;
        let of_picture = |stamp_s: &f64| thing.path[t_s.iter().position(|t| t == stamp_s)?];
        let places: Vec<Option<[f64; 2]>> = self.sampled_s.iter().map(of_picture).collect();
        let makes_one = |(picture, place): (usize, &Option<[f64; 2]>)| {
            let [x, y] = (*place)?;
            let is_elsewhere = |other: &[f64; 2]| (other[0] - x).hypot(other[1] - y) > 2.0 * thing.radius_px();
            let others: Vec<usize> =
                (0..places.len()).filter(|k| places[*k].as_ref().is_some_and(is_elsewhere)).collect();
            let differs = |[x, y]: [f64; 2]| {
                let stored_px = stream.orientation.stored_point([x / stream.pixel_aspect, y], stream.stored_size_px);
                self.album.differs(picture, stored_px, &others)
            };
            let around = (0..AROUND).map(|k| {
                let (sin, cos) = (std::f64::consts::TAU * f64::from(k) / f64::from(AROUND)).sin_cos();
                [cos, sin].map(|part| OUTSIDE * thing.radius_px() * part)
            });
            let of_what_moves = || {
                let seen: Vec<bool> = around.filter_map(|[dx, dy]| differs([x + dx, y + dy])).collect();
                2 * seen.iter().filter(|own| **own).count() > seen.len()
            };
            differs([x, y]).map(|own| own || of_what_moves())
        };
        let seen: Vec<bool> = places.iter().enumerate().filter_map(makes_one).collect();
        let told = !self.camera.taken_out || !self.album.camera.is_empty();
        (seen.len() >= FEWEST_TELLING && told).then(|| 2 * seen.iter().filter(|own| **own).count() >= seen.len())
    }

    /// Its stream.
    pub fn stream(&self) -> &StreamInfo {
        &self.stream
    }

    /// What is known of the camera's motion.
    pub fn camera(&self) -> Camera {
        self.camera
    }

    /// Measures every frame. Where that shows no marks, it is done once more in the way that shows something that swings.
    ///
    /// # Errors
    /// As [`measure`].
    pub fn run(&mut self, progress: &dyn Progress) -> Result<Measurement> {
        match self.attempt(progress) {
            Err(refusal @ Error::NoMarks { .. }) if self.seek_otherwise(progress)? => match self.attempt(progress) {
                Err(Error::NoMarks { .. }) => Err(refusal),
                result => result,
            },
            result => result,
        }
    }

    fn attempt(&mut self, progress: &dyn Progress) -> Result<Measurement> {
        self.rewind()?;
        let mut tracker = Tracker::new(self.slots.clone(), self.options.rig.pivot_px);
        let detector = self.detector.clone();
        let decoded = self.each_frame(&detector, progress, &mut |frame| tracker.push(frame))?;
        if self.takes_out_what_was_watched() {
            return self.attempt(progress);
        }
        progress.begin("angles", None);
        self.conclude(decoded, tracker)
    }

    /// Whether the camera has moved in the frames just seen though the pictures looked at beforehand did not show it, as after a knock in the middle: from now on its motion is
    /// taken out.
    fn takes_out_what_was_watched(&mut self) -> bool {
        let watched = std::mem::take(&mut self.watched);
        if !survey::moves(survey::greatest_px(watched.iter()), watched.len()) {
            return false;
        }
        self.background = self.watch.take();
        self.first_camera.taken_out = self.background.is_some();
        self.first_camera.taken_out
    }

    /// Everything of these hues in every frame. May be called again.
    ///
    /// # Errors
    /// As [`measure`].
    pub fn gather(&mut self, hues: Vec<Hue>, progress: &dyn Progress) -> Result<Vec<FrameBlobs>> {
        self.rewind()?;
        let detector = if self.detector.hues() == hues {
            self.detector.clone()
        } else {
            survey::detector(&self.pictures, hues, self.still)?
        };
        let mut frames = Vec::new();
        self.each_frame(&detector, progress, &mut |frame| frames.push(frame))?;
        if self.takes_out_what_was_watched() {
            frames.clear();
            self.rewind()?;
            self.each_frame(&detector, progress, &mut |frame| frames.push(frame))?;
        }
        self.camera.finish(self.stamps_s.len());
        Ok(frames)
    }

    /// To the first frame again, if any was decoded.
    fn rewind(&mut self) -> Result<()> {
        if !self.stamps_s.is_empty() {
            self.recording = Recording::open(&self.path, &self.options.still_times)?;
            self.stamps_s.clear();
            self.camera = self.first_camera;
        }
        Ok(())
    }

    fn each_frame(
        &mut self,
        detector: &Detector,
        progress: &dyn Progress,
        sink: &mut dyn FnMut(FrameBlobs),
    ) -> Result<Decoded> {
        progress.begin("tracking", self.stream.stated_frames);
        let frames_and_rate = self.stream.stated_frames.zip(self.stream.nominal_rate_hz);
        let watch = self.watch.as_ref().zip(frames_and_rate).map(|(background, (frames, rate_hz))| {
            let every_s = (frames as f64 / f64::from(WATCHED)).max(1.0) / rate_hz;
            Watch { background, every_s, step_s: 1.0 / rate_hz }
        });
        let view = View { watch, ..View::of(&self.stream, self.options, &self.area, self.background.as_ref()) };
        let mut spread = DamageSpread::new(self.stream.delay_frames);
        let (stamps_s, camera, watched) = (&mut self.stamps_s, &mut self.camera, &mut self.watched);
        let mut take = |frame: Outcome<Seen>| {
            if frame.value.outside {
                return;
            }
            stamps_s.push(frame.value.t_s);
            camera.note(&frame.value);
            watched.extend(frame.value.watched);
            sink(frame_blobs(frame));
        };
        let decoded =
            self.recording.decode_in_order(self.options.workers, &|f| view.look(detector, &f), &mut |outcome| {
                if progress.is_cancelled() {
                    return Err(Error::Interrupted);
                }
                progress.advance(1);
                spread.push(outcome?).into_iter().for_each(&mut take);
                Ok(())
            })?;
        spread.finish().for_each(&mut take);
        Ok(decoded)
    }

    fn conclude(&mut self, decoded: Decoded, tracker: Tracker) -> Result<Measurement> {
        if decoded.frames == 0 {
            return Err(Error::NoFrames { path: self.path.clone(), packets: decoded.packets });
        }
        if self.stamps_s.is_empty() {
            let message = format!("no frame lies between --from and --until; the file holds {} frames", decoded.frames);
            return Err(Error::Option { option: "--from".to_owned(), message });
        }
        if self.camera.lost_frames == self.stamps_s.len() {
            return Err(nothing_steady());
        }
        let (mut tracks, found) = tracker.finish();
        let (rig, frames) = (&self.options.rig, self.stamps_s.len() as u64);
        let rejected = Rejected { path: &self.path, album: &self.album, hues: &self.hues, frames, rig };
        rejected.check(&found, &tracks)?;
        let file_t_s = tracks.t_s.clone();
        let file_timing = Timing::audit(&file_t_s, self.stream.nominal_rate_hz, self.stream.tick_s);
        let time_scale = match (rig.true_rate_hz, file_timing.real_rate_hz) {
            (Some(true_hz), Some(file_hz)) => file_hz / true_hz,
            _ => 1.0,
        };
        tracks.scale_time(time_scale);
        let nominal_hz = rig.true_rate_hz.or(self.stream.nominal_rate_hz);
        let timing = Timing::audit(&tracks.t_s, nominal_hz, self.stream.tick_s * time_scale);
        let angles = angles_from_tracks(&tracks, &self.calibration, rig.pivot_px, self.options.angle_source)?;
        self.camera.finish(self.stamps_s.len());
        let (stream, hues, camera) = (self.stream.clone(), self.hues.clone(), self.camera);
        let siting = self.detector.siting();
        let marks = self.slots.iter().map(|slot| hues[usize::from(slot.hue)].colour.clone()).collect();
        Ok(Measurement { stream, decoded, timing, hues, marks, tracks, angles, file_t_s, time_scale, camera, siting })
    }
}

/// The camera's motion cannot be taken out.
fn nothing_steady() -> Error {
    let message = "too little of what stands still has clear edges to tell where the camera looks; name corners or dots on it with --reference, or leave the option out".to_owned();
    Error::Option { option: "--steady always".to_owned(), message }
}

impl Camera {
    /// Sums up what a frame shows; [`Camera::finish`] makes means of the sums.
    fn note(&mut self, seen: &Seen) {
        match seen.camera {
            Some(camera) => {
                self.greatest_shift_px = self.greatest_shift_px.max(camera.size_px());
                self.patches += camera.patches;
                self.sd_px += camera.sd_px().powi(2);
            }
            None if self.taken_out => self.lost_frames += 1,
            None => {}
        }
    }

    fn finish(&mut self, frames: usize) {
        let n = frames.saturating_sub(self.lost_frames).max(1);
        self.patches /= n;
        self.sd_px = (self.sd_px / n as f64).sqrt();
    }
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
