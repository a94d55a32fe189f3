//! How well the past of a thing foretells its place, 0 to 1: near 1 for anything that swings, next to nothing for spots of a texture that are taken for one
//! thing.
//!
//! ```text
//! 1/(1 + (u/u₀)²),   u² = Σ |pₖ − Σᵢ wᵢ pₖ₋ᵢ|² / Σ |pₖ|²,   i = 1 … 4,   p from the middle of the path; in the denominator from that of the run in sight
//! ```
//! both sums less what the error of each place makes of them. The weights w are those of least squares. An oscillation, also two at once, is foretold exactly (Prony's linear prediction).

use nalgebra::{DMatrix, DVector};

/// Of what stands still.
pub(super) const STILL: f64 = 1.0;
/// Places before the one that they foretell: two for each of two oscillations.
const ORDER: usize = 4;
/// As few foretold places tell nothing of how well they are: there are nearly as many weights.
const FEWEST: usize = 2 * ORDER;
/// What a place that was looked at roughly is off, px.
pub(super) const ROUGH_PX: f64 = 0.2;
/// What is foretold to this part of its motion is as likely a mark as not (training: marks of 40 films miss it by less than 0.011 of it, two by 0.06; spots of
/// brick and wood by 0.04 to 0.6).
const UNSTEADY: f64 = 0.03;

/// Nearer to the place before than this a thing that moves is in a picture that was shown twice, or turns (px; judgement: a quarter of what a place is off that was looked at roughly).
const REPEATED_PX: f64 = 0.05;

/// The path without the places of pictures that are repeated, after which it jumps; as it is where most of it would be left out.
fn without_repeats(path: &[Option<[f64; 2]>]) -> Vec<Option<[f64; 2]>> {
    let is_repeated = |k: usize| match (k.checked_sub(1).and_then(|before| path[before]), path[k]) {
        (Some(before), Some(own)) => (own[0] - before[0]).hypot(own[1] - before[1]) < REPEATED_PX,
        _ => false,
    };
    let kept: Vec<_> = (0..path.len()).map(|k| path[k].filter(|_| !is_repeated(k))).collect();
    let count = |path: &[Option<[f64; 2]>]| path.iter().flatten().count();
    if 2 * count(&kept) > count(path) { kept } else { path.to_vec() }
}

/// Of a path; where it was out of sight it begins anew, and where a picture is repeated. A path of fewer than 13 places tells nothing, and stands for steady.
pub(super) fn steadiness(path: &[Option<[f64; 2]>]) -> f64 {
    let path = &*without_repeats(path);
    if path.iter().flatten().count() <= ORDER + FEWEST {
        return STILL;
    }
    let [mut missed_px2, mut moved_px2] = [0.0; 2];
    for axis in 0..2 {
        let mean_of = |run: &[Option<[f64; 2]>]| {
            let (count, sum) = run.iter().flatten().fold((0.0, 0.0), |(n, sum), p| (n + 1.0, sum + p[axis]));
            sum / f64::max(count, 1.0)
        };
        let middle = mean_of(path);
        let (mut before, mut next) = (Vec::new(), Vec::new());
        for run in path.split(Option::is_none) {
            let own_middle = mean_of(run) - middle;
            let places: Vec<f64> = run.iter().flatten().map(|p| p[axis] - middle).collect();
            for places in places.windows(ORDER + 1) {
                before.extend_from_slice(&places[..ORDER]);
                // what is in sight need not lie evenly about the middle
                before.push(1.0);
                next.push(places[ORDER]);
                moved_px2 += (places[ORDER] - own_middle).powi(2) - ROUGH_PX.powi(2);
            }
        }
        if next.len() <= FEWEST {
            return 0.0;
        }
        let before = DMatrix::from_row_slice(next.len(), ORDER + 1, &before);
        let next = DVector::from_vec(next);
        let Ok(weights) = before.clone().svd(true, true).solve(&next, f64::EPSILON) else { return 0.0 };
        let rough_px2 = ROUGH_PX.powi(2) * (1.0 + weights.rows(0, ORDER).norm_squared());
        let missed = &next - before * weights;
        missed_px2 += (missed.norm_squared() - rough_px2 * next.len() as f64).max(0.0);
    }
    if moved_px2 <= 0.0 {
        return 0.0;
    }
    let unsteadiness2 = missed_px2 / moved_px2;
    1.0 / (1.0 + unsteadiness2 / UNSTEADY.powi(2))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_past_foretells_what_swings_and_no_texture() {
        let place = |x: f64, y: f64| Some([x, y]);
        let swing = |i: usize| 100.0 * (0.17 * i as f64).sin() + 20.0 * (0.6 * i as f64).cos();
        let noise = |i: usize| 4e-4 * ((i * 7919 + i * i * 104_729) % 1000) as f64 - 0.2;
        let seen: Vec<_> = (0..240).map(|i| place(swing(i) + noise(i), 0.1 * swing(i))).collect();
        assert!(steadiness(&seen) > 0.5);
        // covered now and then
        let covered: Vec<_> = seen.iter().enumerate().map(|(i, p)| p.filter(|_| i % 37 > 9)).collect();
        assert!(steadiness(&covered) > 0.5, "{}", steadiness(&covered));
        // spots of a wall, one after the other
        let spot = |i: usize| 46.0 * ((0.31 * (i * i) as f64).sin() * 2.0).round();
        let texture: Vec<_> = (0..240).map(|i| place(spot(i), noise(i))).collect();
        assert!(steadiness(&texture) < 0.1);
        // pictures that stand still for a while, and those in between left out
        let frozen: Vec<_> = (0..240).map(|i| seen[if (90..94).contains(&i) { 90 } else { i }]).collect();
        assert!(steadiness(&frozen) > 0.5, "{}", steadiness(&frozen));
        // a fifth of a second of a swing
        assert_eq!(steadiness(&seen[..12]), STILL);
        // two spots, each for itself at rest
        let two: Vec<_> =
            (0..240).map(|i| place(if i < 120 { 0.0 } else { 90.0 }, noise(i)).filter(|_| i != 120)).collect();
        assert!(steadiness(&two) < 0.5, "{}", steadiness(&two));
    }
}
