//! The verdict: adequate, identified, ambiguous or unknown; what cannot be told apart; and the measurement that would tell.

use super::evidence::{self, Scatter, normalised};
use super::heldout::HeldOut;
use super::latent::Latent;
use super::noise::{BEYOND_NOISE, COLOURED};
use super::refit::{self, Refit};
use super::{Cause, MAIN_EFFECTS, Place, locate};
use crate::fit::whitening::RecordNoise;
use crate::model::Parameter;
use crate::statistics::median_step_s;

/// A verdict stands alone when it is at least this probable.
const ALONE: f64 = 0.75;
/// Of the names that fit within the noise this part stands for something outside the table that they imitate: on training banks of the concealed benchmark,
/// names stated at 0.99 were right in 97 of 100 cases.
const IMITATED: f64 = 0.03;
/// Each name beyond two is with these odds what it seems to be: many free numbers together imitate much, and no bank has calibrated them.
const BEYOND_TWO: f64 = 0.7;
/// A hypothesis this much less probable than the best named one is told from it.
const TOLD_APART: f64 = 0.05;
/// A named law may be wrong by this part of its own torque before something unknown is suspected beside it.
const LAW_SHARE: f64 = 0.002;
/// A hysteresis by more: how it goes over from spring to slip has as many forms as there are authors.
const HYSTERESIS_SHARE: f64 = 0.05;
/// A support in step with the swing can be what it seems to be, or stand for a torque that is not known: on the same banks it was what it seemed four times
/// out of five.
const IN_STEP: f64 = 0.8;
/// The same beside a law of physics, where it gains less than this many standard deviations: three free numbers complete a law that is only nearly right, and
/// a law outside the table that has a near relative in it is more often what has been filmed.
const BESIDE_A_LAW: f64 = 0.35;
const SLIGHT: f64 = 25.0;
/// Frames are missing whole. A jump of the clock by another part of them can be meant, or stand for a knock, or for a part that fell off.
const NOT_WHOLE: f64 = 0.6;
/// A jump is of whole frames if it is by so many standard deviations, or by this part of a frame.
const WHOLE_SD: f64 = 3.0;
const WHOLE: f64 = 0.05;
/// Where the best of the table leaves far more than noise, its names stand if they leave at most this part of what the base model leaves of what was not fitted. Of what a rig does they may be the
/// largest part, or the nearest relatives of what is not in the table: the odds are even.
const PROVEN: f64 = 0.5;
const NEAREST: f64 = 0.5;

/// Probabilities below this change nothing.
const NEGLIGIBLE: f64 = 1e-4;

/// What the recordings say.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Status {
    /// Nothing is missing that could be seen.
    Adequate,
    /// One answer.
    Identified,
    /// Several answers that the recordings do not tell apart.
    Ambiguous,
    /// Something is missing that is not in the table.
    Unknown,
}

impl Status {
    /// The name in files.
    pub fn id(self) -> &'static str {
        match self {
            Self::Adequate => "adequate",
            Self::Identified => "identified",
            Self::Ambiguous => "ambiguous",
            Self::Unknown => "unknown",
        }
    }
}

/// A hypothesis with its probability.
#[derive(Debug, Clone)]
pub struct Weighed<'a> {
    /// Fitted.
    pub fit: Refit<'a>,
    /// ln of evidence and prior.
    pub ln_posterior: f64,
    /// Posterior.
    pub probability: f64,
    /// Posterior where nothing outside the table is at work.
    pub if_named: f64,
}

/// The verdict.
#[derive(Debug, Clone)]
pub struct Verdict {
    /// What kind.
    pub status: Status,
    /// The best names.
    pub effects: Vec<Cause>,
    /// Every effect that the recordings do not tell from them.
    pub class: Vec<Cause>,
    /// Of the answer as it is given.
    pub probability: f64,
    /// That the truth is one of the hypotheses that make up the class.
    pub class_probability: f64,
    /// Of anything outside the table.
    pub unknown: f64,
    /// The measurement that would split the class.
    pub to_decide: Option<String>,
}

/// Hypotheses beside the unknown.
#[derive(Debug)]
pub struct Weighing<'a> {
    /// With their probabilities, likeliest first.
    pub weighed: Vec<Weighed<'a>>,
    /// The probability of something else.
    pub unknown: f64,
    /// That something around the likeliest fit, at each place.
    pub unknowns: Vec<Latent>,
}

/// Weighs hypotheses; `remainder` gives the unknown around the likeliest fit, and the torque of that fit's own effects (N·m).
pub fn weigh<'a>(
    fits: Vec<Refit<'a>>,
    values: usize,
    candidates: usize,
    remainder: impl Fn(&Refit<'a>, f64) -> (Vec<Latent>, f64),
) -> Weighing<'a> {
    let least = refit::least(&fits);
    let scatter = least.map_or(Scatter::NOISE, |best| Scatter::of(best, values));
    let least_without = |cause: Cause| {
        let others = fits.iter().filter(|f| !f.hypothesis.causes.contains(&cause));
        others.map(|f| f.chi2).fold(f64::INFINITY, f64::min)
    };
    let ln = |f: &Refit<'_>| {
        evidence::ln_evidence(f, scatter, least_without) + evidence::ln_prior(&f.hypothesis, candidates)
    };
    let mut posterior: Vec<f64> = fits.iter().map(ln).collect();
    let best = (0..fits.len()).max_by(|a, b| posterior[*a].total_cmp(&posterior[*b])).unwrap_or(0);
    let (latents, added_n_m) = remainder(&fits[best], fits[best].chi2 / values as f64);
    posterior.push(
        posterior[best]
            + evidence::PRIOR_UNKNOWN.ln()
            + unknown_gain(&latents, law_error_n_m(&fits[best], added_n_m), slow_errors_rad(&fits[best])),
    );
    let if_named = normalised(&posterior[..fits.len()]);
    let mut probability = normalised(&posterior);
    let mut unknown = probability.pop().unwrap_or(0.0);
    // a name, above all a support that moves, may be a stand-in for what is not known
    for (fit, probability) in fits.iter().zip(&mut probability).filter(|(_, p)| **p > NEGLIGIBLE) {
        let genuine = genuine(fit, &fits);
        unknown += (1.0 - genuine) * *probability;
        *probability *= genuine;
    }
    let mut weighed: Vec<Weighed<'a>> = (fits.into_iter().zip(posterior).zip(probability.into_iter().zip(if_named)))
        .map(|((fit, ln_posterior), (probability, if_named))| Weighed { fit, ln_posterior, probability, if_named })
        .collect();
    // where the unknown takes all, or next to all, their order among themselves still counts
    weighed.sort_by(|a, b| (b.probability.total_cmp(&a.probability)).then(b.ln_posterior.total_cmp(&a.ln_posterior)));
    Weighing { weighed, unknown, unknowns: latents }
}

/// The odds that a fit's effects are what has been filmed, and stand for nothing else.
fn genuine(fit: &Refit<'_>, fits: &[Refit<'_>]) -> f64 {
    if fit.hypothesis.causes.is_empty() {
        return 1.0;
    }
    let beyond_two = fit.hypothesis.causes.len().saturating_sub(MAIN_EFFECTS) as i32;
    let whole = if misses_part_of_a_frame(fit) { NOT_WHOLE } else { 1.0 };
    let named = whole * (1.0 - IMITATED) * BEYOND_TWO.powi(beyond_two);
    let Some(hz) = fit.value(Parameter::SupportFrequency) else { return named };
    let fit_of = |causes: &[Cause]| fits.iter().find(|f| f.hypothesis.causes == causes);
    let others: Vec<Cause> = fit.hypothesis.causes.iter().copied().filter(|c| *c != Cause::SupportMotion).collect();
    let is_slight = fit_of(&others).is_some_and(|without| without.chi2 - fit.chi2 < SLIGHT * SLIGHT);
    if is_slight && others.iter().any(|c| c.place() != Place::Camera) {
        return BESIDE_A_LAW * named;
    }
    if fit_of(&[]).is_some_and(|null| locate::is_in_step(null, hz)) { IN_STEP * named } else { named }
}

/// Whether a fit misses frames, and not a whole number of them.
fn misses_part_of_a_frame(fit: &Refit<'_>) -> bool {
    let (Some(missing_s), Some((record, _))) = (fit.value(Parameter::DroppedFrames), fit.hypothesis.dropped) else {
        return false;
    };
    let Some(frame_s) = median_step_s(&fit.problem.records[record].t_s) else { return false };
    let sd = fit.covariance(&[Parameter::DroppedFrames])[(0, 0)].sqrt() / frame_s;
    let frames = missing_s / frame_s;
    let whole = frames.round().abs().max(1.0).copysign(frames);
    (frames - whole).abs() > (WHOLE_SD * sd).max(WHOLE)
}

/// By how much the torque of a fit's laws may be wrong.
fn law_error_n_m(fit: &Refit<'_>, added_n_m: f64) -> f64 {
    let is_hysteretic = fit.hypothesis.causes.contains(&Cause::JointHysteretic);
    if is_hysteretic { HYSTERESIS_SHARE * added_n_m } else { LAW_SHARE * added_n_m }
}

/// The errors that tracked angles may have from one swing to the next, as large as those in step with it.
fn slow_errors_rad(fit: &Refit<'_>) -> f64 {
    let of_record = |noise: &RecordNoise| noise.in_step * noise.sd_rad.iter().copied().fold(0.0, f64::max);
    fit.problem.noise.iter().map(of_record).fold(0.0, f64::max)
}

/// How much likelier an unknown of any size makes the recordings than one that a law's own error, or the tracker's, allows.
fn unknown_gain(latents: &[Latent], law_error_n_m: f64, slow_errors_rad: f64) -> f64 {
    let within =
        |latent: &Latent, allowed: f64| latent.tried.iter().filter(|t| t.0 <= allowed).map(|t| t.1).fold(0.0, f64::max);
    let is_camera = |latent: &&Latent| latent.place() == Place::Camera;
    let wander = latents.iter().find(is_camera).map_or(0.0, |camera| within(camera, slow_errors_rad));
    let of = |latent: &Latent| {
        // an offset that wanders may be noise of another colour than was learnt
        let own = if is_camera(&latent) { COLOURED } else { within(latent, law_error_n_m) };
        latent.gain - own.max(wander)
    };
    // any size is as likely as any other, at any place
    let looks: usize = latents.iter().map(|l| l.tried.len()).sum();
    latents.iter().map(of).fold(f64::NEG_INFINITY, f64::max) - (looks.max(1) as f64).ln()
}

impl Verdict {
    /// From the probabilities, and the proof of the likeliest.
    pub fn of(weighed: &[Weighed<'_>], unknown: f64, marks: usize, proof: Option<&HeldOut>) -> Self {
        let adequate: f64 = weighed.iter().filter(|w| w.fit.hypothesis.causes.is_empty()).map(|w| w.probability).sum();
        let named = 1.0 - adequate - unknown;
        let nothing = |status, probability| Self {
            status,
            effects: Vec::new(),
            class: Vec::new(),
            probability,
            class_probability: probability,
            unknown,
            to_decide: None,
        };
        if unknown > adequate && unknown > named {
            let proven = proof.is_some_and(|proof| proof.leaves() <= PROVEN) && is_beyond_noise(&weighed[0].fit);
            return if proven {
                Self::naming(weighed, |w| NEAREST * w.if_named, 1.0 - NEAREST, marks)
            } else {
                nothing(Status::Unknown, unknown)
            };
        }
        if adequate >= named {
            return nothing(Status::Adequate, adequate);
        }
        Self::naming(weighed, |w| w.probability, unknown, marks)
    }

    /// Whether something outside the table is at least as likely as the names that are given.
    pub fn leaves_it_open(&self) -> bool {
        self.status == Status::Unknown || self.unknown >= self.class_probability && self.status != Status::Adequate
    }

    /// The likeliest names and their class.
    fn naming(weighed: &[Weighed<'_>], probability: impl Fn(&Weighed<'_>) -> f64, unknown: f64, marks: usize) -> Self {
        let named: Vec<&Weighed<'_>> = with_names(weighed).collect();
        let best = named[0];
        let mut class = not_told_apart(weighed, &probability);
        let effects = best.fit.hypothesis.causes.clone();
        let status = if probability(best) >= ALONE { Status::Identified } else { Status::Ambiguous };
        if status == Status::Identified {
            class.clone_from(&effects);
        }
        let to_decide = to_decide(&effects, &class, marks);
        let within = |w: &&&Weighed<'_>| w.fit.hypothesis.causes.iter().all(|c| class.contains(c));
        let class_probability = named.iter().filter(within).map(|w| probability(w)).sum();
        Self { status, effects, class, probability: probability(best), class_probability, unknown, to_decide }
    }
}

/// The hypotheses that have effects, likeliest first.
fn with_names<'w, 'a>(weighed: &'w [Weighed<'a>]) -> impl Iterator<Item = &'w Weighed<'a>> {
    weighed.iter().filter(|w| !w.fit.hypothesis.causes.is_empty())
}

/// The effects of the likeliest names, then all that the recordings do not tell from them.
pub fn not_told_apart(weighed: &[Weighed<'_>], probability: impl Fn(&Weighed<'_>) -> f64) -> Vec<Cause> {
    let mut class = Vec::new();
    let least = with_names(weighed).next().map_or(0.0, |best| TOLD_APART * probability(best));
    for cause in with_names(weighed).filter(|w| probability(w) > least).flat_map(|w| &w.fit.hypothesis.causes) {
        if !class.contains(cause) {
            class.push(*cause);
        }
    }
    class
}

/// Whether a fit leaves so much that the noise does not matter.
pub fn leaves_more_than_noise(fit: &Refit<'_>) -> bool {
    over_noise(fit) > BEYOND_NOISE
}

/// The same of a fit with names.
pub fn is_beyond_noise(fit: &Refit<'_>) -> bool {
    !fit.hypothesis.causes.is_empty() && leaves_more_than_noise(fit)
}

/// What a fit leaves of the angles, over their noise: root mean squares, of the worst recording.
pub fn over_noise(fit: &Refit<'_>) -> f64 {
    let of = |record: usize| {
        let Some(left) = locate::residuals(fit, record) else { return 0.0 };
        let squares = left.rmse_rad.iter().zip(&left.noise_rad).map(|(left, noise)| (left / noise).powi(2));
        (squares.sum::<f64>() / left.rmse_rad.len().max(1) as f64).sqrt()
    };
    (0..fit.problem.records.len()).map(of).fold(0.0, f64::max)
}

/// What to measure to split a class.
fn to_decide(effects: &[Cause], class: &[Cause], marks: usize) -> Option<String> {
    if class.len() <= effects.len() {
        return None;
    }
    let has = |of: &[Cause]| of.iter().filter(|c| class.contains(c)).count() > 1;
    let mut advice: Vec<&str> = Vec::new();
    if has(&[Cause::CameraTilt, Cause::SideForce, Cause::RestCurl]) {
        advice.push("film a plumb line beside the strip, and the strip turned about its length by half a turn");
    }
    if has(&[Cause::TimeBase, Cause::HingeStiffness, Cause::AddedMass, Cause::DistributedFlexibility]) {
        advice.push(
            "film a clock with the strip, and release it at a much larger angle: only a spring's share in the frequency falls with amplitude",
        );
    }
    if has(&[Cause::HingeViscous, Cause::AirLinear, Cause::JointHysteretic]) {
        advice.push(if marks > 1 {
            "release it in the other shape (θ2 against θ1), and again with a card on the tip: only the air's loss grows with its area"
        } else {
            "repeat it with a card on the tip: only the air's loss grows with its area"
        });
    }
    if has(&[Cause::HingeViscous, Cause::HingeCoulomb, Cause::AirQuadratic, Cause::AirLinear, Cause::JointHysteretic]) {
        advice.push("release it at twice the angle and record until it is at rest: the losses differ in how they fall with amplitude");
    }
    if has(&[Cause::AngleGain, Cause::JointCubicStiffness, Cause::RestCurl, Cause::AddedMass]) {
        advice.push("film a grid in the plane of the swing, which fixes the gain of the angles");
    }
    if has(&[Cause::DifferentialLag, Cause::DroppedFrames, Cause::TimeBase]) {
        advice.push("film a running clock beside the strip");
    }
    if advice.is_empty() {
        advice.push("a longer recording with less noise, from a larger release and from another shape of release");
    }
    Some(advice.join("; "))
}
