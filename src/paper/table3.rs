//! Table 3: natural frequencies.

use std::f64::consts::TAU;

use super::published::{LENGTH_M, MATERIALS, Material, ROD_LENGTH_M};
use super::table2::{first_mode, strip};
use super::{AGREES, GRAVITY_M_S2, Quantity, Row, Section, Verdict, agrees, normal_modes};
use crate::error::Result;
use crate::experiment::Inertia;
use crate::model::modes::{beam_frequencies_hz, limp_frequency_hz, rigid_frequency_hz};
use crate::model::strip::Strip;

/// A number of Table 3 this near to a mode of another model is taken to be that mode.
const RESEMBLES: f64 = 0.01;

/// A frequency that a model of the strip has.
struct Candidate {
    name: String,
    hz: f64,
}

/// Table 3.
///
/// # Errors
/// [`crate::Error::Simulation`].
pub fn section() -> Result<Section> {
    let mut rows = Vec::new();
    for material in &MATERIALS {
        rows.extend(material_rows(material)?);
    }
    let floor_hz = limp_frequency_hz(0, LENGTH_M, GRAVITY_M_S2);
    let rigid_hz = rigid_frequency_hz(LENGTH_M, GRAVITY_M_S2);
    let mut remarks = vec![
        "Computed: for the simulation the paper's lumps ¼, ½, ¼ with Table 2's K and C, whose rods swing as one (0, ⅔, ⅓ swing alike); for \
         the theory two rods; for the experiment and the finite elements (FE) a hinged beam in gravity."
            .to_owned(),
        format!(
            "The floor: a uniform strip of {LENGTH_M} m hung by a hinge swings at {floor_hz:.4} Hz when limp and {rigid_hz:.4} Hz when \
             rigid; stiffness only raises it (A10). All three measured f₁ lie below, PET 5 mils' too, and neither mass nor stiffness nor \
             damping mends that."
        ),
    ];
    remarks.extend(MATERIALS.iter().map(|material| {
        let share = material.frequencies.measured_hz / floor_hz;
        format!(
            "{}: {} Hz becomes the floor's with the time base {:.3} times faster, or L = {:.3} m, or g = {:.2} m/s².",
            material.name,
            material.frequencies.measured_hz,
            1.0 / share,
            LENGTH_M / share.powi(2),
            GRAVITY_M_S2 * share.powi(2)
        )
    }));
    remarks.push(ratios());
    Ok(Section { title: "Table 3: natural frequencies", rows, remarks })
}

/// f₂/f₁ does not depend on a wrong time base: which model do the pairs belong to?
fn ratios() -> String {
    let ratio = |[first, second]: [f64; 2]| second / first;
    let pairs = MATERIALS.iter().map(|Material { name, frequencies, .. }| {
        format!("{name} {:.3} and {:.3}", ratio(frequencies.theory_hz), ratio(frequencies.finite_element_hz))
    });
    let weightless = beam_frequencies_hz(&strip(&MATERIALS[1], 0.0).clamped(), 2);
    let [slow, fast] = normal_modes::rods(&MATERIALS[0]).modes().map(|m| m.omega_squared_rad2_s2.sqrt());
    let limp = [0, 1].map(|k| limp_frequency_hz(k, LENGTH_M, GRAVITY_M_S2));
    let above = |k: usize| 100.0 * (MATERIALS[1].frequencies.finite_element_hz[k] / weightless[k] - 1.0);
    format!(
        "f₂/f₁ of theory and FE: {}. Of the models: limp strip {:.3}, two rods {:.3}, clamped beam without gravity {:.3}. PET 5 mils' \
         FE pair lies {:.1} and {:.1} % above that beam's own: it is such a beam, not a hinged strip in gravity.",
        pairs.collect::<Vec<_>>().join(", "),
        ratio(limp),
        fast / slow,
        weightless[1] / weightless[0],
        above(0),
        above(1)
    )
}

fn material_rows(material: &Material) -> Result<Vec<Row>> {
    let Material { name, frequencies, .. } = material;
    let beam = strip(material, GRAVITY_M_S2);
    let hinged_hz = beam_frequencies_hz(&beam, 2);
    let [slow, fast] = normal_modes::rods(material).modes().map(|m| m.frequency_hz.unwrap_or(f64::NAN));
    let candidates = candidates(&beam, [slow, fast]);
    let judged = |quantity: String, paper_hz: f64, computed_hz: f64| {
        let verdict = judge(paper_hz, computed_hz, &candidates);
        Row::new(quantity, Quantity::new(paper_hz, "Hz"), Quantity::new(computed_hz, "Hz"), verdict)
    };
    Ok(vec![
        simulated(material)?,
        measured(material, hinged_hz[0]),
        judged(format!("{name}, theory f₁"), frequencies.theory_hz[0], slow),
        judged(format!("{name}, theory f₂"), frequencies.theory_hz[1], fast),
        judged(format!("{name}, FE f₁"), frequencies.finite_element_hz[0], hinged_hz[0]),
        judged(format!("{name}, FE f₂"), frequencies.finite_element_hz[1], hinged_hz[1]),
    ])
}

/// Every mode a number of this table might be.
fn candidates(beam: &Strip, rods_hz: [f64; 2]) -> Vec<Candidate> {
    let weightless = Strip { gravity_m_s2: 0.0, ..*beam };
    let mut candidates = Vec::new();
    let mut add = |model: &str, frequencies_hz: &[f64]| {
        for (k, hz) in frequencies_hz.iter().enumerate() {
            candidates.push(Candidate { name: format!("mode {} of {model}", k + 1), hz: *hz });
        }
    };
    add("the two rods", &rods_hz);
    add("a hinged beam", &beam_frequencies_hz(beam, 2));
    add("a clamped beam", &beam_frequencies_hz(&beam.clamped(), 2));
    add("a clamped beam without g", &beam_frequencies_hz(&weightless.clamped(), 2));
    candidates
}

/// Is it the mode it is said to be, or another one, or below every possible one?
fn judge(paper_hz: f64, computed_hz: f64, candidates: &[Candidate]) -> Verdict {
    if agrees(paper_hz, computed_hz, AGREES) {
        return Verdict::Reproduces(String::new());
    }
    let off = |c: &Candidate| (paper_hz / c.hz).ln().abs();
    if let Some(nearest) = candidates.iter().min_by(|a, b| off(a).total_cmp(&off(b)))
        && agrees(paper_hz, nearest.hz, RESEMBLES)
    {
        return Verdict::ReproducesIf(format!("it is {} ({:.4})", nearest.name, nearest.hz));
    }
    let floor_hz = limp_frequency_hz(0, LENGTH_M, GRAVITY_M_S2);
    Verdict::CannotBe(if paper_hz < floor_hz {
        "below the floor (A10)".to_owned()
    } else {
        "no mode of rods or beam".to_owned()
    })
}

/// The free vibration of the paper's own model, lumps with Table 2's constants.
fn simulated(material: &Material) -> Result<Row> {
    let model_hz = first_mode(material, Inertia::Lumps)?.frequency_hz;
    let paper_hz = material.frequencies.simulated_hz;
    let verdict = if agrees(paper_hz, model_hz, AGREES) {
        Verdict::Reproduces(String::new())
    } else if let Some(share) = tip_to_joint_mass(paper_hz) {
        Verdict::CannotBe(format!("it takes m₃ = {share:.3} m₂"))
    } else {
        Verdict::CannotBe("no lumps swing so slowly".to_owned())
    };
    let quantity = format!("{}, simulated f₁", material.name);
    Ok(Row::new(quantity, Quantity::new(paper_hz, "Hz"), Quantity::new(model_hz, "Hz"), verdict))
}

/// m₃/m₂ with which two equal rods that swing as one have a frequency, from ω² = (g/L)(m₂ + 2m₃)/(m₂ + 4m₃); none has it outside
/// g/2L < ω² < g/L.
fn tip_to_joint_mass(frequency_hz: f64) -> Option<f64> {
    let share = (TAU * frequency_hz).powi(2) * ROD_LENGTH_M / GRAVITY_M_S2;
    (share > 0.5 && share < 1.0).then(|| (1.0 - share) / (4.0 * share - 2.0))
}

/// The experiment against the stiff and limp bounds (A10).
fn measured(material: &Material, hinged_hz: f64) -> Row {
    let paper_hz = material.frequencies.measured_hz;
    let floor_hz = limp_frequency_hz(0, LENGTH_M, GRAVITY_M_S2);
    let verdict = if paper_hz < floor_hz {
        Verdict::CannotBe(format!("{:.1} % below the floor (A10)", 100.0 * (1.0 - paper_hz / floor_hz)))
    } else {
        Verdict::Reproduces(String::new())
    };
    let quantity = format!("{}, measured f₁", material.name);
    Row::new(quantity, Quantity::new(paper_hz, "Hz"), Quantity::new(hinged_hz, "Hz"), verdict)
}
