//! The variables in which the valley of a hysteresis is straight.
//!
//! Before it yields, a hysteresis is a spring of stiffness T_h/Δ_y beside the joint's K, and their sum is what a recording tells best. In (K, T_h, Δ_y)
//! the valley of equal sums is bent, and a descent creeps along it; in (K, T_h/Δ_y, Δ_y) it is straight.

use super::Problem;
use super::descent::{Block, Descent, Outcome};
use crate::model::Parameter;

/// Descents after the first, each with the shapes of the strip as the one before found it held.
const MOST_UPDATES: usize = 3;

/// Where T_h and Δ_y stand among a problem's variables.
#[derive(Debug, Clone, Copy)]
pub struct StiffnessCoordinates {
    torque: usize,
    yields: usize,
}

impl StiffnessCoordinates {
    /// Of a problem with a hysteresis.
    pub fn of(problem: &Problem<'_>) -> Option<Self> {
        let [torque, yields] = [Parameter::HysteresisTorque, Parameter::HysteresisYield].map(|p| problem.place(p));
        Some(Self { torque: torque?, yields: yields? })
    }

    /// T_h → T_h/Δ_y.
    pub fn straight(self, mut x: Vec<f64>) -> Vec<f64> {
        x[self.torque] /= x[self.yields];
        x
    }

    /// T_h/Δ_y → T_h.
    pub fn bent(self, x: &[f64]) -> Vec<f64> {
        let mut x = x.to_vec();
        x[self.torque] *= x[self.yields];
        x
    }

    /// Derivatives with (T_h, Δ_y) to those with (k, Δ_y), k = T_h/Δ_y: ∂/∂k = Δ_y ∂/∂T_h, and at constant k ∂/∂Δ_y gains k ∂/∂T_h.
    pub fn straighten(self, blocks: &mut [Block], straight: &[f64]) {
        let (stiffness, yield_rad) = (straight[self.torque], straight[self.yields]);
        for block in blocks {
            let place = |variable| block.columns.iter().position(|c| *c == variable);
            let (Some(torque), Some(yields)) = (place(self.torque), place(self.yields)) else { continue };
            let with_torque = block.slopes.column(torque).into_owned();
            block.slopes.column_mut(yields).axpy(stiffness, &with_torque, 1.0);
            block.slopes.column_mut(torque).scale_mut(yield_rad);
        }
    }

    /// The end of a descent in (T_h, Δ_y) again: x and JᵀJ.
    pub fn bend(self, mut outcome: Outcome) -> Outcome {
        let (stiffness, yield_rad) = (outcome.x[self.torque], outcome.x[self.yields]);
        let (torque, yields) = (self.torque, self.yields);
        let normal = &mut outcome.normal;
        // k = T/Δ: ∂/∂T = (1/Δ) ∂/∂k, and at constant T ∂/∂Δ loses (k/Δ) ∂/∂k; rows, then columns
        for row in 0..normal.nrows() {
            let with_stiffness = normal[(row, torque)];
            normal[(row, torque)] = with_stiffness / yield_rad;
            normal[(row, yields)] -= stiffness / yield_rad * with_stiffness;
        }
        for column in 0..normal.ncols() {
            let with_stiffness = normal[(torque, column)];
            normal[(torque, column)] = with_stiffness / yield_rad;
            normal[(yields, column)] -= stiffness / yield_rad * with_stiffness;
        }
        outcome.x = self.bent(&outcome.x);
        outcome
    }
}

/// Descends, of a problem with a hysteresis in the variables in which its valley is straight.
pub fn descend(problem: &Problem<'_>, descent: &Descent, x: Vec<f64>) -> Option<Outcome> {
    let lower = problem.lower();
    let Some(valley) = StiffnessCoordinates::of(problem) else { return descent.run(x, &lower, |x| problem.blocks(x)) };
    let straight = descent.run(valley.straight(x), &lower, |x| {
        let mut blocks = problem.blocks(&valley.bent(x))?;
        valley.straighten(&mut blocks, x);
        Some(blocks)
    });
    straight.map(|outcome| valley.bend(outcome))
}

/// Descends, and on with the shapes of the strip as it was found to be held ([`update_strip_modes`]).
pub fn descend_updating_modes<'a>(
    problem: Problem<'a>,
    descent: &Descent,
    x: Vec<f64>,
) -> Option<(Problem<'a>, Outcome)> {
    let outcome = descend(&problem, descent, x)?;
    Some(update_strip_modes(problem, descent, outcome))
}

/// Computes the mode shapes of a strip again for the hinge spring that was fitted, and goes on, a few times at most.
pub fn update_strip_modes<'a>(
    mut problem: Problem<'a>,
    descent: &Descent,
    mut outcome: Outcome,
) -> (Problem<'a>, Outcome) {
    for _ in 0..MOST_UPDATES {
        if problem.has_modes_at(&outcome.x) {
            break;
        }
        let held = problem.clone().with_modes_at(&outcome.x);
        let on = Descent { damping: outcome.damping, worst_start: f64::INFINITY, judged: None, ..*descent };
        let again = descend(&held, &on, outcome.x.clone()).filter(|again| again.cost < outcome.cost);
        let Some((again, blocks)) = again.and_then(|again| held.blocks(&again.x).map(|blocks| (again, blocks))) else {
            break;
        };
        (problem, outcome) = (held, Outcome { blocks, ..again });
    }
    (problem, outcome)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::Ending;
    use nalgebra::{DMatrix, DVector};

    /// What is fitted: some linear function of (T_h, Δ_y) and another variable.
    fn slopes() -> DMatrix<f64> {
        DMatrix::from_row_slice(4, 3, &[1.0, 3.0, -2.0, 0.5, -1.0, 4.0, 2.0, 0.3, 1.0, -1.0, 2.0, 0.7])
    }

    #[test]
    fn there_and_back_the_normal_matrix_is_the_same() {
        let valley = StiffnessCoordinates { torque: 0, yields: 2 };
        let x = vec![3e-6, 7.0, 0.05];
        let straight = valley.straight(x.clone());
        assert!((straight[0] - 6e-5).abs() < 1e-18);
        let residual = DVector::zeros(4);
        let mut blocks = vec![Block { columns: vec![0, 1, 2], residual, slopes: slopes(), robust: true }];
        valley.straighten(&mut blocks, &straight);
        let normal = blocks[0].slopes.tr_mul(&blocks[0].slopes);
        let ending = Ending::Converged;
        let outcome = Outcome { x: straight, cost: 0.0, blocks: Vec::new(), normal, steps: 0, ending, damping: 0.0 };
        let back = valley.bend(outcome);
        assert!(back.x.iter().zip(&x).all(|(a, b)| (a / b - 1.0).abs() < 1e-12), "{:?}", back.x);
        let direct = slopes().tr_mul(&slopes());
        assert!((&back.normal - &direct).amax() < 1e-9 * direct.amax(), "{} {direct}", back.normal);
    }

    #[test]
    fn derivatives_are_those_of_the_straight_variables() {
        let valley = StiffnessCoordinates { torque: 0, yields: 2 };
        let straight = [0.6, 7.0, 0.5];
        let value = |straight: &[f64]| slopes() * DVector::from_vec(valley.bent(straight));
        let residual = DVector::zeros(4);
        let mut blocks = vec![Block { columns: vec![0, 1, 2], residual, slopes: slopes(), robust: true }];
        valley.straighten(&mut blocks, &straight);
        for column in 0..3 {
            let step = 1e-6 * straight[column];
            let mut moved = straight;
            moved[column] += step;
            let difference = (value(&moved) - value(&straight)) / step;
            let slope = blocks[0].slopes.column(column);
            assert!((difference - slope).amax() < 1e-5 * slope.amax(), "{column}");
        }
    }
}
