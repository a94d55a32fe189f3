//! One step of the collocation: the accelerations at its stages, and their sensitivities.

use nalgebra::{DMatrix, DVector};

use super::balance::Balance;
use super::collocation::{RADAU, STAGES, Weights};
use super::elimination::Elimination;
use super::forward::Bearers;
use super::shapes::Shapes;
use super::{ForwardModel, Hinge, Partials};

/// Newton's iterations before a step is shortened.
const MOST_ITERATIONS: usize = 12;
/// Newton stops when the angles change by less than this part of the tolerance.
const NEWTON_SHARE: f64 = 1e-3;

/// An accepted step: a polynomial in time.
#[derive(Debug, Clone)]
pub struct Step {
    /// Its start.
    pub from_s: f64,
    /// Its length.
    pub length_s: f64,
    /// θ at the start.
    pub theta_rad: Vec<f64>,
    /// ω, then the laws' own variables, at the start.
    pub rate: Vec<f64>,
    /// Accelerations, stage after stage.
    pub stages: Vec<f64>,
    /// What the dry hinge does.
    pub hinge: Hinge,
    /// Derivatives, where asked for.
    pub slopes: Option<Slopes>,
}

/// A place in a step, with the polynomial's weights there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepPlace {
    tau: f64,
    angle: Weights,
    rate: Weights,
}

impl StepPlace {
    /// At τ = 0 … 1.
    pub fn at(tau: f64) -> Self {
        Self { tau, angle: RADAU.angle_weights(tau), rate: RADAU.rate_weights(tau) }
    }
}

/// Derivatives with parameters and initial values, one column each.
#[derive(Debug, Clone, PartialEq)]
pub struct Slopes {
    /// ∂θ at the step's start, n × columns.
    pub theta: DMatrix<f64>,
    /// ∂rate at the step's start, m × columns.
    pub rate: DMatrix<f64>,
    /// ∂acceleration, stage after stage, 5m × columns.
    pub stages: DMatrix<f64>,
}

impl Step {
    /// θ at τ = 0 … 1 of the step.
    pub fn theta_rad(&self, tau: f64) -> Vec<f64> {
        let weights = RADAU.angle_weights(tau);
        let h = self.length_s;
        (0..self.theta_rad.len())
            .map(|i| self.theta_rad[i] + h * tau * self.rate[i] + h * h * self.sum(&weights, i))
            .collect()
    }

    /// ω and the laws' own variables at τ.
    pub fn rate(&self, tau: f64) -> Vec<f64> {
        let weights = RADAU.rate_weights(tau);
        (0..self.rate.len()).map(|i| self.rate[i] + self.length_s * self.sum(&weights, i)).collect()
    }

    /// One rate at τ.
    pub fn one_rate(&self, i: usize, tau: f64) -> f64 {
        self.rate[i] + self.length_s * self.sum(&RADAU.rate_weights(tau), i)
    }

    /// Accelerations at τ.
    pub fn acceleration(&self, tau: f64) -> Vec<f64> {
        let weights = RADAU.basis(tau);
        (0..self.rate.len()).map(|i| self.sum(&weights, i)).collect()
    }

    /// Accelerations at the end.
    pub fn last_acceleration(&self) -> &[f64] {
        &self.stages[(STAGES - 1) * self.rate.len()..]
    }

    /// Adds `factor` times ∂θ of one link at a place of the step to `row`.
    pub fn add_angle_slopes(&self, link: usize, at: &StepPlace, factor: f64, row: &mut [f64]) {
        let Some(slopes) = &self.slopes else { return };
        let (m, h) = (self.rate.len(), self.length_s);
        for (column, value) in row.iter_mut().enumerate() {
            let stages = slopes.stages.column(column);
            let bent: f64 = at.angle.iter().enumerate().map(|(k, w)| w * stages[k * m + link]).sum();
            *value += factor * (slopes.theta[(link, column)] + h * at.tau * slopes.rate[(link, column)] + h * h * bent);
        }
    }

    /// θ and ω of one link at a place of the step.
    pub fn link(&self, link: usize, at: &StepPlace) -> (f64, f64) {
        let h = self.length_s;
        let theta = self.theta_rad[link] + h * at.tau * self.rate[link] + h * h * self.sum(&at.angle, link);
        (theta, self.rate[link] + h * self.sum(&at.rate, link))
    }

    /// Derivatives of θ and of the rates at τ.
    pub fn slopes(&self, tau: f64) -> Option<(DMatrix<f64>, DMatrix<f64>)> {
        let slopes = self.slopes.as_ref()?;
        let (n, m, h) = (self.theta_rad.len(), self.rate.len(), self.length_s);
        let (angle, rate) = (RADAU.angle_weights(tau), RADAU.rate_weights(tau));
        let sum = |weights: &Weights, i: usize, c: usize| -> f64 {
            weights.iter().enumerate().map(|(k, w)| w * slopes.stages[(k * m + i, c)]).sum()
        };
        let theta = DMatrix::from_fn(n, slopes.theta.ncols(), |i, c| {
            slopes.theta[(i, c)] + h * tau * slopes.rate[(i, c)] + h * h * sum(&angle, i, c)
        });
        let rate = DMatrix::from_fn(m, slopes.rate.ncols(), |i, c| slopes.rate[(i, c)] + h * sum(&rate, i, c));
        Some((theta, rate))
    }

    /// A step of coordinates as one of the links.
    #[must_use]
    pub fn of_links(self, shapes: &Shapes) -> Self {
        let columns = |values: &[f64], count: usize| DMatrix::from_column_slice(values.len() / count, count, values);
        let expanded = |values: &[f64], count| shapes.expanded(&columns(values, count)).as_slice().to_vec();
        let slopes = self.slopes.map(|slopes| {
            let count = slopes.theta.ncols();
            let stages = shapes.expanded(
                &slopes.stages.reshape_generic(nalgebra::Dyn(self.rate.len()), nalgebra::Dyn(STAGES * count)),
            );
            let rows = STAGES * stages.nrows();
            Slopes {
                theta: shapes.expanded(&slopes.theta),
                rate: shapes.expanded(&slopes.rate),
                stages: stages.reshape_generic(nalgebra::Dyn(rows), nalgebra::Dyn(count)),
            }
        });
        Self {
            theta_rad: expanded(&self.theta_rad, 1),
            rate: expanded(&self.rate, 1),
            stages: expanded(&self.stages, STAGES),
            slopes,
            ..self
        }
    }

    fn sum(&self, weights: &Weights, i: usize) -> f64 {
        let m = self.rate.len();
        weights.iter().enumerate().map(|(k, w)| w * self.stages[k * m + i]).sum()
    }
}

/// Solves for the stages of one step after another.
pub struct Stages<'a> {
    balance: Balance<'a>,
    /// θ, rates and accelerations at a stage.
    at: [Vec<f64>; 3],
    partials: Vec<Partials>,
    /// Q of every stage, scaled.
    residual: DVector<f64>,
    /// ∂Q/∂accelerations of all stages, scaled, row after row.
    matrix: Vec<f64>,
    elimination: Elimination,
    /// 1 / own inertia, by row.
    scale: Vec<f64>,
    /// What a unit of the laws' own variables is worth.
    hidden_rad: f64,
    /// The pace of the swing.
    characteristic_rad_s: f64,
}

/// Where a step begins.
pub struct Start<'a> {
    /// Time.
    pub from_s: f64,
    /// Coordinates.
    pub theta: &'a [f64],
    /// Rates.
    pub rate: &'a [f64],
    /// What the dry hinge does.
    pub hinge: Hinge,
    /// On which side of their corners the laws are.
    pub sides: &'a [f64],
}

impl<'a> Stages<'a> {
    /// For a model.
    pub fn new(model: &'a ForwardModel) -> Self {
        let balance = Balance::new(model);
        let (n, m) = (balance.count(), balance.rates());
        Self {
            at: [vec![0.0; n], vec![0.0; m], vec![0.0; m]],
            partials: vec![Partials::zero(n, m); STAGES],
            residual: DVector::zeros(STAGES * m),
            matrix: vec![0.0; STAGES * m * STAGES * m],
            elimination: Elimination::default(),
            scale: (0..m).map(|i| if i < n { 1.0 / balance.inertia_kg_m2(i) } else { 1.0 }).collect(),
            hidden_rad: model.hidden_rad(),
            characteristic_rad_s: model.characteristic_rad_s(),
            balance,
        }
    }

    /// Solves the balance at all stages for the accelerations `k`, from a first guess. `None` where Newton's method does not converge.
    pub fn solve(&mut self, start: &Start<'_>, length_s: f64, k: &mut DVector<f64>, tolerance_rad: f64) -> Option<()> {
        if !self.linearise(start, length_s, k) {
            return None;
        }
        let mut before = f64::INFINITY;
        for _ in 0..MOST_ITERATIONS {
            self.balance(start, length_s, k);
            self.elimination.solve_one(self.residual.as_mut_slice());
            *k -= &self.residual;
            let size_rad = length_s * length_s * self.residual.amax();
            if !size_rad.is_finite() {
                return None;
            }
            // the next change is at most this one times their ratio, which the first one does not tell
            let ratio = if before.is_finite() { size_rad / before } else { 1.0 };
            if size_rad * ratio.min(1.0) < NEWTON_SHARE * tolerance_rad || size_rad < 4.0 * f64::EPSILON {
                return Some(());
            }
            if ratio > 0.7 && before.is_finite() {
                return None;
            }
            before = size_rad;
        }
        None
    }

    /// Estimated error of a solved step's angles at its end, as far as they are seen (rad), after the filter that keeps it meaningful for stiff systems; `first`
    /// are the accelerations at its start.
    pub fn error_rad(&self, start: &Start<'_>, length_s: f64, k: &DVector<f64>, first: &[f64]) -> f64 {
        let (n, m) = (start.theta.len(), start.rate.len());
        let (h, gamma) = (length_s, RADAU.gamma * length_s);
        let estimate = |first: f64, stage: &dyn Fn(usize) -> f64| {
            h * (RADAU.gamma * first + (0..STAGES).map(|i| RADAU.error[i] * stage(i)).sum::<f64>())
        };
        let stage_rate = |i: usize, row: usize| {
            start.rate[row] + h * (0..STAGES).map(|j| RADAU.rate[i][j] * k[j * m + row]).sum::<f64>()
        };
        let angle = DVector::from_fn(n, |row, _| estimate(start.rate[row], &|i| stage_rate(i, row)));
        let rate = DVector::from_fn(m, |row, _| estimate(first[row], &|i| k[i * m + row]));
        let Partials { theta: with_theta, rate: with_rate, acceleration: inertia, .. } = &self.partials[0];
        let mut matrix = inertia + with_rate * gamma;
        let mut corner = matrix.columns_mut(0, n);
        corner += with_theta * (gamma * gamma);
        let right = inertia * &rate - with_theta * &angle * gamma;
        let Some(rate) = matrix.lu().solve(&right) else { return f64::INFINITY };
        let hidden = self.hidden_rad * rate.rows(n, m - n).amax();
        let (angle, rate) = (angle + rate.rows(0, n) * gamma, rate.rows(0, n).into_owned());
        self.balance.seen_rad(angle.as_slice(), rate.as_slice(), self.characteristic_rad_s).max(hidden)
    }

    /// Derivatives of a solved step's stages: exact for the numerical solution itself, as the balance holds at every stage.
    pub fn slopes(
        &mut self,
        start: &Start<'_>,
        length_s: f64,
        k: &DVector<f64>,
        parameters: &[Bearers],
        (theta, rate): (&DMatrix<f64>, &DMatrix<f64>),
    ) -> Option<DMatrix<f64>> {
        let (n, m, columns) = (theta.nrows(), rate.nrows(), theta.ncols());
        let mut right = vec![0.0; STAGES * m * columns];
        let mut q = vec![0.0; m];
        let mut moved = vec![0.0; n * columns];
        for stage in 0..STAGES {
            self.go_to(stage, start, length_s, k);
            self.balance.partials(&mut self.partials[stage]);
            self.fill_rows(stage, length_s);
            let partials = &self.partials[stage];
            let own = &mut right[stage * m * columns..(stage + 1) * m * columns];
            for (column, parameter) in parameters.iter().enumerate() {
                self.balance.sensitivity(parameter, partials, &mut q);
                for row in 0..m {
                    own[row * columns + column] = -q[row] * self.scale[row];
                }
            }
            let reach_s = length_s * RADAU.nodes[stage];
            for link in 0..n {
                for column in 0..columns {
                    moved[link * columns + column] = theta[(link, column)] + reach_s * rate[(link, column)];
                }
            }
            for (row, own) in own.chunks_exact_mut(columns).enumerate() {
                for j in 0..n {
                    let factor = partials.theta[(row, j)] * self.scale[row];
                    own.iter_mut().zip(&moved[j * columns..]).for_each(|(r, moved)| *r -= factor * moved);
                }
                for j in 0..m {
                    let factor = partials.rate[(row, j)] * self.scale[row];
                    own.iter_mut().zip(rate.row(j).iter()).for_each(|(r, rate)| *r -= factor * rate);
                }
            }
        }
        if !self.elimination.decompose(STAGES * m, &self.matrix) {
            return None;
        }
        self.elimination.solve(&mut right, columns);
        Some(DMatrix::from_row_slice(STAGES * m, columns, &right))
    }

    /// Linearises at the stages of a guess; whether the system has a solution.
    fn linearise(&mut self, start: &Start<'_>, length_s: f64, k: &DVector<f64>) -> bool {
        for stage in 0..STAGES {
            self.go_to(stage, start, length_s, k);
            self.balance.partials(&mut self.partials[stage]);
            self.fill_rows(stage, length_s);
        }
        self.elimination.decompose(self.residual.len(), &self.matrix)
    }

    /// ∂Qᵢ/∂kⱼ = δᵢⱼ ∂Q/∂acceleration + h wᵢⱼ ∂Q/∂rate + h² uᵢⱼ ∂Q/∂θ.
    fn fill_rows(&mut self, stage: usize, length_s: f64) {
        let partials = &self.partials[stage];
        let (n, m) = (partials.theta.ncols(), partials.rate.ncols());
        let rows = &mut self.matrix[stage * m * STAGES * m..(stage + 1) * m * STAGES * m];
        for (row, values) in rows.chunks_exact_mut(STAGES * m).enumerate() {
            let scale = self.scale[row];
            for (j, block) in values.chunks_exact_mut(m).enumerate() {
                let rate = scale * length_s * RADAU.rate[stage][j];
                let angle = scale * length_s * length_s * RADAU.angle[stage][j];
                for (column, value) in block.iter_mut().enumerate() {
                    *value = rate * partials.rate[(row, column)];
                    if column < n {
                        *value += angle * partials.theta[(row, column)];
                    }
                    if stage == j {
                        *value += scale * partials.acceleration[(row, column)];
                    }
                }
            }
        }
    }

    fn balance(&mut self, start: &Start<'_>, length_s: f64, k: &DVector<f64>) {
        let m = start.rate.len();
        for stage in 0..STAGES {
            self.go_to(stage, start, length_s, k);
            let mut rows = self.residual.rows_mut(stage * m, m);
            self.balance.torque(rows.as_mut_slice());
            for (value, scale) in rows.iter_mut().zip(&self.scale) {
                *value *= scale;
            }
        }
    }

    fn go_to(&mut self, stage: usize, start: &Start<'_>, length_s: f64, k: &DVector<f64>) {
        let (n, m, h) = (start.theta.len(), start.rate.len(), length_s);
        let (angle, rate) = (&RADAU.angle[stage], &RADAU.rate[stage]);
        let k = k.as_slice();
        let [at_theta, at_rate, at_acceleration] = &mut self.at;
        for i in 0..m {
            let (mut moved, mut sped) = (0.0, 0.0);
            for j in 0..STAGES {
                moved += angle[j] * k[j * m + i];
                sped += rate[j] * k[j * m + i];
            }
            at_rate[i] = start.rate[i] + h * sped;
            at_acceleration[i] = k[stage * m + i];
            if i < n {
                at_theta[i] = start.theta[i] + h * RADAU.nodes[stage] * start.rate[i] + h * h * moved;
            }
        }
        let t_s = start.from_s + h * RADAU.nodes[stage];
        self.balance.go_to(t_s, at_theta, (at_rate, at_acceleration), start.hinge, start.sides);
    }
}
