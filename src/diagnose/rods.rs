//! How many rods stand for a strip.
//!
//! The error of a chain of n rods is in proportion to ε = 1/n². For a large release and little noise that error is seen, and a law would be named for it. So
//! the rods are counted, too: χ² over ε is nearly a parabola, of which three counts tell the lowest point.

use rayon::prelude::*;

use super::context::FitContext;
use super::refit::{self, Refit, least_chi2};
use super::settings::Settings;
use crate::experiment::{Experiment, Model};
use crate::model::Parameter;

/// Counts between two marks that are tried beside the usual one: near to it, as from a chain that swings a little slower to one that swings a little faster a
/// fit stays in step. Then so many to which a parabola leads (cost), and the bounds of these (judgement).
const TRIED: [usize; 2] = [12, 6];
const GUIDED: usize = 2;
const FEWEST: usize = 4;
const MOST: usize = 20;
/// Fits that leave least, of which those with fewer effects are compared (cost).
pub const LEADERS: usize = 5;
/// A fit that leaves so many times the χ² that is wanted is not led below that by another count (cost: up to four times was seen, with two thirds of
/// the rods and 0.33 mrad of noise).
const MAX_CHI2_RATIO: f64 = 10.0;
/// A spring at the hinge has at least this part of the compliance of half a rod (judgement: a clamp has all of it).
const LEAST: f64 = 0.1;
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
        self.with_chi2(fit, fit.chi2)
    }

    /// The weight of a fit if it left another χ².
    fn with_chi2(&self, fit: &Refit<'_>, chi2: f64) -> f64 {
        chi2 / self.scatter + self.settings.misfit.counts * fit.coefficients() as f64
    }

    fn is_unexplained(&self) -> bool {
        self.scatter > self.settings.search.count_unexplained
    }

    fn best<'f, 'a>(&self, fits: &'f [Refit<'a>]) -> Option<&'f Refit<'a>> {
        fits.iter().min_by(|a, b| self.weight(a).total_cmp(&self.weight(b)))
    }
}

/// Fits of one hypothesis with several numbers of rods.
struct RodCountScan<'c> {
    /// Of every count from none to the most.
    contexts: &'c [FitContext<'c>],
    /// The count, and its fit; the usual one first.
    fits: Vec<(usize, Refit<'c>)>,
}

impl<'c> RodCountScan<'c> {
    /// Fits with another count, from where the fits with the two nearest ones lead: all values change with ε.
    fn try_count(&mut self, pieces: usize) -> Option<()> {
        if self.fits.iter().any(|(tried, _)| *tried == pieces) {
            return Some(());
        }
        let begun = match &self.nearest(epsilon(pieces))[..] {
            [] => return None,
            [(_, only)] => begun_with(only, pieces),
            [(count, first), (next, second), ..] => {
                let share = (epsilon(pieces) - epsilon(*count)) / (epsilon(*next) - epsilon(*count));
                let (own, other) = (bare(first), bare(second));
                let x: Vec<f64> = own.iter().zip(&other).map(|(own, other)| own + share * (other - own)).collect();
                Refit { x: clamped(first, &x, pieces), ..first.clone() }
            }
        };
        let found = self.contexts[pieces].refit(&begun.hypothesis, &begun, &[])?;
        self.fits.push((pieces, found));
        Some(())
    }

    /// The fits, those with the nearest ε first.
    fn nearest(&self, to: f64) -> Vec<&(usize, Refit<'c>)> {
        let far = |count: usize| (epsilon(count) - to).abs();
        let mut fits: Vec<_> = self.fits.iter().collect();
        fits.sort_by(|a, b| far(a.0).total_cmp(&far(b.0)));
        fits
    }

    /// The count that leaves least, and how much.
    fn best(&self, weights: &Weights<'_>) -> Option<(usize, f64)> {
        let weighed = self.fits.iter().map(|(count, fit)| (*count, weights.weight(fit)));
        weighed.min_by(|a, b| a.1.total_cmp(&b.1))
    }

    /// Whether some count may leave no more than this: χ² is convex in ε, and so above the straight line through two counts beyond them.
    fn may_reach(&self, target: f64, weights: &Weights<'_>) -> bool {
        let points: Vec<(f64, f64)> =
            self.fits.iter().map(|(count, fit)| (epsilon(*count), weights.weight(fit))).collect();
        (FEWEST..=MOST).any(|count| convex_bound(&points, epsilon(count)) <= target)
    }

    /// What the best count and the two nearest to it leave.
    fn nearest_three(&self, weights: &Weights<'_>) -> Vec<(usize, f64)> {
        let Some((best, _)) = self.best(weights) else { return Vec::new() };
        self.nearest(epsilon(best)).into_iter().take(3).map(|(count, fit)| (*count, weights.weight(fit))).collect()
    }
}

/// A fit of a strip of some number of rods, its variables as they are to begin with for another one.
pub fn begun_with<'a>(fit: &Refit<'a>, pieces: usize) -> Refit<'a> {
    Refit { x: clamped(fit, &bare(fit), pieces), ..fit.clone() }
}

/// The variables of a fit, the spring at its hinge as its compliance.
fn bare(fit: &Refit<'_>) -> Vec<f64> {
    with_hinge(fit, &fit.x, compliance, fit.problem.experiment.model.pieces)
}

/// The same variables with the spring at the hinge of so many rods.
fn clamped(fit: &Refit<'_>, bare: &[f64], pieces: usize) -> Vec<f64> {
    with_hinge(fit, bare, spring, pieces)
}

/// The compliance of what holds a strip, which does not depend on the number of its rods: that of the spring at the hinge of a chain, without the half of a rod that
/// bends above the first joint, 1/K − ℓ/(2EI).
fn compliance(spring: f64, half_rod: f64) -> f64 {
    1.0 / spring - half_rod
}

/// The spring at the hinge of a chain.
fn spring(compliance: f64, half_rod: f64) -> f64 {
    1.0 / (compliance + half_rod).max(LEAST * half_rod)
}

/// Variables with the one of the spring at the hinge changed, where it is free and not zero; `of` has the compliance of half a rod, ℓ/(2EI).
fn with_hinge(fit: &Refit<'_>, x: &[f64], of: impl Fn(f64, f64) -> f64, pieces: usize) -> Vec<f64> {
    let mut x = x.to_vec();
    let [spring, bending] = [Parameter::HingeStiffness, Parameter::BendingStiffness].map(|own| fit.place(own));
    if let (Some(spring), Some(bending)) = (spring, bending)
        && fit.x[spring] > 0.0
        && x[bending] > 0.0
    {
        let rod_m = fit.problem.experiment.specimen.lengths_m()[0] / pieces as f64;
        x[spring] = of(x[spring], 0.5 * rod_m / x[bending]);
    }
    x
}

/// Which fits are compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ComparedFits {
    /// Those that leave least.
    Best,
    /// Where they leave much, those of one effect, too.
    Simple,
}

/// The number of rods between two marks that the recordings ask for, if it is not the usual one; `None` also where the file asks for another.
pub fn preferred_rod_count(context: &FitContext<'_>, fits: &[Refit<'_>], among: ComparedFits) -> Option<usize> {
    let usual = Model::default().pieces;
    if !context.is_strip() || context.experiment.model.pieces != usual {
        return None;
    }
    let weights = Weights::of(context, fits);
    let best = weights.best(fits)?;
    // one effect of a leader may only make up for the count, and be told from the others where that is right
    let leaders = refit::best(fits, LEADERS, |_| true, |fit| weights.weight(fit));
    // a single effect may only lead the way where nothing else is left: beside a wrong effect a wrong count makes up for what that one gets wrong
    let most = match among {
        ComparedFits::Best => context.settings.search.count_unexplained * context.values() as f64,
        ComparedFits::Simple => f64::INFINITY,
    };
    // what leaves many times as much is not led there by another count
    let may_win = |fit: &&Refit<'_>| fit.chi2 < MAX_CHI2_RATIO * best.chi2.min(most);
    let within = |fit: &Refit<'_>| leaders.iter().any(|leader| fit.hypothesis.is_within(&fits[*leader].hypothesis));
    let simple = |fit: &Refit<'_>| fit.hypothesis.effects.len() < 2 && !fit.hypothesis.is_expensive();
    let unexplained = weights.is_unexplained();
    let compared: Vec<&Refit<'_>> = fits
        .iter()
        .filter(|fit| within(fit) || among == ComparedFits::Simple && unexplained && simple(fit))
        .filter(may_win)
        .collect();
    if !is_affordable(context, best, compared.len())? {
        return None;
    }
    let better = weights.weight(best) - weights.settings.search.worth_a_count;
    let wanted = |fit: &Refit<'_>| better.min(weights.with_chi2(fit, most));
    let experiments: Vec<Experiment> = (0..=MOST).map(|pieces| with(context.experiment, pieces)).collect();
    let contexts: Vec<FitContext<'_>> =
        experiments.iter().map(|experiment| FitContext { experiment, ..context.clone() }).collect();
    let promised = compared.par_iter().with_max_len(1).filter_map(|fit| {
        let mut counted = RodCountScan { contexts: &contexts, fits: vec![(usual, (*fit).clone())] };
        for pieces in TRIED {
            if counted.may_reach(wanted(fit), &weights) {
                counted.try_count(pieces)?;
            }
        }
        // the parabola is only a guide
        for _ in 0..GUIDED {
            if counted.fits.len() > TRIED.len() && counted.may_reach(wanted(fit), &weights) {
                let (pieces, _) = likeliest_count(&counted.nearest_three(&weights), FEWEST)?;
                counted.try_count(pieces);
            }
        }
        if among == ComparedFits::Simple && unexplained {
            counted.try_count(RIGID);
        }
        counted.best(&weights).filter(|(_, weight)| *weight < wanted(fit))
    });
    promised.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(pieces, _)| pieces)
}

/// Whether so many scans come to an end before all together has come to what a diagnosis may take: a motion of a stiff strip may cost as much as a hundred others.
fn is_affordable(context: &FitContext<'_>, fit: &Refit<'_>, scans: usize) -> Option<bool> {
    let (search, before) = (&context.settings.search, context.work.done());
    fit.problem.blocks(&fit.x)?;
    let each = context.work.done() - before;
    let motions = scans * (TRIED.len() + GUIDED) * context.settings.descent.few_steps;
    Some(before as f64 + each as f64 * motions as f64 <= search.shares.all * search.budget as f64)
}

/// Whether the best fit leaves so much that a wrong count may have led to it.
pub fn is_unexplained(context: &FitContext<'_>, fits: &[Refit<'_>]) -> bool {
    Weights::of(context, fits).is_unexplained()
}

/// Whether another count lowers the penalised χ², both judged by the noise of the first search.
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

/// The least that a convex function can be at some place, by the lines through every two points beyond which it lies; none where all lie around it.
fn convex_bound(points: &[(f64, f64)], at: f64) -> f64 {
    let pairs = points.iter().enumerate().flat_map(|(i, a)| points[..i].iter().map(move |b| (a, b)));
    let is_beyond = |(a, b): &(&(f64, f64), &(f64, f64))| (a.0 - at) * (b.0 - at) >= 0.0 && a.0 != b.0;
    let line = |(a, b): (&(f64, f64), &(f64, f64))| a.1 + (b.1 - a.1) * (at - a.0) / (b.0 - a.0);
    pairs.filter(is_beyond).map(line).fold(f64::NEG_INFINITY, f64::max)
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
    fn what_holds_a_strip_is_the_same_with_any_number_of_rods() {
        let (of_eight, of_five) = (0.0125 / 2.0 / 3.7e-5, 0.02 / 2.0 / 3.7e-5);
        let with_five = |stiffness: f64| spring(compliance(stiffness, of_eight), of_five);
        // a clamp is as stiff as half a rod
        assert!((with_five(1.0 / of_eight) * of_five - 1.0).abs() < 1e-12);
        // a soft spring hardly differs
        assert!((with_five(1e-6) / 1e-6 - 1.0).abs() < 2e-4);
        // none is negative
        assert!(with_five(1e3) > 0.0);
    }

    #[test]
    fn a_line_is_lowest_at_its_end() {
        let (x, y) = lowest_point(&[(0.2, 5.0), (0.3, 4.0), (0.1, 6.0)], 0.05..=0.4).unwrap();
        assert!((x - 0.4).abs() < 1e-12 && (y - 3.0).abs() < 1e-9, "{x} {y}");
    }

    #[test]
    fn a_convex_function_is_bounded_beyond_two_points_and_not_between_them() {
        let points = [0.1, 0.2, 0.4].map(|x: f64| (x, (x - 0.5).powi(2)));
        // the chord of the last two, at its end
        assert!((convex_bound(&points, 0.5) - -0.03).abs() < 1e-12);
        // between the first two only the line of the other two tells
        assert!(convex_bound(&points, 0.15) <= 0.35f64.powi(2));
        assert_eq!(convex_bound(&points[..2], 0.15), f64::NEG_INFINITY);
        for x in [0.05, 0.15, 0.3, 0.45] {
            assert!(convex_bound(&points, x) <= (x - 0.5).powi(2) + 1e-12, "{x}");
        }
    }
}
