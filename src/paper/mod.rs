//! The paper's tables and Fig. 3 recomputed, number by number, each with a verdict.
//!
//! | file | recomputes |
//! |---|---|
//! | [`published`] | nothing: what the paper prints |
//! | [`equations`] | Eq. 9, 10, 22–24, corrected and as printed |
//! | [`slips`] | what each slip in them does |
//! | [`fig3`] | Fig. 3 |
//! | [`table1`] | the masses |
//! | [`table2`] | K_eq and C_eq |
//! | [`normal_modes`] | Eq. 33 and 34 |
//! | [`table3`] | the frequencies |
//! | [`table4`] | light pressure and displacements |
//! | [`warm`] | the same with heat allowed |
//!
//! The paper measures the damping of thin membranes and validates a model of flexible, high area-to-mass debris under solar radiation
//! pressure. Gravity is taken as 9.81 m/s² throughout; the paper does not state it.

pub mod equations;
pub mod fig3;
pub mod normal_modes;
pub mod published;
pub mod slips;
pub mod table1;
pub mod table2;
pub mod table3;
pub mod table4;
pub mod warm;

use serde::Serialize;

use crate::error::{Error, Result};

/// g everywhere in the comparison.
pub const GRAVITY_M_S2: f64 = 9.81;
/// Two numbers agree when they differ by no more than this share: half a unit of the paper's third digit, at worst.
pub const AGREES: f64 = 3e-3;

/// A number with its unit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Quantity {
    /// The number.
    pub value: f64,
    /// Its unit, empty for a ratio.
    pub unit: &'static str,
}

/// What becomes of one of the paper's numbers.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "verdict", content = "because", rename_all = "snake_case")]
pub enum Verdict {
    /// It comes out, to [`AGREES`] or as the sentence says.
    Reproduces(String),
    /// It comes out under a condition.
    ReproducesIf(String),
    /// It contradicts the rest of the paper, or physics.
    CannotBe(String),
}

/// One number of the paper beside the recomputed one.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Row {
    /// What it is.
    pub quantity: String,
    /// As printed; none where the paper gives no number.
    pub paper: Option<Quantity>,
    /// Recomputed.
    pub computed: Quantity,
    /// Does it reproduce?
    #[serde(flatten)]
    pub verdict: Verdict,
}

/// One table, figure or set of equations.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Section {
    /// Its name in the paper.
    pub title: &'static str,
    /// Its numbers.
    pub rows: Vec<Row>,
    /// What they mean together.
    pub remarks: Vec<String>,
}

/// The whole comparison.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Reproduction {
    schema: &'static str,
    /// g.
    pub gravity_m_s2: f64,
    /// From the lamp to the strip; the paper does not give it.
    pub distance_m: f64,
    /// In the paper's order.
    pub sections: Vec<Section>,
}

impl Reproduction {
    /// Recomputes everything.
    ///
    /// # Errors
    /// [`Error::Option`] for a distance that is not positive; [`Error::Simulation`].
    pub fn of(distance_m: f64) -> Result<Self> {
        if !(distance_m > 0.0 && distance_m.is_finite()) {
            let message = format!("{distance_m}: must be a positive number of metres from the lamp to the strip");
            return Err(Error::Option { option: "--distance-m".to_owned(), message });
        }
        Ok(Self {
            schema: "freeswing.paper/1",
            gravity_m_s2: GRAVITY_M_S2,
            distance_m,
            sections: vec![
                table1::section(),
                slips::section()?,
                fig3::section()?,
                normal_modes::section(),
                table2::section()?,
                table3::section()?,
                table4::section(distance_m)?,
                warm::section()?,
            ],
        })
    }

    /// Rows that reproduce, that do so under a condition, and that cannot be.
    pub fn counts(&self) -> [usize; 3] {
        let mut counts = [0; 3];
        for row in self.sections.iter().flat_map(|s| &s.rows) {
            counts[match row.verdict {
                Verdict::Reproduces(_) => 0,
                Verdict::ReproducesIf(_) => 1,
                Verdict::CannotBe(_) => 2,
            }] += 1;
        }
        counts
    }
}

impl Quantity {
    /// A number with its unit.
    pub const fn new(value: f64, unit: &'static str) -> Self {
        Self { value, unit }
    }
}

impl Row {
    /// A number the paper prints.
    fn new(quantity: impl Into<String>, paper: Quantity, computed: Quantity, verdict: Verdict) -> Self {
        Self { quantity: quantity.into(), paper: Some(paper), computed, verdict }
    }

    /// A number the paper does not print.
    fn unprinted(quantity: impl Into<String>, computed: Quantity, verdict: Verdict) -> Self {
        Self { quantity: quantity.into(), paper: None, computed, verdict }
    }
}

impl Verdict {
    /// The sentence after the verdict; may be empty.
    pub fn because(&self) -> &str {
        match self {
            Self::Reproduces(text) | Self::ReproducesIf(text) | Self::CannotBe(text) => text,
        }
    }
}

/// Whether two numbers differ by no more than a share of the second.
fn agrees(a: f64, b: f64, share: f64) -> bool {
    (a - b).abs() <= share * b.abs()
}

#[cfg(test)]
mod tests;
