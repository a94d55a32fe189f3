//! Torques between consecutive links: T turns the upper link by +T and the lower by −T.
//!
//! T depends on Δ = σ(θᵢ₊₁ − θᵢ). σ is 1 for two links. A strip cut into shorter links than its marks lie apart bends at several
//! joints: σ = ℓ_marks/ℓ makes Δ the bend between two links of ℓ_marks with the same curvature, so that the same law holds.

use nalgebra::DMatrix;

use super::{Effect, Law};
use crate::model::{Chain, Motion, Parameter, Partials};

/// The joint of the base model: T = K(Δ − κ) + CΔ̇, κ being `rest_curl`; energy ½K(Δ − κ)²/σ (paper Eq. 9, 10 as equal and opposite
/// torques).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpringDamper {
    /// K.
    pub stiffness_n_m_per_rad: f64,
    /// C.
    pub damping_n_m_s_per_rad: f64,
    /// κ.
    pub rest_rad: f64,
    /// ℓ of EI = Kℓ.
    pub length_m: f64,
}

impl SpringDamper {
    fn torque_n_m(&self, bend: &Bend) -> f64 {
        self.stiffness_n_m_per_rad * (bend.angle_rad - self.rest_rad) + self.damping_n_m_s_per_rad * bend.rate_rad_s
    }
}

impl Effect for SpringDamper {
    fn add_torque(&self, chain: &Chain, motion: &Motion, q: &mut [f64]) {
        bends(chain, motion).for_each(|bend| bend.add_torque(self.torque_n_m(&bend), q));
    }

    fn add_partials(&self, chain: &Chain, motion: &Motion, partials: &mut Partials) {
        for bend in bends(chain, motion) {
            bend.add_slope(self.stiffness_n_m_per_rad, &mut partials.theta);
            bend.add_slope(self.damping_n_m_s_per_rad, &mut partials.rate);
        }
    }

    fn parameters(&self) -> Vec<(Parameter, f64)> {
        vec![
            (Parameter::JointStiffness, self.stiffness_n_m_per_rad),
            (Parameter::JointDamping, self.damping_n_m_s_per_rad),
            (Parameter::RestCurl, self.rest_rad),
            (Parameter::BendingStiffness, self.stiffness_n_m_per_rad * self.length_m),
        ]
    }

    fn set(&mut self, parameter: Parameter, value: f64) {
        match parameter {
            Parameter::JointStiffness => self.stiffness_n_m_per_rad = value,
            Parameter::JointDamping => self.damping_n_m_s_per_rad = value,
            Parameter::RestCurl => self.rest_rad = value,
            Parameter::BendingStiffness => self.stiffness_n_m_per_rad = value / self.length_m,
            _ => {}
        }
    }

    fn add_sensitivity(&self, parameter: Parameter, chain: &Chain, motion: &Motion, q: &mut [f64]) {
        for bend in bends(chain, motion) {
            let slope = match parameter {
                Parameter::JointStiffness => bend.angle_rad - self.rest_rad,
                Parameter::JointDamping => bend.rate_rad_s,
                Parameter::RestCurl => -self.stiffness_n_m_per_rad,
                Parameter::BendingStiffness => (bend.angle_rad - self.rest_rad) / self.length_m,
                _ => 0.0,
            };
            bend.add_torque(slope, q);
        }
    }

    fn energy_j(&self, chain: &Chain, motion: &Motion) -> f64 {
        let of_bend = |b: Bend| 0.5 * self.stiffness_n_m_per_rad * (b.angle_rad - self.rest_rad).powi(2) / b.ratio;
        bends(chain, motion).map(of_bend).sum()
    }
}

/// `joint_cubic_stiffness`: T = k₃Δ³, energy ¼k₃Δ⁴/σ.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CubicSpring;

impl Law for CubicSpring {
    const PARAMETER: Parameter = Parameter::JointCubicStiffness;

    fn add_torque(&self, chain: &Chain, motion: &Motion, k3: f64, q: &mut [f64]) {
        bends(chain, motion).for_each(|bend| bend.add_torque(k3 * bend.angle_rad.powi(3), q));
    }

    fn add_partials(&self, chain: &Chain, motion: &Motion, k3: f64, partials: &mut Partials) {
        bends(chain, motion).for_each(|bend| bend.add_slope(3.0 * k3 * bend.angle_rad.powi(2), &mut partials.theta));
    }

    fn energy_j(&self, chain: &Chain, motion: &Motion, k3: f64) -> f64 {
        bends(chain, motion).map(|b| 0.25 * k3 * b.angle_rad.powi(4) / b.ratio).sum()
    }
}

/// `joint_hysteretic`: T = T_h z, with z of each joint after Bouc and Wen (A = 1, β = γ = ½, n = 1), Δ_y being the yield angle:
///
/// ```text
/// ż = [Δ̇ − ½|Δ̇| z − ½Δ̇ |z|] / Δ_y
/// ```
///
/// z moves along the same curve of Δ however fast: the loss a cycle does not depend on frequency. |z| never exceeds 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hysteresis {
    /// T_h.
    pub torque_n_m: f64,
    /// Δ_y.
    pub yield_rad: f64,
}

impl Hysteresis {
    /// ż Δ_y, and its slopes with Δ̇ and with z: Δ̇ [1 − ½(sgn Δ̇ + sgn z) z].
    fn flow(motion: &Motion, bend: &Bend, z: f64) -> (f64, f64, f64) {
        let rate = bend.rate_rad_s;
        let signs = match motion.sides.get(2 * bend.upper..2 * bend.upper + 2) {
            Some(sides) => sides[0] + sides[1],
            None => rate.signum() + z.signum(),
        };
        let open = 1.0 - 0.5 * signs * z;
        (rate * open, open, -0.5 * signs * rate)
    }
}

impl Effect for Hysteresis {
    fn hidden(&self, chain: &Chain) -> usize {
        chain.count() - 1
    }

    /// T_h, and the bend Δ_y at which it yields.
    fn of_hidden(&self, _chain: &Chain) -> [f64; 2] {
        [self.torque_n_m.abs(), self.yield_rad]
    }

    fn add_torque(&self, chain: &Chain, motion: &Motion, q: &mut [f64]) {
        let n = chain.count();
        for bend in bends(chain, motion) {
            let row = n + bend.upper;
            bend.add_torque(self.torque_n_m * motion.rate[row], q);
            q[row] += Self::flow(motion, &bend, motion.rate[row]).0 / self.yield_rad - motion.acceleration[row];
        }
    }

    fn add_partials(&self, chain: &Chain, motion: &Motion, partials: &mut Partials) {
        let n = chain.count();
        for bend in bends(chain, motion) {
            let row = n + bend.upper;
            let (_, with_rate, with_z) = Self::flow(motion, &bend, motion.rate[row]);
            partials.rate[(bend.upper, row)] += self.torque_n_m;
            partials.rate[(bend.upper + 1, row)] -= self.torque_n_m;
            partials.rate[(row, bend.upper)] -= bend.ratio * with_rate / self.yield_rad;
            partials.rate[(row, bend.upper + 1)] += bend.ratio * with_rate / self.yield_rad;
            partials.rate[(row, row)] += with_z / self.yield_rad;
            partials.acceleration[(row, row)] -= 1.0;
        }
    }

    fn parameters(&self) -> Vec<(Parameter, f64)> {
        vec![(Parameter::HysteresisTorque, self.torque_n_m), (Parameter::HysteresisYield, self.yield_rad)]
    }

    fn set(&mut self, parameter: Parameter, value: f64) {
        match parameter {
            Parameter::HysteresisTorque => self.torque_n_m = value,
            Parameter::HysteresisYield => self.yield_rad = value,
            _ => {}
        }
    }

    fn add_sensitivity(&self, parameter: Parameter, chain: &Chain, motion: &Motion, q: &mut [f64]) {
        let n = chain.count();
        for bend in bends(chain, motion) {
            let row = n + bend.upper;
            match parameter {
                Parameter::HysteresisTorque => bend.add_torque(motion.rate[row], q),
                Parameter::HysteresisYield => {
                    q[row] -= Self::flow(motion, &bend, motion.rate[row]).0 / self.yield_rad.powi(2);
                }
                _ => {}
            }
        }
    }

    /// Δ̇ and z of every joint.
    fn add_switching_functions(&self, chain: &Chain, motion: &Motion, corners: &mut Vec<f64>) {
        let n = chain.count();
        bends(chain, motion).for_each(|bend| corners.extend([bend.rate_rad_s, motion.rate[n + bend.upper]]));
    }

    /// ½T_hΔ_y z²/σ: what the spring T_h/Δ_y of small motions stores.
    fn energy_j(&self, chain: &Chain, motion: &Motion) -> f64 {
        let n = chain.count();
        let z = |b: &Bend| motion.rate[n + b.upper];
        bends(chain, motion).map(|b| 0.5 * self.torque_n_m * self.yield_rad * z(&b).powi(2) / b.ratio).sum()
    }
}

/// The bend between link `upper` and the next.
struct Bend {
    upper: usize,
    /// σ.
    ratio: f64,
    /// Δ.
    angle_rad: f64,
    /// Δ̇.
    rate_rad_s: f64,
}

impl Bend {
    fn add_torque(&self, torque_n_m: f64, q: &mut [f64]) {
        q[self.upper] += torque_n_m;
        q[self.upper + 1] -= torque_n_m;
    }

    /// Adds ∂T/∂Δ = `slope` for both links.
    fn add_slope(&self, slope: f64, partials: &mut DMatrix<f64>) {
        let slope = self.ratio * slope;
        let (i, j) = (self.upper, self.upper + 1);
        partials[(i, j)] += slope;
        partials[(i, i)] -= slope;
        partials[(j, j)] -= slope;
        partials[(j, i)] += slope;
    }
}

fn bends<'a>(chain: &'a Chain, motion: &'a Motion) -> impl Iterator<Item = Bend> + 'a {
    (0..chain.count() - 1).map(|upper| {
        let ratio = chain.joint_ratio(upper);
        Bend {
            upper,
            ratio,
            angle_rad: ratio * (motion.theta_rad[upper + 1] - motion.theta_rad[upper]),
            rate_rad_s: ratio * (motion.rate[upper + 1] - motion.rate[upper]),
        }
    })
}
