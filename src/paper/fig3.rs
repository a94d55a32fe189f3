//! Fig. 3: Kapton 1 mil pushed by 0.1 mN on each of the masses 2 and 3 for 2 s.

use super::equations::{Instant, Lumps};
use super::published::{
    FIG_3_DAMPING_N_M_S_PER_RAD, FIG_3_DURATION_S, FIG_3_FORCE_N, FIG_3_PEAK_M, FIG_3_STIFFNESS_N_M_PER_RAD, MATERIALS,
    ROD_LENGTH_M,
};
use super::{AGREES, GRAVITY_M_S2, Quantity, Row, Section, Verdict, agrees};
use crate::error::Result;

/// Shares of the mass at the hinge, the joint and the tip, and the joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Push {
    /// They sum to 1.
    pub lumps: [f64; 3],
    /// K.
    pub stiffness_n_m_per_rad: f64,
    /// C.
    pub damping_n_m_s_per_rad: f64,
}

impl Push {
    /// The joint of Fig. 3, by its units.
    pub fn of(lumps: [f64; 3]) -> Self {
        Self {
            lumps,
            stiffness_n_m_per_rad: FIG_3_STIFFNESS_N_M_PER_RAD,
            damping_n_m_s_per_rad: FIG_3_DAMPING_N_M_S_PER_RAD,
        }
    }
}

/// Largest displacement of mass 3 along x (m) while the forces act, from rest.
///
/// # Errors
/// [`crate::Error::Simulation`].
pub fn fig3_peak_m(push: &Push) -> Result<f64> {
    let lumps = Lumps {
        mass_kg: [push.lumps[1], push.lumps[2]].map(|share| share * MATERIALS[2].table_mass_kg()),
        length_m: [ROD_LENGTH_M; 2],
        gravity_m_s2: GRAVITY_M_S2,
        stiffness_n_m_per_rad: push.stiffness_n_m_per_rad,
        damping_n_m_s_per_rad: push.damping_n_m_s_per_rad,
    };
    Ok(peak_by_runge_kutta_m(&lumps, 2e-5))
}

/// The classical Runge–Kutta method at a fixed step on Eq. 25.
fn peak_by_runge_kutta_m(lumps: &Lumps, step_s: f64) -> f64 {
    let force_n = [[FIG_3_FORCE_N, 0.0]; 2];
    let rates = |y: [f64; 4]| {
        let at = Instant { theta_rad: [y[0], y[1]], omega_rad_s: [y[2], y[3]], force_n };
        let [a1, a2] = lumps.acceleration_rad_s2(&at, &[]);
        [y[2], y[3], a1, a2]
    };
    let moved = |y: [f64; 4], k: [f64; 4], h: f64| std::array::from_fn(|i| y[i] + h * k[i]);
    let (mut y, mut peak_m) = ([0.0; 4], 0.0f64);
    for _ in 0..(FIG_3_DURATION_S / step_s).round() as usize {
        let k1 = rates(y);
        let k2 = rates(moved(y, k1, step_s / 2.0));
        let k3 = rates(moved(y, k2, step_s / 2.0));
        let k4 = rates(moved(y, k3, step_s));
        y = std::array::from_fn(|i| y[i] + step_s / 6.0 * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]));
        peak_m = peak_m.max(lumps.length_m[0] * y[0].sin() + lumps.length_m[1] * y[1].sin());
    }
    peak_m
}

/// Fig. 3.
///
/// # Errors
/// [`crate::Error::Simulation`].
pub fn section() -> Result<Section> {
    let row = |name: &str, push: &Push, found: fn(bool) -> Verdict| -> Result<Row> {
        let peak_m = fig3_peak_m(push)?;
        let verdict = found(agrees(FIG_3_PEAK_M, peak_m, AGREES));
        Ok(Row::new(name, Quantity::new(FIG_3_PEAK_M, "m"), Quantity::new(peak_m, "m"), verdict))
    };
    let fitting = Push::of([0.0, 2.0 / 3.0, 1.0 / 3.0]);
    let exchanged = Push {
        stiffness_n_m_per_rad: FIG_3_DAMPING_N_M_S_PER_RAD,
        damping_n_m_s_per_rad: FIG_3_STIFFNESS_N_M_PER_RAD,
        ..fitting
    };
    let rows = vec![
        row("tip, lumps 0, ⅔, ⅓", &fitting, |agrees| {
            if agrees {
                Verdict::ReproducesIf("(m₂ + 2m₃)/M = 4/3".to_owned())
            } else {
                Verdict::CannotBe("the tip goes elsewhere".to_owned())
            }
        })?,
        row("tip, lumps ¼, ½, ¼", &Push::of([0.25, 0.5, 0.25]), |agrees| {
            if agrees {
                Verdict::Reproduces(String::new())
            } else {
                Verdict::CannotBe("a uniform strip's lumps let it go further".to_owned())
            }
        })?,
        row("0, ⅔, ⅓, K and C as named", &exchanged, |agrees| {
            if agrees {
                Verdict::ReproducesIf("the names are exchanged back (A2); the peak cannot tell".to_owned())
            } else {
                Verdict::CannotBe("the names are exchanged (A2)".to_owned())
            }
        })?,
    ];
    let remarks = [
        "The text calls 0.05 N·m/rad C_eq and 0.0004 N·m·s/rad K_eq; the units say which is which (A2).",
        "Either joint is so stiff that the rods swing as one: the peak is twice the displacement at rest, 2·6FL/((m₂ + 2m₃)g), so it \
         tells (m₂ + 2m₃)/M and nothing about K or C.",
    ]
    .map(str::to_owned)
    .to_vec();
    Ok(Section { title: "Fig. 3: Kapton 1 mil, 0.1 mN on masses 2 and 3 for 2 s", rows, remarks })
}
