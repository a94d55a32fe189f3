//! What is fitted in full simulation: laws of the grammar beside names, first a few steps of all, then the best to the end, within a budget of work.

use std::collections::VecDeque;

use rayon::prelude::*;

use super::super::context::FitContext;
use super::super::effect::Effect;
use super::super::grammar::Term;
use super::super::hypothesis::Hypothesis;
use super::super::misfit::leaves_only_noise;
use super::super::posterior::Posterior;
use super::super::refit::Refit;
use super::super::stretches::{Asked, best_term_sets};
use super::term_screening::{Candidate, started};
use crate::experiment::{Coefficient, Law};

/// A scale that many times the one from which it began has run away.
const AWAY: f64 = 100.0;
/// So many fits are begun before it is asked whether the budget allows more, on every machine the same ones at once.
const BEGUN_AT_ONCE: usize = 8;
/// The same of fits that go on.
const GONE_ON_AT_ONCE: usize = 2;

/// Terms, and a fit with them, wherever it has come to.
pub type Begun<'a> = (Vec<Term>, Refit<'a>);

/// The work that laws may take.
pub struct Budget {
    /// What will have been done when it is spent.
    until: u64,
    /// The same when what was fitted has been made simpler.
    pub until_simpler: u64,
    /// It in motions with their derivatives.
    motions: f64,
}

impl Budget {
    /// After one motion with its derivatives, before which so much had been done.
    pub fn of(context: &FitContext<'_>, before: u64) -> Self {
        let (shares, all) = (&context.settings.search.shares, context.settings.search.budget as f64);
        let allowed = (shares.law * all).min(shares.all * all - before as f64).max(0.0);
        let each = (context.work.done() - before).max(1) as f64;
        let until = before + allowed as u64;
        let until_simpler = until + (shares.simpler * all) as u64;
        Self { until, until_simpler, motions: allowed / each }
    }
}

/// The candidates that came to an end, and those that short stretches ask for, of the base model's fit.
pub fn fitted<'a>(
    context: &FitContext<'a>,
    posterior: &Posterior<'a>,
    (candidates, budget): (Vec<Candidate>, &Budget),
    asked_for: impl FnOnce(&Refit<'a>, u64) -> Vec<Begun<'a>>,
) -> Vec<Begun<'a>> {
    let (best, law) = (posterior.best(), &context.settings.law);
    // what leaves more than the base model leads nowhere
    let base = context.with_noise(&best.problem.noise, posterior.base(), 0);
    let bound = base.map_or(f64::INFINITY, |base| base.chi2);
    let along_best = |candidate: Candidate| {
        let fit = begun_fit(context, best, &candidate, (bound, budget.motions > law.along))?;
        Some((candidate.terms, fit))
    };
    let (in_a_part, in_all): (Vec<Candidate>, Vec<Candidate>) =
        candidates.into_iter().partition(Candidate::acts_in_a_part);
    let (mut candidates, mut in_a_part) = (VecDeque::from(in_all), Some(in_a_part));
    // those that short stretches ask for begin far away, and each costs as much as many others
    let mut asked_for = Some(asked_for);
    let until_first = part_of_rest(context, law.first, budget.until);
    let (mut begun, mut made, mut set_aside): (Vec<Begun<'a>>, Vec<Begun<'a>>, Vec<Begun<'a>>) = Default::default();
    loop {
        let until = if in_a_part.is_some() { until_first } else { budget.until };
        begun.extend(within(
            context,
            part_of_rest(context, law.begun, until),
            (BEGUN_AT_ONCE, &mut candidates),
            along_best,
        ));
        let (ended, left_behind) = halved(context, std::mem::take(&mut begun), until);
        made.extend(ended);
        set_aside.extend(left_behind);
        let is_exact = |fit: &Refit<'a>| leaves_only_noise(fit, &context.settings.misfit);
        let leaves_more = !is_exact(best) && !made.iter().any(|own| is_exact(&own.1));
        if let Some(in_a_part) = in_a_part.take_if(|_| leaves_more) {
            // what acts in a part of the swing follows many motions nearly: it is sought where nothing that acts in all of it leaves only noise
            candidates.extend(in_a_part);
            candidates.make_contiguous().sort_by_key(|own| own.rank);
            if let Some(asked_for) = asked_for.take() {
                begun = asked_for(posterior.base(), part_of_rest(context, law.first, budget.until));
            }
            continue;
        }
        // what the budget leaves when the best have come to their end is for more of them
        if context.work.done() >= until {
            return made;
        }
        if candidates.is_empty() {
            match asked_for.take() {
                Some(asked_for) => begun = asked_for(posterior.base(), part_of_rest(context, law.first, until)),
                // and what was set aside for better ones may yet overtake them
                None if set_aside.is_empty() => return made,
                None => begun = std::mem::take(&mut set_aside),
            }
        }
    }
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
    (bound, has_time): (f64, bool),
) -> Option<Refit<'a>> {
    (candidate.gain > context.settings.misfit.counts).then_some(())?;
    let (with, hypothesis) = (with_laws(context, &candidate.terms), &candidate.hypothesis);
    let led = Refit { x: best.x.iter().zip(&candidate.step).map(|(x, step)| x + step).collect(), ..best.clone() };
    let begun = if with.cost_at(hypothesis, &led, &[]) < bound { with.begin(hypothesis, &led, &[]) } else { None };
    let promised = context.settings.search.keeps_up * (best.chi2 - candidate.gain).max(best.values() as f64);
    let is_as_promised = begun.as_ref().is_some_and(|begun| begun.chi2 < promised);
    let is_worth = has_time && candidate.rank == 0 && !is_as_promised && *hypothesis != best.hypothesis;
    let along = is_worth.then(|| with.refit_along_fit(hypothesis, best, f64::INFINITY)).flatten();
    begun.into_iter().chain(along).min_by(|a, b| a.chi2.total_cmp(&b.chi2))
}

/// Terms, and names beside them, that short stretches ask for, fitted along the recorded motion: where the names of the table lead nowhere, no motion of theirs shows
/// what is missing. So many of them as the work allows.
pub fn along_the_recording<'a>(
    context: &FitContext<'a>,
    (base, until): (&Refit<'a>, u64),
    effects: &[Effect],
    terms: &[Term],
) -> Vec<Begun<'a>> {
    // a stretch is a part of the swing: beside those that act in all of it, those that act in a part are asked for by themselves
    let (in_a_part, in_all): (Vec<&Term>, Vec<&Term>) = terms.iter().partition(|term| term.acts_in_a_part());
    let asked = |terms: Vec<&Term>| {
        let terms: Vec<Term> = terms.into_iter().cloned().collect();
        let sets = best_term_sets(context, base, effects, &terms, context.settings.search.asked);
        let with_amplitudes = |(asked, of_terms): (Asked, Vec<(usize, f64)>)| {
            let own = of_terms.into_iter().enumerate();
            (asked, own.map(|(place, (k, amplitude))| started(&terms[k], amplitude, place)).collect())
        };
        sets.into_iter().map(with_amplitudes).collect::<Vec<(Asked, Vec<Term>)>>()
    };
    let mut asked: VecDeque<(Asked, Vec<Term>)> = asked(in_all).into_iter().chain(asked(in_a_part)).collect();
    within(context, until, (GONE_ON_AT_ONCE, &mut asked), |(asked, terms)| {
        let fit = with_laws(context, &terms).refit_along_recording(&asked.hypothesis, base, &asked.start)?;
        Some((terms, fit))
    })
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

/// Fits to the end within a budget of work, by successive halving (Jamieson and Talwalkar, Proceedings of Machine Learning Research 51 (2016) 240): the better half goes
/// some steps on, of these the better half twice as many, and so on, each time for half of what is left of the budget; and what was set aside.
fn halved<'a>(context: &FitContext<'a>, mut going_on: Vec<Begun<'a>>, until: u64) -> (Vec<Begun<'a>>, Vec<Begun<'a>>) {
    let (mut made, mut set_aside) = (Vec::new(), Vec::new());
    let mut steps = context.settings.descent.first_steps;
    while !going_on.is_empty() {
        let mut better = foremost(going_on, context.settings.search.hopeless);
        set_aside.extend(better.split_off(better.len().div_ceil(2)));
        let half = part_of_rest(context, 0.5, until);
        let further = within(context, half, (GONE_ON_AT_ONCE, &mut better.into()), |(terms, fit)| {
            continue_fit(context, terms, fit, steps)
        });
        let is_last = steps >= context.settings.descent.most_steps || context.work.done() > until;
        let (ended, others): (Vec<Begun<'a>>, Vec<Begun<'a>>) =
            further.into_iter().partition(|own| own.1.converged || is_last);
        made.extend(ended);
        going_on = others;
        steps *= 2;
    }
    (made, set_aside)
}

/// What will have been done with a part of what is left until then.
fn part_of_rest(context: &FitContext<'_>, part: f64, until: u64) -> u64 {
    let done = context.work.done();
    done + (part * until.saturating_sub(done) as f64) as u64
}

/// What becomes of some items, so many at once: the first of them in any case, the others for as long as the work done allows it.
fn within<T: Send, R: Send>(
    context: &FitContext<'_>,
    until: u64,
    (at_once, items): (usize, &mut VecDeque<T>),
    of: impl Fn(T) -> Option<R> + Sync,
) -> Vec<R> {
    let mut made = Vec::new();
    loop {
        let batch: Vec<T> = items.drain(..at_once.min(items.len())).collect();
        let is_last = batch.len() < at_once;
        made.extend(batch.into_par_iter().with_max_len(1).filter_map(&of).collect::<Vec<R>>());
        if is_last || context.work.done() > until {
            return made;
        }
    }
}

/// A candidate so many steps further, its coefficients those of the fit; `None` where one has run away, and its term is another one of the grammar.
pub fn continue_fit<'a>(
    context: &FitContext<'a>,
    mut terms: Vec<Term>,
    begun: Refit<'a>,
    steps: usize,
) -> Option<Begun<'a>> {
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
