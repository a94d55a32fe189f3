//! The same swing by the model, and how far two swings are apart.

use freeswing::model::integrate::Directions;
use freeswing::model::{Accuracy, ForwardModel, Parameter, State, Trajectory};
use nalgebra::DMatrix;

use super::{DIRECTIONS, Swing, TwoRods};

impl TwoRods {
    /// Lets the model swing them.
    pub fn swing_by_the_model(&self, accuracy: &Accuracy, times_s: &[f64]) -> Swing {
        let model = ForwardModel::of(&self.experiment()).unwrap();
        let (m, initial) = (model.rates(), 4);
        let at = |row: usize, column: usize| f64::from(u8::from(row == column));
        let directions = Directions {
            parameters: vec![Parameter::JointStiffness, Parameter::JointDamping, Parameter::HingeViscous],
            theta: DMatrix::from_fn(2, initial, at),
            rate: DMatrix::from_fn(m, initial, |row, column| if row < 2 { at(row + 2, column) } else { 0.0 }),
        };
        let (theta_rad, omega_rad_s) = (self.values[3..5].to_vec(), self.values[5..].to_vec());
        let start = State { theta_rad, omega_rad_s, hidden: Vec::new() };
        let span_s = (0.0, times_s[times_s.len() - 1]);
        let trajectory = Trajectory::with(&model, &start, span_s, Some(&directions), accuracy).unwrap();
        let instants: Vec<_> = times_s.iter().map(|t_s| trajectory.instant(*t_s).unwrap()).collect();
        let slopes = instants.iter().map(|instant| {
            let (theta, _) = instant.slopes.as_ref().unwrap();
            std::array::from_fn(|direction| [theta[(0, direction)], theta[(1, direction)]])
        });
        Swing {
            theta_rad: instants.iter().map(|i| [i.theta_rad[0], i.theta_rad[1]]).collect(),
            slopes: slopes.collect(),
        }
    }
}

impl Swing {
    /// Largest difference of angles (rad), and of the derivatives in each direction as a part of their largest.
    pub fn differences(&self, other: &Swing) -> (f64, [f64; DIRECTIONS]) {
        let apart = |a: &[f64; 2], b: &[f64; 2]| (a[0] - b[0]).abs().max((a[1] - b[1]).abs());
        let angles = self.theta_rad.iter().zip(&other.theta_rad).map(|(a, b)| apart(a, b)).fold(0.0, f64::max);
        let slopes = std::array::from_fn(|d| {
            let largest = other.slopes.iter().map(|s| apart(&s[d], &[0.0; 2])).fold(0.0, f64::max);
            let gap = self.slopes.iter().zip(&other.slopes).map(|(a, b)| apart(&a[d], &b[d])).fold(0.0, f64::max);
            gap / largest
        });
        (angles, slopes)
    }
}
