//! Damped sinusoids by nonlinear least squares on the true time stamps.
//!
//! ```text
//! θᵢ(t) = oᵢ + Σₖ dᵢₖ cos(πkτ/T) + Σₘ e^{−σₘτ} (aᵢₘ cos ωₘτ + bᵢₘ sin ωₘτ),   τ = t − t₀
//! f = √(ω² + σ²) / 2π,   ξ = σ / √(ω² + σ²)
//! ```
//!
//! The poles (ωₘ, σₘ) are common to all links; offsets, drifts dᵢₖ and amplitudes belong to each. The latter enter linearly and are eliminated: variable
//! projection with Kaufman's Jacobian (Golub and Pereyra, Inverse Problems 19 (2003) R1, Eq. 11), minimised by Levenberg–Marquardt.
//! Missing samples are simply absent. Each link is weighted by the noise found in its own residual.
//!
//! The search may end anywhere: on a drift (ω → 0, ξ → 1), on two columns that cancel each other, on a pole that the record does not resolve. Its end
//! is a damped oscillation only if [`Pole::is_resolved_oscillation`], if no amplitude exceeds what was recorded, and if the linearisation behind the
//! intervals reaches as far as they do; otherwise there is no result.

use levenberg_marquardt::{LeastSquaresProblem as _, LevenbergMarquardt};
use nalgebra::{Complex, DMatrix};

use super::estimate::Estimate;
use super::pole::Pole;
use super::projection::{Projection, drift_phase};
use super::signal::{LinkSamples, Signal};

/// A mode's amplitude at the start over the range of what was recorded, at most: an oscillation that starts at its zero reaches less than its amplitude.
const LARGEST_AMPLITUDE: f64 = 2.0;

/// What the fit says about one link.
#[derive(Debug, Clone, PartialEq)]
pub struct LinkFit {
    /// oᵢ.
    pub offset_rad: f64,
    /// dᵢ₁, dᵢ₂, …
    pub drift_rad: Vec<f64>,
    /// a − ib of each mode at the origin: θ = Re(c e^{(−σ+iω)τ}).
    pub amplitudes_rad: Vec<Complex<f64>>,
    /// Standard deviation of the real and of the imaginary part of each, for given poles.
    pub amplitude_sd_rad: Vec<f64>,
    /// Measured minus fitted.
    pub residual_rad: Vec<f64>,
    /// Standard deviation of the residual.
    pub noise_rad: f64,
}

/// A sum of damped sinusoids fitted to a signal.
#[derive(Debug, Clone, PartialEq)]
pub struct SinusoidFit {
    /// t₀.
    pub origin_s: f64,
    /// One a mode, in the order of the start values.
    pub poles: Vec<Pole>,
    /// Covariance of (ω₁, σ₁, ω₂, σ₂, …), of white residuals.
    pub covariance: DMatrix<f64>,
    /// One a link.
    pub links: Vec<LinkFit>,
    /// Values less parameters.
    pub degrees_of_freedom: f64,
    /// Σᵢ nᵢ ln(RSSᵢ/nᵢ): minus twice the log-likelihood, up to a constant.
    pub deviance: f64,
}

impl SinusoidFit {
    /// Fits from these poles, without drift; `None` when there are too few values, or the search ends where no oscillation is.
    pub fn from_start(signal: &Signal, origin_s: f64, start: &[Pole]) -> Option<Self> {
        Self::with_drift(signal, origin_s, start, 0)
    }

    /// Fits from these poles with so many terms of drift a link.
    pub fn with_drift(signal: &Signal, origin_s: f64, start: &[Pole], drift_terms: usize) -> Option<Self> {
        let linear = 1 + drift_terms + 2 * start.len();
        if start.is_empty() || signal.links.iter().any(|l| l.t_s.len() < linear + 2 * start.len()) {
            return None;
        }
        let mut problem = Projection::new(signal, origin_s, start, drift_terms);
        let mut converged = false;
        for _ in 0..2 {
            let solver = LevenbergMarquardt::new().with_tol(1e-12).with_patience(40);
            let (solved, report) = solver.minimize(problem);
            converged = report.termination.was_successful();
            problem = solved;
            problem.weigh()?;
        }
        if !converged {
            return None;
        }
        let nyquist_rad_s = std::f64::consts::PI / signal.step_s;
        let poles = problem.poles();
        let sane = |p: &Pole| p.omega_rad_s < 1.05 * nyquist_rad_s && p.is_resolved_oscillation(signal.duration_s());
        if !poles.iter().all(sane) {
            return None;
        }
        Self::of_solved(problem, origin_s).filter(|fit| fit.stays_within(signal) && fit.is_resolved())
    }

    /// The fit that a solved problem is, with its covariance.
    fn of_solved(problem: Projection, origin_s: f64) -> Option<Self> {
        let poles = problem.poles();
        let values: usize = problem.links.iter().map(|l| l.tau_s.len()).sum();
        let drift_terms = problem.links.first()?.drift_terms;
        let linear = 1 + drift_terms + 2 * poles.len();
        let share = 2.0 * poles.len() as f64 / values as f64;
        let degrees_of_freedom =
            (values - problem.links.len() * linear).checked_sub(2 * poles.len()).filter(|d| *d > 0)? as f64;
        let jacobian = problem.jacobian()?;
        let chi2: f64 = problem.residuals()?.norm_squared();
        let covariance = jacobian.tr_mul(&jacobian).try_inverse()? * (chi2 / degrees_of_freedom);
        let mut links = Vec::new();
        let mut deviance = 0.0;
        for link in problem.links {
            let n = link.tau_s.len() as f64;
            let rss = link.residual.norm_squared();
            deviance += n * (rss / n).max(f64::MIN_POSITIVE).ln();
            let noise_rad = (rss / (n * (1.0 - share) - linear as f64).max(1.0)).sqrt();
            let inverse = link.triangle.try_inverse()?;
            let spread = |k: usize| inverse.row(k).norm();
            let c = &link.coefficients;
            let modes = 0..poles.len();
            links.push(LinkFit {
                offset_rad: c[0],
                drift_rad: c.as_slice()[1 + 2 * poles.len()..].to_vec(),
                amplitudes_rad: modes.clone().map(|m| Complex::new(c[1 + 2 * m], -c[2 + 2 * m])).collect(),
                amplitude_sd_rad: modes
                    .map(|m| noise_rad * spread(1 + 2 * m).hypot(spread(2 + 2 * m)) * std::f64::consts::FRAC_1_SQRT_2)
                    .collect(),
                residual_rad: link.residual.as_slice().to_vec(),
                noise_rad,
            });
        }
        let finite = covariance.iter().all(|c| c.is_finite());
        finite.then_some(SinusoidFit { origin_s, poles, covariance, links, degrees_of_freedom, deviance })
    }

    /// Whether no amplitude is larger than the recording allows.
    fn stays_within(&self, signal: &Signal) -> bool {
        self.links
            .iter()
            .zip(&signal.links)
            .all(|(fit, link)| fit.amplitudes_rad.iter().all(|a| a.norm() <= LARGEST_AMPLITUDE * link.range_rad()))
    }

    /// Whether every frequency is known well enough for the linearisation that gives its interval: to less than half of itself.
    fn is_resolved(&self) -> bool {
        (0..self.poles.len()).all(|m| self.frequency_hz(m).low > 0.5 * self.poles[m].frequency_hz())
    }

    /// Natural frequency of a mode.
    pub fn frequency_hz(&self, mode: usize) -> Estimate {
        let Pole { omega_rad_s: w, decay_per_s: s } = self.poles[mode];
        let natural = w.hypot(s);
        let sd = self.propagated(mode, [w / natural, s / natural]) / std::f64::consts::TAU;
        Estimate::new(self.poles[mode].frequency_hz(), sd, self.degrees_of_freedom)
    }

    /// Damping ratio of a mode.
    pub fn damping_ratio(&self, mode: usize) -> Estimate {
        let Pole { omega_rad_s: w, decay_per_s: s } = self.poles[mode];
        let cubed = w.hypot(s).powi(3);
        let sd = self.propagated(mode, [-s * w / cubed, w * w / cubed]);
        Estimate::new(self.poles[mode].damping_ratio(), sd, self.degrees_of_freedom)
    }

    fn propagated(&self, mode: usize, slope: [f64; 2]) -> f64 {
        let c = self.covariance.view((2 * mode, 2 * mode), (2, 2));
        let [a, b] = slope;
        (a * a * c[(0, 0)] + 2.0 * a * b * c[(0, 1)] + b * b * c[(1, 1)]).max(0.0).sqrt()
    }

    /// The fitted angle of a link without its offset, of one mode.
    pub fn mode_rad(&self, link: usize, mode: usize, t_s: f64) -> f64 {
        let (pole, tau) = (self.poles[mode], t_s - self.origin_s);
        let rotation = Complex::from_polar((-pole.decay_per_s * tau).exp(), pole.omega_rad_s * tau);
        (self.links[link].amplitudes_rad[mode] * rotation).re
    }

    /// The signal with the offsets and every mode but one taken away.
    pub fn isolate(&self, signal: &Signal, mode: usize) -> Signal {
        let value = |link: usize, t: f64, theta: f64| {
            let others = (0..self.poles.len()).filter(|m| *m != mode).map(|m| self.mode_rad(link, m, t));
            theta - self.links[link].offset_rad - others.sum::<f64>()
        };
        let each = |(link, samples): (usize, &LinkSamples)| {
            samples.t_s.iter().zip(&samples.theta_rad).map(|(t, a)| value(link, *t, *a)).collect()
        };
        signal.with_values(signal.links.iter().enumerate().map(each).collect())
    }

    /// The fit of one mode of it, as if it were alone in the signal that [`SinusoidFit::isolate`] gives.
    #[must_use]
    pub fn only(&self, mode: usize) -> Self {
        let link = |l: &LinkFit| LinkFit {
            offset_rad: 0.0,
            drift_rad: Vec::new(),
            amplitudes_rad: vec![l.amplitudes_rad[mode]],
            amplitude_sd_rad: vec![l.amplitude_sd_rad[mode]],
            ..l.clone()
        };
        Self {
            poles: vec![self.poles[mode]],
            covariance: self.covariance.view((2 * mode, 2 * mode), (2, 2)).into_owned(),
            links: self.links.iter().map(link).collect(),
            ..self.clone()
        }
    }

    /// Terms of drift, of each link.
    pub fn drift_terms(&self) -> usize {
        self.links.first().map_or(0, |link| link.drift_rad.len())
    }

    /// The same with so many terms of drift; as it is where that leads to no fit.
    #[must_use]
    pub fn with_drift_terms(self, signal: &Signal, terms: usize) -> Self {
        if self.drift_terms() == terms {
            return self;
        }
        Self::with_drift(signal, self.origin_s, &self.poles, terms).unwrap_or(self)
    }

    /// A link's drift, its offset not included.
    pub fn drift_at_rad(&self, signal: &Signal, link: usize, t_s: f64) -> f64 {
        let turn = drift_phase(t_s - self.origin_s, signal.duration_s());
        let terms = self.links[link].drift_rad.iter().enumerate();
        terms.map(|(k, d)| d * (turn * (k + 1) as f64).cos()).sum()
    }

    /// How far each link's drift goes over the record.
    pub fn drift_ranges_rad(&self, signal: &Signal) -> Vec<f64> {
        let at = |link: usize, k: u32| {
            self.drift_at_rad(signal, link, self.origin_s + f64::from(k) / 200.0 * signal.duration_s())
        };
        let range = |link: usize| {
            let values = (0..=200).map(|k| at(link, k));
            let [low, high] = values.fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], v| [l.min(v), h.max(v)]);
            high - low
        };
        (0..self.links.len()).map(range).collect()
    }

    /// The signal with the drifts taken away.
    pub fn without_drift(&self, signal: &Signal) -> Signal {
        let each = |(link, samples): (usize, &LinkSamples)| {
            let pairs = samples.t_s.iter().zip(&samples.theta_rad);
            pairs.map(|(t, a)| a - self.drift_at_rad(signal, link, *t)).collect()
        };
        signal.with_values(signal.links.iter().enumerate().map(each).collect())
    }

    /// How many terms of drift, up to those fitted, the Bayesian information criterion wants at these poles: the columns of the drift stand last, so
    /// that one orthogonalisation gives the residual of every number of them.
    pub fn wanted_drift(&self, signal: &Signal) -> usize {
        let most = self.drift_terms();
        let problem = Projection::new(signal, self.origin_s, &self.poles, most);
        let values = signal.values() as f64;
        let criterion = |terms: usize| {
            let deviance = problem.links.iter().map(|link| {
                let n = link.tau_s.len() as f64;
                let projected = link.orthonormal.tr_mul(&link.measured);
                let left_out = projected.len() - (most - terms);
                let rss = link.residual.norm_squared() + projected.rows_range(left_out..).norm_squared();
                n * (rss / n).max(f64::MIN_POSITIVE).ln()
            });
            deviance.sum::<f64>() + (terms * problem.links.len()) as f64 * values.ln()
        };
        (0..=most).min_by(|a, b| criterion(*a).total_cmp(&criterion(*b))).unwrap_or(0)
    }

    /// The deviance that offsets and drifts alone would have.
    pub fn deviance_without_modes(&self, signal: &Signal) -> f64 {
        let terms = self.drift_terms();
        let problem = Projection::new(signal, self.origin_s, &[], terms);
        let deviance = problem.links.iter().map(|link| {
            let n = link.tau_s.len() as f64;
            n * (link.residual.norm_squared() / n).max(f64::MIN_POSITIVE).ln()
        });
        deviance.sum()
    }

    /// Mean square of a mode over the record, all links together: how strong it is.
    pub fn strength(&self, mode: usize, duration_s: f64) -> f64 {
        let squares: f64 = self.links.iter().map(|l| l.amplitudes_rad[mode].norm_sqr()).sum();
        squares * self.poles[mode].mean_square(duration_s)
    }

    /// The residuals as a signal.
    pub fn residuals(&self, signal: &Signal) -> Signal {
        signal.with_values(self.links.iter().map(|l| l.residual_rad.clone()).collect())
    }

    /// Largest amplitude of a mode among the links at the origin.
    pub fn amplitude_rad(&self, mode: usize) -> f64 {
        self.links.iter().map(|l| l.amplitudes_rad[mode].norm()).fold(0.0, f64::max)
    }

    /// The same so long after the origin.
    pub fn last_amplitude_rad(&self, mode: usize, duration_s: f64) -> f64 {
        self.amplitude_rad(mode) * (-self.poles[mode].decay_per_s * duration_s).exp()
    }

    /// The Bayesian information criterion, up to a constant.
    pub fn criterion(&self, signal: &Signal) -> f64 {
        self.deviance + self.parameters() as f64 * (signal.values() as f64).ln()
    }

    /// Number of parameters: poles, amplitudes, offsets.
    pub fn parameters(&self) -> usize {
        let drift = self.drift_terms();
        2 * self.poles.len() + self.links.len() * (1 + drift + 2 * self.poles.len())
    }
}
