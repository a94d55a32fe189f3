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
//! (Messenger and Bortz 2021, weak SINDy). The second kind is the power: what stores energy gives back over a period what it took, so that a geometry that is a little
//! wrong leaves the losses clear. Each kind counts over what all laws together leave of it. No simulated motion can fall out of step with the recording, for there is none: so it points to sets of laws that a
//! search beside a poor base model does not come by. Smoothing costs what a simulation of the whole recording does not: it proposes, and proves nothing.

use nalgebra::{DMatrix, DVector};

use super::context::FitContext;
use super::effect::{Acts, Cost, Effect, Place};
use super::hypothesis::Hypothesis;
use super::refit::Refit;
use crate::fit::begin::undamped;
use crate::fit::{Problem, Record};
use crate::model::{ForwardModel, Motion, Parameter, Partials};
use crate::statistics::median;

/// Half the width of a window of smoothing, and of a bump, in periods of the fastest mode: a polynomial of the fifth power follows half a period.
const HALF_WIDTH: f64 = 0.25;
/// Coefficients of that polynomial.
const POWERS: usize = 6;
/// Fewest values in a window: two more than the polynomial has coefficients.
const FEWEST: usize = POWERS + 2;
/// A window's values reach at least this far to both sides, as a part of its half width.
const REACHES: f64 = 0.7;
/// A bump holds this part of the rows that it would without gaps.
const SEEN: f64 = 0.8;
/// How often the kinds of rows are put over what is left of them.
const REWEIGHTED: usize = 4;
/// Errors of the camera or the encoder that every set may have beside its laws, with their standard deviations: an offset (rad) and a gain.
const OF_CAMERA: [(Parameter, f64); 2] = [(Parameter::CameraTilt, 0.01), (Parameter::AngleGain, 0.02)];
/// Most laws of one set.
const MOST_LAWS: usize = 3;

/// A set of laws that the weak form asks for.
#[derive(Debug, Clone)]
pub struct Asked {
    /// The laws.
    pub hypothesis: Hypothesis,
    /// Their coefficients, and the base model's.
    pub start: Vec<(Parameter, f64)>,
    /// What they leave of the weighed torques that the base model leaves.
    pub leaves: f64,
}

/// Weighed torques of one kind: a row a bump, the base model's first, then the derivatives with each parameter.
type Block = DMatrix<f64>;

/// The sets of laws that leave least, those of most laws first: `each` of the largest number that is worth its coefficients, and the best of every smaller one.
///
/// Empty where the frames do not resolve the fastest mode, and for a strip whose marks do not show every link.
pub fn asked_for(context: &FitContext<'_>, base: &Refit<'_>, effects: &[Effect], each: usize) -> Vec<Asked> {
    let laws: Vec<Effect> = effects.iter().copied().filter(|effect| has_torque(*effect)).collect();
    let of_all = Hypothesis { effects: laws.clone(), dropped: None };
    let Ok(problem) = context.problem(&of_all, &base.problem.noise) else { return Vec::new() };
    let value = |p: &Parameter| base.value(*p).unwrap_or(0.0);
    let known: Vec<Parameter> = context.base.iter().copied().filter(|p| !is_of_camera(*p)).collect();
    let allowed = known.iter().copied().chain(OF_CAMERA.map(|(parameter, _)| parameter));
    let columns: Vec<Parameter> = allowed.chain(laws.iter().map(|law| law.parameters()[0])).collect();
    let start = |p: &Parameter| if known.contains(p) { value(p) } else { start_of(&problem, *p) };
    let values: Vec<f64> = problem.free.iter().map(start).collect();
    let Some(blocks) = weighed(context, &problem, &values, &columns) else { return Vec::new() };
    let of_column = |p: &Parameter| {
        let of_camera = OF_CAMERA.iter().find(|(parameter, _)| parameter == p).map(|(_, sd)| (0.0, *sd));
        let belief = context.beliefs.iter().find(|belief| belief.parameter == *p);
        let belief = belief.map(|belief| (belief.value, belief.sd));
        Column {
            from: if known.contains(p) { value(p) } else { 0.0 },
            is_not_negative: p.is_not_negative(),
            belief: belief.or(of_camera),
        }
    };
    let squares = LeastSquares::of(blocks, columns.iter().map(of_column).collect());
    let asked = |(set, solution, leaves): (Vec<usize>, Vec<f64>, f64)| {
        let effects: Vec<Effect> = set.iter().map(|law| laws[*law]).collect();
        let of_set = effects.iter().map(|effect| effect.parameters()[0]);
        let of_laws = of_set.zip(solution[known.len() + OF_CAMERA.len()..].iter().copied());
        let start = known.iter().copied().zip(solution.iter().copied()).chain(of_laws).collect();
        Asked { hypothesis: Hypothesis { effects, dropped: None }, start, leaves }
    };
    squares.best_sets(known.len() + OF_CAMERA.len(), each).into_iter().map(asked).collect()
}

/// Whether a law acts at every instant by a torque in proportion to its coefficient.
fn has_torque(effect: Effect) -> bool {
    let entry = effect.entry();
    matches!(entry.cost, Cost::Ordinary | Cost::Corners) && entry.acts != Acts::Motion && entry.place != Place::Camera
}

fn is_of_camera(parameter: Parameter) -> bool {
    matches!(
        parameter,
        Parameter::TimeBase
            | Parameter::DroppedFrames
            | Parameter::CameraTilt
            | Parameter::AngleGain
            | Parameter::DifferentialLag
    )
}

/// A law that is off has no torque; what only shapes a law keeps its value.
fn start_of(problem: &Problem<'_>, parameter: Parameter) -> f64 {
    let believed = problem.beliefs.iter().find(|belief| belief.parameter == parameter);
    if parameter.is_proportional() { 0.0 } else { believed.map_or(0.0, |belief| belief.value) }
}

/// Torques and powers of all recordings, and their derivatives with some parameters; `None` where the frames do not show the motion.
fn weighed(context: &FitContext<'_>, problem: &Problem<'_>, values: &[f64], of: &[Parameter]) -> Option<Vec<Block>> {
    let (model, _) = problem.model(0, values).ok()?;
    let n = model.chain().count();
    if n != context.marks() {
        return None;
    }
    let [slowest_hz, fastest_hz] = modes_hz(problem, values)?;
    let (half_s, period_s) = (HALF_WIDTH / fastest_hz, 1.0 / slowest_hz);
    let yield_rad = context.yield_rad().0;
    let (mut by_link, mut power) = (vec![Vec::new(); n], Vec::new());
    for record in context.records {
        let instants = instants(&model, record, half_s, yield_rad);
        let torques: Vec<(f64, DMatrix<f64>)> =
            instants.iter().map(|motion| (motion.t_s, torques(&model, motion, of))).collect();
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

/// The motion at every row where it is seen to both sides.
fn instants(model: &ForwardModel, record: &Record, half_s: f64, yield_rad: f64) -> Vec<Motion> {
    let n = model.chain().count();
    let mut worked = vec![0.0; model.rates() - n];
    let mut before: Option<Vec<f64>> = None;
    let mut instants = Vec::new();
    for row in 0..record.len() {
        let smooth: Option<Vec<[f64; 3]>> =
            record.theta_rad.iter().map(|angles| smoothed(&record.t_s, angles, row, half_s)).collect();
        let Some(smooth) = smooth else { continue };
        let theta: Vec<f64> = smooth.iter().map(|s| s[0]).collect();
        if let Some(before) = &before {
            for (joint, z) in worked.iter_mut().enumerate() {
                let bend = |angles: &[f64]| angles[joint + 1] - angles[joint];
                *z = worked_by(*z, (bend(&theta) - bend(before)) / yield_rad);
            }
        }
        let rates: Vec<f64> = smooth.iter().map(|s| s[1]).chain(worked.iter().copied()).collect();
        let mut motion = model.motion(record.t_s[row], &theta, &rates);
        smooth.iter().enumerate().for_each(|(link, s)| motion.acceleration[link] = s[2]);
        instants.push(motion);
        before = Some(theta);
    }
    instants
}

/// z of Bouc and Wen's law after its spring has been worked by a part of the yield angle: dz = (1 − ½(sgn Δ̇ + sgn z) z) dΔ/Δ_y, solved.
fn worked_by(z: f64, bent: f64) -> f64 {
    let (towards, size) = (bent.signum(), bent.abs());
    let along = z * towards;
    let after = if along + size <= 0.0 {
        along + size
    } else {
        let (from, left) = if along < 0.0 { (0.0, size + along) } else { (along, size) };
        1.0 - (1.0 - from) * (-left).exp()
    };
    after * towards
}

/// An angle, its rate and its acceleration at a row, by the polynomial through the values around it.
fn smoothed(t_s: &[f64], angles: &[Option<f64>], row: usize, half_s: f64) -> Option<[f64; 3]> {
    let at = |i: usize| (t_s[i] - t_s[row]) / half_s;
    let below = (0..row).rev().take_while(|i| at(*i) >= -1.0);
    let above = (row..t_s.len()).take_while(|i| at(*i) <= 1.0);
    let values: Vec<(f64, f64)> = below.chain(above).filter_map(|i| Some((at(i), angles[i]?))).collect();
    let reach = values.iter().fold([0.0f64; 2], |[low, high], (x, _)| [low.min(*x), high.max(*x)]);
    if values.len() < FEWEST || -reach[0] < REACHES || reach[1] < REACHES {
        return None;
    }
    let (mut normal, mut right) = (DMatrix::<f64>::zeros(POWERS, POWERS), DVector::<f64>::zeros(POWERS));
    for (x, value) in values {
        let powers = DVector::from_fn(POWERS, |k, _| x.powi(k as i32));
        let weight = (1.0 - x.abs().powi(3)).max(0.0) + 1e-3;
        normal.ger(weight, &powers, &powers, 1.0);
        right.axpy(weight * value, &powers, 1.0);
    }
    let fitted = normal.cholesky()?.solve(&right);
    Some([fitted[0], fitted[1] / half_s, 2.0 * fitted[2] / (half_s * half_s)])
}

/// Weighs what is made of the torques at each instant by bumps that overlap by half.
fn bumps(
    at: &[(f64, DMatrix<f64>)],
    half_s: f64,
    of: impl Fn(usize, &DMatrix<f64>) -> DVector<f64>,
    rows: &mut Vec<DVector<f64>>,
) {
    let (Some(first), Some(last)) = (at.first(), at.last()) else { return };
    let mut steps_s: Vec<f64> = at.windows(2).map(|pair| pair[1].0 - pair[0].0).collect();
    let Some(step_s) = median(&mut steps_s) else { return };
    let expected = 2.0 * half_s / step_s;
    let count = ((last.0 - first.0) / half_s) as usize;
    for bump in 1..count {
        let centre_s = first.0 + bump as f64 * half_s;
        let from = at.partition_point(|(t_s, _)| *t_s < centre_s - half_s);
        let within = (from..at.len()).take_while(|k| at[*k].0 <= centre_s + half_s);
        let (mut sum, mut weight, mut seen) = (DVector::zeros(first.1.ncols()), 0.0, 0.0);
        for k in within {
            let phi = (1.0 - ((at[k].0 - centre_s) / half_s).powi(2)).max(0.0).powi(3);
            sum.axpy(phi, &of(k, &at[k].1), 1.0);
            weight += phi;
            seen += 1.0;
        }
        // a gap would be no bump
        if seen > SEEN * expected && weight > 0.0 {
            rows.push(sum / weight);
        }
    }
}

/// A parameter among the least squares.
struct Column {
    /// The value around which the torques are linear.
    from: f64,
    is_not_negative: bool,
    /// Value and standard deviation, where something is known.
    belief: Option<(f64, f64)>,
}

/// Sums of squares of the weighed torques, each kind over what all laws together leave of it.
struct LeastSquares {
    /// XᵀX, in units in which its diagonal is one.
    normal: DMatrix<f64>,
    /// −Xᵀy.
    right: DVector<f64>,
    /// |y|².
    whole: f64,
    /// Norms of the columns of X.
    sizes: Vec<f64>,
    columns: Vec<Column>,
    rows: usize,
}

impl LeastSquares {
    fn of(mut blocks: Vec<Block>, columns: Vec<Column>) -> Self {
        let rms = |block: &Block, change: &[f64]| {
            let left = block.column(0) + block.columns(1, change.len()) * DVector::from_column_slice(change);
            (left.norm_squared() / left.len() as f64).sqrt()
        };
        let count = columns.len();
        let raw: Vec<f64> = blocks.iter().map(|block| rms(block, &vec![0.0; count])).collect();
        let mut scale = raw.clone();
        let mut squares = Self::summed(&mut blocks, &scale, columns);
        let all: Vec<usize> = (0..count).collect();
        for _ in 0..REWEIGHTED {
            let Some((solution, _)) = squares.solved(&all) else { break };
            let change: Vec<f64> = solution.iter().zip(&squares.columns).map(|(value, own)| value - own.from).collect();
            // the blocks are over their scale
            let left: Vec<f64> = blocks.iter().map(|block| rms(block, &change)).collect();
            let factor: Vec<f64> =
                left.iter().zip(&scale).zip(&raw).map(|((l, s), raw)| (l * s).max(1e-3 * raw) / s).collect();
            scale.iter_mut().zip(&factor).for_each(|(scale, factor)| *scale *= factor);
            squares = Self::summed(&mut blocks, &factor, squares.columns);
        }
        squares
    }

    /// The sums, the blocks first put over some scale.
    fn summed(blocks: &mut [Block], scale: &[f64], columns: Vec<Column>) -> Self {
        let count = columns.len();
        blocks.iter_mut().zip(scale).for_each(|(block, scale)| *block /= scale.max(1e-300));
        let mut all = DMatrix::<f64>::zeros(count + 1, count + 1);
        blocks.iter().for_each(|block| all += block.tr_mul(block));
        let sizes: Vec<f64> = (1..=count).map(|k| all[(k, k)].sqrt().max(1e-300)).collect();
        Self {
            normal: DMatrix::from_fn(count, count, |a, b| all[(a + 1, b + 1)] / (sizes[a] * sizes[b])),
            right: DVector::from_fn(count, |a, _| -all[(a + 1, 0)] / sizes[a]),
            whole: all[(0, 0)],
            sizes,
            columns,
            rows: blocks.iter().map(|block| block.nrows()).sum(),
        }
    }

    /// Values of some columns' parameters, and χ². What would fall below zero, and may not, is zero.
    fn solved(&self, of: &[usize]) -> Option<(Vec<f64>, f64)> {
        let mut at_bound: Vec<usize> = Vec::new();
        loop {
            let (change, chi2) = self.solved_with(of, &at_bound)?;
            let value = |(own, change): (&usize, &f64)| self.columns[*own].from + change;
            let values: Vec<f64> = of.iter().zip(&change).map(value).collect();
            let below = of
                .iter()
                .zip(&values)
                .find(|(own, value)| self.columns[**own].is_not_negative && **value < 0.0 && !at_bound.contains(*own));
            match below {
                Some((own, _)) => at_bound.push(*own),
                None => return Some((values, chi2)),
            }
        }
    }

    /// The same with some of them at zero: changes, in the parameters' units.
    fn solved_with(&self, of: &[usize], at_bound: &[usize]) -> Option<(Vec<f64>, f64)> {
        let free: Vec<usize> = of.iter().copied().filter(|own| !at_bound.contains(own)).collect();
        let count = free.len();
        let mut normal = DMatrix::from_fn(count, count, |a, b| self.normal[(free[a], free[b])]);
        let mut right = DVector::from_fn(count, |a, _| self.right[free[a]]);
        let mut whole = self.whole;
        let bound: Vec<(usize, f64)> = at_bound.iter().map(|k| (*k, -self.columns[*k].from * self.sizes[*k])).collect();
        for (k, change) in &bound {
            (0..count).for_each(|a| right[a] -= self.normal[(free[a], *k)] * change);
            whole -= 2.0 * self.right[*k] * change;
            whole += bound.iter().map(|(other, beside)| self.normal[(*k, *other)] * change * beside).sum::<f64>();
        }
        for (own, k) in free.iter().enumerate() {
            normal[(own, own)] += 1e-10;
            if let Some((known, sd)) = self.columns[*k].belief {
                let [off, sd] = [self.columns[*k].from - known, sd].map(|value| value * self.sizes[*k]);
                normal[(own, own)] += 1.0 / (sd * sd);
                right[own] -= off / (sd * sd);
                whole += (off / sd).powi(2);
            }
        }
        let solution = normal.cholesky()?.solve(&right);
        let chi2 = (whole - solution.dot(&right)).max(0.0);
        let change = |own: &usize| match free.iter().position(|k| k == own) {
            Some(place) => solution[place] / self.sizes[*own],
            None => -self.columns[*own].from,
        };
        Some((of.iter().map(change).collect(), chi2))
    }

    /// The sets of laws that leave least; the first `known` columns are the base model's, every other one is a law.
    fn best_sets(&self, known: usize, each: usize) -> Vec<(Vec<usize>, Vec<f64>, f64)> {
        let base: Vec<usize> = (0..known).collect();
        let Some((_, nothing)) = self.solved(&base) else { return Vec::new() };
        let mut found: Vec<Vec<(Vec<usize>, Vec<f64>, f64)>> = Vec::new();
        let mut before = nothing;
        let mut sets: Vec<Vec<usize>> = vec![Vec::new()];
        for _ in 0..MOST_LAWS {
            let with_one_more = |set: &Vec<usize>| {
                let (set, next) = (set.clone(), set.last().map_or(0, |last| last + 1));
                (next..self.columns.len() - known).map(move |law| [set.as_slice(), &[law]].concat())
            };
            sets = sets.iter().flat_map(with_one_more).collect();
            let solved = |set: &Vec<usize>| {
                let columns: Vec<usize> = base.iter().copied().chain(set.iter().map(|law| known + law)).collect();
                let (values, chi2) = self.solved(&columns)?;
                // a law at its bound is none
                let acts = values[known..].iter().all(|value| *value != 0.0);
                acts.then(|| (set.clone(), values, chi2))
            };
            let mut solved: Vec<(Vec<usize>, Vec<f64>, f64)> = sets.iter().filter_map(solved).collect();
            solved.sort_by(|a, b| a.2.total_cmp(&b.2));
            // Schwarz's criterion; neighbouring bumps overlap by half
            let Some(least) = solved.first().map(|(_, _, chi2)| *chi2) else { break };
            if 0.5 * (before - least) < (0.5 * self.rows as f64).ln() {
                break;
            }
            before = least;
            solved.truncate(each);
            found.push(solved.into_iter().map(|(set, values, chi2)| (set, values, chi2 / nothing)).collect());
        }
        found.iter_mut().rev().skip(1).for_each(|smaller| smaller.truncate(1));
        found.into_iter().rev().flatten().collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_polynomial_of_the_fifth_power_is_smoothed_to_itself() {
        let t_s: Vec<f64> = (0..21).map(|k| 0.1 * f64::from(k)).collect();
        let of = |t: f64| 0.3 - t + 0.5 * t.powi(3) - 0.2 * t.powi(5);
        let angles: Vec<Option<f64>> = t_s.iter().enumerate().map(|(k, t)| (k != 9).then_some(of(*t))).collect();
        let [angle, rate, acceleration] = smoothed(&t_s, &angles, 10, 0.5).unwrap();
        assert!((angle - of(1.0)).abs() < 1e-9 && (rate - (-1.0 + 1.5 - 1.0)).abs() < 1e-8);
        assert!((acceleration - (3.0 - 4.0)).abs() < 1e-6, "{acceleration}");
        // seen to one side alone
        assert!(smoothed(&t_s, &angles, 1, 0.5).is_none());
    }

    #[test]
    fn a_joint_is_worked_as_the_law_of_bouc_and_wen_has_it() {
        let (mut exact, mut stepped) = (-0.3, -0.3);
        for bent in [0.2, 1.4, -0.5, -2.5, 0.7] {
            exact = worked_by(exact, bent);
            let steps = 100_000;
            for _ in 0..steps {
                let d: f64 = bent / f64::from(steps);
                stepped += d * (1.0 - 0.5 * (d.signum() + f64::signum(stepped)) * stepped);
            }
            assert!((exact - stepped).abs() < 1e-4, "{bent}: {exact} {stepped}");
        }
    }

    #[test]
    fn the_laws_at_work_leave_least_and_a_negative_damper_is_none() {
        let rows = 400;
        let wave = |k: usize, n: f64| (0.1 * n * k as f64 + n).sin();
        let slopes = DMatrix::from_fn(rows, 4, |k, column| wave(k, 1.0 + column as f64));
        // the base model's own parameter, dry friction and quadratic drag at work, linear drag not
        let torque = DVector::from_fn(rows, |k, _| {
            -(0.5 * wave(k, 1.0) + 2.0 * wave(k, 2.0) - 3.0 * wave(k, 3.0) + 1.0 * wave(k, 4.0)) + 1e-3 * wave(k, 17.0)
        });
        let column = |from: f64| Column { from, is_not_negative: true, belief: None };
        let block = slopes.insert_column(0, 0.0);
        let block = DMatrix::from_fn(rows, 5, |i, j| if j == 0 { torque[i] } else { block[(i, j)] });
        let squares = LeastSquares::of(vec![block], vec![column(1.0), column(0.0), column(0.0), column(0.0)]);
        let sets = squares.best_sets(1, 1);
        let best = &sets[0];
        assert_eq!(best.0, [0, 2]);
        assert!((best.1[1] - 2.0).abs() < 0.1 && (best.1[2] - 1.0).abs() < 0.1, "{:?}", best.1);
    }
}
