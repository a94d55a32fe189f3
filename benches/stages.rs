//! How fast each stage of `track` is: decode, detect, track, angles and their table.

use std::path::Path;

use divan::Bencher;
use divan::counter::{BytesCount, ItemsCount};
use freeswing::angles::{AngleSource, angles_from_tracks, to_csv};
use freeswing::calibrate::Calibration;
use freeswing::detect::{Detector, Hue};
use freeswing::experiment::{Experiment, MarkColour, Rig};
use freeswing::synth::Recording;
use freeswing::track::{FrameBlobs, MarkSlot, Measured, Sighting, Tracker, Tracks};
use freeswing::video::{Container, Frame, OwnedPicture, decode_in_order};

fn main() {
    divan::main();
}

/// Half a minute at 100 frames a second.
const FRAMES: usize = 3000;

fn recording(duration_s: f64, scale: f64) -> Recording {
    let mut experiment = Experiment::default();
    let render = &mut experiment.render;
    render.duration_s = duration_s;
    (render.width_px, render.height_px) = ((1280.0 * scale) as u32, (720.0 * scale) as u32);
    render.scale_px_per_m *= scale;
    render.hinge_px = render.hinge_px.map(|c| c * scale);
    render.mark_diameter_px *= scale;
    render.strip_width_px *= scale;
    Recording::of(&experiment).expect("the default experiment renders")
}

/// Every frame of a 25 s recording at 1280×720.
#[divan::bench(args = [1, 2, 4], sample_count = 5)]
fn decode(bencher: Bencher, workers: usize) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("videos/kapton.mp4");
    bencher.counter(ItemsCount::new(750usize)).bench_local(|| {
        let mut container = Container::open(&path).expect("the project's recording opens");
        let frame_time = |frame: Frame<'_>| frame.t_s;
        decode_in_order(&mut container, workers, &frame_time, &mut |_| Ok(())).expect("it decodes")
    });
}

/// One picture of 1280×720 times `scale`.
#[divan::bench(args = [1.0, 1.5])]
fn detect(bencher: Bencher, scale: f64) {
    let recording = recording(1.0, scale);
    let pictures: Vec<OwnedPicture> = (0..8).map(|i| recording.frame(i).picture).collect();
    let hue = Hue { colour: MarkColour::red(), marks: 3, threshold: 60.0, ..Hue::default() };
    let detector = Detector::new(vec![hue]);
    let mut next = 0;
    bencher.counter(ItemsCount::new(1usize)).bench_local(|| {
        next = (next + 1) % pictures.len();
        detector.detect(&pictures[next].view()).expect("it is searched")
    });
}

/// What a perfect detector would see: three marks and a knob that stands still.
fn sightings() -> Vec<FrameBlobs> {
    let mut experiment = Experiment::default();
    (experiment.render.fps, experiment.render.duration_s) = (100.0, FRAMES as f64 / 100.0);
    let recording = Recording::of(&experiment).expect("the default experiment swings");
    let seen = |position_px| Sighting {
        hue: 0,
        measured: Measured { position_px, covariance_px2: [4e-4, 4e-4, 0.0], area_px2: 380.0 },
        cut: false,
    };
    let frame = |i: usize| {
        let truth = recording.truth(i);
        let sightings = truth.marks_px.iter().copied().chain([[716.0, 40.0]]).map(seen).collect();
        FrameBlobs { t_s: truth.t_s, damaged: false, sightings }
    };
    (0..FRAMES).map(frame).collect()
}

fn tracks_of(frames: Vec<FrameBlobs>) -> Tracks {
    let mut tracker = Tracker::new(vec![MarkSlot { hue: 0 }; 3], None);
    frames.into_iter().for_each(|frame| tracker.push(frame));
    tracker.finish().0
}

/// Assignment, Kalman filter and noise of 3000 frames.
#[divan::bench(sample_count = 20)]
fn track(bencher: Bencher) {
    let frames = sightings();
    bencher.counter(ItemsCount::new(FRAMES)).with_inputs(|| frames.clone()).bench_local_values(tracks_of);
}

/// Angles of 3000 frames.
#[divan::bench]
fn angles(bencher: Bencher) {
    let tracks = tracks_of(sightings());
    let calibration = Calibration::new(&Rig::default(), 1.0, Path::new("")).expect("no file is read");
    bencher
        .counter(ItemsCount::new(FRAMES))
        .bench_local(|| angles_from_tracks(&tracks, &calibration, None, AngleSource::Measured).expect("they exist"));
}

/// `angles.csv` of 3000 frames.
#[divan::bench]
fn table(bencher: Bencher) {
    let tracks = tracks_of(sightings());
    let calibration = Calibration::new(&Rig::default(), 1.0, Path::new("")).expect("no file is read");
    let angles = angles_from_tracks(&tracks, &calibration, None, AngleSource::Measured).expect("they exist");
    let bytes = to_csv(&tracks, &angles).len();
    bencher.counter(BytesCount::new(bytes)).bench_local(|| to_csv(&tracks, &angles));
}
