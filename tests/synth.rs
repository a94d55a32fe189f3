//! Rendered marks lie where the truth says.

use freeswing::experiment::{Experiment, Lens, Noise, Occlusion, PixelFormat, Render, Rgb, Siting};
use freeswing::synth::{Recording, SynthFrame};

/// A small picture of a strip at rest: wide, flat, without noise.
fn still() -> Experiment {
    let mut experiment = Experiment::default();
    experiment.model.release_rad = vec![0.0, 0.0];
    experiment.render = Render {
        width_px: 160,
        height_px: 240,
        duration_s: 0.1,
        scale_px_per_m: 800.0,
        hinge_px: [80.0, 40.0],
        strip_width_px: 90.0,
        strip_sheen: 0.0,
        strip_slope: 0.0,
        noise: Noise { read: 0.0, shot: 0.0 },
        exposure_s: 0.0,
        ..Render::default()
    };
    experiment.render.codec.pixel_format = PixelFormat::Yuv444p;
    experiment
}

/// Centroid of C_r above its level on the bare strip, within `radius_px` of where it should be, in luma pixels.
fn red_centroid_px(frame: &SynthFrame, mark: usize, radius_px: f64) -> [f64; 2] {
    let view = frame.picture.view();
    let (width, height) = view.layout.chroma_size();
    let [mx, my] = frame.truth.marks_px[mark];
    let mut samples = Vec::new();
    let mut bare = Vec::new();
    for y in 0..height {
        for x in 0..width {
            let (px, py) = view.layout.chroma_to_luma(x as f64, y as f64);
            let distance = (px - mx).hypot(py - my);
            let (_, cr) = view.chroma(x, y);
            if distance <= radius_px {
                samples.push((px, py, cr));
            } else if distance <= radius_px + 3.0 {
                bare.push(cr);
            }
        }
    }
    let level = bare.iter().sum::<f64>() / bare.len() as f64;
    let mut sum = [0.0; 3];
    for (x, y, cr) in samples {
        sum = [sum[0] + x * (cr - level), sum[1] + y * (cr - level), sum[2] + cr - level];
    }
    [sum[0] / sum[2], sum[1] / sum[2]]
}

fn error_px(frame: &SynthFrame, mark: usize, radius_px: f64) -> f64 {
    let [x, y] = red_centroid_px(frame, mark, radius_px);
    let [mx, my] = frame.truth.marks_px[mark];
    (x - mx).hypot(y - my)
}

#[test]
fn the_centroid_is_the_truth_at_every_pixel_phase() {
    let mut worst: f64 = 0.0;
    for blur in [0.0, 0.8] {
        for phase in 0..11 {
            let mut experiment = still();
            let offset = f64::from(phase) / 11.0;
            experiment.render.hinge_px = [80.0 + offset, 40.0 + (3.0 * offset).fract()];
            experiment.render.lens_blur_px = blur;
            let frame = Recording::of(&experiment).unwrap().frame(0);
            worst = worst.max(error_px(&frame, 1, 18.0));
        }
    }
    println!("worst centroid error {worst:.5} px");
    assert!(worst < 0.005, "{worst}");
}

#[test]
fn chroma_lies_where_its_layout_says() {
    for siting in [Siting::Left, Siting::Center, Siting::TopLeft] {
        for format in [PixelFormat::Yuv420p, PixelFormat::Yuv422p, PixelFormat::Yuv420p10le] {
            let mut worst: f64 = 0.0;
            for phase in 0..8 {
                let mut experiment = still();
                experiment.render.codec.siting = siting;
                experiment.render.codec.pixel_format = format;
                let offset = f64::from(phase) / 4.0;
                experiment.render.hinge_px = [80.0 + offset, 40.0 + (3.0 * offset) % 2.0];
                let frame = Recording::of(&experiment).unwrap().frame(0);
                worst = worst.max(error_px(&frame, 1, 18.0));
            }
            println!("{siting:?} {format:?}: {worst:.5} px");
            assert!(worst < 0.008, "{siting:?} {format:?} {worst}");
        }
    }
}

#[test]
fn a_symmetrical_blur_leaves_the_centroid_at_mid_exposure() {
    let mut experiment = still();
    experiment.model.release_rad = vec![0.12, 0.12];
    experiment.model.k_eq_n_m_per_rad = 1e-3;
    experiment.render.exposure_s = 0.012;
    experiment.render.duration_s = 0.4;
    experiment.render.fps = 60.0;
    let recording = Recording::of(&experiment).unwrap();
    // The frame in which the strip passes the vertical: fast, and hardly accelerated.
    let speed = |i: usize| (recording.truth(i + 1).marks_px[1][0] - recording.truth(i - 1).marks_px[1][0]).abs() * 30.0;
    let fastest = (1..recording.len() - 1).max_by(|a, b| speed(*a).total_cmp(&speed(*b))).unwrap();
    assert!(speed(fastest) * 0.012 > 0.5, "{}", speed(fastest));
    let error = error_px(&recording.frame(fastest), 1, 22.0);
    assert!(error < 0.005, "{error}");
}

#[test]
fn a_rolling_shutter_shows_each_mark_at_its_own_rows_time() {
    let mut experiment = still();
    experiment.model.release_rad = vec![0.2, 0.2];
    experiment.render.row_time_s = 5e-5;
    experiment.render.duration_s = 0.4;
    let recording = Recording::of(&experiment).unwrap();
    let mut straight = experiment.clone();
    straight.render.row_time_s = 0.0;
    let straight = Recording::of(&straight).unwrap();
    let (mut worst, mut largest): (f64, f64) = (0.0, 0.0);
    for i in 0..recording.len() {
        let frame = recording.frame(i);
        // Rows of the mark are exposed one after the other, which shears the disc: its centroid stays.
        worst = worst.max(error_px(&frame, 2, 15.0));
        largest = largest.max((frame.truth.marks_px[2][0] - straight.truth(i).marks_px[2][0]).abs());
    }
    assert!(worst < 0.01 && largest > 1.0, "{worst} {largest}");
}

#[test]
fn a_lens_moves_the_marks_as_the_truth_says() {
    let mut experiment = still();
    experiment.render.lens = Some(Lens { focal_px: 400.0, k1: -0.05, k2: 0.02 });
    let frame = Recording::of(&experiment).unwrap().frame(0);
    assert!((frame.truth.marks_px[0][1] - 40.0).abs() > 0.1);
    for mark in [0, 1] {
        let error = error_px(&frame, mark, 16.0);
        assert!(error < 0.015, "mark {mark}: {error}");
    }
}

#[test]
fn an_occlusion_covers_the_mark_while_it_lasts() {
    let mut experiment = still();
    let rect_px = [0.0, 110.0, 160.0, 20.0];
    experiment.render.occlusions = vec![Occlusion { from_s: 0.03, until_s: 0.06, rect_px, rgb: Rgb([90, 90, 90]) }];
    let recording = Recording::of(&experiment).unwrap();
    let (_, open) = recording.frame(0).picture.view().chroma(80, 120);
    let (_, covered) = recording.frame(1).picture.view().chroma(80, 120);
    assert!(open > 0.2 && covered.abs() < 0.01, "{open} {covered}");
}

#[test]
fn frames_are_the_same_in_any_order_and_noise_follows_the_seed() {
    let mut experiment = still();
    experiment.render.noise = Noise::default();
    let recording = Recording::of(&experiment).unwrap();
    let in_order: Vec<SynthFrame> = recording.frames().collect();
    assert_eq!(in_order.len(), 3);
    assert_eq!(in_order[2], recording.frame(2));
    experiment.render.seed = 2;
    let other = Recording::of(&experiment).unwrap().frame(2);
    assert!(other.picture != in_order[2].picture && other.truth == in_order[2].truth);
}

#[test]
fn noise_has_the_stated_strength() {
    let mut experiment = still();
    experiment.render.noise = Noise { read: 0.01, shot: 0.02 };
    experiment.render.vignette = 0.0;
    let noisy = Recording::of(&experiment).unwrap().frame(1);
    experiment.render.noise = Noise { read: 0.0, shot: 0.0 };
    let clean = Recording::of(&experiment).unwrap().frame(1);
    let (a, b) = (noisy.picture.view(), clean.picture.view());
    let pixels: Vec<(usize, usize)> = (150..230).flat_map(|y| (0..30).map(move |x| (x, y))).collect();
    let level = pixels.iter().map(|p| b.y(p.0, p.1)).sum::<f64>() / pixels.len() as f64;
    let variance = pixels.iter().map(|p| (a.y(p.0, p.1) - b.y(p.0, p.1)).powi(2)).sum::<f64>() / pixels.len() as f64;
    let (kr, kb) = b.layout.matrix.luma_weights();
    let kept = kr * kr + kb * kb + (1.0 - kr - kb).powi(2);
    let step = 1.0 / 219.0;
    let stated = kept * (0.01f64.powi(2) + 0.02f64.powi(2) * level) + step * step / 6.0;
    assert!((variance / stated - 1.0).abs() < 0.12, "{variance} {stated}");
}

#[test]
fn dropped_frames_and_jitter_show_in_the_stamps() {
    let mut experiment = still();
    experiment.render.duration_s = 1.0;
    experiment.render.start_s = 0.5;
    experiment.render.dropped_frames = vec![3, 4];
    experiment.render.jitter_s = 0.002;
    let recording = Recording::of(&experiment).unwrap();
    let stamps = recording.stamps_s();
    assert_eq!(stamps.len(), 28);
    assert!((stamps[3] - stamps[2] - 0.1).abs() < 0.03 && stamps.windows(2).all(|w| w[1] > w[0]));
    assert!((stamps[0] - 0.5).abs() < 0.014);
}

#[test]
fn odd_scenes_are_drawn_without_a_panic() {
    let mut away = still();
    away.render.hinge_px = [-900.0, -900.0];
    let mut limp = still();
    limp.render.strip_width_px = 0.0;
    limp.render.mark_diameter_px = 1.0;
    let mut tiny = still();
    (tiny.render.width_px, tiny.render.height_px) = (16, 16);
    let mut odd = still();
    (odd.render.width_px, odd.render.height_px) = (161, 239);
    let mut far = still();
    far.render.hinge_px = [1000.0, 1000.0];
    far.render.codec.pixel_format = PixelFormat::Yuv420p;
    for experiment in [away, limp, tiny, odd, far] {
        assert_eq!(Recording::of(&experiment).unwrap().frames().count(), 3);
    }
}

#[test]
fn a_fixed_pivot_carries_no_mark() {
    let mut experiment = still();
    experiment.rig.pivot_px = Some([80.0, 40.0]);
    let recording = Recording::of(&experiment).unwrap();
    assert_eq!(recording.truth(0).marks_px.len(), 2);
    experiment.rig.marks = vec!["red".parse().unwrap()];
    let error = Recording::of(&experiment).unwrap_err().to_string();
    assert_eq!(error, "rig.marks: names 1 colours for 2 marks; name one a mark, top to bottom");
}

#[test]
fn the_hard_recording_of_the_fixtures_renders() {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/render/hard.toml");
    let recording = Recording::of(&Experiment::read(&path).unwrap()).unwrap();
    assert_eq!(recording.frames().count(), 27);
}
