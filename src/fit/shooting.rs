//! Multiple shooting: the recording in short stretches, each with a start of its own, drawn together into one motion.
//!
//! From the start values of a file a motion of a minute soon swings out of step with the recording, and its least squares have many false
//! minima. A stretch of a swing or two cannot: its own start comes from the recording, and the parameters from all stretches at once. What is
//! left at the seams (the defects) is then made to vanish step by step.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::descent::{Block, Descent};
use super::noise::least_noise_rad;
use super::predict::{Request, predict};
use super::whitening::RecordNoise;
use super::{Problem, Record};
use crate::error::Result;
use crate::model::Camera;
use crate::statistics::median;

/// A start is read off values this near, in radians of the model's pace: wide enough to even out the noise, short enough for a cubic to follow the second mode.
pub const STATE_WINDOW_RAD: f64 = 0.35;
/// Standard deviations of the seams (in units of the noise), from loose to tight.
const DEFECT_SDS: [f64; 2] = [100.0, 5.0];
/// Steps of the descent for each.
const STEPS_EACH: usize = 12;
/// Length of a stretch, in periods of the model's pace.
const PERIODS: f64 = 1.5;
/// Fewest values a stretch holds for each number in its start.
const VALUES_EACH: usize = 5;

/// A stretch of a recording.
struct Stretch {
    record: usize,
    rows: Range<usize>,
    /// Where the next one begins; the last row of the recording for the last.
    until_s: f64,
    last: bool,
}

impl Stretch {
    fn request<'a>(
        &'a self,
        problem: &'a Problem<'_>,
        camera: &'a Camera,
        start: &'a [f64],
        slopes: bool,
    ) -> Request<'a> {
        Request {
            record: &problem.records[self.record],
            rows: &self.rows,
            start,
            camera,
            parameters: &problem.free,
            until_s: self.until_s,
            accuracy: &problem.accuracy,
            slopes,
        }
    }
}

/// Where multiple shooting ends.
#[derive(Debug, Clone)]
pub struct ShootingResult {
    /// The parameters, then each recording's start.
    pub x: Vec<f64>,
    /// The noise by which it was found.
    pub noise: Vec<RecordNoise>,
    /// What stretches with starts of their own leave, over the noise: (recording, link, residual) in order of time.
    pub residuals: Vec<(usize, usize, f64)>,
}

/// Start values for a fit of whole recordings; and the noise of every angle on the way.
///
/// # Errors
/// [`crate::Error::Simulation`] where the specimen cannot swing.
pub fn multiple_shooting(problem: &mut Problem<'_>) -> Result<ShootingResult> {
    let (model, _) = problem.model(0, &[])?;
    let characteristic_rad_s = model.characteristic_rad_s();
    let stretches = stretches(problem, PERIODS * std::f64::consts::TAU / characteristic_rad_s);
    let marks = problem.marks();
    let mut x = problem.start_values()?;
    let reach_s = STATE_WINDOW_RAD / characteristic_rad_s;
    let mut left: Vec<Vec<Vec<f64>>> = vec![vec![Vec::new(); marks]; problem.records.len()];
    for stretch in &stretches {
        let near = problem.records[stretch.record].state_near(stretch.rows.start, reach_s);
        x.extend(near.iter().map(|n| n[0]));
        x.extend(near.iter().map(|n| n[1]));
        near.iter().enumerate().for_each(|(link, n)| left[stretch.record][link].push(n[2]));
    }
    for (record, (noise, left)) in problem.noise.iter_mut().zip(&mut left).enumerate() {
        for (link, (noise, left)) in noise.sd_rad.iter_mut().zip(left).enumerate() {
            let least_rad = least_noise_rad(problem.records, record, link);
            *noise = median(left).unwrap_or(1e-3).clamp(1e-6, 0.05).max(least_rad);
        }
    }
    Ok(close_defects(problem, &stretches, x, characteristic_rad_s, true))
}

/// The same from a motion that follows the recordings already, whatever model it is of: the stretches begin where that motion is, so that no parameters near these
/// fall out of step with it. `state` gives the angles between marks at a row of a recording, then their rates. The noise is taken as it is.
///
/// # Errors
/// [`crate::Error::Simulation`] where the specimen cannot swing.
pub fn shooting_along(
    problem: &mut Problem<'_>,
    parameters: &[f64],
    state: impl Fn(usize, usize) -> Vec<f64>,
) -> Result<ShootingResult> {
    let characteristic_rad_s = problem.model(0, parameters)?.0.characteristic_rad_s();
    let stretches = stretches(problem, PERIODS * std::f64::consts::TAU / characteristic_rad_s);
    let mut x = parameters.to_vec();
    stretches.iter().for_each(|stretch| x.extend(state(stretch.record, stretch.rows.start)));
    Ok(close_defects(problem, &stretches, x, characteristic_rad_s, false))
}

/// Stretches with starts of their own, their seams ever tighter; `learns` the noise from what the loosest leave.
fn close_defects(
    problem: &mut Problem<'_>,
    stretches: &[Stretch],
    mut x: Vec<f64>,
    characteristic_rad_s: f64,
    learns: bool,
) -> ShootingResult {
    let (free, marks) = (problem.free.len(), problem.marks());
    let mut lower = problem.lower();
    lower.truncate(free);
    lower.resize(x.len(), f64::NEG_INFINITY);
    let longest_s =
        stretches.iter().map(|s| s.until_s - problem.records[s.record].t_s[s.rows.start]).fold(0.0, f64::max);
    problem.accuracy = problem.accuracy_of(longest_s, 3e-6);
    let mut left_by_stretches = Vec::new();
    for (round, seam) in DEFECT_SDS.iter().enumerate() {
        let descent = Descent::robust(STEPS_EACH, 0.3);
        let Some(outcome) =
            descent.run(x.clone(), &lower, |x| blocks(problem, stretches, x, *seam, characteristic_rad_s))
        else {
            break;
        };
        x = outcome.x;
        if round == 0 && learns {
            left_by_stretches = residuals(problem, stretches, &x);
            let variables = x.len();
            problem.update_noise(&left_by_stretches, variables);
        }
    }
    let mut whole = x[..free].to_vec();
    for (index, stretch) in stretches.iter().enumerate() {
        if stretch.rows.start == 0 {
            let start = free + index * 2 * marks;
            for half in x[start..start + 2 * marks].chunks(marks) {
                whole.extend_from_slice(half);
                whole.extend(vec![0.0; problem.further()]);
            }
        }
    }
    ShootingResult { x: whole, noise: problem.noise.clone(), residuals: left_by_stretches }
}

fn stretches(problem: &Problem<'_>, length_s: f64) -> Vec<Stretch> {
    let wanted = VALUES_EACH * 2 * problem.marks();
    problem.records.iter().enumerate().flat_map(|(index, record)| cut(index, record, length_s, wanted)).collect()
}

/// Cuts at measured rows; a gap makes its stretch longer.
fn cut(index: usize, record: &Record, length_s: f64, wanted: usize) -> Vec<Stretch> {
    let mut starts = vec![0];
    for row in 1..record.len() {
        let begun = starts[starts.len() - 1];
        let long = record.t_s[row] - record.t_s[begun] >= length_s;
        let measured = record.theta_rad.iter().all(|angles| angles[row].is_some());
        if long && measured && record.values(begun..row) >= wanted && record.values(row..record.len()) >= wanted {
            starts.push(row);
        }
    }
    let end = record.len();
    (0..starts.len())
        .map(|k| {
            let next = starts.get(k + 1).copied();
            Stretch {
                record: index,
                rows: starts[k]..next.unwrap_or(end),
                until_s: record.t_s[next.unwrap_or(end - 1)],
                last: next.is_none(),
            }
        })
        .collect()
}

fn blocks(
    problem: &Problem<'_>,
    stretches: &[Stretch],
    x: &[f64],
    seam: f64,
    characteristic_rad_s: f64,
) -> Option<Vec<Block>> {
    let of = |index: usize| of_stretch(problem, stretches, index, x, seam, characteristic_rad_s);
    (!problem.work.is_spent()).then_some(())?;
    // all are asked, also where one gives nothing, so that the work done does not depend on which thread comes first
    let of_stretches: Vec<_> = (0..stretches.len()).into_par_iter().map(of).collect();
    let seams_beside = of_stretches
        .into_iter()
        .collect::<Option<Vec<_>>>()?
        .into_iter()
        .flat_map(|(own, seam)| std::iter::once(own).chain(seam));
    Some(problem.belief_block(x).into_iter().chain(seams_beside).collect())
}

/// The residuals of one stretch, and of the seam after it.
fn of_stretch(
    problem: &Problem<'_>,
    stretches: &[Stretch],
    index: usize,
    x: &[f64],
    seam: f64,
    characteristic_rad_s: f64,
) -> Option<(Block, Option<Block>)> {
    let (free, marks) = (problem.free.len(), problem.marks());
    let stretch = &stretches[index];
    let (model, camera) = problem.model(stretch.record, &x[..free]).ok()?;
    let start = free + index * 2 * marks;
    let request = stretch.request(problem, &camera, &x[start..start + 2 * marks], true);
    let prediction = predict(&model, &request).ok()?;
    let own: Vec<usize> = (0..free).chain(start..start + 2 * marks).collect();
    let block = problem.block(stretch.record, &prediction, own.clone());
    if stretch.last {
        return Some((block, None));
    }
    let (end, end_slopes) = prediction.end;
    let next = start + 2 * marks;
    let mut columns = own;
    columns.extend(next..next + 2 * marks);
    let mut slopes = DMatrix::zeros(2 * marks, columns.len());
    slopes.columns_mut(0, end_slopes.ncols()).copy_from(&end_slopes);
    let mut residual = DVector::zeros(2 * marks);
    for row in 0..2 * marks {
        let noise_rad = problem.noise[stretch.record].sd_rad[row % marks];
        let weight = 1.0 / (seam * noise_rad * if row < marks { 1.0 } else { characteristic_rad_s });
        residual[row] = weight * (end[row] - x[next + row]);
        slopes[(row, free + 2 * marks + row)] = -1.0;
        slopes.row_mut(row).scale_mut(weight);
    }
    Some((block, Some(Block { columns, residual, slopes, robust: false })))
}

/// The data's residuals in units of the noise, with recording and link.
fn residuals(problem: &Problem<'_>, stretches: &[Stretch], x: &[f64]) -> Vec<(usize, usize, f64)> {
    let (free, marks) = (problem.free.len(), problem.marks());
    let mut all = Vec::new();
    for (index, stretch) in stretches.iter().enumerate() {
        let Ok((model, camera)) = problem.model(stretch.record, &x[..free]) else { continue };
        let start = free + index * 2 * marks;
        let request = stretch.request(problem, &camera, &x[start..start + 2 * marks], false);
        if let Ok(prediction) = predict(&model, &request) {
            let block = problem.block(stretch.record, &prediction, Vec::new());
            let pairs = prediction.values.iter().zip(block.residual.iter());
            all.extend(pairs.map(|(value, r)| (stretch.record, value.link, *r)));
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::experiment::Experiment;
    use crate::model::{ForwardModel, Parameter, State, Trajectory};

    const FREE: [Parameter; 2] = [Parameter::JointStiffness, Parameter::JointDamping];

    fn with(stiffness: f64) -> Experiment {
        let mut experiment = Experiment::default();
        (experiment.model.k_eq_n_m_per_rad, experiment.model.c_eq_n_m_s_per_rad) = (stiffness, 2e-7);
        experiment
    }

    /// Half a minute at 30 Hz, exact.
    fn swing() -> (Record, Vec<Vec<f64>>) {
        let model = ForwardModel::of(&with(2e-4)).unwrap();
        let release = State::released(&model, &[0.5, 0.8]).unwrap();
        let swing = Trajectory::swing(&model, &release, 0.0, 30.0).unwrap();
        let t_s: Vec<f64> = (0..900).map(|row| f64::from(row) / 30.0).collect();
        let states: Vec<Vec<f64>> =
            t_s.iter().map(|t| swing.at(*t)).map(|s| [s.theta_rad, s.omega_rad_s].concat()).collect();
        let theta_rad = (0..2).map(|link| states.iter().map(|s| Some(s[link])).collect()).collect();
        (Record::uniform("made", t_s, theta_rad), states)
    }

    #[test]
    fn stretches_along_a_motion_that_follows_lead_to_its_parameters() {
        let (record, states) = swing();
        let records = [record];
        // as one motion of 30 s the second mode would miss several turns
        let mut problem = Problem::new(&records, &with(2.4e-4), &FREE).unwrap();
        let parameters = problem.start_values().unwrap();
        let shot = shooting_along(&mut problem, &parameters, |_, row| states[row].clone()).unwrap();
        assert!((shot.x[0] / 2e-4 - 1.0).abs() < 0.01, "{:?}", shot.x);
        assert!(shot.x[2..].iter().zip(&states[0]).all(|(x, state)| (x - state).abs() < 1e-2), "{:?}", shot.x);
    }
}
