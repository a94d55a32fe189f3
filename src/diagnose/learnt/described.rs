//! What is fitted: names with and without laws of the grammar, in full simulation, and the length of each description.

use rayon::prelude::*;

use super::super::context::FitContext;
use super::super::effect::Effect;
use super::super::evidence::{Scatter, normalised};
use super::super::grammar::Term;
use super::super::hypothesis::Hypothesis;
use super::super::misfit::most_of_noise;
use super::super::posterior::Posterior;
use super::super::refit::Refit;
use super::super::settings::LawSettings;
use super::super::stretches::{Asked, terms_asked_for};
use super::Needed;
use super::along::Along;
use super::sought::{Candidate, candidates, started};
use crate::experiment::{Coefficient, Law};
use crate::model::Parameter;

/// Scales of a term's state to begin with, over those that it had beside a name.
const SCALED: [f64; 3] = [1.0, 0.7, 1.4];
/// A scale that many times the one from which it began has run away.
const AWAY: f64 = 100.0;

/// So many fits are begun before it is asked whether the budget allows more, on every machine the same ones at once.
const BEGUN_AT_ONCE: usize = 8;
/// The same of fits to the end.
const ENDED_AT_ONCE: usize = 2;

/// Terms, and the first steps of a fit with them.
type Begun<'a> = (Vec<Term>, Refit<'a>);

/// Terms that were fitted beside some effects, with the length of the description.
pub struct Described<'a> {
    /// The terms, with their coefficients.
    pub terms: Vec<Term>,
    /// The fit.
    pub fit: Refit<'a>,
    /// The length of its description (nats).
    pub length: f64,
}

/// Names with and without laws of the grammar, fitted in full simulation, the shortest description first.
pub fn descriptions<'a>(
    context: &FitContext<'a>,
    posterior: &Posterior<'a>,
    effects: &[Effect],
) -> Option<Vec<Described<'a>>> {
    let best = posterior.best();
    let before = context.work.done();
    let linearised = best.linearised()?;
    let (from, each) = (context.work.done(), (context.work.done() - before).max(1) as f64);
    let (search, law) = (&context.settings.search, &context.settings.law);
    let allowed = search.shares.law * search.budget as f64;
    let until = |part: f64| from + (part * allowed) as u64;
    let (candidates, terms) = candidates(best, &linearised, law)?;
    let prior = Prior::of(context, best, effects, &terms)?;
    // their fits begin far away, and cost as much as all others
    let asked = (allowed > law.asked * each).then(|| along_the_recording(context, posterior.base(), effects, &terms));
    let along_best = |candidate: Candidate| {
        let fit = begun_fit(context, best, &candidate, allowed > law.along * each)?;
        Some((candidate.terms, fit))
    };
    let mut begun: Vec<Begun<'a>> = within(context, until(law.begun), (BEGUN_AT_ONCE, candidates), along_best);
    begun.extend(asked.unwrap_or_default());
    let with_laws = within(context, until(1.0), (ENDED_AT_ONCE, foremost(begun, search.hopeless)), |(terms, fit)| {
        ended(context, terms, fit)
    });
    // what the table has been fitted with is a description, too
    let possible = posterior.candidates.iter().filter(|candidate| candidate.ln_posterior.is_finite());
    let of_table = possible.map(|candidate| (Vec::new(), candidate.fit.clone()));
    let fitted: Vec<(Vec<Term>, Refit<'a>)> = with_laws.into_iter().chain(of_table).collect();
    let mut order = described(fitted, &prior)?;
    // a term that is nearly right makes names superfluous that were needed without it
    for _ in 0..best.hypothesis.effects.len() {
        let without_one = without_a_name(context, &order[0]);
        let none_shorter = without_one.is_empty();
        let shortest = order[0].fit.hypothesis.clone();
        let all = order.into_iter().map(|own| (own.terms, own.fit)).chain(without_one);
        order = described(all.collect(), &prior)?;
        if none_shorter || order[0].fit.hypothesis == shortest {
            break;
        }
    }
    Some(order)
}

/// A description with terms without each of its names, from where it stands, and from there with the scales of the terms' states smaller and larger: a threshold
/// or a width has false minima.
fn without_a_name<'a>(context: &FitContext<'a>, own: &Described<'a>) -> Vec<(Vec<Term>, Refit<'a>)> {
    let with = with_laws(context, &own.terms);
    let names = if own.terms.is_empty() { &[][..] } else { &own.fit.hypothesis.effects };
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
        ended(context, own.terms.clone(), begun)
    };
    names.par_iter().with_max_len(1).filter_map(fewer).collect()
}

/// The context of fits with some laws more.
pub fn with_laws<'a>(context: &FitContext<'a>, terms: &[Term]) -> FitContext<'a> {
    let laws: Vec<Law> = terms.iter().map(|term| term.law.clone()).collect();
    let coefficients = laws.iter().flat_map(|law| law.coefficients().map(|(parameter, _)| parameter));
    let base = context.base.iter().copied().chain(coefficients).collect();
    FitContext { laws, base, ..context.clone() }
}

/// The first steps of a candidate, where it promises anything, from where the linear approximation leads. What the names do together is not linear in each: where
/// that leaves more than was promised in their place, the foremost candidate begins along the motion that they follow, if there is time for that.
fn begun_fit<'a>(
    context: &FitContext<'a>,
    best: &Refit<'a>,
    candidate: &Candidate,
    has_time: bool,
) -> Option<Refit<'a>> {
    (candidate.gain > context.settings.misfit.counts).then_some(())?;
    let (with, hypothesis) = (with_laws(context, &candidate.terms), &candidate.hypothesis);
    let led = Refit { x: best.x.iter().zip(&candidate.step).map(|(x, step)| x + step).collect(), ..best.clone() };
    let begun = with.begin(hypothesis, &led, &[]);
    let promised = context.settings.search.keeps_up * (best.chi2 - candidate.gain).max(best.values() as f64);
    let is_as_promised = begun.as_ref().is_some_and(|begun| begun.chi2 < promised);
    let is_worth = has_time && candidate.rank == 0 && !is_as_promised && *hypothesis != best.hypothesis;
    let along = is_worth.then(|| with.refit_along(hypothesis, best, &[])).flatten();
    begun.into_iter().chain(along).min_by(|a, b| a.chi2.total_cmp(&b.chi2))
}

/// Terms, and names beside them, that short stretches ask for, fitted along the recorded motion: where the names of the table lead nowhere, no motion of theirs shows
/// what is missing.
fn along_the_recording<'a>(
    context: &FitContext<'a>,
    base: &Refit<'a>,
    effects: &[Effect],
    terms: &[Term],
) -> Vec<Begun<'a>> {
    let asked = terms_asked_for(context, base, effects, terms, context.settings.search.asked);
    let fitted = |(asked, of_terms): (Asked, Vec<(usize, f64)>)| {
        let own = of_terms.into_iter().enumerate();
        let terms: Vec<Term> = own.map(|(place, (k, amplitude))| started(&terms[k], amplitude, place)).collect();
        let fit = with_laws(context, &terms).refit_along_recording(&asked.hypothesis, base, &asked.start)?;
        Some((terms, fit))
    };
    asked.into_par_iter().with_max_len(1).filter_map(fitted).collect()
}

/// What was begun, without what has no hope: the best term and the best pair beside each set of names, then the rest, the better ones first.
fn foremost<'a>(mut begun: Vec<Begun<'a>>, hopeless: f64) -> Vec<Begun<'a>> {
    begun.sort_by(|a, b| a.1.chi2.total_cmp(&b.1.chi2));
    let least = begun.first().map_or(0.0, |own| own.1.chi2);
    begun.retain(|own| own.1.chi2 < hopeless * least);
    let mut seen: Vec<(Hypothesis, usize)> = Vec::new();
    let (first, rest): (Vec<Begun<'a>>, Vec<Begun<'a>>) = begun.into_iter().partition(|(terms, fit)| {
        let kind = (fit.hypothesis.clone(), terms.len());
        let is_first = !seen.contains(&kind);
        seen.push(kind);
        is_first
    });
    first.into_iter().chain(rest).collect()
}

/// What becomes of some items, so many at once: the first of them in any case, the others for as long as the work done allows it.
fn within<T: Send, R: Send>(
    context: &FitContext<'_>,
    until: u64,
    (at_once, items): (usize, Vec<T>),
    of: impl Fn(T) -> Option<R> + Sync,
) -> Vec<R> {
    let mut made = Vec::new();
    let mut items = items.into_iter();
    loop {
        let batch: Vec<T> = items.by_ref().take(at_once).collect();
        let is_last = batch.len() < at_once;
        made.extend(batch.into_par_iter().with_max_len(1).filter_map(&of).collect::<Vec<R>>());
        if is_last || context.work.done() > until {
            return made;
        }
    }
}

/// A candidate to the end, its coefficients those of the fit; `None` where one has run away, and its term is another one of the grammar.
fn ended<'a>(context: &FitContext<'a>, mut terms: Vec<Term>, begun: Refit<'a>) -> Option<(Vec<Term>, Refit<'a>)> {
    let steps = context.settings.descent.most_steps;
    let with = with_laws(context, &terms);
    let fit = if begun.converged { begun } else { with.go_on(&begun, steps).unwrap_or(begun) };
    for term in &mut terms {
        let fitted: Vec<Option<f64>> = term.law.coefficients().map(|(parameter, _)| fit.value(parameter)).collect();
        // the amplitude comes first; the others were begun within the range of the state
        let begun = term.law.parameters.values().skip(1).map(|own| own.start.abs()).fold(0.0, f64::max);
        for (own, value) in term.law.parameters.values_mut().zip(fitted) {
            own.start = value.unwrap_or(own.start);
        }
        let has_run_away = |own: &Coefficient| own.start.abs() > AWAY * begun;
        if term.law.parameters.values().skip(1).any(has_run_away) {
            return None;
        }
    }
    Some((terms, fit))
}

/// What names and terms cost before anything was seen (nats).
struct Prior {
    /// To say which effect of the table is meant.
    of_effect: f64,
    /// That something outside the table is at work, and to say which term.
    of_term: f64,
    /// More of a term that gives energy.
    of_active: f64,
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
            of_active: -law.active.ln(),
            along: Along::of(context, best, effects, terms.iter())?,
            law: law.clone(),
        })
    }

    fn of_description(&self, terms: &[Term], hypothesis: &Hypothesis) -> f64 {
        // under whatever name, it is the table's
        let is_of_table = |term: &Term| !self.along.stands_for((term, true), &self.law).is_empty();
        let of_term = |term: &Term| if is_of_table(term) { self.of_effect } else { self.of_term };
        let is_active = |term: &&Term| term.state != "angle" && self.along.gives_energy(term);
        hypothesis.effects.len() as f64 * self.of_effect
            + terms.iter().map(of_term).sum::<f64>()
            + terms.iter().filter(is_active).count() as f64 * self.of_active
    }
}

/// The fits with the lengths of their descriptions, the shortest first.
fn described<'a>(fitted: Vec<(Vec<Term>, Refit<'a>)>, prior: &Prior) -> Option<Vec<Described<'a>>> {
    let least = fitted.iter().map(|(_, fit)| fit).min_by(|a, b| a.chi2.total_cmp(&b.chi2))?;
    let scatter = Scatter::of(least, least.values());
    let together = (scatter.of_all / scatter.of_values).max(1.0);
    let length = |terms: &[Term], fit: &Refit<'_>| {
        let count = fit.added().len() + terms.iter().map(|term| term.law.parameters.len()).sum::<usize>();
        0.5 * fit.chi2 / scatter.of_all
            + 0.5 * count as f64 * (fit.values() as f64 / together).ln()
            + prior.of_description(terms, &fit.hypothesis)
    };
    let mut order: Vec<Described<'a>> =
        fitted.into_iter().map(|(terms, fit)| Described { length: length(&terms, &fit), terms, fit }).collect();
    order.sort_by(|a, b| a.length.total_cmp(&b.length));
    Some(order)
}

/// The probability of each effect among all descriptions: of those that name it, and of those with a term that does what it does along the motion of a fit.
pub fn needed(context: &FitContext<'_>, order: &[Described<'_>], best: &Refit<'_>, effects: &[Effect]) -> Needed {
    let weights = normalised(&order.iter().map(|own| -own.length).collect::<Vec<f64>>());
    let along = Along::of(context, best, effects, order.iter().flat_map(|own| &own.terms));
    let (law, misfit) = (&context.settings.law, &context.settings.misfit);
    let of_description = |own: &Described<'_>| -> Vec<(Effect, f64)> {
        let is_exact = own.fit.chi2 < most_of_noise(own.fit.values(), misfit);
        let Some(along) = along.as_ref() else { return Vec::new() };
        own.terms.iter().flat_map(|term| along.stands_for((term, is_exact), law)).collect()
    };
    let shares: Vec<Vec<(Effect, f64)>> = order.iter().map(of_description).collect();
    let of_effect = |effect: &Effect| {
        let share = |(own, shares): (&Described<'_>, &Vec<(Effect, f64)>)| {
            let of_terms = shares.iter().filter(|share| share.0 == *effect).map(|share| share.1).fold(0.0, f64::max);
            if own.fit.hypothesis.has(*effect) { 1.0 } else { of_terms }
        };
        (*effect, order.iter().zip(&shares).map(share).zip(&weights).map(|(share, weight)| share * weight).sum())
    };
    effects.iter().map(of_effect).collect()
}
