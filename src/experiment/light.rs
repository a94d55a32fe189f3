//! `[light]`, `[heat]`, `[laser]`: the strip under the spotlight, and the sensor that sees it move.

use serde::Deserialize;

use super::{finite, not_negative, positive};

/// The spotlight. Every key but the power and the distance has a default.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Light {
    /// P, electrical power that leaves the lamp as light.
    pub power_w: Option<f64>,
    /// Powers of a sweep.
    pub powers_w: Vec<f64>,
    /// d, from the lamp to the strip.
    pub distance_m: Option<f64>,
    /// Distances of a sweep.
    pub distances_m: Vec<f64>,
    /// ε of paper Eq. 40, transmissivity of the chamber's window.
    pub window: f64,
    /// Direction in which the light travels, from the horizontal upwards: the angle from the normal of the strip at rest.
    pub direction_deg: f64,
    /// Diameter of the lit spot; the whole strip is lit where it is absent.
    pub spot_diameter_m: Option<f64>,
    /// Centre of the spot below the hinge; half the strip's length where it is absent.
    pub spot_height_m: Option<f64>,
    /// Time in which the lamp warms up: its flux rises as 1 − exp(−t/τ).
    pub warm_up_s: f64,
    /// Lamp on, off, on, … in the time of the record.
    pub on_s: Vec<f64>,
    /// The lamp is chopped with this frequency, half of each period lit.
    pub chop_hz: Option<f64>,
}

impl Default for Light {
    fn default() -> Self {
        Self {
            power_w: None,
            powers_w: Vec::new(),
            distance_m: None,
            distances_m: Vec::new(),
            window: 1.0,
            direction_deg: 0.0,
            spot_diameter_m: None,
            spot_height_m: None,
            warm_up_s: 0.0,
            on_s: Vec::new(),
            chop_hz: None,
        }
    }
}

impl Light {
    pub(super) fn validate(&self, length_m: f64) -> Result<(), String> {
        self.power_w.map_or(Ok(()), |v| not_negative("light.power_w", v))?;
        for (i, power) in self.powers_w.iter().enumerate() {
            not_negative(&format!("light.powers_w[{i}]"), *power)?;
        }
        self.distance_m.map_or(Ok(()), |v| positive("light.distance_m", v))?;
        for (i, distance) in self.distances_m.iter().enumerate() {
            positive(&format!("light.distances_m[{i}]"), *distance)?;
        }
        if !(self.window > 0.0 && self.window <= 1.0) {
            return Err(format!("light.window = {}: a share of the light, above 0 and at most 1", self.window));
        }
        if !(self.direction_deg.abs() < 90.0) {
            return Err(format!(
                "light.direction_deg = {}: must be between -90 and 90, from the strip's normal",
                self.direction_deg
            ));
        }
        self.spot_diameter_m.map_or(Ok(()), |v| positive("light.spot_diameter_m", v))?;
        if let Some(height) = self.spot_height_m
            && !(0.0..=length_m).contains(&height)
        {
            return Err(format!("light.spot_height_m = {height}: the strip reaches from 0 to {length_m} m"));
        }
        not_negative("light.warm_up_s", self.warm_up_s)?;
        self.chop_hz.map_or(Ok(()), |v| positive("light.chop_hz", v))?;
        for (i, t) in self.on_s.iter().enumerate() {
            finite(&format!("light.on_s[{i}]"), *t)?;
        }
        match self.on_s.windows(2).position(|pair| pair[1] <= pair[0]) {
            Some(i) => Err(format!(
                "light.on_s: {} is followed by {}; times must rise: on, off, on, …",
                self.on_s[i],
                self.on_s[i + 1]
            )),
            None => Ok(()),
        }
    }
}

/// Films whose thermal values are known.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
pub enum Film {
    /// Polyethylene terephthalate.
    #[serde(alias = "pet", alias = "Mylar", alias = "mylar")]
    PET,
    /// Polyimide.
    #[serde(alias = "kapton")]
    Kapton,
}

/// A face of the strip.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Face {
    /// That which faces the lamp.
    Front,
    /// The other.
    Back,
}

/// A thin layer on one face.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Coating {
    /// Its thickness.
    pub thickness_m: f64,
    /// Its Young's modulus.
    pub young_modulus_pa: f64,
    /// Its thermal expansion.
    pub expansion_per_k: f64,
    /// Where it is.
    pub face: Face,
}

/// How the strip warms and what warmth does to it. What is absent is that of `film`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Heat {
    /// The film, for typical values.
    pub film: Option<Film>,
    /// c, specific heat capacity.
    pub heat_capacity_j_kg_k: Option<f64>,
    /// k, through the thickness.
    pub conductivity_w_m_k: Option<f64>,
    /// α, thermal expansion along the strip.
    pub expansion_per_k: Option<f64>,
    /// (dE/dT)/E; zero where neither film nor number is given.
    pub modulus_change_per_k: Option<f64>,
    /// Emissivity of the face towards the lamp.
    pub emissivity_front: Option<f64>,
    /// Emissivity of the other face.
    pub emissivity_back: Option<f64>,
    /// Temperature of the chamber's wall, and of the strip in the dark.
    pub wall_k: f64,
    /// Heat given to a gas on each face; zero in a vacuum.
    pub convection_w_m2_k: f64,
    /// A layer that expands otherwise.
    pub coating: Option<Coating>,
}

impl Default for Heat {
    fn default() -> Self {
        Self {
            film: None,
            heat_capacity_j_kg_k: None,
            conductivity_w_m_k: None,
            expansion_per_k: None,
            modulus_change_per_k: None,
            emissivity_front: None,
            emissivity_back: None,
            wall_k: 293.15,
            convection_w_m2_k: 0.0,
            coating: None,
        }
    }
}

impl Heat {
    pub(super) fn validate(&self) -> Result<(), String> {
        for (key, value) in [
            ("heat_capacity_j_kg_k", self.heat_capacity_j_kg_k),
            ("conductivity_w_m_k", self.conductivity_w_m_k),
            ("wall_k", Some(self.wall_k)),
        ] {
            value.map_or(Ok(()), |v| positive(&format!("heat.{key}"), v))?;
        }
        for (key, value) in
            [("expansion_per_k", self.expansion_per_k), ("modulus_change_per_k", self.modulus_change_per_k)]
        {
            value.map_or(Ok(()), |v| finite(&format!("heat.{key}"), v))?;
        }
        for (key, value) in [("emissivity_front", self.emissivity_front), ("emissivity_back", self.emissivity_back)] {
            if let Some(v) = value.filter(|v| !(0.0..=1.0).contains(v)) {
                return Err(format!("heat.{key} = {v}: must be between 0 and 1"));
            }
        }
        not_negative("heat.convection_w_m2_k", self.convection_w_m2_k)?;
        let Some(coating) = self.coating else { return Ok(()) };
        positive("heat.coating.thickness_m", coating.thickness_m)?;
        positive("heat.coating.young_modulus_pa", coating.young_modulus_pa)?;
        finite("heat.coating.expansion_per_k", coating.expansion_per_k)
    }
}

/// The displacement sensor.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Laser {
    /// The point of the strip it sees, below the hinge; the free end where it is absent.
    pub height_m: Option<f64>,
    /// Least and greatest displacement it can tell.
    pub range_m: Option<[f64; 2]>,
    /// Its step.
    pub resolution_m: Option<f64>,
    /// The column of a record that holds the displacement.
    pub column: Option<String>,
    /// Displacement a volt, for a record in volts.
    pub scale_m_per_v: Option<f64>,
}

impl Laser {
    pub(super) fn validate(&self, length_m: f64) -> Result<(), String> {
        if let Some(height) = self.height_m
            && !(height > 0.0 && height <= length_m)
        {
            return Err(format!(
                "laser.height_m = {height}: not on the strip, which reaches from the hinge (0) down to {length_m} m"
            ));
        }
        if let Some([low, high]) = self.range_m
            && !(low.is_finite() && high.is_finite() && low < high)
        {
            return Err(format!("laser.range_m = [{low}, {high}]: give the least and the greatest displacement in m"));
        }
        self.resolution_m.map_or(Ok(()), |v| positive("laser.resolution_m", v))?;
        match self.scale_m_per_v {
            Some(v) if !(v.is_finite() && v != 0.0) => {
                Err(format!("laser.scale_m_per_v = {v}: must be a number other than 0"))
            }
            _ => Ok(()),
        }
    }
}
