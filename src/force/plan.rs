//! What an experiment has to be to see the push.
//!
//! A sensor's noise of sd σ, white at a rate r, is averaged over a time T, half of it lit. The step's sd is then that of the difference of two means, and that of
//! a chopped swing's amplitude the one of a fitted sinusoid:
//!
//! ```text
//! sd(step) = 2σ/√(rT)        sd(amplitude) = σ√(2/(rT))
//! ```
//!
//! After each switch the swing has to die away, and a chopped one to build up, before anything is learnt: a step takes two such times, one on and one off, beside T, and
//! chopping one, and a period at least. Drift and heat come on top: this is the least that is needed.

use serde::Serialize;

use super::{Response, Setup};
use crate::error::{Error, Result};
use crate::identify::estimate::NORMAL_QUANTILE;

/// What is wanted, and what there is to measure with.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wanted {
    /// Half the 95 % interval of the push, over the push.
    pub relative: f64,
    /// σ of one sample.
    pub noise_m: f64,
    /// r.
    pub rate_hz: f64,
    /// T.
    pub time_s: f64,
    /// ξ of the first mode.
    pub damping_ratio: f64,
}

/// One way to light the strip.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Way {
    /// What the push moves the point by: the step, or the amplitude.
    pub push_m: f64,
    /// What heat moves it by over what the push does.
    pub heat_over_push: f64,
    /// Half the 95 % interval at this power, after averaging over the time, over the push.
    pub relative_interval: f64,
    /// Least power for the wanted interval in the time (W).
    pub smallest_power_w: f64,
    /// Least time for the wanted interval at the power, with what nothing is learnt in (s).
    pub shortest_time_s: f64,
    /// The time after a switch that nothing is learnt in: until the swing has built up or died away to a tenth (s).
    pub settling_s: f64,
}

/// Long on and off, against chopping at the strip's own frequency.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Plan {
    schema: &'static str,
    /// P.
    pub power_w: f64,
    /// d.
    pub distance_m: f64,
    /// Wanted: half the 95 % interval, over the push.
    pub wanted_relative_interval: f64,
    /// σ of one sample.
    pub noise_m: f64,
    /// r.
    pub rate_hz: f64,
    /// T.
    pub time_s: f64,
    /// ξ.
    pub damping_ratio: f64,
    /// f of the first mode.
    pub first_mode_hz: f64,
    /// Lamp on for long, off for long.
    pub steps: Way,
    /// Lamp chopped at the first mode's frequency.
    pub chopped: Way,
    /// Signal over noise of chopping over that of steps, in the same time.
    pub gain: f64,
}

impl Plan {
    /// Reckons both.
    ///
    /// # Errors
    /// [`Error::Option`] for a wish that is none; [`Error::Missing`], [`Error::Simulation`].
    pub fn of(setup: &Setup, wanted: Wanted) -> Result<Self> {
        for (option, value) in [
            ("--interval", wanted.relative),
            ("--noise-m", wanted.noise_m),
            ("--rate-hz", wanted.rate_hz),
            ("--time-s", wanted.time_s),
            ("--damping-ratio", wanted.damping_ratio),
        ] {
            if !(value.is_finite() && value > 0.0) {
                return Err(Error::Option {
                    option: option.to_owned(),
                    message: format!("{value} is not above 0; give a positive number"),
                });
            }
        }
        let (power_w, distance_m) = setup.main()?;
        if power_w == 0.0 {
            return Err(Error::Missing { detail: "light.power_w = 0: without light there is nothing to plan".into() });
        }
        let response = Response::of(setup, power_w, distance_m, wanted.damping_ratio)?;
        let settling_s = 10f64.ln() / (wanted.damping_ratio * std::f64::consts::TAU * response.first_mode_hz());
        let way = |[push_m, heat_m]: [f64; 2], noise_factor: f64, settlings: f64, least_s: f64| {
            let per_root_s_m = NORMAL_QUANTILE * noise_factor * wanted.noise_m / wanted.rate_hz.sqrt();
            let push_m = push_m.abs();
            let relative_interval = per_root_s_m / wanted.time_s.sqrt() / push_m;
            Way {
                push_m,
                heat_over_push: heat_m / push_m,
                relative_interval,
                smallest_power_w: power_w * relative_interval / wanted.relative,
                shortest_time_s: settlings * settling_s
                    + (per_root_s_m / (push_m * wanted.relative)).powi(2).max(least_s),
                settling_s,
            }
        };
        let steps = way(response.still_m(), 2.0, 2.0, 0.0);
        let chopped =
            way(response.chopped_m(response.first_mode_hz()), 2f64.sqrt(), 1.0, 1.0 / response.first_mode_hz());
        Ok(Self {
            schema: "freeswing.force_plan/1",
            power_w,
            distance_m,
            wanted_relative_interval: wanted.relative,
            noise_m: wanted.noise_m,
            rate_hz: wanted.rate_hz,
            time_s: wanted.time_s,
            damping_ratio: wanted.damping_ratio,
            first_mode_hz: response.first_mode_hz(),
            gain: steps.relative_interval / chopped.relative_interval,
            steps,
            chopped,
        })
    }
}
