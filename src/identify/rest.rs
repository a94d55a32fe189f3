//! An end in which nothing swings any more.
//!
//! A recording that goes on long after the swing has died away, or after friction has stopped it, has a spectrum of noise. What precedes the rest is used. It is
//! a rest where the last fifth of the record is white noise, or one and the same value: the mean square of successive differences is then twice the variance
//! (von Neumann, Ann. Math. Stat. 12 (1941) 367), and next to nothing for an oscillation.

use super::signal::{LinkSamples, Signal};
use crate::statistics::median;

/// Part of the record that shows whether it ends at rest.
const LAST: f64 = 0.2;
/// Half the mean square of successive differences over the variance, at least: 1 of white noise; π²/n² per cycle of an oscillation of n values.
const WHITE: f64 = 0.6;
/// Standard deviations of the noise beyond which two values in a row are a motion (statistics).
const MOVES: f64 = 4.5;
/// A rest shorter than this part of the record does no harm.
const SHORTEST: f64 = 0.2;
/// Fewest values that show a rest.
const FEWEST: usize = 20;

/// When a recording's last motion ends, where a rest follows.
pub(super) fn rests_from_s(signal: &Signal) -> Option<f64> {
    let ends: Option<Vec<f64>> = signal.links.iter().map(|link| last_motion_s(link, signal.span_s)).collect();
    let end_s = ends?.into_iter().fold(f64::NEG_INFINITY, f64::max);
    (end_s.is_finite() && signal.span_s[1] - end_s > SHORTEST * signal.duration_s()).then_some(end_s)
}

/// Of one link; `None` where it does not end at rest.
fn last_motion_s(link: &LinkSamples, [from_s, until_s]: [f64; 2]) -> Option<f64> {
    let first = link.t_s.partition_point(|t| *t < until_s - LAST * (until_s - from_s));
    let last = &link.theta_rad[first..];
    if last.len() < FEWEST {
        return None;
    }
    let mean = last.iter().sum::<f64>() / last.len() as f64;
    let variance = last.iter().map(|a| (a - mean).powi(2)).sum::<f64>() / last.len() as f64;
    let successive = last.windows(2).map(|pair| (pair[1] - pair[0]).powi(2)).sum::<f64>() / (last.len() - 1) as f64;
    if successive < 2.0 * WHITE * variance {
        return None;
    }
    let rest_rad = median(&mut last.to_vec())?;
    // a last digit that does not change has no noise
    let noise_rad = variance.sqrt().max(1e-4 * link.range_rad());
    let moves = |a: &f64| (a - rest_rad).abs() > MOVES * noise_rad;
    let place = link.theta_rad.windows(2).rposition(|pair| pair.iter().all(moves))? + 1;
    Some(link.t_s[place])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn signal(value: impl Fn(f64) -> f64) -> Signal {
        let noise = |k: u32| 2e-6 * (f64::from(k * k) * 0.754_877).fract() * 1e3 - 1e-3;
        let t_s: Vec<f64> = (0..1500).map(|k| f64::from(k) / 30.0).collect();
        let theta_rad = (0..1500).zip(&t_s).map(|(k, t)| value(*t) + noise(k)).collect();
        Signal { span_s: [0.0, t_s[1499]], links: vec![LinkSamples { t_s, theta_rad }], step_s: 1.0 / 30.0 }
    }

    #[test]
    fn a_swing_that_is_over_is_followed_by_a_rest() {
        // friction takes the amplitude evenly
        let stopped = signal(|t| (0.1 - 0.01 * t).max(0.0) * (6.0 * t).cos());
        assert!((9.0..10.1).contains(&rests_from_s(&stopped).unwrap()));
        let died = signal(|t| 0.1 * (-0.4 * t).exp() * (6.0 * t).cos());
        assert!((8.0..12.0).contains(&rests_from_s(&died).unwrap()));
    }

    #[test]
    fn a_swing_that_goes_on_has_no_rest() {
        for decay in [0.0, 0.01, 0.1] {
            assert_eq!(rests_from_s(&signal(|t| 0.1 * f64::exp(-decay * t) * (6.0 * t).cos())), None);
        }
        // nothing swings at all
        assert_eq!(rests_from_s(&signal(|_| 0.0)), None);
    }
}
