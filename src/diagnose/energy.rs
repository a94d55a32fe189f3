//! Work of the laws along a fitted motion: what each place dissipates, and the torque that the added effects exert.

use super::effect::{Acts, Effect, Place};
use super::linearisation::motion_at;
use super::refit::Refit;
use crate::fit::problem::switch_on;
use crate::model::{Parameter, Partials};

/// Root mean square of the torque that the laws added to the base model exert, on all links together (N·m). A support that moves is no law: its
/// motion is what it is.
pub fn added_torque_n_m(fit: &Refit<'_>) -> f64 {
    let mut square = 0.0;
    let mut count = 0usize;
    let laws = fit.hypothesis.effects.iter().filter(|effect| effect.entry().acts != Acts::Motion);
    let added: Vec<Parameter> = laws.flat_map(|effect| effect.parameters()).copied().collect();
    let values: Vec<f64> = added.iter().map(|p| fit.value(*p).unwrap_or(0.0)).collect();
    for record in 0..fit.problem.records.len() {
        along(fit, record, &added, |_, torques, _| {
            let n = torques.first().map_or(0, |t| t.len());
            let total: f64 =
                (0..n).map(|i| torques.iter().zip(&values).map(|(t, v)| t[i] * v).sum::<f64>().powi(2)).sum();
            square += total;
            count += 1;
        });
    }
    (square / count.max(1) as f64).sqrt()
}

/// Share of each place of losses in the energy that a fitted model dissipates (hinge, joint, air).
pub fn energy_shares(fit: &Refit<'_>) -> [f64; 3] {
    let mut work_j = [0.0; 3];
    for record in 0..fit.problem.records.len() {
        let of_record = dissipated_j(fit, record);
        work_j.iter_mut().zip(of_record).for_each(|(whole, part)| *whole += part);
    }
    let total: f64 = work_j.iter().map(|w| w.max(0.0)).sum();
    if total > 0.0 { work_j.map(|w| w.max(0.0) / total) } else { [0.0; 3] }
}

/// Energy that a unit of a law would take along a fitted motion, all recordings together (J); the law need not be in the model.
pub fn work_of_unit_j(fit: &Refit<'_>, parameter: Parameter) -> f64 {
    let mut with = fit.clone();
    switch_on(&mut with.problem.experiment, parameter);
    let mut work_j = 0.0;
    for record in 0..fit.problem.records.len() {
        along(&with, record, &[parameter], |step_s, torques, rate| {
            work_j -= torques[0].iter().zip(rate).map(|(q, omega)| q * omega).sum::<f64>() * step_s;
        });
    }
    work_j
}

/// Energy that a fitted model dissipates through a recording at hinge, joint and air (J).
pub fn dissipated_j(fit: &Refit<'_>, record: usize) -> [f64; 3] {
    let mut work_j = [0.0; 3];
    let Ok((model, _)) = fit.problem.model(record, &fit.x[..fit.problem.free.len()]) else { return work_j };
    let losses = Effect::losses();
    let of: Vec<Parameter> = losses.iter().map(|loss| loss.0).collect();
    let values: Vec<f64> = of.iter().map(|parameter| model.value(*parameter).unwrap_or(0.0)).collect();
    along(fit, record, &of, |step_s, torques, rate| {
        for ((torque, value), (_, place)) in torques.iter().zip(&values).zip(&losses) {
            let power: f64 = torque.iter().zip(rate).map(|(q, omega)| q * omega).sum::<f64>() * value;
            if let Some(own) = Place::OF_LOSSES.iter().position(|p| p == place) {
                work_j[own] -= power * step_s;
            }
        }
    });
    work_j
}

/// Walks along a fitted motion: length of the interval, torques for one unit of each parameter, and the rates.
fn along(fit: &Refit<'_>, record: usize, parameters: &[Parameter], mut visit: impl FnMut(f64, &[Vec<f64>], &[f64])) {
    let Some((model, swing, times_s)) = fit.motion(record) else { return };
    let (n, m) = (model.chain().count(), model.rates());
    let mut partials = Partials::zero(n, m);
    let mut torques = vec![vec![0.0; m]; parameters.len()];
    for pair in times_s.windows(2) {
        let Some(motion) = motion_at(&model, &swing, 0.5 * (pair[0] + pair[1])) else { continue };
        model.partials(&motion, &mut partials);
        for (torque, parameter) in torques.iter_mut().zip(parameters) {
            model.sensitivity(*parameter, &motion, &partials, torque);
        }
        let of_links: Vec<Vec<f64>> = torques.iter().map(|t| t[..n].to_vec()).collect();
        visit(pair[1] - pair[0], &of_links, &motion.rate[..n]);
    }
}
