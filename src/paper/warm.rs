//! Table 4 with heat allowed: what absorption and what distance its errors would take.
//!
//! The paper suspects heat behind what its models miss. With x the push's displacement and r what the film's heat adds to it,
//!
//! ```text
//! Δ = x/(x(1 + r)) − 1        r = 1/(1 + Δ) − 1
//! ```
//!
//! A bare film's heat acts by the curl of the gradient through its thickness. That is in proportion to the flux, as the push is: r depends neither on distance nor on
//! power, only on the absorbed share.

use super::published::{LENGTH_M, MATERIALS, Material, OPTICS, POWERS_W, ROD_LENGTH_M, WIDTH_M};
use super::table4::{light_force_n, multibody_tip_m};
use super::{AGREES, GRAVITY_M_S2, Quantity, Row, Section, Verdict, agrees};
use crate::error::Result;
use crate::experiment::{Experiment, Film, Heat, Light, Model, Reflectivity, Rig, Specimen};
use crate::force::{Force, Setup};

/// The sensor's step (m), Sec. IV.
const STEP_M: f64 = 1e-7;

/// r of a specimen, hinged, with the paper's absorbed share.
fn heat_over_push(material: &Material) -> Result<f64> {
    let [specular, diffuse, absorbed] = OPTICS;
    let film = if material.name.starts_with("PET") { Film::PET } else { Film::Kapton };
    let experiment = Experiment {
        specimen: Specimen {
            mass_kg: material.mass_kg(),
            length_m: LENGTH_M,
            width_m: WIDTH_M,
            thickness_m: Some(material.thickness_m),
            young_modulus_pa: Some(material.young_modulus_pa),
            link_lengths_m: vec![ROD_LENGTH_M; 2],
            reflectivity: Some(Reflectivity::opaque(specular, diffuse, absorbed)),
            ..Specimen::default()
        },
        rig: Rig { gravity_m_s2: GRAVITY_M_S2, ..Rig::default() },
        model: Model { k_eq_n_m_per_rad: material.k_eq_printed, ..Model::default() },
        light: Some(Light { power_w: Some(POWERS_W[3]), distance_m: Some(1.0), ..Light::default() }),
        heat: Some(Heat { film: Some(film), ..Heat::default() }),
        ..Experiment::default()
    };
    let force = Force::of(&Setup::of(&experiment)?, &[])?;
    let tip = force.sweep[0].point;
    Ok((tip.total_m - tip.strip_m) / tip.strip_m)
}

/// Every number of Table 4, judged with heat.
///
/// # Errors
/// [`crate::Error::Simulation`].
pub fn section() -> Result<Section> {
    let mut rows = Vec::new();
    let mut ratios = Vec::new();
    for material in &MATERIALS {
        let ratio = heat_over_push(material)?;
        ratios.push(ratio);
        for (model, errors) in [("multibody", material.multibody_error), ("FE", material.finite_element_error)] {
            rows.extend(
                POWERS_W.into_iter().zip(errors).map(|(power_w, error)| row(material, model, power_w, error, ratio)),
            );
        }
    }
    Ok(Section { title: "Table 4 with heat allowed: error of a model without it", rows, remarks: remarks(&ratios)? })
}

/// The absorbed share at which heat would make an error.
fn absorbed(error: f64, ratio: f64) -> f64 {
    OPTICS[2] * (1.0 / (1.0 + error) - 1.0) / ratio
}

fn row(material: &Material, model: &str, power_w: f64, error: f64, ratio: f64) -> Row {
    let with_heat = 1.0 / (1.0 + ratio) - 1.0;
    let takes = absorbed(error, ratio);
    let verdict = if agrees(error, with_heat, AGREES) {
        Verdict::Reproduces(String::new())
    } else if takes < 0.0 {
        Verdict::CannotBe("the strip would move less than the push alone, and heat moves it the same way".to_owned())
    } else {
        Verdict::CannotBe(format!("it takes an absorbed share of {:.2} %, and Table 1 has 14 %", 100.0 * takes))
    };
    let quantity = format!("{}, {model}, {power_w} W", material.name);
    Row::new(quantity, Quantity::new(error, ""), Quantity::new(with_heat, ""), verdict)
}

fn remarks(ratios: &[f64]) -> Result<Vec<String>> {
    let named = |of: &dyn Fn(&Material, f64) -> String| {
        MATERIALS
            .iter()
            .zip(ratios)
            .map(|(material, ratio)| format!("{} {}", material.name, of(material, *ratio)))
            .collect::<Vec<_>>()
            .join(", ")
    };
    let shares = named(&|material, ratio| {
        let takes = material.multibody_error.map(|error| 100.0 * absorbed(error, ratio));
        let [low, high] = [takes.into_iter().fold(f64::INFINITY, f64::min), takes.into_iter().fold(0.0, f64::max)];
        format!("{low:.2} to {high:.2} %")
    });
    let mut farthest = Vec::new();
    for (material, ratio) in MATERIALS.iter().zip(ratios) {
        let (distance_m, absorbed) = hidden_from_m(material, *ratio)?;
        let moved_um = 1e6 * multibody_tip_m(material, light_force_n(POWERS_W[0], distance_m))?;
        farthest.push(format!(
            "{} {distance_m:.2} m with {:.2} % absorbed, where 500 W push it by {moved_um:.2} µm",
            material.name,
            100.0 * absorbed
        ));
    }
    Ok(vec![
        format!(
            "The film's front is warmer than its back, and so it curls away from the lamp. With Table 1's absorbed share and typical values of the films, \
             that moves the free end as many times as far as the push: {}.",
            named(&|_, ratio| format!("{ratio:.1}"))
        ),
        format!(
            "Push and curl are both in proportion to the flux: their ratio does not depend on the distance. The multibody errors would take an absorbed share \
             that changes with the power: {shares}. No single share makes them."
        ),
        format!(
            "The errors become possible only where the sensor's step of 0.1 µm hides them all, from these distances on: {}.",
            farthest.join("; ")
        ),
        "A layer of aluminium on one face alone, as on the paper's Kapton, curls it some hundred times as far as the push (`freeswing force` with \
         [heat.coating]): a strip that moved by a micrometre did not do that."
            .to_owned(),
    ])
}

/// The shortest distance from which one absorbed share brings all eight errors of a specimen within half a step of the sensor, and that share.
fn hidden_from_m(material: &Material, ratio: f64) -> Result<(f64, f64)> {
    let at_a_metre_m = multibody_tip_m(material, light_force_n(1.0, 1.0))?;
    let farthest = |absorbed: f64| {
        let moved = 1.0 + ratio * absorbed / OPTICS[2];
        let errors = material.multibody_error.iter().chain(&material.finite_element_error);
        let off = errors
            .zip(POWERS_W.iter().cycle())
            .map(|(error, power_w)| power_w * at_a_metre_m * (moved - 1.0 / (1.0 + error)).abs());
        (off.fold(0.0, f64::max) / (0.5 * STEP_M)).sqrt()
    };
    let shares = (0..=1400).map(|k| 1e-4 * f64::from(k));
    let best = shares.map(|share| (farthest(share), share)).min_by(|a, b| a.0.total_cmp(&b.0));
    Ok(best.unwrap_or((f64::INFINITY, 0.0)))
}
