//! The unknown torque: a smooth random process at one place, estimated around a fitted motion by a Kalman filter and smoother.
//!
//! ```text
//! state   z = (δθ, δrate, u, δp, e, b)   u' = −u/T + w,   sd of u: σ
//! seen    left = ∂(angle)/∂θ δθ (+ u) + e + Φb + white noise
//! ```
//!
//! e is what goes on from row to row of each angle's noise, Φb what a tracked angle may err in step with the swing ([`crate::fit::whitening`]); a smooth
//! torque must not be blamed for them. White noise that two angles share is taken out of the second by what the first one shows of it.
//!
//! The initial state and the base parameters are free as in the fit itself (their prior is wide), so that u holds only what they cannot absorb.
//! `ln L(σ) − ln L(0)` says how much the recording asks for it.
//!
//! Its course given the whole recording is that of Bryson and Frazier's smoother, which inverts no covariance: λ and Λ go backwards over each
//! seen value (ν its innovation, S that one's variance, K the gain) and each step Φ,
//!
//! ```text
//! λ ← (1 − KH)ᵀλ − Hᵀν/S      Λ ← (1 − KH)ᵀΛ(1 − KH) + HᵀH/S      then λ ← Φᵀλ, Λ ← ΦᵀΛΦ
//! z = z⁻ − P⁻λ                cov z = P⁻ − P⁻ΛP⁻                   (⁻: predicted from the rows before)
//! ```

use nalgebra::{DMatrix, DVector};

use super::effect::Place;
use super::linearisation::{Input, Linearisation};
use super::refit::Refit;
use crate::fit::angle_correlation::ConditionalCache;
use crate::fit::whitening::{Colour, RecordNoise, SYNCHRONOUS_TERMS, synchronous_basis};
use crate::statistics::median_step_s;

/// Standard deviations of the fitted state and parameters at which their prior stands (numerics: as good as free).
const WIDE: f64 = 300.0;
/// Least white noise beside noise that goes on, in units of its variance (numerics: next to none).
const WHITE: f64 = 1e-4;
/// Sizes tried, a factor each (start values).
pub(super) const SIZES: usize = 9;
const SIZE_FACTOR: f64 = 3.0;

/// What is assumed of an unknown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Form {
    /// Any smooth course in time.
    TimeHistory(Input),
    /// Any law of the state at a place ([`super::basis_law`]).
    Law(Place),
}

impl Form {
    /// Where it acts.
    pub fn place(self) -> Place {
        match self {
            Self::TimeHistory(input) => input.place(),
            Self::Law(place) => place,
        }
    }

    /// The name in files.
    pub fn id(self) -> &'static str {
        match self {
            Self::TimeHistory(_) => "course",
            Self::Law(_) => "law",
        }
    }
}

/// An unknown torque (or offset).
#[derive(Debug, Clone)]
pub struct LatentForce {
    /// What it is.
    pub form: Form,
    /// Its standard deviation: N·m, or rad of the camera.
    pub size: f64,
    /// How much likelier it makes the recordings, in natural logarithm.
    pub gain: f64,
    /// (size, gain) of every size tried, in order of size.
    pub tried: Vec<(f64, f64)>,
}

impl LatentForce {
    /// Of the size with the largest gain, of some (size, gain) beside nothing.
    pub fn likeliest(form: Form, tried: impl Iterator<Item = (f64, f64)>) -> Self {
        let tried: Vec<(f64, f64)> = std::iter::once((0.0, 0.0)).chain(tried).collect();
        let (size, gain) = tried.iter().copied().max_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((0.0, 0.0));
        Self { form, size, gain, tried }
    }

    /// Where it acts.
    pub fn place(&self) -> Place {
        self.form.place()
    }
}

/// Sizes to try, up to a large one.
pub fn sizes(typical: f64) -> [f64; SIZES] {
    std::array::from_fn(|k| typical * SIZE_FACTOR.powi(k as i32 + 1 - SIZES as i32))
}

/// Events that the Kalman filter reports.
enum Stage<'s> {
    /// A row, before anything of it is seen: state and covariance.
    Row(&'s DVector<f64>, &'s DMatrix<f64>),
    /// A value of a mark: how it depends on the state, the innovation, its variance, and P⁻Hᵀ.
    Value { slopes: &'s DVector<f64>, innovation: f64, variance: f64, gain: &'s DVector<f64> },
}

/// A seen value, kept for the way back: H, ν, S, P⁻Hᵀ.
struct Seen {
    slopes: DVector<f64>,
    innovation: f64,
    variance: f64,
    gain: DVector<f64>,
}

/// The filter for one recording and input.
pub struct Filter<'a> {
    around: &'a Linearisation,
    /// Of the noise, over what was thought.
    variance: f64,
    /// Of the recording.
    noise: &'a RecordNoise,
    /// Errors in step that each angle may have, `[mark][row]`; none of an angle that was not tracked.
    synchronous: Vec<Vec<[f64; SYNCHRONOUS_TERMS]>>,
    input: Input,
    /// From each row to the next, the noise included.
    transitions: Vec<DMatrix<f64>>,
    memory_s: f64,
    /// State at the first row, and parameters; with their standard deviations.
    begin: Vec<f64>,
    wide: Vec<f64>,
}

/// What the unknown has to account for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Beyond {
    /// Only what the fit leaves: its own parameters and effects are free.
    TheFit,
    /// All that the base model lacks: the effects that the fit adds to it are taken away again, and their torque is the unknown's to exert. The fitted motion
    /// is only where the balance is linear.
    TheBaseModel,
}

/// What is assumed of an unknown of any course.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LatentConfig {
    /// What it has to account for.
    pub beyond: Beyond,
    /// T, in units of the time in which the swing goes on by a radian.
    pub memory: f64,
}

impl LatentConfig {
    /// One that goes with the swing, beside a fit (judgement: its memory is a radian of it).
    pub const RESIDUAL: Self = Self { beyond: Beyond::TheFit, memory: 1.0 };
    /// All that a base model lacks: a gust or a knock as well, which are sudden (judgement: a third of that memory).
    pub const SHORT_MEMORY: Self = Self { beyond: Beyond::TheFit, memory: 0.3 };
    /// The same around another fit, for its course (judgement: the memory of the first).
    pub const TOTAL: Self = Self { beyond: Beyond::TheBaseModel, memory: 1.0 };
}

impl<'a> Filter<'a> {
    /// For a recording of a fit, and what an unknown pushes at.
    pub fn new(
        fit: &'a Refit<'_>,
        record: usize,
        (around, variance): (&'a Linearisation, f64),
        input: Input,
        LatentConfig { beyond, memory }: LatentConfig,
    ) -> Option<Self> {
        let problem = &fit.problem;
        let (model, _) = problem.model(record, &fit.x[..problem.free.len()]).ok()?;
        let memory_s = memory / model.characteristic_rad_s();
        let pattern = |k: usize| DMatrix::from_columns(&[around.pattern(input, &around.rows[k].theta_rad)]);
        let mut transitions = around.transitions(memory_s, pattern);
        let sd = |i: usize| 1.0 / fit.normal[(i, i)].max(1e-300).sqrt();
        let (start, marks) = (problem.start_of(record), problem.marks());
        let angle = (0..marks).map(|i| sd(start + i)).fold(0.0, f64::max);
        let rate = (0..marks).map(|i| sd(start + problem.shapes() + i)).fold(0.0, f64::max);
        let mut wide = vec![WIDE * angle; around.links];
        wide.extend(vec![WIDE * rate; around.links]);
        wide.extend(vec![0.0; around.rates - around.links]);
        wide.push(0.0);
        wide.extend((0..problem.free.len()).map(|i| WIDE * sd(i)));
        let noise = &problem.noise[record];
        wide.extend(vec![0.0; marks]);
        let synchronous =
            if noise.synchronous > 0.0 { synchronous_basis(&problem.records[record], noise) } else { Vec::new() };
        wide.extend(vec![variance.sqrt(); synchronous.len() * SYNCHRONOUS_TERMS]);
        let mut begin = vec![0.0; wide.len()];
        if beyond == Beyond::TheBaseModel {
            for place in fit.added().iter().filter_map(|p| fit.place(*p)) {
                let variable = around.state() + 1 + place;
                begin[variable] = if problem.free[place].is_proportional() { -fit.x[place] } else { 0.0 };
                wide[variable] = 0.0;
            }
        }
        let (step_s, total) = (median_step_s(&around.t_s)?, wide.len());
        for (transition, pair) in transitions.iter_mut().zip(around.t_s.windows(2)) {
            *transition = std::mem::take(transition).resize(total, total, 0.0);
            let first = around.state() + 1 + around.parameters;
            for (of_noise, colour) in (first..).zip(&noise.colour) {
                transition[(of_noise, of_noise)] = colour.rho.powf((pair[1] - pair[0]) / step_s);
            }
            (first + marks..total).for_each(|of_step| transition[(of_step, of_step)] = 1.0);
        }
        Some(Self { around, variance, noise, synchronous, input, transitions, memory_s, begin, wide })
    }

    /// ln L up to a constant, for a standard deviation of the unknown.
    pub fn log_likelihood(&self, size: f64) -> f64 {
        let mut log_likelihood = 0.0;
        self.run(size, &mut |stage| {
            if let Stage::Value { innovation, variance, .. } = stage {
                log_likelihood -= 0.5 * (innovation * innovation / variance + variance.ln());
            }
        });
        log_likelihood
    }

    /// The unknown at every row given the whole recording, each with its standard deviation.
    pub fn course(&self, size: f64) -> Vec<(f64, f64)> {
        let (input, total) = (self.around.state(), self.wide.len());
        // of every row: u as predicted, its column of P⁻, what was seen
        let mut rows: Vec<(f64, DVector<f64>, Vec<Seen>)> = Vec::with_capacity(self.around.rows.len());
        self.run(size, &mut |stage| match stage {
            Stage::Row(z, p) => rows.push((z[input], p.column(input).into_owned(), Vec::new())),
            Stage::Value { slopes, innovation, variance, gain } => {
                let seen = Seen { slopes: slopes.clone(), innovation, variance, gain: gain.clone() };
                if let Some((_, _, of_row)) = rows.last_mut() {
                    of_row.push(seen);
                }
            }
        });
        let mut pull = DVector::<f64>::zeros(total);
        let mut weight = DMatrix::<f64>::zeros(total, total);
        let mut course = Vec::with_capacity(rows.len());
        for (k, (predicted, column, seen)) in rows.iter().enumerate().rev() {
            for Seen { slopes, innovation, variance, gain } in seen.iter().rev() {
                let along = (gain.dot(&pull) + innovation) / variance;
                pull.axpy(-along, slopes, 1.0);
                let across = &weight * gain / *variance;
                let whole = gain.dot(&across) / variance + 1.0 / variance;
                weight -= &across * slopes.transpose() + slopes * across.transpose();
                weight.ger(whole, slopes, slopes, 1.0);
            }
            let variance = column[input] - column.dot(&(&weight * column));
            course.push((predicted - column.dot(&pull), variance.max(0.0).sqrt()));
            if k > 0 {
                let transition = &self.transitions[k - 1];
                pull = transition.tr_mul(&pull);
                weight = transition.tr_mul(&(weight * transition));
            }
        }
        course.reverse();
        course
    }

    /// Adds what is new at a row of the noise that goes on.
    fn add_noise(&self, k: usize, p: &mut DMatrix<f64>) {
        if self.noise.is_white() {
            return;
        }
        let fresh = |(mark, place): (usize, usize)| {
            let rho = if k > 0 { self.transitions[k - 1][(place, place)] } else { 0.0 };
            let Colour { share, .. } = self.noise.colour[mark];
            self.around.rows[k].sd_rad[mark] * (self.variance * share * (1.0 - rho * rho)).sqrt()
        };
        let sd_rad: Vec<f64> = self.of_noise().enumerate().map(fresh).collect();
        for (mark, place) in self.of_noise().enumerate() {
            p[(place, place)] += sd_rad[mark] * sd_rad[mark];
            for before in 0..mark {
                let both = self.noise.across.between(before, mark) * sd_rad[before] * sd_rad[mark];
                let other = place - (mark - before);
                p[(other, place)] += both;
                p[(place, other)] += both;
            }
        }
    }

    /// Where the noise of each angle stands in the state.
    fn of_noise(&self) -> std::ops::Range<usize> {
        let first = self.around.state() + 1 + self.around.parameters;
        first..first + self.noise.colour.len()
    }

    /// Runs the filter; `hear` gets all that it comes by.
    fn run(&self, size: f64, on_event: &mut dyn FnMut(Stage<'_>)) {
        let (n, total) = (self.around.links, self.wide.len());
        let input = self.around.state();
        let mut z = DVector::from_column_slice(&self.begin);
        let mut p = DMatrix::from_fn(total, total, |i, j| if i == j { self.wide[i] * self.wide[i] } else { 0.0 });
        p[(input, input)] = size * size;
        let mut moved = DMatrix::zeros(total, total);
        let (mut slopes, mut gain) = (DVector::zeros(total), DVector::zeros(total));
        let goes_together = !self.noise.across.is_none();
        let mut memo = ConditionalCache::new(&self.noise.across);
        for k in 0..self.around.rows.len() {
            if k > 0 {
                let transition = &self.transitions[k - 1];
                z = transition * &z;
                transition.mul_to(&p, &mut moved);
                moved.mul_to(&transition.transpose(), &mut p);
                let fade = (self.around.t_s[k] - self.around.t_s[k - 1]) / self.memory_s;
                p[(input, input)] += size * size * (1.0 - (-2.0 * fade).exp());
            }
            self.add_noise(k, &mut p);
            on_event(Stage::Row(&z, &p));
            let row = &self.around.rows[k];
            // of the marks above: which, what is left, how it is seen, its white noise
            let mut above: Vec<(usize, f64, DVector<f64>, f64)> = Vec::new();
            for (mark, left) in row.left_rad.iter().enumerate() {
                let Some(mut left) = *left else { continue };
                (0..n).for_each(|i| slopes[i] = row.observed[(mark, i)]);
                if self.input == Input::Camera {
                    slopes[input] = 1.0;
                }
                self.of_noise().enumerate().for_each(|(of, i)| slopes[i] = f64::from(u8::from(of == mark)));
                for (of, shapes) in self.synchronous.iter().enumerate() {
                    let first = self.of_noise().end + of * SYNCHRONOUS_TERMS;
                    let own = if of == mark { shapes[k] } else { [0.0; SYNCHRONOUS_TERMS] };
                    slopes.rows_mut(first, SYNCHRONOUS_TERMS).copy_from_slice(&own);
                }
                let mut white_rad = self.white_sd_rad(k, mark);
                if goes_together {
                    let own = (mark, left, slopes.clone(), white_rad);
                    let marks: Vec<usize> = above.iter().map(|other| other.0).collect();
                    let given = memo.given(mark, &marks);
                    for ((_, other, of_other, other_rad), part) in above.iter().zip(&given.beta) {
                        let shared = part * white_rad / other_rad;
                        left -= shared * other;
                        slopes.axpy(-shared, of_other, 1.0);
                    }
                    white_rad *= given.sd;
                    above.push(own);
                }
                p.mul_to(&slopes, &mut gain);
                let variance = white_rad * white_rad + slopes.dot(&gain);
                let innovation = left - slopes.dot(&z);
                on_event(Stage::Value { slopes: &slopes, innovation, variance, gain: &gain });
                z.axpy(innovation / variance, &gain, 1.0);
                p.ger(-1.0 / variance, &gain, &gain, 1.0);
                slopes.fill(0.0);
            }
        }
    }

    /// Of the white noise of a mark at a row.
    fn white_sd_rad(&self, k: usize, mark: usize) -> f64 {
        let white = (1.0 - self.noise.colour[mark].share).max(WHITE);
        (white * self.variance).sqrt() * self.around.rows[k].sd_rad[mark]
    }
}

/// The unknown with any course, of the size that makes the recordings likeliest. `typical` is a large size: gravity's torque, or the noise.
pub fn likeliest(filters: &[Filter<'_>], input: Input, typical: f64) -> LatentForce {
    let nothing: f64 = filters.iter().map(|f| f.log_likelihood(0.0)).sum();
    let gain = |size: f64| -> f64 { filters.iter().map(|f| f.log_likelihood(size)).sum::<f64>() - nothing };
    LatentForce::likeliest(Form::TimeHistory(input), sizes(typical).into_iter().map(|size| (size, gain(size))))
}
