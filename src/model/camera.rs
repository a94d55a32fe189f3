//! What a camera makes of the angles: its clock, its tilt, its pixels, from where it looks. And what an encoder does.

use super::Parameter;
use super::view::View;
use crate::experiment::{Effects, EncoderError};

/// A camera that is not perfect. The angle seen of link i at stamp t is
///
/// ```text
/// φᵢ(t) = (1 + angle_gain) v(θᵢ(T(t) + [i > 1] differential_lag)) + e(θᵢ) + camera_tilt + [i > 1] differential_zero
/// T(t)  = t₀ + (1 + time_base)(t − t₀) + [t ≥ t_d] dropped_frames
/// ```
///
/// v: how a camera sees an angle that looks askew, `camera_oblique` ([`View`]); v(θ) = θ of one that does not. e: of the encoder of a specimen of one link, `encoder_error`
/// ([`EncoderError`]).
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
    /// `camera_oblique`.
    pub view: View,
    /// `encoder_error`.
    pub encoder: Option<EncoderError>,
    /// `differential_lag`.
    pub lag_s: f64,
    /// `differential_zero`.
    pub zero_rad: f64,
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
            view: effects.camera_oblique.map_or(View::default(), |o| View { stretch: o.stretch, shear: o.shear }),
            encoder: effects.encoder_error,
            lag_s: effects.differential_lag.unwrap_or(0.0),
            zero_rad: effects.differential_zero.unwrap_or(0.0),
            origin_s,
        }
    }

    /// T of a stamp, for one link.
    pub fn true_time_s(&self, t_s: f64, link: usize) -> f64 {
        let dropped_s = if t_s >= self.dropped_at_s { self.dropped_s } else { 0.0 };
        let lag_s = if link > 0 { self.lag_s } else { 0.0 };
        self.origin_s + (1.0 + self.time_base) * (t_s - self.origin_s) + dropped_s + lag_s
    }

    /// ∂T with one of the clock's parameters, for one link; zero with any other parameter.
    pub fn true_time_slope(&self, parameter: Parameter, t_s: f64, link: usize) -> f64 {
        match parameter {
            Parameter::TimeBase => t_s - self.origin_s,
            Parameter::DroppedFrames if t_s >= self.dropped_at_s => 1.0,
            Parameter::DifferentialLag if link > 0 => 1.0,
            _ => 0.0,
        }
    }

    /// φ of θ of one link.
    pub fn seen_rad(&self, theta_rad: f64, link: usize) -> f64 {
        let zero_rad = if link > 0 { self.zero_rad } else { 0.0 };
        let in_place_rad = (1.0 + self.gain) * self.view.angle_rad(theta_rad);
        let of_encoder_rad = self.encoder.map_or(0.0, |error| error.of_rad(theta_rad));
        in_place_rad + of_encoder_rad + self.tilt_rad + zero_rad
    }

    /// ∂φ/∂θ.
    pub fn seen_slope(&self, theta_rad: f64) -> f64 {
        let of_encoder = self.encoder.map_or(0.0, |error| error.slope(theta_rad));
        (1.0 + self.gain) * self.view.slopes(theta_rad).angle + of_encoder
    }

    /// ∂φ with one of the camera's parameters, at stamp `t_s` of a link with angle θ and rate θ̇; zero with any other parameter.
    pub fn slope(&self, parameter: Parameter, t_s: f64, link: usize, theta_rad: f64, omega_rad_s: f64) -> f64 {
        match parameter {
            Parameter::CameraTilt => 1.0,
            Parameter::DifferentialZero if link > 0 => 1.0,
            Parameter::AngleGain => self.view.angle_rad(theta_rad),
            Parameter::ViewStretch => (1.0 + self.gain) * self.view.slopes(theta_rad).stretch,
            Parameter::ViewShear => (1.0 + self.gain) * self.view.slopes(theta_rad).shear,
            Parameter::Encoder(shape) => shape.at(theta_rad),
            Parameter::TimeBase | Parameter::DroppedFrames | Parameter::DifferentialLag => {
                self.seen_slope(theta_rad) * omega_rad_s * self.true_time_slope(parameter, t_s, link)
            }
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
            Parameter::ViewStretch => Some(self.view.stretch),
            Parameter::ViewShear => Some(self.view.shear),
            Parameter::Encoder(shape) => Some(self.encoder.map_or(0.0, |error| error.coefficient_rad(shape))),
            Parameter::DifferentialLag => Some(self.lag_s),
            Parameter::DifferentialZero => Some(self.zero_rad),
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
            Parameter::ViewStretch => self.view.stretch = value,
            Parameter::ViewShear => self.view.shear = value,
            Parameter::Encoder(shape) => *self.encoder.get_or_insert_default().coefficient_mut(shape) = value,
            Parameter::DifferentialLag => self.lag_s = value,
            Parameter::DifferentialZero => self.zero_rad = value,
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_parameter_has_the_slope_of_differences() {
        let camera = Camera {
            time_base: 0.01,
            dropped_s: 0.04,
            dropped_at_s: 1.0,
            tilt_rad: 0.02,
            gain: -0.03,
            view: View { stretch: 0.05, shear: -0.08 },
            encoder: Some(EncoderError {
                zero_rad: 0.003,
                sine_rad: 0.01,
                cosine_rad: -0.02,
                sine_2_rad: 0.03,
                cosine_2_rad: 0.005,
            }),
            lag_s: 0.004,
            zero_rad: 0.03,
            origin_s: 0.2,
        };
        let (t_s, link, step) = (2.0, 1, 1e-6);
        let theta = |true_s: f64| 1.3 * (2.0 * true_s).sin();
        let rate = |true_s: f64| 2.6 * (2.0 * true_s).cos();
        let seen = |camera: &Camera| camera.seen_rad(theta(camera.true_time_s(t_s, link)), link);
        let of_camera = Parameter::ALL.into_iter().filter(|parameter| camera.value(*parameter).is_some());
        let mut count = 0;
        for parameter in of_camera {
            let value = camera.value(parameter).unwrap();
            let with = |change: f64| {
                let mut changed = camera;
                changed.set(parameter, value + change);
                seen(&changed)
            };
            let true_s = camera.true_time_s(t_s, link);
            let slope = camera.slope(parameter, t_s, link, theta(true_s), rate(true_s));
            let difference = (with(step) - with(-step)) / (2.0 * step);
            assert!((slope - difference).abs() < 1e-7, "{parameter}: {slope} {difference}");
            count += 1;
        }
        assert_eq!(count, 13);
    }
}
