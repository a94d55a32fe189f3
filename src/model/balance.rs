//! The balance of torques along the coordinates that are integrated: the links' angles, or the shapes of a strip.

use nalgebra::{DMatrix, DVector};

use super::forward::{Bearers, balanced};
use super::shapes::Shapes;
use super::{ForwardModel, Hinge, Motion, Partials};
use crate::error::Result;

/// A model at one instant, seen along its coordinates. Rates are those of the coordinates, then the laws' own variables.
#[derive(Debug)]
pub struct Balance<'a> {
    model: &'a ForwardModel,
    shapes: Option<&'a Shapes>,
    motion: Motion,
    /// Of the links, where the coordinates are shapes.
    of_links: Partials,
    torque: Vec<f64>,
}

impl<'a> Balance<'a> {
    /// Of a model.
    pub fn new(model: &'a ForwardModel) -> Self {
        let (n, m) = (model.chain().count(), model.rates());
        Self {
            model,
            shapes: model.shapes(),
            motion: Motion::zero(n, m - n),
            of_links: Partials::zero(n, m),
            torque: vec![0.0; m],
        }
    }

    /// The model.
    pub fn model(&self) -> &'a ForwardModel {
        self.model
    }

    /// Number of coordinates.
    pub fn count(&self) -> usize {
        self.shapes.map_or(self.model.chain().count(), Shapes::count)
    }

    /// Number of rates.
    pub fn rates(&self) -> usize {
        self.count() + self.model.rates() - self.model.chain().count()
    }

    /// Own inertia of a coordinate.
    pub fn inertia_kg_m2(&self, i: usize) -> f64 {
        self.shapes.map_or_else(|| self.model.chain().inertia_kg_m2()[(i, i)], |shapes| shapes.inertia_kg_m2(i))
    }

    /// The angle (rad) that errors of the coordinates and of their rates are seen as.
    pub fn seen_rad(&self, angle: &[f64], rate: &[f64], characteristic_rad_s: f64) -> f64 {
        let of_link = |(angle, rate): (&f64, &f64)| angle.abs().max(rate.abs() / characteristic_rad_s);
        match self.shapes {
            None => angle.iter().zip(rate).map(of_link).fold(0.0, f64::max),
            Some(shapes) => shapes.seen_rad(angle, rate, characteristic_rad_s),
        }
    }

    /// Columns of the links' values as columns of coordinates.
    pub fn coordinates(&self, of_links: DMatrix<f64>) -> DMatrix<f64> {
        match self.shapes {
            None => of_links,
            Some(shapes) => shapes.coordinates(&of_links),
        }
    }

    /// Goes to an instant.
    pub fn go_to(
        &mut self,
        t_s: f64,
        theta: &[f64],
        (rate, acceleration): (&[f64], &[f64]),
        hinge: Hinge,
        sides: &[f64],
    ) {
        let motion = &mut self.motion;
        let given =
            [(theta, &mut motion.theta_rad), (rate, &mut motion.rate), (acceleration, &mut motion.acceleration)];
        given.into_iter().for_each(|(of, links)| spread(self.shapes, of, links));
        for ((sin, cos), theta) in motion.sin.iter_mut().zip(&mut motion.cos).zip(&motion.theta_rad) {
            (*sin, *cos) = theta.sin_cos();
        }
        motion.hinge = hinge;
        motion.sides.clear();
        motion.sides.extend_from_slice(sides);
        self.model.set_time(motion, t_s);
    }

    /// Q, one value a rate.
    pub fn torque(&mut self, q: &mut [f64]) {
        let Some(shapes) = self.shapes else { return self.model.torque(&self.motion, q) };
        self.model.torque(&self.motion, &mut self.torque);
        shapes.reduce(&self.torque, q);
        if self.motion.hinge == Hinge::Sticks {
            q[0] = -shapes.inertia_kg_m2(0) * self.motion.acceleration[0];
        }
    }

    /// ∂Q.
    pub fn partials(&mut self, partials: &mut Partials) {
        let Some(shapes) = self.shapes else { return self.model.partials(&self.motion, partials) };
        self.model.partials(&self.motion, &mut self.of_links);
        shapes.reduce_partials(&self.of_links, partials);
        if self.motion.hinge == Hinge::Sticks {
            partials.clear_row(0);
            partials.acceleration[(0, 0)] = -shapes.inertia_kg_m2(0);
        }
    }

    /// ∂Q/∂parameter; `partials` are those of the same instant.
    pub fn sensitivity(&mut self, of: &Bearers, partials: &Partials, q: &mut [f64]) {
        let Some(shapes) = self.shapes else { return self.model.sensitivity_of(of, &self.motion, partials, q) };
        self.model.sensitivity_of(of, &self.motion, &self.of_links, &mut self.torque);
        shapes.reduce(&self.torque, q);
        if self.motion.hinge == Hinge::Sticks {
            q[0] = 0.0;
        }
    }

    /// The accelerations of the instant, whatever it was given.
    ///
    /// # Errors
    /// [`crate::Error::Simulation`] when no inertia is left (a negative added mass).
    pub fn accelerations(&mut self) -> Result<Vec<f64>> {
        let (n, m) = (self.count(), self.rates());
        let (mut partials, mut q) = (Partials::zero(n, m), DVector::zeros(m));
        let mut accelerations = vec![0.0; m];
        for _ in 0..self.model.newton_steps() {
            spread(self.shapes, &accelerations, &mut self.motion.acceleration);
            self.partials(&mut partials);
            self.torque(q.as_mut_slice());
            let change = balanced(&partials, &q, self.motion.t_s)?;
            accelerations.iter_mut().zip(&change).for_each(|(own, change)| *own += change);
        }
        Ok(accelerations)
    }

    /// What friction has to bear while the hinge is held: the sum of all other torques on the first coordinate (N·m).
    pub fn sticking_torque_n_m(&mut self) -> f64 {
        let Some(shapes) = self.shapes else { return self.model.sticking_torque_n_m(&self.motion) };
        self.model.torque_while_held(&self.motion, &mut self.torque);
        let mut along = vec![0.0; self.rates()];
        shapes.reduce(&self.torque, &mut along);
        along[0]
    }

    /// What dry friction of the hinge can hold (N·m), where the hinge is dry.
    pub fn friction_n_m(&self) -> Option<f64> {
        self.model.friction_n_m(&self.motion)
    }

    /// Quantities at whose zeros a law has a corner; of the rates alone.
    pub fn corners(&mut self, rate: &[f64]) -> Vec<f64> {
        spread(self.shapes, rate, &mut self.motion.rate);
        self.model.corners(&self.motion)
    }

    /// Quantities at whose zeros a force bends.
    pub fn kinks(&mut self, t_s: f64, theta: &[f64], rate: &[f64]) -> Vec<f64> {
        spread(self.shapes, theta, &mut self.motion.theta_rad);
        spread(self.shapes, rate, &mut self.motion.rate);
        self.motion.t_s = t_s;
        self.model.kinks(&self.motion)
    }
}

/// What coordinates are on the links: themselves, where no shapes are sought.
fn spread(shapes: Option<&Shapes>, of_coordinates: &[f64], of_links: &mut [f64]) {
    match shapes {
        None => of_links.copy_from_slice(of_coordinates),
        Some(shapes) => shapes.expand(of_coordinates, of_links),
    }
}
