//! How much a measured track really scatters, from the track alone.
//!
//! The p-th difference of evenly sampled positions suppresses a motion of frequency f by (2 sin π f Δt)^p, so for
//! high p only the errors remain; divided by the standard deviation that the stated variances give it, it should
//! have unit scale. Where it has scale κ, the stated standard deviations are multiplied by κ.
//!
//! A codec moves a mark by whole quarter pixels and codes what is left only where it is large, so a moving mark
//! scatters far more than its noise says; without loss it scatters less. At rest the picture is coded once and repeated:
//! the error does not show as scatter; nor does it along an axis on which the mark hardly moves, where it is the same for
//! many frames. The two states therefore have a factor each, along each axis, that of motion by speed: what lies behind a fast mark is new to the codec, and the
//! less of it shows in the picture that noise is told from. A mark at rest is never believed to be better than its own scatter or than [`REST_SHARE`] of what the moving
//! marks show, nor better than stated where nothing moves.

use super::{Flags, Measured};
use crate::statistics::{median, median_step_s};

/// Orders that are tried; the least result counts, for motion can only add to it. The height of a tip that swings at an
/// eighth of the frame rate moves at a quarter of it, which order 12 still lets through where the codec loses nothing.
const ORDERS: [usize; 6] = [6, 8, 10, 12, 16, 20];
/// Windows below which nothing is concluded.
const LEAST_WINDOWS: usize = 50;
/// Classes of speed, each judged alone.
const SPEED_CLASSES: usize = 3;
/// px a frame from which a mark counts as moving.
const MOVING_PX: f64 = 0.5;
/// What neighbouring errors have in common, which differences do not see, and the choice of the least result (training: the 46 foreign renderings, of whose intervals
/// 95 % hold in the mean and in the median of the moving marks).
const UNSEEN: f64 = 1.35;
/// Error at rest over error in motion. On foreign renderings 0.1 to 0.5 where a picture is predicted from the last, 1 where
/// each is coded alone.
const REST_SHARE: f64 = 0.9;

/// Factors (x, y) on the stated standard deviation of a mark.
#[derive(Debug, Clone, PartialEq)]
pub struct Scatter {
    /// At rest.
    pub resting: [f64; 2],
    /// In motion.
    pub moving: [Moving; 2],
}

impl Scatter {
    /// On the variance along one axis at a speed, between rest and motion.
    pub fn variance_factor(&self, speed_px: f64, axis: usize) -> f64 {
        let motion = (speed_px / MOVING_PX).min(1.0);
        (1.0 - motion) * self.resting[axis].powi(2) + motion * self.moving[axis].at(speed_px).powi(2)
    }
}

/// The factor in motion along one axis.
#[derive(Debug, Clone, PartialEq)]
pub struct Moving {
    /// Classes of speed (px a frame), the slowest first, and their factors.
    classes: Vec<[f64; 2]>,
}

impl Moving {
    /// One factor at any speed.
    fn even(factor: f64) -> Self {
        Self { classes: vec![[0.0, factor]] }
    }

    /// At a speed; between two classes by their middles.
    pub fn at(&self, speed_px: f64) -> f64 {
        let above = self.classes.partition_point(|[speed, _]| *speed <= speed_px);
        let (below, above) = (self.classes.get(above.wrapping_sub(1)), self.classes.get(above));
        match (below, above) {
            (Some([slow, low]), Some([fast, high])) => low + (high - low) * (speed_px - slow) / (fast - slow),
            (Some([_, own]), None) | (None, Some([_, own])) => *own,
            (None, None) => 1.0,
        }
    }

    /// That of the class with the least.
    fn least(&self) -> f64 {
        self.classes.iter().map(|[_, factor]| *factor).fold(f64::INFINITY, f64::min)
    }

    /// The mean of all classes.
    pub fn mean(&self) -> f64 {
        self.classes.iter().map(|[_, factor]| factor).sum::<f64>() / self.classes.len().max(1) as f64
    }
}

/// The factors of all marks; a mark that never moves takes over what the moving ones show.
pub fn scatters(marks: &[Vec<(Option<Measured>, Flags)>], t_s: &[f64]) -> Vec<Scatter> {
    let tracks: Vec<Vec<Option<Measured>>> =
        marks.iter().map(|points| points.iter().map(|(m, _)| *m).collect()).collect();
    let speeds: Vec<[Vec<f64>; 2]> = tracks.iter().map(|t| [0, 1].map(|axis| speeds_along(t, axis))).collect();
    let moving: Vec<[Option<Moving>; 2]> =
        tracks.iter().zip(&speeds).map(|(t, v)| [0, 1].map(|axis| moving_factor(t, &v[axis], t_s, axis))).collect();
    let shown: Vec<f64> = moving.iter().flatten().flatten().map(Moving::least).collect();
    // where nothing moves, nothing tells what a picture that is repeated hides
    let usual = if shown.is_empty() { 1.0 } else { shown.iter().sum::<f64>() / shown.len() as f64 };
    tracks
        .iter()
        .zip(&speeds)
        .zip(moving)
        .map(|((track, speed), moving)| {
            let rest = |axis: usize| resting_factor(track, &speed[axis], t_s, axis).unwrap_or(0.0);
            let least = if shown.is_empty() { 1.0 } else { 0.0 };
            Scatter {
                resting: [0, 1].map(|axis| {
                    let in_motion = moving[axis].as_ref().map_or(usual, Moving::least);
                    rest(axis).max(REST_SHARE * in_motion).max(least)
                }),
                moving: moving.map(|own| own.unwrap_or_else(|| Moving::even(usual))),
            }
        })
        .collect()
}

/// Speed of a track along one axis (0: x, 1: y), px a frame, from its neighbours in time.
pub fn speeds_along(points: &[Option<Measured>], axis: usize) -> Vec<f64> {
    let between = |a: usize, b: usize| -> Option<f64> {
        let (p, q) = (points.get(a)?.as_ref()?, points.get(b)?.as_ref()?);
        Some((q.position_px[axis] - p.position_px[axis]).abs() / (b - a) as f64)
    };
    (0..points.len())
        .map(|i| {
            let before = i.checked_sub(1).and_then(|b| between(b, i));
            let around = i.checked_sub(1).and_then(|b| between(b, i + 1));
            around.or(before).or_else(|| between(i, i + 1)).unwrap_or(0.0)
        })
        .collect()
}

/// κ in motion along one axis (0: x, 1: y), or `None` where the track moves too little or is too uneven.
fn moving_factor(points: &[Option<Measured>], speeds_px: &[f64], t_s: &[f64], axis: usize) -> Option<Moving> {
    let mut classes: Vec<[f64; 2]> = Vec::new();
    for order in ORDERS {
        let mut scores = scores(points, speeds_px, t_s, axis, order);
        scores.retain(|s| s.speed_px >= MOVING_PX);
        scores.sort_by(|a, b| a.speed_px.total_cmp(&b.speed_px));
        let size = (scores.len() / SPEED_CLASSES).max(LEAST_WINDOWS);
        let each = scores.chunks(size).filter(|c| c.len() >= LEAST_WINDOWS).take(SPEED_CLASSES);
        for (index, class) in each.enumerate() {
            let own = [class[class.len() / 2].speed_px, UNSEEN * scale(class)];
            match classes.get_mut(index) {
                Some(least) if own[1] < least[1] => *least = own,
                Some(_) => {}
                None => classes.push(own),
            }
        }
    }
    classes.sort_by(|a, b| a[0].total_cmp(&b[0]));
    (!classes.is_empty()).then_some(Moving { classes })
}

/// κ at rest along one axis, or `None` where the track rests too little.
fn resting_factor(points: &[Option<Measured>], speeds_px: &[f64], t_s: &[f64], axis: usize) -> Option<f64> {
    let mut scores = scores(points, speeds_px, t_s, axis, ORDERS[0]);
    scores.retain(|s| s.speed_px < MOVING_PX);
    (scores.len() >= LEAST_WINDOWS).then(|| scale(&scores))
}

/// One window: its normalised difference and the mean speed.
struct Score {
    size: f64,
    speed_px: f64,
}

/// Normal scale from the median size.
fn scale(scores: &[Score]) -> f64 {
    let mut sizes: Vec<f64> = scores.iter().map(|s| s.size).collect();
    median(&mut sizes).unwrap_or(0.0) / 0.6745
}

fn scores(points: &[Option<Measured>], speeds_px: &[f64], t_s: &[f64], axis: usize, order: usize) -> Vec<Score> {
    let Some(step) = median_step_s(t_s) else { return Vec::new() };
    let weights = binomial(order);
    let mut scores = Vec::new();
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
            let speed_px = speeds_px[start..=start + order].iter().sum::<f64>() / (order + 1) as f64;
            scores.push(Score { size: difference.abs() / variance.sqrt(), speed_px });
        }
    }
    scores
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

    /// A linear congruential generator: twelve uniform numbers make one nearly normal one.
    fn normal_numbers(mut seed: u64) -> impl FnMut() -> f64 {
        let mut uniform = move || {
            seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (seed >> 11) as f64 / (1u64 << 53) as f64
        };
        move || (0..12).map(|_| uniform()).sum::<f64>() - 6.0
    }

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
        let mut normal = normal_numbers(1);
        let t_s: Vec<f64> = (0..900).map(|i| i as f64 / 30.0).collect();
        let points: Vec<Option<Measured>> = t_s
            .iter()
            .map(|t| {
                let swing = 200.0 * (8.5 * t).sin() + 20.0 * (22.6 * t).cos();
                let error = 0.04 * normal();
                Some(Measured {
                    position_px: [swing + error, 0.0],
                    covariance_px2: [0.02f64.powi(2), 1.0, 0.0],
                    area_px2: 1.0,
                })
            })
            .collect();
        let factor = moving_factor(&points, &speeds_along(&points, 0), &t_s, 0).unwrap();
        let factor = factor.mean();
        // errors without memory are stated a little too large, never too small
        assert!((2.0..2.5).contains(&factor), "{factor}");
    }

    #[test]
    fn a_mark_that_errs_more_where_it_is_fast_is_believed_less_there() {
        let mut normal = normal_numbers(7);
        let t_s: Vec<f64> = (0..1800).map(|i| f64::from(i) / 30.0).collect();
        let point = |t: &f64| {
            let speed = (2.0 * t).cos().abs();
            let error = (0.02 + 0.06 * speed) * normal();
            let position_px = [100.0 * (2.0 * t).sin() + error, 0.0];
            Some(Measured { position_px, covariance_px2: [0.02f64.powi(2), 1.0, 0.0], area_px2: 1.0 })
        };
        let points: Vec<Option<Measured>> = t_s.iter().map(point).collect();
        let moving = moving_factor(&points, &speeds_along(&points, 0), &t_s, 0).unwrap();
        // it goes through the middle by 6.7 px a frame
        let [slow, fast] = [moving.at(1.0), moving.at(6.5)];
        assert!(fast > 1.5 * slow && (3.0..6.5).contains(&fast), "{slow} {fast}");
        assert!(slow <= moving.mean() && moving.mean() <= fast && moving.least() <= slow);
    }
}
