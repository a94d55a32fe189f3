//! One oscillation whose frequency and damping go with its amplitude, over the whole record at once.
//!
//! The slow flow (`slow_flow`) shows how the phase bends as the swing becomes smaller, also where a record is too short to be cut into [`super::windows`]. Which losses there are, and whether the resting angle drifts, the Bayesian information criterion says. What hung bodies allow of κ enters as an
//! observation, as in [`super::envelope`]; of a displacement nobody knows what angle it is of, and k = κA² is open up to that of a swing of some 70°.

use std::iter;

use nalgebra::{DMatrix, DVector};
use serde::Serialize;

use super::damping::{Trend, is_above};
use super::envelope::{Bounds, FrequencyLaw, PENDULUM, THEORY_TOLERANCE};
use super::estimate::{Estimate, f_tail};
use super::excess::Excess;
use super::pendulum;
use super::signal::Signal;
use super::sinusoids::SinusoidFit;
use super::slow_flow::{Coefficients, FEWEST_DELTA, SETS, SlowFlow};
use crate::series::Measured;

/// Mean and standard deviation of k where nothing is known of it: that of a swing of 70° (judgement).
const ANY_K: [f64; 2] = [0.0, 0.1];
/// A fall of the deviance by which a recording contradicts a prior (statistics: three standard deviations).
const CONTRADICTS: f64 = 9.0;
/// What may be left beside the oscillation of a hung body, over what scatters from sample to sample (judgement): as much. So large may the errors of a tracker or an encoder be that go
/// with the swing; more is what the fit does not describe.
const MOST_BESIDE: f64 = 1.0;

/// What the fit says.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Modulated {
    /// Frequency against amplitude.
    pub frequency: FrequencyLaw,
    /// ξ at small amplitude where it is a constant, else stretched to what it is from the record's first amplitude to its last.
    pub damping_ratio: Estimate,
    /// How it goes with amplitude, where it does.
    pub trend: Option<Trend>,
    /// Standard deviation of each link's residual.
    pub noise_rad: Vec<f64>,
    /// Terms of drift that it has beside it.
    #[serde(skip)]
    pub drift_terms: usize,
}

impl Modulated {
    /// Of a recording with one mode, of which these damped sinusoids are known; `None` where it is no weakly nonlinear oscillation, or leaves more than noise.
    pub(super) fn of(recorded: &Signal, sinusoids: &SinusoidFit, measured: Measured) -> Option<Self> {
        let [pole] = sinusoids.poles[..] else { return None };
        let values = recorded.values() as f64;
        let recorded = &recorded.averaged(pole.omega_rad_s);
        let own = Self::of_averaged(recorded, sinusoids, measured)?;
        let averaged = (values / recorded.values() as f64).sqrt();
        Some(Self { noise_rad: own.noise_rad.iter().map(|noise| noise * averaged).collect(), ..own })
    }

    fn of_averaged(recorded: &Signal, sinusoids: &SinusoidFit, measured: Measured) -> Option<Self> {
        let best = best_flow(recorded, sinusoids, measured)?;
        best.is_weakly_nonlinear().then_some(())?;
        let before_it_sticks = |fewest_delta: f64| {
            let until_s = best.sticks_from_s(fewest_delta).unwrap_or(recorded.span_s[1]);
            let swing = recorded.between(recorded.span_s[0], until_s);
            sinusoids.poles[0].is_resolved_oscillation(swing.duration_s()).then_some(swing)
        };
        let swing = FEWEST_DELTA.into_iter().find_map(before_it_sticks)?;
        Told::of(&best.over(&swing)?)?.modulated()
    }

    /// The Bayesian information criterion of one such oscillation, up to the constant that [`SinusoidFit::criterion`] leaves out.
    pub(super) fn criterion(recorded: &Signal, sinusoids: &SinusoidFit, measured: Measured) -> Option<f64> {
        let best = best_flow(recorded, sinusoids, measured)?;
        // its noise is that of an unbiased estimate
        let values = recorded.values() as f64;
        Some(best.criterion() + values * (best.degrees_of_freedom() / values).ln())
    }
}

/// The slow flow that describes the whole recording best.
fn best_flow<'a>(recorded: &'a Signal, sinusoids: &SinusoidFit, measured: Measured) -> Option<SlowFlow<'a>> {
    let [pole] = sinusoids.poles[..] else { return None };
    let prior = prior_of_k(recorded, sinusoids.amplitude_rad(0), measured);
    let noise_rad: Vec<f64> = sinusoids.links.iter().map(|link| link.noise_rad).collect();
    let drifts = sinusoids.drift_terms();
    let of_terms = |terms| SlowFlow::at(recorded, pole, (prior, measured), terms, &noise_rad).solved(SETS[0]);
    let viscous = iter::once(0).chain((drifts > 0).then_some(drifts)).filter_map(of_terms);
    let best = viscous.flat_map(with_others).min_by(|a, b| a.criterion().total_cmp(&b.criterion()))?;
    // where the recording contradicts what hung bodies allow, it is right
    let open = best.with_prior(ANY_K).filter(|open| best.deviance() - open.deviance() > CONTRADICTS);
    Some(open.unwrap_or(best))
}

/// With one set of losses after the other.
fn with_others(viscous: SlowFlow<'_>) -> Vec<SlowFlow<'_>> {
    let others = SETS[1..].iter().filter_map(|set| viscous.clone().solved(set)).filter(SlowFlow::loses);
    others.chain([viscous.clone()]).collect()
}

/// Mean and standard deviation of what k may be.
fn prior_of_k(recorded: &Signal, amplitude_rad: f64, measured: Measured) -> [f64; 2] {
    match measured {
        // one link alone is a pendulum, or a spring brings it back
        Measured::Angles if recorded.links.len() == 1 => {
            [0.5, 2.0 / 3.0].map(|part| part * PENDULUM * amplitude_rad.powi(2))
        }
        Measured::Angles => Bounds::of(true, measured).kappa.map(|bound| bound * amplitude_rad.powi(2)),
        Measured::Displacement => ANY_K,
    }
}

/// A fit that leaves only noise, with intervals that allow for the powers of the amplitude that it leaves out.
struct Told<'f, 'a> {
    flow: &'f SlowFlow<'a>,
    own: Coefficients,
    /// k before gravity alone is assumed, with its standard deviation.
    seen_k: [f64; 2],
    /// A₀.
    amplitude_rad: f64,
    /// In the end, over A₀.
    last: f64,
    /// Of ω₀, k, β₀, β₁, β₂.
    covariance: DMatrix<f64>,
    /// Probability of so large a residual near the oscillation.
    p_value: f64,
}

impl<'f, 'a> Told<'f, 'a> {
    fn of(flow: &'f SlowFlow<'a>) -> Option<Self> {
        let seen = flow.coefficients();
        let beside = Excess::of(&flow.residual()?, seen.omega_rad_s);
        // a fit that failed is no evidence
        let is_noise = beside.over_scatter <= MOST_BESIDE && !flow.is_beyond_hung_bodies(ANY_K);
        (beside.power <= 1.0 || is_noise).then_some(())?;
        let (amplitude_rad, last) = (flow.amplitude_rad()?, flow.last()?);
        // what errors of the recording that go with the swing do to the oscillation, least squares sees with the power that they have there
        let mut covariance = flow.covariance()?;
        let seen_k = [seen.k, (covariance[(1, 1)] * beside.power).sqrt()];
        let mut values = seen.values();
        let is_link = flow.measured == Measured::Angles && flow.signal.links.len() == 1;
        if is_link && !flow.is_beyond_hung_bodies(ANY_K) {
            let priors = [flow.prior, pendulum::by_gravity(amplitude_rad)];
            pendulum::average_over_models(&mut values, &mut covariance, beside.power, priors);
        } else {
            covariance *= beside.power;
        }
        let own = Coefficients::of(values);
        Some(Self { flow, own, seen_k, amplitude_rad, last, covariance, p_value: beside.p_value })
    }

    /// Of a linear function of ω₀, k, β₀, β₁, β₂.
    fn sd(&self, slope: [f64; 5]) -> f64 {
        let slope = DVector::from_column_slice(&slope);
        slope.dot(&(&self.covariance * &slope)).max(0.0).sqrt()
    }

    fn estimate(&self, value: f64, slope: [f64; 5]) -> Estimate {
        Estimate::new(value, self.sd(slope), self.flow.degrees_of_freedom())
    }

    fn k_sd(&self) -> f64 {
        self.covariance[(1, 1)].sqrt()
    }

    /// Where the amplitude is a times the first one.
    fn damping_ratio(&self, a: f64) -> Estimate {
        let Coefficients { omega_rad_s: omega, losses_per_s: [dry, viscous, drag], .. } = self.own;
        let slope = [0.0, 0.0, 1.0 / (a * omega), 1.0 / omega, a / omega];
        self.estimate((dry / a + viscous + drag * a) / omega, slope)
    }

    /// The square of the angle's first amplitude.
    fn amplitude_rad2(&self) -> f64 {
        match self.flow.measured {
            Measured::Angles => self.amplitude_rad.powi(2),
            // of a pendulum, whose k tells it
            Measured::Displacement => (self.own.k.abs() + self.k_sd()) / PENDULUM,
        }
    }

    /// What amplitude may do to the ξ of a linear damper.
    fn of_linear_damper(&self) -> f64 {
        let bound = Bounds::of(true, self.flow.measured).lambda[1];
        // least squares sees a² weighed by a²
        let seen = 0.5 * (1.0 + self.last.powi(2));
        bound * seen * self.amplitude_rad2() * self.damping_ratio(1.0).value.abs()
    }

    /// Whether ξ at one amplitude is above that at another, by more than a linear damper's.
    fn is_above(&self, a: f64, b: f64) -> bool {
        let omega = self.own.omega_rad_s;
        let sd = self.sd([0.0, 0.0, (1.0 / a - 1.0 / b) / omega, 0.0, (a - b) / omega]);
        let [high, low] = [a, b].map(|amplitude| self.damping_ratio(amplitude).value);
        is_above(high, low, sd.hypot(self.of_linear_damper()))
    }

    /// The amplitude at which dry friction and drag together are least, over the first one.
    fn least_at(&self) -> f64 {
        let [dry, _, drag] = self.own.losses_per_s;
        (dry / drag).sqrt()
    }

    fn trend(&self) -> Option<Trend> {
        let (first, last, least_at) = (1.0, self.last, self.least_at());
        let is_between = last < least_at && least_at < first;
        if is_between && self.is_above(last, least_at) && self.is_above(first, least_at) {
            Some(Trend::LeastBetween)
        } else if self.is_above(first, last) {
            Some(Trend::GrowsWithAmplitude)
        } else if self.is_above(last, first) {
            Some(Trend::FallsWithAmplitude)
        } else {
            None
        }
    }

    /// By how much the frequency at small amplitude may be off for what the flow leaves out, relative to it.
    fn left_out(&self) -> f64 {
        let Coefficients { omega_rad_s: omega, k, losses_per_s: [_, viscous, drag] } = self.own;
        let (last, kappa) = (self.last, k / self.amplitude_rad.powi(2));
        // the next power is known of a pendulum, of another spring only its order
        let is_pendulum = match self.flow.measured {
            Measured::Angles => {
                let kappa_sd = self.k_sd() / self.amplitude_rad.powi(2);
                (kappa - PENDULUM).abs() < 2.0 * kappa_sd + THEORY_TOLERANCE * PENDULUM
            }
            Measured::Displacement => k > -2.0 * self.k_sd(),
        };
        let fourth = Bounds::of(true, self.flow.measured).fourth[0];
        // where a spring cancels what gravity does to the first power, it does not cancel the next
        let larger = k.abs().max(PENDULUM * self.amplitude_rad2());
        let next =
            if is_pendulum { fourth * (self.last * self.amplitude_rad2()).powi(2) } else { (larger * last).powi(2) };
        // the second order in δ/A is a part of the phase
        let of_friction = (self.own.shift() / last).powi(2) / (omega * self.flow.signal.duration_s());
        // of what drag makes of the frequency the equivalent linear damper tells only the order
        let of_drag = 0.25 * ((viscous + drag).powi(2) - viscous.powi(2)) / omega.powi(2);
        next.hypot(of_friction).hypot(of_drag)
    }

    fn modulated(&self) -> Option<Modulated> {
        let turn = std::f64::consts::TAU;
        let f0_hz = self.estimate(self.own.omega_rad_s / turn, [1.0 / turn, 0.0, 0.0, 0.0, 0.0]);
        let k = self.estimate(self.own.k, [0.0, 1.0, 0.0, 0.0, 0.0]);
        let [seen_k, seen_sd] = self.seen_k;
        let trend = self.trend();
        let (large, small) = (self.damping_ratio(1.0), self.damping_ratio(self.last));
        let modulated = Modulated {
            frequency: FrequencyLaw {
                f0_hz: f0_hz.blurred(self.left_out() * f0_hz.value),
                kappa_per_rad2: k.times(self.amplitude_rad.powi(-2)),
                p_constant: f_tail((seen_k / seen_sd).powi(2), 1.0, self.flow.degrees_of_freedom()),
                p_value: self.p_value,
            },
            damping_ratio: match trend {
                None => small.blurred(self.of_linear_damper()),
                Some(Trend::LeastBetween) => {
                    let least = self.damping_ratio(self.least_at());
                    large.widened_to_cover(small.low, small.high).widened_to_cover(least.low, least.high)
                }
                Some(_) => large.widened_to_cover(small.low, small.high),
            },
            trend,
            noise_rad: self.flow.noise_rad.clone(),
            drift_terms: self.flow.drift_terms,
        };
        let law = &modulated.frequency;
        let numbers = [&law.f0_hz, &law.kappa_per_rad2, &modulated.damping_ratio];
        numbers.iter().all(|number| number.sd.is_finite() && number.value.is_finite()).then_some(modulated)
    }
}

#[cfg(test)]
mod tests {
    use super::super::identify;
    use super::super::numerics::runge_kutta;
    use super::*;
    use crate::series::AngleSeries;

    const F0_HZ: f64 = 0.8;

    /// So many cycles of a pendulum, 60 values per second, with these losses of the angular acceleration, and no noise but that of four digits.
    fn swing(cycles: f64, amplitude_rad: f64, loss: impl Fn(f64) -> f64) -> AngleSeries {
        let omega = std::f64::consts::TAU * F0_HZ;
        let slope = |[theta, rate]: [f64; 2]| [rate, -omega * omega * theta.sin() - loss(rate)];
        let (steps, dt) = (200, 1.0 / 60.0);
        let h = dt / f64::from(steps);
        let mut y = [amplitude_rad, 0.0];
        let mut rows = Vec::new();
        for k in 0..(cycles / F0_HZ / dt) as usize {
            rows.push((k as f64 * dt, (1e4 * y[0]).round() / 1e4));
            for _ in 0..steps {
                y = runge_kutta(y, h, slope);
            }
        }
        let text: String = rows.iter().map(|(t, theta)| format!("{t},{theta}\n")).collect();
        AngleSeries::parse(format!("t_s,theta1_rad\n{text}").as_bytes(), "swing.csv".as_ref()).unwrap()
    }

    #[test]
    fn ten_cycles_tell_the_frequency_at_small_amplitude() {
        type Case = (&'static str, fn(f64) -> f64, Option<Trend>);
        let losses: [Case; 3] = [
            ("viscous", |v| 0.04 * v, None),
            ("drag", |v| 0.01 * v + 0.05 * v * v.abs(), Some(Trend::GrowsWithAmplitude)),
            ("friction", |v| 0.02 * v + 0.05 * (v / 1e-3).tanh(), Some(Trend::FallsWithAmplitude)),
        ];
        for (name, loss, trend) in losses {
            for amplitude_rad in [0.1, 0.4, 0.8] {
                let found = identify(&swing(10.0, amplitude_rad, loss), None).unwrap();
                let mode = &found.modes[0];
                let (f, case) = (mode.frequency_hz, format!("{name}, {amplitude_rad} rad: {found}"));
                assert!(mode.modulated.is_some() && mode.frequency_at_amplitude_rad.is_none(), "{case}");
                assert!(f.holds(F0_HZ) && f.half() < 2e-3 * F0_HZ, "{case}");
                if amplitude_rad == 0.4 {
                    assert_eq!(mode.damping_trend, trend, "{case}");
                }
            }
        }
    }

    #[test]
    fn a_wide_swing_has_a_drift_only_where_its_resting_angle_does() {
        for (cycles, amplitude_rad) in [(5.0, 0.5), (7.0, 0.8), (7.0, 1.1), (12.0, 0.8)] {
            let still = swing(cycles, amplitude_rad, |v| 0.01 * v + 0.02 * v * v.abs());
            let found = identify(&still, None).unwrap();
            assert_eq!(found.drift_rad, [0.0], "{found}");
            // it ends as wide as 17°, or wider
            assert!(!found.summary.contains("small amplitude"), "{}", found.summary);
            let mut moved = still.clone();
            let of_row = moved.t_s.iter().zip(moved.theta_rad[0].iter_mut().flatten());
            of_row.for_each(|(t, theta)| *theta += 0.01 * t);
            let found = identify(&moved, None).unwrap();
            let went_rad = 0.01 * still.t_s.last().unwrap();
            assert!((found.drift_rad[0] / went_rad - 1.0).abs() < 0.2, "{went_rad}: {found}");
        }
    }

    #[test]
    fn sixty_cycles_of_a_viscous_swing_have_one_damping_ratio_and_that_of_drag_and_friction_its_least() {
        let omega = std::f64::consts::TAU * F0_HZ;
        let viscous = identify(&swing(60.0, 0.4, |v| 0.02 * v), None).unwrap();
        let mode = &viscous.modes[0];
        assert!(mode.frequency_hz.holds(F0_HZ) && mode.frequency_hz.half() < 1e-4 * F0_HZ, "{viscous}");
        assert!(mode.damping.estimate().unwrap().holds(0.01 / omega) && mode.damping_trend.is_none(), "{viscous}");
        let (drag, dry) = (0.08, 0.03);
        let both = identify(&swing(25.0, 0.4, |v| drag * v * v.abs() + dry * (v / 1e-3).tanh()), None).unwrap();
        let mode = &both.modes[0];
        assert_eq!(mode.damping_trend, Some(Trend::LeastBetween), "{both}");
        // of drag 4qA/3π, of friction 2d/πω²A: least where they are alike
        let pi = std::f64::consts::PI;
        let least = 2.0 * (4.0 * drag / (3.0 * pi) * 2.0 * dry / (pi * omega * omega)).sqrt();
        let told = mode.damping.estimate().unwrap();
        assert!((told.low / least - 1.0).abs() < 0.05, "{least}: {both}");
    }

    #[test]
    fn errors_that_go_with_the_swing_widen_what_they_do_not_outweigh() {
        let omega = std::f64::consts::TAU * F0_HZ;
        // a wave a tenth off the swing's frequency, beside noise of half a milliradian
        let with_errors = |size_rad: f64| {
            let mut seed = 1u64;
            let mut uniform = || {
                seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                (seed >> 11) as f64 / (1u64 << 53) as f64 - 0.5
            };
            let mut made = swing(30.0, 0.3, |v| 0.02 * v);
            for (t, theta) in made.t_s.iter().zip(made.theta_rad[0].iter_mut().flatten()) {
                let noise_rad = 5e-4 * (0..12).map(|_| uniform()).sum::<f64>();
                *theta += noise_rad + size_rad * (1.1 * omega * t).cos();
            }
            identify(&made, None).unwrap().modes[0].clone()
        };
        let [plain, slight, strong] = [0.0, 1.5e-4, 3e-3].map(with_errors);
        let told = |mode: &super::super::Mode| mode.modulated.clone().map(|own| own.frequency.f0_hz);
        let (plain, slight) = (told(&plain).unwrap(), told(&slight).unwrap());
        assert!(slight.half() > 1.2 * plain.half() && slight.half() < 5.0 * plain.half(), "{plain:?} {slight:?}");
        assert!(slight.holds(F0_HZ), "{slight:?}");
        assert!(told(&strong).is_none(), "{strong:?}");
    }

    #[test]
    fn a_swing_that_friction_stops_at_once_has_no_slow_flow() {
        let found = identify(&swing(10.0, 0.05, |v| 0.15 * (v / 1e-3).tanh()), None).unwrap();
        assert!(found.modes.iter().all(|mode| mode.modulated.is_none()), "{found}");
    }
}
