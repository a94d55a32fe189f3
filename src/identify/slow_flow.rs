//! The slow flow of one oscillation: its amplitude and phase over a record, and the least-squares problem in what they depend on.
//!
//! ```text
//! θᵢ(t) = oᵢ + pᵢa² + Σₖ dᵢₖ cos(πkτ/T) + Σₕ Re[cᵢₕ aʰ e^{ihφ}],   h = 1, 2, 3,  τ = t − t₀,  a(t₀) = 1,  φ(t₀) = 0
//! dφ/dt = ω₀ (1 − k a² + k²a⁴/4 − ξ²/2)    k = κA₀², ξ = (β₁ + β₂a)/ω₀, A₀ the first amplitude of the link that moves most
//! da/dt = −(β₀ + β₁a + β₂a²)               dry friction, viscous, quadratic drag
//! ```
//!
//! It is that of a weakly nonlinear oscillator (Nayfeh and Mook, Nonlinear Oscillations, 1979, ch. 2). A spring that is stiffer to one side moves the middle of
//! the swing by a part that goes with a², as its second harmonic does. Offsets, drifts, shapes and harmonics enter linearly and
//! are eliminated (variable projection). k has a prior, one more observation.
//!
//! Dry friction lets each half swing go about a centre that is shifted by δ against the motion, so that the oscillation lags a little more the smaller it is:
//! to first order in δ/A its fundamental is
//!
//! ```text
//! A cos φ + 3δ/π sin φ,        δ = πβ₀A₀/2ω₀        (from the exact solution, half swing by half swing)
//! ```
//! and it has a third harmonic of constant size.
//!
//! The next power of the amplitude in the frequency is a pendulum's, whose fundamental has the amplitude A. A displacement is taken for x = L sin θ of one: a is the
//! amplitude of the angle, and the fundamental that is seen
//!
//! ```text
//! f = f₀(1 − A²/16 + A⁴/1024) = f₀(1 − κA² + κ²A⁴/4)
//! A_x = 2L J₁(A) = L(A − A³/8 + A⁵/192 − …),   A² = 16κA²
//! ```

use levenberg_marquardt::{LeastSquaresProblem, LevenbergMarquardt};
use nalgebra::storage::Owned;
use nalgebra::{Complex, DMatrix, DVector, Dyn};

use super::numerics::{central_differences, runge_kutta};
use super::pole::Pole;
use super::projection::{Eliminated, drift_phase};
use super::signal::{LinkSamples, Signal};
use crate::series::Measured;

/// Of ω₀, k, β₀, β₁, β₂ those that are free, with one set of losses after the other.
pub const SETS: [&[usize]; 7] =
    [&[0, 1, 3], &[0, 1, 2], &[0, 1, 4], &[0, 1, 2, 3], &[0, 1, 3, 4], &[0, 1, 2, 4], &[0, 1, 2, 3, 4]];
/// An integration step is at most this part of the record: the amplitude changes slowly.
const STEPS: f64 = 200.0;
/// Below this part of the first amplitude the swing is over.
const OVER: f64 = 1e-3;
/// Harmonics of the oscillation.
const HARMONICS: i32 = 3;
/// A swing is followed down to so many δ of dry friction, to the fewer where too little of it would be left (judgement: the second order in δ/A is then 4 % and
/// 16 %).
pub const FEWEST_DELTA: [f64; 2] = [5.0, 2.5];
/// κA² is at most this, either way: that of a swing of 80° (judgement: beyond it the powers of the amplitude that stand here are too few).
const MOST_K: f64 = 0.12;
/// A harmonic is at most this part of the fundamental (judgement: an oscillation of half the frequency has its second one alone).
const MOST_HARMONIC: f64 = 0.2;
/// ξ is at most this (judgement: what is of second order in it is then half a percent).
const MOST_DAMPING: f64 = 0.1;

/// The least-squares problem in what is not linear.
#[derive(Debug, Clone)]
pub struct SlowFlow<'a> {
    /// What was recorded.
    pub signal: &'a Signal,
    /// Mean and standard deviation of k.
    pub prior: [f64; 2],
    /// Angles, or a displacement.
    pub measured: Measured,
    /// Of each link.
    pub drift_terms: usize,
    /// Of each link, that of its residual.
    pub noise_rad: Vec<f64>,
    /// ω₀, k, β₀, β₁, β₂ over [`Self::units`].
    values: [f64; 5],
    /// Of them those that are free.
    pub free: Vec<usize>,
    /// ω₀ at first.
    omega_rad_s: f64,
}

/// f/f₀ of a pendulum where κA² is this.
fn slowed(kappa_a2: f64) -> f64 {
    1.0 - kappa_a2 + 0.25 * kappa_a2.powi(2)
}

/// The amplitude of sin θ over that of θ, of a pendulum of which κA² is this: 2J₁(A)/A.
fn flattened(kappa_a2: f64) -> f64 {
    let q = kappa_a2.max(0.0);
    1.0 - 2.0 * q + 4.0 / 3.0 * q.powi(2) - 4.0 / 9.0 * q.powi(3)
}

/// What is left of one link, and its coefficients: offset, drifts, what goes with a², cosine and sine of each harmonic.
struct Projected {
    residual: DVector<f64>,
    coefficients: DVector<f64>,
}

/// What an oscillation depends on.
#[derive(Debug, Clone, Copy)]
pub struct Coefficients {
    /// ω₀.
    pub omega_rad_s: f64,
    /// κA₀².
    pub k: f64,
    /// β₀, β₁, β₂.
    pub losses_per_s: [f64; 3],
}

impl Coefficients {
    /// Of these, in order.
    pub fn of([omega_rad_s, k, dry, viscous, drag]: [f64; 5]) -> Self {
        Self { omega_rad_s, k, losses_per_s: [dry, viscous, drag] }
    }

    /// All of them, in order.
    pub fn values(&self) -> [f64; 5] {
        let [dry, viscous, drag] = self.losses_per_s;
        [self.omega_rad_s, self.k, dry, viscous, drag]
    }

    /// δ of dry friction over A₀.
    pub fn shift(&self) -> f64 {
        0.5 * std::f64::consts::PI * self.losses_per_s[0] / self.omega_rad_s
    }
}

impl<'a> SlowFlow<'a> {
    /// To begin with, near a pole, with a prior of k, so many terms of drift and the links' noise.
    pub fn at(
        signal: &'a Signal,
        pole: Pole,
        (prior, measured): ([f64; 2], Measured),
        drift_terms: usize,
        noise_rad: &[f64],
    ) -> Self {
        let values = [1.0, prior[0], 0.0, pole.decay_per_s * signal.duration_s(), 0.0];
        let (noise_rad, omega_rad_s) = (noise_rad.to_vec(), pole.omega_rad_s);
        Self { signal, prior, measured, drift_terms, noise_rad, values, free: SETS[0].to_vec(), omega_rad_s }
    }

    /// What the oscillation depends on.
    pub fn coefficients(&self) -> Coefficients {
        self.coefficients_of(&self.values)
    }

    fn coefficients_of(&self, values: &[f64; 5]) -> Coefficients {
        let units = self.units();
        Coefficients::of(std::array::from_fn(|i| values[i] * units[i]))
    }

    /// In which its values are.
    fn units(&self) -> [f64; 5] {
        let per_s = self.signal.duration_s().recip();
        [self.omega_rad_s, 1.0, per_s, per_s, per_s]
    }

    /// The values with those that are free replaced.
    fn with(&self, free: &DVector<f64>) -> [f64; 5] {
        let mut values = self.values;
        self.free.iter().zip(free.iter()).for_each(|(k, value)| values[*k] = *value);
        values
    }

    /// Solved with these free, the links weighed by their noise.
    pub fn solved(mut self, free: &[usize]) -> Option<Self> {
        self.free = free.to_vec();
        let lost = self.values[2..].iter().sum::<f64>();
        (2..5).filter(|i| !free.contains(i)).for_each(|i| self.values[i] = 0.0);
        // a loss that begins at nothing shows no slope where it alone is there
        if self.values[2..].iter().all(|own| *own == 0.0) {
            free.iter().filter(|i| **i > 1).for_each(|i| self.values[*i] = lost);
        }
        for _ in 0..2 {
            let (solved, report) = LevenbergMarquardt::new().with_tol(1e-10).with_patience(60).minimize(self);
            report.termination.was_successful().then_some(())?;
            self = solved;
            self.noise_rad = self.residual_sd_rad()?;
        }
        Some(self)
    }

    /// Amplitude over the first one and phase at each sample.
    fn course(&self, values: &[f64; 5], link: &LinkSamples) -> Vec<[f64; 2]> {
        let Coefficients { omega_rad_s, k, losses_per_s: [dry, viscous, drag] } = self.coefficients_of(values);
        let slope = |[a, _]: [f64; 2]| {
            let loss = if a > OVER { dry + viscous * a + drag * a * a } else { 0.0 };
            let damped = 0.5 * ((viscous + drag * a) / omega_rad_s).powi(2);
            [-loss, omega_rad_s * (slowed(k * a * a) - damped)]
        };
        let longest_s = self.signal.duration_s() / STEPS;
        let (mut t_s, mut state) = (self.signal.span_s[0], [1.0, 0.0]);
        let at = |to_s: &f64| {
            let count = ((to_s - t_s) / longest_s).ceil().max(1.0);
            let step_s = (to_s - t_s) / count;
            for _ in 0..count as usize {
                state = runge_kutta(state, step_s, slope);
            }
            t_s = *to_s;
            state
        };
        link.t_s.iter().map(at).collect()
    }

    fn projected(&self, values: &[f64; 5]) -> Option<Vec<Projected>> {
        let of_link = |link: &LinkSamples| {
            let (columns, first) = (self.columns(), self.first_harmonic());
            let lag = 3.0 / std::f64::consts::PI * self.coefficients_of(values).shift();
            let mut basis = DMatrix::from_element(link.t_s.len(), columns, 1.0);
            for (row, ([a, phase], t_s)) in self.course(values, link).into_iter().zip(&link.t_s).enumerate() {
                let turn = drift_phase(t_s - self.signal.span_s[0], self.signal.duration_s());
                (1..=self.drift_terms).for_each(|k| basis[(row, k)] = (turn * k as f64).cos());
                basis[(row, first - 1)] = a * a;
                let turned = |times: i32| Complex::from_polar(1.0, f64::from(times) * phase);
                let seen = match self.measured {
                    Measured::Angles => 1.0,
                    Measured::Displacement => flattened(values[1] * a * a),
                };
                let powers = (1..=HARMONICS).map(|times| (seen * a).powi(times) * turned(times));
                let friction = self.has_friction().then(|| turned(3));
                let lagging = -Complex::i() * lag * turned(1);
                for (i, own) in powers.chain(friction).enumerate() {
                    let own = if i == 0 { own + lagging } else { own };
                    let column = first + 2 * i;
                    (basis[(row, column)], basis[(row, column + 1)]) = (own.re, own.im);
                }
            }
            let own = Eliminated::of(basis, &DVector::from_column_slice(&link.theta_rad));
            Some(Projected { residual: own.residual, coefficients: own.coefficients? })
        };
        self.signal.links.iter().map(of_link).collect()
    }

    fn misfit(&self, values: &[f64; 5]) -> Option<DVector<f64>> {
        let links = self.projected(values)?;
        let of_link = |(link, noise): (&Projected, &f64)| (&link.residual / *noise).as_slice().to_vec();
        let mut all: Vec<f64> = links.iter().zip(&self.noise_rad).flat_map(of_link).collect();
        all.push((values[1] - self.prior[0]) / self.prior[1]);
        all.iter().all(|r| r.is_finite()).then(|| DVector::from_vec(all))
    }

    fn has_friction(&self) -> bool {
        self.free.contains(&2)
    }

    /// Place of the fundamental's first coefficient, after offset, drifts and what goes with a².
    fn first_harmonic(&self) -> usize {
        2 + self.drift_terms
    }

    /// Linear coefficients of a link.
    fn columns(&self) -> usize {
        self.first_harmonic() + 2 * (HARMONICS as usize + usize::from(self.has_friction()))
    }

    /// Values less coefficients.
    pub fn degrees_of_freedom(&self) -> f64 {
        let linear = self.signal.links.len() * self.columns();
        self.signal.values() as f64 - (linear + self.free.len()) as f64
    }

    fn residual_sd_rad(&self) -> Option<Vec<f64>> {
        let share = self.degrees_of_freedom() / self.signal.values() as f64;
        let sd = |link: &Projected| (link.residual.norm_squared() / (share * link.residual.len() as f64)).sqrt();
        let all: Vec<f64> = self.projected(&self.values)?.iter().map(sd).collect();
        (share > 0.0 && all.iter().all(|sd| *sd > 0.0 && sd.is_finite())).then_some(all)
    }

    /// Whether all losses take energy.
    pub fn loses(&self) -> bool {
        self.values[2..].iter().all(|own| *own >= 0.0)
    }

    /// Whether it is one weakly nonlinear oscillation, whose amplitude changes little in a cycle.
    pub fn is_weakly_nonlinear(&self) -> bool {
        let own = self.coefficients();
        let changes_slowly = own.losses_per_s.iter().sum::<f64>().abs() < MOST_DAMPING * own.omega_rad_s;
        let Some(links) = self.projected(&self.values) else { return false };
        let size = |link: &Projected, times: usize| {
            let place = self.first_harmonic() + 2 * (times - 1);
            link.coefficients[place].hypot(link.coefficients[place + 1])
        };
        let sum = |times: usize| links.iter().map(|link| size(link, times)).sum::<f64>();
        let is_plain = (2..=HARMONICS as usize).all(|times| sum(times) < MOST_HARMONIC * sum(1));
        changes_slowly && is_plain && own.k.abs() < MOST_K
    }

    /// The Bayesian information criterion, up to a constant.
    pub fn criterion(&self) -> f64 {
        let values = self.signal.values() as f64;
        self.deviance() + (values - self.degrees_of_freedom()) * values.ln()
    }

    /// Minus twice the log-likelihood, up to a constant.
    pub fn deviance(&self) -> f64 {
        let lengths = self.signal.links.iter().map(|link| link.t_s.len() as f64);
        lengths.zip(&self.noise_rad).map(|(n, sd)| 2.0 * n * sd.ln()).sum()
    }

    /// Whether k was opened to this prior, for the recording contradicts what hung bodies allow. Of a displacement it is open from the start, which contradicts nothing.
    pub fn is_beyond_hung_bodies(&self, open: [f64; 2]) -> bool {
        self.measured == Measured::Angles && self.prior == open
    }

    /// The same solved with another mean and standard deviation of what k may be.
    pub fn with_prior(&self, prior: [f64; 2]) -> Option<Self> {
        Self { prior, ..self.clone() }.solved(&self.free)
    }

    /// The same of a part of the recording that begins with it.
    pub fn over<'b>(&self, part: &'b Signal) -> Option<SlowFlow<'b>> {
        let longer = part.duration_s() / self.signal.duration_s();
        let [omega, k, dry, viscous, drag] = self.values;
        let values = [omega, k, dry * longer, viscous * longer, drag * longer];
        let (free, noise_rad) = (self.free.clone(), self.noise_rad.clone());
        SlowFlow { signal: part, values, free, noise_rad, ..*self }.solved(&self.free)
    }

    /// When dry friction has left a swing of so many δ, which may stick soon, and what is of first order in δ/A describes it no longer.
    pub fn sticks_from_s(&self, fewest_delta: f64) -> Option<f64> {
        let least = fewest_delta * self.coefficients().shift();
        let link = self.longest()?;
        let place = self.course(&self.values, link).iter().position(|[a, _]| *a < least)?;
        Some(link.t_s[place])
    }

    /// The amplitude in the end, over the first one.
    pub fn last(&self) -> Option<f64> {
        let [a, _] = *self.course(&self.values, self.longest()?).last()?;
        Some(a.max(OVER))
    }

    fn longest(&self) -> Option<&'a LinkSamples> {
        self.signal.links.iter().max_by(|a, b| a.t_s.len().cmp(&b.t_s.len()))
    }

    /// A₀.
    pub fn amplitude_rad(&self) -> Option<f64> {
        let first = self.first_harmonic();
        let amplitude = |link: &Projected| link.coefficients[first].hypot(link.coefficients[first + 1]);
        Some(self.projected(&self.values)?.iter().map(amplitude).fold(f64::MIN_POSITIVE, f64::max))
    }

    /// What it leaves.
    pub fn residual(&self) -> Option<Signal> {
        let links = self.projected(&self.values)?;
        Some(self.signal.with_values(links.iter().map(|link| link.residual.as_slice().to_vec()).collect()))
    }

    /// Covariance of ω₀, k, β₀, β₁, β₂, zero for what is not free.
    pub fn covariance(&self) -> Option<DMatrix<f64>> {
        let (jacobian, units) = (self.jacobian()?, self.units());
        let own = jacobian.tr_mul(&jacobian).try_inverse()?;
        let mut covariance = DMatrix::zeros(units.len(), units.len());
        for (i, row) in self.free.iter().enumerate() {
            for (j, column) in self.free.iter().enumerate() {
                covariance[(*row, *column)] = own[(i, j)] * units[*row] * units[*column];
            }
        }
        Some(covariance)
    }
}

impl LeastSquaresProblem<f64, Dyn, Dyn> for SlowFlow<'_> {
    type ResidualStorage = Owned<f64, Dyn>;
    type JacobianStorage = Owned<f64, Dyn, Dyn>;
    type ParameterStorage = Owned<f64, Dyn>;

    fn set_params(&mut self, free: &DVector<f64>) {
        self.values = self.with(free);
    }

    fn params(&self) -> DVector<f64> {
        DVector::from_iterator(self.free.len(), self.free.iter().map(|k| self.values[*k]))
    }

    fn residuals(&self) -> Option<DVector<f64>> {
        self.misfit(&self.values)
    }

    fn jacobian(&self) -> Option<DMatrix<f64>> {
        central_differences(&self.params(), |free| self.misfit(&self.with(free)))
    }
}
