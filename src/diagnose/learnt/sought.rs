//! What is sought: the terms, and pairs of them, that would lower most of what is left beside the names of a fit, without each of them, and in their place.

use nalgebra::{DMatrix, DVector};
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
}

/// What promises most, beside the names of a fit, without each of them, and in the place of them all, from the fit's residuals and their derivatives; and the terms
/// out of which it was chosen.
pub fn candidates(
    best: &Refit<'_>,
    (residual, slopes): &(DVector<f64>, DMatrix<f64>),
    count: usize,
    settings: &LawSettings,
) -> Option<(Vec<Candidate>, Vec<Term>)> {
    let (all, columns) = effects_of_terms(best, residual.len())?;
    let names = &best.hypothesis.effects;
    let mut left_out: Vec<Vec<Effect>> = vec![Vec::new()];
    left_out.extend(names.iter().map(|effect| vec![*effect]));
    left_out.extend((names.len() > 1).then(|| names.clone()));
    let lower = best.problem.lower();
    let (apart, alone) = (told_apart(&columns, settings.the_same), recordings(best.problem.records).len() == 1);
    // in a single release the amplitude falls with time, and a loss that drifts stands for any loss
    let of_loss = alone && names.iter().any(|effect| effect.entry().acts == Acts::Loss);
    let drifts = |term: &Term| of_loss && term.drifts && term.state != "angle";
    let promise = |out: &Vec<Effect>| {
        let parameters: Vec<Parameter> = out.iter().flat_map(|effect| effect.parameters()).copied().collect();
        let gone: Vec<usize> = parameters.iter().filter_map(|parameter| best.place(*parameter)).collect();
        let kept: Vec<usize> = (0..best.x.len()).filter(|i| !gone.contains(i) && best.x[*i] > lower[*i]).collect();
        // what the names explain is then the term's to explain
        let left = gone.iter().fold(residual.clone(), |r, i| r - slopes.column(*i) * best.x[*i]);
        let is_a_name = |k: usize| {
            let own = columns.column(k);
            let cosine = |i: &usize| own.dot(&slopes.column(*i)) / (own.norm() * slopes.column(*i).norm()).max(1e-300);
            gone.iter().any(|i| cosine(i).abs() > settings.the_same)
        };
        let new: Vec<usize> = apart.iter().copied().filter(|k| !is_a_name(*k) && !drifts(&all[*k])).collect();
        let hypothesis = out.iter().fold(best.hypothesis.clone(), |hypothesis, effect| hypothesis.without(*effect));
        let own = slopes.select_columns(&kept);
        let projection = Projection::off(left.clone(), own.clone());
        let promising = promising(&projection, (&columns, &new), count, settings);
        let steps = steps(&left, &own, &columns, &promising);
        let candidate = |(i, (gain, terms)): (usize, Promising)| {
            let mut step = vec![0.0; best.x.len()];
            kept.iter().zip(steps.column(i).iter()).for_each(|(place, moved)| step[*place] = *moved);
            let terms = terms.into_iter().enumerate().map(|(place, (k, a))| started(&all[k], a, place)).collect();
            Candidate { hypothesis: hypothesis.clone(), terms, step, gain }
        };
        promising.into_iter().enumerate().map(candidate).collect::<Vec<_>>()
    };
    let candidates = left_out.iter().flat_map(promise).collect();
    Some((candidates, apart.iter().map(|k| all[*k].clone()).collect()))
}

/// The terms that do something else to the angles than any before them: on a single link hinge, strip and tip are one place.
fn told_apart(columns: &DMatrix<f64>, the_same: f64) -> Vec<usize> {
    let sizes: Vec<f64> = columns.column_iter().map(|column| column.norm().max(1e-300)).collect();
    let mut kept: Vec<usize> = Vec::new();
    for k in 0..columns.ncols() {
        let cosine = |other: &usize| columns.column(k).dot(&columns.column(*other)) / (sizes[k] * sizes[*other]);
        if !kept.iter().any(|other| cosine(other).abs() > the_same) {
            kept.push(k);
        }
    }
    kept
}

/// Every term of the grammar, and what a unit of its amplitude adds to the residuals, of which there are so many, a column each.
fn effects_of_terms(fit: &Refit<'_>, rows: usize) -> Option<(Vec<Term>, DMatrix<f64>)> {
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
    let seen = columns.first()?.len();
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

/// By how much some terms lower χ², and which with what amplitudes.
type Promising = (f64, Vec<(usize, f64)>);

/// The terms and pairs of them that lower what is left most, beside some effects.
fn promising(
    left: &Projection,
    (columns, new): (&DMatrix<f64>, &[usize]),
    count: usize,
    settings: &LawSettings,
) -> Vec<Promising> {
    let projected = left.out(columns);
    let is_new = |k: usize| projected.column(k).norm() > settings.nothing_left * columns.column(k).norm();
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
    let foremost = &alone[..alone.len().min(settings.paired)];
    let mut pairs: Vec<Promising> = foremost
        .iter()
        .enumerate()
        .flat_map(|(i, a)| alone[i + 1..].iter().filter_map(move |b| of_pair(a, b)))
        .filter(|(gain, _)| gain.is_finite())
        .collect();
    pairs.sort_by(|a, b| b.0.total_cmp(&a.0));
    let amplitude = |k: usize| -projected.column(k).dot(&left.residual) / projected.column(k).norm_squared();
    let alone = alone.iter().take(count).map(|(gain, k)| (*gain, vec![(*k, amplitude(*k))]));
    alone.chain(pairs.into_iter().take(count)).collect()
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
