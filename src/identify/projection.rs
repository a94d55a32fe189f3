//! The least-squares problem of damped sinusoids in their poles alone: variable projection with Kaufman's Jacobian.

use levenberg_marquardt::LeastSquaresProblem;
use nalgebra::storage::Owned;
use nalgebra::{DMatrix, DVector, Dyn};

use super::pole::Pole;
use super::signal::{LinkSamples, Signal};

/// The least-squares problem in the poles alone.
pub(super) struct Projection {
    pub links: Vec<Projected>,
    parameters: DVector<f64>,
}

/// Phase of the slowest term of a drift, half a cycle over the record.
pub(super) fn drift_phase(tau_s: f64, duration_s: f64) -> f64 {
    std::f64::consts::PI * tau_s / duration_s
}

/// What enters linearly, eliminated: Φ = QR, c = R⁻¹Qᵀy, r = y − QQᵀy.
pub(super) struct Eliminated {
    /// Q.
    pub orthonormal: DMatrix<f64>,
    /// R.
    pub triangle: DMatrix<f64>,
    /// r.
    pub residual: DVector<f64>,
    /// c; `None` where Φ has not its full rank.
    pub coefficients: Option<DVector<f64>>,
}

impl Eliminated {
    /// Of the values y that columns Φ describe.
    pub fn of(basis: DMatrix<f64>, measured: &DVector<f64>) -> Self {
        let qr = basis.qr();
        let (orthonormal, triangle) = (qr.q(), qr.r());
        let projected = orthonormal.tr_mul(measured);
        let residual = measured - &orthonormal * &projected;
        let coefficients = triangle.solve_upper_triangular(&projected);
        Self { orthonormal, triangle, residual, coefficients }
    }
}

/// One link's share of it, at the present poles.
pub(super) struct Projected {
    pub tau_s: Vec<f64>,
    duration_s: f64,
    pub drift_terms: usize,
    pub measured: DVector<f64>,
    weight: f64,
    pub orthonormal: DMatrix<f64>,
    pub triangle: DMatrix<f64>,
    /// offset, a₁, b₁, a₂, b₂, …, d₁, d₂, …
    pub coefficients: DVector<f64>,
    pub residual: DVector<f64>,
}

impl Projected {
    fn update(&mut self, parameters: &DVector<f64>) {
        let columns = 1 + parameters.len() + self.drift_terms;
        let mut basis = DMatrix::from_element(self.tau_s.len(), columns, 1.0);
        for (row, tau) in self.tau_s.iter().enumerate() {
            let turn = drift_phase(*tau, self.duration_s);
            for k in 0..self.drift_terms {
                basis[(row, 1 + parameters.len() + k)] = (turn * (k + 1) as f64).cos();
            }
            for m in 0..parameters.len() / 2 {
                let envelope = (-parameters[2 * m + 1] * tau).exp();
                let (sin, cos) = (parameters[2 * m] * tau).sin_cos();
                basis[(row, 1 + 2 * m)] = envelope * cos;
                basis[(row, 2 + 2 * m)] = envelope * sin;
            }
        }
        let own = Eliminated::of(basis, &self.measured);
        (self.orthonormal, self.triangle, self.residual) = (own.orthonormal, own.triangle, own.residual);
        self.coefficients = own.coefficients.unwrap_or_else(|| DVector::from_element(columns, f64::NAN));
    }

    /// Kaufman's Jacobian of the residual: −P⊥ (∂Φ/∂α) c, unweighted.
    fn jacobian(&self, parameters: &DVector<f64>) -> DMatrix<f64> {
        let mut slope = DMatrix::zeros(self.tau_s.len(), parameters.len());
        for (row, tau) in self.tau_s.iter().enumerate() {
            for m in 0..parameters.len() / 2 {
                let envelope = (-parameters[2 * m + 1] * tau).exp();
                let (sin, cos) = (parameters[2 * m] * tau).sin_cos();
                let (a, b) = (self.coefficients[1 + 2 * m], self.coefficients[2 + 2 * m]);
                slope[(row, 2 * m)] = envelope * tau * (b * cos - a * sin);
                slope[(row, 2 * m + 1)] = -envelope * tau * (a * cos + b * sin);
            }
        }
        &self.orthonormal * self.orthonormal.tr_mul(&slope) - slope
    }
}

impl Projection {
    pub fn new(signal: &Signal, origin_s: f64, start: &[Pole], drift_terms: usize) -> Self {
        let link = |l: &LinkSamples| Projected {
            tau_s: l.t_s.iter().map(|t| t - origin_s).collect(),
            duration_s: signal.duration_s(),
            drift_terms,
            measured: DVector::from_column_slice(&l.theta_rad),
            weight: 1.0,
            orthonormal: DMatrix::zeros(0, 0),
            triangle: DMatrix::zeros(0, 0),
            coefficients: DVector::zeros(0),
            residual: DVector::zeros(0),
        };
        let parameters = start.iter().flat_map(|p| [p.omega_rad_s, p.decay_per_s]).collect::<Vec<_>>();
        let mut problem =
            Self { links: signal.links.iter().map(link).collect(), parameters: DVector::zeros(parameters.len()) };
        problem.set_params(&DVector::from_vec(parameters));
        problem
    }

    pub fn poles(&self) -> Vec<Pole> {
        let pairs = self.parameters.as_slice().chunks_exact(2);
        pairs.map(|p| Pole { omega_rad_s: p[0], decay_per_s: p[1] }).collect()
    }

    /// Sets each link's weight to the inverse of its noise.
    pub fn weigh(&mut self) -> Option<()> {
        let noises: Vec<f64> = self.links.iter().map(|l| l.residual.norm_squared() / l.tau_s.len() as f64).collect();
        let largest = noises.iter().copied().fold(0.0, f64::max);
        if !largest.is_finite() {
            return None;
        }
        for (link, noise) in self.links.iter_mut().zip(&noises) {
            // an exact fit of one link must not silence the other
            link.weight = 1.0 / noise.max(1e-6 * largest).max(f64::MIN_POSITIVE).sqrt();
        }
        Some(())
    }
}

impl LeastSquaresProblem<f64, Dyn, Dyn> for Projection {
    type ResidualStorage = Owned<f64, Dyn>;
    type JacobianStorage = Owned<f64, Dyn, Dyn>;
    type ParameterStorage = Owned<f64, Dyn>;

    fn set_params(&mut self, parameters: &DVector<f64>) {
        self.parameters.copy_from(parameters);
        for link in &mut self.links {
            link.update(parameters);
        }
    }

    fn params(&self) -> DVector<f64> {
        self.parameters.clone()
    }

    fn residuals(&self) -> Option<DVector<f64>> {
        let values = self.links.iter().flat_map(|l| l.residual.iter().map(|r| r * l.weight));
        let all = DVector::from_vec(values.collect());
        all.iter().all(|r| r.is_finite()).then_some(all)
    }

    fn jacobian(&self) -> Option<DMatrix<f64>> {
        let rows = self.links.iter().map(|l| l.tau_s.len()).sum();
        let mut all = DMatrix::zeros(rows, self.parameters.len());
        let mut row = 0;
        for link in &self.links {
            let part = link.jacobian(&self.parameters) * link.weight;
            all.rows_mut(row, part.nrows()).copy_from(&part);
            row += part.nrows();
        }
        all.iter().all(|v| v.is_finite()).then_some(all)
    }
}
