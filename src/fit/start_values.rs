//! Where a fit begins, wherever the file's values stand: with the spring and the dampers that give the modes the recording shows.
//!
//! In a spring that is far off, the sum of squares of a long recording has a false minimum at every turn that the second mode misses. The second mode's
//! frequency says what the spring is, near enough to be in step; where no second mode is seen, the shape of the first does: the stiffer the joint, the more the
//! links turn alike.

use super::observed_modes::ObservedMode;
use super::{Record, Seen};
use crate::experiment::Experiment;
use crate::model::modes::{Linearised, Mode, Modes};
use crate::model::{ForwardModel, Parameter};

/// Stiffness of the softest and the stiffest joint tried, over gravity's torque on the first link (judgement: as good as limp, and as rigid).
const SOFTEST: f64 = 1e-5;
const STIFFEST: f64 = 1e4;
/// Halvings of the ratio of the two (numerics: a spring to 3·10⁻⁴ of it).
const HALVINGS: usize = 16;
/// A damper from which its damping ratio is read off, over √(stiffness × inertia) (numerics: the ratio is linear in it).
const LITTLE: f64 = 1e-3;

/// A frequency beyond this part of half the rate may be that of its mirror image on the other side of it (judgement).
const ALIASED: f64 = 0.6;

/// Damping ratio of a second mode that is not seen (start values).
const UNSEEN_DAMPING_RATIO: f64 = 0.3;

/// A spring that differs from the seen one by more than this factor is not where to begin (judgement).
const FAR_OFF: f64 = 1.5;

/// Most beginnings: the file's values, those of the modes, and those of a second mode's mirror image.
pub const MOST: u64 = 3;

/// Where a fit may begin, likeliest first: with the file's values, and with what the modes of the longest recording say. Without a second mode these are vague, and
/// come last: a stiff joint with little damping ends on a line in the noise. Where the file's spring is far from the seen one, the file's values do.
pub fn start_experiments(records: &[Record], experiment: &Experiment, free: &[Parameter]) -> Vec<Experiment> {
    let begun_with = |p: &Parameter| {
        p.is_spring() || matches!(p, Parameter::JointDamping | Parameter::HingeViscous | Parameter::AirLinear)
    };
    let mut order = vec![experiment.clone()];
    let longest = records.iter().max_by_key(|record| record.len());
    let Some(seen) = longest.filter(|_| free.iter().any(begun_with)).and_then(Seen::of) else { return order };
    order.extend(from_modes(experiment, free, &seen));
    let springs = order.iter().map(|begun| spring_of(begun, free)).collect::<Option<Vec<_>>>();
    let are_far = |springs: Vec<f64>| springs[1..].iter().all(|spring| is_far_off(*spring, springs[0]));
    if springs.is_some_and(are_far) && seen.fast.is_some() {
        order.rotate_left(1);
    }
    order
}

/// Whether the file's spring is far from the seen one.
fn is_far_off(seen: f64, stated: f64) -> bool {
    (seen / stated.max(f64::MIN_POSITIVE)).ln().abs() > FAR_OFF.ln()
}

/// The experiment with the free spring and linear dampers set to what the modes say, likeliest first; the same where they say nothing.
pub fn from_modes(experiment: &Experiment, free: &[Parameter], seen: &Seen) -> Vec<Experiment> {
    let mut begun = vec![with_modes(experiment, free, seen)];
    if let Some(fast) = seen.fast.as_ref().filter(|fast| fast.frequency_hz > ALIASED * seen.nyquist_hz) {
        let mirrored = ObservedMode { frequency_hz: 2.0 * seen.nyquist_hz - fast.frequency_hz, ..fast.clone() };
        begun.push(with_modes(experiment, free, &Seen { fast: Some(mirrored), ..seen.clone() }));
    }
    begun
}

fn with_modes(experiment: &Experiment, free: &[Parameter], seen: &Seen) -> Experiment {
    let mut begun = experiment.clone();
    let spring = free.iter().copied().find(|parameter| parameter.is_spring());
    if let Some(spring) = spring
        && let Some(stiffness) = stiffness_of(&begun, spring, seen)
    {
        set(&mut begun, spring, stiffness);
    }
    let joint = Some(Parameter::JointDamping).filter(|joint| free.contains(joint));
    let outside = [Parameter::HingeViscous, Parameter::AirLinear].into_iter().find(|damper| free.contains(damper));
    // a second mode that is not seen does not ring: begun with little damping, it would end on a line in the noise
    let silent = || ObservedMode { damping_ratio: Some(UNSEEN_DAMPING_RATIO), ..seen.slow.clone() };
    let fast = seen.fast.clone().unwrap_or_else(silent);
    for (damper, seen, mode) in [(joint, &fast, 1), (outside, &seen.slow, 0)] {
        if let Some(damper) = damper
            && let Some(damping) = damping_of(&begun, damper, seen, mode)
        {
            set(&mut begun, damper, damping);
        }
    }
    begun
}

/// The spring whose modes are those seen: the softest or the stiffest where none has them.
fn stiffness_of(experiment: &Experiment, spring: Parameter, seen: &Seen) -> Option<f64> {
    let unit = unit_of(experiment, spring)?;
    let (mut soft, mut stiff) = (SOFTEST * unit, STIFFEST * unit);
    for _ in 0..HALVINGS {
        let middle = (soft * stiff).sqrt();
        let mut tried = experiment.clone();
        set(&mut tried, spring, middle);
        let modes = undamped(&tried)?;
        let is_stiffer = match &seen.fast {
            // a joint too stiff to swing has no second mode
            Some(fast) => modes.get(1).is_none_or(|mode| mode.frequency_hz > fast.frequency_hz),
            None => alike(modes.first()?)? > seen_alike(&seen.slow)?,
        };
        if is_stiffer { stiff = middle } else { soft = middle }
    }
    Some((soft * stiff).sqrt())
}

/// θ₁ over the last angle of a mode.
fn alike(mode: &Mode) -> Option<f64> {
    let (first, last) = (mode.shape.first()?, mode.shape.last()?);
    Some(first.amplitude * (first.phase_rad - last.phase_rad).cos() / last.amplitude)
}

fn seen_alike(mode: &ObservedMode) -> Option<f64> {
    let last = mode.shape.last().filter(|_| mode.shape.len() > 1)?;
    Some(last.arg().cos() / last.norm())
}

/// What a spring is measured by: gravity's torque on the first link, times the length for a bending stiffness.
fn unit_of(experiment: &Experiment, spring: Parameter) -> Option<f64> {
    let model = ForwardModel::of(experiment).ok()?;
    let torque_n_m = (model.gravity_m_s2() * model.chain().static_moment_kg_m(0)).abs();
    let length_m = experiment.specimen.lengths_m().iter().sum::<f64>();
    Some(if spring == Parameter::BendingStiffness { torque_n_m * length_m } else { torque_n_m })
}

/// The damper that damps a mode as it was seen: ξ is linear in a small one.
fn damping_of(experiment: &Experiment, damper: Parameter, seen: &ObservedMode, mode: usize) -> Option<f64> {
    let ratio = seen.damping_ratio?;
    let model = ForwardModel::of(experiment).ok()?;
    let inertia_kg_m2 = model.chain().inertia_kg_m2()[(0, 0)];
    let mut little = LITTLE * inertia_kg_m2 * std::f64::consts::TAU * seen.frequency_hz;
    if damper == Parameter::AirLinear {
        little /= experiment.specimen.lengths_m().iter().sum::<f64>().powi(3);
    }
    let with = |size: f64| {
        let mut tried = experiment.clone();
        set(&mut tried, damper, size);
        Some(Modes::of(&Linearised::of(&tried).ok()?).ok()?.modes.get(mode)?.damping_ratio)
    };
    let (without, with) = (with(0.0)?, with(little)?);
    Some((little * (ratio - without) / (with - without)).max(0.0)).filter(|size| size.is_finite())
}

/// The modes without losses, slowest first.
pub fn undamped(experiment: &Experiment) -> Option<Vec<Mode>> {
    let mut free = experiment.clone();
    free.model.c_eq_n_m_s_per_rad = 0.0;
    let effects = &mut free.model.effects;
    (effects.hinge_viscous, effects.air_linear) = (None, None);
    Some(Modes::of(&Linearised::of(&free).ok()?).ok()?.modes)
}

/// Frequencies of the slow mode, however stiff the joints are: the lowest and the highest.
pub fn slow_mode_hz(experiment: &Experiment) -> Option<[f64; 2]> {
    let slowest = |experiment: &Experiment| Some(undamped(experiment)?.first()?.frequency_hz);
    let stated_hz = slowest(experiment)?;
    let spring = match experiment.model.effects.distributed_flexibility {
        Some(_) => Parameter::BendingStiffness,
        None => Parameter::JointStiffness,
    };
    let unit = unit_of(experiment, spring)?;
    let with = |stiffness: f64| {
        let mut tried = experiment.clone();
        set(&mut tried, spring, stiffness);
        slowest(&tried).unwrap_or(stated_hz)
    };
    let [soft_hz, stiff_hz] = [with(SOFTEST * unit), with(100.0 * unit)];
    Some([soft_hz.min(stated_hz), stiff_hz.max(stated_hz)])
}

/// The free spring of an experiment, with its value.
pub fn spring_of(experiment: &Experiment, free: &[Parameter]) -> Option<f64> {
    match free.iter().find(|parameter| parameter.is_spring())? {
        Parameter::BendingStiffness => experiment.model.effects.distributed_flexibility,
        _ => Some(experiment.model.k_eq_n_m_per_rad),
    }
}

fn set(experiment: &mut Experiment, parameter: Parameter, value: f64) {
    let model = &mut experiment.model;
    match parameter {
        Parameter::JointStiffness => model.k_eq_n_m_per_rad = value,
        Parameter::JointDamping => model.c_eq_n_m_s_per_rad = value,
        Parameter::BendingStiffness => model.effects.distributed_flexibility = Some(value),
        Parameter::HingeViscous => model.effects.hinge_viscous = Some(value),
        Parameter::AirLinear => model.effects.air_linear = Some(value),
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Complex;

    /// What a specimen with a spring shows.
    fn seen(experiment: &Experiment) -> Seen {
        let modes = Modes::of(&Linearised::of(experiment).unwrap()).unwrap().modes;
        let of = |mode: &Mode| ObservedMode {
            frequency_hz: mode.frequency_hz,
            frequency_half_hz: 0.0,
            relative_half_width: 0.0,
            mean_frequency_hz: mode.frequency_hz,
            damping_ratio: Some(mode.damping_ratio),
            amplitude_rad: 0.1,
            shape: mode
                .shape
                .iter()
                .map(|c| Complex::from_polar(c.amplitude, c.phase_rad) / mode.shape[0].amplitude)
                .collect(),
        };
        Seen { slow: of(&modes[0]), fast: Some(of(&modes[1])), nyquist_hz: 60.0, peaks_hz: Vec::new() }
    }

    fn with(stiffness: f64, damping: f64) -> Experiment {
        let mut experiment = Experiment::default();
        experiment.model.k_eq_n_m_per_rad = stiffness;
        experiment.model.c_eq_n_m_s_per_rad = damping;
        experiment
    }

    const FREE: [Parameter; 2] = [Parameter::JointStiffness, Parameter::JointDamping];

    #[test]
    fn the_second_mode_gives_the_spring_and_the_damper_wherever_the_file_stands() {
        let truth = seen(&with(1e-3, 1e-6));
        for stated in [1e-5, 1e-4, 1e-2, 1e-1] {
            let begun = &from_modes(&with(stated, 3e-5), &FREE, &truth)[0].model;
            assert!((begun.k_eq_n_m_per_rad / 1e-3 - 1.0).abs() < 1e-2, "{begun:?}");
            assert!((begun.c_eq_n_m_s_per_rad / 1e-6 - 1.0).abs() < 2e-2, "{begun:?}");
        }
    }

    #[test]
    fn the_shape_of_the_first_mode_gives_the_spring_where_no_second_is_seen() {
        let truth = Seen { fast: None, ..seen(&with(1e-3, 1e-6)) };
        let begun = &from_modes(&with(1e-5, 1e-6), &FREE, &truth)[0].model;
        assert!((begun.k_eq_n_m_per_rad / 1e-3 - 1.0).abs() < 2e-2, "{begun:?}");
    }

    #[test]
    fn a_second_mode_beyond_half_the_rate_is_sought_at_its_mirror_image() {
        let mut truth = seen(&with(1e-3, 1e-6));
        // 14.3 Hz at 25 rows per second are seen at 10.7 Hz
        truth.nyquist_hz = 12.5;
        let fast = truth.fast.as_mut().unwrap();
        fast.frequency_hz = 25.0 - fast.frequency_hz;
        let begun = from_modes(&with(1e-4, 1e-6), &FREE, &truth);
        assert!((begun[1].model.k_eq_n_m_per_rad / 1e-3 - 1.0).abs() < 1e-2, "{begun:?}");
    }

    #[test]
    fn the_slow_mode_of_two_rods_lies_between_limp_and_rigid() {
        let [low_hz, high_hz] = slow_mode_hz(&with(2e-4, 1e-6)).unwrap();
        assert!((low_hz - 1.3486).abs() < 1e-3 && (high_hz - 1.3649).abs() < 1e-3, "{low_hz} {high_hz}");
    }
}
