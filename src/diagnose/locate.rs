//! Where a model differs from a recording: place, time, amplitude, phase, frequency.

use rayon::prelude::*;

use super::any_law::any_laws;
use super::latent::{Assumed, Beyond, Filter, Latent, likeliest, sizes};
use super::refit::Refit;
use super::surroundings::{Input, Surroundings};
use super::torque::Phase;
use super::{Cause, Place, noise};
use crate::fit::{Record, Residuals, Verdict, residuals_of};
use crate::model::observe::chord_angles_rad;

/// Power of the motion at a frequency, over its largest, from which on a torque of that frequency is in step with it.
const IN_STEP: f64 = 1e-5;
/// Places are told from one another by this much in ln-likelihood.
const TOLD: f64 = 3.0;

/// The unknown of each form and at each place around a fit, likeliest first; `variance` scales that of the noise.
pub fn unknowns(fit: &Refit<'_>, variance: f64, assumed: Assumed) -> Vec<Latent> {
    let records = 0..fit.problem.records.len();
    let around: Option<Vec<Surroundings>> = records.map(|record| Surroundings::of(fit, record)).collect();
    let Some(around) = around else { return Vec::new() };
    let inputs = Input::ALL.into_par_iter().filter(|input| *input != Input::Joint || fit.problem.marks() > 1);
    let course = |input: Input| {
        let filters: Option<Vec<Filter<'_>>> = around
            .iter()
            .enumerate()
            .map(|(record, a)| Filter::new(fit, record, (a, variance), input, assumed))
            .collect();
        Some(likeliest(&filters?, input, typical(fit, input.place())))
    };
    let mut unknowns: Vec<Latent> = inputs.filter_map(course).collect();
    if assumed.beyond == Beyond::TheFit {
        unknowns.extend(any_laws(fit, &around, variance, |place| sizes(typical(fit, place))));
    }
    unknowns.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    unknowns
}

/// A large size of an unknown: gravity's torque at the largest angle, or a hundred times the noise.
fn typical(fit: &Refit<'_>, place: Place) -> f64 {
    if place == Place::Camera {
        return 10.0 * fit.problem.noise.iter().flat_map(|n| &n.sd_rad).copied().fold(0.0, f64::max);
    }
    let Ok((model, _)) = fit.problem.model(0, &fit.x[..fit.problem.free.len()]) else { return 1.0 };
    let largest_rad = fit.problem.records.iter().map(Record::largest_angle_rad).fold(0.0, f64::max);
    0.3 * model.gravity_m_s2() * model.chain().static_moment_kg_m(0) * largest_rad
}

/// Whether a support would move at a frequency at which the base model's own motion has power. Such a support can stand for any torque in step with
/// the swing, so it names nothing.
pub fn is_in_step(null: &Refit<'_>, frequency_hz: f64) -> bool {
    (0..null.problem.records.len()).any(|record| {
        let Some((model, swing, true_s)) = null.motion(record) else { return false };
        let chords: Vec<Vec<f64>> =
            true_s.iter().map(|t| chord_angles_rad(model.chain(), &swing.at(*t).theta_rad)).collect();
        let span_s = true_s[true_s.len() - 1] - true_s[0];
        let bin = (frequency_hz * span_s).round() as usize;
        (0..null.problem.marks()).any(|link| {
            let power = noise::spectrum(&chords.iter().map(|c| c[link]).collect::<Vec<f64>>());
            let strongest = power[1..].iter().copied().fold(0.0, f64::max);
            let near = bin.saturating_sub(1)..(bin + 2).min(power.len());
            power[near.start.min(power.len())..near.end].iter().any(|p| *p > IN_STEP * strongest)
        })
    })
}

/// Where what a base model lacks would act, whatever it is: where the unknown around it makes the recordings likeliest, or nearly so if that is where the
/// nearest of the named effects acts.
pub fn place_of_all(null: &Refit<'_>, of_nearest: Option<Place>) -> Option<Place> {
    let unknowns = unknowns(null, 1.0, Assumed::SUDDEN);
    let likeliest = unknowns.first().filter(|likeliest| likeliest.gain > 0.0)?;
    let is_as_likely = |place: &Place| unknowns.iter().any(|u| u.place() == *place && u.gain > likeliest.gain - TOLD);
    of_nearest.filter(is_as_likely).or_else(|| Some(likeliest.place()))
}

/// What a fit leaves of a recording.
pub fn residuals(fit: &Refit<'_>, record: usize) -> Option<Residuals> {
    residuals_of(&fit.problem, &fit.x, record).ok()
}

impl Phase {
    /// Of an effect.
    pub fn of(cause: Cause) -> Option<Self> {
        match cause {
            Cause::HingeViscous
            | Cause::HingeCoulomb
            | Cause::JointHysteretic
            | Cause::AirLinear
            | Cause::AirQuadratic
            | Cause::TimeBase
            | Cause::DroppedFrames
            | Cause::DifferentialLag => Some(Self::Velocity),
            Cause::HingeStiffness
            | Cause::JointCubicStiffness
            | Cause::RestCurl
            | Cause::AddedMass
            | Cause::DistributedFlexibility
            | Cause::AngleGain => Some(Self::Position),
            Cause::SideForce | Cause::SupportMotion | Cause::CameraTilt => None,
        }
    }
}

/// Where, when and how the base model departs from the first recording that it does not reproduce.
#[derive(Debug, Clone, Default)]
pub struct Departure {
    /// From and until when.
    pub time_s: Option<[f64; 2]>,
    /// Amplitudes there.
    pub amplitude_rad: Option<[f64; 2]>,
    /// Strongest frequency of what is left.
    pub frequency_hz: Option<f64>,
    /// Phase with which the residual goes: with the velocity (a delay) or with the position (a gain).
    pub goes_with: Option<Phase>,
}

/// The departure of the base model.
pub fn departure(null: &Refit<'_>) -> Departure {
    for record in 0..null.problem.records.len() {
        let Some(residuals) = residuals(null, record) else { continue };
        let Ok((model, _)) = null.problem.model(record, &null.x[..null.problem.free.len()]) else { continue };
        let window_s = std::f64::consts::TAU / model.pace_rad_s();
        let verdict = Verdict::of(&residuals, window_s);
        let wrong: Vec<_> = verdict.windows.iter().filter(|w| w.links.iter().any(|l| l.misfit)).collect();
        let (Some(first), Some(last)) = (wrong.first(), wrong.last()) else { continue };
        let amplitudes = wrong.iter().flat_map(|w| w.links.iter().map(|l| l.amplitude_rad));
        let (least, most) = amplitudes.fold((f64::INFINITY, 0.0f64), |(a, b), v| (a.min(v), b.max(v)));
        return Departure {
            time_s: Some([first.from_s, last.until_s]),
            amplitude_rad: Some([least, most]),
            frequency_hz: strongest_hz(&residuals, model.pace_rad_s()),
            goes_with: goes_with(&residuals),
        };
    }
    Departure::default()
}

/// Which explains more of what is left: a delay or a gain, window by window taken together.
fn goes_with(residuals: &Residuals) -> Option<Phase> {
    let (mut delay, mut gain, mut rates, mut angles) = (0.0, 0.0, 0.0, 0.0);
    for r in residuals.values.iter().flatten() {
        delay += r.left_rad() * r.rate_rad_s;
        gain += r.left_rad() * r.predicted_rad;
        rates += r.rate_rad_s * r.rate_rad_s;
        angles += r.predicted_rad * r.predicted_rad;
    }
    (rates > 0.0 && angles > 0.0).then(|| {
        // a torque in phase with the velocity changes the amplitude, one with the position the phase
        if delay * delay / rates > gain * gain / angles { Phase::Position } else { Phase::Velocity }
    })
}

/// The frequency at which what is left is strongest.
fn strongest_hz(residuals: &Residuals, pace_rad_s: f64) -> Option<f64> {
    let values = residuals.values.iter().max_by_key(|v| v.len())?;
    let span_s = values.last()?.t_s - values.first()?.t_s;
    let swing_hz = pace_rad_s / std::f64::consts::TAU;
    let count = (8.0 * swing_hz * span_s) as usize;
    let power = |k: usize| {
        let rate = std::f64::consts::TAU * k as f64 / span_s;
        let sum = values.iter().fold([0.0; 2], |s, r| {
            let (sin, cos) = (rate * r.t_s).sin_cos();
            [s[0] + r.left_rad() * sin, s[1] + r.left_rad() * cos]
        });
        sum[0] * sum[0] + sum[1] * sum[1]
    };
    let best = (1..count).map(|k| (k, power(k))).max_by(|a, b| a.1.total_cmp(&b.1))?;
    Some(best.0 as f64 / span_s)
}
