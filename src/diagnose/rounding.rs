//! What an encoder's rounding alone leaves of a fit. It goes with the swing, as a torque does that is not known.

use super::refit::Refit;
use crate::fit::Record;
use crate::series::noise::step_rad;

/// Places of the encoder's zero within a step that are tried: what the rounding makes depends on it.
const ZEROS: usize = 4;

/// The recordings as they would be if the model of a fit were what was recorded: its angles, rounded in the encoder's steps, with its zero at several places. Nothing
/// where no angle is in steps.
pub fn rounded(fit: &Refit<'_>) -> Vec<Vec<Record>> {
    (0..ZEROS).filter_map(|zero| rounded_about(fit, zero as f64 / ZEROS as f64)).collect()
}

/// The same with the zero moved by a part of a step.
fn rounded_about(fit: &Refit<'_>, moved: f64) -> Option<Vec<Record>> {
    let mut records = fit.problem.records.to_vec();
    records.iter().any(|record| record.rounding > 0.0).then_some(())?;
    for (index, record) in records.iter_mut().enumerate() {
        // each step is where the recorded ones are
        let steps: Vec<Option<(f64, f64)>> = record
            .theta_rad
            .iter()
            .map(|angles| {
                let step = step_rad(angles)?;
                Some((step, angles.iter().flatten().next()? + moved * step))
            })
            .collect();
        for value in fit.problem.predict(index, &fit.x, false).ok()?.values {
            let angle = match steps[value.link] {
                Some((step, zero)) => ((value.predicted_rad - zero) / step).round() * step + zero,
                None => value.predicted_rad,
            };
            record.theta_rad[value.link][value.row] = Some(angle);
        }
    }
    Some(records)
}
