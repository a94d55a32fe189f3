//! Table 3: natural frequencies.

use super::published::{LENGTH_M, MATERIALS, Material};
use super::table2::{first_mode, strip};
use super::{AGREES, GRAVITY_M_S2, Quantity, Row, Section, Verdict, agrees, normal_modes};
use crate::error::Result;
use crate::experiment::Inertia;
use crate::model::modes::{beam_frequencies_hz, limp_frequency_hz, rigid_frequency_hz};
use crate::model::strip::{Strip, Support};

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
    let mut remarks = vec![format!(
        "A uniform strip of {LENGTH_M} m hung by a hinge swings at {floor_hz:.4} Hz when limp and {rigid_hz:.4} Hz when rigid; stiffness \
         only raises it (A10). All three measured f₁ lie below, and no mass, stiffness or damping mends that."
    )];
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
    let pairs = MATERIALS.iter().map(|m| {
        let ratio = |pair: [f64; 2]| pair[1] / pair[0];
        let Material { name, frequencies, .. } = m;
        format!("{name} {:.3}, {:.3}", ratio(frequencies.theory_hz), ratio(frequencies.finite_element_hz))
    });
    let beam = beam_frequencies_hz(&strip(&MATERIALS[1], 0.0), Support::Clamped, 2);
    let [slow, fast] = normal_modes::rods(&MATERIALS[0]).modes().map(|m| m.omega_squared_rad2_s2.sqrt());
    let limp = limp_frequency_hz(1, LENGTH_M, GRAVITY_M_S2) / limp_frequency_hz(0, LENGTH_M, GRAVITY_M_S2);
    format!(
        "f₂/f₁ of theory and finite elements: {}. The models: limp strip {limp:.3}, two rods {:.3}, clamped weightless beam {:.3}. So PET 5 \
         mils' pairs are a beam without gravity, its finite elements too.",
        pairs.collect::<Vec<_>>().join("; "),
        fast / slow,
        beam[1] / beam[0]
    )
}

fn material_rows(material: &Material) -> Result<Vec<Row>> {
    let Material { name, frequencies, .. } = material;
    let beam = strip(material, GRAVITY_M_S2);
    let hinged_hz = beam_frequencies_hz(&beam, Support::Hinged, 2);
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
        judged(format!("{name}, finite elements f₁"), frequencies.finite_element_hz[0], hinged_hz[0]),
        judged(format!("{name}, finite elements f₂"), frequencies.finite_element_hz[1], hinged_hz[1]),
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
    add("two rods", &rods_hz);
    add("the hinged beam", &beam_frequencies_hz(beam, Support::Hinged, 2));
    add("the clamped beam", &beam_frequencies_hz(beam, Support::Clamped, 2));
    add("the clamped beam without gravity", &beam_frequencies_hz(&weightless, Support::Clamped, 2));
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
        return Verdict::ReproducesIf(format!("it is {}, {:.4} Hz", nearest.name, nearest.hz));
    }
    let floor_hz = limp_frequency_hz(0, LENGTH_M, GRAVITY_M_S2);
    Verdict::CannotBe(if paper_hz < floor_hz {
        format!("it lies below the floor of a hinged strip, {floor_hz:.4} Hz (A10)")
    } else {
        format!("it is {:+.1} % off, and no mode of rods or beam", 100.0 * (paper_hz / computed_hz - 1.0))
    })
}

/// The free vibration of the model with Table 2's constants.
fn simulated(material: &Material) -> Result<Row> {
    let [rods, lumps] = [first_mode(material, Inertia::Rods)?, first_mode(material, Inertia::Lumps)?];
    let paper_hz = material.frequencies.simulated_hz;
    let verdict = if [&rods, &lumps].iter().any(|m| agrees(paper_hz, m.frequency_hz, AGREES)) {
        Verdict::Reproduces(String::new())
    } else {
        Verdict::CannotBe(format!(
            "with Table 2's K the rods swing as one, on lumps ¼, ½, ¼ at {:.4} Hz",
            lumps.frequency_hz
        ))
    };
    Ok(Row::new(
        format!("{}, simulated f₁", material.name),
        Quantity::new(paper_hz, "Hz"),
        Quantity::new(rods.frequency_hz, "Hz"),
        verdict,
    ))
}

/// The experiment against the stiff and limp bounds (A10).
fn measured(material: &Material, hinged_hz: f64) -> Row {
    let paper_hz = material.frequencies.measured_hz;
    let floor_hz = limp_frequency_hz(0, LENGTH_M, GRAVITY_M_S2);
    let verdict = if paper_hz < floor_hz {
        Verdict::CannotBe(format!(
            "it lies {:.1} % below the floor, {floor_hz:.4} Hz, of a strip hung by a hinge at 1 g in real time (A10)",
            100.0 * (1.0 - paper_hz / floor_hz)
        ))
    } else {
        Verdict::Reproduces(String::new())
    };
    let quantity = format!("{}, measured f₁", material.name);
    Row::new(quantity, Quantity::new(paper_hz, "Hz"), Quantity::new(hinged_hz, "Hz"), verdict)
}
