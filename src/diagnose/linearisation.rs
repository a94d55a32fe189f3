//! A fitted motion's linearisation: what a small torque at any instant would have done to the angles.
//!
//! The balance of torques linearised along the motion (`δ` of state and parameters, `u` an input torque),
//!
//! ```text
//! δα = −(∂Q/∂α)⁻¹ [∂Q/∂θ δθ + ∂Q/∂rate δrate + ∂Q/∂p δp + B u]
//! ```
//!
//! from one row of the recording to the next, by the exponential of the matrix in the middle between them; where the swing goes far from row to row, in the
//! middle of several parts.

use nalgebra::{DMatrix, DVector};

use super::effect::Place;
use super::refit::Refit;
use crate::fit::whitening::Whitening;
use crate::model::observe::{chord_angles_rad, chord_slopes};
use crate::model::{Camera, Chain, ForwardModel, Hinge, Motion, Parameter, Partials, Trajectory};

/// The swing goes on by at most this much while the matrix is held: with more, the linear motion would grow of its own.
const HELD_RAD: f64 = 0.3;
/// A gap is not cut into more parts than this.
const MOST_PARTS: f64 = 64.0;

/// What an unknown torque (or offset) pushes at.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Input {
    /// The hinge.
    Hinge,
    /// The joint: a torque on the first link, and back on the last.
    Joint,
    /// The strip, from outside, the more the farther from the hinge, as a drag does.
    Drag,
    /// The strip, from outside, every piece by its mass, as light or a draught does; a pivot that is shaken as well.
    Push,
    /// The camera: an offset of every angle.
    Camera,
}

impl Input {
    /// Every one.
    pub const ALL: [Self; 5] = [Self::Hinge, Self::Joint, Self::Drag, Self::Push, Self::Camera];

    /// Where it acts.
    pub fn place(self) -> Place {
        match self {
            Self::Hinge => Place::Hinge,
            Self::Joint => Place::Joint,
            Self::Drag | Self::Push => Place::Air,
            Self::Camera => Place::Camera,
        }
    }
}

/// One recording's motion, linearised.
#[derive(Debug, Clone)]
pub struct Linearisation {
    /// The links.
    pub chain: Chain,
    /// Stamps of the rows.
    pub t_s: Vec<f64>,
    /// Links, and further rates of the laws.
    pub links: usize,
    /// Number of rates.
    pub rates: usize,
    /// Free parameters of the fit.
    pub parameters: usize,
    /// At each row, what happens there.
    pub rows: Vec<Row>,
    /// Of the values seen, link after link.
    whitening: Whitening,
    /// From each row to the next, part after part: d(δθ, δrate)/dt with δθ, δrate, then the parameters, then the torque on each link.
    flows: Vec<Vec<DMatrix<f64>>>,
}

/// One row of the recording beside the motion.
#[derive(Debug, Clone)]
pub struct Row {
    /// Angles between marks.
    pub chord_rad: Vec<f64>,
    /// θ.
    pub theta_rad: Vec<f64>,
    /// Rates.
    pub rate: Vec<f64>,
    /// ∂(angle seen)/∂θ, marks × links.
    pub observed: DMatrix<f64>,
    /// Measured less predicted.
    pub left_rad: Vec<Option<f64>>,
    /// Its standard deviation.
    pub sd_rad: Vec<f64>,
}

impl Linearisation {
    /// Of one recording of a fit; `None` where the motion cannot be integrated.
    pub fn of(fit: &Refit<'_>, record: usize) -> Option<Self> {
        let problem = &fit.problem;
        let data = &problem.records[record];
        let prediction = problem.predict(record, &fit.x, false).ok()?;
        let (model, swing, true_s) = fit.motion(record)?;
        let chain = model.chain();
        let (_, camera) = problem.model(record, &fit.x[..problem.free.len()]).ok()?;
        let mut rows: Vec<Row> = true_s.iter().map(|t| row(chain, &swing, *t, &camera)).collect();
        for value in &prediction.values {
            let sd_rad = problem.sd_rad(record, value.link, value.row);
            let row = &mut rows[value.row];
            row.left_rad[value.link] = data.theta_rad[value.link][value.row].map(|m| m - value.predicted_rad);
            row.sd_rad[value.link] = sd_rad;
        }
        let flows = true_s.windows(2).map(|pair| {
            let length_s = pair[1] - pair[0];
            let parts = (model.characteristic_rad_s() * length_s / HELD_RAD).ceil().clamp(1.0, MOST_PARTS) as usize;
            let middle_s = |part: usize| pair[0] + length_s * (part as f64 + 0.5) / parts as f64;
            (0..parts).map(|part| flow(&model, &problem.free, &swing, middle_s(part))).collect()
        });
        Some(Self {
            chain: chain.clone(),
            flows: flows.collect::<Option<Vec<_>>>()?,
            t_s: true_s,
            links: chain.count(),
            rates: model.rates(),
            parameters: problem.free.len(),
            rows,
            whitening: Whitening::of(problem, record, &prediction.values),
        })
    }

    /// Of every recording of a fit; `None` where one of the motions cannot be integrated.
    pub fn of_all(fit: &Refit<'_>) -> Option<Vec<Self>> {
        (0..fit.problem.records.len()).map(|record| Self::of(fit, record)).collect()
    }

    /// Rows a second, on average.
    pub fn mean_rate_hz(&self) -> f64 {
        (self.t_s.len() - 1) as f64 / (self.t_s[self.t_s.len() - 1] - self.t_s[0])
    }

    /// Number of numbers in a state: δθ and δrate.
    pub fn state(&self) -> usize {
        self.links + self.rates
    }

    /// From each row to the next, in the order state, inputs, parameters. Each column of `inputs` is a torque on the links that fades within `memory_s`
    /// (an Ornstein–Uhlenbeck process; infinite where it is held).
    pub fn transitions(&self, memory_s: f64, inputs: impl Fn(usize) -> DMatrix<f64>) -> Vec<DMatrix<f64>> {
        (0..self.flows.len()).map(|k| self.transition(k, &inputs(k), memory_s, self.parameters)).collect()
    }

    /// The same of held inputs, without the parameters.
    pub fn transitions_of_inputs(&self, inputs: impl Fn(usize) -> DMatrix<f64>) -> Vec<DMatrix<f64>> {
        (0..self.flows.len()).map(|k| self.transition(k, &inputs(k), f64::INFINITY, 0)).collect()
    }

    /// The same of one input, a sideways acceleration of the pivot (m/s²): in its frame every mass feels the opposite.
    pub fn transitions_of_pivot(&self) -> Vec<DMatrix<f64>> {
        self.transitions_of_inputs(|k| {
            let theta_rad = &self.rows[k].theta_rad;
            DMatrix::from_fn(theta_rad.len(), 1, |i, _| -self.chain.static_moment_kg_m(i) * theta_rad[i].cos())
        })
    }

    fn transition(&self, k: usize, inputs: &DMatrix<f64>, memory_s: f64, parameters: usize) -> DMatrix<f64> {
        let part_s = (self.t_s[k + 1] - self.t_s[k]) / self.flows[k].len() as f64;
        let parts =
            self.flows[k].iter().map(|flow| (self.rate_of_change(flow, inputs, memory_s, parameters) * part_s).exp());
        parts.reduce(|before, after| after * before).unwrap_or_default()
    }

    /// d(state, inputs, the first parameters)/dt, while a flow is held.
    fn rate_of_change(
        &self,
        flow: &DMatrix<f64>,
        inputs: &DMatrix<f64>,
        memory_s: f64,
        parameters: usize,
    ) -> DMatrix<f64> {
        let (state, count) = (self.state(), inputs.ncols());
        let total = state + count + parameters;
        let mut matrix = DMatrix::zeros(total, total);
        matrix.view_mut((0, 0), (state, state)).copy_from(&flow.columns(0, state));
        matrix.view_mut((0, state + count), (state, parameters)).copy_from(&flow.columns(state, parameters));
        let torques = flow.columns(state + self.parameters, self.links) * inputs;
        matrix.view_mut((0, state), (state, count)).copy_from(&torques);
        (state..state + count).for_each(|i| matrix[(i, i)] = -1.0 / memory_s);
        matrix
    }

    /// What inputs add to the angles, row after row, mark after mark, each following several courses; `held` is what they are between a row
    /// and the next, of each input; `transitions` those of held inputs.
    pub fn responses<const C: usize>(
        &self,
        transitions: &[DMatrix<f64>],
        held: &[impl AsRef<[[f64; C]]>],
    ) -> Vec<[f64; C]> {
        let (state, marks) = (self.state(), self.rows[0].observed.nrows());
        let mut z = vec![[0.0; C]; state];
        let mut next = z.clone();
        let mut all = Vec::with_capacity(self.rows.len() * marks);
        for (k, row) in self.rows.iter().enumerate() {
            if k > 0 {
                let (transition, held) = (&transitions[k - 1], held[k - 1].as_ref());
                for (i, next) in next.iter_mut().enumerate() {
                    *next = [0.0; C];
                    for (j, from) in z.iter().chain(held).enumerate() {
                        (0..C).for_each(|c| next[c] += transition[(i, j)] * from[c]);
                    }
                }
                std::mem::swap(&mut z, &mut next);
            }
            for mark in 0..marks {
                all.push(std::array::from_fn(|c| (0..self.links).map(|i| row.observed[(mark, i)] * z[i][c]).sum()));
            }
        }
        all
    }

    /// Of responses those of the values seen, link after link, whitened; one column a course.
    pub fn seen<const C: usize>(&self, responses: &[[f64; C]]) -> DMatrix<f64> {
        let marks = self.rows[0].observed.nrows();
        let of_mark = |mark: usize| {
            let rows = (0..self.rows.len()).filter(move |row| self.rows[*row].left_rad[mark].is_some());
            rows.map(move |row| row * marks + mark)
        };
        let values: Vec<usize> = (0..marks).flat_map(of_mark).collect();
        let mut columns = DMatrix::from_fn(values.len(), C, |i, c| responses[values[i]][c]);
        self.whitening.apply(&mut columns);
        columns
    }

    /// The torques on the links of a unit input, where the links stand at these angles.
    pub fn pattern(&self, input: Input, theta_rad: &[f64]) -> DVector<f64> {
        let (n, chain) = (self.links, &self.chain);
        let mut pattern = DVector::zeros(n);
        match input {
            Input::Hinge => pattern[0] = 1.0,
            Input::Joint => {
                pattern[0] = 1.0;
                pattern[n - 1] -= 1.0;
            }
            Input::Drag => {
                let mut above_m = 0.0;
                for j in 0..n {
                    let length_m = chain.length_m(j);
                    let push = length_m * (above_m + 0.5 * length_m);
                    for i in 0..j {
                        pattern[i] += chain.length_m(i) * push * (theta_rad[i] - theta_rad[j]).cos();
                    }
                    pattern[j] += length_m * length_m * (0.5 * above_m + length_m / 3.0);
                    above_m += length_m;
                }
                pattern.normalize_mut();
            }
            Input::Push => {
                (0..n).for_each(|i| pattern[i] = chain.static_moment_kg_m(i) * theta_rad[i].cos());
                pattern.normalize_mut();
            }
            Input::Camera => {}
        }
        pattern
    }
}

fn row(chain: &Chain, swing: &Trajectory, t_s: f64, camera: &Camera) -> Row {
    let state = swing.at(t_s);
    let chord_rad = chord_angles_rad(chain, &state.theta_rad);
    let mut observed = chord_slopes(chain, &state.theta_rad);
    for (mut of_mark, theta_rad) in observed.row_iter_mut().zip(&chord_rad) {
        of_mark *= camera.seen_slope(*theta_rad);
    }
    let marks = observed.nrows();
    let mut rate = state.omega_rad_s;
    rate.extend(state.hidden);
    Row { chord_rad, theta_rad: state.theta_rad, rate, observed, left_rad: vec![None; marks], sd_rad: vec![1.0; marks] }
}

/// The instant of a motion, with its accelerations.
pub fn motion_at(model: &ForwardModel, swing: &Trajectory, t_s: f64) -> Option<Motion> {
    let (step, tau) = swing.step_at(t_s)?;
    let mut motion = model.motion(t_s, &step.theta_rad(tau), &step.rate(tau));
    motion.acceleration = step.acceleration(tau);
    if model.is_dry() {
        motion.hinge = step.hinge;
    }
    Some(motion)
}

fn flow(model: &ForwardModel, free: &[Parameter], swing: &Trajectory, t_s: f64) -> Option<DMatrix<f64>> {
    let (n, m) = (model.chain().count(), model.rates());
    let motion = motion_at(model, swing, t_s)?;
    let mut partials = Partials::zero(n, m);
    model.partials(&motion, &mut partials);
    let mut right = DMatrix::zeros(m, n + m + free.len() + n);
    right.columns_mut(0, n).copy_from(&partials.theta);
    right.columns_mut(n, m).copy_from(&partials.rate);
    let mut q = vec![0.0; m];
    for (column, parameter) in free.iter().enumerate() {
        model.sensitivity(*parameter, &motion, &partials, &mut q);
        right.column_mut(n + m + column).copy_from_slice(&q);
    }
    (0..n).for_each(|link| right[(link, n + m + free.len() + link)] = 1.0);
    if motion.hinge == Hinge::Sticks {
        right.row_mut(0).fill(0.0);
    }
    let accelerations = (-partials.acceleration).lu().solve(&right)?;
    let mut flow = DMatrix::zeros(n + m, right.ncols());
    (0..n).for_each(|i| flow[(i, n + i)] = 1.0);
    flow.rows_mut(n, m).copy_from(&accelerations);
    Some(flow)
}
