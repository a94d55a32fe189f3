//! What is fitted to what: the recordings, the model with its free parameters, the noise.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::descent::Block;
use super::noise::least_noise_rad;
use super::predict::{Request, Value, predict};
use super::whitening::{RecordNoise, Whitening};
use super::{Prediction, Record};
use crate::error::{Error, Result};
use crate::experiment::{Experiment, Hysteresis, Law, SupportFlexibility, SupportMotion};
use crate::model::{Accuracy, Camera, ForwardModel, Parameter, Work};
use crate::statistics::median;

/// Standard deviations of a strip's modes where a motion starts, as angles between marks and their rates, of the last one that the marks show: the third part of a large
/// swing, at some hertz. Of further modes they are less: one that is held bent by fingers has a mode in proportion to 1/ω².
const FURTHER_RAD: f64 = 0.1;
const FURTHER_RAD_S: f64 = 4.0;
/// Standard deviation of where a stand that yields is at the first row, and of its speed over ω (m): that of a rig that somebody has just touched (judgement).
const STAND_M: f64 = 5e-3;
/// Frequency of a stand over that of a weight on a thread as long as the specimen, to within as much again; its damping ratio, if it is of wood or metal, and the standard deviation of that (judgement).
const STAND_OVER_SWING: f64 = 6.0;
const STAND_DAMPING: f64 = 0.05;
const STAND_DAMPING_SD: f64 = 0.1;
/// Springs of the hinge that differ by less, as a part of them and of K, hold a strip alike.
const HELD_ALIKE: f64 = 0.1;

/// Steps of the integration for each second of a recording before a motion is given up.
const STEPS_EACH_SECOND: f64 = 300.0;
/// A motion is given up where it turns this many times as far as the recording, and a turn's sixth.
const RUNAWAY: f64 = 5.0;

/// A model with free parameters, and recordings of one specimen.
///
/// The variables of a fit are the free parameters, then for each recording the angles between marks at its first row (of a strip also how much there is of
/// the next modes, and where a stand is that yields) and their rates.
#[derive(Debug, Clone)]
pub struct Problem<'a> {
    /// The recordings.
    pub records: &'a [Record],
    /// The parameters that are free.
    pub free: Vec<Parameter>,
    /// The model, its coefficients at their start values.
    pub experiment: Experiment,
    /// Noise of each recording.
    pub noise: Vec<RecordNoise>,
    /// Of the integration.
    pub accuracy: Accuracy,
    /// From this stamp on frames may be missing, of each recording.
    pub dropped_at_s: Vec<f64>,
    /// What is known of free parameters beforehand.
    pub beliefs: Vec<Belief>,
    /// Shapes free at each start beyond the angles between marks, the further modes of a strip: the frequency of the last mode that the marks show, over that of each.
    pub further_modes: Vec<f64>,
    /// Coordinates free at each start beyond shapes: of a stand that yields.
    pub pairs: usize,
    /// What its integrations have cost.
    pub work: Work,
}

/// A free parameter that is known beforehand, as a measured length or mass is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Belief {
    /// Which.
    pub parameter: Parameter,
    /// Its value.
    pub value: f64,
    /// Its standard deviation.
    pub sd: f64,
}

impl<'a> Problem<'a> {
    /// A problem with some free parameters. Laws that are off are switched on with a coefficient of zero.
    ///
    /// # Errors
    /// [`Error::Option`] for a parameter that this specimen does not have; [`Error::Simulation`] for a specimen that cannot swing.
    pub fn new(records: &'a [Record], experiment: &Experiment, free: &[Parameter]) -> Result<Self> {
        let mut experiment = experiment.clone();
        free.iter().for_each(|parameter| switch_on(&mut experiment, *parameter));
        let model = ForwardModel::of(&experiment)?;
        let mut beliefs = of_stand(&experiment);
        beliefs.retain(|belief| free.contains(&belief.parameter));
        for parameter in free {
            if parameter.is_of_joint() && model.chain().count() < 2 {
                let message = "this specimen has one link and no joint; leave it out".to_owned();
                return Err(Error::Option { option: parameter.id().to_owned(), message });
            }
            if matches!(parameter, Parameter::Encoder(_)) && records.iter().any(|record| record.links() > 1) {
                let message = "is of specimens of one link; leave it out".to_owned();
                return Err(Error::Option { option: parameter.id().to_owned(), message });
            }
        }
        Ok(Self {
            records,
            free: free.to_vec(),
            experiment,
            noise: records.iter().map(|r| RecordNoise::white(vec![1e-3; r.links()])).collect(),
            accuracy: Accuracy::default(),
            dropped_at_s: vec![f64::INFINITY; records.len()],
            beliefs,
            further_modes: model.shapes().map_or_else(Vec::new, |shapes| shapes.slower()),
            pairs: model.free_pairs().len(),
            work: Work::default(),
        })
    }

    /// Number of angles seen.
    pub fn marks(&self) -> usize {
        self.records.first().map_or(0, Record::links)
    }

    /// Number of variables.
    pub fn variables(&self) -> usize {
        self.free.len() + self.records.len() * 2 * self.shapes()
    }

    /// Number of coordinates, and as many rates, in which each motion starts: the angles between marks, further shapes, and a stand's.
    pub fn shapes(&self) -> usize {
        self.marks() + self.further()
    }

    /// Of these those beyond the angles between marks.
    pub fn further(&self) -> usize {
        self.further_modes.len() + self.pairs
    }

    /// Where a recording's start stands among the variables.
    pub fn start_of(&self, record: usize) -> usize {
        self.free.len() + record * 2 * self.shapes()
    }

    /// A recording's start among the variables.
    pub fn start<'x>(&self, x: &'x [f64], record: usize) -> &'x [f64] {
        &x[self.start_of(record)..][..2 * self.shapes()]
    }

    /// The starts that variables of another problem hold, in the shapes of this one: what that one lacks is at rest.
    pub fn starts_from(&self, other: &Problem<'_>, x: &[f64]) -> Vec<f64> {
        self.starts_in_shapes(&x[other.free.len()..], other.shapes())
    }

    /// Starts in so many shapes, in the shapes of this problem: what they lack is at rest.
    pub fn starts_in_shapes(&self, starts: &[f64], shapes: usize) -> Vec<f64> {
        let halves = starts.chunks(shapes);
        halves.flat_map(|half| (0..self.shapes()).map(|i| half.get(i).copied().unwrap_or(0.0))).collect()
    }

    /// Angles between marks and their rates where a recording's motion starts.
    pub fn seen_start(&self, x: &[f64], record: usize) -> Vec<f64> {
        let (start, marks, shapes) = (self.start_of(record), self.marks(), self.shapes());
        [&x[start..start + marks], &x[start + shapes..start + shapes + marks]].concat()
    }

    /// The start values of the free parameters.
    pub fn start_values(&self) -> Result<Vec<f64>> {
        let (model, camera) = self.model(0, &[])?;
        let value = |p: &Parameter| camera.value(*p).or_else(|| model.value(*p)).unwrap_or(0.0);
        Ok(self.free.iter().map(value).collect())
    }

    /// Where a free parameter stands among the variables.
    pub fn place(&self, parameter: Parameter) -> Option<usize> {
        self.free.iter().position(|free| *free == parameter)
    }

    /// Lower bounds of all variables.
    pub fn lower(&self) -> Vec<f64> {
        let mut lower = vec![f64::NEG_INFINITY; self.variables()];
        let stated: Vec<(Parameter, f64)> = self.experiment.model.law.iter().flat_map(least_values).collect();
        for (bound, parameter) in lower.iter_mut().zip(&self.free) {
            let of_law = stated.iter().find(|(stated, _)| stated == parameter);
            *bound = of_law.map_or(parameter.least(), |(_, least)| *least);
        }
        lower
    }

    /// The model and the camera of a recording with values for the first of the free parameters.
    ///
    /// # Errors
    /// [`Error::Simulation`].
    pub fn model(&self, record: usize, values: &[f64]) -> Result<(ForwardModel, Camera)> {
        let mut model = ForwardModel::of(&self.experiment)?.counted_by(&self.work);
        let mut camera = Camera::of(&self.experiment.model.effects, 0.0, self.dropped_at_s[record]);
        for (parameter, value) in self.free.iter().zip(values) {
            model.set(*parameter, *value);
            camera.set(*parameter, *value);
        }
        Ok((model, camera))
    }

    /// The same with the shapes of a strip whose hinge has the spring that the variables give it, unless they are alike. A strip starts in its lowest modes, and
    /// those of one that is clamped are no sum of those of one that hangs free.
    #[must_use]
    pub fn with_modes_at(mut self, x: &[f64]) -> Self {
        if let Some(spring) = self.hinge_spring(x).filter(|_| !self.has_modes_at(x)) {
            self.experiment.model.effects.hinge_stiffness = Some(spring);
        }
        self
    }

    /// The same with the shapes of another problem's strip, where both have a spring at the hinge.
    #[must_use]
    pub fn with_modes_of(mut self, other: &Problem<'_>) -> Self {
        if [&self, other].iter().all(|problem| problem.free.contains(&Parameter::HingeStiffness)) {
            self.experiment.model.effects.hinge_stiffness = other.experiment.model.effects.hinge_stiffness;
        }
        self
    }

    /// Whether the shapes are those of a strip held as the variables say, to a tenth of the spring at its hinge and of its own K, with which its modes change
    /// less than their amplitudes are told.
    pub fn has_modes_at(&self, x: &[f64]) -> bool {
        let effects = &self.experiment.model.effects;
        let (Some(spring), Some(bending)) = (self.hinge_spring(x), effects.distributed_flexibility) else {
            return true;
        };
        let length_m = self.experiment.specimen.lengths_m()[0];
        (spring - effects.hinge_stiffness.unwrap_or(0.0)).abs() <= HELD_ALIKE * (spring.abs() + bending / length_m)
    }

    /// The spring at the hinge of a strip, where it is free.
    fn hinge_spring(&self, x: &[f64]) -> Option<f64> {
        let place = self.place(Parameter::HingeStiffness)?;
        self.experiment.model.effects.distributed_flexibility.map(|_| x[place])
    }

    /// Predicts all rows of one recording, with or without derivatives.
    ///
    /// # Errors
    /// [`Error::Simulation`].
    pub fn predict(&self, record: usize, x: &[f64], slopes: bool) -> Result<Prediction> {
        let (model, camera) = self.model(record, &x[..self.free.len()])?;
        let data = &self.records[record];
        let request = Request {
            record: data,
            rows: &(0..data.len()),
            start: self.start(x, record),
            camera: &camera,
            parameters: &self.free,
            until_s: data.t_s[data.len() - 1],
            accuracy: &self.accuracy,
            slopes,
        };
        predict(&model, &request)
    }

    /// The residuals of all recordings, each as one motion from its first row, then of the beliefs; `None` where one cannot be integrated, or the descent that asks has done the work that it may.
    pub fn blocks(&self, x: &[f64]) -> Option<Vec<Block>> {
        (!self.work.is_spent()).then_some(())?;
        let of = |record: usize| {
            let prediction = self.predict(record, x, true).ok()?;
            let start = self.start_of(record);
            let columns = (0..self.free.len()).chain(start..start + 2 * self.shapes()).collect();
            Some(self.block(record, &prediction, columns))
        };
        self.of_each_recording(of).into_iter().chain(self.known_blocks(x).map(Some)).collect()
    }

    /// All that is known beforehand: of the parameters, and of how much of further shapes there may be at each start, and of a stand's own swing.
    fn known_blocks(&self, x: &[f64]) -> impl Iterator<Item = Block> {
        let (marks, shapes) = (self.marks(), self.shapes());
        let of_start = |start: usize| {
            self.further_modes.iter().enumerate().flat_map(move |(k, slower)| {
                let place = start + marks + k;
                [(place, 0.0, FURTHER_RAD * slower.powi(2)), (place + shapes, 0.0, FURTHER_RAD_S * slower)]
            })
        };
        let further = (0..self.records.len()).flat_map(|record| of_start(self.start_of(record)));
        let of_pairs = self.starts_of_pairs().map(|place| (place, 0.0, STAND_M));
        self.belief_block(x).into_iter().chain(known_block(&further.chain(of_pairs).collect::<Vec<_>>(), x))
    }

    /// Where the start values of a stand's own swing are among the variables.
    fn starts_of_pairs(&self) -> impl Iterator<Item = usize> {
        let (first, shapes, pairs) = (self.marks() + self.further_modes.len(), self.shapes(), self.pairs);
        let of_half = move |half: usize| half + first..half + first + pairs;
        let halves =
            (0..self.records.len()).map(|record| self.start_of(record)).flat_map(move |start| [start, start + shapes]);
        halves.flat_map(of_half)
    }

    /// ln of how many of a stand's own swings that are believed possible the recordings tell apart, each number of it by itself, from JᵀJ of a fit.
    pub fn ln_known_of_pairs(&self, normal: &DMatrix<f64>) -> f64 {
        self.starts_of_pairs().map(|place| (STAND_M * normal[(place, place)].sqrt()).max(1.0).ln()).sum()
    }

    /// How far the parameters are from what is known of them, over its standard deviation.
    pub fn belief_block(&self, x: &[f64]) -> Option<Block> {
        let known: Vec<_> =
            self.beliefs.iter().filter_map(|b| Some((self.place(b.parameter)?, b.value, b.sd))).collect();
        known_block(&known, x)
    }

    /// Σr² over all recordings; infinite where the motion cannot be integrated.
    pub fn cost(&self, x: &[f64]) -> f64 {
        let of = |record: usize| {
            let prediction = self.predict(record, x, false).ok()?;
            Some(self.block(record, &prediction, Vec::new()).residual.norm_squared())
        };
        self.known_blocks(x).map(|block| block.residual.norm_squared()).sum::<f64>()
            + self.of_each_recording(of).into_iter().map(|own| own.unwrap_or(f64::INFINITY)).sum::<f64>()
    }

    /// What each recording gives. All of them are asked, also where one gives nothing, so that the work done does not depend on which thread comes first.
    fn of_each_recording<T: Send>(&self, of: impl Fn(usize) -> T + Sync + Send) -> Vec<T> {
        (0..self.records.len()).into_par_iter().with_max_len(1).map(of).collect()
    }

    /// The residuals of a prediction in units of their noise ([`super::whitening`]).
    pub fn block(&self, record: usize, prediction: &Prediction, columns: Vec<usize>) -> Block {
        let data = &self.records[record];
        let whitening = Whitening::of(self, record, &prediction.values);
        let left =
            |value: &Value| value.predicted_rad - data.theta_rad[value.link][value.row].unwrap_or(value.predicted_rad);
        let mut residual = DVector::from_iterator(prediction.values.len(), prediction.values.iter().map(left));
        whitening.whiten(residual.as_mut_slice());
        let mut slopes = prediction.slopes.clone();
        whitening.apply(&mut slopes);
        Block { columns, residual, slopes, robust: true }
    }

    /// Sets the accuracy of the integration by the least noise.
    pub fn integrate_below_the_noise(&mut self) {
        let least = self.noise.iter().flat_map(|n| &n.sd_rad).copied().fold(f64::INFINITY, f64::min);
        self.accuracy = Accuracy { step_error_rad: step_error_rad(least), ..Accuracy::default() };
    }

    /// Standard deviation of the noise of one value.
    pub fn sd_rad(&self, record: usize, link: usize, row: usize) -> f64 {
        self.noise[record].sd_rad[link] * self.records[record].relative_sd[link][row]
    }

    /// The longest recording.
    pub fn longest_s(&self) -> f64 {
        self.records.iter().map(|r| r.t_s[r.len() - 1] - r.t_s[0]).fold(0.0, f64::max)
    }

    /// How exact motions of some length are to be, and when one is given up: where it turns far beyond the recordings, or needs far more steps than a swing.
    pub fn accuracy_of(&self, longest_s: f64, step_error_rad: f64) -> Accuracy {
        let largest_rad = self.records.iter().map(Record::largest_angle_rad).fold(0.0, f64::max);
        Accuracy {
            step_error_rad,
            most_steps: 1000 + (STEPS_EACH_SECOND * longest_s) as usize,
            most_angle_rad: RUNAWAY * (1.0 + largest_rad),
            ..Accuracy::default()
        }
    }

    /// Sets the noise to what some residuals (in units of the present noise) say, robustly.
    pub fn update_noise(&mut self, residuals: &[(usize, usize, f64)], variables: usize) {
        for record in 0..self.records.len() {
            for link in 0..self.marks() {
                let of = |r: &&(usize, usize, f64)| r.0 == record && r.1 == link;
                let mut sizes: Vec<f64> = residuals.iter().filter(of).map(|r| r.2.abs()).collect();
                if sizes.len() < 4 {
                    continue;
                }
                let Some(median) = median(&mut sizes) else { continue };
                let freedom = residuals.len().saturating_sub(variables).max(1) as f64 / residuals.len() as f64;
                let factor = 1.4826 * median / freedom.sqrt();
                let least_rad = least_noise_rad(self.records, record, link);
                self.noise[record].sd_rad[link] = (self.noise[record].sd_rad[link] * factor).max(least_rad);
            }
        }
    }
}

/// Of the coefficients of a stated law those that have a least value.
fn least_values(law: &Law) -> impl Iterator<Item = (Parameter, f64)> {
    law.coefficients().filter_map(|(parameter, own)| Some((parameter, own.min?)))
}

/// The error allowed in a step beside some noise: a hundredth of it. A minute of one, two or three links then errs by a two-hundredth of the noise, since errors of
/// single steps are estimated too large (1e-6 rad a step: 5e-7 rad after 60 s).
pub fn step_error_rad(noise_rad: f64) -> f64 {
    (1e-2 * noise_rad).clamp(1e-10, 1e-5)
}

/// How far variables (place, value, standard deviation) are from what is known of them.
fn known_block(known: &[(usize, f64, f64)], x: &[f64]) -> Option<Block> {
    (!known.is_empty()).then(|| Block {
        columns: known.iter().map(|(column, _, _)| *column).collect(),
        residual: DVector::from_iterator(known.len(), known.iter().map(|(i, value, sd)| (x[*i] - value) / sd)),
        slopes: DMatrix::from_diagonal(&DVector::from_iterator(known.len(), known.iter().map(|(_, _, sd)| 1.0 / sd))),
        robust: false,
    })
}

/// The derivatives of a fit's blocks with all variables, and their residuals, one row after another.
pub fn stacked(blocks: &[Block], variables: usize) -> (DVector<f64>, DMatrix<f64>) {
    let rows: usize = blocks.iter().map(|b| b.residual.len()).sum();
    let (mut residual, mut slopes) = (DVector::zeros(rows), DMatrix::zeros(rows, variables));
    let mut first = 0;
    for block in blocks {
        let count = block.residual.len();
        residual.rows_mut(first, count).copy_from(&block.residual);
        for (own, column) in block.columns.iter().enumerate() {
            slopes.view_mut((first, *column), (count, 1)).copy_from(&block.slopes.column(own));
        }
        first += count;
    }
    (residual, slopes)
}

/// What is believed of a stand that yields: a recording that shows it hardly at all tells neither its frequency nor its damping.
fn of_stand(experiment: &Experiment) -> Vec<Belief> {
    let Some(stand) = experiment.model.effects.support_flexibility else { return Vec::new() };
    let (hz, ratio) = (stand.frequency_hz, stand.damping_ratio);
    vec![
        Belief { parameter: Parameter::SupportOwnFrequency, value: hz, sd: hz },
        Belief { parameter: Parameter::SupportDampingRatio, value: ratio, sd: STAND_DAMPING_SD },
    ]
}

/// Switches a law on with a coefficient of zero, where it is off.
pub fn switch_on(experiment: &mut Experiment, parameter: Parameter) {
    let effects = &mut experiment.model.effects;
    let on = |effect: &mut Option<f64>| {
        effect.get_or_insert(0.0);
    };
    match parameter {
        Parameter::JointStiffness | Parameter::JointDamping | Parameter::Link(..) | Parameter::Law(_) => {}
        Parameter::RestCurl => on(&mut effects.rest_curl),
        Parameter::BendingStiffness => on(&mut effects.distributed_flexibility),
        Parameter::JointCubicStiffness => on(&mut effects.joint_cubic_stiffness),
        Parameter::HysteresisTorque | Parameter::HysteresisYield => {
            effects.joint_hysteretic.get_or_insert(Hysteresis { torque_n_m: 0.0, yield_rad: 0.03 });
        }
        Parameter::HingeViscous => on(&mut effects.hinge_viscous),
        Parameter::HingeCoulomb => on(&mut effects.hinge_coulomb),
        Parameter::HingeStiffness => on(&mut effects.hinge_stiffness),
        Parameter::AirLinear => on(&mut effects.air_linear),
        Parameter::AirQuadratic => on(&mut effects.air_quadratic),
        Parameter::AddedMass => on(&mut effects.added_mass),
        Parameter::SideForce => on(&mut effects.side_force),
        Parameter::SupportSine | Parameter::SupportCosine | Parameter::SupportFrequency => {
            let still = SupportMotion { amplitude_m: 0.0, frequency_hz: 1.0, phase_rad: 0.0 };
            effects.support_motion.get_or_insert(still);
        }
        Parameter::SupportCompliance | Parameter::SupportOwnFrequency | Parameter::SupportDampingRatio => {
            let length_m: f64 = experiment.specimen.lengths_m().iter().sum();
            let swing_hz = (experiment.rig.gravity_m_s2.abs() / length_m).sqrt() / std::f64::consts::TAU;
            let frequency_hz = STAND_OVER_SWING * swing_hz;
            let rigid = SupportFlexibility { compliance_m_per_n: 0.0, frequency_hz, damping_ratio: STAND_DAMPING };
            effects.support_flexibility.get_or_insert(rigid);
        }
        Parameter::TimeBase => on(&mut effects.time_base),
        Parameter::DroppedFrames => on(&mut effects.dropped_frames),
        Parameter::CameraTilt => on(&mut effects.camera_tilt),
        Parameter::AngleGain => on(&mut effects.angle_gain),
        Parameter::ViewStretch | Parameter::ViewShear => {
            effects.camera_oblique.get_or_insert_default();
        }
        Parameter::Encoder(_) => {
            effects.encoder_error.get_or_insert_default();
        }
        Parameter::DifferentialLag => on(&mut effects.differential_lag),
        Parameter::DifferentialZero => on(&mut effects.differential_zero),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_strip_is_held_as_its_variables_say() {
        let record = Record::uniform("made", (0..30).map(f64::from).collect(), vec![vec![Some(0.1); 30]; 2]);
        let mut experiment = Experiment::default();
        experiment.model.effects.distributed_flexibility = Some(1e-5);
        let records = std::slice::from_ref(&record);
        let free = [Parameter::HingeStiffness, Parameter::JointDamping];
        let problem = Problem::new(records, &experiment, &free).unwrap();
        let (loose, clamped) = ([0.0, 1e-7], [1e-2, 1e-7]);
        assert!(problem.has_modes_at(&loose) && !problem.has_modes_at(&clamped));
        let shapes = |problem: &Problem<'_>| problem.model(0, &clamped).unwrap().0.start();
        let held = problem.clone().with_modes_at(&clamped);
        assert!(held.has_modes_at(&clamped) && (shapes(&held) - shapes(&problem)).amax() > 0.1);
        assert_eq!(shapes(&problem.with_modes_of(&held)), shapes(&held));
        // rods have no shapes that depend on it
        experiment.model.effects.distributed_flexibility = None;
        assert!(Problem::new(records, &experiment, &free).unwrap().has_modes_at(&clamped));
    }
}
