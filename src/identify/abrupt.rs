//! Instants at which a swing changes at once: a touch, or frames that are missing though the time stamps go on.
//!
//! Damped sinusoids are fitted to the cycles before an instant and to those after it, each on their own, and both are taken to that instant. Of a swing that is left to
//! itself the two complex amplitudes differ by noise, and by the little that the frequency bends within a few cycles: their usual difference over the record is the
//! measure of both. A difference that noise of this size would make in no recording is a change at once.

use nalgebra::Complex;
use serde::Serialize;

use super::signal::Signal;
use super::sinusoids::SinusoidFit;
use super::windows::{WINDOW_BEATS, window_fit};
use crate::digits::fixed;
use crate::series::Measured;
use crate::statistics::median;

/// Instants looked at in a cycle of the slowest mode.
const INSTANTS_A_CYCLE: f64 = 4.0;
/// From one instant to the next in which the same stretch is the one before, in instants: its length and a margin on either side, of half an instant, as far as a change
/// may lie from the nearest one. Within two cycles and a quarter a frequency is seen.
const FEWEST_STEPS: f64 = 10.0;
/// Fewest instants whose median tells how far two amplitudes usually differ.
const FEWEST_INSTANTS: usize = 12;
/// Probability of a difference by chance below which it is none (statistics), of a record.
const BY_CHANCE: f64 = 1e-6;
/// A change below this part of the record's largest amplitude does no harm (judgement).
const LEAST_CHANGE: f64 = 0.02;
/// What fits beside a change leave, over what they usually leave: where it is more, no damped sinusoids are there, as between two beats (judgement).
const MOST_LEFT: f64 = 2.0;
/// Median of the length of a plane vector whose components have a standard deviation of 1 (Rayleigh).
const MEDIAN_LENGTH: f64 = 1.1774;

/// A change at once of the slowest mode.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct AbruptChange {
    /// When, to an eighth of a cycle.
    pub t_s: f64,
    /// Amplitude of the link that moves most, before it.
    pub before_rad: f64,
    /// The same after it.
    pub after_rad: f64,
    /// By what part of a cycle the oscillation is ahead of what it was, −½ to ½.
    pub ahead_cycles: f64,
}

/// Every change at once of a recording with these modes, in the order of time.
///
/// The largest is found first. A change makes what lies beside it unusual, so that each further one is held against what is usual clear of those that are known.
pub(super) fn changes(signal: &Signal, fit: &SinusoidFit) -> Vec<AbruptChange> {
    let Some(grid) = Grid::of(signal, fit) else { return Vec::new() };
    let stretches = grid.stretches(signal, fit);
    let differences: Vec<Difference> = grid.differences(&stretches);
    let mut found: Vec<AbruptChange> = Vec::new();
    while let Some(change) = grid.largest_change(&stretches, &differences, &found) {
        found.push(change);
    }
    found.sort_by(|a, b| a.t_s.total_cmp(&b.t_s));
    found
}

/// The instants.
struct Grid {
    from_s: f64,
    step_s: f64,
    /// From one instant to the next in which the same stretch is the one before, in instants.
    apart: f64,
    count: usize,
    /// Which of the modes is the slowest.
    slowest: usize,
}

impl Grid {
    /// Stretches of some cycles, and where modes beat of some beats of each.
    fn of(signal: &Signal, fit: &SinusoidFit) -> Option<Self> {
        let omega = |mode: &usize| fit.poles[*mode].omega_rad_s;
        let slowest = (0..fit.poles.len()).min_by(|a, b| omega(a).total_cmp(&omega(b)))?;
        let step_s = std::f64::consts::TAU / omega(&slowest) / INSTANTS_A_CYCLE;
        let pairs = (0..fit.poles.len()).flat_map(|i| (0..i).map(move |j| [i, j]));
        let beats_s = pairs.map(|[a, b]| std::f64::consts::TAU / (omega(&a) - omega(&b)).abs());
        let longest_s = beats_s.fold(0.0, |longest: f64, beat_s| longest.max(WINDOW_BEATS * beat_s));
        let apart = (longest_s / step_s + 1.0).ceil().max(FEWEST_STEPS);
        let count = ((signal.duration_s() / step_s).floor() - apart).max(0.0) as usize;
        Some(Self { from_s: signal.span_s[0], step_s, apart, count, slowest })
    }

    /// One that begins half an instant after each; those without a fit or with a gap are none.
    fn stretches(&self, signal: &Signal, fit: &SinusoidFit) -> Vec<Option<Stretch>> {
        let of = |k: usize| {
            let ends_s = [0.5, self.apart - 0.5].map(|part| self.from_s + (k as f64 + part) * self.step_s);
            let part = signal.between(ends_s[0], ends_s[1]);
            part.links.iter().all(|link| is_filled(&link.t_s, ends_s, self.step_s)).then_some(())?;
            Stretch::of(&window_fit(&part, 0.5 * (ends_s[0] + ends_s[1]), &[&fit.poles])?, self)
        };
        (0..self.count).map(of).collect()
    }

    /// The largest change beside those that are known; `None` where no further one is told.
    fn largest_change(
        &self,
        stretches: &[Option<Stretch>],
        differences: &[Difference<'_>],
        known: &[AbruptChange],
    ) -> Option<AbruptChange> {
        let reach_s = self.apart * self.step_s;
        let is_clear = |t_s: f64, by: f64| known.iter().all(|change| (t_s - change.t_s).abs() > by * reach_s);
        let middle_s = |k: usize| self.from_s + (k as f64 + 0.5 * self.apart) * self.step_s;
        let clear_of = |k: &usize| is_clear(middle_s(*k), 0.5);
        let links = stretches.iter().flatten().next().map_or(0, |own| own.left_rad.len());
        let usual_of = |mut values: Vec<f64>| median(&mut values).unwrap_or(f64::INFINITY);
        let left_rad = |link: usize| {
            let clear = (0..stretches.len()).filter(clear_of).filter_map(|k| stretches[k].as_ref());
            usual_of(clear.map(|own| own.left_rad[link]).collect())
        };
        let usually_left_rad: Vec<f64> = (0..links).map(left_rad).collect();
        let clear: Vec<(&Difference, f64)> = (differences.iter().filter(|own| is_clear(own.t_s, 1.0)))
            .map(|own| (own, own.in_sd(&usually_left_rad)))
            .collect();
        if clear.len() < FEWEST_INSTANTS {
            return None;
        }
        let usual = (usual_of(clear.iter().map(|(_, in_sd)| *in_sd).collect()) / MEDIAN_LENGTH).max(1.0);
        let largest_rad = clear.iter().map(|(own, _)| own.amplitudes_rad()[0].norm()).fold(0.0, f64::max);
        // the length of a plane vector exceeds r standard deviations with a probability of exp(−r²/2)
        let limit = usual * (2.0 * (differences.len() as f64 / BY_CHANCE).ln()).sqrt();
        let is_change = |(own, in_sd): &&(&Difference, f64)| {
            let [before, after] = own.amplitudes_rad();
            // it lies in the stretches of its neighbours
            *in_sd > limit
                && is_clear(own.t_s, 1.5)
                && own.is_clean(&usually_left_rad)
                && (after - before).norm() > LEAST_CHANGE * largest_rad
        };
        let largest = clear.iter().filter(is_change).max_by(|a, b| a.1.total_cmp(&b.1))?;
        Some(largest.0.change())
    }

    fn differences<'a>(&self, stretches: &'a [Option<Stretch>]) -> Vec<Difference<'a>> {
        let apart = self.apart as usize;
        let of = |k: usize| {
            let (before, after) = (stretches[k - apart].as_ref()?, stretches[k].as_ref()?);
            Some(Difference { t_s: self.from_s + k as f64 * self.step_s, before, after })
        };
        (apart..stretches.len()).filter_map(of).collect()
    }
}

/// Whether values follow one another without a gap longer than this.
fn is_filled(t_s: &[f64], [from_s, until_s]: [f64; 2], longest_s: f64) -> bool {
    let ends = [t_s.first().map(|first| first - from_s), t_s.last().map(|last| until_s - last)];
    let is_short = |gap_s: f64| gap_s <= longest_s;
    ends.iter().all(|gap_s| gap_s.is_some_and(is_short)) && t_s.windows(2).all(|pair| is_short(pair[1] - pair[0]))
}

/// The slowest mode of one stretch.
struct Stretch {
    /// Of each link, half an instant before it and half an instant after it.
    ends_rad: [Vec<Complex<f64>>; 2],
    /// Standard deviation of an amplitude of each link for given poles, over that of a value.
    of_noise: Vec<f64>,
    /// Standard deviation of what is left of each link.
    left_rad: Vec<f64>,
}

impl Stretch {
    fn of(local: &SinusoidFit, grid: &Grid) -> Option<Self> {
        let pole = local.poles.get(grid.slowest)?;
        let half_s = 0.5 * grid.apart * grid.step_s;
        let at = |tau_s: f64| {
            let turned = Complex::from_polar((-pole.decay_per_s * tau_s).exp(), pole.omega_rad_s * tau_s);
            local.links.iter().map(|link| link.amplitudes_rad[grid.slowest] * turned).collect()
        };
        let left_rad: Vec<f64> = local.links.iter().map(|link| link.noise_rad.max(f64::MIN_POSITIVE)).collect();
        let of_noise = local.links.iter().zip(&left_rad);
        let of_noise = of_noise.map(|(link, left)| link.amplitude_sd_rad[grid.slowest] / left).collect();
        Some(Self { ends_rad: [at(-half_s), at(half_s)], of_noise, left_rad })
    }
}

impl AbruptChange {
    /// In words.
    pub fn statement(&self, measured: Measured) -> String {
        let [before, after] = [self.before_rad, self.after_rad].map(|rad| measured.show(rad, 1));
        format!(
            "the swing changes at once at t = {:.2} s (amplitude from {before} to {after}, {} cycles ahead): a touch, or missing frames",
            self.t_s,
            fixed(self.ahead_cycles, 2)
        )
    }
}

/// Two stretches, taken to the instant between them.
struct Difference<'a> {
    t_s: f64,
    before: &'a Stretch,
    after: &'a Stretch,
}

impl Difference<'_> {
    /// Before and after, of each link.
    fn pairs(&self) -> impl Iterator<Item = [Complex<f64>; 2]> {
        self.before.ends_rad[1].iter().zip(&self.after.ends_rad[0]).map(|(before, after)| [*before, *after])
    }

    /// Before and after, of the link that moves most.
    fn amplitudes_rad(&self) -> [Complex<f64>; 2] {
        self.pairs().max_by(|a, b| a[0].norm().total_cmp(&b[0].norm())).unwrap_or_default()
    }

    /// The difference in standard deviations of given poles, all links together, where values have this noise.
    fn in_sd(&self, noise_rad: &[f64]) -> f64 {
        let of_noise = self.before.of_noise.iter().zip(&self.after.of_noise);
        let squares = self.pairs().zip(of_noise).zip(noise_rad).map(|(([before, after], (a, b)), noise_rad)| {
            (after - before).norm_sqr() / (noise_rad * a.hypot(*b)).powi(2).max(f64::MIN_POSITIVE)
        });
        (squares.sum::<f64>() / noise_rad.len() as f64).sqrt()
    }

    fn is_clean(&self, usually_left_rad: &[f64]) -> bool {
        let of =
            |stretch: &Stretch| stretch.left_rad.iter().zip(usually_left_rad).all(|(l, usual)| *l < MOST_LEFT * usual);
        of(self.before) && of(self.after)
    }

    fn change(&self) -> AbruptChange {
        let [before, after] = self.amplitudes_rad();
        AbruptChange {
            t_s: self.t_s,
            before_rad: before.norm(),
            after_rad: after.norm(),
            ahead_cycles: (after / before).arg() / std::f64::consts::TAU,
        }
    }
}

/// The longest part of a recording that these changes leave as it is, from when to when, a quarter of a cycle clear of them.
pub(super) fn longest_part_s(signal: &Signal, changes: &[AbruptChange], cycle_s: f64) -> [f64; 2] {
    let starts = std::iter::once(signal.span_s[0]).chain(changes.iter().map(|change| change.t_s + 0.25 * cycle_s));
    let ends = changes.iter().map(|change| change.t_s - 0.25 * cycle_s).chain([signal.span_s[1]]);
    let parts = starts.zip(ends).map(|(from_s, until_s)| [from_s, until_s]);
    parts.max_by(|a, b| (a[1] - a[0]).total_cmp(&(b[1] - b[0]))).unwrap_or(signal.span_s)
}

#[cfg(test)]
mod tests {
    use rand::rngs::Xoshiro256PlusPlus;
    use rand::{RngExt as _, SeedableRng as _};

    use super::*;
    use crate::identify::pole::Pole;
    use crate::identify::signal::LinkSamples;

    /// 60 s at 30 Hz with noise of 1 mrad.
    fn recorded(theta_rad: impl Fn(f64) -> f64) -> Signal {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(5);
        let t_s: Vec<f64> = (0..1800).map(|i| f64::from(i) / 30.0).collect();
        let theta_rad = t_s.iter().map(|t| theta_rad(*t) + rng.random_range(-1.7e-3..1.7e-3)).collect();
        let span_s = [t_s[0], t_s[t_s.len() - 1]];
        Signal { links: vec![LinkSamples { t_s, theta_rad }], span_s, step_s: 1.0 / 30.0 }
    }

    fn changes_of(signal: &Signal, poles: &[Pole]) -> Vec<AbruptChange> {
        changes(signal, &SinusoidFit::from_start(signal, 0.0, poles).unwrap())
    }

    /// A swing of 0.9 Hz that is given so much more speed (rad/s) at 20 s.
    fn touched(speed_rad_s: f64) -> Signal {
        let pole = Pole::of(0.9, 0.005);
        let free = move |t: f64| 0.2 * (-pole.decay_per_s * t).exp() * (pole.omega_rad_s * t).cos();
        let more = move |t: f64| {
            let tau = (t - 20.0).max(0.0);
            speed_rad_s / pole.omega_rad_s * (-pole.decay_per_s * tau).exp() * (pole.omega_rad_s * tau).sin()
        };
        recorded(move |t| free(t) + more(t))
    }

    #[test]
    fn a_touch_is_told_with_its_time_and_a_swing_left_to_itself_has_none() {
        let poles = [Pole::of(0.9, 0.005)];
        assert!(changes_of(&touched(0.0), &poles).is_empty());
        for speed_rad_s in [0.06, 0.4] {
            let signal = touched(speed_rad_s);
            let [change] = changes_of(&signal, &poles)[..] else { panic!("one touch") };
            assert!((change.t_s - 20.0).abs() < 0.15, "{change:?}");
            assert!((change.before_rad - 0.2 * (-poles[0].decay_per_s * 20.0).exp()).abs() < 2e-3, "{change:?}");
            let [from_s, until_s] = longest_part_s(&signal, &[change], 1.0 / 0.9);
            assert!(from_s > 20.0 && from_s < 20.6 && until_s == signal.span_s[1]);
        }
    }

    #[test]
    fn frames_that_are_missing_move_the_phase_alone() {
        let pole = Pole::of(0.9, 0.005);
        let later = |t: f64| if t < 30.0 { t } else { t + 0.1 };
        let signal = recorded(|t| 0.2 * (-pole.decay_per_s * later(t)).exp() * (pole.omega_rad_s * later(t)).cos());
        let [change] = changes_of(&signal, &[pole])[..] else { panic!("one jump") };
        assert!((change.t_s - 30.0).abs() < 0.15 && (change.ahead_cycles - 0.09).abs() < 0.005, "{change:?}");
        assert!((change.after_rad / change.before_rad - 1.0).abs() < 0.02, "{change:?}");
    }

    #[test]
    fn a_single_frame_that_is_missing_is_seen_beside_many() {
        // of 20 s, four frames at 6.7 s and one at 14 s: both lie in most of the stretches
        let pole = Pole::of(1.0, 0.004);
        let later = |t: f64| t + if t < 6.7 { 0.0 } else { 4.0 / 30.0 } + if t < 14.0 { 0.0 } else { 1.0 / 30.0 };
        let whole = recorded(|t| 0.28 * (-pole.decay_per_s * later(t)).exp() * (pole.omega_rad_s * later(t)).cos());
        let found = changes_of(&whole.between(0.0, 20.0), &[pole]);
        let [many, one] = found[..] else { panic!("{found:?}") };
        assert!((many.t_s - 6.7).abs() < 0.2 && (one.t_s - 14.0).abs() < 0.2, "{found:?}");
        assert!((one.ahead_cycles - 1.0 / 30.0).abs() < 0.005, "{found:?}");
    }

    #[test]
    fn beats_a_wide_swing_and_a_gap_are_no_changes() {
        let [a, b] = [Pole::of(1.0, 0.003), Pole::of(1.06, 0.003)];
        let beats = recorded(|t| 0.05 * (a.omega_rad_s * t).cos() + 0.04 * (b.omega_rad_s * t).cos());
        assert!(changes_of(&beats, &[a, b]).is_empty());
        // as a pendulum's frequency falls, f₀(1 − A²/16)
        let amplitude = |t: f64| 1.0 * (-0.03 * t).exp();
        let wide = recorded(|t| {
            let turned = std::f64::consts::TAU * (t - (1.0 - (-0.06 * t).exp()) / 0.06 / 16.0);
            amplitude(t) * turned.cos()
        });
        assert!(changes_of(&wide, &[Pole::of(0.97, 0.005)]).is_empty());
        let mut gap = touched(0.0);
        let link = &mut gap.links[0];
        let kept: Vec<usize> = (0..link.t_s.len()).filter(|k| !(20.0..24.0).contains(&link.t_s[*k])).collect();
        *link = LinkSamples {
            t_s: kept.iter().map(|k| link.t_s[*k]).collect(),
            theta_rad: kept.iter().map(|k| link.theta_rad[*k]).collect(),
        };
        assert!(changes_of(&gap, &[Pole::of(0.9, 0.005)]).is_empty());
    }
}
