//! A support that yields.

use super::Effect;
use crate::model::{Chain, Motion, Parameter, Partials};

/// `support_flexibility`: the pivot is carried by a stand of stiffness 1/s and damping ratio ζ. f is the frequency at which the stand swings with the specimen's mass
/// hung on it, so that the stand and that mass M together weigh 1/(s ω²), ω = 2πf. The pivot's displacement x is an unknown of its own:
///
/// ```text
/// ẍ/ω² + 2ζẋ/ω + x = −s Σᵢ hᵢ (cos θᵢ θ̈ᵢ − sin θᵢ θ̇ᵢ²)       the chain pulls at the stand,
/// Qᵢ = −ẍ hᵢ cos θᵢ                                          and the stand carries the chain's pivot with it
/// ```
///
/// Both are derivatives of one energy, so that without damping none is lost. Kept in mind are x and ẋ/ω (m). What the air or a side force adds to the pull is left
/// out, and so is the pivot's speed in the air's: both are as small beside gravity and the swing as the air's own forces.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SupportFlexibility {
    /// s.
    pub compliance_m_per_n: f64,
    /// f.
    pub frequency_hz: f64,
    /// ζ.
    pub damping_ratio: f64,
}

impl SupportFlexibility {
    fn omega_rad_s(&self) -> f64 {
        std::f64::consts::TAU * self.frequency_hz
    }

    /// Σ hᵢ (cos θᵢ θ̈ᵢ − sin θᵢ θ̇ᵢ²) (N): the chain's sideways inertia.
    pub fn pull_n(chain: &Chain, motion: &Motion) -> f64 {
        let of = |i: usize| Self::pull_of_moment(motion, i) * chain.static_moment_kg_m(i);
        (0..chain.count()).map(of).sum()
    }

    /// The same of a unit of hᵢ.
    fn pull_of_moment(motion: &Motion, i: usize) -> f64 {
        motion.cos[i] * motion.acceleration[i] - motion.sin[i] * motion.rate[i] * motion.rate[i]
    }

    /// Where x stands among the rates; ẋ/ω follows it. They are the last two.
    fn place(motion: &Motion) -> usize {
        motion.rate.len() - 2
    }
}

impl Effect for SupportFlexibility {
    fn hidden(&self, _chain: &Chain) -> usize {
        2
    }

    fn begins_free(&self) -> bool {
        true
    }

    /// Of a metre: at most a link that turns as far as its pivot moves.
    fn of_hidden(&self, chain: &Chain) -> [f64; 2] {
        [f64::INFINITY, 1.0 / chain.length_m(0)]
    }

    fn add_torque(&self, chain: &Chain, motion: &Motion, q: &mut [f64]) {
        let (at, omega) = (Self::place(motion), self.omega_rad_s());
        let (x_m, speed_m) = (motion.rate[at], motion.rate[at + 1]);
        let pivot_m_s2 = omega * motion.acceleration[at + 1];
        for i in 0..chain.count() {
            q[i] -= pivot_m_s2 * chain.static_moment_kg_m(i) * motion.cos[i];
        }
        q[at] += omega * speed_m - motion.acceleration[at];
        let carried_m = x_m + 2.0 * self.damping_ratio * speed_m + motion.acceleration[at + 1] / omega;
        q[at + 1] -= carried_m + self.compliance_m_per_n * Self::pull_n(chain, motion);
    }

    fn add_partials(&self, chain: &Chain, motion: &Motion, partials: &mut Partials) {
        let (at, omega, s) = (Self::place(motion), self.omega_rad_s(), self.compliance_m_per_n);
        let pivot_m_s2 = omega * motion.acceleration[at + 1];
        for i in 0..chain.count() {
            let moment = chain.static_moment_kg_m(i);
            let (sin, cos, rate) = (motion.sin[i], motion.cos[i], motion.rate[i]);
            partials.theta[(i, i)] += pivot_m_s2 * moment * sin;
            partials.acceleration[(i, at + 1)] -= omega * moment * cos;
            partials.theta[(at + 1, i)] += s * moment * (sin * motion.acceleration[i] + cos * rate * rate);
            partials.rate[(at + 1, i)] += 2.0 * s * moment * sin * rate;
            partials.acceleration[(at + 1, i)] -= s * moment * cos;
        }
        partials.rate[(at, at + 1)] += omega;
        partials.acceleration[(at, at)] -= 1.0;
        partials.rate[(at + 1, at)] -= 1.0;
        partials.rate[(at + 1, at + 1)] -= 2.0 * self.damping_ratio;
        partials.acceleration[(at + 1, at + 1)] -= 1.0 / omega;
    }

    fn parameters(&self) -> Vec<(Parameter, f64)> {
        vec![
            (Parameter::SupportCompliance, self.compliance_m_per_n),
            (Parameter::SupportOwnFrequency, self.frequency_hz),
            (Parameter::SupportDampingRatio, self.damping_ratio),
        ]
    }

    fn set(&mut self, parameter: Parameter, value: f64) {
        match parameter {
            Parameter::SupportCompliance => self.compliance_m_per_n = value,
            Parameter::SupportOwnFrequency => self.frequency_hz = value,
            Parameter::SupportDampingRatio => self.damping_ratio = value,
            _ => {}
        }
    }

    fn add_sensitivity(&self, parameter: Parameter, chain: &Chain, motion: &Motion, q: &mut [f64]) {
        let (at, omega) = (Self::place(motion), self.omega_rad_s());
        let speed_m = motion.rate[at + 1];
        match parameter {
            Parameter::SupportCompliance => q[at + 1] -= Self::pull_n(chain, motion),
            Parameter::SupportDampingRatio => q[at + 1] -= 2.0 * speed_m,
            Parameter::SupportOwnFrequency => {
                let by_hz = std::f64::consts::TAU;
                for i in 0..chain.count() {
                    q[i] -= by_hz * motion.acceleration[at + 1] * chain.static_moment_kg_m(i) * motion.cos[i];
                }
                q[at] += by_hz * speed_m;
                q[at + 1] += by_hz * motion.acceleration[at + 1] / (omega * omega);
            }
            _ => {}
        }
    }

    /// Of the chain's pull at the stand; what the moving pivot does to the chain is a sideways acceleration.
    fn add_sensitivity_of_links(&self, parameter: Parameter, chain: &Chain, motion: &Motion, q: &mut [f64]) {
        let at = Self::place(motion);
        for i in 0..chain.count() {
            let slope_kg = chain.borne_moment_slope_kg(0, i, parameter);
            q[at + 1] -= self.compliance_m_per_n * slope_kg * Self::pull_of_moment(motion, i);
        }
    }

    fn sideways_m_s2(&self, motion: &Motion) -> f64 {
        -self.omega_rad_s() * motion.acceleration[Self::place(motion) + 1]
    }

    /// ½(x² + (ẋ/ω)²)/s + ẋ Σ hᵢ cos θᵢ θ̇ᵢ: the spring, the stand and the specimen's mass upon it, and what that mass has of both motions.
    fn energy_j(&self, chain: &Chain, motion: &Motion) -> f64 {
        let (at, omega) = (Self::place(motion), self.omega_rad_s());
        let (x_m, speed_m) = (motion.rate[at], motion.rate[at + 1]);
        if self.compliance_m_per_n == 0.0 {
            return 0.0;
        }
        let of = |i: usize| chain.static_moment_kg_m(i) * motion.cos[i] * motion.rate[i];
        let shared_j = omega * speed_m * (0..chain.count()).map(of).sum::<f64>();
        0.5 * (x_m * x_m + speed_m * speed_m) / self.compliance_m_per_n + shared_j
    }
}
