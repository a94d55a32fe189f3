//! Small vibrations of the strip as a beam in gravity, by finite elements.

use std::f64::consts::TAU;

use nalgebra::DVector;

use crate::model::strip::{Mesh, Strip, Support};

/// Natural frequencies (Hz) of the hung strip, lowest first.
///
/// ```text
/// (K − ω²M) v = 0        with the matrices of the finite elements
/// ```
///
/// The vectors are taken from the inverse of K, whose largest eigenvalues are the lowest modes, and the frequencies from Rayleigh's quotient
/// of each vector, so the stiff short waves of a fine mesh cost no digits. The first four are right to six digits for every stiffness from
/// a limp strip to a rigid one.
///
/// Empty where the strip has neither stiffness nor weight.
pub fn beam_frequencies_hz(strip: &Strip, support: Support, count: usize) -> Vec<f64> {
    let mesh = Mesh::of(strip);
    shapes(strip, &mesh, support)
        .iter()
        .take(count)
        .map(|shape| strip.rayleigh_quotient_rad2_s2(&mesh, support, shape.as_slice()).sqrt() / TAU)
        .collect()
}

/// The freedoms of every mode, lowest first.
fn shapes(strip: &Strip, mesh: &Mesh, support: Support) -> Vec<DVector<f64>> {
    let matrices = strip.assemble(mesh, support);
    // A hinged beam without gravity turns freely; a shift keeps the matrix positive and leaves the vectors as they are.
    let stiff_rad2_s2 = strip.bending_stiffness_n_m2 / (strip.mass_per_length_kg_m * strip.length_m.powi(4));
    let shift_rad2_s2 = stiff_rad2_s2 + strip.gravity_m_s2 / strip.length_m;
    let Some(factor) = (&matrices.stiffness_n_m + &matrices.mass_kg * shift_rad2_s2).cholesky() else {
        return Vec::new();
    };
    // K = LLᵀ turns K v = ω²M v into (L⁻¹ M L⁻ᵀ) u = u/ω² with v = L⁻ᵀu.
    let lower = factor.l();
    let inverse = lower
        .solve_lower_triangular(&matrices.mass_kg)
        .and_then(|half| lower.solve_lower_triangular(&half.transpose()));
    let Some(inverse) = inverse else { return Vec::new() };
    let eigen = (0.5 * (&inverse + inverse.transpose())).symmetric_eigen();
    let mut order: Vec<usize> = (0..eigen.eigenvalues.len()).collect();
    order.sort_by(|a, b| eigen.eigenvalues[*b].total_cmp(&eigen.eigenvalues[*a]));
    let shape = |k: usize| lower.tr_solve_lower_triangular(&eigen.eigenvectors.column(k));
    order.into_iter().filter_map(shape).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::modes::{limp_frequency_hz, rigid_frequency_hz};

    fn pet_5_mil() -> Strip {
        Strip {
            length_m: 0.2,
            mass_per_length_kg_m: 1390.0 * 0.05 * 127e-6,
            bending_stiffness_n_m2: 8.81e9 * 0.05 * 127e-6f64.powi(3) / 12.0,
            gravity_m_s2: 0.0,
        }
    }

    fn root_hz(strip: &Strip, root: f64) -> f64 {
        root * root / TAU * (strip.bending_stiffness_n_m2 / strip.mass_per_length_kg_m).sqrt() / strip.length_m.powi(2)
    }

    #[test]
    fn a_clamped_beam_without_gravity_has_the_classical_roots() {
        let strip = pet_5_mil();
        let hz = beam_frequencies_hz(&strip, Support::Clamped, 4);
        for (found, root) in hz.iter().zip([1.875_104_068_7, 4.694_091_132_97, 7.854_757_438_24, 10.995_540_734_9]) {
            assert!((found / root_hz(&strip, root) - 1.0).abs() < 1e-6, "{hz:?}");
        }
        assert!((hz[0] - 1.2912).abs() < 1e-4, "{hz:?}");
    }

    #[test]
    fn a_hinged_beam_without_gravity_turns_freely_and_has_the_classical_roots() {
        let strip = pet_5_mil();
        let hz = beam_frequencies_hz(&strip, Support::Hinged, 4);
        assert!(hz[0] < 1e-3, "{hz:?}");
        for (found, root) in hz[1..].iter().zip([3.926_602_312_05, 7.068_582_745_63, 10.210_176_122_8]) {
            assert!((found / root_hz(&strip, root) - 1.0).abs() < 1e-6, "{hz:?}");
        }
    }

    #[test]
    fn gravity_going_to_zero_leaves_the_clamped_roots() {
        let strip = Strip { gravity_m_s2: 1e-7, ..pet_5_mil() };
        let hz = beam_frequencies_hz(&strip, Support::Clamped, 1);
        assert!((hz[0] / root_hz(&strip, 1.875_104_068_7) - 1.0).abs() < 1e-6, "{hz:?}");
    }

    #[test]
    fn stiffness_going_to_zero_leaves_the_hanging_chain() {
        for stiffness in [0.0, 1e-16] {
            let limp = Strip { gravity_m_s2: 9.80665, bending_stiffness_n_m2: stiffness, ..pet_5_mil() };
            let hz = beam_frequencies_hz(&limp, Support::Hinged, 4);
            for (k, found) in hz.iter().enumerate() {
                assert!((found / limp_frequency_hz(k, 0.2, 9.80665) - 1.0).abs() < 1e-6, "{k} {hz:?}");
            }
        }
    }

    #[test]
    fn a_thin_clamp_shortens_the_limp_strip_by_its_boundary_layer() {
        let strip = Strip { gravity_m_s2: 9.80665, bending_stiffness_n_m2: 1e-12, ..pet_5_mil() };
        let hz = beam_frequencies_hz(&strip, Support::Clamped, 2);
        for (k, found) in hz.iter().enumerate() {
            let shorter_hz = limp_frequency_hz(k, 0.2 - strip.boundary_layer_m(), 9.80665);
            assert!((found / shorter_hz - 1.0).abs() < 1e-6, "{k} {found} {shorter_hz}");
        }
    }

    #[test]
    fn stiffness_going_to_infinity_leaves_the_rigid_strip() {
        for stiffness in [1e2, 1e6] {
            let stiff = Strip { gravity_m_s2: 9.80665, bending_stiffness_n_m2: stiffness, ..pet_5_mil() };
            let hz = beam_frequencies_hz(&stiff, Support::Hinged, 1);
            assert!((hz[0] / rigid_frequency_hz(0.2, 9.80665) - 1.0).abs() < 1e-6, "{hz:?}");
        }
    }

    #[test]
    fn stiffness_and_gravity_only_raise_a_frequency() {
        let mut last = [0.0; 2];
        for stiffness in [1e-10, 1e-8, 1e-6, 1e-4] {
            let strip = Strip { gravity_m_s2: 9.80665, bending_stiffness_n_m2: stiffness, ..pet_5_mil() };
            for (last, support) in last.iter_mut().zip([Support::Hinged, Support::Clamped]) {
                let hz = beam_frequencies_hz(&strip, support, 1)[0];
                assert!(hz > *last && hz > limp_frequency_hz(0, 0.2, 9.80665) * (1.0 - 1e-9));
                *last = hz;
            }
        }
    }
}
