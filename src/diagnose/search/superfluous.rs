//! Effects that a set of several does not need.
//!
//! Such a set leaves as little as the set without them, and cannot be the answer: an effect of it is not told from zero. The set without may never have been fitted,
//! for a search adds the effects one after another, and the first may have been the wrong one. It costs a few steps, whatever the budget has left.

use rayon::prelude::*;

use super::super::hypothesis::Hypothesis;
use super::super::laws::Estimates;
use super::super::misfit::needs;
use super::super::refit::{self, Refit, least};
use super::Search;

/// Sets of several effects that are looked at (cost).
const SETS: usize = 3;

impl<'a> Search<'a, '_> {
    /// Fits the best sets of several effects without one that is not told from zero, and goes on with what is left of them.
    pub(super) fn drop_superfluous(&mut self) {
        for _ in 0..self.context.settings.search.most_coefficients {
            let proposed = self.without_superfluous();
            let of = |(hypothesis, within): &(Hypothesis, &Refit<'a>)| self.context.refit(hypothesis, within, &[]);
            let found: Vec<Refit<'a>> = proposed.par_iter().with_max_len(1).filter_map(of).collect();
            if found.is_empty() {
                break;
            }
            self.keep(found);
        }
    }

    /// Hypotheses that have not been fitted, or not from where a richer one stands, with that one's fit.
    fn without_superfluous(&self) -> Vec<(Hypothesis, &Refit<'a>)> {
        let Some(best) = least(&self.fits) else { return Vec::new() };
        let settings = self.context.settings;
        let chosen = refit::best(
            &self.fits,
            SETS,
            |fit| fit.hypothesis.effects.len() > 1,
            |fit| needs(fit, best, &settings.misfit),
        );
        let mut proposed: Vec<(Hypothesis, &Refit<'a>)> = Vec::new();
        for fit in chosen.into_iter().map(|place| &self.fits[place]) {
            let estimates = Estimates::of(fit, fit.variance_ratio());
            for effect in estimates.effects.iter().filter(|effect| !estimates.tells(**effect, &settings.prior)) {
                let fewer = fit.hypothesis.without(*effect);
                let is_known = |other: &Refit<'a>| {
                    other.hypothesis.effects == fewer.effects && other.chi2 < fit.chi2 + settings.misfit.counts
                };
                let is_new = proposed.iter().all(|(known, _)| *known != fewer);
                if is_new && !self.fits.iter().any(is_known) {
                    proposed.push((fewer, fit));
                }
            }
        }
        proposed
    }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand::rngs::StdRng;
    use rand_distr::{Distribution, Normal};

    use super::*;
    use crate::diagnose::base_priors::DampingAssumption;
    use crate::diagnose::effect::Effect;
    use crate::diagnose::testing::{arm, swing};
    use crate::diagnose::{Settings, preparation};
    use crate::fit::Record;
    use crate::model::Parameter;
    use crate::progress::Silent;

    const DAMPED: &str = "hinge_viscous = 2e-5\n";

    #[test]
    fn a_pair_of_which_one_is_nothing_leads_to_the_other_alone() {
        let (t_s, theta_rad) = swing(&arm(&format!("{DAMPED}hinge_coulomb = 2e-4\n")), 15.0, 30.0);
        let (mut random, noise) = (StdRng::seed_from_u64(2), Normal::new(0.0, 1e-3).unwrap());
        let angles = theta_rad.iter().map(|theta| Some(theta + noise.sample(&mut random))).collect();
        let record = Record::uniform("made", t_s, vec![angles]);
        let settings = Settings::default();
        let prepared = preparation::prepare(&[record], &arm(DAMPED), &settings).unwrap();
        let taken = DampingAssumption::AsStated;
        let mut search = Search::of_base_model(&prepared, &prepared.experiment, taken, &settings, &Silent).unwrap();
        let pair = Hypothesis::default().and(Effect::HingeCoulomb, None).and(Effect::CameraTilt, None);
        let start = [(Parameter::HingeCoulomb, 2e-4), (Parameter::HingeViscous, 2e-5)];
        let fit = search.context.refit(&pair, search.base(), &start).unwrap();
        assert!(fit.chi2 < 550.0, "{}", fit.chi2);
        let estimates = Estimates::of(&fit, fit.variance_ratio());
        assert!(!estimates.tells(Effect::CameraTilt, &settings.prior), "{:?}", estimates.value(Parameter::CameraTilt));
        search.keep(vec![fit]);
        search.drop_superfluous();
        let alone = search.fits.iter().find(|fit| fit.hypothesis.effects == [Effect::HingeCoulomb]).unwrap();
        assert!(alone.chi2 < 550.0, "{}", alone.chi2);
        // friction is needed
        assert!(search.fits.iter().all(|fit| fit.hypothesis.effects != [Effect::CameraTilt]));
    }
}
