//! How each law of the table is sought: what it promises beside a fit, the starts from which it is fitted, and what it costs to be one of its kind.
//!
//! | file | holds |
//! |---|---|
//! | `ordinary` | a law in proportion to its coefficient |
//! | [`missing_frames`] | at which instant frames are missing |
//! | [`moving_support`] | at which frequency a support moves |
//! | `flexible_support` | at which frequency a stand swings that yields |
//! | [`hysteresis`] | where its fit starts |
//! | `oblique_view` | a camera that looks askew, with its stretch and its shear; a sensor's scale |
//! | `encoder` | an encoder off its axis, with its error once and twice a turn |
//! | [`bending`] | a strip that bends everywhere, as finely as it needs |

pub mod bending;
mod encoder;
mod flexible_support;
pub mod hysteresis;
pub mod missing_frames;
pub mod moving_support;
mod oblique_view;
mod ordinary;

use nalgebra::DMatrix;
use rayon::prelude::*;

use super::context::FitContext;
use super::effect::Effect;
use super::misfit::{Misfit, leaves_only_noise, left_of_excess};
use super::refit::Refit;
use super::screen::{Score, Screen};
use super::settings::{PriorSettings, Settings};
use crate::model::Parameter;

/// One effect to be sought beside a fit.
#[derive(Debug, Clone, Copy)]
pub struct FitRequest<'q, 'a> {
    /// What all fits share.
    pub context: &'q FitContext<'a>,
    /// The fit beside which it is sought.
    pub base: &'q Refit<'a>,
    /// Which.
    pub effect: Effect,
    /// What it promises.
    pub score: Option<&'q Score>,
    /// How much that fit lacks.
    pub misfit: Misfit,
}

/// Standard deviations of what a sensor or a set-up errs beyond which it is none of its errors (statistics): a torque that changes the frequency with the amplitude looks
/// like one, and so do two links that are a bending strip (a gain of 0.16 and of 0.18).
const FARTHEST: f64 = 2.0;

/// Value and standard deviation of each coefficient of a fit.
pub type Coefficients<'c> = dyn Fn(Parameter) -> (f64, f64) + 'c;

/// What is particular to a law; what it does not say is as of any law in proportion to its coefficient.
pub trait Law: Sync {
    /// The best fit of it beside another one, from every start that may lead to its minimum.
    fn beside<'a>(&self, sought: &FitRequest<'_, 'a>) -> Option<Refit<'a>> {
        ordinary::beside(sought)
    }

    /// The best fit of it beside another one from wherever it may be, where all else has failed: of a law with more false minima than its starts come by.
    fn fit_from_many_starts<'a>(&self, _context: &FitContext<'a>, _base: &Refit<'a>) -> Option<Refit<'a>> {
        None
    }

    /// What it promises at a fit, of a law that is scanned for.
    fn scan(&self, _screen: &Screen<'_, '_>) -> Option<Score> {
        None
    }

    /// A fit with what no derivative tells set anew, for as long as that moves it.
    fn settled<'a>(&self, _context: &FitContext<'a>, fit: Refit<'a>) -> Refit<'a> {
        fit
    }

    /// Its strength and that one's standard deviation, in a fit that has it; `None` of a law that takes the place of one of the base model, and has no size
    /// to be told from none.
    fn strength(&self, effect: Effect, of: &Coefficients<'_>) -> Option<(f64, f64)> {
        Some(of(effect.parameters()[0]))
    }

    /// Whether a fit has it as nature can.
    fn is_possible(&self, _fit: &Refit<'_>, _prior: &PriorSettings) -> bool {
        true
    }

    /// Whether a fit that has it explains more, over the same fit without, than errors of the recording do that no noise of a row tells.
    fn is_seen(&self, _fit: &Refit<'_>, _without: &Refit<'_>) -> bool {
        true
    }

    /// ln of how many kinds of it there are beyond its strength: signs, phases, frequencies, instants.
    fn ln_multiplicity(
        &self,
        _fit: &Refit<'_>,
        effect: Effect,
        _of: &Coefficients<'_>,
        _settings: &PriorSettings,
    ) -> f64 {
        // either sign, where it may have either
        if effect.parameters()[0].is_not_negative() { 0.0 } else { std::f64::consts::LN_2 }
    }

    /// The odds that it is what it seems to be, in a fit among others, and stands for nothing else.
    fn odds(&self, _fit: &Refit<'_>, _others: &[&Refit<'_>], _settings: &Settings) -> f64 {
        1.0
    }
}

/// The odds of an error whose free numbers complete any law that is only nearly right: small where a fit among others leaves more than noise, and more of what the base model
/// leaves than laws of the table do where all are right.
fn odds_of_what_completes_a_law(fit: &Refit<'_>, others: &[&Refit<'_>], settings: &Settings) -> f64 {
    let base = others.iter().find(|other| other.hypothesis.effects.is_empty());
    let leaves_little = |base: &&Refit<'_>| left_of_excess(fit, base) < settings.prior.imitated_down_to;
    let is_all = leaves_only_noise(fit, &settings.misfit) || base.is_none_or(leaves_little);
    if is_all { 1.0 } else { settings.prior.within_law_error }
}

/// The law of an effect.
pub fn law_of(effect: Effect) -> &'static dyn Law {
    match effect {
        Effect::DroppedFrames => &missing_frames::MissingFrames,
        Effect::SupportMotion => &moving_support::MovingSupport,
        Effect::SupportFlexibility => &flexible_support::FlexibleSupport,
        Effect::CameraOblique => &oblique_view::ObliqueView,
        Effect::EncoderError => &encoder::EncoderError,
        Effect::AngleGain => &oblique_view::WrongScale,
        Effect::JointHysteretic => &hysteresis::Hysteresis,
        Effect::DistributedFlexibility => &bending::Bending,
        _ => &ordinary::Ordinary,
    }
}

/// The coefficients of a fit's effects, each with its standard deviation.
pub struct Estimates<'f> {
    fit: &'f Refit<'f>,
    /// The effects that have a strength.
    pub effects: Vec<Effect>,
    added: Vec<Parameter>,
    /// Of the coefficients of these effects, everything else being free.
    pub covariance: DMatrix<f64>,
}

impl<'f> Estimates<'f> {
    /// Of a fit; `variance` scales that of the noise.
    pub fn of(fit: &'f Refit<'f>, variance: f64) -> Self {
        let has_strength = |effect: &&Effect| law_of(**effect).strength(**effect, &|_| (0.0, 0.0)).is_some();
        let effects: Vec<Effect> = fit.hypothesis.effects.iter().filter(has_strength).copied().collect();
        let added: Vec<Parameter> = effects.iter().flat_map(|effect| effect.parameters()).copied().collect();
        let covariance = fit.covariance(&added) * variance;
        Self { fit, effects, added, covariance }
    }

    /// A coefficient and its standard deviation.
    pub fn value(&self, parameter: Parameter) -> (f64, f64) {
        let place = self.added.iter().position(|p| *p == parameter);
        let sd = place.map_or(f64::INFINITY, |i| self.covariance[(i, i)].sqrt());
        (self.fit.value(parameter).unwrap_or(0.0), sd)
    }

    /// Whether an effect's strength is told from zero.
    pub fn tells(&self, effect: Effect, settings: &PriorSettings) -> bool {
        let strength = law_of(effect).strength(effect, &|parameter| self.value(parameter));
        strength.is_none_or(|(value, sd)| value.abs() > settings.min_significance * sd)
    }
}

/// A fit, each of its laws settled.
pub fn settled<'a>(context: &FitContext<'a>, fit: Refit<'a>) -> Refit<'a> {
    let effects = fit.hypothesis.effects.clone();
    effects.into_iter().fold(fit, |fit, effect| law_of(effect).settled(context, fit))
}

/// The score of each effect that says anything; effects of the fit's own hypothesis are left out.
pub fn scores(screen: &Screen<'_, '_>, effects: &[Effect]) -> Vec<Score> {
    let further: Vec<Effect> = effects.iter().copied().filter(|e| !screen.fit.hypothesis.has(*e)).collect();
    // what is scanned for, or has corners that the others need not suffer, has a motion of its own
    let (alone, together): (Vec<Effect>, Vec<Effect>) =
        further.into_iter().partition(|effect| effect.is_scanned() || effect.is_expensive());
    let (together, alone) = rayon::join(
        || screen.of_coefficients(&together, None).unwrap_or_default(),
        || alone.par_iter().with_max_len(1).filter_map(|effect| law_of(*effect).scan(screen)).collect::<Vec<_>>(),
    );
    let mut scores = together;
    scores.extend(alone);
    scores
}

/// The scores of those effects that would leave so little more in the place of one of a fit's that they count.
pub fn twin_scores(context: &FitContext<'_>, fit: &Refit<'_>, effect: Effect, others: &[Effect]) -> Option<Vec<Score>> {
    let screen = Screen::in_place_of(context, fit, effect)?;
    let left = screen.projection.residual.norm_squared();
    let most = fit.chi2 + context.settings.certificate.within;
    let mut scores = scores(&screen, &cheap_to_score(context, others));
    scores.retain(|score| left - score.gain < most);
    Some(scores)
}

/// The effects that are screened: a hysteresis in each joint of a strip of many links costs more than all others, and is only fitted alone.
pub fn cheap_to_score(context: &FitContext<'_>, effects: &[Effect]) -> Vec<Effect> {
    effects.iter().copied().filter(|effect| !has_corners_in_every_joint(context, *effect)).collect()
}

/// Whether an effect has corners in every joint of a strip.
pub fn has_corners_in_every_joint(context: &FitContext<'_>, effect: Effect) -> bool {
    context.is_strip() && effect.has_switching()
}
