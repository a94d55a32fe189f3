//! Identification against synthetic decays with known truth, and on real recordings.

use std::f64::consts::TAU;
use std::path::{Path, PathBuf};

use freeswing::identify::{Damping, Estimate, Identification, Method, Mode, identify};
use freeswing::series::AngleSeries;
use rand::rngs::Xoshiro256PlusPlus;
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};

/// One damped sinusoid of known parameters.
#[derive(Debug, Clone, Copy)]
struct Truth {
    frequency_hz: f64,
    damping_ratio: f64,
    /// Of each link.
    amplitude_rad: [f64; 2],
    phase_rad: f64,
}

impl Truth {
    fn angle_rad(&self, link: usize, t_s: f64) -> f64 {
        let natural = TAU * self.frequency_hz;
        let (sigma, omega) = (self.damping_ratio * natural, natural * (1.0 - self.damping_ratio.powi(2)).sqrt());
        self.amplitude_rad[link] * (-sigma * t_s).exp() * (omega * t_s + self.phase_rad).cos()
    }
}

/// A synthetic recording at 30 frames a second.
struct Case {
    modes: Vec<Truth>,
    series: AngleSeries,
}

impl Case {
    /// Both modes, 20 to 60 s, noise of 0.02 to 0.25°, some frames missing.
    fn random(rng: &mut Xoshiro256PlusPlus) -> Self {
        let log =
            |rng: &mut Xoshiro256PlusPlus, low: f64, high: f64| low * (high / low).powf(rng.random_range(0.0..1.0));
        let first = Truth {
            frequency_hz: log(rng, 0.5, 1.6),
            damping_ratio: log(rng, 0.0005, 0.05),
            amplitude_rad: [rng.random_range(0.1..0.5), 0.0],
            phase_rad: rng.random_range(0.0..TAU),
        };
        let first = Truth { amplitude_rad: [first.amplitude_rad[0], 1.3 * first.amplitude_rad[0]], ..first };
        let second = first.amplitude_rad[0] * rng.random_range(0.15..0.6);
        let second = Truth {
            frequency_hz: (first.frequency_hz * rng.random_range(2.2..2.85)).min(4.0),
            damping_ratio: log(rng, 0.0005, 0.05),
            amplitude_rad: [second, -1.7 * second],
            phase_rad: rng.random_range(0.0..TAU),
        };
        let (noise_rad, duration_s) = (log(rng, 0.02, 0.25).to_radians(), rng.random_range(20.0..60.0));
        Self::of(vec![first, second], noise_rad, duration_s, rng)
    }

    fn of(modes: Vec<Truth>, noise_rad: f64, duration_s: f64, rng: &mut Xoshiro256PlusPlus) -> Self {
        let t_s: Vec<f64> = (0..(30.0 * duration_s) as usize).map(|k| k as f64 / 30.0).collect();
        let mut angle = |link: usize, t: f64| {
            let noise: f64 = StandardNormal.sample(rng);
            let theta = 0.02 + modes.iter().map(|m| m.angle_rad(link, t)).sum::<f64>() + noise_rad * noise;
            (!rng.random_bool(0.01)).then_some(theta)
        };
        let theta_rad: Vec<Vec<Option<f64>>> = (0..2).map(|l| t_s.iter().map(|t| angle(l, *t)).collect()).collect();
        let sd_rad = theta_rad.iter().map(|l| vec![None; l.len()]).collect();
        let series = AngleSeries { path: PathBuf::from("synthetic"), t_s, theta_rad, sd_rad };
        Self { modes, series }
    }
}

/// Errors and coverage of one quantity over a bank.
#[derive(Default)]
struct Score {
    relative_errors: Vec<f64>,
    inside: usize,
}

impl Score {
    fn add(&mut self, estimate: &Estimate, truth: f64) {
        self.relative_errors.push((estimate.value / truth - 1.0).abs());
        self.inside += usize::from(estimate.holds(truth));
    }

    fn median(&mut self) -> f64 {
        self.relative_errors.sort_by(f64::total_cmp);
        self.relative_errors[self.relative_errors.len() / 2]
    }

    fn coverage(&self) -> f64 {
        self.inside as f64 / self.relative_errors.len() as f64
    }

    fn line(&mut self, name: &str) {
        let n = self.relative_errors.len();
        if n > 0 {
            println!(
                "{name:28} {n:5} cases, median error {:.4} %, coverage {:.1} %",
                100.0 * self.median(),
                100.0 * self.coverage()
            );
        }
    }
}

/// The modes of a result next to the true ones.
fn matched<'a>(found: &'a Identification, case: &'a Case) -> impl Iterator<Item = (&'a Mode, &'a Truth)> {
    found.modes.iter().filter_map(|mode| {
        let near = |t: &&Truth| (mode.frequency_hz.value / t.frequency_hz - 1.0).abs() < 0.05;
        Some((mode, case.modes.iter().find(near)?))
    })
}

fn bank(cases: u64) -> [Score; 2] {
    let [mut f, mut xi] = [Score::default(), Score::default()];
    let mut methods: Vec<(Method, Score, Score)> =
        [Method::Spectrum, Method::HalfPower, Method::Decrement, Method::Sinusoids, Method::Envelope]
            .map(|m| (m, Score::default(), Score::default()))
            .into();
    let (mut two, mut unidentified, mut disagree) = (0, 0, [0, 0]);
    for seed in 0..cases {
        let case = Case::random(&mut Xoshiro256PlusPlus::seed_from_u64(seed));
        let found = identify(&case.series, None).unwrap();
        two += u64::from(found.modes.len() == 2);
        for (mode, truth) in matched(&found, &case) {
            f.add(&mode.frequency_hz, truth.frequency_hz);
            match &mode.damping {
                Damping::Identified(estimate) => xi.add(estimate, truth.damping_ratio),
                Damping::NotIdentifiable { .. } => unidentified += 1,
            }
            for (method, f, xi) in &mut methods {
                for e in mode.estimators.iter().filter(|e| e.method == *method) {
                    e.frequency_hz.iter().for_each(|e| f.add(e, truth.frequency_hz));
                    e.damping_ratio.iter().for_each(|e| xi.add(e, truth.damping_ratio));
                }
            }
            disagree[0] += u64::from(mode.frequency_consistency.is_some_and(|c| !c.agree));
            disagree[1] += u64::from(mode.damping_consistency.is_some_and(|c| !c.agree));
        }
    }
    println!(
        "{cases} recordings: two modes in {two}, damping not identifiable in {unidentified}, disagreement {disagree:?}"
    );
    f.line("f");
    xi.line("ξ");
    for (method, f, xi) in &mut methods {
        f.line(&format!("{method:?} f"));
        xi.line(&format!("{method:?} ξ"));
    }
    [f, xi]
}

#[test]
fn forty_synthetic_decays_are_identified() {
    let [mut f, mut xi] = bank(40);
    assert!(f.relative_errors.len() >= 76, "{}", f.relative_errors.len());
    assert!(f.median() < 2e-4 && xi.median() < 0.02, "{} {}", f.median(), xi.median());
    assert!(f.coverage() > 0.88 && xi.coverage() > 0.88, "{} {}", f.coverage(), xi.coverage());
}

#[test]
#[ignore = "slow; `make accuracy` runs it"]
fn four_hundred_synthetic_decays_are_identified_with_true_intervals() {
    let [mut f, mut xi] = bank(400);
    assert!(f.median() < 2e-4 && xi.median() < 0.02, "{} {}", f.median(), xi.median());
    for score in [f, xi] {
        assert!((0.93..=0.97).contains(&score.coverage()), "{}", score.coverage());
    }
}
