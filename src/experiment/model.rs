//! `[model]`: start values and settings of the forward model.

use serde::Deserialize;

use super::law::{self, Law};
use super::{finite, not_negative, positive};

/// Bouc–Wen hysteresis of the joint.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Hysteresis {
    /// Largest hysteretic torque.
    pub torque_n_m: f64,
    /// Angle at which it yields.
    pub yield_rad: f64,
}

/// Sinusoidal sideways motion of the pivot.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SupportMotion {
    /// Amplitude.
    pub amplitude_m: f64,
    /// Frequency.
    pub frequency_hz: f64,
    /// Phase at t = 0.
    #[serde(default)]
    pub phase_rad: f64,
}

/// A stand that yields under the pull of what hangs on it.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SupportFlexibility {
    /// How far a sideways force moves the pivot.
    pub compliance_m_per_n: f64,
    /// Frequency at which the stand swings with the specimen's mass hung on it.
    pub frequency_hz: f64,
    /// Its damping ratio (1).
    #[serde(default)]
    pub damping_ratio: f64,
}

/// A camera that looks at the plane of the swing askew: tan φ = (1 + s) sin θ / (cos θ + b sin θ).
#[derive(Debug, Clone, Copy, Default, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ObliqueView {
    /// s (1).
    pub stretch: f64,
    /// b (1).
    pub shear: f64,
}

/// An error of an encoder that comes again once and twice a turn: z + a₁ sin θ + b₁ cos θ + a₂ sin 2θ + b₂ cos 2θ.
#[derive(Debug, Clone, Copy, Default, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct EncoderError {
    /// z.
    pub zero_rad: f64,
    /// a₁.
    pub sine_rad: f64,
    /// b₁.
    pub cosine_rad: f64,
    /// a₂.
    pub sine_2_rad: f64,
    /// b₂.
    pub cosine_2_rad: f64,
}

/// The physics beyond springs, dampers and gravity, by identifier. Absent means off.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Effects {
    /// −c θ̇₁ (N·m·s/rad).
    pub hinge_viscous: Option<f64>,
    /// −τ sgn θ̇₁ (N·m).
    pub hinge_coulomb: Option<f64>,
    /// −k θ₁ (N·m/rad).
    pub hinge_stiffness: Option<f64>,
    /// k₃ Δ³ (N·m/rad³).
    pub joint_cubic_stiffness: Option<f64>,
    /// Loss independent of frequency.
    pub joint_hysteretic: Option<Hysteresis>,
    /// The joint's spring rests at this angle (rad).
    pub rest_curl: Option<f64>,
    /// Force per length −c v_n (N·s/m²).
    pub air_linear: Option<f64>,
    /// Force per length −c |v_n| v_n (kg/m²).
    pub air_quadratic: Option<f64>,
    /// Inertia per length across the strip (kg/m).
    pub added_mass: Option<f64>,
    /// Steady sideways acceleration (m/s²).
    pub side_force: Option<f64>,
    /// Sideways motion of the pivot.
    pub support_motion: Option<SupportMotion>,
    /// A stand that yields.
    pub support_flexibility: Option<SupportFlexibility>,
    /// Bending stiffness EI (N·m²) of a chain of many links.
    pub distributed_flexibility: Option<f64>,
    /// True time = (1+ε) × stated time (1).
    pub time_base: Option<f64>,
    /// Frames missing at one instant (s).
    pub dropped_frames: Option<f64>,
    /// Common offset of all angles (rad).
    pub camera_tilt: Option<f64>,
    /// Common gain of all angles (1).
    pub angle_gain: Option<f64>,
    /// A camera that looks askew.
    pub camera_oblique: Option<ObliqueView>,
    /// An encoder off its axis, of a specimen of one link.
    pub encoder_error: Option<EncoderError>,
    /// θ₂ sampled later than θ₁ (s).
    pub differential_lag: Option<f64>,
    /// Offset of θ₂ over that of θ₁ (rad).
    pub differential_zero: Option<f64>,
}

/// Start values and settings of the forward model.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Model {
    /// Stiffness of the joint.
    pub k_eq_n_m_per_rad: f64,
    /// Damping of the joint.
    pub c_eq_n_m_s_per_rad: f64,
    /// Whether the file states that damping. Of one link, which has no joint, it stands for the hinge's, which a base model has or has not.
    #[serde(skip)]
    pub states_damping: bool,
    /// Angles at release, at rest.
    pub release_rad: Vec<f64>,
    /// Rods between two marks, where the strip bends everywhere (`distributed_flexibility`).
    pub pieces: usize,
    /// Whether the file states that number.
    #[serde(skip)]
    pub states_pieces: bool,
    /// Physics beyond the base model.
    pub effects: Effects,
    /// Laws stated by a formula.
    pub law: Vec<Law>,
}

impl Default for Model {
    fn default() -> Self {
        Self {
            k_eq_n_m_per_rad: 2.0e-4,
            c_eq_n_m_s_per_rad: 2.0e-6,
            states_damping: false,
            release_rad: vec![0.5, 0.6],
            pieces: 8,
            states_pieces: false,
            effects: Effects::default(),
            law: Vec::new(),
        }
    }
}

impl Model {
    pub(super) fn validate(&self) -> Result<(), String> {
        not_negative("model.k_eq_n_m_per_rad", self.k_eq_n_m_per_rad)?;
        not_negative("model.c_eq_n_m_s_per_rad", self.c_eq_n_m_s_per_rad)?;
        if self.release_rad.is_empty() || self.release_rad.iter().any(|a| !a.is_finite()) {
            return Err("model.release_rad: needs one finite angle a link".to_owned());
        }
        if !(1..=20).contains(&self.pieces) {
            return Err(format!("model.pieces = {}: must be from 1 to 20", self.pieces));
        }
        law::validate(&self.law)?;
        self.effects.validate()
    }
}

impl Effects {
    /// Losses and inertia from zero upwards, everything else finite.
    fn validate(&self) -> Result<(), String> {
        let checked = |id: &str, value: Option<f64>, check: fn(&str, f64) -> Result<(), String>| {
            value.map_or(Ok(()), |value| check(&format!("model.effects.{id}"), value))
        };
        for (id, value) in [
            ("hinge_viscous", self.hinge_viscous),
            ("hinge_coulomb", self.hinge_coulomb),
            ("hinge_stiffness", self.hinge_stiffness),
            ("air_linear", self.air_linear),
            ("air_quadratic", self.air_quadratic),
            ("added_mass", self.added_mass),
            ("joint_hysteretic.torque_n_m", self.joint_hysteretic.map(|h| h.torque_n_m)),
            ("support_flexibility.compliance_m_per_n", self.support_flexibility.map(|s| s.compliance_m_per_n)),
            ("support_flexibility.damping_ratio", self.support_flexibility.map(|s| s.damping_ratio)),
        ] {
            checked(id, value, not_negative)?;
        }
        for (id, value) in [
            ("joint_hysteretic.yield_rad", self.joint_hysteretic.map(|h| h.yield_rad)),
            ("support_motion.frequency_hz", self.support_motion.map(|s| s.frequency_hz)),
            ("support_flexibility.frequency_hz", self.support_flexibility.map(|s| s.frequency_hz)),
            ("distributed_flexibility", self.distributed_flexibility),
            // of a plane that is seen from its edge or from behind nothing is told
            ("camera_oblique: 1 + stretch", self.camera_oblique.map(|view| 1.0 + view.stretch)),
            // what it reads has to grow with the angle
            ("encoder_error: 1 - its steepest slope", self.encoder_error.map(|error| 1.0 - error.steepest())),
        ] {
            checked(id, value, positive)?;
        }
        for (id, value) in [
            ("joint_cubic_stiffness", self.joint_cubic_stiffness),
            ("rest_curl", self.rest_curl),
            ("side_force", self.side_force),
            ("support_motion.amplitude_m", self.support_motion.map(|s| s.amplitude_m)),
            ("time_base", self.time_base),
            ("dropped_frames", self.dropped_frames),
            ("camera_tilt", self.camera_tilt),
            ("angle_gain", self.angle_gain),
            ("camera_oblique.shear", self.camera_oblique.map(|view| view.shear)),
            ("differential_lag", self.differential_lag),
            ("differential_zero", self.differential_zero),
        ] {
            checked(id, value, finite)?;
        }
        Ok(())
    }
}
