//! A search of the first part of recordings, where a fit of the whole is too dear for one.
//!
//! A search fits some hundred hypotheses. Where the budget does not allow that of the whole recordings, it is made on as much of their beginning as the budget
//! allows; the best fits of each number of coefficients then follow the recordings to their end, part after part, and beside the best of them one more is sought.

use super::super::context::first_part;
use super::super::effect::{Cost, Effect};
use super::super::misfit::needs;
use super::super::refit::{self, Refit, least};
use super::super::settings::MisfitSettings;
use super::rounds::{Round, Tried};
use super::{Search, horizon};

/// A single effect is not told from the best fit of a part where it needs more than that by less than so many falls of χ² that count (judgement).
const TIED: f64 = 2.0;

impl<'a> Search<'a, '_> {
    /// Searches with single effects and pairs, then from further starts: the whole recordings, or the part that can be afforded.
    pub(super) fn begin(&mut self) {
        if self.prepared.part < 1.0 {
            self.begin_on(self.prepared.part);
        } else {
            self.usual();
            self.restarts();
        }
    }

    fn begin_on(&mut self, part: f64) {
        let records = first_part(self.context.records, part);
        let context = self.context.on(&records);
        let Some(base) = horizon::refit_on_first_part(&self.context, &context, self.base()) else { return };
        let mut early = Search {
            has_added_damper: self.has_added_damper,
            rival_residual: self.rival_residual,
            budget: self.budget,
            rods: self.rods.clone(),
            part,
            ..Search::begun(self.prepared, context, base, self.progress)
        };
        early.usual();
        if early.stopped_early {
            (self.stopped_early, self.bending_n_m2) = (true, early.bending_n_m2);
            self.rods = early.rods_with_warm_starts();
            self.rounds.extend(early.rounds);
            return;
        }
        early.restarts();
        early.budget.allow(self.context.settings.search.shares.restarts);
        if !self.context.is_strip() {
            early.round(Round::OneMore, &mut Tried::default());
        }
        early.drop_superfluous();
        let Search { fits, rounds, undecided, .. } = early;
        self.part = part;
        self.rounds.extend(rounds);
        self.undecided.extend(undecided);
        self.indistinguishable = indistinguishable(&fits, &self.context.settings.misfit);
        self.progress.begin("to the end", None);
        let noise = &self.base().problem.noise;
        let found: Vec<Refit<'a>> = horizon::carried(&self.context, fits, part, noise);
        self.keep(found);
        self.update_noise();
        // one more effect would make up for a wrong number of rods, which only whole recordings tell
        if self.prefers_other_rod_count() {
            self.stopped_early = true;
            return;
        }
        self.budget.allow(self.context.settings.search.shares.further);
        self.round(Round::Indistinguishable, &mut Tried::default());
        self.round(Round::OneMore, &mut Tried::default());
    }
}

/// Single effects that a part of the recordings does not tell from the best of its fits, nearest first.
fn indistinguishable(fits: &[Refit<'_>], settings: &MisfitSettings) -> Vec<Effect> {
    let Some(best) = least(fits) else { return Vec::new() };
    let least = fits.iter().map(|fit| needs(fit, best, settings)).fold(f64::INFINITY, f64::min);
    let is_tied = |fit: &Refit<'_>| match fit.hypothesis.effects[..] {
        [only] => only.entry().cost == Cost::Ordinary && needs(fit, best, settings) < least + TIED * settings.counts,
        _ => false,
    };
    let order = refit::best(fits, usize::MAX, is_tied, |fit| needs(fit, best, settings));
    order.into_iter().flat_map(|place| fits[place].hypothesis.effects.clone()).collect()
}
