//! Effects beside a fit: every one, or those that promise most.

use rayon::prelude::*;

use super::super::context::FitContext;
use super::super::effect::Effect;
use super::super::laws::{self, FitRequest, law_of};
use super::super::misfit::Misfit;
use super::super::refit::Refit;
use super::super::screen::{Score, Screen};

/// An effect to be fitted beside a fit, from every start that may lead to its minimum.
#[derive(Debug, Clone)]
pub struct Beside<'f, 'a> {
    /// The fit.
    pub base: &'f Refit<'a>,
    /// How much it lacks.
    pub misfit: Misfit,
    /// Which.
    pub effect: Effect,
    /// What it promises.
    pub score: Option<Score>,
}

impl<'f, 'a> Beside<'f, 'a> {
    /// The best fit of it.
    pub fn fitted(&self, context: &FitContext<'a>) -> Option<Refit<'a>> {
        let Self { base, misfit, effect, score } = self;
        law_of(*effect).beside(&FitRequest { context, base, effect: *effect, score: score.as_ref(), misfit: *misfit })
    }

    /// Every effect that a fit does not have.
    pub fn every(context: &FitContext<'a>, base: &'f Refit<'a>, effects: &[Effect]) -> Vec<Self> {
        let Some(screen) = Screen::at(context, base) else { return Vec::new() };
        let scores = laws::scores(&screen, &laws::cheap_to_score(context, effects));
        let misfit = Misfit::of(context, base, &scores);
        let others = effects.iter().copied().filter(|effect| !base.hypothesis.has(*effect));
        others.map(|effect| Self::of(base, misfit, effect, &scores)).collect()
    }

    /// One effect, of which there may be a score.
    pub fn of(base: &'f Refit<'a>, misfit: Misfit, effect: Effect, scores: &[Score]) -> Self {
        let score = scores.iter().find(|score| score.effect == effect).cloned();
        Self { base, misfit, effect, score }
    }

    /// Those that promise most, as far as the number of effects and of coefficients allows.
    pub fn most_promising(context: &FitContext<'a>, base: &'f Refit<'a>, effects: &[Effect]) -> Vec<Self> {
        let settings = &context.settings.search;
        if base.hypothesis.effects.len() >= settings.most_effects {
            return Vec::new();
        }
        let room = settings.most_coefficients.saturating_sub(base.coefficients());
        let small: Vec<Effect> = effects.iter().copied().filter(|e| e.parameters().len() <= room).collect();
        let mut all = Self::every(context, base, &small);
        all.retain(|beside| beside.promised() > context.settings.misfit.counts);
        all.sort_by(|a, b| b.promised().total_cmp(&a.promised()));
        all.truncate(settings.tried);
        all
    }

    fn promised(&self) -> f64 {
        self.score.as_ref().map_or(0.0, |score| score.gain)
    }
}

/// A fit with one effect more, of those that promise most.
pub fn with_one_more<'b>(context: &FitContext<'b>, fit: &Refit<'b>, effects: &[Effect]) -> Vec<Refit<'b>> {
    let proposals = Beside::most_promising(context, fit, effects);
    proposals.par_iter().with_max_len(1).filter_map(|beside| beside.fitted(context)).collect()
}
