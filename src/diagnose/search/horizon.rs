//! Horizon continuation: fits of growing first parts of the recordings, each begun where the last one ended, where the best leave far more than noise.
//!
//! The sum of squares of a long recording has many false minima, that of its beginning few. Where each part leads is where the next begins, so that no
//! motion has to lose step. What two effects leave there may be a third one's: a real rig has several.

use rayon::prelude::*;

use super::super::context::{FitContext, first_part};
use super::super::effect::Effect;
use super::super::hypothesis::Hypothesis;
use super::super::misfit::needs;
use super::super::refit::{self, Refit, best_of_each_count, least, merged};
use super::super::settings::{MisfitSettings, SearchSettings};
use super::one_more::with_one_more;
use crate::fit::recordings;
use crate::fit::search::PARTS;
use crate::fit::whitening::RecordNoise;
use crate::model::Parameter;

/// A part that is less than this many times as long as the one before is left out.
const MUCH_LONGER: f64 = 1.5;

/// The hypotheses of some fits from the beginning of the recordings on, those of each number of coefficients that keep up with the best; and beside the best
/// of each part other effects.
pub fn continued<'a>(context: &FitContext<'a>, fits: &[Refit<'a>], effects: &[Effect]) -> Vec<Refit<'a>> {
    let Some(noise) = fits.first().map(|fit| fit.problem.noise.clone()) else { return Vec::new() };
    let (settings, steps) = (&context.settings.search, &context.settings.descent);
    let most = settings.most_coefficients;
    let mut followed: Vec<(Hypothesis, Vec<f64>)> = Vec::new();
    for part in PARTS.into_iter().filter(|part| part * swings(fits) > settings.fewest_swings) {
        let records = first_part(context.records, part);
        let early = context.on(&records);
        let there: Vec<Refit<'_>> = if followed.is_empty() {
            let chosen = best_and_base(fits, settings.begun, Refit::relative_residual);
            let begun = |place: &usize| refit_on_first_part(context, &early, &fits[*place]);
            chosen.par_iter().with_max_len(1).filter_map(begun).collect()
        } else {
            descended(&early, &noise, followed, steps.few_steps)
        };
        let more: Vec<Refit<'_>> = best_of_each_count(&there, most)
            .into_iter()
            .flat_map(|best| with_one_more(&early, best, effects))
            .collect();
        let merged = merged(there, more, context.settings.certificate.agrees);
        followed = to_follow(foremost(in_step(merged, &context.settings.misfit), settings));
        if followed.is_empty() {
            return Vec::new();
        }
    }
    descended(context, &noise, followed, steps.most_steps)
}

/// The best of some fits of the first part of the recordings, followed to their end; part after part those that would lose step.
pub fn carried<'a>(context: &FitContext<'a>, fits: Vec<Refit<'_>>, part: f64, noise: &[RecordNoise]) -> Vec<Refit<'a>> {
    let (settings, steps) = (&context.settings.search, &context.settings.descent);
    // of a longer part each step costs more; what an effect has not earned does not come before the fit without it
    let few = |fits: Vec<Refit<'_>>| {
        let Some(least) = least(&fits) else { return Vec::new() };
        let is_near = |fit: &Refit<'_>| fit.chi2 < settings.far * least.chi2;
        // a support has three numbers to bend to a part, of which the whole leaves nothing
        let counts = context.settings.misfit.counts;
        let cost = |fit: &Refit<'_>| fit.chi2 / least.variance_ratio() + counts * fit.coefficients() as f64;
        let chosen = refit::best(&fits, settings.carried, is_near, cost);
        chosen.into_iter().map(|place| (fits[place].hypothesis.clone(), fits[place].x.clone())).collect()
    };
    let keeps_step = |(hypothesis, x): &(Hypothesis, Vec<f64>)| {
        let there = context.descend_from(hypothesis, noise, x.clone(), 0);
        there.is_some_and(|fit| !fit.has_lost_step(&context.settings.misfit))
    };
    let (mut at_the_end, mut followed): (Vec<_>, Vec<_>) =
        few(foremost(fits, settings)).into_iter().partition(keeps_step);
    for longer in PARTS.into_iter().filter(|longer| *longer > MUCH_LONGER * part) {
        let records = first_part(context.records, longer);
        let there = descended(&context.on(&records), noise, followed, steps.few_steps);
        followed = few(foremost(in_step(there, &context.settings.misfit), settings));
    }
    at_the_end.extend(followed);
    // those that are worth it go on once the noise is known
    descended(context, noise, at_the_end, steps.few_steps)
}

/// The best fits of pieces of the recordings, and the base model's, on whole ones: from where the first piece of each begins, and where that loses step, with the
/// recording as it grows.
pub fn whole<'a>(context: &FitContext<'a>, of_pieces: &[Refit<'a>], noise: &[RecordNoise]) -> Vec<Refit<'a>> {
    let (settings, few) = (context.settings, context.settings.descent.few_steps);
    let Some(least) = least(of_pieces) else { return Vec::new() };
    let chosen = best_and_base(of_pieces, settings.search.followed, |fit| needs(fit, least, &settings.misfit));
    let on_whole = |place: &usize| {
        let (fit, problem) = (&of_pieces[*place], &of_pieces[*place].problem);
        let recordings = recordings(problem.records);
        let starts = recordings.iter().flat_map(|pieces| problem.start(&fit.x, pieces.start));
        let x = fit.x[..problem.free.len()].iter().chain(starts).copied().collect();
        let of_recording = |(piece, at_s)| Some((recordings.iter().position(|own| own.contains(&piece))?, at_s));
        let hypothesis =
            Hypothesis { dropped: fit.hypothesis.dropped.and_then(of_recording), ..fit.hypothesis.clone() };
        let whole = context.descend_from(&hypothesis, noise, x, few)?;
        let grown = whole.has_lost_step(&settings.misfit).then(|| continue_one(context, &whole)).flatten();
        grown.into_iter().chain([whole]).min_by(|a, b| a.chi2.total_cmp(&b.chi2))
    };
    chosen.par_iter().with_max_len(1).filter_map(on_whole).collect()
}

/// The fits that leave least, and the base model's, in their order.
fn best_and_base<'a>(fits: &[Refit<'a>], count: usize, left: impl Fn(&Refit<'a>) -> f64) -> Vec<usize> {
    let mut chosen = refit::best(fits, count, |_| true, left);
    chosen.extend((0..fits.len()).filter(|place| fits[*place].hypothesis.effects.is_empty()));
    chosen.sort_unstable();
    chosen.dedup();
    chosen
}

/// Those that have not lost step: what has does not find it again in a longer part.
fn in_step<'b>(mut fits: Vec<Refit<'b>>, settings: &MisfitSettings) -> Vec<Refit<'b>> {
    fits.retain(|fit| !fit.has_lost_step(settings));
    fits
}

fn to_follow(fits: Vec<Refit<'_>>) -> Vec<(Hypothesis, Vec<f64>)> {
    fits.into_iter().map(|fit| (fit.hypothesis, fit.x)).collect()
}

/// A hypothesis by itself from the beginning of the recordings on.
pub fn continue_one<'a>(context: &FitContext<'a>, fit: &Refit<'a>) -> Option<Refit<'a>> {
    continued(context, std::slice::from_ref(fit), &[]).pop()
}

/// How often the longest recording swings.
pub fn swings(fits: &[Refit<'_>]) -> f64 {
    let of = |fit: &Refit<'_>| {
        let (model, _) = fit.problem.model(0, &[]).ok()?;
        Some(fit.problem.longest_s() * model.characteristic_rad_s() / std::f64::consts::TAU)
    };
    fits.first().and_then(of).unwrap_or(0.0)
}

/// The best of each number of coefficients: what is free to move a support anywhere must not displace a law.
fn foremost<'b>(fits: Vec<Refit<'b>>, settings: &SearchSettings) -> Vec<Refit<'b>> {
    let of_count = |count: usize| {
        let mut best = refit::best(&fits, settings.followed, |fit| fit.coefficients() == count, |fit| fit.chi2);
        let most = settings.keeps_up * best.first().map_or(0.0, |place| fits[*place].relative_residual());
        best.retain(|place| fits[*place].relative_residual() <= most);
        best
    };
    let kept: Vec<usize> = (0..=settings.most_coefficients).flat_map(of_count).collect();
    fits.into_iter().enumerate().filter(|(place, _)| kept.contains(place)).map(|(_, fit)| fit).collect()
}

fn descended<'b>(
    context: &FitContext<'b>,
    noise: &[RecordNoise],
    from: Vec<(Hypothesis, Vec<f64>)>,
    most_steps: usize,
) -> Vec<Refit<'b>> {
    let descend = |(hypothesis, x)| context.descend_from(&hypothesis, noise, x, most_steps);
    from.into_par_iter().with_max_len(1).filter_map(descend).collect()
}

/// A fit's hypothesis on the beginning, from its own parameters or from those that short stretches led to, whichever leads further.
pub fn refit_on_first_part<'b>(context: &FitContext<'_>, early: &FitContext<'b>, fit: &Refit<'_>) -> Option<Refit<'b>> {
    let fit = context.with_observed_starts(fit);
    let stretches: Vec<(Parameter, f64)> = context.base.iter().copied().zip(context.begun.iter().copied()).collect();
    let from = |start: &[(Parameter, f64)]| early.begin(&fit.hypothesis, &fit, start);
    let begun = [from(&[]), from(&stretches)].into_iter().flatten().collect();
    let steps = &context.settings.descent;
    early.best_gone_on(begun, steps.few_steps - steps.first_steps, |_| true)
}
