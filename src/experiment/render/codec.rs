//! `[render.codec]`: how the pictures are coded.

use serde::Deserialize;

use super::{Check, within};
use crate::video::{Layout, Matrix};

/// The presets of x264 and x265.
const PRESETS: [&str; 10] =
    ["ultrafast", "superfast", "veryfast", "faster", "fast", "medium", "slow", "slower", "veryslow", "placebo"];

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
    /// Bits a second that H.264 stays below over a few seconds, whatever the rate factor asks for.
    #[serde(skip)]
    pub most_bits_per_s: Option<u64>,
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
            most_bits_per_s: None,
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

    /// Checks every value against its interval.
    pub(super) fn validate(&self) -> Check {
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

fn matrix<'de, D: serde::Deserializer<'de>>(deserializer: D) -> Result<Matrix, D::Error> {
    match String::deserialize(deserializer)?.as_str() {
        "bt601" => Ok(Matrix::Bt601),
        "bt709" => Ok(Matrix::Bt709),
        "bt2020" => Ok(Matrix::Bt2020),
        other => Err(serde::de::Error::custom(format!("unknown matrix `{other}`; use bt601, bt709 or bt2020"))),
    }
}
