//! Decoding: every frame once, with its own stamp, the same to the bit however many cores decode it.

use std::path::{Path, PathBuf};
use std::process::Command;

use freeswing::video::{Container, Decoded, Frame, Recording, StillTimes, WHOLE_S, decode_in_order, decode_one_by_one};

/// A moving test picture of 150 frames, coded by the `ffmpeg` program with `options`.
fn clip(folder: &Path, name: &str, options: &[&str]) -> PathBuf {
    let path = folder.join(name);
    let source = ["-f", "lavfi", "-i", "testsrc2=size=160x128:rate=25:duration=6,noise=alls=12:allf=t"];
    let status = Command::new("ffmpeg")
        .args(["-v", "error", "-nostdin", "-y"])
        .args(source)
        .args(options)
        .arg(&path)
        .status()
        .expect("ffmpeg is installed by scripts/setup");
    assert!(status.success(), "{name}");
    path
}

/// Stamp and a checksum of all samples of every frame.
fn fingerprint(frame: Frame<'_>) -> (f64, u64) {
    let picture = frame.picture;
    let wide = picture.wide();
    let (cw, ch) = picture.layout.chroma_size();
    let mut sum = 0u64;
    let mut take = |plane: &freeswing::video::Plane<'_>, width, height| {
        for y in 0..height {
            for x in 0..width {
                sum = sum.wrapping_mul(0x100_0000_01b3).wrapping_add(u64::from(plane.code(wide, x, y)));
            }
        }
    };
    take(&picture.luma, picture.layout.width_px, picture.layout.height_px);
    take(&picture.cb, cw, ch);
    take(&picture.cr, cw, ch);
    (frame.t_s, sum)
}

fn decode(path: &Path, workers: usize) -> (Vec<(f64, u64)>, Decoded) {
    let mut frames = Vec::new();
    let mut container = Container::open(path).unwrap();
    let decoded = decode_in_order(&mut container, workers, &fingerprint, &mut |f| {
        frames.push(f);
        Ok(())
    })
    .unwrap();
    (frames, decoded)
}

fn decode_whole(path: &Path) -> Vec<(f64, u64)> {
    let mut frames = Vec::new();
    let mut container = Container::open(path).unwrap();
    decode_one_by_one(&mut container, 1, &fingerprint, &mut |f| {
        frames.push(f);
        Ok(())
    })
    .unwrap();
    frames
}

/// The stamps that `ffprobe` reports, in seconds.
fn probed(path: &Path) -> Vec<f64> {
    let output = Command::new("ffprobe")
        .args(["-v", "error", "-select_streams", "V:0", "-show_entries", "frame=best_effort_timestamp_time"])
        .args(["-of", "csv=p=0"])
        .arg(path)
        .output()
        .unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    text.lines().filter_map(|l| l.split(',').next()?.trim().parse().ok()).collect()
}

fn check(path: &Path) -> Decoded {
    let name = path.display();
    let (one, decoded) = decode(path, 1);
    assert_eq!(one, decode(path, 2).0, "{name}: one worker and two");
    assert_eq!(one, decode(path, 3).0, "{name}: one worker and three");
    assert_eq!(one, decode_whole(path), "{name}: split and whole");
    let stamps = probed(path);
    assert_eq!(one.len(), stamps.len(), "{name}: frames");
    for (i, ((t, _), probed)) in one.iter().zip(&stamps).enumerate() {
        assert!((t - probed).abs() <= 1e-6, "{name}: frame {i} at {t}, ffprobe says {probed}");
    }
    decoded
}

#[test]
fn every_codec_container_and_pixel_format_decodes_alike_in_parallel() {
    let folder = tempfile::tempdir().unwrap();
    let x264 = ["-c:v", "libx264", "-preset", "veryfast"];
    let with = |more: &[&'static str]| [&x264[..], more].concat();
    let cases: Vec<(&str, Vec<&str>, bool)> = vec![
        ("b_frames.mp4", with(&["-g", "25", "-bf", "3", "-pix_fmt", "yuv420p"]), true),
        ("open_gop.mp4", with(&["-x264-params", "open-gop=1:keyint=25:bframes=3", "-pix_fmt", "yuv420p"]), false),
        ("intra_refresh.mkv", with(&["-intra-refresh", "1", "-g", "25", "-pix_fmt", "yuv420p"]), false),
        ("one_key_frame.mp4", with(&["-g", "999", "-sc_threshold", "0", "-pix_fmt", "yuv420p"]), false),
        ("ten_bit_422.mkv", with(&["-g", "30", "-pix_fmt", "yuv422p10le"]), true),
        ("full_444.mov", with(&["-g", "30", "-pix_fmt", "yuvj444p"]), true),
        (
            "hevc.mp4",
            vec!["-c:v", "libx265", "-preset", "ultrafast", "-x265-params", "keyint=30:open-gop=0:log-level=none"],
            true,
        ),
        ("hevc_open_gop.mkv", vec!["-c:v", "libx265", "-x265-params", "keyint=30:log-level=none"], false),
        ("mpeg4.avi", vec!["-c:v", "mpeg4", "-g", "30", "-q:v", "3"], true),
        ("mpeg4_b.mp4", vec!["-c:v", "mpeg4", "-g", "30", "-bf", "2", "-q:v", "3"], false),
        ("mjpeg.mov", vec!["-c:v", "mjpeg", "-q:v", "3", "-pix_fmt", "yuvj420p"], true),
        ("mjpeg.avi", vec!["-c:v", "mjpeg", "-q:v", "3", "-pix_fmt", "yuvj422p"], true),
        ("raw_nv12.avi", vec!["-c:v", "rawvideo", "-pix_fmt", "nv12"], true),
        ("raw_rgb.avi", vec!["-c:v", "rawvideo", "-pix_fmt", "bgr24"], true),
        ("lossless.mkv", vec!["-c:v", "ffv1", "-pix_fmt", "yuv420p"], true),
    ];
    for (name, options, splits) in cases {
        let path = clip(folder.path(), name, &options);
        let decoded = check(&path);
        assert_eq!(decoded.frames, 150, "{name}");
        if splits {
            assert!(decoded.segments > 1, "{name}: {} segments", decoded.segments);
        }
    }
}

#[test]
fn sampled_pictures_are_those_of_the_whole_recording_one_key_frame_or_many() {
    let folder = tempfile::tempdir().unwrap();
    for (name, gap) in [("one.mp4", "250"), ("many.mp4", "30")] {
        let coded = ["-c:v", "libx264", "-pix_fmt", "yuv420p", "-bf", "2", "-sc_threshold", "0", "-g", gap];
        let path = clip(folder.path(), name, &coded);
        let whole = decode_whole(&path);
        let mut sampled = Vec::new();
        let recording = Recording::open(&path, &StillTimes::Beside).unwrap();
        recording.sample(8, WHOLE_S, &mut |frame| sampled.push(fingerprint(*frame))).unwrap();
        let places: Vec<usize> =
            sampled.iter().map(|seen| whole.iter().position(|frame| frame == seen).expect(name)).collect();
        assert_eq!(places.len(), 8, "{name}");
        if gap == "250" {
            assert_eq!(places, [1, 9, 17, 25, 33, 41, 49, 57]);
        } else {
            assert!(places.windows(2).all(|w| w[0] + 8 <= w[1]) && places[7] > 120, "{places:?}");
        }
    }
}

#[test]
fn stamps_that_start_late_vary_or_come_through_an_edit_list_are_the_containers_own() {
    let folder = tempfile::tempdir().unwrap();
    let h264 = ["-c:v", "libx264", "-preset", "veryfast", "-pix_fmt", "yuv420p", "-g", "25", "-bf", "2"];
    let late = clip(folder.path(), "late.mkv", &[&h264[..], &["-output_ts_offset", "1.5"]].concat());
    check(&late);
    assert!((decode(&late, 2).0[0].0 - 1.5).abs() < 0.01);
    let uneven = ["-vf", "setpts='(N+0.3*sin(N))/25/TB'", "-vsync", "vfr", "-video_track_timescale", "90000"];
    check(&clip(folder.path(), "uneven.mp4", &[&h264[..], &uneven[..]].concat()));
    // cutting without coding anew leaves an edit list that hides the frames before the cut
    let whole = clip(folder.path(), "whole.mp4", &h264);
    let cut = folder.path().join("cut.mp4");
    let status = Command::new("ffmpeg")
        .args(["-v", "error", "-nostdin", "-y", "-ss", "1.3", "-i"])
        .arg(&whole)
        .args(["-c", "copy"])
        .arg(&cut)
        .status()
        .unwrap();
    assert!(status.success());
    check(&cut);
}

#[test]
fn the_main_video_stream_is_found_among_sound_and_others() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("several.mkv");
    let status = Command::new("ffmpeg")
        .args(["-v", "error", "-nostdin", "-y", "-f", "lavfi", "-i", "sine=duration=2"])
        .args(["-f", "lavfi", "-i", "testsrc2=size=64x48:rate=25:duration=2"])
        .args(["-f", "lavfi", "-i", "testsrc2=size=320x240:rate=25:duration=2"])
        .args(["-map", "0:a", "-map", "1:v", "-map", "2:v", "-c:v", "libx264", "-pix_fmt", "yuv420p"])
        .arg(&path)
        .status()
        .unwrap();
    assert!(status.success());
    let info = Container::open(&path).unwrap().info;
    assert_eq!((info.stored_size_px, info.streams, info.other_videos), ((320, 240), 3, 1));
}

#[test]
fn the_real_recording_has_the_stamps_that_ffprobe_reports() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data/chaotic_pendulum.mp4");
    if !path.exists() {
        eprintln!("SKIPPED: {} is not here", path.display());
        return;
    }
    let stamps = probed(&path);
    let mut ours = Vec::new();
    let mut container = Container::open(&path).unwrap();
    decode_in_order(&mut container, 2, &|f: Frame<'_>| f.t_s, &mut |t| {
        ours.push(t);
        Ok(())
    })
    .unwrap();
    assert_eq!((ours.len(), stamps.len()), (2054, 2054));
    assert!(ours.iter().zip(&stamps).all(|(a, b)| (a - b).abs() <= 1e-6));
}

#[test]
fn pictures_of_a_part_come_from_that_part() {
    let folder = tempfile::tempdir().unwrap();
    let many_key_frames = clip(folder.path(), "often.mp4", &["-c:v", "libx264", "-g", "25"]);
    let one_key_frame = clip(folder.path(), "once.mp4", &["-c:v", "libx264", "-g", "1000"]);
    for (path, least) in [(many_key_frames, 6), (one_key_frame, 2)] {
        let recording = Recording::open(&path, &StillTimes::Beside).unwrap();
        let mut seen = Vec::new();
        recording.sample(8, [2.0, 4.0], &mut |frame| seen.push(frame.t_s)).unwrap();
        assert!(
            seen.len() >= least && seen.iter().all(|t_s| (2.0..=4.0).contains(t_s)),
            "{}: {seen:?}",
            path.display()
        );
    }
}
