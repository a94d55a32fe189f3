//! Eq. 33 and 34: two rods under gravity alone.

use super::published::{LENGTH_M, MATERIALS, Material, ROD_LENGTH_M};
use super::{GRAVITY_M_S2, Quantity, Row, Section, Verdict};
use crate::model::modes::{RodMode, TwoRods};

/// The paper's rods, half of the mass each; their frequencies are the same for every mass.
pub fn rods(material: &Material) -> TwoRods {
    TwoRods {
        mass_kg: [0.5 * material.table_mass_kg(); 2],
        length_m: [ROD_LENGTH_M; 2],
        gravity_m_s2: GRAVITY_M_S2,
        joint_stiffness_n_m_per_rad: 0.0,
        hinge_stiffness_n_m_per_rad: 0.0,
    }
}

/// Eq. 33 and 34, corrected and as printed; Table 3 holds their numbers.
pub fn section() -> Section {
    let rods = rods(&MATERIALS[0]);
    let (corrected, printed) = (rods.modes(), rods.as_printed());
    let literal = |name: &str, printed: &RodMode, corrected: &RodMode, because: &str| {
        Row::new(name, quantity(printed), quantity(corrected), Verdict::CannotBe(because.to_owned()))
    };
    let labelled = Row::unprinted(
        "Eq. 34, A₁/A₂, + root",
        Quantity::new(corrected[1].amplitude_ratio, ""),
        Verdict::CannotBe("the text has it positive".to_owned()),
    );
    let rows = vec![
        literal("Eq. 33, − root", &printed[0], &corrected[0], "k₅, k₆ > 0; 4k₁k₅k₆² (A7)"),
        literal("Eq. 33, + root", &printed[1], &corrected[1], "k₅, k₆ > 0; 4k₁k₅k₆² (A7)"),
        k2_slip(),
        labelled,
    ];
    let kapton = MATERIALS[2].frequencies.theory_hz;
    let [slow_hz, fast_hz] = corrected.map(|m| m.frequency_hz.unwrap_or(f64::NAN));
    let scale = kapton[0] / slow_hz;
    let remarks = vec![
        format!(
            "As printed one ω² is negative, a fall. The text below Eq. 34 calls the + root the first mode, in phase (A₁/A₂ > 0). It is the \
             fast one with the rods opposed; the slow one has {:.4}.",
            corrected[0].amplitude_ratio
        ),
        format!(
            "These rods of {LENGTH_M} m swing at {slow_hz:.4} and {fast_hz:.4} Hz whatever their mass, so the theory column cannot hold \
             three pairs."
        ),
        format!(
            "Kapton's pair has the ratio f₂/f₁ = {:.3}, the rods {:.3}: it is this pair with every frequency divided by {:.2}, as if g \
             were {:.3} m/s².",
            kapton[1] / kapton[0],
            fast_hz / slow_hz,
            1.0 / scale,
            GRAVITY_M_S2 * scale * scale
        ),
    ];
    Section { title: "Eq. 33, 34: two rods under gravity", rows, remarks }
}

/// m₁L₁² for m₂L₁² in k₂: nothing at equal rods, so shown at unequal ones.
fn k2_slip() -> Row {
    let rods = TwoRods { mass_kg: [1.0, 3.0], ..rods(&MATERIALS[0]) };
    let slow = |hz: [RodMode; 2]| hz.iter().filter_map(|m| m.frequency_hz).fold(f64::INFINITY, f64::min);
    Row::new(
        "Eq. 33, masses 1 : 3, slow",
        Quantity::new(slow(rods.as_printed()), "Hz"),
        Quantity::new(slow(rods.modes()), "Hz"),
        Verdict::CannotBe("k₂ holds m₂L₁², not m₁L₁² (A7)".to_owned()),
    )
}

fn quantity(mode: &RodMode) -> Quantity {
    match mode.frequency_hz {
        Some(hz) => Quantity::new(hz, "Hz"),
        None => Quantity::new(mode.omega_squared_rad2_s2, "rad²/s²"),
    }
}
