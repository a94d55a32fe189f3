//! The number of a strip's rods: where the recordings ask for another one, the search begins again with that.

use std::sync::OnceLock;

use rayon::prelude::*;

use super::super::base;
use super::super::base_priors::DampingAssumption;
use super::super::hypothesis::Hypothesis;
use super::super::misfit::{Misfit, needs};
use super::super::refit::{self, Refit, least};
use super::super::rods;
use super::super::settings::Settings;
use super::Search;
use crate::error::Result;
use crate::experiment::Experiment;

/// A hypothesis and the variables that its fit is to begin with.
type WarmStart = (Hypothesis, Vec<f64>);

/// What a search knows of the number of a strip's rods.
#[derive(Debug, Clone, Default)]
pub(super) struct RodCount {
    /// The one that the recordings ask for, if it is not the usual one.
    preferred: Option<usize>,
    /// What left least when it was last asked for.
    asked_of: Option<Hypothesis>,
    /// What led with another number, to be begun with.
    warm_starts: Vec<WarmStart>,
}

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
        let is_answered = self.rods.asked_of.is_some() && self.rods.asked_of == self.leader();
        let asked = || rods::preferred_rod_count(&self.context, &self.fits, rods::ComparedFits::Simple);
        let Some(count) = self.rods.preferred.or_else(|| if is_answered { None } else { asked() }) else {
            return Ok(None);
        };
        let counted = counted.get_or_init(|| rods::with(self.context.experiment, count));
        let context = base::context(self.prepared, counted, DampingAssumption::AsStated, self.context.settings)?;
        let fit = base::fitted_near(&context, &rods::begun_with(self.base(), count), self.prepared)?;
        Ok(Some(Self::begun(self.prepared, context, fit, self.progress)))
    }

    /// Searches again with the number of rods that the recordings of a strip ask for, where that does better; [`Self::counted`] has asked where nothing is missing.
    ///
    /// # Errors
    /// As [`Self::of_base_model`].
    pub fn searched_with_preferred_rods(self, counted: &'a OnceLock<Experiment>) -> Result<Self> {
        let is_asked = self.rods.preferred.is_some() || !self.is_adequate();
        let again = if is_asked { self.with_the_preferred_count(counted)? } else { None };
        let Some(mut again) = again else { return Ok(self) };
        let pieces = again.context.experiment.model.pieces;
        again.rods.warm_starts = match self.rods.warm_starts.is_empty() {
            true => Self::best_warm_starts(&self.fits, pieces, self.context.settings),
            false => self.rods.warm_starts.clone(),
        };
        again.run();
        let is_kept = self.rods.preferred.is_some() || rods::is_kept(&self.context, &self.fits, &again.fits);
        Ok(if is_kept { again.after(self) } else { self.after(again) })
    }

    /// The same for a search of longer recordings, with what leads here if another number is asked for.
    pub(super) fn rods_with_warm_starts(&self) -> RodCount {
        let leading = |count| Self::best_warm_starts(&self.fits, count, self.context.settings);
        let warm_starts = self.rods.preferred.map(leading).unwrap_or_default();
        RodCount { preferred: self.rods.preferred, warm_starts, asked_of: None }
    }

    /// The hypotheses that leave least, to be begun with another number of rods: the budget may end before they are sought again.
    fn best_warm_starts(fits: &[Refit<'_>], pieces: usize, settings: &Settings) -> Vec<WarmStart> {
        let Some(best) = least(fits) else { return Vec::new() };
        let leaders = refit::best(
            fits,
            rods::LEADERS,
            |fit| !fit.hypothesis.effects.is_empty() && fit.chi2 < settings.search.far * best.chi2,
            |fit| needs(fit, best, &settings.misfit),
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
        let found: Vec<Refit<'a>> = self.rods.warm_starts.par_iter().with_max_len(1).filter_map(fitted).collect();
        if !found.is_empty() {
            self.keep(found);
            self.update_noise();
        }
    }

    /// Whether the fits that there are ask for another number of rods.
    pub(super) fn prefers_other_rod_count(&mut self) -> bool {
        self.rods.preferred = rods::preferred_rod_count(&self.context, &self.fits, rods::ComparedFits::Best);
        self.rods.asked_of = self.leader();
        self.rods.preferred.is_some()
    }

    /// The hypothesis that leaves least, if that is no more than noise: beyond it simple effects are asked, too, at the end.
    fn leader(&self) -> Option<Hypothesis> {
        let is_explained = !rods::is_unexplained(&self.context, &self.fits);
        least(&self.fits).filter(|_| is_explained).map(|best| best.hypothesis.clone())
    }
}
