//! An end in which nothing swings any more.
//!
//! A recording that goes on long after the swing has died away, or after friction has stopped it, has a spectrum of noise. What precedes the rest is used. It is
//! a rest where the last fifth of the record is white noise, by its autocorrelations ρ, or scatters no more than the table's own standard deviation: a codec
//! keeps what stands still from picture to picture, and its errors are not white.
//!
//! ```text
//! Q = n Σₖ ρₖ²,   k = 1 … m,   χ² of m degrees of freedom of white noise   (Box and Pierce, J. Am. Stat. Assoc. 65 (1970) 1509)
//! ```

use super::estimate::chi_squared_tail;
use super::signal::{LinkSamples, Signal};
use crate::statistics::median;

/// Part of the record that shows whether it ends at rest.
const LAST: f64 = 0.2;
/// Autocorrelations that noise makes in fewer records are a motion's (statistics).
const LEAST_P: f64 = 1e-3;
/// Lags at most: some cycles of all that is sampled well.
const MOST_LAGS: usize = 60;
/// A scatter below this part of the whole range is the rounding of one and the same value.
const CONSTANT: f64 = 1e-9;
/// Standard deviations of the noise beyond which two values in a row are a motion (statistics).
const MOVES: f64 = 4.5;
/// A rest shorter than this part of the record does no harm.
const SHORTEST: f64 = 0.2;
/// Fewest values that show a rest.
const FEWEST: usize = 20;

/// When a recording's last motion ends, where a rest follows; `stated_rad` is the standard deviation of a value of each link, where the table has one.
pub(super) fn rests_from_s(signal: &Signal, stated_rad: &[Option<f64>]) -> Option<f64> {
    let stated = |link: usize| stated_rad.get(link).copied().flatten().unwrap_or(0.0);
    let end = |(number, link): (usize, &LinkSamples)| last_motion_s(link, signal.span_s, stated(number));
    let ends: Option<Vec<f64>> = signal.links.iter().enumerate().map(end).collect();
    let end_s = ends?.into_iter().fold(f64::NEG_INFINITY, f64::max);
    (end_s.is_finite() && signal.span_s[1] - end_s > SHORTEST * signal.duration_s()).then_some(end_s)
}

/// Of one link; `None` where it does not end at rest.
fn last_motion_s(link: &LinkSamples, [from_s, until_s]: [f64; 2], stated_rad: f64) -> Option<f64> {
    let first = link.t_s.partition_point(|t| *t < until_s - LAST * (until_s - from_s));
    let last = &link.theta_rad[first..];
    if last.len() < FEWEST {
        return None;
    }
    let mean = last.iter().sum::<f64>() / last.len() as f64;
    let variance = last.iter().map(|a| (a - mean).powi(2)).sum::<f64>() / last.len() as f64;
    let is_constant = variance.sqrt() < stated_rad.max(CONSTANT * link.range_rad());
    if !is_constant && !is_white(last, mean, variance) {
        return None;
    }
    let rest_rad = median(&mut last.to_vec())?;
    // a last digit that does not change has no noise
    let noise_rad = variance.sqrt().max(stated_rad).max(1e-4 * link.range_rad());
    let moves = |a: &f64| (a - rest_rad).abs() > MOVES * noise_rad;
    let place = link.theta_rad.windows(2).rposition(|pair| pair.iter().all(moves))? + 1;
    Some(link.t_s[place])
}

fn is_white(values: &[f64], mean: f64, variance: f64) -> bool {
    let (n, lags) = (values.len(), MOST_LAGS.min(values.len() / 4));
    let correlation = |lag: usize| {
        let products = values.iter().zip(&values[lag..]).map(|(a, b)| (a - mean) * (b - mean));
        products.sum::<f64>() / (n as f64 * variance)
    };
    let squares = (1..=lags).map(|lag| correlation(lag).powi(2)).sum::<f64>();
    chi_squared_tail(n as f64 * squares, lags as f64) > LEAST_P
}

#[cfg(test)]
mod tests {
    use rand::rngs::Xoshiro256PlusPlus;
    use rand::{RngExt as _, SeedableRng as _};

    use super::*;

    fn signal(value: impl Fn(f64) -> f64) -> Signal {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(7);
        let t_s: Vec<f64> = (0..1500).map(|k| f64::from(k) / 30.0).collect();
        let theta_rad = t_s.iter().map(|t| value(*t) + rng.random_range(-1e-3..1e-3)).collect();
        Signal { span_s: [0.0, t_s[1499]], links: vec![LinkSamples { t_s, theta_rad }], step_s: 1.0 / 30.0 }
    }

    #[test]
    fn a_swing_that_is_over_is_followed_by_a_rest() {
        // friction takes the amplitude evenly
        let stopped = signal(|t| (0.1 - 0.01 * t).max(0.0) * (6.0 * t).cos());
        assert!((9.0..10.1).contains(&rests_from_s(&stopped, &[]).unwrap()));
        let died = signal(|t| 0.1 * (-0.4 * t).exp() * (6.0 * t).cos());
        assert!((8.0..12.0).contains(&rests_from_s(&died, &[]).unwrap()));
    }

    #[test]
    fn a_rest_of_errors_that_last_is_known_by_the_table_s_own_standard_deviation() {
        // friction stops the swing, and the codec keeps what stands for half a second
        let kept = |t: f64| 3e-4 * (7.0 * (2.0 * t).floor()).sin();
        let mut stopped = signal(|t| (0.1 - 0.01 * t).max(0.0) * (6.0 * t).cos());
        let link = &mut stopped.links[0];
        link.theta_rad.iter_mut().zip(&link.t_s).for_each(|(a, t)| *a += kept(*t) * 10.0);
        assert_eq!(rests_from_s(&stopped, &[None]), None);
        assert!((8.0..10.5).contains(&rests_from_s(&stopped, &[Some(3e-3)]).unwrap()));
        // what still swings is no rest
        assert_eq!(rests_from_s(&signal(|t| 0.1 * f64::exp(-0.01 * t) * f64::cos(6.0 * t)), &[Some(3e-3)]), None);
    }

    #[test]
    fn a_swing_that_goes_on_has_no_rest() {
        for (decay, rate) in [(0.0, 6.0), (0.01, 6.0), (0.1, 6.0), (0.02, 36.0), (0.1, 45.0)] {
            assert_eq!(rests_from_s(&signal(|t| 0.1 * f64::exp(-decay * t) * f64::cos(rate * t)), &[]), None);
        }
        // nothing swings at all
        assert_eq!(rests_from_s(&signal(|_| 0.0), &[]), None);
    }
}
