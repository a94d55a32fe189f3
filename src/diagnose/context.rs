//! The fit context: what every fit of one diagnosis shares, none of which changes.
//!
//! The noise is not among it. It is learnt from fits, and each fit owns the noise by which it was judged ([`super::refit::Refit`]).

use super::effect::{BendingStrip, SetUp};
use super::hypothesis::Hypothesis;
use super::settings::Settings;
use crate::error::Result;
use crate::experiment::{Experiment, Law};
use crate::fit::whitening::RecordNoise;
use crate::fit::{Belief, Problem, Record};
use crate::model::{Parameter, Work};

/// A yield angle of the joint's hysteresis to expect, as a part of the bend that every joint reaches, and how far from it
/// that may be, as a part of itself (judgement).
const YIELD: (f64, f64) = (0.2, 2.5);
/// The same of a joint that has no spring: a bearing, whose friction is dry (judgement: it yields at once, as both bearings of a real double arm do).
const DRY_YIELD: (f64, f64) = (1e-3, 0.5);
/// The strip while bending all along it is only a candidate (cost: a tenth of that of eight rods).
const CANDIDATE: BendingStrip = BendingStrip { rods: 3, bending_n_m2: None };

/// What every fit of one diagnosis shares.
#[derive(Debug, Clone)]
pub struct FitContext<'a> {
    /// The recordings.
    pub records: &'a [Record],
    /// Specimen, rig and start values.
    pub experiment: &'a Experiment,
    /// Thresholds.
    pub settings: &'a Settings,
    /// The base model's parameters.
    pub base: Vec<Parameter>,
    /// What is known of them.
    pub beliefs: Vec<Belief>,
    /// Of the integration.
    pub step_error_rad: f64,
    /// Parameters and initial states from multiple shooting on short stretches, where the base model's fit began; empty where they are not known.
    pub begun: Vec<f64>,
    /// The discretisation of a strip that bends all along, once that is the answer: as fine as that of a base model. `None` while bending is only a candidate,
    /// with few rods and no further modes.
    pub identified_strip: Option<BendingStrip>,
    /// Laws learnt from the recordings, beside those of the file; their coefficients stand among the base model's.
    pub laws: Vec<Law>,
    /// What the fits have cost.
    pub work: Work,
    /// What a descent may cost, where what is left of a budget allows no more.
    pub most_work: u64,
}

impl<'a> FitContext<'a> {
    /// The problem of a hypothesis, judged by some noise.
    ///
    /// # Errors
    /// As [`Problem::new`].
    pub fn problem(&self, hypothesis: &Hypothesis, noise: &[RecordNoise]) -> Result<Problem<'a>> {
        let mut free = self.base.clone();
        let mut beliefs = self.beliefs.clone();
        let mut experiment = self.experiment.clone();
        experiment.model.law.extend(self.laws.iter().cloned());
        let mut set_up = SetUp {
            free: &mut free,
            beliefs: &mut beliefs,
            experiment: &mut experiment,
            yield_rad: self.yield_rad(),
            view: self.settings.prior.view,
            encoder_rad: self.settings.prior.encoder_rad,
            strip: self.identified_strip.unwrap_or(CANDIDATE),
        };
        hypothesis.effects.iter().for_each(|effect| effect.set_up(&mut set_up));
        let mut problem = Problem::new(self.records, &experiment, &free)?;
        problem.work = self.work.clone();
        problem.noise = noise.to_vec();
        problem.beliefs.extend(beliefs);
        if free.contains(&Parameter::BendingStiffness) && !self.is_strip() && self.identified_strip.is_none() {
            // no more is free at its start than in the rods it is compared with
            problem.further_modes.clear();
        }
        problem.accuracy = problem.accuracy_of(problem.longest_s(), self.step_error_rad);
        if let Some((record, at_s)) = hypothesis.dropped {
            problem.dropped_at_s[record] = at_s;
        }
        Ok(problem)
    }

    /// The same with other recordings of it.
    #[must_use]
    pub fn on<'b>(&self, records: &'b [Record]) -> FitContext<'b>
    where
        'a: 'b,
    {
        let begun = if records.len() == self.records.len() { self.begun.clone() } else { Vec::new() };
        FitContext { records, begun, ..self.clone() }
    }

    /// The bend that every joint reaches, in the recording in which it is largest; of one link the largest angle.
    pub fn common_bend_rad(&self) -> f64 {
        self.records.iter().map(Record::common_bend_rad).fold(0.0, f64::max)
    }

    /// Whether the base model's joint has a spring.
    pub fn has_spring(&self) -> bool {
        self.base.iter().any(|parameter| parameter.is_spring())
    }

    /// What is believed of a hysteresis' yield angle, and its standard deviation.
    pub fn yield_rad(&self) -> (f64, f64) {
        let (share, scatter) = if self.has_spring() { YIELD } else { DRY_YIELD };
        let yield_rad = share * self.common_bend_rad();
        (yield_rad, scatter * yield_rad)
    }

    /// Whether the base model bends all along the strip.
    pub fn is_strip(&self) -> bool {
        self.base.contains(&Parameter::BendingStiffness)
    }

    /// Whether a recording is cut in pieces with starts of their own.
    pub fn is_in_pieces(&self) -> bool {
        self.records.iter().any(|record| record.continues)
    }

    /// Number of recordings.
    pub fn recordings(&self) -> usize {
        self.records.iter().filter(|record| !record.continues).count()
    }

    /// Number of angles.
    pub fn marks(&self) -> usize {
        self.records.first().map_or(0, Record::links)
    }

    /// Number of values.
    pub fn values(&self) -> usize {
        self.records.iter().map(|r| r.values(0..r.len())).sum()
    }
}

/// The first part of each recording.
pub fn first_part(records: &[Record], part: f64) -> Vec<Record> {
    let rows =
        |record: &Record| ((part * record.len() as f64) as usize).max(crate::series::FEWEST_ROWS).min(record.len());
    records.iter().map(|record| record.until(rows(record))).collect()
}

/// The noise without errors that are synchronous with the motion: missing physics is synchronous, too, and must not be discounted while it is sought.
pub fn without_synchronous_errors(noise: &[RecordNoise]) -> Vec<RecordNoise> {
    noise.iter().map(|noise| RecordNoise { synchronous: 0.0, ..noise.clone() }).collect()
}
