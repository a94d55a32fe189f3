//! `[specimen]`: what swings.

use serde::Deserialize;

use super::positive;

/// How the mass of a strip is placed on its links.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Inertia {
    /// Uniform links (paper Eq. 33).
    #[default]
    Rods,
    /// Point masses at the nodes (paper Eq. 22–25), shares in `lumps`.
    Lumps,
    /// A uniform strip that bends all along: many rods, with the bending stiffness `model.effects.distributed_flexibility`.
    Strip,
}

/// Optical shares of a surface, which sum to one.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Reflectivity {
    /// Mirror-like share, C_s of paper Eq. 41.
    pub specular: f64,
    /// Diffuse share, C_d.
    pub diffuse: f64,
    /// Absorbed share, C_a.
    pub absorbed: f64,
    /// Share that passes through.
    #[serde(default)]
    pub transmitted: f64,
}

/// Shares are printed with three or four digits.
const SHARES_SUM: f64 = 1e-3;

impl Reflectivity {
    /// A surface that light does not pass through.
    pub const fn opaque(specular: f64, diffuse: f64, absorbed: f64) -> Self {
        Self { specular, diffuse, absorbed, transmitted: 0.0 }
    }

    fn validate(&self, key: &str) -> Result<(), String> {
        let shares = [
            ("specular", self.specular),
            ("diffuse", self.diffuse),
            ("absorbed", self.absorbed),
            ("transmitted", self.transmitted),
        ];
        if let Some((share, value)) = shares.iter().find(|(_, value)| !(0.0..=1.0).contains(value)) {
            return Err(format!("{key}.{share} = {value}: a share of the light, from 0 to 1"));
        }
        let sum: f64 = shares.iter().map(|(_, value)| value).sum();
        if (sum - 1.0).abs() > SHARES_SUM {
            return Err(format!(
                "{key}: specular, diffuse, absorbed and transmitted sum to {}; they must sum to 1",
                (sum * 1e4).round() / 1e4
            ));
        }
        Ok(())
    }
}

/// One general rigid link.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Link {
    /// Pivot to pivot.
    pub length_m: f64,
    /// Mass.
    pub mass_kg: f64,
    /// The link's own pivot to its centre of mass.
    pub com_m: f64,
    /// About the centre of mass.
    pub inertia_kg_m2: f64,
}

/// What swings: a strip, or general rigid links.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Specimen {
    /// For reports.
    pub name: String,
    /// Mass of the whole strip.
    pub mass_kg: f64,
    /// Length of the whole strip.
    pub length_m: f64,
    /// Width of the strip.
    pub width_m: f64,
    /// Thickness of the strip.
    pub thickness_m: Option<f64>,
    /// Density of the material.
    pub density_kg_m3: Option<f64>,
    /// Young's modulus of the material.
    pub young_modulus_pa: Option<f64>,
    /// Optical shares of the surface, of the face towards the lamp.
    pub reflectivity: Option<Reflectivity>,
    /// Optical shares of the other face, where it differs.
    pub reflectivity_back: Option<Reflectivity>,
    /// Curvature of the strip at rest, without load; positive towards +x at the free end.
    pub curl_per_m: f64,
    /// Lengths between the marks, top to bottom.
    pub link_lengths_m: Vec<f64>,
    /// Rods, lumps or a strip that bends all along.
    pub inertia: Inertia,
    /// Shares of the mass at the nodes, hinge first, for `inertia = "lumps"`.
    pub lumps: Option<Vec<f64>>,
    /// General rigid links, instead of the strip above.
    pub links: Vec<Link>,
}

impl Default for Specimen {
    /// The paper's Kapton 1 mil strip (Table 1, masses in grams).
    fn default() -> Self {
        Self {
            name: "Kapton 1 mil".to_owned(),
            mass_kg: 0.3606e-3,
            length_m: 0.20,
            width_m: 0.05,
            thickness_m: None,
            density_kg_m3: None,
            young_modulus_pa: None,
            reflectivity: None,
            reflectivity_back: None,
            curl_per_m: 0.0,
            link_lengths_m: vec![0.10, 0.10],
            inertia: Inertia::Rods,
            lumps: None,
            links: Vec::new(),
        }
    }
}

impl Specimen {
    /// Lengths of the links, top to bottom: of `links` where given, else `link_lengths_m`.
    pub fn lengths_m(&self) -> Vec<f64> {
        if self.links.is_empty() {
            self.link_lengths_m.clone()
        } else {
            self.links.iter().map(|l| l.length_m).collect()
        }
    }

    /// Mass of all links, or of the strip.
    pub fn whole_mass_kg(&self) -> f64 {
        if self.links.is_empty() { self.mass_kg } else { self.links.iter().map(|link| link.mass_kg).sum() }
    }

    /// E w t³ / 12, the bending stiffness of a flat strip (N·m²), where modulus and thickness are known.
    pub fn bending_stiffness_n_m2(&self) -> Option<f64> {
        Some(self.young_modulus_pa? * self.width_m * self.thickness_m?.powi(3) / 12.0)
    }

    pub(super) fn validate(&self) -> Result<(), String> {
        positive("specimen.mass_kg", self.mass_kg)?;
        positive("specimen.length_m", self.length_m)?;
        positive("specimen.width_m", self.width_m)?;
        for (key, value) in [
            ("specimen.thickness_m", self.thickness_m),
            ("specimen.density_kg_m3", self.density_kg_m3),
            ("specimen.young_modulus_pa", self.young_modulus_pa),
        ] {
            value.map_or(Ok(()), |v| positive(key, v))?;
        }
        for (key, surface) in
            [("specimen.reflectivity", self.reflectivity), ("specimen.reflectivity_back", self.reflectivity_back)]
        {
            surface.map_or(Ok(()), |surface| surface.validate(key))?;
        }
        super::finite("specimen.curl_per_m", self.curl_per_m)?;
        if self.link_lengths_m.is_empty() {
            return Err("specimen.link_lengths_m: needs at least one length".to_owned());
        }
        for (i, length) in self.link_lengths_m.iter().enumerate() {
            positive(&format!("specimen.link_lengths_m[{i}]"), *length)?;
        }
        for (i, link) in self.links.iter().enumerate() {
            positive(&format!("specimen.links[{i}].length_m"), link.length_m)?;
            positive(&format!("specimen.links[{i}].mass_kg"), link.mass_kg)?;
            positive(&format!("specimen.links[{i}].com_m"), link.com_m)?;
            super::not_negative(&format!("specimen.links[{i}].inertia_kg_m2"), link.inertia_kg_m2)?;
        }
        if let Some(lumps) = &self.lumps {
            let nodes = self.link_lengths_m.len() + 1;
            let sum: f64 = lumps.iter().sum();
            if lumps.len() != nodes || lumps.iter().any(|l| !(*l >= 0.0)) || (sum - 1.0).abs() > 1e-6 {
                return Err(format!(
                    "specimen.lumps: needs {nodes} shares (hinge, joints, tip), none negative, that sum to 1 (they sum to {sum})"
                ));
            }
        }
        Ok(())
    }
}
