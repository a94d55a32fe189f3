//! The pressure of the spotlight's light: paper Eq. 40 and 41.

use crate::experiment::{Light, Reflectivity};
use crate::model::strip::LocalForce;

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
/// F = I A cos α/c · {2(C_d/3 + C_s cos α) n + (1 − C_s − C_t) s}        (paper Eq. 41, there without C_t)
/// ```
///
/// with α the angle of incidence and C_t the share that passes through, which takes its momentum with it.
pub fn radiation_force_n(flux_w_m2: f64, area_m2: f64, incidence_rad: f64, surface: &Reflectivity) -> [f64; 2] {
    let cos = incidence_rad.cos().max(0.0);
    let caught_n = flux_w_m2 * area_m2 * cos / SPEED_OF_LIGHT_M_S;
    momentum(surface, cos).map(|share| caught_n * share)
}

/// Momentum that a face takes of the light it catches, as [along its normal, along the light]: the braces of Eq. 41.
fn momentum(face: &Reflectivity, cos: f64) -> [f64; 2] {
    [2.0 * (face.diffuse / 3.0 + face.specular * cos), 1.0 - face.specular - face.transmitted]
}

/// What of a strip is lit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spot {
    /// D.
    pub diameter_m: f64,
    /// Centre below the support.
    pub height_m: f64,
}

/// Light on a strip, in the plane of its motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Beam {
    /// I, across the beam.
    pub flux_w_m2: f64,
    /// β, of the light's direction upwards from +x.
    pub direction_rad: f64,
    /// None: the whole strip is lit.
    pub spot: Option<Spot>,
    /// Width of the strip.
    pub width_m: f64,
    /// Shares of the face towards the lamp while the strip hangs.
    pub front: Reflectivity,
    /// Shares of the other face.
    pub back: Reflectivity,
}

impl Beam {
    /// The light of an experiment's lamp at a power and a distance.
    ///
    /// Without a spot its flux is that of Eq. 40. A spot's diameter D is that at the stated distance d₀; all the light falls evenly into it, in a cone from
    /// the lamp: I = Pε/(¼π(Dd/d₀)²).
    pub fn of(
        light: &Light,
        power_w: f64,
        distance_m: f64,
        width_m: f64,
        length_m: f64,
        faces: [Reflectivity; 2],
    ) -> Self {
        let spot = light.spot_diameter_m.map(|stated_m| Spot {
            diameter_m: stated_m * distance_m / light.distance_m.unwrap_or(distance_m),
            height_m: light.spot_height_m.unwrap_or(0.5 * length_m),
        });
        let flux_w_m2 = match spot {
            None => Spotlight { power_w, distance_m, window: light.window }.flux_w_m2(),
            Some(spot) => power_w * light.window / (std::f64::consts::FRAC_PI_4 * spot.diameter_m.powi(2)),
        };
        let [front, back] = faces;
        Self { flux_w_m2, direction_rad: light.direction_deg.to_radians(), spot, width_m, front, back }
    }

    /// Share of the strip's width that is lit at s: the chord of a round spot.
    pub fn lit(&self, s_m: f64) -> f64 {
        let Some(spot) = self.spot else { return 1.0 };
        let half = (0.25 * spot.diameter_m.powi(2) - (s_m - spot.height_m).powi(2)).max(0.0).sqrt();
        (2.0 * half / self.width_m).min(1.0)
    }

    /// cos α at an angle of the strip; below zero where the light meets the other face.
    pub fn incidence_cos(&self, theta_rad: f64) -> f64 {
        (theta_rad - self.direction_rad).cos()
    }

    /// Heat taken up per area of the strip (W/m²), averaged over its width.
    pub fn absorbed_w_m2(&self, s_m: f64, theta_rad: f64) -> f64 {
        let cos = self.incidence_cos(theta_rad);
        let face = if cos < 0.0 { &self.back } else { &self.front };
        face.absorbed * self.flux_w_m2 * cos.abs() * self.lit(s_m)
    }

    /// Push per length, [along x, down] (N/m), with its derivative in the strip's angle. Light on the other face pushes against that face.
    pub fn push(&self, s_m: f64, theta_rad: f64) -> LocalForce {
        let cos = self.incidence_cos(theta_rad);
        let (sign, face) = if cos < 0.0 { (-1.0, &self.back) } else { (1.0, &self.front) };
        let per_cos = self.flux_w_m2 * self.width_m * self.lit(s_m) / SPEED_OF_LIGHT_M_S;
        let (cos, cos_slope) = (sign * cos, -sign * (theta_rad - self.direction_rad).sin());
        let [across, along] = momentum(face, cos);
        let across_slope = 2.0 * face.specular * cos_slope;
        let (sin_theta, cos_theta) = theta_rad.sin_cos();
        let normal = [sign * cos_theta, -sign * sin_theta];
        let normal_slope = [-sign * sin_theta, -sign * cos_theta];
        let light = [self.direction_rad.cos(), -self.direction_rad.sin()];
        LocalForce {
            force_n_m: [0, 1].map(|k| per_cos * cos * (across * normal[k] + along * light[k])),
            slope_n_m_rad: [0, 1].map(|k| {
                per_cos
                    * (cos_slope * (across * normal[k] + along * light[k])
                        + cos * (across_slope * normal[k] + across * normal_slope[k]))
            }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MLI: Reflectivity = Reflectivity::opaque(0.60, 0.26, 0.14);

    fn beam(direction_rad: f64) -> Beam {
        Beam { flux_w_m2: 318.31, direction_rad, spot: None, width_m: 0.05, front: MLI, back: MLI }
    }

    #[test]
    fn two_kilowatt_at_a_metre_press_with_19_nanonewton() {
        let flux = Spotlight { power_w: 2000.0, distance_m: 1.0, window: 1.0 }.flux_w_m2();
        assert!((flux - 318.31).abs() < 0.005);
        let [normal, along] = radiation_force_n(flux, 0.01, 0.0, &MLI);
        assert!((normal + along - 1.883e-8).abs() < 1e-11);
    }

    #[test]
    fn a_mirror_takes_twice_a_black_surface_once_and_a_window_none_of_the_light() {
        let of = |surface: Reflectivity| {
            let [normal, along] = radiation_force_n(1.0, 1.0, 0.0, &surface);
            (normal + along) * SPEED_OF_LIGHT_M_S
        };
        assert!((of(Reflectivity::opaque(1.0, 0.0, 0.0)) - 2.0).abs() < 1e-14);
        assert!((of(Reflectivity::opaque(0.0, 0.0, 1.0)) - 1.0).abs() < 1e-14);
        assert!((of(Reflectivity::opaque(0.0, 1.0, 0.0)) - 5.0 / 3.0).abs() < 1e-14);
        assert_eq!(of(Reflectivity { transmitted: 1.0, ..Reflectivity::opaque(0.0, 0.0, 0.0) }), 0.0);
    }

    #[test]
    fn flux_falls_with_the_square_of_the_distance() {
        let near = Spotlight { power_w: 500.0, distance_m: 0.5, window: 0.9 };
        let far = Spotlight { distance_m: 1.5, ..near };
        assert!((near.flux_w_m2() / far.flux_w_m2() - 9.0).abs() < 1e-12);
    }

    #[test]
    fn the_push_along_a_strip_is_that_of_eq_41_on_either_face() {
        for (theta, direction) in [(0.0, 0.0), (0.3, -0.2), (2.0, 0.1), (-1.2, 0.4)] {
            let push = beam(direction).push(0.1, theta);
            let cos = f64::cos(theta - direction);
            let [normal, along] = radiation_force_n(318.31, 0.05, cos.abs().acos(), &MLI);
            let expected = [
                normal * cos.signum() * f64::cos(theta) + along * f64::cos(direction),
                -normal * cos.signum() * f64::sin(theta) - along * f64::sin(direction),
            ];
            for k in 0..2 {
                assert!((push.force_n_m[k] - expected[k]).abs() < 1e-20, "{theta} {direction}");
                let step = 1e-6;
                let [more, less] = [step, -step].map(|d| beam(direction).push(0.1, theta + d).force_n_m[k]);
                assert!(((more - less) / (2.0 * step) - push.slope_n_m_rad[k]).abs() < 1e-15, "{theta} {direction}");
            }
        }
    }

    #[test]
    fn a_mirror_is_pushed_along_its_normal_alone() {
        let mirror = Reflectivity::opaque(1.0, 0.0, 0.0);
        let push = Beam { front: mirror, ..beam(0.0) }.push(0.1, 0.4).force_n_m;
        assert!((push[1] / push[0] + f64::tan(0.4)).abs() < 1e-14);
    }

    #[test]
    fn a_spot_lights_its_chords_and_holds_all_the_light() {
        let light = Light { spot_diameter_m: Some(0.04), distance_m: Some(1.0), window: 0.9, ..Light::default() };
        let beam = Beam::of(&light, 10.0, 2.0, 0.05, 0.2, [MLI, MLI]);
        let diameter_m: f64 = 0.08;
        assert!((beam.flux_w_m2 * std::f64::consts::FRAC_PI_4 * diameter_m.powi(2) - 9.0).abs() < 1e-12);
        assert_eq!(beam.lit(0.1), 1.0);
        assert!((beam.lit(0.1 + 0.035) - 2.0 * f64::sqrt(0.04f64.powi(2) - 0.035f64.powi(2)) / 0.05).abs() < 1e-12);
        assert_eq!(beam.lit(0.15), 0.0);
        assert_eq!(beam.absorbed_w_m2(0.15, 0.0), 0.0);
        assert!((beam.absorbed_w_m2(0.1, 0.3) / (0.14 * beam.flux_w_m2 * f64::cos(0.3)) - 1.0).abs() < 1e-12);
    }
}
