//! Table 1: the masses, ρ·w·L·t.

use super::published::MATERIALS;
use super::{AGREES, Quantity, Row, Section, Verdict, agrees};

/// The masses.
pub fn section() -> Section {
    let rows = MATERIALS.iter().map(|material| {
        let computed_g = 1e3 * material.mass_kg();
        let verdict = if agrees(material.mass_printed, computed_g, AGREES) {
            Verdict::ReproducesIf("the unit is g (A1)".to_owned())
        } else {
            Verdict::CannotBe("density times volume is another mass".to_owned())
        };
        let paper = Quantity::new(material.mass_printed, "mg");
        Row::new(material.name, paper, Quantity::new(computed_g, "g"), verdict)
    });
    Section { title: "Table 1: masses", rows: rows.collect(), remarks: Vec::new() }
}
