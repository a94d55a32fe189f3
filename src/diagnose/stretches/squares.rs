//! Least squares of what stretches leave, for every set of laws.

use nalgebra::{DMatrix, DVector};

/// A parameter among the least squares.
pub struct Column {
    /// The value around which the motion is linear.
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

/// Sums of squares of what the stretches leave, over what all laws together leave: the base model's residual, then the derivatives with each parameter.
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
    independent: usize,
}

impl LeastSquares {
    /// Of the rows of all stretches, which hold so many values that do not go together.
    pub fn of(stretches: &[DMatrix<f64>], columns: Vec<Column>, independent: usize) -> Self {
        let count = columns.len();
        let mut all = DMatrix::<f64>::zeros(count + 1, count + 1);
        stretches.iter().for_each(|rows| all += rows.tr_mul(rows));
        let sizes: Vec<f64> = (1..=count).map(|k| all[(k, k)].sqrt().max(1e-300)).collect();
        let raw = Self {
            normal: DMatrix::from_fn(count, count, |a, b| all[(a + 1, b + 1)] / (sizes[a] * sizes[b])),
            right: DVector::from_fn(count, |a, _| -all[(a + 1, 0)] / sizes[a]),
            whole: all[(0, 0)],
            sizes,
            columns,
            independent,
        };
        // what all laws leave is the variance
        let everything: Vec<usize> = (0..count).collect();
        let least = raw.solved(&everything).map_or(raw.whole, |(_, chi2)| chi2).max(1e-9 * raw.whole);
        let scale = (least / independent.max(1) as f64).sqrt().max(1e-300);
        let sizes = raw.sizes.iter().map(|size| size / scale).collect();
        Self { right: raw.right / scale, whole: raw.whole / (scale * scale), sizes, ..raw }
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

    /// The sets of at most so many laws that leave least, `each` of the largest number that is worth it and one of every smaller one; the first `known` columns are
    /// the base model's, every other one is a law.
    pub fn best_sets(&self, known: usize, (most, each): (usize, usize)) -> Vec<Set> {
        let base: Vec<usize> = (0..known).collect();
        let Some((_, mut before)) = self.solved(&base) else { return Vec::new() };
        let mut found: Vec<Vec<Set>> = Vec::new();
        let mut sets: Vec<Vec<usize>> = vec![Vec::new()];
        for _ in 0..most {
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
            // Schwarz's criterion
            let Some(least) = solved.first().map(|set| set.chi2) else { break };
            if before - least < (self.independent.max(2) as f64).ln() {
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
        let squares = LeastSquares::of(&[block], vec![column(1.0), column(0.0), column(0.0), column(0.0)], rows);
        let sets = squares.best_sets(1, (3, 1));
        let best = &sets[0];
        assert_eq!(best.laws, [0, 2]);
        assert!((best.values[1] - 2.0).abs() < 0.1 && (best.values[2] - 1.0).abs() < 0.1, "{:?}", best.values);
    }
}
