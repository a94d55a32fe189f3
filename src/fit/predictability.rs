//! How far a motion can be foretold. A chain that tumbles forgets how it began: what a fit then leaves says nothing of the model.
//!
//! ```text
//! δᵢ(t) = σ maxⱼ |∂θᵢ(t)/∂θⱼ(0)|      σ: the angles' noise
//! ```
//!
//! Where δ has grown to a radian, the noise of the first rows has become another motion. The derivatives are those of the model along its own motion from where the
//! recording begins.

use std::ops::Range;

use super::noise::noise_rad;
use super::search::observed_starts;
use super::{Problem, Record};
use crate::experiment::Experiment;
use crate::series::FEWEST_ROWS;

/// A difference that is another motion.
const ANOTHER_RAD: f64 = 1.0;
/// Later beginnings that are tried: so many parts of the recording.
const PARTS: usize = 8;

/// The rows of a recording that the model can foretell one from the other, where those are not all: from the first on, or up to the last, whichever are more.
pub fn foretold(record: &Record, experiment: &Experiment) -> Option<Range<usize>> {
    let noise_rad = noise_rad(record).into_iter().fold(0.0, f64::max);
    let lost_at = |first: usize| lost_at(&record.from_row(first), experiment, noise_rad);
    let until = lost_at(0)?;
    let later = (1..PARTS).map(|part| part * record.len() / PARTS).find(|first| lost_at(*first).is_none());
    let rows = match later {
        Some(first) if record.len() - first > until => first..record.len(),
        _ => 0..until,
    };
    (rows.len() >= FEWEST_ROWS).then_some(rows)
}

/// The first row at which the noise has grown into another motion.
fn lost_at(record: &Record, experiment: &Experiment, noise_rad: f64) -> Option<usize> {
    let problem = Problem::new(std::slice::from_ref(record), experiment, &[]).ok()?;
    let prediction = problem.predict(0, &observed_starts(&problem).ok()?, true).ok()?;
    let angles = prediction.slopes.columns(0, problem.marks());
    let grown = |value: usize| noise_rad * angles.row(value).iter().fold(0.0, |most: f64, slope| most.max(slope.abs()));
    let lost = (0..prediction.values.len()).filter(|value| grown(*value) > ANOTHER_RAD);
    lost.map(|value| prediction.values[value].row).min()
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};

    use super::*;
    use crate::model::{ForwardModel, State, Trajectory};

    /// Two rods of 0.2 m, let go at these angles, a hundred rows per second.
    fn recorded(release_rad: [f64; 2], duration_s: f64) -> (Record, Experiment) {
        let experiment = Experiment::parse(
            "[specimen]\nlink_lengths_m = [0.2, 0.2]\nmass_kg = 0.1\n[model]\nk_eq_n_m_per_rad = 0.0\nc_eq_n_m_s_per_rad = 2e-5\n",
            "experiment.toml".as_ref(),
        )
        .unwrap();
        let t_s: Vec<f64> = (0..(100.0 * duration_s) as usize).map(|i| f64::from(i as u32) / 100.0).collect();
        let model = ForwardModel::of(&experiment).unwrap();
        let start = State::released(&model, &release_rad).unwrap();
        let swing = Trajectory::swing(&model, &start, 0.0, duration_s).unwrap();
        let mut random = rand::rngs::StdRng::seed_from_u64(3);
        let mut noise = || 1e-3 * random.random_range(-1.0..1.0);
        let theta_rad: Vec<Vec<Option<f64>>> =
            (0..2).map(|link| t_s.iter().map(|t| Some(swing.at(*t).theta_rad[link] + noise())).collect()).collect();
        let record = Record::uniform("made", t_s, theta_rad);
        (record, experiment)
    }

    #[test]
    fn a_swing_is_foretold_to_its_end_and_a_tumbling_chain_is_not() {
        let (calm, experiment) = recorded([0.6, -0.9], 20.0);
        assert_eq!(foretold(&calm, &experiment), None);
        let (tumbles, experiment) = recorded([2.1, 2.6], 10.0);
        let rows = foretold(&tumbles, &experiment).unwrap();
        assert!(rows.start == 0 && (80..700).contains(&rows.end), "{rows:?}");
    }
}
