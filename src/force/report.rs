//! What light does to a strip, power by power and distance by distance.

use serde::Serialize;

use super::chain::LitChain;
use super::{Lit, Parts, Setup};
use crate::error::{Error, Result};
use crate::model::light::Beam;
use crate::model::strip::load::Free;
use crate::model::strip::{Mesh, Rest};

/// Places nearer than this part of the length are one.
const SAME_M: f64 = 1e-9;

/// How far each of what light does moves a point along x (m), alone; and all together.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Point {
    /// Below the support.
    pub s_m: f64,
    /// By the push, of the chain of links; none for a clamp.
    pub multibody_m: Option<f64>,
    /// By the push, of the strip.
    pub strip_m: f64,
    /// By all that heat does: what both together move it less what the push does.
    pub heat_m: Option<f64>,
    /// By the curl of the gradient through the thickness.
    pub gradient_m: Option<f64>,
    /// By the curl of a layer.
    pub coating_m: Option<f64>,
    /// By what the warm faces radiate.
    pub recoil_m: Option<f64>,
    /// By everything.
    pub total_m: f64,
}

/// A power and a distance.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Row {
    /// P.
    pub power_w: f64,
    /// d.
    pub distance_m: f64,
    /// I at the strip.
    pub flux_w_m2: f64,
    /// Along x, on the strip as it hangs in the dark.
    pub force_n: f64,
    /// Of the hottest point.
    pub temperature_k: Option<f64>,
    /// At the sensor's point.
    #[serde(flatten)]
    pub point: Point,
}

/// What heat does in time.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Times {
    /// Of the film's temperature, at the wall's.
    pub time_constant_s: f64,
    /// Of the gradient through the thickness.
    pub through_thickness_s: f64,
    /// Values that are typical ones of the film, not stated.
    pub assumed: Vec<&'static str>,
}

/// What `freeswing force` tells.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Force {
    schema: &'static str,
    /// Name of the specimen.
    pub specimen: String,
    /// P of the points.
    pub power_w: f64,
    /// d of the points.
    pub distance_m: f64,
    /// I of the points.
    pub flux_w_m2: f64,
    /// Along x, on the whole strip.
    pub force_n: f64,
    /// Of the strip.
    pub weight_n: f64,
    /// Of the strip under its own weight.
    pub first_mode_hz: f64,
    /// At the sensor's point, the joints and the free end.
    pub points: Vec<Point>,
    /// In order of distance and power.
    pub sweep: Vec<Row>,
    /// None without `[heat]`.
    pub heat: Option<Times>,
}

/// The strip at rest in the dark, and what it is held against.
struct Dark<'s> {
    setup: &'s Setup,
    mesh: Mesh,
    rest: Rest,
    chain: Option<LitChain>,
}

impl Force {
    /// Reckons an experiment, at the sensor's point, the joints, the free end, and at further places.
    ///
    /// # Errors
    /// [`crate::Error::Option`] for a place off the strip; [`crate::Error::Missing`], [`crate::Error::Simulation`].
    pub fn of(setup: &Setup, further_m: &[f64]) -> Result<Self> {
        let mesh = Mesh::of(&setup.strip, Mesh::ELEMENTS);
        let rest = Rest::of(&setup.strip, &mesh, &Free)?;
        let vibration = rest.vibration();
        let dark = Dark { setup, mesh, rest, chain: LitChain::of(setup)? };
        let (power_w, distance_m) = setup.main()?;
        let places_m = places_m(setup, further_m)?;
        let mut sweep = Vec::new();
        for distance_m in setup.distances_m()? {
            for power_w in setup.powers_w()? {
                sweep.push(dark.row(power_w, distance_m)?);
            }
        }
        let lit = dark.lit(power_w, distance_m)?;
        Ok(Self {
            schema: "freeswing.force/1",
            specimen: setup.experiment.specimen.name.clone(),
            power_w,
            distance_m,
            flux_w_m2: lit.beam.flux_w_m2,
            force_n: dark.force_n(&lit.beam),
            weight_n: setup.strip.mass_per_length_kg_m * setup.strip.length_m * setup.strip.gravity_m_s2,
            first_mode_hz: vibration.map_or(f64::NAN, |v| v.frequencies_hz(1)[0]),
            points: places_m.iter().map(|s_m| dark.point(&lit, *s_m)).collect::<Result<_>>()?,
            sweep,
            heat: setup.film.map(|film| Times {
                time_constant_s: film.time_constant_s(film.wall_k),
                through_thickness_s: film.through_thickness_s(),
                assumed: setup.experiment.heat.as_ref().map(crate::model::heat::WarmFilm::assumed).unwrap_or_default(),
            }),
        })
    }
}

/// Where displacements are told, from the top down.
fn places_m(setup: &Setup, further_m: &[f64]) -> Result<Vec<f64>> {
    let length_m = setup.strip.length_m;
    if let Some(off_m) = further_m.iter().find(|s_m| !(0.0..=length_m).contains(*s_m)) {
        let message = format!("{off_m} is not on the strip, which reaches from the hinge (0) down to {length_m} m");
        return Err(Error::Option { option: "--at-m".into(), message });
    }
    let joints_m = setup.experiment.specimen.link_lengths_m.iter().scan(0.0, |end_m, link_m| {
        *end_m += link_m;
        Some(f64::min(*end_m, length_m))
    });
    let mut places_m: Vec<f64> = vec![setup.sensor_m()];
    for place_m in joints_m.chain(further_m.iter().copied()) {
        if places_m.iter().all(|known_m| (known_m - place_m).abs() > SAME_M * length_m) {
            places_m.push(place_m);
        }
    }
    places_m.sort_by(f64::total_cmp);
    Ok(places_m)
}

/// The strip at rest under the push, and under each of what its warmth does.
struct LitRests {
    beam: Beam,
    pushed: Rest,
    warm: Option<Warm>,
}

/// Rests of a warm strip.
struct Warm {
    hottest_k: Option<f64>,
    all: Rest,
    gradient: Rest,
    coating: Rest,
    recoil: Rest,
}

impl Dark<'_> {
    fn lit(&self, power_w: f64, distance_m: f64) -> Result<LitRests> {
        let beam = self.setup.beam(power_w, distance_m);
        let of = |parts: Parts| Lit::rest(&self.setup.strip, &self.mesh, beam, self.setup.film, parts);
        let warm = match self.setup.film {
            None => None,
            Some(_) => {
                let (all, lit) = of(Parts::ALL)?;
                Some(Warm {
                    hottest_k: lit.hottest_k(),
                    all,
                    gradient: of(Parts { gradient: true, ..Parts::NONE })?.0,
                    coating: of(Parts { coating: true, ..Parts::NONE })?.0,
                    recoil: of(Parts { recoil: true, ..Parts::NONE })?.0,
                })
            }
        };
        Ok(LitRests { beam, pushed: of(Parts::PUSH)?.0, warm })
    }

    /// Along x, on the strip as it hangs in the dark.
    fn force_n(&self, beam: &Beam) -> f64 {
        let angles = self.mesh.angles(self.rest.freedoms.as_slice());
        let push = |p: usize| self.mesh.weight_m(p) * beam.push(self.mesh.s_m(p), angles[p]).force_n_m[0];
        (0..self.mesh.points()).map(push).sum()
    }

    fn row(&self, power_w: f64, distance_m: f64) -> Result<Row> {
        let lit = self.lit(power_w, distance_m)?;
        Ok(Row {
            power_w,
            distance_m,
            flux_w_m2: lit.beam.flux_w_m2,
            force_n: self.force_n(&lit.beam),
            temperature_k: lit.warm.as_ref().and_then(|warm| warm.hottest_k),
            point: self.point(&lit, self.setup.sensor_m())?,
        })
    }

    fn point(&self, lit: &LitRests, s_m: f64) -> Result<Point> {
        let moved = |rest: &Rest| rest.place_m(s_m)[0] - self.rest.place_m(s_m)[0];
        let strip_m = moved(&lit.pushed);
        let alone = |of: fn(&Warm) -> &Rest| lit.warm.as_ref().map(|warm| moved(of(warm)));
        let total_m = alone(|warm| &warm.all);
        Ok(Point {
            s_m,
            multibody_m: self.chain.as_ref().map(|chain| chain.moved_m(&lit.beam, s_m)).transpose()?,
            strip_m,
            heat_m: total_m.map(|total_m| total_m - strip_m),
            gradient_m: alone(|warm| &warm.gradient),
            coating_m: alone(|warm| &warm.coating),
            recoil_m: alone(|warm| &warm.recoil),
            total_m: total_m.unwrap_or(strip_m),
        })
    }
}
