//! The overlay and the debug pictures show what was measured.

use std::path::{Path, PathBuf};

use freeswing::experiment::Experiment;
use freeswing::measure::{Measurement, Options, measure};
use freeswing::overlay::Overlay;
use freeswing::progress::Silent;
use freeswing::synth;
use freeswing::video::{Recording, StillTimes};

/// A short swing of the fixtures with jitter in its stamps.
fn small() -> Experiment {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/render/small.toml");
    let mut experiment = Experiment::read(&path).unwrap();
    experiment.render.duration_s = 0.5;
    experiment.render.jitter_s = 0.002;
    experiment
}

fn rendered(experiment: &Experiment, folder: &Path) -> PathBuf {
    let path = folder.join("swing.mp4");
    synth::Recording::of(experiment).unwrap().write(&path, None, &mut |_| Ok(())).unwrap();
    path
}

fn overlaid(source: &Path) -> (Measurement, PathBuf) {
    overlaid_below(source, None)
}

fn overlaid_below(source: &Path, most_bytes: Option<u64>) -> (Measurement, PathBuf) {
    let m = measure(source, &Options::default(), Path::new(""), &Silent).unwrap();
    let target = source.with_file_name("seen.mp4");
    let overlay =
        Overlay { tracks: &m.tracks, angles: &m.angles, pivot_px: None, rate_hz: m.timing.real_rate_hz, most_bytes };
    let recording = Recording::open(source, &StillTimes::Beside).unwrap();
    overlay.write(recording, &target, 2, &Silent).unwrap();
    (m, target)
}

/// Stamp of each frame, size, and samples bluer than the scene has any, around each of `marks_px`.
fn blue_near_marks(video: &Path, m: &Measurement) -> (Vec<f64>, Vec<Vec<usize>>) {
    let mut recording = Recording::open(video, &StillTimes::Beside).unwrap();
    let (mut stamps, mut blue) = (Vec::new(), Vec::new());
    let collect = |frame: freeswing::video::Frame<'_>| {
        let index = m.tracks.t_s.iter().position(|t| (t - frame.t_s).abs() < 2e-4).unwrap();
        let counts = m.tracks.marks.iter().map(|mark| {
            let [x, y] = mark[index].measured.unwrap().position_px;
            let layout = frame.picture.layout;
            let (cx, cy) = layout.luma_to_chroma(x, y);
            let (width, height) = layout.chroma_size();
            let near = |c: f64, side: usize| (c as usize).saturating_sub(8)..(c as usize + 9).min(side);
            let cells = near(cy, height).flat_map(|y| near(cx, width).map(move |x| (x, y)));
            cells.filter(|(x, y)| frame.picture.chroma(*x, *y).0 > 0.08).count()
        });
        (frame.t_s, counts.collect::<Vec<usize>>())
    };
    let mut sink = |(t_s, counts)| {
        stamps.push(t_s);
        blue.push(counts);
        Ok(())
    };
    recording.decode_in_order(1, &collect, &mut sink).unwrap();
    (stamps, blue)
}

#[test]
fn every_frame_keeps_its_stamp_and_has_a_blue_rectangle_around_each_mark() {
    let folder = tempfile::tempdir().unwrap();
    let source = rendered(&small(), folder.path());
    let (m, target) = overlaid(&source);
    let (stamps, blue) = blue_near_marks(&target, &m);
    assert_eq!(stamps.len(), m.tracks.t_s.len());
    for (a, b) in stamps.iter().zip(&m.tracks.t_s) {
        assert!((a - b).abs() < 1e-5, "{a} {b}");
    }
    for (frame, counts) in blue.iter().enumerate() {
        assert!(counts.iter().all(|n| *n >= 6), "frame {frame}: {counts:?}");
    }
    let (_, bare) = blue_near_marks(&source, &m);
    assert!(bare.iter().flatten().all(|n| *n == 0), "the scene itself has no blue");
    let left: Vec<_> = std::fs::read_dir(folder.path()).unwrap().collect();
    assert_eq!(left.len(), 2, "no temporary file stays: {left:?}");
}

#[test]
fn an_overlay_that_must_be_small_has_smaller_pictures_and_every_stamp() {
    let folder = tempfile::tempdir().unwrap();
    let mut experiment = small();
    experiment.render.duration_s = 4.0;
    let source = rendered(&experiment, folder.path());
    let (m, large) = overlaid_below(&source, None);
    let [size, bytes] = [width(&large), std::fs::metadata(&large).unwrap().len() as usize];
    let most = bytes as u64 / 5;
    let (_, target) = overlaid_below(&source, Some(most));
    let small = std::fs::metadata(&target).unwrap().len();
    assert!(
        small < most * 13 / 10 && width(&target) <= size,
        "{small} bytes of {most}, {} px of {size}",
        width(&target)
    );
    let (stamps, _) = blue_near_marks(&target, &m);
    assert_eq!(stamps.len(), m.tracks.t_s.len());
}

fn width(video: &Path) -> usize {
    Recording::open(video, &StillTimes::Beside).unwrap().info().stored_size_px.0
}

#[test]
fn a_turned_recording_is_drawn_as_it_is_displayed() {
    let folder = tempfile::tempdir().unwrap();
    let mut experiment = small();
    experiment.render.codec.rotation_deg = 90;
    let source = rendered(&experiment, folder.path());
    let (m, target) = overlaid(&source);
    let seen = Recording::open(&target, &StillTimes::Beside).unwrap();
    assert_eq!(seen.info().stored_size_px, (240, 320));
    let (_, blue) = blue_near_marks(&target, &m);
    assert!(blue.iter().flatten().all(|n| *n >= 6), "{blue:?}");
}

#[test]
fn the_command_writes_overlay_and_debug_pictures() {
    let folder = tempfile::tempdir().unwrap();
    let source = rendered(&small(), folder.path());
    let debug = folder.path().join("steps/here");
    let mut command = assert_cmd::Command::cargo_bin("track").unwrap();
    command.arg(&source).arg("--out").arg(folder.path().join("angles.csv"));
    command.arg("--overlay").arg(folder.path().join("seen.mp4"));
    command.arg("--debug-frames").arg(&debug).args(["--debug-count", "3", "--quiet"]);
    command.assert().success();
    assert!(folder.path().join("seen.mp4").is_file());
    let mut names: Vec<String> =
        std::fs::read_dir(&debug).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    let steps = ["1_picture", "2_component", "3_binary", "4_marks"];
    let wanted: Vec<String> = [2, 7, 12].iter().flat_map(|n| steps.map(|step| format!("{n:05}_{step}.png"))).collect();
    assert_eq!(names, wanted);
    let binary = image::open(debug.join("00007_3_binary.png")).unwrap().into_luma8();
    let white = binary.pixels().filter(|p| p.0[0] == 255).count();
    // three discs of 12 px
    assert!((200..900).contains(&white), "{white}");
}

#[test]
fn a_target_that_cannot_be_written_is_said_before_any_work() {
    let folder = tempfile::tempdir().unwrap();
    let source = folder.path().join("swing.mp4");
    let table = folder.path().join("angles.csv");
    for (option, target, message) in [
        ("--overlay", "nowhere/seen.mp4", "cannot be written"),
        ("--overlay", "seen.gif", "unknown extension .gif"),
        ("--debug-frames", "angles.txt/steps", "cannot be written"),
    ] {
        std::fs::write(folder.path().join("angles.txt"), "a file, not a folder").unwrap();
        let mut command = assert_cmd::Command::cargo_bin("track").unwrap();
        command.arg(&source).arg("--out").arg(&table).arg(option).arg(folder.path().join(target));
        command.assert().code(2).stderr(predicates::str::contains(message)).stderr(predicates::str::contains(target));
        assert!(!table.exists());
    }
}
