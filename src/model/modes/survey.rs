//! Everything `freeswing modes` tells of an experiment.

use serde::Serialize;

use super::{Linearised, Modes, RodMode, TwoRods, beam_frequencies_hz, limp_frequency_hz, rigid_frequency_hz};
use crate::error::Result;
use crate::experiment::{Effects, Experiment, Inertia, Model, Specimen};
use crate::model::strip::Strip;

/// Modes listed of a continuous strip.
const STRIP_MODES: usize = 4;

/// The normal modes of one experiment, by every model that applies to it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Survey {
    schema: &'static str,
    /// Name of the specimen.
    pub specimen: String,
    /// g.
    pub gravity_m_s2: f64,
    /// What no stiffness can go below.
    pub floor: Floor,
    /// The chain of links, with its springs and dampers.
    pub chain: ChainModes,
    /// Two rods in closed form, for a strip of two rods.
    pub two_rods: Option<RodForms>,
    /// The strip as a beam, where thickness and modulus are given.
    pub beam: Option<BeamModes>,
}

/// The lowest frequencies that are possible at this gravity.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Floor {
    /// First mode of the links without springs, dampers and air.
    pub links_hz: f64,
    /// The limp strip, mode by mode; none for general links.
    pub limp_strip_hz: Vec<f64>,
    /// The strip that does not bend; none for general links.
    pub rigid_strip_hz: Option<f64>,
}

/// The chain near its rest position.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ChainModes {
    /// θ₀, top to bottom.
    pub rest_rad: Vec<f64>,
    /// K of each joint as configured, where the strip bends only there.
    pub joint_stiffness_n_m_per_rad: Option<f64>,
    /// EI as configured, where the strip bends everywhere.
    pub bending_stiffness_n_m2: Option<f64>,
    /// C of each joint as configured.
    pub joint_damping_n_m_s_per_rad: f64,
    /// Vibrations and decays.
    #[serde(flatten)]
    pub modes: Modes,
    /// Effects that are switched on and have no linear part.
    pub not_linear: Vec<String>,
}

/// Eq. 33 and 34.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RodForms {
    /// Gravity alone, corrected; slow, fast.
    pub gravity_only: [RodMode; 2],
    /// Gravity alone, letter by letter; − root, + root.
    pub as_printed: [RodMode; 2],
    /// With the springs of the experiment.
    pub with_springs: [RodMode; 2],
}

/// The strip by finite elements.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BeamModes {
    /// EI.
    pub bending_stiffness_n_m2: f64,
    /// How far a clamp reaches.
    pub boundary_layer_m: f64,
    /// Hinged, with gravity.
    pub hinged_hz: Vec<f64>,
    /// Clamped, with gravity.
    pub clamped_hz: Vec<f64>,
    /// Clamped, without gravity.
    pub clamped_weightless_hz: Vec<f64>,
}

impl Survey {
    /// Computes all that applies.
    ///
    /// # Errors
    /// [`crate::Error::Simulation`] when the specimen cannot swing.
    pub fn of(experiment: &Experiment) -> Result<Self> {
        let linear = Linearised::of(experiment)?;
        let bending = experiment.model.effects.distributed_flexibility;
        Ok(Self {
            schema: "freeswing.modes/1",
            specimen: experiment.specimen.name.clone(),
            gravity_m_s2: experiment.rig.gravity_m_s2,
            floor: Floor::of(experiment)?,
            chain: ChainModes {
                modes: Modes::of(&linear)?,
                not_linear: linear.left_out(experiment)?,
                rest_rad: linear.rest_rad,
                joint_stiffness_n_m_per_rad: bending.is_none().then_some(experiment.model.k_eq_n_m_per_rad),
                bending_stiffness_n_m2: bending,
                joint_damping_n_m_s_per_rad: experiment.model.c_eq_n_m_s_per_rad,
            },
            two_rods: RodForms::of(experiment),
            beam: BeamModes::of(&experiment.specimen, experiment.rig.gravity_m_s2),
        })
    }
}

impl Floor {
    fn of(experiment: &Experiment) -> Result<Self> {
        let limp = Experiment {
            model: Model {
                k_eq_n_m_per_rad: 0.0,
                c_eq_n_m_s_per_rad: 0.0,
                effects: Effects::default(),
                ..experiment.model.clone()
            },
            ..experiment.clone()
        };
        let links = Modes::of(&Linearised::of(&limp)?)?;
        let (length_m, gravity_m_s2) = (experiment.specimen.length_m, experiment.rig.gravity_m_s2);
        let strip = experiment.specimen.links.is_empty();
        let modes = if strip { STRIP_MODES } else { 0 };
        Ok(Self {
            links_hz: links.modes.first().map_or(0.0, |m| m.frequency_hz),
            limp_strip_hz: (0..modes).map(|k| limp_frequency_hz(k, length_m, gravity_m_s2)).collect(),
            rigid_strip_hz: strip.then(|| rigid_frequency_hz(length_m, gravity_m_s2)),
        })
    }
}

impl RodForms {
    fn of(experiment: &Experiment) -> Option<Self> {
        let Specimen { link_lengths_m, links, inertia, mass_kg, .. } = &experiment.specimen;
        let &[upper_m, lower_m] = link_lengths_m.as_slice() else { return None };
        let bends_everywhere = experiment.model.effects.distributed_flexibility.is_some();
        if !links.is_empty() || *inertia == Inertia::Lumps || bends_everywhere {
            return None;
        }
        let per_length_kg_m = mass_kg / (upper_m + lower_m);
        let limp = TwoRods {
            mass_kg: [per_length_kg_m * upper_m, per_length_kg_m * lower_m],
            length_m: [upper_m, lower_m],
            gravity_m_s2: experiment.rig.gravity_m_s2,
            joint_stiffness_n_m_per_rad: 0.0,
            hinge_stiffness_n_m_per_rad: 0.0,
        };
        let sprung = TwoRods {
            joint_stiffness_n_m_per_rad: experiment.model.k_eq_n_m_per_rad,
            hinge_stiffness_n_m_per_rad: experiment.model.effects.hinge_stiffness.unwrap_or(0.0),
            ..limp
        };
        Some(Self { gravity_only: limp.modes(), as_printed: limp.as_printed(), with_springs: sprung.modes() })
    }
}

impl BeamModes {
    fn of(specimen: &Specimen, gravity_m_s2: f64) -> Option<Self> {
        if !specimen.links.is_empty() {
            return None;
        }
        let strip = Strip::of(specimen, gravity_m_s2)?;
        let weightless = Strip { gravity_m_s2: 0.0, ..strip };
        Some(Self {
            bending_stiffness_n_m2: strip.bending_stiffness_n_m2,
            boundary_layer_m: strip.boundary_layer_m(),
            hinged_hz: beam_frequencies_hz(&strip, STRIP_MODES),
            clamped_hz: beam_frequencies_hz(&strip.clamped(), STRIP_MODES),
            clamped_weightless_hz: beam_frequencies_hz(&weightless.clamped(), STRIP_MODES),
        })
    }
}
