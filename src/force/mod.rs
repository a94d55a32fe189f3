//! The strip under the spotlight: how far light pushes it, and how far heat does.
//!
//! | file | holds |
//! |---|---|
//! | [`lit`] | what light does to a strip: push, curls, recoil, softening; the strip at rest under them |
//! | [`chain`] | the chain of links under the same push |
//! | [`report`] | power by power and distance by distance |
//! | [`response`] | the motion when the lamp goes on and off, or is chopped |
//! | [`plan`] | what an experiment has to be to see the push |

pub mod chain;
pub mod lit;
pub mod plan;
pub mod report;
pub mod response;

pub use lit::{Lit, Parts};
pub use plan::Plan;
pub use report::{Force, Point, Row};
pub use response::{Response, Schedule};

use crate::error::{Error, Result};
use crate::experiment::{Experiment, Light, Reflectivity};
use crate::model::heat::WarmFilm;
use crate::model::light::Beam;
use crate::model::strip::Strip;

/// A strip, its lamp and its film, as an experiment states them.
#[derive(Debug, Clone, PartialEq)]
pub struct Setup {
    /// The experiment.
    pub experiment: Experiment,
    /// The lamp.
    pub light: Light,
    /// The strip as a beam.
    pub strip: Strip,
    /// Shares of its two faces.
    pub faces: [Reflectivity; 2],
    /// What heat needs; none without `[heat]`.
    pub film: Option<WarmFilm>,
}

impl Setup {
    /// What an experiment states of them.
    ///
    /// # Errors
    /// [`Error::Missing`] that asks for what it does not.
    pub fn of(experiment: &Experiment) -> Result<Self> {
        let missing = |detail: &str| Error::Missing { detail: detail.to_owned() };
        let specimen = &experiment.specimen;
        if !specimen.links.is_empty() {
            return Err(missing(
                "[[specimen.links]] are rigid; light is reckoned on a strip: give length, mass, width, thickness and modulus instead",
            ));
        }
        let light = experiment.light.clone().ok_or_else(|| {
            missing("[light] is missing; state the lamp, for example power_w = 2000.0 and distance_m = 1.0")
        })?;
        let front = specimen.reflectivity.ok_or_else(|| {
            missing("specimen.reflectivity is missing; for example reflectivity = { specular = 0.60, diffuse = 0.26, absorbed = 0.14 }")
        })?;
        let strip = Strip::of_experiment(experiment).ok_or_else(|| {
            missing("specimen.thickness_m and specimen.young_modulus_pa are needed; without them nobody knows how the strip bends")
        })?;
        let film = WarmFilm::of(experiment)?;
        let faces = [front, specimen.reflectivity_back.unwrap_or(front)];
        Ok(Self { experiment: experiment.clone(), light, strip, faces, film })
    }

    /// Powers of the sweep, or the one power.
    ///
    /// # Errors
    /// [`Error::Missing`].
    pub fn powers_w(&self) -> Result<Vec<f64>> {
        let stated = if self.light.powers_w.is_empty() {
            self.light.power_w.into_iter().collect()
        } else {
            self.light.powers_w.clone()
        };
        let none = || Error::Missing {
            detail: "light.power_w is missing (W, what leaves the lamp as light; for example power_w = 2000.0)".into(),
        };
        if stated.is_empty() { Err(none()) } else { Ok(stated) }
    }

    /// Distances of the sweep, or the one distance.
    ///
    /// # Errors
    /// [`Error::Missing`], unless a spot states where the light goes.
    pub fn distances_m(&self) -> Result<Vec<f64>> {
        let one = self.light.distance_m.or(self.light.spot_diameter_m.map(|_| 1.0));
        let stated =
            if self.light.distances_m.is_empty() { one.into_iter().collect() } else { self.light.distances_m.clone() };
        let none = || Error::Missing {
            detail: "light.distance_m is missing (m, from the lamp to the strip; for example distance_m = 1.0)".into(),
        };
        if stated.is_empty() { Err(none()) } else { Ok(stated) }
    }

    /// The power and the distance that single numbers are for: those stated alone, else the largest power and the first distance.
    ///
    /// # Errors
    /// [`Error::Missing`].
    pub fn main(&self) -> Result<(f64, f64)> {
        let power_w = match self.light.power_w {
            Some(power_w) => power_w,
            None => self.powers_w()?.into_iter().fold(0.0, f64::max),
        };
        let distance_m = match self.light.distance_m {
            Some(distance_m) => distance_m,
            None => self.distances_m()?[0],
        };
        Ok((power_w, distance_m))
    }

    /// The light at a power and a distance.
    pub fn beam(&self, power_w: f64, distance_m: f64) -> Beam {
        let specimen = &self.experiment.specimen;
        Beam::of(&self.light, power_w, distance_m, specimen.width_m, specimen.length_m, self.faces)
    }

    /// The point that the sensor sees; the free end where none is stated.
    pub fn sensor_m(&self) -> f64 {
        self.experiment.laser.as_ref().and_then(|laser| laser.height_m).unwrap_or(self.strip.length_m)
    }
}
