//! What the paper prints, number by number, units as they should be: its slips are judged elsewhere, not mended here.

/// One specimen in all four tables.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Material {
    /// As in the tables.
    pub name: &'static str,
    /// Table 1.
    pub thickness_m: f64,
    /// Table 1, the bare number; the paper says mg.
    pub mass_printed: f64,
    /// Table 1.
    pub density_kg_m3: f64,
    /// Table 1.
    pub young_modulus_pa: f64,
    /// Table 2.
    pub damping_ratio: f64,
    /// Table 2, the bare number; the paper says N·m/rad.
    pub k_eq_printed: f64,
    /// Table 2, the bare number; the paper says N·m·s/rad.
    pub c_eq_printed: f64,
    /// Table 3.
    pub frequencies: Frequencies,
    /// Table 4, at [`POWERS_W`]: (simulated − measured)/measured.
    pub multibody_error: [f64; 4],
    /// Table 4, at [`POWERS_W`].
    pub finite_element_error: [f64; 4],
}

/// A row of Table 3.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frequencies {
    /// f₁ of the free vibration, simulated (MATLAB).
    pub simulated_hz: f64,
    /// f₁ of the free vibration, measured.
    pub measured_hz: f64,
    /// f₁, f₂ of the normal modes (theory).
    pub theory_hz: [f64; 2],
    /// f₁, f₂ by finite elements (ANSYS).
    pub finite_element_hz: [f64; 2],
}

/// Width of every specimen.
pub const WIDTH_M: f64 = 0.05;
/// Length of every specimen.
pub const LENGTH_M: f64 = 0.20;
/// Length of each of the two rods.
pub const ROD_LENGTH_M: f64 = 0.10;
/// Powers of Table 4.
pub const POWERS_W: [f64; 4] = [500.0, 1000.0, 1500.0, 2000.0];
/// Table 1: specular, diffuse and absorbed share of every specimen.
pub const OPTICS: [f64; 3] = [0.60, 0.26, 0.14];

/// Fig. 3: the force on each of the masses 2 and 3.
pub const FIG_3_FORCE_N: f64 = 1e-4;
/// Fig. 3: how long it acts.
pub const FIG_3_DURATION_S: f64 = 2.0;
/// Fig. 3: the displacement of mass 3 it shows.
pub const FIG_3_PEAK_M: f64 = 0.0254;
/// Section II calls this number C_eq and gives it the unit N·m/rad.
pub const FIG_3_STIFFNESS_N_M_PER_RAD: f64 = 0.05;
/// Section II calls this number K_eq and gives it the unit N·m·s/rad.
pub const FIG_3_DAMPING_N_M_S_PER_RAD: f64 = 0.0004;

/// The three specimens in the order of Table 1.
pub const MATERIALS: [Material; 3] = [
    Material {
        name: "PET 1 mil",
        thickness_m: 25.4e-6,
        mass_printed: 0.3530,
        density_kg_m3: 1390.0,
        young_modulus_pa: 8.81e9,
        damping_ratio: 0.0409,
        k_eq_printed: 0.0258,
        c_eq_printed: 2.467e-4,
        frequencies: Frequencies {
            simulated_hz: 0.5581,
            measured_hz: 0.5156,
            theory_hz: [0.5265, 1.3474],
            finite_element_hz: [0.5350, 1.3815],
        },
        multibody_error: [-0.0993, -0.1201, -0.0813, -0.0355],
        finite_element_error: [0.0646, 0.0519, 0.0520, 0.0173],
    },
    Material {
        name: "PET 5 mils",
        thickness_m: 127e-6,
        mass_printed: 1.7653,
        density_kg_m3: 1390.0,
        young_modulus_pa: 8.81e9,
        damping_ratio: 0.0145,
        k_eq_printed: 0.1162,
        c_eq_printed: 4.153e-4,
        frequencies: Frequencies {
            simulated_hz: 1.4190,
            measured_hz: 1.3090,
            theory_hz: [1.3480, 8.1566],
            finite_element_hz: [1.3338, 8.3209],
        },
        multibody_error: [-0.0357, -0.0849, -0.1140, -0.0371],
        finite_element_error: [0.0070, 0.0475, 0.0620, 0.0288],
    },
    Material {
        name: "Kapton 1 mil",
        thickness_m: 25.4e-6,
        mass_printed: 0.3606,
        density_kg_m3: 1420.0,
        young_modulus_pa: 2.50e9,
        damping_ratio: 0.0441,
        k_eq_printed: 0.0251,
        c_eq_printed: 2.652e-4,
        frequencies: Frequencies {
            simulated_hz: 0.2087,
            measured_hz: 0.2109,
            theory_hz: [0.2299, 0.6147],
            finite_element_hz: [0.2095, 0.6270],
        },
        multibody_error: [-0.0828, -0.0983, -0.0748, -0.0345],
        finite_element_error: [0.0648, 0.0559, 0.0562, 0.0290],
    },
];

impl Material {
    /// Mass from Table 1's density and size (kg), ρ·w·L·t.
    pub fn mass_kg(&self) -> f64 {
        self.density_kg_m3 * WIDTH_M * LENGTH_M * self.thickness_m
    }

    /// Table 1's mass, read as grams (kg).
    pub fn table_mass_kg(&self) -> f64 {
        1e-3 * self.mass_printed
    }
}
