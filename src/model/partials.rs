//! The balance of torques, linearised.

use nalgebra::{DMatrix, DVector};

/// Partial derivatives of the sum of torques.
///
/// With n links and m rates (ω, then the laws' own variables), rows are the m equations:
///
/// | field | shape | ∂Q / |
/// |---|---|---|
/// | `theta` | m × n | ∂θ |
/// | `rate` | m × m | ∂rate |
/// | `acceleration` | m × m | ∂acceleration |
/// | `pivot_velocity`, `pivot_acceleration` | m | ∂ẋₚ, ∂ẍₚ |
#[derive(Debug, Clone, PartialEq)]
pub struct Partials {
    /// N·m/rad.
    pub theta: DMatrix<f64>,
    /// N·m·s/rad.
    pub rate: DMatrix<f64>,
    /// N·m·s²/rad: the inertia with its sign turned.
    pub acceleration: DMatrix<f64>,
    /// N·s.
    pub pivot_velocity: DVector<f64>,
    /// N·s².
    pub pivot_acceleration: DVector<f64>,
}

impl Partials {
    /// All zero, for n links and m rates.
    pub fn zero(n: usize, m: usize) -> Self {
        Self {
            theta: DMatrix::zeros(m, n),
            rate: DMatrix::zeros(m, m),
            acceleration: DMatrix::zeros(m, m),
            pivot_velocity: DVector::zeros(m),
            pivot_acceleration: DVector::zeros(m),
        }
    }

    /// Sets every entry to zero.
    pub fn clear(&mut self) {
        // slices are filled as a block of memory, matrices entry by entry
        for matrix in [&mut self.theta, &mut self.rate, &mut self.acceleration] {
            matrix.as_mut_slice().fill(0.0);
        }
        for vector in [&mut self.pivot_velocity, &mut self.pivot_acceleration] {
            vector.as_mut_slice().fill(0.0);
        }
    }

    /// Sets one row to zero.
    pub fn clear_row(&mut self, row: usize) {
        self.theta.row_mut(row).fill(0.0);
        self.rate.row_mut(row).fill(0.0);
        self.acceleration.row_mut(row).fill(0.0);
        self.pivot_velocity[row] = 0.0;
        self.pivot_acceleration[row] = 0.0;
    }
}
