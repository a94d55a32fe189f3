//! A strip that bends everywhere, as finely as it needs.
//!
//! While it is one candidate among many it is made of few rods and starts in the shape of the two it replaces, which is cheap and tells it from other
//! effects. Where it then explains most, it is given as many rods as the recording asks for ([`super::super::rods`]) and the shapes
//! that it has as a base model, and all beside it is sought anew.

use rayon::prelude::*;

use super::super::context::FitContext;
use super::super::effect::Effect;
use super::super::hypothesis::Hypothesis;
use super::super::misfit::is_out_of_step;
use super::super::refit::Refit;
use super::super::rods;
use super::super::settings::PriorSettings;
use super::{Coefficients, Law, Sought};

/// Counts of rods between two marks that are tried beside the usual one, and the least that they may lead to.
const FEW: usize = 5;
const MANY: usize = 12;
const FEWEST: usize = 3;

/// The law.
pub struct Bending;

impl Law for Bending {
    /// Many rods are dear: only where there is something to explain, and further only where the first steps lead somewhere.
    fn beside<'a>(&self, sought: &Sought<'_, 'a>) -> Option<Refit<'a>> {
        let Sought { context, base, effect, misfit, .. } = *sought;
        if !misfit.unexplained {
            return None;
        }
        let settings = &context.settings.descent;
        let hypothesis = base.hypothesis.and(effect, None);
        let begun = context.begin(&hypothesis, base, &[]).filter(|b| b.chi2 < settings.beyond_hope * base.chi2);
        let begun = begun.and_then(|b| context.go_on(&b, settings.few_steps));
        let begun = begun.filter(|b| b.chi2 < settings.hopeful * base.chi2);
        let near = begun.and_then(|b| if b.converged { Some(b) } else { context.go_on(&b, settings.few_steps) });
        let lost = near.as_ref().is_none_or(|near| is_out_of_step(near, &context.settings.misfit));
        let anew = (misfit.out_of_step && lost).then(|| context.refit_anew(&hypothesis, &[], base)).flatten();
        context.best_of([near, anew])
    }

    /// It takes the place of the joint's spring.
    fn strength(&self, _effect: Effect, _of: &Coefficients<'_>) -> Option<(f64, f64)> {
        None
    }

    fn ln_kinds(&self, _fit: &Refit<'_>, _effect: Effect, _of: &Coefficients<'_>, _settings: &PriorSettings) -> f64 {
        0.0
    }
}

/// The hypothesis of it alone.
pub fn alone() -> Hypothesis {
    Hypothesis { effects: vec![Effect::DistributedFlexibility], dropped: None }
}

/// The fit of it alone with as many rods as the recording asks for, if that does better than a coarse one; and in which context.
pub fn finer<'a>(context: &FitContext<'a>, coarse: &Refit<'a>) -> Option<(FitContext<'a>, Refit<'a>)> {
    let with = |count: usize| FitContext { fine_strip: Some(count), ..context.clone() };
    let of = |count: usize| Some((count, with(count).refit(&alone(), coarse, &[])?));
    let usual = context.experiment.model.pieces;
    let counts = [usual, FEW, MANY];
    let mut finer: Vec<(usize, Refit<'a>)> = counts.into_par_iter().with_max_len(1).filter_map(of).collect();
    let left: Vec<(usize, f64)> = finer.iter().map(|(count, fine)| (*count, fine.chi2)).collect();
    let promised = rods::likeliest_count(&left, FEWEST).filter(|(count, _)| !counts.contains(count));
    finer.extend(promised.and_then(|(count, _)| of(count)));
    // as many as usual, unless the recording asks for another count
    let left_by_usual = finer.iter().find(|f| f.0 == usual).map_or(coarse.chi2, |f| f.1.chi2);
    let enough = left_by_usual - context.settings.search.worth_a_count;
    let better = finer.iter().filter(|f| f.1.chi2 < enough).min_by(|a, b| a.1.chi2.total_cmp(&b.1.chi2));
    let count = better.map_or(usual, |better| better.0);
    let (_, fine) = finer.into_iter().find(|(own, fine)| *own == count && fine.chi2 < coarse.chi2)?;
    Some((with(count), fine))
}
