//! A law of no particular form at one place, as an unknown: whatever torque the angle and the rate there determine, and what of it drifts; of the camera
//! whatever offset of an angle that angle determines, as a lens does, and one that drifts.
//!
//! The process of [`super::latent`] takes any course in time, and pays for it row after row; something that follows the swing, as most that acts in a
//! laboratory does, needs a handful of numbers. They are the coefficients b of some functions f of the state, their torques all of the size s:
//!
//! ```text
//! torque = Σ bₖ fₖ(angle, rate, time)      bₖ ~ N(0, s²),  fₖ of root mean square 1 along the fitted motion
//! r̃ = C̃b + noise                           r̃: residuals, C̃: what each fₖ adds to the angles, both whitened, what is free projected out
//! ln L(s) − ln L(0) = ½ Σᵢ [aᵢ² s²/(1 + s²λᵢ) − ln(1 + s²λᵢ)]      C̃ᵀC̃ = VΛVᵀ,  a = VᵀC̃ᵀr̃
//! ```

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::effect::Place;
use super::latent::{Form, LatentForce, SIZES};
use super::linearisation::{Input, Linearisation, Row};
use super::refit::Refit;
use super::screen::Projection;
use crate::fit::Record;
use crate::model::effects::{air, load};
use crate::model::{ForwardModel, Motion};

/// Below this part of the largest rate dry friction turns round, and of the largest angle play does.
const DRY: f64 = 0.05;
/// Functions of an angle and its rate.
const OF_STATE: usize = 15;
/// Functions of a speed across the strip.
const OF_SPEED: usize = 8;
/// Functions of an angle as it is seen.
const OF_VIEW: usize = 8;

/// Of an angle x and its rate v, both over their largest, and of the time τ from −½ to ½.
fn of_state(x: f64, v: f64, tau: f64) -> [f64; OF_STATE] {
    let (play, dry, drag) = ((x / DRY).tanh(), (v / DRY).tanh(), v * v.abs());
    let [a, b, c, d] = [x * x * x, x * x * v, x * v * v, v * v * v];
    [x, v, play, dry, drag, x * x, x * v, v * v, a, b, c, d, tau * x, tau * v, tau * dry]
}

/// Forces per length, of a speed over its largest and of the time.
fn of_speed(v: f64, tau: f64) -> [f64; OF_SPEED] {
    [1.0, v, (v / DRY).tanh(), v * v.abs(), v * v, v * v * v, tau, tau * v]
}

/// Offsets, of an angle over its largest and of the time. Not of the rate, nor of both: a clock and a gain that drift do what a spring and a damper do that
/// drift, and those are more common.
fn of_view(x: f64, tau: f64) -> [f64; OF_VIEW] {
    [1.0, x, x * x, x * x * x, tau, tau * tau, tau * tau * tau, tau.powi(4)]
}

/// The middle between two rows of a recording.
struct Instant {
    motion: Motion,
    tau: f64,
}

/// A recording's motion, ready for any torque.
pub struct Swing<'s> {
    /// Its linearisation.
    pub around: &'s Linearisation,
    instants: Vec<Instant>,
    /// From row to row, with a torque on each link.
    transitions: Vec<DMatrix<f64>>,
}

impl<'s> Swing<'s> {
    /// Along a linearised motion of a model; `None` where that has no accelerations.
    pub fn of(around: &'s Linearisation, model: &ForwardModel) -> Option<Self> {
        let middle = |a: &[f64], b: &[f64]| -> Vec<f64> { a.iter().zip(b).map(|(a, b)| 0.5 * (a + b)).collect() };
        let last = around.rows.len().max(2) - 1;
        let instant = |(k, pair): (usize, &[Row])| {
            let t_s = 0.5 * (around.t_s[k] + around.t_s[k + 1]);
            let (theta_rad, rate) =
                (middle(&pair[0].theta_rad, &pair[1].theta_rad), middle(&pair[0].rate, &pair[1].rate));
            let mut motion = model.motion(t_s, &theta_rad, &rate);
            model.accelerate(&mut motion).ok()?;
            Some(Instant { motion, tau: (k as f64 + 0.5) / last as f64 - 0.5 })
        };
        let each_link = DMatrix::identity(around.links, around.links);
        Some(Self {
            around,
            instants: around.rows.windows(2).enumerate().map(instant).collect::<Option<_>>()?,
            transitions: around.transitions_of_inputs(|_| each_link.clone()),
        })
    }

    /// The motion at the middles between two rows.
    pub fn motions(&self) -> impl Iterator<Item = &Motion> {
        self.instants.iter().map(|at| &at.motion)
    }

    /// A torque on the links, at one instant after another: `torque` adds it to the links'.
    pub fn torques(&self, torque: impl Fn(&Motion, &mut [f64])) -> Vec<f64> {
        let mut all = Vec::with_capacity(self.instants.len() * self.around.links);
        let mut q = vec![0.0; self.around.rates];
        for at in &self.instants {
            q.fill(0.0);
            torque(&at.motion, &mut q);
            all.extend_from_slice(&q[..self.around.links]);
        }
        all
    }

    /// What a torque adds to the values seen, whitened: `torque` adds it to the links'.
    pub fn response(&self, torque: impl Fn(&Motion, &mut [f64])) -> DMatrix<f64> {
        let torques = self.torques(torque);
        let of_links = |q: &[f64]| q.iter().map(|q| [*q]).collect::<Vec<_>>();
        self.seen(&torques.chunks(self.around.links).map(of_links).collect::<Vec<_>>())
    }

    /// What torques on the links that are held from row to row add to the values seen, whitened, one column a course.
    fn seen<const C: usize>(&self, held: &[Vec<[f64; C]>]) -> DMatrix<f64> {
        self.around.seen(&self.around.responses(&self.transitions, held))
    }

    /// The torques on the links of each function of the angle and the rate on which an input works.
    fn of_input(&self, input: Input, at: &Instant, largest: [f64; 2]) -> Vec<[f64; OF_STATE]> {
        let (pattern, [x, v]) = self.conjugate(input, at);
        let f = of_state(x / largest[0], v / largest[1], at.tau);
        pattern.iter().map(|lever| f.map(|f| lever * f)).collect()
    }

    /// An input's torque on each link, and the angle and the rate on which it works.
    fn conjugate(&self, input: Input, at: &Instant) -> (DVector<f64>, [f64; 2]) {
        let pattern = self.around.pattern(input, &at.motion.theta_rad);
        let along = |values: &[f64]| pattern.iter().zip(values).map(|(p, v)| p * v).sum::<f64>();
        let works_on = [along(&at.motion.theta_rad), along(&at.motion.rate)];
        (pattern, works_on)
    }

    /// The torques on the links of each function of the speed across the strip.
    fn of_air(&self, at: &Instant, largest_m_s: f64) -> Vec<[f64; OF_SPEED]> {
        let (chain, motion) = (&self.around.chain, &at.motion);
        let mut torques = vec![[0.0; OF_SPEED]; self.around.links];
        let mut q = vec![0.0; self.around.links];
        for function in 0..OF_SPEED {
            q.fill(0.0);
            let force = |speed_m_s: f64| of_speed(speed_m_s / largest_m_s, at.tau)[function];
            load::add_torque(chain, motion, |link| air::load_of(link, air::points(link), force), &mut q);
            torques.iter_mut().zip(&q).for_each(|(torque, q)| torque[function] = *q);
        }
        torques
    }

    /// What each function of the angles seen adds to them, row after row, mark after mark.
    fn of_camera(&self, largest_rad: f64) -> Vec<[f64; OF_VIEW]> {
        let last = self.around.rows.len().max(2) - 1;
        let of_row = |(k, row): (usize, &Row)| {
            let tau = k as f64 / last as f64 - 0.5;
            row.chord_rad.iter().map(|x| of_view(x / largest_rad, tau)).collect::<Vec<_>>()
        };
        self.around.rows.iter().enumerate().flat_map(of_row).collect()
    }

    /// The largest speed across the strip at an instant.
    pub fn fastest_m_s(&self, motion: &Motion) -> f64 {
        let points = load::links(&self.around.chain, motion).flat_map(|link| air::points(&link));
        points.fold(0.0, |fastest_m_s, at| at.speed_m_s.abs().max(fastest_m_s))
    }
}

/// The motions of a fit, each along its linearisation; `None` where there is no such model.
pub fn swings<'s>(fit: &Refit<'_>, around: &'s [Linearisation]) -> Option<Vec<Swing<'s>>> {
    let swing = |(record, around)| {
        let (model, _) = fit.problem.model(record, &fit.x[..fit.problem.free.len()]).ok()?;
        Swing::of(around, &model)
    };
    around.iter().enumerate().map(swing).collect()
}

/// What each function of a law adds to the values seen of all recordings, whitened, for a torque of root mean square 1 (of the camera an offset); and nothing
/// to what else there is in as many rows, the beliefs. `acts` are the torques of a swing, or what it adds to the angles, and what that does to the values.
fn columns<const C: usize>(
    swings: &[Swing<'_>],
    rows: usize,
    acts: impl Fn(&Swing<'_>) -> (Vec<[f64; C]>, DMatrix<f64>),
) -> DMatrix<f64> {
    let (mut square, mut count) = ([0.0; C], 0usize);
    let mut all = DMatrix::zeros(rows, C);
    let mut first = 0;
    for swing in swings {
        let (held, seen) = acts(swing);
        for size in &held {
            square.iter_mut().zip(size).for_each(|(square, size)| *square += size * size);
        }
        count += swing.instants.len();
        all.rows_mut(first, seen.nrows()).copy_from(&seen);
        first += seen.nrows();
    }
    for (mut column, square) in all.column_iter_mut().zip(square) {
        column /= (square / count.max(1) as f64).sqrt().max(f64::MIN_POSITIVE);
    }
    all
}

/// The torques on the links at all instants, and what they do to the values seen.
fn torques<const C: usize>(swing: &Swing<'_>, of: impl Fn(&Instant) -> Vec<[f64; C]>) -> (Vec<[f64; C]>, DMatrix<f64>) {
    let held: Vec<Vec<[f64; C]>> = swing.instants.iter().map(of).collect();
    let seen = swing.seen(&held);
    (held.into_iter().flatten().collect(), seen)
}

/// A law of any form around a fit, at each place that can have one, of the likeliest of the place's sizes (N·m, of the camera rad); `variance` scales that of
/// the noise.
pub fn basis_laws(
    fit: &Refit<'_>,
    around: &[Linearisation],
    variance: f64,
    sizes: impl Fn(Place) -> [f64; SIZES] + Sync,
) -> Vec<LatentForce> {
    let Some(projection) = Projection::of(fit) else { return Vec::new() };
    let rows = projection.residual.len();
    let Some(swings) = swings(fit, around) else { return Vec::new() };
    let largest = |of: &dyn Fn(&Swing<'_>, &Instant) -> f64| {
        let all = swings.iter().flat_map(|swing| swing.instants.iter().map(|at| of(swing, at).abs()));
        all.fold(f64::MIN_POSITIVE, f64::max)
    };
    let of_input = |input: Input| {
        let largest = [0, 1].map(|i| largest(&|swing, at| swing.conjugate(input, at).1[i]));
        columns(&swings, rows, |swing| torques(swing, |at| swing.of_input(input, at, largest)))
    };
    let of_air = || {
        let largest_m_s = largest(&|swing, at| swing.fastest_m_s(&at.motion));
        columns(&swings, rows, |swing| torques(swing, |at| swing.of_air(at, largest_m_s)))
    };
    let of_camera = || {
        let largest_rad = fit.problem.records.iter().map(Record::largest_angle_rad).fold(f64::MIN_POSITIVE, f64::max);
        columns(&swings, rows, |swing| {
            let offsets = swing.of_camera(largest_rad);
            let seen = swing.around.seen(&offsets);
            (offsets, seen)
        })
    };
    let places = [Place::Hinge, Place::Joint, Place::Air, Place::Camera];
    let places = places.into_iter().filter(|p| *p != Place::Joint || fit.problem.marks() > 1);
    let likeliest = |place: Place| {
        let columns = match place {
            Place::Joint => of_input(Input::Joint),
            Place::Air => of_air(),
            Place::Camera => of_camera(),
            Place::Hinge => of_input(Input::Hinge),
        };
        let columns = projection.out(&columns);
        let eigen = columns.tr_mul(&columns).symmetric_eigen();
        let along = eigen.eigenvectors.tr_mul(&columns.tr_mul(&projection.residual));
        let gain = |size: f64| {
            let of = |(along, lambda): (&f64, &f64)| {
                let seen = size * size * lambda.max(0.0) / variance;
                along * along * size * size / (variance * variance * (1.0 + seen)) - seen.ln_1p()
            };
            0.5 * along.iter().zip(&eigen.eigenvalues).map(of).sum::<f64>()
        };
        LatentForce::likeliest(Form::Law(place), sizes(place).into_iter().map(|size| (size, gain(size))))
    };
    places.collect::<Vec<_>>().into_par_iter().map(likeliest).collect()
}
