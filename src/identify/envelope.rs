//! Frequency and damping as functions of amplitude: the sign of missing physics.
//!
//! The record is cut into windows of a few cycles, in each of which damped sinusoids are fitted on their own. Amplitude A and phase φ at each
//! window's middle are independent of one another and of the other windows', and between neighbours
//!
//! ```text
//! f = Δφ / 2πΔt,   σ = ln(A/A') / Δt
//! ```
//! which is far sharper than a frequency or damping fitted within a window. Weighted least squares then lay laws through all windows:
//!
//! ```text
//! dφ/dt = 2πf₀ (1 − κA² − κ'A'²)              κ = 1/16 for a rigid pendulum; A' belongs to the other mode
//! d ln A/dt = −σ₀ (1 + λA² + λ'A'²)           a linear damper on a swing of finite size
//! dA/dt = −(b₀ + b₁A + b₂A²)                  friction, viscous, quadratic
//! ```
//! The first two give f₀ and ξ₀ at small amplitude. Where the windows are too few or too much alike to tell how amplitude acts, it is bounded by what
//! hung bodies do: κ = 0.03 ± 0.03 for the slowest mode, 0.4 ± 0.5 for faster ones, κ' = 0 ± 0.1, λ = 0 ± 0.15 and 0 ± 0.5, λ' = 0 ± 0.3 /rad² (one standard deviation)
//! enter as observations, so that the intervals of f₀ and ξ₀ hold what the data leave open; of a displacement, whose angle nobody knows, κ is open. A fourth power of A is added where the second does not
//! describe the windows, and half of what it changes is added to the standard deviation for the powers left out.
//! The third law is for a picture and a first guess, never to decide: Coulomb friction and quadratic drag together imitate a viscous damper.

use nalgebra::{DMatrix, DVector};
use serde::Serialize;

use super::decay_law::{DecayFit, DecayLaw, Widening};
use super::estimate::{Estimate, chi_squared_tail, f_tail};
use super::windows::{FEWEST_OF_A_LAW, WindowAmplitude, Windows};
use crate::series::Measured;

/// κ of a pendulum (1/rad²), f = f₀(1 − κA²).
pub const PENDULUM: f64 = 1.0 / 16.0;
/// By how much the theory of κ may be off: it is the first term in A², for a shape that does not change with amplitude.
pub(super) const THEORY_TOLERANCE: f64 = 0.15;

/// From here on the frequency within a window is trusted to join it to the next.
const CLEAR_OF_UNWRAPPING: f64 = 15.0;

/// A step from one window to the next.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Step {
    /// Halfway between the windows' middles.
    pub t_s: f64,
    /// Amplitude of the link that moves most.
    pub amplitude_rad: f64,
    /// Undamped natural frequency.
    pub frequency_hz: Estimate,
    /// ξ.
    pub damping_ratio: Estimate,
}

/// f = f₀ (1 − κA²).
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct FrequencyLaw {
    /// Undamped natural frequency at small amplitude.
    pub f0_hz: Estimate,
    /// κ (1/rad²).
    pub kappa_per_rad2: Estimate,
    /// Probability that noise alone makes so much dependence on this and the other mode's amplitude; small: the frequency is not constant.
    pub p_constant: f64,
    /// Probability that the phases scatter so far about the law by noise.
    pub p_value: f64,
}

/// ξ = ξ₀ (1 + λA²).
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct DampingLaw {
    /// Damping ratio at small amplitude.
    pub xi0: Estimate,
    /// Probability that the amplitudes scatter so far about the law by noise; small: friction, drag, or another law altogether.
    pub p_value: f64,
}

/// One mode's history.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Envelope {
    /// Number of windows in which the mode stands clear of the noise.
    pub windows: usize,
    /// Length of each.
    pub window_s: f64,
    /// From window to window.
    pub steps: Vec<Step>,
    /// ξ when dA/dt = −b₁A.
    pub damping_ratio: Estimate,
    /// Probability that the amplitudes scatter so far about an exponential by noise.
    pub p_exponential: f64,
    /// Root of the mean square of the windows' amplitudes: what a term left out of the two laws below would act with.
    pub rms_amplitude_rad: f64,
    /// Frequency against amplitude.
    pub frequency: Option<FrequencyLaw>,
    /// Damping against amplitude.
    pub damping: Option<DampingLaw>,
    /// Decay against amplitude, from six windows on.
    pub decay: Option<DecayLaw>,
}

impl Envelope {
    /// Of one mode of the windows, in these of its moments, which has these bounds.
    ///
    /// # Errors
    /// In words, when the mode is clear of the noise, and of what else there is, in fewer than three windows.
    pub(super) fn of(
        windows: &Windows,
        mode: usize,
        moments: &[WindowAmplitude],
        bounds: Bounds,
    ) -> Result<Self, String> {
        if moments.len() < 3 {
            let clear_of = if windows.moments[mode].len() < 3 { "the noise" } else { "the slowest mode's harmonics" };
            return Err(format!(
                "the mode stands clear of {clear_of} in {} window{} of {:.2} s; at least 3 are needed",
                moments.len(),
                if moments.len() == 1 { "" } else { "s" },
                windows.window_s
            ));
        }
        let others: Vec<&[WindowAmplitude]> =
            windows.moments.iter().enumerate().filter(|(m, _)| *m != mode).map(|(_, w)| w.as_slice()).collect();
        let exponential =
            DecayFit::of(moments, [false, true, false]).ok_or("the amplitudes do not converge to a decay")?;
        let phases = unwrapped(moments);
        let b1 = exponential.estimate(2);
        let omega = (phases[phases.len() - 1] - phases[0]) / (moments[moments.len() - 1].t_s - moments[0].t_s);
        let damping_ratio = b1.map(|s| s / s.hypot(omega), omega * omega / b1.value.hypot(omega).powi(3));
        let regression = Regression::of(moments, &others, bounds);
        let frequency = regression.frequency_law(&phases, damping_ratio.value);
        // at small amplitude, as the damping ratio is
        let natural_rad_s = frequency.map_or(omega.hypot(b1.value), |law| std::f64::consts::TAU * law.f0_hz.value);
        let squares: f64 = moments.iter().map(|m| m.amplitude_rad().powi(2)).sum();
        Ok(Self {
            windows: moments.len(),
            window_s: windows.window_s,
            steps: steps(moments, &phases),
            damping_ratio,
            p_exponential: exponential.p_value,
            rms_amplitude_rad: (squares / moments.len() as f64).sqrt(),
            frequency,
            damping: regression.damping_law(natural_rad_s),
            decay: DecayLaw::of(moments, &exponential),
        })
    }
}

impl Envelope {
    /// With intervals that allow for other modes of these amplitudes, where the windows do not follow them, and for what is not known of those modes: they are taken away
    /// as the whole record's fit has them, and the two are known no better than this fit knows them.
    pub(super) fn widened_for_other_modes(
        mut self,
        others_rad: impl Iterator<Item = f64>,
        [frequency_hz, damping_ratio]: [Estimate; 2],
    ) -> Self {
        let fourth: f64 = others_rad.map(|a| a.powi(4)).sum();
        let squares = fourth.sqrt();
        let [kappa, lambda] = [Bounds::OTHER.kappa[1], Bounds::OTHER.lambda[1]].map(|sd| sd * squares);
        if let Some(law) = &mut self.frequency {
            law.f0_hz = law.f0_hz.blurred((kappa * law.f0_hz.value).hypot(frequency_hz.sd));
        }
        if let Some(law) = &mut self.damping {
            law.xi0 = law.xi0.blurred((lambda * law.xi0.value).hypot(damping_ratio.sd));
        }
        self.damping_ratio = self.damping_ratio.blurred(damping_ratio.sd);
        self
    }

    /// ξ₀, where a linear damper explains the decay.
    pub fn linear_damping(&self) -> Option<Estimate> {
        self.damping.filter(|law| law.p_value >= 0.01).map(|law| law.xi0)
    }

    /// A frequency with an interval that holds those of the steps.
    pub(super) fn over_steps(&self, frequency_hz: Estimate) -> Estimate {
        let steps = self.steps.iter().map(|s| s.frequency_hz.value);
        steps.fold(frequency_hz, |range, f_hz| range.widened_to_cover(f_hz, f_hz))
    }

    /// ξ as if there were a linear damper, stretched to what the steps show that tell it to a tenth.
    pub fn damping_over_the_record(&self) -> Estimate {
        let certain = |s: &&Step| s.damping_ratio.sd < 0.1 * s.damping_ratio.value;
        let steps = self.steps.iter().filter(certain).map(|s| s.damping_ratio.value);
        steps.fold(self.damping_ratio, |range, xi| range.widened_to_cover(xi, xi))
    }
}

/// Phases without jumps. Neighbours are joined by the frequency found within their windows; where the mode has become weak, by that of the step
/// before, which is sharper.
pub(super) fn unwrapped(moments: &[WindowAmplitude]) -> Vec<f64> {
    let mut phases: Vec<f64> = moments.first().map(|m| m.amplitude_rad.arg()).into_iter().collect();
    let mut before: Option<f64> = None;
    for pair in moments.windows(2) {
        let span_s = pair[1].t_s - pair[0].t_s;
        let weak = pair.iter().any(|m| m.amplitude_rad() < CLEAR_OF_UNWRAPPING * m.sd_rad);
        let omega = before.filter(|_| weak).unwrap_or(0.5 * (pair[0].omega_rad_s + pair[1].omega_rad_s));
        let expected = phases[phases.len() - 1] + omega * span_s;
        let turns = ((expected - pair[1].amplitude_rad.arg()) / std::f64::consts::TAU).round();
        let phase = pair[1].amplitude_rad.arg() + turns * std::f64::consts::TAU;
        before = Some((phase - phases[phases.len() - 1]) / span_s);
        phases.push(phase);
    }
    phases
}

fn steps(moments: &[WindowAmplitude], phases: &[f64]) -> Vec<Step> {
    let pair = |k: usize| {
        let (a, b) = (&moments[k], &moments[k + 1]);
        let (from, to) = (a.amplitude_rad(), b.amplitude_rad());
        let span_s = b.t_s - a.t_s;
        let relative = (a.sd_rad / from).hypot(b.sd_rad / to);
        let (omega, decay) = ((phases[k + 1] - phases[k]) / span_s, (from / to).ln() / span_s);
        let natural = omega.hypot(decay);
        let sd = relative / span_s;
        Step {
            t_s: 0.5 * (a.t_s + b.t_s),
            amplitude_rad: (from * to).sqrt(),
            frequency_hz: Estimate::new(natural / std::f64::consts::TAU, sd / std::f64::consts::TAU, 1e6),
            damping_ratio: Estimate::new(decay / natural, sd * omega * omega / natural.powi(3), 1e6),
        }
    };
    (0..moments.len() - 1).map(pair).collect()
}

/// Standard deviation of κ where nothing is known of it.
const UNKNOWN: f64 = 1e3;

/// What is known beforehand of how amplitude acts: mean and standard deviation (1/rad²).
#[derive(Debug, Clone, Copy)]
pub(super) struct Bounds {
    pub kappa: [f64; 2],
    pub lambda: [f64; 2],
    /// Standard deviation of the next power's relative effect on frequency and damping (1/rad⁴), as simulated two-rod chains have it.
    pub fourth: [f64; 2],
}

impl Bounds {
    /// Of the other mode's amplitude.
    pub const OTHER: Self = Self { kappa: [0.0, 0.1], lambda: [0.0, 0.3], fourth: [0.0; 2] };

    /// Of the mode's own amplitude. Of a displacement nobody knows what angle it is of, nor κ therefore.
    pub fn of(slowest: bool, measured: Measured) -> Self {
        let of_angles = if slowest {
            Self { kappa: [0.03, 0.03], lambda: [0.0, 0.15], fourth: [1e-3, 0.1] }
        } else {
            Self { kappa: [0.4, 0.5], lambda: [0.0, 0.5], fourth: [0.03, 0.5] }
        };
        match measured {
            Measured::Angles => of_angles,
            Measured::Displacement => Self { kappa: [0.0, UNKNOWN], ..of_angles },
        }
    }
}

/// What stands for a power of an amplitude in a law, with what is known of its coefficient beforehand.
struct Term {
    /// ∫A² dt up to each window.
    integral: Vec<f64>,
    /// Mean and standard deviation of κ.
    kappa: [f64; 2],
    /// Mean and standard deviation of λ.
    lambda: [f64; 2],
}

/// Windows against time and amplitudes.
struct Regression<'a> {
    moments: &'a [WindowAmplitude],
    terms: Vec<Term>,
    quartic: Term,
}

/// y = y₀ + r (t + Σ cⱼ∫Aⱼ²).
struct Slope {
    rate: f64,
    coefficients: Vec<f64>,
    /// Of y₀, r, r c₁, r c₂, …
    covariance: DMatrix<f64>,
    degrees_of_freedom: f64,
    p_value: f64,
}

impl<'a> Regression<'a> {
    fn of(moments: &'a [WindowAmplitude], others: &[&[WindowAmplitude]], bounds: Bounds) -> Self {
        let Bounds { kappa, lambda, .. } = bounds;
        let mut terms = vec![Term { integral: powers(moments, moments, 2), kappa, lambda }];
        terms.extend(others.iter().map(|other| Term {
            integral: powers(moments, other, 2),
            kappa: Bounds::OTHER.kappa,
            lambda: Bounds::OTHER.lambda,
        }));
        let quartic = Term { integral: powers(moments, moments, 4), kappa: [0.0, kappa[1]], lambda };
        Self { moments, terms, quartic }
    }

    fn frequency_law(&self, phases: &[f64], xi: f64) -> Option<FrequencyLaw> {
        let slope = self.slope(phases, |term| [-term.kappa[0], term.kappa[1]])?;
        let natural = std::f64::consts::TAU * (1.0 - xi * xi).max(1e-9).sqrt();
        let kappa = -slope.coefficients[0];
        let c = &slope.covariance;
        // of κ = −(r c)/r
        let variance = (c[(2, 2)] + 2.0 * kappa * c[(1, 2)] + kappa * kappa * c[(1, 1)]) / slope.rate.powi(2);
        let terms = slope.coefficients.len();
        let dependence = DVector::from_iterator(terms, slope.coefficients.iter().map(|k| k * slope.rate));
        let information = c.view((2, 2), (terms, terms)).into_owned().try_inverse()?;
        let wald = dependence.dot(&(information * &dependence)) / terms as f64;
        Some(FrequencyLaw {
            f0_hz: Estimate::new(slope.rate / natural, c[(1, 1)].sqrt() / natural, slope.degrees_of_freedom),
            kappa_per_rad2: Estimate::new(kappa, variance.max(0.0).sqrt(), slope.degrees_of_freedom),
            p_constant: f_tail(wald, terms as f64, slope.degrees_of_freedom),
            p_value: slope.p_value,
        })
    }

    fn damping_law(&self, natural_rad_s: f64) -> Option<DampingLaw> {
        let logs: Vec<f64> = self.moments.iter().map(|m| m.amplitude_rad().ln()).collect();
        let slope = self.slope(&logs, |term| term.lambda)?;
        let sd = slope.covariance[(1, 1)].sqrt() / natural_rad_s;
        Some(DampingLaw {
            xi0: Estimate::new(-slope.rate / natural_rad_s, sd, slope.degrees_of_freedom),
            p_value: slope.p_value,
        })
    }

    /// With the fourth power of the amplitude where the second leaves a misfit.
    fn slope(&self, values: &[f64], prior: fn(&Term) -> [f64; 2]) -> Option<Slope> {
        let terms: Vec<&Term> = self.terms.iter().collect();
        let plain = self.least_squares(values, &terms, prior)?;
        if plain.p_value > 0.05 || self.moments.len() < FEWEST_OF_A_LAW {
            return Some(plain);
        }
        let with_quartic: Vec<&Term> = terms.into_iter().chain([&self.quartic]).collect();
        let Some(mut curved) = self.least_squares(values, &with_quartic, prior).filter(|c| c.p_value > plain.p_value)
        else {
            return Some(plain);
        };
        curved.covariance[(1, 1)] += (0.5 * (curved.rate - plain.rate)).powi(2);
        Some(curved)
    }

    /// Weighted least squares, each coefficient's prior being one more observation.
    fn least_squares(&self, values: &[f64], terms: &[&Term], prior: fn(&Term) -> [f64; 2]) -> Option<Slope> {
        let (moments, n, k) = (self.moments, self.moments.len(), terms.len());
        let span_s = moments[n - 1].t_s - moments[0].t_s;
        let about = (values[n - 1] - values[0]) / span_s;
        let weight = |row: usize| moments[row].amplitude_rad() / moments[row].sd_rad;
        let basis = DMatrix::from_fn(n + k, 2 + k, |row, column| match (row < n, column) {
            (true, 0) => weight(row),
            (true, 1) => weight(row) * (moments[row].t_s - moments[0].t_s),
            (true, _) => weight(row) * terms[column - 2].integral[row],
            (false, _) if column == row - n + 2 => 1.0 / (prior(terms[column - 2])[1] * about).abs(),
            (false, _) => 0.0,
        });
        let wanted = DVector::from_fn(n + k, |row, _| {
            if row < n {
                weight(row) * values[row]
            } else {
                let [mean, sd] = prior(terms[row - n]);
                mean * about / (sd * about).abs()
            }
        });
        let fit = basis.clone().svd(true, true).solve(&wanted, 1e-14).ok()?;
        let chi2 = (&basis * &fit - &wanted).norm_squared();
        let free = n as f64 - 2.0;
        let p_value = chi_squared_tail(chi2, free);
        let widening = Widening::of(chi2, free, p_value);
        let covariance = basis.tr_mul(&basis).try_inverse()? * widening.variance;
        let coefficients: Vec<f64> = (0..k).map(|j| fit[2 + j] / fit[1]).collect();
        let sound = fit.iter().chain(covariance.iter()).all(|v| v.is_finite()) && covariance[(1, 1)] > 0.0;
        let degrees_of_freedom = widening.degrees_of_freedom;
        sound.then_some(Slope { rate: fit[1], coefficients, covariance, degrees_of_freedom, p_value })
    }
}

/// ∫Aᵖ dt from the first of `moments` to each of them, A taken from `source`; zero where `source` has died away.
pub(super) fn powers(moments: &[WindowAmplitude], source: &[WindowAmplitude], power: i32) -> Vec<f64> {
    let amplitude =
        |t: f64| source.iter().find(|m| (m.t_s - t).abs() < 1e-9).map_or(0.0, WindowAmplitude::amplitude_rad);
    let mut sum = 0.0;
    let mut integral = vec![0.0];
    for pair in moments.windows(2) {
        let (a, b) = (amplitude(pair[0].t_s).powi(power), amplitude(pair[1].t_s).powi(power));
        // exponential between the two: the logarithmic mean
        let ratio = if a > 0.0 && b > 0.0 { (a / b).ln() } else { 0.0 };
        let mean = if ratio.abs() > 1e-3 { (a - b) / ratio } else { 0.5 * (a + b) };
        sum += mean * (pair[1].t_s - pair[0].t_s);
        integral.push(sum);
    }
    integral
}
