//! What each slip in Eq. 9 to 24 does, as a number.

use super::equations::{Instant, Lumps, Slip, SmallMotion};
use super::published::{MATERIALS, ROD_LENGTH_M};
use super::{GRAVITY_M_S2, Quantity, Row, Section, Verdict};
use crate::error::Result;

/// A swing in which every term counts: both rods out, both moving, the lower one faster.
const SWING: Instant = Instant { theta_rad: [0.2, 0.4], omega_rad_s: [2.0, 4.0], force_n: [[0.0; 2]; 2] };

/// PET 1 mil on the lumps ¼, ½, ¼ without spring and damper.
fn limp() -> Lumps {
    let mass_kg = MATERIALS[0].table_mass_kg();
    Lumps {
        mass_kg: [0.5 * mass_kg, 0.25 * mass_kg],
        length_m: [ROD_LENGTH_M; 2],
        gravity_m_s2: GRAVITY_M_S2,
        stiffness_n_m_per_rad: 0.0,
        damping_n_m_s_per_rad: 0.0,
    }
}

/// Eq. 9 to 24.
///
/// # Errors
/// [`crate::Error::Simulation`].
pub fn section() -> Result<Section> {
    let mut rows =
        vec![load_sign(), load_component(), rotation_rate(), gravity_sign()?, side_force_sign(), coupling_length()?];
    rows.extend(joint_forces()?);
    let remarks = [
        "\"Paper\" is the equation with that one slip, \"computed\" the corrected one, for PET 1 mil on the lumps ¼, ½, ¼. Pushes are \
         answered in rad/s² of rod 2, both rods at 0.4 rad (y) or hanging (x); a second mode in 1/s is no swing but a fall that grows by e \
         in each 1/rate.",
        "In A₂ gravity and side force both have the wrong sign: at rest the two slips cancel, so statics hide what motion shows. Energy \
         from nothing is power over kinetic energy with the rods at 0.2 and 0.4 rad, 2 and 4 rad/s.",
        "C₃ is shown with rods of 0.08 and 0.12 m; with the paper's equal rods it makes no difference.",
        "A joint gives equal and opposite torques ±K(θ₂ − θ₁). Read as forces K(θ₂ − θ₁)/L along x on the masses 2 and 3, alike or opposed, \
         it is not symmetric and makes or takes energy; first mode shown, with Table 2's K.",
    ]
    .map(str::to_owned)
    .to_vec();
    Ok(Section { title: "Equations 9 to 24: what the slips do", rows, remarks })
}

/// A3: what holds rod 2 upright when half the weight of mass 3 is lifted.
fn load_sign() -> Row {
    let lumps = limp();
    let weight_n = lumps.mass_kg[1] * GRAVITY_M_S2;
    let held = |slips: &[Slip]| {
        let [held, free] = [0.5 * weight_n, 0.0].map(|lift_n| {
            let at = Instant { theta_rad: [0.0, 1e-6], force_n: [[0.0; 2], [0.0, lift_n]], ..Instant::default() };
            lumps.acceleration_rad_s2(&at, slips)[1]
        });
        Quantity::new(held / free, "m₃g")
    };
    Row::new(
        "Eq. 12, ½ m₃g lifted off",
        held(&[Slip::LoadSign]),
        held(&[]),
        Verdict::CannotBe("it is +F_y, up like y (A3)".to_owned()),
    )
}

/// A4: the angular acceleration of rod 2 from a force along y, rods at an angle.
fn load_component() -> Row {
    let lumps = limp();
    let answer = |slips: &[Slip]| {
        let [pushed, free] = [1e-4, 0.0].map(|lift_n| {
            let at = Instant { theta_rad: [0.4, 0.4], force_n: [[0.0; 2], [0.0, lift_n]], ..Instant::default() };
            lumps.acceleration_rad_s2(&at, slips)[1]
        });
        Quantity::new(pushed - free, "rad/s²")
    };
    Row::new(
        "Eq. 24, 0.1 mN along y",
        answer(&[Slip::LoadComponent]),
        answer(&[]),
        Verdict::CannotBe("it is s₂F_y, as in Eq. 23 (A4)".to_owned()),
    )
}

/// A4: energy from nothing.
fn rotation_rate() -> Row {
    let lumps = limp();
    let gain = |slips: &[Slip]| {
        Quantity::new(lumps.power_from_nothing_w(&SWING, slips) / lumps.kinetic_energy_j(&SWING), "1/s")
    };
    Row::new(
        "Eq. 23, energy from nothing",
        gain(&[Slip::RotationRate]),
        gain(&[]),
        Verdict::CannotBe("it is (dθ₁/dt)² (A4)".to_owned()),
    )
}

/// A4: the hanging position is not stable.
fn gravity_sign() -> Result<Row> {
    let lumps = limp();
    Ok(Row::new(
        "Eq. 23, second mode",
        fastest(&lumps, &[Slip::GravitySign])?,
        fastest(&lumps, &[])?,
        Verdict::CannotBe("it is −s₂m₃g (A4): rods fall up".to_owned()),
    ))
}

/// A4: which way a side force pushes.
fn side_force_sign() -> Row {
    let lumps = limp();
    let answer = |slips: &[Slip]| {
        let at = Instant { force_n: [[0.0; 2], [1e-4, 0.0]], ..Instant::default() };
        Quantity::new(lumps.acceleration_rad_s2(&at, slips)[1], "rad/s²")
    };
    Row::new(
        "Eq. 23, 0.1 mN along x",
        answer(&[Slip::SideForceSign]),
        answer(&[]),
        Verdict::CannotBe("it is +c₂F_x (A4)".to_owned()),
    )
}

/// A5: nothing at equal rods.
fn coupling_length() -> Result<Row> {
    let equal = limp();
    let unequal = Lumps { length_m: [0.08, 0.12], ..equal };
    let same = (fastest(&equal, &[Slip::CouplingLength])?.value - fastest(&equal, &[])?.value).abs() < 1e-9;
    let text = "L₁ = L₂; C₃ holds L₁ (A5)".to_owned();
    let verdict = if same { Verdict::ReproducesIf(text) } else { Verdict::CannotBe(text) };
    let printed = fastest(&unequal, &[Slip::CouplingLength])?;
    Ok(Row::new("Eq. 24, C₃, second mode", printed, fastest(&unequal, &[])?, verdict))
}

/// A6: spring and damper as forces.
fn joint_forces() -> Result<[Row; 2]> {
    let lumps = Lumps { stiffness_n_m_per_rad: MATERIALS[0].k_eq_printed, ..limp() };
    let right = slowest(&lumps, &[])?;
    let row = |name: &str, slip: Slip, because: &str| -> Result<Row> {
        Ok(Row::new(name, slowest(&lumps, &[slip])?, right, Verdict::CannotBe(because.to_owned())))
    };
    Ok([
        row("Eq. 9, forces alike", Slip::JointForcesAlike, "it is a torque (A6)")?,
        row("Eq. 9, forces opposed", Slip::JointForcesOpposed, "it is a torque (A6)")?,
    ])
}

fn slowest(lumps: &Lumps, slips: &[Slip]) -> Result<Quantity> {
    Ok(quantity(lumps.small_motions(slips)?[0]))
}

fn fastest(lumps: &Lumps, slips: &[Slip]) -> Result<Quantity> {
    Ok(quantity(lumps.small_motions(slips)?[1]))
}

fn quantity(motion: SmallMotion) -> Quantity {
    match motion {
        SmallMotion::Swings { hz } => Quantity::new(hz, "Hz"),
        SmallMotion::Falls { per_s } | SmallMotion::Flutters { per_s, .. } => Quantity::new(per_s, "/s"),
    }
}
