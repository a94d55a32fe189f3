//! One mode: what to take for its frequency and damping, its shape, and what disagreement means.

use nalgebra::Complex;
use serde::Serialize;

use super::consistency::Consistency;
use super::envelope::{Envelope, FrequencyLaw};
use super::estimate::{Estimate, probability};
use super::estimators::{Estimator, Estimators, Whole};
use super::floor::amplitude_dependence;
use crate::model::chain::Chain;

/// By how much the theory of κ may be off: it is the first term in A², for a shape that does not change with amplitude.
const THEORY_TOLERANCE: f64 = 0.15;

/// ξ, or why the data do not tell it.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Damping {
    /// Its interval stays clear of zero.
    Identified(Estimate),
    /// Its interval reaches zero.
    NotIdentifiable {
        /// 95 % interval.
        estimate: Estimate,
        /// With the number that makes it so.
        reason: String,
    },
}

impl Damping {
    fn of(estimate: Estimate, duration_s: f64) -> Self {
        if estimate.low > 0.0 {
            return Self::Identified(estimate);
        }
        let reason = format!(
            "the decay over {duration_s:.0} s is within the noise: ξ ≤ {:.2e} is all that can be said",
            estimate.high.max(0.0)
        );
        Self::NotIdentifiable { estimate, reason }
    }

    /// The identified value.
    pub fn estimate(&self) -> Option<&Estimate> {
        match self {
            Self::Identified(estimate) => Some(estimate),
            Self::NotIdentifiable { .. } => None,
        }
    }

    /// The interval, identified or not.
    pub fn interval(&self) -> &Estimate {
        match self {
            Self::Identified(estimate) | Self::NotIdentifiable { estimate, .. } => estimate,
        }
    }
}

/// One link's part in a mode.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct LinkMotion {
    /// Amplitude at the start of the record.
    pub amplitude_rad: f64,
    /// |θᵢ/θ₁|.
    pub ratio_to_first: Estimate,
    /// arg θᵢ/θ₁: 0 together, π against each other, anything between tells of uneven damping or of a lag.
    pub phase_to_first_rad: Estimate,
}

/// One mode.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Mode {
    /// Undamped natural frequency to take.
    pub frequency_hz: Estimate,
    /// ξ to take.
    pub damping: Damping,
    /// Where the two come from.
    pub basis: String,
    /// Top to bottom.
    pub shape: Vec<LinkMotion>,
    /// By how much the residual near this frequency exceeds white noise, in power; 1 when it does not.
    pub residual_excess: f64,
    /// Every method.
    pub estimators: Vec<Estimator>,
    /// Whether the frequencies agree.
    pub frequency_consistency: Option<Consistency>,
    /// Whether the dampings agree.
    pub damping_consistency: Option<Consistency>,
    /// Frequency and damping against amplitude.
    pub envelope: Option<Envelope>,
    /// κ that a swing of this shape has without any missing physics.
    pub expected_kappa_per_rad2: Option<f64>,
    /// What the reader should know.
    pub notes: Vec<String>,
}

impl Mode {
    pub(super) fn of(whole: &Whole, mode: usize, chain: Option<&Chain>, gravity_m_s2: f64) -> Self {
        let envelope = whole.windows.as_ref().map_err(Clone::clone).and_then(|w| Envelope::of(w, mode));
        let estimators = Estimators::of(whole, mode, &envelope);
        let envelope = envelope.ok();
        let shape = shape(whole, mode);
        let amplitudes_rad: Vec<f64> = (0..whole.fit.poles.len()).map(|m| whole.fit.amplitude_rad(m)).collect();
        let choice = estimators.choose(envelope.as_ref(), &amplitudes_rad, mode).beside_harmonic(whole.fit, mode);
        let mut this = Self {
            expected_kappa_per_rad2: expected_kappa(&shape, whole.fit.poles[mode].frequency_hz(), chain, gravity_m_s2),
            frequency_hz: choice.frequency_hz,
            damping: Damping::of(choice.damping_ratio, whole.signal.duration_s()),
            basis: choice.basis,
            shape,
            residual_excess: estimators.residual_excess,
            frequency_consistency: estimators.compare(estimators.raw[0], |e| e.frequency_hz),
            damping_consistency: estimators.compare(estimators.raw[1], |e| e.damping_ratio),
            estimators: estimators.each,
            envelope,
            notes: Vec::new(),
        };
        this.notes = this.findings(mode);
        this
    }

    /// The frequency at small amplitude; where the data do not tell how it depends on amplitude, with this κ.
    pub fn small_amplitude_hz(&self, kappa_per_rad2: f64) -> Estimate {
        match self.envelope.as_ref().and_then(|e| e.frequency) {
            Some(law) => law.f0_hz,
            None => {
                let amplitude_rad = self.shape.iter().map(|l| l.amplitude_rad).fold(0.0, f64::max);
                let highest = self.frequency_hz.high / (1.0 - kappa_per_rad2 * amplitude_rad * amplitude_rad).max(0.5);
                self.frequency_hz.covering(self.frequency_hz.low, highest)
            }
        }
    }

    /// What disagreement and dependence on amplitude mean, in words.
    fn findings(&self, mode: usize) -> Vec<String> {
        let all = [self.against_theory(), self.of_frequency(), self.of_damping()];
        all.into_iter().flatten().map(|finding| format!("mode {}: {finding}", mode + 1)).collect()
    }

    fn frequency_law(&self) -> Option<FrequencyLaw> {
        self.envelope.as_ref().and_then(|e| e.frequency)
    }

    /// κ against that of gravity alone.
    fn against_theory(&self) -> Option<String> {
        let (law, expected) = (self.frequency_law()?, self.expected_kappa_per_rad2?);
        let k = law.kappa_per_rad2;
        let measured = format!("κ = {:.4} ± {:.4} /rad²", k.value, 0.5 * (k.high - k.low));
        let amplitude_rad = self.shape.iter().map(|l| l.amplitude_rad).fold(0.0, f64::max);
        let tolerance = THEORY_TOLERANCE * expected.abs();
        let agrees = k.low - tolerance <= expected && expected <= k.high + tolerance;
        if amplitude_rad > 0.8 && expected > 0.03 && k.high < 0.3 * expected {
            Some(format!(
                "the frequency does not fall with amplitude ({measured}, a pendulum has {expected:.4}) although θ reaches {amplitude_rad:.1} rad: are the angles in degrees?"
            ))
        } else if !agrees {
            Some(format!(
                "f = f₀(1 − κA²) has {measured}, gravity alone makes {expected:.4}: a nonlinear stiffness is at work, or the true angles are {:.2} × the stated ones",
                (k.value / expected).max(0.0).sqrt()
            ))
        } else if !k.holds(0.0) {
            Some(format!("the frequency falls with amplitude as gravity makes it ({measured}, expected {expected:.4})"))
        } else {
            None
        }
    }

    fn of_frequency(&self) -> Option<String> {
        let test = self.frequency_consistency.filter(|t| !t.agree)?;
        let meaning = if self.frequency_law().is_some_and(|l| l.p_constant < 0.01) {
            "the frequency depends on amplitude, which each estimator weighs differently; take f₀ of the envelope"
        } else {
            "amplitude does not explain it; look for dropped frames, a neighbouring mode or forcing"
        };
        Some(format!(
            "the frequencies disagree (χ² = {:.0} of {}, {}): {meaning}",
            test.chi2,
            test.estimators - 1,
            probability(test.p_value)
        ))
    }

    fn of_damping(&self) -> Option<String> {
        if let Damping::NotIdentifiable { reason, .. } = &self.damping {
            return Some(format!("damping not identifiable: {reason}"));
        }
        let p_viscous = self.envelope.as_ref().and_then(|e| e.decay).map_or(1.0, |d| d.p_viscous);
        match self.damping_consistency.filter(|t| !t.agree) {
            Some(test) => {
                let meaning = if p_viscous < 0.01 {
                    "the damping depends on amplitude: friction or drag, not one ξ"
                } else {
                    "the decay is no exponential; look at the envelope before using one ξ"
                };
                Some(format!(
                    "the damping ratios disagree (χ² = {:.0} of {}, {}): {meaning}",
                    test.chi2,
                    test.estimators - 1,
                    probability(test.p_value)
                ))
            }
            None if p_viscous < 0.01 => Some(format!(
                "the damping depends on amplitude ({}): friction or drag, not one ξ",
                probability(p_viscous)
            )),
            None => None,
        }
    }
}

fn shape(whole: &Whole, mode: usize) -> Vec<LinkMotion> {
    let fit = whole.fit;
    let first = fit.links[0].amplitudes_rad[mode];
    let each = |link: usize| {
        let own = &fit.links[link];
        let (ratio, sd) = match whole.windows {
            Ok(w) => (w.shapes[mode][link], w.shape_sd[mode][link]),
            Err(_) => {
                let ratio = own.amplitudes_rad[mode] / first;
                (
                    ratio,
                    (own.amplitude_sd_rad[mode].hypot(ratio.norm() * fit.links[0].amplitude_sd_rad[mode]))
                        / first.norm(),
                )
            }
        };
        LinkMotion {
            amplitude_rad: own.amplitudes_rad[mode].norm(),
            ratio_to_first: Estimate::new(ratio.norm(), sd, fit.degrees_of_freedom),
            phase_to_first_rad: Estimate::new(
                ratio.arg(),
                sd / ratio.norm().max(f64::MIN_POSITIVE),
                fit.degrees_of_freedom,
            ),
        }
    };
    (0..fit.links.len()).map(each).collect()
}

/// κ that gravity alone makes; without a chain only one link's is known.
fn expected_kappa(shape: &[LinkMotion], frequency_hz: f64, chain: Option<&Chain>, gravity_m_s2: f64) -> Option<f64> {
    let Some(chain) = chain else {
        return (shape.len() == 1).then_some(1.0 / 16.0);
    };
    let complex = |l: &LinkMotion| Complex::from_polar(l.ratio_to_first.value, l.phase_to_first_rad.value);
    let shape: Vec<Complex<f64>> = shape.iter().map(complex).collect();
    Some(amplitude_dependence(chain, gravity_m_s2, frequency_hz, &shape))
}
