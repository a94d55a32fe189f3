//! The answer: a diagnosis that owns all it says, and is written as it stands, freeswing.diagnosis/1.

use std::collections::BTreeMap;
use std::path::PathBuf;

use serde::Serialize;

use super::adequacy::Detectable;
use super::effect::{Effect, Phase, Place};
use super::law_report::LearntLaw;
pub use super::quantity::{Parameters, Quantity};
use super::search::RoundEnd;
use super::torque::MissingTorque;
use super::verdict::Status;
use crate::fit::Residuals;
use crate::model::Parameter;

/// The answer.
#[derive(Debug, Clone, Serialize)]
pub struct Diagnosis {
    /// The format.
    pub schema: &'static str,
    /// Its name.
    pub specimen: String,
    /// The base model.
    pub baseline: Baseline,
    /// Where it differs from the recordings.
    #[serde(rename = "where")]
    pub location: Location,
    /// The hypotheses, likeliest first.
    pub candidates: Vec<CandidateReport>,
    /// The verdict.
    pub verdict: Answer,
    /// The prediction of what was not fitted.
    pub heldout: Option<HoldoutResult>,
    /// What could have been seen.
    pub detectable: Limits,
    /// What each round of the search came to.
    pub search: Vec<RoundEnd>,
    /// Rounds of the search that its budget did not allow.
    pub undecided: Vec<&'static str>,
    /// The pieces of the recordings that were fitted, where these were cut: number and mean length.
    pub pieces: Option<Pieces>,
    /// What a figure shows.
    #[serde(skip)]
    pub drawn: Option<Drawn>,
}

/// Pieces of recordings.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Pieces {
    /// Of all recordings.
    pub count: usize,
    /// Mean.
    pub length_s: f64,
}

/// The base model beside the first recording.
#[derive(Debug, Clone, Serialize)]
pub struct Baseline {
    /// As fitted.
    pub parameters: Parameters,
    /// What it leaves of each angle.
    pub rmse_rad: Vec<f64>,
    /// Noise of each angle.
    pub noise_rad: Vec<f64>,
    /// How it goes on from row to row…
    pub noise_correlation: Vec<f64>,
    /// … and which share of it does.
    pub noise_share_correlated: Vec<f64>,
    /// Its correlation from angle to angle, the strongest.
    pub noise_correlation_across: f64,
    /// Whether the base model is enough.
    pub adequate: bool,
    /// How often chance alone leaves residuals as conspicuous; `None` where the motion cannot be integrated.
    pub p_value: Option<f64>,
}

/// Where the base model differs from the recordings.
#[derive(Debug, Clone, Serialize)]
pub struct Location {
    /// Where what is missing acts.
    pub place: Option<Place>,
    /// Share of each place in the energy lost, by the likeliest model.
    pub energy_share: BTreeMap<&'static str, f64>,
    /// From and until when the base model departs.
    pub time_s: Option<[f64; 2]>,
    /// Amplitudes there.
    pub amplitude_rad: Option<[f64; 2]>,
    /// With what the missing torque goes.
    pub phase: Option<Phase>,
    /// Strongest frequency of what the base model leaves.
    pub frequency_hz: Option<f64>,
    /// The same in words.
    pub statement: String,
    /// The torque that the base model lacks.
    pub missing_torque: Option<MissingTorqueSummary>,
    /// Root mean square of the torque of the likeliest effects.
    pub named_torque_n_m: f64,
    /// The unknown around the likeliest hypothesis.
    pub unknown: Vec<Unknown>,
}

/// The torque that the base model lacks, in numbers.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct MissingTorqueSummary {
    /// Where.
    pub place: Place,
    /// Root mean square.
    pub rms: f64,
    /// Of it.
    pub unit: &'static str,
    /// With what it goes.
    pub phase: Option<Phase>,
    /// Its strongest frequency.
    pub frequency_hz: Option<f64>,
    /// What it takes of the energy lost.
    pub energy_share: Option<f64>,
}

/// An unknown of some form at some place.
#[derive(Debug, Clone, Serialize)]
pub struct Unknown {
    /// Where.
    pub place: Place,
    /// `course` or `law`.
    pub form: &'static str,
    /// Its likeliest size.
    pub size: f64,
    /// How much likelier it makes the recordings.
    pub log_likelihood_gain: f64,
    /// The same of each size tried.
    pub tried: Vec<(f64, f64)>,
}

/// A hypothesis, fitted and weighed.
#[derive(Debug, Clone, Serialize)]
pub struct CandidateReport {
    /// The effects beside the base model.
    pub effects: Vec<Effect>,
    /// Its posterior probability.
    pub probability: f64,
    /// The same where nothing outside the table is at work.
    pub probability_if_named: f64,
    /// The effects' coefficients.
    pub parameters: Parameters,
    /// From which stamp on frames are missing.
    pub dropped_at_s: Option<f64>,
    /// What it leaves of each angle.
    pub rmse_rad: Vec<f64>,
    /// Over the noise.
    pub chi2: f64,
    /// Schwarz's criterion.
    pub bic: f64,
    /// How far the fit may be trusted to be the best of its hypothesis.
    pub fit: FitQuality,
    /// The coefficients in the order of the effects.
    #[serde(skip)]
    pub coefficients: Vec<(Parameter, Quantity)>,
}

/// How far a fit may be trusted to be the best of its hypothesis.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct FitQuality {
    /// Nothing is to be gained where it stands.
    pub converged: bool,
    /// Independent starts that ended there.
    pub starts_agreeing: usize,
    /// It leaves no more than any fit of a hypothesis within its own.
    pub nested_ok: bool,
    /// All of that, of as many starts as it takes: it counts.
    pub certified: bool,
}

/// The verdict.
#[derive(Debug, Clone, Serialize)]
pub struct Answer {
    /// What kind.
    pub status: Status,
    /// The names that explain most, at most two.
    pub effects: Vec<Effect>,
    /// Those beside them.
    pub further_effects: Vec<Effect>,
    /// All that the recordings do not tell from them.
    pub class: Vec<Effect>,
    /// Of the answer as it is given.
    pub probability: f64,
    /// That probability with every rival whose fit is not certified as good as the best, and without them.
    pub probability_interval: [f64; 2],
    /// Those rivals.
    pub uncertified: Vec<Vec<Effect>>,
    /// That the truth is in the class.
    pub class_probability: f64,
    /// Of anything outside the table.
    pub unknown_probability: f64,
    /// How probable each effect of the table is, over all sets of names that hold it, whatever remains beside them.
    pub inclusion: BTreeMap<&'static str, f64>,
    /// What remains beside the names.
    pub remainder: Remainder,
    /// What that was learnt to be.
    pub law: Option<LearntLaw>,
    /// The same in words.
    pub statement: String,
    /// The measurement that would split the class.
    pub to_decide: Option<String>,
    /// Whether something remains beside the names, so that explanations are weighed among themselves.
    pub among_themselves: bool,
}

/// What the names leave of the first recording, or the base model where there are none.
#[derive(Debug, Clone, Serialize)]
pub struct Remainder {
    /// The probability that it is more than noise.
    pub present: f64,
    /// Where it would act.
    pub place: Option<Place>,
    /// With what it goes.
    pub phase: Option<Phase>,
    /// Its strongest frequency.
    pub frequency_hz: Option<f64>,
    /// Of each angle, noise included.
    pub rms_rad: Vec<f64>,
    /// The same over the noise.
    pub over_noise: Vec<f64>,
    /// Its part of what the base model leaves beyond the noise.
    pub share: f64,
}

/// What was not fitted, predicted.
#[derive(Debug, Clone, Serialize)]
pub struct HoldoutResult {
    /// From which stamp on.
    pub from_s: f64,
    /// Of which recording.
    pub recording: PathBuf,
    /// Whether that is predicted as a whole, from fits to the others.
    pub whole_recording: bool,
    /// What the base model leaves of each angle.
    pub baseline_rmse_rad: Vec<f64>,
    /// What the whole answer does: the names, and the law that was learnt beside them.
    pub augmented_rmse_rad: Vec<f64>,
    /// What the names do without it.
    pub named_rmse_rad: Vec<f64>,
    /// Noise of each angle.
    #[serde(skip)]
    pub noise_rad: Vec<f64>,
}

impl HoldoutResult {
    /// What was fitted, and what predicted.
    pub fn words(&self) -> String {
        if self.whole_recording {
            format!("Fitted to the other recordings, predicted for {}", self.recording.display())
        } else {
            format!("Fitted before {:.2} s, predicted from there on", self.from_s)
        }
    }
}

/// What could have been seen, by the effects' identifiers in the order of the table.
#[derive(Debug, Clone)]
pub struct Limits(pub Vec<Detectable>);

impl Serialize for Limits {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(self.0.iter().map(|limit| (limit.effect, Limit::of(limit))))
    }
}

/// What of one effect could have been seen.
#[derive(Serialize)]
struct Limit<'l> {
    smallest: Option<f64>,
    named_from: Option<f64>,
    unit: &'static str,
    confused_with: &'l [Effect],
}

impl<'l> Limit<'l> {
    fn of(limit: &'l Detectable) -> Self {
        Self {
            smallest: limit.smallest.is_finite().then_some(limit.smallest),
            named_from: limit.named.is_finite().then_some(limit.named),
            unit: limit.parameter.unit(),
            confused_with: &limit.confused_with,
        }
    }
}

/// Both models beside the first recording.
#[derive(Debug, Clone)]
pub struct Drawn {
    /// What the base model leaves.
    pub before: Residuals,
    /// The effects named, and what is left with them.
    pub after: Option<(Vec<Effect>, Residuals)>,
    /// What is left with the law that was learnt as well.
    pub learnt: Option<Residuals>,
    /// From here on both are predictions.
    pub border_s: Option<f64>,
    /// Period of the swing.
    pub swing_s: f64,
    /// What the base model lacks, of the model and not of the camera.
    pub torque: Option<MissingTorque>,
}
