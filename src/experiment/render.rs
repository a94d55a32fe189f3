//! `[render]`: how a synthetic recording is made.

use serde::Deserialize;

use super::{not_negative, positive};
use crate::video::{Layout, MAX_SIDE_PX, Matrix};

/// The presets of x264 and x265.
const PRESETS: [&str; 10] =
    ["ultrafast", "superfast", "veryfast", "faster", "fast", "medium", "slow", "slower", "veryslow", "placebo"];

type Check = Result<(), String>;

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

/// The encoder.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum CodecName {
    /// H.264, by libx264.
    #[default]
    H264,
    /// HEVC, by libx265.
    Hevc,
    /// MPEG-4 Part 2.
    Mpeg4,
    /// Motion JPEG.
    Mjpeg,
}

/// The layout of the samples.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum PixelFormat {
    /// 4:2:0, 8 bit.
    #[default]
    Yuv420p,
    /// 4:2:2, 8 bit.
    Yuv422p,
    /// 4:4:4, 8 bit.
    Yuv444p,
    /// 4:2:0, 10 bit.
    Yuv420p10le,
    /// 4:2:0, 8 bit, the colour differences interleaved.
    Nv12,
}

/// Where the chroma samples of a subsampled picture lie.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Siting {
    /// On the left luma column, between two rows (MPEG-2, H.264).
    #[default]
    Left,
    /// Amid four luma samples (JPEG, MPEG-1).
    Center,
    /// On the top left luma sample (BT.2020).
    TopLeft,
}

/// How the pictures are coded.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Codec {
    /// The encoder.
    pub name: CodecName,
    /// Constant rate factor (0–51) for H.264 and HEVC; the quantiser (1–31) for MPEG-4 and MJPEG.
    pub crf: f64,
    /// x264's or x265's preset.
    pub preset: String,
    /// Largest number of B-frames in a row; the encoder's own choice where absent.
    pub b_frames: Option<u32>,
    /// Largest number of frames from a key frame to the next.
    pub gop: u32,
    /// Layout of the samples.
    pub pixel_format: PixelFormat,
    /// 0..255 rather than 16..235.
    pub full_range: bool,
    /// `bt601`, `bt709` or `bt2020`.
    #[serde(deserialize_with = "matrix")]
    pub matrix: Matrix,
    /// Where the chroma samples lie.
    pub siting: Siting,
    /// Clockwise turn by which a player shows the picture, from the display matrix; the stored picture is not turned.
    pub rotation_deg: i32,
}

impl Default for Codec {
    fn default() -> Self {
        Self {
            name: CodecName::H264,
            crf: 18.0,
            preset: "medium".to_owned(),
            b_frames: None,
            gop: 60,
            pixel_format: PixelFormat::Yuv420p,
            full_range: false,
            matrix: Matrix::Bt709,
            siting: Siting::Left,
            rotation_deg: 0,
        }
    }
}

impl Codec {
    /// The layout of a picture of this size.
    pub fn layout(&self, width_px: u32, height_px: u32) -> Layout {
        let (shift_x, shift_y) = match self.pixel_format {
            PixelFormat::Yuv444p => (0, 0),
            PixelFormat::Yuv422p => (1, 0),
            PixelFormat::Yuv420p | PixelFormat::Yuv420p10le | PixelFormat::Nv12 => (1, 1),
        };
        let site = match self.siting {
            Siting::Left => [0.0, 0.5],
            Siting::Center => [0.5, 0.5],
            Siting::TopLeft => [0.0, 0.0],
        };
        Layout {
            width_px: width_px as usize,
            height_px: height_px as usize,
            bits: if self.pixel_format == PixelFormat::Yuv420p10le { 10 } else { 8 },
            low_bits: 0,
            chroma_shift_x: shift_x,
            chroma_shift_y: shift_y,
            chroma_site_px: [site[0] * f64::from(shift_x), site[1] * f64::from(shift_y)],
            full_range: self.full_range,
            matrix: self.matrix,
        }
    }

    fn validate(&self) -> Check {
        let (least, most) = match self.name {
            CodecName::H264 | CodecName::Hevc => (0.0, 51.0),
            CodecName::Mpeg4 | CodecName::Mjpeg => (1.0, 31.0),
        };
        within("render.codec.crf", self.crf, least, most)?;
        let encoder = matches!(self.name, CodecName::H264 | CodecName::Hevc);
        if encoder && !PRESETS.contains(&self.preset.as_str()) {
            return Err(format!("render.codec.preset = {}: must be one of {}", self.preset, PRESETS.join(", ")));
        }
        if self.gop == 0 {
            return Err("render.codec.gop = 0: must be 1 or more".to_owned());
        }
        if self.name == CodecName::Mjpeg && !self.full_range {
            return Err("render.codec.full_range = false: MJPEG is always full range; set it to true".to_owned());
        }
        if self.rotation_deg % 90 != 0 {
            return Err(format!("render.codec.rotation_deg = {}: must be a multiple of 90", self.rotation_deg));
        }
        Ok(())
    }
}

/// How a synthetic recording is made.
///
/// Pixels: the origin is the centre of the top left pixel, y runs down. Colours are gamma-coded; light is added up linearly and coded
/// with `gamma`. The Kapton recording of the project is these defaults, nearly.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Render {
    /// Picture width.
    pub width_px: u32,
    /// Picture height.
    pub height_px: u32,
    /// Nominal frames a second.
    pub fps: f64,
    /// Length of the recording.
    pub duration_s: f64,
    /// Time stamp of the first frame. The release is at stamp 0.
    pub start_s: f64,
    /// Seed of the noise and of the jitter.
    pub seed: u64,
    /// Pixels a metre in the plane of the swing.
    pub scale_px_per_m: f64,
    /// The hinge in the undistorted picture.
    pub hinge_px: [f64; 2],
    /// Diameter of a mark.
    pub mark_diameter_px: f64,
    /// Visible width of the strip, which is seen obliquely.
    pub strip_width_px: f64,
    /// Colour of the strip.
    pub strip_rgb: Rgb,
    /// Strength of the strip's sheen, 0 (flat) to 1.
    pub strip_sheen: f64,
    /// Change of the strip's brightness from its left edge to its right, as a share, −1 to 1. A slope under a mark pulls a careless
    /// centroid to its darker side.
    pub strip_slope: f64,
    /// Colour of the chamber's wall where it is brightest.
    pub background_rgb: Rgb,
    /// Fall of the light towards the corners, 0 to 1.
    pub vignette: f64,
    /// A stand that holds the hinge.
    pub stand: bool,
    /// A knob on it that resembles a mark.
    pub distractor: Option<Distractor>,
    /// Burnt-in text.
    pub captions: Vec<Caption>,
    /// What stands before the strip for a while.
    pub occlusions: Vec<Occlusion>,
    /// Exposure of a frame (of a row, with a rolling shutter), centred on its stamp.
    pub exposure_s: f64,
    /// Standard deviation of the lens's Gaussian blur. Lens and pixel together blur by 0.45 px at least.
    pub lens_blur_px: f64,
    /// Exponent of the signal: V = light^(1/gamma).
    pub gamma: f64,
    /// Sensor noise.
    pub noise: Noise,
    /// Radial distortion.
    pub lens: Option<Lens>,
    /// Roll of the camera: the scene turns anticlockwise about the hinge, adding to both angles.
    pub tilt_rad: f64,
    /// Rolling shutter: time from a row to the next below; the stamp is that of the middle row.
    pub row_time_s: f64,
    /// Standard deviation of the frames' instants about the nominal rate. The stamps stay true.
    pub jitter_s: f64,
    /// Frames, counted from 0 at the nominal rate, that are missing. The stamps stay true.
    pub dropped_frames: Vec<u64>,
    /// How the pictures are coded.
    pub codec: Codec,
}

impl Default for Render {
    fn default() -> Self {
        Self {
            width_px: 1280,
            height_px: 720,
            fps: 30.0,
            duration_s: 25.0,
            start_s: 0.0,
            seed: 1,
            scale_px_per_m: 2600.0,
            hinge_px: [640.0, 96.0],
            mark_diameter_px: 22.0,
            strip_width_px: 48.0,
            strip_rgb: Rgb([196, 132, 46]),
            strip_sheen: 0.5,
            strip_slope: 0.1,
            background_rgb: Rgb([58, 64, 74]),
            vignette: 0.85,
            stand: true,
            distractor: None,
            captions: Vec::new(),
            occlusions: Vec::new(),
            exposure_s: 0.002,
            lens_blur_px: 0.8,
            gamma: 2.2,
            noise: Noise::default(),
            lens: None,
            tilt_rad: 0.0,
            row_time_s: 0.0,
            jitter_s: 0.0,
            dropped_frames: Vec::new(),
            codec: Codec::default(),
        }
    }
}

impl Render {
    /// Frames at the nominal rate, dropped ones included.
    pub fn nominal_frames(&self) -> u64 {
        (self.duration_s * self.fps).round() as u64
    }

    /// Checks every value against its interval; the error names the key.
    ///
    /// # Errors
    /// A line that names the key, its value and what it must be.
    pub fn validate(&self) -> Check {
        for (key, side, even) in [
            ("render.width_px", self.width_px, self.codec.layout(16, 16).chroma_shift_x == 1),
            ("render.height_px", self.height_px, self.codec.layout(16, 16).chroma_shift_y == 1),
        ] {
            if !(16..=MAX_SIDE_PX).contains(&side) || (even && side % 2 == 1) {
                let parity = if even { "an even number " } else { "" };
                return Err(format!("{key} = {side}: must be {parity}from 16 to {MAX_SIDE_PX}"));
            }
        }
        within("render.fps", self.fps, 0.1, 10_000.0)?;
        within("render.duration_s", self.duration_s, 0.0, 86_400.0)?;
        if self.nominal_frames() == 0 {
            return Err(format!("render.duration_s = {}: not one frame at {} a second", self.duration_s, self.fps));
        }
        not_negative("render.start_s", self.start_s)?;
        within("render.scale_px_per_m", self.scale_px_per_m, 1e-3, 1e7)?;
        within("render.mark_diameter_px", self.mark_diameter_px, 1.0, 4096.0)?;
        within("render.strip_width_px", self.strip_width_px, 0.0, 4096.0)?;
        within("render.strip_sheen", self.strip_sheen, 0.0, 1.0)?;
        within("render.strip_slope", self.strip_slope, -1.0, 1.0)?;
        within("render.vignette", self.vignette, 0.0, 1.0)?;
        within("render.exposure_s", self.exposure_s, 0.0, 1.0 / self.fps)?;
        within("render.lens_blur_px", self.lens_blur_px, 0.0, 64.0)?;
        within("render.gamma", self.gamma, 1.0, 3.0)?;
        within("render.noise.read", self.noise.read, 0.0, 1.0)?;
        within("render.noise.shot", self.noise.shot, 0.0, 1.0)?;
        within("render.tilt_rad", self.tilt_rad, -3.2, 3.2)?;
        within("render.row_time_s", self.row_time_s, 0.0, 1.0 / self.fps / f64::from(self.height_px))?;
        within("render.jitter_s", self.jitter_s, 0.0, 0.2 / self.fps)?;
        if !self.hinge_px.iter().all(|p| p.abs() <= f64::from(MAX_SIDE_PX)) {
            return Err("render.hinge_px: must be two numbers of pixels near the picture".to_owned());
        }
        if self.dropped_frames.iter().filter(|f| **f < self.nominal_frames()).count() as u64 >= self.nominal_frames() {
            return Err("render.dropped_frames: leaves no frame".to_owned());
        }
        self.validate_things()?;
        self.codec.validate()
    }

    fn validate_things(&self) -> Check {
        if let Some(lens) = &self.lens {
            positive("render.lens.focal_px", lens.focal_px)?;
            // Beyond these the picture's corners fold over.
            within("render.lens.k1", lens.k1, -0.3, 1.0)?;
            within("render.lens.k2", lens.k2, -0.1, 1.0)?;
            let corner_px = f64::from(self.width_px).hypot(f64::from(self.height_px)) / 2.0;
            within("render.lens: picture corner over focal_px", corner_px / lens.focal_px, 0.0, 1.0)?;
        }
        if let Some(knob) = &self.distractor {
            within("render.distractor.diameter_px", knob.diameter_px, 1.0, 4096.0)?;
        }
        for caption in &self.captions {
            within("render.captions.height_px", caption.height_px, 1.0, 1024.0)?;
        }
        for occlusion in &self.occlusions {
            if !occlusion.rect_px.iter().all(|v| v.abs() <= f64::from(MAX_SIDE_PX)) {
                return Err("render.occlusions.rect_px: must be left, top, width, height in pixels".to_owned());
            }
            not_negative("render.occlusions.until_s - from_s", occlusion.until_s - occlusion.from_s)?;
        }
        Ok(())
    }
}

fn within(key: &str, value: f64, least: f64, most: f64) -> Check {
    if value >= least && value <= most { Ok(()) } else { Err(format!("{key} = {value}: must be {least} to {most}")) }
}

fn matrix<'de, D: serde::Deserializer<'de>>(deserializer: D) -> Result<Matrix, D::Error> {
    match String::deserialize(deserializer)?.as_str() {
        "bt601" => Ok(Matrix::Bt601),
        "bt709" => Ok(Matrix::Bt709),
        "bt2020" => Ok(Matrix::Bt2020),
        other => Err(serde::de::Error::custom(format!("unknown matrix `{other}`; use bt601, bt709 or bt2020"))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_is_what_the_command_promises() {
        let render = Render::default();
        assert_eq!(render.validate(), Ok(()));
        assert_eq!((render.width_px, render.height_px, render.fps), (1280, 720, 30.0));
        assert_eq!((render.mark_diameter_px, render.codec.crf, render.codec.preset.as_str()), (22.0, 18.0, "medium"));
    }

    #[test]
    fn values_outside_their_interval_are_named() {
        let odd = Render { width_px: 321, ..Render::default() };
        assert_eq!(odd.validate().unwrap_err(), "render.width_px = 321: must be an even number from 16 to 16384");
        let nan = Render { gamma: f64::NAN, ..Render::default() };
        assert!(nan.validate().unwrap_err().starts_with("render.gamma = NaN: must be 1 to 3"));
    }

    #[test]
    fn a_colour_is_six_digits() {
        assert_eq!(Rgb::try_from("#0a0B0c".to_owned()), Ok(Rgb([10, 11, 12])));
        assert!(Rgb::try_from("red".to_owned()).is_err());
    }
}
