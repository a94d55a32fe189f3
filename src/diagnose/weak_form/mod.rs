//! The weak form: which laws the recorded motion itself asks for, without any motion being simulated.
//!
//! Along the motion that was recorded the sum of torques Q is linear in the coefficients β of all laws. Smoothed angles give rates and accelerations; Q and its
//! derivatives are weighed by short bumps φₖ, and least squares give the coefficients of any set of laws at once:
//!
//! ```text
//! ∫φₖ Qᵢ dt + Σ β ∫φₖ ∂Qᵢ/∂β dt = eₖ              φ = (1 − x²)³, half a period of the fastest mode wide
//! ∫ψₖ Q·θ̇ dt + Σ β ∫ψₖ ∂Q/∂β·θ̇ dt = eₖ        ψ: the same shape, two periods of the slowest mode wide
//! ```
//!
//! (Messenger and Bortz 2021, weak SINDy). The second kind is the power: what stores energy gives back over a period what it took, so that a geometry that is a
//! little wrong leaves the losses clear. Each kind counts over what all laws together leave of it. No simulated motion can fall out of step with the recording,
//! for there is none: so it points to sets of laws that a search beside a poor base model does not come by. Smoothing costs what a simulation of the whole
//! recording does not: it proposes, and proves nothing.
//!
//! | file | holds |
//! |---|---|
//! | `recorded` | the motion from smoothed angles, and the bumps |
//! | `squares` | least squares for every set of laws |

mod recorded;
mod squares;

use nalgebra::{DMatrix, DVector};

use super::context::FitContext;
use super::effect::{Acts, Cost, Effect, Place};
use super::hypothesis::Hypothesis;
use super::refit::Refit;
use crate::fit::Problem;
use crate::fit::begin::undamped;
use crate::model::{ForwardModel, Motion, Parameter, Partials};
use recorded::{bumps, instants};
use squares::{Block, Column, LeastSquares, Set};

/// Half the width of a window of smoothing, and of a bump, in periods of the fastest mode: a polynomial of the fifth power follows half a period.
const HALF_WIDTH: f64 = 0.25;
/// Errors of the camera or the encoder that every set may have beside its laws, with their standard deviations: an offset (rad) and a gain.
const OF_CAMERA: [(Parameter, f64); 2] = [(Parameter::CameraTilt, 0.01), (Parameter::AngleGain, 0.02)];

/// A set of laws that the weak form asks for.
#[derive(Debug, Clone)]
pub struct Asked {
    /// The laws.
    pub hypothesis: Hypothesis,
    /// Their coefficients, and the base model's.
    pub start: Vec<(Parameter, f64)>,
}

/// The sets of laws that leave least, those of most laws first: `each` of the largest number that is worth its coefficients, and the best of every smaller one.
///
/// Empty where the frames do not resolve the fastest mode, and for a strip whose marks do not show every link.
pub fn asked_for(context: &FitContext<'_>, base: &Refit<'_>, effects: &[Effect], each: usize) -> Vec<Asked> {
    let laws: Vec<Effect> = effects.iter().copied().filter(|effect| has_torque(*effect)).collect();
    let of_all = Hypothesis { effects: laws.clone(), dropped: None };
    let Some((problem, x)) = context.start(&of_all, base, &[]) else { return Vec::new() };
    let values = &x[..problem.free.len()];
    let Ok((model, camera)) = problem.model(0, values) else { return Vec::new() };
    let value = |p: &Parameter| base.value(*p).unwrap_or(0.0);
    let known: Vec<Parameter> = context.base.iter().copied().filter(|p| camera.value(*p).is_none()).collect();
    let allowed = known.iter().copied().chain(OF_CAMERA.map(|(parameter, _)| parameter));
    let columns: Vec<Parameter> = allowed.chain(laws.iter().map(|law| law.parameters()[0])).collect();
    let modes_hz = modes_hz(&problem, values);
    let Some(blocks) = modes_hz.and_then(|hz| weighed(context, &model, hz, &columns)) else { return Vec::new() };
    let of_column = |p: &Parameter| {
        let of_camera = OF_CAMERA.iter().find(|(parameter, _)| parameter == p).map(|(_, sd)| (0.0, *sd));
        let belief = context.beliefs.iter().find(|belief| belief.parameter == *p);
        let belief = belief.map(|belief| (belief.value, belief.sd));
        let from = if of_camera.is_some() { 0.0 } else { value(p) };
        Column { from, is_not_negative: p.is_not_negative(), belief: belief.or(of_camera) }
    };
    let squares = LeastSquares::of(blocks, columns.iter().map(of_column).collect());
    let asked = |set: Set| {
        let effects: Vec<Effect> = set.laws.iter().map(|law| laws[*law]).collect();
        let of_set = effects.iter().map(|effect| effect.parameters()[0]);
        let of_laws = of_set.zip(set.values[known.len() + OF_CAMERA.len()..].iter().copied());
        let start = known.iter().copied().zip(set.values.iter().copied()).chain(of_laws).collect();
        Asked { hypothesis: Hypothesis { effects, dropped: None }, start }
    };
    squares.best_sets(known.len() + OF_CAMERA.len(), each).into_iter().map(asked).collect()
}

/// Whether a law acts at every instant by a torque in proportion to its coefficient.
fn has_torque(effect: Effect) -> bool {
    let entry = effect.entry();
    matches!(entry.cost, Cost::Ordinary | Cost::Corners) && entry.acts != Acts::Motion && entry.place != Place::Camera
}

/// Torques and powers of all recordings, and their derivatives with some parameters; `None` where the frames do not show the motion.
fn weighed(
    context: &FitContext<'_>,
    model: &ForwardModel,
    [slowest_hz, fastest_hz]: [f64; 2],
    of: &[Parameter],
) -> Option<Vec<Block>> {
    let n = model.chain().count();
    if n != context.marks() {
        return None;
    }
    let (half_s, period_s) = (HALF_WIDTH / fastest_hz, 1.0 / slowest_hz);
    let yield_rad = context.yield_rad().0;
    let (mut by_link, mut power) = (vec![Vec::new(); n], Vec::new());
    for record in context.records {
        let instants = instants(model, record, half_s, yield_rad);
        let torques: Vec<(f64, DMatrix<f64>)> =
            instants.iter().map(|motion| (motion.t_s, torques(model, motion, of))).collect();
        for (link, rows) in by_link.iter_mut().enumerate() {
            bumps(&torques, half_s, |_, torques| torques.row(link).transpose(), rows);
        }
        let work =
            |k: usize, torques: &DMatrix<f64>| torques.tr_mul(&DVector::from_column_slice(&instants[k].rate[..n]));
        bumps(&torques, period_s, work, &mut power);
    }
    let blocks = by_link.into_iter().chain([power]).filter(|rows| rows.len() > 2 * of.len());
    let blocks: Vec<Block> = blocks.map(|rows| DMatrix::from_fn(rows.len(), of.len() + 1, |i, j| rows[i][j])).collect();
    (blocks.len() == n + 1).then_some(blocks)
}

/// f of the slowest and of the fastest mode with the base model's spring.
fn modes_hz(problem: &Problem<'_>, values: &[f64]) -> Option<[f64; 2]> {
    let mut experiment = problem.experiment.clone();
    if let Some(spring) = problem.free.iter().position(|p| *p == Parameter::JointStiffness) {
        experiment.model.k_eq_n_m_per_rad = values[spring];
    }
    let modes = undamped(&experiment)?;
    Some([modes.first()?.frequency_hz, modes.last()?.frequency_hz])
}

/// Q of every link and its derivatives, a row a link.
fn torques(model: &ForwardModel, motion: &Motion, of: &[Parameter]) -> DMatrix<f64> {
    let (n, m) = (model.chain().count(), model.rates());
    let (mut q, mut slope, mut partials) = (vec![0.0; m], vec![0.0; m], Partials::zero(n, m));
    model.torque(motion, &mut q);
    model.partials(motion, &mut partials);
    let mut all = DMatrix::zeros(n, of.len() + 1);
    (0..n).for_each(|link| all[(link, 0)] = q[link]);
    let theta = DVector::from_column_slice(&motion.theta_rad);
    let [rate, acceleration] = [&motion.rate, &motion.acceleration].map(|v| DVector::from_column_slice(&v[..n]));
    let by = |matrix: &DMatrix<f64>, vector: &DVector<f64>| matrix.view((0, 0), (n, n)) * vector;
    for (column, parameter) in of.iter().enumerate() {
        let slope = match parameter {
            Parameter::CameraTilt => -by(&partials.theta, &DVector::repeat(n, 1.0)),
            Parameter::AngleGain => {
                -by(&partials.theta, &theta) - by(&partials.rate, &rate) - by(&partials.acceleration, &acceleration)
            }
            _ => {
                model.sensitivity(*parameter, motion, &partials, &mut slope);
                DVector::from_column_slice(&slope[..n])
            }
        };
        all.column_mut(column + 1).copy_from(&slope);
    }
    all
}
