//! One mode: what to take for its frequency and damping, its shape, and what disagreement means.

use nalgebra::Complex;
use serde::Serialize;

use super::consistency::Consistency;
use super::damping::{Damping, Trend};
use super::driven::is_all_driven;
use super::envelope::{Bounds, Envelope, FrequencyLaw, PENDULUM, THEORY_TOLERANCE};
use super::estimate::{Estimate, probability};
use super::estimators::{Estimator, Estimators, LARGEST_HARMONIC, Whole, is_on_third_harmonic};
use super::floor::amplitude_dependence;
use super::modulated::Modulated;
use super::pendulum::SCALE;
use super::windows::Windows;
use crate::model::chain::Chain;
use crate::series::Measured;

/// A pendulum that swings more slowly is more than 100 m long.
const SLOWEST_SWING_HZ: f64 = 0.05;
/// A pendulum that swings faster is less than 1 mm long.
const FASTEST_SWING_HZ: f64 = 15.8;

/// A line this near three times the slowest frequency, in each window, goes with it (judgement: a mode's frequency depends on amplitude otherwise).
const LOCKED: f64 = 0.06;
/// The third harmonic of a swing is at most this many times that of a chain without resonance (judgement).
const RESONANCE: f64 = 2.0;

/// How a frequency goes with amplitude, of one oscillation over the record where that describes it, else through the windows.
fn frequency_law(modulated: Option<&Modulated>, envelope: Option<&Envelope>) -> Option<FrequencyLaw> {
    modulated.map(|own| own.frequency).or_else(|| envelope.and_then(|own| own.frequency))
}

/// Whether neither gravity nor a linear spring beside it, which leaves κ gravity's share of the stiffness, makes a frequency go with amplitude so.
fn is_beyond_springs(law: &FrequencyLaw, expected_kappa: f64) -> bool {
    let (kappa, tolerance) = (law.kappa_per_rad2, THEORY_TOLERANCE * expected_kappa.abs());
    kappa.low > expected_kappa + tolerance || kappa.high < -tolerance
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
    /// 1 for the strongest.
    pub number: usize,
    /// Root of the mean square over the record, all links together.
    pub rms_rad: f64,
    /// Undamped natural frequency to take.
    pub frequency_hz: Estimate,
    /// The amplitude at which the frequency is meant, where amplitude may change it and the data do not tell how. Of angles the
    /// interval holds that at small amplitude as well; of a displacement, whose angle nobody knows, it does not.
    pub frequency_at_amplitude_rad: Option<f64>,
    /// ξ to take.
    pub damping: Damping,
    /// How ξ goes with amplitude, where it is no constant.
    pub damping_trend: Option<Trend>,
    /// Where frequency and ξ come from.
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
    /// Frequency and damping against amplitude, from window to window.
    pub envelope: Option<Envelope>,
    /// The same over the whole record at once, where one oscillation describes it.
    pub modulated: Option<Modulated>,
    /// κ that a swing of this shape has without any missing physics.
    pub expected_kappa_per_rad2: Option<f64>,
    /// What the reader should know.
    pub notes: Vec<String>,
    /// The amplitude down to which a constant ξ was seen, where it is one of no single sinusoid.
    #[serde(skip)]
    pub seen_down_to_rad: Option<f64>,
    /// Whether it lies on the third harmonic of the slowest mode, and is no larger than that may be.
    #[serde(skip)]
    pub may_be_harmonic: bool,
    /// In what its sizes are told.
    #[serde(skip)]
    pub measured: Measured,
}

impl Mode {
    pub(super) fn of(whole: &Whole, mode: usize, chain: Option<&Chain>, gravity_m_s2: f64) -> Self {
        let envelope = envelope_of(whole, mode);
        let estimators = Estimators::of(whole, mode, &envelope);
        let envelope = envelope.ok();
        let shape = shape(whole, mode);
        let amplitudes_rad: Vec<f64> = (0..whole.fit.poles.len()).map(|m| whole.fit.amplitude_rad(m)).collect();
        let duration_s = whole.signal.duration_s();
        let changes =
            |e: &&Envelope| e.decay.is_some_and(|d| d.p_viscous < 0.01) || e.damping.is_some_and(|d| d.p_value < 0.01);
        let damping_trend = match whole.modulated {
            Some(own) => own.trend,
            None => envelope
                .as_ref()
                .filter(changes)
                .and_then(|e| Trend::of(e, of_linear_damper(e, Bounds::of(mode == 0, whole.measured), whole.measured))),
        };
        let choice = estimators
            .choose(whole, envelope.as_ref(), damping_trend, &amplitudes_rad, mode)
            .widened_for_harmonic(whole.fit, mode)
            .widened_for_resonance(whole, mode);
        let expected_kappa_per_rad2 = match whole.measured {
            Measured::Angles => expected_kappa(&shape, choice.frequency_hz.value, chain, gravity_m_s2),
            // nobody knows what angle it is of
            Measured::Displacement => None,
        };
        let last_rad = whole.fit.last_amplitude_rad(mode, duration_s);
        let law = frequency_law(whole.modulated, envelope.as_ref());
        let choice = match law.zip(expected_kappa_per_rad2) {
            Some((law, expected)) if is_beyond_springs(&law, expected) => {
                let last_step = envelope.as_ref().and_then(|own| own.steps.last());
                choice.widened_for_unknown_law(&law, last_step.map_or(last_rad, |step| step.amplitude_rad))
            }
            _ => choice,
        };
        let raw = estimators.raw;
        Self {
            number: mode + 1,
            rms_rad: whole.fit.strength(mode, duration_s).sqrt(),
            damping_trend,
            expected_kappa_per_rad2,
            measured: whole.measured,
            frequency_hz: choice.frequency_hz,
            frequency_at_amplitude_rad: choice.frequency_at_rad,
            damping: Damping::of(choice.damping_ratio, &raw[1], duration_s),
            basis: choice.basis,
            seen_down_to_rad: choice.at_small_amplitude.then_some(last_rad),
            may_be_harmonic: may_be_harmonic(whole, mode),
            shape,
            residual_excess: estimators.residual_excess,
            frequency_consistency: estimators.compare(raw[0], |e| e.frequency_hz),
            damping_consistency: estimators.compare(raw[1], |e| e.damping_ratio),
            estimators: estimators.each,
            envelope,
            modulated: whole.modulated.cloned(),
            notes: Vec::new(),
        }
    }

    /// With its place among the modes, the strongest first, and what the reader should know of it.
    pub(super) fn numbered(mut self, number: usize) -> Self {
        self.number = number;
        self.notes = self.findings(number);
        self
    }

    /// Whether its frequency is known to less than half of itself.
    pub(super) fn is_resolved(&self) -> bool {
        self.frequency_hz.within(0.5 * self.frequency_hz.value, 1.5 * self.frequency_hz.value)
    }

    /// Whether all links move to the same side at the same time, as in the slowest mode of a hanging chain and in no other: its flexibility matrix
    /// has no negative element (Perron and Frobenius).
    pub fn moves_together(&self) -> bool {
        self.shape.iter().all(|l| l.phase_to_first_rad.value.cos() > 0.0)
    }

    /// The frequency at small amplitude; where the one given belongs to a larger amplitude, with this κ.
    pub fn small_amplitude_hz(&self, kappa_per_rad2: f64) -> Estimate {
        if self.frequency_at_amplitude_rad.is_none() {
            return self.frequency_hz;
        }
        let amplitude_rad = self.amplitude_rad();
        let highest = self.frequency_hz.high / (1.0 - kappa_per_rad2 * amplitude_rad * amplitude_rad).max(0.5);
        self.frequency_hz.widened_to_cover(self.frequency_hz.low, highest)
    }

    /// What disagreement and dependence on amplitude mean, in words.
    fn findings(&self, number: usize) -> Vec<String> {
        let all = [self.doubt(), self.against_theory(), self.of_frequency(), self.of_damping()];
        all.into_iter().flatten().map(|finding| format!("mode {number}: {finding}")).collect()
    }

    /// How its frequency goes with amplitude, where the data tell it.
    pub(super) fn frequency_law(&self) -> Option<FrequencyLaw> {
        frequency_law(self.modulated.as_ref(), self.envelope.as_ref())
    }

    /// κ against that of gravity alone.
    fn against_theory(&self) -> Option<String> {
        let (law, expected) = (self.frequency_law()?, self.expected_kappa_per_rad2?);
        let k = law.kappa_per_rad2;
        let measured = format!("κ = {:.4} ± {:.4} /rad²", k.value, k.half());
        let tolerance = THEORY_TOLERANCE * expected.abs();
        let agrees = k.low - tolerance <= expected && expected <= k.high + tolerance;
        // by which factor on the angles it would be gravity's
        let times = |kappa: f64| (kappa / expected).max(0.0).sqrt();
        if self.constant_though_wide() || self.is_no_swing_of_its_own() {
            None
        } else if !agrees {
            // no scale of the angles makes a frequency rise with amplitude that gravity makes fall
            let scale = if k.low > 0.0 {
                format!(", or the true angles are about {:.2} × the stated ones", times(k.value))
            } else if k.high > 0.0 {
                format!(", or the true angles are less than {:.2} × the stated ones", times(k.high))
            } else {
                String::new()
            };
            // a spring beside gravity leaves κ gravity's share of the stiffness
            let cause = if k.low > 0.0 && k.high < expected {
                let part = 100.0 * (1.0 - k.value / expected);
                format!(
                    "a spring beside gravity, of {part:.0} % of the stiffness, does that, or a swing in a second plane"
                )
            } else {
                "a nonlinear stiffness is at work, or a swing in a second plane".to_owned()
            };
            Some(format!("f = f₀(1 − κA²) has {measured}, gravity alone makes {expected:.4}: {cause}{scale}"))
        } else if !k.holds(0.0) && k.half() < 0.5 * expected.abs() {
            // a little more or less is in the scale of any angle; of a chain further modes change κ, too
            let is_usual_scale = times(k.high) > 1.0 - SCALE && times(k.low) < 1.0 + SCALE;
            let how = if k.holds(expected) || is_usual_scale {
                format!("as gravity makes it ({measured}, expected {expected:.4})")
            } else if self.shape.len() > 1 {
                format!("about as gravity makes it ({measured}, expected {expected:.4} of this mode alone)")
            } else {
                format!(
                    "about as gravity makes it ({measured}, expected {expected:.4}; both agree if the true angles are {:.3} × the stated ones: are they measured from the hinge?)",
                    times(k.value)
                )
            };
            Some(format!("the frequency falls with amplitude {how}"))
        } else {
            None
        }
    }

    /// Largest amplitude of any link at the start.
    pub fn amplitude_rad(&self) -> f64 {
        self.shape.iter().map(|l| l.amplitude_rad).fold(0.0, f64::max)
    }

    /// Whether the frequency stays the same although the swing is so wide that gravity makes it fall.
    fn constant_though_wide(&self) -> bool {
        let Some((law, expected)) = self.frequency_law().zip(self.expected_kappa_per_rad2) else { return false };
        self.amplitude_rad() > 0.8 && expected > 0.03 && law.kappa_per_rad2.high < 0.3 * expected
    }

    /// Whether its decay follows no law of damping: what changes its amplitude then changes its frequency, too.
    fn is_no_swing_of_its_own(&self) -> bool {
        self.damping_trend == Some(Trend::Uneven)
    }

    /// A doubt of what the table's columns hold, where the motion would be strange for a hung body.
    pub fn doubt(&self) -> Option<String> {
        let f_hz = self.frequency_hz.value;
        let pendulum_m = 9.8 / (std::f64::consts::TAU * f_hz).powi(2);
        let amplitude_rad = self.amplitude_rad();
        if f_hz < SLOWEST_SWING_HZ {
            return Some(format!(
                "a pendulum of {f_hz:.2e} Hz would be {pendulum_m:.0} m long: is t_s in milliseconds, or a frame number?"
            ));
        }
        if self.measured == Measured::Angles && f_hz > FASTEST_SWING_HZ && amplitude_rad > 0.1 {
            return Some(format!(
                "a pendulum of {f_hz:.0} Hz would be {:.2} mm long: is t_s in minutes?",
                1e3 * pendulum_m
            ));
        }
        if self.constant_though_wide() {
            return Some(format!(
                "the frequency does not fall with amplitude, as a pendulum's does, although θ reaches {amplitude_rad:.1} rad: are the angles in degrees, or does a spring bring it back?"
            ));
        }
        let lower = self.shape.get(1).filter(|_| self.moves_together())?;
        (lower.ratio_to_first.high < 0.95).then(|| {
            format!(
                "where all links move together the lower one should swing farther than the upper one, but θ2 = {:.2} θ1: are the columns exchanged, or is θ2 measured from link 1?",
                lower.ratio_to_first.value
            )
        })
    }

    fn of_frequency(&self) -> Option<String> {
        // what one oscillation describes needs no other reason
        let test = self.frequency_consistency.filter(|t| !t.agree && self.modulated.is_none())?;
        let lawful = !self.is_no_swing_of_its_own();
        let meaning = if lawful && self.frequency_law().is_some_and(|l| l.p_constant < 0.01) {
            "the frequency depends on amplitude, which each estimator weighs differently; take f₀"
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
        let meaning = match self.damping_trend {
            Some(Trend::Uneven) => "the damping ratio changes in a way that neither dry friction nor drag explains: look for a swing in a second plane, a neighbouring part that vibrates with it, a draught or a hand".to_owned(),
            Some(trend) => format!("the damping depends on amplitude: friction or drag, not one ξ ({})", trend.words()),
            // what one oscillation describes needs no other reason
            None if self.modulated.is_some() => return None,
            None => "the decay is no exponential; look at the envelope before using one ξ".to_owned(),
        };
        let disagree = self.damping_consistency.filter(|t| !t.agree);
        let said = disagree.map(|test| {
            format!(
                "the damping ratios disagree (χ² = {:.0} of {}, {}): {meaning}",
                test.chi2,
                test.estimators - 1,
                probability(test.p_value)
            )
        });
        said.or_else(|| self.damping_trend.map(|_| meaning))
    }
}

/// What amplitude may do to the ξ of a linear damper, relative to it.
fn of_linear_damper(envelope: &Envelope, bounds: Bounds, measured: Measured) -> f64 {
    let amplitude_rad2 = envelope.steps.iter().map(|step| step.amplitude_rad.powi(2)).fold(0.0, f64::max);
    let amplitude_rad2 = match measured {
        Measured::Angles => amplitude_rad2,
        // of a pendulum, whose κ tells it
        Measured::Displacement => {
            envelope.frequency.map_or(0.0, |law| law.kappa_per_rad2.value.abs() * amplitude_rad2 / PENDULUM)
        }
    };
    bounds.lambda[1] * amplitude_rad2 + bounds.fourth[1] * amplitude_rad2.powi(2)
}

/// The mode's history in the windows of all modes; where those cannot show it, in windows of its own cycles.
fn envelope_of(whole: &Whole, mode: usize) -> Result<Envelope, String> {
    let bounds = Bounds::of(mode == 0, whole.measured);
    let of = |windows: &Windows, own: usize| {
        Envelope::of(windows, own, &whole.clear_moments(mode, &windows.moments[own], windows.window_s), bounds)
    };
    let shared = whole.windows.as_ref().map_err(Clone::clone).and_then(|windows| of(windows, mode));
    if shared.is_ok() || whole.fit.poles.len() == 1 {
        return shared;
    }
    let own = Windows::of_mode(whole.signal, whole.fit, mode)?;
    let others = (0..whole.fit.poles.len()).filter(|m| *m != mode).map(|m| whole.fit.amplitude_rad(m));
    let known = [whole.fit.frequency_hz(mode), whole.fit.damping_ratio(mode)];
    Ok(of(&own, 0)?.widened_for_other_modes(others, known))
}

/// Whether a mode is on the third harmonic of the slowest one, over the record and in each window, and goes with it or is in the end no larger than that harmonic may be;
/// where there are no windows, over the record.
fn may_be_harmonic(whole: &Whole, mode: usize) -> bool {
    // a window may follow the harmonic where the record shows another line
    if !is_on_third_harmonic(whole.fit, mode) {
        return false;
    }
    let is_small = |own_rad: f64, slowest_rad: f64| own_rad < RESONANCE * LARGEST_HARMONIC * slowest_rad.powi(3);
    let Ok(windows) = whole.windows else {
        return is_small(whole.fit.amplitude_rad(mode), whole.fit.amplitude_rad(0));
    };
    let (own, slowest) = (&windows.moments[mode], &windows.moments[0]);
    let last = own.last().and_then(|last| Some((last, slowest.iter().find(|moment| moment.t_s == last.t_s)?)));
    let Some((last, beside)) = last else { return false };
    let is_locked = own.iter().all(|moment| {
        let beside = slowest.iter().find(|beside| beside.t_s == moment.t_s);
        beside.is_some_and(|beside| (moment.omega_rad_s / beside.omega_rad_s / 3.0 - 1.0).abs() < LOCKED)
    });
    is_locked && (is_small(last.amplitude_rad(), beside.amplitude_rad()) || is_all_driven(own, slowest))
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
        // the sinusoids of a wide swing, which decays otherwise, begin higher than it does
        let farthest_rad = 0.5 * whole.signal.links[link].range_rad();
        LinkMotion {
            amplitude_rad: own.amplitudes_rad[mode].norm().min(farthest_rad),
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
        return (shape.len() == 1).then_some(PENDULUM);
    };
    let complex = |l: &LinkMotion| Complex::from_polar(l.ratio_to_first.value, l.phase_to_first_rad.value);
    let shape: Vec<Complex<f64>> = shape.iter().map(complex).collect();
    Some(amplitude_dependence(chain, gravity_m_s2, frequency_hz, &shape))
}
