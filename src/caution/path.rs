//! The path of a mark that hangs from a point nobody has named: whether it comes back the way it went.

use nalgebra::{DMatrix, DVector, Matrix2};

use crate::measure::Measurement;
use crate::track::Point;

/// Powers of the place along the path that describe it (numerics: an arc of half a turn to a thousandth).
const POWERS: i32 = 4;
/// Distance between the ways out and back, over the swing, from which on the path is open (judgement: paths of one plane had at most 0.0008, one of two planes 0.025).
const OPEN: f64 = 0.005;
/// Frames below which a path is not looked at, and half a swing, px.
const FEWEST_FRAMES: usize = 30;
const LEAST_SWING_PX: f64 = 5.0;
/// Standard deviations of that distance from which on it is no chance (judgement).
const CHANCE_DEVIATIONS: f64 = 5.0;

/// One mark alone whose ways out and back differ: it swings towards the camera, too, and what is seen of it grows or falls as the plane turns.
pub(super) fn open(m: &Measurement) -> Option<String> {
    let [points] = &m.tracks.marks[..] else { return None };
    if !m.angles.links.is_empty() {
        return None;
    }
    let (apart_px, swing_px) = out_and_back_px(points, &m.angles.t_s)?;
    (apart_px > OPEN * swing_px).then(|| {
        format!(
            "the mark comes back another way than it went, {apart_px:.1} px beside it in a swing of {swing_px:.0} px: it swings towards the camera as well, and what is seen of it may grow or fall only because the plane of the swing turns; hang it on two strings, or film it from below, before a damping is believed"
        )
    })
}

/// How far the ways out and back lie apart (rms from their middle), and half the range of the motion; `None` where too little is seen, or chance may have done it.
///
/// ```text
/// w = Σₖ aₖ uᵏ + v (b₀ + b₁ u + b₂ u²)        k = 0 … 4
/// ```
///
/// u is the place along the path, w across it, v the speed along it: what goes with v is what the way back differs by.
fn out_and_back_px(points: &[Point], t_s: &[f64]) -> Option<(f64, f64)> {
    let seen: Vec<(f64, [f64; 2])> =
        points.iter().zip(t_s).filter_map(|(point, t_s)| Some((*t_s, point.measured?.position_px))).collect();
    let n = seen.len();
    if n < FEWEST_FRAMES {
        return None;
    }
    let mean = [0, 1].map(|axis| seen.iter().map(|(_, p)| p[axis]).sum::<f64>() / n as f64);
    let moment = |i: usize, j: usize| seen.iter().map(|(_, p)| (p[i] - mean[i]) * (p[j] - mean[j])).sum::<f64>();
    let eigen = Matrix2::new(moment(0, 0), moment(0, 1), moment(0, 1), moment(1, 1)).symmetric_eigen();
    let along = eigen.eigenvectors.column(eigen.eigenvalues.imax()).into_owned();
    let part = |p: &[f64; 2], x: f64, y: f64| (p[0] - mean[0]) * x + (p[1] - mean[1]) * y;
    let u: Vec<f64> = seen.iter().map(|(_, p)| part(p, along[0], along[1])).collect();
    let swing_px = 0.5 * (u.iter().copied().fold(f64::MIN, f64::max) - u.iter().copied().fold(f64::MAX, f64::min));
    if swing_px < LEAST_SWING_PX {
        return None;
    }
    let speed: Vec<f64> = (1..n - 1).map(|k| (u[k + 1] - u[k - 1]) / (seen[k + 1].0 - seen[k - 1].0)).collect();
    let fastest = speed.iter().fold(0.0_f64, |most, v| most.max(v.abs()));
    // stamps that repeat tell no speed
    if !(fastest > 0.0) || speed.iter().any(|v| !v.is_finite()) {
        return None;
    }
    let columns = POWERS as usize + 4;
    let row = |k: usize, column: usize| {
        let (place, speed) = (u[k + 1] / swing_px, speed[k] / fastest);
        let power = column as i32;
        if power <= POWERS { place.powi(power) } else { speed * place.powi(power - POWERS - 1) }
    };
    let design = DMatrix::from_fn(n - 2, columns, row);
    let across = DVector::from_fn(n - 2, |k, _| part(&seen[k + 1].1, -along[1], along[0]));
    let found = design.clone().svd(true, true).solve(&across, 1e-12).ok()?;
    let left = &across - &design * &found;
    let odd = columns - POWERS as usize - 1;
    let apart = design.columns(columns - odd, odd) * found.rows(columns - odd, odd);
    let rms = |of: &DVector<f64>| (of.norm_squared() / of.len() as f64).sqrt();
    let by_chance_px = rms(&left) * (odd as f64 / n as f64).sqrt();
    (rms(&apart) > CHANCE_DEVIATIONS * by_chance_px).then(|| (rms(&apart), swing_px))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::track::{Flags, Measured};

    /// A ball on a string of 600 px that swings in two planes, seen from a little above; `aside` is its motion towards the camera over that along the picture.
    fn seen(aside: f64) -> Option<(f64, f64)> {
        let t_s: Vec<f64> = (0..240).map(|k| f64::from(k) / 30.0).collect();
        let point = |t_s: &f64| {
            let (x, z) = (200.0 * (4.0 * t_s).cos(), 200.0 * aside * (4.0 * t_s).sin());
            let y = (600.0_f64 * 600.0 - x * x - z * z).sqrt() + 0.1 * z;
            let measured = Some(Measured { position_px: [640.0 + x, y], covariance_px2: [0.0; 3], area_px2: 100.0 });
            Point { measured, filtered: None, flags: Flags::default() }
        };
        let points: Vec<Point> = t_s.iter().map(point).collect();
        out_and_back_px(&points, &t_s)
    }

    #[test]
    fn stamps_that_repeat_tell_nothing() {
        let measured = Measured { position_px: [640.0, 300.0], covariance_px2: [0.0; 3], area_px2: 100.0 };
        let point = |k: i32| Point {
            measured: Some(Measured { position_px: [640.0 + 9.0 * f64::from(k % 7), 300.0], ..measured }),
            filtered: None,
            flags: Flags::default(),
        };
        let points: Vec<Point> = (0..60).map(point).collect();
        let halted_s: Vec<f64> = (0..60).map(|k| f64::from(k.min(40))).collect();
        assert_eq!(out_and_back_px(&points, &halted_s), None);
        assert_eq!(out_and_back_px(&points, &[1.0; 60]), None);
    }

    #[test]
    fn a_swing_in_one_plane_comes_back_the_way_it_went() {
        assert!(seen(0.0).is_none_or(|(apart, swing)| apart < 1e-3 * OPEN * swing));
        let (apart, swing) = seen(0.2).unwrap();
        assert!((swing - 200.0).abs() < 1.0 && (apart - 4.0 / 2f64.sqrt()).abs() < 0.1, "{apart} {swing}");
        assert!(apart > OPEN * swing);
    }
}
