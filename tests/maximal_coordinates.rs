//! The equations of motion against a formulation that shares nothing with them: maximal coordinates.
//!
//! Every link is a free rigid body with the coordinates q = (x, y, θ) of its centre of mass, y up. Constraint forces λ hold the hinge and
//! the joints together; everything else is a force or a couple on a body:
//!
//! ```text
//! ⎡ M  −Aᵀ ⎤ ⎡ q̈ ⎤   ⎡ F ⎤      M = diag(m, m, I) of every body, and the air's
//! ⎣ A   0  ⎦ ⎣ λ ⎦ = ⎣ b ⎦      A q̈ = b: the constraints, differentiated twice
//! ```
//!
//! With u = (sin θ, −cos θ) down a link and n = (cos θ, sin θ) across it, the point at r below its centre of mass has
//!
//! ```text
//! p = (x, y) + r u      ṗ = (ẋ, ẏ) + r θ̇ n      p̈ = (ẍ, ÿ) + r θ̈ n − r θ̇² u
//! ```
//!
//! and a force f there is the force f and the couple r n·f. The hinge holds the first link's upper end on the pivot, each joint the upper end
//! of a link on the lower end of the one above. A hinge that sticks is one constraint more, θ̈₁ = 0, whose λ is the friction's couple.
//!
//! The air that moves with a body has T = ½∫mₐ vₙ² ds, vₙ = n·ṗ, a function of this body's q and q̇ alone. Its generalised forces,
//! −d/dt ∂T/∂q̇ + ∂T/∂q, are differentiated by number: along q̇ by differences, exact as T is a square; along θ by complex steps,
//! f′(θ) = Im f(θ + iε)/ε, which lose no digits.

use freeswing::experiment::{Effects, Experiment, Hysteresis, Inertia, Link, Model, Specimen, SupportMotion};
use freeswing::model::effects::outside::NodalForces;
use freeswing::model::{ForwardModel, Hinge};
use nalgebra::{Complex, DMatrix, DVector, Vector2, Vector3};
use rand::rngs::Xoshiro256PlusPlus;
use rand::{RngExt, SeedableRng};

/// Numbers of links.
const COUNTS: [usize; 5] = [1, 2, 3, 7, 20];
/// Largest disagreement, as a part of the largest acceleration.
const AGREES: f64 = 1e-8;
/// Rods of a bending strip between marks.
const PIECES: usize = 8;

// ---- the bodies

struct Body {
    mass_kg: f64,
    inertia_kg_m2: f64,
    /// From its upper end down to its centre of mass, and from there to its lower end.
    above_m: f64,
    below_m: f64,
    theta_rad: f64,
    omega_rad_s: f64,
    /// Of the centre of mass.
    velocity_m_s: Vector2<f64>,
}

impl Body {
    fn down(&self) -> Vector2<f64> {
        Vector2::new(self.theta_rad.sin(), -self.theta_rad.cos())
    }

    fn across(&self) -> Vector2<f64> {
        Vector2::new(self.theta_rad.cos(), self.theta_rad.sin())
    }

    /// vₙ at r.
    fn speed_across_m_s(&self, r_m: f64) -> f64 {
        self.across().dot(&(self.velocity_m_s + self.across() * (self.omega_rad_s * r_m)))
    }

    /// Gauss–Legendre points and weights of 16 panels on each side of the point where vₙ changes sign, or of the middle.
    fn points_m(&self) -> Vec<(f64, f64)> {
        let (top, bottom) = (-self.above_m, self.below_m);
        let turn = -self.speed_across_m_s(0.0) / self.omega_rad_s;
        let turn = if turn > top && turn < bottom { turn } else { 0.5 * (top + bottom) };
        let panel = |from: f64, to: f64, k: usize| {
            let (width, reach) = ((to - from) / 16.0, (3.0f64 / 5.0).sqrt());
            let middle = from + (k as f64 + 0.5) * width;
            [(-reach, 5.0), (0.0, 8.0), (reach, 5.0)].map(|(x, w)| (middle + 0.5 * width * x, width * w / 18.0))
        };
        (0..32).flat_map(|k| if k < 16 { panel(top, turn, k) } else { panel(turn, bottom, k - 16) }).collect()
    }

    fn air(&self, mass_kg_m: f64) -> Air {
        Air { mass_kg_m, points_m: self.points_m(), theta_rad: self.theta_rad }
    }
}

/// The links of a specimen as bodies at rest, in their masses and lengths as `experiment.toml` explains them.
fn bodies_of(experiment: &Experiment) -> Vec<Body> {
    let specimen = &experiment.specimen;
    let pieces = if experiment.model.effects.distributed_flexibility.is_some() { PIECES } else { 1 };
    let lengths_m: Vec<f64> =
        specimen.lengths_m().iter().flat_map(|length| std::iter::repeat_n(length / pieces as f64, pieces)).collect();
    let total_m: f64 = lengths_m.iter().sum();
    let body = |(i, &length_m): (usize, &f64)| {
        let rod_kg = specimen.mass_kg * length_m / total_m;
        let (mass_kg, above_m, inertia_kg_m2) = match (specimen.links.get(i), &specimen.lumps) {
            (Some(link), _) => (link.mass_kg, link.com_m, link.inertia_kg_m2),
            (None, Some(lumps)) => (specimen.mass_kg * lumps[i + 1], length_m, 0.0),
            (None, None) => (rod_kg, 0.5 * length_m, rod_kg * length_m * length_m / 12.0),
        };
        let below_m = length_m - above_m;
        let (theta_rad, omega_rad_s, velocity_m_s) = (0.0, 0.0, Vector2::zeros());
        Body { mass_kg, inertia_kg_m2, above_m, below_m, theta_rad, omega_rad_s, velocity_m_s }
    };
    lengths_m.iter().enumerate().map(body).collect()
}

// ---- the air that moves with a body

struct Air {
    mass_kg_m: f64,
    points_m: Vec<(f64, f64)>,
    theta_rad: f64,
}

impl Air {
    const STEP: f64 = 1e-30;

    /// T of (ẋ, ẏ, θ̇) at θ.
    fn energy_j(&self, theta_rad: Complex<f64>, [x, y, omega]: [f64; 3]) -> Complex<f64> {
        let speed = |r: f64| theta_rad.cos() * x + theta_rad.sin() * y + r * omega;
        let sum: Complex<f64> = self.points_m.iter().map(|(r, weight)| speed(*r) * speed(*r) * *weight).sum();
        sum * (0.5 * self.mass_kg_m)
    }

    /// ∂T/∂q̇.
    fn momentum(&self, theta_rad: Complex<f64>, rate: [f64; 3]) -> [Complex<f64>; 3] {
        std::array::from_fn(|j| {
            let moved = |by: f64| std::array::from_fn(|k| rate[k] + if j == k { by } else { 0.0 });
            (self.energy_j(theta_rad, moved(1.0)) - self.energy_j(theta_rad, moved(-1.0))) * 0.5
        })
    }

    /// Its mass matrix, and the forces −Ṁq̇ + ∂T/∂q.
    fn inertia(&self, rate: [f64; 3]) -> ([[f64; 3]; 3], [f64; 3]) {
        let at = |step: f64| Complex::new(self.theta_rad, step * Self::STEP);
        let unit = |j: usize| std::array::from_fn(|k| if j == k { 1.0 } else { 0.0 });
        let mass = std::array::from_fn(|j| self.momentum(at(0.0), unit(j)).map(|p| p.re));
        let mut force = self.momentum(at(rate[2]), rate).map(|p| -p.im / Self::STEP);
        force[2] += self.energy_j(at(1.0), rate).im / Self::STEP;
        (mass, force)
    }
}

// ---- one instant of a swing, as both formulations see it

struct Case {
    experiment: Experiment,
    /// (Fx, Fy) on the lower ends.
    forces_n: Vec<[f64; 2]>,
    t_s: f64,
    theta_rad: Vec<f64>,
    omega_rad_s: Vec<f64>,
    /// z of the hysteresis.
    hidden: Vec<f64>,
    sticks: bool,
}

/// θ̈, and what friction bears where the hinge sticks.
struct Answer {
    alpha_rad_s2: DVector<f64>,
    sticking_torque_n_m: f64,
}

impl Case {
    fn effects(&self) -> &Effects {
        &self.experiment.model.effects
    }

    /// Sideways velocity and acceleration of the pivot.
    fn pivot(&self) -> [f64; 2] {
        self.effects().support_motion.map_or([0.0; 2], |support| {
            let rate = std::f64::consts::TAU * support.frequency_hz;
            let phase = rate * self.t_s + support.phase_rad;
            [support.amplitude_m * rate * phase.cos(), -support.amplitude_m * rate * rate * phase.sin()]
        })
    }

    fn bodies(&self) -> Vec<Body> {
        let mut bodies = bodies_of(&self.experiment);
        let mut end_m_s = Vector2::new(self.pivot()[0], 0.0);
        for (i, body) in bodies.iter_mut().enumerate() {
            (body.theta_rad, body.omega_rad_s) = (self.theta_rad[i], self.omega_rad_s[i]);
            body.velocity_m_s = end_m_s + body.across() * (body.above_m * body.omega_rad_s);
            end_m_s = body.velocity_m_s + body.across() * (body.below_m * body.omega_rad_s);
        }
        bodies
    }

    /// Force and couple on each body.
    fn loads(&self, bodies: &[Body]) -> Vec<Vector3<f64>> {
        let (effects, rig) = (self.effects(), &self.experiment.rig);
        let mut loads = vec![Vector3::zeros(); bodies.len()];
        for (i, body) in bodies.iter().enumerate() {
            let mut push = |r_m: f64, force_n: Vector2<f64>| {
                loads[i] += Vector3::new(force_n.x, force_n.y, r_m * body.across().dot(&force_n));
            };
            let field_m_s2 = Vector2::new(effects.side_force.unwrap_or(0.0), -rig.gravity_m_s2);
            push(0.0, field_m_s2 * body.mass_kg);
            if let Some(force_n) = self.forces_n.get(i) {
                push(body.below_m, Vector2::from(*force_n));
            }
            for (r_m, weight_m) in body.points_m() {
                let speed = body.speed_across_m_s(r_m);
                let drag_n_m = effects.air_linear.unwrap_or(0.0) * speed
                    + effects.air_quadratic.unwrap_or(0.0) * speed * speed.abs();
                push(r_m, body.across() * (-drag_n_m * weight_m));
            }
        }
        loads[0].z -= effects.hinge_viscous.unwrap_or(0.0) * bodies[0].omega_rad_s
            + effects.hinge_stiffness.unwrap_or(0.0) * bodies[0].theta_rad;
        if !self.sticks {
            loads[0].z -= effects.hinge_coulomb.unwrap_or(0.0) * bodies[0].omega_rad_s.signum();
        }
        for upper in 0..bodies.len() - 1 {
            let couple_n_m = self.joint_n_m(upper, &bodies[upper], &bodies[upper + 1]);
            loads[upper].z += couple_n_m;
            loads[upper + 1].z -= couple_n_m;
        }
        loads
    }

    /// The couple with which a joint turns the link above it.
    fn joint_n_m(&self, upper: usize, above: &Body, below: &Body) -> f64 {
        let (model, effects) = (&self.experiment.model, self.effects());
        let (bend_rad, rate_rad_s) = (below.theta_rad - above.theta_rad, below.omega_rad_s - above.omega_rad_s);
        if let Some(bending_n_m2) = effects.distributed_flexibility {
            // bending moment = EI × curvature
            let length_m = 0.5 * (above.above_m + above.below_m + below.above_m + below.below_m);
            let marks_m = self.experiment.specimen.link_lengths_m.iter().sum::<f64>()
                / self.experiment.specimen.link_lengths_m.len() as f64;
            let natural_per_m = effects.rest_curl.unwrap_or(0.0) / marks_m;
            let damping_n_m2_s = model.c_eq_n_m_s_per_rad * marks_m;
            return bending_n_m2 * (bend_rad / length_m - natural_per_m) + damping_n_m2_s * rate_rad_s / length_m;
        }
        model.k_eq_n_m_per_rad * (bend_rad - effects.rest_curl.unwrap_or(0.0))
            + model.c_eq_n_m_s_per_rad * rate_rad_s
            + effects.joint_cubic_stiffness.unwrap_or(0.0) * bend_rad.powi(3)
            + effects.joint_hysteretic.map_or(0.0, |law| law.torque_n_m * self.hidden[upper])
    }

    fn by_constraints(&self) -> Answer {
        let bodies = self.bodies();
        let n = bodies.len();
        let size = 5 * n + usize::from(self.sticks);
        let mut matrix = DMatrix::zeros(size, size);
        let mut right = DVector::zeros(size);
        for (i, (body, load)) in bodies.iter().zip(self.loads(&bodies)).enumerate() {
            for (k, inertia) in [body.mass_kg, body.mass_kg, body.inertia_kg_m2].into_iter().enumerate() {
                matrix[(3 * i + k, 3 * i + k)] = inertia;
                right[3 * i + k] = load[k];
            }
            if let Some(mass_kg_m) = self.effects().added_mass {
                let rate = [body.velocity_m_s.x, body.velocity_m_s.y, body.omega_rad_s];
                let (mass, force) = body.air(mass_kg_m).inertia(rate);
                for k in 0..3 {
                    right[3 * i + k] += force[k];
                    (0..3).for_each(|l| matrix[(3 * i + k, 3 * i + l)] += mass[k][l]);
                }
            }
        }
        right[3 * n] = self.pivot()[1];
        // one row of A, for the point at r of a body: `side` × its acceleration along x (0) or y (1)
        let mut constrain = |joint: usize, i: usize, r_m: f64, side: f64| {
            let body = &bodies[i];
            for axis in 0..2 {
                let row = 3 * n + 2 * joint + axis;
                for (column, value) in [(3 * i + axis, side), (3 * i + 2, side * r_m * body.across()[axis])] {
                    matrix[(row, column)] = value;
                    matrix[(column, row)] = -value;
                }
                right[row] += side * r_m * body.omega_rad_s.powi(2) * body.down()[axis];
            }
        };
        for i in 0..n {
            constrain(i, i, -bodies[i].above_m, 1.0);
            if i + 1 < n {
                constrain(i + 1, i, bodies[i].below_m, -1.0);
            }
        }
        if self.sticks {
            (matrix[(size - 1, 2)], matrix[(2, size - 1)]) = (1.0, -1.0);
        }
        let solved = solve(&matrix, &right);
        let sticking_torque_n_m = if self.sticks { -solved[size - 1] } else { 0.0 };
        Answer { alpha_rad_s2: DVector::from_fn(n, |i, _| solved[3 * i + 2]), sticking_torque_n_m }
    }

    fn by_the_model(&self) -> Answer {
        let mut model = ForwardModel::of(&self.experiment).unwrap();
        if !self.forces_n.is_empty() {
            model = model.with_forces(NodalForces { force_n: self.forces_n.clone(), from_s: 0.0, until_s: 9.0 });
        }
        let rate = [self.omega_rad_s.clone(), self.hidden.clone()].concat();
        let mut motion = model.motion(self.t_s, &self.theta_rad, &rate);
        if self.sticks {
            motion.hinge = Hinge::Sticks;
        }
        model.accelerate(&mut motion).unwrap();
        let n = self.theta_rad.len();
        for (joint, z) in self.hidden.iter().enumerate() {
            let rate_rad_s = self.omega_rad_s[joint + 1] - self.omega_rad_s[joint];
            let yields = if rate_rad_s * z > 0.0 { 1.0 - z.abs() } else { 1.0 };
            let flow_per_s = rate_rad_s * yields / self.effects().joint_hysteretic.unwrap().yield_rad;
            assert!((motion.acceleration[n + joint] - flow_per_s).abs() <= 1e-12 * flow_per_s.abs());
        }
        let sticking_torque_n_m = if self.sticks { model.sticking_torque_n_m(&motion) } else { 0.0 };
        Answer { alpha_rad_s2: DVector::from_column_slice(&motion.acceleration[..n]), sticking_torque_n_m }
    }

    /// The disagreement as a part of the largest acceleration.
    fn disagreement(&self) -> f64 {
        let (bodies, model) = (self.by_constraints().alpha_rad_s2, self.by_the_model().alpha_rad_s2);
        (&model - &bodies).amax() / bodies.amax()
    }
}

/// Rows of all sizes stand in one matrix: each is divided by its largest entry, and what is left over is solved for once more.
fn solve(matrix: &DMatrix<f64>, right: &DVector<f64>) -> DVector<f64> {
    let size = DVector::from_iterator(matrix.nrows(), matrix.row_iter().map(|row| 1.0 / row.amax()));
    let (matrix, right) = (DMatrix::from_diagonal(&size) * matrix, right.component_mul(&size));
    let lu = matrix.clone().lu();
    let first = lu.solve(&right).unwrap();
    let left = right - matrix * &first;
    first + lu.solve(&left).unwrap()
}

// ---- random cases

#[derive(Debug, Clone, Copy)]
enum Kind {
    Rods,
    Lumps,
    Links,
}

const KINDS: [Kind; 3] = [Kind::Rods, Kind::Lumps, Kind::Links];

struct Cases(Xoshiro256PlusPlus);

impl Cases {
    fn new(seed: u64) -> Self {
        Self(Xoshiro256PlusPlus::seed_from_u64(seed))
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        self.0.random_range(low..high)
    }

    fn specimen(&mut self, kind: Kind, n: usize) -> Specimen {
        let link_lengths_m: Vec<f64> = (0..n).map(|_| self.between(0.03, 0.15)).collect();
        let strip = Specimen { mass_kg: self.between(2e-4, 2e-3), link_lengths_m, ..Specimen::default() };
        match kind {
            Kind::Rods => strip,
            Kind::Lumps => {
                let shares: Vec<f64> = (0..=n).map(|_| self.between(0.3, 1.0)).collect();
                let sum: f64 = shares.iter().sum();
                let lumps = Some(shares.iter().map(|s| s / sum).collect());
                Specimen { inertia: Inertia::Lumps, lumps, ..strip }
            }
            Kind::Links => {
                // heavy and light ones, with centres of mass that may lie beyond the joint
                let link = |length_m: &f64| {
                    let (mass_kg, com_m) = (self.between(1e-4, 3e-3), length_m * self.between(0.1, 1.3));
                    let inertia_kg_m2 = mass_kg * length_m * length_m * self.between(0.02, 0.5);
                    Link { length_m: *length_m, mass_kg, com_m, inertia_kg_m2 }
                };
                let links = strip.link_lengths_m.iter().map(link).collect();
                Specimen { links, ..strip }
            }
        }
    }

    /// Large angles, fast rates.
    fn case(&mut self, specimen: Specimen, model: Model) -> Case {
        let links = match model.effects.distributed_flexibility {
            Some(_) => PIECES * specimen.link_lengths_m.len(),
            None => specimen.lengths_m().len(),
        };
        let hidden = if model.effects.joint_hysteretic.is_some() { links - 1 } else { 0 };
        let mut draw = |count: usize, reach: f64| (0..count).map(|_| self.between(-reach, reach)).collect::<Vec<f64>>();
        let (theta_rad, omega_rad_s, hidden) = (draw(links, 3.0), draw(links, 20.0), draw(hidden, 0.95));
        let experiment = Experiment { specimen, model, ..Experiment::default() };
        Case { experiment, forces_n: Vec::new(), t_s: 0.37, theta_rad, omega_rad_s, hidden, sticks: false }
    }

    /// Forces that turn the chain about as hard as gravity.
    fn forces_n(&mut self, n: usize) -> Vec<[f64; 2]> {
        (0..n).map(|_| [self.between(-2e-3, 2e-3), self.between(-2e-3, 2e-3)]).collect()
    }
}

fn joint(k: f64, c: f64, effects: Effects) -> Model {
    Model { k_eq_n_m_per_rad: k, c_eq_n_m_s_per_rad: c, effects, ..Model::default() }
}

/// Each effect by itself, in a size that matters.
fn single_effects() -> Vec<(&'static str, Effects)> {
    let off = Effects::default;
    vec![
        ("hinge_viscous", Effects { hinge_viscous: Some(3e-6), ..off() }),
        ("hinge_coulomb", Effects { hinge_coulomb: Some(2e-5), ..off() }),
        ("hinge_stiffness", Effects { hinge_stiffness: Some(2e-4), ..off() }),
        ("joint_cubic_stiffness", Effects { joint_cubic_stiffness: Some(1e-4), ..off() }),
        (
            "joint_hysteretic",
            Effects { joint_hysteretic: Some(Hysteresis { torque_n_m: 3e-5, yield_rad: 0.05 }), ..off() },
        ),
        ("rest_curl", Effects { rest_curl: Some(0.4), ..off() }),
        ("air_linear", Effects { air_linear: Some(2e-2), ..off() }),
        ("added_mass", Effects { added_mass: Some(3e-3), ..off() }),
        ("side_force", Effects { side_force: Some(2.0), ..off() }),
        (
            "support_motion",
            Effects {
                support_motion: Some(SupportMotion { amplitude_m: 0.01, frequency_hz: 1.7, phase_rad: 0.6 }),
                ..off()
            },
        ),
    ]
}

fn all_effects() -> Effects {
    Effects {
        hinge_viscous: Some(3e-6),
        hinge_coulomb: Some(2e-5),
        hinge_stiffness: Some(2e-4),
        joint_cubic_stiffness: Some(1e-4),
        joint_hysteretic: Some(Hysteresis { torque_n_m: 3e-5, yield_rad: 0.05 }),
        rest_curl: Some(0.4),
        air_linear: Some(2e-2),
        air_quadratic: Some(1e-2),
        added_mass: Some(3e-3),
        side_force: Some(2.0),
        support_motion: Some(SupportMotion { amplitude_m: 0.01, frequency_hz: 1.7, phase_rad: 0.6 }),
        ..Effects::default()
    }
}

/// 150 specimens: rods, lumps and general links, 1 to 20 of them.
fn for_all_specimens(seed: u64, mut check: impl FnMut(&mut Cases, Specimen, &str)) {
    let mut cases = Cases::new(seed);
    for kind in KINDS {
        for n in COUNTS {
            for _ in 0..10 {
                let specimen = cases.specimen(kind, n);
                check(&mut cases, specimen, &format!("{n} {kind:?}"));
            }
        }
    }
}

/// Both formulations give the same accelerations in a case made of every specimen.
fn agree(seed: u64, name: &str, mut case: impl FnMut(&mut Cases, Specimen) -> Case) {
    let mut worst = 0.0f64;
    for_all_specimens(seed, |cases, specimen, what| {
        let gap = case(cases, specimen).disagreement();
        assert!(gap < AGREES, "{name}, {what}: {gap:e}");
        worst = worst.max(gap);
    });
    println!("{name}: the accelerations agree to {worst:.0e}");
}

#[test]
fn bare_chains_agree() {
    agree(1, "gravity alone", |cases, specimen| cases.case(specimen, joint(0.0, 0.0, Effects::default())));
}

#[test]
fn chains_with_springs_and_dampers_agree() {
    agree(2, "springs and dampers", |cases, specimen| {
        let model = joint(cases.between(0.0, 1.0), cases.between(0.0, 1e-3), Effects::default());
        cases.case(specimen, model)
    });
}

#[test]
fn every_effect_by_itself_agrees() {
    for (seed, (name, effects)) in single_effects().into_iter().enumerate() {
        let mut weight = 0.0f64;
        agree(10 + seed as u64, name, |cases, specimen| {
            let mut case = cases.case(specimen, joint(2e-4, 2e-6, effects.clone()));
            let with = case.by_constraints().alpha_rad_s2;
            case.experiment.model.effects = Effects::default();
            let without = case.by_constraints().alpha_rad_s2;
            case.experiment.model.effects = effects.clone();
            weight = weight.max((&with - &without).amax() / with.amax());
            case
        });
        assert!(weight > 0.05, "{name} is too small to be tested: {weight}");
    }
}

#[test]
fn forces_on_the_nodes_agree() {
    agree(30, "forces on the nodes", |cases, specimen| {
        let case = cases.case(specimen, joint(2e-4, 2e-6, Effects::default()));
        Case { forces_n: cases.forces_n(case.theta_rad.len()), ..case }
    });
}

#[test]
fn all_effects_together_agree() {
    agree(31, "all effects", |cases, specimen| {
        let case = cases.case(specimen, joint(2e-4, 2e-6, all_effects()));
        Case { forces_n: cases.forces_n(case.theta_rad.len()), ..case }
    });
}

#[test]
fn quadratic_drag_agrees_where_speeds_change_sign_along_a_link_too() {
    agree(34, "air_quadratic", |cases, specimen| {
        let effects = Effects { air_quadratic: Some(1e-2), ..Effects::default() };
        cases.case(specimen, joint(2e-4, 2e-6, effects))
    });
}

#[test]
fn a_held_hinge_bears_the_couple_of_its_constraint() {
    for_all_specimens(32, |cases, specimen, what| {
        let mut case = cases.case(specimen, joint(2e-4, 2e-6, all_effects()));
        case.omega_rad_s[0] = 0.0;
        case.sticks = true;
        let (bodies, model) = (case.by_constraints(), case.by_the_model());
        let largest_rad_s2 = bodies.alpha_rad_s2.amax().max(1.0);
        let gap = (&model.alpha_rad_s2 - &bodies.alpha_rad_s2).amax() / largest_rad_s2;
        assert!(gap < AGREES, "{what}: {gap:e}");
        assert!(model.alpha_rad_s2[0].abs() < 1e-12 * largest_rad_s2, "{what}: {}", model.alpha_rad_s2[0]);
        let gap = (model.sticking_torque_n_m - bodies.sticking_torque_n_m).abs() / bodies.sticking_torque_n_m.abs();
        assert!(gap < AGREES, "{what}: {} {} N m", model.sticking_torque_n_m, bodies.sticking_torque_n_m);
    });
}

#[test]
fn a_strip_that_bends_everywhere_agrees() {
    let mut cases = Cases::new(33);
    for marks in [1, 2, 3].repeat(10) {
        let effects = Effects {
            distributed_flexibility: Some(cases.between(1e-6, 1e-4)),
            rest_curl: Some(0.3),
            added_mass: Some(3e-3),
            air_linear: Some(2e-2),
            ..Effects::default()
        };
        let specimen = cases.specimen(Kind::Rods, marks);
        let gap = cases.case(specimen, joint(0.0, 2e-6, effects)).disagreement();
        assert!(gap < AGREES, "{marks} lengths between marks: {gap:e}");
    }
}
