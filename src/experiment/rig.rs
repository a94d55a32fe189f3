//! `[rig]`: how the specimen hangs and is seen.

use std::path::PathBuf;
use std::str::FromStr;

use serde::Deserialize;

use super::positive;

/// What tells a mark from its surroundings.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Look {
    /// Its hue.
    Hue,
    /// It is darker than what lies around it.
    Dark,
    /// It is lighter.
    Light,
}

/// Codes by which the channels of a colour must differ to have a hue.
const LEAST_SATURATION: u8 = 32;

/// The colour of a mark: a name or `#rrggbb`. `dark` (or `black`) and `light` (or `white`) have no hue.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MarkColour {
    /// As the user wrote it.
    pub name: String,
    /// Red, green, blue.
    pub rgb: [u8; 3],
}

impl MarkColour {
    const NAMES: [(&'static str, [u8; 3]); 14] = [
        ("red", [255, 0, 0]),
        ("green", [0, 160, 0]),
        ("blue", [0, 0, 255]),
        ("yellow", [255, 255, 0]),
        ("orange", [255, 128, 0]),
        ("magenta", [255, 0, 255]),
        ("cyan", [0, 255, 255]),
        ("violet", [128, 0, 255]),
        ("purple", [160, 0, 200]),
        ("pink", [255, 80, 160]),
        ("dark", [0, 0, 0]),
        ("black", [0, 0, 0]),
        ("light", [255, 255, 255]),
        ("white", [255, 255, 255]),
    ];

    /// The paper's marks.
    pub fn red() -> Self {
        Self { name: "red".to_owned(), rgb: [255, 0, 0] }
    }

    /// What tells such a mark from its surroundings.
    pub fn look(&self) -> Look {
        let [least, most] = [self.rgb.iter().min(), self.rgb.iter().max()].map(|c| c.copied().unwrap_or(0));
        match (most - least >= LEAST_SATURATION, least >= 128) {
            (true, _) => Look::Hue,
            (false, false) => Look::Dark,
            (false, true) => Look::Light,
        }
    }

    /// It was given by a name, which stands for a family of hues, rather than measured.
    pub fn is_named(&self) -> bool {
        !self.name.starts_with('#')
    }
}

impl FromStr for MarkColour {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let lower = text.trim().to_ascii_lowercase();
        if let Some((_, rgb)) = Self::NAMES.iter().find(|(name, _)| *name == lower) {
            return Ok(Self { name: lower, rgb: *rgb });
        }
        let names = Self::NAMES.map(|(name, _)| name).join(", ");
        let digits = lower
            .strip_prefix('#')
            .filter(|d| d.len() == 6 && d.bytes().all(|b| b.is_ascii_hexdigit()))
            .ok_or_else(|| format!("unknown colour `{text}`; use {names} or #rrggbb"))?;
        let channel = |i: usize| u8::from_str_radix(&digits[i..i + 2], 16).map_err(|e| e.to_string());
        let rgb = [channel(0)?, channel(2)?, channel(4)?];
        let spread = rgb.iter().max().copied().unwrap_or(0) - rgb.iter().min().copied().unwrap_or(0);
        if spread < LEAST_SATURATION {
            return Err(format!(
                "colour `{text}` is a grey, which has no hue to be found by; for a mark darker or lighter than what \
                 lies around it say dark or light"
            ));
        }
        Ok(Self { name: lower, rgb })
    }
}

impl<'de> Deserialize<'de> for MarkColour {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        String::deserialize(deserializer)?.parse().map_err(serde::de::Error::custom)
    }
}

/// How the strip is held at its upper end.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Support {
    /// Held and free to turn.
    #[default]
    Hinged,
    /// Held and kept vertical.
    Clamped,
}

/// What measured the angles.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Sensor {
    /// A camera.
    #[default]
    Camera,
    /// An encoder on each hinge: its scale, its clock and its view are right; its zero may not be.
    Encoder,
}

/// How the specimen hangs and is seen.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Rig {
    /// Local gravity.
    pub gravity_m_s2: f64,
    /// How the specimen is held at its upper end.
    pub support: Support,
    /// A torsion spring at a hinge.
    pub support_stiffness_n_m_per_rad: f64,
    /// What measured the angles.
    pub sensor: Sensor,
    /// The camera looks into a mirror.
    pub mirrored: bool,
    /// A fixed, unmarked hinge; then the first mark is the joint.
    pub pivot_px: Option<[f64; 2]>,
    /// Standard deviation of that along x and y.
    pub pivot_sd_px: Option<[f64; 2]>,
    /// One colour a mark, top to bottom.
    pub marks: Vec<MarkColour>,
    /// Two points on a plumb line, upper first: the picture's true vertical.
    pub plumb_px: Option<[[f64; 2]; 2]>,
    /// Width of a pixel over its height, where the file states it wrongly.
    pub pixel_aspect: Option<f64>,
    /// An OpenCV calibration file (`camera_matrix`, `distortion_coefficients`), relative to the experiment file.
    pub lens_calibration: Option<PathBuf>,
    /// Marks are sought only in here: left, top, width, height.
    pub roi_px: Option<[f64; 4]>,
    /// A picture, white where marks are sought, relative to the experiment file.
    pub mask: Option<PathBuf>,
    /// What comes before is not measured, seconds of the file.
    pub from_s: Option<f64>,
    /// What comes after is not measured, seconds of the file.
    pub until_s: Option<f64>,
    /// Frames per second at which the camera ran, where the file plays slower (slow motion).
    pub true_rate_hz: Option<f64>,
    /// Fixed points with clear edges, displayed pixels: they show how the camera moves.
    pub reference_marks: Vec<[f64; 2]>,
}

impl Default for Rig {
    fn default() -> Self {
        Self {
            gravity_m_s2: 9.80665,
            support: Support::Hinged,
            support_stiffness_n_m_per_rad: 0.0,
            sensor: Sensor::Camera,
            mirrored: false,
            pivot_px: None,
            pivot_sd_px: None,
            marks: Vec::new(),
            plumb_px: None,
            pixel_aspect: None,
            lens_calibration: None,
            roi_px: None,
            mask: None,
            from_s: None,
            until_s: None,
            true_rate_hz: None,
            reference_marks: Vec::new(),
        }
    }
}

impl Rig {
    /// The part of the recording that is used, from one time of the file to another.
    pub fn span_s(&self) -> [f64; 2] {
        [self.from_s.unwrap_or(f64::NEG_INFINITY), self.until_s.unwrap_or(f64::INFINITY)]
    }

    /// The numbers make sense.
    ///
    /// # Errors
    /// A line that names the key.
    pub(crate) fn validate(&self) -> Result<(), String> {
        positive("rig.gravity_m_s2", self.gravity_m_s2)?;
        super::not_negative("rig.support_stiffness_n_m_per_rad", self.support_stiffness_n_m_per_rad)?;
        self.pixel_aspect.map_or(Ok(()), |v| positive("rig.pixel_aspect", v))?;
        if let Some([upper, lower]) = self.plumb_px
            && !((upper[0] - lower[0]).hypot(upper[1] - lower[1]) >= 1.0)
        {
            return Err("rig.plumb_px: the two points must be at least a pixel apart".to_owned());
        }
        self.true_rate_hz.map_or(Ok(()), |v| positive("rig.true_rate_hz", v))?;
        if let Some(roi) = self.roi_px
            && !(roi.iter().all(|v| v.is_finite()) && roi[2] >= 8.0 && roi[3] >= 8.0)
        {
            return Err("rig.roi_px: give left, top, width and height, at least 8 px wide and high".to_owned());
        }
        for (key, value) in [("from_s", self.from_s), ("until_s", self.until_s)] {
            if value.is_some_and(|v| !v.is_finite()) {
                return Err(format!("rig.{key}: must be a number of seconds"));
            }
        }
        if let (Some(from), Some(until)) = (self.from_s, self.until_s)
            && !(until > from)
        {
            return Err(format!("rig.until_s = {until}: must be later than rig.from_s = {from}"));
        }
        if self.reference_marks.iter().flatten().any(|v| !v.is_finite()) {
            return Err("rig.reference_marks: must be points of two finite numbers".to_owned());
        }
        if self.pivot_px.is_some_and(|p| !p[0].is_finite() || !p[1].is_finite()) {
            return Err("rig.pivot_px: must be two finite numbers".to_owned());
        }
        if self.pivot_sd_px.is_some_and(|sd| !sd.iter().all(|sd| sd.is_finite() && *sd >= 0.0)) {
            return Err("rig.pivot_sd_px: must be two numbers of at least 0".to_owned());
        }
        if self.pivot_sd_px.is_some() && self.pivot_px.is_none() {
            return Err("rig.pivot_sd_px: is the standard deviation of rig.pivot_px, which is not given".to_owned());
        }
        Ok(())
    }
}
