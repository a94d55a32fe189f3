//! What the model says the camera sees, with derivatives.

use std::ops::Range;

use nalgebra::DMatrix;

use super::Record;
use crate::error::{Error, Result};
use crate::model::integrate::Directions;
use crate::model::observe::{chord_angles_rad, chord_slopes};
use crate::model::step::StepPlace;
use crate::model::trajectory::StartDirections;
use crate::model::{Accuracy, Camera, ForwardModel, Parameter, Trajectory};

/// The angles predicted for some rows, and their derivatives.
#[derive(Debug, Clone)]
pub struct Prediction {
    /// One entry a measured value, link after link.
    pub values: Vec<Value>,
    /// ∂angle: a row each value; columns are the parameters, then the angles at the start, then their rates.
    pub slopes: DMatrix<f64>,
    /// Angles between marks and their rates where the next stretch begins, with derivatives of each (columns as above).
    pub end: (Vec<f64>, DMatrix<f64>),
}

/// One measured value and its prediction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Value {
    /// Which angle.
    pub link: usize,
    /// Which row of the table.
    pub row: usize,
    /// The angle as it should be seen.
    pub predicted_rad: f64,
    /// Rate of the angle as seen.
    pub rate_rad_s: f64,
}

/// What a prediction needs besides the model.
#[derive(Debug, Clone, Copy)]
pub struct Request<'a> {
    /// The recording.
    pub record: &'a Record,
    /// Rows to predict; the motion starts at the first.
    pub rows: &'a Range<usize>,
    /// Angles between marks at the first row (perhaps how much of a strip's next modes, and how far a stand has yielded), then their rates.
    pub start: &'a [f64],
    /// The camera.
    pub camera: &'a Camera,
    /// Parameters to take derivatives with.
    pub parameters: &'a [Parameter],
    /// Stamp to which the motion is carried on.
    pub until_s: f64,
    /// Of the integration.
    pub accuracy: &'a Accuracy,
    /// Whether derivatives are wanted; without them the prediction's matrices have no column.
    pub slopes: bool,
}

/// Predicts the angles of some rows.
///
/// # Errors
/// [`Error::Simulation`] where the motion cannot be integrated.
pub fn predict(model: &ForwardModel, request: &Request<'_>) -> Result<Prediction> {
    let Request { record, rows, start, parameters, accuracy, .. } = *request;
    let marks = record.links();
    let chain = model.chain();
    let start_s = record.t_s[rows.start];
    let mut camera = Camera { origin_s: start_s, ..*request.camera };
    if start_s >= camera.dropped_at_s {
        // the motion starts after the missing frames
        (camera.dropped_s, camera.dropped_at_s) = (0.0, f64::INFINITY);
    }
    let ends_s = [0, 1].map(|link| camera.true_time_s(request.until_s, link));
    let latest_s = ends_s[0].max(ends_s[1]) + 1e-9;
    let begun = StartDirections::of(model, start.len());
    let state = begun.state(start);
    let StartDirections { theta, rate } = begun;
    let directions = request.slopes.then(|| Directions { parameters: parameters.to_vec(), theta, rate });
    let swing = Trajectory::with(model, &state, (start_s, latest_s), directions.as_ref(), accuracy)?;
    let columns = if request.slopes { parameters.len() + start.len() } else { 0 };
    let mut values = Vec::with_capacity(record.values(rows.clone()));
    let mut flat = Vec::with_capacity(values.capacity() * columns);
    let mut row_slopes = vec![0.0; columns];
    for link in 0..marks {
        for row in rows.clone().filter(|row| record.theta_rad[link][*row].is_some()) {
            let t_s = record.t_s[row];
            row_slopes.fill(0.0);
            let (theta, omega) = seen(chain, &swing, camera.true_time_s(t_s, link), link, &mut row_slopes)
                .ok_or_else(|| Error::Simulation { detail: "a motion of no length".into() })?;
            let seen_slope = camera.seen_slope(theta);
            row_slopes.iter_mut().for_each(|s| *s *= seen_slope);
            for (column, parameter) in parameters.iter().enumerate().take(columns) {
                row_slopes[column] += camera.slope(*parameter, t_s, link, theta, omega);
            }
            flat.extend_from_slice(&row_slopes);
            values.push(Value {
                link,
                row,
                predicted_rad: camera.seen_rad(theta, link),
                rate_rad_s: seen_slope * omega,
            });
        }
    }
    let slopes = DMatrix::from_row_slice(values.len(), columns, &flat);
    Ok(Prediction { values, slopes, end: end_of(model, &swing, request, &camera)? })
}

/// Angle between marks and its rate at a true time; its derivatives are added to `slopes`.
fn seen(
    chain: &crate::model::Chain,
    swing: &Trajectory,
    true_s: f64,
    link: usize,
    slopes: &mut [f64],
) -> Option<(f64, f64)> {
    let (step, tau) = swing.step_at(true_s)?;
    let at = StepPlace::at(tau);
    let group = &chain.groups()[link];
    // a lag may reach a little before the start
    let missed_s = true_s.min(step.from_s + tau * step.length_s) - (step.from_s + tau * step.length_s);
    if group.len() == 1 {
        step.add_angle_slopes(group.start, &at, 1.0, slopes);
        let (theta, omega) = step.link(group.start, &at);
        return Some((theta + omega * missed_s, omega));
    }
    let (theta, rate) = (step.theta_rad(tau), step.rate(tau));
    let along = chord_slopes(chain, &theta);
    let mut omega = 0.0;
    for member in group.clone() {
        step.add_angle_slopes(member, &at, along[(link, member)], slopes);
        omega += along[(link, member)] * rate[member];
    }
    Some((chord_angles_rad(chain, &theta)[link] + omega * missed_s, omega))
}

fn end_of(
    model: &ForwardModel,
    swing: &Trajectory,
    request: &Request<'_>,
    camera: &Camera,
) -> Result<(Vec<f64>, DMatrix<f64>)> {
    let (chain, marks) = (model.chain(), request.record.links());
    let instant = swing
        .instant(camera.true_time_s(request.until_s, 0))
        .ok_or_else(|| Error::Simulation { detail: "a motion of no length".into() })?;
    let along = chord_slopes(chain, &instant.theta_rad);
    let n = chain.count();
    let omega = nalgebra::DVector::from_column_slice(&instant.rate[..n]);
    let mut values = chord_angles_rad(chain, &instant.theta_rad);
    values.extend((&along * omega).iter());
    let Some((theta, rate)) = instant.slopes else { return Ok((values, DMatrix::zeros(2 * marks, 0))) };
    let columns = request.parameters.len() + request.start.len();
    let mut slopes = DMatrix::zeros(2 * marks, columns);
    slopes.rows_mut(0, marks).copy_from(&(&along * theta));
    slopes.rows_mut(marks, marks).copy_from(&(&along * rate.rows(0, n)));
    // the camera's clock moves the instant itself
    for (column, parameter) in request.parameters.iter().enumerate() {
        let moved = camera.true_time_slope(*parameter, request.until_s, 0);
        for link in 0..marks {
            let acceleration: f64 = (0..n).map(|i| along[(link, i)] * instant.acceleration[i]).sum();
            slopes[(link, column)] += moved * values[marks + link];
            slopes[(marks + link, column)] += moved * acceleration;
        }
    }
    Ok((values, slopes))
}
