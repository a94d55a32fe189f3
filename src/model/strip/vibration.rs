//! Small vibrations of the strip about its rest.
//!
//! ```text
//! (K − ω²M) v = 0        M = ∫ μ (∂x/∂q)(∂x/∂q)ᵀ + μ (∂d/∂q)(∂d/∂q)ᵀ ds
//! ```

use std::f64::consts::TAU;

use nalgebra::{DMatrix, DVector};

use super::{Rest, Support};

/// Modes of the symmetric part in which forces that turn with the strip are told.
const BASIS: usize = 12;
/// A square this small beside the shift that made it positive is none.
const ROUNDING: f64 = 1e-9;

/// Small vibrations of a strip.
#[derive(Debug, Clone, PartialEq)]
pub struct Vibration {
    /// ω², lowest first (rad²/s²); below zero where the shape is not stable.
    pub squares_rad2_s2: Vec<f64>,
    /// The freedoms of every mode, a column each, of unit modal mass (kg m²).
    pub shapes: DMatrix<f64>,
}

impl Vibration {
    /// f of the first few modes (Hz); not a number for one that grows.
    pub fn frequencies_hz(&self, count: usize) -> Vec<f64> {
        self.squares_rad2_s2.iter().take(count).map(|square| square.sqrt() / TAU).collect()
    }
}

impl Rest {
    /// M at this shape.
    pub fn mass(&self) -> DMatrix<f64> {
        let mesh = &self.mesh;
        let angles = mesh.angles(self.freedoms.as_slice());
        let of = |slope: fn(f64) -> f64| {
            let mut derivatives = mesh.displacement_derivatives(&angles.iter().map(|a| slope(*a)).collect::<Vec<_>>());
            for (p, mut row) in derivatives.row_iter_mut().enumerate() {
                row *= (mesh.weight_m(p) * self.strip.mass_per_length_kg_m).sqrt();
            }
            derivatives.tr_mul(&derivatives)
        };
        if angles.iter().all(|a| *a == 0.0) { of(f64::cos) } else { of(f64::cos) + of(|a| -a.sin()) }
    }

    /// Modes, lowest first. None where the strip has neither stiffness nor weight.
    ///
    /// The vectors are those of K's inverse, whose largest eigenvalues are the lowest modes, so the stiff short waves of a fine mesh cost no digits. Forces
    /// that turn with the strip leave K unsymmetric; the lowest twelve modes of its symmetric part are then the basis of the whole.
    pub fn vibration(&self) -> Option<Vibration> {
        let strip = &self.strip;
        let (mass, whole) = (strip.free(self.mass()), strip.free(self.stiffness.clone()));
        let symmetric = 0.5 * (&whole + whole.transpose());
        // a hinged strip without gravity turns freely: a shift leaves the vectors as they are
        let bending = strip.bending_stiffness_n_m2 / (strip.mass_per_length_kg_m * strip.length_m.powi(4));
        let shift = bending + strip.gravity_m_s2 / strip.length_m;
        let (lower, shift) =
            [0.0, shift].into_iter().find_map(|shift| Some(((&symmetric + &mass * shift).cholesky()?.l(), shift)))?;
        let half = lower.solve_lower_triangular(&mass)?;
        let inverse = lower.solve_lower_triangular(&half.transpose())?;
        let eigen = (0.5 * (&inverse + inverse.transpose())).symmetric_eigen();
        let mut order: Vec<usize> = (0..eigen.eigenvalues.len()).collect();
        order.sort_by(|a, b| eigen.eigenvalues[*b].total_cmp(&eigen.eigenvalues[*a]));
        let mut shapes = DMatrix::zeros(mass.nrows(), order.len());
        let mut squares_rad2_s2 = Vec::with_capacity(order.len());
        for (k, mode) in order.into_iter().enumerate() {
            let of_inverse = eigen.eigenvalues[mode];
            let shape = lower.tr_solve_lower_triangular(&eigen.eigenvectors.column(mode))?;
            // vᵀMv is the eigenvalue
            shapes.set_column(k, &(shape / of_inverse.max(f64::MIN_POSITIVE).sqrt()));
            let square = 1.0 / of_inverse - shift;
            squares_rad2_s2.push(if square.abs() <= ROUNDING * shift { 0.0 } else { square });
        }
        if whole != symmetric {
            let basis = shapes.columns(0, BASIS.min(shapes.ncols())).into_owned();
            let reduced = basis.tr_mul(&(&whole * &basis));
            let mut squares: Vec<f64> = reduced.complex_eigenvalues().iter().map(|v| v.re).collect();
            squares.sort_by(f64::total_cmp);
            squares_rad2_s2.splice(..squares.len(), squares);
        }
        let held = usize::from(strip.support == Support::Clamped);
        Some(Vibration { squares_rad2_s2, shapes: shapes.insert_rows(0, held, 0.0) })
    }

    /// x of a point a unit of each mode's coordinate (m).
    pub fn seen(&self, vibration: &Vibration, s_m: f64) -> DVector<f64> {
        let mesh = &self.mesh;
        let freedoms = self.freedoms.as_slice();
        DVector::from_iterator(
            vibration.shapes.ncols(),
            vibration.shapes.column_iter().map(|shape| {
                // ∂x = ∫ cos θ ∂θ ds, both at the integral's points
                mesh.integral_of_turn(freedoms, shape.as_slice(), s_m)
            }),
        )
    }
}
