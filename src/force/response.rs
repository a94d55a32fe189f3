//! The strip's motion when the lamp goes on and off, or is chopped, in its modes about the dark rest.
//!
//! A micrometre is small, so each mode answers alone to the force along it:
//!
//! ```text
//! z̈ₖ + 2ξωₖżₖ + ωₖ²zₖ = Σₚ Qₚₖ uₚ(t)        Q of the push: ∫ f·∂r/∂zₖ ds,  of a curl: ∫ EI κₚ κₖ ds
//! ```
//!
//! uₚ is one where a part p of what light does has reached its steady value: the push follows the lamp, the layer's curl the temperature, the gradient's curl
//! what flows through the film, the recoil what is radiated. Between two instants they are taken as straight lines, for which the answer is exact.

use std::f64::consts::{PI, TAU};

use nalgebra::{Complex, DVector};

use super::{Lit, Parts, Setup};
use crate::error::{Error, Result};
use crate::model::heat::WarmFilm;
use crate::model::strip::load::Free;
use crate::model::strip::{Load, Mesh, Rest};

/// Modes that answer; what further ones add follows at once, and is added as it is at rest.
const MODES: usize = 8;
/// Longest step (s).
const LONGEST_STEP_S: f64 = 2e-3;
/// Parts: push, gradient, layer, recoil.
const PARTS: usize = 4;

/// When the lamp is lit.
#[derive(Debug, Clone, PartialEq)]
pub struct Schedule {
    /// On, off, on, …
    pub edges_s: Vec<f64>,
    /// τ of the lamp.
    pub warm_up_s: f64,
    /// Chopped, half of each period lit, from each time the lamp goes on.
    pub chop_hz: Option<f64>,
}

impl Schedule {
    /// Share of the lamp's full light.
    pub fn light(&self, t_s: f64) -> f64 {
        let passed = self.edges_s.partition_point(|edge| *edge <= t_s);
        if passed % 2 == 0 {
            return 0.0;
        }
        let since_s = t_s - self.edges_s[passed - 1];
        let open = self.chop_hz.is_none_or(|hz| (since_s * hz).fract() < 0.5);
        let warm = if self.warm_up_s > 0.0 { 1.0 - (-since_s / self.warm_up_s).exp() } else { 1.0 };
        if open { warm } else { 0.0 }
    }
}

/// One instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Instant {
    /// t.
    pub t_s: f64,
    /// Share of the lamp's full light.
    pub light: f64,
    /// T of the hottest point.
    pub kelvin: Option<f64>,
    /// By the push.
    pub push_m: f64,
    /// By heat.
    pub heat_m: f64,
}

/// How one point of a strip answers to light.
#[derive(Debug, Clone, PartialEq)]
pub struct Response {
    /// ωₖ of the modes that answer.
    omega_rad_s: Vec<f64>,
    /// ξ.
    pub damping_ratio: f64,
    /// What each part moves the point by in each mode at rest: part × mode (m).
    at_rest_m: Vec<[f64; PARTS]>,
    /// What all further modes add (m).
    further_m: [f64; PARTS],
    film: Option<WarmFilm>,
    /// Heat taken up where it is most, in full light.
    absorbed_w_m2: f64,
}

impl Response {
    /// Of the sensor's point, at a power and a distance.
    ///
    /// # Errors
    /// [`Error::Simulation`] where the strip's rest is not stable.
    pub fn of(setup: &Setup, power_w: f64, distance_m: f64, damping_ratio: f64) -> Result<Self> {
        let strip = &setup.strip;
        let mesh = Mesh::of(strip, Mesh::ELEMENTS);
        let rest = Rest::of(strip, &mesh, &Free)?;
        let unstable = || Error::Simulation {
            detail: "the strip's rest is not stable; check its mass, stiffness, curl_per_m and rig.support".into(),
        };
        let vibration = rest.vibration().filter(|v| v.squares_rad2_s2[0] > 0.0).ok_or_else(unstable)?;
        let beam = setup.beam(power_w, distance_m);
        let (_, lit) = Lit::rest(strip, &mesh, beam, setup.film, Parts::ALL)?;
        let modes = MODES.min(vibration.squares_rad2_s2.len());
        let seen = rest.seen(&vibration, setup.sensor_m());
        let forces: [DVector<f64>; PARTS] = std::array::from_fn(|part| along_freedoms(&rest, &lit, part));
        let mut at_rest_m = (0..vibration.squares_rad2_s2.len())
            .map(|k| {
                let shape = vibration.shapes.column(k);
                std::array::from_fn(|part| seen[k] * shape.dot(&forces[part]) / vibration.squares_rad2_s2[k])
            })
            .collect::<Vec<[f64; PARTS]>>();
        let further = at_rest_m.split_off(modes);
        let further_m = std::array::from_fn(|part| further.iter().map(|m| m[part]).sum());
        Ok(Self {
            omega_rad_s: vibration.squares_rad2_s2[..modes].iter().map(|square| square.sqrt()).collect(),
            damping_ratio,
            at_rest_m,
            further_m,
            film: setup.film,
            absorbed_w_m2: lit.warmth.iter().map(|w| w.absorbed_w_m2).fold(0.0, f64::max),
        })
    }

    /// f of the first mode.
    pub fn first_mode_hz(&self) -> f64 {
        self.omega_rad_s[0] / TAU
    }

    /// What the push and what heat moves the point by at rest (m).
    pub fn still_m(&self) -> [f64; 2] {
        let all = |part: usize| self.further_m[part] + self.at_rest_m.iter().map(|m| m[part]).sum::<f64>();
        [all(0), (1..PARTS).map(all).sum()]
    }

    /// The motion from t = 0, when all is at rest and dark, in even steps.
    pub fn motion(&self, schedule: &Schedule, step_s: f64, steps: usize) -> Vec<Instant> {
        let inner = (step_s / LONGEST_STEP_S).ceil().max(1.0) as usize;
        let h = step_s / inner as f64;
        let walls_k = self.film.map(|film| film.wall_k);
        let mut kelvin = walls_k;
        let mut oscillators = vec![[Oscillator::default(); 2]; self.omega_rad_s.len()];
        let mut drive = self.drives(schedule.light(0.0), kelvin);
        let mut instants = Vec::with_capacity(steps + 1);
        for step in 0..=steps * inner {
            let t_s = h * step as f64;
            if step > 0 {
                let light = schedule.light(t_s);
                if let (Some(film), Some(kelvin)) = (&self.film, kelvin.as_mut()) {
                    let mean = 0.5 * (schedule.light(t_s - 0.999 * h) + schedule.light(t_s - 0.001 * h));
                    film.advance(kelvin, t_s - h, t_s, |_| self.absorbed_w_m2 * mean);
                }
                let next = self.drives(light, kelvin);
                for ((oscillators, omega), moved_m) in
                    oscillators.iter_mut().zip(&self.omega_rad_s).zip(&self.at_rest_m)
                {
                    let of = |drive: &[f64; PARTS]| {
                        [moved_m[0] * drive[0], (1..PARTS).map(|part| moved_m[part] * drive[part]).sum()]
                    };
                    for (oscillator, (from, until)) in oscillators.iter_mut().zip(of(&drive).into_iter().zip(of(&next)))
                    {
                        oscillator.advance(*omega, self.damping_ratio, h, from, until);
                    }
                }
                drive = next;
            }
            if step % inner == 0 {
                let sum = |which: usize| oscillators.iter().map(|o| o[which].place).sum::<f64>();
                instants.push(Instant {
                    t_s,
                    light: schedule.light(t_s),
                    kelvin,
                    push_m: sum(0) + self.further_m[0] * drive[0],
                    heat_m: sum(1) + (1..PARTS).map(|part| self.further_m[part] * drive[part]).sum::<f64>(),
                });
            }
        }
        instants
    }

    /// uₚ.
    fn drives(&self, light: f64, kelvin: Option<f64>) -> [f64; PARTS] {
        let (Some(film), Some(kelvin)) = (&self.film, kelvin) else { return [light, 0.0, 0.0, 0.0] };
        let steady_k = film.steady_k(self.absorbed_w_m2);
        let share = |now: f64, steady: f64| if steady == 0.0 { 0.0 } else { now / steady };
        [
            light,
            share(
                film.gradient_curl_per_m(light * self.absorbed_w_m2, kelvin),
                film.gradient_curl_per_m(self.absorbed_w_m2, steady_k),
            ),
            share(kelvin - film.wall_k, steady_k - film.wall_k),
            share(kelvin.powi(4) - film.wall_k.powi(4), steady_k.powi(4) - film.wall_k.powi(4)),
        ]
    }

    /// Amplitude (m) of the motion at a chopping frequency once it has settled, of the push and of heat: the fundamental of a light that is full for half of each
    /// period has an amplitude of 2/π.
    pub fn chopped_m(&self, chop_hz: f64) -> [f64; 2] {
        let omega = TAU * chop_hz;
        let lag = self.film.map(|film| {
            let mean_k = film.steady_k(0.5 * self.absorbed_w_m2);
            Complex::new(1.0, omega * film.time_constant_s(mean_k)).inv()
        });
        let drive = |part: usize| -> Complex<f64> {
            let one = Complex::new(1.0, 0.0);
            match (part, self.film, lag) {
                (0, ..) | (_, None, _) | (_, _, None) => one,
                (1, Some(film), Some(lag)) => {
                    // what is taken up acts at once, what is given off with the temperature
                    let at_once = film.gradient_curl_per_m(self.absorbed_w_m2, film.wall_k);
                    let steady = film.gradient_curl_per_m(self.absorbed_w_m2, film.steady_k(self.absorbed_w_m2));
                    if steady == 0.0 { one } else { (one * at_once + lag * (steady - at_once)) / steady }
                }
                (_, _, Some(lag)) => lag,
            }
        };
        let gain = |omega_k: f64| {
            let square = omega_k * omega_k;
            Complex::new(square, 0.0) / Complex::new(square - omega * omega, 2.0 * self.damping_ratio * omega_k * omega)
        };
        let of = |part: usize| -> Complex<f64> {
            let answered: Complex<f64> =
                self.at_rest_m.iter().zip(&self.omega_rad_s).map(|(m, omega_k)| gain(*omega_k) * m[part]).sum();
            (answered + self.further_m[part]) * drive(part) * (2.0 / PI)
        };
        [of(0).norm(), (1..PARTS).map(of).sum::<Complex<f64>>().norm()]
    }
}

/// What a part of what light does along each freedom.
fn along_freedoms(rest: &Rest, lit: &Lit, part: usize) -> DVector<f64> {
    let (mesh, strip) = (&rest.mesh, &rest.strip);
    let angles = mesh.angles(rest.freedoms.as_slice());
    let curl = |which: usize| {
        let moment = |p: usize| mesh.weight_m(p) * strip.bending_stiffness_n_m2 * lit.curls_per_m(mesh.s_m(p))[which];
        mesh.along_curvatures(&(0..mesh.points()).map(moment).collect::<Vec<_>>())
    };
    let force = |parts: Parts| {
        let alone = Lit { parts, ..lit.clone() };
        let below = |axis: usize| {
            let local = |p: usize| alone.force(mesh.s_m(p), angles[p]).force_n_m[axis];
            mesh.below(&(0..mesh.points()).map(local).collect::<Vec<_>>())
        };
        let (across, down) = (below(0), below(1));
        let turned = |p: usize| across[p] * angles[p].cos() - down[p] * angles[p].sin();
        mesh.along_freedoms(&(0..mesh.points()).map(turned).collect::<Vec<_>>())
    };
    match part {
        0 => force(Parts::PUSH),
        1 | 2 => curl(part - 1),
        _ => force(Parts { recoil: true, ..Parts::NONE }),
    }
}

/// One mode's place, in metres of the point, and rate.
#[derive(Debug, Clone, Copy, Default)]
struct Oscillator {
    place: f64,
    rate: f64,
}

impl Oscillator {
    /// Moves on by h while the place it would rest at goes straight from one value to another: exact.
    fn advance(&mut self, omega: f64, damping_ratio: f64, h: f64, from: f64, until: f64) {
        // a straight line a + bt is followed by a + b(t − 2ξ/ω); what is left swings and dies away
        let slope = (until - from) / h;
        let follows = |at: f64| at - slope * 2.0 * damping_ratio / omega;
        let decay = damping_ratio * omega;
        let swing = omega * (1.0 - damping_ratio * damping_ratio).max(1e-12).sqrt();
        let (place, rate) = (self.place - follows(from), self.rate - slope);
        let (sin, cos) = (swing * h).sin_cos();
        let shrunk = (-decay * h).exp();
        let across = (rate + decay * place) / swing;
        self.place = follows(until) + shrunk * (place * cos + across * sin);
        self.rate = slope + shrunk * ((across * cos - place * sin) * swing - decay * (place * cos + across * sin));
    }
}
