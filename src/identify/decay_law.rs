//! The decay of an amplitude: friction, viscous and quadratic shares.

use levenberg_marquardt::{LeastSquaresProblem, LevenbergMarquardt};
use nalgebra::storage::Owned;
use nalgebra::{DMatrix, DVector, Dyn};
use serde::Serialize;

use super::estimate::{Estimate, chi_squared_tail, f_tail};
use super::numerics::{central_differences, runge_kutta};
use super::windows::{FEWEST_OF_A_LAW, WindowAmplitude};

/// dA/dt = −(b₀ + b₁A + b₂A²).
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct DecayLaw {
    /// Dry friction's share.
    pub b0_rad_per_s: Estimate,
    /// Viscous share.
    pub b1_per_s: Estimate,
    /// Quadratic drag's share.
    pub b2_per_rad_s: Estimate,
    /// Probability that noise alone makes this law so much better than b₁ by itself; small: damping depends on amplitude.
    pub p_viscous: f64,
}

/// By how much a misfit widens an interval.
pub(super) struct Widening {
    /// Factor on variances.
    pub variance: f64,
    /// For Student's distribution.
    pub degrees_of_freedom: f64,
}

impl Widening {
    /// Scatter beyond what noise explains (p < 0.05) widens, and its size is only as certain as the degrees of freedom allow.
    pub fn of(chi2: f64, free: f64, p_value: f64) -> Self {
        if p_value < 0.05 {
            Self { variance: chi2 / free, degrees_of_freedom: free }
        } else {
            Self { variance: 1.0, degrees_of_freedom: 1e6 }
        }
    }
}

impl DecayLaw {
    /// The three-term law, with a test against the viscous one.
    pub(super) fn of(moments: &[WindowAmplitude], exponential: &DecayFit) -> Option<Self> {
        if moments.len() < FEWEST_OF_A_LAW {
            return None;
        }
        let full = DecayFit::of(moments, [true, true, true])?;
        let free = moments.len() as f64 - 4.0;
        let f = (exponential.chi2 - full.chi2).max(0.0) / 2.0 / (full.chi2 / free).max(1.0);
        Some(Self {
            b0_rad_per_s: full.estimate(1),
            b1_per_s: full.estimate(2),
            b2_per_rad_s: full.estimate(3),
            p_viscous: f_tail(f, 2.0, free),
        })
    }
}

/// A₀ and the wanted ones of b₀, b₁, b₂ fitted to the windows' amplitudes.
pub(super) struct DecayFit {
    /// A₀, b₀, b₁, b₂.
    values: [f64; 4],
    sd: [f64; 4],
    chi2: f64,
    pub(super) p_value: f64,
    degrees_of_freedom: f64,
}

impl DecayFit {
    /// Of A₀, b₀, b₁, b₂ by index.
    pub(super) fn estimate(&self, parameter: usize) -> Estimate {
        Estimate::new(self.values[parameter], self.sd[parameter], self.degrees_of_freedom)
    }

    /// Fits the wanted terms.
    pub(super) fn of(moments: &[WindowAmplitude], wanted: [bool; 3]) -> Option<Self> {
        let (first, last) = (moments.first()?, moments.last()?);
        let rate = (first.amplitude_rad() / last.amplitude_rad()).ln() / (last.t_s - first.t_s);
        let largest = first.amplitude_rad();
        let mut active = vec![0];
        active.extend((0..3).filter(|k| wanted[*k]).map(|k| k + 1));
        // each term in units in which it would make the whole decay
        let scale = [largest, largest * rate.abs().max(1e-6), rate.abs().max(1e-6), rate.abs().max(1e-6) / largest];
        let share = 1.0 / (active.len() - 1) as f64;
        let start = DVector::from_fn(active.len(), |k, _| if k == 0 { 1.0 } else { share * rate.signum() });
        let problem = DecayProblem { moments, active, scale, scaled: start };
        let (solved, report) = LevenbergMarquardt::new().with_tol(1e-12).with_patience(60).minimize(problem);
        let chi2 = 2.0 * report.objective_function;
        let free = moments.len().checked_sub(solved.active.len()).filter(|f| *f > 0)? as f64;
        let jacobian = solved.jacobian()?;
        let covariance = jacobian.tr_mul(&jacobian).try_inverse()?;
        let p_value = chi_squared_tail(chi2, free);
        let widening = Widening::of(chi2, free, p_value);
        let (mut values, mut sd) = ([0.0; 4], [0.0; 4]);
        for (k, parameter) in solved.active.iter().enumerate() {
            values[*parameter] = solved.scaled[k] * scale[*parameter];
            sd[*parameter] = (covariance[(k, k)] * widening.variance).sqrt() * scale[*parameter];
        }
        let sound = report.termination.was_successful()
            && chi2.is_finite()
            && solved.active.iter().all(|parameter| sd[*parameter].is_finite() && sd[*parameter] > 0.0);
        sound.then_some(Self { values, sd, chi2, p_value, degrees_of_freedom: widening.degrees_of_freedom })
    }
}

/// Least squares of the decay law's amplitudes.
struct DecayProblem<'a> {
    moments: &'a [WindowAmplitude],
    active: Vec<usize>,
    scale: [f64; 4],
    scaled: DVector<f64>,
}

impl DecayProblem<'_> {
    /// (A(tₖ) − Aₖ)/sdₖ by Runge–Kutta's method, eight steps a window.
    fn misfit(&self, scaled: &DVector<f64>) -> DVector<f64> {
        let mut parameters = [0.0; 4];
        for (k, parameter) in self.active.iter().enumerate() {
            parameters[*parameter] = scaled[k] * self.scale[*parameter];
        }
        let [mut amplitude, b0, b1, b2] = parameters;
        let slope = |a: f64| if a > 0.0 { -(b0 + b1 * a + b2 * a * a) } else { 0.0 };
        let mut t_s = self.moments[0].t_s;
        let misfit = self.moments.iter().map(|m| {
            let step_s = (m.t_s - t_s) / 8.0;
            for _ in 0..8 {
                [amplitude] = runge_kutta([amplitude], step_s, |[a]| [slope(a)]);
            }
            t_s = m.t_s;
            (amplitude - m.amplitude_rad()) / m.sd_rad
        });
        DVector::from_vec(misfit.collect())
    }
}

impl LeastSquaresProblem<f64, Dyn, Dyn> for DecayProblem<'_> {
    type ResidualStorage = Owned<f64, Dyn>;
    type JacobianStorage = Owned<f64, Dyn, Dyn>;
    type ParameterStorage = Owned<f64, Dyn>;

    fn set_params(&mut self, parameters: &DVector<f64>) {
        self.scaled.copy_from(parameters);
    }

    fn params(&self) -> DVector<f64> {
        self.scaled.clone()
    }

    fn residuals(&self) -> Option<DVector<f64>> {
        let misfit = self.misfit(&self.scaled);
        misfit.iter().all(|r| r.is_finite()).then_some(misfit)
    }

    fn jacobian(&self) -> Option<DMatrix<f64>> {
        central_differences(&self.scaled, |scaled| Some(self.misfit(scaled)))
    }
}
