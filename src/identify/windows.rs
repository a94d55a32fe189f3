//! A recording cut into windows of a few cycles, with damped sinusoids fitted in each on its own.
//!
//! Amplitude and phase at a window's middle do not depend on the frequency and damping fitted within it, nor on the other windows.
//!
//! The windows are cut for all modes together, by the slowest one's cycles. Where that leaves fewer than three in which a faster mode is seen, or where the
//! slowest has too few cycles, [`Windows::of_mode`] cuts them by the mode's own, the others taken away.

use nalgebra::Complex;

use super::pole::Pole;
use super::signal::{LinkSamples, Signal};
use super::sinusoids::SinusoidFit;
use crate::statistics::median;

/// Cycles of the slowest mode in a window.
const WINDOW_CYCLES: f64 = 4.0;
/// Beats of the slowest mode with its neighbour in a window: over fewer of them the amplitudes of both are not told apart.
pub(super) const WINDOW_BEATS: f64 = 2.0;
/// Cycles of a stretch that shows a frequency, at least.
const STRETCH_CYCLES: f64 = 2.2;
/// Windows that show a law of three terms.
pub const FEWEST_OF_A_LAW: usize = 6;
/// An amplitude must exceed this many of its standard deviations, or its phase cannot be followed.
const CLEAR_OF_NOISE: f64 = 5.0;

/// One mode in one window.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WindowAmplitude {
    /// The window's middle.
    pub t_s: f64,
    /// Complex amplitude of the mode, scaled to the link that moves most.
    pub amplitude_rad: Complex<f64>,
    /// Standard deviation of its real and imaginary part.
    pub sd_rad: f64,
    /// Frequency within the window, for joining the phases.
    pub omega_rad_s: f64,
}

impl WindowAmplitude {
    /// A, with the noise's share of its square removed.
    pub fn amplitude_rad(&self) -> f64 {
        (self.amplitude_rad.norm_sqr() - self.sd_rad * self.sd_rad).max(0.0).sqrt()
    }

    /// The same beside something else of this size (rad), which may stand in its place.
    pub fn beside(&self, other_rad: f64) -> Self {
        Self { sd_rad: self.sd_rad.hypot(other_rad), ..*self }
    }

    /// Whether its phase can be followed.
    fn is_clear(&self) -> bool {
        self.amplitude_rad.norm() > CLEAR_OF_NOISE * self.sd_rad
    }
}

/// The moments up to where the mode is no longer clear of noise and all else.
pub(super) fn while_clear(moments: impl Iterator<Item = WindowAmplitude>) -> Vec<WindowAmplitude> {
    moments.take_while(WindowAmplitude::is_clear).collect()
}

/// The windows of a recording.
#[derive(Debug, Clone, PartialEq)]
pub struct Windows {
    /// Length of each.
    pub window_s: f64,
    /// `[mode][window]`, those clear of the noise.
    pub moments: Vec<Vec<WindowAmplitude>>,
    /// Noise of each link, from what the windows' fits leave over.
    pub noise_rad: Vec<f64>,
    /// θᵢ/θ₁ of each mode, all windows together: `[mode][link]`.
    pub shapes: Vec<Vec<Complex<f64>>>,
    /// Standard deviation of the real and imaginary part of each.
    pub shape_sd: Vec<Vec<f64>>,
    /// In the order of time; a window without a sound fit is left out.
    fits: Vec<SinusoidFit>,
}

impl Windows {
    /// Cuts a signal into windows and fits these modes in each.
    ///
    /// # Errors
    /// In words, when there are fewer than three windows, or fewer than three can be fitted.
    pub fn of(signal: &Signal, fit: &SinusoidFit) -> Result<Self, String> {
        let of_poles = fit.poles.iter().map(|p| p.omega_rad_s);
        let slowest = of_poles.clone().fold(f64::INFINITY, f64::min);
        let cycles = signal.duration_s() * slowest / std::f64::consts::TAU;
        let apart = of_poles.fold(f64::INFINITY, |d, w| if w > slowest { d.min(w - slowest) } else { d });
        let beats = signal.duration_s() * apart / std::f64::consts::TAU;
        let count = (cycles / WINDOW_CYCLES).min(beats / WINDOW_BEATS).floor();
        if beats < 3.0 * WINDOW_BEATS {
            return Err(format!(
                "{beats:.1} beats of two modes are too few to see an amplitude change; record at least {:.0} beats",
                3.0 * WINDOW_BEATS
            ));
        }
        if count < 3.0 {
            return Err(format!(
                "{cycles:.1} cycles are too few to see an amplitude change; record at least {:.0} cycles",
                3.0 * WINDOW_CYCLES
            ));
        }
        let window_s = signal.duration_s() / count;
        let mut fits: Vec<SinusoidFit> = Vec::new();
        let mut previous = fit.poles.clone();
        for k in 0..count as usize {
            let from_s = signal.span_s[0] + k as f64 * window_s;
            // the last sample belongs to the last window
            let until_s = from_s + window_s + if k + 1 == count as usize { signal.step_s } else { 0.0 };
            let window = signal.between(from_s, until_s);
            if let Some(local) = window_fit(&window, from_s + 0.5 * window_s, &[&previous, &fit.poles]) {
                previous.clone_from(&local.poles);
                previous.extend_from_slice(&fit.poles[local.poles.len()..]);
                fits.push(local);
            }
        }
        if fits.len() < 3 {
            return Err(format!(
                "only {} of {count:.0} windows hold enough samples and a clear oscillation",
                fits.len()
            ));
        }
        let noise_rad: Vec<f64> = (0..signal.links.len()).map(|link| pooled_noise(&fits, link)).collect();
        fits.iter_mut().for_each(|local| share_noise(local, &noise_rad));
        let modes = fit.poles.len();
        let mut windows = Self {
            window_s,
            moments: Vec::new(),
            noise_rad,
            shapes: Vec::new(),
            shape_sd: Vec::new(),
            fits: Vec::new(),
        };
        for mode in 0..modes {
            let local: Vec<&SinusoidFit> = fits.iter().filter(|f| f.poles.len() > mode).collect();
            let (shape, sd) = shape(&local, fit, mode);
            windows.moments.push(moments(&local, mode, &shape));
            windows.shapes.push(shape);
            windows.shape_sd.push(sd);
        }
        windows.fits = fits;
        Ok(windows)
    }

    /// One mode alone in windows of its own cycles, every other one taken away as the whole record's fit has it.
    ///
    /// # Errors
    /// As [`Windows::of`].
    pub fn of_mode(signal: &Signal, fit: &SinusoidFit, mode: usize) -> Result<Self, String> {
        Self::of(&fit.isolate(signal, mode), &fit.only(mode))
    }

    /// The signal with the offset and every mode but one taken away as each window shows them; samples outside every window are left out.
    #[must_use]
    pub fn isolate(&self, signal: &Signal, whole: &SinusoidFit, mode: usize) -> Signal {
        let empty = LinkSamples { t_s: Vec::new(), theta_rad: Vec::new() };
        let links = vec![empty; signal.links.len()];
        let mut alone = Signal { links, span_s: signal.span_s, step_s: signal.step_s };
        for fit in self.fits.iter().filter(|f| f.poles.len() > mode) {
            let from_s = fit.origin_s - 0.5 * self.window_s;
            let last = fit.origin_s + self.window_s > signal.span_s[1];
            let until_s = from_s + self.window_s + if last { signal.step_s } else { 0.0 };
            // the offset of a short window is none of its own: the whole record's serves better
            let mut local = fit.clone();
            for (link, whole) in local.links.iter_mut().zip(&whole.links) {
                link.offset_rad = whole.offset_rad;
            }
            let part = local.isolate(&signal.between(from_s, until_s), mode);
            for (link, part) in alone.links.iter_mut().zip(part.links) {
                link.t_s.extend(part.t_s);
                link.theta_rad.extend(part.theta_rad);
            }
        }
        alone
    }
}

/// From the lowest to the highest frequency (Hz) and damping ratio of a mode alone in stretches of a record that is too short for windows; where it is clear of the
/// noise in two of them.
pub(super) fn over_stretches(signal: &Signal, fit: &SinusoidFit) -> Option<[[f64; 2]; 2]> {
    let [pole] = fit.poles[..] else { return None };
    let cycles = signal.duration_s() * pole.omega_rad_s / std::f64::consts::TAU;
    let count = (cycles / STRETCH_CYCLES).floor();
    let stretch_s = signal.duration_s() / count;
    let of_stretch = |k: usize| {
        let from_s = signal.span_s[0] + k as f64 * stretch_s;
        let stretch = signal.between(from_s, from_s + stretch_s);
        window_fit(&stretch, from_s + 0.5 * stretch_s, &[&fit.poles])
    };
    let local: Vec<Pole> = (0..count as usize).filter_map(of_stretch).map(|fit| fit.poles[0]).collect();
    let ends = |of: fn(&Pole) -> f64| {
        local.iter().map(of).fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], own| [low.min(own), high.max(own)])
    };
    (local.len() >= 2).then(|| [ends(Pole::frequency_hz), ends(Pole::damping_ratio)])
}

/// Fits a window with all modes, or with fewer when the weaker ones have died away, from each of these starts; what is found is near the first of them.
pub(super) fn window_fit(window: &Signal, origin_s: f64, starts: &[&[Pole]]) -> Option<SinusoidFit> {
    let first = starts.first()?;
    let best = |modes: usize| {
        let fits = starts.iter().filter_map(|start| SinusoidFit::from_start(window, origin_s, &start[..modes]));
        let near = |f: &SinusoidFit| {
            f.poles.iter().zip(*first).all(|(a, b)| (a.omega_rad_s / b.omega_rad_s - 1.0).abs() < 0.25)
        };
        fits.filter(near).min_by(|a, b| a.deviance.total_cmp(&b.deviance))
    };
    let clear = |f: &SinusoidFit| {
        (0..f.poles.len())
            .all(|m| f.links.iter().any(|l| l.amplitudes_rad[m].norm() > CLEAR_OF_NOISE * l.amplitude_sd_rad[m]))
    };
    (1..=first.len()).rev().filter_map(best).find(clear)
}

/// Takes the pooled noise for a window's own where the two differ by no more than chance: the pooled one is better known.
fn share_noise(fit: &mut SinusoidFit, pooled_rad: &[f64]) {
    for (link, pooled) in fit.links.iter_mut().zip(pooled_rad) {
        let ratio = pooled / link.noise_rad;
        if (0.8..1.4).contains(&ratio) {
            link.amplitude_sd_rad.iter_mut().for_each(|sd| *sd *= ratio);
        }
    }
}

fn pooled_noise(fits: &[SinusoidFit], link: usize) -> f64 {
    // the median is not drawn up by the first, largest swings, where a sinusoid fits worst
    let mut noises: Vec<f64> = fits.iter().map(|f| f.links[link].noise_rad).collect();
    median(&mut noises).unwrap_or(0.0)
}

/// θᵢ/θ₁ over all windows, each weighted by its own certainty; of the whole record's fit where no window shows the mode.
fn shape(local: &[&SinusoidFit], whole: &SinusoidFit, mode: usize) -> (Vec<Complex<f64>>, Vec<f64>) {
    let source: Vec<&SinusoidFit> = if local.is_empty() { vec![whole] } else { local.to_vec() };
    let links = 0..whole.links.len();
    let each = links.map(|link| {
        let (mut cross, mut power, mut variance) = (Complex::new(0.0, 0.0), 0.0, 0.0);
        for fit in &source {
            let (first, this) = (&fit.links[0], &fit.links[link]);
            let weight =
                1.0 / this.amplitude_sd_rad[mode].hypot(first.amplitude_sd_rad[mode]).powi(2).max(f64::MIN_POSITIVE);
            cross += weight * this.amplitudes_rad[mode] * first.amplitudes_rad[mode].conj();
            power += weight * first.amplitudes_rad[mode].norm_sqr();
        }
        let ratio = cross / power;
        for fit in &source {
            let (first, this) = (&fit.links[0], &fit.links[link]);
            let sd2 = this.amplitude_sd_rad[mode].powi(2) + (ratio.norm() * first.amplitude_sd_rad[mode]).powi(2);
            variance += first.amplitudes_rad[mode].norm_sqr() / sd2.max(f64::MIN_POSITIVE);
        }
        (ratio, if link == 0 { 0.0 } else { variance.recip().sqrt() })
    });
    each.unzip()
}

/// The mode's amplitude in each window, projected on its shape, scaled to the link that moves most.
fn moments(local: &[&SinusoidFit], mode: usize, shape: &[Complex<f64>]) -> Vec<WindowAmplitude> {
    let largest = shape.iter().map(|s| s.norm()).fold(0.0, f64::max);
    let each = local.iter().map(|fit| {
        let (mut sum, mut weight) = (Complex::new(0.0, 0.0), 0.0);
        for (link, s) in fit.links.iter().zip(shape) {
            let (s, certainty) = (s / largest, link.amplitude_sd_rad[mode].powi(-2));
            sum += certainty * s.conj() * link.amplitudes_rad[mode];
            weight += certainty * s.norm_sqr();
        }
        WindowAmplitude {
            t_s: fit.origin_s,
            amplitude_rad: sum / weight,
            sd_rad: weight.recip().sqrt(),
            omega_rad_s: fit.poles[mode].omega_rad_s,
        }
    });
    let sound = |m: &WindowAmplitude| m.sd_rad > 0.0 && m.sd_rad.is_finite();
    while_clear(each.filter(sound))
}
