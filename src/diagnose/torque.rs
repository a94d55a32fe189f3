//! The course of the torque that a model lacks, at the place where it explains most: what to add to the fitted motion, row by row, for the
//! recording to follow.

use super::effect::{Phase, Place};
use super::latent::{Filter, Form, LatentConfig, LatentForce};
use super::latent_forces::unknowns;
use super::linearisation::{Input, Linearisation};
use super::locate::FEWEST_CYCLES;
use super::refit::Refit;
use super::{energy, noise};

/// A torque that works less than this part of what it could, with the angle or with its rate, has no phase (judgement).
const NO_PHASE: f64 = 0.3;
/// Rows in each cycle of a torque whose frequency is told (judgement).
const ROWS_A_CYCLE: usize = 4;

/// The torque that a model lacks, through one recording.
#[derive(Debug, Clone)]
pub struct MissingTorque {
    /// Where it acts.
    pub place: Place,
    /// The recording.
    pub record: usize,
    /// Stamps.
    pub t_s: Vec<f64>,
    /// At each of them, with its standard deviation (N·m; of the camera an angle in rad).
    pub course: Vec<(f64, f64)>,
    /// The angle that it works on (the hinge's, the bend of the joint, that of the whole strip), and its rate (rad, rad/s).
    pub works_on: Vec<(f64, f64)>,
    /// Root mean square of the course.
    pub rms: f64,
    /// Whether it goes with the angle at its place or with the rate.
    pub phase: Option<Phase>,
    /// Its strongest frequency.
    pub frequency_hz: Option<f64>,
    /// Whether most of it is constant.
    pub steady: bool,
    /// What it takes from the swing, as a share of all that the fit dissipates.
    pub energy_share: Option<f64>,
}

/// The torque that the base model lacks, at a place, or where it explains most, in the recording that the base model reproduces worst; `fit` is the
/// likeliest one of the table, whose motion follows the recordings.
pub fn missing(fit: &Refit<'_>, null: &Refit<'_>, at: Option<Place>) -> Option<MissingTorque> {
    let variance = fit.variance_ratio();
    let worst = |record: &usize| null.relative_residual_of(*record);
    let record = (0..fit.problem.records.len()).max_by(|a, b| worst(a).total_cmp(&worst(b)))?;
    let around = unknowns(fit, variance, LatentConfig::TOTAL);
    let likeliest = around.iter().find(|u| u.gain > 0.0 && at.is_none_or(|place| u.place() == place))?;
    MissingTorque::of(fit, record, likeliest, variance)
}

impl MissingTorque {
    /// Beside a fit, in one of its recordings; `variance` scales that of the noise.
    pub fn of(fit: &Refit<'_>, record: usize, unknown: &LatentForce, variance: f64) -> Option<Self> {
        let Form::TimeHistory(input) = unknown.form else { return None };
        let around = Linearisation::of(fit, record)?;
        let course = Filter::new(fit, record, (&around, variance), input, LatentConfig::TOTAL)?.course(unknown.size);
        let rms = (course.iter().map(|c| c.0 * c.0).sum::<f64>() / course.len().max(1) as f64).sqrt();
        let torque: Vec<f64> = course.iter().map(|c| c.0).collect();
        let span_s = around.t_s.last()? - around.t_s.first()?;
        let power = noise::spectrum(&torque);
        let strongest = (1..power.len()).max_by(|a, b| power[*a].total_cmp(&power[*b]));
        // with fewer rows per cycle it is noise
        let strongest = strongest.filter(|k| ROWS_A_CYCLE * k <= torque.len());
        let mean = torque.iter().sum::<f64>() / torque.len().max(1) as f64;
        let steady = mean * mean > 0.5 * rms * rms;
        let mut missing = Self {
            place: input.place(),
            record,
            rms,
            phase: None,
            frequency_hz: strongest.filter(|k| !steady && *k >= FEWEST_CYCLES).map(|k| k as f64 / span_s),
            steady,
            energy_share: None,
            works_on: Vec::new(),
            t_s: around.t_s.clone(),
            course,
        };
        if input != Input::Camera {
            missing.work(fit, &around, input);
        }
        Some(missing)
    }

    /// What it does with the angle and the rate that are conjugate to it.
    fn work(&mut self, fit: &Refit<'_>, around: &Linearisation, input: Input) {
        let (mut torque, mut angle, mut rate, mut with_angle, mut with_rate, mut taken_j) =
            (0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
        for (k, row) in around.rows.iter().enumerate() {
            let pattern = around.pattern(input, &row.theta_rad);
            let along = |values: &[f64]| pattern.iter().zip(values).map(|(p, v)| p * v).sum::<f64>();
            let (u, q, v) = (self.course[k].0, along(&row.theta_rad), along(&row.rate[..around.links]));
            self.works_on.push((q, v));
            torque += u * u;
            angle += q * q;
            rate += v * v;
            with_angle += u * q;
            with_rate += u * v;
            if k > 0 {
                taken_j -= u * v * (around.t_s[k] - around.t_s[k - 1]);
            }
        }
        let part = |work: f64, of: f64| (work / (torque * of).sqrt().max(1e-300)).abs();
        let (angle, rate) = (part(with_angle, angle), part(with_rate, rate));
        if angle.max(rate) > NO_PHASE && !self.steady {
            self.phase = Some(if angle > rate { Phase::Position } else { Phase::Velocity });
        }
        let lost_j: f64 = energy::dissipated_j(fit, self.record).iter().sum();
        self.energy_share = (lost_j > 0.0).then(|| taken_j / lost_j);
    }
}
