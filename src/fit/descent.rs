//! Least squares by the method of Levenberg and Marquardt, with lower bounds and Huber's weights.
//!
//! The residuals come in blocks, each of which depends on a few of the variables; so a fit with many initial states stays small.

use nalgebra::{DMatrix, DVector};

/// Some residuals, in units of their standard deviation, and their derivatives with the variables in `columns`.
#[derive(Debug, Clone)]
pub struct Block {
    /// Which variables.
    pub columns: Vec<usize>,
    /// r.
    pub residual: DVector<f64>,
    /// ∂r, one column each of `columns`.
    pub slopes: DMatrix<f64>,
    /// Whether outliers are expected here.
    pub robust: bool,
}

/// After a failed step the damping grows so many times, after the next one so many times faster, from a first damping that may be eight decades too small.
const GROWTH: f64 = 4.0;

/// Settings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Descent {
    /// Residuals beyond this many standard deviations count linearly; infinite for plain least squares.
    pub huber: f64,
    /// Most steps, failed ones included.
    pub most_steps: usize,
    /// It has converged when the next step promises less than this part of the mean square (χ² of about one is then this many variances).
    pub enough: f64,
    /// A variable that is to stay where it is.
    pub fixed: Option<usize>,
    /// A start that costs more is no start.
    pub worst_start: f64,
    /// After so many steps it ends unless it has come below this cost.
    pub judged: Option<(usize, f64)>,
    /// Damping of the first step, in units of the normal matrix' diagonal: small where the start is known to be near.
    pub damping: f64,
}

impl Default for Descent {
    fn default() -> Self {
        Self {
            huber: f64::INFINITY,
            most_steps: 60,
            enough: 1e-5,
            fixed: None,
            worst_start: f64::INFINITY,
            judged: None,
            damping: 1e-4,
        }
    }
}

/// So many variances lie between a least and one standard deviation of one variable from it: what promises less is there (statistics).
const WITHIN_ONE_SD: f64 = 1.0;
/// Damping that only keeps what the residuals say nothing of where it is (numerics).
const UNDAMPED: f64 = 1e-8;
/// Residuals beyond this many standard deviations count linearly where outliers are expected (judgement: of normal noise one value in 16 000).
const OUTLIER: f64 = 4.0;

impl Descent {
    /// With outliers bounded by Huber's weights.
    pub fn robust(most_steps: usize, enough: f64) -> Self {
        Self { huber: OUTLIER, most_steps, enough, ..Self::default() }
    }
}

/// How it ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ending {
    /// No step, however long, promises anything more.
    Converged,
    /// After the most steps.
    StepLimit,
    /// No step makes it better, though one should.
    Stuck,
}

/// Where it ended.
#[derive(Debug, Clone)]
pub struct Outcome {
    /// The variables.
    pub x: Vec<f64>,
    /// Σ r², with Huber's weights.
    pub cost: f64,
    /// The blocks there.
    pub blocks: Vec<Block>,
    /// JᵀJ, weighted.
    pub normal: DMatrix<f64>,
    /// Steps taken.
    pub steps: usize,
    /// How.
    pub ending: Ending,
    /// Damping of the next step.
    pub damping: f64,
}

impl Outcome {
    /// Number of residuals.
    pub fn residuals(&self) -> usize {
        self.blocks.iter().map(|b| b.residual.len()).sum()
    }
}

struct Normals {
    cost: f64,
    matrix: DMatrix<f64>,
    gradient: DVector<f64>,
}

impl Normals {
    /// By how much a step lowers the cost in linear approximation.
    fn promised(&self, step: &DVector<f64>) -> f64 {
        -2.0 * self.gradient.dot(step) - step.dot(&(&self.matrix * step))
    }
}

impl Descent {
    /// Descends from `x`. `evaluate` gives the blocks at a place, or `None` where there are none. `lower` holds a bound each variable.
    ///
    /// Returns `None` where even the start cannot be evaluated, or is too bad.
    pub fn run(
        &self,
        x: Vec<f64>,
        lower: &[f64],
        mut evaluate: impl FnMut(&[f64]) -> Option<Vec<Block>>,
    ) -> Option<Outcome> {
        let mut x = x;
        let mut blocks = evaluate(&x)?;
        let mut normals = self.normals(&blocks, x.len());
        if normals.cost > self.worst_start {
            return None;
        }
        let (mut damping, mut growth) = (self.damping, GROWTH);
        let mut ending = Ending::StepLimit;
        let mut steps = 0;
        while steps < self.most_steps {
            if self.judged.is_some_and(|(after, bound)| steps == after && normals.cost >= bound) {
                break;
            }
            steps += 1;
            let Some(taken) = self.step_within(&normals, &x, lower, damping) else {
                damping *= 10.0;
                continue;
            };
            let moved: Vec<f64> =
                x.iter().zip(taken.iter()).zip(lower).map(|((x, s), low)| (x + s).max(*low)).collect();
            let promised = normals.promised(&taken);
            let mean_square = normals.cost / blocks.iter().map(|b| b.residual.len()).sum::<usize>().max(1) as f64;
            if !(promised > self.enough * mean_square) {
                ending =
                    if self.is_at_least(&normals, &x, lower, mean_square) { Ending::Converged } else { Ending::Stuck };
                break;
            }
            let trial = evaluate(&moved).map(|blocks| (self.normals(&blocks, x.len()), blocks));
            match trial {
                Some((trial, trial_blocks)) if trial.cost < normals.cost => {
                    let gain = (normals.cost - trial.cost) / promised;
                    damping = (damping * (1.0 - (2.0 * gain - 1.0).powi(3)).max(0.1)).max(1e-12);
                    growth = GROWTH;
                    (x, blocks, normals) = (moved, trial_blocks, trial);
                }
                _ => {
                    damping *= growth;
                    growth *= GROWTH;
                    if damping > 1e12 {
                        ending = Ending::Stuck;
                        break;
                    }
                }
            }
        }
        Some(Outcome { x, cost: normals.cost, blocks, normal: normals.matrix, steps, ending, damping })
    }

    fn normals(&self, blocks: &[Block], count: usize) -> Normals {
        let mut normals = Normals { cost: 0.0, matrix: DMatrix::zeros(count, count), gradient: DVector::zeros(count) };
        for block in blocks {
            let mut residual = block.residual.clone();
            let mut slopes = block.slopes.clone();
            for row in 0..residual.len() {
                let size = residual[row].abs();
                if block.robust && size > self.huber {
                    normals.cost += self.huber * (2.0 * size - self.huber);
                    let weight = (self.huber / size).sqrt();
                    residual[row] *= weight;
                    slopes.row_mut(row).scale_mut(weight);
                } else {
                    normals.cost += size * size;
                }
            }
            let gradient = slopes.tr_mul(&residual);
            let square = slopes.tr_mul(&slopes);
            for (a, i) in block.columns.iter().enumerate() {
                normals.gradient[*i] += gradient[a];
                for (b, j) in block.columns.iter().enumerate() {
                    normals.matrix[(*i, *j)] += square[(a, b)];
                }
            }
        }
        normals
    }

    /// Whether a step without further damping promises next to nothing, too: a short one does everywhere.
    fn is_at_least(&self, normals: &Normals, x: &[f64], lower: &[f64], mean_square: f64) -> bool {
        let full = self.step_within(normals, x, lower, UNDAMPED);
        full.is_some_and(|step| normals.promised(&step) <= self.enough.max(WITHIN_ONE_SD) * mean_square)
    }

    /// The damped step that stays within the bounds: variables that would cross theirs stop there, and the others follow.
    fn step_within(&self, normals: &Normals, x: &[f64], lower: &[f64], damping: f64) -> Option<DVector<f64>> {
        let held = |i: usize| self.fixed == Some(i) || (x[i] <= lower[i] && normals.gradient[i] > 0.0);
        let mut stopped: Vec<Option<f64>> = (0..x.len()).map(|i| held(i).then_some(0.0)).collect();
        loop {
            let step = damped_step(&normals.matrix, &normals.gradient, &stopped, damping)?;
            let crossing: Vec<usize> =
                (0..x.len()).filter(|i| stopped[*i].is_none() && x[*i] + step[*i] < lower[*i]).collect();
            if crossing.is_empty() {
                return Some(step);
            }
            crossing.into_iter().for_each(|i| stopped[i] = Some(lower[i] - x[i]));
        }
    }
}

/// Solves (N + λ diag N) step = −gradient for the variables whose step is not given.
pub fn damped_step(
    matrix: &DMatrix<f64>,
    gradient: &DVector<f64>,
    given: &[Option<f64>],
    damping: f64,
) -> Option<DVector<f64>> {
    let count = given.len();
    let scale: Vec<f64> = (0..count).map(|i| matrix[(i, i)].max(1e-300).sqrt()).collect();
    let damped = DMatrix::from_fn(count, count, |i, j| {
        if given[i].is_some() || given[j].is_some() {
            return f64::from(u8::from(i == j));
        }
        let extra = if i == j { damping } else { 0.0 };
        matrix[(i, j)] / (scale[i] * scale[j]) + extra
    });
    let carried = |i: usize| (0..count).map(|j| matrix[(i, j)] * given[j].unwrap_or(0.0)).sum::<f64>();
    let right = DVector::from_fn(count, |i, _| match given[i] {
        Some(step) => step * scale[i],
        None => -(gradient[i] + carried(i)) / scale[i],
    });
    let solved = damped.cholesky()?.solve(&right);
    solved.iter().all(|v| v.is_finite()).then(|| DVector::from_fn(count, |i, _| solved[i] / scale[i]))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rosenbrock's valley as two residuals.
    fn valley(x: &[f64]) -> Option<Vec<Block>> {
        Some(vec![Block {
            columns: vec![0, 1],
            residual: DVector::from_vec(vec![10.0 * (x[1] - x[0] * x[0]), 1.0 - x[0]]),
            slopes: DMatrix::from_row_slice(2, 2, &[-20.0 * x[0], 10.0, -1.0, 0.0]),
            robust: true,
        }])
    }

    #[test]
    fn it_walks_down_the_curved_valley() {
        let settings = Descent { enough: 1e-12, ..Descent::default() };
        let outcome = settings.run(vec![-1.2, 1.0], &[f64::NEG_INFINITY; 2], valley).unwrap();
        assert!((outcome.x[0] - 1.0).abs() < 1e-6 && (outcome.x[1] - 1.0).abs() < 1e-6, "{outcome:?}");
    }

    #[test]
    fn a_descent_that_creeps_along_a_bent_valley_has_not_converged() {
        let steep = |x: &[f64]| {
            let mut blocks = valley(x)?;
            blocks[0].residual[0] *= 30.0;
            blocks[0].slopes.row_mut(0).scale_mut(30.0);
            Some(blocks)
        };
        let coarse = Descent { enough: 0.02, damping: 1e-8, ..Descent::default() };
        let outcome = coarse.run(vec![-1.2, 1.44], &[f64::NEG_INFINITY; 2], steep).unwrap();
        assert!(outcome.cost > 4.0 && outcome.ending == Ending::Stuck, "{outcome:?}");
        let fine = Descent { enough: 1e-12, most_steps: 5000, ..coarse };
        let outcome = fine.run(vec![0.9, 0.81], &[f64::NEG_INFINITY; 2], steep).unwrap();
        assert_eq!(outcome.ending, Ending::Converged, "{outcome:?}");
    }

    #[test]
    fn a_bound_holds_and_lets_go() {
        let outcome = Descent::default().run(vec![3.0, 4.0], &[f64::NEG_INFINITY, 2.25], valley).unwrap();
        assert!((outcome.x[1] - 2.25).abs() < 1e-9 && (outcome.x[0] - 1.5).abs() < 2e-3, "{outcome:?}");
    }

    #[test]
    fn a_descent_that_is_judged_goes_on_only_below_its_bound() {
        let ended = |bound: f64| {
            let judged = Descent { judged: Some((2, bound)), ..Descent::default() };
            let outcome = judged.run(vec![-1.2, 1.0], &[f64::NEG_INFINITY; 2], valley).unwrap();
            (outcome.steps, outcome.ending)
        };
        assert_eq!(ended(0.0), (2, Ending::StepLimit));
        let (steps, ending) = ended(f64::INFINITY);
        assert!(steps > 2 && ending == Ending::Converged);
    }

    #[test]
    fn a_descent_goes_on_with_its_damping() {
        // where a full step overshoots, one that forgets how much it had damped tries it again and again
        let few = Descent { most_steps: 4, damping: 1e-8, enough: 1e-12, ..Descent::default() };
        let begun = few.run(vec![-1.2, 1.0], &[f64::NEG_INFINITY; 2], valley).unwrap();
        let in_turns = |keeps: bool| {
            let mut own = begun.clone();
            let mut turns = 0;
            while own.ending != Ending::Converged && turns < 50 {
                let damping = if keeps { own.damping } else { few.damping };
                own = Descent { damping, ..few }.run(own.x, &[f64::NEG_INFINITY; 2], valley).unwrap();
                turns += 1;
            }
            turns
        };
        assert!(in_turns(true) < in_turns(false), "{} {}", in_turns(true), in_turns(false));
    }

    #[test]
    fn one_wild_value_does_not_carry_the_mean_away() {
        let values = [1.0, 1.1, 0.9, 1.05, 0.95, 50.0];
        let mean = |x: &[f64]| {
            let residual = DVector::from_iterator(6, values.iter().map(|v| (x[0] - v) / 0.1));
            Some(vec![Block { columns: vec![0], residual, slopes: DMatrix::from_element(6, 1, 10.0), robust: true }])
        };
        let robust = Descent { huber: 2.0, ..Descent::default() }.run(vec![0.0], &[-9.0], mean).unwrap();
        assert!((robust.x[0] - 1.04).abs() < 0.01, "{robust:?}");
    }
}
