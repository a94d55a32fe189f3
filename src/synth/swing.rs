//! The model's motion, and where the camera sees the marks.

use std::f64::consts::FRAC_PI_2;

use crate::error::Result;
use crate::experiment::Experiment;
use crate::model::observe::chord_angles_rad;
use crate::model::{Camera, ForwardModel, State, Trajectory};

/// A swing as the camera sees it, in the undistorted picture.
///
/// The camera effects of `[model.effects]` enter here, see [`Camera`]; `render.tilt_rad` adds to the tilt. `dropped_frames` of
/// `[model.effects]` are missing without a trace in the stamps: from the middle of the recording on, the motion is that much further than the
/// stamps say. (Those of `[render]` leave a gap in the stamps.)
#[derive(Debug)]
pub struct Swing {
    model: ForwardModel,
    trajectory: Trajectory,
    lengths_m: Vec<f64>,
    hinge_px: [f64; 2],
    scale_px_per_m: f64,
    mirrored: bool,
    camera: Camera,
}

impl Swing {
    /// Simulates the experiment's swing over its recording. It is released at stamp 0, or at the first stamp where that is later.
    ///
    /// # Errors
    /// [`crate::Error::Simulation`].
    pub fn of(experiment: &Experiment) -> Result<Self> {
        let model = ForwardModel::of(experiment)?;
        let (render, effects) = (&experiment.render, &experiment.model.effects);
        let mut camera = Camera::of(effects, 0.0, render.start_s + 0.5 * render.duration_s);
        camera.tilt_rad += render.tilt_rad;
        // Jitter, exposure and rolling shutter together reach less than two frames beyond the last stamp.
        let last_stamp_s = render.start_s + render.duration_s + 2.0 / render.fps;
        let until_s = (0..2).map(|link| camera.true_time_s(last_stamp_s, link)).fold(0.0, f64::max);
        let release = State::released(&model, &experiment.model.release_rad)?;
        let trajectory = Trajectory::swing(&model, &release, 0.0, until_s)?;
        Ok(Self {
            lengths_m: experiment.specimen.lengths_m(),
            model,
            trajectory,
            hinge_px: experiment.rig.pivot_px.unwrap_or(render.hinge_px),
            scale_px_per_m: render.scale_px_per_m,
            mirrored: experiment.rig.mirrored,
            camera,
        })
    }

    /// φ at a stamp, top to bottom: what a perfect measurement reads.
    pub fn angles_rad(&self, t_s: f64) -> Vec<f64> {
        self.true_angles_rad(t_s)
            .into_iter()
            .enumerate()
            .map(|(link, theta)| self.camera.seen_rad(theta, link))
            .collect()
    }

    /// θ at the instants at which the camera saw it.
    fn true_angles_rad(&self, t_s: f64) -> Vec<f64> {
        let chords = |t_s: f64| chord_angles_rad(self.model.chain(), &self.trajectory.at(t_s).theta_rad);
        let times = |link: usize| self.camera.true_time_s(t_s, link);
        let upper = chords(times(0));
        let lower = if self.camera.lag_s == 0.0 { None } else { Some(chords(times(1))) };
        let theta = |i: usize| match &lower {
            Some(angles) if i > 0 => angles[i],
            _ => upper[i],
        };
        (0..self.lengths_m.len()).map(theta).collect()
    }

    /// The hinge, the joints and the tip at a stamp, in the undistorted picture.
    pub fn nodes_px(&self, t_s: f64) -> Vec<[f64; 2]> {
        let pivot_px = self.scale_px_per_m * self.model.pivot_m(self.camera.true_time_s(t_s, 0));
        let side = if self.mirrored { -1.0 } else { 1.0 };
        let view = self.camera.view;
        let beside = |node: [f64; 2], length_px: f64, angle_rad: f64| {
            [node[0] + side * length_px * angle_rad.sin(), node[1] + length_px * angle_rad.cos()]
        };
        // the pivot moves level, whatever the gain of the angles
        let level_rad = view.angle_rad(FRAC_PI_2) + self.camera.tilt_rad;
        let mut node = beside(self.hinge_px, pivot_px * view.length(FRAC_PI_2), level_rad);
        let mut nodes = vec![node];
        for (link, (length_m, theta_rad)) in self.lengths_m.iter().zip(self.true_angles_rad(t_s)).enumerate() {
            let length_px = length_m * self.scale_px_per_m * view.length(theta_rad);
            node = beside(node, length_px, self.camera.seen_rad(theta_rad, link));
            nodes.push(node);
        }
        nodes
    }

    /// Roll of the picture: anticlockwise, or clockwise in a mirror.
    pub fn roll_rad(&self) -> f64 {
        if self.mirrored { -self.camera.tilt_rad } else { self.camera.tilt_rad }
    }

    /// The hinge at rest, in the undistorted picture.
    pub fn hinge_px(&self) -> [f64; 2] {
        self.hinge_px
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::experiment::ObliqueView;

    fn short() -> Experiment {
        let mut experiment = Experiment::default();
        experiment.render.duration_s = 0.5;
        experiment
    }

    #[test]
    fn the_marks_hang_where_the_angles_say() {
        let swing = Swing::of(&short()).unwrap();
        let nodes = swing.nodes_px(0.0);
        assert_eq!(nodes[0], [640.0, 96.0]);
        assert!((nodes[1][0] - (640.0 + 260.0 * 0.5f64.sin())).abs() < 1e-9);
        assert!((nodes[2][1] - (96.0 + 260.0 * (0.5f64.cos() + 0.6f64.cos()))).abs() < 1e-9);
    }

    #[test]
    fn a_mirror_swaps_left_and_right() {
        let mut experiment = short();
        let plain = Swing::of(&experiment).unwrap().nodes_px(0.2);
        experiment.rig.mirrored = true;
        let mirrored = Swing::of(&experiment).unwrap().nodes_px(0.2);
        for (p, m) in plain.iter().zip(&mirrored) {
            assert!((p[0] + m[0] - 1280.0).abs() < 1e-9 && p[1] == m[1]);
        }
    }

    #[test]
    fn a_camera_that_looks_askew_maps_the_whole_plane() {
        let mut experiment = short();
        let plain = Swing::of(&experiment).unwrap().nodes_px(0.2);
        experiment.model.effects.camera_oblique = Some(ObliqueView { stretch: -0.05, shear: 0.1 });
        let askew = Swing::of(&experiment).unwrap().nodes_px(0.2);
        for (p, a) in plain.iter().zip(&askew) {
            let [x, y] = [p[0] - 640.0, p[1] - 96.0];
            assert!((a[0] - 640.0 - 0.95 * x).abs() < 1e-9 && (a[1] - 96.0 - (y + 0.1 * x)).abs() < 1e-9, "{a:?}");
        }
    }

    #[test]
    fn camera_effects_change_what_is_seen() {
        let mut experiment = short();
        let plain = Swing::of(&experiment).unwrap();
        let effects = &mut experiment.model.effects;
        (effects.camera_tilt, effects.angle_gain, effects.time_base) = (Some(0.01), Some(0.02), Some(0.1));
        (effects.differential_lag, effects.differential_zero) = (Some(0.003), Some(-0.02));
        let seen = Swing::of(&experiment).unwrap().angles_rad(0.2);
        assert!((seen[0] - (1.02 * plain.angles_rad(0.22)[0] + 0.01)).abs() < 1e-8);
        assert!((seen[1] - (1.02 * plain.angles_rad(0.223)[1] + 0.01 - 0.02)).abs() < 1e-8);
    }
}
