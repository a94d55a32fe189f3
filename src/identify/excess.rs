//! What a residual has beside a mode beyond white noise.

use nalgebra::Complex;

use super::estimate::chi_squared_tail;
use super::signal::Signal;

/// Of what noise makes in fewer records something else is the cause (statistics).
const LEAST_P: f64 = 1e-3;

/// What a residual has in the lines beside a mode, 2/T to 9/T away on both sides.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Excess {
    /// Its power there over that of white noise of the same variance; 1 unless the excess would come about by chance less than once in a thousand records.
    /// Least squares sees only that part of the residual.
    pub power: f64,
    /// That chance.
    pub p_value: f64,
    /// What lies there, over what scatters from sample to sample: mean squares.
    pub over_scatter: f64,
}

/// The variance of what scatters from sample to sample: third differences hold 20 times that of white noise, and next to nothing of a mode and its harmonics.
fn scatter(values: &[f64]) -> f64 {
    let third = |w: &[f64]| (w[3] - 3.0 * w[2] + 3.0 * w[1] - w[0]).powi(2);
    values.windows(4).map(third).sum::<f64>() / (20 * values.len().saturating_sub(3).max(1)) as f64
}

impl Excess {
    /// Of a residual beside the mode of this frequency.
    pub fn of(residual: &Signal, omega_rad_s: f64) -> Self {
        let line = std::f64::consts::TAU / residual.duration_s();
        let (mut sum, mut lines, mut over_scatter) = (0.0, 0.0, 0.0f64);
        for link in &residual.links {
            let n = link.t_s.len() as f64;
            let variance = link.theta_rad.iter().map(|r| r * r).sum::<f64>() / n;
            let before = sum;
            for k in (2..10).flat_map(|k| [f64::from(k), -f64::from(k)]) {
                let omega = omega_rad_s + k * line;
                if omega < 2.0 * line {
                    continue;
                }
                let turns = link.t_s.iter().zip(&link.theta_rad).map(|(t, r)| Complex::from_polar(*r, -omega * t));
                sum += turns.sum::<Complex<f64>>().norm_sqr() / (n * variance.max(f64::MIN_POSITIVE));
                lines += 1.0;
            }
            // a line and its mirror image hold 2/n of white noise
            let beside = 2.0 * (sum - before) * variance / n;
            over_scatter = over_scatter.max(beside / scatter(&link.theta_rad).max(f64::MIN_POSITIVE));
        }
        // each line's power is half a χ² of two degrees of freedom
        let p_value = chi_squared_tail(2.0 * sum, 2.0 * lines);
        let power = if p_value < LEAST_P { (sum / lines).max(1.0) } else { 1.0 };
        Self { power, p_value, over_scatter }
    }
}
