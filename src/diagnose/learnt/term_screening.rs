//! What is sought: the terms, and pairs of them, that would lower most of what is left beside the names of a fit, without each of them, and in their place.

use std::iter;

use nalgebra::{DMatrix, DVector, DVectorView};
use rayon::prelude::*;

use super::super::basis_law::{Swing, swings};
use super::super::effect::{Acts, Effect, Place};
use super::super::grammar::{StateRange, Term, terms};
use super::super::hypothesis::Hypothesis;
use super::super::linearisation::Linearisation;
use super::super::refit::Refit;
use super::super::screen::Projection;
use super::super::settings::LawSettings;
use super::term_torques::cosine;
use crate::experiment::LawPlace;
use crate::fit::descent::damped_step;
use crate::fit::recordings;
use crate::model::effects::Effect as _;
use crate::model::effects::formula::Formula;
use crate::model::{Motion, Parameter, Partials};

/// For so many terms, or pairs, that are begun beside each set of names one more is begun that acts in a part of the swing (cost).
const FEW: usize = 4;
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
    /// So many others of as many terms promise more beside these effects.
    pub rank: usize,
}

impl Candidate {
    /// Whether one of its terms is dry friction in a part of the swing.
    pub fn acts_in_a_part(&self) -> bool {
        self.terms.iter().any(Term::acts_in_a_part)
    }
}

/// What promises most, beside the names of a fit, without each of them, in the place of those that are no camera's, and of them all, from the fit's residuals and
/// their derivatives; the terms
/// out of which it was chosen; and every term with every start.
pub fn candidates(
    best: &Refit<'_>,
    (residual, slopes): &(DVector<f64>, DMatrix<f64>),
    settings: &LawSettings,
) -> Option<(Vec<Candidate>, Vec<Term>, Vec<Term>)> {
    let around = Linearisation::of_all(best)?;
    let swings = swings(best, &around)?;
    let (all, columns, torques) = effects_of_terms(best, &swings, residual.len())?;
    let names = &best.hypothesis.effects;
    let left_out = left_out(names);
    let lower = best.problem.lower();
    let apart = told_apart(&torques, &torques_of_the_base(best, &swings)?, settings.the_same);
    let alone = recordings(best.problem.records).len() == 1;
    // in a single release the amplitude falls with time, and a loss that drifts stands for any loss; one that sets in bends the decay at an instant
    let of_loss = alone && names.iter().any(|effect| effect.entry().acts == Acts::Loss);
    let drifts = |term: &Term| of_loss && term.drifts && !term.sets_in() && term.state != "angle";
    let promise = |out: &Vec<Effect>| {
        let parameters: Vec<Parameter> = out.iter().flat_map(|effect| effect.parameters()).copied().collect();
        let gone: Vec<usize> = parameters.iter().filter_map(|parameter| best.place(*parameter)).collect();
        let kept: Vec<usize> = (0..best.x.len()).filter(|i| !gone.contains(i) && best.x[*i] > lower[*i]).collect();
        // what the names explain is then the term's to explain; a yield angle or a frequency explains nothing by itself
        let explaining = parameters.iter().filter(|p| p.is_proportional()).filter_map(|p| best.place(*p));
        let left = explaining.fold(residual.clone(), |r, i| r - slopes.column(i) * best.x[i]);
        let hypothesis = out.iter().fold(best.hypothesis.clone(), |hypothesis, effect| hypothesis.without(*effect));
        let own = slopes.select_columns(&kept);
        let projection = Projection::off(left.clone(), own.clone());
        let projected = projection.out(&columns);
        // all losses make the swing smaller, and all springs make it faster: only what else they do tells them apart
        let of_names = projection.out(&slopes.select_columns(&gone));
        let is_a_name =
            |k: usize| of_names.column_iter().any(|name| cosine(&projected.column(k), &name).abs() > settings.the_same);
        let does_something = |k: usize| projected.column(k).norm() > settings.nothing_left * columns.column(k).norm();
        let is_new = |k: &usize| does_something(*k) && !is_a_name(*k) && !drifts(&all[*k]);
        let single = |is_asked: &dyn Fn(&Term) -> bool| {
            let new = apart.iter().copied().filter(is_new).filter(|k| is_asked(&all[*k]));
            let each = new.map(|k| of_one(&projection.residual, &projected, k));
            // what goes with a rate takes energy, and gives none
            foremost_of_forms(each.filter(|own| own.is_possible(&all)).collect(), &all)
        };
        let of_all_the_swing = single(&|term| !term.acts_in_a_part());
        let of_a_part = single(&Term::acts_in_a_part);
        let pairs = |alone, many| promising(&projection.residual, &projected, alone, many);
        // what touches in a part of the swing follows many motions nearly, and is seldom there
        let few = settings.most / FEW;
        let foremost = of_a_part.len().min(few);
        let beside = of_all_the_swing.iter().take(settings.paired).cloned();
        let with_a_part = of_a_part.into_iter().take(few).chain(beside).collect();
        let mut promising = pairs(of_all_the_swing, (settings.most, settings.paired));
        let is_of_a_part = |own: &Promising| own.terms.iter().any(|(k, _)| all[*k].acts_in_a_part());
        promising.extend(pairs(with_a_part, (few, foremost)).into_iter().filter(is_of_a_part));
        promising.retain(|own| own.is_possible(&all));
        let steps = steps(&left, &own, &columns, &promising);
        let candidate = |(i, Promising { gain, terms, rank }): (usize, Promising)| {
            let mut step = vec![0.0; best.x.len()];
            kept.iter().zip(steps.column(i).iter()).for_each(|(place, moved)| step[*place] = *moved);
            let terms = terms.into_iter().enumerate().map(|(place, (k, a))| started(&all[k], a, place)).collect();
            Candidate { hypothesis: hypothesis.clone(), terms, step, gain, rank }
        };
        promising.into_iter().enumerate().map(candidate).collect::<Vec<_>>()
    };
    // what promises most beside each set of names comes first
    let mut candidates: Vec<Candidate> = left_out.iter().flat_map(promise).collect();
    candidates.sort_by_key(|candidate| candidate.rank);
    let apart = apart.iter().map(|k| all[*k].clone()).collect();
    Some((candidates, apart, all))
}

/// Of some names those that are left out at a time: none, each, all that are no camera's, and all.
fn left_out(names: &[Effect]) -> Vec<Vec<Effect>> {
    let of_physics = names.iter().copied().filter(|effect| effect.place() != Place::Camera).collect();
    let each = names.iter().map(|effect| vec![*effect]);
    let mut all: Vec<Vec<Effect>> = iter::once(Vec::new()).chain(each).collect();
    for out in [of_physics, names.to_vec()] {
        if !all.contains(&out) {
            all.push(out);
        }
    }
    all
}

/// The terms that exert another torque than any before them, and than what is free in the base model: on a single link hinge, strip and tip are one place.
fn told_apart(torques: &DMatrix<f64>, of_base: &DMatrix<f64>, the_same: f64) -> Vec<usize> {
    let mut kept: Vec<usize> = Vec::new();
    for k in 0..torques.ncols() {
        let is_the_same = |other: DVectorView<'_, f64>| cosine(&torques.column(k), &other).abs() > the_same;
        let is_of_base = of_base.column_iter().any(is_the_same);
        if !is_of_base && !kept.iter().any(|other| is_the_same(torques.column(*other))) {
            kept.push(k);
        }
    }
    kept
}

/// The torques on the links of a unit of what is free in the base model and held by no bound, a column each. What a term adds to the angles is known too coarsely to tell
/// it from these.
fn torques_of_the_base(fit: &Refit<'_>, swings: &[Swing<'_>]) -> Option<DMatrix<f64>> {
    let lower = fit.problem.lower();
    let of_names: Vec<Parameter> =
        fit.hypothesis.effects.iter().flat_map(|effect| effect.parameters()).copied().collect();
    let free = fit.problem.free.iter().enumerate();
    let is_free =
        |(place, parameter): &(usize, &Parameter)| fit.x[*place] > lower[*place] && !of_names.contains(parameter);
    let free: Vec<Parameter> = free.filter(is_free).map(|(_, parameter)| *parameter).collect();
    let of_record = |(record, swing): (usize, &Swing<'_>)| {
        let (model, _) = fit.problem.model(record, &fit.x[..fit.problem.free.len()]).ok()?;
        let unit = |parameter: &Parameter| {
            swing.torques(|motion, q| {
                let mut partials = Partials::zero(model.chain().count(), model.rates());
                model.partials(motion, &mut partials);
                model.sensitivity(*parameter, motion, &partials, q);
            })
        };
        Some(free.iter().map(unit).collect::<Vec<_>>())
    };
    let of_records: Vec<Vec<Vec<f64>>> = swings.iter().enumerate().map(of_record).collect::<Option<_>>()?;
    let columns = (0..free.len()).map(|k| of_records.iter().flat_map(|of| &of[k]).copied().collect::<Vec<f64>>());
    let columns: Vec<DVector<f64>> = columns.map(DVector::from_vec).collect();
    Some(if columns.is_empty() { DMatrix::zeros(0, 0) } else { DMatrix::from_columns(&columns) })
}

/// Every term of the grammar, what a unit of its amplitude adds to the residuals, of which there are so many, a column each, and the torques on the links.
fn effects_of_terms(
    fit: &Refit<'_>,
    swings: &[Swing<'_>],
    rows: usize,
) -> Option<(Vec<Term>, DMatrix<f64>, DMatrix<f64>)> {
    let at = |place: LawPlace, joint: Option<usize>| {
        let terms = terms(place, largest(swings, (place, joint), fit.problem.longest_s()));
        terms.into_iter().map(move |term| match joint {
            Some(joint) => term.at_joint(joint),
            None => term,
        })
    };
    let joints = fit.problem.marks() - 1;
    // all joints alike, and of several each by itself
    let of_joints = (joints > 0).then_some(None).into_iter().chain((1..=joints).filter(|_| joints > 1).map(Some));
    let all: Vec<Term> = at(LawPlace::Hinge, None)
        .chain(of_joints.flat_map(|joint| at(LawPlace::Joint, joint)))
        .chain(at(LawPlace::Strip, None))
        .chain(at(LawPlace::Tip, None))
        .collect();
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

/// The largest state at a place, or at one joint.
fn largest(swings: &[Swing<'_>], (place, joint): (LawPlace, Option<usize>), time_s: f64) -> StateRange {
    let mut largest = StateRange { angle: 1e-6, rate: 1e-6, time_s };
    for (motion, swing) in swings.iter().flat_map(|swing| swing.motions().map(move |motion| (motion, swing))) {
        let links = motion.links();
        let mut meet = |angle: f64, rate: f64| {
            largest.angle = largest.angle.max(angle.abs());
            largest.rate = largest.rate.max(rate.abs());
        };
        match place {
            LawPlace::Hinge | LawPlace::Support => meet(motion.theta_rad[0], motion.rate[0]),
            LawPlace::Joint => (1..links).filter(|i| joint.is_none_or(|only| only == *i)).for_each(|i| {
                meet(motion.theta_rad[i] - motion.theta_rad[i - 1], motion.rate[i] - motion.rate[i - 1]);
            }),
            LawPlace::Strip | LawPlace::Tip => meet(0.0, swing.fastest_m_s(motion)),
        }
    }
    largest
}

/// Terms that lower χ².
#[derive(Clone)]
struct Promising {
    gain: f64,
    /// Their places, with the amplitudes of which they do.
    terms: Vec<(usize, f64)>,
    /// So many others of as many terms lower it more.
    rank: usize,
}

impl Promising {
    const fn of(gain: f64, terms: Vec<(usize, f64)>) -> Self {
        Self { gain, terms, rank: 0 }
    }

    /// None of its terms is a loss that gives energy.
    fn is_possible(&self, all: &[Term]) -> bool {
        self.terms.iter().all(|(k, amplitude)| !all[*k].is_loss() || *amplitude > 0.0)
    }
}

/// A term alone.
fn of_one(residual: &DVector<f64>, projected: &DMatrix<f64>, k: usize) -> Promising {
    let (own, pull) = (projected.column(k), projected.column(k).dot(residual));
    Promising::of(pull * pull / own.norm_squared(), vec![(k, -pull / own.norm_squared())])
}

/// The same, those that lower it most first.
fn ranked(mut all: Vec<Promising>) -> Vec<Promising> {
    all.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    all.iter_mut().enumerate().for_each(|(rank, own)| own.rank = rank);
    all
}

/// Of single terms each form once, with the other coefficients at which it promises most; the foremost first.
fn foremost_of_forms(alone: Vec<Promising>, all: &[Term]) -> Vec<Promising> {
    let mut foremost = ranked(alone);
    let first = each_form_once(foremost.iter().map(|own| own.terms[0].0), all);
    foremost.retain(|own| first.contains(&own.terms[0].0));
    ranked(foremost)
}

/// Of the places of some terms the first of each form.
pub(super) fn each_form_once(places: impl Iterator<Item = usize>, all: &[Term]) -> Vec<usize> {
    let mut first: Vec<usize> = Vec::new();
    for k in places {
        if !first.iter().any(|own| all[*own].form() == all[k].form()) {
            first.push(k);
        }
    }
    first
}

/// The foremost of single terms, and of pairs of them: so many of each; paired are so many.
fn promising(
    residual: &DVector<f64>,
    projected: &DMatrix<f64>,
    alone: Vec<Promising>,
    (count, paired): (usize, usize),
) -> Vec<Promising> {
    let of_pair = |a: usize, b: usize| {
        let pair = projected.select_columns(&[a, b]);
        let pull = pair.tr_mul(residual);
        let value = pair.tr_mul(&pair).try_inverse()? * &pull;
        let gain = pull.dot(&value);
        gain.is_finite().then(|| Promising::of(gain, vec![(a, -value[0]), (b, -value[1])]))
    };
    let places: Vec<usize> = alone.iter().map(|own| own.terms[0].0).collect();
    let (places, of_pair) = (&places, &of_pair);
    let with_later = |i: usize| places[i + 1..].iter().filter_map(move |b| of_pair(places[i], *b));
    let pairs = ranked((0..places.len().min(paired)).flat_map(with_later).collect());
    alone.into_iter().take(count).chain(pairs.into_iter().take(count)).collect()
}

/// By how much the variables with these derivatives move with each set of terms, a column each: the step of a descent that is damped a little.
fn steps(left: &DVector<f64>, slopes: &DMatrix<f64>, columns: &DMatrix<f64>, promising: &[Promising]) -> DMatrix<f64> {
    let (normal, none) = (slopes.tr_mul(slopes), vec![None; slopes.ncols()]);
    let mut steps = DMatrix::zeros(slopes.ncols(), promising.len());
    for (mut step, own) in steps.column_iter_mut().zip(promising) {
        let with = own.terms.iter().fold(left.clone(), |with, (k, a)| with + columns.column(*k) * *a);
        if let Some(damped) = damped_step(&normal, &slopes.tr_mul(&with), &none, DAMPING) {
            step.copy_from(&damped);
        }
    }
    steps
}

/// A term with its amplitude, under a name of its own.
pub(super) fn started(term: &Term, amplitude: f64, place: usize) -> Term {
    let mut term = term.named(place);
    if let Some(own) = term.law.parameters.get_mut("a") {
        own.start = amplitude;
    }
    term
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cube_is_told_from_a_square_and_the_same_torque_stands_once() {
        let rate = |i: usize| (-(i as f64) / 600.0).exp() * (0.2 * i as f64).sin();
        let square = |i: usize| rate(i) * rate(i).abs();
        let torques = DMatrix::from_fn(900, 3, |i, k| [square(i), 2.0 * square(i), rate(i).powi(3)][k]);
        let the_same = LawSettings::default().the_same;
        assert_eq!(told_apart(&torques, &DMatrix::zeros(0, 0), the_same), [0, 2]);
        // nor is what is free in the base model a term of its own
        assert_eq!(told_apart(&torques, &torques.columns(2, 1).into_owned(), the_same), [0]);
    }

    #[test]
    fn every_other_variable_moves_along_with_a_term() {
        let wave = |rate: f64, phase: f64| move |i: usize| (rate * i as f64 + phase).sin();
        let waves = [wave(0.1, 0.0), wave(0.1, 1.0), wave(0.37, 0.4)];
        // derivatives of very different sizes, as those with an angle and with an inertia are
        let slopes = DMatrix::from_fn(200, 2, |i, k| [1.0, 1e5][k] * waves[k](i));
        let columns = DMatrix::from_fn(200, 1, |i, _| waves[2](i) + 0.5 * waves[0](i));
        let left = DVector::from_fn(200, |i, _| -3.0 * columns[(i, 0)] + 0.2 * waves[1](i));
        let promising = [3.0, 1.0].map(|amplitude| Promising::of(0.0, vec![(0, amplitude)]));
        let steps = steps(&left, &slopes, &columns, &promising);
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
