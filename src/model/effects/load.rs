//! Loads along the chain: a force and a moment on each link, handed up from link to link.
//!
//! What acts on link i, as a force Fᵢ and a moment Mᵢ about its upper pivot, turns every link above it as well. With the directions across a link and back
//! along it, uₖ = (cos θₖ, sin θₖ) and wₖ = (−sin θₖ, cos θₖ), y up, the torques of the work done (virtual work) are
//!
//! ```text
//! Qₖ = Mₖ + Lₖ uₖ·Σ_{i>k} Fᵢ
//! ```
//!
//! A load depends on its link's angle, rate and acceleration, and on how the link's upper pivot moves,
//!
//! ```text
//! v = Σ_{l<i} Lₗ θ̇ₗ uₗ + (ẋₚ, 0)        a = Σ_{l<i} Lₗ (θ̈ₗ uₗ + θ̇ₗ² wₗ) + (ẍₚ, 0)
//! ```
//!
//! so that one way down the chain and up again gives the torques of n links in n steps, and their derivatives in n².

use nalgebra::{Matrix2, Matrix3x2, Vector2, Vector3};

use crate::model::{Chain, Motion, Partials};

/// A force (N: sideways, up) and its moment about the link's upper pivot (N·m).
pub type Load = Vector3<f64>;

/// A load with its derivatives.
#[derive(Debug, Clone, Copy, Default)]
pub struct LoadSlopes {
    /// The load.
    pub load: Load,
    /// With the velocity of the link's upper pivot.
    pub velocity: Matrix3x2<f64>,
    /// With the acceleration of the link's upper pivot.
    pub acceleration: Matrix3x2<f64>,
    /// With the link's own angle, the upper pivot moving as it does.
    pub own_angle: Load,
    /// With its own rate.
    pub own_rate: Load,
    /// With its own acceleration.
    pub own_acceleration: Load,
}

/// Velocity and acceleration of a point.
type Moving = (Vector2<f64>, Vector2<f64>);

/// A link of a moving chain.
#[derive(Debug, Clone, Copy)]
pub struct MovingLink {
    /// Its place from the top.
    pub number: usize,
    /// Its length.
    pub length_m: f64,
    /// θ̇.
    pub rate_rad_s: f64,
    /// θ̈.
    pub acceleration_rad_s2: f64,
    /// u.
    pub across: Vector2<f64>,
    /// w.
    pub back: Vector2<f64>,
    /// v.
    pub pivot_m_s: Vector2<f64>,
    /// a.
    pub pivot_m_s2: Vector2<f64>,
}

impl MovingLink {
    fn of(chain: &Chain, motion: &Motion, number: usize, (pivot_m_s, pivot_m_s2): Moving) -> Self {
        let (sin, cos) = (motion.sin[number], motion.cos[number]);
        Self {
            number,
            length_m: chain.length_m(number),
            rate_rad_s: motion.rate[number],
            acceleration_rad_s2: motion.acceleration[number],
            across: Vector2::new(cos, sin),
            back: Vector2::new(-sin, cos),
            pivot_m_s,
            pivot_m_s2,
        }
    }

    /// vₙ at a distance down the link.
    pub fn speed_m_s(&self, down_m: f64) -> f64 {
        self.across.dot(&self.pivot_m_s) + down_m * self.rate_rad_s
    }

    /// How the lower end moves: its velocity and acceleration.
    fn end(&self) -> Moving {
        let turning = self.across * self.acceleration_rad_s2 + self.back * self.rate_rad_s.powi(2);
        (self.pivot_m_s + self.across * (self.length_m * self.rate_rad_s), self.pivot_m_s2 + turning * self.length_m)
    }
}

/// How the uppermost pivot moves.
fn top(motion: &Motion) -> Moving {
    (Vector2::new(motion.pivot_m_s, 0.0), Vector2::new(motion.pivot_m_s2, 0.0))
}

/// The links from the top.
pub fn links<'m>(chain: &'m Chain, motion: &'m Motion) -> impl Iterator<Item = MovingLink> + 'm {
    let mut pivot = top(motion);
    (0..chain.count()).map(move |number| {
        let link = MovingLink::of(chain, motion, number, pivot);
        pivot = link.end();
        link
    })
}

/// Visits the links from the bottom: from the last up to this one, whose upper pivot moves so.
fn upwards(chain: &Chain, motion: &Motion, (number, pivot): (usize, Moving), visit: &mut impl FnMut(&MovingLink)) {
    if number < chain.count() {
        let link = MovingLink::of(chain, motion, number, pivot);
        upwards(chain, motion, (number + 1, link.end()), visit);
        visit(&link);
    }
}

/// What the way down and up costs of a law in a step, in the unit of [`Work`](crate::model::Work).
pub fn work(chain: &Chain) -> u64 {
    let n = chain.count() as u64;
    n * (8 + n) / 4
}

/// Adds the torques of a load on every link.
pub fn add_torque(chain: &Chain, motion: &Motion, load: impl Fn(&MovingLink) -> Load, q: &mut [f64]) {
    let mut below_n = Vector2::zeros();
    upwards(chain, motion, (0, top(motion)), &mut |link| {
        let own = load(link);
        q[link.number] += own.z + link.length_m * link.across.dot(&below_n);
        below_n += own.xy();
    });
}

/// Adds their derivatives.
pub fn add_partials(chain: &Chain, motion: &Motion, load: impl Fn(&MovingLink) -> LoadSlopes, partials: &mut Partials) {
    let mut below_n = Vector2::zeros();
    let (mut with_velocity, mut with_acceleration) = (Matrix2::zeros(), Matrix2::zeros());
    upwards(chain, motion, (0, top(motion)), &mut |link| {
        let (i, own) = (link.number, load(link));
        let lever = link.across * link.length_m;
        // what reaches this link's torque from links above, which move its pivot and all that hangs on it
        let torque_with_velocity = own.velocity.row(2) + lever.transpose() * with_velocity;
        let torque_with_acceleration = own.acceleration.row(2) + lever.transpose() * with_acceleration;
        // what its own motion does to the forces that hang on it, and on links above
        let [angle, rate, acceleration] = Reach::of(chain, motion, i)
            .map(|reach| with_velocity * reach.velocity + with_acceleration * reach.acceleration);
        partials.theta[(i, i)] += own.own_angle.z + lever.dot(&angle) + link.length_m * link.back.dot(&below_n);
        partials.rate[(i, i)] += own.own_rate.z + lever.dot(&rate);
        partials.acceleration[(i, i)] += own.own_acceleration.z + lever.dot(&acceleration);
        let [angle, rate, acceleration] =
            [angle + own.own_angle.xy(), rate + own.own_rate.xy(), acceleration + own.own_acceleration.xy()];
        for above in 0..i {
            let reach = Reach::of(chain, motion, above);
            let torque = |reach: &Reach| {
                (torque_with_velocity * reach.velocity + torque_with_acceleration * reach.acceleration).x
            };
            let lever = reach[2].acceleration;
            for (matrix, reach, force) in [
                (&mut partials.theta, &reach[0], &angle),
                (&mut partials.rate, &reach[1], &rate),
                (&mut partials.acceleration, &reach[2], &acceleration),
            ] {
                matrix[(i, above)] += torque(reach);
                matrix[(above, i)] += lever.dot(force);
            }
        }
        partials.pivot_velocity[i] += torque_with_velocity.x;
        partials.pivot_acceleration[i] += torque_with_acceleration.x;
        below_n += own.load.xy();
        with_velocity += own.velocity.fixed_rows::<2>(0);
        with_acceleration += own.acceleration.fixed_rows::<2>(0);
    });
}

/// How the end of a link moves more where the link's angle, rate or acceleration is larger: all pivots below do.
struct Reach {
    velocity: Vector2<f64>,
    acceleration: Vector2<f64>,
}

impl Reach {
    /// With the angle, the rate, the acceleration.
    fn of(chain: &Chain, motion: &Motion, link: usize) -> [Self; 3] {
        let (length_m, rate, acceleration) = (chain.length_m(link), motion.rate[link], motion.acceleration[link]);
        let across = Vector2::new(motion.cos[link], motion.sin[link]) * length_m;
        let back = Vector2::new(-motion.sin[link], motion.cos[link]) * length_m;
        [
            Self { velocity: back * rate, acceleration: back * acceleration - across * (rate * rate) },
            Self { velocity: across, acceleration: back * (2.0 * rate) },
            Self { velocity: Vector2::zeros(), acceleration: across },
        ]
    }
}
