//! The law that no table holds: sought where the names leave more than noise, fitted in full simulation, proven on what was not fitted.
//!
//! 1. Along the motion of the likeliest fit, which follows the recordings, every term of the [`grammar`](super::grammar) is a torque, and the linearised motion
//!    says what it adds to the angles. With everything else that is free projected out, its fall of χ² is that of Rao's score test.
//! 2. The same with a name taken away, or all of them: what it explains is then the term's to explain, which may be the law that the name stands for.
//! 3. The terms, and pairs of them, that promise most are fitted, as laws of the file would be: first a few steps of all, then the best to the end.
//! 4. The description length chooses among them; with v the variance that the best one leaves, over the noise's, of n values of which τ go together,
//!
//! ```text
//! L = χ²/(2vτ) + ½ k ln(n/τ)        k: coefficients
//! P(name | something remains) = Σ exp(−L) of the fits with it / Σ exp(−L) of all
//! ```
//! 5. Of the shortest the one stands that leaves least of what was not fitted, or nearly so, if that is clearly less than the names do.

use nalgebra::DMatrix;
use rayon::prelude::*;

use super::basis_law::{Swing, swings};
use super::context::FitContext;
use super::effect::{Acts, Effect};
use super::evidence::{Scatter, normalised};
use super::grammar::{Largest, Term, terms};
use super::heldout::{self, HeldOut, Prediction};
use super::hypothesis::Hypothesis;
use super::linearisation::Linearisation;
use super::posterior::Posterior;
use super::refit::Refit;
use super::screen::Projection;
use crate::experiment::{Law, LawPlace};
use crate::model::effects::Effect as _;
use crate::model::effects::formula::Formula;
use crate::model::{Motion, Parameter};

/// Terms of which pairs are tried.
const PAIRED: usize = 12;
/// Terms, and pairs, begun beside each set of names, and as many of all that was begun fitted to the end, at least and at most (cost)…
const FEWEST: usize = 2;
const MOST: usize = 6;
/// … for each of which so many motions are made.
const EVALUATIONS: f64 = 80.0;
/// Predictions that leave at most this many times what the best one does are alike.
const ALIKE: f64 = 1.1;
/// The shortest descriptions of which it is asked what they predict.
const PROVEN: usize = 4;
/// Of a term less than this is left by the projection: it does what is free already.
const NOTHING_LEFT: f64 = 1e-3;
/// A term whose effect on the angles has this cosine with that of a name is that name under another one.
const THE_SAME: f64 = 0.999;
/// Terms and pairs told as alternatives are within so many nats of the best.
const ALTERNATIVES: f64 = 5.0;

/// A law that was learnt.
#[derive(Debug, Clone)]
pub struct Learnt<'a> {
    /// Its terms, with their coefficients.
    pub terms: Vec<Term>,
    /// The fit of the names that stand beside it, with it.
    pub fit: Refit<'a>,
    /// The prediction of what was not fitted.
    pub prediction: Prediction,
    /// Other formulas that do nearly as well, with how much longer their description is (nats).
    pub alternatives: Vec<(String, f64)>,
}

/// Terms to be fitted beside some effects.
#[derive(Clone)]
struct Candidate {
    hypothesis: Hypothesis,
    terms: Vec<Term>,
    gain: f64,
}

/// Terms that were fitted beside some effects, with the length of the description.
struct Described<'a> {
    terms: Vec<Term>,
    fit: Refit<'a>,
    length: f64,
}

/// How probable each name of the likeliest fit is where any law may stand in its place; nothing where that was not asked.
pub type Needed = Vec<(Effect, f64)>;

/// Learns what the likeliest fit leaves, where that is more than noise. A strip's fits are too dear for it.
pub fn beside<'a>(
    context: &FitContext<'a>,
    posterior: &Posterior<'a>,
    proof: Option<&HeldOut>,
    from_s: Option<f64>,
) -> (Needed, Option<Learnt<'a>>) {
    let is_worth = posterior.remains > context.settings.verdict.even && !context.is_strip();
    let order = if is_worth { descriptions(context, posterior.best()) } else { None };
    let Some(order) = order else { return (Needed::new(), None) };
    let names = &posterior.best().hypothesis.effects;
    let needed = names.iter().map(|effect| (*effect, needed(&order, *effect))).collect();
    (needed, proof.and_then(|proof| best_proven(context, &order, proof, from_s)))
}

/// Names with and without laws of the grammar, fitted in full simulation, the shortest description first.
fn descriptions<'a>(context: &FitContext<'a>, best: &Refit<'a>) -> Option<Vec<Described<'a>>> {
    let before = context.work.done();
    best.linearised()?;
    let each = (context.work.done() - before).max(1) as f64;
    let allowed = context.settings.search.shares.law * context.settings.search.budget as f64 / each;
    let count = ((allowed / EVALUATIONS) as usize).clamp(FEWEST, MOST);
    let begun: Vec<(Candidate, Refit<'a>)> = candidates(best, count)?
        .into_par_iter()
        .with_max_len(1)
        .filter_map(|candidate| Some((candidate.clone(), begun_fit(context, best, &candidate, count > FEWEST)?)))
        .collect();
    let ended = |(candidate, fit): (Candidate, Refit<'a>)| ended(context, candidate, fit);
    let fitted: Vec<(Vec<Term>, Refit<'a>)> =
        foremost(begun, count).into_par_iter().with_max_len(1).map(ended).chain([(Vec::new(), best.clone())]).collect();
    described(fitted)
}

/// Of the shortest descriptions the one that leaves least of what was not fitted, if that is clearly less than the names do.
fn best_proven<'a>(
    context: &FitContext<'a>,
    order: &[Described<'a>],
    proof: &HeldOut,
    from_s: Option<f64>,
) -> Option<Learnt<'a>> {
    let shorter = order.iter().take_while(|own| !own.terms.is_empty()).take(PROVEN).collect::<Vec<_>>();
    let leaves = |prediction: &Prediction| {
        let told = Prediction { rmse_rad: prediction.rmse_rad.clone(), left: None };
        HeldOut { baseline: proof.augmented.clone(), augmented: told, ..proof.clone() }.leaves()
    };
    let predict = |own: &&Described<'a>| heldout::predicted(&with_laws(context, &own.terms), &own.fit, from_s);
    let predicted: Vec<Option<Prediction>> = shorter.par_iter().with_max_len(1).map(predict).collect();
    let proven = shorter.into_iter().zip(predicted).filter_map(|(own, prediction)| Some((own, prediction?)));
    let proven: Vec<(&Described<'a>, Prediction)> = proven.collect();
    let least = proven.iter().map(|(_, prediction)| leaves(prediction)).fold(f64::INFINITY, f64::min);
    (least < context.settings.verdict.borne_out).then_some(())?;
    // of those that predict alike the shortest
    let (own, prediction) = proven.into_iter().find(|(_, prediction)| leaves(prediction) <= ALIKE * least)?;
    let near = order.iter().filter(|other| !std::ptr::eq(*other, own) && !other.terms.is_empty());
    let near = near.filter(|other| other.length < own.length + ALTERNATIVES);
    Some(Learnt {
        terms: own.terms.clone(),
        fit: own.fit.clone(),
        prediction,
        alternatives: near.map(|other| (formula_of(&other.terms), other.length - own.length)).collect(),
    })
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

/// The probability of a name among all descriptions.
fn needed(order: &[Described<'_>], effect: Effect) -> f64 {
    let weights = normalised(&order.iter().map(|own| -own.length).collect::<Vec<f64>>());
    let with = order.iter().zip(weights).filter(|(own, _)| own.fit.hypothesis.has(effect));
    with.map(|(_, weight)| weight).sum()
}

impl Learnt<'_> {
    /// The formula with its numbers.
    pub fn formula(&self) -> String {
        formula_of(&self.terms)
    }

    /// A coefficient's standard deviation.
    pub fn sd(&self, coefficient: Parameter) -> f64 {
        let scale = (self.fit.chi2 / self.fit.values().max(1) as f64).max(1.0).sqrt();
        let covariance = self.fit.covariance(&[coefficient]);
        scale * covariance.get((0, 0)).map_or(f64::INFINITY, |variance| variance.max(0.0).sqrt())
    }
}

/// The terms' formulas with the numbers of their coefficients, one after the other.
fn formula_of(terms: &[Term]) -> String {
    terms.iter().map(Term::with_numbers).collect::<Vec<_>>().join(" + ").replace("+ -", "- ")
}

/// What promises most, beside the names of a fit, without each of them, and in the place of them all.
fn candidates(best: &Refit<'_>, count: usize) -> Option<Vec<Candidate>> {
    let (all, columns) = effects_of_terms(best)?;
    let (residual, slopes) = best.linearised()?;
    let names = &best.hypothesis.effects;
    let mut left_out: Vec<Vec<Effect>> = vec![Vec::new()];
    left_out.extend(names.iter().map(|effect| vec![*effect]));
    left_out.extend((names.len() > 1).then(|| names.clone()));
    let lower = best.problem.lower();
    let (apart, alone) = (told_apart(&columns), best.problem.records.len() == 1);
    let promise = |out: &Vec<Effect>| {
        let parameters: Vec<Parameter> = out.iter().flat_map(|effect| effect.parameters()).copied().collect();
        let gone: Vec<usize> = parameters.iter().filter_map(|parameter| best.place(*parameter)).collect();
        let kept: Vec<usize> = (0..best.x.len()).filter(|i| !gone.contains(i) && best.x[*i] > lower[*i]).collect();
        // what the names explain is then the term's to explain
        let left = gone.iter().fold(residual.clone(), |r, i| r - slopes.column(*i) * best.x[*i]);
        let is_a_name = |k: usize| {
            let own = columns.column(k);
            let cosine = |i: &usize| own.dot(&slopes.column(*i)) / (own.norm() * slopes.column(*i).norm()).max(1e-300);
            gone.iter().any(|i| cosine(i).abs() > THE_SAME)
        };
        // in a single release the amplitude falls with time, and a loss that drifts stands for any loss
        let of_loss = alone && out.iter().any(|effect| effect.entry().acts == Acts::Loss);
        let drifts = |term: &Term| of_loss && term.drifts && term.state != "angle";
        let new: Vec<usize> = apart.iter().copied().filter(|k| !is_a_name(*k) && !drifts(&all[*k])).collect();
        let hypothesis = out.iter().fold(best.hypothesis.clone(), |hypothesis, effect| hypothesis.without(*effect));
        let projection = Projection::off(left, slopes.select_columns(&kept));
        promising(&projection, &all, (&columns, &new), &hypothesis, count)
    };
    Some(left_out.iter().flat_map(promise).collect())
}

/// The terms that do something else to the angles than any before them: on a single link hinge, strip and tip are one place.
fn told_apart(columns: &DMatrix<f64>) -> Vec<usize> {
    let sizes: Vec<f64> = columns.column_iter().map(|column| column.norm().max(1e-300)).collect();
    let mut kept: Vec<usize> = Vec::new();
    for k in 0..columns.ncols() {
        let cosine = |other: &usize| columns.column(k).dot(&columns.column(*other)) / (sizes[k] * sizes[*other]);
        if !kept.iter().any(|other| cosine(other).abs() > THE_SAME) {
            kept.push(k);
        }
    }
    kept
}

/// Every term of the grammar, and what a unit of its amplitude adds to the values seen, whitened, a column each.
fn effects_of_terms(fit: &Refit<'_>) -> Option<(Vec<Term>, DMatrix<f64>)> {
    let around = Linearisation::of_all(fit)?;
    let swings = swings(fit, &around)?;
    let places = [LawPlace::Hinge, LawPlace::Joint, LawPlace::Strip, LawPlace::Tip];
    let places = places.into_iter().filter(|place| *place != LawPlace::Joint || fit.problem.marks() > 1);
    let all: Vec<Term> =
        places.flat_map(|place| terms(place, largest(&swings, place, fit.problem.longest_s()))).collect();
    let column = |term: &Term| {
        let mut unit = term.law.clone();
        unit.parameters.get_mut("a")?.start = 1.0;
        let formula = Formula::of(&unit)?;
        let of_swing = |swing: &Swing<'_>| {
            swing.response(|motion: &Motion, q: &mut [f64]| formula.add_torque(&swing.around.chain, motion, q))
        };
        Some(swings.iter().flat_map(|swing| of_swing(swing).as_slice().to_vec()).collect::<Vec<f64>>())
    };
    let columns: Vec<Vec<f64>> = all.par_iter().map(column).collect::<Option<_>>()?;
    let (seen, rows) = (columns.first()?.len(), fit.linearised()?.0.len());
    // beliefs stand after what is seen, and no torque changes them
    let matrix = DMatrix::from_fn(rows, all.len(), |i, k| if i < seen { columns[k][i] } else { 0.0 });
    Some((all, matrix))
}

/// The largest state at a place.
fn largest(swings: &[Swing<'_>], place: LawPlace, time_s: f64) -> Largest {
    let mut largest = Largest { angle: 1e-6, rate: 1e-6, time_s };
    for (motion, swing) in swings.iter().flat_map(|swing| swing.motions().map(move |motion| (motion, swing))) {
        let links = motion.links();
        let mut meet = |angle: f64, rate: f64| {
            largest.angle = largest.angle.max(angle.abs());
            largest.rate = largest.rate.max(rate.abs());
        };
        match place {
            LawPlace::Hinge | LawPlace::Support => meet(motion.theta_rad[0], motion.rate[0]),
            LawPlace::Joint => (1..links).for_each(|i| {
                meet(motion.theta_rad[i] - motion.theta_rad[i - 1], motion.rate[i] - motion.rate[i - 1]);
            }),
            LawPlace::Strip | LawPlace::Tip => meet(0.0, swing.fastest_m_s(motion)),
        }
    }
    largest
}

/// The terms and pairs of them that lower what is left most, beside some effects.
fn promising(
    left: &Projection,
    all: &[Term],
    (columns, new): (&DMatrix<f64>, &[usize]),
    hypothesis: &Hypothesis,
    count: usize,
) -> Vec<Candidate> {
    let projected = left.out(columns);
    let is_new = |k: usize| projected.column(k).norm() > NOTHING_LEFT * columns.column(k).norm();
    let mut alone: Vec<(f64, usize)> = new
        .iter()
        .copied()
        .filter(|k| is_new(*k))
        .map(|k| (projected.column(k).dot(&left.residual).powi(2) / projected.column(k).norm_squared(), k))
        .collect();
    alone.sort_by(|a, b| b.0.total_cmp(&a.0));
    let of_pair = |(_, a): &(f64, usize), (_, b): &(f64, usize)| {
        let pair = projected.select_columns(&[*a, *b]);
        let pull = pair.tr_mul(&left.residual);
        let value = pair.tr_mul(&pair).try_inverse()? * &pull;
        Some((pull.dot(&value), vec![(*a, -value[0]), (*b, -value[1])]))
    };
    let foremost = &alone[..alone.len().min(PAIRED)];
    let mut pairs: Vec<(f64, Vec<(usize, f64)>)> = foremost
        .iter()
        .enumerate()
        .flat_map(|(i, a)| alone[i + 1..].iter().filter_map(move |b| of_pair(a, b)))
        .filter(|(gain, _)| gain.is_finite())
        .collect();
    pairs.sort_by(|a, b| b.0.total_cmp(&a.0));
    let amplitude = |k: usize| -projected.column(k).dot(&left.residual) / projected.column(k).norm_squared();
    let alone = alone.iter().take(count).map(|(gain, k)| (*gain, vec![(*k, amplitude(*k))]));
    let chosen = alone.chain(pairs.into_iter().take(count));
    let candidate = |(gain, terms): (f64, Vec<(usize, f64)>)| Candidate {
        hypothesis: hypothesis.clone(),
        terms: terms.into_iter().enumerate().map(|(place, (k, a))| begun(&all[k], a, place)).collect(),
        gain,
    };
    chosen.map(candidate).collect()
}

/// A term with its amplitude, under a name of its own.
fn begun(term: &Term, amplitude: f64, place: usize) -> Term {
    let mut term = term.clone();
    term.law.name = format!("learnt {}", place + 1);
    if let Some(own) = term.law.parameters.get_mut("a") {
        own.start = amplitude;
    }
    term
}

/// The context of fits with some laws more.
fn with_laws<'a>(context: &FitContext<'a>, terms: &[Term]) -> FitContext<'a> {
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
