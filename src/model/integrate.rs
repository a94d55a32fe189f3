//! The motion in time, by the explicit Runge–Kutta method of Dormand and Prince, order 5(4), with dense output.

use nalgebra::DVector;
use ode_solvers::continuous_output_model::ContinuousOutputModel;
use ode_solvers::dop_shared::IntegrationError;
use ode_solvers::{Dopri5, OutputType, System};

use super::forward::ForwardModel;
use crate::error::{Error, Result};

/// Error allowed in a step, relative to the state.
const RELATIVE_TOLERANCE: f64 = 1e-10;
/// Error allowed in a step, in rad and rad/s.
const ABSOLUTE_TOLERANCE: f64 = 1e-12;
/// Longest step: a tenth of a second cannot leap over a swing released from rest.
const LONGEST_STEP_S: f64 = 0.1;
/// Most steps in one motion. A minute of an ordinary strip takes about 40 000; a stiff one would take millions.
const MOST_STEPS: u32 = 400_000;

/// Angles and rates of all links, top to bottom.
#[derive(Debug, Clone, PartialEq)]
pub struct State {
    /// θ.
    pub theta_rad: Vec<f64>,
    /// θ̇.
    pub omega_rad_s: Vec<f64>,
}

impl State {
    /// At rest in a position.
    pub fn at_rest(theta_rad: &[f64]) -> Self {
        Self { theta_rad: theta_rad.to_vec(), omega_rad_s: vec![0.0; theta_rad.len()] }
    }

    fn from_vector(y: &DVector<f64>) -> Self {
        let (theta, omega) = y.as_slice().split_at(y.len() / 2);
        Self { theta_rad: theta.to_vec(), omega_rad_s: omega.to_vec() }
    }
}

/// A motion, known at every instant between its ends.
#[derive(Debug, Clone)]
pub struct Trajectory {
    output: ContinuousOutputModel<f64, DVector<f64>>,
    start: State,
    from_s: f64,
    until_s: f64,
}

impl Trajectory {
    /// Lets the model swing from `start` at `from_s` until `until_s`.
    ///
    /// # Errors
    /// [`Error::Simulation`] when the state does not match the links, or the motion is too stiff for an explicit method: it is refused
    /// after a fixed number of steps instead of crawling.
    pub fn swing(model: &ForwardModel, start: &State, from_s: f64, until_s: f64) -> Result<Self> {
        Self::swing_within(MOST_STEPS, model, start, from_s, until_s)
    }

    fn swing_within(most_steps: u32, model: &ForwardModel, start: &State, from_s: f64, until_s: f64) -> Result<Self> {
        let n = model.chain().count();
        if start.theta_rad.len() != n || start.omega_rad_s.len() != n {
            let detail = format!("{} angles for {n} links; give model.release_rad one a link", start.theta_rad.len());
            return Err(Error::Simulation { detail });
        }
        let mut trajectory =
            Self { output: ContinuousOutputModel::new(), start: start.clone(), from_s, until_s: until_s.max(from_s) };
        if until_s > from_s {
            let y = DVector::from_iterator(2 * n, start.theta_rad.iter().chain(&start.omega_rad_s).copied());
            let mut solver = Dopri5::from_param(
                Equations(model),
                from_s,
                until_s,
                0.0,
                y,
                RELATIVE_TOLERANCE,
                ABSOLUTE_TOLERANCE,
                0.9,
                0.04,
                0.2,
                10.0,
                LONGEST_STEP_S,
                0.0,
                most_steps,
                u32::MAX,
                OutputType::Continuous,
            );
            solver.integrate_with_continuous_output_model(&mut trajectory.output).map_err(refusal)?;
        }
        Ok(trajectory)
    }

    /// The state at an instant; before the start and after the end it is the state there.
    pub fn at(&self, t_s: f64) -> State {
        let t_s = t_s.clamp(self.from_s, self.until_s);
        // The last breakpoint may lie a rounding error before the end.
        let inside = if self.until_s > self.from_s { t_s.min(self.output.bounds().1) } else { t_s };
        self.output.evaluate(inside).map_or_else(|| self.start.clone(), |y| State::from_vector(&y))
    }

    /// The first and the last instant.
    pub fn span_s(&self) -> (f64, f64) {
        (self.from_s, self.until_s)
    }
}

/// y = (θ, θ̇), y′ = (θ̇, θ̈).
struct Equations<'a>(&'a ForwardModel);

impl System<f64, DVector<f64>> for Equations<'_> {
    fn system(&self, t_s: f64, y: &DVector<f64>, dy: &mut DVector<f64>) {
        let n = y.len() / 2;
        let (theta, omega) = y.as_slice().split_at(n);
        dy.rows_mut(0, n).copy_from_slice(omega);
        match self.0.acceleration(&self.0.motion(t_s, theta, omega)) {
            Ok(alpha) => dy.rows_mut(n, n).copy_from(&alpha),
            // Not-a-number makes the solver shorten its step and, at last, give up.
            Err(_) => dy.rows_mut(n, n).fill(f64::NAN),
        }
    }
}

fn refusal(error: IntegrationError) -> Error {
    let (t_s, what) = match error {
        IntegrationError::MaxNumStepReached { x, n_step } => (x, format!("more than {} steps", n_step - 1)),
        IntegrationError::StepSizeUnderflow { x } => (x, "steps without length".to_owned()),
        IntegrationError::StiffnessDetected { x } => (x, "ever shorter steps".to_owned()),
    };
    Error::Simulation {
        detail: format!(
            "it takes {what} up to t = {t_s:.4} s; lower model.k_eq_n_m_per_rad, model.c_eq_n_m_s_per_rad or the largest effect"
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::experiment::{Effects, Experiment, SupportMotion};

    fn experiment(k: f64, c: f64, effects: Effects) -> Experiment {
        let mut experiment = Experiment::default();
        experiment.model.k_eq_n_m_per_rad = k;
        experiment.model.c_eq_n_m_s_per_rad = c;
        experiment.model.effects = effects;
        experiment
    }

    fn energies_j(experiment: &Experiment, release: &[f64], until_s: f64) -> Vec<f64> {
        let model = ForwardModel::of(experiment).unwrap();
        let swing = Trajectory::swing(&model, &State::at_rest(release), 0.0, until_s).unwrap();
        (0..=400)
            .map(|i| {
                let t_s = until_s * f64::from(i) / 400.0;
                let state = swing.at(t_s);
                model.energy_j(&model.motion(t_s, &state.theta_rad, &state.omega_rad_s))
            })
            .collect()
    }

    #[test]
    fn energy_is_conserved_without_losses() {
        let stored = Effects {
            hinge_stiffness: Some(1e-5),
            joint_cubic_stiffness: Some(1e-4),
            rest_curl: Some(0.1),
            added_mass: Some(3e-4),
            side_force: Some(0.4),
            ..Effects::default()
        };
        for (effects, release) in [(Effects::default(), [0.9, -0.6]), (stored, [0.5, 0.8])] {
            let energies = energies_j(&experiment(2e-4, 0.0, effects), &release, 5.0);
            let worst = energies.iter().map(|e| (e / energies[0] - 1.0).abs()).fold(0.0, f64::max);
            assert!(worst < 1e-8, "{worst}");
        }
    }

    #[test]
    fn energy_never_rises_where_every_effect_dissipates() {
        let losses = Effects {
            hinge_viscous: Some(1e-7),
            hinge_coulomb: Some(2e-7),
            air_linear: Some(1e-4),
            air_quadratic: Some(2e-3),
            ..Effects::default()
        };
        let energies = energies_j(&experiment(2e-4, 1e-7, losses), &[0.5, 0.7], 5.0);
        assert!(energies.windows(2).all(|e| e[1] <= e[0] * (1.0 + 1e-10)));
        assert!(energies[400] < 0.9 * energies[0]);
    }

    #[test]
    fn a_heavy_dry_hinge_stops_the_rod_off_the_vertical() {
        let mut dry = experiment(0.0, 0.0, Effects { hinge_coulomb: Some(2e-4), ..Effects::default() });
        dry.specimen.link_lengths_m = vec![0.2];
        let model = ForwardModel::of(&dry).unwrap();
        let swing = Trajectory::swing(&model, &State::at_rest(&[0.7]), 0.0, 3.0).unwrap();
        let stopped = swing.at(3.0);
        assert!(stopped.omega_rad_s[0].abs() < 2e-3 && stopped.theta_rad[0].abs() > 0.1, "{stopped:?}");
    }

    #[test]
    fn a_pivot_that_moves_slowly_carries_the_chain_with_it() {
        let slow = SupportMotion { amplitude_m: 0.01, frequency_hz: 0.05, phase_rad: 0.0 };
        let moved = experiment(2e-4, 0.0, Effects { support_motion: Some(slow), ..Effects::default() });
        let model = ForwardModel::of(&moved).unwrap();
        let swing = Trajectory::swing(&model, &State::at_rest(&[0.0, 0.0]), 0.0, 10.0).unwrap();
        // Sudden start of the pivot at 3 mm/s: the chain rings by v/√(gL) at most.
        assert!((0..100).all(|i| swing.at(0.1 * f64::from(i)).theta_rad[0].abs() < 0.01));
    }

    #[test]
    fn a_motion_too_stiff_is_refused_with_its_remedy() {
        let model = ForwardModel::of(&experiment(2e-4, 1.0, Effects::default())).unwrap();
        let start = State::at_rest(&[0.5, 0.6]);
        let error = Trajectory::swing_within(5_000, &model, &start, 0.0, 60.0).unwrap_err().to_string();
        assert!(error.contains("more than 5000 steps") && error.contains("lower model.k_eq_n_m_per_rad"), "{error}");
    }

    #[test]
    fn the_wrong_number_of_angles_is_refused() {
        let model = ForwardModel::of(&Experiment::default()).unwrap();
        let error = Trajectory::swing(&model, &State::at_rest(&[0.5]), 0.0, 1.0).unwrap_err().to_string();
        assert!(error.contains("1 angles for 2 links"), "{error}");
    }
}
