//! A law in proportion to its coefficient.

use super::super::effect::{Acts, Requires};
use super::super::refit::Refit;
use super::{FitRequest, Law};

/// Any of them.
pub struct Ordinary;

impl Law for Ordinary {}

/// The best fit of it beside another one, from where the score points. Where the base model is out of step, has damped away what a better one keeps, or made its spring stand
/// for what is missing, from short stretches as well.
pub fn beside<'a>(sought: &FitRequest<'_, 'a>) -> Option<Refit<'a>> {
    let FitRequest { context, base, effect, score, misfit } = *sought;
    let entry = effect.entry();
    let mut tries = Vec::new();
    if let Some(score) = score {
        let hypothesis = score.hypothesis(&base.hypothesis);
        let near = context.refit(&hypothesis, base, &score.start);
        let still = |fit: &Refit<'_>| fit.has_lost_step(&context.settings.misfit);
        let lost = misfit.out_of_step && entry.acts == Acts::Pace && near.as_ref().is_none_or(still);
        let slow = misfit.unexplained && entry.acts == Acts::Loss && near.as_ref().is_none_or(|near| !near.converged);
        let leaves_too_much = near.as_ref().is_none_or(|near| near.chi2 > misfit.chi2_limit);
        if lost || slow || misfit.spring_drifted && leaves_too_much {
            tries.push(context.refit_by_shooting(&hypothesis, &score.start, base));
        }
        if misfit.unexplained && leaves_too_much {
            let others = score.further.iter();
            tries.extend(others.map(|start| context.refit_below(misfit.leads, &hypothesis, base, start)));
        }
        tries.push(near);
    }
    // a spring of the base model that has grown in its place asks for less than nothing of it
    let hidden = score.is_none() && misfit.spring_drifted && entry.acts == Acts::Pace;
    // what bends a joint at rest: a base model that has given its second mode up is no place to start from
    let unexplained_by_any = misfit.unexplained && tries.iter().flatten().all(|fit| fit.chi2 > misfit.chi2_limit);
    if hidden || entry.needs == Requires::Spring && unexplained_by_any {
        tries.push(context.refit_by_shooting(&base.hypothesis.and(effect, None), &[], base));
    }
    context.best_of(tries)
}
