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
use crate::fit::recordings;
use crate::model::effects::Effect as _;
use crate::model::effects::formula::Formula;
use crate::model::{Motion, Parameter};

/// Terms to be fitted beside some effects.
#[derive(Clone)]
pub struct Candidate {
    /// The effects.
    pub hypothesis: Hypothesis,
    /// The terms, their amplitudes as they promise.
    pub terms: Vec<Term>,
    /// Fall of χ² in linear approximation.
    pub gain: f64,
}

/// What promises most, beside the names of a fit, without each of them, and in the place of them all; with the fit's residuals and their derivatives.
pub fn candidates(
    best: &Refit<'_>,
    (residual, slopes): &(DVector<f64>, DMatrix<f64>),
    count: usize,
    settings: &LawSettings,
) -> Option<Vec<Candidate>> {
    let (all, columns) = effects_of_terms(best, residual.len())?;
    let names = &best.hypothesis.effects;
    let mut left_out: Vec<Vec<Effect>> = vec![Vec::new()];
    left_out.extend(names.iter().map(|effect| vec![*effect]));
    left_out.extend((names.len() > 1).then(|| names.clone()));
    let lower = best.problem.lower();
    let (apart, alone) = (told_apart(&columns, settings.the_same), recordings(best.problem.records).len() == 1);
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
        // in a single release the amplitude falls with time, and a loss that drifts stands for any loss
        let of_loss = alone && out.iter().any(|effect| effect.entry().acts == Acts::Loss);
        let drifts = |term: &Term| of_loss && term.drifts && term.state != "angle";
        let new: Vec<usize> = apart.iter().copied().filter(|k| !is_a_name(*k) && !drifts(&all[*k])).collect();
        let hypothesis = out.iter().fold(best.hypothesis.clone(), |hypothesis, effect| hypothesis.without(*effect));
        let projection = Projection::off(left, slopes.select_columns(&kept));
        promising(&projection, &all, (&columns, &new), &hypothesis, count, settings)
    };
    Some(left_out.iter().flat_map(promise).collect())
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

/// The terms and pairs of them that lower what is left most, beside some effects.
fn promising(
    left: &Projection,
    all: &[Term],
    (columns, new): (&DMatrix<f64>, &[usize]),
    hypothesis: &Hypothesis,
    count: usize,
    settings: &LawSettings,
) -> Vec<Candidate> {
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
