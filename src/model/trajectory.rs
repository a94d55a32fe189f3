//! A motion, known at every instant.

use nalgebra::{DMatrix, DVector};

use super::ForwardModel;
use super::integrate::{Accuracy, Directions, Place, integrate};
use super::step::Step;
use crate::error::{Error, Result};

/// Angles and rates of all links, top to bottom.
#[derive(Debug, Clone, PartialEq)]
pub struct State {
    /// θ.
    pub theta_rad: Vec<f64>,
    /// θ̇.
    pub omega_rad_s: Vec<f64>,
    /// What laws keep in mind (the Bouc–Wen variable of each joint, where a stand is that yields); empty stands for zero.
    pub hidden: Vec<f64>,
}

impl State {
    /// At rest in a position.
    pub fn at_rest(theta_rad: &[f64]) -> Self {
        Self { theta_rad: theta_rad.to_vec(), omega_rad_s: vec![0.0; theta_rad.len()], hidden: Vec::new() }
    }

    /// Of the numbers in which a motion starts, see [`StartDirections`].
    pub fn begun(model: &ForwardModel, start: &[f64]) -> Self {
        StartDirections::of(model, start.len()).state(start)
    }

    /// At rest with these angles between marks.
    ///
    /// # Errors
    /// [`Error::Simulation`] when there is not one angle for each pair of marks.
    pub fn released(model: &ForwardModel, release_rad: &[f64]) -> Result<Self> {
        let links = model.chain().groups().len();
        if release_rad.len() != links {
            let detail = format!("{} angles for {links} links; give model.release_rad one a link", release_rad.len());
            return Err(Error::Simulation { detail });
        }
        let further = vec![0.0; model.free_pairs().len()];
        Ok(Self::begun(model, &[release_rad, &further, &vec![0.0; links], &further].concat()))
    }
}

/// What the numbers in which a motion starts are on the links and on the laws' own variables.
///
/// The first half of the numbers are angles, of [`ForwardModel::start`] the first shapes, then the coordinate of each law that begins anywhere
/// ([`ForwardModel::free_pairs`]); the second half are their rates. All other variables of laws are zero.
#[derive(Debug, Clone, PartialEq)]
pub struct StartDirections {
    /// ∂θ, n × numbers.
    pub theta: DMatrix<f64>,
    /// ∂rate, m × numbers.
    pub rate: DMatrix<f64>,
}

impl StartDirections {
    /// Of so many numbers, at least the angles between marks and their rates.
    pub fn of(model: &ForwardModel, numbers: usize) -> Self {
        let (n, half) = (model.chain().count(), numbers / 2);
        let mut pairs = model.free_pairs();
        // a start of the angles between marks alone leaves these at zero, too
        pairs.truncate(half.saturating_sub(model.chain().groups().len()));
        let shapes = half - pairs.len();
        let start = model.start();
        let (mut theta, mut rate) = (DMatrix::zeros(n, numbers), DMatrix::zeros(model.rates(), numbers));
        theta.columns_mut(0, shapes).copy_from(&start.columns(0, shapes));
        rate.view_mut((0, half), (n, shapes)).copy_from(&start.columns(0, shapes));
        for (k, row) in pairs.into_iter().enumerate() {
            rate[(row, shapes + k)] = 1.0;
            rate[(row + 1, half + shapes + k)] = 1.0;
        }
        Self { theta, rate }
    }

    /// Where a motion starts with these numbers.
    pub fn state(&self, start: &[f64]) -> State {
        let start = DVector::from_column_slice(start);
        let theta_rad = (&self.theta * &start).as_slice().to_vec();
        let mut omega_rad_s = (&self.rate * &start).as_slice().to_vec();
        let hidden = omega_rad_s.split_off(theta_rad.len());
        State { theta_rad, omega_rad_s, hidden }
    }
}

/// One instant of a motion with its derivatives.
#[derive(Debug, Clone)]
pub struct Instant {
    /// θ.
    pub theta_rad: Vec<f64>,
    /// ω, then the laws' own variables.
    pub rate: Vec<f64>,
    /// α.
    pub acceleration: Vec<f64>,
    /// ∂θ and ∂rate, a column each parameter and initial value.
    pub slopes: Option<(DMatrix<f64>, DMatrix<f64>)>,
}

/// A motion, known at every instant between its ends.
#[derive(Debug, Clone)]
pub struct Trajectory {
    steps: Vec<Step>,
    start: State,
    from_s: f64,
    until_s: f64,
}

impl Trajectory {
    /// Lets the model swing from `start` at `from_s` until `until_s`.
    ///
    /// # Errors
    /// [`Error::Simulation`] when the state does not match the links, or no step is short enough.
    pub fn swing(model: &ForwardModel, start: &State, from_s: f64, until_s: f64) -> Result<Self> {
        Self::with(model, start, (from_s, until_s), None, &Accuracy::default())
    }

    /// The same with derivatives, or to another accuracy.
    ///
    /// # Errors
    /// As [`Trajectory::swing`].
    pub fn with(
        model: &ForwardModel,
        start: &State,
        (from_s, until_s): (f64, f64),
        directions: Option<&Directions>,
        accuracy: &Accuracy,
    ) -> Result<Self> {
        let (n, m) = (model.chain().count(), model.rates());
        if start.theta_rad.len() != n || start.omega_rad_s.len() != n {
            let detail = format!("{} angles for {n} links; give model.release_rad one a link", start.theta_rad.len());
            return Err(Error::Simulation { detail });
        }
        let mut rate = start.omega_rad_s.clone();
        rate.extend(&start.hidden);
        rate.resize(m, 0.0);
        let place = Place { t_s: from_s, theta: start.theta_rad.clone(), rate };
        let mut steps = Vec::new();
        integrate(model, place, until_s, directions, accuracy, &mut |step| steps.push(step))?;
        Ok(Self { steps, start: start.clone(), from_s, until_s: until_s.max(from_s) })
    }

    /// The state at an instant; before the start and after the end it is the state there.
    pub fn at(&self, t_s: f64) -> State {
        let Some((step, tau)) = self.step_at(t_s) else { return self.start.clone() };
        let n = step.theta_rad.len();
        let mut omega_rad_s = step.rate(tau);
        let hidden = omega_rad_s.split_off(n);
        State { theta_rad: step.theta_rad(tau), omega_rad_s, hidden }
    }

    /// The instant with its accelerations and derivatives; `None` for a motion of no length.
    pub fn instant(&self, t_s: f64) -> Option<Instant> {
        let (step, tau) = self.step_at(t_s)?;
        Some(Instant {
            theta_rad: step.theta_rad(tau),
            rate: step.rate(tau),
            acceleration: step.acceleration(tau),
            slopes: step.slopes(tau),
        })
    }

    /// The first and the last instant.
    pub fn span_s(&self) -> (f64, f64) {
        (self.from_s, self.until_s)
    }

    /// The steps taken.
    pub fn steps(&self) -> &[Step] {
        &self.steps
    }

    /// The step that holds an instant, and τ in it; `None` for a motion of no length.
    pub fn step_at(&self, t_s: f64) -> Option<(&Step, f64)> {
        let t_s = t_s.clamp(self.from_s, self.until_s);
        let after = self.steps.partition_point(|s| s.from_s <= t_s);
        let step = self.steps.get(after.saturating_sub(1))?;
        let tau = if step.length_s > 0.0 { ((t_s - step.from_s) / step.length_s).min(1.0) } else { 0.0 };
        Some((step, tau))
    }
}
