//! The candidates: every form alone and every two of different effects, and how probable each is.

use rayon::prelude::*;

use super::filter::LANES;
use super::fit::{Bench, Fit, Member, Stage};
use super::forms::{Effect, FROM_ENDS_S, Form};
use super::solve::{Span, solve};

/// Prior odds of each effect of the table.
const PRIOR_ODDS: f64 = 0.1;
/// How near to an edge of the lamp no other jump is sought (s).
pub const BESIDE_EDGE_S: f64 = 1.0;
/// A form whose best start takes less than this from the sum of squares cannot pay for its prior, size and shape.
const WORTH: f64 = 5.0;
/// A form alone is led down from so many of its likeliest starts, a second one from the likeliest.
const STARTS: usize = 2;

/// A candidate with its probability among all.
#[derive(Debug, Clone)]
pub struct Candidate {
    /// Fitted.
    pub fit: Fit,
    /// Posterior.
    pub probability: f64,
}

/// All candidates, likeliest first.
pub fn candidates(bench: &Bench<'_>) -> Vec<Candidate> {
    let Some(base) = bench.fit(Vec::new()) else { return Vec::new() };
    let still = Starts::of(bench, &bench.still);
    let singles: Vec<Fit> =
        Form::ALL.par_iter().filter_map(|form| with_one_more(bench, &base, *form, &still)).collect();
    let mut ranked: Vec<&Fit> = singles.iter().collect();
    ranked.sort_by(|a, b| b.ln_evidence.total_cmp(&a.ln_evidence));
    let mut pairs: Vec<(&Fit, Form)> = Vec::new();
    for (k, one) in ranked.iter().enumerate() {
        // forms without a fit of their own come last
        let before = |form: Form| ranked[..k].iter().any(|better| better.members[0].form == form);
        let own = one.members[0].form.effect();
        pairs.extend(Form::ALL.into_iter().filter(|f| f.effect() != own && !before(*f)).map(|form| (*one, form)));
    }
    let walking =
        singles.iter().find(|fit| fit.walk_m2_s > 0.0).map(|fit| Starts::of(bench, &bench.stage(fit.walk_m2_s)));
    let starts_of = |one: &Fit| walking.as_ref().filter(|_| one.walk_m2_s > 0.0).unwrap_or(&still);
    let pairs: Vec<Fit> =
        pairs.par_iter().filter_map(|(one, other)| with_one_more(bench, one, *other, starts_of(one))).collect();
    let mut best: Vec<Fit> = vec![base];
    for fit in singles.iter().cloned().chain(pairs) {
        let forms = |fit: &Fit| {
            let mut ids: Vec<&str> = fit.members.iter().map(|m| m.form.id()).collect();
            ids.sort_unstable();
            ids
        };
        match best.iter_mut().find(|other| forms(other) == forms(&fit)) {
            Some(other) if other.ln_evidence < fit.ln_evidence => *other = fit,
            Some(_) => {}
            None => best.push(fit),
        }
    }
    weighed(best)
}

fn weighed(fits: Vec<Fit>) -> Vec<Candidate> {
    let ln_prior = |fit: &Fit| fit.members.iter().map(|m| (PRIOR_ODDS * m.form.share()).ln()).sum::<f64>();
    let ln: Vec<f64> = fits.iter().map(|fit| fit.ln_evidence + ln_prior(fit)).collect();
    let most = ln.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let sum: f64 = ln.iter().map(|v| (v - most).exp()).sum();
    let mut all: Vec<Candidate> =
        fits.into_iter().zip(ln).map(|(fit, v)| Candidate { fit, probability: (v - most).exp() / sum }).collect();
    all.sort_by(|a, b| b.probability.total_cmp(&a.probability));
    all
}

/// A fit with one more form, from the starts that explain most of what is left.
fn with_one_more(bench: &Bench<'_>, fit: &Fit, form: Form, known: &Starts) -> Option<Fit> {
    let begins_to_walk = form == Form::Walk && fit.walk_m2_s == 0.0;
    let stage = &bench.stage(if begins_to_walk { bench.noise.walk_m2_s } else { fit.walk_m2_s });
    let tried = starts(bench, fit, form, stage, known).into_iter().filter_map(|shape| {
        let mut members = fit.members.clone();
        members.push(Member { form, shape });
        bench.fit(members)
    });
    tried.max_by(|a, b| a.ln_evidence.total_cmp(&b.ln_evidence))
}

/// The starts of every form on a stage, each with its first column, whitened.
struct Starts(Vec<(Form, Vec<f64>, Vec<f64>)>);

impl Starts {
    fn of(bench: &Bench<'_>, stage: &Stage) -> Self {
        let with = &bench.with;
        let shapes: Vec<(Form, Vec<f64>)> = Form::ALL
            .into_iter()
            .flat_map(|form| form.starts(with).into_iter().map(move |shape| (form, shape)))
            .collect();
        let first = |(form, shape): &(Form, Vec<f64>)| {
            Some((*form, shape.clone(), form.columns(shape, with).into_iter().next()?))
        };
        let whitened = |some: &[(Form, Vec<f64>)]| {
            let (shapes, columns): (Vec<_>, Vec<_>) =
                some.iter().filter_map(first).map(|(form, shape, column)| ((form, shape), column)).unzip();
            let white = stage.filter.whiten_all(&columns);
            shapes.into_iter().zip(white).map(|((form, shape), white)| (form, shape, white)).collect::<Vec<_>>()
        };
        Self(shapes.par_chunks(LANES).flat_map_iter(whitened).collect())
    }
}

fn starts(bench: &Bench<'_>, fit: &Fit, form: Form, stage: &Stage, known: &Starts) -> Vec<Vec<f64>> {
    if form == Form::Walk {
        return vec![Vec::new()];
    }
    if form == Form::Step {
        return jumps_of(bench, fit, stage).into_iter().map(|at_s| vec![at_s]).collect();
    }
    let members = bench.whitened(stage, &fit.members);
    let columns: Vec<&[f64]> = stage.base.iter().chain(&members).map(Vec::as_slice).collect();
    let span = Span::of(&columns, stage.y.len());
    let left = left_on(&columns, stage, fit);
    let own = known.0.iter().filter(|(of, ..)| *of == form);
    let mut ranked: Vec<(f64, Vec<f64>)> =
        own.map(|(_, shape, white)| (span.gain(white, &left), shape.clone())).collect();
    ranked.sort_by(|a, b| b.0.total_cmp(&a.0));
    ranked.truncate(if ranked.first().is_some_and(|best| best.0 > WORTH) { ranked.len() } else { 0 });
    let mut kept: Vec<Vec<f64>> = Vec::new();
    for (_, shape) in ranked {
        // neighbours of a start lead to the same place
        let is_near = |other: &Vec<f64>| other.iter().zip(&shape).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) < 0.8;
        if !kept.iter().any(is_near) {
            kept.push(shape);
        }
        if kept.len() == most_starts(fit) {
            break;
        }
    }
    kept
}

fn most_starts(fit: &Fit) -> usize {
    if fit.members.is_empty() { STARTS } else { 1 }
}

fn left_on(columns: &[&[f64]], stage: &Stage, fit: &Fit) -> Vec<f64> {
    solve(columns, &stage.y, &[]).map_or_else(|| fit.left.clone(), |solution| solution.left)
}

/// The likeliest jumps of what a fit leaves, away from the lamp's edges.
fn jumps_of(bench: &Bench<'_>, fit: &Fit, stage: &Stage) -> Vec<f64> {
    let grid = bench.with.grid;
    let members = bench.whitened(stage, &fit.members);
    let columns: Vec<&[f64]> = stage.base.iter().chain(&members).map(Vec::as_slice).collect();
    let left = left_on(&columns, stage, fit);
    let scan = stage.filter.jumps(&left, 3);
    let ends = (FROM_ENDS_S / grid.step_s).ceil() as usize;
    let mut cells: Vec<usize> = (ends..grid.len().saturating_sub(ends))
        .filter(|cell| scan[*cell].0 > WORTH && bench.with.lamp.nearest_s(grid.time_s(*cell)) > BESIDE_EDGE_S)
        .collect();
    cells.sort_by(|a, b| scan[*b].0.total_cmp(&scan[*a].0));
    let mut found: Vec<f64> = Vec::new();
    for cell in cells {
        let at_s = grid.time_s(cell) - 0.5 * grid.step_s;
        if found.iter().all(|other| (other - at_s).abs() > 2.0) {
            found.push(at_s);
        }
        if found.len() == most_starts(fit) {
            break;
        }
    }
    found
}

/// How probable an effect is, over all candidates that hold it.
pub fn inclusion(candidates: &[Candidate], effect: Effect) -> f64 {
    let with_it = candidates.iter().filter(|c| c.fit.effects().contains(&effect)).map(|c| c.probability);
    // `sum` of none is −0
    with_it.fold(0.0, |sum, probability| sum + probability).min(1.0)
}

/// The push over all candidates: mean and standard deviation of the mixture.
pub fn mixed_push(candidates: &[Candidate]) -> [f64; 2] {
    let mean: f64 = candidates.iter().map(|c| c.probability * c.fit.push()[0]).sum();
    let spread = |c: &Candidate| {
        let [push, sd] = c.fit.push();
        c.probability * (sd * sd + (push - mean).powi(2))
    };
    [mean, candidates.iter().map(spread).sum::<f64>().sqrt()]
}
