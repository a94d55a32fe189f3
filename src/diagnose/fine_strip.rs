//! A strip that bends everywhere, as finely as it needs.
//!
//! While it is one candidate among many it is made of few rods and starts in the shape of the two it replaces, which is cheap and tells it from other
//! effects. Where it then explains most, it is given as many rods as the recording asks for ([`super::pieces`]) and the shapes
//! that it has as a base model, and all beside it is sought anew.

use rayon::prelude::*;

use super::ground::{Ground, Hypothesis};
use super::refit::{Refit, least};
use super::selection;
use super::single::{self, Lacks};
use super::{Cause, pieces};
use crate::progress::Progress;

/// Counts of rods between two marks that are tried beside the usual one, and the least that they may lead to.
const FEW: usize = 5;
const MANY: usize = 12;
const FEWEST: usize = 3;

/// The fits, those with a strip that bends everywhere made anew with a finer one, where that is asked for and does better.
pub fn with_fine_strip<'a>(
    ground: &mut Ground<'a>,
    mut fits: Vec<Refit<'a>>,
    causes: &[Cause],
    progress: &dyn Progress,
) -> Vec<Refit<'a>> {
    let bends = |fit: &Refit<'a>| fit.hypothesis.causes.contains(&Cause::DistributedFlexibility);
    let alone = Hypothesis { causes: vec![Cause::DistributedFlexibility], dropped: None };
    let unexplained = least(&fits).is_some_and(|best| Lacks::of(ground, best, &[]).unexplained);
    if unexplained && causes.contains(&Cause::DistributedFlexibility) && !fits.iter().any(bends) {
        // from the base model's motion its own may not be found
        fits.extend(ground.refit_anew(&alone, &[], fits[0].chi2));
    }
    let asked_for = least(&fits).is_some_and(bends);
    let Some(coarse) = fits.iter().find(|fit| asked_for && fit.hypothesis == alone) else { return fits };
    let with = |pieces: usize| Ground { fine_strip: Some(pieces), ..ground.clone() };
    let of = |pieces: usize| Some((pieces, with(pieces).refit(&alone, coarse, &[])?));
    let usual = ground.experiment.model.pieces;
    let counts = [usual, FEW, MANY];
    let mut finer: Vec<(usize, Refit<'a>)> = counts.into_par_iter().with_max_len(1).filter_map(of).collect();
    let left: Vec<(usize, f64)> = finer.iter().map(|(pieces, fine)| (*pieces, fine.chi2)).collect();
    let promised = pieces::likeliest_count(&left, FEWEST).filter(|(pieces, _)| !counts.contains(pieces));
    finer.extend(promised.and_then(|(pieces, _)| of(pieces)));
    // as many as usual, unless the recording asks for another count
    let enough = finer.iter().find(|f| f.0 == usual).map_or(coarse.chi2, |f| f.1.chi2) - pieces::WORTH;
    let better = finer.iter().filter(|f| f.1.chi2 < enough).min_by(|a, b| a.1.chi2.total_cmp(&b.1.chi2));
    let count = better.map_or(usual, |better| better.0);
    let chosen = finer.into_iter().find(|(pieces, fine)| *pieces == count && fine.chi2 < coarse.chi2);
    let Some((_, fine)) = chosen else { return fits };
    *ground = with(count);
    progress.begin("strip", Some(causes.len() as u64));
    let pairs = single::beside(ground, &fine, causes, None, progress);
    let mut all: Vec<Refit<'a>> = fits.into_iter().filter(|fit| !bends(fit)).collect();
    all.push(fine);
    all.extend(pairs);
    selection::with_refined_noise(ground, all)
}
