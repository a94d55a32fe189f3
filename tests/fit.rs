//! Simulated swings through `fit`: the parameters come back, the intervals cover, and a model that lacks something is found out.

use freeswing::experiment::{Effects, Experiment};
use freeswing::fit::{Fit, Record, Verdict, fit};
use freeswing::model::modes::{Linearised, Modes};
use freeswing::model::{ForwardModel, Parameter, State, Trajectory};
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, Normal};
use rayon::prelude::*;

const BASE: [Parameter; 3] = [Parameter::JointStiffness, Parameter::JointDamping, Parameter::HingeViscous];

/// A swing of the default strip.
struct Case {
    experiment: Experiment,
    duration_s: f64,
    rate_hz: f64,
    noise_rad: f64,
}

impl Case {
    fn new(k: f64, c: f64, hinge: f64) -> Self {
        let mut experiment = Experiment::default();
        (experiment.model.k_eq_n_m_per_rad, experiment.model.c_eq_n_m_s_per_rad) = (k, c);
        experiment.model.effects.hinge_viscous = Some(hinge);
        experiment.model.release_rad = vec![0.5, 0.62];
        Self { experiment, duration_s: 20.0, rate_hz: 30.0, noise_rad: 1e-3 }
    }

    fn record(&self, seed: u64) -> Record {
        let model = ForwardModel::of(&self.experiment).unwrap();
        let start = State::at_rest(&self.experiment.model.release_rad);
        let swing = Trajectory::swing(&model, &start, 0.0, self.duration_s).unwrap();
        let rows = (self.duration_s * self.rate_hz) as usize;
        let t_s: Vec<f64> = (0..rows).map(|i| i as f64 / self.rate_hz).collect();
        let (noise, mut random) = (Normal::new(0.0, self.noise_rad).unwrap(), StdRng::seed_from_u64(seed));
        let links = start.theta_rad.len();
        let mut theta_rad = vec![Vec::with_capacity(rows); links];
        for t_s in &t_s {
            for (link, angle_rad) in swing.at(*t_s).theta_rad.iter().enumerate() {
                theta_rad[link].push(Some(angle_rad + noise.sample(&mut random)));
            }
        }
        Record::uniform("simulated", t_s, theta_rad)
    }
}

/// Start values of a file that knows nothing of the case.
fn start() -> Experiment {
    let mut experiment = Experiment::default();
    experiment.model.effects = Effects { hinge_viscous: Some(0.0), ..Effects::default() };
    experiment
}

fn value(fit: &Fit, parameter: Parameter) -> f64 {
    fit.estimate(parameter).unwrap().value
}

#[test]
fn simulate_and_fit_returns_the_parameters() {
    for (seed, (k, c, hinge)) in [(2e-4, 2e-6, 1e-7), (1e-5, 3e-7, 4e-7), (1e-3, 2e-5, 2e-7)].into_iter().enumerate() {
        let fit = fit(&[Case::new(k, c, hinge).record(seed as u64)], &start(), &BASE).unwrap();
        for (parameter, truth) in BASE.into_iter().zip([k, c, hinge]) {
            let estimate = fit.estimate(parameter).unwrap();
            assert!((estimate.value - truth).abs() < 4.0 * estimate.sd, "{parameter} {truth}: {estimate:?}");
        }
        assert!((value(&fit, Parameter::JointStiffness) / k - 1.0).abs() < 0.03);
        assert!(!fit.coloured && Verdict::of(&fit.residuals[0], 0.8).is_reproduced());
    }
}

#[test]
fn outliers_and_a_missing_stretch_do_no_harm() {
    let case = Case::new(2e-4, 2e-6, 1e-7);
    let mut record = case.record(5);
    for (link, row) in [(0, 40), (0, 41), (1, 100), (1, 333), (0, 512)] {
        record.theta_rad[link][row] = Some(1.5);
    }
    for row in 200..290 {
        record.theta_rad[0][row] = None;
        record.theta_rad[1][row] = None;
    }
    let fit = fit(&[record], &start(), &BASE).unwrap();
    assert!(fit.outliers[0].len() >= 5 && fit.outliers[0].len() <= 8, "{:?}", fit.outliers);
    let stiffness = fit.estimate(Parameter::JointStiffness).unwrap();
    assert!((stiffness.value - 2e-4).abs() < 4.0 * stiffness.sd && stiffness.sd < 1e-6, "{stiffness:?}");
}

#[test]
fn a_value_in_twenty_that_is_wrong_does_no_harm() {
    let mut record = Case::new(2e-4, 2e-6, 1e-7).record(6);
    // among them the last but one
    for row in (19..record.len()).step_by(20).chain([record.len() - 2]) {
        record.theta_rad[0][row] = record.theta_rad[0][row].map(|angle| angle + 0.2 * (row as f64).sin().signum());
    }
    let wrong = record.len() / 20 + 1;
    let fit = fit(&[record], &start(), &BASE).unwrap();
    assert!((wrong - 1..wrong + 3).contains(&fit.outliers[0].len()), "{} of {wrong}", fit.outliers[0].len());
    assert!(Verdict::of(&fit.residuals[0], 0.8).is_reproduced());
}

#[test]
fn noise_that_is_correlated_is_no_misfit() {
    let case = Case { noise_rad: 0.0, ..Case::new(2e-4, 2e-6, 1e-7) };
    let mut record = case.record(7);
    let (mut random, fresh) = (StdRng::seed_from_u64(7), Normal::new(0.0, 1e-3).unwrap());
    for angles in &mut record.theta_rad {
        let mut noise = 0.0;
        for angle in angles.iter_mut().flatten() {
            noise = 0.4 * noise + fresh.sample(&mut random);
            *angle += noise;
        }
    }
    let fit = fit(&[record], &start(), &BASE).unwrap();
    assert!(Verdict::of(&fit.residuals[0], 0.8).is_reproduced(), "{}", Verdict::of(&fit.residuals[0], 0.8).statement());
}

#[test]
fn two_recordings_share_their_parameters_and_say_more_than_one() {
    let (large, mut small) = (Case::new(2e-4, 2e-6, 1e-7), Case::new(2e-4, 2e-6, 1e-7));
    small.experiment.model.release_rad = vec![0.2, -0.1];
    let (large, small) = (large.record(1), small.record(2));
    let one = fit(std::slice::from_ref(&large), &start(), &BASE).unwrap();
    let both = fit(&[large, small], &start(), &BASE).unwrap();
    let sd = |fit: &Fit| fit.estimate(Parameter::JointStiffness).unwrap().sd;
    assert!(sd(&both) < 0.92 * sd(&one), "{} {}", sd(&both), sd(&one));
    assert!((value(&both, Parameter::JointStiffness) - 2e-4).abs() < 4.0 * sd(&both));
    assert!((both.starts[1][0] - 0.2).abs() < 2e-3 && (both.starts[1][1] + 0.1).abs() < 2e-3, "{:?}", both.starts);
}

#[test]
fn friction_that_the_model_lacks_is_not_reproduced_until_it_is_let_in() {
    let mut dry = Case::new(2e-4, 2e-6, 1e-7);
    dry.experiment.model.effects.hinge_coulomb = Some(3e-7);
    dry.noise_rad = 3e-4;
    let record = [dry.record(3)];
    let without = fit(&record, &start(), &BASE).unwrap();
    let verdict = Verdict::of(&without.residuals[0], 0.8);
    assert!(!verdict.is_reproduced() && verdict.statement().starts_with("not reproduced: from"));
    let with = fit(&record, &start(), &[&BASE[..], &[Parameter::HingeCoulomb]].concat()).unwrap();
    assert!(Verdict::of(&with.residuals[0], 0.8).is_reproduced());
    let friction = with.estimate(Parameter::HingeCoulomb).unwrap();
    assert!((friction.value - 3e-7).abs() < 4.0 * friction.sd && friction.low > 0.0, "{friction:?}");
}

#[test]
fn a_damper_in_the_joint_of_a_first_mode_swing_is_said_to_be_undetermined() {
    let mut quiet = Case::new(0.02, 1e-6, 1e-7);
    quiet.experiment.model.release_rad = vec![0.3, 0.3];
    let fit = fit(&[quiet.record(8)], &start(), &BASE).unwrap();
    let joint = fit.estimate(Parameter::JointDamping).unwrap();
    assert!(!joint.is_determined(), "{joint:?}");
    assert!(fit.estimate(Parameter::HingeViscous).unwrap().is_determined());
}

#[test]
fn one_link_is_fitted_too() {
    let mut one = Case::new(0.0, 0.0, 2e-7);
    one.experiment.specimen.link_lengths_m = vec![0.2];
    one.experiment.model.release_rad = vec![0.4];
    let mut from = start();
    from.specimen.link_lengths_m = vec![0.2];
    let fit = fit(&[one.record(4)], &from, &[Parameter::HingeViscous]).unwrap();
    let hinge = fit.estimate(Parameter::HingeViscous).unwrap();
    assert!((hinge.value - 2e-7).abs() < 4.0 * hinge.sd && hinge.sd < 1e-8, "{hinge:?}");
}

/// Frequencies (Hz) and damping ratios of both modes.
fn modes_of(values: [f64; 3]) -> Vec<[f64; 2]> {
    let case = Case::new(values[0], values[1], values[2]);
    let modes = Modes::of(&Linearised::of(&case.experiment).unwrap()).unwrap();
    modes.modes.iter().map(|m| [m.frequency_hz, m.damping_ratio]).collect()
}

/// Errors relative to the truth, and whether the interval holds it, of K, C and c; errors of f and ξ of both modes.
struct Scored {
    relative: [Option<f64>; 3],
    covered: [bool; 3],
    frequency: Vec<f64>,
    damping: Vec<Option<f64>>,
}

fn score(index: u64) -> Scored {
    let mut random = StdRng::seed_from_u64(0x5eed_0000 + index);
    let mut between = |low: f64, high: f64| (random.random_range(low.ln()..high.ln())).exp();
    let (k, duration_s, noise_rad) = (between(1e-5, 1e-3), between(20.0, 60.0), between(0.02, 0.25).to_radians());
    let (c, hinge) = (k.sqrt() * between(1e-5, 3e-4), between(2e-8, 6e-7));
    let release = [between(0.2, 0.7), between(0.05, 0.3)];
    let mut case = Case::new(k, c, hinge);
    case.experiment.model.release_rad = vec![release[0], release[0] + release[1]];
    (case.duration_s, case.noise_rad) = (duration_s, noise_rad);
    let fit = fit(&[case.record(index)], &start(), &BASE).unwrap();
    let truth = [k, c, hinge];
    let estimates = BASE.map(|p| *fit.estimate(p).unwrap());
    let (found, exact) = (modes_of(estimates.map(|e| e.value)), modes_of(truth));
    let determined = estimates[1].is_determined() && estimates[2].is_determined();
    Scored {
        relative: std::array::from_fn(|i| estimates[i].is_determined().then(|| estimates[i].value / truth[i] - 1.0)),
        covered: std::array::from_fn(|i| (estimates[i].low..=estimates[i].high).contains(&truth[i])),
        frequency: found.iter().zip(&exact).map(|(f, e)| f[0] / e[0] - 1.0).collect(),
        damping: found.iter().zip(&exact).map(|(f, e)| determined.then(|| f[1] / e[1] - 1.0)).collect(),
    }
}

fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut sizes: Vec<f64> = values.map(f64::abs).collect();
    sizes.sort_by(f64::total_cmp);
    sizes[sizes.len() / 2]
}

fn bank(cases: u64) -> ([f64; 3], [f64; 3], [f64; 2], [f64; 2]) {
    let scored: Vec<Scored> = (0..cases).into_par_iter().map(score).collect();
    let relative = std::array::from_fn(|i| median(scored.iter().filter_map(|s| s.relative[i])));
    let covered = std::array::from_fn(|i| scored.iter().filter(|s| s.covered[i]).count() as f64 / scored.len() as f64);
    let of_mode = |of: &dyn Fn(&Scored, usize) -> Option<f64>| {
        std::array::from_fn(|mode| median(scored.iter().filter_map(|s| of(s, mode))))
    };
    let frequency = of_mode(&|s, mode| s.frequency.get(mode).copied());
    let damping = of_mode(&|s, mode| s.damping.get(mode).copied().flatten());
    for (name, i) in ["K", "C", "hinge"].into_iter().zip(0..) {
        let told = scored.iter().filter(|s| s.relative[i].is_some()).count();
        println!(
            "{name}: median error {:.3} % where told from zero ({told} of {cases}), intervals cover {:.1} %",
            1e2 * relative[i],
            1e2 * covered[i]
        );
    }
    println!(
        "median error of f {:.4} and {:.4} %, of ξ {:.2} and {:.2} %",
        1e2 * frequency[0],
        1e2 * frequency[1],
        1e2 * damping[0],
        1e2 * damping[1]
    );
    (relative, covered, frequency, damping)
}

#[test]
fn a_dozen_simulated_recordings_come_back() {
    let (relative, _, frequency, damping) = bank(12);
    assert!(relative[0] <= 0.01 && relative[1] <= 0.03, "{relative:?}");
    assert!(frequency[0] <= 2e-4 && damping[0] <= 0.02, "{frequency:?} {damping:?}");
}

#[test]
#[ignore = "slow: run with `make accuracy`"]
fn two_hundred_simulated_recordings_come_back_and_the_intervals_cover() {
    let (relative, covered, frequency, damping) = bank(200);
    assert!(frequency[0] <= 2e-4 && frequency[1] <= 2e-4, "{frequency:?}");
    assert!(damping[0] <= 0.02 && damping[1] <= 0.02, "{damping:?}");
    assert!(relative[0] <= 0.01 && relative[1] <= 0.02, "{relative:?}");
    let mean = covered.iter().sum::<f64>() / 3.0;
    assert!((0.93..=0.97).contains(&mean), "{covered:?}");
}
