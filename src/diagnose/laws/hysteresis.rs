//! The joint's hysteresis needs starts of its own, beside variables of its own ([`crate::fit::transformed`]).

use rayon::prelude::*;

use super::super::context::{FitContext, first_part};
use super::super::effect::Effect;
use super::super::refit::Refit;
use super::super::screen::{Score, Screen};
use super::super::settings::PriorSettings;
use super::{Coefficients, FitRequest, Law};
use crate::model::Parameter;

/// Yield angles at which it is scored, as parts of the bend that every joint reaches (start values).
const SCORED: [f64; 3] = [0.03, 0.15, 0.6];
/// Starts: yield angles as parts of the bend that every joint reaches, and the hysteresis' part of the spring (start values).
const YIELD_SHARES: [f64; 3] = [0.05, 0.2, 0.6];
const SPRING_SHARES: [f64; 2] = [0.4, 0.9];
/// The same where everything else has failed, and how much stiffer the joint may then be (start values); how many of them begin a descent, and how many end it
/// (cost).
const EVERY_YIELD: [f64; 5] = [0.03, 0.1, 0.25, 0.5, 0.9];
const EVERY_SHARE: [f64; 4] = [0.1, 0.4, 0.7, 0.95];
const STIFFER: [f64; 3] = [1.0, 2.0, 8.0];
const BEGUN: usize = 12;
const ENDED: usize = 3;
/// Parts of the recordings that are followed before the whole is (numerics: of so short a beginning false minima are few).
const PARTS: [f64; 2] = [0.15, 0.5];

/// The law.
pub struct Hysteresis;

impl Law for Hysteresis {
    /// From every start that may lead to its minimum: where the scores point, as a part of the spring where there is something to explain, and from short
    /// stretches, which do not know what the base model has given up, where nothing else explains it.
    fn beside<'a>(&self, sought: &FitRequest<'_, 'a>) -> Option<Refit<'a>> {
        let FitRequest { context, base, effect, score, misfit } = *sought;
        let hypothesis = base.hypothesis.and(effect, None);
        let near = || score.and_then(|score| where_scored(context, base, score, misfit.leads));
        let softened = || (misfit.unexplained || misfit.seen).then(|| softened(context, base, misfit.leads)).flatten();
        // in every joint of a strip, and from no memory in each stretch, it is too dear
        let is_worth_it = misfit.unexplained_by_any && !context.is_strip();
        let anew = || is_worth_it.then(|| context.refit_by_shooting(&hypothesis, &[], base)).flatten();
        let (near, (softened, anew)) = rayon::join(near, || rayon::join(softened, anew));
        context.best_of([near, softened, anew])
    }

    fn fit_from_many_starts<'a>(&self, context: &FitContext<'a>, base: &Refit<'a>) -> Option<Refit<'a>> {
        fit_from_many_starts(context, base)
    }

    /// The best of several yield angles, then the others.
    fn scan(&self, screen: &Screen<'_, '_>) -> Option<Score> {
        let context = screen.context;
        let yields_rad = if context.has_spring() {
            SCORED.map(|share| share * context.common_bend_rad()).to_vec()
        } else {
            vec![context.yield_rad().0]
        };
        let of_yield = |yield_rad: &f64| {
            let mut score = screen.of_coefficients(&[Effect::JointHysteretic], Some(*yield_rad))?.pop()?;
            score.start.push((Parameter::HysteresisYield, *yield_rad));
            Some(score)
        };
        let mut scores: Vec<Score> = yields_rad.par_iter().with_max_len(1).filter_map(of_yield).collect();
        scores.sort_by(|a, b| b.gain.total_cmp(&a.gain));
        let further = scores.iter().skip(1).filter(|score| score.gain > 0.0).map(|score| score.start.clone()).collect();
        Some(Score { further, ..scores.into_iter().next()? })
    }

    /// Any yield angle that the recording does not tell from its own.
    fn ln_multiplicity(
        &self,
        _fit: &Refit<'_>,
        _effect: Effect,
        of: &Coefficients<'_>,
        settings: &PriorSettings,
    ) -> f64 {
        let (yield_rad, sd) = of(Parameter::HysteresisYield);
        (yield_rad * settings.yields).ln().max(sd.ln())
    }
}

/// The hysteresis as large as a score says it is, the spring being softer by what it adds before it yields: from that of several yield angles whose first steps
/// lead lowest, if that is below `bound`. From no hysteresis at all no descent finds the way: the spring must follow it to a thousandth of itself, or the second mode falls out of step.
fn where_scored<'a>(context: &FitContext<'a>, base: &Refit<'a>, score: &Score, bound: f64) -> Option<Refit<'a>> {
    let hypothesis = base.hypothesis.and(Effect::JointHysteretic, None);
    let spring = base.problem.free.iter().copied().find(|parameter| parameter.is_spring());
    let steps = &context.settings.descent;
    let with_softer_spring = |start: &Vec<(Parameter, f64)>| {
        let of = |parameter| start.iter().find(|(own, _)| *own == parameter).map(|(_, value)| *value);
        let added = of(Parameter::HysteresisTorque)? / of(Parameter::HysteresisYield)?;
        let whole = spring_stiffness(base)?;
        let share = (added / whole).min(SPRING_SHARES[1]);
        let mut start = start.clone();
        start.push((spring?, (1.0 - share) * base.value(spring?)?));
        Some(start)
    };
    let starts: Vec<_> = std::iter::once(&score.start).chain(&score.further).filter_map(with_softer_spring).collect();
    if starts.is_empty() {
        return context.refit_below(bound, &hypothesis, base, &score.start);
    }
    // each may cost far more than none at first, and lead below
    let begun = starts.par_iter().with_max_len(1).filter_map(|start| context.begin(&hypothesis, base, start));
    let best = begun.min_by(|a, b| a.chi2.total_cmp(&b.chi2))?;
    if best.chi2 < bound && !best.converged { context.go_on(&best, steps.few_steps) } else { Some(best) }
}

/// Stiffness of a fit's joint.
fn spring_stiffness(fit: &Refit<'_>) -> Option<f64> {
    fit.problem.model(0, &fit.x[..fit.problem.free.len()]).ok()?.0.value(Parameter::JointStiffness)
}

/// The hysteresis where it makes up a part of what the base model takes for the spring: from the best of several such starts, if that leads below `bound`.
fn softened<'a>(context: &FitContext<'a>, null: &Refit<'a>, bound: f64) -> Option<Refit<'a>> {
    let hypothesis = null.hypothesis.and(Effect::JointHysteretic, None);
    let starts = starts(context, null, &YIELD_SHARES, &SPRING_SHARES, &[1.0])?;
    let costed = starts.into_iter().map(|start| (context.cost_at(&hypothesis, null, &start), start));
    let (cost, best) = costed.min_by(|a, b| a.0.total_cmp(&b.0))?;
    if context.is_strip() {
        // in every joint of it: a step is as dear as ten of another effect's
        let is_hopeful = cost < context.settings.descent.hopeless_ratio * null.chi2;
        return is_hopeful.then(|| context.begin(&hypothesis, null, &best)).flatten();
    }
    context.refit_below(bound, &hypothesis, null, &best)
}

/// Where a hysteresis beside a fit may start: with these yield angles, as parts of the bend that every joint reaches, as these parts of the spring, the spring being as many times
/// as stiff before it yields as that fit has it.
fn starts(
    context: &FitContext<'_>,
    fit: &Refit<'_>,
    yield_shares: &[f64],
    spring_shares: &[f64],
    stiffer: &[f64],
) -> Option<Vec<Vec<(Parameter, f64)>>> {
    let spring = fit.problem.free.iter().copied().find(|parameter| parameter.is_spring())?;
    let stiffness = spring_stiffness(fit)?;
    // a base model that has locked its joint is no guide to the damper
    let damping = fit.value(Parameter::JointDamping).unwrap_or(0.0).min(context.experiment.model.c_eq_n_m_s_per_rad);
    let mut starts = Vec::new();
    for yield_rad in yield_shares.iter().map(|share| share * context.common_bend_rad()) {
        for (share, scale) in spring_shares.iter().flat_map(|share| stiffer.iter().map(move |scale| (share, scale))) {
            starts.push(vec![
                (spring, (1.0 - share) * scale * fit.value(spring).unwrap_or(0.0)),
                // what it loses the base model took for the damper's
                (Parameter::JointDamping, (1.0 - share) * damping),
                (Parameter::HysteresisTorque, share * scale * stiffness * yield_rad),
                (Parameter::HysteresisYield, yield_rad),
            ]);
        }
    }
    Some(starts)
}

/// The hysteresis beside a fit from wherever it may be: its sum of squares has many false minima, of a whole recording far more than of its beginning.
fn fit_from_many_starts<'a>(context: &FitContext<'a>, fit: &Refit<'a>) -> Option<Refit<'a>> {
    let hypothesis = fit.hypothesis.and(Effect::JointHysteretic, None);
    let starts = starts(context, fit, &EVERY_YIELD, &EVERY_SHARE, &STIFFER)?;
    let fit = &context.with_observed_starts(fit);
    let (settings, noise) = (&context.settings.descent, &fit.problem.noise);
    let [beginning, first_half] = PARTS.map(|part| first_part(context.records, part));
    let (beginning, first_half) = (context.on(&beginning), context.on(&first_half));
    let cost = |start: Vec<(Parameter, f64)>| (beginning.cost_at(&hypothesis, fit, &start), start);
    let mut costed: Vec<_> = starts.into_par_iter().with_max_len(1).map(cost).collect();
    costed.sort_by(|a, b| a.0.total_cmp(&b.0));
    costed.truncate(BEGUN);
    let begun = costed.par_iter().with_max_len(1).filter_map(|(_, start)| {
        let begun = beginning.begin(&hypothesis, fit, start)?;
        beginning.go_on(&begun, settings.few_steps)
    });
    let mut begun: Vec<(f64, Vec<f64>)> = begun.map(|begun| (begun.chi2, begun.x)).collect();
    begun.sort_by(|a, b| a.0.total_cmp(&b.0));
    begun.truncate(ENDED);
    let ended = begun.into_par_iter().with_max_len(1).filter_map(|(_, x)| {
        let half = first_half.descend_from(&hypothesis, noise, x, settings.few_steps)?;
        context.descend_from(&hypothesis, noise, half.x, settings.most_steps)
    });
    ended.min_by(|a, b| a.chi2.total_cmp(&b.chi2))
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::diagnose::base_priors::DampingAssumption;
    use crate::diagnose::misfit::Misfit;
    use crate::diagnose::preparation;
    use crate::diagnose::search::Search;
    use crate::diagnose::settings::Settings;
    use crate::experiment::Experiment;
    use crate::fit::Record;
    use crate::model::{ForwardModel, State, Trajectory};
    use crate::progress::Silent;

    #[test]
    fn one_that_makes_up_a_thousandth_of_the_spring_is_found_from_its_score() {
        let links = "[specimen]\nmass_kg = 1.1e-3\nlength_m = 0.24\nlink_lengths_m = [0.12, 0.12]\nwidth_m = 0.028\ninertia = \"rods\"\n\
                     [model]\nk_eq_n_m_per_rad = 1.2e-3\nc_eq_n_m_s_per_rad = 7.5e-8\nrelease_rad = [-0.57, -0.43]\n";
        let effect = "[model.effects]\njoint_hysteretic = { torque_n_m = 6e-8, yield_rad = 0.05 }\n";
        let parsed = |text: &str| Experiment::parse(text, Path::new("links")).unwrap();
        let model = ForwardModel::of(&parsed(&format!("{links}{effect}"))).unwrap();
        let release = State::released(&model, &[-0.57, -0.43]).unwrap();
        let swing = Trajectory::swing(&model, &release, 0.0, 15.0).unwrap();
        let t_s: Vec<f64> = (0..900).map(|row| f64::from(row) / 60.0).collect();
        // as good as random, of 0.2 mrad
        let noise = |row: usize, link: usize| 3e-4 * ((row * row * 7 + link * 31 + row * 13) as f64).sin();
        let angles = |link: usize| {
            let rows = t_s.iter().enumerate();
            rows.map(|(row, t)| Some(swing.at(*t).theta_rad[link] + noise(row, link))).collect::<Vec<_>>()
        };
        let record = Record::uniform("made", t_s.clone(), vec![angles(0), angles(1)]);
        let (settings, experiment) = (Settings::default(), parsed(links));
        let prepared = preparation::prepare(&[record], &experiment, &settings).unwrap();
        let taken = DampingAssumption::AsStated;
        let search = Search::of_base_model(&prepared, &prepared.experiment, taken, &settings, &Silent).unwrap();
        let (context, base) = (&search.context, search.base());
        let score = Hysteresis.scan(&Screen::at(context, base).unwrap()).unwrap();
        let fit = where_scored(context, base, &score, f64::INFINITY).unwrap();
        let torque_n_m = fit.value(Parameter::HysteresisTorque).unwrap();
        assert!(
            fit.chi2 < base.chi2 - 30.0 && (torque_n_m / 6e-8 - 1.0).abs() < 0.3,
            "{} {} {torque_n_m}",
            base.chi2,
            fit.chi2
        );
        // from none at all a descent finds next to nothing of it
        let from_none = context.refit(&fit.hypothesis, base, &score.start).unwrap();
        assert!(from_none.chi2 > fit.chi2 + 10.0, "{} {}", from_none.chi2, fit.chi2);
        let misfit = Misfit::of(context, base, std::slice::from_ref(&score));
        let sought = FitRequest { context, base, effect: Effect::JointHysteretic, score: Some(&score), misfit };
        assert!(Hysteresis.beside(&sought).unwrap().chi2 < fit.chi2 + 1.0);
    }
}
