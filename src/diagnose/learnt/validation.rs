//! What is proven: the law that stands, for it predicts what was not fitted clearly better than the names do.

use rayon::prelude::*;

use super::super::context::FitContext;
use super::super::effect::{Effect, Phase, Place};
use super::super::grammar::Term;
use super::super::heldout::{self, HeldOut, Prediction};
use super::super::misfit::{is_beyond_noise, leaves_only_noise};
use super::super::refit::Refit;
use super::description_length::Description;
use super::term_fitting::with_laws;
use super::term_torques::{Along, place_of};
use crate::model::Parameter;

/// A law that was learnt.
#[derive(Debug, Clone)]
pub struct Learnt<'a> {
    /// Its terms, with their coefficients.
    pub terms: Vec<Term>,
    /// The effects that each term is nearly, along the motion.
    pub stand_for: Vec<Vec<Effect>>,
    /// The fit of the names that stand beside it, with it.
    pub fit: Refit<'a>,
    /// The prediction of what was not fitted.
    pub prediction: Prediction,
    /// Other formulas that do nearly as well, with how much longer their description is (nats).
    pub alternatives: Vec<(String, f64)>,
}

impl Learnt<'_> {
    /// Whether it only gives some names another law: each of them stands beside it, or is what one of its terms nearly is.
    pub fn holds(&self, names: &[Effect]) -> bool {
        let is_held =
            |name: &Effect| self.fit.hypothesis.has(*name) || self.stand_for.iter().flatten().any(|e| e == name);
        names.iter().all(is_held)
    }

    /// Where its first term acts.
    pub fn place(&self) -> Option<Place> {
        self.terms.first().map(|term| place_of(term.law.place))
    }

    /// With what its first term goes.
    pub fn phase(&self) -> Option<Phase> {
        self.terms.first().map(|term| if term.state == "angle" { Phase::Position } else { Phase::Velocity })
    }

    /// The formula with its numbers.
    pub fn formula(&self) -> String {
        formula_of(&self.terms)
    }

    /// A coefficient's standard deviation.
    pub fn sd(&self, coefficient: Parameter) -> f64 {
        let scale = self.fit.variance_ratio().sqrt();
        let covariance = self.fit.covariance(&[coefficient]);
        scale * covariance.get((0, 0)).map_or(f64::INFINITY, |variance| variance.max(0.0).sqrt())
    }
}

/// The terms' formulas with the numbers of their coefficients, one after the other.
fn formula_of(terms: &[Term]) -> String {
    terms.iter().map(Term::formula_with_values).collect::<Vec<_>>().join(" + ").replace("+ -", "- ")
}

/// The foremost descriptions, each with what it predicts where it is fitted to a part only, in the order of
///
/// ```text
/// L + 2 Σ ln e      L: length of the description
///                   e: root mean square error of what was predicted, angle by angle
/// ```
///
/// An error that grows along a motion is one of its amplitude and one of its phase: two numbers, of unknown size, however many values show them. (Describing what
/// comes later by what was learnt before is Dawid's prequential description, Journal of the Royal Statistical Society A 147 (1984) 278.) Where the model's own error is
/// far above the noise, what predicts clearly worse than the names that have been `proven` is left out, however short it is, and what does so than another description,
/// unless it leaves only noise.
pub fn foretold<'a>(
    context: &FitContext<'a>,
    mut order: Vec<Description<'a>>,
    (names, proof): (&Refit<'a>, &HeldOut),
    from_s: Option<f64>,
) -> Vec<(Description<'a>, Prediction)> {
    let settings = context.settings;
    let (law, told) = (&settings.law, settings.prior.min_significance);
    let is_proof = is_beyond_noise(names, &settings.noise);
    let fails = |of: &Prediction| is_proof && settings.verdict.borne_out * of.over(&proof.augmented) > 1.0;
    let predict = |mut own: Description<'a>| {
        let prediction = heldout::predicted(&with_laws(context, &own.terms), &own.fit, from_s)?;
        own.length += prediction.length();
        // a law that sets in later was not learnt from what was fitted
        let is_told = prediction.told.iter().all(|deviations| *deviations > told);
        (is_told && !fails(&prediction)).then_some((own, prediction))
    };
    let is_exact = |own: &Description<'_>| leaves_only_noise(&own.fit, &settings.misfit);
    let mut foretold: Vec<(Description<'a>, Prediction)> = Vec::new();
    let mut asked = 0;
    // where none of the foremost predicts anything, the next ones are asked
    while foretold.is_empty() && asked < law.foretold && !order.is_empty() {
        let near = order[0].length + law.far;
        let count = order.iter().take_while(|own| own.length <= near).count().clamp(1, law.foretold - asked);
        let foremost: Vec<Description<'a>> = order.drain(..count).collect();
        asked += count;
        foretold = foremost.into_par_iter().with_max_len(1).filter_map(predict).collect();
    }
    let left = |of: &Prediction| of.over(&proof.augmented);
    let least = foretold.iter().map(|(_, prediction)| left(prediction)).fold(f64::INFINITY, f64::min);
    foretold.retain(|(own, of)| !is_proof || is_exact(own) || settings.verdict.borne_out * left(of) <= least);
    foretold.sort_by(|a, b| a.0.length.total_cmp(&b.0.length));
    foretold
}

/// The law of the shortest of these descriptions, if it leaves clearly less of what was not fitted than the names do; where the names leave hardly more than the noise
/// (rad) there, as of a swing that has died away, if it leaves no more, and its description is far shorter than any without a law, of which the shortest is so
/// `long` before it predicts.
pub fn proven<'a>(
    context: &FitContext<'a>,
    foretold: &[(Description<'a>, Prediction)],
    (proof, noise_rad): (&HeldOut, &[f64]),
    long: Option<f64>,
    along: &Along,
) -> Option<Learnt<'a>> {
    let settings = context.settings;
    let (own, prediction) = foretold.first().filter(|(own, _)| !own.terms.is_empty())?;
    let left = prediction.over(&proof.augmented);
    let is_far_shorter = || long.is_some_and(|long| own.length + settings.law.far < long + proof.augmented.length());
    let is_proven = left < settings.verdict.borne_out || (!proof.tells(noise_rad) && left <= 1.0 && is_far_shorter());
    is_proven.then_some(())?;
    let near = foretold[1..].iter().map(|(other, _)| other).filter(|other| !other.terms.is_empty());
    let near = near.filter(|other| other.length < own.length + settings.law.alternatives);
    Some(Learnt {
        terms: own.terms.clone(),
        stand_for: own
            .stand_for(context, along)
            .into_iter()
            .map(|of| of.into_iter().map(|own| own.0).collect())
            .collect(),
        fit: own.fit.clone(),
        prediction: prediction.clone(),
        alternatives: near.map(|other| (formula_of(&other.terms), other.length - own.length)).collect(),
    })
}
