//! `[render]`: how a synthetic recording is made.

mod codec;
mod scene;

use serde::Deserialize;

pub use codec::{Codec, CodecName, PixelFormat, Siting};
pub use scene::{Caption, Distractor, Lens, Noise, Occlusion, Rgb};

use super::{not_negative, positive};
use crate::video::MAX_SIDE_PX;

type Check = Result<(), String>;

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
    /// Nominal frames per second.
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
    /// Roll of the camera: the scene turns anticlockwise about the hinge, adding to all angles.
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
        self.noise.validate()?;
        within("render.tilt_rad", self.tilt_rad, -3.2, 3.2)?;
        within("render.row_time_s", self.row_time_s, 0.0, 1.0 / self.fps / f64::from(self.height_px))?;
        within("render.jitter_s", self.jitter_s, 0.0, 0.2 / self.fps)?;
        if !self.hinge_px.iter().all(|p| p.abs() <= f64::from(MAX_SIDE_PX)) {
            return Err("render.hinge_px: must be two numbers of pixels near the picture".to_owned());
        }
        if self.dropped_frames.iter().filter(|f| **f < self.nominal_frames()).count() as u64 >= self.nominal_frames() {
            return Err("render.dropped_frames: leaves no frame".to_owned());
        }
        if let Some(lens) = &self.lens {
            let corner_px = f64::from(self.width_px).hypot(f64::from(self.height_px)) / 2.0;
            lens.validate(corner_px)?;
        }
        self.distractor.iter().try_for_each(Distractor::validate)?;
        self.captions.iter().try_for_each(Caption::validate)?;
        self.occlusions.iter().try_for_each(Occlusion::validate)?;
        self.codec.validate()
    }
}

fn within(key: &str, value: f64, least: f64, most: f64) -> Check {
    if value >= least && value <= most { Ok(()) } else { Err(format!("{key} = {value}: must be {least} to {most}")) }
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
}
