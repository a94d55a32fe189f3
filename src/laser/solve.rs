//! Least squares of whitened columns.

use nalgebra::{Cholesky, DMatrix, DVector, DVectorView, Dyn};

/// Added to the diagonal of columns scaled to 1, so that two that are the same cost no solution.
const RIDGE: f64 = 1e-9;

/// Amplitudes of columns, and how well they are known.
#[derive(Debug, Clone)]
pub struct Solution {
    /// Amplitudes.
    pub amplitude: Vec<f64>,
    /// Their covariance.
    pub covariance: DMatrix<f64>,
    /// Sum of squares of what is left.
    pub chi2: f64,
    /// ln of the determinant of the Fisher matrix.
    pub ln_fisher: f64,
    /// What is left.
    pub left: Vec<f64>,
}

/// Amplitudes of the columns that together come nearest to `y`; `known` adds to the Fisher matrix's diagonal what is known of each beforehand.
pub fn solve(columns: &[&[f64]], y: &[f64], known: &[f64]) -> Option<Solution> {
    let (rows, count) = (y.len(), columns.len());
    let y_vector = DVector::from_column_slice(y);
    if count == 0 {
        let covariance = DMatrix::zeros(0, 0);
        return Some(Solution {
            amplitude: Vec::new(),
            covariance,
            chi2: y_vector.norm_squared(),
            ln_fisher: 0.0,
            left: y.to_vec(),
        });
    }
    let x: Vec<DVectorView<'_, f64>> = columns.iter().map(|column| DVectorView::from_slice(column, rows)).collect();
    let mut fisher = DMatrix::zeros(count, count);
    for i in 0..count {
        for j in 0..=i {
            fisher[(i, j)] = x[i].dot(&x[j]);
            fisher[(j, i)] = fisher[(i, j)];
        }
    }
    let right: Vec<f64> = x.iter().map(|column| column.dot(&y_vector)).collect();
    for (k, own) in known.iter().enumerate() {
        fisher[(k, k)] += own;
    }
    let scale: Vec<f64> = (0..count).map(|k| fisher[(k, k)].sqrt().max(f64::MIN_POSITIVE)).collect();
    let factor = scaled_cholesky(&fisher, &scale)?;
    let solved = factor.solve(&DVector::from_fn(count, |k, _| right[k] / scale[k]));
    let amplitude: Vec<f64> = (0..count).map(|k| solved[k] / scale[k]).collect();
    let inverse = factor.inverse();
    let covariance = DMatrix::from_fn(count, count, |i, j| inverse[(i, j)] / (scale[i] * scale[j]));
    let mut left = y_vector;
    x.iter().zip(&amplitude).for_each(|(column, amplitude)| left.axpy(-amplitude, column, 1.0));
    let ln_fisher = factor.l_dirty().diagonal().iter().map(|d| 2.0 * d.ln()).sum::<f64>()
        + scale.iter().map(|s| 2.0 * s.ln()).sum::<f64>();
    Some(Solution { amplitude, covariance, chi2: left.norm_squared(), ln_fisher, left: left.as_slice().to_vec() })
}

/// The sum of columns times their amplitudes.
pub fn combined<'c>(terms: impl Iterator<Item = (&'c Vec<f64>, &'c f64)>, rows: usize) -> Vec<f64> {
    let mut sum = vec![0.0; rows];
    for (column, amplitude) in terms {
        sum.iter_mut().zip(column).for_each(|(s, c)| *s += amplitude * c);
    }
    sum
}

fn scaled_cholesky(fisher: &DMatrix<f64>, scale: &[f64]) -> Option<Cholesky<f64, Dyn>> {
    let count = scale.len();
    let mut scaled = DMatrix::from_fn(count, count, |i, j| fisher[(i, j)] / (scale[i] * scale[j]));
    for k in 0..count {
        scaled[(k, k)] = 1.0 + RIDGE;
    }
    scaled.cholesky()
}

/// An orthonormal basis of whitened columns, to ask quickly what a further one would explain.
#[derive(Debug)]
pub struct Span {
    basis: DMatrix<f64>,
}

impl Span {
    /// Of some columns.
    pub fn of(columns: &[&[f64]], rows: usize) -> Self {
        let mut x = DMatrix::zeros(rows, columns.len());
        for (k, column) in columns.iter().enumerate() {
            x.column_mut(k).copy_from_slice(column);
        }
        Self { basis: if columns.is_empty() { x } else { x.qr().q() } }
    }

    /// What of the sum of squares of `left`, which is perpendicular to the span, a further column explains.
    pub fn gain(&self, column: &[f64], left: &[f64]) -> f64 {
        let column = DVectorView::from_slice(column, column.len());
        let whole = column.norm_squared();
        let beyond = whole - self.basis.tr_mul(&column).norm_squared();
        if beyond <= 1e-12 * whole || beyond <= 0.0 {
            return 0.0;
        }
        column.dot(&DVectorView::from_slice(left, left.len())).powi(2) / beyond
    }
}
