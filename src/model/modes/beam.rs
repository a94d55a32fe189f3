//! Small vibrations of the strip as a beam in gravity, by finite elements.

use crate::model::strip::load::Free;
use crate::model::strip::{Mesh, Rest, Strip};

/// Elements for six digits.
const ELEMENTS: usize = 80;

/// Natural frequencies (Hz) of the strip hanging at rest, lowest first, by finite elements.
///
/// The first four are right to six digits for every stiffness from a limp strip to a rigid one.
///
/// Empty where the strip has neither stiffness nor weight.
pub fn beam_frequencies_hz(strip: &Strip, count: usize) -> Vec<f64> {
    let mesh = Mesh::of(strip, ELEMENTS);
    let vibration = Rest::of(strip, &mesh, &Free).ok().and_then(|rest| rest.vibration());
    vibration.map_or_else(Vec::new, |vibration| vibration.frequencies_hz(count))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    use crate::model::modes::{limp_frequency_hz, rigid_frequency_hz};

    fn pet_5_mil() -> Strip {
        Strip::hung(0.2, 1390.0 * 0.05 * 127e-6, 8.81e9 * 0.05 * 127e-6f64.powi(3) / 12.0, 0.0)
    }

    fn root_hz(strip: &Strip, root: f64) -> f64 {
        root * root / TAU * (strip.bending_stiffness_n_m2 / strip.mass_per_length_kg_m).sqrt() / strip.length_m.powi(2)
    }

    #[test]
    fn a_clamped_beam_without_gravity_has_the_classical_roots() {
        let strip = pet_5_mil();
        let hz = beam_frequencies_hz(&strip.clamped(), 4);
        for (found, root) in hz.iter().zip([1.875_104_068_7, 4.694_091_132_97, 7.854_757_438_24, 10.995_540_734_9]) {
            assert!((found / root_hz(&strip, root) - 1.0).abs() < 1e-6, "{hz:?}");
        }
        assert!((hz[0] - 1.2912).abs() < 1e-4, "{hz:?}");
    }

    #[test]
    fn a_hinged_beam_without_gravity_turns_freely_and_has_the_classical_roots() {
        let strip = pet_5_mil();
        let hz = beam_frequencies_hz(&strip, 4);
        assert!(hz[0] < 1e-3, "{hz:?}");
        for (found, root) in hz[1..].iter().zip([3.926_602_312_05, 7.068_582_745_63, 10.210_176_122_8]) {
            assert!((found / root_hz(&strip, root) - 1.0).abs() < 1e-6, "{hz:?}");
        }
    }

    #[test]
    fn gravity_going_to_zero_leaves_the_clamped_roots() {
        let strip = Strip { gravity_m_s2: 1e-7, ..pet_5_mil() };
        let hz = beam_frequencies_hz(&strip.clamped(), 1);
        assert!((hz[0] / root_hz(&strip, 1.875_104_068_7) - 1.0).abs() < 1e-6, "{hz:?}");
    }

    #[test]
    fn stiffness_going_to_zero_leaves_the_hanging_chain() {
        for stiffness in [0.0, 1e-16] {
            let limp = Strip { gravity_m_s2: 9.80665, bending_stiffness_n_m2: stiffness, ..pet_5_mil() };
            let hz = beam_frequencies_hz(&limp, 4);
            for (k, found) in hz.iter().enumerate() {
                assert!((found / limp_frequency_hz(k, 0.2, 9.80665) - 1.0).abs() < 1e-6, "{k} {hz:?}");
            }
        }
    }

    #[test]
    fn a_thin_clamp_shortens_the_limp_strip_by_its_boundary_layer() {
        let strip = Strip { gravity_m_s2: 9.80665, bending_stiffness_n_m2: 1e-12, ..pet_5_mil() };
        let hz = beam_frequencies_hz(&strip.clamped(), 2);
        for (k, found) in hz.iter().enumerate() {
            let shorter_hz = limp_frequency_hz(k, 0.2 - strip.boundary_layer_m(), 9.80665);
            assert!((found / shorter_hz - 1.0).abs() < 1e-6, "{k} {found} {shorter_hz}");
        }
    }

    #[test]
    fn stiffness_going_to_infinity_leaves_the_rigid_strip() {
        for stiffness in [1e2, 1e6] {
            let stiff = Strip { gravity_m_s2: 9.80665, bending_stiffness_n_m2: stiffness, ..pet_5_mil() };
            let hz = beam_frequencies_hz(&stiff, 1);
            assert!((hz[0] / rigid_frequency_hz(0.2, 9.80665) - 1.0).abs() < 1e-6, "{hz:?}");
        }
    }

    #[test]
    fn stiffness_and_gravity_only_raise_a_frequency() {
        let mut last = [0.0; 2];
        for stiffness in [1e-10, 1e-8, 1e-6, 1e-4] {
            let strip = Strip { gravity_m_s2: 9.80665, bending_stiffness_n_m2: stiffness, ..pet_5_mil() };
            for (last, strip) in last.iter_mut().zip([strip, strip.clamped()]) {
                let hz = beam_frequencies_hz(&strip, 1)[0];
                assert!(hz > *last && hz > limp_frequency_hz(0, 0.2, 9.80665) * (1.0 - 1e-9));
                *last = hz;
            }
        }
    }
}
