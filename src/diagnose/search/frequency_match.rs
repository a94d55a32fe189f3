//! A base model that swings at another pace than the recordings.
//!
//! A wrong frequency bends the fitted springs, of whole motions and of short stretches alike: they are no start for anything else. A clock takes any pace,
//! whatever makes it, and a spring at the hinge that of a specimen held otherwise than the file says. So these are fitted first. Where one of them takes nearly
//! all that the base model leaves, the springs beside it are right, and every other effect is sought from there, in its place: added mass, a support in step
//! with the swing, a scale of the angles.

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
const FREQUENCY_EFFECTS: [Effect; 2] = [Effect::TimeBase, Effect::HingeStiffness];

/// Where effects are sought from in the place of one that takes the pace.
pub struct FrequencyMatched<'a> {
    /// The base model as it stands beside that one, without it.
    pub base: Refit<'a>,
    /// What promises much of what it takes.
    pub scores: Vec<Score>,
}

impl<'a> Search<'a, '_> {
    /// Fits what may take the pace, and looks for what may stand in its place where it takes nearly all that the base model leaves of the swing.
    pub(super) fn match_frequency(&mut self) {
        if !self.frequency_may_be_wrong() {
            return;
        }
        let (base, search) = (self.base(), &self.context.settings.search);
        let most = search.frequency_match_residual * base.relative_residual();
        let of = |effect: &Effect| {
            let alone = Hypothesis::default().and(*effect, None);
            let takes = |fit: &Refit<'a>| fit.relative_residual() < most;
            if let Some(known) = self.fits.iter().find(|fit| fit.hypothesis == alone) {
                return takes(known).then_some((*effect, alone, None));
            }
            let start = if *effect == Effect::TimeBase { self.clock_from_frequency() } else { Vec::new() };
            let new = self.context.refit_by_shooting(&alone, &start, base).filter(takes)?;
            Some((*effect, alone, Some(new)))
        };
        let possible = FREQUENCY_EFFECTS.iter().filter(|effect| self.effects.contains(effect));
        let Some((effect, alone, new)) = possible.into_iter().find_map(of) else { return };
        if let Some(new) = new {
            self.keep(vec![new]);
            self.update_noise();
        }
        let fitted = self.fits.iter().find(|fit| fit.hypothesis == alone);
        self.frequency_matched = fitted.and_then(|fit| substitutes_for(effect, &self.context, fit, &self.effects));
    }

    /// Whether the base model leaves much of the swing, and has lost step, or bent a spring to the pace, or something that takes a pace promises much of what it leaves.
    fn frequency_may_be_wrong(&self) -> bool {
        let (base, settings) = (self.base(), self.context.settings);
        let misfit = self.lacking();
        let promises = |score: &Score| {
            FREQUENCY_EFFECTS.contains(&score.effect) && score.gain > settings.search.most_of * base.chi2
        };
        let is_led =
            self.fits.iter().any(|fit| matches!(&fit.hypothesis.effects[..], [own] if FREQUENCY_EFFECTS.contains(own)));
        let leaves_much = base.relative_residual() > settings.misfit.much;
        leaves_much && (misfit.out_of_step || misfit.spring_drifted || is_led || self.scores.iter().any(promises))
    }

    /// The clock by which the first recording swings as fast as the specimen, with springs as stiff or as soft as they may be.
    fn clock_from_frequency(&self) -> Vec<(Parameter, f64)> {
        let seen = self.context.records.first().and_then(Seen::of);
        let pace = seen.and_then(|seen| Pace::of(&seen, self.context.experiment));
        pace.map(|pace| (Parameter::TimeBase, pace.ratio() - 1.0)).into_iter().collect()
    }
}

/// What promises much of what an effect takes that is fitted alone, in its place.
fn substitutes_for<'a>(
    effect: Effect,
    context: &FitContext<'a>,
    fit: &Refit<'a>,
    effects: &[Effect],
) -> Option<FrequencyMatched<'a>> {
    let screen = Screen::in_place_of(context, fit, effect)?;
    let scores = laws::scores(&screen, &laws::cheap_to_score(context, effects));
    let promised = context.settings.search.most_of * screen.projection.residual.norm_squared();
    let scores = scores.into_iter().filter(|score| score.gain > promised).collect();
    let nothing = Hypothesis::default();
    let (problem, x) = context.start(&nothing, fit, &[])?;
    Some(FrequencyMatched { base: context.descend(&nothing, problem, x, 0)?, scores })
}
