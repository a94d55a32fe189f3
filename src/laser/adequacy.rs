//! Whether a candidate leaves only noise: its innovations must be white, even, without jumps, and say nothing in step with the lamp.

use std::f64::consts::TAU;

use rustfft::{FftPlanner, num_complex::Complex};
use serde::Serialize;

use super::fit::{Bench, Fit, Stage};
use super::search::BESIDE_EDGE_S;
use super::solve::{combined, solve};
use crate::identify::estimate::chi_squared_tail;

/// A record that leaves only noise fails one of the tests this often.
const FALSE_ALARM: f64 = 1e-5;
/// Forms are true to a hundredth of what they explain: the lamp's filament, higher modes and the strip's own shape are not in them. Less than that does not matter.
const MATTERS: f64 = 0.01;
/// The part of the spectrum that is looked at. What is faster than half the highest frequency of the grid, 4 Hz, is the strip's third and higher modes, which
/// move no mean.
const SLOW_PART: f64 = 0.5;
/// Bands of the spectrum: from the slowest line, each so many times as wide as the one before.
const BAND_RATIO: usize = 3;
/// Stretches of which the variance is compared.
const STRETCHES: usize = 48;
/// Of fewer values than this the median of the squares does not scatter as that of many (statistics).
const SHORTEST_STRETCH: usize = 20;
/// Of the median of n squares of a normal number, times n, over the square of their median: 1/(2 f(m) m)² of χ² with one degree of freedom.
const MEDIAN_VARIANCE: f64 = 5.43;
/// Ends of the stretches of time after an edge of the lamp, each of which may have a level of its own (s).
const AFTER_EDGE_S: [f64; 5] = [1.5, 4.0, 10.0, 25.0, 60.0];

/// One test of what is left.
#[derive(Debug, Clone, Serialize)]
pub struct Test {
    /// What it looks for.
    pub looks_for: &'static str,
    /// The probability that noise alone fares worse.
    pub p_value: f64,
    /// Where: Hz of a line, s of a jump.
    pub at: Option<f64>,
    /// Root mean square of the displacement that it finds (m).
    pub rms_m: f64,
}

/// All tests of a fit.
#[derive(Debug, Clone, Serialize)]
pub struct Adequacy {
    /// Whether what is left, beside noise, is too little to matter.
    pub adequate: bool,
    /// The least probability, made up for the number of tests.
    pub p_value: f64,
    /// Each.
    pub tests: Vec<Test>,
}

impl Adequacy {
    /// The largest that a failed test finds; what it looks for tells what is left.
    pub fn left(&self) -> Option<&Test> {
        let failed = self.tests.iter().filter(|test| test.p_value * (self.tests.len() as f64) < FALSE_ALARM);
        failed.max_by(|a, b| a.rms_m.total_cmp(&b.rms_m))
    }
}

/// Tests what a fit leaves.
pub fn adequacy(bench: &Bench<'_>, fit: &Fit) -> Adequacy {
    let stage = &bench.stage(fit.walk_m2_s);
    let held: Vec<f64> =
        fit.left.iter().zip(&bench.with.grid.count).filter(|(_, count)| **count > 0.0).map(|(v, _)| *v).collect();
    let cell_m = bench.cell_m();
    let mut tests = spectrum(bench, stage, &held);
    tests.push(variance(&slow_part(&held), cell_m));
    tests.push(jump(bench, stage, fit));
    tests.extend(in_step(bench, stage, fit));
    let least = tests.iter().map(|t| t.p_value).fold(1.0, f64::min);
    let p_value = 1.0 - (1.0 - least).powi(tests.len() as i32);
    let mut all = Adequacy { adequate: true, p_value, tests };
    all.adequate = all.left().is_none_or(|left| left.rms_m < MATTERS * bench.reach_m);
    all
}

/// Root mean square of a displacement that swings with a frequency, from what it adds to the sum of squares.
fn rms_m(bench: &Bench<'_>, stage: &Stage, hz: f64, chi2: f64) -> f64 {
    let grid = bench.with.grid;
    let swing: Vec<f64> = (0..grid.len()).map(|cell| (TAU * hz * grid.time_s(cell)).cos()).collect();
    let power: f64 = stage.filter.whiten(&swing).iter().map(|v| v * v).sum();
    (0.5 * chi2.max(0.0) / power.max(f64::MIN_POSITIVE)).sqrt()
}

/// Root mean square of what in a course is neither light nor a level.
fn rms_beside_light_m(bench: &Bench<'_>, course: &[f64]) -> f64 {
    let level = vec![1.0; course.len()];
    let left = solve(&[&level, &bench.base[0]], course, &[]).map_or(0.0, |solution| solution.chi2);
    (left / course.len() as f64).sqrt()
}

/// The lines of the spectrum of what is left, the mean first.
fn lines(left: &[f64]) -> Vec<Complex<f64>> {
    let mut values: Vec<Complex<f64>> = left.iter().map(|v| Complex::new(*v, 0.0)).collect();
    FftPlanner::new().plan_fft_forward(values.len()).process(&mut values);
    values
}

/// Number of lines beside the mean that are looked at.
fn slow_lines(count: usize) -> usize {
    (0.5 * SLOW_PART * count as f64) as usize
}

/// What is left without what is faster.
fn slow_part(left: &[f64]) -> Vec<f64> {
    let mut values = lines(left);
    let (count, kept) = (values.len(), slow_lines(values.len()));
    values[kept + 1..count - kept].fill(Complex::default());
    FftPlanner::new().plan_fft_inverse(count).process(&mut values);
    values.iter().map(|v| v.re / count as f64).collect()
}

/// A line anywhere, and more power than noise has in bands from the slowest on.
fn spectrum(bench: &Bench<'_>, stage: &Stage, left: &[f64]) -> Vec<Test> {
    let values = lines(left);
    let count = values.len() as f64;
    let mean = left.iter().map(|v| v * v).sum::<f64>() / count;
    // each is exponential with mean 1 for white noise
    let power: Vec<f64> = values[1..=slow_lines(values.len()).max(1)].iter().map(|v| v.norm_sqr() / count).collect();
    let hz = |k: usize| (k + 1) as f64 / (count * bench.with.grid.step_s);
    let strongest = (0..power.len()).max_by(|a, b| power[*a].total_cmp(&power[*b])).unwrap_or(0);
    let highest = power.get(strongest).copied().unwrap_or(0.0) / mean.max(1.0);
    let line = -f64::exp_m1(power.len() as f64 * f64::ln_1p(-(-highest).exp().min(1.0 - 1e-16)));
    let mut tests = vec![Test {
        looks_for: "a line in the spectrum",
        p_value: line.max(0.0),
        at: Some(hz(strongest)),
        rms_m: rms_m(bench, stage, hz(strongest), 2.0 * highest),
    }];
    let (mut from, mut width) = (0, 6);
    let mut worst = Test { looks_for: "slow structure", p_value: 1.0, at: None, rms_m: 0.0 };
    let mut bands = 0;
    while from + width <= power.len() {
        let sum: f64 = power[from..from + width].iter().sum();
        let p_value = chi_squared_tail(2.0 * sum, 2.0 * width as f64);
        if p_value < worst.p_value {
            let middle = hz(from + width / 2);
            let rms_m = rms_m(bench, stage, middle, 2.0 * (sum - width as f64));
            worst = Test { p_value, at: Some(middle), rms_m, ..worst };
        }
        bands += 1;
        from += width;
        width *= BAND_RATIO;
    }
    worst.p_value = 1.0 - (1.0 - worst.p_value).powi(bands.max(1));
    tests.push(worst);
    tests
}

/// Variance of the slow part that is not the same throughout. Of each stretch by the median of the squares: what rings for seconds after a knock, in modes that are
/// not followed, is no noise.
fn variance(left: &[f64], cell_m: f64) -> Test {
    let length = (left.len() / STRETCHES).max(SHORTEST_STRETCH);
    let usual = |part: &[f64]| {
        let mut squares: Vec<f64> = part.iter().map(|v| v * v).collect();
        crate::statistics::median(&mut squares).unwrap_or(0.0)
    };
    let parts: Vec<f64> = left.chunks(length).filter(|part| part.len() == length).map(usual).collect();
    let mean = parts.iter().sum::<f64>() / parts.len().max(1) as f64;
    let spread = MEDIAN_VARIANCE / (SLOW_PART * length as f64) * mean * mean;
    let chi2: f64 = parts.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / spread.max(f64::MIN_POSITIVE);
    let most = parts.iter().copied().fold(0.0, f64::max) / mean.max(f64::MIN_POSITIVE);
    Test {
        looks_for: "uneven noise",
        p_value: if parts.len() > 1 { chi_squared_tail(chi2, (parts.len() - 1) as f64) } else { 1.0 },
        at: None,
        rms_m: cell_m * (most - 1.0).max(0.0).sqrt(),
    }
}

/// A jump of the level, away from the lamp's edges.
fn jump(bench: &Bench<'_>, stage: &Stage, fit: &Fit) -> Test {
    let grid = bench.with.grid;
    let scan = stage.filter.jumps(&fit.left, 1);
    let steps =
        fit.members.iter().filter(|m| m.form == super::forms::Form::Step).map(|m| m.shape[0]).collect::<Vec<_>>();
    let is_free = |t_s: f64| {
        bench.with.lamp.nearest_s(t_s) > BESIDE_EDGE_S && steps.iter().all(|s| (s - t_s).abs() > BESIDE_EDGE_S)
    };
    let cells = (3..grid.len()).filter(|cell| is_free(grid.time_s(*cell)));
    let best = cells.max_by(|a, b| scan[*a].0.total_cmp(&scan[*b].0)).unwrap_or(0);
    let one = chi_squared_tail(scan[best].0, 1.0);
    Test {
        looks_for: "a jump",
        p_value: (one * grid.len() as f64).min(1.0),
        at: Some(grid.time_s(best)),
        rms_m: scan[best].1.abs(),
    }
}

/// Levels of their own for stretches after each kind of edge, and for each cycle.
fn in_step(bench: &Bench<'_>, stage: &Stage, fit: &Fit) -> Vec<Test> {
    let (grid, lamp) = (bench.with.grid, bench.with.lamp);
    let members = bench.whitened(stage, &fit.members);
    let plain: Vec<&[f64]> = stage.base.iter().chain(&members).map(Vec::as_slice).collect();
    let mut after: Vec<Vec<f64>> = Vec::new();
    for is_lit in [true, false] {
        for (k, end_s) in AFTER_EDGE_S.iter().enumerate() {
            let start_s = if k == 0 { 0.0 } else { AFTER_EDGE_S[k - 1] };
            let course = lamp.course(grid, |_, i| {
                f64::from(i.edges > 0 && i.is_lit == is_lit && i.since_s >= start_s && i.since_s < *end_s)
            });
            after.push(course);
        }
    }
    let cycles: Vec<Vec<f64>> = lamp.each(grid).into_iter().skip(1).collect();
    [("a course in step with the lamp", after), ("cycles that differ", cycles)]
        .into_iter()
        .filter(|(_, further)| !further.is_empty())
        .map(|(looks_for, further)| {
            let white = stage.filter.whiten_all(&further);
            let all: Vec<&[f64]> = plain.iter().copied().chain(white.iter().map(Vec::as_slice)).collect();
            let solution = solve(&all, &stage.y, &[]);
            let gained = solution.as_ref().map_or(0.0, |solution| fit.chi2 - solution.chi2);
            let course = solution.map_or_else(Vec::new, |solution| {
                combined(further.iter().zip(&solution.amplitude[plain.len()..]), grid.len())
            });
            Test {
                looks_for,
                p_value: chi_squared_tail(gained, further.len() as f64),
                at: None,
                rms_m: if course.is_empty() { 0.0 } else { rms_beside_light_m(bench, &course) },
            }
        })
        .collect()
}

/// The push of each cycle alone with its standard deviation, under a fit's forms.
pub fn push_of_each(bench: &Bench<'_>, fit: &Fit) -> Vec<[f64; 2]> {
    let stage = &bench.stage(fit.walk_m2_s);
    let members = bench.whitened(stage, &fit.members);
    let cycles = stage.filter.whiten_all(&bench.with.lamp.each(bench.with.grid));
    let all: Vec<&[f64]> = cycles.iter().chain(&stage.base[1..]).chain(&members).map(Vec::as_slice).collect();
    let Some(solution) = solve(&all, &stage.y, &[]) else { return Vec::new() };
    (0..cycles.len()).map(|k| [solution.amplitude[k], solution.covariance[(k, k)].max(0.0).sqrt()]).collect()
}
