//! One damped oscillation: its pole, its frequency and its damping ratio.

use serde::Serialize;

/// Fewest cycles by which an oscillation is told from a drift: within two, offset, trend and two half swings fit each other's data.
pub const FEWEST_CYCLES: f64 = 2.0;

/// One damped oscillation: its pole −σ ± iω.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Pole {
    /// ω, damped angular frequency.
    pub omega_rad_s: f64,
    /// σ; an amplitude falls as e^{−σt}.
    pub decay_per_s: f64,
}

impl Pole {
    /// From the natural frequency and the damping ratio.
    pub fn of(frequency_hz: f64, damping_ratio: f64) -> Self {
        let natural_rad_s = std::f64::consts::TAU * frequency_hz;
        Self {
            omega_rad_s: natural_rad_s * (1.0 - damping_ratio * damping_ratio).max(0.0).sqrt(),
            decay_per_s: damping_ratio * natural_rad_s,
        }
    }

    /// Undamped natural frequency f.
    pub fn frequency_hz(&self) -> f64 {
        self.omega_rad_s.hypot(self.decay_per_s) / std::f64::consts::TAU
    }

    /// ξ.
    pub fn damping_ratio(&self) -> f64 {
        self.decay_per_s / self.omega_rad_s.hypot(self.decay_per_s)
    }

    /// Cycles within a record, or before the amplitude has changed twentyfold, whichever is less.
    pub fn cycles_seen(&self, duration_s: f64) -> f64 {
        let lasting_s = 20f64.ln() / self.decay_per_s.abs().max(f64::MIN_POSITIVE);
        self.omega_rad_s / std::f64::consts::TAU * duration_s.min(lasting_s)
    }

    /// Whether a record shows it to and fro often enough that it is no drift.
    pub fn is_resolved_oscillation(&self, duration_s: f64) -> bool {
        self.cycles_seen(duration_s) >= FEWEST_CYCLES
    }

    /// Mean over a record of the square of an oscillation of unit amplitude at its start.
    pub fn mean_square(&self, duration_s: f64) -> f64 {
        let x = 2.0 * self.decay_per_s * duration_s;
        0.5 * if x.abs() < 1e-6 { 1.0 } else { -(-x).exp_m1() / x }
    }
}
