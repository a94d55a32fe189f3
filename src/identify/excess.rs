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
    /// The part of the residual's power that lies there.
    pub share: f64,
}

impl Excess {
    /// Of a residual beside the mode of this frequency.
    pub fn of(residual: &Signal, omega_rad_s: f64) -> Self {
        let line = std::f64::consts::TAU / residual.duration_s();
        let (mut sum, mut lines) = (0.0, 0.0);
        for link in &residual.links {
            let n = link.t_s.len() as f64;
            let variance = link.theta_rad.iter().map(|r| r * r).sum::<f64>() / n;
            for k in (2..10).flat_map(|k| [f64::from(k), -f64::from(k)]) {
                let omega = omega_rad_s + k * line;
                if omega < 2.0 * line {
                    continue;
                }
                let turns = link.t_s.iter().zip(&link.theta_rad).map(|(t, r)| Complex::from_polar(*r, -omega * t));
                sum += turns.sum::<Complex<f64>>().norm_sqr() / (n * variance.max(f64::MIN_POSITIVE));
                lines += 1.0;
            }
        }
        // each line's power is half a χ² of two degrees of freedom
        let p_value = chi_squared_tail(2.0 * sum, 2.0 * lines);
        let power = if p_value < LEAST_P { (sum / lines).max(1.0) } else { 1.0 };
        // a line and its mirror image hold 2/n of white noise
        let share = 2.0 * sum / residual.values().max(1) as f64;
        Self { power, p_value, share }
    }
}
