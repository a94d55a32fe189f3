//! Forces of the air along the strip.
//!
//! At distance s down a link the strip's speed across itself, and its derivative, are
//!
//! ```text
//! vₙ(s) = u·v + s θ̇        v̇ₙ(s) = u·a + θ̇ w·v + s θ̈
//! ```
//!
//! with the link's directions u, w and its upper pivot's velocity v and acceleration a (see [`load`]). A force per length f(s) across the
//! strip is the load F = u∫f ds, M = ∫f s ds, taken by Gauss–Legendre quadrature. vₙ is linear in s, so that of a drag f s is a polynomial, of the third power
//! at most – on either side of the point where the link turns about itself and |vₙ|vₙ has its corner. There the link is cut, and the quadrature is exact.

use nalgebra::{Matrix3x2, Vector2, Vector3};

use super::Law;
use super::load::{self, Load, LoadSlopes, MovingLink};
use crate::model::{Chain, Motion, Parameter, Partials};

/// Gauss–Legendre nodes on 0..1 with their weights: exact to the third power, the highest that any law here needs.
const GAUSS: [(f64, f64); 2] = [(0.211_324_865_405_187_1, 0.5), (0.788_675_134_594_812_9, 0.5)];

/// The same, exact to the seventh power: for a force of any formula.
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
        load::add_torque(chain, motion, |link| load_of(link, points(link), |speed| -c * speed), q);
    }

    fn add_partials(&self, chain: &Chain, motion: &Motion, c: f64, partials: &mut Partials) {
        load::add_partials(chain, motion, |link| slopes_of(link, points(link), |speed| [-c * speed, -c]), partials);
    }

    fn work(&self, chain: &Chain) -> u64 {
        load::work(chain)
    }
}

/// `air_quadratic`: f = −c |vₙ| vₙ, c = ½ρC_D·width.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct QuadraticDrag;

impl Law for QuadraticDrag {
    const PARAMETER: Parameter = Parameter::AirQuadratic;

    fn add_torque(&self, chain: &Chain, motion: &Motion, c: f64, q: &mut [f64]) {
        load::add_torque(chain, motion, |link| load_of(link, points(link), |speed| -c * speed.abs() * speed), q);
    }

    fn add_partials(&self, chain: &Chain, motion: &Motion, c: f64, partials: &mut Partials) {
        let drag = |speed: f64| [-c * speed.abs() * speed, -2.0 * c * speed.abs()];
        load::add_partials(chain, motion, |link| slopes_of(link, points(link), drag), partials);
    }

    fn work(&self, chain: &Chain) -> u64 {
        load::work(chain)
    }
}

/// `added_mass`: kinetic energy ½∫mₐvₙ²ds of the air that moves with the strip. Lagrange's equations give the load
///
/// ```text
/// F = −mₐ(u∫v̇ₙds + w θ̇ V)        M = −mₐ(∫v̇ₙ s ds − w·v V)        V = ∫vₙds
/// ```
///
/// of which the terms with V turn the momentum mₐvₙu with the link.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AddedMass;

impl Law for AddedMass {
    const PARAMETER: Parameter = Parameter::AddedMass;

    fn add_torque(&self, chain: &Chain, motion: &Motion, mass: f64, q: &mut [f64]) {
        load::add_torque(chain, motion, |link| Self::load(link, mass), q);
    }

    fn add_partials(&self, chain: &Chain, motion: &Motion, mass: f64, partials: &mut Partials) {
        load::add_partials(chain, motion, |link| Self::slopes(link, mass), partials);
    }

    fn energy_j(&self, chain: &Chain, motion: &Motion, mass: f64) -> f64 {
        let of_link =
            |link: MovingLink| 0.5 * mass * points(&link).map(|at| at.weight_m * at.speed_m_s.powi(2)).sum::<f64>();
        load::links(chain, motion).map(of_link).sum()
    }

    fn work(&self, chain: &Chain) -> u64 {
        load::work(chain)
    }
}

impl AddedMass {
    /// ∫v̇ₙds, ∫v̇ₙ s ds, V, and w·v.
    fn integrals(link: &MovingLink) -> [f64; 4] {
        let (l, along_m_s) = (link.length_m, link.back.dot(&link.pivot_m_s));
        let turning = l * link.acceleration_rad_s2;
        let pivot_m_s2 = link.across.dot(&link.pivot_m_s2) + link.rate_rad_s * along_m_s;
        let sum = l * (pivot_m_s2 + turning / 2.0);
        let moment = l * l * (pivot_m_s2 / 2.0 + turning / 3.0);
        [sum, moment, l * link.speed_m_s(0.5 * l), along_m_s]
    }

    fn load(link: &MovingLink, mass: f64) -> Load {
        let [sum, moment, passing, along_m_s] = Self::integrals(link);
        stack(link.across * sum + link.back * (link.rate_rad_s * passing), moment - along_m_s * passing) * -mass
    }

    fn slopes(link: &MovingLink, mass: f64) -> LoadSlopes {
        let MovingLink { length_m: l, rate_rad_s: rate, across, back, .. } = *link;
        let [sum, _, passing, along_m_s] = Self::integrals(link);
        let end_m_s = link.speed_m_s(0.0);
        let sped_with_angle = back.dot(&link.pivot_m_s2) - rate * end_m_s;
        let mut velocity = Matrix3x2::zeros();
        let turned = across * back.transpose() + back * across.transpose();
        velocity.fixed_rows_mut::<2>(0).copy_from(&(turned * (l * rate)));
        velocity.set_row(2, &(back * (0.5 * l * l * rate - passing) - across * (along_m_s * l)).transpose());
        LoadSlopes {
            load: Self::load(link, mass),
            velocity: velocity * -mass,
            acceleration: stack(across * l, 0.5 * l * l) * across.transpose() * -mass,
            own_angle: stack(
                across * (l * sped_with_angle - rate * passing) + back * (sum + rate * l * along_m_s),
                0.5 * l * l * sped_with_angle + end_m_s * passing - l * along_m_s * along_m_s,
            ) * -mass,
            own_rate: stack(across * (l * along_m_s) + back * (passing + 0.5 * l * l * rate), 0.0) * -mass,
            own_acceleration: stack(across * (0.5 * l * l), l * l * l / 3.0) * -mass,
        }
    }
}

/// A point of a link.
#[derive(Debug, Clone, Copy)]
pub struct Point {
    /// How far down the link.
    pub down_m: f64,
    /// The length that it stands for.
    pub weight_m: f64,
    /// vₙ.
    pub speed_m_s: f64,
}

/// The points of a link at which a force per length is taken that is a polynomial of the second power at most on either side of standstill.
pub fn points(link: &MovingLink) -> impl Iterator<Item = Point> + use<> {
    nodes(link, &GAUSS)
}

/// The same for a force of any formula: exact up to the sixth power.
pub fn fine_points(link: &MovingLink) -> impl Iterator<Item = Point> + use<> {
    nodes(link, &FINE_GAUSS)
}

/// The lower end of the last link, where a force is taken whole; none of other links.
pub fn tip(chain: &Chain, link: &MovingLink) -> impl Iterator<Item = Point> + use<> {
    let end = Point { down_m: link.length_m, weight_m: 1.0, speed_m_s: link.speed_m_s(link.length_m) };
    (link.number + 1 == chain.count()).then_some(end).into_iter()
}

/// The nodes above and below the point about which a link turns.
fn nodes(link: &MovingLink, gauss: &'static [(f64, f64)]) -> impl Iterator<Item = Point> + use<> {
    let link = *link;
    let still_m = -link.speed_m_s(0.0) / link.rate_rad_s;
    let is_cut = still_m > 0.0 && still_m < link.length_m;
    let cut_m = if is_cut { still_m } else { link.length_m };
    let parts = [Some((0.0, cut_m)), is_cut.then_some((cut_m, link.length_m))];
    parts.into_iter().flatten().flat_map(move |(from_m, until_m)| {
        let length_m = until_m - from_m;
        gauss.iter().map(move |(node, weight)| {
            let down_m = from_m + node * length_m;
            Point { down_m, weight_m: weight * length_m, speed_m_s: link.speed_m_s(down_m) }
        })
    })
}

/// The load of a force per length at some points of a link.
pub fn load_of(link: &MovingLink, points: impl Iterator<Item = Point>, force_n_m: impl Fn(f64) -> f64) -> Load {
    let [mut sum, mut moment] = [0.0; 2];
    points.for_each(|at| {
        let force_n = at.weight_m * force_n_m(at.speed_m_s);
        sum += force_n;
        moment += force_n * at.down_m;
    });
    stack(link.across * sum, moment)
}

/// The same with its derivatives, of a force given with its slope.
pub fn slopes_of(
    link: &MovingLink,
    points: impl Iterator<Item = Point>,
    force_n_m: impl Fn(f64) -> [f64; 2],
) -> LoadSlopes {
    let [mut sum, mut moment] = [0.0; 2];
    // ∫f′ds, ∫f′s ds, ∫f′s²ds
    let mut slopes = [0.0; 3];
    points.for_each(|at| {
        let [force_n, slope] = force_n_m(at.speed_m_s).map(|value| at.weight_m * value);
        sum += force_n;
        moment += force_n * at.down_m;
        for (power, own) in slopes.iter_mut().enumerate() {
            *own += slope * at.down_m.powi(power as i32);
        }
    });
    let (across, back) = (link.across, link.back);
    let [with_speed, with_rate] = [[0, 1], [1, 2]].map(|[force, moment]| stack(across * slopes[force], slopes[moment]));
    LoadSlopes {
        load: stack(across * sum, moment),
        velocity: with_speed * across.transpose(),
        own_angle: with_speed * back.dot(&link.pivot_m_s) + stack(back * sum, 0.0),
        own_rate: with_rate,
        ..LoadSlopes::default()
    }
}

fn stack(force_n: Vector2<f64>, moment_n_m: f64) -> Load {
    Vector3::new(force_n.x, force_n.y, moment_n_m)
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
