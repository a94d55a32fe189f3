//! What a record holds: nothing but the push, named effects, a class that it cannot tell apart, or something else.

use serde::Serialize;

use super::adequacy::Adequacy;
use super::fit::{Bench, Fit, Member};
use super::forms::{Effect, Form};
use super::search::{Candidate, inclusion, mixed_push};
use super::solve::solve;
use crate::identify::estimate::{NORMAL_QUANTILE, student_quantile};
use crate::statistics::no_chance;

/// A set of effects is certain from this probability on.
const CERTAIN: f64 = 0.9;
/// A rival counts from this part of the likeliest set's probability on.
const RIVAL: f64 = 0.05;
/// An effect of so many standard deviations is named: half its square pays for its prior odds, its size and its shape.
const NAMED_SD: f64 = 5.0;
/// Columns whose correlation is beyond this, push and swings taken out, are told apart only by large effects.
const CONFUSED: f64 = 0.9;

/// The answer's form.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Status {
    /// Push, swings and noise explain the record.
    Adequate,
    /// These effects and no others.
    Identified,
    /// The record does not tell some apart.
    Ambiguous,
    /// Something that is not in the table.
    Unknown,
}

/// What remains beside the names.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Remainder {
    /// The probability that something does.
    pub present: f64,
    /// What it looks like, where it matters.
    pub like: Option<&'static str>,
    /// Frequency of the strongest line, where there is one.
    pub frequency_hz: Option<f64>,
    /// Its root mean square.
    pub rms_m: f64,
    /// Innovations over what noise leaves.
    pub over_noise: f64,
    /// Part of what the push alone leaves beyond the noise.
    pub share: f64,
}

/// The verdict.
#[derive(Debug, Clone, PartialEq)]
pub struct Verdict {
    /// Its form.
    pub status: Status,
    /// The likeliest names.
    pub effects: Vec<Effect>,
    /// All that the record does not tell from them.
    pub class: Vec<Effect>,
    /// Of the set of names; of an unknown that something else is there.
    pub probability: f64,
    /// Of each effect.
    pub inclusion: Vec<(Effect, f64)>,
    /// Beside them.
    pub remainder: Remainder,
    /// The measurement that would split the class.
    pub to_decide: Option<&'static str>,
}

/// Weighs candidates and tests.
pub fn verdict(bench: &Bench<'_>, candidates: &[Candidate], adequacy: &Adequacy) -> Verdict {
    let best = &candidates[0].fit;
    let inclusion: Vec<(Effect, f64)> = Effect::ALL.into_iter().map(|e| (e, inclusion(candidates, e))).collect();
    let remainder = remainder(bench, candidates, adequacy);
    let of_set = |effects: &[Effect]| -> f64 {
        candidates.iter().filter(|c| c.fit.effects() == effects).map(|c| c.probability).sum()
    };
    let effects = best.effects();
    let likely = of_set(&effects);
    let mut class = effects.clone();
    for candidate in candidates {
        let rival = candidate.fit.effects();
        if rival != effects && of_set(&rival) > RIVAL * likely {
            class.extend(rival);
        }
    }
    // a sensor that drifts and a support that creeps move the same number
    if effects.contains(&Effect::SensorDrift) {
        class.push(Effect::Tilt);
    }
    if best.members.iter().any(|m| m.form == Form::Creep) {
        class.push(Effect::SensorDrift);
    }
    class.sort();
    class.dedup();
    let stands = adequacy.adequate && !effects.contains(&Effect::Other);
    let status = match (stands, effects.is_empty(), likely >= CERTAIN && class == effects) {
        (false, _, _) => Status::Unknown,
        (true, true, _) if likely >= 0.5 => Status::Adequate,
        (true, _, true) => Status::Identified,
        (true, _, false) => Status::Ambiguous,
    };
    let (effects, class, probability) = match status {
        Status::Unknown => (Vec::new(), Vec::new(), remainder.present),
        Status::Adequate => (Vec::new(), Vec::new(), likely),
        _ => (effects, class, likely),
    };
    let to_decide = (status == Status::Ambiguous).then(|| decides(&class));
    Verdict { status, effects, class, probability, inclusion, remainder, to_decide }
}

fn remainder(bench: &Bench<'_>, candidates: &[Candidate], adequacy: &Adequacy) -> Remainder {
    let best = &candidates[0].fit;
    let base = candidates.iter().find(|c| c.fit.members.is_empty()).map_or(best.chi2, |c| c.fit.chi2);
    let held = bench.with.grid.held() as f64;
    let left = adequacy.left();
    let frequency_hz = left.filter(|t| t.looks_for.contains("spectrum")).and_then(|t| t.at);
    let crept_m = crept_m(bench, best);
    let other = inclusion(candidates, Effect::Other);
    let found_m = left.map_or(0.0, |test| test.rms_m);
    let rms_m = found_m.max(crept_m);
    let chi2 = held * (rms_m / bench.cell_m()).powi(2);
    Remainder {
        present: if adequacy.adequate { other } else { no_chance(adequacy.p_value).max(other) },
        like: if crept_m > found_m { Some("a creep with the logarithm of time") } else { left.map(|t| t.looks_for) },
        frequency_hz,
        rms_m,
        over_noise: (best.chi2 / held).sqrt(),
        share: (chi2 / (base - held).max(chi2).max(f64::MIN_POSITIVE)).min(1.0),
    }
}

/// Root mean square, about its mean, of what a candidate holds that is not in the table.
fn crept_m(bench: &Bench<'_>, fit: &Fit) -> f64 {
    let mut place = bench.base.len();
    let mut sum_m2 = 0.0;
    for member in &fit.members {
        if member.form.effect() == Effect::Other {
            let column = member.form.columns(&member.shape, &bench.with).swap_remove(0);
            let mean = column.iter().sum::<f64>() / column.len() as f64;
            let variance = column.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / column.len() as f64;
            sum_m2 += fit.amplitude[place].powi(2) * variance;
        }
        place += member.form.count(&bench.with);
    }
    sum_m2.sqrt()
}

/// The measurement that splits a class.
fn decides(class: &[Effect]) -> &'static str {
    let has = |effect: Effect| class.contains(&effect);
    if has(Effect::SensorDrift) && has(Effect::Tilt) {
        return "point the sensor at a fixed target beside the strip for as long: what moves there is the sensor, what does not is the support";
    }
    if has(Effect::Heat) && has(Effect::Tilt) {
        return "leave the lamp on for ten minutes: a film settles within a minute, a support goes on";
    }
    if has(Effect::Heat) && has(Effect::LampWarmUp) {
        return "watch the lamp with a photodiode, or the film with a thermometer: heat stays after a switch-off, light does not";
    }
    if has(Effect::Gas) {
        return "repeat the cycles after some hours of pumping and light: gas is used up, heat and lamp are not";
    }
    if has(Effect::LampWarmUp) {
        return "watch the lamp with a photodiode";
    }
    "record more cycles with longer lit and dark times"
}

impl Verdict {
    /// The push with its standard deviation. Where something else is there the interval also holds what a level that wanders freely, and
    /// the cycles among themselves, allow.
    pub fn push(&self, bench: &Bench<'_>, candidates: &[Candidate], cycles_m: &[[f64; 2]]) -> [f64; 2] {
        let [push, sd] = mixed_push(candidates);
        if self.status != Status::Unknown {
            // what remains, though it does not matter, may be part of the push
            return [push, sd.hypot(self.remainder.rms_m)];
        }
        let walking = bench.fit_on(&bench.stage(bench.noise.walk_m2_s), candidates[0].fit.members.clone());
        let [other, other_sd] = walking.map_or([push, sd], |fit| fit.push());
        let over = self.remainder.over_noise.max(1.0);
        [
            push,
            [(over * sd).hypot(self.remainder.rms_m), other_sd, (push - other).abs(), scatter_m(cycles_m)]
                .into_iter()
                .fold(0.0, f64::max),
        ]
    }
}

/// Standard deviation of the mean of cycles by their own scatter, widened for how few they are.
fn scatter_m(cycles_m: &[[f64; 2]]) -> f64 {
    let count = cycles_m.len() as f64;
    if cycles_m.len() < 2 {
        return 0.0;
    }
    let mean = cycles_m.iter().map(|c| c[0]).sum::<f64>() / count;
    let variance = cycles_m.iter().map(|c| (c[0] - mean).powi(2)).sum::<f64>() / (count - 1.0);
    (variance / count).sqrt() * student_quantile(count - 1.0) / NORMAL_QUANTILE
}

/// The smallest size of each effect that would be named beside what a fit holds, and what it would be confused with.
pub fn detectable(bench: &Bench<'_>, fit: &Fit) -> Vec<(Effect, f64, Vec<Effect>)> {
    let typical = [Form::Warmth, Form::Lag, Form::Pulse, Form::Line, Form::Slow];
    let stage = &bench.stage(fit.walk_m2_s);
    let column_of = |form: Form| {
        let starts = form.starts(&bench.with);
        let shape = starts[starts.len() / 2].clone();
        bench.whitened(stage, &[Member { form, shape }]).swap_remove(0)
    };
    let others: Vec<Vec<f64>> = typical.iter().map(|form| column_of(*form)).collect();
    let beyond: Vec<Option<(Vec<f64>, f64)>> = typical
        .iter()
        .zip(&others)
        .map(|(form, column)| {
            let members: Vec<Member> =
                fit.members.iter().filter(|m| m.form.effect() != form.effect()).cloned().collect();
            let beside = bench.whitened(stage, &members);
            let columns: Vec<&[f64]> = stage.base.iter().chain(&beside).map(Vec::as_slice).collect();
            let solution = solve(&columns, column, &[])?;
            Some((solution.left, solution.chi2))
        })
        .collect();
    let correlation = |a: &(Vec<f64>, f64), b: &(Vec<f64>, f64)| {
        let product: f64 = a.0.iter().zip(&b.0).map(|(x, y)| x * y).sum();
        product.abs() / (a.1 * b.1).sqrt().max(f64::MIN_POSITIVE)
    };
    typical
        .iter()
        .enumerate()
        .filter_map(|(k, form)| {
            let own = beyond[k].as_ref()?;
            let confused = typical
                .iter()
                .enumerate()
                .filter(|(j, _)| *j != k && beyond[*j].as_ref().is_some_and(|other| correlation(own, other) > CONFUSED))
                .map(|(_, other)| other.effect());
            Some((form.effect(), NAMED_SD / own.1.sqrt(), confused.collect()))
        })
        .collect()
}
