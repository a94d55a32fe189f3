//! Residuals in units of their noise: divided by it, less what the noise before foretells, and with errors in step with the swing discounted.
//!
//! A value's noise has the standard deviation σ and the correlation ρ from row to row. Beside it a tracked angle has errors that come again whenever the
//! specimen is where it was: what a mark stands on shifts it by a hundredth of a pixel, and turns with the strip. They are Φb, b normal of unit variance:
//!
//! ```text
//! r ← r/σ,    rᵢ ← (rᵢ − ρᵢrᵢ₋₁)/√(1 − ρᵢ²),    r ← (1 + ΦΦᵀ)^(−1/2) r        Φ with its rows like r's
//! Φ of an angle: share · σ · [1, u, u³, w]      u: the angle,  w: the next link's less it;  each of root mean square 1
//! (1 + ΦΦᵀ)^(−1/2) = 1 − ΦMΦᵀ                   M = V diag((1 − 1/√(1 + λ))/λ) Vᵀ,    ΦᵀΦ = VΛVᵀ
//! ```
//!
//! so that residuals become independent and of unit variance, and their derivatives with them.

use nalgebra::{DMatrix, DVector};

use super::Problem;
use super::predict::Value;
use super::record::Record;
use crate::statistics::median_step_s;

/// Shapes of an error in step with the swing, of each angle.
pub const IN_STEP_SHAPES: usize = 4;

/// What makes residuals of some rows of a recording independent and of unit variance.
#[derive(Debug, Clone)]
pub struct Whitening {
    /// 1/σ.
    weights: Vec<f64>,
    /// What the value before foretells; zero where nothing.
    foretold: Vec<f64>,
    /// Φ and M.
    in_step: Option<(DMatrix<f64>, DMatrix<f64>)>,
}

impl Whitening {
    /// Of some values of a recording, link after link.
    pub fn of(problem: &Problem<'_>, record: usize, values: &[Value]) -> Self {
        let data = &problem.records[record];
        let sd_rad = |v: &Value| problem.noise_rad[record][v.link] * data.relative_sd[v.link][v.row];
        let mut whitening = Self {
            weights: values.iter().map(|v| 1.0 / sd_rad(v)).collect(),
            foretold: foretold(problem, record, values),
            in_step: None,
        };
        if problem.in_step[record] > 0.0 {
            let shapes = in_step_shapes(data, problem.in_step[record], &problem.noise_rad[record]);
            let mut phi = DMatrix::zeros(values.len(), data.links() * IN_STEP_SHAPES);
            for (i, value) in values.iter().enumerate() {
                let own = shapes[value.link][value.row];
                (0..IN_STEP_SHAPES).for_each(|k| phi[(i, value.link * IN_STEP_SHAPES + k)] = own[k]);
            }
            whitening.apply(&mut phi);
            let eigen = phi.tr_mul(&phi).symmetric_eigen();
            let shrink = |l: f64| if l > 1e-12 { (1.0 - 1.0 / (1.0 + l).sqrt()) / l } else { 0.5 };
            let scaled = &eigen.eigenvectors * DMatrix::from_diagonal(&eigen.eigenvalues.map(shrink));
            whitening.in_step = Some((phi, scaled * eigen.eigenvectors.transpose()));
        }
        whitening
    }

    /// Whitens columns, each of as many rows as there are values.
    pub fn apply(&self, columns: &mut DMatrix<f64>) {
        columns.column_iter_mut().for_each(|mut column| self.whiten(column.as_mut_slice()));
    }

    /// Whitens one column.
    pub fn whiten(&self, column: &mut [f64]) {
        column.iter_mut().zip(&self.weights).for_each(|(value, weight)| *value *= weight);
        for i in (1..column.len()).rev() {
            let rho = self.foretold[i];
            if rho > 0.0 {
                column[i] = (column[i] - rho * column[i - 1]) / (1.0 - rho * rho).sqrt();
            }
        }
        if let Some((phi, shrink)) = &self.in_step {
            let along = DVector::from_fn(phi.ncols(), |k, _| {
                phi.column(k).as_slice().iter().zip(column.iter()).map(|(a, b)| a * b).sum::<f64>()
            });
            for (shape, size) in phi.column_iter().zip((shrink * along).iter()) {
                column.iter_mut().zip(shape.iter()).for_each(|(value, shape)| *value -= size * shape);
            }
        }
    }
}

/// ρ^(steps between the two rows) of each value and the one before it.
fn foretold(problem: &Problem<'_>, record: usize, values: &[Value]) -> Vec<f64> {
    let (colour, t_s) = (&problem.colour[record], &problem.records[record].t_s);
    let mut foretold = vec![0.0; values.len()];
    if colour.iter().all(|rho| *rho == 0.0) {
        return foretold;
    }
    let step_s = median_step_s(t_s).unwrap_or(1.0);
    for (foretold, pair) in foretold[1..].iter_mut().zip(values.windows(2)) {
        if pair[0].link == pair[1].link {
            let steps = (t_s[pair[1].row] - t_s[pair[0].row]) / step_s;
            *foretold = colour[pair[1].link].powf(steps);
        }
    }
    foretold
}

/// Errors in step with the swing that each angle may have (rad), `[link][row]`; `share` of the noise each.
pub fn in_step_shapes(record: &Record, share: f64, noise_rad: &[f64]) -> Vec<Vec<[f64; IN_STEP_SHAPES]>> {
    let of_unit_size = |values: Vec<f64>| -> Vec<f64> {
        let rms = (values.iter().map(|v| v * v).sum::<f64>() / values.len().max(1) as f64).sqrt();
        values.iter().map(|v| v / rms.max(1e-300)).collect()
    };
    let of = |link: usize| {
        let angles = &record.theta_rad[link];
        let next = [link + 1, link.wrapping_sub(1)].into_iter().find_map(|other| record.theta_rad.get(other));
        let angle = of_unit_size(angles.iter().map(|a| a.unwrap_or(0.0)).collect());
        let cube = of_unit_size(angle.iter().map(|a| a.powi(3)).collect());
        let bend = |row: usize| Some(next?[row]? - angles[row]?);
        let bend = of_unit_size((0..record.len()).map(|row| bend(row).unwrap_or(0.0)).collect());
        let size = share * noise_rad[link];
        (0..record.len()).map(|row| [1.0, angle[row], cube[row], bend[row]].map(|shape| size * shape)).collect()
    };
    (0..record.links()).map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::experiment::Experiment;

    /// A recording of two angles that swing at two frequencies.
    fn record() -> Record {
        let t_s: Vec<f64> = (0..200).map(|k| k as f64 / 30.0).collect();
        let angle = |size: f64, other: f64| {
            t_s.iter().map(|t| Some(size * (6.0 * t).cos() + other * (17.0 * t).sin())).collect::<Vec<_>>()
        };
        Record {
            path: "made".into(),
            theta_rad: vec![angle(0.4, 0.02), angle(0.5, -0.05)],
            relative_sd: vec![vec![1.0; 200]; 2],
            t_s,
            in_step: 0.25,
        }
    }

    #[test]
    fn whitened_errors_have_unit_variance_in_every_direction() {
        let records = [record()];
        let mut problem = Problem::new(&records, &Experiment::default(), &[]).unwrap();
        problem.colour = vec![vec![0.3, 0.0]];
        problem.in_step = vec![0.25];
        let values: Vec<Value> = (0..2)
            .flat_map(|link| (0..200).map(move |row| Value { link, row, predicted_rad: 0.0, rate_rad_s: 0.0 }))
            .collect();
        // the covariance as it is stated: coloured noise and errors in step
        let shapes = in_step_shapes(&records[0], 0.25, &problem.noise_rad[0]);
        let covariance = DMatrix::from_fn(400, 400, |i, j| {
            let (a, b) = (&values[i], &values[j]);
            if a.link != b.link {
                return 0.0;
            }
            let noise_rad = problem.noise_rad[0][a.link];
            let apart = a.row.abs_diff(b.row) as i32;
            let noise = noise_rad * noise_rad * problem.colour[0][a.link].powi(apart);
            let (one, other) = (shapes[a.link][a.row], shapes[b.link][b.row]);
            noise + one.iter().zip(&other).map(|(x, y)| x * y).sum::<f64>()
        });
        let whitening = Whitening::of(&problem, 0, &values);
        let mut once = covariance;
        whitening.apply(&mut once);
        let mut twice = once.transpose();
        whitening.apply(&mut twice);
        let off = (&twice - DMatrix::identity(400, 400)).amax();
        assert!(off < 1e-9, "{off}");
    }
}
