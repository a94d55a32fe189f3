//! The length of each description: names with and without laws of the grammar.

use rayon::prelude::*;

use super::super::context::FitContext;
use super::super::effect::Effect;
use super::super::evidence::{Scatter, normalised};
use super::super::grammar::{Form, Term};
use super::super::hypothesis::Hypothesis;
use super::super::laws;
use super::super::misfit::leaves_only_noise;
use super::super::posterior::{Needed, Posterior};
use super::super::refit::Refit;
use super::super::settings::LawSettings;
use super::substitutes::substitute_terms;
use super::term_fitting::{Begun, Budget, along_the_recording, continue_fit, fitted, with_laws};
use super::term_screening::candidates;
use super::term_torques::Along;
use crate::model::Parameter;

/// Scales of a term's state to begin with, over those that it had beside a name.
const SCALED: [f64; 3] = [1.0, 0.7, 1.4];

/// Terms that were fitted beside some effects, with the length of the description.
pub struct Description<'a> {
    /// The terms, with their coefficients.
    pub terms: Vec<Term>,
    /// The fit.
    pub fit: Refit<'a>,
    /// The length of its description (nats).
    pub length: f64,
}

/// Names, and the forms of terms beside them.
type Kind = (Hypothesis, Vec<Form>);

impl Description<'_> {
    fn kind(&self) -> Kind {
        (self.fit.hypothesis.clone(), self.terms.iter().map(Term::form).collect())
    }

    /// The effects that each of its terms stands for along a motion, with the share of each. Friction that goes with its load, or acts in a part of the swing, is friction.
    pub fn stand_for(&self, context: &FitContext<'_>, along: &Along) -> Vec<Vec<(Effect, f64)>> {
        let (law, misfit) = (&context.settings.law, &context.settings.misfit);
        let is_exact = leaves_only_noise(&self.fit, misfit);
        let of_term = |term: &Term| {
            let plain = if term.is_by_load() || term.acts_in_a_part() { term.plainer() } else { None };
            along.stands_for((plain.as_ref().unwrap_or(term), is_exact), law)
        };
        self.terms.iter().map(of_term).collect()
    }
}

/// Names with and without laws of the grammar, fitted in full simulation, the shortest description first; and the motion along which their terms are compared with
/// effects.
pub fn descriptions<'a>(
    context: &FitContext<'a>,
    posterior: &Posterior<'a>,
    effects: &[Effect],
) -> Option<(Vec<Description<'a>>, Along)> {
    let best = posterior.best();
    let before = context.work.done();
    let linearised = best.linearised()?;
    let budget = Budget::of(context, before);
    let (mut candidates, terms, every_start) = candidates(best, &linearised, &context.settings.law)?;
    let prior = Prior::of(context, best, effects, &terms)?;
    candidates.extend(substitute_terms(context, best, &prior.along, &every_start));
    candidates.sort_by_key(|candidate| candidate.rank);
    let with_laws = fitted(context, posterior, (candidates, &budget), |base, until| {
        along_the_recording(context, (base, until), effects, &terms)
    });
    // what the table has been fitted with is a description, too
    let possible = posterior.candidates.iter().filter(|candidate| candidate.ln_posterior.is_finite());
    let of_table = possible.map(|candidate| (Vec::new(), candidate.fit.clone()));
    let mut order = described(with_laws.into_iter().chain(of_table).collect(), &prior)?;
    // a term that is nearly right makes superfluous what was needed without it
    let mut tried = Vec::new();
    while context.work.done() <= budget.until_simpler {
        // what a prediction may yet put first
        let near = order[0].length + context.settings.law.far;
        let new = |own: &&Description<'a>| own.length < near && !own.terms.is_empty() && !tried.contains(&own.kind());
        let Some(shortest) = order.iter().find(new) else { break };
        tried.push(shortest.kind());
        let (mut simpler, (without_a_term, plainer)) = rayon::join(
            || without_a_name(context, shortest),
            || rayon::join(|| without_a_term(context, shortest), || with_a_plainer_term(context, shortest)),
        );
        simpler.extend(without_a_term.into_iter().chain(plainer));
        order = described(order.into_iter().map(|own| (own.terms, own.fit)).chain(simpler).collect(), &prior)?;
    }
    Some((order, prior.along))
}

/// A description with terms without each of its names, from where it stands, and from there with the scales of the terms' states smaller and larger: a threshold
/// or a width has false minima.
fn without_a_name<'a>(context: &FitContext<'a>, own: &Description<'a>) -> Vec<Begun<'a>> {
    let with = with_laws(context, &own.terms);
    // a term's amplitude comes first
    let scales: Vec<Parameter> =
        own.terms.iter().flat_map(|term| term.law.coefficients().skip(1)).map(|(parameter, _)| parameter).collect();
    let fewer = |name: &Effect| {
        let hypothesis = own.fit.hypothesis.without(*name);
        let from = |factor: f64| {
            let start: Vec<_> = scales.iter().filter_map(|p| Some((*p, factor * own.fit.value(*p)?))).collect();
            with.begin(&hypothesis, &own.fit, &start)
        };
        let begun = SCALED.map(from).into_iter().flatten().min_by(|a, b| a.chi2.total_cmp(&b.chi2))?;
        finish_if_competitive(context, own, (own.terms.clone(), begun))
    };
    own.fit.hypothesis.effects.par_iter().with_max_len(1).filter_map(fewer).collect()
}

/// A description with several terms without each of them, from where it stands.
fn without_a_term<'a>(context: &FitContext<'a>, own: &Description<'a>) -> Vec<Begun<'a>> {
    let fewer = |out: usize| {
        let others = own.terms.iter().enumerate().filter(|(place, _)| *place != out).map(|(_, term)| term);
        with_other_terms(context, own, others.enumerate().map(|(place, term)| term.named(place)).collect())
    };
    let several = if own.terms.len() > 1 { own.terms.len() } else { 0 };
    (0..several).into_par_iter().with_max_len(1).filter_map(fewer).collect()
}

/// A description with each of its terms in the form that it has where its further coefficients say nothing, or where it does not change, from where it stands.
fn with_a_plainer_term<'a>(context: &FitContext<'a>, own: &Description<'a>) -> Vec<Begun<'a>> {
    let plainer = |place: usize| {
        let mut terms = own.terms.clone();
        terms[place] = own.terms[place].plainer()?.named(place);
        with_other_terms(context, own, terms)
    };
    (0..own.terms.len()).into_par_iter().with_max_len(1).filter_map(plainer).collect()
}

/// A description's effects with other terms, these with the coefficients that they have.
fn with_other_terms<'a>(context: &FitContext<'a>, own: &Description<'a>, terms: Vec<Term>) -> Option<Begun<'a>> {
    let start: Vec<_> = terms.iter().flat_map(|term| term.law.coefficients()).map(|(p, own)| (p, own.start)).collect();
    let begun = with_laws(context, &terms).begin(&own.fit.hypothesis, &own.fit, &start)?;
    finish_if_competitive(context, own, (terms, begun))
}

/// The end of a simpler fit, unless it soon leaves far more than the description does.
fn finish_if_competitive<'a>(
    context: &FitContext<'a>,
    own: &Description<'a>,
    (terms, begun): Begun<'a>,
) -> Option<Begun<'a>> {
    let (search, descent) = (&context.settings.search, &context.settings.descent);
    let keeps_up = |fit: &Refit<'a>, times: f64| fit.chi2 < times * own.fit.chi2;
    keeps_up(&begun, search.hopeless).then_some(())?;
    let (terms, few) = continue_fit(context, terms, begun, descent.few_steps)?;
    keeps_up(&few, search.keeps_up).then_some(())?;
    continue_fit(context, terms, few, descent.most_steps)
}

/// What names and terms cost before anything was seen (nats).
struct Prior {
    /// To say which effect of the table is meant.
    of_effect: f64,
    /// That something outside the table is at work, and to say which term.
    of_term: f64,
    /// The motion along which it does.
    along: Along,
    law: LawSettings,
}

impl Prior {
    fn of(context: &FitContext<'_>, best: &Refit<'_>, effects: &[Effect], terms: &[Term]) -> Option<Self> {
        let [of_effect, which] = [effects.len(), terms.len()].map(|kinds| (kinds.max(1) as f64).ln());
        let law = &context.settings.law;
        Some(Self {
            of_effect,
            of_term: which - context.settings.prior.unknown.ln(),
            along: Along::of(context, best, effects, terms.iter())?,
            law: law.clone(),
        })
    }

    fn of_description(&self, terms: &[Term], hypothesis: &Hypothesis) -> f64 {
        // under whatever name, it is the table's
        let is_of_table = |term: &Term| !self.along.stands_for((term, true), &self.law).is_empty();
        let of_term = |term: &Term| if is_of_table(term) { self.of_effect } else { self.of_term };
        hypothesis.effects.len() as f64 * self.of_effect + terms.iter().map(of_term).sum::<f64>()
    }

    /// Whether a term is no law of what hangs and is let go, which takes energy from nowhere: it corrects another one.
    fn is_impossible(&self, term: &Term) -> bool {
        term.is_loss() && self.along.adds_energy(term)
    }
}

/// The fits with the lengths of their descriptions, the shortest first, each kind once; without those of which a term gives energy.
fn described<'a>(mut fitted: Vec<Begun<'a>>, prior: &Prior) -> Option<Vec<Description<'a>>> {
    fitted.retain(|(terms, _)| !terms.iter().any(|term| prior.is_impossible(term)));
    let least = fitted.iter().map(|(_, fit)| fit).min_by(|a, b| a.chi2.total_cmp(&b.chi2))?;
    let scatter = Scatter::of(least, least.values());
    let together = (scatter.of_all / scatter.of_values).max(1.0);
    let length = |terms: &[Term], fit: &Refit<'_>| {
        // the instant of a jump costs ln n, twice what another number does (Zhang and Siegmund, Biometrics 63 (2007) 22)
        let of_instant = 2 * usize::from(fit.hypothesis.dropped.is_some());
        let count = fit.added().len() + of_instant + terms.iter().map(|own| own.law.parameters.len()).sum::<usize>();
        0.5 * fit.chi2 / scatter.of_all
            + 0.5 * count as f64 * (fit.values() as f64 / together).ln()
            + prior.of_description(terms, &fit.hypothesis)
    };
    let mut order: Vec<Description<'a>> =
        fitted.into_iter().map(|(terms, fit)| Description { length: length(&terms, &fit), terms, fit }).collect();
    order.sort_by(|a, b| a.length.total_cmp(&b.length));
    let mut seen = Vec::new();
    order.retain(|own| {
        let is_new = !seen.contains(&own.kind());
        seen.push(own.kind());
        is_new
    });
    Some(order)
}

/// The names of a hypothesis, another effect in the place of one.
fn exchanged(best: &Hypothesis, name: Effect, twin: Effect) -> Vec<Effect> {
    best.without(name).and(twin, best.dropped).effects
}

/// Effects that do as well in the place of a name, as the table's fits say, with their odds over it.
struct Exchangeable(Vec<(Effect, Effect, f64)>);

impl Exchangeable {
    /// Of the names of the likeliest fit.
    fn of(posterior: &Posterior<'_>, effects: &[Effect]) -> Self {
        let (likeliest, best) = (posterior.candidates[0].ln_posterior, &posterior.best().hypothesis);
        let odds = |(name, twin): (Effect, Effect)| {
            let ln_posterior = posterior.candidate(&exchanged(best, name, twin))?.ln_posterior;
            Some((name, twin, (ln_posterior - likeliest).exp()))
        };
        let others = || effects.iter().copied().filter(|effect| !best.has(*effect));
        Self(best.effects.iter().flat_map(|name| others().map(move |twin| (*name, twin))).filter_map(odds).collect())
    }

    /// Without those whose exchange in a hypothesis is among some sets of names.
    fn but(&self, best: &Hypothesis, is_among: impl Fn(&[Effect]) -> bool) -> Self {
        Self(self.0.iter().copied().filter(|(name, twin, _)| !is_among(&exchanged(best, *name, *twin))).collect())
    }

    /// The part of a hypothesis that is an effect's: what tells a name of it from others tells them apart beside a law, too, and nothing else does.
    fn share(&self, effect: Effect, hypothesis: &Hypothesis) -> f64 {
        let of_name = |name: Effect| self.0.iter().filter(move |own| own.0 == name && !hypothesis.has(own.1));
        let all = |name: Effect| 1.0 + of_name(name).map(|own| own.2).sum::<f64>();
        if hypothesis.has(effect) {
            return 1.0 / all(effect);
        }
        let names = hypothesis.effects.iter();
        let of_twin =
            |name: &Effect| of_name(*name).filter(|own| own.1 == effect).map(|own| own.2).sum::<f64>() / all(*name);
        names.map(of_twin).fold(0.0, f64::max)
    }
}

/// The probability of each effect among all descriptions: of those that name it, or one that it does as well as, and of those with a term that does what it does along a
/// motion; and that of those without it which have a term that no effect does.
pub fn needed(
    context: &FitContext<'_>,
    order: &[Description<'_>],
    posterior: &Posterior<'_>,
    effects: &[Effect],
    along: &Along,
) -> Vec<Needed> {
    let weights = normalised(&order.iter().map(|own| -own.length).collect::<Vec<f64>>());
    let twins = Exchangeable::of(posterior, effects);
    // a set of names alone shares nothing with one that is a description of its own
    let is_described =
        |names: &[Effect]| order.iter().any(|own| own.terms.is_empty() && own.fit.hypothesis.effects == names);
    let apart = twins.but(&posterior.best().hypothesis, is_described);
    let irreplaceable = order.first().map(|own| irreplaceable(context, own, effects)).unwrap_or_default();
    let terms: Vec<Vec<Vec<(Effect, f64)>>> = order.iter().map(|own| own.stand_for(context, along)).collect();
    let of_effect = |effect: &Effect| {
        let compared = irreplaceable.contains(effect);
        let mut needed = Needed { effect: *effect, probability: 0.0, replaced: 0.0, compared };
        for ((own, terms), weight) in order.iter().zip(&terms).zip(&weights) {
            let of_terms = terms.iter().flatten().filter(|own| own.0 == *effect).map(|own| own.1).fold(0.0, f64::max);
            let twins = if terms.is_empty() { &apart } else { &twins };
            let share = twins.share(*effect, &own.fit.hypothesis).max(of_terms);
            needed.probability += share * weight;
            if terms.iter().any(Vec::is_empty) {
                needed.replaced += (1.0 - share) * weight;
            }
        }
        needed
    };
    effects.iter().map(of_effect).collect()
}

/// The names beside a law that leaves only noise in the place of which no other effect would do as well, as the tangents of its motion say.
fn irreplaceable(context: &FitContext<'_>, own: &Description<'_>, effects: &[Effect]) -> Vec<Effect> {
    if own.terms.is_empty() || !leaves_only_noise(&own.fit, &context.settings.misfit) {
        return Vec::new();
    }
    let with = with_laws(context, &own.terms);
    let has_no_twin =
        |name: &&Effect| laws::twin_scores(&with, &own.fit, **name, effects).is_some_and(|own| own.is_empty());
    own.fit.hypothesis.effects.iter().filter(has_no_twin).copied().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_shares_its_weight_with_what_does_as_well_in_its_place() {
        let twins = Exchangeable(vec![(Effect::CameraTilt, Effect::SideForce, 0.5)]);
        let of = |effects: &[Effect]| Hypothesis { effects: effects.to_vec(), dropped: None };
        let (tilted, both) = (of(&[Effect::CameraTilt]), of(&[Effect::CameraTilt, Effect::SideForce]));
        assert!((twins.share(Effect::CameraTilt, &tilted) - 2.0 / 3.0).abs() < 1e-12);
        assert!((twins.share(Effect::SideForce, &tilted) - 1.0 / 3.0).abs() < 1e-12);
        // beside each other none stands in the other's place
        assert_eq!([Effect::CameraTilt, Effect::SideForce].map(|own| twins.share(own, &both)), [1.0, 1.0]);
        assert_eq!(twins.share(Effect::HingeCoulomb, &tilted), 0.0);
    }
}
