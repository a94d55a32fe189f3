//! What is sought: the terms, and pairs of them, that would lower most of what is left beside the names of a fit, without each of them, and in their place.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector, DVectorView};
use rayon::prelude::*;

use super::super::basis_law::{Swing, swings};
use super::super::effect::{Acts, Effect};
use super::super::grammar::{Largest, Term, terms};
use super::super::hypothesis::Hypothesis;
use super::super::linearisation::Linearisation;
use super::super::refit::Refit;
use super::super::screen::Projection;
use super::super::settings::LawSettings;
use crate::experiment::LawPlace;
use crate::fit::descent::damped_step;
use crate::fit::recordings;
use crate::model::effects::Effect as _;
use crate::model::effects::formula::Formula;
use crate::model::{Motion, Parameter};

/// Of what the derivatives do not tell apart nothing moves: part of a variable's own curvature.
const DAMPING: f64 = 1e-8;

/// Terms to be fitted beside some effects.
#[derive(Clone)]
pub struct Candidate {
    /// The effects.
    pub hypothesis: Hypothesis,
    /// The terms, their amplitudes as they promise.
    pub terms: Vec<Term>,
    /// By how much every variable of the fit moves, and χ² falls, in linear approximation.
    pub step: Vec<f64>,
    /// See `step`.
    pub gain: f64,
    /// Whether no other of as many terms promises more beside these effects.
    pub is_foremost: bool,
}

/// What promises most, beside the names of a fit, without each of them, and in the place of them all, from the fit's residuals and their derivatives; and the terms
/// out of which it was chosen.
pub fn candidates(
    best: &Refit<'_>,
    (residual, slopes): &(DVector<f64>, DMatrix<f64>),
    settings: &LawSettings,
) -> Option<(Vec<Candidate>, Vec<Term>)> {
    let (all, columns, torques) = effects_of_terms(best, residual.len())?;
    let names = &best.hypothesis.effects;
    let mut left_out: Vec<Vec<Effect>> = vec![Vec::new()];
    left_out.extend(names.iter().map(|effect| vec![*effect]));
    left_out.extend((names.len() > 1).then(|| names.clone()));
    let lower = best.problem.lower();
    let (apart, alone) = (told_apart(&torques, settings.the_same), recordings(best.problem.records).len() == 1);
    // in a single release the amplitude falls with time, and a loss that drifts stands for any loss
    let of_loss = alone && names.iter().any(|effect| effect.entry().acts == Acts::Loss);
    let drifts = |term: &Term| of_loss && term.drifts && term.state != "angle";
    let promise = |out: &Vec<Effect>| {
        let parameters: Vec<Parameter> = out.iter().flat_map(|effect| effect.parameters()).copied().collect();
        let gone: Vec<usize> = parameters.iter().filter_map(|parameter| best.place(*parameter)).collect();
        let kept: Vec<usize> = (0..best.x.len()).filter(|i| !gone.contains(i) && best.x[*i] > lower[*i]).collect();
        // what the names explain is then the term's to explain
        let left = gone.iter().fold(residual.clone(), |r, i| r - slopes.column(*i) * best.x[*i]);
        let hypothesis = out.iter().fold(best.hypothesis.clone(), |hypothesis, effect| hypothesis.without(*effect));
        let own = slopes.select_columns(&kept);
        let projection = Projection::off(left.clone(), own.clone());
        let projected = projection.out(&columns);
        // all losses make the swing smaller, and all springs make it faster: only what else they do tells them apart
        let of_names = projection.out(&slopes.select_columns(&gone));
        let is_a_name =
            |k: usize| of_names.column_iter().any(|name| cosine(&projected.column(k), &name).abs() > settings.the_same);
        let new: Vec<usize> = apart.iter().copied().filter(|k| !is_a_name(*k) && !drifts(&all[*k])).collect();
        let does_something =
            |k: &usize| projected.column(*k).norm() > settings.nothing_left * columns.column(*k).norm();
        let new: Vec<usize> = new.into_iter().filter(does_something).collect();
        let promising = promising(
            &projection.residual,
            &projected,
            &foremost_of_forms(&projection.residual, &projected, &all, new),
            (settings.most, settings.paired),
        );
        let steps = steps(&left, &own, &columns, &promising);
        let candidate = |(i, (gain, terms)): (usize, Promising)| {
            let mut step = vec![0.0; best.x.len()];
            kept.iter().zip(steps.column(i).iter()).for_each(|(place, moved)| step[*place] = *moved);
            let terms = terms.into_iter().enumerate().map(|(place, (k, a))| started(&all[k], a, place)).collect();
            Candidate { hypothesis: hypothesis.clone(), terms, step, gain, is_foremost: false }
        };
        promising.into_iter().enumerate().map(candidate).collect::<Vec<_>>()
    };
    // what promises most beside each set of names comes first
    let mut all_ranked: Vec<(usize, Candidate)> = left_out.iter().flat_map(|out| ranked(promise(out))).collect();
    all_ranked.sort_by_key(|own| own.0);
    let candidates = all_ranked.into_iter().map(|own| own.1).collect();
    Some((candidates, apart.iter().map(|k| all[*k].clone()).collect()))
}

/// Candidates with their places, the foremost first, among those of as many terms.
fn ranked(candidates: Vec<Candidate>) -> Vec<(usize, Candidate)> {
    let mut of_each: BTreeMap<usize, usize> = BTreeMap::new();
    let place = |candidate: Candidate| {
        let next = of_each.entry(candidate.terms.len()).or_default();
        *next += 1;
        (*next, Candidate { is_foremost: *next == 1, ..candidate })
    };
    candidates.into_iter().map(place).collect()
}

/// The terms that exert another torque than any before them: on a single link hinge, strip and tip are one place.
fn told_apart(torques: &DMatrix<f64>, the_same: f64) -> Vec<usize> {
    let mut kept: Vec<usize> = Vec::new();
    for k in 0..torques.ncols() {
        let is_the_same = |other: &usize| cosine(&torques.column(k), &torques.column(*other)).abs() > the_same;
        if !kept.iter().any(is_the_same) {
            kept.push(k);
        }
    }
    kept
}

/// Of the angle between two columns; 0 where one of them is nothing.
fn cosine(a: &DVectorView<'_, f64>, b: &DVectorView<'_, f64>) -> f64 {
    a.dot(b) / (a.norm() * b.norm()).max(f64::MIN_POSITIVE)
}

/// Every term of the grammar, what a unit of its amplitude adds to the residuals, of which there are so many, a column each, and the torques on the links.
fn effects_of_terms(fit: &Refit<'_>, rows: usize) -> Option<(Vec<Term>, DMatrix<f64>, DMatrix<f64>)> {
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
        let torque =
            |swing: &Swing<'_>, motion: &Motion, q: &mut [f64]| formula.add_torque(&swing.around.chain, motion, q);
        let seen = |swing: &Swing<'_>| swing.response(|motion, q| torque(swing, motion, q)).as_slice().to_vec();
        let exerted = |swing: &Swing<'_>| swing.torques(|motion, q| torque(swing, motion, q));
        Some((swings.iter().flat_map(seen).collect(), swings.iter().flat_map(exerted).collect()))
    };
    let columns: Vec<(Vec<f64>, Vec<f64>)> = all.par_iter().map(column).collect::<Option<_>>()?;
    let (seen, instants) = columns.first().map(|(seen, torques)| (seen.len(), torques.len()))?;
    // beliefs stand after what is seen, and no torque changes them
    let matrix = DMatrix::from_fn(rows, all.len(), |i, k| if i < seen { columns[k].0[i] } else { 0.0 });
    let torques = DMatrix::from_fn(instants, all.len(), |i, k| columns[k].1[i]);
    Some((all, matrix, torques))
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

/// By how much some terms lower χ², and which with what amplitudes.
type Promising = (f64, Vec<(usize, f64)>);

/// By how much a term alone would lower χ², with the amplitude of which it does.
fn alone(residual: &DVector<f64>, projected: &DMatrix<f64>, k: usize) -> (f64, f64) {
    let (own, pull) = (projected.column(k), projected.column(k).dot(residual));
    (pull * pull / own.norm_squared(), -pull / own.norm_squared())
}

/// Some terms, each form once, with the other coefficients at which it promises most; the foremost first.
fn foremost_of_forms(
    residual: &DVector<f64>,
    projected: &DMatrix<f64>,
    all: &[Term],
    mut terms: Vec<usize>,
) -> Vec<usize> {
    let gain = |k: &usize| alone(residual, projected, *k).0;
    terms.sort_by(|a, b| gain(b).total_cmp(&gain(a)));
    let mut forms = Vec::new();
    terms.retain(|k| {
        let is_first = !forms.contains(&all[*k].form());
        forms.push(all[*k].form());
        is_first
    });
    terms
}

/// The foremost of some terms, and of pairs of them, that lower what is left most, with their amplitudes: so many of each; paired are so many.
fn promising(
    residual: &DVector<f64>,
    projected: &DMatrix<f64>,
    terms: &[usize],
    (count, paired): (usize, usize),
) -> Vec<Promising> {
    let of_pair = |a: usize, b: usize| {
        let pair = projected.select_columns(&[a, b]);
        let pull = pair.tr_mul(residual);
        let value = pair.tr_mul(&pair).try_inverse()? * &pull;
        Some((pull.dot(&value), vec![(a, -value[0]), (b, -value[1])]))
    };
    let foremost = &terms[..terms.len().min(paired)];
    let with_later =
        |(i, a): (usize, &usize)| terms[i + 1..].iter().filter_map(move |b| of_pair(*a, *b)).collect::<Vec<_>>();
    let mut pairs: Vec<Promising> =
        foremost.iter().enumerate().flat_map(with_later).filter(|(gain, _)| gain.is_finite()).collect();
    pairs.sort_by(|a, b| b.0.total_cmp(&a.0));
    let of_one = |k: &usize| {
        let (gain, amplitude) = alone(residual, projected, *k);
        (gain, vec![(*k, amplitude)])
    };
    terms.iter().take(count).map(of_one).chain(pairs.into_iter().take(count)).collect()
}

/// By how much the variables with these derivatives move with each set of terms, a column each: the step of a descent that is damped a little.
fn steps(left: &DVector<f64>, slopes: &DMatrix<f64>, columns: &DMatrix<f64>, promising: &[Promising]) -> DMatrix<f64> {
    let (normal, none) = (slopes.tr_mul(slopes), vec![None; slopes.ncols()]);
    let mut steps = DMatrix::zeros(slopes.ncols(), promising.len());
    for (mut step, (_, terms)) in steps.column_iter_mut().zip(promising) {
        let with = terms.iter().fold(left.clone(), |with, (k, a)| with + columns.column(*k) * *a);
        if let Some(damped) = damped_step(&normal, &slopes.tr_mul(&with), &none, DAMPING) {
            step.copy_from(&damped);
        }
    }
    steps
}

/// A term with its amplitude, under a name of its own.
pub(super) fn started(term: &Term, amplitude: f64, place: usize) -> Term {
    let mut term = term.clone();
    term.law.name = format!("learnt {}", place + 1);
    if let Some(own) = term.law.parameters.get_mut("a") {
        own.start = amplitude;
    }
    term
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_other_variable_moves_along_with_a_term() {
        let wave = |rate: f64, phase: f64| move |i: usize| (rate * i as f64 + phase).sin();
        let waves = [wave(0.1, 0.0), wave(0.1, 1.0), wave(0.37, 0.4)];
        // derivatives of very different sizes, as those with an angle and with an inertia are
        let slopes = DMatrix::from_fn(200, 2, |i, k| [1.0, 1e5][k] * waves[k](i));
        let columns = DMatrix::from_fn(200, 1, |i, _| waves[2](i) + 0.5 * waves[0](i));
        let left = DVector::from_fn(200, |i, _| -3.0 * columns[(i, 0)] + 0.2 * waves[1](i));
        let steps = steps(&left, &slopes, &columns, &[(0.0, vec![(0, 3.0)]), (0.0, vec![(0, 1.0)])]);
        for (step, amplitude) in steps.column_iter().zip([3.0, 1.0]) {
            let there = &left + columns.column(0) * amplitude + &slopes * step;
            for slope in slopes.column_iter() {
                assert!(slope.dot(&there).abs() < 1e-6 * slope.norm() * left.norm(), "{steps}");
            }
        }
        // with the term as large as it is, only what it does not explain is left to the others
        assert!(steps[(0, 0)].abs() < 1e-6 && (1e5 * steps[(1, 0)] + 0.2).abs() < 1e-6, "{steps}");
    }
}
