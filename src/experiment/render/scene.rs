//! What stands before the camera, and the camera's own faults: colours, noise, lens, things beside the strip.

use serde::Deserialize;

use super::{Check, not_negative, positive, within};
use crate::video::MAX_SIDE_PX;

/// A colour, red, green, blue, gamma-coded; `#rrggbb` in a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(try_from = "String")]
pub struct Rgb(pub [u8; 3]);

impl TryFrom<String> for Rgb {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        let digits = text.strip_prefix('#').filter(|d| d.len() == 6 && d.bytes().all(|b| b.is_ascii_hexdigit()));
        let value = digits.and_then(|d| u32::from_str_radix(d, 16).ok());
        let value = value.ok_or_else(|| format!("unknown colour `{text}`; write #rrggbb"))?;
        Ok(Self([(value >> 16) as u8, (value >> 8) as u8, value as u8]))
    }
}

/// Sensor noise, in shares of full scale of the gamma-coded signal V (0..1): σ² = read² + shot² V.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Noise {
    /// Standard deviation in the dark.
    pub read: f64,
    /// Standard deviation that photon noise adds at full scale.
    pub shot: f64,
}

impl Default for Noise {
    fn default() -> Self {
        Self { read: 0.004, shot: 0.008 }
    }
}

impl Noise {
    pub(super) fn validate(&self) -> Check {
        within("render.noise.read", self.read, 0.0, 1.0)?;
        within("render.noise.shot", self.shot, 0.0, 1.0)
    }
}

/// Radial distortion about the picture's centre: r_d = r(1 + k₁ρ² + k₂ρ⁴), ρ = r / focal length.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Lens {
    /// Focal length.
    pub focal_px: f64,
    /// k₁; negative is a barrel.
    pub k1: f64,
    /// k₂.
    #[serde(default)]
    pub k2: f64,
}

impl Lens {
    /// For a picture whose corners are `corner_px` from its centre.
    pub(super) fn validate(&self, corner_px: f64) -> Check {
        positive("render.lens.focal_px", self.focal_px)?;
        // Beyond these the picture's corners fold over.
        within("render.lens.k1", self.k1, -0.3, 1.0)?;
        within("render.lens.k2", self.k2, -0.1, 1.0)?;
        within("render.lens: picture corner over focal_px", corner_px / self.focal_px, 0.0, 1.0)
    }
}

/// A knob on the stand whose colour resembles a mark's.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Distractor {
    /// Centre, in the undistorted picture.
    pub centre_px: [f64; 2],
    /// Diameter.
    pub diameter_px: f64,
    /// Colour.
    pub rgb: Rgb,
}

impl Distractor {
    pub(super) fn validate(&self) -> Check {
        within("render.distractor.diameter_px", self.diameter_px, 1.0, 4096.0)
    }
}

/// Text burnt into every frame, in block letters (A–Z, 0–9 and `-:./`).
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Caption {
    /// The text.
    pub text: String,
    /// Top left corner.
    pub corner_px: [f64; 2],
    /// Height of a letter.
    pub height_px: f64,
    /// Colour.
    pub rgb: Rgb,
}

impl Caption {
    pub(super) fn validate(&self) -> Check {
        within("render.captions.height_px", self.height_px, 1.0, 1024.0)
    }
}

/// Something that stands before the strip for a while.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Occlusion {
    /// From this stamp on.
    pub from_s: f64,
    /// Until this stamp.
    pub until_s: f64,
    /// Left, top, width, height.
    pub rect_px: [f64; 4],
    /// Colour.
    pub rgb: Rgb,
}

impl Occlusion {
    pub(super) fn validate(&self) -> Check {
        if !self.rect_px.iter().all(|v| v.abs() <= f64::from(MAX_SIDE_PX)) {
            return Err("render.occlusions.rect_px: must be left, top, width, height in pixels".to_owned());
        }
        not_negative("render.occlusions.until_s - from_s", self.until_s - self.from_s)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_colour_is_six_digits() {
        assert_eq!(Rgb::try_from("#0a0B0c".to_owned()), Ok(Rgb([10, 11, 12])));
        assert!(Rgb::try_from("red".to_owned()).is_err());
    }
}
