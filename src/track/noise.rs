//! How much a measured track really scatters, from the track alone.
//!
//! The p-th difference of evenly sampled positions suppresses a motion of frequency f by (2 sin π f Δt)^p, so for
//! high p only the errors remain; divided by the standard deviation that the stated variances give it, it should
//! have unit scale. Where it has scale κ, the stated standard deviations are multiplied by κ.

use super::Measured;

/// Orders that are tried; the least result counts, for motion can only add to it.
const ORDERS: [usize; 3] = [6, 8, 10];
/// Windows below which nothing is concluded.
const LEAST_WINDOWS: usize = 60;

/// κ along one axis (0: x, 1: y), or `None` where the track is too short or too uneven.
pub fn scatter_factor(points: &[Option<Measured>], t_s: &[f64], axis: usize) -> Option<f64> {
    ORDERS.iter().filter_map(|order| factor_of_order(points, t_s, axis, *order)).min_by(f64::total_cmp)
}

fn factor_of_order(points: &[Option<Measured>], t_s: &[f64], axis: usize, order: usize) -> Option<f64> {
    let step = median_step(t_s)?;
    let weights = binomial(order);
    let mut scores: Vec<f64> = Vec::new();
    for start in 0..points.len().saturating_sub(order) {
        let stamps = &t_s[start..=start + order];
        if stamps.windows(2).any(|w| (w[1] - w[0] - step).abs() > 0.02 * step) {
            continue;
        }
        let window: Option<Vec<&Measured>> = points[start..=start + order].iter().map(Option::as_ref).collect();
        let Some(window) = window else { continue };
        let (mut difference, mut variance) = (0.0, 0.0);
        for (weight, point) in weights.iter().zip(window) {
            difference += weight * point.position_px[axis];
            variance += weight * weight * point.covariance_px2[axis];
        }
        if variance > 0.0 {
            scores.push(difference.abs() / variance.sqrt());
        }
    }
    if scores.len() < LEAST_WINDOWS {
        return None;
    }
    let middle = scores.len() / 2;
    let (_, median, _) = scores.select_nth_unstable_by(middle, f64::total_cmp);
    Some(*median / 0.6745)
}

fn median_step(t_s: &[f64]) -> Option<f64> {
    let mut steps: Vec<f64> = t_s.windows(2).map(|w| w[1] - w[0]).collect();
    if steps.is_empty() {
        return None;
    }
    let middle = steps.len() / 2;
    let (_, median, _) = steps.select_nth_unstable_by(middle, f64::total_cmp);
    (*median > 0.0).then_some(*median)
}

/// Alternating binomial coefficients.
fn binomial(order: usize) -> Vec<f64> {
    let mut row = vec![1.0];
    for _ in 0..order {
        let mut next = vec![1.0];
        next.extend(row.windows(2).map(|w: &[f64]| w[1] - w[0]));
        next.push(-row[row.len() - 1]);
        row = next;
    }
    row
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn binomial_weights_annihilate_polynomials() {
        let weights = binomial(6);
        assert_eq!(weights.len(), 7);
        for power in 0..6 {
            let sum: f64 = weights.iter().enumerate().map(|(i, w)| w * (i as f64).powi(power)).sum();
            assert!(sum.abs() < 1e-9, "power {power}: {sum}");
        }
    }

    #[test]
    fn a_swing_with_known_scatter_gives_it_back() {
        // a linear congruential generator: twelve uniform numbers make one nearly normal one
        let mut seed = 1u64;
        let mut uniform = || {
            seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (seed >> 11) as f64 / (1u64 << 53) as f64
        };
        let t_s: Vec<f64> = (0..900).map(|i| i as f64 / 30.0).collect();
        let points: Vec<Option<Measured>> = t_s
            .iter()
            .map(|t| {
                let swing = 200.0 * (8.5 * t).sin() + 20.0 * (22.6 * t).cos();
                let error: f64 = 0.04 * ((0..12).map(|_| uniform()).sum::<f64>() - 6.0);
                Some(Measured {
                    position_px: [swing + error, 0.0],
                    covariance_px2: [0.02f64.powi(2), 1.0, 0.0],
                    area_px2: 1.0,
                })
            })
            .collect();
        let factor = scatter_factor(&points, &t_s, 0).unwrap();
        assert!((factor - 2.0).abs() < 0.25, "{factor}");
    }
}
