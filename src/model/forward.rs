//! The equations of motion of the chain with its effects.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};

use super::effects::outside::{NodalForces, SupportMotion};
use super::effects::{Effect, effects_of};
use super::observe::links_from_chords;
use super::shapes::Shapes;
use super::{Chain, Hinge, Motion, Parameter, Partials, Work};
use crate::error::{Error, Result};
use crate::experiment::Experiment;

/// A friction that goes with the load is a small part of the torques: each step leaves less than a hundredth of what the one before left.
const MOST_NEWTON_STEPS: usize = 5;

/// A chain under gravity, with its effects, as a balance of torques (d'Alembert):
///
/// ```text
/// 0 = Q = −Σⱼ aᵢⱼ [cos(θᵢ−θⱼ) θ̈ⱼ + sin(θᵢ−θⱼ) θ̇ⱼ²] − g hᵢ sin θᵢ + the effects' torques
/// ```
///
/// (paper Eq. 22–25 as corrected). Laws with variables of their own add one equation for each.
#[derive(Debug)]
pub struct ForwardModel {
    chain: Chain,
    gravity_m_s2: f64,
    effects: Vec<Box<dyn Effect>>,
    hidden: usize,
    /// Of a strip of many links.
    shapes: Option<Shapes>,
    work: Work,
}

/// A parameter, and what of a model has it: looked up once for a motion, and asked at every stage of every step.
#[derive(Debug, Clone)]
pub struct Bearers {
    parameter: Parameter,
    of_chain: bool,
    of_support: bool,
    /// By their places among the model's.
    effects: Vec<usize>,
}

impl ForwardModel {
    /// The model an experiment describes. `distributed_flexibility` makes the strip a chain of `pieces` rods between marks.
    ///
    /// # Errors
    /// [`Error::Simulation`] when the specimen cannot swing.
    pub fn of(experiment: &Experiment) -> Result<Self> {
        let (specimen, model) = (&experiment.specimen, &experiment.model);
        let gravity_m_s2 = experiment.rig.gravity_m_s2;
        let lengths_m = specimen.lengths_m();
        let mark_length_m = lengths_m.iter().sum::<f64>() / lengths_m.len() as f64;
        let (chain, shapes) = match model.effects.distributed_flexibility {
            Some(bending) => {
                let chain = Chain::continuous(specimen, model.pieces)?;
                let of_hinge = model.effects.hinge_stiffness.unwrap_or(0.0).max(0.0);
                let shapes = Shapes::of(&chain, gravity_m_s2, bending / mark_length_m, of_hinge);
                (chain, shapes)
            }
            None => (Chain::of(specimen)?, None),
        };
        let effects = effects_of(model, mark_length_m);
        let hidden = effects.iter().map(|e| e.hidden(&chain)).sum();
        Ok(Self { chain, gravity_m_s2, effects, hidden, shapes, work: Work::default() })
    }

    /// The same with forces on the lower ends of the links.
    pub fn with_forces(mut self, forces: NodalForces) -> Self {
        self.effects.push(Box::new(forces));
        self
    }

    /// The same with every link's angle sought for itself: what the shapes of a strip are held against.
    #[must_use]
    pub fn without_reduction(mut self) -> Self {
        self.shapes = None;
        self
    }

    /// The same, its integrations counted with others'.
    #[must_use]
    pub fn counted_by(mut self, work: &Work) -> Self {
        self.work = work.clone();
        self
    }

    /// What its integrations have cost.
    pub fn work(&self) -> &Work {
        &self.work
    }

    /// What a step costs in which so many rates are sought, in the unit of [`Work`].
    pub fn work_of_step(&self, sought: usize) -> u64 {
        Work::of_step(self.rates(), sought) + self.effects.iter().map(|e| e.work(&self.chain)).sum::<u64>()
    }

    /// The links.
    pub fn chain(&self) -> &Chain {
        &self.chain
    }

    /// The shapes of which the motion is a sum, where it is not sought link by link.
    pub fn shapes(&self) -> Option<&Shapes> {
        self.shapes.as_ref()
    }

    /// Angles of the links where a motion starts: a column for each angle between marks and, of a strip, one for each of its next modes.
    pub fn start(&self) -> DMatrix<f64> {
        self.shapes.as_ref().map_or_else(|| links_from_chords(&self.chain), |shapes| shapes.start().clone())
    }

    /// Of each law whose variables are a coordinate and its rate where they stand among the rates; both may have any value where a motion starts.
    pub fn free_pairs(&self) -> Vec<usize> {
        let (mut place, mut pairs) = (self.chain.count(), Vec::new());
        for effect in &self.effects {
            pairs.extend(effect.begins_free().then_some(place));
            place += effect.hidden(&self.chain);
        }
        pairs
    }

    /// Number of rates: one a link, and the laws' own variables.
    pub fn rates(&self) -> usize {
        self.chain.count() + self.hidden
    }

    /// g.
    pub fn gravity_m_s2(&self) -> f64 {
        self.gravity_m_s2
    }

    /// What dry friction of the hinge can hold at an instant (N·m), all laws together, where the hinge is dry.
    pub fn friction_n_m(&self, motion: &Motion) -> Option<f64> {
        self.effects.iter().filter_map(|e| e.friction_n_m(&self.chain, motion)).reduce(|a, b| a + b)
    }

    /// Whether the hinge has dry friction.
    pub fn is_dry(&self) -> bool {
        self.friction_n_m(&Motion::zero(self.chain.count(), self.hidden)).is_some()
    }

    /// Every coefficient with its value.
    pub fn parameters(&self) -> Vec<(Parameter, f64)> {
        let of_links = self.chain.parameters().into_iter().filter_map(|p| self.chain.value(p).map(|value| (p, value)));
        self.effects.iter().flat_map(|e| e.parameters()).chain(of_links).collect()
    }

    /// The value of a coefficient, where a law has it.
    pub fn value(&self, parameter: Parameter) -> Option<f64> {
        self.parameters().into_iter().find(|(p, _)| *p == parameter).map(|(_, value)| value)
    }

    /// Sets a coefficient of the laws that have it.
    pub fn set(&mut self, parameter: Parameter, value: f64) {
        self.effects.iter_mut().for_each(|e| e.set(parameter, value));
        self.chain.set(parameter, value);
    }

    /// √(g Σhᵢ / Σaᵢᵢ) of the links between marks: the pace of the swing, for tolerances on rates. The rods of a strip that lie between two marks are one link, so
    /// that it does not depend on how many they are.
    pub fn characteristic_rad_s(&self) -> f64 {
        let moment: f64 = (0..self.chain.count()).map(|i| self.chain.static_moment_kg_m(i)).sum();
        let inertia = self.chain.inertia_kg_m2();
        let of_link = |rods: &Range<usize>| inertia.view((rods.start, rods.start), (rods.len(), rods.len())).sum();
        let inertia_kg_m2: f64 = self.chain.groups().iter().map(of_link).sum();
        (self.gravity_m_s2.abs() * moment / inertia_kg_m2).sqrt().max(1.0)
    }

    /// The angle (rad) by which a unit of the laws' own variables moves the specimen: its torque against gravity, and at most what the law itself allows.
    pub fn hidden_rad(&self) -> f64 {
        let n = self.chain.count();
        let moment: f64 = (0..n).map(|i| self.chain.static_moment_kg_m(i)).sum();
        let held_n_m = self.gravity_m_s2.abs() * moment / n as f64;
        let of = |[torque_n_m, most_rad]: [f64; 2]| {
            if torque_n_m < most_rad * held_n_m { torque_n_m / held_n_m } else { most_rad }
        };
        self.effects.iter().map(|effect| of(effect.of_hidden(&self.chain))).fold(0.0, f64::max)
    }

    /// Sideways position of the pivot (m).
    pub fn pivot_m(&self, t_s: f64) -> f64 {
        self.support().map_or(0.0, |s| s.at(t_s)[0])
    }

    /// Sorted instants at which the forces change suddenly.
    pub fn discontinuities_s(&self) -> Vec<f64> {
        let mut discontinuities_s: Vec<f64> = self.effects.iter().flat_map(|e| e.discontinuities_s()).collect();
        discontinuities_s.sort_by(f64::total_cmp);
        discontinuities_s
    }

    /// Quantities at whose zeros a law has a corner.
    pub fn corners(&self, motion: &Motion) -> Vec<f64> {
        let mut corners = Vec::new();
        self.effects.iter().for_each(|e| e.add_switching_functions(&self.chain, motion, &mut corners));
        corners
    }

    /// Quantities at whose zeros a force bends.
    pub fn kinks(&self, motion: &Motion) -> Vec<f64> {
        let mut kinks = Vec::new();
        self.effects.iter().for_each(|e| e.add_kinks(&self.chain, motion, &mut kinks));
        kinks
    }

    /// An instant with the pivot where it then is.
    pub fn motion(&self, t_s: f64, theta_rad: &[f64], rate: &[f64]) -> Motion {
        let mut motion = Motion::zero(self.chain.count(), self.hidden);
        motion.place(theta_rad);
        motion.rate[..rate.len()].copy_from_slice(rate);
        motion.hinge = Hinge::sliding(rate[0]);
        self.set_time(&mut motion, t_s);
        motion
    }

    /// Sets the time, and with it the pivot, and what weighs on the chain.
    pub fn set_time(&self, motion: &mut Motion, t_s: f64) {
        motion.t_s = t_s;
        motion.gravity_m_s2 = self.gravity_m_s2;
        if let Some(support) = self.support() {
            [_, motion.pivot_m_s, motion.pivot_m_s2] = support.at(t_s);
        }
    }

    /// Q: zero when the accelerations are those of the motion. `q` holds one value a rate.
    pub fn torque(&self, motion: &Motion, q: &mut [f64]) {
        self.free_torque(motion, q);
        if motion.hinge == Hinge::Sticks {
            q[0] = -self.chain.inertia_kg_m2()[(0, 0)] * motion.acceleration[0];
        }
    }

    /// ∂Q.
    pub fn partials(&self, motion: &Motion, partials: &mut Partials) {
        self.free_partials(motion, partials);
        if motion.hinge == Hinge::Sticks {
            partials.clear_row(0);
            partials.acceleration[(0, 0)] = -self.chain.inertia_kg_m2()[(0, 0)];
        }
    }

    /// ∂Q/∂parameter; `partials` are those of the same instant.
    pub fn sensitivity(&self, parameter: Parameter, motion: &Motion, partials: &Partials, q: &mut [f64]) {
        self.sensitivity_of(&self.bearers(parameter), motion, partials, q);
    }

    /// What of the model has a parameter.
    pub fn bearers(&self, parameter: Parameter) -> Bearers {
        let has = |effect: &dyn Effect| effect.parameters().iter().any(|(own, _)| *own == parameter);
        let effects: Vec<usize> = (0..self.effects.len()).filter(|e| has(self.effects[*e].as_ref())).collect();
        Bearers {
            parameter,
            of_chain: self.chain.value(parameter).is_some(),
            of_support: effects.iter().any(|e| self.effects[*e].pivot().is_some()),
            effects,
        }
    }

    /// The same of a parameter whose bearers are known.
    pub(super) fn sensitivity_of(&self, of: &Bearers, motion: &Motion, partials: &Partials, q: &mut [f64]) {
        q.fill(0.0);
        if of.of_chain {
            let of_effects: f64 = self.effects.iter().map(|e| e.sideways_m_s2(motion)).sum();
            let sideways_m_s2 = of_effects - motion.pivot_m_s2;
            self.chain.add_sensitivity(of.parameter, [sideways_m_s2, self.gravity_m_s2], motion, q);
            self.effects.iter().for_each(|e| e.add_sensitivity_of_links(of.parameter, &self.chain, motion, q));
        }
        of.effects.iter().for_each(|e| self.effects[*e].add_sensitivity(of.parameter, &self.chain, motion, q));
        if let Some(support) = self.support().filter(|_| of.of_support) {
            let [velocity, acceleration] = support.slopes(of.parameter, motion.t_s);
            for (row, q) in q.iter_mut().enumerate() {
                *q += velocity * partials.pivot_velocity[row] + acceleration * partials.pivot_acceleration[row];
            }
        }
        if motion.hinge == Hinge::Sticks {
            q[0] = 0.0;
        }
    }

    /// Solves the balance for the accelerations.
    ///
    /// # Errors
    /// [`Error::Simulation`] when no inertia is left (a negative added mass).
    pub fn accelerate(&self, motion: &mut Motion) -> Result<()> {
        let (n, m) = (self.chain.count(), self.rates());
        let (mut partials, mut q) = (Partials::zero(n, m), DVector::zeros(m));
        motion.acceleration.fill(0.0);
        for _ in 0..self.newton_steps() {
            self.partials(motion, &mut partials);
            self.torque(motion, q.as_mut_slice());
            let change = balanced(&partials, &q, motion.t_s)?;
            motion.acceleration.iter_mut().zip(&change).for_each(|(own, change)| *own += change);
        }
        Ok(())
    }

    /// Newton's steps from no acceleration to the balance: one where the torques are linear in the accelerations.
    pub(super) fn newton_steps(&self) -> usize {
        if self.effects.iter().all(|e| e.is_linear_in_accelerations()) { 1 } else { MOST_NEWTON_STEPS }
    }

    /// What friction has to bear on the first link while it is held: the sum of all other torques on it (N·m).
    pub fn sticking_torque_n_m(&self, motion: &Motion) -> f64 {
        let mut q = vec![0.0; self.rates()];
        self.torque_while_held(motion, &mut q);
        q[0]
    }

    /// Q without what holds the hinge.
    pub(super) fn torque_while_held(&self, motion: &Motion, q: &mut [f64]) {
        let held = Motion { hinge: Hinge::Sticks, ..motion.clone() };
        self.free_torque(&held, q);
    }

    /// Kinetic energy in the pivot's frame, gravity's from the hanging position, and what the effects store (J).
    pub fn energy_j(&self, motion: &Motion) -> f64 {
        let stored_j: f64 = self.effects.iter().map(|e| e.energy_j(&self.chain, motion)).sum();
        self.chain.energy_j(self.gravity_m_s2, motion) + stored_j
    }

    fn free_torque(&self, motion: &Motion, q: &mut [f64]) {
        q.fill(0.0);
        self.chain.add_torque(self.gravity_m_s2, motion, q);
        self.effects.iter().for_each(|e| e.add_torque(&self.chain, motion, q));
    }

    /// ∂Q without what holds the hinge.
    pub(super) fn free_partials(&self, motion: &Motion, partials: &mut Partials) {
        partials.clear();
        self.chain.add_partials(self.gravity_m_s2, motion, partials);
        self.effects.iter().for_each(|e| e.add_partials(&self.chain, motion, partials));
    }

    fn support(&self) -> Option<&SupportMotion> {
        self.effects.iter().find_map(|e| e.pivot())
    }
}

/// By how much the accelerations change until the torques balance, in linear approximation.
pub(super) fn balanced(partials: &Partials, q: &DVector<f64>, t_s: f64) -> Result<Vec<f64>> {
    let solved = (-&partials.acceleration).lu().solve(q).filter(|a| a.iter().all(|v| v.is_finite()));
    let solved = solved.ok_or_else(|| Error::Simulation {
        detail: format!("no inertia left at t = {t_s:.3} s; lower model.effects.added_mass"),
    })?;
    Ok(solved.as_slice().to_vec())
}
