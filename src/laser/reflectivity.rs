//! What the push says of the surface: the momentum that it takes from the light.
//!
//! An even pressure p on a strip that hangs from a hinge, limp or rigid, moves a point s below it by
//!
//! ```text
//! y(s) = p ∫₀ˢ A(s')/w(s') ds',    A(s'), w(s'): lit area and weight below s'        (whole strip lit: y = s F/W)
//! ```
//!
//! and Eq. 41 gives, of the force across the strip, F c/(I A cos α) = cos α (1 + C_s) + ⅔ C_d: from 1 (black) to 2 (mirror) where the light falls straight.

use serde::Serialize;

use crate::experiment::{Experiment, Reflectivity, Support};
use crate::identify::estimate::NORMAL_QUANTILE;
use crate::model::light::{Beam, SPEED_OF_LIGHT_M_S, radiation_force_n};

/// Steps of the integral along the strip.
const STEPS: usize = 2000;

/// The push as a figure for the surface.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Figure {
    /// I.
    pub flux_w_m2: f64,
    /// The force across the strip that the push means.
    pub force_n: f64,
    /// F c/(I A cos α).
    pub momentum_coefficient: f64,
    /// Its standard deviation, that of the push alone.
    pub sd: f64,
    /// Its 95 % interval.
    pub interval: [f64; 2],
    /// What the stated shares give.
    pub stated: Option<f64>,
    /// From black to mirror.
    pub possible: [f64; 2],
    /// Whether the interval and the possible have anything in common.
    pub can_be: bool,
}

/// The figure, or what is missing for it.
pub fn figure(experiment: &Experiment, [push_m, sd_m]: [f64; 2]) -> Result<Figure, String> {
    let light = experiment.light.clone().unwrap_or_default();
    let missing = |key: &str| format!("{key} is not given, so the push is not turned into a reflectivity");
    let power_w = light.power_w.ok_or_else(|| missing("light.power_w"))?;
    let distance_m = light.distance_m.ok_or_else(|| missing("light.distance_m"))?;
    if power_w <= 0.0 {
        return Err("light.power_w is 0: there is no light to push".to_owned());
    }
    if !experiment.specimen.links.is_empty() {
        return Err("the specimen is made of links: the push is turned into a reflectivity for a strip only".to_owned());
    }
    if experiment.rig.support != Support::Hinged || experiment.rig.support_stiffness_n_m_per_rad > 0.0 {
        return Err("the strip does not turn freely (rig.support): its answer depends on its stiffness, so the push is not turned into a reflectivity".to_owned());
    }
    let incidence_rad = light.direction_deg.to_radians();
    let specimen = &experiment.specimen;
    let surface = specimen.reflectivity.unwrap_or(Reflectivity::opaque(0.0, 0.0, 1.0));
    let beam = Beam::of(&light, power_w, distance_m, specimen.width_m, specimen.length_m, [surface; 2]);
    let flux_w_m2 = beam.flux_w_m2;
    let (lever_m3_n, area_m2) = lever(experiment, &beam);
    if !(area_m2 > 0.0 && lever_m3_n > 0.0) {
        return Err(
            "the lit spot misses the strip above the sensor's point (light.spot_diameter_m, light.spot_height_m)"
                .to_owned(),
        );
    }
    let cos = incidence_rad.cos();
    let per_push = area_m2 / lever_m3_n * SPEED_OF_LIGHT_M_S / (flux_w_m2 * area_m2 * cos);
    let (value, sd) = (push_m.abs() * per_push, sd_m * per_push);
    let interval = [value - NORMAL_QUANTILE * sd, value + NORMAL_QUANTILE * sd];
    let possible = [cos, (2.0 * cos).max(cos + 2.0 / 3.0)];
    let stated = experiment.specimen.reflectivity.map(|surface| {
        let [normal_n, along_n] = radiation_force_n(flux_w_m2, area_m2, incidence_rad, &surface);
        (normal_n + along_n * cos) * SPEED_OF_LIGHT_M_S / (flux_w_m2 * area_m2 * cos)
    });
    Ok(Figure {
        flux_w_m2,
        force_n: push_m * area_m2 / lever_m3_n,
        momentum_coefficient: value,
        sd,
        interval,
        stated,
        possible,
        can_be: interval[1] >= possible[0] && interval[0] <= possible[1],
    })
}

/// Displacement of the sensor's point a pressure (m³/N), and the lit area (m²).
fn lever(experiment: &Experiment, beam: &Beam) -> (f64, f64) {
    let specimen = &experiment.specimen;
    let length_m = specimen.length_m;
    let height_m = experiment.laser.as_ref().and_then(|l| l.height_m).unwrap_or(length_m);
    let step_m = length_m / STEPS as f64;
    let weight_n_m = specimen.mass_kg * experiment.rig.gravity_m_s2 / length_m;
    let middle = |k: usize| (k as f64 + 0.5) * step_m;
    // lit area below each step's middle
    let (mut below_m2, mut lever_m3_n) = (0.0, 0.0);
    for k in (0..STEPS).rev() {
        let own_m2 = specimen.width_m * beam.lit(middle(k)) * step_m;
        let share = ((height_m - k as f64 * step_m) / step_m).clamp(0.0, 1.0);
        lever_m3_n += share * step_m * (below_m2 + 0.5 * own_m2) / (weight_n_m * (length_m - middle(k)));
        below_m2 += own_m2;
    }
    (lever_m3_n, below_m2)
}
