//! Accuracy against rendered swings of known truth: position, angle, stated standard deviation.
//!
//! `cargo test` runs a small part; `make accuracy` the whole bank, in release mode, and prints the figures.

use std::path::Path;

use freeswing::angles::Angles;
use freeswing::experiment::Experiment;
use freeswing::measure::{Measurement, Options, measure};
use freeswing::progress::Silent;
use freeswing::synth::Recording;

/// A rendered recording, measured both ways.
struct Case {
    truth: Recording,
    subpixel: Measurement,
    binary: Measurement,
}

/// Renders an experiment through its codec and tracks the file.
fn case(toml: &str) -> Case {
    let experiment = Experiment::parse(toml, Path::new("case.toml")).unwrap();
    let recording = Recording::of(&experiment).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let video = folder.path().join("swing.mp4");
    recording.write(&video, None, &mut |_| Ok(())).unwrap();
    let run = |binary_centroid| {
        let options = Options { binary_centroid, ..Options::default() };
        measure(&video, &options, Path::new(""), &Silent).unwrap()
    };
    Case { subpixel: run(false), binary: run(true), truth: recording }
}

/// Errors and stated standard deviations of one coordinate or angle.
#[derive(Default)]
struct Errors {
    error: Vec<f64>,
    sd: Vec<f64>,
    /// Where in the pixel the truth lay.
    phase: Vec<f64>,
}

impl Errors {
    fn rms(&self) -> f64 {
        (self.error.iter().map(|e| e * e).sum::<f64>() / self.error.len() as f64).sqrt()
    }

    fn bias(&self) -> f64 {
        self.error.iter().sum::<f64>() / self.error.len() as f64
    }

    fn coverage(&self) -> f64 {
        let inside = self.error.iter().zip(&self.sd).filter(|(e, s)| e.abs() <= 1.96 * *s).count();
        inside as f64 / self.error.len() as f64
    }

    /// Largest difference of the mean error in a quarter of the pixel from the mean over all.
    fn phase_spread(&self) -> f64 {
        let all = self.bias();
        (0..4)
            .map(|quarter| {
                let of: Vec<f64> = self
                    .error
                    .iter()
                    .zip(&self.phase)
                    .filter(|(_, p)| ((**p * 4.0) as usize).min(3) == quarter)
                    .map(|(e, _)| *e)
                    .collect();
                (of.iter().sum::<f64>() / of.len().max(1) as f64 - all).abs()
            })
            .fold(0.0, f64::max)
    }

    fn extend(&mut self, other: Errors) {
        self.error.extend(other.error);
        self.sd.extend(other.sd);
        self.phase.extend(other.phase);
    }
}

/// Share of the positions of marks in plain view that must be measured.
const LEAST_SEEN: f64 = 0.995;

/// Position errors along one axis over the marks that swing.
fn positions(case: &Case, m: &Measurement, axis: usize) -> Errors {
    let mut errors = Errors::default();
    // a tracker that gives up where it is hard would be exact elsewhere
    let all: usize = m.tracks.marks.iter().skip(1).map(Vec::len).sum();
    let seen = m.tracks.marks.iter().skip(1).flatten().filter(|point| point.measured.is_some()).count();
    assert!(seen as f64 >= LEAST_SEEN * all as f64, "{seen} of {all} positions");
    for (mark, track) in m.tracks.marks.iter().enumerate().skip(1) {
        for (frame, point) in track.iter().enumerate() {
            let (Some(measured), truth) = (point.measured, case.truth.truth(frame)) else { continue };
            let at = truth.marks_px[mark][axis];
            errors.error.push(measured.position_px[axis] - at);
            errors.sd.push(measured.covariance_px2[axis].sqrt());
            errors.phase.push(at.rem_euclid(1.0));
        }
    }
    errors
}

fn angles(case: &Case, angles: &Angles) -> Errors {
    let mut errors = Errors::default();
    let all: usize = angles.links.iter().map(Vec::len).sum();
    let seen = angles.links.iter().flatten().flatten().count();
    assert!(seen as f64 >= LEAST_SEEN * all as f64, "{seen} of {all} angles");
    for (link, track) in angles.links.iter().enumerate() {
        for (frame, angle) in track.iter().enumerate() {
            let Some(angle) = angle else { continue };
            errors.error.push(angle.theta_rad - case.truth.truth(frame).theta_rad[link]);
            errors.sd.push(angle.sd_rad);
        }
    }
    errors
}

/// An experiment with the given strip, quality, seed and release.
fn experiment(strip: &str, crf: f64, seed: u64, release: [f64; 2], duration_s: f64) -> String {
    format!(
        "[model]\nrelease_rad = [{}, {}]\nk_eq_n_m_per_rad = 2.0e-4\n[model.effects]\nhinge_coulomb = 2.0e-7\nair_quadratic = 1.0e-3\n\
         [render]\nduration_s = {duration_s}\nseed = {seed}\nstrip_rgb = \"{strip}\"\n[render.codec]\ncrf = {crf}\n",
        release[0], release[1]
    )
}

/// The bank: two strips, two releases, several seeds.
fn bank(crf: f64, seeds: std::ops::Range<u64>, duration_s: f64) -> Vec<Case> {
    let mut cases = Vec::new();
    for seed in seeds {
        let (strip, release) = if seed % 2 == 0 { ("#c4842e", [0.42, 0.58]) } else { ("#d8dade", [0.5, 0.35]) };
        cases.push(case(&experiment(strip, crf, seed, release, duration_s)));
    }
    cases
}

fn report(name: &str, cases: &[Case]) -> ([Errors; 2], Errors, Errors) {
    let gather = |f: &dyn Fn(&Case) -> Errors| {
        let mut all = Errors::default();
        cases.iter().for_each(|c| all.extend(f(c)));
        all
    };
    let xy = [0, 1].map(|axis| gather(&|c| positions(c, &c.subpixel, axis)));
    let theta = gather(&|c| angles(c, &c.subpixel.angles));
    let plain = gather(&|c| angles(c, &c.binary.angles));
    for (axis, e) in ["x", "y"].iter().zip(&xy) {
        println!(
            "{name}: {axis} rms {:.4} px, bias {:+.4} px, phase {:.4} px, 95 % interval covers {:.1} %",
            e.rms(),
            e.bias(),
            e.phase_spread(),
            100.0 * e.coverage()
        );
    }
    println!(
        "{name}: angle rms {:.2e} rad (binary {:.2e}, ratio {:.3}), covers {:.1} %",
        theta.rms(),
        plain.rms(),
        theta.rms() / plain.rms(),
        100.0 * theta.coverage()
    );
    (xy, theta, plain)
}

#[test]
fn a_short_rendered_swing_is_measured_to_a_few_hundredths_of_a_pixel() {
    let (xy, theta, plain) = report("short", &bank(18.0, 1..2, 4.0));
    for e in &xy {
        assert!(e.rms() < 0.06 && e.bias().abs() < 0.03, "{} {}", e.rms(), e.bias());
    }
    assert!(theta.rms() < 0.3 * plain.rms());
}

#[test]
#[ignore = "slow: make accuracy"]
fn the_bank_at_default_quality_keeps_every_promise() {
    let (xy, theta, plain) = report("default quality", &bank(18.0, 40..46, 20.0));
    for e in &xy {
        assert!(e.rms() <= 0.04, "rms {}", e.rms());
        assert!(e.bias().abs() <= 0.02 && e.phase_spread() <= 0.02, "{} {}", e.bias(), e.phase_spread());
        assert!((0.93..=0.97).contains(&e.coverage()), "coverage {}", e.coverage());
    }
    assert!(theta.rms() <= 0.25 * plain.rms(), "{}", theta.rms() / plain.rms());
}

#[test]
#[ignore = "slow: make accuracy"]
fn poor_and_lossless_quality_are_reported_with_honest_intervals() {
    for (name, crf, most) in [("crf 23", 23.0, 0.98), ("crf 12", 12.0, 0.99)] {
        let (xy, theta, _) = report(name, &bank(crf, 50..52, 20.0));
        for e in xy.iter().chain([&theta]) {
            assert!((0.90..=most).contains(&e.coverage()), "{name}: coverage {}", e.coverage());
        }
    }
}
