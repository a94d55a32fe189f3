//! Identification of synthetic tables: drift, offset and trend at several resolutions, two modes of any ratio, growing amplitudes, tumbling.

use std::f64::consts::{PI, TAU};
use std::path::PathBuf;

use freeswing::experiment::Experiment;
use freeswing::identify::{Damping, Identification, Mode, identify};
use freeswing::series::AngleSeries;
use rand::rngs::Xoshiro256PlusPlus;
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};

/// A damped swing with the same frequency and damping in each link.
#[derive(Clone)]
struct Swing {
    frequency_hz: f64,
    damping_ratio: f64,
    amplitudes_rad: Vec<f64>,
    phase_rad: f64,
}

impl Swing {
    fn angle_rad(&self, link: usize, t_s: f64) -> f64 {
        let natural = TAU * self.frequency_hz;
        let damped = natural * (1.0 - self.damping_ratio.powi(2)).sqrt();
        let envelope = (-self.damping_ratio * natural * t_s).exp();
        self.amplitudes_rad[link] * envelope * (damped * t_s + self.phase_rad).cos()
    }
}

/// A swing at a stiffness that softens, T = K θ₀ tanh(θ/θ₀), by Runge and Kutta's method; 1.0 Hz at small amplitude.
fn softening(release_rad: f64, duration_s: f64) -> AngleSeries {
    let (rate_hz, fine) = (100.0, 10);
    let acceleration = |[angle, rate]: [f64; 2]| -TAU * TAU * 0.5 * (angle / 0.5).tanh() - 0.01 * TAU * rate;
    let slope = |state: [f64; 2]| [state[1], acceleration(state)];
    let along = |state: [f64; 2], slope: [f64; 2], h: f64| [state[0] + h * slope[0], state[1] + h * slope[1]];
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(5);
    let (mut state, mut angles) = ([release_rad, 0.0], Vec::new());
    for _ in 0..(duration_s * rate_hz) as usize {
        let noise: f64 = StandardNormal.sample(&mut rng);
        angles.push(Some(state[0] + 5e-4 * noise));
        for _ in 0..fine {
            let h = 1.0 / (rate_hz * f64::from(fine));
            let k1 = slope(state);
            let k2 = slope(along(state, k1, 0.5 * h));
            let k3 = slope(along(state, k2, 0.5 * h));
            let k4 = slope(along(state, k3, h));
            state = [0, 1].map(|i| state[i] + h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]));
        }
    }
    series((0..angles.len()).map(|k| k as f64 / rate_hz).collect(), vec![angles])
}

#[test]
fn the_frequency_at_small_amplitude_is_as_uncertain_as_the_law_that_leads_there() {
    let one = "[[specimen.links]]\nlength_m = 0.3\nmass_kg = 0.1\ncom_m = 0.15\ninertia_kg_m2 = 7.5e-4\n[model]\nrelease_rad = [0.8]\n";
    let experiment = Experiment::parse(one, &PathBuf::from("one.toml")).unwrap();
    let found = identify(&softening(0.8, 15.0), Some(&experiment)).unwrap();
    let f = found.modes[0].frequency_hz;
    assert!(f.low < 1.0 && f.high > 1.0 && f.half() < 0.5, "{f:?}");
    assert!(found.modes[0].basis.contains("nonlinear stiffness"), "{}", found.modes[0].basis);
    // seen down to small swings it is known
    let later = identify(&softening(0.1, 30.0), Some(&experiment)).unwrap();
    assert!((later.modes[0].frequency_hz.value - 1.0).abs() < 0.01, "{:?}", later.modes[0].frequency_hz);
}

/// A table as a camera of some resolution would give it.
struct Table {
    swings: Vec<Swing>,
    links: usize,
    duration_s: f64,
    rate_hz: f64,
    noise_rad: f64,
    /// Angles are rounded to this, as by a tracker of whole pixels; zero for none.
    quantum_rad: f64,
    /// Added to each link.
    slow: Law,
}

impl Table {
    fn of(swings: Vec<Swing>) -> Self {
        let links = swings.first().map_or(1, |s| s.amplitudes_rad.len());
        Self { swings, links, duration_s: 25.0, rate_hz: 30.0, noise_rad: 1e-3, quantum_rad: 0.0, slow: |_| 0.0 }
    }

    fn series(&self, seed: u64) -> AngleSeries {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        let t_s: Vec<f64> = (0..(self.duration_s * self.rate_hz) as usize).map(|k| k as f64 / self.rate_hz).collect();
        let mut angle = |link: usize, t: f64| {
            let noise: f64 = StandardNormal.sample(&mut rng);
            let angle = self.swings.iter().map(|s| s.angle_rad(link, t)).sum::<f64>() + (self.slow)(t);
            let seen = angle + self.noise_rad * noise;
            Some(if self.quantum_rad > 0.0 { (seen / self.quantum_rad).round() * self.quantum_rad } else { seen })
        };
        let theta_rad: Vec<Vec<Option<f64>>> =
            (0..self.links).map(|link| t_s.iter().map(|t| angle(link, *t)).collect()).collect();
        series(t_s, theta_rad)
    }

    fn identified(&self, seed: u64) -> Identification {
        identify(&self.series(seed), None).unwrap()
    }
}

fn series(t_s: Vec<f64>, theta_rad: Vec<Vec<Option<f64>>>) -> AngleSeries {
    let sd_rad = theta_rad.iter().map(|l| vec![None; l.len()]).collect();
    AngleSeries { path: PathBuf::from("synthetic"), t_s, theta_rad, sd_rad, tracked: false, warnings: Vec::new() }
}

fn one_link(frequency_hz: f64, damping_ratio: f64, amplitude_rad: f64) -> Swing {
    Swing { frequency_hz, damping_ratio, amplitudes_rad: vec![amplitude_rad], phase_rad: 0.4 }
}

/// Every number of a result is what a swing can have and the record can resolve.
fn assert_bounded(found: &Identification, what: &str) {
    let text = found.to_string();
    let nyquist_hz = 0.5 / found.record.step_s;
    for mode in &found.modes {
        let f = &mode.frequency_hz;
        assert!(0.0 < f.low && f.low <= f.value && f.value <= f.high, "{what}: {f:?}");
        assert!(f.high < 1.6 * nyquist_hz && f.half() < f.value, "{what}: {f:?}");
        if let Some(xi) = mode.damping.interval() {
            assert!(-1.0 <= xi.low && xi.high <= 1.0, "{what}: {xi:?}");
        }
        for e in &mode.estimators {
            assert!(e.frequency_hz.is_none_or(|f| f.low >= 0.0 && f.high <= 1.1 * nyquist_hz), "{what}: {e:?}");
            assert!(e.damping_ratio.is_none_or(|xi| xi.low >= -1.0 && xi.high <= 1.0), "{what}: {e:?}");
        }
        assert!(mode.shape.iter().all(|l| l.amplitude_rad < 2.5 * TAU), "{what}: {:?}", mode.shape);
    }
    let no_number =
        |word: &str| ["NaN", "inf", "-inf"].contains(&word.trim_matches(|c: char| !c.is_alphanumeric() && c != '-'));
    assert!(!text.split_whitespace().any(no_number), "{what}: {text}");
    assert!(!found.summary.is_empty() && !found.summary.contains('\n'), "{what}: {}", found.summary);
    assert!(text.starts_with(&found.summary), "{what}");
}

fn assert_is(mode: &Mode, frequency_hz: f64, what: &str) {
    let off = (mode.frequency_hz.value - frequency_hz).abs();
    let allowed = (4.0 * mode.frequency_hz.sd).max(1e-4 * frequency_hz);
    assert!(off < allowed, "{what}: {:?} against {frequency_hz}", mode.frequency_hz);
    assert!(off < 3e-3 * frequency_hz, "{what}: {:?} against {frequency_hz}", mode.frequency_hz);
}

/// Of time, in seconds.
type Law = fn(f64) -> f64;

const SLOW: [(&str, Law); 7] = [
    ("nothing", |_| 0.0),
    ("an offset of 11°", |_| 0.2),
    ("a trend of 0.3° to and fro", |t| 0.0052 * (t / 12.0 - 1.0)),
    ("a trend of 29°, larger than the swing", |t| 0.02 * t),
    ("a creep of 0.2° that dies away", |t| 0.0035 * (-t / 4.0).exp()),
    ("a drift of 0.2°", |t| 0.0035 * (TAU * t / 17.0).sin() + 0.001 * (TAU * t / 11.0).cos()),
    ("a drift of 0.2° that dies within a cycle of 3 s", |t| 0.0035 * (-0.7 * t).exp() * (TAU * 0.304 * t).cos()),
];

#[test]
fn a_drift_is_no_mode_and_the_swing_comes_first_with_windows_of_its_own() {
    for (what, slow) in SLOW {
        for (noise_rad, quantum_rad, rate_hz) in
            [(2e-4, 0.0, 30.0), (1e-3, 0.0, 60.0), (3e-3, 0.0, 25.0), (5e-4, 2e-3, 30.0)]
        {
            for (cycles, xi) in [(25.0, 0.004), (14.0, 0.01)] {
                let what = format!("{what}, noise {noise_rad}, {cycles} cycles");
                let mut table = Table::of(vec![one_link(0.9756, xi, 0.3)]);
                (table.slow, table.noise_rad, table.quantum_rad, table.rate_hz) =
                    (slow, noise_rad, quantum_rad, rate_hz);
                table.duration_s = cycles / 0.9756;
                let found = table.identified(7);
                assert_bounded(&found, &what);
                let first = &found.modes[0];
                assert_is(first, 0.9756, &what);
                assert_eq!((first.number, found.swing_mode), (1, Some(1)), "{what}");
                assert!(first.envelope.is_some(), "{what}: {found}");
                assert!(
                    first.damping.estimate().is_some_and(|e| e.holds(xi) || (e.value / xi - 1.0).abs() < 0.1),
                    "{what}: {found}"
                );
                assert!(found.modes.len() == 1, "{what}: {found}");
                assert!(found.summary.starts_with("f₁ = 0.97"), "{what}: {}", found.summary);
            }
        }
    }
}

#[test]
fn a_drift_is_reported_apart() {
    let mut table = Table::of(vec![one_link(0.9756, 0.004, 0.3)]);
    table.slow = |t| 0.0035 * (TAU * t / 17.0).sin();
    let found = table.identified(1);
    assert!((0.006..0.009).contains(&found.drift_rad[0]), "{:?}", found.drift_rad);
    assert!(found.to_string().contains("drift over the record 0."), "{found}");
    table.slow = |_| 0.1;
    assert_eq!(table.identified(1).drift_rad, [0.0]);
}

#[test]
fn a_wandering_offset_is_rarely_a_mode_and_never_the_first() {
    let mut as_modes = 0;
    for seed in 0..20 {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        let mut series = Table::of(vec![one_link(0.9756, 0.004, 0.3)]).series(seed);
        let mut wandering = 0.0;
        for theta in series.theta_rad[0].iter_mut().flatten() {
            let step: f64 = StandardNormal.sample(&mut rng);
            wandering += 3e-4 * step;
            *theta += wandering;
        }
        let found = identify(&series, None).unwrap();
        assert_bounded(&found, "wandering");
        assert!((found.modes[0].frequency_hz.value / 0.9756 - 1.0).abs() < 3e-3, "{found}");
        as_modes += found.modes.len() - 1;
    }
    assert!(as_modes <= 4, "{as_modes} of 20");
}

#[test]
fn the_floor_and_the_equivalents_follow_the_swing() {
    let text = "[specimen]\nlength_m = 0.26\nlink_lengths_m = [0.26]\n";
    let experiment = Experiment::parse(text, std::path::Path::new("e.toml")).unwrap();
    let mut table = Table::of(vec![one_link(1.2, 0.004, 0.3)]);
    table.slow = SLOW[6].1;
    let found = identify(&table.series(2), Some(&experiment)).unwrap();
    assert!(!found.floor.as_ref().unwrap().below, "{found}");
    let k_eq = found.equivalents.as_ref().unwrap().k_eq_n_per_m.value;
    let mass = found.equivalents.as_ref().unwrap().mass_kg;
    assert!((k_eq / (mass * (TAU * 1.2).powi(2)) - 1.0).abs() < 0.01, "{found}");
    // two links: the stronger second mode comes first, the floor follows the first
    let slow = Swing { frequency_hz: 1.35, damping_ratio: 0.004, amplitudes_rad: vec![0.05, 0.07], phase_rad: 0.0 };
    let fast = Swing { frequency_hz: 3.1, damping_ratio: 0.003, amplitudes_rad: vec![0.2, -0.3], phase_rad: 0.0 };
    let found = identify(&Table::of(vec![slow, fast]).series(3), Some(&Experiment::default())).unwrap();
    assert_is(&found.modes[0], 3.1, "the strongest");
    assert_is(&found.modes[1], 1.35, "the slowest");
    assert_eq!(found.swing_mode, Some(2));
    assert!(!found.floor.as_ref().unwrap().below && found.to_string().contains("(mode 2; M ="), "{found}");
}

#[test]
fn two_modes_of_any_ratio_of_strength_are_found() {
    let mut missed = 0;
    let ratios = [0.03, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0];
    for (seed, ratio) in ratios.into_iter().enumerate() {
        for (duration_s, times) in [(10.0, 2.4), (25.0, 2.4), (25.0, 5.2)] {
            let what = format!("{ratio} in {duration_s} s at {times}");
            let small = f64::min(1.0, 1.0 / ratio);
            let amplitudes = |scale: f64, sign: f64| vec![0.15 * scale, sign * 0.2 * scale];
            let slow = Swing {
                frequency_hz: 1.1,
                damping_ratio: 0.004,
                amplitudes_rad: amplitudes(small, 1.0),
                phase_rad: 0.3,
            };
            let fast = Swing {
                frequency_hz: 1.1 * times,
                damping_ratio: 0.003,
                amplitudes_rad: amplitudes(small * ratio, -1.0),
                phase_rad: 1.1,
            };
            let found = Table { duration_s, noise_rad: 5e-4, ..Table::of(vec![slow, fast]) }.identified(seed as u64);
            assert_bounded(&found, &what);
            let order = if ratio > 1.0 { [1.1 * times, 1.1] } else { [1.1, 1.1 * times] };
            if ratio != 1.0 {
                assert_is(&found.modes[0], order[0], &what);
            }
            missed += 2 - found.modes.len();
            for mode in &found.modes {
                assert!(order.iter().any(|f| (mode.frequency_hz.value / f - 1.0).abs() < 5e-3), "{what}: {found}");
                assert!(mode.envelope.is_some() || duration_s * mode.frequency_hz.value < 12.0, "{what}: {found}");
            }
        }
    }
    assert!(missed <= 1, "{missed} weak modes missed");
}

#[test]
fn two_modes_closer_than_the_spectrum_separates_are_told_apart() {
    for (seed, (duration_s, times)) in [(12.0, 1.06), (12.0, 1.15), (60.0, 1.03)].into_iter().enumerate() {
        let swings = vec![one_link(1.1, 0.004, 0.15), one_link(1.1 * times, 0.003, 0.1)];
        let found = Table { duration_s, ..Table::of(swings) }.identified(seed as u64);
        let what = format!("{times} in {duration_s} s: {found}");
        assert_eq!(found.modes.len(), 2, "{what}");
        for frequency_hz in [1.1, 1.1 * times] {
            assert!(found.modes.iter().any(|mode| mode.frequency_hz.holds(frequency_hz)), "{what}");
        }
    }
}

#[test]
fn a_growing_amplitude_has_no_damping_ratio() {
    let found = Table::of(vec![one_link(1.1, -0.003, 0.05)]).identified(4);
    assert_bounded(&found, "growing");
    assert_is(&found.modes[0], 1.1, "growing");
    let Damping::NotIdentifiable { reason, .. } = &found.modes[0].damping else { panic!("{found}") };
    assert!(reason.contains("the amplitude grows, by 1.9 % a cycle"), "{reason}");
    assert!(found.summary.contains("ξ₁ not identifiable (the amplitude grows"), "{}", found.summary);
}

#[test]
fn damping_that_depends_on_amplitude_is_said_in_the_first_line() {
    // dA/dt = −b A² and dA/dt = −b₀: drag and dry friction
    let laws: [(Law, &str); 2] = [
        (|t| 0.4 / (1.0 + 0.4 * 0.1 * t), "grows with amplitude, as drag does"),
        (|t| 0.4 - 0.006 * t, "grows as the swing becomes small, as dry friction does"),
    ];
    for (amplitude, says) in laws {
        let t_s: Vec<f64> = (0..1500).map(|k| f64::from(k) / 30.0).collect();
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(3);
        let theta = t_s.iter().map(|t| {
            let noise: f64 = StandardNormal.sample(&mut rng);
            Some(amplitude(*t) * (TAU * 1.36 * t).cos() + 5e-4 * noise)
        });
        let theta_rad = vec![theta.collect()];
        let found = identify(&series(t_s, theta_rad), None).unwrap();
        assert!(found.summary.contains("% over the record") && found.summary.contains(says), "{}", found.summary);
    }
}

/// A chain whose lower link turns over a few times before it swings.
fn tumbling(until_s: f64, duration_s: f64) -> AngleSeries {
    let t_s: Vec<f64> = (0..(30.0 * duration_s) as usize).map(|k| k as f64 / 30.0).collect();
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(9);
    let mut angle = |t: f64, upper: bool| {
        let noise: f64 = StandardNormal.sample(&mut rng);
        let after = t - until_s;
        let swing = 0.4 * (-0.05 * after).exp() * (TAU * 0.9 * after).sin();
        let chaos = 1.9 * (1.7 * t + 2.0 * (0.9 * t).sin()).sin();
        let angle = match (after > 0.0, upper) {
            (true, true) => 0.7 * swing,
            (true, false) => 4.0 * PI + swing,
            (false, true) => chaos,
            (false, false) => 4.0 * PI * t / until_s + chaos,
        };
        Some(angle + 1e-3 * noise)
    };
    let theta_rad = vec![t_s.iter().map(|t| angle(*t, true)).collect(), t_s.iter().map(|t| angle(*t, false)).collect()];
    series(t_s, theta_rad)
}

#[test]
fn tumbling_is_said_with_the_time_that_ends_it_and_only_the_swing_is_used() {
    let found = identify(&tumbling(12.0, 40.0), None).unwrap();
    assert_bounded(&found, "tumbling");
    let tumbling_found = found.tumbling.as_ref().unwrap();
    let from_s = tumbling_found.swings_from_s.unwrap();
    assert!((11.0..12.3).contains(&from_s), "{tumbling_found:?}");
    assert!(found.summary.contains(&format!("--from {from_s:.2}")), "{}", found.summary);
    assert_is(&found.modes[0], 0.9, "after the tumbling");
    let endless = identify(&tumbling(39.0, 40.0), None).unwrap();
    assert_bounded(&endless, "endless");
    assert!(endless.modes.is_empty() && endless.summary.starts_with("not identifiable: θ"), "{}", endless.summary);
}

#[test]
fn no_random_table_gives_an_impossible_number() {
    for seed in 0..60 {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(1000 + seed);
        let log =
            |rng: &mut Xoshiro256PlusPlus, low: f64, high: f64| low * (high / low).powf(rng.random_range(0.0..1.0));
        let frequency_hz = log(&mut rng, 0.1, 5.0);
        let swings = (0..rng.random_range(0..3)).map(|_| {
            let amplitude = log(&mut rng, 1e-4, 2.0);
            Swing {
                frequency_hz: frequency_hz * log(&mut rng, 0.5, 5.0),
                damping_ratio: log(&mut rng, 1e-5, 0.6) * if rng.random_bool(0.1) { -0.02 } else { 1.0 },
                amplitudes_rad: vec![amplitude, amplitude * rng.random_range(-2.0..2.0)],
                phase_rad: rng.random_range(0.0..TAU),
            }
        });
        let table = Table {
            swings: swings.collect(),
            links: 2,
            duration_s: log(&mut rng, 0.8, 40.0),
            rate_hz: 30.0,
            noise_rad: log(&mut rng, 1e-5, 0.3),
            quantum_rad: if rng.random_bool(0.3) { 0.01 } else { 0.0 },
            slow: SLOW[rng.random_range(0..SLOW.len())].1,
        };
        assert_bounded(&table.identified(seed), &format!("seed {seed}"));
    }
}
