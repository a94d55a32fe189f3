//! The screen: which effect would lower the residuals of a fit, judged by exact sensitivities with everything else that is free projected out.
//!
//! With residuals r and derivatives J of the fit's own variables, c of an effect's coefficient β (all over the noise), Q an orthonormal basis of J:
//!
//! ```text
//! c̃ = c − QQᵀc      β̂ = −c̃ᵀr/|c̃|²      z = β̂ |c̃|      Δχ² = z²      (Rao's score test)
//! ```
//!
//! Two laws have no such c at the outset: frames may be missing at any instant, and the support may move at any frequency. Both are scanned.

use nalgebra::{DMatrix, DMatrixView, DVector};
use rayon::prelude::*;

use super::Cause;
use super::ground::{Ground, Hypothesis};
use super::refit::Refit;
use super::surroundings::Surroundings;
use crate::fit::whitening::Whitening;
use crate::model::Parameter;

/// Of a column less than this is left by the projection: nothing can be said about it.
const NOTHING_LEFT: f64 = 1e-5;
/// Yield angles of the joint's hysteresis, as parts of the largest bend.
const YIELDS: [f64; 3] = [0.03, 0.15, 0.6];
/// Frequencies of a moving support: this fine for the length of the recording.
const PER_RESOLUTION: f64 = 1.0;
/// Frequencies that are followed side by side.
const AT_ONCE: usize = 8;
/// Peaks over the frequency that are kept beside the highest.
const FURTHER_PEAKS: usize = 4;
/// Lowest and highest frequency of a moving support, in units of the swing's. A slower one only leans, and has to move by metres to do so.
pub(super) const LOWEST: f64 = 0.1;
const HIGHEST: f64 = 8.0;

/// What one effect promises.
#[derive(Debug, Clone)]
pub struct Score {
    /// The effect.
    pub cause: Cause,
    /// Values of its coefficients.
    pub start: Vec<(Parameter, f64)>,
    /// Other values that promise something, where a scan has several peaks.
    pub further: Vec<Vec<(Parameter, f64)>>,
    /// Where frames are missing.
    pub dropped: Option<(usize, f64)>,
    /// Fall of χ² in linear approximation.
    pub gain: f64,
    /// Standard deviation of the first coefficient.
    pub sd: f64,
    /// c̃ of the effect, one column a coefficient that counts.
    pub columns: DMatrix<f64>,
}

/// Residuals of a fit with what its variables can change taken out.
#[derive(Debug, Clone)]
pub struct Projection {
    /// Orthonormal basis of the derivatives.
    pub basis: DMatrix<f64>,
    /// Residuals (predicted less measured) over the noise.
    pub residual: DVector<f64>,
}

impl Projection {
    /// Of a fit. Variables held by their bound do not count.
    pub fn of(fit: &Refit<'_>) -> Option<Self> {
        let (residual, slopes) = fit.linearised()?;
        Some(Self::new(residual, slopes, fit))
    }

    fn new(residual: DVector<f64>, slopes: DMatrix<f64>, fit: &Refit<'_>) -> Self {
        let lower = fit.problem.lower();
        let loose: Vec<usize> = (0..fit.x.len()).filter(|i| fit.x[*i] > lower[*i]).collect();
        let mut kept = slopes.select_columns(&loose);
        for mut column in kept.column_iter_mut() {
            let size = column.norm();
            column /= size.max(1e-300);
        }
        let basis = kept.qr().q();
        let residual = &residual - &basis * basis.tr_mul(&residual);
        Self { basis, residual }
    }

    /// c̃ of c.
    pub fn out(&self, columns: &DMatrix<f64>) -> DMatrix<f64> {
        let once = columns - &self.basis * self.basis.tr_mul(columns);
        &once - &self.basis * self.basis.tr_mul(&once)
    }
}

/// Scores effects at a fit.
pub struct Screen<'g, 'a> {
    ground: &'g Ground<'a>,
    fit: &'g Refit<'a>,
    /// Of the fit.
    pub projection: Projection,
}

impl<'g, 'a> Screen<'g, 'a> {
    /// At a fit.
    pub fn at(ground: &'g Ground<'a>, fit: &'g Refit<'a>) -> Option<Self> {
        Some(Self { ground, fit, projection: Projection::of(fit)? })
    }

    /// The score of each effect that says anything; effects of the fit's own hypothesis are left out.
    pub fn scores(&self, causes: &[Cause]) -> Vec<Score> {
        let further: Vec<Cause> = causes.iter().copied().filter(|c| !self.fit.hypothesis.causes.contains(c)).collect();
        let smooth: Vec<Cause> =
            further.iter().copied().filter(|c| !c.is_scanned() && *c != Cause::DistributedFlexibility).collect();
        // every corner of a hysteresis ends a step, which the others need not suffer
        let (kinked, smooth): (Vec<Cause>, Vec<Cause>) = smooth.into_iter().partition(|c| *c == Cause::JointHysteretic);
        let yields_rad = if self.ground.has_spring() {
            YIELDS.map(|share| share * self.ground.largest_bend_rad()).to_vec()
        } else {
            vec![self.ground.yield_rad().0]
        };
        let of_yield = |yield_rad: &f64| {
            let mut score = self.of_coefficients(&kinked, Some(*yield_rad))?.pop()?;
            score.start.push((Parameter::HysteresisYield, *yield_rad));
            Some(score)
        };
        let of_yields = || yields_rad.par_iter().with_max_len(1).filter_map(of_yield).collect::<Vec<Score>>();
        let ((smooth, yields), (dropped, support)) = rayon::join(
            || rayon::join(|| self.of_coefficients(&smooth, None).unwrap_or_default(), of_yields),
            || {
                rayon::join(
                    || further.contains(&Cause::DroppedFrames).then(|| self.of_dropped_frames()).flatten(),
                    || further.contains(&Cause::SupportMotion).then(|| self.of_support()).flatten(),
                )
            },
        );
        let hysteresis = yields.into_iter().max_by(|a, b| a.gain.total_cmp(&b.gain));
        smooth.into_iter().chain(hysteresis).chain(dropped).chain(support).collect()
    }

    /// All effects that are proportional to a coefficient, from one motion with all their derivatives.
    fn of_coefficients(&self, causes: &[Cause], yield_rad: Option<f64>) -> Option<Vec<Score>> {
        if causes.is_empty() {
            return None;
        }
        let mut hypothesis = self.fit.hypothesis.clone();
        hypothesis.causes.extend(causes);
        let mut problem = self.ground.problem(&hypothesis).ok()?;
        if let (Some(law), Some(yield_rad)) = (&mut problem.experiment.model.effects.joint_hysteretic, yield_rad) {
            law.yield_rad = yield_rad;
        }
        // only the first coefficient of each counts; the rest of a law keeps its value
        let first: Vec<Parameter> = causes.iter().map(|c| c.parameters()[0]).collect();
        let own = &self.fit.problem;
        problem.free = own.free.iter().copied().chain(first.iter().copied()).collect();
        problem.dropped_at_s.clone_from(&own.dropped_at_s);
        let (free, added) = (own.free.len(), first.len());
        let mut x = self.fit.x[..free].to_vec();
        x.extend(vec![0.0; added]);
        x.extend_from_slice(&self.fit.x[free..]);
        let blocks = problem.blocks(&x)?;
        let (_, slopes) = crate::fit::problem::stacked(&blocks, x.len());
        let scored = causes.iter().enumerate().filter_map(|(k, cause)| {
            let column = slopes.columns(free + k, 1).into_owned();
            self.score(*cause, column, &first[k..=k], None)
        });
        Some(scored.collect())
    }

    /// The score of some coefficients of one effect together.
    fn score(
        &self,
        cause: Cause,
        columns: DMatrix<f64>,
        of: &[Parameter],
        dropped: Option<(usize, f64)>,
    ) -> Option<Score> {
        let size = columns.norm();
        let columns = self.projection.out(&columns);
        if !(columns.norm() > NOTHING_LEFT * size) {
            return None;
        }
        let gram = columns.tr_mul(&columns);
        let inverse = gram.try_inverse()?;
        let pull = -columns.tr_mul(&self.projection.residual);
        let mut value = &inverse * &pull;
        let mut gain = pull.dot(&value);
        if of[0].is_not_negative() && value[0] < 0.0 {
            (value[0], gain) = (0.0, 0.0);
        }
        let start = of.iter().zip(value.iter()).map(|(p, v)| (*p, *v)).collect();
        Some(Score { cause, start, further: Vec::new(), dropped, gain, sd: inverse[(0, 0)].sqrt(), columns })
    }

    /// Frames missing before each row in turn: the angles after it are ahead.
    fn of_dropped_frames(&self) -> Option<Score> {
        let problem = &self.fit.problem;
        let values: usize = self.ground.values();
        let mut best: Option<(f64, usize, f64)> = None;
        let mut first = 0;
        let mut of_record = Vec::new();
        for (record, data) in problem.records.iter().enumerate() {
            let prediction = problem.predict(record, &self.fit.x, false).ok()?;
            let before = first;
            first += prediction.values.len();
            let rates: Vec<(f64, f64)> = prediction
                .values
                .iter()
                .map(|v| {
                    let sd = problem.sd_rad(record, v.link, v.row);
                    (data.t_s[v.row], v.rate_rad_s / sd)
                })
                .collect();
            of_record.push((before, prediction.values, rates));
        }
        for (record, data) in problem.records.iter().enumerate() {
            let (first, _, rates) = &of_record[record];
            let p = self.projection.basis.ncols();
            // sums over the rows from each instant on, by adding one instant after another from the last
            let mut order: Vec<usize> = (0..rates.len()).collect();
            order.sort_by(|a, b| rates[*b].0.total_cmp(&rates[*a].0));
            let (mut square, mut pull, mut along) = (0.0, 0.0, vec![0.0; p]);
            let mut k = 0;
            for row in (1..data.len()).rev() {
                while k < order.len() && rates[order[k]].0 >= data.t_s[row] {
                    let at = first + order[k];
                    let rate = rates[order[k]].1;
                    square += rate * rate;
                    pull += rate * self.projection.residual[at];
                    (0..p).for_each(|i| along[i] += rate * self.projection.basis[(at, i)]);
                    k += 1;
                }
                let left = square - along.iter().map(|a| a * a).sum::<f64>();
                if left > 1e-4 * square && k > 8 && k + 8 < order.len() {
                    let gain = pull * pull / left;
                    if best.is_none_or(|(most, _, _)| gain > most) {
                        // between the two rows
                        best = Some((gain, record, 0.5 * (data.t_s[row] + data.t_s[row - 1])));
                    }
                }
            }
        }
        let (_, record, at_s) = best?;
        let (first, seen, _) = &of_record[record];
        let data = &problem.records[record];
        let mut column = DMatrix::zeros(self.projection.residual.len().max(values), 1);
        let mut after: Vec<f64> =
            seen.iter().map(|v| if data.t_s[v.row] >= at_s { v.rate_rad_s } else { 0.0 }).collect();
        Whitening::of(problem, record, seen).whiten(&mut after);
        column.view_mut((*first, 0), (after.len(), 1)).copy_from_slice(&after);
        self.score(Cause::DroppedFrames, column, &[Parameter::DroppedFrames], Some((record, at_s)))
    }

    /// A support that moves at each frequency in turn.
    fn of_support(&self) -> Option<Score> {
        let problem = &self.fit.problem;
        let records = problem.records.len();
        let mut around = Vec::with_capacity(records);
        for record in 0..records {
            let (model, _) = problem.model(record, &self.fit.x[..problem.free.len()]).ok()?;
            let surroundings = Surroundings::of(self.fit, record)?;
            let transitions = surroundings.transitions_of_inputs(|k| {
                let theta_rad = &surroundings.rows[k].theta_rad;
                DMatrix::from_fn(theta_rad.len(), 1, |i, _| {
                    -surroundings.chain.static_moment_kg_m(i) * theta_rad[i].cos()
                })
            });
            around.push((surroundings, transitions, model.pace_rad_s()));
        }
        let span_s = around.iter().map(|(a, _, _)| a.t_s[a.t_s.len() - 1] - a.t_s[0]).fold(0.0, f64::max);
        let swing_hz = around[0].2 / std::f64::consts::TAU;
        let nyquist_hz = 0.5 * around.iter().map(|(a, _, _)| a.t_s.len() as f64).fold(0.0, f64::max) / span_s;
        let count = (PER_RESOLUTION * span_s * (HIGHEST * swing_hz).min(0.9 * nyquist_hz)) as usize;
        let hz = |k: usize| (k as f64 + 0.5) / (PER_RESOLUTION * span_s);
        let first = ((PER_RESOLUTION * span_s * LOWEST * swing_hz) as usize).max(1);
        let frequencies_hz: Vec<f64> = (first..count).map(hz).collect();
        let of_several = |several: &[f64]| {
            let columns = self.at_frequencies(&around, several);
            let promised = |(k, hz): (usize, &f64)| Some((self.promise(&columns.columns(2 * k, 2))?, *hz));
            several.iter().enumerate().filter_map(promised).collect::<Vec<_>>()
        };
        let promises: Vec<(f64, f64)> = frequencies_hz.chunks(AT_ONCE).flat_map(of_several).collect();
        let is_peak = |k: &usize| {
            let near = promises[k.saturating_sub(1)..promises.len().min(k + 2)].iter();
            near.map(|p| p.0).fold(f64::NEG_INFINITY, f64::max) <= promises[*k].0
        };
        let mut peaks: Vec<(f64, f64)> = (0..promises.len()).filter(is_peak).map(|k| promises[k]).collect();
        peaks.sort_by(|a, b| b.0.total_cmp(&a.0));
        let at = |hz: f64| {
            let columns = self.at_frequencies(&around, &[hz]).columns(0, 2).into_owned();
            let parameters = [Parameter::SupportSine, Parameter::SupportCosine];
            let mut score = self.score(Cause::SupportMotion, columns, &parameters, None)?;
            score.start.push((Parameter::SupportFrequency, hz));
            Some(score)
        };
        let mut score = at(peaks.first()?.1)?;
        let further = peaks.iter().skip(1).take(FURTHER_PEAKS).filter_map(|(_, hz)| at(*hz));
        score.further = further.map(|other| other.start).collect();
        Some(score)
    }

    /// Δχ² of some columns, without forming c̃.
    fn promise(&self, columns: &DMatrixView<'_, f64>) -> Option<f64> {
        let along = self.projection.basis.tr_mul(columns);
        let gram = columns.tr_mul(columns) - along.tr_mul(&along);
        let pull = columns.tr_mul(&self.projection.residual);
        Some(pull.dot(&(gram.try_inverse()? * &pull)))
    }

    /// Two columns each of a few frequencies.
    fn at_frequencies(
        &self,
        around: &[(Surroundings, Vec<DMatrix<f64>>, f64)],
        frequencies_hz: &[f64],
    ) -> DMatrix<f64> {
        let mut columns = DMatrix::zeros(self.projection.residual.len(), 2 * AT_ONCE);
        let mut first = 0;
        for (surroundings, transitions, _) in around {
            // the pivot's acceleration for one metre of sine, and of cosine
            let course = |pair: &[f64]| {
                let mut course = [0.0; 2 * AT_ONCE];
                for (both, frequency_hz) in course.chunks_exact_mut(2).zip(frequencies_hz) {
                    let rate = std::f64::consts::TAU * frequency_hz;
                    let (sin, cos) = (rate * 0.5 * (pair[0] + pair[1])).sin_cos();
                    both.copy_from_slice(&[-rate * rate * sin, -rate * rate * cos]);
                }
                [course]
            };
            let held: Vec<[[f64; 2 * AT_ONCE]; 1]> = surroundings.t_s.windows(2).map(course).collect();
            let seen = surroundings.seen(&surroundings.responses(transitions, &held));
            columns.rows_mut(first, seen.nrows()).copy_from(&seen);
            first += seen.nrows();
        }
        columns
    }
}

/// The hypothesis and start values a score leads to.
impl Score {
    /// The fit's hypothesis with this effect.
    pub fn hypothesis(&self, of: &Hypothesis) -> Hypothesis {
        of.and(self.cause, self.dropped)
    }
}
