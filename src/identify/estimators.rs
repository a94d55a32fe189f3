//! Every estimator of one mode side by side, and which one to take.

use serde::Serialize;

use super::consistency::Consistency;
use super::damping::Trend;
use super::decrement::Decrement;
use super::driven::without_driven;
use super::envelope::{Bounds, Envelope, FrequencyLaw};
use super::estimate::Estimate;
use super::excess::Excess;
use super::half_power::HalfPower;
use super::modulated::Modulated;
use super::signal::Signal;
use super::sinusoids::SinusoidFit;
use super::spectrum::Spectrum;
use super::windows::{WindowAmplitude, Windows, over_stretches, while_clear};
use crate::series::Measured;

/// A way to a frequency or a damping ratio.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// Peak of the amplitude spectrum.
    Spectrum,
    /// Bandwidth at half power.
    HalfPower,
    /// Logarithmic decrement over all peaks.
    Decrement,
    /// Damped sinusoids over the whole record.
    Sinusoids,
    /// Amplitudes and phases of windows; frequency and damping at small amplitude.
    Envelope,
    /// One oscillation whose frequency and damping go with its amplitude, where that describes the record.
    Modulated,
}

/// What one method says.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Estimator {
    /// Which.
    pub method: Method,
    /// Undamped natural frequency.
    pub frequency_hz: Option<Estimate>,
    /// ξ.
    pub damping_ratio: Option<Estimate>,
    /// Why a number is absent, or what to know about it.
    pub note: Option<String>,
}

impl Estimator {
    /// Without the numbers that say nothing: a frequency whose interval leaves what can be seen, from zero to the Nyquist frequency, a ξ whose interval
    /// leaves −1 to 1.
    fn resolved(mut self, nyquist_hz: f64) -> Self {
        let frequency_hz = self.frequency_hz.filter(|f| f.within(0.0, 1.05 * nyquist_hz));
        let damping_ratio = self.damping_ratio.filter(|xi| xi.within(-1.0, 1.0));
        if (frequency_hz.is_none() && self.frequency_hz.is_some())
            || (damping_ratio.is_none() && self.damping_ratio.is_some())
        {
            let is_f = frequency_hz.is_none() && self.frequency_hz.is_some();
            let what = if is_f { "f" } else { "ξ" };
            self.note = Some(format!("not identifiable: its interval for {what} is wider than {what} can be"));
        }
        Self { frequency_hz, damping_ratio, ..self }
    }
}

/// What all modes share.
pub(super) struct Whole<'a> {
    pub signal: &'a Signal,
    pub spectrum: &'a Spectrum,
    pub fit: &'a SinusoidFit,
    pub windows: &'a Result<Windows, String>,
    /// Where one oscillation describes the record.
    pub modulated: Option<&'a Modulated>,
    pub noise_rad: &'a [f64],
    pub measured: Measured,
    /// Amplitude of what swings three times as fast as the slowest mode.
    pub third_rad: f64,
}

impl Whole<'_> {
    /// A mode's moments in windows of this length, up to where it is no longer clear of the noise, nor of the slowest mode's third harmonic: what that is seen to drive
    /// is taken away, else what it may be counts as noise.
    pub fn clear_moments(&self, mode: usize, seen: &[WindowAmplitude], window_s: f64) -> Vec<WindowAmplitude> {
        let pole = self.fit.poles[mode];
        let apart_rad_s = (pole.omega_rad_s - 3.0 * self.fit.poles[0].omega_rad_s).abs();
        // farther apart, a window tells the two from one another
        let slowest = self.windows.as_ref().ok().filter(|_| mode > 0 && apart_rad_s * window_s < std::f64::consts::TAU);
        let bounds = Bounds::of(mode == 0, self.measured);
        match slowest.and_then(|windows| without_driven(seen, &windows.moments[0], pole, bounds)) {
            Some(free) => while_clear(free.into_iter()),
            None => while_clear(seen.iter().map(|own| own.beside(self.harmonic_rad(mode, own, window_s)))),
        }
    }

    /// What the third harmonic of the slowest mode may be taken for of a faster one in a window of this length (rad): A³/20, see [`harmonic_share`], and of that as much
    /// as shows at the frequency found there, or at the mode's, whichever is nearer,
    ///
    /// ```text
    /// A³/20 / √(1 + (Δω T/2)²)      Δω = ω − 3ω₁,  T: the window's length
    /// ```
    fn harmonic_rad(&self, mode: usize, window: &WindowAmplitude, window_s: f64) -> f64 {
        if mode == 0 || self.measured == Measured::Displacement {
            return 0.0;
        }
        let apart = |omega_rad_s: f64| 0.5 * (omega_rad_s - 3.0 * self.fit.poles[0].omega_rad_s).abs() * window_s;
        let nearest = apart(self.fit.poles[mode].omega_rad_s).min(apart(window.omega_rad_s));
        let amplitude_rad = self.fit.last_amplitude_rad(0, window.t_s - self.fit.origin_s);
        amplitude_rad.powi(3) * LARGEST_HARMONIC / 1f64.hypot(nearest)
    }
}

/// What every method says about one mode.
pub(super) struct Estimators {
    pub each: Vec<Estimator>,
    /// Frequency and damping of the damped sinusoids, as noise alone has them.
    pub raw: [Estimate; 2],
    /// By how much the residual near the mode exceeds white noise, in power.
    pub residual_excess: f64,
}

/// What to take.
pub(super) struct Choice {
    pub frequency_hz: Estimate,
    pub damping_ratio: Estimate,
    /// The amplitude at which the frequency is meant, where amplitude may change it and the data do not tell how.
    pub frequency_at_rad: Option<f64>,
    pub basis: String,
    /// Whether a constant ξ is meant at small amplitude.
    pub at_small_amplitude: bool,
}

impl Estimators {
    pub fn of(whole: &Whole, mode: usize, envelope: &Result<Envelope, String>) -> Self {
        let fit = whole.fit;
        let residual = fit.residuals(whole.signal);
        let excess: Vec<f64> = fit.poles.iter().map(|p| Excess::of(&residual, p.omega_rad_s).power).collect();
        // where the whole record is no sum of damped sinusoids, the other modes are taken away window by window
        let alone = match whole.windows {
            Ok(windows) if excess.iter().any(|e| *e > 1.0) => windows.isolate(whole.signal, fit, mode),
            _ => fit.isolate(whole.signal, mode),
        };
        let filled = alone.bridged();
        let raw = [fit.frequency_hz(mode), fit.damping_ratio(mode)];
        let each = [
            spectral(whole, &filled, mode, raw[1].value),
            half_power(whole, &filled, mode),
            decrement(whole, &alone, mode),
            sinusoids(raw, excess[mode], envelope.as_ref().ok()),
            windowed(envelope, whole.measured),
        ];
        let nyquist_hz = 0.5 / whole.signal.step_s;
        let each = each.into_iter().chain(whole.modulated.map(modulated));
        let each = each.map(|e| e.resolved(nyquist_hz)).collect();
        Self { each, raw, residual_excess: excess[mode] }
    }

    /// Whether the methods agree, the damped sinusoids entering with this value.
    pub fn compare(&self, own: Estimate, quantity: fn(&Estimator) -> Option<Estimate>) -> Option<Consistency> {
        let others = self.each.iter().filter(|e| e.method != Method::Sinusoids).filter_map(quantity);
        Consistency::of(&others.chain([own]).collect::<Vec<_>>())
    }

    /// A frequency and a damping ratio with intervals that hold those of the record's stretches, where no law of one oscillation describes a record too short for
    /// windows: two modes too close to be told apart, frames that are missing though the stamps go on, a push, a finger that brakes it. The damping ratio only where
    /// more than noise is left.
    fn over_stretches(&self, whole: &Whole, [f_hz, xi]: [Estimate; 2]) -> [Estimate; 2] {
        if whole.modulated.is_some() || whole.windows.is_ok() {
            return [f_hz, xi];
        }
        let Some([f_ends, xi_ends]) = over_stretches(whole.signal, whole.fit) else { return [f_hz, xi] };
        let widened_to_cover = |own: Estimate, [low, high]: [f64; 2]| own.widened_to_cover(low, high);
        let uneven = self.residual_excess > 1.0;
        [widened_to_cover(f_hz, f_ends), if uneven { widened_to_cover(xi, xi_ends) } else { xi }]
    }

    /// The laws at small amplitude; the damped sinusoids where the amplitude does not matter or its effect cannot be followed.
    ///
    /// Where no law of one oscillation describes how the swing decays, none takes its frequency to small amplitude either: the interval then holds the frequencies
    /// of the windows.
    pub fn choose(
        &self,
        whole: &Whole,
        envelope: Option<&Envelope>,
        trend: Option<Trend>,
        amplitudes_rad: &[f64],
        mode: usize,
    ) -> Choice {
        let (duration_s, known) = (whole.signal.duration_s(), whole.measured == Measured::Angles);
        let mut lawful_rad = amplitudes_rad.to_vec();
        // of a mode alone, what the laws leave out acts with the windows' amplitudes; another mode's share in it is not followed
        if let (Some(envelope), [only]) = (envelope, &mut lawful_rad[..]) {
            *only = only.min(envelope.rms_amplitude_rad);
        }
        let sinusoids = self.each.iter().find(|e| e.method == Method::Sinusoids);
        let frequency_hz = sinusoids.and_then(|e| e.frequency_hz).unwrap_or(self.raw[0]);
        let damping_ratio = sinusoids.and_then(|e| e.damping_ratio).unwrap_or(self.raw[1]);
        // what amplitude may have changed, by the bounds on κ and λ
        let decays = std::f64::consts::TAU * frequency_hz.value * damping_ratio.value * duration_s;
        let [changed, changed_xi] = unfollowed(amplitudes_rad, decays, mode);
        let (changed_hz, changed_xi) = (changed * frequency_hz.value, changed_xi * damping_ratio.value);
        let squares: f64 = lawful_rad.iter().map(|a| a * a).sum();
        let omitted = Bounds::of(mode == 0, whole.measured).fourth.map(|bound| bound * squares * squares);
        // of the slowest mode of hung angles it is known how amplitude acts
        let changed_too = [frequency_hz.blurred(changed_hz), damping_ratio.blurred(changed_xi)];
        let over_the_record = self.over_stretches(whole, changed_too);
        let is_told =
            |law: &FrequencyLaw, other: Estimate| (known && mode == 0) || law.f0_hz.half() < WIDEST_LAW * other.half();
        if let Some(own) = whole.modulated.filter(|own| is_told(&own.frequency, over_the_record[0])) {
            return Choice::of_modulated(own);
        }
        // what angle a displacement is of nobody knows, nor therefore what amplitude has changed
        let felt = !known || changed_hz > 0.3 * frequency_hz.sd;
        // a law that reaches far beyond the steps it was laid through tells nothing at its end; of a faster mode, beyond what amplitudes do
        let farthest = if mode == 0 { FARTHEST_LAW } else { FARTHEST_LAW.min(3.0 * changed) };
        let sound = |e: &Envelope, law: &FrequencyLaw| {
            e.steps.iter().any(|s| (law.f0_hz.value / s.frequency_hz.value - 1.0).abs() < farthest)
                && law.f0_hz.half() < farthest * law.f0_hz.value
                && is_told(law, frequency_hz)
        };
        let law = envelope.and_then(|e| e.frequency.filter(|f| sound(e, f)).map(|f| (e, f)));
        // where the windows tell no law, ξ is the range of their own
        let of_windows = |envelope: &Envelope| {
            let linear = envelope.linear_damping().map(|xi| relatively_blurred(xi, omitted[1]));
            linear.unwrap_or_else(|| envelope.damping_over_the_record())
        };
        let is_needed = felt || self.residual_excess > 1.0;
        match law.filter(|_| is_needed) {
            Some((envelope, law)) => {
                let f0_hz = relatively_blurred(law.f0_hz, omitted[0].hypot(of_losses(envelope, duration_s)));
                let f0_hz = if trend == Some(Trend::Uneven) { envelope.over_steps(f0_hz) } else { f0_hz };
                Choice::of_windows(f0_hz, of_windows(envelope))
            }
            None if is_needed => {
                // of second order in ξ, where the decay is not a linear damper's
                let of_losses = if self.residual_excess > 1.0 { damping_ratio.value.powi(2) } else { 0.0 };
                let [f_hz, xi] = over_the_record;
                // of a faster mode that lives shorter than the slowest one's harmonic, the whole record may show that
                let f_hz = envelope.filter(|_| mode > 0).map_or(f_hz, |own| own.over_steps(f_hz));
                let over_the_record = [relatively_blurred(f_hz, of_losses), xi];
                let at_rad = felt.then(|| amplitudes_rad[mode] * weighed(decays).sqrt());
                let in_windows = envelope.map(|e| (of_windows(e), e.linear_damping().is_some()));
                Choice::of_widened_sinusoids(over_the_record, at_rad, in_windows)
            }
            None => Choice::of_sinusoids(self.over_stretches(whole, [frequency_hz, damping_ratio])[0], damping_ratio),
        }
    }
}

/// How much less exactly than that at the record's own amplitudes the frequency at small amplitude may be known, to be told in its place.
const WIDEST_LAW: f64 = 5.0;

/// Below the last amplitude seen the frequency may change so many times as much as the square of the amplitude makes it (judgement: its next power may do as much).
const UNKNOWN_LAW: f64 = 2.0;

/// How far from the frequency of its nearest step, and how wide, relative to it, f₀ may be: a pendulum released at 145° has 0.5 f₀.
const FARTHEST_LAW: f64 = 0.5;

/// Nearness to three times the slowest frequency at which a mode and the harmonic of a large swing mix.
const HARMONIC_BAND: f64 = 0.06;

/// The third harmonic of a swing of amplitude A, over A³ (1/rad²), without resonance.
pub(super) const LARGEST_HARMONIC: f64 = 1.0 / 20.0;

/// Whether a mode lies at three times the slowest frequency.
pub(super) fn is_on_third_harmonic(fit: &SinusoidFit, mode: usize) -> bool {
    let times = fit.poles[mode].omega_rad_s / fit.poles[0].omega_rad_s;
    mode > 0 && (times / 3.0 - 1.0).abs() <= HARMONIC_BAND
}

/// How much a mode at three times the slowest frequency may be that one's third harmonic, 0 to 1.
///
/// sin θ and the turning of the links give a swing of amplitude A a harmonic of up to about A³/20 in a chain, more where the mode resonates with it;
/// within windows of a few cycles it cannot be told from the mode, whose frequency and damping are then neither's.
pub(super) fn harmonic_share(fit: &SinusoidFit, mode: usize) -> f64 {
    if !is_on_third_harmonic(fit, mode) {
        return 0.0;
    }
    (fit.amplitude_rad(0).powi(3) * LARGEST_HARMONIC / fit.amplitude_rad(mode).max(f64::MIN_POSITIVE)).min(1.0)
}

impl Choice {
    /// From the laws of one oscillation over the whole record.
    fn of_modulated(own: &Modulated) -> Self {
        Self {
            frequency_hz: own.frequency.f0_hz,
            damping_ratio: own.damping_ratio,
            frequency_at_rad: None,
            basis: "one oscillation whose frequency and damping go with its amplitude: f at small amplitude, ξ over the record"
                .to_owned(),
            at_small_amplitude: true,
        }
    }

    /// From the laws through the windows.
    fn of_windows(frequency_hz: Estimate, damping_ratio: Estimate) -> Self {
        Self {
            frequency_hz,
            damping_ratio,
            frequency_at_rad: None,
            basis: "windows: f and ξ at small amplitude".to_owned(),
            at_small_amplitude: true,
        }
    }

    /// From damped sinusoids whose intervals allow for what amplitude may have changed, at the amplitude that is given; ξ from the windows where there are any, with
    /// whether that is at small amplitude: a frequency that changes makes the swing smaller than a sinusoid of one frequency, which takes that for damping.
    fn of_widened_sinusoids(
        [frequency_hz, damping_ratio]: [Estimate; 2],
        frequency_at_rad: Option<f64>,
        in_windows: Option<(Estimate, bool)>,
    ) -> Self {
        let widened = "damped sinusoids over the whole record; widened for what amplitude may have changed";
        Self {
            frequency_hz,
            damping_ratio: in_windows.map_or(damping_ratio, |own| own.0),
            frequency_at_rad,
            basis: if in_windows.is_some() { format!("f: {widened}; ξ: windows") } else { widened.to_owned() },
            at_small_amplitude: in_windows.is_some_and(|own| own.1),
        }
    }

    /// From damped sinusoids as they are.
    fn of_sinusoids(frequency_hz: Estimate, damping_ratio: Estimate) -> Self {
        Self {
            frequency_hz,
            damping_ratio,
            frequency_at_rad: None,
            basis: "damped sinusoids over the whole record".to_owned(),
            at_small_amplitude: false,
        }
    }

    /// The slowest mode's, with intervals that allow for one that swings three times as fast, which gives energy to it and takes it back: its torque on the slowest goes with
    /// A₀²A₁, and what it holds is A₁²(3ω)² of A₀²ω². Of both only the order is known.
    pub fn widened_for_resonance(self, whole: &Whole, mode: usize) -> Self {
        let (slowest_rad, third_rad) = (whole.fit.amplitude_rad(0), whole.third_rad);
        // of one link alone the harmonic is gravity's
        if mode > 0 || third_rad == 0.0 || whole.signal.links.len() < 2 || whole.measured == Measured::Displacement {
            return self;
        }
        let turned_rad = whole.fit.poles[0].omega_rad_s * whole.signal.duration_s();
        // no more is taken than it has
        let exchanged = (3.0 * third_rad / slowest_rad).powi(2).min(1.0) / (2.0 * turned_rad);
        Self {
            frequency_hz: relatively_blurred(self.frequency_hz, Bounds::OTHER.kappa[1] * slowest_rad * third_rad),
            damping_ratio: self.damping_ratio.blurred(exchanged),
            basis: format!("{}; widened: what swings three times as fast exchanges energy with it", self.basis),
            ..self
        }
    }

    /// At small amplitude, where a stiffness whose law nobody knows changes the frequency: κ of the amplitudes seen tells little of that below the last of them.
    pub fn widened_for_unknown_law(self, law: &FrequencyLaw, last_rad: f64) -> Self {
        if !self.at_small_amplitude {
            return self;
        }
        let change = UNKNOWN_LAW * law.kappa_per_rad2.value.abs() * last_rad * last_rad * law.f0_hz.value;
        let [low, high] = [-change, change].map(|change| self.frequency_hz.value + change);
        Self {
            frequency_hz: self.frequency_hz.widened_to_cover(low.max(0.0), high),
            basis: format!("{}; widened: a nonlinear stiffness is at work, and no smaller swing was seen", self.basis),
            ..self
        }
    }

    /// With intervals that allow for the third harmonic of the slowest mode.
    pub fn widened_for_harmonic(self, fit: &SinusoidFit, mode: usize) -> Self {
        let share = harmonic_share(fit, mode);
        if share < 0.01 {
            return self;
        }
        let damping_ratio = self.damping_ratio;
        Self {
            frequency_hz: relatively_blurred(self.frequency_hz, HARMONIC_BAND * share.sqrt()),
            damping_ratio: damping_ratio.blurred(2.0 * share.sqrt() * damping_ratio.value.abs()),
            basis: format!(
                "{}; widened: it lies on the third harmonic of the slowest mode, which only a forward model separates",
                self.basis
            ),
            ..self
        }
    }
}

/// What losses that go with amplitude do to the frequency of windows, relative to it: to second order in ξ as a linear damper's, and the lag of dry
/// friction, 3δ/πA with δ/A = πξ/2, over the record.
fn of_losses(envelope: &Envelope, duration_s: f64) -> f64 {
    let Estimate { low, high, .. } = envelope.damping_over_the_record();
    let turned_rad = std::f64::consts::TAU * envelope.steps.first().map_or(1.0, |s| s.frequency_hz.value) * duration_s;
    (0.25 * (high * high - low * low)).hypot(1.5 * (high - low) / turned_rad)
}

fn relatively_blurred(estimate: Estimate, relative: f64) -> Estimate {
    estimate.blurred(relative * estimate.value)
}

/// Relative standard deviation of frequency and damping of a mode whose dependence on the amplitudes cannot be followed. `decays`: e-foldings of its amplitude over
/// the record.
fn unfollowed(amplitudes_rad: &[f64], decays: f64, mode: usize) -> [f64; 2] {
    let rms = |[mean, sd]: [f64; 2]| mean.hypot(sd);
    let (mut f2, mut xi2) = (0.0, 0.0);
    for (other, amplitude_rad) in amplitudes_rad.iter().enumerate() {
        // all of another mode's that outlives it
        let (bounds, share) = if other == mode {
            (Bounds::of(mode == 0, Measured::Angles), weighed(decays))
        } else {
            (Bounds::OTHER, 1.0)
        };
        f2 += (share * amplitude_rad.powi(2) * rms(bounds.kappa)).powi(2);
        xi2 += (share * amplitude_rad.powi(2) * rms(bounds.lambda)).powi(2);
    }
    [f2.sqrt(), xi2.sqrt()]
}

/// Least squares sees A² weighed by A²: half of A₀² where it dies away, all of it where it hardly decays.
fn weighed(decays: f64) -> f64 {
    0.5 * (1.0 + (-2.0 * decays.max(0.0)).exp())
}

fn spectral(whole: &Whole, alone: &Signal, mode: usize, xi: f64) -> Estimator {
    let near_hz = whole.fit.poles[mode].omega_rad_s / std::f64::consts::TAU;
    let natural = 1.0 / (1.0 - xi * xi).max(0.1).sqrt();
    let line = Spectrum::line(alone, near_hz, whole.noise_rad);
    Estimator {
        method: Method::Spectrum,
        frequency_hz: line.map(|f| f.times(natural)),
        damping_ratio: None,
        note: Some(match line {
            Some(_) => format!("resolution {:.4} Hz", whole.spectrum.resolution_hz),
            None => format!("no single peak within {:.4} Hz", whole.spectrum.resolution_hz),
        }),
    }
}

fn half_power(whole: &Whole, alone: &Signal, mode: usize) -> Estimator {
    let found = HalfPower::of(alone, whole.fit.poles[mode], whole.noise_rad);
    Estimator {
        method: Method::HalfPower,
        frequency_hz: found.as_ref().ok().map(|h| h.frequency_hz),
        damping_ratio: found.as_ref().ok().map(|h| h.damping_ratio),
        note: Some(match found {
            Ok(h) => format!("the paper's Eq. 28 as printed gives ξ = {:.5}", h.damping_ratio_literal),
            Err(reason) => reason,
        }),
    }
}

fn decrement(whole: &Whole, alone: &Signal, mode: usize) -> Estimator {
    let clearness = |link: usize| whole.fit.links[link].amplitudes_rad[mode].norm() / whole.noise_rad[link];
    let link = (0..alone.links.len()).max_by(|a, b| clearness(*a).total_cmp(&clearness(*b))).unwrap_or(0);
    let frequency_hz = whole.fit.poles[mode].omega_rad_s / std::f64::consts::TAU;
    let found = Decrement::of(&alone.links[link], frequency_hz, whole.noise_rad[link]);
    Estimator {
        method: Method::Decrement,
        frequency_hz: found.as_ref().ok().map(|d| d.frequency_hz),
        damping_ratio: found.as_ref().ok().map(|d| d.damping_ratio),
        note: Some(match found {
            Ok(d) => format!("{}, {} peaks, δ = {:.5}", whole.measured.name(link), d.peaks, d.decrement.value),
            Err(reason) => reason,
        }),
    }
}

/// Widened where the residual near the mode exceeds white noise, and to what the frequency and damping were in the windows.
fn sinusoids([f, xi]: [Estimate; 2], excess: f64, envelope: Option<&Envelope>) -> Estimator {
    let widen = |e: Estimate| {
        let factor = excess.sqrt();
        Estimate {
            sd: e.sd * factor,
            low: e.value + (e.low - e.value) * factor,
            high: e.value + (e.high - e.value) * factor,
            ..e
        }
    };
    let (mut f, mut xi) = (widen(f), widen(xi));
    let misfits = excess > 1.0;
    if let Some(envelope) = envelope.filter(|_| misfits) {
        f = envelope.over_steps(f);
        for step in &envelope.steps {
            xi = xi.widened_to_cover(step.damping_ratio.value, step.damping_ratio.value);
        }
    }
    let note = misfits.then(|| {
        format!("residual {excess:.1} × white noise near the mode: intervals widened to the range over the record")
    });
    Estimator { method: Method::Sinusoids, frequency_hz: Some(f), damping_ratio: Some(xi), note }
}

fn windowed(envelope: &Result<Envelope, String>, measured: Measured) -> Estimator {
    let law = envelope.as_ref().ok().and_then(|e| e.frequency);
    let damping = envelope.as_ref().ok().and_then(|e| e.damping);
    Estimator {
        method: Method::Envelope,
        frequency_hz: law.map(|l| l.f0_hz),
        damping_ratio: damping.map(|d| d.xi0),
        note: Some(match envelope {
            Ok(e) => match law {
                Some(l) => format!(
                    "{} windows; at small amplitude, κ = {}",
                    e.windows,
                    measured.per_square(l.kappa_per_rad2.value, l.kappa_per_rad2.sd)
                ),
                None => format!("{} windows do not tell f against amplitude", e.windows),
            },
            Err(reason) => reason.clone(),
        }),
    }
}

fn modulated(own: &Modulated) -> Estimator {
    Estimator {
        method: Method::Modulated,
        frequency_hz: Some(own.frequency.f0_hz),
        damping_ratio: Some(own.damping_ratio),
        note: None,
    }
}
