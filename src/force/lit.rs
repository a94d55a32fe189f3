//! What light does to a strip.
//!
//! It pushes, its heat curls the strip through the gradient and through a layer, a warm film pushes itself off by what it radiates, and it softens:
//!
//! ```text
//! recoil per area = 2/(3c) (ε_f − ε_b) σ (T⁴ − T_w⁴) along the normal        (Lambert's law; what comes from the wall included)
//! ```
//!
//! Light and heat depend on the strip's shape and the shape on them: one is found for the other until both stand.

use crate::error::Result;
use crate::model::heat::WarmFilm;
use crate::model::light::{Beam, SPEED_OF_LIGHT_M_S};
use crate::model::strip::load::Free;
use crate::model::strip::{Load, LocalForce, Mesh, Rest, Strip};

/// Rounds of shape and heat.
const ROUNDS: usize = 40;
/// The free end moves less than this part of the length from round to round: the shape stands.
const STANDS: f64 = 1e-13;

/// Which of what light does is reckoned with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Parts {
    /// Eq. 41.
    pub push: bool,
    /// The curl of the gradient through the thickness.
    pub gradient: bool,
    /// The curl of a layer.
    pub coating: bool,
    /// What the warm faces radiate.
    pub recoil: bool,
    /// The modulus falls.
    pub softening: bool,
}

impl Parts {
    /// Everything.
    pub const ALL: Self = Self { push: true, gradient: true, coating: true, recoil: true, softening: true };
    /// Nothing.
    pub const NONE: Self = Self { push: false, gradient: false, coating: false, recoil: false, softening: false };
    /// The push alone.
    pub const PUSH: Self = Self { push: true, ..Self::NONE };
}

/// Heat at one point of the strip.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Warmth {
    /// Where.
    pub s_m: f64,
    /// Taken up by the lit face (W/m²).
    pub absorbed_w_m2: f64,
    /// T.
    pub kelvin: f64,
}

/// The load of light on a strip of a known warmth.
#[derive(Debug, Clone, PartialEq)]
pub struct Lit {
    /// The light.
    pub beam: Beam,
    /// The film, where heat is reckoned with.
    pub film: Option<WarmFilm>,
    /// What is reckoned with.
    pub parts: Parts,
    /// Warmth at the points of the mesh.
    pub warmth: Vec<Warmth>,
}

impl Lit {
    /// The strip at rest under a light that has been on for long, and the load that keeps it there.
    ///
    /// # Errors
    /// [`crate::Error::Simulation`].
    pub fn rest(strip: &Strip, mesh: &Mesh, beam: Beam, film: Option<WarmFilm>, parts: Parts) -> Result<(Rest, Self)> {
        let mut rest = Rest::of(strip, mesh, &Free)?;
        let mut lit = Self { beam, film, parts, warmth: Vec::new() };
        let mut last_m = rest.place_m(strip.length_m);
        for _ in 0..ROUNDS {
            lit.warmth = lit.steady(&rest);
            rest = Rest::of(strip, mesh, &lit)?;
            let tip_m = rest.place_m(strip.length_m);
            let moved_m = (tip_m[0] - last_m[0]).hypot(tip_m[1] - last_m[1]);
            last_m = tip_m;
            if moved_m <= STANDS * strip.length_m {
                break;
            }
        }
        Ok((rest, lit))
    }

    /// The warmth of a shape.
    fn steady(&self, rest: &Rest) -> Vec<Warmth> {
        let Some(film) = &self.film else { return Vec::new() };
        let angles = rest.mesh.angles(rest.freedoms.as_slice());
        let at = |(point, theta_rad): (usize, f64)| {
            let s_m = rest.mesh.s_m(point);
            let absorbed_w_m2 = self.beam.absorbed_w_m2(s_m, theta_rad);
            Warmth { s_m, absorbed_w_m2, kelvin: film.steady_k(absorbed_w_m2) }
        };
        angles.into_iter().enumerate().map(at).collect()
    }

    /// The film and its warmth at a place: that of the nearest point above it.
    fn warm(&self, s_m: f64) -> Option<(&WarmFilm, Warmth)> {
        let above = self.warmth.partition_point(|w| w.s_m <= s_m).max(1) - 1;
        Some((self.film.as_ref()?, *self.warmth.get(above)?))
    }

    /// The hottest point (K).
    pub fn hottest_k(&self) -> Option<f64> {
        self.warmth.iter().map(|w| w.kelvin).reduce(f64::max)
    }

    /// Curl of the gradient and of the layer at a place (1/m).
    pub fn curls_per_m(&self, s_m: f64) -> [f64; 2] {
        let Some((film, warmth)) = self.warm(s_m) else { return [0.0; 2] };
        // the lit face is the front while the light meets it
        let lit_face = if self.beam.incidence_cos(0.0) < 0.0 { -1.0 } else { 1.0 };
        let gradient = lit_face * film.gradient_curl_per_m(warmth.absorbed_w_m2, warmth.kelvin);
        [gradient, film.coating_curl_per_m(warmth.kelvin)]
    }

    /// Recoil per length at a place, along the normal of the front (N/m).
    pub fn recoil_n_m(&self, s_m: f64) -> f64 {
        let Some((film, warmth)) = self.warm(s_m) else { return 0.0 };
        let radiated = film.radiated_w_m2(0, warmth.kelvin) - film.radiated_w_m2(1, warmth.kelvin);
        2.0 / 3.0 * radiated / SPEED_OF_LIGHT_M_S * self.beam.width_m
    }
}

impl Load for Lit {
    fn force(&self, s_m: f64, theta_rad: f64) -> LocalForce {
        let mut force = if self.parts.push { self.beam.push(s_m, theta_rad) } else { LocalForce::default() };
        if self.parts.recoil {
            let recoil = self.recoil_n_m(s_m);
            let (sin, cos) = theta_rad.sin_cos();
            force.force_n_m[0] += recoil * cos;
            force.force_n_m[1] -= recoil * sin;
            force.slope_n_m_rad[0] -= recoil * sin;
            force.slope_n_m_rad[1] -= recoil * cos;
        }
        force
    }

    fn curl_per_m(&self, s_m: f64) -> f64 {
        let [gradient, coating] = self.curls_per_m(s_m);
        f64::from(u8::from(self.parts.gradient)) * gradient + f64::from(u8::from(self.parts.coating)) * coating
    }

    fn stiffness_ratio(&self, s_m: f64) -> f64 {
        match self.warm(s_m) {
            Some((film, warmth)) if self.parts.softening => film.stiffness_ratio(warmth.kelvin),
            _ => 1.0,
        }
    }

    fn follows(&self) -> bool {
        true
    }
}
