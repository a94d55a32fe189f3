//! The heat that light leaves in a thin film, and how it curls the strip.
//!
//! A film is thin beside its width and so light that it has one temperature through its thickness, but for a small gradient. Per area, with q the heat taken up
//! by the face towards the lamp, ρct the film's heat capacity and e the heat a face gives off,
//!
//! ```text
//! ρct Ṫ = q − e_f − e_b        e = εσ(T⁴ − T_w⁴) + h(T − T_w)
//! ```
//!
//! What enters the front less what the front gives off flows on through the film. While the film warms it is stored evenly, so the flow falls from q − e_f at
//! the front to e_b at the back, in a time t²/(π²a), a the diffusivity, that is less than a millisecond for a film. The mean gradient curls it:
//!
//! ```text
//! κ = α (q − e_f + e_b)/(2k)        the lit face convex, the free end away from the lamp
//! ```
//!
//! This curl is there as soon as the light is, and in the steady state it is as large as at the start if both faces give off alike. A layer on one face adds that of
//! Timoshenko's bimetal (1925, Eq. 4), which grows with the temperature. Conduction along the strip is left out: it levels over millimetres. So is the curl across
//! the strip, which stiffens a strip that curls much.

use crate::error::{Error, Result};
use crate::experiment::{Coating, Experiment, Face, Film, Heat};

/// σ, of Stefan and Boltzmann (W/m²K⁴).
pub const STEFAN_BOLTZMANN_W_M2_K4: f64 = 5.670_374_419e-8;

/// Typical values of a film.
struct Typical {
    heat_capacity_j_kg_k: f64,
    conductivity_w_m_k: f64,
    expansion_per_k: f64,
    modulus_change_per_k: f64,
    emissivity_front: f64,
    emissivity_back: f64,
}

impl Typical {
    /// Kapton HN: DuPont's data sheet (1.09 J/gK, 0.12 W/mK, 20·10⁻⁶/K; 2.5 GPa at 23 °C and 2.0 GPa at 200 °C). PET: DuPont Teijin's data of Mylar
    /// (0.28 cal/gK, 3.7·10⁻⁴ cal/cm s K, 17·10⁻⁶/K), which give no modulus at other temperatures.
    ///
    /// Emissivities are those of the paper's specimens, PET with aluminium on both faces and Kapton with aluminium towards the lamp: 0.035 of the metal, 0.62 of
    /// 25 µm of polyimide before it (Sheldahl's Red Book).
    fn of(film: Film) -> Self {
        match film {
            Film::PET => Self {
                heat_capacity_j_kg_k: 1170.0,
                conductivity_w_m_k: 0.155,
                expansion_per_k: 17e-6,
                modulus_change_per_k: 0.0,
                emissivity_front: 0.035,
                emissivity_back: 0.035,
            },
            Film::Kapton => Self {
                heat_capacity_j_kg_k: 1090.0,
                conductivity_w_m_k: 0.12,
                expansion_per_k: 20e-6,
                modulus_change_per_k: -1.13e-3,
                emissivity_front: 0.035,
                emissivity_back: 0.62,
            },
        }
    }
}

/// A strip's film, as heat sees it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WarmFilm {
    /// ρct.
    pub capacity_j_m2_k: f64,
    /// t.
    pub thickness_m: f64,
    /// E.
    pub young_modulus_pa: f64,
    /// k.
    pub conductivity_w_m_k: f64,
    /// α.
    pub expansion_per_k: f64,
    /// (dE/dT)/E.
    pub modulus_change_per_k: f64,
    /// ε of the front and the back.
    pub emissivity: [f64; 2],
    /// h of each face.
    pub convection_w_m2_k: f64,
    /// T_w.
    pub wall_k: f64,
    /// A layer on one face.
    pub coating: Option<Coating>,
}

impl WarmFilm {
    /// The film of an experiment; none without `[heat]`.
    ///
    /// # Errors
    /// [`Error::Missing`] that asks for what `[heat]` and `[specimen]` do not say.
    pub fn of(experiment: &Experiment) -> Result<Option<Self>> {
        let Some(heat) = &experiment.heat else { return Ok(None) };
        let specimen = &experiment.specimen;
        let typical = heat.film.map(Typical::of);
        let or = |stated: Option<f64>, of_film: fn(&Typical) -> f64, key: &str| {
            stated.or_else(|| typical.as_ref().map(of_film)).ok_or_else(|| missing(&format!("heat.{key}"), FILM))
        };
        let stated = |value: Option<f64>, key: &str| value.ok_or_else(|| missing(&format!("specimen.{key}"), ""));
        let thickness_m = stated(specimen.thickness_m, "thickness_m")?;
        let per_area_kg_m2 = specimen.mass_kg / (specimen.length_m * specimen.width_m);
        let emissivity = [
            or(heat.emissivity_front, |t| t.emissivity_front, "emissivity_front")?,
            or(heat.emissivity_back, |t| t.emissivity_back, "emissivity_back")?,
        ];
        if emissivity == [0.0; 2] && heat.convection_w_m2_k == 0.0 {
            return Err(Error::Missing {
                detail: "heat: neither face gives off heat; emissivity_front, emissivity_back and convection_w_m2_k are all 0".into(),
            });
        }
        Ok(Some(Self {
            capacity_j_m2_k: per_area_kg_m2
                * or(heat.heat_capacity_j_kg_k, |t| t.heat_capacity_j_kg_k, "heat_capacity_j_kg_k")?,
            thickness_m,
            young_modulus_pa: stated(specimen.young_modulus_pa, "young_modulus_pa")?,
            conductivity_w_m_k: or(heat.conductivity_w_m_k, |t| t.conductivity_w_m_k, "conductivity_w_m_k")?,
            expansion_per_k: or(heat.expansion_per_k, |t| t.expansion_per_k, "expansion_per_k")?,
            modulus_change_per_k: heat
                .modulus_change_per_k
                .or(typical.as_ref().map(|t| t.modulus_change_per_k))
                .unwrap_or(0.0),
            emissivity,
            convection_w_m2_k: heat.convection_w_m2_k,
            wall_k: heat.wall_k,
            coating: heat.coating,
        }))
    }

    /// The values that are the film's typical ones, in words; nothing where all are stated.
    pub fn assumed(heat: &Heat) -> Vec<&'static str> {
        // of a film that keeps its modulus there is no value to take
        let softens = heat.film.is_some_and(|film| Typical::of(film).modulus_change_per_k != 0.0);
        let modulus = softens.then_some(("modulus_change_per_k", heat.modulus_change_per_k));
        let keys = [
            ("heat_capacity_j_kg_k", heat.heat_capacity_j_kg_k),
            ("conductivity_w_m_k", heat.conductivity_w_m_k),
            ("expansion_per_k", heat.expansion_per_k),
            ("emissivity_front", heat.emissivity_front),
            ("emissivity_back", heat.emissivity_back),
        ];
        keys.into_iter().chain(modulus).filter(|(_, value)| value.is_none()).map(|(key, _)| key).collect()
    }

    /// e of a face (W/m²).
    fn given_off_w_m2(&self, face: usize, kelvin: f64) -> f64 {
        self.radiated_w_m2(face, kelvin) + self.convection_w_m2_k * (kelvin - self.wall_k)
    }

    /// What a face radiates beyond what it takes from the wall (W/m²).
    pub fn radiated_w_m2(&self, face: usize, kelvin: f64) -> f64 {
        self.emissivity[face] * STEFAN_BOLTZMANN_W_M2_K4 * (kelvin.powi(4) - self.wall_k.powi(4))
    }

    /// What a kelvin more lets both faces give off more (W/m²K).
    fn loss_w_m2_k(&self, kelvin: f64) -> f64 {
        4.0 * self.emissivity.iter().sum::<f64>() * STEFAN_BOLTZMANN_W_M2_K4 * kelvin.powi(3)
            + 2.0 * self.convection_w_m2_k
    }

    /// q − e_f − e_b (W/m²).
    pub fn stored_w_m2(&self, absorbed_w_m2: f64, kelvin: f64) -> f64 {
        absorbed_w_m2 - self.given_off_w_m2(0, kelvin) - self.given_off_w_m2(1, kelvin)
    }

    /// The temperature at which as much is given off as is taken up.
    pub fn steady_k(&self, absorbed_w_m2: f64) -> f64 {
        // what is given off is convex in T: Newton's method comes down from above and does not overshoot
        let emitted = self.emissivity.iter().sum::<f64>() * STEFAN_BOLTZMANN_W_M2_K4;
        let by_radiation_k = (absorbed_w_m2 / emitted + self.wall_k.powi(4)).powf(0.25);
        let by_gas_k = self.wall_k + absorbed_w_m2 / (2.0 * self.convection_w_m2_k);
        let mut kelvin = by_radiation_k.min(by_gas_k);
        for _ in 0..50 {
            let step = self.stored_w_m2(absorbed_w_m2, kelvin) / self.loss_w_m2_k(kelvin);
            kelvin += step;
            if step.abs() < 1e-13 * kelvin {
                break;
            }
        }
        kelvin
    }

    /// τ (s) of a small change about a temperature.
    pub fn time_constant_s(&self, kelvin: f64) -> f64 {
        self.capacity_j_m2_k / self.loss_w_m2_k(kelvin)
    }

    /// t²/(π²a) (s): how long the gradient takes to stand.
    pub fn through_thickness_s(&self) -> f64 {
        self.capacity_j_m2_k * self.thickness_m / (std::f64::consts::PI.powi(2) * self.conductivity_w_m_k)
    }

    /// Moves a temperature on by a time, the heat taken up being q(t): Runge and Kutta's method of the fourth order. Returns what was given off on the way
    /// (J/m²), by the same steps.
    pub fn advance(&self, kelvin: &mut f64, from_s: f64, until_s: f64, absorbed_w_m2: impl Fn(f64) -> f64) -> f64 {
        let hottest_k = kelvin.max(self.steady_k(absorbed_w_m2(from_s).max(absorbed_w_m2(until_s)).max(0.0)));
        let steps = ((until_s - from_s) / (STEP * self.time_constant_s(hottest_k))).ceil().max(1.0);
        let h = (until_s - from_s) / steps;
        let mut given_off_j_m2 = 0.0;
        for step in 0..steps as usize {
            let t = from_s + h * step as f64;
            let rate = |t: f64, kelvin: f64| {
                let off = self.given_off_w_m2(0, kelvin) + self.given_off_w_m2(1, kelvin);
                [(absorbed_w_m2(t) - off) / self.capacity_j_m2_k, off]
            };
            let k1 = rate(t, *kelvin);
            let k2 = rate(t + 0.5 * h, *kelvin + 0.5 * h * k1[0]);
            let k3 = rate(t + 0.5 * h, *kelvin + 0.5 * h * k2[0]);
            let k4 = rate(t + h, *kelvin + h * k3[0]);
            let mean = |i: usize| (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]) / 6.0;
            *kelvin += h * mean(0);
            given_off_j_m2 += h * mean(1);
        }
        given_off_j_m2
    }

    /// κ of the gradient through the thickness (1/m), positive with the free end away from a lamp before the front.
    pub fn gradient_curl_per_m(&self, absorbed_w_m2: f64, kelvin: f64) -> f64 {
        let through_w_m2 = absorbed_w_m2 - self.given_off_w_m2(0, kelvin) + self.given_off_w_m2(1, kelvin);
        self.expansion_per_k * through_w_m2 / (2.0 * self.conductivity_w_m_k)
    }

    /// κ of the layer (1/m), against that at the wall's temperature.
    ///
    /// ```text
    /// κ = 6(α_c − α)(T − T_w)(1 + m)² / {h [3(1 + m)² + (1 + mn)(m² + 1/(mn))]}        m = t_c/t, n = E_c/E, h = t + t_c
    /// ```
    pub fn coating_curl_per_m(&self, kelvin: f64) -> f64 {
        let Some(coating) = self.coating else { return 0.0 };
        let m = coating.thickness_m / self.thickness_m;
        let mn = m * coating.young_modulus_pa / self.young_modulus_pa;
        let both = (1.0 + m).powi(2);
        let height_m = self.thickness_m + coating.thickness_m;
        let strain = (coating.expansion_per_k - self.expansion_per_k) * (kelvin - self.wall_k);
        let curl = 6.0 * strain * both / (height_m * (3.0 * both + (1.0 + mn) * (m * m + 1.0 / mn)));
        if coating.face == Face::Front { curl } else { -curl }
    }

    /// E at a temperature over that at the wall's. A film is not followed to where it melts.
    pub fn stiffness_ratio(&self, kelvin: f64) -> f64 {
        (1.0 + self.modulus_change_per_k * (kelvin - self.wall_k)).max(SOFTEST)
    }
}

/// A step over the shortest time constant: the method's error is then below 10⁻⁹ of a change.
const STEP: f64 = 0.02;
/// A linear law of the modulus ends here.
const SOFTEST: f64 = 0.05;
const FILM: &str = "; or write film = \"PET\" or film = \"Kapton\" for typical values";

fn missing(key: &str, or: &str) -> Error {
    Error::Missing { detail: format!("{key} is missing; what light warms cannot be told without it{or}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn film() -> WarmFilm {
        WarmFilm {
            capacity_j_m2_k: 1420.0 * 1090.0 * 25.4e-6,
            thickness_m: 25.4e-6,
            young_modulus_pa: 2.5e9,
            conductivity_w_m_k: 0.12,
            expansion_per_k: 20e-6,
            modulus_change_per_k: -1.13e-3,
            emissivity: [0.035, 0.62],
            convection_w_m2_k: 0.0,
            wall_k: 293.15,
            coating: None,
        }
    }

    #[test]
    fn the_steady_temperature_gives_off_what_is_taken_up() {
        for absorbed in [0.0, 1e-3, 44.6, 1e3, 1e5] {
            for convection_w_m2_k in [0.0, 5.0] {
                let film = WarmFilm { convection_w_m2_k, ..film() };
                let kelvin = film.steady_k(absorbed);
                assert!(film.stored_w_m2(absorbed, kelvin).abs() <= 1e-9 * absorbed.max(1.0), "{absorbed}");
            }
        }
        let closed_k = (44.6 / (0.655 * STEFAN_BOLTZMANN_W_M2_K4) + 293.15f64.powi(4)).powf(0.25);
        assert!((film().steady_k(44.6) / closed_k - 1.0).abs() < 1e-12);
    }

    /// ∫dT/(Tₛ⁴ − T⁴) in closed form.
    fn closed_time_s(film: &WarmFilm, from_k: f64, until_k: f64, steady_k: f64) -> f64 {
        let of = |t: f64| {
            ((steady_k + t) / (steady_k - t)).ln() / (4.0 * steady_k.powi(3))
                + (t / steady_k).atan() / (2.0 * steady_k.powi(3))
        };
        film.capacity_j_m2_k / (film.emissivity.iter().sum::<f64>() * STEFAN_BOLTZMANN_W_M2_K4)
            * (of(until_k) - of(from_k))
    }

    #[test]
    fn a_film_warms_as_the_closed_form_says_and_keeps_account_of_its_heat() {
        let film = film();
        for absorbed in [1.0, 44.6, 5000.0] {
            let steady = film.steady_k(absorbed);
            let target = film.wall_k + 0.7 * (steady - film.wall_k);
            let time_s = closed_time_s(&film, film.wall_k, target, steady);
            let mut kelvin = film.wall_k;
            let given_off = film.advance(&mut kelvin, 0.0, time_s, |_| absorbed);
            assert!(((kelvin - film.wall_k) / (target - film.wall_k) - 1.0).abs() < 1e-6, "{absorbed}");
            let taken_up = absorbed * time_s;
            let kept = film.capacity_j_m2_k * (kelvin - film.wall_k);
            assert!(((kept + given_off) / taken_up - 1.0).abs() < 1e-9, "{absorbed}");
        }
    }

    #[test]
    fn a_small_change_dies_away_with_its_time_constant() {
        let film = film();
        let mut kelvin = film.wall_k + 1e-3;
        let tau_s = film.time_constant_s(film.wall_k);
        film.advance(&mut kelvin, 0.0, tau_s, |_| 0.0);
        assert!(((kelvin - film.wall_k) / 1e-3 / f64::exp(-1.0) - 1.0).abs() < 1e-4, "{kelvin}");
        // 1420 · 1090 · 25.4e-6 / (4 · 0.655 · σ · 293.15³)
        assert!((tau_s - 10.51).abs() < 0.01, "{tau_s}");
        assert!(film.through_thickness_s() < 1e-3);
    }

    #[test]
    fn alike_faces_keep_the_first_gradient() {
        let film = WarmFilm { emissivity: [0.3, 0.3], ..film() };
        let first = film.gradient_curl_per_m(44.6, film.wall_k);
        assert!((first - 20e-6 * 44.6 / 0.24).abs() < 1e-12);
        let last = film.gradient_curl_per_m(44.6, film.steady_k(44.6));
        assert!((last / first - 1.0).abs() < 1e-9);
    }

    #[test]
    fn a_thin_layer_curls_as_stoney_says_and_equal_halves_as_timoshenko() {
        let layer = |thickness_m, young_modulus_pa, face| Coating {
            thickness_m,
            young_modulus_pa,
            expansion_per_k: 23.1e-6,
            face,
        };
        let thin = WarmFilm { coating: Some(layer(1e-8, 70e9, Face::Front)), ..film() };
        let curl = thin.coating_curl_per_m(thin.wall_k + 10.0);
        let stoney = 6.0 * 70e9 * 1e-8 * 3.1e-6 * 10.0 / (2.5e9 * 25.4e-6f64.powi(2));
        assert!((curl / stoney - 1.0).abs() < 0.06, "{curl} {stoney}");
        let equal = WarmFilm { coating: Some(layer(25.4e-6, 2.5e9, Face::Back)), ..film() };
        let curl = equal.coating_curl_per_m(equal.wall_k + 10.0);
        assert!((curl / (-1.5 * 3.1e-5 / 50.8e-6) - 1.0).abs() < 1e-12, "{curl}");
    }
}
