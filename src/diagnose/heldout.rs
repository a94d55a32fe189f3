//! The hold-out test: one part is fitted, the other predicted with all coefficients as they are.

use rayon::prelude::*;

use super::context::{FitContext, without_synchronous_errors};
use super::effect::Effect;
use super::hypothesis::Hypothesis;
use super::misfit::{is_beyond_noise, leaves_more_than_noise};
use super::posterior::{Candidate, Posterior, weigh};
use super::refit::Refit;
use super::search::horizon::continue_one;
use crate::experiment::Law;
use crate::fit::whitening::RecordNoise;
use crate::fit::{Belief, Problem, Record, Residuals, recordings, residuals_of};
use crate::model::Parameter;

/// A frozen coefficient may move by this part of itself.
const FROZEN: f64 = 1e-9;

/// What was not fitted, predicted.
#[derive(Debug, Clone, PartialEq)]
pub struct HeldOut {
    /// The recording that was predicted.
    pub record: usize,
    /// From which stamp on it was not fitted.
    pub from_s: f64,
    /// By the base model.
    pub baseline: Prediction,
    /// By the model with the effects named.
    pub augmented: Prediction,
}

/// What one model leaves of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Prediction {
    /// Root mean square error of each angle, of what was not fitted.
    pub rmse_rad: Vec<f64>,
    /// What is left of the whole recording, where a part of it was fitted.
    pub left: Option<Residuals>,
    /// By how many standard deviations what was fitted told the amplitude of each law of the file from zero, its other coefficients being what they are: of a
    /// narrow law only amplitude times width is known.
    pub told: Vec<f64>,
}

/// What the base model leaves beyond the noise of what was not fitted tells what others explain where it is so many variances (judgement: twice the noise in all).
const MUCH_BEYOND_NOISE: f64 = 3.0;

impl HeldOut {
    /// What the names leave, as a part of what the base model leaves.
    pub fn leaves(&self) -> f64 {
        self.augmented.over(&self.baseline)
    }

    /// The part of the squares that the base model leaves beyond the noise (rad) of which the names, or another description, leave nothing; all of it where that is too little to
    /// be told from the noise's own scatter.
    pub fn explained(&self, other: Option<&Prediction>, noise_rad: &[f64]) -> f64 {
        let noise = squares(noise_rad);
        let beyond = |of: &Prediction| (squares(&of.rmse_rad) - noise).max(0.0);
        let left = other.into_iter().chain([&self.augmented]).map(beyond).fold(f64::INFINITY, f64::min);
        let base = beyond(&self.baseline);
        if base > MUCH_BEYOND_NOISE * noise { (1.0 - left / base).max(0.0) } else { 1.0 }
    }

    /// Whether the names leave so much beyond the noise (rad) of what was not fitted that it tells which description does better.
    pub fn tells(&self, noise_rad: &[f64]) -> bool {
        squares(&self.augmented.rmse_rad) > (1.0 + MUCH_BEYOND_NOISE) * squares(noise_rad)
    }
}

impl Prediction {
    /// Of nothing yet, from what was fitted.
    fn from(fitted: &Refit<'_>, laws: &[Law]) -> Self {
        let variance = fitted.variance_ratio();
        let deviations = |law: &Law| {
            let coefficients: Vec<Parameter> = law.coefficients().map(|(parameter, _)| parameter).collect();
            let precision = fitted.covariance(&coefficients).try_inverse()?;
            Some(fitted.value(*coefficients.first()?)?.abs() * (precision.get((0, 0))? / variance).sqrt())
        };
        Self { rmse_rad: Vec::new(), left: None, told: laws.iter().map(|law| deviations(law).unwrap_or(0.0)).collect() }
    }

    /// What it leaves, as a part of what another one does: root mean squares of all angles.
    pub fn over(&self, other: &Self) -> f64 {
        (squares(&self.rmse_rad) / squares(&other.rmse_rad).max(1e-300)).sqrt()
    }

    /// What its errors add to the length of a description that makes it: 2 Σ ln e over the angles ([`super::learnt`]).
    pub fn length(&self) -> f64 {
        2.0 * self.rmse_rad.iter().map(|error| error.max(f64::MIN_POSITIVE).ln()).sum::<f64>()
    }
}

fn squares(values: &[f64]) -> f64 {
    values.iter().map(|value| value * value).sum()
}

/// The posterior and its proof; where the model's own error is far above the noise, of those sets of effects that also predict what was not fitted: what was fitted
/// always falls with one more effect, and there a set that fits a tenth better may predict six times worse. Of each number of effects the likeliest sets are asked,
/// and one more effect must predict much better than fewer do.
pub fn borne_out<'a>(
    context: &FitContext<'a>,
    posterior: Posterior<'a>,
    fits: Vec<Refit<'a>>,
    effects: usize,
    from_s: Option<f64>,
) -> (Posterior<'a>, Option<HeldOut>) {
    let (verdict, best) = (&context.settings.verdict, posterior.best());
    if !is_beyond_noise(best, &context.settings.noise) {
        let proof = held_out(context, posterior.base(), &[best], from_s).into_iter().next().flatten();
        return (posterior, proof);
    }
    let asked: Vec<&Refit<'a>> = (1..=best.hypothesis.effects.len())
        .flat_map(|size| {
            let of_size = |c: &&Candidate<'a>| c.fit.hypothesis.effects.len() == size && c.ln_posterior.is_finite();
            let mut sets: Vec<&Candidate<'a>> = posterior.candidates.iter().filter(of_size).collect();
            sets.sort_by(|a, b| b.ln_posterior.total_cmp(&a.ln_posterior));
            sets.into_iter().take(verdict.sets_asked).map(|candidate| &candidate.fit)
        })
        .collect();
    let proofs = held_out(context, posterior.base(), &asked, from_s);
    let leaves: Vec<f64> = proofs.iter().map(|own| own.as_ref().map_or(f64::INFINITY, HeldOut::leaves)).collect();
    let sizes = asked.iter().map(|fit| fit.hypothesis.effects.len());
    let sets: Vec<(usize, f64)> = sizes.zip(leaves.iter().copied()).collect();
    let Some(led) = leader(&sets, verdict.borne_out) else { return (posterior, None) };
    let fails = |fit: &Refit<'a>| {
        let place = asked.iter().position(|asked| asked.hypothesis == fit.hypothesis);
        place.is_some_and(|place| verdict.borne_out * leaves[place] > leaves[led])
    };
    let stands = |fit: &Refit<'a>| fit.hypothesis.effects.len() <= sets[led].0 && !fails(fit);
    let standing: Vec<Refit<'a>> = fits.into_iter().filter(stands).collect();
    let hypothesis = asked[led].hypothesis.clone();
    let weighed = weigh(standing, effects, &posterior.compared, context.settings);
    let place = weighed.candidates.iter().position(|candidate| candidate.fit.hypothesis == hypothesis);
    (weighed.led_by(place.unwrap_or(0)), proofs.into_iter().nth(led).flatten())
}

/// Of sets of so many effects each, fewer first, that leave such parts of what was not fitted, the one that leaves least, where one with more effects leaves at most so
/// much of what fewer do; `None` where none predicts anything.
fn leader(sets: &[(usize, f64)], borne_out: f64) -> Option<usize> {
    let is_better = |(size, leaves): (usize, f64), (led_size, led_leaves): (usize, f64)| {
        if size > led_size { leaves <= borne_out * led_leaves } else { leaves < led_leaves }
    };
    let better = |led: Option<usize>, place: usize| match led {
        Some(led) if !is_better(sets[place], sets[led]) => Some(led),
        _ => Some(place),
    };
    (0..sets.len()).filter(|place| sets[*place].1.is_finite()).fold(None, better)
}

/// The posterior led by the effects that are more probable than not each by itself, where a law that was learnt has put one of them in the place of a name; and
/// its proof. Where nothing remains beside the names, it must be among the sets that the table's fits do not tell apart.
pub fn reorder_by_inclusion<'a>(
    context: &FitContext<'a>,
    posterior: Posterior<'a>,
    proof: Option<HeldOut>,
    from_s: Option<f64>,
) -> (Posterior<'a>, Option<HeldOut>) {
    let verdict = &context.settings.verdict;
    let inclusions = posterior.inclusions(context.settings);
    let likely: Vec<Effect> = inclusions.iter().filter(|own| own.1 > verdict.even).map(|own| own.0).collect();
    let most = posterior.candidates.iter().map(|candidate| candidate.if_named).fold(0.0, f64::max);
    // where nothing else remains, the table's own fits tell sets of its names apart
    let least = if posterior.remains > verdict.even { 0.0 } else { verdict.told_apart * most };
    let is_meant = |candidate: &Candidate<'_>| {
        let effects = &candidate.fit.hypothesis.effects;
        let is_of_likely = effects.len() == likely.len() && effects.iter().all(|effect| likely.contains(effect));
        is_of_likely && candidate.ln_posterior.is_finite() && candidate.if_named >= least
    };
    let is_new = |effect: &Effect| !posterior.best().hypothesis.has(*effect);
    let takes_a_place = !posterior.needed.is_empty() && likely.iter().any(is_new);
    match posterior.candidates.iter().position(is_meant).filter(|_| takes_a_place) {
        Some(place) => {
            let posterior = posterior.led_by(place);
            let proof = held_out(context, posterior.base(), &[posterior.best()], from_s).into_iter().next().flatten();
            (posterior, proof)
        }
        None => (posterior, proof),
    }
}

/// What one fit predicts of what is not fitted: the last third of a single recording from the first two; of several, the last recording from the others, of
/// which only the start is then fitted. `from_s` moves the border of a single one.
pub fn predicted(context: &FitContext<'_>, fit: &Refit<'_>, from_s: Option<f64>) -> Option<Prediction> {
    predicted_by(context, fit, from_s, true)
}

/// The same; `is_continued` says whether a fit that leaves far more than noise is fitted from the beginning of what is fitted, too.
fn predicted_by(
    context: &FitContext<'_>,
    fit: &Refit<'_>,
    from_s: Option<f64>,
    is_continued: bool,
) -> Option<Prediction> {
    // a prediction is held against what was seen, whoever erred
    let fit = plain(fit);
    match border(context, from_s)? {
        HoldoutSplit::Row(rows, _) => along(context, &fit, rows, is_continued),
        HoldoutSplit::Piece(pieces, _) => beyond(context, &fit, pieces),
        HoldoutSplit::Record(last) => across(context, &fit, last),
    }
}

/// Predicts by the base model and by each of some fits.
fn held_out(
    context: &FitContext<'_>,
    null: &Refit<'_>,
    fits: &[&Refit<'_>],
    from_s: Option<f64>,
) -> Vec<Option<HeldOut>> {
    let of_fits = || fits.par_iter().with_max_len(1).map(|fit| predicted(context, fit, from_s)).collect::<Vec<_>>();
    // a strip's base model that has lost step would take a quarter of a minute more
    let is_continued = context.work.done() < context.settings.search.budget;
    let (baseline, augmented) = rayon::join(|| predicted_by(context, null, from_s, is_continued), of_fits);
    let (record, from_s) = match border(context, from_s) {
        Some(HoldoutSplit::Row(_, border_s)) => (0, border_s),
        Some(HoldoutSplit::Piece(_, border_s)) => (0, border_s),
        Some(HoldoutSplit::Record(last)) => (last, context.records[last].t_s[0]),
        None => return vec![None; fits.len()],
    };
    let proof = |augmented: Option<Prediction>| {
        Some(HeldOut { record, from_s, baseline: baseline.clone()?, augmented: augmented? })
    };
    augmented.into_iter().map(proof).collect()
}

/// What is not fitted.
enum HoldoutSplit {
    /// A single recording from this row, and this stamp, on.
    Row(usize, f64),
    /// A single recording in pieces, so many of which are fitted, up to this stamp.
    Piece(usize, f64),
    /// This one of several recordings, or its first piece.
    Record(usize),
}

fn border(context: &FitContext<'_>, from_s: Option<f64>) -> Option<HoldoutSplit> {
    if context.recordings() > 1 {
        return recordings(context.records).last().map(|pieces| HoldoutSplit::Record(pieces.start));
    }
    let (record, last) = (context.records.first()?, context.records.last()?);
    let (first_s, last_s) = (record.t_s[0], last.t_s[last.len() - 1]);
    let border_s = from_s.unwrap_or(first_s + context.settings.verdict.fitted * (last_s - first_s));
    if context.is_in_pieces() {
        // whole pieces are fitted
        let fitted = context.records.partition_point(|piece| piece.t_s[0] <= border_s).checked_sub(1)?;
        return (fitted > 0).then(|| HoldoutSplit::Piece(fitted, context.records[fitted].t_s[0]));
    }
    let rows = record.t_s.partition_point(|t| *t < border_s);
    let is_long = |rows: usize| rows >= crate::series::FEWEST_ROWS;
    (is_long(rows) && is_long(record.len() - rows)).then_some(HoldoutSplit::Row(rows, border_s))
}

/// The same judged without errors in step with the swing; what it left is no more known.
fn plain<'a>(fit: &Refit<'a>) -> Refit<'a> {
    let mut fit = fit.clone();
    fit.problem.noise = without_synchronous_errors(&fit.problem.noise);
    fit
}

/// A hypothesis near another fit, as far as steps lead: what a fit predicts that is still on its way is not what its hypothesis does.
fn refit_to_its_end<'a>(context: &FitContext<'a>, hypothesis: &Hypothesis, near: &Refit<'_>) -> Option<Refit<'a>> {
    let begun = context.refit(hypothesis, near, &[])?;
    let further = (!begun.converged).then(|| context.go_on(&begun, context.settings.descent.most_steps)).flatten();
    Some(context.to_the_least(further.unwrap_or(begun)))
}

fn along(context: &FitContext<'_>, fit: &Refit<'_>, rows: usize, is_continued: bool) -> Option<Prediction> {
    let record = &context.records[0];
    let early = [record.until(rows)];
    let part = context.on(&early);
    let refitted = refit_to_its_end(&part, &fit.hypothesis, fit)?;
    // what leaves far more than noise may have lost step between here and there
    let is_continued = is_continued && leaves_more_than_noise(&refitted, &context.settings.noise);
    let grown = is_continued.then(|| continue_one(&part, &refitted)).flatten();
    let refitted = grown.into_iter().chain([refitted]).min_by(|a, b| a.chi2.total_cmp(&b.chi2))?;
    let whole = context.problem_near(&fit.hypothesis, &refitted).ok()?;
    let rmse_rad = errors(&whole.predict(0, &refitted.x, false).ok()?.values, record, rows)?;
    let left = residuals_of(&whole, &refitted.x, 0).ok();
    Some(Prediction { rmse_rad, left, ..Prediction::from(&refitted, &context.laws) })
}

/// The pieces up to the border are fitted; from the last of them on all is predicted as one motion. Where the model errs, and yet follows the fitted pieces as one
/// motion, the coefficients are those of that motion: it is as long as what is predicted, and a piece leaves open what tells over many swings.
fn beyond(context: &FitContext<'_>, fit: &Refit<'_>, pieces: usize) -> Option<Prediction> {
    let early = context.on(&context.records[..pieces]);
    let (mut near, free, starts) = (fit.clone(), fit.problem.free.len(), 2 * fit.problem.shapes());
    near.x.truncate(free + pieces * starts);
    let within = |pieces: usize| fit.hypothesis.dropped.filter(move |dropped| dropped.0 < pieces);
    near.hypothesis = Hypothesis { dropped: within(pieces), ..fit.hypothesis.clone() };
    let fitted = refit_to_its_end(&early, &near.hypothesis, &near)?;
    let last = pieces - 1;
    let of_last = [context.records[last].clone()];
    let rest = [Record::joined(&context.records[last..])?];
    let in_last = within(pieces).filter(|dropped| dropped.0 == last).map(|(_, at_s)| (0, at_s));
    let hypothesis = Hypothesis { dropped: in_last, ..fit.hypothesis.clone() };
    let start = &fitted.x[free + last * starts..];
    let from_its_start = |coefficients: Vec<f64>| {
        let last = context.on(&of_last);
        let noise = last.noise_of(&fitted);
        refit_start(&last, &hypothesis, &Refit { x: coefficients, ..fitted.clone() }, (start, noise))
    };
    let of_one = coefficients_of_one_motion(context, &fitted).and_then(from_its_start);
    let of_pieces = || Refit { x: [&fitted.x[..free], start].concat(), ..fitted.clone() };
    let from_last = of_one.unwrap_or_else(of_pieces);
    let (problem, x) = (context.on(&rest).problem_near(&hypothesis, &from_last).ok()?, from_last.x);
    let rmse_rad = errors(&problem.predict(0, &x, false).ok()?.values, &rest[0], context.records[last].len())?;
    let before = (0..last).map(|piece| fitted.residuals(piece));
    let left = before.chain([residuals_of(&problem, &x, 0).ok()]).collect::<Option<_>>().and_then(Residuals::joined);
    Some(Prediction { rmse_rad, left, ..Prediction::from(&fitted, &context.laws) })
}

/// The coefficients of a fit that leaves more than noise of pieces, fitted to these as one motion; `None` where that leaves more than √n times what n pieces do, to
/// which errors add up that are independent from piece to piece.
fn coefficients_of_one_motion(context: &FitContext<'_>, fitted: &Refit<'_>) -> Option<Vec<f64>> {
    let (pieces, free) = (fitted.problem.records.len(), fitted.problem.free.len());
    if !leaves_more_than_noise(fitted, &context.settings.noise) {
        return None;
    }
    let of_pieces =
        (0..pieces).map(|piece| fitted.residuals(piece)).collect::<Option<_>>().and_then(Residuals::joined)?;
    let joined = [Record::joined(fitted.problem.records)?];
    let context = context.on(&joined);
    let x = fitted.x[..free + 2 * fitted.problem.shapes()].to_vec();
    let dropped = fitted.hypothesis.dropped.map(|(_, at_s)| (0, at_s));
    let hypothesis = Hypothesis { dropped, ..fitted.hypothesis.clone() };
    let problem = context.problem_near(&hypothesis, fitted).ok()?;
    let begun = context.descend(&hypothesis, problem, x, 0)?;
    let independent = pieces as f64 * squares(&of_pieces.rmse_rad);
    let follows = |fit: &Refit<'_>, times: f64| {
        fit.residuals(0).is_some_and(|left| squares(&left.rmse_rad) <= times * independent)
    };
    // steps of a motion that has lost step are dear and lead nowhere
    follows(&begun, context.settings.search.hopeless).then_some(())?;
    let one = refit_to_its_end(&context, &hypothesis, &begun)?;
    follows(&one, 1.0).then(|| one.x[..free].to_vec())
}

/// The fit of a recording's start alone, by this noise, near another start, with the coefficients of a fit.
fn refit_start<'b>(
    alone: &FitContext<'b>,
    hypothesis: &Hypothesis,
    of: &Refit<'b>,
    (start, noise): (&[f64], Vec<RecordNoise>),
) -> Option<Refit<'b>> {
    let coefficients = &of.x[..of.problem.free.len()];
    let frozen: Vec<Belief> = (of.problem.free.iter().zip(coefficients))
        .map(|(p, value)| Belief { parameter: *p, value: *value, sd: FROZEN * value.abs().max(1e-12) })
        .collect();
    let alone = FitContext { beliefs: frozen, ..alone.clone() };
    let problem = Problem { records: alone.records, noise, ..of.problem.clone() };
    let x = [coefficients, start].concat();
    alone.refit(hypothesis, &Refit { problem, x, ..of.clone() }, &[])
}

fn across(context: &FitContext<'_>, fit: &Refit<'_>, last: usize) -> Option<Prediction> {
    let others = context.on(&context.records[..last]);
    let whole = [Record::joined(&context.records[last..])?];
    let hypothesis = Hypothesis { dropped: fit.hypothesis.dropped.filter(|d| d.0 < last), ..fit.hypothesis.clone() };
    let mut near = fit.clone();
    near.x.truncate(fit.problem.start_of(last));
    let fitted = refit_to_its_end(&others, &hypothesis, &near)?;
    // on the last one only the start is free
    let noise = vec![fit.problem.noise[last].clone()];
    let hypothesis = Hypothesis { dropped: None, ..hypothesis };
    let start = fit.problem.start(&fit.x, last);
    let seen = refit_start(&context.on(&whole), &hypothesis, &fitted, (start, noise))?;
    let rmse_rad = errors(&seen.problem.predict(0, &seen.x, false).ok()?.values, &whole[0], 0)?;
    Some(Prediction { rmse_rad, ..Prediction::from(&fitted, &context.laws) })
}

/// Root mean square error of each angle from a row on.
fn errors(values: &[crate::fit::predict::Value], record: &Record, from_row: usize) -> Option<Vec<f64>> {
    (0..record.links())
        .map(|link| {
            let left = values.iter().filter(|v| v.link == link && v.row >= from_row);
            let squares: Vec<f64> =
                left.filter_map(|v| Some((record.theta_rad[link][v.row]? - v.predicted_rad).powi(2))).collect();
            (!squares.is_empty()).then(|| (squares.iter().sum::<f64>() / squares.len() as f64).sqrt())
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn more_effects_lead_only_where_they_predict_clearly_better() {
        assert_eq!(leader(&[(1, 0.8), (1, 0.7), (2, 0.66), (2, 0.6), (3, 0.58)], 0.9), Some(3));
        // what was fitted always falls with one more, what is predicted may rise
        assert_eq!(leader(&[(1, 0.24), (2, 0.30), (3, 0.26)], 0.9), Some(0));
        assert_eq!(leader(&[(1, f64::INFINITY), (2, 0.9), (3, f64::INFINITY)], 0.9), Some(1));
        assert_eq!(leader(&[(1, f64::INFINITY)], 0.9), None);
    }

    #[test]
    fn a_law_beside_the_names_adds_to_what_is_explained_and_noise_counts_for_nothing() {
        let left = |rmse_rad: f64| Prediction { rmse_rad: vec![rmse_rad; 2], left: None, told: Vec::new() };
        let proof = |baseline, augmented| HeldOut {
            record: 0,
            from_s: 1.0,
            baseline: left(baseline),
            augmented: left(augmented),
        };
        let noise_rad = [1.0; 2];
        assert!((proof(9.0, 5.0).explained(None, &noise_rad) - 0.7).abs() < 1e-12);
        assert!((proof(9.0, 5.0).explained(Some(&left(1.0)), &noise_rad) - 1.0).abs() < 1e-12);
        // names that make it worse explain nothing, and where the base model leaves hardly more than noise nothing is told
        assert_eq!(proof(9.0, 10.0).explained(None, &noise_rad), 0.0);
        assert_eq!(proof(1.05, 1.06).explained(None, &noise_rad), 1.0);
        // where the names leave hardly more than the noise, what is predicted tells no description from another
        assert!(proof(9.0, 5.0).tells(&noise_rad) && !proof(9.0, 1.02).tells(&noise_rad));
    }
}
