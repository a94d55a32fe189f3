//! What the surroundings do to the whole chain.

use std::f64::consts::TAU;

use super::{Effect, Law};
use crate::model::{Chain, Motion, Parameter, Partials};

/// `side_force`: a steady sideways acceleration a, positive towards +x, Qᵢ = a hᵢ cos θᵢ, energy −a Σ hᵢ sin θᵢ.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SideForce;

impl Law for SideForce {
    const PARAMETER: Parameter = Parameter::SideForce;

    fn add_torque(&self, chain: &Chain, motion: &Motion, a: f64, q: &mut [f64]) {
        for i in 0..chain.count() {
            q[i] += a * chain.static_moment_kg_m(i) * motion.cos[i];
        }
    }

    fn add_partials(&self, chain: &Chain, motion: &Motion, a: f64, partials: &mut Partials) {
        for i in 0..chain.count() {
            partials.theta[(i, i)] -= a * chain.static_moment_kg_m(i) * motion.sin[i];
        }
    }

    fn energy_j(&self, chain: &Chain, motion: &Motion, a: f64) -> f64 {
        -(0..chain.count()).map(|i| a * chain.static_moment_kg_m(i) * motion.sin[i]).sum::<f64>()
    }

    fn sideways_m_s2(&self, a: f64) -> f64 {
        a
    }
}

/// `support_motion`: the pivot moves sideways, xₚ = S sin 2πft + C cos 2πft.
///
/// In the pivot's frame its acceleration is a side force, Qᵢ = −ẍₚ hᵢ cos θᵢ. The air sees its velocity, too.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SupportMotion {
    /// S.
    pub sine_m: f64,
    /// C.
    pub cosine_m: f64,
    /// f.
    pub frequency_hz: f64,
}

impl SupportMotion {
    /// xₚ, ẋₚ, ẍₚ.
    pub fn at(&self, t_s: f64) -> [f64; 3] {
        let rate = TAU * self.frequency_hz;
        let (sin, cos) = (rate * t_s).sin_cos();
        let position_m = self.sine_m * sin + self.cosine_m * cos;
        [position_m, rate * (self.sine_m * cos - self.cosine_m * sin), -rate * rate * position_m]
    }

    /// Derivatives of ẋₚ and ẍₚ with a parameter.
    pub fn slopes(&self, parameter: Parameter, t_s: f64) -> [f64; 2] {
        let rate = TAU * self.frequency_hz;
        let (sin, cos) = (rate * t_s).sin_cos();
        match parameter {
            Parameter::SupportSine => [rate * cos, -rate * rate * sin],
            Parameter::SupportCosine => [-rate * sin, -rate * rate * cos],
            Parameter::SupportFrequency => {
                let [x, v, a] = self.at(t_s);
                // v = 2πf u(ft), a = −(2πf)²x
                [v / self.frequency_hz - TAU * t_s * rate * x, 2.0 * a / self.frequency_hz - TAU * t_s * rate * v]
            }
            _ => [0.0; 2],
        }
    }
}

impl Effect for SupportMotion {
    fn add_torque(&self, chain: &Chain, motion: &Motion, q: &mut [f64]) {
        for i in 0..chain.count() {
            q[i] -= motion.pivot_m_s2 * chain.static_moment_kg_m(i) * motion.cos[i];
        }
    }

    fn add_partials(&self, chain: &Chain, motion: &Motion, partials: &mut Partials) {
        for i in 0..chain.count() {
            partials.theta[(i, i)] += motion.pivot_m_s2 * chain.static_moment_kg_m(i) * motion.sin[i];
            partials.pivot_acceleration[i] -= chain.static_moment_kg_m(i) * motion.cos[i];
        }
    }

    fn parameters(&self) -> Vec<(Parameter, f64)> {
        vec![
            (Parameter::SupportSine, self.sine_m),
            (Parameter::SupportCosine, self.cosine_m),
            (Parameter::SupportFrequency, self.frequency_hz),
        ]
    }

    fn set(&mut self, parameter: Parameter, value: f64) {
        match parameter {
            Parameter::SupportSine => self.sine_m = value,
            Parameter::SupportCosine => self.cosine_m = value,
            Parameter::SupportFrequency => self.frequency_hz = value,
            _ => {}
        }
    }

    /// Nothing here: the pivot's velocity and acceleration carry it, see [`SupportMotion::slopes`].
    fn add_sensitivity(&self, _: Parameter, _: &Chain, _: &Motion, _: &mut [f64]) {}

    fn pivot(&self) -> Option<&SupportMotion> {
        Some(self)
    }
}

/// Steady forces on the lower ends of the links, between two instants (paper Eq. 7–14, with the sign of Eq. 12 mended).
///
/// ```text
/// Qᵢ = Lᵢ [cos θᵢ Σ_{k≥i} Fx_k + sin θᵢ Σ_{k≥i} Fy_k]      y up
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct NodalForces {
    /// (Fx, Fy) at the lower end of each link, top to bottom.
    pub force_n: Vec<[f64; 2]>,
    /// When they act.
    pub from_s: f64,
    /// Until when.
    pub until_s: f64,
}

impl NodalForces {
    fn below_n(&self, i: usize, t_s: f64) -> [f64; 2] {
        if t_s < self.from_s || t_s > self.until_s {
            return [0.0; 2];
        }
        self.force_n.iter().skip(i).fold([0.0; 2], |sum, f| [sum[0] + f[0], sum[1] + f[1]])
    }
}

impl Effect for NodalForces {
    fn add_torque(&self, chain: &Chain, motion: &Motion, q: &mut [f64]) {
        for (i, link) in chain.links().iter().enumerate() {
            let [x_n, y_n] = self.below_n(i, motion.t_s);
            q[i] += link.length_m * (motion.cos[i] * x_n + motion.sin[i] * y_n);
        }
    }

    fn add_partials(&self, chain: &Chain, motion: &Motion, partials: &mut Partials) {
        for (i, link) in chain.links().iter().enumerate() {
            let [x_n, y_n] = self.below_n(i, motion.t_s);
            partials.theta[(i, i)] += link.length_m * (motion.cos[i] * y_n - motion.sin[i] * x_n);
        }
    }

    fn discontinuities_s(&self) -> Vec<f64> {
        vec![self.from_s, self.until_s]
    }
}
