//! Table 2: K_eq and C_eq.

use std::f64::consts::TAU;

use super::published::{LENGTH_M, MATERIALS, Material, ROD_LENGTH_M, WIDTH_M};
use super::{AGREES, GRAVITY_M_S2, Quantity, Row, Section, Verdict, agrees};
use crate::error::{Error, Result};
use crate::experiment::{Experiment, Inertia, Model, Rig, Specimen};
use crate::model::modes::{Linearised, Mode, Modes, beam_frequencies_hz};
use crate::model::strip::Strip;

/// Eq. 29: K_eq = ω_n² M_tot (N/m, a translational constant).
pub fn stiffness_n_m(omega_n_rad_s: f64, mass_kg: f64) -> f64 {
    omega_n_rad_s * omega_n_rad_s * mass_kg
}

/// Eq. 30: C_eq = 2 M_tot ω_n ξ (N·s/m, a translational constant).
pub fn damping_n_s_m(omega_n_rad_s: f64, mass_kg: f64, damping_ratio: f64) -> f64 {
    2.0 * mass_kg * omega_n_rad_s * damping_ratio
}

/// The ω_n (rad/s) with which Eq. 29 gives Table 2's K_eq.
pub fn implied_omega_n_rad_s(material: &Material) -> f64 {
    (material.k_eq_printed / material.table_mass_kg()).sqrt()
}

/// The first mode of the corrected model with Table 2's constants taken as rotational ones, as the paper does.
///
/// # Errors
/// [`Error::Simulation`].
pub fn first_mode(material: &Material, inertia: Inertia) -> Result<Mode> {
    let experiment = Experiment {
        specimen: Specimen {
            name: material.name.to_owned(),
            mass_kg: material.table_mass_kg(),
            length_m: LENGTH_M,
            width_m: WIDTH_M,
            link_lengths_m: vec![ROD_LENGTH_M; 2],
            inertia,
            ..Specimen::default()
        },
        rig: Rig { gravity_m_s2: GRAVITY_M_S2, ..Rig::default() },
        model: Model {
            k_eq_n_m_per_rad: material.k_eq_printed,
            c_eq_n_m_s_per_rad: material.c_eq_printed,
            ..Model::default()
        },
        ..Experiment::default()
    };
    let modes = Modes::of(&Linearised::of(&experiment)?)?;
    let none = || Error::Simulation { detail: "the model with Table 2's constants has no swing".into() };
    modes.modes.into_iter().next().ok_or_else(none)
}

/// The strip as a beam.
pub fn strip(material: &Material, gravity_m_s2: f64) -> Strip {
    let bending_stiffness_n_m2 = material.young_modulus_pa * WIDTH_M * material.thickness_m.powi(3) / 12.0;
    Strip::hung(LENGTH_M, material.mass_kg() / LENGTH_M, bending_stiffness_n_m2, gravity_m_s2)
}

/// Table 2.
///
/// # Errors
/// [`Error::Simulation`].
pub fn section() -> Result<Section> {
    let mut rows = Vec::new();
    for material in &MATERIALS {
        rows.extend(constants(material));
    }
    rows.push(clamped_and_weightless(&MATERIALS[1]));
    for material in &MATERIALS {
        rows.push(damping(material)?);
    }
    let pet_1_mil = &MATERIALS[0];
    let inertia_kg_m2 = pet_1_mil.table_mass_kg() * LENGTH_M * LENGTH_M / 3.0;
    let largest = MATERIALS.iter().max_by(|a, b| a.c_eq_printed.total_cmp(&b.c_eq_printed)).map_or("", |m| m.name);
    let remarks = vec![
        "K_eq is recomputed with the ω_n that C_eq and ξ imply, C_eq with the ω_n of K_eq: both columns are of one frequency, f₁, and it is \
         not Table 3's (A9). PET 5 mils' is that of a clamped beam without gravity, 3.5160/2π·√(EI/ρAL⁴) (A11)."
            .to_owned(),
        format!(
            "Eq. 29 and 30 give N/m and N·s/m, not N·m/rad and N·m·s/rad (A8). A rotational constant of the same ω_n needs a moment of \
             inertia: ML²/3 makes {:.3e} N·m/rad of PET 1 mil's {}, {:.0} times less.",
            stiffness_n_m(implied_omega_n_rad_s(pet_1_mil), inertia_kg_m2),
            pet_1_mil.k_eq_printed,
            pet_1_mil.table_mass_kg() / inertia_kg_m2
        ),
        "ξ₁ is that of the corrected model with Table 2's constants at the joint. In the first mode both rods move together and a damper \
         between them does next to nothing: the measured damping must come from elsewhere, hinge or air (A12)."
            .to_owned(),
        format!("The text says that PET 5 mils has the lowest C_eq. In Table 2 {largest} has the highest; it is ξ that is lowest."),
    ];
    Ok(Section { title: "Table 2: K_eq and C_eq", rows, remarks })
}

/// K_eq and C_eq by the ω_n that Table 2 implies, and by Table 3's frequency.
fn constants(material: &Material) -> [Row; 3] {
    let Material { name, k_eq_printed, c_eq_printed, damping_ratio, .. } = *material;
    let mass_kg = material.table_mass_kg();
    let omega = implied_omega_n_rad_s(material);
    let table_3_hz = material.frequencies.measured_hz;
    // Two printed numbers imply one ω_n independently of each other: K, and C with ξ.
    let k = stiffness_n_m(c_eq_printed / (2.0 * mass_kg * damping_ratio), mass_kg);
    let c = damping_n_s_m(omega, mass_kg, damping_ratio);
    let verdict = |paper: f64, computed: f64, condition: String| {
        if agrees(paper, computed, AGREES) {
            Verdict::ReproducesIf(condition)
        } else {
            Verdict::CannotBe("Eq. 29 and 30 give another number".to_owned())
        }
    };
    let ratio = omega / TAU / table_3_hz;
    let frequency = if agrees(ratio, 1.0, AGREES) {
        Verdict::Reproduces(String::new())
    } else {
        Verdict::CannotBe(format!("{ratio:.3} × Table 3's (A9)"))
    };
    [
        Row::new(
            format!("K_eq, {name}"),
            Quantity::new(k_eq_printed, "N·m/rad"),
            Quantity::new(k, "N/m"),
            verdict(k_eq_printed, k, format!("N/m, {:.3} rad/s", (k / mass_kg).sqrt())),
        ),
        Row::new(
            format!("C_eq, {name}"),
            Quantity::new(c_eq_printed, "N·m·s/rad"),
            Quantity::new(c, "N·s/m"),
            verdict(c_eq_printed, c, format!("N·s/m, {omega:.3} rad/s")),
        ),
        Row::new(format!("f₁, {name}"), Quantity::new(table_3_hz, "Hz"), Quantity::new(omega / TAU, "Hz"), frequency),
    ]
}

/// A11.
fn clamped_and_weightless(material: &Material) -> Row {
    let implied_hz = implied_omega_n_rad_s(material) / TAU;
    let beam_hz = beam_frequencies_hz(&strip(material, 0.0).clamped(), 1)[0];
    let verdict = if agrees(implied_hz, beam_hz, 1e-3) {
        Verdict::ReproducesIf("clamped and weightless (A11)".to_owned())
    } else {
        Verdict::CannotBe("not the clamped beam either".to_owned())
    };
    Row::new(
        format!("f₁, {}, a beam", material.name),
        Quantity::new(implied_hz, "Hz"),
        Quantity::new(beam_hz, "Hz"),
        verdict,
    )
}

/// A12.
fn damping(material: &Material) -> Result<Row> {
    let mode = first_mode(material, Inertia::Rods)?;
    let because = format!("{:.0} × less (A12)", material.damping_ratio / mode.damping_ratio);
    Ok(Row::new(
        format!("ξ₁, {}", material.name),
        Quantity::new(material.damping_ratio, ""),
        Quantity::new(mode.damping_ratio, ""),
        Verdict::CannotBe(because),
    ))
}
