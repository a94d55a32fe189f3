//! How many rods stand for a strip.
//!
//! A chain of n rods swings as the strip does up to an error in proportion to ε = 1/n². For a large release and little noise that error is seen, and a
//! law would be named for it. So the rods are counted, too: their χ² over ε is a parabola, of which three counts tell the lowest point.

use rayon::prelude::*;

use super::context::FitContext;
use super::refit::{Refit, least_chi2};
use super::settings::Settings;
use crate::experiment::{Experiment, Model};

/// Counts between two marks that are tried beside the usual one, and the bounds of what they may lead to.
const TRIED: [usize; 2] = [4, 12];
const FEWEST: usize = 3;
const MOST: usize = 20;
/// Fits that leave least, of which those with fewer effects are compared.
const LEADERS: usize = 5;
/// Links that are rigid between the marks: no parabola leads there.
const RIGID: usize = 1;

/// How well each fit does, what it needs being paid for, over what the best of them leaves.
struct Weights<'s> {
    scatter: f64,
    settings: &'s Settings,
}

impl<'s> Weights<'s> {
    fn of(context: &FitContext<'s>, fits: &[Refit<'_>]) -> Self {
        Self { scatter: (least_chi2(fits) / context.values() as f64).max(1.0), settings: context.settings }
    }

    fn weight(&self, fit: &Refit<'_>) -> f64 {
        fit.chi2 / self.scatter + self.settings.misfit.counts * fit.coefficients() as f64
    }

    fn best<'f, 'a>(&self, fits: &'f [Refit<'a>]) -> Option<&'f Refit<'a>> {
        fits.iter().min_by(|a, b| self.weight(a).total_cmp(&self.weight(b)))
    }
}

/// The number of rods between two marks that the recordings ask for, if it is not the usual one; `None` also where the file asks for another.
pub fn preferred(context: &FitContext<'_>, fits: &[Refit<'_>]) -> Option<usize> {
    let usual = Model::default().pieces;
    if !context.is_strip() || context.experiment.model.pieces != usual {
        return None;
    }
    let weights = Weights::of(context, fits);
    let best = weights.best(fits)?;
    // one effect of a leader may only make up for the count, and be told from the others where that is right
    let mut leaders: Vec<&Refit<'_>> = fits.iter().collect();
    leaders.sort_by(|a, b| weights.weight(a).total_cmp(&weights.weight(b)));
    leaders.truncate(LEADERS);
    let within = |fit: &Refit<'_>| leaders.iter().any(|leader| fit.hypothesis.is_within(&leader.hypothesis));
    let simple = |fit: &Refit<'_>| fit.hypothesis.effects.len() < 2 && !fit.hypothesis.is_dear();
    let unexplained = weights.scatter > weights.settings.search.count_unexplained;
    let compared: Vec<&Refit<'_>> = fits.iter().filter(|fit| within(fit) || unexplained && simple(fit)).collect();
    let left_with = |fit: &Refit<'_>, pieces: usize| {
        let experiment = with(context.experiment, pieces);
        let other = FitContext { experiment: &experiment, ..context.clone() };
        Some(weights.weight(&other.refit(&fit.hypothesis, fit, &[])?))
    };
    let promised = compared.par_iter().with_max_len(1).filter_map(|fit| {
        let mut points = vec![(usual, weights.weight(fit))];
        for pieces in TRIED {
            points.push((pieces, left_with(fit, pieces)?));
        }
        // the parabola is only a guide
        let (pieces, _) = likeliest_count(&points, FEWEST)?;
        let is_new = !points.iter().any(|(tried, _)| *tried == pieces);
        points.extend(is_new.then(|| left_with(fit, pieces)).flatten().map(|left| (pieces, left)));
        points.extend(unexplained.then(|| left_with(fit, RIGID)).flatten().map(|left| (RIGID, left)));
        points.into_iter().min_by(|a, b| a.1.total_cmp(&b.1))
    });
    let (pieces, value) = promised.min_by(|a, b| a.1.total_cmp(&b.1))?;
    (pieces != usual && value < weights.weight(best) - weights.settings.search.worth_a_count).then_some(pieces)
}

/// Whether fits with another count do better, as was promised. Each round has learnt a noise of its own; the first one's is the yardstick.
pub fn is_kept(context: &FitContext<'_>, before: &[Refit<'_>], after: &[Refit<'_>]) -> bool {
    let weights = Weights::of(context, before);
    let (Some(old), Some(new)) = (weights.best(before), weights.best(after)) else { return false };
    let Some(noise) = before.first().map(|fit| &fit.problem.noise) else { return false };
    let mut problem = new.problem.clone();
    problem.noise.clone_from(noise);
    let new = Refit { chi2: problem.cost(&new.x), ..new.clone() };
    weights.weight(&new) < weights.weight(old)
}

/// An experiment with another number of rods.
pub fn with(experiment: &Experiment, pieces: usize) -> Experiment {
    let mut experiment = experiment.clone();
    experiment.model.pieces = pieces;
    experiment
}

/// The count, of at least `fewest`, at which what three counts leave promises to be least, and how much that is.
fn likeliest_count(left: &[(usize, f64)], fewest: usize) -> Option<(usize, f64)> {
    let points: Vec<(f64, f64)> = left.iter().map(|(pieces, left)| (epsilon(*pieces), *left)).collect();
    let (lowest, left) = lowest_point(&points, epsilon(MOST)..=epsilon(fewest))?;
    Some(((1.0 / lowest.sqrt()).round() as usize, left))
}

fn epsilon(pieces: usize) -> f64 {
    1.0 / (pieces * pieces) as f64
}

/// Where a parabola through three points is lowest within bounds, and how low.
fn lowest_point(points: &[(f64, f64)], bounds: std::ops::RangeInclusive<f64>) -> Option<(f64, f64)> {
    let [(x0, y0), (x1, y1), (x2, y2)] = *points else { return None };
    let (rise, further) = ((y1 - y0) / (x1 - x0), (y2 - y1) / (x2 - x1));
    let bend = (further - rise) / (x2 - x0);
    let at = |x: f64| y0 + (x - x0) * (rise + (x - x1) * bend);
    let vertex = 0.5 * (x0 + x1 - rise / bend);
    let inside = vertex.clamp(*bounds.start(), *bounds.end());
    let candidates = [*bounds.start(), *bounds.end(), if bend > 0.0 { inside } else { *bounds.start() }];
    let lowest = candidates.into_iter().min_by(|a, b| at(*a).total_cmp(&at(*b)))?;
    lowest.is_finite().then(|| (lowest, at(lowest)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_lowest_point_of_a_parabola_is_found_from_three_of_its_points() {
        let parabola = |x: f64| 3.0 + 40.0 * (x - 0.3).powi(2);
        let points = [0.9, 0.5, 0.1].map(|x| (x, parabola(x)));
        let (x, y) = lowest_point(&points, 0.0..=1.0).unwrap();
        assert!((x - 0.3).abs() < 1e-12 && (y - 3.0).abs() < 1e-12);
        let (x, y) = lowest_point(&points, 0.4..=1.0).unwrap();
        assert!((x - 0.4).abs() < 1e-12 && (y - parabola(0.4)).abs() < 1e-12);
    }

    #[test]
    fn a_line_is_lowest_at_its_end() {
        let (x, y) = lowest_point(&[(0.2, 5.0), (0.3, 4.0), (0.1, 6.0)], 0.05..=0.4).unwrap();
        assert!((x - 0.4).abs() < 1e-12 && (y - 3.0).abs() < 1e-9, "{x} {y}");
    }
}
