//! An arm for tests, and how it swings.

use std::path::Path;

use crate::experiment::Experiment;
use crate::model::{ForwardModel, State, Trajectory};

/// A single arm with some effects, as lines of `[model.effects]`.
pub fn arm(effects: &str) -> Experiment {
    let text = format!(
        "[[specimen.links]]\nlength_m = 0.3\nmass_kg = 0.1\ncom_m = 0.2\ninertia_kg_m2 = 1e-3\n\
         [model]\nrelease_rad = [0.5]\n[model.effects]\n{effects}"
    );
    Experiment::parse(&text, Path::new("arm")).unwrap()
}

/// The stamps and the angles of its swing.
pub fn swing(arm: &Experiment, length_s: f64, rate_hz: f64) -> (Vec<f64>, Vec<f64>) {
    let model = ForwardModel::of(arm).unwrap();
    let swing = Trajectory::swing(&model, &State::released(&model, &[0.5]).unwrap(), 0.0, length_s).unwrap();
    let t_s: Vec<f64> = (0..(rate_hz * length_s) as usize).map(|row| row as f64 / rate_hz).collect();
    let theta_rad = t_s.iter().map(|t| swing.at(*t).theta_rad[0]).collect();
    (t_s, theta_rad)
}
