//! Gaussian elimination for the small dense systems of a step.
//!
//! A step of two links solves one 10 × 10 system for its stages and one more for ten or so derivatives. Rows lie one after another in memory, so
//! that every inner loop is a sum of two slices, which the compiler turns into vector instructions; a factorisation made for any shape and stride
//! takes about three times as long at this size.

/// A square matrix, decomposed into triangles with row exchanges.
#[derive(Debug, Clone, Default)]
pub struct Elimination {
    size: usize,
    /// L below the diagonal (ones on it), U on and above; row after row.
    factors: Vec<f64>,
    /// Row that was taken as pivot of each column.
    order: Vec<usize>,
}

impl Elimination {
    /// Decomposes a matrix given row after row. Returns whether it has an inverse.
    pub fn decompose(&mut self, size: usize, matrix: &[f64]) -> bool {
        self.size = size;
        self.factors.clear();
        self.factors.extend_from_slice(matrix);
        self.order.clear();
        for column in 0..size {
            let entry = |row: usize| self.factors[row * size + column].abs();
            let pivot = (column..size).fold(column, |best, row| if entry(row) > entry(best) { row } else { best });
            if !(entry(pivot) > 0.0) {
                return false;
            }
            self.order.push(pivot);
            if pivot != column {
                let (upper, lower) = self.factors.split_at_mut(pivot * size);
                upper[column * size..(column + 1) * size].swap_with_slice(&mut lower[..size]);
            }
            let (upper, lower) = self.factors.split_at_mut((column + 1) * size);
            let pivot_row = &upper[column * size..];
            let inverse = 1.0 / pivot_row[column];
            for row in lower.chunks_exact_mut(size) {
                let factor = row[column] * inverse;
                row[column] = factor;
                subtract(&mut row[column + 1..], factor, &pivot_row[column + 1..]);
            }
        }
        true
    }

    /// Solves for one right-hand side in place.
    pub fn solve_one(&self, right: &mut [f64]) {
        let size = self.size;
        for (row, pivot) in self.order.iter().enumerate() {
            right.swap(row, *pivot);
        }
        for row in 1..size {
            let (above, below) = right.split_at_mut(row);
            below[0] -= dot(&self.factors[row * size..row * size + row], above);
        }
        for row in (0..size).rev() {
            let (above, below) = right.split_at_mut(row + 1);
            let factors = &self.factors[row * size..(row + 1) * size];
            above[row] = (above[row] - dot(&factors[row + 1..], below)) / factors[row];
        }
    }

    /// Solves for right-hand sides of `width` columns, given row after row, in place.
    pub fn solve(&self, right: &mut [f64], width: usize) {
        let size = self.size;
        for (row, pivot) in self.order.iter().enumerate() {
            if *pivot != row {
                let (upper, lower) = right.split_at_mut(pivot * width);
                upper[row * width..(row + 1) * width].swap_with_slice(&mut lower[..width]);
            }
        }
        for row in 1..size {
            let (above, below) = right.split_at_mut(row * width);
            for column in 0..row {
                let factor = self.factors[row * size + column];
                subtract(&mut below[..width], factor, &above[column * width..(column + 1) * width]);
            }
        }
        for row in (0..size).rev() {
            let (above, below) = right.split_at_mut((row + 1) * width);
            let own = &mut above[row * width..];
            for column in row + 1..size {
                let at = (column - row - 1) * width;
                subtract(own, self.factors[row * size + column], &below[at..at + width]);
            }
            let inverse = 1.0 / self.factors[row * size + row];
            own.iter_mut().for_each(|value| *value *= inverse);
        }
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// a −= factor · b.
fn subtract(a: &mut [f64], factor: f64, b: &[f64]) {
    for (a, b) in a.iter_mut().zip(b) {
        *a -= factor * b;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::DMatrix;
    use rand::{RngExt, SeedableRng};

    #[test]
    fn it_agrees_with_the_library() {
        let mut random = rand::rngs::StdRng::seed_from_u64(1);
        for size in [1, 2, 5, 10, 13, 40] {
            let mut number = || random.random_range(-1.0..1.0);
            let matrix = DMatrix::from_fn(size, size, |_, _| number());
            let right = DMatrix::from_fn(size, 3, |_, _| number());
            let expected = matrix.clone().lu().solve(&right).unwrap();
            let mut elimination = Elimination::default();
            assert!(elimination.decompose(size, matrix.transpose().as_slice()));
            let mut one: Vec<f64> = right.column(0).iter().copied().collect();
            elimination.solve_one(&mut one);
            assert!(one.iter().zip(expected.column(0).iter()).all(|(a, b)| (a - b).abs() < 1e-10));
            let mut solved = right.transpose().as_slice().to_vec();
            elimination.solve(&mut solved, 3);
            let solved = DMatrix::from_row_slice(size, 3, &solved);
            assert!((solved - expected).amax() < 1e-10);
        }
    }

    #[test]
    fn a_matrix_without_inverse_is_told() {
        assert!(!Elimination::default().decompose(2, &[1.0, 2.0, 0.5, 1.0]));
    }
}
