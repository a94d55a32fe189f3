//! The noise by which the fits of a search are judged: what the best of them leaves.

use rayon::prelude::*;

use super::super::context::FitContext;
use super::super::misfit::leaves_only_noise;
use super::super::refit::{Refit, least, least_chi2};
use super::super::residual_noise::residual_noise;
use super::Search;
use crate::fit::whitening::RecordNoise;

impl<'a> Search<'a, '_> {
    /// Judges all fits by the noise that the best of them leaves; those that have not yet converged, and are worth it, go on. Where that led far down, the noise is
    /// what is left there.
    pub(super) fn update_noise(&mut self) {
        // a strip's steps are dear: what leaves more than noise tells nothing of it, and is not led to its end
        let leaves_more = |best: &Refit<'a>| !leaves_only_noise(best, &self.context.settings.misfit);
        if self.context.is_strip() && least(&self.fits).is_some_and(leaves_more) {
            return;
        }
        let before = least_chi2(&self.fits);
        self.learn_noise_once();
        if self.context.settings.search.far_down * least_chi2(&self.fits) < before {
            self.learn_noise_once();
        }
    }

    fn learn_noise_once(&mut self) {
        let context = &self.context;
        let best = least(&self.fits);
        let learnt = best.and_then(|best| residual_noise(context, best));
        let (least, base) = (best.map_or(0.0, |best| best.chi2), self.base().chi2);
        let (descent, is_spent) = (&context.settings.descent, self.is_spent());
        let again = |fit: Refit<'a>| {
            let worth = is_worth_more(context, &fit, least, base);
            // where the budget is spent only the best one goes to its end
            let steps = if is_spent && fit.chi2 > least { descent.few_steps } else { descent.most_steps };
            match (&learnt, worth) {
                (Some(noise), _) => context.with_noise(noise, &fit, if worth { steps } else { 0 }).unwrap_or(fit),
                (None, true) if !fit.converged => context.go_on(&fit, steps).unwrap_or(fit),
                _ => fit,
            }
        };
        let fits = std::mem::take(&mut self.fits);
        self.fits = fits.into_par_iter().with_max_len(1).map(again).collect();
    }

    /// The same fits beside the errors in step with the swing that a tracked angle may have; those that are near the noise go on from where they are.
    pub(super) fn add_synchronous_errors(&mut self) {
        let mut noise = self.base().problem.noise.clone();
        for (noise, record) in noise.iter_mut().zip(self.context.records) {
            noise.synchronous = record.synchronous;
        }
        self.reweight(&noise, self.context.settings.descent.few_steps);
    }

    pub(super) fn reweight(&mut self, noise: &[RecordNoise], steps: usize) {
        if self.base().problem.noise == noise {
            return;
        }
        let (context, least) = (&self.context, least_chi2(&self.fits));
        let hopeless = context.settings.search.hopeless;
        let again = |fit: Refit<'a>| {
            let worth = fit.chi2 < hopeless * (least + hopeless);
            context.with_noise(noise, &fit, if worth { steps } else { 0 }).unwrap_or(fit)
        };
        let fits = std::mem::take(&mut self.fits);
        self.fits = fits.into_par_iter().with_max_len(1).map(again).collect();
    }
}

/// Whether a fit is worth further steps beside the best and the base model's.
fn is_worth_more(context: &FitContext<'_>, fit: &Refit<'_>, least: f64, base: f64) -> bool {
    let settings = context.settings;
    let (hopeless, dear) = (settings.search.hopeless, fit.hypothesis.has_switching());
    // in every joint of a strip it has only begun
    let bound = if dear && context.is_strip() { settings.descent.strip_continue_ratio } else { hopeless };
    fit.chi2 < bound * (least + hopeless) && !(dear && fit.chi2 > base - settings.misfit.counts)
}
