//! The noise of a recording, of each angle from its values alone ([`crate::series::noise`]), and of tracked ones at least what the tracker states.

use super::Record;
use crate::series::noise::{LEAST_RAD, least_rad, of_angle};

/// Standard deviation of each angle's noise.
pub fn noise_rad(record: &Record) -> Vec<f64> {
    let of = |(link, angles): (usize, &Vec<Option<f64>>)| of_angle(&record.t_s, angles).max(stated_rad(record, link));
    record.theta_rad.iter().enumerate().map(of).collect()
}

/// The least that the noise of an angle can be, by all pieces of its recording: one of them may be at rest.
pub fn least_noise_rad(records: &[Record], record: usize, link: usize) -> f64 {
    let pieces = records.iter().filter(|piece| piece.path == records[record].path);
    pieces.map(|piece| least_rad(&piece.theta_rad[link]).max(stated_rad(piece, link))).fold(LEAST_RAD, f64::max)
}

fn stated_rad(record: &Record, link: usize) -> f64 {
    record.stated_rad.get(link).copied().unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_distr::{Distribution, StandardNormal};

    const NOISE_RAD: f64 = 1e-3;

    /// Two modes, the second near a third of the rate, whose frequency falls with amplitude.
    fn swing(t_s: f64) -> f64 {
        let decayed = (-0.05 * t_s).exp();
        0.5 * decayed * (8.5 * t_s * (1.0 + 0.005 * decayed)).cos() + 0.1 * (-0.1 * t_s).exp() * (60.0 * t_s).cos()
    }

    fn record(t_s: Vec<f64>, seed: u64) -> Record {
        let mut random = rand::rngs::StdRng::seed_from_u64(seed);
        let noisy = |t: &f64| {
            let noise: f64 = StandardNormal.sample(&mut random);
            Some(swing(*t) + NOISE_RAD * noise)
        };
        let theta_rad = vec![t_s.iter().map(noisy).collect()];
        Record::uniform("swing", t_s, theta_rad)
    }

    fn is_noise(record: &Record, tolerance: f64) {
        let found = noise_rad(record)[0];
        assert!((found / NOISE_RAD - 1.0).abs() < tolerance, "{found}");
    }

    #[test]
    fn a_fast_second_mode_is_not_taken_for_noise() {
        for seed in 0..4 {
            // the least of several estimates of 600 values lies some per cent low
            is_noise(&record((0..600).map(|i| f64::from(i) / 30.0).collect(), seed), 0.13);
        }
    }

    #[test]
    fn tracked_angles_have_at_least_the_noise_that_is_stated() {
        let tracked = |stated: f64| Record {
            stated_rad: vec![stated],
            ..record((0..600).map(|i| f64::from(i) / 30.0).collect(), 7)
        };
        assert_eq!(noise_rad(&tracked(2e-3)), [2e-3]);
        is_noise(&tracked(1e-5), 0.13);
        assert_eq!(least_noise_rad(&[tracked(2e-3)], 0, 0), 2e-3);
    }

    #[test]
    fn outliers_and_gaps_are_not_either() {
        let mut record = record((0..900).map(|i| f64::from(i) / 30.0).collect(), 5);
        for row in [40, 41, 333, 512] {
            record.theta_rad[0][row] = Some(1.5);
        }
        record.theta_rad[0][200..290].fill(None);
        is_noise(&record, 0.15);
    }

    #[test]
    fn stamps_that_jitter_are_no_noise_where_they_are_true() {
        let mut random = rand::rngs::StdRng::seed_from_u64(9);
        let t_s = (0..1200).map(|i| f64::from(i) / 120.0 + 0.003 * random.random_range(-1.0..1.0)).collect();
        is_noise(&record(t_s, 6), 0.15);
    }

    #[test]
    fn an_encoder_that_rests_still_has_its_steps() {
        let step_rad = 2e-3;
        let stepped = |t: &f64| Some((swing(*t) * (1.0 - t / 10.0).max(0.0) / step_rad).round() * step_rad);
        let mut record = record((0..1800).map(|i| f64::from(i) / 30.0).collect(), 0);
        record.theta_rad[0] = record.t_s.iter().map(stepped).collect();
        let found = noise_rad(&record)[0];
        assert!((found / step_rad * 12f64.sqrt() - 1.0).abs() < 0.2, "{found}");
    }

    #[test]
    fn a_table_without_noise_has_hardly_any() {
        let mut record = record((0..600).map(|i| f64::from(i) / 30.0).collect(), 0);
        record.theta_rad[0] = record.t_s.iter().map(|t| Some(swing(*t))).collect();
        assert!(noise_rad(&record)[0] < 1e-5);
    }
}
