//! The posterior: how probable each hypothesis is, beside the others and beside something that no table holds.

use super::bagging;
use super::effect::{Effect, Place};
use super::energy::added_torque_n_m;
use super::evidence::{self, Scatter, normalised};
use super::hypothesis::Compared;
use super::latent::{LatentConfig, LatentForce};
use super::latent_forces::unknowns;
use super::laws::law_of;
use super::misfit::{chi2_noise_limit, leaves_more_than_noise, left_of_excess, needs};
use super::refit::{self, Refit};
use super::rounding::rounded;
use super::settings::Settings;
use crate::fit::Record;
use crate::fit::whitening::RecordNoise;
use crate::statistics::no_chance;

/// Probabilities below this change nothing.
const NEGLIGIBLE: f64 = 1e-4;

/// A hypothesis with its probability.
#[derive(Debug, Clone)]
pub struct Candidate<'a> {
    /// Fitted.
    pub fit: Refit<'a>,
    /// ln of evidence and prior.
    pub ln_posterior: f64,
    /// Posterior.
    pub probability: f64,
    /// Posterior where nothing outside the table is at work.
    pub if_named: f64,
    /// Probability of this set of effects, over the cases with and without something that remains beside it.
    pub mixture_probability: f64,
}

/// Hypotheses beside the unknown.
#[derive(Debug)]
pub struct Posterior<'a> {
    /// With their probabilities, likeliest first.
    pub candidates: Vec<Candidate<'a>>,
    /// The probability of something else.
    pub unknown: f64,
    /// The probability that something remains beside the likeliest names, whatever they are.
    pub remains: f64,
    /// The probability of the likeliest one if every rival whose fit is not certified, and which is within reach, fitted as well.
    pub lowest: f64,
    /// Those rivals.
    pub uncertified: Vec<Vec<Effect>>,
    /// That something around the likeliest fit, at each place.
    pub unknowns: Vec<LatentForce>,
    /// How many effects of a hypothesis have been held against every other.
    pub compared: Compared,
    /// How probable each effect is where any law may stand in its place; nothing where that was not asked.
    pub needed: Vec<Needed>,
    /// The part of what the base model leaves of what was not fitted that the best description explains, laws that were learnt included: where any law may stand in its place, no
    /// effect is surer.
    pub explained: f64,
}

/// How probable an effect is where any law may stand in its place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Needed {
    /// Which.
    pub effect: Effect,
    /// That it is at work.
    pub probability: f64,
    /// That a law outside the table acts in its place.
    pub replaced: f64,
    /// Whether it has been held against every other effect beside the likeliest law.
    pub compared: bool,
}

/// Weighs the hypotheses of some fits, out of so many candidate effects, beside the unknown around the likeliest of them. So many effects of each have been held
/// against every other.
pub fn weigh<'a>(fits: Vec<Refit<'a>>, effects: usize, compared: &Compared, settings: &Settings) -> Posterior<'a> {
    let values = fits.first().map_or(0, Refit::values);
    let least = refit::least(&fits);
    let scatter = least.map_or(Scatter::NOISE, |best| Scatter::of(best, values));
    let least_without = |effect: Effect| {
        let others = fits.iter().filter(|f| !f.hypothesis.effects.contains(&effect));
        others.map(|f| f.chi2).fold(f64::INFINITY, f64::min)
    };
    let ln_prior = |fit: &Refit<'_>| evidence::ln_prior(&fit.hypothesis, effects, &settings.prior);
    let ln = |fit: &Refit<'_>| {
        evidence::ln_evidence(fit, scatter, least_without, &settings.prior, settings.misfit.counts) + ln_prior(fit)
    };
    let is_seen = |fit: &Refit<'_>| {
        fit.hypothesis.effects.iter().all(|effect| {
            let rest = fit.hypothesis.without(*effect);
            let without = fits.iter().find(|other| other.hypothesis.effects == rest.effects);
            without.is_none_or(|without| law_of(*effect).is_seen(fit, without))
        })
    };
    let mut posterior: Vec<f64> =
        fits.iter().map(|fit| if is_seen(fit) { ln(fit) } else { f64::NEG_INFINITY }).collect();
    let best = (0..fits.len()).max_by(|a, b| posterior[*a].total_cmp(&posterior[*b])).unwrap_or(0);
    let unknowns = unknowns(&fits[best], fits[best].chi2 / values as f64, LatentConfig::RESIDUAL);
    posterior.push(
        posterior[best] + settings.prior.unknown.ln() + ln_gain_of_unknown(&fits[best], &unknowns, scatter, settings),
    );
    let rivals = uncertified_within_reach(&fits, best, settings);
    let mut at_best = posterior.clone();
    for rival in &rivals {
        at_best[*rival] = at_best[*rival].max(posterior[best] + ln_prior(&fits[*rival]) - ln_prior(&fits[best]));
    }
    let others: Vec<&Refit<'_>> = fits.iter().collect();
    let not_imitated: Vec<f64> = fits.iter().map(|fit| not_imitated(fit, &others, compared, settings)).collect();
    let lowest = normalised(&at_best)[best] * not_imitated[best];
    let uncertified = rivals.iter().map(|rival| fits[*rival].hypothesis.effects.clone()).collect();
    let if_named = normalised(&posterior[..fits.len()]);
    let mut probability = normalised(&posterior);
    let mut unknown = probability.pop().unwrap_or(0.0);
    let remains = unknown;
    let layers = RemainderMixture { fits: &fits, best, ln_posterior: &posterior, if_named: &if_named };
    let mixture_probability = layers.probabilities((scatter, remains), settings);
    // a name, above all a support that moves, may be a stand-in for what is not known
    for (not_imitated, probability) in not_imitated.iter().zip(&mut probability) {
        unknown += (1.0 - not_imitated) * *probability;
        *probability *= not_imitated;
    }
    let candidate = |(place, fit)| Candidate {
        fit,
        ln_posterior: posterior[place],
        probability: probability[place],
        if_named: if_named[place],
        mixture_probability: mixture_probability[place],
    };
    let mut candidates: Vec<Candidate<'a>> = fits.into_iter().enumerate().map(candidate).collect();
    // where the unknown takes all, or next to all, their order among themselves still counts
    candidates
        .sort_by(|a, b| (b.probability.total_cmp(&a.probability)).then(b.ln_posterior.total_cmp(&a.ln_posterior)));
    Posterior {
        candidates,
        unknown,
        remains,
        lowest,
        uncertified,
        unknowns,
        compared: compared.clone(),
        needed: Vec::new(),
        explained: 1.0,
    }
}

/// By how much something outside the table raises the ln of the evidence around the likeliest fit: what its latent forces explain beyond the rounding of the table,
/// or what a fit that failed leaves.
fn ln_gain_of_unknown(best: &Refit<'_>, unknowns: &[LatentForce], scatter: Scatter, settings: &Settings) -> f64 {
    let law_error_n_m = law_error_n_m(best, added_torque_n_m(best));
    let coloured = settings.noise.coloured;
    let explained = unknown_gain(unknowns, law_error_n_m, slow_errors_rad(best), coloured);
    let of_rounding = gain_of_rounding(best, law_error_n_m, coloured);
    (explained - of_rounding).max(gain_over_a_failed_fit(best, scatter, settings))
}

/// The names in layers: P(S) = (1 − z) P(S | nothing remains) + z g P(S | something remains), z being the probability that something does, and g the odds
/// that names which leave so much are at work.
struct RemainderMixture<'f, 'a> {
    fits: &'f [Refit<'a>],
    /// The likeliest.
    best: usize,
    /// Of the fits, then of the unknown.
    ln_posterior: &'f [f64],
    /// P(S | nothing remains).
    if_named: &'f [f64],
}

impl RemainderMixture<'_, '_> {
    fn probabilities(&self, (scatter, remains): (Scatter, f64), settings: &Settings) -> Vec<f64> {
        let Self { fits, if_named, .. } = *self;
        let bagged_posterior = match remains > NEGLIGIBLE {
            true => self.bagged_posterior(scatter, settings),
            false => if_named.to_vec(),
        };
        let base = fits.iter().find(|f| f.hypothesis.effects.is_empty());
        let of = |place: usize| {
            let left = base.map_or(1.0, |base| left_of_excess(&fits[place], base));
            let named = !fits[place].hypothesis.effects.is_empty();
            let odds = if named { settings.prior.odds_where_left(left) } else { 1.0 };
            (1.0 - remains) * if_named[place] + remains * odds * bagged_posterior[place]
        };
        (0..fits.len()).map(of).collect()
    }

    /// P(S | something remains). A fit that is not certified may be a false minimum: it counts for nothing beside those that are.
    fn bagged_posterior(&self, scatter: Scatter, settings: &Settings) -> Vec<f64> {
        let counts = |place: usize| place == self.best || self.fits[place].is_certified(&settings.certificate);
        let ln_weight = |(place, fit): (usize, &Refit<'_>)| match counts(place) {
            true => self.ln_posterior[place] + 0.5 * fit.chi2 / scatter.of_all,
            false => f64::NEG_INFINITY,
        };
        let ln_weight: Vec<f64> = self.fits.iter().enumerate().map(ln_weight).collect();
        let together = ((scatter.of_all - 1.0) / (scatter.of_values - 1.0).max(1e-9)).max(1.0);
        bagging::bagged_posterior(self.fits, &ln_weight, (scatter.of_values, together))
    }
}

/// The rivals of the likeliest fit that are not certified, and leave so little more that a better fit of theirs might count. One that leaves only noise stands in
/// no false minimum, however few starts have led there.
fn uncertified_within_reach(fits: &[Refit<'_>], best: usize, settings: &Settings) -> Vec<usize> {
    let only_noise = chi2_noise_limit(fits[best].values(), &settings.misfit);
    let needs = |fit: &Refit<'_>| needs(fit, &fits[best], &settings.misfit);
    let reach = needs(&fits[best]) + settings.certificate.within;
    let is_rival = |place: &usize| {
        let fit = &fits[*place];
        let is_sound = fit.is_certified(&settings.certificate) || fit.chi2 < only_noise;
        *place != best && !is_sound && needs(fit) < reach
    };
    (0..fits.len()).filter(is_rival).collect()
}

/// The probability that a fit's effects are the cause, and do not imitate another one.
fn not_imitated(fit: &Refit<'_>, others: &[&Refit<'_>], compared: &Compared, settings: &Settings) -> f64 {
    let effects = &fit.hypothesis.effects;
    if effects.is_empty() {
        return 1.0;
    }
    let odds: f64 = effects.iter().map(|effect| odds(*effect, fit, others, settings)).product();
    let further = effects.len().saturating_sub(compared.of(effects)) as i32;
    odds * (1.0 - settings.prior.imitated) * settings.prior.not_compared.powi(further)
}

/// The same of one of them: what another one beside it stands for is not its concern.
fn genuine_alone(effect: Effect, is_further: bool, fit: &Refit<'_>, others: &[&Refit<'_>], settings: &Settings) -> f64 {
    let further = if is_further { settings.prior.not_compared } else { 1.0 };
    odds(effect, fit, others, settings) * (1.0 - settings.prior.imitated) * further
}

/// The odds that one of them is what it seems to be, as its own law and those beside it say.
fn odds(effect: Effect, fit: &Refit<'_>, others: &[&Refit<'_>], settings: &Settings) -> f64 {
    let beside = if within_law_error(effect, fit, others) { settings.prior.within_law_error } else { 1.0 };
    beside.min(law_of(effect).odds(fit, others, settings))
}

/// Whether an effect explains no more than the error of another one's law: of two torques that go with the position, or with the velocity, the smaller may be what the
/// larger one's law lacks.
fn within_law_error(effect: Effect, fit: &Refit<'_>, others: &[&Refit<'_>]) -> bool {
    let explained = |effect: Effect| {
        let rest = fit.hypothesis.without(effect).effects;
        others.iter().find(|other| other.hypothesis.effects == rest).map(|without| without.chi2 - fit.chi2)
    };
    let is_like = |other: &&Effect| {
        **other != effect
            && effect.entry().phase.is_some()
            && other.place() != Place::Camera
            && other.entry().phase == effect.entry().phase
    };
    let errors = fit.hypothesis.effects.iter().filter(is_like).filter_map(|other| {
        let error = other.entry().law_error;
        Some(error * error * explained(*other)?)
    });
    let most = errors.fold(0.0, f64::max);
    effect.place() != Place::Camera && explained(effect).is_some_and(|own| own < most)
}

/// By how much the torque of a fit's laws may be wrong.
fn law_error_n_m(fit: &Refit<'_>, added_n_m: f64) -> f64 {
    let part = |effect: &Effect| effect.entry().law_error;
    fit.hypothesis.effects.iter().map(part).fold(0.0, f64::max) * added_n_m
}

/// The errors that tracked or rounded angles may have from one swing to the next, as large as those in step with it.
fn slow_errors_rad(fit: &Refit<'_>) -> f64 {
    let of_record = |(noise, record): (&RecordNoise, &Record)| {
        noise.synchronous.max(record.rounding) * noise.sd_rad.iter().copied().fold(0.0, f64::max)
    };
    fit.problem.noise.iter().zip(fit.problem.records).map(of_record).fold(0.0, f64::max)
}

/// How much likelier an unknown of any size makes the recordings than one that a law's own error, or the tracker's, allows.
fn unknown_gain(latents: &[LatentForce], law_error_n_m: f64, slow_errors_rad: f64, coloured: f64) -> f64 {
    let within = |latent: &LatentForce, allowed: f64| {
        latent.tried.iter().filter(|t| t.0 <= allowed).map(|t| t.1).fold(0.0, f64::max)
    };
    let is_camera = |latent: &&LatentForce| latent.place() == Place::Camera;
    let wander = latents.iter().find(is_camera).map_or(0.0, |camera| within(camera, slow_errors_rad));
    let of = |latent: &LatentForce| {
        // an offset that wanders may be noise of another colour than was learnt
        let own = if is_camera(&latent) { coloured } else { within(latent, law_error_n_m) };
        latent.gain - own.max(wander)
    };
    // any size is as likely as any other, at any place
    let looks: usize = latents.iter().map(|l| l.tried.len()).sum();
    latents.iter().map(of).fold(f64::NEG_INFINITY, f64::max) - (looks.max(1) as f64).ln()
}

/// The same of an encoder's rounding of the fit itself: so much an unknown gains where there is none.
fn gain_of_rounding(fit: &Refit<'_>, law_error_n_m: f64, coloured: f64) -> f64 {
    let gain = |records: Vec<Record>| {
        let (mut made, values) = (fit.clone(), fit.values() as f64);
        made.problem.records = &records;
        let latents = unknowns(&made, fit.chi2 / values, LatentConfig::RESIDUAL);
        unknown_gain(&latents, law_error_n_m, slow_errors_rad(&made), coloured)
    };
    rounded(fit).into_iter().map(gain).fold(0.0, f64::max)
}

/// How much likelier anything that leaves only noise makes the recordings than a fit that failed: one that leaves far more, being out of step with a recording, shows no
/// small torque that would mend it, and one that has not come to its end shows only what is left of its way.
fn gain_over_a_failed_fit(fit: &Refit<'_>, scatter: Scatter, settings: &Settings) -> f64 {
    let stopped = !fit.converged && fit.chi2 > chi2_noise_limit(fit.values(), &settings.misfit);
    let gain = 0.5 * (fit.chi2 - fit.values() as f64) / scatter.of_all;
    if stopped || leaves_more_than_noise(fit, &settings.noise) { gain } else { f64::NEG_INFINITY }
}

impl<'a> Posterior<'a> {
    /// The likeliest fit.
    pub fn best(&self) -> &Refit<'a> {
        &self.candidates[0].fit
    }

    /// The same with one of the candidates first.
    pub fn led_by(mut self, place: usize) -> Self {
        self.candidates[..=place].rotate_right(1);
        self
    }

    /// The same where the base model is likeliest and leaves more than the noise, and chance leaves residuals as conspicuous as its own so rarely that something is missing,
    /// whatever it is; `p_value` says how often, where that can be told. An encoder's rounding is conspicuous, and no larger than the noise.
    #[must_use]
    pub fn beside_chance(mut self, p_value: impl FnOnce(&Refit<'a>) -> Option<f64>, settings: &Settings) -> Self {
        let (base, values) = (self.best(), self.best().values());
        let squares = || base.over_noise().powi(2) * values as f64;
        let is_more = base.hypothesis.effects.is_empty() && squares() > chi2_noise_limit(values, &settings.misfit);
        let p_value = is_more.then(|| p_value(base)).flatten();
        // what is surer that something is missing stays
        let missing = p_value.filter(|p_value| *p_value < settings.verdict.chance).map(no_chance);
        if let Some(missing) = missing.filter(|missing| *missing > self.unknown) {
            let named: f64 = self.candidates.iter().map(|candidate| candidate.probability).sum();
            self.candidates.iter_mut().for_each(|candidate| candidate.probability *= (1.0 - missing) / named);
            (self.unknown, self.remains) = (missing, missing);
        }
        self
    }

    /// Whether a name of the likeliest fit often stands for something else, or two of them may together: a frequency, and how it goes with amplitude, is what any
    /// nonlinear spring changes.
    pub fn may_be_imitation(&self, settings: &Settings) -> bool {
        let (best, others) = (self.best(), self.fits());
        let effects = &best.hypothesis.effects;
        let of_frequency = effects.iter().filter(|effect| effect.entry().is_of_frequency()).count();
        of_frequency > 1 || effects.iter().any(|effect| odds(*effect, best, &others, settings) < 1.0)
    }

    /// Whether something remains, and the names, which may imitate a law of no table, have not been held against any: a strip's fits are too dear for that.
    fn may_stand_for_a_law(&self, settings: &Settings) -> bool {
        self.needed.is_empty() && self.remains > settings.verdict.even && self.may_be_imitation(settings)
    }

    fn fits(&self) -> Vec<&Refit<'a>> {
        self.candidates.iter().map(|c| &c.fit).collect()
    }

    /// The fit of some effects and no others.
    pub fn of(&self, effects: &[Effect]) -> Option<&Refit<'a>> {
        self.candidate(effects).map(|c| &c.fit)
    }

    /// The same with its probabilities.
    pub fn candidate(&self, effects: &[Effect]) -> Option<&Candidate<'a>> {
        self.candidates.iter().find(|c| c.fit.hypothesis.effects == effects)
    }

    /// The base model's fit, which every search holds.
    pub fn base(&self) -> &Refit<'a> {
        self.of(&[]).unwrap_or(self.best())
    }

    /// How probable an effect is, over all sets of names that hold it, whatever remains beside them: as the fits of the table say, or, where laws were
    /// sought, all descriptions. `is_untried` says that the names may stand for a law.
    fn inclusion(&self, effect: Effect, is_untried: bool, settings: &Settings) -> f64 {
        let others = self.fits();
        let needed = self.needed.iter().find(|own| own.effect == effect);
        let not_imitated = |fit: &Refit<'_>| {
            let explaining = self.by_contribution(fit);
            let compared = self.compared.of(&fit.hypothesis.effects);
            let is_further = is_untried || explaining.iter().skip(compared).any(|further| *further == effect);
            let is_compared = needed.is_some_and(|needed| needed.compared);
            genuine_alone(effect, is_further && !is_compared, fit, &others, settings)
        };
        let with = || self.candidates.iter().filter(|c| c.fit.hypothesis.has(effect));
        let counts = with().filter(|c| c.mixture_probability > NEGLIGIBLE);
        let of_table =
            counts.map(|c| c.mixture_probability * not_imitated(&c.fit)).fold(0.0, |sum, p| sum + p).min(1.0);
        let likeliest = with().next().map_or(1.0 - settings.prior.imitated, |c| not_imitated(&c.fit));
        // the descriptions hold those of the table, too
        needed.map_or(of_table, |needed| (needed.probability * likeliest).min(self.explained))
    }

    /// How probable each effect of the table is.
    pub fn inclusions(&self, settings: &Settings) -> Vec<(Effect, f64)> {
        let is_untried = self.may_stand_for_a_law(settings);
        Effect::ALL.into_iter().map(|effect| (effect, self.inclusion(effect, is_untried, settings))).collect()
    }

    /// A fit's effects, the one that explains most first: without which it would be worst. What has not been weighed leaves at least what one with more effects does.
    pub fn by_contribution(&self, fit: &Refit<'_>) -> Vec<Effect> {
        let mut effects = fit.hypothesis.effects.clone();
        let left_without = |effect: &Effect| {
            let others = fit.hypothesis.without(*effect);
            let fits = || self.candidates.iter().map(|candidate| &candidate.fit);
            let richer = fits().filter(|own| !own.hypothesis.has(*effect) && others.is_within(&own.hypothesis));
            self.of(&others.effects).map_or(richer.map(|own| own.chi2).fold(fit.chi2, f64::max), |fit| fit.chi2)
        };
        effects.sort_by(|a, b| left_without(b).total_cmp(&left_without(a)));
        effects
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::base_priors::DampingAssumption;
    use crate::diagnose::hypothesis::Hypothesis;
    use crate::diagnose::preparation;
    use crate::diagnose::search::Search;
    use crate::diagnose::testing::{arm, swing};
    use crate::progress::Silent;

    /// The posterior of an arm's base model alone, which leaves more than the noise, beside something of this probability, held against chance.
    fn beside_something(unknown: f64, check: impl Fn(Posterior<'_>)) {
        let experiment = arm("hinge_viscous = 2e-5\n");
        let (t_s, theta_rad) = swing(&experiment, 10.0, 30.0);
        let wave = |t: &f64| 1e-2 * (2.0 * t).sin();
        let angles = t_s.iter().zip(theta_rad).map(|(t, theta_rad)| Some(theta_rad + wave(t))).collect();
        let record = Record::uniform("made", t_s, vec![angles]);
        let settings = Settings::default();
        let prepared = preparation::prepare(&[record], &experiment, &settings).unwrap();
        let taken = DampingAssumption::AsStated;
        let search = Search::of_base_model(&prepared, &prepared.experiment, taken, &settings, &Silent).unwrap();
        let probability = (1.0 - unknown).max(1e-300);
        let candidate = Candidate {
            fit: search.base().clone(),
            ln_posterior: 0.0,
            probability,
            if_named: 1.0,
            mixture_probability: probability,
        };
        let posterior = Posterior {
            candidates: vec![candidate],
            unknown,
            remains: unknown,
            lowest: probability,
            uncertified: Vec::new(),
            unknowns: Vec::new(),
            compared: Compared::default(),
            needed: Vec::new(),
            explained: 1.0,
        };
        check(posterior.beside_chance(|_| Some(0.002), &settings));
    }

    #[test]
    fn what_chance_seldom_leaves_makes_the_unknown_surer_and_never_less_sure() {
        beside_something(0.3, |posterior| {
            // 1/(1 − e 0.002 ln 0.002)
            assert!((posterior.unknown - 0.9673).abs() < 1e-4, "{}", posterior.unknown);
            assert!((posterior.candidates[0].probability + posterior.unknown - 1.0).abs() < 1e-12);
        });
        // so sure that no number near 1 says it: nothing is divided by nothing
        beside_something(1.0, |posterior| {
            assert_eq!(posterior.unknown, 1.0);
            assert!(posterior.candidates[0].probability < 1e-12);
        });
    }

    #[test]
    fn a_clock_and_a_scale_that_were_held_against_no_law_are_less_probable_where_something_remains() {
        let experiment = arm("hinge_viscous = 2e-5\n");
        let (t_s, theta_rad) = swing(&experiment, 10.0, 30.0);
        let angles = theta_rad.into_iter().map(Some).collect();
        let record = Record::uniform("made", t_s, vec![angles]);
        let settings = Settings::default();
        let prepared = preparation::prepare(&[record], &experiment, &settings).unwrap();
        let taken = DampingAssumption::AsStated;
        let search = Search::of_base_model(&prepared, &prepared.experiment, taken, &settings, &Silent).unwrap();
        let inclusion = |effects: &[Effect], remains: f64| {
            let of = |hypothesis: Hypothesis, effect: &Effect| hypothesis.and(*effect, None);
            let hypothesis = effects.iter().fold(Hypothesis::default(), of);
            let fit = search.context.refit(&hypothesis, search.base(), &[]).unwrap();
            let weighed = |fit, probability| Candidate {
                fit,
                ln_posterior: 0.0,
                probability,
                if_named: probability,
                mixture_probability: probability,
            };
            let posterior = Posterior {
                candidates: vec![weighed(fit, 1.0), weighed(search.base().clone(), 0.0)],
                unknown: 0.0,
                remains,
                lowest: 1.0,
                uncertified: Vec::new(),
                unknowns: Vec::new(),
                compared: Compared { of_any: 2, ..Compared::default() },
                needed: Vec::new(),
                explained: 1.0,
            };
            let inclusions = posterior.inclusions(&settings);
            inclusions.into_iter().find(|own| own.0 == Effect::TimeBase).unwrap().1
        };
        let both = [Effect::TimeBase, Effect::AngleGain];
        assert!((inclusion(&both, 1.0) / inclusion(&both, 0.0) - settings.prior.not_compared).abs() < 1e-9);
        // a clock alone changes no frequency with amplitude
        let alone = [Effect::TimeBase];
        assert_eq!(inclusion(&alone, 1.0), inclusion(&alone, 0.0));
    }
}
