//! The unknown torque around a fit: of any course in time, or any law, at each place.

use rayon::prelude::*;

use super::basis_law::basis_laws;
use super::effect::Place;
use super::latent::{Beyond, Filter, LatentConfig, LatentForce, likeliest, sizes};
use super::linearisation::{Input, Linearisation};
use super::refit::Refit;
use crate::fit::Record;

/// A large size of an error of the camera, over the noise (start values: smaller ones are tried, too)…
const OVER_NOISE: f64 = 10.0;
/// … and of an unknown torque, over gravity's at the largest angle (start values).
const OVER_GRAVITY: f64 = 0.3;

/// The unknown of each form and at each place around a fit, likeliest first; `variance` scales that of the noise.
pub fn unknowns(fit: &Refit<'_>, variance: f64, assumed: LatentConfig) -> Vec<LatentForce> {
    let Some(around) = Linearisation::of_all(fit) else { return Vec::new() };
    let inputs = Input::ALL.into_par_iter().filter(|input| *input != Input::Joint || fit.problem.marks() > 1);
    let course = |input: Input| {
        let filters: Option<Vec<Filter<'_>>> = around
            .iter()
            .enumerate()
            .map(|(record, a)| Filter::new(fit, record, (a, variance), input, assumed))
            .collect();
        Some(likeliest(&filters?, input, typical(fit, input.place())))
    };
    let mut unknowns: Vec<LatentForce> = inputs.filter_map(course).collect();
    if assumed.beyond == Beyond::TheFit {
        unknowns.extend(basis_laws(fit, &around, variance, |place| sizes(typical(fit, place))));
    }
    unknowns.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    unknowns
}

/// A large size of an unknown: a part of gravity's torque at the largest angle, or a multiple of the noise.
fn typical(fit: &Refit<'_>, place: Place) -> f64 {
    if place == Place::Camera {
        return OVER_NOISE * fit.problem.noise.iter().flat_map(|n| &n.sd_rad).copied().fold(0.0, f64::max);
    }
    let Ok((model, _)) = fit.problem.model(0, &fit.x[..fit.problem.free.len()]) else { return 1.0 };
    let largest_rad = fit.problem.records.iter().map(Record::largest_angle_rad).fold(0.0, f64::max);
    OVER_GRAVITY * model.gravity_m_s2() * model.chain().static_moment_kg_m(0) * largest_rad
}

/// Where what a base model lacks would act, whatever it is: where the unknown around it makes the recordings likeliest, or nearly so if that is where the
/// nearest of the named effects acts: places are told from one another by so much in ln-likelihood.
pub fn place_of_all(null: &Refit<'_>, of_nearest: Option<Place>, told: f64) -> Option<Place> {
    let unknowns = unknowns(null, 1.0, LatentConfig::SHORT_MEMORY);
    let likeliest = unknowns.first().filter(|likeliest| likeliest.gain > 0.0)?;
    let is_as_likely = |place: &Place| unknowns.iter().any(|u| u.place() == *place && u.gain > likeliest.gain - told);
    of_nearest.filter(is_as_likely).or_else(|| Some(likeliest.place()))
}
