//! What a camera makes of the angles: its clock, its tilt, its pixels.

use super::Parameter;
use crate::experiment::Effects;

/// A camera that is not perfect. The angle seen of link i at stamp t is
///
/// ```text
/// φᵢ(t) = (1 + angle_gain) θᵢ(T(t) + [i > 1] differential_lag) + camera_tilt
/// T(t)  = t₀ + (1 + time_base)(t − t₀) + [t ≥ t_d] dropped_frames
/// ```
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Camera {
    /// ε of `time_base`.
    pub time_base: f64,
    /// `dropped_frames`.
    pub dropped_s: f64,
    /// t_d: from this stamp on they are missing.
    pub dropped_at_s: f64,
    /// `camera_tilt`.
    pub tilt_rad: f64,
    /// `angle_gain`.
    pub gain: f64,
    /// `differential_lag`.
    pub lag_s: f64,
    /// t₀: here the true time is the stamp.
    pub origin_s: f64,
}

impl Camera {
    /// The camera of `[model.effects]`, whose frames are missing from `dropped_at_s` on.
    pub fn of(effects: &Effects, origin_s: f64, dropped_at_s: f64) -> Self {
        Self {
            time_base: effects.time_base.unwrap_or(0.0),
            dropped_s: effects.dropped_frames.unwrap_or(0.0),
            dropped_at_s,
            tilt_rad: effects.camera_tilt.unwrap_or(0.0),
            gain: effects.angle_gain.unwrap_or(0.0),
            lag_s: effects.differential_lag.unwrap_or(0.0),
            origin_s,
        }
    }

    /// T of a stamp, for one link.
    pub fn true_time_s(&self, t_s: f64, link: usize) -> f64 {
        let dropped_s = if t_s >= self.dropped_at_s { self.dropped_s } else { 0.0 };
        let lag_s = if link > 0 { self.lag_s } else { 0.0 };
        self.origin_s + (1.0 + self.time_base) * (t_s - self.origin_s) + dropped_s + lag_s
    }

    /// φ of θ.
    pub fn seen_rad(&self, theta_rad: f64) -> f64 {
        (1.0 + self.gain) * theta_rad + self.tilt_rad
    }

    /// ∂φ with one of the camera's parameters, at stamp `t_s` of a link with angle θ and rate θ̇; zero with any other parameter.
    pub fn slope(&self, parameter: Parameter, t_s: f64, link: usize, theta_rad: f64, omega_rad_s: f64) -> f64 {
        let rate = (1.0 + self.gain) * omega_rad_s;
        match parameter {
            Parameter::TimeBase => rate * (t_s - self.origin_s),
            Parameter::DroppedFrames if t_s >= self.dropped_at_s => rate,
            Parameter::DifferentialLag if link > 0 => rate,
            Parameter::CameraTilt => 1.0,
            Parameter::AngleGain => theta_rad,
            _ => 0.0,
        }
    }

    /// The value of one of the camera's parameters.
    pub fn value(&self, parameter: Parameter) -> Option<f64> {
        match parameter {
            Parameter::TimeBase => Some(self.time_base),
            Parameter::DroppedFrames => Some(self.dropped_s),
            Parameter::CameraTilt => Some(self.tilt_rad),
            Parameter::AngleGain => Some(self.gain),
            Parameter::DifferentialLag => Some(self.lag_s),
            _ => None,
        }
    }

    /// Sets one of the camera's parameters; others are left alone.
    pub fn set(&mut self, parameter: Parameter, value: f64) {
        match parameter {
            Parameter::TimeBase => self.time_base = value,
            Parameter::DroppedFrames => self.dropped_s = value,
            Parameter::CameraTilt => self.tilt_rad = value,
            Parameter::AngleGain => self.gain = value,
            Parameter::DifferentialLag => self.lag_s = value,
            _ => {}
        }
    }
}
