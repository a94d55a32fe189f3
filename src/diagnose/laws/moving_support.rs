//! A support that moves to and fro: at which frequency.
//!
//! A support's sine and cosine have derivatives at every frequency, none of which leads to another. So all of them are looked at along the linearised motion, and the
//! highest peaks are fitted.

use nalgebra::DMatrix;

use super::super::effect::{Effect, Place};
use super::super::hypothesis::Hypothesis;
use super::super::linearisation::Linearisation;
use super::super::noise;
use super::super::refit::Refit;
use super::super::screen::{Score, Screen};
use super::super::settings::{PriorSettings, Settings};
use super::{Coefficients, Law};
use crate::model::Parameter;
use crate::model::observe::chord_angles_rad;

/// Frequencies: this fine for the length of the recording (start values: as many as that tells apart).
const PER_RESOLUTION: f64 = 1.0;
/// Each peak is then sought at these places around it, in steps of that (start values: half a step off, a support has slipped by a quarter of a cycle at both ends of the
/// recording, from where a descent may not find it).
const BETWEEN: [f64; 4] = [-0.5, -0.25, 0.25, 0.5];
/// Frequencies that are followed side by side (cost: no answer depends on it).
const AT_ONCE: usize = 8;
/// Peaks over the frequency that are kept beside the highest (cost).
const FURTHER_PEAKS: usize = 4;
/// Lowest and highest frequency, in units of the swing's. A slower one only leans, and has to move by metres to do so (physics); a faster one is not looked for
/// (judgement).
const LOWEST: f64 = 0.1;
const HIGHEST: f64 = 8.0;
/// The highest also as a part of half the rate (judgement).
const OF_NYQUIST: f64 = 0.9;
/// Power of the motion at a frequency, over its largest, from which on a torque of that frequency is in step with it (judgement: any line of the motion).
const POWER_IN_STEP: f64 = 1e-5;

/// The law.
pub struct MovingSupport;

impl Law for MovingSupport {
    fn scan(&self, screen: &Screen<'_, '_>) -> Option<Score> {
        scanned(screen)
    }

    fn strength(&self, _effect: Effect, of: &Coefficients<'_>) -> Option<(f64, f64)> {
        let ((sine, sd), (cosine, _)) = (of(Parameter::SupportSine), of(Parameter::SupportCosine));
        Some((sine.hypot(cosine), sd))
    }

    fn is_possible(&self, fit: &Refit<'_>, _prior: &PriorSettings) -> bool {
        !is_quasi_static(fit)
    }

    /// A codec lets a tracked mark wander over seconds, by no more than its errors in step with the swing; an encoder rounds in step with it.
    fn is_seen(&self, fit: &Refit<'_>, without: &Refit<'_>) -> bool {
        let share =
            fit.problem.records.iter().map(|record| record.synchronous.max(record.rounding)).fold(0.0, f64::max);
        without.chi2 - fit.chi2 >= share * share * fit.values() as f64
    }

    /// Any direction of the phase, and any frequency up to a multiple of the swing's.
    fn ln_multiplicity(
        &self,
        _fit: &Refit<'_>,
        effect: Effect,
        of: &Coefficients<'_>,
        settings: &PriorSettings,
    ) -> f64 {
        let amplitude_m = self.strength(effect, of).map_or(0.0, |strength| strength.0);
        (std::f64::consts::TAU * amplitude_m.abs()).ln() + settings.frequencies.ln()
    }

    /// In step with the swing it can be what it seems to be, or stand for a torque that is not known; beside that it leaves more than noise.
    fn odds(&self, fit: &Refit<'_>, others: &[&Refit<'_>], settings: &Settings) -> f64 {
        let Some(hz) = fit.value(Parameter::SupportFrequency) else { return 1.0 };
        let prior = &settings.prior;
        let fit_of = |hypothesis: &Hypothesis| others.iter().find(|f| f.hypothesis.effects == hypothesis.effects);
        let rest = fit.hypothesis.without(Effect::SupportMotion);
        let is_slight = fit_of(&rest).is_some_and(|without| without.chi2 - fit.chi2 < prior.slight * prior.slight);
        if is_slight && rest.effects.iter().any(|e| e.place() != Place::Camera) {
            return prior.within_law_error;
        }
        let Some(base) = fit_of(&Hypothesis::default()) else { return 1.0 };
        let powers = chord_powers(base);
        let synchronous = if is_in_step(&powers, hz) {
            prior.support_in_step.min(super::odds_of_what_completes_a_law(fit, others, settings))
        } else {
            1.0
        };
        synchronous * chance_of_multiple(&powers, hz).map_or(1.0, |chance| chance / (1.0 + chance))
    }
}

/// A support that moves at each frequency in turn.
fn scanned(screen: &Screen<'_, '_>) -> Option<Score> {
    let problem = &screen.fit.problem;
    let records = problem.records.len();
    let mut around = Vec::with_capacity(records);
    for record in 0..records {
        let (model, _) = problem.model(record, &screen.fit.x[..problem.free.len()]).ok()?;
        let linearisation = Linearisation::of(screen.fit, record)?;
        let transitions = linearisation.transitions_of_pivot();
        around.push((linearisation, transitions, model.characteristic_rad_s()));
    }
    let span_s = around.iter().map(|(a, _, _)| a.t_s[a.t_s.len() - 1] - a.t_s[0]).fold(0.0, f64::max);
    let swing_hz = around[0].2 / std::f64::consts::TAU;
    let nyquist_hz = 0.5 * around.iter().map(|(a, _, _)| a.t_s.len() as f64).fold(0.0, f64::max) / span_s;
    let count = (PER_RESOLUTION * span_s * (HIGHEST * swing_hz).min(OF_NYQUIST * nyquist_hz)) as usize;
    let hz = |k: usize| (k as f64 + 0.5) / (PER_RESOLUTION * span_s);
    let first = ((PER_RESOLUTION * span_s * LOWEST * swing_hz) as usize).max(1);
    let frequencies_hz: Vec<f64> = (first..count).map(hz).collect();
    let of_several = |several: &[f64]| {
        let columns = at_frequencies(screen, &around, several);
        let promised = |(k, hz): (usize, &f64)| Some((screen.promise(&columns.columns(2 * k, 2))?, *hz));
        several.iter().enumerate().filter_map(promised).collect::<Vec<_>>()
    };
    let promises: Vec<(f64, f64)> = frequencies_hz.chunks(AT_ONCE).flat_map(of_several).collect();
    let is_peak = |k: &usize| {
        let near = promises[k.saturating_sub(1)..promises.len().min(k + 2)].iter();
        near.map(|p| p.0).fold(f64::NEG_INFINITY, f64::max) <= promises[*k].0
    };
    let mut peaks: Vec<(f64, f64)> = (0..promises.len()).filter(is_peak).map(|k| promises[k]).collect();
    peaks.sort_by(|a, b| b.0.total_cmp(&a.0));
    peaks.truncate(1 + FURTHER_PEAKS);
    let between = |peak: &(f64, f64)| {
        let near: Vec<f64> = BETWEEN.iter().map(|part| peak.1 + part / (PER_RESOLUTION * span_s)).collect();
        of_several(&near).into_iter().fold(*peak, |best, other| if other.0 > best.0 { other } else { best })
    };
    let mut peaks: Vec<(f64, f64)> = peaks.iter().map(between).collect();
    peaks.sort_by(|a, b| b.0.total_cmp(&a.0));
    let at = |hz: f64| {
        let columns = at_frequencies(screen, &around, &[hz]).columns(0, 2).into_owned();
        let parameters = [Parameter::SupportSine, Parameter::SupportCosine];
        let mut score = screen.score(Effect::SupportMotion, columns, &parameters, None)?;
        score.start.push((Parameter::SupportFrequency, hz));
        Some(score)
    };
    let mut score = at(peaks.first()?.1)?;
    let further = peaks.iter().skip(1).filter_map(|(_, hz)| at(*hz));
    score.further = further.map(|other| other.start).collect();
    Some(score)
}

/// Two columns each of a few frequencies.
fn at_frequencies(
    screen: &Screen<'_, '_>,
    around: &[(Linearisation, Vec<DMatrix<f64>>, f64)],
    frequencies_hz: &[f64],
) -> DMatrix<f64> {
    let mut columns = DMatrix::zeros(screen.projection.residual.len(), 2 * AT_ONCE);
    let mut first = 0;
    for (linearisation, transitions, _) in around {
        // the pivot's acceleration for one metre of sine, and of cosine
        let course = |pair: &[f64]| {
            let mut course = [0.0; 2 * AT_ONCE];
            for (both, frequency_hz) in course.chunks_exact_mut(2).zip(frequencies_hz) {
                let rate = std::f64::consts::TAU * frequency_hz;
                let (sin, cos) = (rate * 0.5 * (pair[0] + pair[1])).sin_cos();
                both.copy_from_slice(&[-rate * rate * sin, -rate * rate * cos]);
            }
            [course]
        };
        let held: Vec<[[f64; 2 * AT_ONCE]; 1]> = linearisation.t_s.windows(2).map(course).collect();
        let seen = linearisation.seen(&linearisation.responses(transitions, &held));
        columns.rows_mut(first, seen.nrows()).copy_from(&seen);
        first += seen.nrows();
    }
    columns
}

/// Whether the support of a fit moves so slowly beside the swing that nothing moves but the angles' zero.
fn is_quasi_static(fit: &Refit<'_>) -> bool {
    let Ok((model, _)) = fit.problem.model(0, &fit.x[..fit.problem.free.len()]) else { return false };
    let swing_hz = model.characteristic_rad_s() / std::f64::consts::TAU;
    fit.value(Parameter::SupportFrequency).is_some_and(|hz| hz < LOWEST * swing_hz)
}

/// Where a support would move at a multiple of the swing's frequency, how likely that is by chance: the part of the frequencies that lie within a resolution of a
/// multiple. As likely is something that goes with the swing: a sensor off its centre, a spring stiffer to one side.
fn chance_of_multiple(powers: &[Vec<Power>], frequency_hz: f64) -> Option<f64> {
    powers.iter().filter_map(|of_record| of_record.first()).find_map(|Power { of_bins: power, span_s }| {
        let highest = (1..power.len() - 1).max_by(|a, b| power[*a].total_cmp(&power[*b]))?;
        let [before, at, after] = [highest - 1, highest, highest + 1].map(|k| power[k].max(f64::MIN_POSITIVE).ln());
        let peak = highest as f64 + 0.5 * (after - before) / (2.0 * at - before - after).max(f64::MIN_POSITIVE);
        let bin = frequency_hz * span_s;
        let times = (bin / peak).round();
        (times >= 2.0 && (bin - times * peak).abs() < 1.0).then(|| (2.0 / peak).min(1.0))
    })
}

/// Whether a support would move at a frequency at which the base model's own motion has power. Such a support can stand for any torque in step with
/// the swing, so it names nothing.
fn is_in_step(powers: &[Vec<Power>], frequency_hz: f64) -> bool {
    powers.iter().flatten().any(|Power { of_bins: power, span_s }| {
        let bin = (frequency_hz * span_s).round() as usize;
        let strongest = power[1..].iter().copied().fold(0.0, f64::max);
        let near = bin.saturating_sub(1)..(bin + 2).min(power.len());
        power[near.start.min(power.len())..near.end].iter().any(|p| *p > POWER_IN_STEP * strongest)
    })
}

/// The power of a motion at each multiple of 1/T.
struct Power {
    of_bins: Vec<f64>,
    /// T.
    span_s: f64,
}

/// That of a fit's own motion, of each angle of each record that it can be integrated through.
fn chord_powers(fit: &Refit<'_>) -> Vec<Vec<Power>> {
    let of_record = |record: usize| {
        let (model, swing, true_s) = fit.motion(record)?;
        let chords: Vec<Vec<f64>> =
            true_s.iter().map(|t| chord_angles_rad(model.chain(), &swing.at(*t).theta_rad)).collect();
        let span_s = true_s[true_s.len() - 1] - true_s[0];
        let of_bins = |link: usize| noise::spectrum(&chords.iter().map(|c| c[link]).collect::<Vec<f64>>());
        Some((0..fit.problem.marks()).map(|link| Power { of_bins: of_bins(link), span_s }).collect())
    };
    (0..fit.problem.records.len()).filter_map(of_record).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::base_priors::DampingAssumption;
    use crate::diagnose::preparation;
    use crate::diagnose::search::Search;
    use crate::diagnose::testing::{arm, swing};
    use crate::fit::Record;
    use crate::progress::Silent;

    const LENGTH_S: f64 = 40.0;

    const DAMPED: &str = "hinge_viscous = 2e-4\n";

    #[test]
    fn a_support_is_found_wherever_its_frequency_stands_among_those_looked_at() {
        let settings = Settings::default();
        for part in [0.0, 0.3, 0.5, 0.7] {
            let frequency_hz = (78.0 + part) / LENGTH_S;
            let moving = format!(
                "{DAMPED}support_motion = {{ amplitude_m = 2e-3, frequency_hz = {frequency_hz}, phase_rad = 1.0 }}\n"
            );
            let (t_s, theta_rad) = swing(&arm(&moving), LENGTH_S, 25.0);
            let angles = theta_rad.into_iter().map(Some).collect();
            let record = Record::uniform("made", t_s, vec![angles]);
            let prepared = preparation::prepare(&[record], &arm(DAMPED), &settings).unwrap();
            let taken = DampingAssumption::AsStated;
            let search = Search::of_base_model(&prepared, &prepared.experiment, taken, &settings, &Silent).unwrap();
            let score = scanned(&Screen::at(&search.context, search.base()).unwrap()).unwrap();
            let found_hz = score.start.iter().find(|own| own.0 == Parameter::SupportFrequency).unwrap().1;
            // an eighth of a cycle at each end of the recording
            assert!((found_hz - frequency_hz).abs() * LENGTH_S <= 0.26, "{part}: {found_hz} for {frequency_hz}");
            assert!(score.gain > 0.5 * search.base().chi2, "{part}: {} of {}", score.gain, search.base().chi2);
        }
    }
}
