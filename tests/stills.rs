//! A folder of stills is measured like a video.

use std::path::Path;

use freeswing::experiment::{Experiment, PixelFormat};
use freeswing::measure::{Options, measure};
use freeswing::progress::Silent;
use freeswing::synth::{Recording, SynthFrame, Truth};
use freeswing::video::{Picture, StillTimes};
use image::{Rgb, RgbImage};

/// Renders a short swing into stills of the given ending, numbered without padding; returns the truth.
fn stills(folder: &Path, ending: &str) -> Vec<Truth> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/render/small.toml");
    let mut experiment = Experiment::read(&path).unwrap();
    experiment.render.duration_s = 0.4;
    experiment.render.jitter_s = 0.002;
    experiment.render.codec.pixel_format = PixelFormat::Yuv444p;
    let mut truth = Vec::new();
    for SynthFrame { picture, truth: t } in Recording::of(&experiment).unwrap().frames() {
        rgb(&picture.view()).save(folder.join(format!("f{}.{ending}", truth.len()))).unwrap();
        truth.push(t);
    }
    truth
}

fn rgb(picture: &Picture<'_>) -> RgbImage {
    let layout = picture.layout;
    RgbImage::from_fn(layout.width_px as u32, layout.height_px as u32, |x, y| {
        let (x, y) = (x as usize, y as usize);
        let (cb, cr) = picture.chroma(x, y);
        Rgb(layout.matrix.rgb([picture.y(x, y), cb, cr]).map(|v| (255.0 * v).round().clamp(0.0, 255.0) as u8))
    })
}

fn write_times(folder: &Path, truth: &[Truth]) {
    let rows: String = truth.iter().map(|t| format!("f{}.png,{:.6}\n", t.frame, t.t_s)).collect();
    std::fs::write(folder.join("times.csv"), format!("file,t_s\n{rows}")).unwrap();
}

#[test]
fn stills_give_the_angles_of_the_truth_at_the_times_beside_them() {
    let folder = tempfile::tempdir().unwrap();
    let truth = stills(folder.path(), "png");
    write_times(folder.path(), &truth);
    let one = measure(folder.path(), &Options { workers: 1, ..Options::default() }, Path::new(""), &Silent).unwrap();
    assert_eq!((one.stream.container.as_str(), one.stream.codec.as_str()), ("stills", "png"));
    assert_eq!(one.tracks.t_s.len(), truth.len());
    let mut worst: f64 = 0.0;
    for (i, t) in truth.iter().enumerate() {
        assert!((one.tracks.t_s[i] - t.t_s).abs() < 1e-6);
        for (link, theta) in one.angles.links.iter().zip(&t.theta_rad) {
            let measured = link[i].unwrap().theta_rad;
            worst = worst.max((measured - theta).abs());
            assert!((measured - theta).abs() < 0.006, "still {i}: {measured} {theta}");
        }
    }
    println!("worst angle error {worst:.5} rad");
    let many = measure(folder.path(), &Options { workers: 3, ..Options::default() }, Path::new(""), &Silent).unwrap();
    assert_eq!(
        (one.tracks.marks, one.angles),
        (many.tracks.marks, many.angles),
        "serial and parallel agree to the bit"
    );
}

#[test]
fn jpeg_and_bmp_stills_are_measured_at_a_rate() {
    for ending in ["jpg", "bmp"] {
        let folder = tempfile::tempdir().unwrap();
        let truth = stills(folder.path(), ending);
        let options = Options { still_times: StillTimes::Rate(50.0), ..Options::default() };
        let m = measure(folder.path(), &options, Path::new(""), &Silent).unwrap();
        assert_eq!(m.tracks.t_s[3], 0.06);
        let worst =
            truth.iter().enumerate().map(|(i, t)| (m.angles.links[0][i].unwrap().theta_rad - t.theta_rad[0]).abs());
        assert!(worst.fold(0.0, f64::max) < 0.02, "{ending}");
    }
}

#[test]
fn a_damaged_still_is_flagged_and_one_of_another_size_left_out() {
    let folder = tempfile::tempdir().unwrap();
    let truth = stills(folder.path(), "png");
    write_times(folder.path(), &truth);
    std::fs::write(folder.path().join("f4.png"), b"not a picture").unwrap();
    RgbImage::new(64, 64).save(folder.path().join("f6.png")).unwrap();
    let table = folder.path().join("angles.csv");
    let mut command = assert_cmd::Command::cargo_bin("track").unwrap();
    command.arg(folder.path()).arg("--out").arg(&table).arg("--overlay").arg(folder.path().join("seen.mp4"));
    command
        .assert()
        .success()
        .stderr(predicates::str::contains("the stills are damaged: 1 stills refused, 1 frames not measured"))
        .stderr(predicates::str::contains("1 stills have another size"));
    let text = std::fs::read_to_string(&table).unwrap();
    assert_eq!(text.lines().count(), truth.len(), "a header, and one still left out");
    assert!(text.lines().nth(5).unwrap().contains("damaged"));
    let beside = std::fs::read_to_string(folder.path().join("angles.json")).unwrap();
    assert!(beside.contains("the bytes of the stills, one after the other in order"));
}

#[test]
fn stills_without_times_and_videos_with_them_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let table = folder.path().join("angles.csv");
    let track = |more: &[&str], message: &str| {
        let mut command = assert_cmd::Command::cargo_bin("track").unwrap();
        command.arg(folder.path()).arg("--out").arg(&table).args(more);
        command.assert().code(2).stderr(predicates::str::contains(message));
        assert!(!table.exists());
    };
    track(&[], "holds no PNG, JPEG, TIFF, BMP or PNM stills");
    RgbImage::new(64, 64).save(folder.path().join("a.png")).unwrap();
    track(
        &[],
        "the stills have no time stamps; put them in times.csv in this folder, or give --times FILE or --rate HZ",
    );
    track(&["--rate", "0"], "give a number above 0");
    track(&["--rate", "50"], "no red mark");
    std::fs::write(folder.path().join("times.txt"), "0.1\n0.2\n").unwrap();
    track(&[], "holds 2 times for 1 stills");
    let video = concat!(env!("CARGO_MANIFEST_DIR"), "/videos/kapton.mp4");
    let mut command = assert_cmd::Command::cargo_bin("track").unwrap();
    command.arg(video).arg("--out").arg(&table).args(["--rate", "30"]);
    command.assert().code(2).stderr(predicates::str::contains("--rate: is for a folder of stills"));
}
