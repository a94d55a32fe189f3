//! Is the base model enough? Its residuals against what chance alone would leave, and what could have been seen.
//!
//! The residuals of a fit to data that its model made are (1 − QQᵀ)ε, ε being the noise: replicates of them cost no integration. Each statistic
//! (the best score of an effect, the worst window, the highest peak of the spectrum, the correlation of neighbours, each over the mean square) is ranked among
//! its replicates, and the smallest rank among the smallest ranks of the replicates, so that looking in many places is paid for. Effects that are scanned for are
//! left to the spectrum and the windows: a replicate would have to be scanned anew to be held against them.

use nalgebra::DVector;
use rand::SeedableRng;
use rand::rngs::StdRng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;
use rustfft::FftPlanner;
use rustfft::num_complex::Complex;

use super::context::FitContext;
use super::effect::Effect;
use super::laws;
use super::refit::Refit;
use super::screen::{Score, Screen};
use super::settings::VerdictSettings;
use crate::fit::whitening::Whitening;
use crate::model::Parameter;
use crate::progress::Progress;

/// Replicates of the residuals (cost; the most conspicuous in one of four statistics is at most four of them: rarer than one in two hundred).
const REPLICATES: usize = 1000;
/// What they are compared by: so many numbers, see above.
const STATISTICS: usize = 4;
/// Values of a window (judgement).
const WINDOW: usize = 40;
/// Columns that differ by less than this part do the same (judgement: a thousandth).
const NEVER_TOLD: f64 = 1e-3;
/// The smallest amount of an effect that a recording can show.
#[derive(Debug, Clone)]
pub struct Detectable {
    /// The effect.
    pub effect: Effect,
    /// Its first coefficient.
    pub parameter: Parameter,
    /// The amount; infinite where no amount can be told from the base model.
    pub smallest: f64,
    /// From this amount on its name is told from every other single effect's; infinite where it never is.
    pub named: f64,
    /// Effects that would do nearly the same.
    pub confused_with: Vec<Effect>,
}

/// What [`adequacy`] says.
#[derive(Debug, Clone)]
pub struct Adequacy {
    /// How often chance alone leaves residuals as conspicuous as these; `None` where the motion cannot be integrated.
    pub p_value: Option<f64>,
    /// What could have been seen.
    pub detectable: Vec<Detectable>,
}

/// Judges the base model's fit.
///
/// With `bootstraps` whole recordings are made from it and fitted anew, that many; otherwise only their residuals, to first order.
pub fn adequacy(
    context: &FitContext<'_>,
    null: &Refit<'_>,
    effects: &[Effect],
    bootstraps: usize,
    progress: &dyn Progress,
) -> Adequacy {
    let nothing = Adequacy { p_value: None, detectable: Vec::new() };
    let Some(screen) = Screen::at(context, null) else { return nothing };
    let scores = laws::scores(&screen, &laws::cheap_to_score(context, effects));
    let basis = &screen.projection.basis;
    // of the hysteresis, the best of several yield angles
    let is_fixed = |s: &&Score| !s.effect.is_scanned() && !s.effect.has_switching();
    let fixed: Vec<&Score> = scores.iter().filter(is_fixed).collect();
    let transform = FftPlanner::new().plan_fft_forward(basis.nrows());
    let statistics = |residual: &DVector<f64>| {
        let score = fixed
            .iter()
            .map(|s| {
                let pull = s.columns.tr_mul(residual);
                pull.dot(&(s.columns.tr_mul(&s.columns).try_inverse().map_or(pull.clone() * 0.0, |i| i * &pull)))
            })
            .fold(0.0, f64::max);
        let window =
            (0..residual.len() / WINDOW).map(|k| residual.rows(k * WINDOW, WINDOW).norm_squared()).fold(0.0, f64::max);
        let neighbours: f64 = (1..residual.len()).map(|i| residual[i] * residual[i - 1]).sum();
        let mean_square = residual.norm_squared() / residual.len() as f64;
        let mut spectrum: Vec<Complex<f64>> = residual.iter().map(|r| Complex::new(*r, 0.0)).collect();
        transform.process(&mut spectrum);
        let peak = spectrum[..residual.len() / 2 + 1].iter().map(Complex::norm_sqr).fold(0.0, f64::max);
        [
            score / mean_square,
            window / mean_square,
            peak / mean_square,
            (neighbours / residual.norm_squared().max(1e-300)).abs(),
        ]
    };
    let replicates: Vec<[f64; STATISTICS]> = if bootstraps > 0 {
        progress.begin("bootstraps", Some(bootstraps as u64));
        let of = |seed: u64| {
            let residual = replicate(context, null, seed);
            progress.advance(1);
            residual.map(|r| statistics(&r))
        };
        (0..bootstraps as u64).into_par_iter().filter_map(of).collect()
    } else {
        let of = |seed: u64| {
            let mut random = StdRng::seed_from_u64(seed);
            let noise = DVector::from_fn(basis.nrows(), |_, _| StandardNormal.sample(&mut random));
            statistics(&(&noise - basis * basis.tr_mul(&noise)))
        };
        (0..REPLICATES as u64).into_par_iter().map(of).collect()
    };
    let own = statistics(&screen.projection.residual);
    Adequacy {
        p_value: Some(ranked(&own, &replicates)),
        detectable: detectable(&scores, effects, &context.settings.verdict),
    }
}

/// The residuals, over the noise, of the base model fitted to a recording that it made itself, with noise as it was found.
fn replicate(context: &FitContext<'_>, null: &Refit<'_>, seed: u64) -> Option<DVector<f64>> {
    let mut random = StdRng::seed_from_u64(seed);
    let mut records = context.records.to_vec();
    for (index, record) in records.iter_mut().enumerate() {
        let values = null.problem.predict(index, &null.x, false).ok()?.values;
        let mut noise_rad: Vec<f64> = values.iter().map(|_| StandardNormal.sample(&mut random)).collect();
        Whitening::of(&null.problem, index, &values).colour(&mut noise_rad);
        for (value, noise_rad) in values.iter().zip(noise_rad) {
            record.theta_rad[value.link][value.row] = Some(value.predicted_rad + noise_rad);
        }
    }
    // what was measured beforehand would have come out otherwise, too
    let mut measured = context.on(&records);
    for belief in &mut measured.beliefs {
        let error: f64 = StandardNormal.sample(&mut random);
        belief.value = null.value(belief.parameter).unwrap_or(belief.value) + belief.sd * error;
    }
    measured.refit(&null.hypothesis, null, &[])?.linearised().map(|(residual, _)| residual)
}

/// The share of the recording and its replicates whose least rank among all of them is as small as the recording's.
fn ranked(own: &[f64; STATISTICS], replicates: &[[f64; STATISTICS]]) -> f64 {
    let all: Vec<&[f64; STATISTICS]> = std::iter::once(own).chain(replicates).collect();
    let rank = |of: &&[f64; STATISTICS]| {
        (0..STATISTICS).map(|s| all.iter().filter(|other| other[s] >= of[s]).count()).min().unwrap_or(all.len())
    };
    let ranks: Vec<usize> = all.par_iter().map(rank).collect();
    ranks.iter().filter(|rank| **rank <= ranks[0]).count() as f64 / all.len() as f64
}

/// The smallest detectable amount of each effect, and what it would be confused with.
pub fn detectable(scores: &[Score], effects: &[Effect], settings: &VerdictSettings) -> Vec<Detectable> {
    let of = |effect: &Effect| {
        let parameter = effect.parameters()[0];
        let Some(score) = scores.iter().find(|s| s.effect == *effect) else {
            return Detectable {
                effect: *effect,
                parameter,
                smallest: f64::INFINITY,
                named: f64::INFINITY,
                confused_with: Vec::new(),
            };
        };
        let confused = |other: &&Score| other.effect != *effect && together(score, other) > settings.confused;
        let nearest = scores.iter().filter(|o| o.effect != *effect).map(|o| together(score, o)).fold(0.0, f64::max);
        let apart = (1.0 - nearest * nearest).max(0.0).sqrt();
        Detectable {
            effect: *effect,
            parameter,
            smallest: settings.seen * score.sd,
            named: if apart > NEVER_TOLD { settings.named * score.sd / apart } else { f64::INFINITY },
            confused_with: scores.iter().filter(confused).map(|s| s.effect).collect(),
        }
    };
    effects.iter().map(of).collect()
}

/// How much of one effect's column others of another can make: the cosine between them.
fn together(one: &Score, other: &Score) -> f64 {
    let column = one.columns.column(0);
    let gram = other.columns.tr_mul(&other.columns);
    let along = other.columns.tr_mul(&column);
    let Some(inverse) = gram.try_inverse() else { return 0.0 };
    (along.dot(&(inverse * &along)) / column.norm_squared().max(1e-300)).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::base_priors::DampingAssumption;
    use crate::diagnose::preparation;
    use crate::diagnose::search::Search;
    use crate::diagnose::settings::Settings;
    use crate::diagnose::testing::{arm, swing};
    use crate::fit::Record;
    use crate::progress::Silent;

    /// The p-value of an arm's swing with something added to its angles, with so many bootstrap recordings.
    fn p_value(added_rad: impl Fn(f64) -> f64, bootstraps: usize) -> f64 {
        let experiment = arm("hinge_viscous = 2e-5\n");
        let (t_s, theta_rad) = swing(&experiment, 20.0, 30.0);
        let mut random = StdRng::seed_from_u64(5);
        let angles = t_s.iter().zip(theta_rad).map(|(t, theta_rad)| {
            let noise: f64 = StandardNormal.sample(&mut random);
            Some(theta_rad + added_rad(*t) + 5e-4 * noise)
        });
        let record = Record::uniform("made", t_s.clone(), vec![angles.collect()]);
        let settings = Settings::default();
        let prepared = preparation::prepare(&[record], &experiment, &settings).unwrap();
        let taken = DampingAssumption::AsStated;
        let search = Search::of_base_model(&prepared, &prepared.experiment, taken, &settings, &Silent).unwrap();
        adequacy(&search.context, search.base(), &search.effects, bootstraps, &Silent).p_value.unwrap()
    }

    #[test]
    fn a_line_that_dies_away_is_not_left_by_chance() {
        let line = |t: f64| 1.5e-3 * (-t / 4.0).exp() * (std::f64::consts::TAU * 7.0 * t).sin();
        assert!(p_value(line, 0) < Settings::default().verdict.chance);
        assert!(p_value(|_| 0.0, 0) > 0.05);
    }

    #[test]
    fn recordings_of_links_whose_masses_are_believed_are_made_anew() {
        assert!(p_value(|_| 0.0, 12) > 0.1);
    }
}
