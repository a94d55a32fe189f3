//! What is fitted: names with and without laws of the grammar, in full simulation, and the length of each description.

use nalgebra::DVector;
use rayon::prelude::*;

use super::super::context::FitContext;
use super::super::effect::{Effect, Phase};
use super::super::evidence::{Scatter, normalised};
use super::super::grammar::Term;
use super::super::hypothesis::Hypothesis;
use super::super::refit::Refit;
use super::sought::{Candidate, candidates};
use crate::experiment::Law;
use crate::model::effects::Effect as _;
use crate::model::effects::formula::Formula;
use crate::model::{ForwardModel, Motion, Parameter, Partials};

/// Scales of a term's state to begin with, over those that it had beside a name.
const SCALED: [f64; 3] = [1.0, 0.7, 1.4];

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
pub fn descriptions<'a>(context: &FitContext<'a>, best: &Refit<'a>) -> Option<Vec<Described<'a>>> {
    let before = context.work.done();
    let linearised = best.linearised()?;
    let each = (context.work.done() - before).max(1) as f64;
    let (search, law) = (&context.settings.search, &context.settings.law);
    let allowed = search.shares.law * search.budget as f64 / each;
    let count = ((allowed / law.evaluations) as usize).clamp(law.fewest, law.most);
    let begun: Vec<(Candidate, Refit<'a>)> = candidates(best, &linearised, count, law)?
        .into_par_iter()
        .with_max_len(1)
        .filter_map(|candidate| Some((candidate.clone(), begun_fit(context, best, &candidate, count > law.fewest)?)))
        .collect();
    let ended = |(candidate, fit): (Candidate, Refit<'a>)| ended(context, candidate, fit);
    let fitted: Vec<(Vec<Term>, Refit<'a>)> =
        foremost(begun, count).into_par_iter().with_max_len(1).map(ended).chain([(Vec::new(), best.clone())]).collect();
    let mut order = described(fitted)?;
    // a term that is nearly right makes names superfluous that were needed without it
    for _ in 0..best.hypothesis.effects.len() {
        let without_one = without_a_name(context, &order[0]);
        let none_shorter = without_one.is_empty();
        let shortest = order[0].fit.hypothesis.clone();
        let all = order.into_iter().map(|own| (own.terms, own.fit)).chain(without_one);
        order = described(all.collect())?;
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
        Some(ended(context, Candidate { terms: own.terms.clone(), hypothesis, gain: 0.0 }, begun))
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

/// The first steps of a candidate, where it promises anything. What the names do together is not linear in each: in their place it begins along the motion that they
/// follow, where there is time for that.
fn begun_fit<'a>(
    context: &FitContext<'a>,
    best: &Refit<'a>,
    candidate: &Candidate,
    has_time: bool,
) -> Option<Refit<'a>> {
    (candidate.gain > context.settings.misfit.counts).then_some(())?;
    let (with, hypothesis) = (with_laws(context, &candidate.terms), &candidate.hypothesis);
    let begun = with.begin(hypothesis, best, &[]);
    let along = (has_time && *hypothesis != best.hypothesis).then(|| with.refit_along(hypothesis, best, &[])).flatten();
    begun.into_iter().chain(along).min_by(|a, b| a.chi2.total_cmp(&b.chi2))
}

/// Of what was begun the best, and the best term and the best pair beside each set of names.
fn foremost<'a>(mut begun: Vec<(Candidate, Refit<'a>)>, most: usize) -> Vec<(Candidate, Refit<'a>)> {
    begun.sort_by(|a, b| a.1.chi2.total_cmp(&b.1.chi2));
    let mut seen: Vec<(Hypothesis, usize)> = Vec::new();
    let mut rank = 0;
    begun.retain(|(candidate, _)| {
        let kind = (candidate.hypothesis.clone(), candidate.terms.len());
        let is_first = !seen.contains(&kind);
        seen.push(kind);
        rank += 1;
        is_first || rank <= most
    });
    begun
}

/// A candidate to the end, its coefficients those of the fit.
fn ended<'a>(context: &FitContext<'a>, candidate: Candidate, begun: Refit<'a>) -> (Vec<Term>, Refit<'a>) {
    let mut terms = candidate.terms;
    let steps = context.settings.descent.most_steps;
    let with = with_laws(context, &terms);
    let fit = if begun.converged { begun } else { with.go_on(&begun, steps).unwrap_or(begun) };
    for term in &mut terms {
        let fitted: Vec<Option<f64>> = term.law.coefficients().map(|(parameter, _)| fit.value(parameter)).collect();
        for (own, value) in term.law.parameters.values_mut().zip(fitted) {
            own.start = value.unwrap_or(own.start);
        }
    }
    (terms, fit)
}

/// The fits with the lengths of their descriptions, the shortest first.
fn described(fitted: Vec<(Vec<Term>, Refit<'_>)>) -> Option<Vec<Described<'_>>> {
    let least = fitted.iter().map(|(_, fit)| fit).min_by(|a, b| a.chi2.total_cmp(&b.chi2))?;
    let scatter = Scatter::of(least, least.values());
    let together = (scatter.of_all / scatter.of_values).max(1.0);
    let length = |terms: &[Term], fit: &Refit<'_>| {
        let count = fit.added().len() + terms.iter().map(|term| term.law.parameters.len()).sum::<usize>();
        0.5 * fit.chi2 / scatter.of_all + 0.5 * count as f64 * (fit.values() as f64 / together).ln()
    };
    let mut order: Vec<Described<'_>> =
        fitted.into_iter().map(|(terms, fit)| Described { length: length(&terms, &fit), terms, fit }).collect();
    order.sort_by(|a, b| a.length.total_cmp(&b.length));
    Some(order)
}

/// The probability of each name of a fit among all descriptions: of those that have it, and of those with a term that does what it does.
pub fn needed(order: &[Described<'_>], best: &Refit<'_>, the_same_law: f64) -> Vec<(Effect, f64)> {
    let weights = normalised(&order.iter().map(|own| -own.length).collect::<Vec<f64>>());
    let along = Along::of(best);
    let of_name = |effect: &Effect| {
        let own = along.as_ref().and_then(|along| along.of_effect(best, *effect));
        let is_it = |term: &Term| {
            if !is_of_kind(term, *effect) {
                return false;
            }
            let torques = own.as_ref().zip(along.as_ref().and_then(|along| along.of_term(term)));
            torques.is_some_and(|(own, other)| own.dot(&other) > the_same_law * own.norm() * other.norm())
        };
        let has_it = |own: &Described<'_>| own.fit.hypothesis.has(*effect) || own.terms.iter().any(is_it);
        let with = order.iter().zip(&weights).filter(|(own, _)| has_it(own));
        (*effect, with.map(|(_, weight)| weight).sum())
    };
    best.hypothesis.effects.iter().map(of_name).collect()
}

/// Whether a term has the state and the shape of an effect's law.
fn is_of_kind(term: &Term, effect: Effect) -> bool {
    let entry = effect.entry();
    entry.shapes.contains(&term.shape) && (term.state == "angle") == (entry.phase == Some(Phase::Position))
}

/// A fit's motion through every recording, row after row.
struct Along(Vec<(ForwardModel, Vec<Motion>)>);

impl Along {
    fn of(fit: &Refit<'_>) -> Option<Self> {
        let of_record = |record: usize| {
            let (model, swing, true_s) = fit.motion(record)?;
            let at = |t_s: &f64| {
                let state = swing.at(*t_s);
                model.motion(*t_s, &state.theta_rad, &[state.omega_rad_s, state.hidden].concat())
            };
            let motions = true_s.iter().map(at).collect();
            Some((model, motions))
        };
        (0..fit.problem.records.len()).map(of_record).collect::<Option<_>>().map(Self)
    }

    /// Torques on the links, one instant after another.
    fn torques(&self, torque: impl Fn(&ForwardModel, &Motion, &mut [f64])) -> DVector<f64> {
        let mut all = Vec::new();
        for (model, motion) in self.0.iter().flat_map(|(model, motions)| motions.iter().map(move |m| (model, m))) {
            let mut q = vec![0.0; model.rates()];
            torque(model, motion, &mut q);
            all.extend_from_slice(&q[..model.chain().count()]);
        }
        DVector::from_vec(all)
    }

    /// Of an effect of the fit, in the direction in which it acts.
    fn of_effect(&self, fit: &Refit<'_>, effect: Effect) -> Option<DVector<f64>> {
        let parameter = effect.parameters()[0];
        let sign = fit.value(parameter)?.signum();
        Some(self.torques(|model, motion, q| {
            let mut partials = Partials::zero(model.chain().count(), model.rates());
            model.partials(motion, &mut partials);
            model.sensitivity(parameter, motion, &partials, q);
            q.iter_mut().for_each(|q| *q *= sign);
        }))
    }

    /// Of a term with its coefficients.
    fn of_term(&self, term: &Term) -> Option<DVector<f64>> {
        let formula = Formula::of(&term.law)?;
        Some(self.torques(|model, motion, q| formula.add_torque(model.chain(), motion, q)))
    }
}
