//! A strip that is found to bend everywhere.
//!
//! While bending is one candidate among many, the strip is made of few rods and starts in the shape of the two links that it replaces, which is cheap. Such a strip is
//! not right to the noise, and what else is missing would be told by what it gets wrong. So the search ends where bending leads, and another begins whose base model
//! is the strip; what that one finds then stands beside the file's own model.

use std::sync::OnceLock;

use rayon::prelude::*;

use super::super::effect::{BendingStrip, Effect, bending_n_m2};
use super::super::hypothesis::Hypothesis;
use super::super::laws::bending;
use super::super::preparation::{Prepared, prepare_within};
use super::super::refit::{Refit, least};
use super::Search;
use super::proposal::Proposal;
use crate::fit::Record;
use crate::model::Parameter;

impl<'a> Search<'a, '_> {
    /// A search whose base model is a strip that bends everywhere, where this one was led to it, or does not explain the recordings: what else is missing shows beside a
    /// strip that is right, and beside it alone.
    pub fn bending_strip_search(&mut self, records: &[Record], kept: &'a OnceLock<Prepared>) -> Option<Self> {
        let is_found = self.stopped_early || self.bends();
        let as_stiff = || {
            let stiffness = self.base().value(Parameter::JointStiffness).filter(|_| self.may_bend())?;
            Some(bending_n_m2(stiffness, self.context.experiment))
        };
        let stated = if is_found { self.bending_n_m2 } else { as_stiff() }?;
        let settings = self.context.settings;
        let mut experiment = self.context.experiment.clone();
        experiment.model.effects.distributed_flexibility = Some(stated);
        // with what the search that led here has left
        let budget = settings.search.budget.saturating_sub(self.context.work.done());
        let strip = prepare_within(budget, records, &experiment, settings).ok().and_then(|prepared| {
            // the whole takes as much for each row as the part that was prepared; one search is complete, and the other would not begin
            let of_base = (prepared.work.done() as f64 / prepared.part) as u64;
            (self.stopped_early || of_base < budget).then_some(())?;
            let prepared = kept.get_or_init(|| prepared);
            let taken = prepared.initial_damping();
            Self::of_base_model(prepared, &prepared.experiment, taken, settings, self.progress).ok()
        });
        if strip.is_none() && self.stopped_early {
            // no such strip follows the recordings
            self.stopped_early = false;
            self.end();
        }
        let rival_residual = least(&self.fits).filter(|_| !is_found).map(Refit::relative_residual);
        strip.map(|strip| Self { rival_residual, ..strip })
    }

    /// Whether bending explains most of what the base model leaves, and leaves less than anything else.
    pub(super) fn bends(&mut self) -> bool {
        let leads = self.context.settings.search.leader_leaves * self.base().chi2;
        let leader = least(&self.fits).filter(|best| best.chi2 < leads && !self.context.is_strip());
        self.bending_n_m2 = leader.and_then(|best| best.value(Parameter::BendingStiffness));
        self.bending_n_m2.is_some()
    }

    /// Whether the links may be a strip, nothing else explaining what is left.
    fn may_bend(&self) -> bool {
        self.effects.contains(&Effect::DistributedFlexibility) && self.misfit().is_some_and(|misfit| misfit.unexplained)
    }

    /// Whether another base model does better. What leaves only noise is not behind: how much that is of a swing differs between a part of the recordings and the whole.
    pub fn is_behind(&self) -> bool {
        let is_explained = self.misfit().is_some_and(|misfit| !misfit.unexplained);
        let leaves_more = |rival| least(&self.fits).is_none_or(|best| best.relative_residual() > rival);
        !is_explained && self.rival_residual.is_some_and(leaves_more)
    }

    /// Bending where nothing else explains what is left: from the base model's motion its own may not be found.
    pub(super) fn try_bending(&mut self) {
        let is_tried = self.fits.iter().any(|fit| fit.hypothesis.has(Effect::DistributedFlexibility));
        if !is_tried && self.may_bend() {
            let found = self.fitted(&self.context, &[Proposal::ByShooting(bending::alone(), self.base())]);
            self.keep(found);
        }
        self.bends();
    }

    /// The same with what a search beside the bending strip has found.
    #[must_use]
    pub fn with_strip_fits(mut self, strip: Self) -> Self {
        let model = &strip.context.experiment.model;
        self.context.identified_strip =
            Some(BendingStrip { rods: model.pieces, bending_n_m2: model.effects.distributed_flexibility });
        self.fits.retain(|fit| !fit.hypothesis.has(Effect::DistributedFlexibility));
        self.reweight(&strip.base().problem.noise, 0);
        let context = &self.context;
        let of = |fit: &Refit<'a>| {
            let hypothesis = with_bending(&fit.hypothesis);
            let (problem, x) = context.start(&hypothesis, fit, &[])?;
            let same = context.descend(&hypothesis, problem, x, 0)?;
            Some(Refit { converged: fit.converged, certificate: fit.certificate, ..same })
        };
        let found = strip.fits.par_iter().with_max_len(1).filter_map(of).collect();
        self.keep(found);
        let compared = strip.compared();
        self.compared.of_any = self.compared.of_any.max(compared.of_any + 1);
        let whole =
            compared.whole.into_iter().map(|effects| with_bending(&Hypothesis { effects, dropped: None }).effects);
        self.compared.whole.extend(whole);
        self.rounds.extend(strip.rounds);
        self.undecided = strip.undecided;
        self
    }
}

fn with_bending(hypothesis: &Hypothesis) -> Hypothesis {
    hypothesis.and(Effect::DistributedFlexibility, None)
}
