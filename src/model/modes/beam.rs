//! Small vibrations of the strip as a beam in gravity, by finite elements.

use std::f64::consts::TAU;

use crate::model::strip::{Mesh, Strip, Support};

/// Natural frequencies (Hz) of the hung strip, lowest first.
///
/// ```text
/// det(K − ω²M) = 0        with the matrices of the finite elements
/// ```
///
/// They are taken from the inverse, whose largest eigenvalues are the lowest modes, so the stiff short waves of a fine mesh cost no digits.
/// The first six are right to six digits for every stiffness from a limp strip to a stiff beam.
///
/// Empty where the strip has neither stiffness nor weight.
pub fn beam_frequencies_hz(strip: &Strip, support: Support, count: usize) -> Vec<f64> {
    let matrices = strip.assemble(&Mesh::of(strip), support);
    // A hinged beam without gravity turns freely; the shift keeps the matrix positive and is taken off again.
    let stiff_rad2_s2 = strip.bending_stiffness_n_m2 / (strip.mass_per_length_kg_m * strip.length_m.powi(4));
    let shift_rad2_s2 = stiff_rad2_s2 + strip.gravity_m_s2 / strip.length_m;
    let Some(factor) = (&matrices.stiffness_n_m + &matrices.mass_kg * shift_rad2_s2).cholesky() else {
        return Vec::new();
    };
    let lower = factor.l();
    let inverse = lower
        .solve_lower_triangular(&matrices.mass_kg)
        .and_then(|half| lower.solve_lower_triangular(&half.transpose()))
        .map(|s| 0.5 * (&s + s.transpose()));
    let Some(inverse) = inverse else { return Vec::new() };
    let mut squares_s2: Vec<f64> = inverse.symmetric_eigenvalues().iter().copied().collect();
    squares_s2.sort_by(|a, b| b.total_cmp(a));
    squares_s2.iter().take(count).map(|s| (1.0 / s - shift_rad2_s2).max(0.0).sqrt() / TAU).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::modes::limp_frequency_hz;

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
        let hz = beam_frequencies_hz(&strip, Support::Clamped, 3);
        for (found, root) in hz.iter().zip([1.875_104_068_7, 4.694_091_132_97, 7.854_757_438_24]) {
            assert!((found / root_hz(&strip, root) - 1.0).abs() < 1e-6, "{hz:?}");
        }
        assert!((hz[0] - 1.2912).abs() < 1e-4, "{hz:?}");
    }

    #[test]
    fn a_hinged_beam_without_gravity_turns_freely_and_has_the_classical_roots() {
        let strip = pet_5_mil();
        let hz = beam_frequencies_hz(&strip, Support::Hinged, 3);
        assert!(hz[0] < 1e-3, "{hz:?}");
        for (found, root) in hz[1..].iter().zip([3.926_602_312_05, 7.068_582_745_63]) {
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
