//! Standard deviations and 95 % intervals of fitted parameters, and what the data do not determine.

use nalgebra::{DMatrix, DVector, SymmetricEigen};

use super::Problem;
use super::descent::{Block, Descent, Ending, Outcome};
use super::problem::stacked;
use crate::identify::estimate::NORMAL_QUANTILE as Z95;
use crate::model::Parameter;
use crate::progress::Progress;

/// χ² of one degree of freedom: 95 % lie below (statistics).
const CHI2_95: f64 = Z95 * Z95;
/// Lags over which residuals are tested for correlation (judgement), and their χ² at 0.1 % (statistics).
const LAGS: usize = 10;
const CHI2_LAGS: f64 = 29.59;
/// Points of a profile tried for each end of an interval (cost).
const PROFILE_POINTS: usize = 8;
/// Variance of what is left, over the noise's, beyond which an interval is the curvature's: the model is wrong by more than it can tell (judgement:
/// five times the noise).
const FAR_FROM_NOISE: f64 = 25.0;
/// A combination of parameters is not determined when its logarithm is less certain than this (judgement: a factor e).
const UNDETERMINED: f64 = 1.0;

/// A fitted parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// Which.
    pub parameter: Parameter,
    /// Least squares.
    pub value: f64,
    /// Standard deviation, from the curvature of the least squares; no larger than that of a normal error with the interval below.
    pub sd: f64,
    /// 95 % interval; from the profile of the likelihood where the curvature alone would mislead, or a bound cuts it.
    pub low: f64,
    /// Upper end.
    pub high: f64,
    /// Whether the bound holds it.
    pub at_bound: bool,
}

impl Estimate {
    /// Whether the interval excludes zero.
    pub fn is_determined(&self) -> bool {
        self.low > 0.0 || self.high < 0.0
    }
}

/// What is known about the parameters.
#[derive(Debug, Clone)]
pub(super) struct Uncertainty {
    pub estimates: Vec<Estimate>,
    pub correlation: DMatrix<f64>,
    pub undetermined: Vec<Vec<(Parameter, f64)>>,
    pub coloured: bool,
}

/// From the blocks at the minimum:
///
/// ```text
/// white residuals      cov = s² (JᵀJ)⁻¹                                   s² = Σr²/(N − p)
/// correlated           cov = (JᵀJ)⁻¹ [Σₗ wₗ Σₜ gₜ gₜ₊ₗᵀ] (JᵀJ)⁻¹          gₜ = Jₜᵀ rₜ,  w Bartlett's (Newey and West 1987)
/// ```
pub(super) fn uncertainty(problem: &Problem<'_>, outcome: &Outcome, progress: &dyn Progress) -> Uncertainty {
    let free = problem.free.len();
    let lower = problem.lower();
    let freedom = outcome.residuals().saturating_sub(outcome.x.len()).max(1) as f64;
    let variance = outcome.cost / freedom;
    let inverse = inverse_of(&outcome.normal);
    let coloured = is_coloured(problem, outcome);
    let white = &inverse * variance;
    let covariance = if coloured { widened(problem, outcome, &inverse, &white) } else { white };
    let sd: Vec<f64> = (0..outcome.x.len()).map(|i| covariance[(i, i)].max(0.0).sqrt()).collect();
    let correlation = DMatrix::from_fn(free, free, |i, j| covariance[(i, j)] / (sd[i] * sd[j]).max(1e-300));
    let estimates = (0..free)
        .map(|i| {
            let profile =
                Profile { problem, outcome, inverse: &inverse, variance, index: i, sd: sd[i], lower: lower[i] };
            let [low, high] = [-1.0, 1.0].map(|side| profile.end(side));
            progress.advance(1);
            let at_bound = outcome.x[i] <= lower[i];
            // the curvature of a narrow, bent valley is not its width
            let of_interval = (high - low) / (2.0 * Z95);
            let sd = if at_bound || !of_interval.is_finite() { sd[i] } else { sd[i].min(of_interval) };
            Estimate { parameter: problem.free[i], value: outcome.x[i], sd, low, high, at_bound }
        })
        .collect();
    Uncertainty { estimates, correlation, undetermined: undetermined(problem, outcome, &covariance), coloured }
}

/// The inverse of JᵀJ, scaled to a unit diagonal first; directions without any information get a very large variance.
fn inverse_of(normal: &DMatrix<f64>) -> DMatrix<f64> {
    let n = normal.nrows();
    let scale = DVector::from_fn(n, |i, _| 1.0 / normal[(i, i)].max(1e-300).sqrt());
    let unit = DMatrix::from_fn(n, n, |i, j| normal[(i, j)] * scale[i] * scale[j]);
    let eigen = SymmetricEigen::new(unit);
    let values = eigen.eigenvalues.map(|v| 1.0 / v.max(1e-14));
    let inverse = &eigen.eigenvectors * DMatrix::from_diagonal(&values) * eigen.eigenvectors.transpose();
    DMatrix::from_fn(n, n, |i, j| inverse[(i, j)] * scale[i] * scale[j])
}

/// Ljung and Box's test of the residuals of every angle, at 0.1 %.
fn is_coloured(problem: &Problem<'_>, outcome: &Outcome) -> bool {
    blocks_of_recordings(problem, outcome).any(|(record, block)| {
        links_of(problem, record).into_iter().any(|rows| {
            let r: Vec<f64> = rows.map(|row| block.residual[row]).collect();
            let n = r.len();
            if n < 5 * LAGS {
                return false;
            }
            let power: f64 = r.iter().map(|v| v * v).sum();
            let part = |lag: usize| (lag..n).map(|i| r[i] * r[i - lag]).sum::<f64>() / power;
            let q: f64 = (1..=LAGS).map(|lag| part(lag).powi(2) / (n - lag) as f64).sum::<f64>() * (n * (n + 2)) as f64;
            q > CHI2_LAGS
        })
    })
}

/// The block of each recording. After them stand those of what is known beforehand, which are no residuals in time.
fn blocks_of_recordings<'o>(problem: &Problem<'_>, outcome: &'o Outcome) -> impl Iterator<Item = (usize, &'o Block)> {
    outcome.blocks.iter().take(problem.records.len()).enumerate()
}

/// The rows of each angle in a recording's block.
fn links_of(problem: &Problem<'_>, record: usize) -> Vec<std::ops::Range<usize>> {
    let mut first = 0;
    let data = &problem.records[record];
    data.theta_rad
        .iter()
        .map(|angles| {
            let count = angles.iter().flatten().count();
            first += count;
            first - count..first
        })
        .collect()
}

fn widened(problem: &Problem<'_>, outcome: &Outcome, inverse: &DMatrix<f64>, white: &DMatrix<f64>) -> DMatrix<f64> {
    let variables = outcome.x.len();
    let (residual, slopes) = stacked(&outcome.blocks, variables);
    let mut middle = DMatrix::zeros(variables, variables);
    let mut first = 0;
    for (record, block) in blocks_of_recordings(problem, outcome) {
        let data = &problem.records[record];
        let step_s = (data.t_s[data.len() - 1] - data.t_s[0]) / (data.len() - 1).max(1) as f64;
        let characteristic_rad_s = problem
            .model(record, &outcome.x[..problem.free.len()])
            .map_or(9.0, |(model, _)| model.characteristic_rad_s());
        // a swing and a half
        let lags = (1.5 * std::f64::consts::TAU / characteristic_rad_s / step_s).ceil() as usize;
        // the angles of one instant belong together
        let mut scores = DMatrix::<f64>::zeros(variables, data.len());
        for (link, rows) in links_of(problem, record).into_iter().enumerate() {
            let measured = (0..data.len()).filter(|row| data.theta_rad[link][*row].is_some());
            for (row, instant) in rows.zip(measured) {
                let at = first + row;
                for i in 0..variables {
                    scores[(i, instant)] += slopes[(at, i)] * residual[at];
                }
            }
        }
        middle += &scores * scores.transpose();
        for lag in 1..=lags.min(data.len() / 4) {
            let weight = 1.0 - lag as f64 / (lags + 1) as f64;
            let count = data.len() - lag;
            let product: DMatrix<f64> = scores.columns(lag, count) * scores.columns(0, count).transpose();
            middle += (&product + product.transpose()) * weight;
        }
        first += block.residual.len();
    }
    let robust = inverse * middle * inverse;
    // never narrower than white residuals of the same size
    let factor = DVector::from_fn(variables, |i, _| (robust[(i, i)] / white[(i, i)].max(1e-300)).max(1.0).sqrt());
    DMatrix::from_fn(variables, variables, |i, j| white[(i, j)] * factor[i] * factor[j])
}

/// How the least squares rise when one parameter is moved, all others following.
struct Profile<'a, 'b> {
    problem: &'a Problem<'b>,
    outcome: &'a Outcome,
    inverse: &'a DMatrix<f64>,
    variance: f64,
    index: usize,
    /// With correlated residuals wider than the curvature's.
    sd: f64,
    lower: f64,
}

impl Profile<'_, '_> {
    /// The end of the 95 % interval towards one side.
    fn end(&self, side: f64) -> f64 {
        let value = self.outcome.x[self.index];
        if self.outcome.ending != Ending::Converged || self.variance > FAR_FROM_NOISE {
            // there is no minimum to follow a profile from, or it is that of a model that is wrong
            return (value + side * Z95 * self.sd).max(self.lower);
        }
        let curved = (self.inverse[(self.index, self.index)] * self.variance).sqrt();
        let widening = (self.sd / curved.max(1e-300)).max(1.0);
        let limit = CHI2_95 * self.variance * widening * widening;
        let quadratic = value + side * Z95 * self.sd;
        if quadratic > self.lower {
            // along the line of the curvature the rise is at least the profile's
            let rise = self.problem.cost(&self.on_line(quadratic)) - self.outcome.cost;
            if (rise / limit - 1.0).abs() < 0.1 {
                return quadratic;
            }
        }
        self.search(side, limit)
    }

    /// Follows the profile outwards until its rise is the limit, or to the bound.
    fn search(&self, side: f64, limit: f64) -> f64 {
        let value = self.outcome.x[self.index];
        let place = |root: f64| (value + side * root * Z95 * self.sd).max(self.lower);
        // the root of the rise over the limit grows in proportion to the distance where the surface is quadratic
        let (mut inside, mut outside, mut guess) = (0.0, None, 1.0);
        let mut start = self.outcome.x.clone();
        for _ in 0..PROFILE_POINTS {
            let at = place(guess);
            let (rise, x) = self.rise(at, &start);
            let root = (rise.max(0.0) / limit).sqrt();
            if (root - 1.0).abs() < 0.03 || (at <= self.lower && root < 1.0) {
                return at;
            }
            if root < 1.0 {
                (inside, start) = (guess, x);
            } else {
                outside = Some(guess);
            }
            let straight = guess / root.max(0.2);
            guess = match outside {
                Some(outside) if !(straight > inside && straight < outside) => 0.5 * (inside + outside),
                Some(_) => straight,
                None => straight.min(4.0 * guess),
            };
        }
        place(outside.unwrap_or(guess))
    }

    /// The variables with this one at a value and all others on the line of the curvature.
    fn on_line(&self, at: f64) -> Vec<f64> {
        let step = at - self.outcome.x[self.index];
        let own = self.inverse[(self.index, self.index)];
        let lower = self.problem.lower();
        let moved = |i: usize| self.outcome.x[i] + step * self.inverse[(i, self.index)] / own;
        (0..self.outcome.x.len()).map(|i| moved(i).max(lower[i])).collect()
    }

    /// Σr² with the parameter at a value and all others at their best, less that at the minimum; and these best values.
    fn rise(&self, at: f64, start: &[f64]) -> (f64, Vec<f64>) {
        let descent = Descent { most_steps: 12, enough: 0.05, fixed: Some(self.index), ..Descent::default() };
        let lower = self.problem.lower();
        let line = self.on_line(at);
        let mut near = start.to_vec();
        near[self.index] = at;
        let begin = if self.problem.cost(&line) < self.problem.cost(&near) { line } else { near };
        match descent.run(begin, &lower, |x| self.problem.blocks(x)) {
            Some(outcome) => (outcome.cost - self.outcome.cost, outcome.x),
            None => (f64::INFINITY, start.to_vec()),
        }
    }
}

/// Directions in the logarithms of the parameters that are less certain than a factor e.
fn undetermined(problem: &Problem<'_>, outcome: &Outcome, covariance: &DMatrix<f64>) -> Vec<Vec<(Parameter, f64)>> {
    let free = problem.free.len();
    if free == 0 {
        return Vec::new();
    }
    let size = |i: usize| outcome.x[i].abs().max(1e-300);
    let relative = DMatrix::from_fn(free, free, |i, j| covariance[(i, j)] / (size(i) * size(j)));
    let clamped = relative.map(|v| v.clamp(-1e12, 1e12));
    let eigen = SymmetricEigen::new(clamped);
    (0..free)
        .filter(|k| eigen.eigenvalues[*k].max(0.0).sqrt() > UNDETERMINED)
        .map(|k| {
            let shares = (0..free).map(|i| (problem.free[i], eigen.eigenvectors[(i, k)]));
            shares.filter(|(_, share)| share.abs() > 0.1).collect()
        })
        .collect()
}
