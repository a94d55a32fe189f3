//! A strip that bends everywhere, as finely as it needs.
//!
//! While it is one candidate among many it is made of few rods and starts in the shape of the two it replaces, which is cheap and tells it from other
//! effects. Where it then explains most and yet leaves more than noise, it is given the rods and the shapes that it has as a base model, and all beside it
//! is sought anew.

use super::Cause;
use super::ground::{Ground, Hypothesis};
use super::refit::Refit;
use super::second_look::beside;
use super::selection::{self, Lacks};
use crate::progress::Progress;

/// The fits, those with a strip that bends everywhere made anew with a finer one, where that is asked for and does better.
pub fn with_fine_strip<'a>(
    ground: &mut Ground<'a>,
    fits: Vec<Refit<'a>>,
    causes: &[Cause],
    progress: &dyn Progress,
) -> Vec<Refit<'a>> {
    let bends = |fit: &Refit<'a>| fit.hypothesis.causes.contains(&Cause::DistributedFlexibility);
    let best = fits.iter().min_by(|a, b| a.chi2.total_cmp(&b.chi2));
    let asked_for = best.is_some_and(|best| bends(best) && Lacks::of(ground, best, &[]).unexplained);
    let alone = Hypothesis { causes: vec![Cause::DistributedFlexibility], dropped: None };
    let Some(coarse) = fits.iter().find(|fit| asked_for && fit.hypothesis == alone) else { return fits };
    let fine_ground = Ground { fine_strip: true, ..ground.clone() };
    let Some(fine) = fine_ground.refit(&alone, coarse, &[]).filter(|fine| fine.chi2 < coarse.chi2) else {
        return fits;
    };
    *ground = fine_ground;
    progress.begin("strip", Some(causes.len() as u64));
    let pairs = beside(ground, &fine, causes, progress);
    let mut all: Vec<Refit<'a>> = fits.into_iter().filter(|fit| !bends(fit)).collect();
    all.push(fine);
    all.extend(pairs);
    selection::with_refined_noise(ground, all)
}
