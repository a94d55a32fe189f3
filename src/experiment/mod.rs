//! `experiment.toml`: the specimen, the rig, the model and, for synthetic recordings, the camera.
//!
//! Unknown keys are an error that names the key and the nearest known one.

mod consistency;
mod keys;
mod law;
mod light;
mod model;
mod render;
mod rig;
mod specimen;
mod unmeasured;

use std::path::Path;

use serde::Deserialize;

pub use law::{Coefficient, Law, LawPlace};
pub use light::{Coating, Face, Film, Heat, Laser, Light};
pub use model::{Effects, EncoderError, Hysteresis, Model, ObliqueView, SupportFlexibility, SupportMotion};
pub use render::{Caption, Codec, CodecName, Distractor, Lens, Noise, Occlusion, PixelFormat, Render, Rgb, Siting};
pub use rig::{Look, MarkColour, Rig, Sensor, Support};
pub use specimen::{Inertia, Link, Reflectivity, Specimen};

use crate::error::{Error, Result};

/// A whole experiment file. Every table is optional.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Experiment {
    /// What swings.
    pub specimen: Specimen,
    /// How it hangs and is seen.
    pub rig: Rig,
    /// Start values and settings of the forward model.
    pub model: Model,
    /// How a synthetic recording is made.
    pub render: Render,
    /// The spotlight.
    pub light: Option<Light>,
    /// How light warms the strip.
    pub heat: Option<Heat>,
    /// The sensor of displacements.
    pub laser: Option<Laser>,
    /// What of the specimen the file does not say, in words; nothing where it says enough.
    #[serde(skip)]
    pub missing: Option<String>,
    /// The same where the specimen is a strip without marks.
    #[serde(skip)]
    pub missing_of_strip: Option<String>,
    /// Bending stiffness of a strip that bends all along (N·m²), where the specimen is one; taken over by what simulates it.
    #[serde(skip)]
    pub bending_stiffness_n_m2: Option<f64>,
    /// What in the file is odd, and may yet be true.
    #[serde(skip)]
    pub warnings: Vec<String>,
}

impl Experiment {
    /// Reads and checks a file.
    ///
    /// # Errors
    /// [`Error::Unreadable`], or [`Error::Config`] with the line and, for an unknown key, the nearest known one.
    pub fn read(path: &Path) -> Result<Self> {
        let text = std::fs::read_to_string(path).map_err(|e| Error::unreadable(path, e))?;
        Self::parse(&text, path)
    }

    /// Reads a file for what only the camera needs: what is still to be measured of the specimen is left at its
    /// default, and link lengths that it does not state are left out.
    ///
    /// # Errors
    /// As [`Experiment::read`].
    pub fn read_rig(path: &Path) -> Result<Self> {
        let text = std::fs::read_to_string(path).map_err(|e| Error::unreadable(path, e))?;
        Self::parse_rig(&text, path)
    }

    /// The same of a text; `path` only appears in errors.
    ///
    /// # Errors
    /// [`Error::Config`].
    pub fn parse_rig(text: &str, path: &Path) -> Result<Self> {
        let text = unmeasured::without(text);
        let mut experiment = Self::parse(&text, path)?;
        if !unmeasured::states(&text, "link_lengths_m") {
            experiment.specimen.link_lengths_m.clear();
        }
        Ok(experiment)
    }

    /// The same for work that says more where the specimen is described: a key that is still to be measured is one that is missing.
    ///
    /// # Errors
    /// As [`Experiment::read`].
    pub fn read_as_far_as_measured(path: &Path) -> Result<Self> {
        let text = std::fs::read_to_string(path).map_err(|e| Error::unreadable(path, e))?;
        let waiting = unmeasured::refuse(&text, path).err();
        let mut experiment = Self::parse(&unmeasured::without(&text), path)?;
        experiment.missing = waiting.map(|error| error.to_string()).or(experiment.missing);
        Ok(experiment)
    }

    /// The same for work that needs the specimen.
    ///
    /// # Errors
    /// As [`Experiment::read`], and [`Error::Config`] that asks for what is missing.
    pub fn read_with_specimen(path: &Path) -> Result<Self> {
        let text = std::fs::read_to_string(path).map_err(|e| Error::unreadable(path, e))?;
        Self::parse_with_specimen(&text, path)
    }

    /// The same of a text; `path` only appears in errors.
    ///
    /// # Errors
    /// [`Error::Config`].
    pub fn parse_with_specimen(text: &str, path: &Path) -> Result<Self> {
        let mut experiment = Self::parse(text, path)?;
        let missing = experiment.missing.take();
        let effects = &mut experiment.model.effects;
        effects.distributed_flexibility = effects.distributed_flexibility.or(experiment.bending_stiffness_n_m2);
        let mut experiment = experiment.unless(missing, path)?;
        experiment.complete_hinge();
        Ok(experiment)
    }

    /// The same for a strip that needs no marks.
    ///
    /// # Errors
    /// As [`Experiment::read_with_specimen`].
    pub fn read_with_strip(path: &Path) -> Result<Self> {
        let mut experiment = Self::read(path)?;
        let missing = experiment.missing_of_strip.take();
        experiment.unless(missing, path)
    }

    /// What the keys that are there say of those that are not: a release for as many links as there are, and of a single link, which has no joint, C at its
    /// hinge.
    fn complete_model(&mut self, keys: &toml::Table) {
        let states = |key: &str| keys.get("model").is_some_and(|model| model.get(key).is_some());
        let (links, model) = (self.specimen.lengths_m().len(), &mut self.model);
        model.states_damping = states("c_eq_n_m_s_per_rad");
        model.states_pieces = states("pieces");
        if !states("release_rad") {
            model.release_rad = (0..links.max(1)).map(|link| 0.5 + 0.1 * link as f64).collect();
        }
        if links == 1 && model.states_damping && model.effects.hinge_viscous.is_none() {
            model.effects.hinge_viscous = Some(model.c_eq_n_m_s_per_rad);
        }
    }

    /// How `[rig]` says that the strip is held, as the hinge's own spring and damper, where `[model.effects]` states none. A clamp bends half of the first rod:
    /// 2 EI/ℓ and, of the damper, as much more than the joint's.
    fn complete_hinge(&mut self) {
        let (model, lengths_m) = (&mut self.model, self.specimen.lengths_m());
        let (effects, mark_length_m) = (&mut model.effects, lengths_m.iter().sum::<f64>() / lengths_m.len() as f64);
        match self.rig.support {
            Support::Clamped => {
                let bends = effects.distributed_flexibility.map(|bending| bending / mark_length_m);
                let pieces = if bends.is_some() { model.pieces } else { 1 };
                let ratio = 2.0 * mark_length_m / (lengths_m[0] / pieces as f64);
                effects.hinge_stiffness.get_or_insert(ratio * bends.unwrap_or(model.k_eq_n_m_per_rad));
                effects.hinge_viscous.get_or_insert(ratio * model.c_eq_n_m_s_per_rad);
            }
            Support::Hinged if self.rig.support_stiffness_n_m_per_rad > 0.0 => {
                effects.hinge_stiffness.get_or_insert(self.rig.support_stiffness_n_m_per_rad);
            }
            Support::Hinged => {}
        }
    }

    fn unless(self, missing: Option<String>, path: &Path) -> Result<Self> {
        match missing {
            Some(message) => Err(Error::Config { path: path.to_owned(), line: None, message }),
            None => Ok(self),
        }
    }

    /// Parses the text of a file; `path` only appears in errors.
    ///
    /// # Errors
    /// [`Error::Config`].
    pub fn parse(text: &str, path: &Path) -> Result<Self> {
        let wrong = |e: toml::de::Error| Error::Config {
            path: path.to_owned(),
            line: e.span().map(|s| text[..s.start.min(text.len())].matches('\n').count() + 1),
            message: with_nearest_key(e.message(), e.span().map_or("", |span| key_at(text, span.start))),
        };
        unmeasured::refuse(text, path)?;
        let mut experiment: Self = toml::from_str(text).map_err(wrong)?;
        let keys: toml::Table = toml::from_str(text).map_err(wrong)?;
        let invalid = |message: String| Error::Config { path: path.to_owned(), line: None, message };
        let name = path.file_stem().map_or_else(|| "specimen".into(), std::ffi::OsStr::to_string_lossy);
        consistency::complete(&mut experiment.specimen, &keys, &name);
        experiment.complete_model(&keys);
        let (stiffness, stiffness_missing) = consistency::bending_stiffness_n_m2(&mut experiment, &keys);
        experiment.bending_stiffness_n_m2 = stiffness;
        experiment.missing = consistency::missing(&keys).or(stiffness_missing);
        experiment.missing_of_strip = consistency::missing_of_strip(&keys);
        experiment.specimen.validate().map_err(invalid)?;
        experiment.rig.validate().map_err(invalid)?;
        experiment.model.validate().map_err(invalid)?;
        let bends = experiment.model.effects.distributed_flexibility.is_some();
        let links = experiment.specimen.lengths_m().len();
        law::validate_joints(&experiment.model.law, links, bends).map_err(invalid)?;
        experiment.render.validate().map_err(invalid)?;
        let length_m = experiment.specimen.length_m;
        experiment.light.as_ref().map_or(Ok(()), |light| light.validate(length_m)).map_err(invalid)?;
        experiment.heat.as_ref().map_or(Ok(()), Heat::validate).map_err(invalid)?;
        experiment.laser.as_ref().map_or(Ok(()), |laser| laser.validate(length_m)).map_err(invalid)?;
        let odd = consistency::contradictions(&experiment, &keys).map_err(invalid)?;
        experiment.warnings = odd.into_iter().map(|warning| format!("{}: {warning}", path.display())).collect();
        Ok(experiment)
    }
}

/// Turns serde's "unknown field `a`, expected one of `b`, `c`" into a line that proposes the nearest key.
fn with_nearest_key(message: &str, key: &str) -> String {
    let message = message.lines().next().unwrap_or_default();
    if let Some((is, wanted)) = message.strip_prefix("invalid type: ").and_then(|rest| rest.split_once(", expected ")) {
        return format!("`{key}` is {}, and wants {}", in_words(is), in_words(wanted));
    }
    if let Some(key) = message.strip_prefix("missing field `").and_then(|rest| rest.strip_suffix('`')) {
        return format!("`{key}` is missing{}", example(key));
    }
    let Some(rest) = message.strip_prefix("unknown field ") else {
        return message.to_owned();
    };
    let names: Vec<&str> = rest.split('`').skip(1).step_by(2).collect();
    let Some((unknown, known)) = names.split_first() else {
        return message.to_owned();
    };
    let nearest = known.iter().map(|k| (strsim::jaro_winkler(unknown, k), k)).max_by(|a, b| a.0.total_cmp(&b.0));
    match nearest {
        Some((_, key)) => format!("unknown key `{unknown}`; the nearest known one is `{key}`"),
        None => format!("unknown key `{unknown}`; this table takes no keys"),
    }
}

/// The key whose value stands at a place of a text.
fn key_at(text: &str, at: usize) -> &str {
    let before = text.get(..at).unwrap_or_default();
    let line = before.rsplit('\n').next().unwrap_or_default();
    let key = line.rsplit_once('=').map_or(line, |(key, _)| key);
    // within an inline table other keys stand before it
    key.rsplit(['{', ',']).next().unwrap_or_default().trim()
}

/// A type as serde calls it, in plain words.
fn in_words(kind: &str) -> String {
    let plain = [
        ("sequence", "a list"),
        ("a sequence", "a list"),
        ("map", "a table"),
        ("a map", "a table"),
        ("f64", "a number"),
        ("f32", "a number"),
        ("a string", "words in quotes"),
        ("a boolean", "true or false"),
        ("u8", "a whole number"),
        ("u32", "a whole number"),
        ("u64", "a whole number"),
        ("usize", "a whole number"),
        ("i32", "a whole number"),
        ("i64", "a whole number"),
    ];
    if let Some((_, words)) = plain.iter().find(|(serde, _)| *serde == kind) {
        return (*words).to_owned();
    }
    if let Some(count) = kind.strip_prefix("an array of length ") {
        return format!("a list of {count}");
    }
    let value = [("string ", "the word "), ("integer ", ""), ("floating point ", ""), ("boolean ", "")];
    let told = value.iter().find_map(|(serde, words)| Some(format!("{words}{}", kind.strip_prefix(serde)?)));
    match told {
        Some(told) => told.replace('`', ""),
        None if kind.starts_with("struct ") => "a table".to_owned(),
        None => kind.to_owned(),
    }
}

/// What a key of a table that needs all of its keys means, and how it is written.
fn example(key: &str) -> String {
    let known = [
        ("length_m", "m, pivot to pivot; for example length_m = 0.1727"),
        ("mass_kg", "kg; for example mass_kg = 0.0938"),
        ("com_m", "m, from the link's pivot to its centre of mass; for example com_m = 0.1086"),
        ("inertia_kg_m2", "kg·m², about the centre of mass; for example inertia_kg_m2 = 4.375e-4"),
        ("torque_n_m", "N·m; for example torque_n_m = 1e-6"),
        ("yield_rad", "rad; for example yield_rad = 0.03"),
        ("amplitude_m", "m; for example amplitude_m = 1e-4"),
        ("frequency_hz", "Hz; for example frequency_hz = 2.0"),
        ("specular", "share of the light; for example specular = 0.60"),
        ("diffuse", "share of the light; for example diffuse = 0.26"),
        ("absorbed", "share of the light; for example absorbed = 0.14"),
        ("thickness_m", "m; for example thickness_m = 1e-7"),
        ("young_modulus_pa", "Pa; for example young_modulus_pa = 70e9"),
        ("expansion_per_k", "1/K; for example expansion_per_k = 23.1e-6"),
        ("face", "the side it is on; face = \"front\" or \"back\""),
    ];
    known.iter().find(|(name, _)| *name == key).map_or(String::new(), |(_, text)| format!(" ({text})"))
}

/// `value` must be finite and positive.
fn positive(key: &str, value: f64) -> std::result::Result<(), String> {
    if value.is_finite() && value > 0.0 { Ok(()) } else { Err(format!("{key} = {value}: must be a positive number")) }
}

/// `value` must be finite.
fn finite(key: &str, value: f64) -> std::result::Result<(), String> {
    if value.is_finite() { Ok(()) } else { Err(format!("{key} = {value}: must be a finite number")) }
}

/// `value` must be finite and not negative.
fn not_negative(key: &str, value: f64) -> std::result::Result<(), String> {
    if value.is_finite() && value >= 0.0 {
        Ok(())
    } else {
        Err(format!("{key} = {value}: must be zero or a positive number"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_unknown_key_is_named_with_its_nearest_neighbour_and_line() {
        let text = "[rig]\ngravity_m_s2 = 9.81\nmirored = true\n";
        let error = Experiment::parse(text, Path::new("e.toml")).unwrap_err().to_string();
        assert_eq!(error, "e.toml:3: unknown key `mirored`; the nearest known one is `mirrored`");
    }

    #[test]
    fn a_clamped_strip_has_a_spring_and_a_damper_at_its_hinge_as_stiff_as_half_a_rod_bent() {
        let of = |held: &str| {
            let text = format!(
                "[specimen]\nlink_lengths_m = [0.1, 0.1]\nmass_kg = 7e-4\nlength_m = 0.2\n[rig]\n{held}\n[model]\npieces = 5\n\
                 c_eq_n_m_s_per_rad = 2e-8\n[model.effects]\ndistributed_flexibility = 1.5e-6\n"
            );
            Experiment::parse_with_specimen(&text, Path::new("e.toml")).unwrap().model.effects
        };
        let clamped = of("support = \"clamped\"");
        // 2 EI/ℓ with ℓ = 0.02 m; C is that of 0.1 m
        assert!((clamped.hinge_stiffness.unwrap() / 1.5e-4 - 1.0).abs() < 1e-12);
        assert!((clamped.hinge_viscous.unwrap() / 2e-7 - 1.0).abs() < 1e-12);
        assert_eq!(of("support_stiffness_n_m_per_rad = 3e-5").hinge_stiffness, Some(3e-5));
        assert_eq!(of("").hinge_stiffness, None);
    }

    #[test]
    fn a_value_of_another_kind_is_told_with_what_the_key_wants() {
        let of = |text: &str| Experiment::parse(text, Path::new("e.toml")).unwrap_err().to_string();
        assert_eq!(of("[specimen]\nmass_kg = [1.0]\n"), "e.toml:2: `mass_kg` is a list, and wants a number");
        assert_eq!(
            of("[specimen]\nmass_kg = \"1 g\"\n"),
            "e.toml:2: `mass_kg` is the word \"1 g\", and wants a number"
        );
        assert_eq!(of("[rig]\nmirrored = 1\n"), "e.toml:2: `mirrored` is 1, and wants true or false");
        assert_eq!(of("[specimen]\nname = 5\n"), "e.toml:2: `name` is 5, and wants words in quotes");
        let inline = of("[specimen]\nreflectivity = { specular = 0.6, diffuse = \"no\", absorbed = 0.1 }\n");
        assert_eq!(inline, "e.toml:2: `diffuse` is the word \"no\", and wants a number");
    }

    #[test]
    fn the_documented_file_is_accepted() {
        let text = r#"
[specimen]
name = "Kapton 1 mil"
mass_kg = 0.3606e-3
length_m = 0.20
width_m = 0.05
thickness_m = 25.4e-6
density_kg_m3 = 1420
young_modulus_pa = 2.5e9
reflectivity = { specular = 0.60, diffuse = 0.26, absorbed = 0.14 }
link_lengths_m = [0.10, 0.10]
inertia = "rods"
[rig]
gravity_m_s2 = 9.80665
mirrored = false
pivot_px = [497.0, 508.0]
marks = ["red", "red", "red"]
[model]
k_eq_n_m_per_rad = 2.0e-4
c_eq_n_m_s_per_rad = 2.0e-6
release_rad = [0.5, 0.6]
[model.effects]
hinge_coulomb = 1.0e-7
"#;
        let e = Experiment::parse(text, Path::new("e.toml")).unwrap();
        assert_eq!(e.specimen.link_lengths_m, vec![0.1, 0.1]);
        assert_eq!(e.rig.pivot_px, Some([497.0, 508.0]));
        assert_eq!(e.model.effects.hinge_coulomb, Some(1.0e-7));
    }

    #[test]
    fn a_friction_that_feeds_the_motion_is_refused() {
        let of = |line: &str| {
            let text = format!("[model.effects]\n{line}\n");
            Experiment::parse(&text, Path::new("e.toml")).unwrap_err().to_string()
        };
        let error = of("hinge_coulomb = -1e-7");
        assert_eq!(error, "e.toml: model.effects.hinge_coulomb = -0.0000001: must be zero or a positive number");
        assert!(of("rest_curl = nan").contains("model.effects.rest_curl = NaN: must be a finite number"));
        assert!(of("distributed_flexibility = 0.0").contains("must be a positive number"));
    }

    #[test]
    fn an_error_of_an_encoder_is_of_one_link_and_lets_its_reading_grow_with_the_angle() {
        let of = |lengths: &str, error: &str| {
            let text = format!("[specimen]\nlink_lengths_m = {lengths}\n[model.effects]\nencoder_error = {error}\n");
            Experiment::parse(&text, Path::new("e.toml")).map_err(|e| e.to_string())
        };
        assert_eq!(of("[0.1]", "{ sine_rad = 0.01 }").unwrap().model.effects.encoder_error.unwrap().sine_rad, 0.01);
        assert!(
            of("[0.1, 0.1]", "{ sine_rad = 0.01 }").unwrap_err().contains("of specimens of one link, this one has 2")
        );
        assert!(of("[0.1]", "{ sine_2_rad = 0.6 }").unwrap_err().contains("encoder_error: 1 - its steepest slope"));
    }

    #[test]
    fn a_mass_of_zero_is_refused() {
        let error = Experiment::parse("[specimen]\nmass_kg = 0.0\n", Path::new("e.toml")).unwrap_err();
        assert_eq!(error.to_string(), "e.toml: specimen.mass_kg = 0: must be a positive number");
    }
}
