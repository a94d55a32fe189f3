//! Least squares of weighed torques, for every set of laws.

use nalgebra::{DMatrix, DVector};

/// How often the kinds of rows are put over what is left of them.
const REWEIGHTED: usize = 4;
/// Most laws of one set.
const MOST_LAWS: usize = 3;

/// Weighed torques of one kind: a row a bump, the base model's first, then the derivatives with each parameter.
pub type Block = DMatrix<f64>;

/// A parameter among the least squares.
pub struct Column {
    /// The value around which the torques are linear.
    pub from: f64,
    pub is_not_negative: bool,
    /// Value and standard deviation, where something is known.
    pub belief: Option<(f64, f64)>,
}

/// A set of laws with its solution.
#[derive(Clone)]
pub struct Set {
    /// Places among the laws.
    pub laws: Vec<usize>,
    /// Of the known parameters, then of the laws.
    pub values: Vec<f64>,
    pub chi2: f64,
}

/// Sums of squares of the weighed torques, each kind over what all laws together leave of it.
pub struct LeastSquares {
    /// XᵀX, in units in which its diagonal is one.
    normal: DMatrix<f64>,
    /// −Xᵀy.
    right: DVector<f64>,
    /// |y|².
    whole: f64,
    /// Norms of the columns of X.
    sizes: Vec<f64>,
    columns: Vec<Column>,
    rows: usize,
}

impl LeastSquares {
    /// Of some kinds of rows.
    pub fn of(mut blocks: Vec<Block>, columns: Vec<Column>) -> Self {
        let rms = |block: &Block, change: &[f64]| {
            let left = block.column(0) + block.columns(1, change.len()) * DVector::from_column_slice(change);
            (left.norm_squared() / left.len() as f64).sqrt()
        };
        let count = columns.len();
        let raw: Vec<f64> = blocks.iter().map(|block| rms(block, &vec![0.0; count])).collect();
        let mut scale = raw.clone();
        let mut squares = Self::summed(&mut blocks, &scale, columns);
        let all: Vec<usize> = (0..count).collect();
        for _ in 0..REWEIGHTED {
            let Some((solution, _)) = squares.solved(&all) else { break };
            let change: Vec<f64> = solution.iter().zip(&squares.columns).map(|(value, own)| value - own.from).collect();
            // the blocks are over their scale
            let left: Vec<f64> = blocks.iter().map(|block| rms(block, &change)).collect();
            let factor: Vec<f64> =
                left.iter().zip(&scale).zip(&raw).map(|((l, s), raw)| (l * s).max(1e-3 * raw) / s).collect();
            scale.iter_mut().zip(&factor).for_each(|(scale, factor)| *scale *= factor);
            squares = Self::summed(&mut blocks, &factor, squares.columns);
        }
        squares
    }

    /// The sums, the blocks first put over some scale.
    fn summed(blocks: &mut [Block], scale: &[f64], columns: Vec<Column>) -> Self {
        let count = columns.len();
        blocks.iter_mut().zip(scale).for_each(|(block, scale)| *block /= scale.max(1e-300));
        let mut all = DMatrix::<f64>::zeros(count + 1, count + 1);
        blocks.iter().for_each(|block| all += block.tr_mul(block));
        let sizes: Vec<f64> = (1..=count).map(|k| all[(k, k)].sqrt().max(1e-300)).collect();
        Self {
            normal: DMatrix::from_fn(count, count, |a, b| all[(a + 1, b + 1)] / (sizes[a] * sizes[b])),
            right: DVector::from_fn(count, |a, _| -all[(a + 1, 0)] / sizes[a]),
            whole: all[(0, 0)],
            sizes,
            columns,
            rows: blocks.iter().map(|block| block.nrows()).sum(),
        }
    }

    /// Values of some columns' parameters, and χ². What would fall below zero, and may not, is zero.
    fn solved(&self, of: &[usize]) -> Option<(Vec<f64>, f64)> {
        let mut at_bound: Vec<usize> = Vec::new();
        loop {
            let (change, chi2) = self.solved_with(of, &at_bound)?;
            let value = |(own, change): (&usize, &f64)| self.columns[*own].from + change;
            let values: Vec<f64> = of.iter().zip(&change).map(value).collect();
            let below = of
                .iter()
                .zip(&values)
                .find(|(own, value)| self.columns[**own].is_not_negative && **value < 0.0 && !at_bound.contains(*own));
            match below {
                Some((own, _)) => at_bound.push(*own),
                None => return Some((values, chi2)),
            }
        }
    }

    /// The same with some of them at zero: changes, in the parameters' units.
    fn solved_with(&self, of: &[usize], at_bound: &[usize]) -> Option<(Vec<f64>, f64)> {
        let free: Vec<usize> = of.iter().copied().filter(|own| !at_bound.contains(own)).collect();
        let count = free.len();
        let mut normal = DMatrix::from_fn(count, count, |a, b| self.normal[(free[a], free[b])]);
        let mut right = DVector::from_fn(count, |a, _| self.right[free[a]]);
        let mut whole = self.whole;
        let bound: Vec<(usize, f64)> = at_bound.iter().map(|k| (*k, -self.columns[*k].from * self.sizes[*k])).collect();
        for (k, change) in &bound {
            (0..count).for_each(|a| right[a] -= self.normal[(free[a], *k)] * change);
            whole -= 2.0 * self.right[*k] * change;
            whole += bound.iter().map(|(other, beside)| self.normal[(*k, *other)] * change * beside).sum::<f64>();
        }
        for (own, k) in free.iter().enumerate() {
            normal[(own, own)] += 1e-10;
            if let Some((known, sd)) = self.columns[*k].belief {
                let [off, sd] = [self.columns[*k].from - known, sd].map(|value| value * self.sizes[*k]);
                normal[(own, own)] += 1.0 / (sd * sd);
                right[own] -= off / (sd * sd);
                whole += (off / sd).powi(2);
            }
        }
        let solution = normal.cholesky()?.solve(&right);
        let chi2 = (whole - solution.dot(&right)).max(0.0);
        let change = |own: &usize| match free.iter().position(|k| k == own) {
            Some(place) => solution[place] / self.sizes[*own],
            None => -self.columns[*own].from,
        };
        Some((of.iter().map(change).collect(), chi2))
    }

    /// The sets of laws that leave least; the first `known` columns are the base model's, every other one is a law.
    pub fn best_sets(&self, known: usize, each: usize) -> Vec<Set> {
        let base: Vec<usize> = (0..known).collect();
        let Some((_, mut before)) = self.solved(&base) else { return Vec::new() };
        let mut found: Vec<Vec<Set>> = Vec::new();
        let mut sets: Vec<Vec<usize>> = vec![Vec::new()];
        for _ in 0..MOST_LAWS {
            let with_one_more = |set: &Vec<usize>| {
                let (set, next) = (set.clone(), set.last().map_or(0, |last| last + 1));
                (next..self.columns.len() - known).map(move |law| [set.as_slice(), &[law]].concat())
            };
            sets = sets.iter().flat_map(with_one_more).collect();
            let solved = |set: &Vec<usize>| {
                let columns: Vec<usize> = base.iter().copied().chain(set.iter().map(|law| known + law)).collect();
                let (values, chi2) = self.solved(&columns)?;
                // a law at its bound is none
                let acts = values[known..].iter().all(|value| *value != 0.0);
                acts.then(|| Set { laws: set.clone(), values, chi2 })
            };
            let mut solved: Vec<Set> = sets.iter().filter_map(solved).collect();
            solved.sort_by(|a, b| a.chi2.total_cmp(&b.chi2));
            // Schwarz's criterion; neighbouring bumps overlap by half
            let Some(least) = solved.first().map(|set| set.chi2) else { break };
            if 0.5 * (before - least) < (0.5 * self.rows as f64).ln() {
                break;
            }
            before = least;
            solved.truncate(each);
            found.push(solved);
        }
        found.iter_mut().rev().skip(1).for_each(|smaller| smaller.truncate(1));
        found.into_iter().rev().flatten().collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_laws_at_work_leave_least_and_a_negative_damper_is_none() {
        let rows = 400;
        let wave = |k: usize, n: f64| (0.1 * n * k as f64 + n).sin();
        // the base model's own parameter, dry friction and quadratic drag at work, linear drag not
        let torque = |k: usize| {
            -(0.5 * wave(k, 1.0) + 2.0 * wave(k, 2.0) - 3.0 * wave(k, 3.0) + 1.0 * wave(k, 4.0)) + 1e-3 * wave(k, 17.0)
        };
        let block = DMatrix::from_fn(rows, 5, |k, column| if column == 0 { torque(k) } else { wave(k, column as f64) });
        let column = |from: f64| Column { from, is_not_negative: true, belief: None };
        let squares = LeastSquares::of(vec![block], vec![column(1.0), column(0.0), column(0.0), column(0.0)]);
        let sets = squares.best_sets(1, 1);
        let best = &sets[0];
        assert_eq!(best.laws, [0, 2]);
        assert!((best.values[1] - 2.0).abs() < 0.1 && (best.values[2] - 1.0).abs() < 0.1, "{:?}", best.values);
    }
}
