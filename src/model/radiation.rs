//! The pressure of the spotlight's light: paper Eq. 40 and 41.

use crate::experiment::Reflectivity;

/// Speed of light.
pub const SPEED_OF_LIGHT_M_S: f64 = 299_792_458.0;

/// A spotlight before a window.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spotlight {
    /// P.
    pub power_w: f64,
    /// d, from the lamp to the strip.
    pub distance_m: f64,
    /// ε, transmissivity of the window.
    pub window: f64,
}

impl Spotlight {
    /// Flux at the strip (W/m²), all the power spread over the half sphere before a perfect mirror:
    ///
    /// ```text
    /// I = 2Pε/(4πd²)        (paper Eq. 40)
    /// ```
    pub fn flux_w_m2(&self) -> f64 {
        2.0 * self.power_w * self.window / (4.0 * std::f64::consts::PI * self.distance_m.powi(2))
    }
}

/// Force of light (N) on an area as [along the surface's normal, along the light]; on a surface that faces the lamp they point the same way.
///
/// ```text
/// F = I A cos α/c · {2(C_d/3 + C_s cos α) n + (1 − C_s) s}        (paper Eq. 41)
/// ```
///
/// with α the angle of incidence. No light falls on the back: beyond 90° the force is zero.
pub fn radiation_force_n(flux_w_m2: f64, area_m2: f64, incidence_rad: f64, surface: &Reflectivity) -> [f64; 2] {
    let cos = incidence_rad.cos().max(0.0);
    let caught_n = flux_w_m2 * area_m2 * cos / SPEED_OF_LIGHT_M_S;
    [caught_n * 2.0 * (surface.diffuse / 3.0 + surface.specular * cos), caught_n * (1.0 - surface.specular)]
}

#[cfg(test)]
mod tests {
    use super::*;

    const MLI: Reflectivity = Reflectivity::opaque(0.60, 0.26, 0.14);

    #[test]
    fn two_kilowatt_at_a_metre_press_with_19_nanonewton() {
        let flux = Spotlight { power_w: 2000.0, distance_m: 1.0, window: 1.0 }.flux_w_m2();
        assert!((flux - 318.31).abs() < 0.005);
        let [normal, along] = radiation_force_n(flux, 0.01, 0.0, &MLI);
        assert!((normal + along - 1.883e-8).abs() < 1e-11);
    }

    #[test]
    fn a_mirror_takes_twice_and_a_black_surface_once_the_light() {
        let of = |specular, diffuse, absorbed| {
            let [normal, along] = radiation_force_n(1.0, 1.0, 0.0, &Reflectivity::opaque(specular, diffuse, absorbed));
            (normal + along) * SPEED_OF_LIGHT_M_S
        };
        assert!((of(1.0, 0.0, 0.0) - 2.0).abs() < 1e-14);
        assert!((of(0.0, 0.0, 1.0) - 1.0).abs() < 1e-14);
        assert!((of(0.0, 1.0, 0.0) - 5.0 / 3.0).abs() < 1e-14);
    }

    #[test]
    fn flux_falls_with_the_square_of_the_distance_and_light_from_behind_does_nothing() {
        let near = Spotlight { power_w: 500.0, distance_m: 0.5, window: 0.9 };
        let far = Spotlight { distance_m: 1.5, ..near };
        assert!((near.flux_w_m2() / far.flux_w_m2() - 9.0).abs() < 1e-12);
        assert_eq!(radiation_force_n(1.0, 1.0, 2.0, &MLI), [0.0, 0.0]);
    }
}
