//! The search: propose, fit, keep.
//!
//! Each round proposes fits from those there are, all of its proposals are fitted, and of each hypothesis the better fit is kept. What is left by the best of them is
//! then learnt as the noise of all. A round is begun while the budget lasts; the names of those that were not are told with the answer.
//!
//! | file | holds |
//! |---|---|
//! | [`rounds`] | the rounds, in order, and what each proposes |
//! | [`proposal`] | what can be proposed, and how it is fitted |
//! | [`one_more`] | an effect beside a fit |
//! | `budget` | what it may cost |
//! | `rod_count` | the number of a strip's rods |
//! | `partial` | the search of the first part, where the whole takes too much work |
//! | [`horizon`] | horizon continuation: fits that follow a recording from its beginning |
//! | `reweighting` | the noise by which all fits are judged |
//! | `frequency_match` | a base model whose frequency is not that of the recordings |
//! | `strip` | a strip that is found to bend everywhere |
//! | `superfluous` | effects that a set of several does not need |

mod budget;
mod frequency_match;
pub mod horizon;
pub mod one_more;
mod partial;
pub mod proposal;
mod reweighting;
mod rod_count;
pub mod rounds;
mod strip;
mod superfluous;

use std::sync::OnceLock;

use rayon::prelude::*;

use super::base;
use super::base_priors::{DampingAssumption, lacks_a_damper};
use super::context::{FitContext, without_synchronous_errors};
use super::effect::Effect;
use super::evidence::is_possible;
use super::hypothesis::Compared;
use super::laws;
use super::misfit::{Misfit, leaves_more_than_noise};
use super::preparation::Prepared;
use super::refit::{Refit, best, least, least_chi2, merged};
use super::screen::{Score, Screen};
use super::settings::Settings;
use crate::error::Result;
use crate::experiment::Experiment;
use crate::progress::Progress;
use budget::Budget;
use frequency_match::FrequencyMatched;
use proposal::Proposal;
use rod_count::RodCount;
use rounds::{NoiseUpdate, Round, Tried};

/// Proposals fitted together, between two looks at the budget.
const TOGETHER: usize = 4;
/// The same of a strip, whose fits are dear.
const TOGETHER_OF_STRIP: usize = 2;
/// A fit of the same hypothesis is better where its χ² is lower by more than this (statistics: half of an ln-likelihood).
const BETTER_BY: f64 = 1.0;

/// What a round came to.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct RoundEnd {
    /// Its name.
    pub round: &'static str,
    /// The part of the recordings that was fitted.
    pub part: f64,
    /// The work done when it ended ([`crate::model::Work`]).
    pub work: u64,
    /// Fits that it proposed.
    pub proposed: usize,
    /// Hypotheses that were new with it, or whose χ² it lowered by more than one.
    pub bettered: usize,
}

/// A search: what it knows.
pub struct Search<'a, 'p> {
    prepared: &'a Prepared,
    /// What all fits share.
    pub context: FitContext<'a>,
    /// The effects that may be missing.
    pub effects: Vec<Effect>,
    /// The best fit of each hypothesis, all judged by the same noise; the base model first.
    pub fits: Vec<Refit<'a>>,
    /// What each round came to.
    pub rounds: Vec<RoundEnd>,
    /// Rounds that the budget cut short.
    pub undecided: Vec<&'static str>,
    /// What the effects promise at the base model.
    scores: Vec<Score>,
    /// The base model at the recorded frequency, from which effects are sought where its own is wrong.
    frequency_matched: Option<FrequencyMatched<'a>>,
    /// Single effects that a search of the first part did not tell from its best.
    indistinguishable: Vec<Effect>,
    /// Whether a single link has a damper that its file does not state.
    has_added_damper: bool,
    /// How stiff the strip is if it bends everywhere, where that explains most of what the base model's joint leaves.
    bending_n_m2: Option<f64>,
    /// Relative residual of another base model's best fit: where the single effects stay above it, this search ends.
    rival_residual: Option<f64>,
    /// Whether it ended there, or where a strip was found to bend, or to need another number of rods.
    stopped_early: bool,
    /// What the search of a strip knows of its rods.
    rods: RodCount,
    /// How many effects of a hypothesis earlier searches have compared with every other, and the hypotheses of which each was exchanged.
    compared: Compared,
    budget: Budget,
    /// The part of the recordings that its first rounds fitted.
    part: f64,
    progress: &'p dyn Progress,
}

impl<'a, 'p> Search<'a, 'p> {
    /// Begins with the base model's fit to some recordings.
    ///
    /// # Errors
    /// [`crate::error::Error::Simulation`] where the specimen cannot swing, or no motion near the start values follows the recordings.
    pub fn of_base_model(
        prepared: &'a Prepared,
        experiment: &'a Experiment,
        taken: DampingAssumption,
        settings: &'a Settings,
        progress: &'p dyn Progress,
    ) -> Result<Self> {
        let context = base::context(prepared, experiment, taken, settings)?;
        let fit = base::fitted(&context, prepared)?;
        let has_added_damper = taken == DampingAssumption::WithDamper;
        Ok(Self { has_added_damper, ..Self::begun(prepared, context, fit, progress) })
    }

    /// Of the whole recordings, the file taken at its word: there is the base model's fit, and no work is allowed yet.
    fn begun(prepared: &'a Prepared, context: FitContext<'a>, base: Refit<'a>, progress: &'p dyn Progress) -> Self {
        let budget = Budget::from(context.work.done(), prepared.budget);
        let effects = base::candidates(&context);
        let scored = laws::cheap_to_score(&context, &effects);
        let scores = Screen::at(&context, &base).map(|screen| laws::scores(&screen, &scored)).unwrap_or_default();
        Self {
            prepared,
            context,
            effects,
            fits: vec![base],
            rounds: Vec::new(),
            undecided: Vec::new(),
            scores,
            frequency_matched: None,
            indistinguishable: Vec::new(),
            has_added_damper: false,
            bending_n_m2: None,
            rival_residual: None,
            stopped_early: false,
            rods: RodCount::default(),
            compared: Compared::default(),
            budget,
            part: 1.0,
            progress,
        }
    }

    /// Searches for what the base model lacks, the file taken at its word. Whole recordings of a rig that are dear and far from the model are left to their pieces:
    /// of bearings and castings no model is right to the noise. It is cut short where a strip is found to bend everywhere, see [`Self::bending_strip_search`], or to
    /// be made of another number of rods, see [`Self::searched_with_preferred_rods`].
    pub fn run(&mut self) {
        let is_rig = !self.context.experiment.specimen.links.is_empty();
        if is_rig && self.prepared.part < 1.0 && self.leaves_more_than_noise() && self.pieces().is_some() {
            return;
        }
        self.begin();
        if !self.stopped_early {
            self.end();
        }
    }

    fn end(&mut self) {
        self.drop_superfluous();
        self.add_synchronous_errors();
        self.budget.allow(self.context.settings.search.shares.certified);
        self.certify();
    }

    /// The same with what another search has spent before, or in vain.
    fn after(mut self, other: Self) -> Self {
        let Compared { of_any, whole } = other.compared();
        self.compared.of_any = self.compared.of_any.max(of_any);
        self.compared.whole.extend(whole);
        self.rounds.splice(0..0, other.rounds);
        let new = other.undecided.into_iter().filter(|name| !self.undecided.contains(name));
        self.undecided.extend(new.collect::<Vec<_>>());
        self
    }

    /// The recordings in pieces; `None` of a strip, whose marks do not show where its rods begin, and where they are too short.
    fn pieces(&self) -> Option<Prepared> {
        let (model, _) = self.base().problem.model(0, &[]).ok()?;
        let cut = || self.prepared.in_pieces(self.context.settings, model.characteristic_rad_s());
        let bends = self.context.is_strip() || self.context.identified_strip.is_some();
        (!bends && !self.context.is_in_pieces()).then(cut).flatten()
    }

    /// A search of the recordings in pieces, each with a start of its own. Where every model leaves far more than noise, the sum of squares of a whole recording says
    /// how the model's small errors add up, and has many false minima; that of pieces says what each law does within a few swings.
    fn in_pieces(&self, kept: &'a OnceLock<Prepared>) -> Option<Self> {
        let pieces = self.leaves_more_than_noise().then(|| self.pieces()).flatten()?;
        let (experiment, settings) = (self.context.experiment, self.context.settings);
        // there is no time for both
        let taken = DampingAssumption::at_first(experiment, self.context.marks(), true);
        let mut search =
            Self::of_base_model(kept.get_or_init(|| pieces), experiment, taken, settings, self.progress).ok()?;
        // what the stretches ask for is where the search for more and fewer effects begins
        search.budget.allow(settings.search.shares.usual);
        search.round(Round::Asked, &mut Tried::default());
        search.update_noise();
        if search.fits.len() == 1 {
            search.begin();
        }
        Some(search)
    }

    /// Searches on, with more effects and fewer: of the recordings in pieces where far more than noise is left; where they are too short for that, with the file taken
    /// loosely if it may be doubted, and from the beginning of the recordings on.
    #[must_use]
    pub fn doubted(self, pieces: &'a OnceLock<Prepared>) -> Self {
        let enough = self.budget.at(self.context.settings.search.shares.certified);
        let with_damper = || {
            (self.context.work.done() < enough).then_some(())?;
            let lacks_a_damper = lacks_a_damper(self.context.experiment, self.context.marks());
            (!self.has_added_damper && lacks_a_damper && self.leaves_more_than_noise()).then_some(())?;
            let (experiment, settings) = (self.context.experiment, self.context.settings);
            let mut with_damper =
                Self::of_base_model(self.prepared, experiment, DampingAssumption::WithDamper, settings, self.progress)
                    .ok()?;
            with_damper.begin();
            Some(with_damper)
        };
        let mut search = match self.in_pieces(pieces) {
            Some(of_pieces) if of_pieces.leaves_more_than_noise() => of_pieces.after(self),
            // where a model is right to the noise the whole tells more than its pieces
            Some(of_pieces) => self.led_by(of_pieces),
            None => match with_damper() {
                Some(other) => other.after(self),
                None => self,
            },
        };
        search.budget.allow(search.context.settings.search.shares.further);
        search.further();
        search.drop_superfluous();
        search.add_synchronous_errors();
        search.budget.allow(1.0);
        search.certify();
        search
    }

    /// The same with what the pieces of its recordings led to, on the whole, each recording from the start of its first piece.
    fn led_by(mut self, of_pieces: Self) -> Self {
        let found: Vec<Refit<'a>> = horizon::whole(&self.context, &of_pieces.fits, &self.base().problem.noise);
        self.keep(found);
        self.update_noise();
        self.after(of_pieces)
    }

    /// How many effects of an answer have been held against every other: two where pairs were, one where only single effects were, none where the budget ended before;
    /// all where each has been exchanged.
    pub fn compared(&self) -> Compared {
        Compared { of_any: self.compared.of_any.max(self.compared_of_any()), whole: self.compared.whole.clone() }
    }

    fn compared_of_any(&self) -> usize {
        let done = |round: Round| {
            self.rounds.iter().any(|end| end.round == round.name()) && !self.undecided.contains(&round.name())
        };
        // short stretches are asked for every set
        let asked = self.context.is_in_pieces() && done(Round::Asked);
        if asked || done(Round::Pairs) || done(Round::OneMore) && done(Round::OneFewer) {
            self.context.settings.search.main_effects
        } else {
            usize::from(done(Round::Singles))
        }
    }

    /// The base model's fit.
    pub fn base(&self) -> &Refit<'a> {
        &self.fits[0]
    }

    /// Whether the best of the fits leaves so much that the noise does not matter.
    pub fn leaves_more_than_noise(&self) -> bool {
        least(&self.fits).is_some_and(|best| leaves_more_than_noise(best, &self.context.settings.noise))
    }

    /// Singles and pairs, until a strip is found to bend everywhere, or to be made of another number of rods: pairs would make up for a wrong one.
    fn usual(&mut self) {
        self.budget.allow(self.context.settings.search.shares.usual);
        self.fit_warm_starts();
        self.match_frequency();
        for round in Round::USUAL {
            self.round(round, &mut Tried::default());
            if round == Round::ExpensiveSingles && (self.bends() || self.is_behind() || self.prefers_other_rod_count())
            {
                self.stopped_early = true;
                return;
            }
        }
        self.try_bending();
    }

    /// Restarts where the best fit leaves more than noise. A strip's fits are too dear for it.
    fn restarts(&mut self) {
        self.budget.allow(self.context.settings.search.shares.restarts);
        if !self.stopped_early && !self.context.is_strip() && self.misfit().is_some_and(|misfit| misfit.unexplained) {
            Round::RESTARTS.into_iter().for_each(|round| self.round(round, &mut Tried::default()));
        }
    }

    /// What does as well as the likeliest fit, and further starts for the fits that may count; of each it is then known whether it leaves no more than those within it.
    fn certify(&mut self) {
        self.round(Round::Twins, &mut Tried::default());
        self.round(Round::Certify, &mut Tried::default());
        self.round(Round::Nested, &mut Tried::default());
        let nested_ok: Vec<bool> = self.fits.iter().map(|fit| self.best_within(fit).is_none()).collect();
        self.fits.iter_mut().zip(nested_ok).for_each(|(fit, nested_ok)| fit.certificate.nested_ok = nested_ok);
    }

    /// More effects and fewer, by turns, until nothing new leads the way; first, where far more than noise is left, from the beginning of whole recordings, or of pieces
    /// with fewer.
    fn further(&mut self) {
        self.reweight(&without_synchronous_errors(&self.base().problem.noise), 0);
        let mut tried = Tried::default();
        if self.context.is_in_pieces() {
            // the stretches have asked for as many laws as are worth it
            self.round(Round::OneFewer, &mut tried);
        } else if self.part == 1.0 && self.leaves_more_than_noise() {
            self.round(Round::FromTheBeginning, &mut tried);
        }
        for turn in 0..self.context.settings.search.turns {
            let led = tried.more.len();
            self.round(Round::OneMore, &mut tried);
            if turn > 0 && tried.more.len() == led {
                break;
            }
            self.round(Round::OneFewer, &mut tried);
            if turn > 0 && !self.leaves_more_than_noise() {
                break;
            }
        }
    }

    /// One round: propose, fit, keep.
    fn round(&mut self, round: Round, tried: &mut Tried) {
        if self.is_spent() {
            self.leave_undecided(round);
            return;
        }
        let before = least_chi2(&self.fits);
        let proposals = round.proposals(self, tried);
        self.progress.begin(round.name(), Some(proposals.len() as u64));
        let mut found = Vec::new();
        let mut proposed = 0;
        let count = proposals.len();
        for some in proposals.chunks(if self.context.is_strip() { TOGETHER_OF_STRIP } else { TOGETHER }) {
            if self.is_spent() {
                break;
            }
            let most_work = self.budget.of_descent(some.len(), self.context.work.done());
            let context = FitContext { most_work, ..self.context.clone() };
            found.extend(self.fitted(&context, some));
            proposed += some.len();
        }
        let exchanged = proposal::exchanged(&proposals[..proposed]);
        self.compared.whole.extend(exchanged);
        if proposed < count {
            self.leave_undecided(round);
        }
        let bettered = self.bettered_by(&found);
        self.rounds.push(RoundEnd {
            round: round.name(),
            part: self.part,
            work: self.context.work.done(),
            proposed,
            bettered,
        });
        self.keep(found);
        if round == Round::ExpensiveSingles {
            self.fits[1..].sort_by(|a, b| a.hypothesis.effects.cmp(&b.hypothesis.effects));
        }
        match round.learns() {
            NoiseUpdate::Always => self.update_noise(),
            NoiseUpdate::IfLower if least_chi2(&self.fits) < before => self.update_noise(),
            _ => {}
        }
    }

    fn leave_undecided(&mut self, round: Round) {
        if !self.undecided.contains(&round.name()) {
            self.undecided.push(round.name());
        }
    }

    /// Whether the present phase has done the work it was allowed. It is asked between fits that run together, so that the answer does not depend on threads.
    fn is_spent(&self) -> bool {
        self.budget.is_spent(self.context.work.done())
    }

    fn fitted(&self, context: &FitContext<'a>, proposals: &[Proposal<'_, 'a>]) -> Vec<Refit<'a>> {
        let of = |proposal: &Proposal<'_, 'a>| {
            let fits = proposal.fitted(context);
            self.progress.advance(1);
            fits
        };
        proposals.par_iter().with_max_len(1).flat_map_iter(of).collect()
    }

    fn keep(&mut self, found: Vec<Refit<'a>>) {
        self.fits = merged(std::mem::take(&mut self.fits), found, self.context.settings.certificate.agrees);
    }

    /// How many hypotheses some fits are new to, or do better.
    fn bettered_by(&self, found: &[Refit<'a>]) -> usize {
        let known = |fit: &Refit<'a>| self.fits.iter().find(|own| own.hypothesis.effects == fit.hypothesis.effects);
        found.iter().filter(|fit| known(fit).is_none_or(|known| fit.chi2 < known.chi2 - BETTER_BY)).count()
    }

    /// How much the base model lacks.
    fn lacking(&self) -> Misfit {
        Misfit::of(&self.context, self.base(), &self.scores)
    }

    /// How much the best fit lacks, of those that need no unusual error of the measurement.
    fn misfit(&self) -> Option<Misfit> {
        let prior = &self.context.settings.prior;
        let foremost = best(&self.fits, 1, |fit| is_possible(fit, prior), |fit| fit.chi2);
        foremost.first().map(|i| Misfit::of(&self.context, &self.fits[*i], &[]))
    }
}
