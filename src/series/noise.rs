//! The noise of an angle, from its values alone: what no motion as smooth as the recording's own can explain.
//!
//! It knows no model, so a model that does not fit cannot raise it. Two methods, each of which counts some motion with the noise and never less than the
//! noise; so the smaller is taken.
//!
//! ```text
//! Neighbours     of d + 1 rows at their true times the divided difference of order d,  Σ wₖθₖ with wₖ ∝ Πⱼ 1/(tₖ − tⱼ), |w| = 1:  a motion of frequency f
//!                leaves (2 sin πfΔt)^d / √(2d choose d) of itself, noise leaves all
//! Subspace       of all stretches of L rows, steps even, the r directions that hold most of their power are the motion's (Hankel matrix; Broomhead and
//!                King, Physica D 20 (1986) 217); from one half of the recording they are learnt, in the other the mean power of the L − r others is σ²
//! ```

use nalgebra::{DMatrix, SymmetricEigen};

use crate::statistics::{median, median_step_s};

/// Orders of the differences. Higher ones suppress motion better, and need more rows without a gap.
const ORDERS: std::ops::RangeInclusive<usize> = 2..=10;
/// Rows of a stretch.
const LENGTHS: [usize; 3] = [16, 32, 48];
/// Parts of a stretch's directions that the motion may take.
const OF_MOTION: [f64; 3] = [0.25, 0.5, 0.75];
/// Each half of a recording has this many stretches for every row of one.
const STRETCHES: usize = 2;
/// Steps are even within this part of the usual one.
const EVEN: f64 = 0.1;
/// Differences beyond this many robust standard deviations are outliers'.
const APART: f64 = 6.0;
/// Where more than this part stands apart, that is how the noise is: one value in ten, which is in three second differences.
const MOST_APART: f64 = 0.3;
/// An exact table still has the digits it was written with.
pub const LEAST_RAD: f64 = 1e-9;
/// An angle is in steps where it has so many rows for every value that occurs…
const ROWS_OF_A_VALUE: usize = 2;
/// … and all but this part of its values are at least a step apart: an encoder that was set anew has values between.
const BETWEEN_STEPS: f64 = 0.05;

/// Of an angle that is known in steps of q, as an encoder's is, q/√12, however often it stays the same.
pub fn least_rad(angles: &[Option<f64>]) -> f64 {
    step_rad(angles).map_or(LEAST_RAD, |step_rad| (step_rad / 12f64.sqrt()).max(LEAST_RAD))
}

/// In which an angle is known, where it is in steps.
pub fn step_rad(angles: &[Option<f64>]) -> Option<f64> {
    let mut values: Vec<f64> = angles.iter().flatten().copied().collect();
    let rows = values.len();
    values.sort_unstable_by(f64::total_cmp);
    let mut gaps: Vec<f64> = values.windows(2).map(|pair| pair[1] - pair[0]).filter(|gap| *gap > LEAST_RAD).collect();
    if rows < ROWS_OF_A_VALUE * (gaps.len() + 1) || gaps.is_empty() {
        return None;
    }
    gaps.sort_unstable_by(f64::total_cmp);
    Some(gaps[(BETWEEN_STEPS * gaps.len() as f64) as usize])
}

/// The part of an encoder's rounding that is in step with the swing, over all of its noise: the largest of the angles'; 0 where none is in steps.
///
/// Of a swing of amplitude A about a step q of the encoder the rounding error has, at the swing's frequency, the amplitude (Widrow and Kollár, Quantization Noise,
/// 2008, app. G)
///
/// ```text
/// |Σₖ (−1)ᵏ 2q/πk J₁(2πkA/q) exp(−2π²k²σ²/q²)|  ≲  2q/π √(q/A)/π exp(−2π²σ²/q²)      σ: noise before it is rounded
/// ```
///
/// and as much at each odd multiple up to 2πA/q.
pub fn rounding_in_step(t_s: &[f64], theta_rad: &[Vec<Option<f64>>]) -> f64 {
    let of = |angles: &Vec<Option<f64>>| {
        let step_rad = step_rad(angles)?;
        let ends = angles.iter().flatten().fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], a| [l.min(*a), h.max(*a)]);
        let steps = (0.5 * (ends[1] - ends[0]) / step_rad).max(1.0);
        let noise2 = (of_angle(t_s, angles) / step_rad).powi(2);
        let before2 = (noise2 - 1.0 / 12.0).max(0.0);
        let pi2 = std::f64::consts::PI.powi(2);
        let rms = 2f64.sqrt() / (pi2 * steps.sqrt()) * (-2.0 * pi2 * before2).exp();
        Some(rms / noise2.sqrt())
    };
    theta_rad.iter().filter_map(of).fold(0.0, f64::max)
}

/// Standard deviation of one angle's noise.
pub fn of_angle(t_s: &[f64], angles: &[Option<f64>]) -> f64 {
    let step_s = median_step_s(t_s).unwrap_or(1.0);
    let differences = ORDERS.filter_map(|order| Differences::of(t_s, angles, step_s, order));
    let Some(neighbours) = differences.min_by(|a, b| a.sd.total_cmp(&b.sd)) else { return least_rad(angles) };
    let mut kept = angles.to_vec();
    neighbours.apart.iter().for_each(|rows| kept[rows.clone()].fill(None));
    let subspace = LENGTHS.iter().filter_map(|length| beside_the_motion(t_s, &kept, step_s, *length));
    subspace.fold(neighbours.sd, f64::min).max(least_rad(angles))
}

/// Normalised divided differences of one order.
struct Differences {
    sd: f64,
    /// Rows of those that stand apart.
    apart: Vec<std::ops::Range<usize>>,
}

impl Differences {
    fn of(t_s: &[f64], angles: &[Option<f64>], step_s: f64, order: usize) -> Option<Self> {
        let at = |first: usize| {
            let rows = first..first + order + 1;
            let gapless = t_s[rows.end - 1] - t_s[first] < (order as f64 + 0.9) * step_s;
            let values: Option<Vec<f64>> = angles[rows.clone()].iter().copied().collect();
            Some((rows.clone(), difference(&t_s[rows], &values.filter(|_| gapless)?, step_s)))
        };
        let all: Vec<_> = (0..t_s.len().saturating_sub(order)).filter_map(at).collect();
        if all.len() < 2 * order {
            return None;
        }
        let mut sizes: Vec<f64> = all.iter().map(|(_, d)| d.abs()).collect();
        let limit = APART * 1.4826 * median(&mut sizes)?;
        let (near, apart): (Vec<_>, Vec<_>) = all.into_iter().partition(|(_, d)| d.abs() <= limit);
        let square = |of: &[(std::ops::Range<usize>, f64)]| of.iter().map(|(_, d)| d * d).sum::<f64>();
        if apart.len() as f64 > MOST_APART * (near.len() + apart.len()) as f64 {
            let sd = ((square(&near) + square(&apart)) / (near.len() + apart.len()) as f64).sqrt();
            return Some(Self { sd, apart: Vec::new() });
        }
        let sd = (square(&near) / near.len() as f64).sqrt();
        Some(Self { sd, apart: apart.into_iter().map(|(rows, _)| rows).collect() })
    }
}

/// Σ wₖθₖ.
fn difference(t_s: &[f64], values: &[f64], step_s: f64) -> f64 {
    let weight = |k: usize| {
        let others = (0..t_s.len()).filter(|j| *j != k);
        others.map(|j| step_s / (t_s[k] - t_s[j])).product::<f64>()
    };
    let weights: Vec<f64> = (0..t_s.len()).map(weight).collect();
    let norm = weights.iter().map(|w| w * w).sum::<f64>().sqrt();
    weights.iter().zip(values).map(|(w, v)| w * v).sum::<f64>() / norm
}

/// The noise beside the subspace of the motion in stretches of `length` rows; `None` where there are too few.
fn beside_the_motion(t_s: &[f64], angles: &[Option<f64>], step_s: f64, length: usize) -> Option<f64> {
    let even = |rows: &std::ops::Range<usize>| {
        t_s[rows.clone()].windows(2).all(|pair| (pair[1] - pair[0] - step_s).abs() <= EVEN * step_s)
    };
    let stretch = |first: usize| {
        let rows = first..first + length;
        let values: Option<Vec<f64>> = angles[rows.clone()].iter().copied().collect();
        values.filter(|_| even(&rows))
    };
    let middle = t_s.len() / 2;
    let halves = [0..(middle + 1).saturating_sub(length), middle..(t_s.len() + 1).saturating_sub(length)];
    let powers = halves.map(|firsts| {
        let (mut power, mut count) = (DMatrix::<f64>::zeros(length, length), 0);
        for values in firsts.filter_map(stretch) {
            let values = nalgebra::DVector::from_vec(values);
            power.syger(1.0, &values, &values, 1.0);
            count += 1;
        }
        power.fill_upper_triangle_with_lower_triangle();
        (count >= STRETCHES * length).then(|| power / f64::from(count.max(1) as u32))
    });
    let [Some(first), Some(second)] = powers else { return None };
    let across = |learnt: &DMatrix<f64>, held: &DMatrix<f64>| {
        let eigen = SymmetricEigen::new(learnt.clone());
        let mut order: Vec<usize> = (0..length).collect();
        order.sort_by(|a, b| eigen.eigenvalues[*a].total_cmp(&eigen.eigenvalues[*b]));
        let along: Vec<f64> = order
            .iter()
            .map(|k| {
                let direction = eigen.eigenvectors.column(*k);
                direction.dot(&(held * direction)).max(0.0)
            })
            .collect();
        let beside = |share: &f64| {
            let kept = length - (share * length as f64) as usize;
            along[..kept].iter().sum::<f64>() / kept as f64
        };
        OF_MOTION.iter().map(beside).fold(f64::INFINITY, f64::min)
    };
    Some(across(&first, &second).min(across(&second, &first)).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rounding_of_an_encoder_is_in_step_with_a_small_swing() {
        let step_rad = 6e-3;
        let t_s: Vec<f64> = (0..3000).map(|i| f64::from(i) / 100.0).collect();
        let share = |amplitude_rad: f64| {
            // rounded at amplitudes around this one, as a swing has them that decays
            let projected = |k: usize| {
                let amplitude_rad = amplitude_rad + step_rad * k as f64 / 40.0;
                let phase = |t: &f64| 5.3 * t;
                let errors = t_s.iter().map(|t| {
                    let angle = amplitude_rad * phase(t).sin();
                    ((angle / step_rad).round() * step_rad - angle) * phase(t).sin()
                });
                (errors.sum::<f64>() / t_s.len() as f64 * 2f64.sqrt() / (step_rad / 12f64.sqrt())).powi(2)
            };
            let found = vec![
                t_s.iter().map(|t| Some((amplitude_rad * (5.3 * t).sin() / step_rad).round() * step_rad)).collect(),
            ];
            (rounding_in_step(&t_s, &found), ((0..80).map(projected).sum::<f64>() / 80.0).sqrt())
        };
        for amplitude_rad in [0.05, 0.1, 0.3] {
            // the envelope of the first term is √2/√ζ(3) times the root of the mean square of all
            let (told, usual) = share(amplitude_rad);
            assert!((told / usual / (2.0f64 / 1.202).sqrt() - 1.0).abs() < 0.15, "{amplitude_rad}: {told} {usual}");
        }
        assert_eq!(rounding_in_step(&t_s, &[t_s.iter().map(|t| Some((5.3 * t).sin())).collect()]), 0.0);
    }
}
