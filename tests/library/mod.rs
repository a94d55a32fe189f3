//! Two rods, written out once more and integrated by a library (`diffsol`), with its forward sensitivities.
//!
//! State θ₁, θ₂, ω₁, ω₂ and, with hysteresis, z. The derivatives come from dual numbers: nothing of the model's own derivatives is used.

mod dual;
mod own;

use std::cell::RefCell;

use diffsol::{DiffsolError, NalgebraLU, NalgebraMat, OdeBuilder, SensitivitiesOdeSolverMethod};
use dual::{CARRIED, Dual, Number};
use freeswing::experiment::{Effects, Experiment, Hysteresis, Model, Specimen};

const _: () = assert!(CARRIED == STATES + COEFFICIENTS);
type Matrix = NalgebraMat<f64>;
type Solver = NalgebraLU<f64>;

/// The directions of the derivatives: K, C, c of the hinge, θ₁, θ₂, ω₁, ω₂ at the start.
pub const DIRECTIONS: usize = 7;

/// A swing of two equal rods under gravity.
#[derive(Debug, Clone)]
pub struct TwoRods {
    /// K, C, c of the hinge, θ₁, θ₂, ω₁, ω₂ at the start.
    pub values: [f64; DIRECTIONS],
    /// c of the quadratic drag.
    pub air_quadratic: f64,
    pub hysteresis: Option<Hysteresis>,
}

/// How the library is to integrate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Method {
    /// Backward differences of orders 1 to 5.
    Bdf,
    /// Singly diagonally implicit Runge–Kutta method of order 4.
    Esdirk34,
    /// Explicit Runge–Kutta method of order 5 by Tsitouras.
    Tsit45,
}

/// Tolerance, relative and absolute in one, of angles in rad and of rates in rad/s.
#[derive(Debug, Clone, Copy)]
pub struct Tolerance {
    pub of_state: f64,
    /// Of the derivatives, each for a relative change of its coefficient, or for 1 rad or rad/s; `None` leaves them unwatched.
    pub of_slopes: Option<f64>,
}

/// Angles at every instant asked for, with their derivatives in every direction.
pub struct Swing {
    pub theta_rad: Vec<[f64; 2]>,
    pub slopes: Vec<[[f64; 2]; DIRECTIONS]>,
}

/// θ₁, θ₂, ω₁, ω₂, z.
const STATES: usize = 5;
/// K, C, c of the hinge.
const COEFFICIENTS: usize = 3;
const LENGTH_M: f64 = 0.1;
const GRAVITY_M_S2: f64 = 9.80665;
/// Of each rod.
const MASS_KG: f64 = 0.1803e-3;

impl TwoRods {
    /// The same as an experiment.
    pub fn experiment(&self) -> Experiment {
        let [k, c, hinge, theta_1, theta_2, ..] = self.values;
        let effects = Effects {
            hinge_viscous: Some(hinge),
            air_quadratic: (self.air_quadratic > 0.0).then_some(self.air_quadratic),
            joint_hysteretic: self.hysteresis,
            ..Effects::default()
        };
        let release_rad = vec![theta_1, theta_2];
        let model = Model { k_eq_n_m_per_rad: k, c_eq_n_m_s_per_rad: c, release_rad, effects, ..Model::default() };
        let specimen = Specimen { mass_kg: 2.0 * MASS_KG, link_lengths_m: vec![LENGTH_M; 2], ..Specimen::default() };
        let mut experiment = Experiment { specimen, model, ..Experiment::default() };
        experiment.rig.gravity_m_s2 = GRAVITY_M_S2;
        experiment
    }

    /// One relative change of a coefficient, 1 rad, 1 rad/s: what a derivative is multiplied with to compare it.
    pub fn units(&self) -> [f64; DIRECTIONS] {
        std::array::from_fn(|i| if i < 3 { self.values[i].abs().max(1e-9) } else { 1.0 })
    }

    fn states(&self) -> usize {
        if self.hysteresis.is_some() { 5 } else { 4 }
    }

    /// dy/dt. Rods: a₁₁ = 4/3 mL², a₁₂ = 1/2 mL², a₂₂ = 1/3 mL², h₁ = 3/2 mL, h₂ = 1/2 mL.
    fn flow<T: Number>(&self, y: &[T], p: &[T], out: &mut [T]) {
        let square = MASS_KG * LENGTH_M * LENGTH_M;
        let (a11, a22) = (T::of(4.0 / 3.0 * square), T::of(square / 3.0));
        let gravity = GRAVITY_M_S2 * MASS_KG * LENGTH_M;
        let (sin, cos) = (y[0] - y[1]).sin_cos();
        let a12 = T::of(0.5 * square) * cos;
        let turn = T::of(0.5 * square) * sin;
        let rate = y[3] - y[2];
        let mut joint = p[0] * (y[1] - y[0]) + p[1] * rate;
        if let Some(law) = self.hysteresis {
            joint = joint + T::of(law.torque_n_m) * y[4];
            let half = T::of(0.5);
            out[4] = (rate - half * rate.abs() * y[4] - half * rate * y[4].abs()) * T::of(1.0 / law.yield_rad);
        }
        let mut q1 = joint - turn * y[3] * y[3] - T::of(1.5 * gravity) * y[0].sin_cos().0 - p[2] * y[2];
        let mut q2 = turn * y[2] * y[2] - T::of(0.5 * gravity) * y[1].sin_cos().0 - joint;
        if self.air_quadratic > 0.0 {
            let c = self.air_quadratic;
            q1 = q1 - T::of(0.25 * c * LENGTH_M.powi(4)) * y[2] * y[2].abs();
            for (s_m, weight_m) in lower_points_m() {
                let speed = T::of(LENGTH_M) * cos * y[2] + T::of(s_m) * y[3];
                let force = T::of(c * weight_m) * speed * speed.abs();
                q1 = q1 - force * T::of(LENGTH_M) * cos;
                q2 = q2 - force * T::of(s_m);
            }
        }
        let determinant = a11 * a22 - a12 * a12;
        out[0] = y[2];
        out[1] = y[3];
        out[2] = (a22 * q1 - a12 * q2) / determinant;
        out[3] = (a11 * q2 - a12 * q1) / determinant;
    }

    /// Lets the library swing them; `times_s` begin after 0.
    pub fn swing(&self, method: Method, tolerance: Tolerance, times_s: &[f64]) -> Result<Swing, DiffsolError> {
        let states = self.states();
        let here = RefCell::new(Linear::default());
        let mut builder = OdeBuilder::<Matrix>::new()
            .p(self.values)
            .h0(1e-4)
            .rtol(tolerance.of_state)
            .atol(vec![tolerance.of_state; states])
            .rhs_sens_implicit(
                |y, p, _, out| self.flow(y, p, out),
                |y, p, _, dy, out| here.borrow_mut().at(self, y, p).along(0, dy, out),
                |y, p, _, dp, out| here.borrow_mut().at(self, y, p).along(STATES, &dp[..COEFFICIENTS], out),
            )
            .init_sens(
                |p, _, y| {
                    y.fill(0.0);
                    y[..4].copy_from_slice(&p[3..]);
                },
                |_, _, dp, dy| {
                    dy.fill(0.0);
                    dy[..4].copy_from_slice(&dp[3..]);
                },
                states,
            );
        builder = match tolerance.of_slopes {
            Some(slopes) => builder.sens_rtol(slopes).sens_atol(vec![slopes; states]).param_scales(self.units()),
            None => builder.turn_off_sensitivities_error_control(),
        };
        let problem = builder.build()?;
        let (theta, slopes, _) = match method {
            Method::Bdf => problem.bdf_sens::<Solver>()?.solve_dense_sensitivities(times_s)?,
            Method::Esdirk34 => problem.esdirk34_sens::<Solver>()?.solve_dense_sensitivities(times_s)?,
            Method::Tsit45 => problem.tsit45_sens()?.solve_dense_sensitivities(times_s)?,
        };
        let angles = |of: &Matrix, column: usize| [of[(0, column)], of[(1, column)]];
        let columns = 0..times_s.len();
        Ok(Swing {
            theta_rad: columns.clone().map(|column| angles(&theta, column)).collect(),
            slopes: columns.map(|column| std::array::from_fn(|i| angles(&slopes[i], column))).collect(),
        })
    }
}

/// The linearised equations at one state. A library asks for their products with one vector after another: they are derived once.
#[derive(Default)]
struct Linear {
    y: [f64; STATES],
    p: [f64; COEFFICIENTS],
    rows: Option<[Dual; STATES]>,
}

impl Linear {
    fn at(&mut self, rods: &TwoRods, y: &[f64], p: &[f64]) -> &Self {
        let p = &p[..COEFFICIENTS];
        if self.rows.is_none() || self.y[..y.len()] != *y || self.p != *p {
            self.y[..y.len()].copy_from_slice(y);
            self.p.copy_from_slice(p);
            let state: [Dual; STATES] = std::array::from_fn(|i| Dual::variable(self.y[i], i));
            let coefficients: [Dual; COEFFICIENTS] = std::array::from_fn(|i| Dual::variable(p[i], STATES + i));
            let mut rows = [Dual::of(0.0); STATES];
            rods.flow(&state, &coefficients, &mut rows);
            self.rows = Some(rows);
        }
        self
    }

    /// The product with a vector of the derivatives from number `first` on.
    fn along(&self, first: usize, vector: &[f64], out: &mut [f64]) {
        for (out, row) in out.iter_mut().zip(self.rows.iter().flatten()) {
            *out = row.slopes[first..].iter().zip(vector).map(|(slope, v)| slope * v).sum();
        }
    }
}

/// Equal panels of the lower rod: the one in which |vₙ|vₙ has its corner errs by a part in 10⁶ of the drag, the others not at all.
const PANELS: usize = 16;

/// The five-point Gauss–Legendre rule on each panel of the lower rod.
fn lower_points_m() -> impl Iterator<Item = (f64, f64)> {
    let inner = 2.0 * (10.0f64 / 7.0).sqrt();
    let (near, far) = ((5.0 - inner).sqrt() / 3.0, (5.0 + inner).sqrt() / 3.0);
    let (heavy, light) = ((322.0 + 13.0 * 70.0f64.sqrt()) / 900.0, (322.0 - 13.0 * 70.0f64.sqrt()) / 900.0);
    let points = [(-far, light), (-near, heavy), (0.0, 128.0 / 225.0), (near, heavy), (far, light)];
    let half_m = 0.5 * LENGTH_M / PANELS as f64;
    (0..PANELS)
        .flat_map(move |panel| points.map(|(x, weight)| (half_m * (2.0 * panel as f64 + 1.0 + x), half_m * weight)))
}
