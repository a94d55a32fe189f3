//! The bounds of a hung strip's first mode: without any stiffness and without any flexibility.

use std::f64::consts::{PI, TAU};

/// The zero j₀,ₖ₊₁ of the Bessel function J₀; `k` counts from 0.
///
/// Newton's method (J₀′ = −J₁) from McMahon's expansion, b = (k + ¾)π:
///
/// ```text
/// j ≈ b + 1/(8b) − 124/(3 (8b)³)
/// ```
pub fn bessel_zero(k: usize) -> f64 {
    let b = (k as f64 + 0.75) * PI;
    let mut zero = b + 1.0 / (8.0 * b) - 124.0 / (3.0 * (8.0 * b).powi(3));
    // The start is right to three digits; each step doubles them.
    for _ in 0..4 {
        zero += libm::j0(zero) / libm::j1(zero);
    }
    zero
}

/// Natural frequency (Hz) of a limp uniform strip hung by its end, the hanging chain:
///
/// ```text
/// f = j₀,ₖ₊₁/(4π) √(g/L)
/// ```
///
/// `k` counts from 0. The first is the lowest frequency a uniform strip hung by a hinge can have: stiffness only raises it.
pub fn limp_frequency_hz(k: usize, length_m: f64, gravity_m_s2: f64) -> f64 {
    bessel_zero(k) / (2.0 * TAU) * (gravity_m_s2 / length_m).sqrt()
}

/// Frequency (Hz) of a rigid uniform strip hung by its end: f = √(3g/2L)/2π.
pub fn rigid_frequency_hz(length_m: f64, gravity_m_s2: f64) -> f64 {
    (1.5 * gravity_m_s2 / length_m).sqrt() / TAU
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_zeros_are_those_of_the_tables() {
        let tabulated = [2.404_825_557_695_773, 5.520_078_110_286_311, 8.653_727_912_911_013, 11.791_534_439_014_281];
        for (k, expected) in tabulated.iter().enumerate() {
            assert!((bessel_zero(k) - expected).abs() < 2e-15 * expected, "{}", bessel_zero(k));
        }
    }

    #[test]
    fn a_strip_of_0_2_m_lies_between_its_two_bounds() {
        for (gravity, limp_hz, rigid_hz) in [(9.80665, 1.3400, 1.3649), (9.81, 1.3403, 1.3652)] {
            assert!((limp_frequency_hz(0, 0.2, gravity) - limp_hz).abs() < 5e-5);
            assert!((rigid_frequency_hz(0.2, gravity) - rigid_hz).abs() < 5e-5);
        }
    }
}
