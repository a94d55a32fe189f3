//! A hypothesis fitted to whole recordings.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};

use super::hypothesis::Hypothesis;
use super::settings::{CertificateSettings, MisfitSettings};
use crate::fit::descent::{Ending, Outcome};
use crate::fit::problem::stacked;
use crate::fit::{Problem, Residuals, recordings, residuals_of, rms_of_pieces};
use crate::model::{Camera, ForwardModel, Parameter, State, Trajectory};

/// A hypothesis fitted to the recordings, with the noise by which it was judged.
#[derive(Debug, Clone)]
pub struct Refit<'a> {
    /// What was assumed.
    pub hypothesis: Hypothesis,
    /// The model with its free parameters.
    pub problem: Problem<'a>,
    /// The free parameters, then each recording's start.
    pub x: Vec<f64>,
    /// Σr² over the noise, beliefs included.
    pub chi2: f64,
    /// JᵀJ.
    pub normal: DMatrix<f64>,
    /// Steps of the descent.
    pub steps: usize,
    /// Levenberg and Marquardt's damping at the end, to continue with.
    pub damping: f64,
    /// Whether the descent ended in a minimum.
    pub converged: bool,
    /// Evidence that this is the global minimum of the hypothesis.
    pub certificate: Certificate,
}

/// How far a fit may be trusted to be the best of its hypothesis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Certificate {
    /// Independent starts that ended there.
    pub starts_agreeing: usize,
    /// Whether it leaves no more than any fit of a hypothesis within its own.
    pub nested_ok: bool,
}

impl<'a> Refit<'a> {
    /// From the end of a descent.
    pub fn of(hypothesis: Hypothesis, problem: Problem<'a>, outcome: Outcome) -> Self {
        let Outcome { x, cost, normal, ending, steps, damping, .. } = outcome;
        Self {
            hypothesis,
            problem,
            x,
            chi2: cost,
            normal,
            steps,
            damping,
            converged: ending == Ending::Converged,
            certificate: Certificate { starts_agreeing: 1, nested_ok: true },
        }
    }

    /// The value of a free parameter.
    pub fn value(&self, parameter: Parameter) -> Option<f64> {
        self.place(parameter).map(|i| self.x[i])
    }

    /// Whether a problem only adds laws to this one's, about the same recordings with the same noise.
    pub fn is_part_of(&self, hypothesis: &Hypothesis, problem: &Problem<'_>) -> bool {
        let own = &self.hypothesis;
        own.is_within(hypothesis)
            && self.problem.free.iter().all(|parameter| problem.free.contains(parameter))
            && (own.dropped == hypothesis.dropped || own.dropped.is_none())
            && std::ptr::eq(self.problem.records, problem.records)
            && self.problem.noise == problem.noise
    }

    /// Where a free parameter stands among the variables.
    pub fn place(&self, parameter: Parameter) -> Option<usize> {
        self.problem.place(parameter)
    }

    /// The coefficients of the added effects, in the order of the effects.
    pub fn added(&self) -> Vec<Parameter> {
        self.hypothesis.effects.iter().flat_map(|effect| effect.parameters()).copied().collect()
    }

    /// How many there are.
    pub fn coefficients(&self) -> usize {
        self.hypothesis.effects.iter().map(|effect| effect.parameters().len()).sum()
    }

    /// The covariance of some of the parameters, all other variables being free: the inverse of JᵀJ, of which variables held by their bound
    /// are left out.
    pub fn covariance(&self, of: &[Parameter]) -> DMatrix<f64> {
        let places: Vec<usize> = of.iter().filter_map(|p| self.place(*p)).collect();
        let lower = self.problem.lower();
        let loose: Vec<usize> = (0..self.x.len()).filter(|i| places.contains(i) || self.x[*i] > lower[*i]).collect();
        let scale = |i: usize| self.normal[(i, i)].max(1e-300).sqrt();
        let count = loose.len();
        let mut unit = DMatrix::from_fn(count, count, |a, b| {
            self.normal[(loose[a], loose[b])] / (scale(loose[a]) * scale(loose[b]))
        });
        (0..count).for_each(|i| unit[(i, i)] += 1e-13);
        let inverse = unit.cholesky().map(|c| c.inverse()).unwrap_or_else(|| DMatrix::identity(count, count) * 1e13);
        let at = |place: usize| loose.iter().position(|i| *i == place).unwrap_or(0);
        DMatrix::from_fn(places.len(), places.len(), |a, b| {
            inverse[(at(places[a]), at(places[b]))] / (scale(places[a]) * scale(places[b]))
        })
    }

    /// The model, its motion through a recording, and the true time of every row.
    pub fn motion(&self, record: usize) -> Option<(ForwardModel, Trajectory, Vec<f64>)> {
        let problem = &self.problem;
        let (model, camera) = problem.model(record, &self.x[..problem.free.len()]).ok()?;
        let data = &problem.records[record];
        let state = State::begun(&model, problem.start(&self.x, record));
        let camera = Camera { origin_s: data.t_s[0], ..camera };
        let true_s: Vec<f64> = data.t_s.iter().map(|t| camera.true_time_s(*t, 0)).collect();
        let span_s = (true_s[0], true_s[data.len() - 1] + 1e-9);
        let swing = Trajectory::with(&model, &state, span_s, None, &problem.accuracy).ok()?;
        Some((model, swing, true_s))
    }

    /// The relative residual of the worst recording: root mean square of the residual over that of the angles.
    pub fn relative_residual(&self) -> f64 {
        (0..self.problem.records.len()).map(|record| self.relative_residual_of(record)).fold(0.0, f64::max)
    }

    /// Whether its motion has lost step with a recording: what is left is a good part of the swing.
    pub fn has_lost_step(&self, settings: &MisfitSettings) -> bool {
        self.relative_residual() > settings.out_of_step
    }

    /// The same of one recording.
    pub fn relative_residual_of(&self, record: usize) -> f64 {
        let Ok(prediction) = self.problem.predict(record, &self.x, false) else { return f64::INFINITY };
        let data = &self.problem.records[record];
        let (mut left, mut whole) = (0.0, 0.0);
        for value in &prediction.values {
            let measured_rad = data.theta_rad[value.link][value.row].unwrap_or(value.predicted_rad);
            left += (measured_rad - value.predicted_rad).powi(2);
            whole += measured_rad * measured_rad;
        }
        (left / whole.max(1e-300)).sqrt()
    }

    /// What it leaves of the first recording, in however many pieces.
    pub fn residuals_of_first(&self) -> Option<Residuals> {
        self.residuals_of(recordings(self.problem.records).into_iter().next()?)
    }

    /// What it leaves of the pieces of a recording.
    pub fn residuals_of(&self, pieces: Range<usize>) -> Option<Residuals> {
        Residuals::joined(pieces.map(|piece| self.residuals(piece)).collect::<Option<_>>()?)
    }

    /// What it leaves of a record.
    pub fn residuals(&self, record: usize) -> Option<Residuals> {
        residuals_of(&self.problem, &self.x, record).ok()
    }

    /// χ² of each value, and no less than that of noise: by so much more than the noise its residuals scatter.
    pub fn variance_ratio(&self) -> f64 {
        (self.chi2 / self.values().max(1) as f64).max(1.0)
    }

    /// What it leaves of the angles, over their noise: root mean squares, of the worst recording.
    pub fn over_noise(&self) -> f64 {
        let of = |pieces: Range<usize>| {
            let Some(left) = self.residuals_of(pieces) else { return 0.0 };
            let squares = left.rmse_rad.iter().zip(&left.noise_rad).map(|(left, noise)| (left / noise).powi(2));
            (squares.sum::<f64>() / left.rmse_rad.len().max(1) as f64).sqrt()
        };
        recordings(self.problem.records).into_iter().map(of).fold(0.0, f64::max)
    }

    /// Number of values.
    pub fn values(&self) -> usize {
        self.problem.records.iter().map(|r| r.values(0..r.len())).sum()
    }

    /// Noise of each angle of the recording that begins with a record.
    pub fn noise_rad(&self, first: usize) -> Vec<f64> {
        let pieces = recordings(self.problem.records).into_iter().find(|pieces| pieces.start == first);
        let of_piece = |piece: usize| &self.problem.noise[piece].sd_rad[..];
        pieces.map(|pieces| rms_of_pieces(&pieces.map(of_piece).collect::<Vec<_>>())).unwrap_or_default()
    }

    /// Whether it counts: it has converged, enough independent starts end there, and it leaves no more than what is within it.
    pub fn is_certified(&self, settings: &CertificateSettings) -> bool {
        self.converged && self.certificate.nested_ok && self.certificate.starts_agreeing >= settings.starts
    }

    /// Becomes the better one of itself and another fit of the same hypothesis.
    pub fn meet(&mut self, other: Self, agrees: f64) {
        let starts = match self.agrees_with(&other, agrees) {
            true => self.certificate.starts_agreeing + other.certificate.starts_agreeing,
            false if other.chi2 < self.chi2 => other.certificate.starts_agreeing,
            false => self.certificate.starts_agreeing,
        };
        if other.chi2 < self.chi2 {
            *self = other;
        }
        self.certificate.starts_agreeing = starts.max(1);
    }

    /// Whether two fits leave the same within so many times the variance left.
    fn agrees_with(&self, other: &Self, agrees: f64) -> bool {
        let variance = (self.chi2.min(other.chi2) / self.values().max(1) as f64).max(1.0);
        (self.chi2 - other.chi2).abs() < agrees * variance
    }

    /// The residuals of all recordings over the noise, row after row; `None` where the motion cannot be integrated.
    pub fn left(&self) -> Option<Vec<f64>> {
        let mut left = Vec::with_capacity(self.values());
        for record in 0..self.problem.records.len() {
            let prediction = self.problem.predict(record, &self.x, false).ok()?;
            left.extend(self.problem.block(record, &prediction, Vec::new()).residual.iter());
        }
        Some(left)
    }

    /// Residuals and their derivatives with all variables, both over the noise; `None` where the motion cannot be integrated.
    pub fn linearised(&self) -> Option<(DVector<f64>, DMatrix<f64>)> {
        let blocks = self.problem.blocks(&self.x)?;
        Some(stacked(&blocks, self.x.len()))
    }
}

/// The fit that leaves least.
pub fn least<'f, 'a>(fits: &'f [Refit<'a>]) -> Option<&'f Refit<'a>> {
    fits.iter().min_by(|a, b| a.chi2.total_cmp(&b.chi2))
}

/// What that one leaves; infinite of none.
pub fn least_chi2(fits: &[Refit<'_>]) -> f64 {
    least(fits).map_or(f64::INFINITY, |fit| fit.chi2)
}

/// The fits of a kind that leave least.
pub fn best<'a>(
    fits: &[Refit<'a>],
    count: usize,
    is_meant: impl Fn(&Refit<'a>) -> bool,
    left: impl Fn(&Refit<'a>) -> f64,
) -> Vec<usize> {
    let mut order: Vec<(f64, usize)> =
        (0..fits.len()).filter(|i| is_meant(&fits[*i])).map(|i| (left(&fits[i]), i)).collect();
    order.sort_by(|a, b| a.0.total_cmp(&b.0));
    order.truncate(count);
    order.into_iter().map(|(_, i)| i).collect()
}

/// The better one of each hypothesis; where two leave the same within `agrees`, in units of the variance left, the starts that led there count together.
pub fn merged<'a>(mut fits: Vec<Refit<'a>>, others: Vec<Refit<'a>>, agrees: f64) -> Vec<Refit<'a>> {
    for other in others {
        match fits.iter_mut().find(|fit| fit.hypothesis.effects == other.hypothesis.effects) {
            Some(known) => known.meet(other, agrees),
            None => fits.push(other),
        }
    }
    fits
}

/// The best fit of each number of coefficients but none, up to the most.
pub fn best_of_each_count<'f, 'a>(fits: &'f [Refit<'a>], most: usize) -> Vec<&'f Refit<'a>> {
    let of_count = |count: usize| best(fits, 1, |fit| fit.coefficients() == count, |fit| fit.chi2);
    (1..=most).flat_map(of_count).map(|place| &fits[place]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::effect::Effect;
    use crate::experiment::Experiment;
    use crate::fit::Record;

    fn leaving(records: &[Record], chi2: f64, starts_agreeing: usize) -> Refit<'_> {
        let problem = Problem::new(records, &Experiment::default(), &[]).unwrap();
        let hypothesis = Hypothesis { effects: vec![Effect::HingeCoulomb], dropped: None };
        let certificate = Certificate { starts_agreeing, nested_ok: true };
        let x = vec![0.1; problem.variables()];
        let normal = DMatrix::identity(4, 4);
        Refit { hypothesis, problem, x, chi2, normal, steps: 1, damping: 0.0, converged: true, certificate }
    }

    #[test]
    fn only_starts_that_end_at_the_best_count_together() {
        let theta_rad = vec![vec![Some(0.1); 30]; 2];
        let t_s = (0..30).map(f64::from).collect();
        let records = [Record::uniform("none", t_s, theta_rad)];
        let met = |own: f64, other: f64| {
            let mut fit = leaving(&records, own, 1);
            fit.meet(leaving(&records, other, 2), 0.2);
            (fit.chi2, fit.certificate.starts_agreeing)
        };
        assert_eq!(met(60.0, 60.1), (60.0, 3));
        assert_eq!(met(60.1, 60.0), (60.0, 3));
        // a false minimum, here the other's, there its own
        assert_eq!(met(60.0, 70.0), (60.0, 1));
        assert_eq!(met(70.0, 60.0), (60.0, 2));
        // far above the noise of 60 values the same end is known less well
        assert_eq!(met(6000.0, 6010.0), (6000.0, 3));
    }

    #[test]
    fn a_fit_counts_only_with_every_part_of_its_certificate() {
        let settings = CertificateSettings::default();
        let records = [];
        let sound = leaving(&records, 60.0, settings.starts);
        assert!(sound.is_certified(&settings));
        assert!(!Refit { converged: false, ..sound.clone() }.is_certified(&settings));
        assert!(!leaving(&records, 60.0, settings.starts - 1).is_certified(&settings));
        let certificate = Certificate { nested_ok: false, ..sound.certificate };
        assert!(!Refit { certificate, ..sound }.is_certified(&settings));
    }
}
