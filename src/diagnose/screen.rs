//! The screen: which effect would lower the residuals of a fit, judged by exact sensitivities with everything else that is free projected out.
//!
//! With residuals r and derivatives J of the fit's own variables, c of an effect's coefficient β (all over the noise), Q an orthonormal basis of J:
//!
//! ```text
//! c̃ = c − QQᵀc      β̂ = −c̃ᵀr/|c̃|²      z = β̂ |c̃|      Δχ² = z²      (Rao's score test)
//! ```
//!
//! Some laws have no such c at the outset, as frames may be missing at any instant, and a support move at any frequency: they are scanned ([`super::laws`]).

use nalgebra::{DMatrix, DMatrixView, DVector};

use super::context::FitContext;
use super::effect::Effect;
use super::hypothesis::Hypothesis;
use super::refit::Refit;
use crate::model::Parameter;

/// Of a column less than this is left by the projection: nothing can be said about it.
const NOTHING_LEFT: f64 = 1e-5;

/// What one effect promises.
#[derive(Debug, Clone)]
pub struct Score {
    /// The effect.
    pub effect: Effect,
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
        Some(Self::off(residual, slopes.select_columns(&loose(fit))))
    }

    /// Of a fit as if one of its effects were not there, in linear approximation.
    pub fn without(fit: &Refit<'_>, effect: Effect) -> Option<Self> {
        let (mut residual, slopes) = fit.linearised()?;
        let is_own = |i: &usize| fit.problem.free.get(*i).is_some_and(|own| effect.parameters().contains(own));
        let (own, others): (Vec<usize>, Vec<usize>) = loose(fit).into_iter().partition(is_own);
        own.into_iter().for_each(|i| residual.axpy(-fit.x[i], &slopes.column(i), 1.0));
        Some(Self::off(residual, slopes.select_columns(&others)))
    }

    /// Of residuals, with what some derivatives can change taken out.
    pub fn off(residual: DVector<f64>, mut slopes: DMatrix<f64>) -> Self {
        for mut column in slopes.column_iter_mut() {
            let size = column.norm();
            column /= size.max(1e-300);
        }
        let basis = slopes.qr().q();
        let residual = &residual - &basis * basis.tr_mul(&residual);
        Self { basis, residual }
    }

    /// c̃ of c.
    pub fn out(&self, columns: &DMatrix<f64>) -> DMatrix<f64> {
        let once = columns - &self.basis * self.basis.tr_mul(columns);
        &once - &self.basis * self.basis.tr_mul(&once)
    }
}

/// The variables of a fit that no bound holds.
fn loose(fit: &Refit<'_>) -> Vec<usize> {
    let lower = fit.problem.lower();
    (0..fit.x.len()).filter(|i| fit.x[*i] > lower[*i]).collect()
}

/// Scores effects at a fit.
pub struct Screen<'g, 'a> {
    /// What all fits share.
    pub context: &'g FitContext<'a>,
    /// The fit.
    pub fit: &'g Refit<'a>,
    /// Of the fit.
    pub projection: Projection,
}

impl<'g, 'a> Screen<'g, 'a> {
    /// At a fit.
    pub fn at(context: &'g FitContext<'a>, fit: &'g Refit<'a>) -> Option<Self> {
        Some(Self { context, fit, projection: Projection::of(fit)? })
    }

    /// At a fit, for what may stand in the place of one of its effects.
    pub fn in_place_of(context: &'g FitContext<'a>, fit: &'g Refit<'a>, effect: Effect) -> Option<Self> {
        Some(Self { context, fit, projection: Projection::without(fit, effect)? })
    }

    /// All effects that are proportional to a coefficient, from one motion with all their derivatives.
    pub fn of_coefficients(&self, effects: &[Effect], yield_rad: Option<f64>) -> Option<Vec<Score>> {
        if effects.is_empty() {
            return None;
        }
        let mut hypothesis = self.fit.hypothesis.clone();
        hypothesis.effects.extend(effects);
        let mut problem = self.context.problem_near(&hypothesis, self.fit).ok()?;
        if let (Some(law), Some(yield_rad)) = (&mut problem.experiment.model.effects.joint_hysteretic, yield_rad) {
            law.yield_rad = yield_rad;
        }
        // only the coefficients in proportion to which it acts count; the rest of a law keeps its value
        let of = |effect: &Effect| effect.parameters().iter().copied().filter(|p| p.is_proportional());
        let own = &self.fit.problem;
        problem.free = own.free.iter().copied().chain(effects.iter().flat_map(of)).collect();
        problem.dropped_at_s.clone_from(&own.dropped_at_s);
        // residuals are those of the fit: what is known of a further coefficient is none of them
        problem.beliefs.clone_from(&own.beliefs);
        let free = own.free.len();
        let mut x = self.fit.x[..free].to_vec();
        x.resize(problem.free.len(), 0.0);
        x.extend_from_slice(&self.fit.x[free..]);
        let blocks = problem.blocks(&x)?;
        let (_, slopes) = crate::fit::problem::stacked(&blocks, x.len());
        let mut first = free;
        let scored = effects.iter().filter_map(|effect| {
            let own: Vec<Parameter> = of(effect).collect();
            let columns = slopes.columns(first, own.len()).into_owned();
            first += own.len();
            self.score(*effect, columns, &own, None)
        });
        Some(scored.collect())
    }

    /// The score of some coefficients of one effect together.
    pub fn score(
        &self,
        effect: Effect,
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
        Some(Score { effect, start, further: Vec::new(), dropped, gain, sd: inverse[(0, 0)].sqrt(), columns })
    }

    /// Δχ² of some columns, without forming c̃.
    pub fn promise(&self, columns: &DMatrixView<'_, f64>) -> Option<f64> {
        let along = self.projection.basis.tr_mul(columns);
        let gram = columns.tr_mul(columns) - along.tr_mul(&along);
        let pull = columns.tr_mul(&self.projection.residual);
        Some(pull.dot(&(gram.try_inverse()? * &pull)))
    }
}

/// The hypothesis and start values a score leads to.
impl Score {
    /// The fit's hypothesis with this effect.
    pub fn hypothesis(&self, of: &Hypothesis) -> Hypothesis {
        of.and(self.effect, self.dropped)
    }
}
