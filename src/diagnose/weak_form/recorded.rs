//! The recorded motion: angles smoothed to rates and accelerations, and what stands along it weighed by bumps.

use nalgebra::{DMatrix, DVector};

use crate::fit::Record;
use crate::model::{ForwardModel, Motion};
use crate::statistics::median;

/// Coefficients of that polynomial.
const POWERS: usize = 6;
/// Fewest values in a window: two more than the polynomial has coefficients.
const FEWEST: usize = POWERS + 2;
/// A window's values reach at least this far to both sides, as a part of its half width.
const REACHES: f64 = 0.7;
/// A bump holds this part of the rows that it would without gaps.
const SEEN: f64 = 0.8;

/// The motion at every row where it is seen to both sides.
pub fn instants(model: &ForwardModel, record: &Record, half_s: f64, yield_rad: f64) -> Vec<Motion> {
    let n = model.chain().count();
    let mut worked = vec![0.0; model.rates() - n];
    let mut before: Option<Vec<f64>> = None;
    let mut instants = Vec::new();
    for row in 0..record.len() {
        let smooth: Option<Vec<[f64; 3]>> =
            record.theta_rad.iter().map(|angles| smoothed(&record.t_s, angles, row, half_s)).collect();
        let Some(smooth) = smooth else { continue };
        let theta: Vec<f64> = smooth.iter().map(|s| s[0]).collect();
        if let Some(before) = &before {
            for (joint, z) in worked.iter_mut().enumerate() {
                let bend = |angles: &[f64]| angles[joint + 1] - angles[joint];
                *z = worked_by(*z, (bend(&theta) - bend(before)) / yield_rad);
            }
        }
        let rates: Vec<f64> = smooth.iter().map(|s| s[1]).chain(worked.iter().copied()).collect();
        let mut motion = model.motion(record.t_s[row], &theta, &rates);
        smooth.iter().enumerate().for_each(|(link, s)| motion.acceleration[link] = s[2]);
        instants.push(motion);
        before = Some(theta);
    }
    instants
}

/// z of Bouc and Wen's law after its spring has been worked by a part of the yield angle: dz = (1 − ½(sgn Δ̇ + sgn z) z) dΔ/Δ_y, solved.
fn worked_by(z: f64, bent: f64) -> f64 {
    let (towards, size) = (bent.signum(), bent.abs());
    let along = z * towards;
    let after = if along + size <= 0.0 {
        along + size
    } else {
        let (from, left) = if along < 0.0 { (0.0, size + along) } else { (along, size) };
        1.0 - (1.0 - from) * (-left).exp()
    };
    after * towards
}

/// An angle, its rate and its acceleration at a row, by the polynomial through the values around it.
fn smoothed(t_s: &[f64], angles: &[Option<f64>], row: usize, half_s: f64) -> Option<[f64; 3]> {
    let at = |i: usize| (t_s[i] - t_s[row]) / half_s;
    let below = (0..row).rev().take_while(|i| at(*i) >= -1.0);
    let above = (row..t_s.len()).take_while(|i| at(*i) <= 1.0);
    let values: Vec<(f64, f64)> = below.chain(above).filter_map(|i| Some((at(i), angles[i]?))).collect();
    let reach = values.iter().fold([0.0f64; 2], |[low, high], (x, _)| [low.min(*x), high.max(*x)]);
    if values.len() < FEWEST || -reach[0] < REACHES || reach[1] < REACHES {
        return None;
    }
    let (mut normal, mut right) = (DMatrix::<f64>::zeros(POWERS, POWERS), DVector::<f64>::zeros(POWERS));
    for (x, value) in values {
        let powers = DVector::from_fn(POWERS, |k, _| x.powi(k as i32));
        let weight = (1.0 - x.abs().powi(3)).max(0.0) + 1e-3;
        normal.ger(weight, &powers, &powers, 1.0);
        right.axpy(weight * value, &powers, 1.0);
    }
    let fitted = normal.cholesky()?.solve(&right);
    Some([fitted[0], fitted[1] / half_s, 2.0 * fitted[2] / (half_s * half_s)])
}

/// Weighs what is made of the torques at each instant by bumps that overlap by half.
pub fn bumps(
    at: &[(f64, DMatrix<f64>)],
    half_s: f64,
    of: impl Fn(usize, &DMatrix<f64>) -> DVector<f64>,
    rows: &mut Vec<DVector<f64>>,
) {
    let (Some(first), Some(last)) = (at.first(), at.last()) else { return };
    let mut steps_s: Vec<f64> = at.windows(2).map(|pair| pair[1].0 - pair[0].0).collect();
    let Some(step_s) = median(&mut steps_s) else { return };
    let expected = 2.0 * half_s / step_s;
    let count = ((last.0 - first.0) / half_s) as usize;
    for bump in 1..count {
        let centre_s = first.0 + bump as f64 * half_s;
        let from = at.partition_point(|(t_s, _)| *t_s < centre_s - half_s);
        let within = (from..at.len()).take_while(|k| at[*k].0 <= centre_s + half_s);
        let (mut sum, mut weight, mut seen) = (DVector::zeros(first.1.ncols()), 0.0, 0.0);
        for k in within {
            let phi = (1.0 - ((at[k].0 - centre_s) / half_s).powi(2)).max(0.0).powi(3);
            sum.axpy(phi, &of(k, &at[k].1), 1.0);
            weight += phi;
            seen += 1.0;
        }
        // a gap would be no bump
        if seen > SEEN * expected && weight > 0.0 {
            rows.push(sum / weight);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_polynomial_of_the_fifth_power_is_smoothed_to_itself() {
        let t_s: Vec<f64> = (0..21).map(|k| 0.1 * f64::from(k)).collect();
        let of = |t: f64| 0.3 - t + 0.5 * t.powi(3) - 0.2 * t.powi(5);
        let angles: Vec<Option<f64>> = t_s.iter().enumerate().map(|(k, t)| (k != 9).then_some(of(*t))).collect();
        let [angle, rate, acceleration] = smoothed(&t_s, &angles, 10, 0.5).unwrap();
        assert!((angle - of(1.0)).abs() < 1e-9 && (rate - (-1.0 + 1.5 - 1.0)).abs() < 1e-8);
        assert!((acceleration - (3.0 - 4.0)).abs() < 1e-6, "{acceleration}");
        // seen to one side alone
        assert!(smoothed(&t_s, &angles, 1, 0.5).is_none());
    }

    #[test]
    fn a_joint_is_worked_as_the_law_of_bouc_and_wen_has_it() {
        let (mut exact, mut stepped) = (-0.3, -0.3);
        for bent in [0.2, 1.4, -0.5, -2.5, 0.7] {
            exact = worked_by(exact, bent);
            let steps = 100_000;
            for _ in 0..steps {
                let d: f64 = bent / f64::from(steps);
                stepped += d * (1.0 - 0.5 * (d.signum() + f64::signum(stepped)) * stepped);
            }
            assert!((exact - stepped).abs() < 1e-4, "{bent}: {exact} {stepped}");
        }
    }
}
