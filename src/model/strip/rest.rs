//! The loaded strip at rest, by Newton's method.
//!
//! With F(s) all force that acts below s, the virtual work of the freedoms q is
//!
//! ```text
//! R = ∫ EI(κ − κ₀) ∂κ/∂q ds + k(θ(0) − θₛ) ∂θ(0)/∂q − ∫ (Fₓ cos θ − F_d sin θ) ∂θ/∂q ds = 0
//! ```
//!
//! The strip hangs straight first. Then loads, curls and the support's direction are raised together, in one step if Newton's method follows, else in as
//! many as it needs: so of several shapes the one is found that the strip is brought to.

use nalgebra::{DMatrix, DVector};

use super::load::Load;
use super::mesh::Mesh;
use super::{Strip, Support};
use crate::error::{Error, Result};

/// Newton's steps before the load is taken in smaller parts.
const NEWTON_STEPS: usize = 15;
/// Largest turn (rad) of a step that Newton's method is followed with.
const LARGEST_TURN_RAD: f64 = 1.0;
/// A correction this small beside the angles themselves is rounding.
const CONVERGED: f64 = 1e-12;
/// Rounding may leave more than that in a limp strip; a correction that no longer falls is the end, if it is as small as this.
const STALLED: f64 = 1e-8;
/// Parts of the load below which there is no shape to be followed.
const SMALLEST_PART: f64 = 1e-4;

/// A strip at rest under its loads.
#[derive(Debug, Clone, PartialEq)]
pub struct Rest {
    /// What is held.
    pub strip: Strip,
    /// How it is cut up.
    pub mesh: Mesh,
    /// θ(0) and the curvatures.
    pub freedoms: DVector<f64>,
    /// ∂R/∂q, with a clamped freedom's row and column left in.
    pub stiffness: DMatrix<f64>,
}

impl Rest {
    /// Brings a strip to rest.
    ///
    /// # Errors
    /// [`Error::Simulation`] where there is no shape to be followed: nothing holds the strip, or it snaps through.
    pub fn of(strip: &Strip, mesh: &Mesh, load: &dyn Load) -> Result<Self> {
        let problem = Problem { strip, mesh, load };
        let mut freedoms = DVector::zeros(mesh.freedoms());
        let (mut reached, mut part) = (0.0, 1.0);
        while reached < 1.0 {
            let share = f64::min(reached + part, 1.0);
            match problem.newton(share, &freedoms) {
                Some(found) => {
                    (freedoms, reached) = (found, share);
                    part *= 2.0;
                }
                None => part *= 0.25,
            }
            if part < SMALLEST_PART {
                return Err(Error::Simulation {
                    detail: format!(
                        "the strip comes to no rest beyond {:.1} % of its load: nothing holds it there; lower the load, or hold the strip",
                        100.0 * reached
                    ),
                });
            }
        }
        let (_, stiffness) = problem.residual_and_stiffness(1.0, &freedoms);
        Ok(Self { strip: *strip, mesh: mesh.clone(), freedoms, stiffness })
    }

    /// θ at a place.
    pub fn angle_at(&self, s_m: f64) -> f64 {
        self.mesh.angle_at(self.freedoms.as_slice(), s_m)
    }

    /// Where a point of the strip lies, [x, down] from the support.
    pub fn place_m(&self, s_m: f64) -> [f64; 2] {
        let upto = |of: fn(f64) -> f64| self.mesh.integral_upto(self.freedoms.as_slice(), s_m, of);
        [upto(f64::sin), upto(f64::cos)]
    }
}

/// What is to come to rest.
struct Problem<'a> {
    strip: &'a Strip,
    mesh: &'a Mesh,
    load: &'a dyn Load,
}

impl Problem<'_> {
    /// The shape under a share of the load, from one nearby; none where Newton's method does not come to it.
    fn newton(&self, share: f64, from: &DVector<f64>) -> Option<DVector<f64>> {
        let mut freedoms = from.clone();
        if let Some(turn_rad) = self.strip.held_angle_rad() {
            freedoms[0] = share * turn_rad;
        }
        let mut last = f64::INFINITY;
        for _ in 0..NEWTON_STEPS {
            let (residual, stiffness) = self.residual_and_stiffness(share, &freedoms);
            if residual.iter().all(|r| *r == 0.0) {
                return Some(freedoms);
            }
            let step = self.solve(stiffness, residual)?;
            freedoms -= &step;
            let largest = |freedoms: &DVector<f64>| {
                self.mesh.angles(freedoms.as_slice()).iter().fold(0.0f64, |most, a| most.max(a.abs()))
            };
            let (turn_rad, angle_rad) = (largest(&step), largest(&freedoms));
            if !(turn_rad <= LARGEST_TURN_RAD) {
                return None;
            }
            let stalled = turn_rad <= STALLED * angle_rad && turn_rad >= 0.5 * last;
            if turn_rad <= CONVERGED * angle_rad || stalled {
                return Some(freedoms);
            }
            last = turn_rad;
        }
        None
    }

    /// K⁻¹R, nothing along what is clamped.
    fn solve(&self, stiffness: DMatrix<f64>, residual: DVector<f64>) -> Option<DVector<f64>> {
        let held = usize::from(self.strip.support == Support::Clamped);
        let (stiffness, residual) = (self.strip.free(stiffness), residual.remove_rows(0, held));
        let symmetric = (!self.load.follows()).then(|| stiffness.clone().cholesky()).flatten();
        let step = match symmetric {
            Some(factor) => factor.solve(&residual),
            None => stiffness.lu().solve(&residual)?,
        };
        step.iter().all(|v| v.is_finite()).then(|| step.insert_rows(0, held, 0.0))
    }

    fn residual_and_stiffness(&self, share: f64, freedoms: &DVector<f64>) -> (DVector<f64>, DMatrix<f64>) {
        let (strip, mesh) = (self.strip, self.mesh);
        let angles = mesh.angles(freedoms.as_slice());
        let mut stiffness = DMatrix::zeros(mesh.freedoms(), mesh.freedoms());
        let mut residual = self.bending(share, freedoms, &mut stiffness);
        if let Support::Hinged { stiffness_n_m_per_rad } = strip.support {
            residual[0] += stiffness_n_m_per_rad * (freedoms[0] - share * strip.support_angle_rad);
            stiffness[(0, 0)] += stiffness_n_m_per_rad;
        }
        let local: Vec<_> = (0..mesh.points()).map(|p| self.load.force(mesh.s_m(p), angles[p])).collect();
        let tip_n = self.load.tip_force_n();
        let weight_n_m = strip.mass_per_length_kg_m * strip.gravity_m_s2;
        let below = |axis: usize, own_n_m: f64| -> Vec<f64> {
            let along: Vec<f64> = local.iter().map(|f| share * f.force_n_m[axis] + own_n_m).collect();
            let mut below = mesh.below(&along);
            below.iter_mut().enumerate().for_each(|(p, f)| *f += mesh.weight_m(p) * share * tip_n[axis]);
            below
        };
        let (across, down) = (below(0, 0.0), below(1, weight_n_m));
        let trigonometry: Vec<(f64, f64)> = angles.iter().map(|a| a.sin_cos()).collect();
        let of = |f: fn((f64, f64), f64, f64) -> f64| -> Vec<f64> {
            trigonometry.iter().zip(&across).zip(&down).map(|((sc, x), d)| f(*sc, *x, *d)).collect()
        };
        residual -= mesh.along_freedoms(&of(|(sin, cos), across, down| across * cos - down * sin));
        mesh.add_of_angles(&of(|(sin, cos), across, down| across * sin + down * cos), &mut stiffness);
        if self.load.follows() {
            let turned = |axis: usize, slope: Vec<f64>| {
                let mut with_angle = mesh.angle_derivatives();
                for (p, mut row) in with_angle.row_iter_mut().enumerate() {
                    row *= share * mesh.weight_m(p) * local[p].slope_n_m_rad[axis];
                }
                mesh.displacement_derivatives(&slope).tr_mul(&with_angle)
            };
            stiffness -= turned(0, trigonometry.iter().map(|(_, cos)| *cos).collect());
            stiffness -= turned(1, trigonometry.iter().map(|(sin, _)| -sin).collect());
        }
        (residual, stiffness)
    }

    fn bending(&self, share: f64, freedoms: &DVector<f64>, stiffness: &mut DMatrix<f64>) -> DVector<f64> {
        let (strip, mesh) = (self.strip, self.mesh);
        let stiffness_at =
            |p: usize| mesh.weight_m(p) * strip.bending_stiffness_n_m2 * self.load.stiffness_ratio(mesh.s_m(p));
        let bending: Vec<f64> = (0..mesh.points()).map(stiffness_at).collect();
        let curvatures = mesh.curvatures(freedoms.as_slice());
        let moments: Vec<f64> = (0..mesh.points())
            .map(|p| bending[p] * (curvatures[p] - share * (strip.curl_per_m + self.load.curl_per_m(mesh.s_m(p)))))
            .collect();
        mesh.add_of_curvatures(&bending, stiffness);
        mesh.along_curvatures(&moments)
    }
}

impl Strip {
    /// The direction that a clamp keeps.
    fn held_angle_rad(&self) -> Option<f64> {
        (self.support == Support::Clamped).then_some(self.support_angle_rad)
    }

    /// A matrix without what a clamp holds.
    pub(super) fn free(&self, matrix: DMatrix<f64>) -> DMatrix<f64> {
        match self.support {
            Support::Clamped => matrix.remove_row(0).remove_column(0),
            Support::Hinged { .. } => matrix,
        }
    }
}
