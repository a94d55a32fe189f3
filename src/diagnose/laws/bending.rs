//! A strip that bends everywhere, as finely as it needs.
//!
//! While it is one candidate among many it is made of few rods and starts in the shape of the two it replaces, which is cheap and tells it from other
//! effects. Where it then explains most, the search begins anew with the strip as its base model (`search/strip.rs`).

use super::super::effect::Effect;
use super::super::hypothesis::Hypothesis;
use super::super::refit::Refit;
use super::super::settings::PriorSettings;
use super::{Coefficients, FitRequest, Law};

/// The law.
pub struct Bending;

impl Law for Bending {
    /// Many rods are dear: only where there is something to explain, and further only where the first steps lead somewhere.
    fn beside<'a>(&self, sought: &FitRequest<'_, 'a>) -> Option<Refit<'a>> {
        let FitRequest { context, base, effect, misfit, .. } = *sought;
        if !misfit.unexplained {
            return None;
        }
        let settings = &context.settings.descent;
        let hypothesis = base.hypothesis.and(effect, None);
        let begun = context.begin(&hypothesis, base, &[]).filter(|b| b.chi2 < settings.hopeless_ratio * base.chi2);
        let begun = begun.and_then(|b| context.go_on(&b, settings.few_steps));
        let begun = begun.filter(|b| b.chi2 < settings.strip_continue_ratio * base.chi2);
        let near = begun.and_then(|b| if b.converged { Some(b) } else { context.go_on(&b, settings.few_steps) });
        let lost = near.as_ref().is_none_or(|near| near.has_lost_step(&context.settings.misfit));
        let anew = (misfit.out_of_step && lost).then(|| context.refit_by_shooting(&hypothesis, &[], base)).flatten();
        context.best_of([near, anew])
    }

    /// It takes the place of the joint's spring.
    fn strength(&self, _effect: Effect, _of: &Coefficients<'_>) -> Option<(f64, f64)> {
        None
    }

    fn ln_multiplicity(
        &self,
        _fit: &Refit<'_>,
        _effect: Effect,
        _of: &Coefficients<'_>,
        _settings: &PriorSettings,
    ) -> f64 {
        0.0
    }
}

/// The hypothesis of it alone.
pub fn alone() -> Hypothesis {
    Hypothesis { effects: vec![Effect::DistributedFlexibility], dropped: None }
}
