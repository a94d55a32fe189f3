//! The strip's motion in time, in the lowest modes about its rest.
//!
//! The freedoms are q = q₀ + V z with few modes V; angles, forces and masses are those of the whole strip, so large swings are followed:
//!
//! ```text
//! (VᵀMV) z̈ + Vᵀ∫ μ (x_z ẍ꜀ + d_z d̈꜀) ds = −VᵀR − 2ξω ż        ẍ꜀ = −∫₀ˢ sin θ θ̇² ds,  d̈꜀ = −∫₀ˢ cos θ θ̇² ds
//! ```
//!
//! by Runge and Kutta's method of the fourth order, with a step that is a small part of the highest mode's period.

use nalgebra::{DMatrix, DVector};

use super::{Load, Rest, Support};
use crate::error::{Error, Result};

/// ω h of the highest mode: the method's error in a period is then below 10⁻⁵.
const STEP_RAD: f64 = 0.15;

/// A strip in motion.
pub struct Motion<'a> {
    rest: &'a Rest,
    load: &'a dyn Load,
    /// θ and κ at the points a unit of each coordinate.
    turns: DMatrix<f64>,
    bends: DMatrix<f64>,
    /// θ(0) a unit of each coordinate.
    at_support: DVector<f64>,
    /// 2ξω of each mode.
    damping_per_s: DVector<f64>,
    step_s: f64,
    /// z.
    pub coordinates: DVector<f64>,
    /// ż.
    pub rates: DVector<f64>,
}

impl<'a> Motion<'a> {
    /// The first modes of a strip, at rest, with one damping ratio for all. The load may be another than that of the rest: then it moves.
    ///
    /// # Errors
    /// [`Error::Simulation`] where the rest is not stable.
    pub fn of(rest: &'a Rest, load: &'a dyn Load, modes: usize, damping_ratio: f64) -> Result<Self> {
        let vibration = rest.vibration().filter(|v| v.squares_rad2_s2.first().is_some_and(|square| *square > -1e-9));
        let vibration = vibration.ok_or_else(|| Error::Simulation {
            detail: "the strip's rest is not stable; check its mass, stiffness, curl_per_m and rig.support".into(),
        })?;
        let modes = modes.min(vibration.shapes.ncols());
        let shapes = vibration.shapes.columns(0, modes).into_owned();
        let omega = DVector::from_fn(modes, |k, _| vibration.squares_rad2_s2[k].max(0.0).sqrt());
        let mesh = &rest.mesh;
        let bends: Vec<DVector<f64>> =
            shapes.column_iter().map(|shape| DVector::from_vec(mesh.curvatures(shape.as_slice()))).collect();
        Ok(Self {
            rest,
            load,
            turns: mesh.angle_derivatives() * &shapes,
            bends: DMatrix::from_columns(&bends),
            at_support: shapes.row(0).transpose(),
            damping_per_s: &omega * (2.0 * damping_ratio),
            step_s: STEP_RAD / omega.max(),
            coordinates: DVector::zeros(modes),
            rates: DVector::zeros(modes),
        })
    }

    /// Moves on.
    ///
    /// # Errors
    /// [`Error::Simulation`] where the motion has no end.
    pub fn advance(&mut self, time_s: f64) -> Result<()> {
        let steps = (time_s / self.step_s).ceil().max(1.0);
        let h = time_s / steps;
        for _ in 0..steps as usize {
            let (z, v) = (self.coordinates.clone(), self.rates.clone());
            let a1 = self.acceleration(&z, &v)?;
            let (v2, v3, a2, a3);
            v2 = &v + &a1 * (0.5 * h);
            a2 = self.acceleration(&(&z + &v * (0.5 * h)), &v2)?;
            v3 = &v + &a2 * (0.5 * h);
            a3 = self.acceleration(&(&z + &v2 * (0.5 * h)), &v3)?;
            let v4 = &v + &a3 * h;
            let a4 = self.acceleration(&(&z + &v3 * h), &v4)?;
            self.coordinates += (v + v2 * 2.0 + v3 * 2.0 + v4) * (h / 6.0);
            self.rates += (a1 + a2 * 2.0 + a3 * 2.0 + a4) * (h / 6.0);
        }
        Ok(())
    }

    /// θ at the points.
    fn angles(&self, coordinates: &DVector<f64>) -> Vec<f64> {
        let rest = self.rest.mesh.angles(self.rest.freedoms.as_slice());
        (&self.turns * coordinates).iter().zip(rest).map(|(turn, rest)| rest + turn).collect()
    }

    /// z̈.
    fn acceleration(&self, coordinates: &DVector<f64>, rates: &DVector<f64>) -> Result<DVector<f64>> {
        let (strip, mesh) = (&self.rest.strip, &self.rest.mesh);
        let angles = self.angles(coordinates);
        let turning = &self.turns * rates;
        let points = mesh.points();
        let trigonometry: Vec<(f64, f64)> = angles.iter().map(|a| a.sin_cos()).collect();
        let weight = |p: usize| mesh.weight_m(p);
        // what a coordinate moves the points by, and the acceleration that turning alone gives them
        let of = |slope: &dyn Fn(usize) -> f64| {
            let mut moved = self.turns.clone();
            for mut column in moved.column_iter_mut() {
                let slopes: Vec<f64> = (0..points).map(|p| slope(p) * column[p]).collect();
                column.copy_from_slice(&mesh.integrals(&slopes));
            }
            moved
        };
        let along = [of(&|p| trigonometry[p].1), of(&|p| -trigonometry[p].0)];
        let turned = |f: &dyn Fn(usize) -> f64| {
            mesh.integrals(&(0..points).map(|p| -f(p) * turning[p] * turning[p]).collect::<Vec<_>>())
        };
        let drawn = [turned(&|p| trigonometry[p].0), turned(&|p| trigonometry[p].1)];
        let mu = strip.mass_per_length_kg_m;
        let tip_n = self.load.tip_force_n();
        let mut mass = DMatrix::zeros(rates.len(), rates.len());
        let mut force = DVector::zeros(rates.len());
        let local: Vec<_> = (0..points).map(|p| self.load.force(mesh.s_m(p), angles[p]).force_n_m).collect();
        for axis in 0..2 {
            let own = if axis == 1 { mu * strip.gravity_m_s2 } else { 0.0 };
            let mut weighed = along[axis].clone();
            for (p, mut row) in weighed.row_iter_mut().enumerate() {
                row *= weight(p);
            }
            mass += along[axis].tr_mul(&weighed) * mu;
            let acting = DVector::from_fn(points, |p, _| local[p][axis] + own - mu * drawn[axis][p]);
            force += weighed.tr_mul(&acting);
            let at_tip = DVector::from_fn(points, |p, _| {
                let slope = if axis == 0 { trigonometry[p].1 } else { -trigonometry[p].0 };
                weight(p) * slope * tip_n[axis]
            });
            force += self.turns.tr_mul(&at_tip);
        }
        let curvatures = mesh.curvatures(self.rest.freedoms.as_slice());
        let bent = &self.bends * coordinates;
        let moments = DVector::from_fn(points, |p, _| {
            let s_m = mesh.s_m(p);
            let stiffness = strip.bending_stiffness_n_m2 * self.load.stiffness_ratio(s_m);
            weight(p) * stiffness * (curvatures[p] + bent[p] - strip.curl_per_m - self.load.curl_per_m(s_m))
        });
        force -= self.bends.tr_mul(&moments);
        if let Support::Hinged { stiffness_n_m_per_rad } = strip.support {
            let angle = self.rest.freedoms[0] + self.at_support.dot(coordinates);
            force -= &self.at_support * (stiffness_n_m_per_rad * (angle - strip.support_angle_rad));
        }
        force -= self.damping_per_s.component_mul(rates);
        let lost = || Error::Simulation {
            detail: "the strip's motion cannot be followed; lower the load or the release".into(),
        };
        mass.cholesky().map(|factor| factor.solve(&force)).filter(|a| a.iter().all(|v| v.is_finite())).ok_or_else(lost)
    }

    /// x of a point (m).
    pub fn x_m(&self, s_m: f64) -> f64 {
        let mesh = &self.rest.mesh;
        let sines: Vec<f64> = self.angles(&self.coordinates).iter().map(|a| a.sin()).collect();
        mesh.interpolated(&mesh.integrals(&sines), s_m)
    }

    /// Kinetic and stored energy (J), without that of loads.
    pub fn energy_j(&self) -> f64 {
        let (strip, mesh) = (&self.rest.strip, &self.rest.mesh);
        let angles = self.angles(&self.coordinates);
        let turning = &self.turns * &self.rates;
        let integrals = |f: &dyn Fn(usize) -> f64| mesh.integrals(&(0..mesh.points()).map(f).collect::<Vec<_>>());
        let across = integrals(&|p| angles[p].cos() * turning[p]);
        let down = integrals(&|p| -angles[p].sin() * turning[p]);
        let depth = integrals(&|p| angles[p].cos());
        let bent = &self.bends * &self.coordinates;
        let curvatures = mesh.curvatures(self.rest.freedoms.as_slice());
        let of = |p: usize| {
            let moving = 0.5 * strip.mass_per_length_kg_m * (across[p].powi(2) + down[p].powi(2));
            let raised = -strip.mass_per_length_kg_m * strip.gravity_m_s2 * depth[p];
            let curvature = curvatures[p] + bent[p] - strip.curl_per_m;
            mesh.weight_m(p) * (moving + raised + 0.5 * strip.bending_stiffness_n_m2 * curvature.powi(2))
        };
        let spring = match strip.support {
            Support::Hinged { stiffness_n_m_per_rad } => {
                let angle = self.rest.freedoms[0] + self.at_support.dot(&self.coordinates);
                0.5 * stiffness_n_m_per_rad * (angle - strip.support_angle_rad).powi(2)
            }
            Support::Clamped => 0.0,
        };
        (0..mesh.points()).map(of).sum::<f64>() + spring
    }
}
