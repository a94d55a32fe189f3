//! What the search proposes to fit, and how each proposal is fitted.

use super::super::context::FitContext;
use super::super::effect::Effect;
use super::super::energy::work_of_unit_j;
use super::super::hypothesis::Hypothesis;
use super::super::laws::{self, law_of};
use super::super::refit::{Certificate, Refit};
use super::super::screen::{Score, Screen};
use super::super::stretches::Asked;
use super::BETTER_BY;
use super::horizon;
use super::one_more::Beside;
use crate::fit::Record;
use crate::model::Parameter;

/// Two losses that together imitate a viscous damper, one growing as the swing becomes small, the other falling (physics).
pub const DAMPER_IMITATION: [Effect; 2] = [Effect::HingeCoulomb, Effect::AirQuadratic];
/// What is left of the base model's dampers where they take its place (start values).
const LEFT_OF_DAMPERS: f64 = 0.1;

/// One thing to fit.
#[derive(Debug, Clone)]
pub enum Proposal<'f, 'a> {
    /// An effect beside a fit, from every start of its law.
    Beside(Beside<'f, 'a>),
    /// An effect beside a fit, from where its score points.
    Scored(&'f Refit<'a>, Score),
    /// The first steps of that.
    Begun(&'f Refit<'a>, Score),
    /// [`DAMPER_IMITATION`] in the place of the base model's dampers: beside them each of the two promises nothing.
    ReplaceDampers(&'f Refit<'a>),
    /// An effect beside a fit from wherever it may be.
    ManyStarts(&'f Refit<'a>, Effect),
    /// A hypothesis that has a fit, from where another one stands.
    FromLeader {
        /// The fit that it has.
        fit: &'f Refit<'a>,
        /// The hypothesis.
        hypothesis: Hypothesis,
        /// Where to begin.
        leader: &'f Refit<'a>,
    },
    /// A restart: a fit anew from where the first part of each recording leads. When a dry hinge stops, and where, no derivative tells, and early on it has not.
    Restart(&'f Refit<'a>),
    /// A restart along the motion of another fit, which follows the recordings: the hypothesis cannot fall out of step with them. It ends after its first steps
    /// unless they leave less than so much.
    Along(Hypothesis, &'f Refit<'a>, f64),
    /// A set of laws that short stretches ask for, along the recorded motion.
    Asked(Asked, &'f Refit<'a>),
    /// A hypothesis from a fit that has fewer of its effects, the others being nothing: it cannot leave more than that one does.
    Nested(Hypothesis, &'f Refit<'a>),
    /// A hypothesis from the base model's fit, followed from the beginning of the recordings on.
    FromTheBeginning(Hypothesis, &'f Refit<'a>),
    /// A fit without one of its effects, and with another one of these in its place.
    Exchange(&'f Refit<'a>, Effect, &'f [Effect]),
    /// Those of these effects that do nearly as well in the place of one of a fit, by the tangents of its motion.
    Twins(&'f Refit<'a>, Effect, Vec<Effect>),
    /// A hypothesis anew from short stretches, beside what is left without.
    ByShooting(Hypothesis, &'f Refit<'a>),
    /// The hypotheses of these fits from the beginning of the recordings on, and beside the best of each part other effects.
    Continued(&'f [Refit<'a>], &'f [Effect]),
}

impl<'a> Proposal<'_, 'a> {
    /// The effects of a fit of which one is held against every other.
    fn exchanges(&self) -> Option<&[Effect]> {
        match self {
            Self::Exchange(fit, _, others) if !others.is_empty() => Some(&fit.hypothesis.effects),
            Self::Twins(fit, ..) => Some(&fit.hypothesis.effects),
            _ => None,
        }
    }

    /// The fits that it leads to.
    pub fn fitted(&self, context: &FitContext<'a>) -> Vec<Refit<'a>> {
        match self {
            Self::Beside(beside) => beside.fitted(context).into_iter().collect(),
            Self::Scored(base, score) => {
                let fit = context.refit(&score.hypothesis(&base.hypothesis), base, &score.start);
                fit.map(|fit| laws::settled(context, fit)).into_iter().collect()
            }
            Self::Begun(base, score) => {
                context.begin(&score.hypothesis(&base.hypothesis), base, &score.start).into_iter().collect()
            }
            Self::ReplaceDampers(base) => replace_dampers(context, base).into_iter().collect(),
            Self::ManyStarts(base, effect) => law_of(*effect).fit_from_many_starts(context, base).into_iter().collect(),
            Self::FromLeader { fit, hypothesis, leader } => {
                from_leader(context, fit, hypothesis, leader).into_iter().collect()
            }
            Self::Restart(fit) => restarted(context, fit).into_iter().collect(),
            Self::Along(hypothesis, leader, bound) => {
                context.refit_along_fit(hypothesis, leader, *bound).into_iter().collect()
            }
            Self::Asked(asked, base) => {
                context.refit_along_recording(&asked.hypothesis, base, &asked.start).into_iter().collect()
            }
            Self::Nested(hypothesis, within) => context.refit(hypothesis, within, &[]).into_iter().collect(),
            Self::FromTheBeginning(hypothesis, base) => {
                let begun = Refit { hypothesis: hypothesis.clone(), ..(*base).clone() };
                horizon::continue_one(context, &begun).into_iter().collect()
            }
            Self::Exchange(fit, effect, others) => instead(context, fit, *effect, others),
            Self::Twins(fit, effect, others) => twins(context, fit, *effect, others),
            Self::ByShooting(hypothesis, without) => {
                let anew = context.refit_by_shooting(hypothesis, &[], without);
                let ended = |fit: Refit<'a>| match fit.converged || hypothesis.is_expensive() {
                    true => Some(fit),
                    false => context.go_on(&fit, context.settings.descent.most_steps),
                };
                anew.and_then(ended).into_iter().collect()
            }
            Self::Continued(fits, effects) => horizon::continued(context, fits, effects),
        }
    }
}

/// The hypotheses of which each effect was held against every other.
pub fn exchanged(proposals: &[Proposal<'_, '_>]) -> Vec<Vec<Effect>> {
    let sets: Vec<&[Effect]> = proposals.iter().filter_map(Proposal::exchanges).collect();
    let of = |set: &[Effect]| sets.iter().filter(|other| **other == set).count();
    let mut whole: Vec<Vec<Effect>> = sets.iter().filter(|set| of(set) == set.len()).map(|set| set.to_vec()).collect();
    whole.dedup();
    whole
}

/// A fit of two losses that take half of the energy each that the base model's dampers took.
fn replace_dampers<'a>(context: &FitContext<'a>, base: &Refit<'a>) -> Option<Refit<'a>> {
    let hypothesis =
        DAMPER_IMITATION.iter().fold(base.hypothesis.clone(), |hypothesis, effect| hypothesis.and(*effect, None));
    let dampers: Vec<(Parameter, f64)> = Effect::losses()
        .into_iter()
        .filter_map(|(parameter, _)| Some((parameter, base.value(parameter)?)))
        .filter(|(_, value)| *value > 0.0)
        .collect();
    let of = |parameter: Parameter| work_of_unit_j(base, parameter);
    let taken_j: f64 = dampers.iter().map(|(parameter, value)| value * of(*parameter)).sum();
    let new = DAMPER_IMITATION
        .map(|effect| effect.parameters()[0])
        .map(|parameter| (parameter, 0.5 * taken_j / of(parameter)));
    let less = dampers.iter().map(|(parameter, value)| (*parameter, LEFT_OF_DAMPERS * value));
    let start: Vec<(Parameter, f64)> = new.into_iter().chain(less).collect();
    start.iter().all(|(_, value)| value.is_finite() && *value > 0.0).then_some(())?;
    context.refit(&hypothesis, base, &start)
}

/// A fit anew from where another one is, with its own coefficients, if that is a better place to begin from than where it ended.
fn from_leader<'a>(
    context: &FitContext<'a>,
    fit: &Refit<'a>,
    hypothesis: &Hypothesis,
    leader: &Refit<'a>,
) -> Option<Refit<'a>> {
    let added = fit.added();
    let own: Vec<(Parameter, f64)> =
        added.iter().filter(|p| leader.value(**p).is_none()).filter_map(|p| Some((*p, fit.value(*p)?))).collect();
    if !(context.cost_at(hypothesis, leader, &own) < fit.chi2) {
        return None;
    }
    context.refit(hypothesis, leader, &own).filter(|again| again.chi2 < fit.chi2 - BETTER_BY)
}

fn restarted<'a>(context: &FitContext<'a>, fit: &Refit<'a>) -> Option<Refit<'a>> {
    let early = first_parts(context)?;
    let x = context.on(&early).refit(&fit.hypothesis, fit, &[])?.x;
    let again = context.descend_from(&fit.hypothesis, &fit.problem.noise, x, context.settings.descent.most_steps)?;
    // it has begun where that fit is
    let certificate = Certificate { starts_agreeing: 0, ..again.certificate };
    Some(Refit { certificate, ..again })
}

/// The first part of each recording: half of it, or as much of it as still swings.
fn first_parts(context: &FitContext<'_>) -> Option<Vec<Record>> {
    let early: Vec<Record> = context.records.iter().map(|r| r.until(swinging_rows(context, r))).collect();
    early.iter().all(|record| record.len() >= crate::series::FEWEST_ROWS).then_some(early)
}

/// Whether the swing has died away long before a recording ends.
pub fn comes_to_rest(context: &FitContext<'_>, record: &Record) -> bool {
    swinging_rows(context, record) + 1 < (context.settings.search.first_part * record.len() as f64) as usize
}

fn swinging_rows(context: &FitContext<'_>, record: &Record) -> usize {
    let settings = &context.settings.search;
    let still = settings.still * record.largest_angle_rad();
    let swings =
        |row: usize| record.theta_rad.iter().any(|angles| angles[row].is_some_and(|angle| angle.abs() > still));
    let last = (0..record.len()).rev().find(|row| swings(*row)).unwrap_or(0);
    last.min((settings.first_part * record.len() as f64) as usize)
}

/// A fit without one of its effects, and with another one of some in its place.
fn instead<'a>(context: &FitContext<'a>, fit: &Refit<'a>, effect: Effect, others: &[Effect]) -> Vec<Refit<'a>> {
    let Some(fewer) = without(context, fit, effect) else { return Vec::new() };
    let mut found = if others.is_empty() { Vec::new() } else { in_its_place(context, fit, &fewer, others) };
    found.push(fewer);
    found
}

/// A fit with another effect in the place of one, of each that would leave so little more that it counts: from its own motion, for from that without the effect a
/// promise is worth little. And the same without each of the names that stay: what these add is known then.
fn twins<'a>(context: &FitContext<'a>, fit: &Refit<'a>, effect: Effect, others: &[Effect]) -> Vec<Refit<'a>> {
    let fewer = fit.hypothesis.without(effect);
    let fitted = |score: Score| {
        let twin = context.refit(&score.hypothesis(&fewer), fit, &score.start)?;
        let without = |name: &Effect| context.refit(&twin.hypothesis.without(*name), &twin, &[]);
        let simpler: Vec<Refit<'a>> = fewer.effects.iter().filter_map(without).collect();
        Some(simpler.into_iter().chain([twin]))
    };
    let scores = laws::twin_scores(context, fit, effect, others).unwrap_or_default();
    scores.into_iter().filter_map(fitted).flatten().collect()
}

/// A fit without one of its effects, from where it is or from the beginning.
fn without<'a>(context: &FitContext<'a>, fit: &Refit<'a>, effect: Effect) -> Option<Refit<'a>> {
    let fewer = Refit { hypothesis: fit.hypothesis.without(effect), ..fit.clone() };
    let near = context.refit(&fewer.hypothesis, &fewer, &[]);
    // pieces are too short to fall out of step
    let continued = (!context.is_in_pieces()).then(|| horizon::continue_one(context, &fewer)).flatten();
    let best = near.into_iter().chain(continued).min_by(|a, b| a.chi2.total_cmp(&b.chi2))?;
    let is_expensive = context.is_in_pieces() && best.hypothesis.has_switching();
    if best.converged || is_expensive { Some(best) } else { context.go_on(&best, context.settings.descent.most_steps) }
}

/// A fit with fewer effects and another one instead, where that promises most of what the one left out would from there.
fn in_its_place<'a>(
    context: &FitContext<'a>,
    fit: &Refit<'a>,
    fewer: &Refit<'a>,
    effects: &[Effect],
) -> Vec<Refit<'a>> {
    let cheap: Vec<Effect> =
        effects.iter().copied().filter(|own| !context.is_in_pieces() || !own.has_switching()).collect();
    let scores = Screen::at(context, fewer).map(|screen| laws::scores(&screen, &cheap)).unwrap_or_default();
    let (own, others): (Vec<Score>, Vec<Score>) =
        scores.into_iter().partition(|score| fit.hypothesis.has(score.effect));
    let promised = own.iter().map(|score| score.gain).fold(0.0, f64::max);
    let other = |score: Score| context.refit(&score.hypothesis(&fewer.hypothesis), fewer, &score.start);
    let most_of = context.settings.search.most_of;
    others.into_iter().filter(|score| score.gain > most_of * promised).filter_map(other).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::base_priors::DampingAssumption;
    use crate::diagnose::search::Search;
    use crate::diagnose::testing::{arm, swing};
    use crate::diagnose::{Settings, preparation};
    use crate::progress::Silent;

    #[test]
    fn what_does_as_well_in_the_place_of_an_effect_is_fitted_and_nothing_else() {
        let (t_s, theta_rad) =
            swing(&arm("hinge_viscous = 2e-5\nhinge_coulomb = 2e-4\nside_force = 3e-3\n"), 15.0, 30.0);
        let angles = theta_rad.iter().enumerate().map(|(k, theta)| Some(theta + 1e-3 * (1.7 * (k * k) as f64).sin()));
        let record = Record::uniform("made", t_s, vec![angles.collect()]);
        let settings = Settings::default();
        let stated = arm("hinge_viscous = 2e-5\n");
        let prepared = preparation::prepare(&[record], &stated, &settings).unwrap();
        let taken = DampingAssumption::AsStated;
        let search = Search::of_base_model(&prepared, &stated, taken, &settings, &Silent).unwrap();
        let pair = Hypothesis::default().and(Effect::HingeCoulomb, None).and(Effect::SideForce, None);
        let start = [(Parameter::HingeCoulomb, 2e-4), (Parameter::SideForce, 3e-3)];
        let fit = search.context.refit(&pair, search.base(), &start).unwrap();
        assert!(fit.chi2 < 550.0, "{}", fit.chi2);
        let others = vec![Effect::CameraTilt, Effect::AirQuadratic, Effect::AngleGain, Effect::TimeBase];
        let in_place_of = |effect| Proposal::Twins(&fit, effect, others.clone()).fitted(&search.context);
        // a constant side force leans the arm as a tilted camera does
        let of_force = in_place_of(Effect::SideForce);
        let sets: Vec<&[Effect]> = of_force.iter().map(|twin| &twin.hypothesis.effects[..]).collect();
        assert_eq!(sets, [&[Effect::CameraTilt][..], &[Effect::CameraTilt, Effect::HingeCoulomb]]);
        assert!((of_force[1].chi2 - fit.chi2).abs() < 5.0, "{} beside {}", of_force[1].chi2, fit.chi2);
        assert!(of_force[0].chi2 > fit.chi2 + 30.0, "{} without friction", of_force[0].chi2);
        // friction of the hinge brakes as nothing else does
        assert!(in_place_of(Effect::HingeCoulomb).is_empty());
    }
}
