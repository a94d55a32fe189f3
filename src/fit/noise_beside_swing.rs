//! Noise that is correlated from row to row, as the residual of a fit shows it.
//!
//! Neighbouring rows show the noise of high frequencies ([`crate::series::noise`]). Noise that is correlated is stronger at the swing's pace. A misfit is in step with
//! the swing: it lies at multiples of its frequency. So the power density between those multiples is the noise's,
//!
//! ```text
//! P(f) = |Σ w r exp(−2πift)|² / Σ w²,   σ² = median P / ln 2        in white noise of variance σ² P is exponential of mean σ²
//! ```
//!
//! with Hann's window w, so that a misfit does not spread to where it is not.

use std::f64::consts::{LN_2, TAU};

use nalgebra::Complex;

use super::Residual;
use crate::statistics::median;

/// Multiples of the swing's frequency up to which it is looked at (judgement: the modes and their harmonics).
const MULTIPLES: f64 = 4.0;
/// Distance from a multiple, of the swing's frequency.
const BESIDE: f64 = 0.25;
/// A median of fewer lines says little (statistics: to a third).
const FEWEST_LINES: usize = 12;
/// So many times what neighbours show it is at most: of a correlation of 0.6 from one row to the next (statistics). A bad fit cannot excuse itself by more.
const MOST: f64 = 2.0;

/// Standard deviation of the noise, in windows of about one swing, of an angle whose neighbours show so much.
pub fn noise_beside_swing(values: &[Residual], of_neighbours_rad: f64, swing_s: f64) -> f64 {
    let [Some(first), Some(last)] = [values.first(), values.last()] else { return of_neighbours_rad };
    let (span_s, n) = (last.t_s - first.t_s, values.len() as f64);
    let hann = |r: &Residual| 1.0 - (TAU * (r.t_s - first.t_s) / span_s).cos();
    let weighed: Vec<(f64, f64)> = values.iter().map(|r| (r.t_s, hann(r) * r.left_rad())).collect();
    let squares: f64 = values.iter().map(|r| hann(r).powi(2)).sum();
    let highest_hz = (MULTIPLES / swing_s).min(0.5 * n / span_s);
    let is_beside = |hz: &f64| {
        let multiples = hz * swing_s;
        (multiples - multiples.round()).abs() > BESIDE
    };
    let lines = (1..).map(|k| f64::from(k) / span_s).take_while(|hz| *hz < highest_hz).filter(is_beside);
    let power = |hz: f64| {
        let turned = weighed.iter().map(|(t_s, left_rad)| Complex::from_polar(*left_rad, -TAU * hz * t_s));
        turned.sum::<Complex<f64>>().norm_sqr() / squares
    };
    let mut powers: Vec<f64> = lines.map(power).collect();
    if powers.len() < FEWEST_LINES {
        return of_neighbours_rad;
    }
    let beside_rad = (median(&mut powers).unwrap_or(0.0) / LN_2).sqrt();
    beside_rad.max(of_neighbours_rad).min(MOST * of_neighbours_rad)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_distr::{Distribution, StandardNormal};

    /// Forty swings of a second at 60 Hz, what is left being noise of this correlation and a misfit in step with the swing.
    fn left(correlation: f64, misfit_rad: f64, seed: u64) -> Vec<Residual> {
        let mut random = rand::rngs::StdRng::seed_from_u64(seed);
        let mut noise = random.random_range(-1e-3..1e-3);
        let value = |row: u32| {
            let t_s = f64::from(row) / 60.0;
            let fresh: f64 = StandardNormal.sample(&mut random);
            noise = correlation * noise + 1e-3 * (1.0 - correlation * correlation).sqrt() * fresh;
            let measured_rad = noise + misfit_rad * (TAU * t_s).sin() * (1.0 - t_s / 40.0);
            Residual { t_s, measured_rad, predicted_rad: 0.0, rate_rad_s: 0.0 }
        };
        (0..2400).map(value).collect()
    }

    #[test]
    fn correlated_noise_is_seen_between_the_swing_s_multiples_and_a_misfit_is_not() {
        for seed in 0..4 {
            let white = noise_beside_swing(&left(0.0, 0.0, seed), 1e-3, 1.0);
            assert!((white / 1e-3 - 1.0).abs() < 0.25, "{white}");
            // (1 + ρ)/(1 − ρ) times the variance at low frequencies
            let coloured = noise_beside_swing(&left(0.4, 0.0, seed), 0.65e-3, 1.0);
            assert!(coloured > 1.1e-3 && coloured <= 1.3e-3, "{coloured}");
            let misfit = noise_beside_swing(&left(0.0, 20e-3, seed), 1e-3, 1.0);
            assert!((misfit / 1e-3 - 1.0).abs() < 0.3, "{misfit}");
        }
    }

    #[test]
    fn few_swings_say_nothing() {
        assert_eq!(noise_beside_swing(&left(0.6, 0.0, 1)[..180], 1e-4, 1.0), 1e-4);
        assert_eq!(noise_beside_swing(&[], 1e-4, 1.0), 1e-4);
    }
}
