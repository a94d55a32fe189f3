//! The joint's hysteresis needs starts and variables of its own.
//!
//! Before it yields, a hysteresis is a spring of stiffness T_h/Δ_y beside the joint's K, and their sum is what a recording tells best. In (K, T_h, Δ_y)
//! the valley of equal sums is bent, and a descent creeps along it; in (K, T_h/Δ_y, Δ_y) it is straight.

use rayon::prelude::*;

use super::ground::{self, Ground};
use super::refit::Refit;
use super::screen::Score;
use super::single::Lacks;
use super::{Cause, growing};
use crate::fit::Problem;
use crate::fit::descent::{Block, Outcome};
use crate::model::Parameter;

/// Starts: yield angles as parts of the largest bend, and the hysteresis' part of the spring.
const YIELD_SHARES: [f64; 3] = [0.05, 0.2, 0.6];
const SPRING_SHARES: [f64; 2] = [0.4, 0.9];
/// The same where everything else has failed, and how much stiffer the joint may then be; how many of them begin a descent, and how many end it.
const EVERY_YIELD: [f64; 5] = [0.03, 0.1, 0.25, 0.5, 0.9];
const EVERY_SHARE: [f64; 4] = [0.1, 0.4, 0.7, 0.95];
const STIFFER: [f64; 3] = [1.0, 2.0, 8.0];
const BEGUN: usize = 12;
const ENDED: usize = 3;
/// Parts of the recordings that are followed before the whole is.
const PARTS: [f64; 2] = [0.15, 0.5];

/// Where T_h and Δ_y stand among a problem's variables.
#[derive(Debug, Clone, Copy)]
pub struct Straightened {
    torque: usize,
    yields: usize,
}

impl Straightened {
    /// Of a problem with a hysteresis.
    pub fn of(problem: &Problem<'_>) -> Option<Self> {
        let place = |parameter| problem.free.iter().position(|p| *p == parameter);
        Some(Self { torque: place(Parameter::HysteresisTorque)?, yields: place(Parameter::HysteresisYield)? })
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

/// The hysteresis alone, from every start that may lead to its minimum: where the score points, as a part of the spring where there is something to explain,
/// and from short stretches, which do not know what the base model has given up, where nothing else explains it.
pub(super) fn alone<'a>(
    ground: &Ground<'a>,
    null: &Refit<'a>,
    score: Option<&Score>,
    lacks: Lacks,
) -> Option<Refit<'a>> {
    let hypothesis = null.hypothesis.and(Cause::JointHysteretic, None);
    let near = || score.and_then(|score| ground.refit_below(lacks.leads, &hypothesis, null, &score.start));
    let softened = || (lacks.unexplained || lacks.seen).then(|| softened(ground, null, lacks.leads)).flatten();
    // in every joint of a strip, and from no memory in each stretch, it is too dear
    let anew =
        || (lacks.unsolved && !ground.is_strip()).then(|| ground.refit_anew(&hypothesis, &[], null.chi2)).flatten();
    let (near, (softened, anew)) = rayon::join(near, || rayon::join(softened, anew));
    [near, softened, anew].into_iter().flatten().min_by(|a, b| a.chi2.total_cmp(&b.chi2))
}

/// The hysteresis where it makes up a part of what the base model takes for the spring: from the best of several such starts, if that leads below `bound`.
fn softened<'a>(ground: &Ground<'a>, null: &Refit<'a>, bound: f64) -> Option<Refit<'a>> {
    let hypothesis = null.hypothesis.and(Cause::JointHysteretic, None);
    let starts = starts(ground, null, &YIELD_SHARES, &SPRING_SHARES, &[1.0])?;
    let costed = starts.into_iter().map(|start| (ground.cost_at(&hypothesis, null, &start), start));
    let (_, best) = costed.min_by(|a, b| a.0.total_cmp(&b.0))?;
    if ground.is_strip() {
        return ground.begin(&hypothesis, null, &best);
    }
    ground.refit_below(bound, &hypothesis, null, &best)
}

/// Where a hysteresis beside a fit may start: with these yield angles, as parts of the largest bend, as these parts of the spring, the spring being as many times
/// as stiff before it yields as that fit has it.
fn starts(
    ground: &Ground<'_>,
    fit: &Refit<'_>,
    yield_shares: &[f64],
    spring_shares: &[f64],
    stiffer: &[f64],
) -> Option<Vec<Vec<(Parameter, f64)>>> {
    let spring = fit.problem.free.iter().copied().find(|parameter| parameter.is_spring())?;
    let stiffness = fit.problem.model(0, &fit.x[..fit.problem.free.len()]).ok()?.0.value(Parameter::JointStiffness)?;
    // a base model that has locked its joint is no guide to the damper
    let damping = fit.value(Parameter::JointDamping).unwrap_or(0.0).min(ground.experiment.model.c_eq_n_m_s_per_rad);
    let mut starts = Vec::new();
    for yield_rad in yield_shares.iter().map(|share| share * ground.largest_bend_rad()) {
        for (share, scale) in spring_shares.iter().flat_map(|share| stiffer.iter().map(move |scale| (share, scale))) {
            starts.push(vec![
                (spring, (1.0 - share) * scale * fit.value(spring).unwrap_or(0.0)),
                // what it loses the base model took for the damper's
                (Parameter::JointDamping, (1.0 - share) * damping),
                (Parameter::HysteresisTorque, share * scale * stiffness * yield_rad),
                (Parameter::HysteresisYield, yield_rad),
            ]);
        }
    }
    Some(starts)
}

/// The hysteresis beside a fit from wherever it may be: its sum of squares has many false minima, of a whole recording far more than of its beginning.
pub(super) fn anywhere<'a>(ground: &Ground<'a>, fit: &Refit<'a>) -> Option<Refit<'a>> {
    let hypothesis = fit.hypothesis.and(Cause::JointHysteretic, None);
    let starts = starts(ground, fit, &EVERY_YIELD, &EVERY_SHARE, &STIFFER)?;
    let fit = &ground.seen_to_start(fit);
    let [beginning, first_half] = PARTS.map(|part| growing::first_part(ground.records, part));
    let (beginning, first_half) = (ground.on(&beginning), ground.on(&first_half));
    let cost = |start: Vec<(Parameter, f64)>| (beginning.cost_at(&hypothesis, fit, &start), start);
    let mut costed: Vec<_> = starts.into_par_iter().with_max_len(1).map(cost).collect();
    costed.sort_by(|a, b| a.0.total_cmp(&b.0));
    costed.truncate(BEGUN);
    let begun = costed.par_iter().with_max_len(1).filter_map(|(_, start)| {
        let begun = beginning.begin(&hypothesis, fit, start)?;
        beginning.again(&begun, ground::FEW_STEPS)
    });
    let mut begun: Vec<(f64, Vec<f64>)> = begun.map(|begun| (begun.chi2, begun.x)).collect();
    begun.sort_by(|a, b| a.0.total_cmp(&b.0));
    begun.truncate(ENDED);
    let ended = begun.into_par_iter().with_max_len(1).filter_map(|(_, x)| {
        let half = first_half.descend_from(&hypothesis, x, ground::FEW_STEPS)?;
        ground.descend_from(&hypothesis, half.x, ground::MOST_STEPS)
    });
    ended.min_by(|a, b| a.chi2.total_cmp(&b.chi2))
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
        let valley = Straightened { torque: 0, yields: 2 };
        let x = vec![3e-6, 7.0, 0.05];
        let straight = valley.straight(x.clone());
        assert!((straight[0] - 6e-5).abs() < 1e-18);
        let residual = DVector::zeros(4);
        let mut blocks = vec![Block { columns: vec![0, 1, 2], residual, slopes: slopes(), robust: true }];
        valley.straighten(&mut blocks, &straight);
        let normal = blocks[0].slopes.tr_mul(&blocks[0].slopes);
        let outcome =
            Outcome { x: straight, cost: 0.0, blocks: Vec::new(), normal, steps: 0, ending: Ending::Converged };
        let back = valley.bend(outcome);
        assert!(back.x.iter().zip(&x).all(|(a, b)| (a / b - 1.0).abs() < 1e-12), "{:?}", back.x);
        let direct = slopes().tr_mul(&slopes());
        assert!((&back.normal - &direct).amax() < 1e-9 * direct.amax(), "{} {direct}", back.normal);
    }

    #[test]
    fn derivatives_are_those_of_the_straight_variables() {
        let valley = Straightened { torque: 0, yields: 2 };
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
