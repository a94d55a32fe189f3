//! The number of a strip's rods: where the recordings ask for another one, the search begins again with that.

use std::sync::OnceLock;

use rayon::prelude::*;

use super::super::base;
use super::super::base_priors::DampingAssumption;
use super::super::misfit::{Misfit, needs};
use super::super::refit::{self, Refit, least};
use super::super::rods;
use super::super::settings::MisfitSettings;
use super::{Search, WarmStart};
use crate::error::Result;
use crate::experiment::Experiment;

impl<'a> Search<'a, '_> {
    /// The base model's fit with the number of rods that the recordings of a strip ask for, where nothing else is missing.
    ///
    /// # Errors
    /// As [`Self::of_base_model`].
    pub fn counted(self, counted: &'a OnceLock<Experiment>) -> Result<Self> {
        let again = if self.is_adequate() { self.with_the_preferred_count(counted)? } else { None };
        let Some(again) = again else { return Ok(self) };
        let is_kept = rods::is_kept(&self.context, &self.fits, &again.fits);
        Ok(if is_kept { again } else { self })
    }

    /// Whether the base model leaves no more than noise.
    fn is_adequate(&self) -> bool {
        !Misfit::of(&self.context, self.base(), &[]).unexplained
    }

    /// The base model's fit with another number of rods, if the recordings ask for it.
    fn with_the_preferred_count(&self, counted: &'a OnceLock<Experiment>) -> Result<Option<Self>> {
        let count =
            self.count.or_else(|| rods::preferred_rod_count(&self.context, &self.fits, rods::ComparedFits::Simple));
        let Some(count) = count else { return Ok(None) };
        let counted = counted.get_or_init(|| rods::with(self.context.experiment, count));
        let context = base::context(self.prepared, counted, DampingAssumption::AsStated, self.context.settings)?;
        let fit = base::fitted_near(&context, &rods::begun_with(self.base(), count), self.prepared)?;
        let work_at_start = context.work.done();
        Ok(Some(Self::begun(self.prepared, context, fit, work_at_start, self.progress)))
    }

    /// Searches again with the number of rods that the recordings of a strip ask for, where that does better; [`Self::counted`] has asked where nothing is missing.
    ///
    /// # Errors
    /// As [`Self::of_base_model`].
    pub fn searched_with_preferred_rods(self, counted: &'a OnceLock<Experiment>) -> Result<Self> {
        let is_asked = self.count.is_some() || !self.is_adequate();
        let again = if is_asked { self.with_the_preferred_count(counted)? } else { None };
        let Some(mut again) = again else { return Ok(self) };
        let pieces = again.context.experiment.model.pieces;
        again.warm_starts = match self.warm_starts.is_empty() {
            true => Self::best_warm_starts(&self.fits, pieces, &self.context.settings.misfit),
            false => self.warm_starts.clone(),
        };
        again.run();
        let is_kept = self.count.is_some() || rods::is_kept(&self.context, &self.fits, &again.fits);
        Ok(if is_kept { again.after(self) } else { self.after(again) })
    }

    /// The hypotheses that leave least, to be begun with another number of rods: the budget may end before they are sought again.
    pub(super) fn best_warm_starts(fits: &[Refit<'_>], pieces: usize, settings: &MisfitSettings) -> Vec<WarmStart> {
        let Some(best) = least(fits) else { return Vec::new() };
        let leaders = refit::best(
            fits,
            rods::LEADERS,
            |fit| !fit.hypothesis.effects.is_empty(),
            |fit| needs(fit, best, settings),
        );
        let begun = |place: usize| (fits[place].hypothesis.clone(), rods::begun_with(&fits[place], pieces).x);
        leaders.into_iter().map(begun).collect()
    }

    /// Fits what led with another number of rods.
    pub(super) fn fit_warm_starts(&mut self) {
        let (context, noise) = (&self.context, &self.base().problem.noise);
        let fitted = |(hypothesis, x): &WarmStart| {
            let is_alike = context.problem(hypothesis, noise).is_ok_and(|problem| problem.variables() == x.len());
            is_alike.then(|| context.descend_from(hypothesis, noise, x.clone(), context.settings.descent.few_steps))?
        };
        let found: Vec<Refit<'a>> = self.warm_starts.par_iter().with_max_len(1).filter_map(fitted).collect();
        if !found.is_empty() {
            self.keep(found);
            self.update_noise();
        }
    }

    /// Whether the single effects ask for another number of rods.
    pub(super) fn prefers_other_rod_count(&mut self) -> bool {
        self.count = rods::preferred_rod_count(&self.context, &self.fits, rods::ComparedFits::Best);
        self.count.is_some()
    }
}
