//! The lumped model in the paper's own form, Eq. 22 to 25: corrected, or with its slips.
//!
//! ```text
//! | C₁ C₂ | | θ̈₁ |   | A₁ |     C₁ = (m₂+m₃)L₁     C₂ = m₃L₂ cos(θ₂−θ₁)     C₃ = m₃L₁ cos(θ₂−θ₁)     C₄ = m₃L₂
//! | C₃ C₄ | | θ̈₂ | = | A₂ |
//! A₁ = θ̇₂² L₂m₃ sin(θ₂−θ₁) + c₁(Fx₂+Fx₃) + s₁(Fy₂+Fy₃ − (m₂+m₃)g) + K(θ₂−θ₁)/L₁
//! A₂ = −θ̇₁² L₁m₃ sin(θ₂−θ₁) + c₂Fx₃ + s₂(Fy₃ − m₃g) − K(θ₂−θ₁)/L₂
//! ```
//!
//! The damper stands beside the spring in the same way.

use std::f64::consts::TAU;

use crate::error::{Error, Result};

/// Masses 2 and 3 on two massless rods.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lumps {
    /// m₂, m₃.
    pub mass_kg: [f64; 2],
    /// L₁, L₂.
    pub length_m: [f64; 2],
    /// g.
    pub gravity_m_s2: f64,
    /// K at mass 2.
    pub stiffness_n_m_per_rad: f64,
    /// C at mass 2.
    pub damping_n_m_s_per_rad: f64,
}

/// One instant.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Instant {
    /// θ₁, θ₂.
    pub theta_rad: [f64; 2],
    /// θ̇₁, θ̇₂.
    pub omega_rad_s: [f64; 2],
    /// (Fx, Fy) on the masses 2 and 3.
    pub force_n: [[f64; 2]; 2],
}

/// A departure of the printed equations from the right ones.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Slip {
    /// Eq. 12: −F_y on mass 3.
    LoadSign,
    /// Eq. 23, 24: θ̇₂² for θ̇₁² in A₂.
    RotationRate,
    /// Eq. 23, 24: +s₂m₃g in A₂.
    GravitySign,
    /// Eq. 23, 24: −c₂F_x in A₂.
    SideForceSign,
    /// Eq. 24: s₂F_x for s₂F_y in A₂.
    LoadComponent,
    /// Eq. 24: L₂ for L₁ in C₃.
    CouplingLength,
    /// Eq. 9, 10 taken as a force K(θ₂−θ₁)/L on each mass, both the same way.
    JointForcesAlike,
    /// Eq. 9, 10 taken as forces K(θ₂−θ₁)/L, one way on mass 2 and the other way on mass 3.
    JointForcesOpposed,
}

/// How a small motion about the vertical goes on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SmallMotion {
    /// It swings, at this frequency.
    Swings { hz: f64 },
    /// It grows by e in every 1/rate.
    Falls { per_s: f64 },
    /// It swings and grows.
    Flutters { hz: f64, per_s: f64 },
}

impl Lumps {
    /// θ̈₁, θ̈₂ (rad/s²) by Eq. 25, with the slips named.
    pub fn acceleration_rad_s2(&self, at: &Instant, slips: &[Slip]) -> [f64; 2] {
        let has = |slip: Slip| slips.contains(&slip);
        let [m2, m3] = self.mass_kg;
        let [l1, l2] = self.length_m;
        let g = self.gravity_m_s2;
        let [(s1, c1), (s2, c2)] = at.theta_rad.map(f64::sin_cos);
        let (s21, c21) = (at.theta_rad[1] - at.theta_rad[0]).sin_cos();
        let [[fx2, fy2], [fx3, fy3]] = at.force_n;

        let rate = if has(Slip::RotationRate) { at.omega_rad_s[1] } else { at.omega_rad_s[0] };
        let load_n = if has(Slip::LoadComponent) { fx3 } else { fy3 };
        let load_n = if has(Slip::LoadSign) { -load_n } else { load_n };
        let weight_n = if has(Slip::GravitySign) { -m3 * g } else { m3 * g };
        let side_n = if has(Slip::SideForceSign) { -fx3 } else { fx3 };
        let [joint_1_n, joint_2_n] = self.joint_n(at, slips);
        let a1 =
            at.omega_rad_s[1].powi(2) * l2 * m3 * s21 + c1 * (fx2 + fx3) + s1 * (fy2 + fy3 - (m2 + m3) * g) + joint_1_n;
        let a2 = -rate.powi(2) * l1 * m3 * s21 + c2 * side_n + s2 * (load_n - weight_n) + joint_2_n;

        let (k1, k2) = ((m2 + m3) * l1, m3 * l2 * c21);
        let (k3, k4) = (m3 * if has(Slip::CouplingLength) { l2 } else { l1 } * c21, m3 * l2);
        let determinant = k1 * k4 - k2 * k3;
        [(k4 * a1 - k2 * a2) / determinant, (k1 * a2 - k3 * a1) / determinant]
    }

    /// What spring and damper add to A₁ and A₂.
    fn joint_n(&self, at: &Instant, slips: &[Slip]) -> [f64; 2] {
        let torque_n_m = self.stiffness_n_m_per_rad * (at.theta_rad[1] - at.theta_rad[0])
            + self.damping_n_m_s_per_rad * (at.omega_rad_s[1] - at.omega_rad_s[0]);
        let [l1, l2] = self.length_m;
        // As forces along x they enter A₁ together and A₂ alone, as every nodal force does.
        let as_forces_n = |force_2_n: f64, force_3_n: f64| {
            [at.theta_rad[0].cos() * (force_2_n + force_3_n), at.theta_rad[1].cos() * force_3_n]
        };
        if slips.contains(&Slip::JointForcesAlike) {
            as_forces_n(torque_n_m / l1, torque_n_m / l2)
        } else if slips.contains(&Slip::JointForcesOpposed) {
            as_forces_n(torque_n_m / l1, -torque_n_m / l2)
        } else {
            [torque_n_m / l1, -torque_n_m / l2]
        }
    }

    /// Power that the equations create from nothing (W): dE/dt without forces and damping. The right ones create none.
    pub fn power_from_nothing_w(&self, at: &Instant, slips: &[Slip]) -> f64 {
        let [m2, m3] = self.mass_kg;
        let [l1, l2] = self.length_m;
        let [w1, w2] = at.omega_rad_s;
        let [a1, a2] = self.acceleration_rad_s2(at, slips);
        let (s21, c21) = (at.theta_rad[1] - at.theta_rad[0]).sin_cos();
        let [(s1, _), (s2, _)] = at.theta_rad.map(f64::sin_cos);
        let kinetic_w = (m2 + m3) * l1 * l1 * w1 * a1
            + m3 * l2 * l2 * w2 * a2
            + m3 * l1 * l2 * (c21 * (a1 * w2 + w1 * a2) - s21 * (w2 - w1) * w1 * w2);
        let gravity_w = self.gravity_m_s2 * ((m2 + m3) * l1 * s1 * w1 + m3 * l2 * s2 * w2);
        let spring_w = self.stiffness_n_m_per_rad * (at.theta_rad[1] - at.theta_rad[0]) * (w2 - w1);
        kinetic_w + gravity_w + spring_w
    }

    /// Kinetic energy (J).
    pub fn kinetic_energy_j(&self, at: &Instant) -> f64 {
        let [m2, m3] = self.mass_kg;
        let [l1, l2] = self.length_m;
        let [w1, w2] = at.omega_rad_s;
        let c21 = (at.theta_rad[1] - at.theta_rad[0]).cos();
        0.5 * (m2 + m3) * (l1 * w1).powi(2) + 0.5 * m3 * (l2 * w2).powi(2) + m3 * l1 * l2 * w1 * w2 * c21
    }

    /// The two small motions about the vertical without damping and forces, the slower first: θ̈ = Bθ has the rates ±√β, β of B.
    ///
    /// # Errors
    /// [`Error::Simulation`] for masses or lengths that make no pendulum.
    pub fn small_motions(&self, slips: &[Slip]) -> Result<[SmallMotion; 2]> {
        let step_rad = 1e-6;
        let column = |theta_rad: [f64; 2]| {
            let at = Instant { theta_rad, ..Instant::default() };
            self.acceleration_rad_s2(&at, slips).map(|a| a / step_rad)
        };
        let [b11, b21] = column([step_rad, 0.0]);
        let [b12, b22] = column([0.0, step_rad]);
        let (half_trace, determinant) = (0.5 * (b11 + b22), b11 * b22 - b12 * b21);
        let discriminant = half_trace * half_trace - determinant;
        if !discriminant.is_finite() {
            return Err(Error::Simulation {
                detail: "the lumps make no pendulum; give both a mass and a length".into(),
            });
        }
        if discriminant < 0.0 {
            // β = r e^(±iφ), so √β = √r e^(±iφ/2)
            let beta = nalgebra::Complex::new(half_trace, (-discriminant).sqrt()).sqrt();
            return Ok([SmallMotion::Flutters { hz: beta.im.abs() / TAU, per_s: beta.re.abs() }; 2]);
        }
        let far = half_trace + half_trace.signum() * discriminant.sqrt();
        let mut squares = [determinant / far, far];
        squares.sort_by(|a, b| a.abs().total_cmp(&b.abs()));
        Ok(squares.map(|b| {
            if b < 0.0 { SmallMotion::Swings { hz: (-b).sqrt() / TAU } } else { SmallMotion::Falls { per_s: b.sqrt() } }
        }))
    }
}
