//! Forces of the air along the strip.
//!
//! At distance s down link i the strip's speed across itself is, with nᵢ = (cos θᵢ, sin θᵢ) and ẋₚ the pivot's sideways velocity,
//!
//! ```text
//! vₙ(s) = Σₖ Jₖ θ̇ₖ + ẋₚ cos θᵢ        Jₖ = Lₖ cos(θᵢ−θₖ) for k < i,  Jᵢ = s
//! ```
//!
//! A force per length f(s) across the strip works on θₖ as Qₖ = ∫ f Jₖ ds (virtual work), taken by Gauss–Legendre quadrature on each link.
//! vₙ is linear in s, so f Jₖ is a polynomial, of the third power at most – on either side of the point where the link turns about itself
//! and |vₙ|vₙ has its corner. There the link is cut, and the quadrature is exact.

use std::ops::RangeInclusive;

use nalgebra::DMatrix;

use super::Law;
use crate::model::{Chain, Motion, Parameter, Partials};

/// Gauss–Legendre nodes on 0..1 with their weights: exact to the third power, the highest that any law here needs.
const GAUSS: [(f64, f64); 2] = [(0.211_324_865_405_187_1, 0.5), (0.788_675_134_594_812_9, 0.5)];

/// The same, exact to the seventh power.
const FINE_GAUSS: [(f64, f64); 4] = [
    (0.069_431_844_202_973_71, 0.173_927_422_568_726_93),
    (0.330_009_478_207_571_87, 0.326_072_577_431_273_07),
    (0.669_990_521_792_428_1, 0.326_072_577_431_273_07),
    (0.930_568_155_797_026_3, 0.173_927_422_568_726_93),
];

/// `air_linear`: f = −c vₙ.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinearDrag;

impl Law for LinearDrag {
    const PARAMETER: Parameter = Parameter::AirLinear;

    fn add_torque(&self, chain: &Chain, motion: &Motion, c: f64, q: &mut [f64]) {
        stations(chain, motion, |at| at.add_force(-c * at.speed_m_s, q));
    }

    fn add_partials(&self, chain: &Chain, motion: &Motion, c: f64, partials: &mut Partials) {
        stations(chain, motion, |at| at.add_force_partials(-c * at.speed_m_s, -c, partials));
    }
}

/// `air_quadratic`: f = −c |vₙ| vₙ, c = ½ρC_D·width.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct QuadraticDrag;

impl Law for QuadraticDrag {
    const PARAMETER: Parameter = Parameter::AirQuadratic;

    fn add_torque(&self, chain: &Chain, motion: &Motion, c: f64, q: &mut [f64]) {
        stations(chain, motion, |at| at.add_force(-c * at.speed_m_s.abs() * at.speed_m_s, q));
    }

    fn add_partials(&self, chain: &Chain, motion: &Motion, c: f64, partials: &mut Partials) {
        stations(chain, motion, |at| {
            let speed = at.speed_m_s;
            at.add_force_partials(-c * speed.abs() * speed, -2.0 * c * speed.abs(), partials);
        });
    }
}

/// `added_mass`: kinetic energy ½∫mₐvₙ²ds of the air that moves with the strip. Lagrange's equations give
///
/// ```text
/// Qₖ = −mₐ∫[Jₖ v̇ₙ + vₙ Wₖ]ds      Wₖ = J̇ₖ − ∂vₙ/∂θₖ
/// v̇ₙ = Σ Jₗθ̈ₗ − Σ_{l<i} Lₗ sin(θᵢ−θₗ)(θ̇ᵢ−θ̇ₗ)θ̇ₗ + ẍₚ cos θᵢ − ẋₚ θ̇ᵢ sin θᵢ
/// Wₖ = −Lₖ sin(θᵢ−θₖ) θ̇ᵢ for k < i,   Wᵢ = U = Σ_{l<i} Lₗ sin(θᵢ−θₗ) θ̇ₗ + ẋₚ sin θᵢ
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AddedMass;

impl Law for AddedMass {
    const PARAMETER: Parameter = Parameter::AddedMass;

    fn add_torque(&self, chain: &Chain, motion: &Motion, mass: f64, q: &mut [f64]) {
        stations(chain, motion, |at| {
            let acceleration = at.acceleration_m_s2();
            for (k, (q, arm)) in q.iter_mut().zip(at.arms_m).enumerate() {
                *q -= mass * at.weight_m * (arm * acceleration + at.speed_m_s * at.turn_m_s(k));
            }
        });
    }

    fn add_partials(&self, chain: &Chain, motion: &Motion, mass: f64, partials: &mut Partials) {
        let mut with = vec![[0.0; 3]; chain.count()];
        stations(chain, motion, |at| {
            let (i, v, a) = (at.i, at.speed_m_s, at.acceleration_m_s2());
            let factor = -mass * at.weight_m;
            for (l, with) in with.iter_mut().enumerate().take(i + 1) {
                *with = [at.acceleration_with_rate(l), at.acceleration_with_angle(l), at.speed_with_angle(l)];
            }
            // Σ of products of something of k and something of l, column after column
            for (l, [rate, angle, speed]) in with.iter().enumerate().take(i + 1) {
                let rows = 0..=i;
                let arm = at.arms_m[l];
                let own = column(&mut partials.acceleration, l, &rows);
                own.iter_mut().zip(at.arms_m).for_each(|(own, arm_k)| *own += factor * arm * arm_k);
                let own = column(&mut partials.rate, l, &rows);
                for (k, (own, arm_k)) in own.iter_mut().zip(at.arms_m).enumerate() {
                    *own += factor * (arm_k * rate + arm * at.turn_m_s(k));
                }
                let own = column(&mut partials.theta, l, &rows);
                for (k, (own, arm_k)) in own.iter_mut().zip(at.arms_m).enumerate() {
                    *own += factor * (arm_k * angle + speed * at.turn_m_s(k));
                }
            }
            // and what depends on both
            let omega = motion.rate[i];
            for k in 0..i {
                let (arm, cross) = (at.arms_m[k], at.crosses_m[k]);
                partials.rate[(k, i)] -= factor * v * cross;
                partials.rate[(i, k)] += factor * v * cross;
                partials.theta[(k, k)] += factor * (cross * a + v * arm * omega);
                partials.theta[(k, i)] -= factor * (cross * a + v * arm * omega);
                partials.theta[(i, k)] -= factor * v * arm * motion.rate[k];
                partials.theta[(i, i)] += factor * v * arm * motion.rate[k];
            }
            let (sin, cos) = (motion.sin[i], motion.cos[i]);
            partials.theta[(i, i)] += factor * v * motion.pivot_m_s * cos;
            for (k, arm) in at.arms_m.iter().enumerate() {
                let turn_with_pivot = if k == i { sin } else { 0.0 };
                let turn = at.turn_m_s(k);
                partials.pivot_velocity[k] += factor * (arm * -sin * omega + cos * turn + v * turn_with_pivot);
                partials.pivot_acceleration[k] += factor * arm * cos;
            }
        });
    }

    fn energy_j(&self, chain: &Chain, motion: &Motion, mass: f64) -> f64 {
        let mut energy_j = 0.0;
        stations(chain, motion, |at| energy_j += 0.5 * mass * at.weight_m * at.speed_m_s.powi(2));
        energy_j
    }
}

/// A point of the strip, at distance s down link i.
pub struct Station<'a> {
    motion: &'a Motion,
    i: usize,
    /// The length that it stands for.
    pub weight_m: f64,
    /// Jₖ, k = 0 … i.
    pub arms_m: &'a [f64],
    /// Lₖ sin(θᵢ−θₖ), k = 0 … i.
    crosses_m: &'a [f64],
    /// vₙ.
    pub speed_m_s: f64,
    /// U.
    slip_m_s: f64,
}

/// Up to so many links the arms need no memory of their own.
const FEW_LINKS: usize = 8;

/// Visits the points of the strip at which a force per length is taken that is a polynomial of the second power at most on either side of standstill.
pub fn stations(chain: &Chain, motion: &Motion, visit: impl FnMut(&Station<'_>)) {
    each_station(chain, motion, 0..chain.count(), visit, |length_m, still_m| {
        let [[a, b], [c, d]] =
            [above(length_m, still_m), below(length_m, still_m)].map(|part| GAUSS.map(|node| on(part, node)));
        [a, b, c, d]
    });
}

/// The same for a force of any formula: exact up to the sixth power.
pub fn fine_stations(chain: &Chain, motion: &Motion, visit: impl FnMut(&Station<'_>)) {
    each_station(chain, motion, 0..chain.count(), visit, |length_m, still_m| {
        let [[a, b, c, d], [e, f, g, h]] =
            [above(length_m, still_m), below(length_m, still_m)].map(|part| FINE_GAUSS.map(|node| on(part, node)));
        [a, b, c, d, e, f, g, h]
    });
}

/// From and until where a link lies above the point about which it turns.
fn above(length_m: f64, still_m: f64) -> [f64; 2] {
    [0.0, if still_m > 0.0 && still_m < length_m { still_m } else { length_m }]
}

/// The same below it: nothing where there is no such point.
fn below(length_m: f64, still_m: f64) -> [f64; 2] {
    [above(length_m, still_m)[1], length_m]
}

/// A node on a part, with the length that it stands for.
fn on([from_m, until_m]: [f64; 2], (node, weight): (f64, f64)) -> (f64, f64) {
    (from_m + node * (until_m - from_m), weight * (until_m - from_m))
}

/// Visits the lower end of the last link, where a force is taken whole.
pub fn tip(chain: &Chain, motion: &Motion, visit: impl FnMut(&Station<'_>)) {
    let last = chain.count() - 1;
    each_station(chain, motion, last..last + 1, visit, |length_m, _| [(length_m, 1.0)]);
}

/// Visits points of some links: `points` gives their distances down a link and the lengths that they stand for, from the link's length and the distance at
/// which it stands still.
fn each_station<const P: usize>(
    chain: &Chain,
    motion: &Motion,
    links: std::ops::Range<usize>,
    mut visit: impl FnMut(&Station<'_>),
    points: impl Fn(f64, f64) -> [(f64, f64); P],
) {
    let n = chain.count();
    let (mut few, mut many) = ([0.0; 2 * FEW_LINKS], Vec::new());
    let both = if n <= FEW_LINKS {
        &mut few[..2 * n]
    } else {
        many.resize(2 * n, 0.0);
        &mut many[..]
    };
    let (arms_m, crosses_m) = both.split_at_mut(n);
    for i in links {
        let (length_m, omega_rad_s) = (chain.length_m(i), motion.rate[i]);
        let mut end_m_s = motion.pivot_m_s * motion.cos[i];
        let mut slip_m_s = motion.pivot_m_s * motion.sin[i];
        for l in 0..i {
            arms_m[l] = chain.length_m(l) * motion.cos_difference(i, l);
            crosses_m[l] = chain.length_m(l) * motion.sin_difference(i, l);
            end_m_s += arms_m[l] * motion.rate[l];
            slip_m_s += crosses_m[l] * motion.rate[l];
        }
        crosses_m[i] = 0.0;
        for (down_m, weight_m) in points(length_m, -end_m_s / omega_rad_s) {
            if weight_m <= 0.0 {
                continue;
            }
            arms_m[i] = down_m;
            let speed_m_s = end_m_s + down_m * omega_rad_s;
            let (arms_m, crosses_m) = (&arms_m[..=i], &crosses_m[..=i]);
            visit(&Station { motion, i, weight_m, arms_m, crosses_m, speed_m_s, slip_m_s });
        }
    }
}

/// Some rows of a column.
fn column<'m>(matrix: &'m mut DMatrix<f64>, column: usize, rows: &RangeInclusive<usize>) -> &'m mut [f64] {
    let first = column * matrix.nrows();
    &mut matrix.as_mut_slice()[first + rows.start()..=first + rows.end()]
}

impl Station<'_> {
    /// ∂vₙ/∂θₗ.
    fn speed_with_angle(&self, l: usize) -> f64 {
        if l < self.i { self.crosses_m[l] * self.motion.rate[l] } else { -self.slip_m_s }
    }

    pub(super) fn add_force(&self, force_n_m: f64, q: &mut [f64]) {
        q.iter_mut().zip(self.arms_m).for_each(|(q, arm)| *q += self.weight_m * force_n_m * arm);
    }

    /// For a force per length f(vₙ) with its slope f′.
    pub(super) fn add_force_partials(&self, force_n_m: f64, slope: f64, partials: &mut Partials) {
        let (i, slope, force) = (self.i, self.weight_m * slope, self.weight_m * force_n_m);
        for l in 0..=i {
            let (with_rate, with_angle) = (slope * self.arms_m[l], slope * self.speed_with_angle(l));
            let own = column(&mut partials.rate, l, &(0..=i));
            own.iter_mut().zip(self.arms_m).for_each(|(own, arm)| *own += with_rate * arm);
            let own = column(&mut partials.theta, l, &(0..=i));
            own.iter_mut().zip(self.arms_m).for_each(|(own, arm)| *own += with_angle * arm);
        }
        // ∂Jₖ/∂θₖ = Lₖ sin(θᵢ−θₖ) = −∂Jₖ/∂θᵢ
        for (k, (arm, cross)) in self.arms_m.iter().zip(self.crosses_m).enumerate() {
            partials.theta[(k, k)] += force * cross;
            partials.theta[(k, i)] -= force * cross;
            partials.pivot_velocity[k] += arm * slope * self.motion.cos[i];
        }
    }

    /// v̇ₙ.
    fn acceleration_m_s2(&self) -> f64 {
        let Motion { rate, acceleration, sin, cos, .. } = self.motion;
        let i = self.i;
        let pivot = self.motion.pivot_m_s2 * cos[i] - self.motion.pivot_m_s * rate[i] * sin[i];
        let of_link = |l: usize| self.arms_m[l] * acceleration[l] - self.crosses_m[l] * (rate[i] - rate[l]) * rate[l];
        (0..=i).map(of_link).sum::<f64>() + pivot
    }

    /// ∂v̇ₙ/∂θ̇ₗ.
    fn acceleration_with_rate(&self, l: usize) -> f64 {
        if l < self.i {
            -self.crosses_m[l] * (self.motion.rate[self.i] - 2.0 * self.motion.rate[l])
        } else {
            -self.slip_m_s
        }
    }

    /// ∂v̇ₙ/∂θₗ.
    fn acceleration_with_angle(&self, l: usize) -> f64 {
        let Motion { rate, acceleration, sin, cos, .. } = self.motion;
        let i = self.i;
        let of_link = |k: usize| self.crosses_m[k] * acceleration[k] + self.arms_m[k] * (rate[i] - rate[k]) * rate[k];
        if l < i {
            of_link(l)
        } else {
            -(0..i).map(of_link).sum::<f64>()
                - self.motion.pivot_m_s2 * sin[i]
                - self.motion.pivot_m_s * rate[i] * cos[i]
        }
    }

    /// Wₖ.
    fn turn_m_s(&self, k: usize) -> f64 {
        if k < self.i { -self.crosses_m[k] * self.motion.rate[self.i] } else { self.slip_m_s }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::experiment::Specimen;

    fn one_rod() -> (Chain, Motion) {
        let chain = Chain::of(&Specimen { link_lengths_m: vec![0.2], ..Specimen::default() }).unwrap();
        let mut motion = Motion::zero(1, 0);
        motion.place(&[0.3]);
        motion.rate[0] = 2.0;
        (chain, motion)
    }

    #[test]
    fn drag_on_one_rod_is_the_hand_integral() {
        let (chain, motion) = one_rod();
        let mut q = [0.0];
        LinearDrag.add_torque(&chain, &motion, 0.7, &mut q);
        assert!((q[0] + 0.7 * 2.0 * 0.2f64.powi(3) / 3.0).abs() < 1e-15);
        q[0] = 0.0;
        QuadraticDrag.add_torque(&chain, &motion, 0.7, &mut q);
        assert!((q[0] + 0.7 * 4.0 * 0.2f64.powi(4) / 4.0).abs() < 1e-15);
    }

    #[test]
    fn added_mass_on_one_rod_is_a_uniform_rod_of_that_mass() {
        let (chain, mut motion) = one_rod();
        motion.acceleration[0] = -3.0;
        let mut q = [0.0];
        AddedMass.add_torque(&chain, &motion, 0.6, &mut q);
        assert!((q[0] - 3.0 * 0.6 * 0.2f64.powi(3) / 3.0).abs() < 1e-15);
    }

    #[test]
    fn the_power_of_the_drag_is_its_work_along_the_strip() {
        let chain = Chain::of(&Specimen::default()).unwrap();
        let mut motion = Motion::zero(2, 0);
        motion.place(&[0.3, -0.4]);
        motion.rate.copy_from_slice(&[2.0, -5.0]);
        let mut q = [0.0; 2];
        QuadraticDrag.add_torque(&chain, &motion, 0.01, &mut q);
        let power = q[0] * 2.0 + q[1] * -5.0;
        let station = |i: usize, s: f64| {
            let end = if i == 0 { 0.0 } else { 0.1 * 2.0 * 0.7f64.cos() };
            (end + s * motion.rate[i]).abs().powi(3)
        };
        let steps = 20_000;
        let direct: f64 = (0..2)
            .flat_map(|i| (0..steps).map(move |k| (i, (k as f64 + 0.5) * 0.1 / steps as f64)))
            .map(|(i, s)| -0.01 * station(i, s) * 0.1 / steps as f64)
            .sum();
        // the lower link's speed changes sign along it
        assert!((power - direct).abs() < 1e-8 * direct.abs(), "{power} {direct}");
    }
}
