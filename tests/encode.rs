//! What is written can be read back: frames, stamps, tags.

use std::path::Path;
use std::process::Command;

use freeswing::Error;
use freeswing::experiment::{Codec, CodecName, Experiment, PixelFormat, Siting};
use freeswing::synth::Recording;
use freeswing::video::{OwnedPicture, VideoWriter};

fn small() -> Experiment {
    let mut experiment = Experiment::default();
    let render = &mut experiment.render;
    (render.width_px, render.height_px, render.fps, render.duration_s) = (160, 120, 30.0, 0.5);
    (render.scale_px_per_m, render.hinge_px, render.mark_diameter_px) = (400.0, [80.0, 20.0], 8.0);
    render.strip_width_px = 14.0;
    render.codec.preset = "ultrafast".to_owned();
    experiment
}

fn probe(path: &Path, entries: &str) -> Vec<String> {
    let output = Command::new("ffprobe")
        .args(["-v", "error", "-select_streams", "v:0", "-of", "csv=p=0", "-show_entries", entries])
        .arg(path)
        .output()
        .expect("ffprobe runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    text.lines().map(|l| l.trim_end_matches(',').to_owned()).filter(|l| !l.is_empty()).collect()
}

fn stamps_s(path: &Path) -> Vec<f64> {
    let lines = probe(path, "frame=best_effort_timestamp_time");
    lines.iter().map(|l| l.split(',').next().unwrap().parse().unwrap_or_else(|_| panic!("stamp {l}"))).collect()
}

fn assert_stamps(recording: &Recording, path: &Path, tolerance_s: f64) {
    let read = stamps_s(path);
    assert_eq!(read.len(), recording.len(), "{}", path.display());
    for (read, stated) in read.iter().zip(recording.stamps_s()) {
        assert!((read - stated).abs() < tolerance_s, "{}: {read} {stated}", path.display());
    }
}

#[test]
fn every_frame_and_stamp_of_a_variable_rate_recording_comes_back() {
    let folder = tempfile::tempdir().unwrap();
    let mut experiment = small();
    experiment.render.jitter_s = 0.003;
    experiment.render.dropped_frames = vec![4, 5, 9];
    experiment.render.start_s = 1.5;
    for (file, b_frames, tolerance_s) in
        [("a.mp4", Some(0), 1e-6), ("b.mp4", Some(3), 1e-6), ("c.mov", None, 1e-6), ("d.mkv", Some(2), 6e-4)]
    {
        experiment.render.codec.b_frames = b_frames;
        let recording = Recording::of(&experiment).unwrap();
        let path = folder.path().join(file);
        recording.write(&path, None, &mut |_| Ok(())).unwrap();
        assert_stamps(&recording, &path, tolerance_s);
    }
}

#[test]
fn every_codec_and_container_takes_every_frame() {
    let folder = tempfile::tempdir().unwrap();
    let cases = [
        (CodecName::H264, PixelFormat::Yuv420p, "mp4", "h264,yuv420p"),
        (CodecName::H264, PixelFormat::Yuv422p, "mkv", "h264,yuv422p"),
        (CodecName::H264, PixelFormat::Yuv444p, "mov", "h264,yuv444p"),
        (CodecName::H264, PixelFormat::Yuv420p10le, "mp4", "h264,yuv420p10le"),
        (CodecName::H264, PixelFormat::Nv12, "mp4", "h264,yuv420p"),
        (CodecName::H264, PixelFormat::Yuv420p, "avi", "h264,yuv420p"),
        (CodecName::Hevc, PixelFormat::Yuv420p, "mp4", "hevc,yuv420p"),
        (CodecName::Hevc, PixelFormat::Yuv420p10le, "mkv", "hevc,yuv420p10le"),
        (CodecName::Mpeg4, PixelFormat::Yuv420p, "avi", "mpeg4,yuv420p"),
        (CodecName::Mpeg4, PixelFormat::Yuv420p, "mp4", "mpeg4,yuv420p"),
        (CodecName::Mjpeg, PixelFormat::Yuv420p, "avi", "mjpeg,yuvj420p"),
        (CodecName::Mjpeg, PixelFormat::Yuv422p, "mov", "mjpeg,yuvj422p"),
    ];
    for (i, (name, format, extension, expected)) in cases.into_iter().enumerate() {
        let mut experiment = small();
        let codec = &mut experiment.render.codec;
        (codec.name, codec.pixel_format) = (name, format);
        codec.full_range = name == CodecName::Mjpeg;
        codec.crf = if matches!(name, CodecName::Mpeg4 | CodecName::Mjpeg) { 3.0 } else { 20.0 };
        codec.b_frames = (extension == "avi").then_some(0);
        let recording = Recording::of(&experiment).unwrap();
        let path = folder.path().join(format!("{i}.{extension}"));
        recording.write(&path, None, &mut |_| Ok(())).unwrap();
        let tolerance_s = if extension == "mkv" { 6e-4 } else { 1e-5 };
        assert_stamps(&recording, &path, tolerance_s);
        assert_eq!(probe(&path, "stream=codec_name,pix_fmt")[0], expected, "{extension}");
    }
}

#[test]
fn colour_tags_and_rotation_are_in_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let mut experiment = small();
    experiment.render.codec.full_range = true;
    experiment.render.codec.siting = Siting::Center;
    experiment.render.codec.rotation_deg = 90;
    let path = folder.path().join("tagged.mp4");
    Recording::of(&experiment).unwrap().write(&path, None, &mut |_| Ok(())).unwrap();
    let tags = probe(&path, "stream=color_range,color_space,color_transfer,color_primaries,chroma_location");
    assert_eq!(tags[0], "pc,bt709,bt709,bt709,center");
    let rotation = probe(&path, "stream_side_data=rotation");
    assert!(rotation.iter().any(|l| l.contains("-90")), "{rotation:?}");
}

#[test]
fn key_frames_come_at_least_every_gop() {
    let folder = tempfile::tempdir().unwrap();
    let mut experiment = small();
    experiment.render.codec.gop = 5;
    let path = folder.path().join("gop.mp4");
    Recording::of(&experiment).unwrap().write(&path, None, &mut |_| Ok(())).unwrap();
    let keys = probe(&path, "frame=key_frame").iter().filter(|l| l.starts_with('1')).count();
    assert!(keys >= 3, "{keys}");
}

#[test]
fn nothing_remains_of_a_file_that_is_not_finished() {
    let folder = tempfile::tempdir().unwrap();
    let recording = Recording::of(&small()).unwrap();
    let (path, truth) = (folder.path().join("stopped.mp4"), folder.path().join("truth.csv"));
    std::fs::write(&path, "an earlier result").unwrap();
    let mut stop = |done: usize| if done == 3 { Err(Error::Interrupted) } else { Ok(()) };
    let error = recording.write(&path, Some(&truth), &mut stop).unwrap_err();
    assert_eq!(error.to_string(), "interrupted; nothing was written");
    let left: Vec<_> = std::fs::read_dir(folder.path()).unwrap().map(|e| e.unwrap().file_name()).collect();
    assert_eq!(left, ["stopped.mp4"]);
    assert_eq!(std::fs::read_to_string(&path).unwrap(), "an earlier result");
}

#[test]
fn bad_targets_and_bad_pictures_are_one_clear_line() {
    let folder = tempfile::tempdir().unwrap();
    let codec = Codec { preset: "ultrafast".to_owned(), ..Codec::default() };
    let layout = codec.layout(64, 48);
    let refused =
        |name: &str| VideoWriter::create(&folder.path().join(name), &codec, layout, 30.0).err().unwrap().to_string();
    assert!(refused("clip.wmv").contains("unknown extension .wmv; use .mp4, .mov, .mkv or .avi"));
    assert!(refused("clip").contains("no extension"));
    assert!(refused("missing/clip.mp4").contains("cannot be written"));
    let odd = codec.layout(33, 33);
    let error = VideoWriter::create(&folder.path().join("a.mp4"), &codec, odd, 30.0).err().unwrap().to_string();
    assert!(error.contains("libx264 refuses the options"), "{error}");
    let mut writer = VideoWriter::create(&folder.path().join("b.mp4"), &codec, layout, 30.0).unwrap();
    writer.write(&OwnedPicture::black(layout), 10).unwrap();
    let error = writer.write(&OwnedPicture::black(layout), 10).unwrap_err().to_string();
    assert!(error.contains("stamps must rise"), "{error}");
    let other = OwnedPicture::black(codec.layout(32, 48));
    assert!(writer.write(&other, 11).unwrap_err().to_string().contains("differs in layout"));
    drop(writer);
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
}
