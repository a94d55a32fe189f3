//! The strip as a continuum: an Euler–Bernoulli beam hung in gravity, by finite elements.
//!
//! With x down the strip from its support, w(x, t) across it, μ its mass per length and T the tension of what hangs below,
//!
//! ```text
//! μ ẅ + (EI w″)″ − (T w′)′ = p        T(x) = μ g (L − x)
//! ```
//!
//! Each element carries the cubic Hermite shape functions of its end displacements and slopes (w₁, φ₁, w₂, φ₂):
//!
//! ```text
//! M = ∫ μ N Nᵀ dx        K = ∫ EI N″N″ᵀ dx + ∫ T N′N′ᵀ dx        f = ∫ p N dx
//! ```
//!
//! The masses are consistent, the tension's share is the geometric stiffness; the integrals are exact. It holds for small slopes.

use nalgebra::{DMatrix, DVector, Matrix4, Vector4};

use crate::experiment::Specimen;

/// How the strip is held at its upper end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Support {
    /// Held and free to turn.
    Hinged,
    /// Held and kept vertical.
    Clamped,
}

impl Support {
    /// Freedoms of the first node that it holds: w, and at a clamp φ.
    fn held(self) -> usize {
        match self {
            Self::Hinged => 1,
            Self::Clamped => 2,
        }
    }
}

/// A uniform strip hung by its upper end.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Strip {
    /// L.
    pub length_m: f64,
    /// μ.
    pub mass_per_length_kg_m: f64,
    /// EI, zero for a limp strip.
    pub bending_stiffness_n_m2: f64,
    /// g.
    pub gravity_m_s2: f64,
}

impl Strip {
    /// The strip of a specimen; its bending stiffness is EI = E w t³/12, none where modulus or thickness are not given.
    pub fn of(specimen: &Specimen, gravity_m_s2: f64) -> Option<Self> {
        let (thickness_m, young_modulus_pa) = (specimen.thickness_m?, specimen.young_modulus_pa?);
        Some(Self {
            length_m: specimen.length_m,
            mass_per_length_kg_m: specimen.mass_kg / specimen.length_m,
            bending_stiffness_n_m2: young_modulus_pa * specimen.width_m * thickness_m.powi(3) / 12.0,
            gravity_m_s2,
        })
    }

    /// Over this length the bending at a clamp dies away (m): √(EI/T) at the support; none without gravity.
    pub fn boundary_layer_m(&self) -> f64 {
        let tension_n = self.mass_per_length_kg_m * self.gravity_m_s2 * self.length_m;
        (self.bending_stiffness_n_m2 / tension_n).sqrt()
    }

    /// Assembles mass, stiffness and load over a mesh. The freedoms are (w, φ) of each node from the support down, without those held.
    pub fn assemble(&self, mesh: &Mesh, support: Support) -> StripMatrices {
        let freedoms = 2 * mesh.nodes_m.len();
        let mut whole = StripMatrices {
            mass_kg: DMatrix::zeros(freedoms, freedoms),
            stiffness_n_m: DMatrix::zeros(freedoms, freedoms),
            pressure_load_m: DVector::zeros(freedoms),
        };
        for (k, element) in mesh.elements().enumerate() {
            let mut mass_kg = whole.mass_kg.fixed_view_mut::<4, 4>(2 * k, 2 * k);
            mass_kg += element.mass_m() * self.mass_per_length_kg_m;
            let mut stiffness_n_m = whole.stiffness_n_m.fixed_view_mut::<4, 4>(2 * k, 2 * k);
            stiffness_n_m += element.bending_per_m3() * self.bending_stiffness_n_m2;
            stiffness_n_m += element.tension(|x_m| self.tension_n(x_m));
            let mut load_m = whole.pressure_load_m.fixed_rows_mut::<4>(2 * k);
            load_m += element.load_m();
        }
        let held = support.held();
        StripMatrices {
            mass_kg: whole.mass_kg.remove_rows(0, held).remove_columns(0, held),
            stiffness_n_m: whole.stiffness_n_m.remove_rows(0, held).remove_columns(0, held),
            pressure_load_m: whole.pressure_load_m.remove_rows(0, held),
        }
    }

    /// ω² (rad²/s²) that a shape given by its freedoms would swing with: Rayleigh's quotient, twice the stored energy over twice the kinetic
    /// energy at unit rate.
    ///
    /// It is summed over the elements, whose bending ∫w″²dx = 4(a² + ab + b²)/h follows from the slopes a, b of their ends against their
    /// chord: a stiff strip that swings without bending keeps its digits, which the assembled matrix would lose.
    pub fn rayleigh_quotient_rad2_s2(&self, mesh: &Mesh, support: Support, shape: &[f64]) -> f64 {
        let held = support.held();
        let freedom = |k: usize| if k < held { 0.0 } else { shape[k - held] };
        let (mut stored_j, mut kinetic_kg_m2) = (0.0, 0.0);
        for (k, element) in mesh.elements().enumerate() {
            let ends = Vector4::from_fn(|i, _| freedom(2 * k + i));
            let chord = (ends[2] - ends[0]) / element.length_m;
            let (a, b) = (ends[1] - chord, ends[3] - chord);
            stored_j += self.bending_stiffness_n_m2 * 4.0 * (a * a + a * b + b * b) / element.length_m;
            stored_j += ends.dot(&(element.tension(|x_m| self.tension_n(x_m)) * ends));
            kinetic_kg_m2 += self.mass_per_length_kg_m * ends.dot(&(element.mass_m() * ends));
        }
        stored_j / kinetic_kg_m2
    }

    /// T(x).
    fn tension_n(&self, x_m: f64) -> f64 {
        self.mass_per_length_kg_m * self.gravity_m_s2 * (self.length_m - x_m)
    }

    /// Displacement of the free end (m) under a steady force per length across the strip.
    pub fn tip_under_pressure_m(&self, support: Support, force_per_length_n_m: f64) -> Option<f64> {
        let matrices = self.assemble(&Mesh::of(self), support);
        let deflection = matrices.stiffness_n_m.cholesky()?.solve(&(matrices.pressure_load_m * force_per_length_n_m));
        Some(deflection[deflection.len() - 2])
    }
}

/// Where the nodes stand, from the support (0) to the free end (L).
#[derive(Debug, Clone, PartialEq)]
pub struct Mesh {
    nodes_m: Vec<f64>,
}

impl Mesh {
    /// Elements of each of the two parts.
    const ELEMENTS: usize = 40;
    /// The finer part ends this many boundary layers below the support.
    const LAYERS: f64 = 12.0;

    /// A mesh fine enough for the first few modes: half its elements within the boundary layer where that is thin.
    pub fn of(strip: &Strip) -> Self {
        let layer_m = strip.boundary_layer_m();
        let fine_m =
            if layer_m > 0.0 { (Self::LAYERS * layer_m).min(0.5 * strip.length_m) } else { 0.5 * strip.length_m };
        let part = |from_m: f64, until_m: f64| {
            let step_m = (until_m - from_m) / Self::ELEMENTS as f64;
            (0..Self::ELEMENTS).map(move |k| from_m + step_m * k as f64)
        };
        let nodes_m = part(0.0, fine_m).chain(part(fine_m, strip.length_m)).chain([strip.length_m]).collect();
        Self { nodes_m }
    }

    fn elements(&self) -> impl Iterator<Item = Element> {
        self.nodes_m.windows(2).map(|ends_m| Element { from_m: ends_m[0], length_m: ends_m[1] - ends_m[0] })
    }

    /// Nodes, from the support down.
    pub fn nodes_m(&self) -> &[f64] {
        &self.nodes_m
    }
}

/// The assembled strip.
#[derive(Debug, Clone, PartialEq)]
pub struct StripMatrices {
    /// Consistent masses. Rows of slopes carry kg·m and kg·m².
    pub mass_kg: DMatrix<f64>,
    /// Bending and tension. Rows of slopes carry N and N·m.
    pub stiffness_n_m: DMatrix<f64>,
    /// Nodal forces of a unit force per length.
    pub pressure_load_m: DVector<f64>,
}

/// One beam element.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Element {
    /// x of its upper node.
    from_m: f64,
    /// h.
    length_m: f64,
}

impl Element {
    /// ∫ N Nᵀ dx.
    #[rustfmt::skip]
    fn mass_m(&self) -> Matrix4<f64> {
        let h = self.length_m;
        Matrix4::new(
            156.0,     22.0 * h,      54.0,    -13.0 * h,
            22.0 * h,   4.0 * h * h,  13.0 * h, -3.0 * h * h,
            54.0,      13.0 * h,     156.0,    -22.0 * h,
            -13.0 * h, -3.0 * h * h, -22.0 * h,  4.0 * h * h,
        ) * (h / 420.0)
    }

    /// ∫ N″N″ᵀ dx.
    #[rustfmt::skip]
    fn bending_per_m3(&self) -> Matrix4<f64> {
        let h = self.length_m;
        Matrix4::new(
            12.0,     6.0 * h,     -12.0,     6.0 * h,
            6.0 * h,  4.0 * h * h,  -6.0 * h, 2.0 * h * h,
            -12.0,   -6.0 * h,      12.0,    -6.0 * h,
            6.0 * h,  2.0 * h * h,  -6.0 * h, 4.0 * h * h,
        ) / h.powi(3)
    }

    /// ∫ T N′N′ᵀ dx, exact for a tension linear in x: three Gauss points are exact to the fifth power.
    fn tension(&self, tension_n: impl Fn(f64) -> f64) -> Matrix4<f64> {
        let offset = 0.5 * 0.6f64.sqrt();
        [(0.5 - offset, 5.0 / 18.0), (0.5, 8.0 / 18.0), (0.5 + offset, 5.0 / 18.0)]
            .into_iter()
            .map(|(s, weight)| {
                let slope = self.slopes_per_m(s);
                slope * slope.transpose() * (weight * self.length_m * tension_n(self.from_m + s * self.length_m))
            })
            .sum()
    }

    /// N′ at the share s of its length.
    fn slopes_per_m(&self, s: f64) -> Vector4<f64> {
        let h = self.length_m;
        let across = 6.0 * (s - s * s) / h;
        Vector4::new(-across, 1.0 - 4.0 * s + 3.0 * s * s, across, 3.0 * s * s - 2.0 * s)
    }

    /// ∫ N dx.
    fn load_m(&self) -> Vector4<f64> {
        let h = self.length_m;
        Vector4::new(h / 2.0, h * h / 12.0, h / 2.0, -h * h / 12.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn kapton() -> Strip {
        Strip {
            length_m: 0.2,
            mass_per_length_kg_m: 1.8034e-3,
            bending_stiffness_n_m2: 1.7069858e-7,
            gravity_m_s2: 9.80665,
        }
    }

    #[test]
    fn a_swing_about_the_hinge_has_the_energies_of_a_rigid_strip() {
        let strip = kapton();
        let mesh = Mesh::of(&strip);
        let matrices = strip.assemble(&mesh, Support::Hinged);
        let turned =
            DVector::from_iterator(2 * mesh.nodes_m().len() - 1, mesh.nodes_m().iter().flat_map(|x| [*x, 1.0]).skip(1));
        let inertia_kg_m2 = turned.dot(&(&matrices.mass_kg * &turned));
        let stiffness_n_m = turned.dot(&(&matrices.stiffness_n_m * &turned));
        let (mu, g, l) = (strip.mass_per_length_kg_m, strip.gravity_m_s2, strip.length_m);
        assert!((inertia_kg_m2 / (mu * l.powi(3) / 3.0) - 1.0).abs() < 1e-12);
        assert!((stiffness_n_m / (mu * g * l * l / 2.0) - 1.0).abs() < 1e-9);
    }

    #[test]
    fn a_clamped_strip_without_gravity_bends_by_p_l4_over_8_ei() {
        let strip = Strip { gravity_m_s2: 0.0, ..kapton() };
        let tip_m = strip.tip_under_pressure_m(Support::Clamped, 1e-9).unwrap();
        let expected_m = 1e-9 * 0.2f64.powi(4) / (8.0 * strip.bending_stiffness_n_m2);
        assert!((tip_m / expected_m - 1.0).abs() < 1e-6, "{tip_m} {expected_m}");
    }

    #[test]
    fn a_hinged_strip_under_pressure_hangs_straight_at_the_ratio_of_force_to_weight() {
        let strip = kapton();
        let tip_m = strip.tip_under_pressure_m(Support::Hinged, 1e-7).unwrap();
        let expected_m = 0.2 * 1e-7 / (strip.mass_per_length_kg_m * strip.gravity_m_s2);
        assert!((tip_m / expected_m - 1.0).abs() < 1e-9);
    }
}
