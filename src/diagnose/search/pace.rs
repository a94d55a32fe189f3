//! A base model that swings at another pace than the recordings.
//!
//! Its springs then follow the pace as far as they can, and so do those that short stretches tell: they are no place to look for anything else from. A clock takes any
//! pace, whatever makes it, and a spring at the hinge that of a specimen held otherwise than the file says. So these are fitted first. Where one of them takes nearly
//! all that the base model leaves, the springs beside it are right, and every other effect is sought from there, in its place: added mass, a support in step with the
//! swing, a scale of the angles.

use super::super::context::FitContext;
use super::super::effect::Effect;
use super::super::hypothesis::Hypothesis;
use super::super::laws;
use super::super::refit::Refit;
use super::super::screen::{Score, Screen};
use super::Search;
use crate::fit::{Pace, Seen};
use crate::model::Parameter;

/// What may take a pace.
const TAKES_PACE: [Effect; 2] = [Effect::TimeBase, Effect::HingeStiffness];

/// Where effects are sought from in the place of one that takes the pace.
pub struct Paced<'a> {
    /// The base model as it stands beside that one, without it.
    pub base: Refit<'a>,
    /// What promises much of what it takes.
    pub scores: Vec<Score>,
}

impl<'a> Search<'a, '_> {
    /// Fits what may take the pace, and looks for what may stand in its place where it takes nearly all that the base model leaves of the swing.
    pub(super) fn seek_pace(&mut self) {
        if !self.may_have_another_pace() {
            return;
        }
        let (base, search) = (self.base(), &self.context.settings.search);
        let most = search.takes_the_pace * base.left_share();
        let of = |effect: &Effect| {
            let alone = Hypothesis::default().and(*effect, None);
            let takes = |fit: &Refit<'a>| fit.left_share() < most;
            if let Some(known) = self.fits.iter().find(|fit| fit.hypothesis == alone) {
                return takes(known).then_some((*effect, alone, None));
            }
            let start = if *effect == Effect::TimeBase { self.clock_of_the_swing() } else { Vec::new() };
            let new = self.context.refit_anew(&alone, &start, base).filter(takes)?;
            Some((*effect, alone, Some(new)))
        };
        let may_be_missing = TAKES_PACE.iter().filter(|effect| self.effects.contains(effect));
        let Some((effect, alone, new)) = may_be_missing.into_iter().find_map(of) else { return };
        if let Some(new) = new {
            self.keep(vec![new]);
            self.learn_noise();
        }
        let fitted = self.fits.iter().find(|fit| fit.hypothesis == alone);
        self.paced = fitted.and_then(|fit| in_the_place_of(effect, &self.context, fit, &self.effects));
    }

    /// Whether the base model leaves much of the swing, and has lost step, or bent a spring to the pace, or something that takes a pace promises much of what it leaves.
    fn may_have_another_pace(&self) -> bool {
        let (base, settings) = (self.base(), self.context.settings);
        let misfit = self.lacking();
        let promises =
            |score: &Score| TAKES_PACE.contains(&score.effect) && score.gain > settings.search.most_of * base.chi2;
        let is_led =
            self.fits.iter().any(|fit| matches!(&fit.hypothesis.effects[..], [own] if TAKES_PACE.contains(own)));
        let leaves_much = base.left_share() > settings.misfit.much;
        leaves_much && (misfit.out_of_step || misfit.strayed || is_led || self.scores.iter().any(promises))
    }

    /// The clock by which the first recording swings as fast as the specimen, with springs as stiff or as soft as they may be.
    fn clock_of_the_swing(&self) -> Vec<(Parameter, f64)> {
        let seen = self.context.records.first().and_then(Seen::of);
        let pace = seen.and_then(|seen| Pace::of(&seen, self.context.experiment));
        pace.map(|pace| (Parameter::TimeBase, pace.ratio() - 1.0)).into_iter().collect()
    }
}

/// What promises much of what an effect takes that is fitted alone, in its place.
fn in_the_place_of<'a>(
    effect: Effect,
    context: &FitContext<'a>,
    fit: &Refit<'a>,
    effects: &[Effect],
) -> Option<Paced<'a>> {
    let screen = Screen::in_place_of(context, fit, effect)?;
    let scores = laws::scores(&screen, &laws::cheap_to_score(context, effects));
    let promised = context.settings.search.most_of * screen.projection.residual.norm_squared();
    let scores = scores.into_iter().filter(|score| score.gain > promised).collect();
    let nothing = Hypothesis::default();
    let (problem, x) = context.start(&nothing, fit, &[])?;
    Some(Paced { base: context.descend(&nothing, problem, x, 0)?, scores })
}
