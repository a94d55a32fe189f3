//! The shapes a bending strip takes (Ritz's reduction).
//!
//! A chain that stands for a strip has as many modes as links, and all but the first few ring far above what a camera sees; yet it is them that an
//! integrator must follow. So the links' angles are sought as a sum of few shapes,
//!
//! ```text
//! θ = Φ q        Φᵀ Q(Φq, Φq̇, Φq̈) = 0
//! ```
//!
//! Q is the whole, non-linear balance of torques. The shapes are the lowest modes of the hanging strip, and how it stands when either end is turned: a
//! spring or friction in the hinge bends it within a short layer that no low mode has, a curl at rest bends it up to both ends. They are combined so
//! that q₁ = θ₁, all others leaving the first link alone: dry friction holds a coordinate. Their inertia ΦᵀMΦ is diagonal.

use nalgebra::{DMatrix, DVector};

use super::observe::chord_slopes;
use super::{Chain, Partials};

/// Modes beyond one for each length between marks.
const FURTHER_MODES: usize = 4;
/// Those of them in which a strip may start: fingers that let go leave it in all its modes, of which a camera sees these for about a second.
const FURTHER_AT_START: usize = 3;
/// Shapes summed side by side.
const LANES: usize = 4;

/// Shapes of a chain, as angles of its links.
#[derive(Debug, Clone, PartialEq)]
pub struct Shapes {
    /// Φ by four shapes at a time, link after link: so that a loop over links keeps their sums in registers.
    basis: Vec<Vec<[f64; LANES]>>,
    count: usize,
    /// Diagonal of ΦᵀMΦ.
    inertia_kg_m2: Vec<f64>,
    /// The modes and layers of which the shapes are made.
    modes: Modes,
    /// Links × (angles between marks, then how much of each of the next modes).
    start: DMatrix<f64>,
    /// From angles to coordinates, (ΦᵀMΦ)⁻¹ΦᵀM: shapes × links.
    projection: DMatrix<f64>,
}

/// The modes, and how a strip stands when either end is turned.
#[derive(Debug, Clone, PartialEq)]
struct Modes {
    /// From coordinates to these: modes × shapes.
    of_shapes: DMatrix<f64>,
    /// Of each the largest angle between marks, and its circular frequency (rad/s).
    each: Vec<[f64; 2]>,
}

impl Shapes {
    /// Of a chain whose joints have the stiffness K of a length between marks, and whose hinge has a spring (N·m/rad); `None` where the chain has fewer
    /// links than shapes.
    pub fn of(chain: &Chain, gravity_m_s2: f64, stiffness_n_m_per_rad: f64, of_hinge_n_m_per_rad: f64) -> Option<Self> {
        let (n, marks) = (chain.count(), chain.groups().len());
        let modes = marks + FURTHER_MODES;
        let count = modes + 2;
        if n < count {
            return None;
        }
        let inertia = chain.inertia_kg_m2();
        let mut stiffness = hanging_stiffness(chain, gravity_m_s2, stiffness_n_m_per_rad);
        stiffness[(0, 0)] += of_hinge_n_m_per_rad;
        // M = LLᵀ, and L⁻¹KL⁻ᵀ has the modes' squares as eigenvalues
        let lower = inertia.clone().cholesky()?.l();
        let half = lower.solve_lower_triangular(&stiffness)?;
        let symmetric = lower.solve_lower_triangular(&half.transpose())?;
        let eigen = (0.5 * (&symmetric + symmetric.transpose())).symmetric_eigen();
        let mut order: Vec<usize> = (0..n).collect();
        order.sort_by(|a, b| eigen.eigenvalues[*a].total_cmp(&eigen.eigenvalues[*b]));
        let mut whole = DMatrix::zeros(n, count);
        for (k, mode) in order.iter().take(modes).enumerate() {
            whole.set_column(k, &lower.tr_solve_lower_triangular(&eigen.eigenvectors.column(*mode))?);
        }
        let start = Self::start_of(chain, &whole.columns(0, marks + FURTHER_AT_START).into_owned())?;
        // in step with the first mode, so that there is an answer without gravity, too
        let still = (&stiffness + inertia * eigen.eigenvalues[order[0]].abs()).cholesky()?;
        for (k, turned) in (modes..count).zip([0, n - 1]) {
            let mut shape = still.solve(&DVector::from_fn(n, |i, _| f64::from(u8::from(i == turned))));
            for known in 0..k {
                let share = whole.column(known).dot(&(inertia * &shape));
                shape -= whole.column(known) * share;
            }
            whole.set_column(k, &(&shape / shape.dot(&(inertia * &shape)).sqrt()));
        }
        let chords = chord_slopes(chain, &vec![0.0; n]) * &whole;
        let mode =
            |k: usize| [chords.column(k).amax(), whole.column(k).dot(&(&stiffness * whole.column(k))).abs().sqrt()];
        let each = (0..count).map(mode).collect();
        let turned = at_the_hinge(&whole);
        let (shapes, scales) = with_the_first_link(&(&whole * &turned));
        let modes = Modes { of_shapes: turned * DMatrix::from_diagonal(&scales), each };
        Some(Self::made_of(modes, &shapes, start, chain))
    }

    /// Shapes that are ready, and the angles where a motion starts.
    fn made_of(modes: Modes, shapes: &DMatrix<f64>, start: DMatrix<f64>, chain: &Chain) -> Self {
        let weighed = shapes.tr_mul(chain.inertia_kg_m2());
        let inertia_kg_m2: Vec<f64> =
            shapes.column_iter().enumerate().map(|(k, shape)| weighed.row(k).transpose().dot(&shape)).collect();
        let projection =
            DMatrix::from_fn(shapes.ncols(), shapes.nrows(), |k, link| weighed[(k, link)] / inertia_kg_m2[k]);
        Self { basis: in_lanes(shapes), count: shapes.ncols(), inertia_kg_m2, modes, start, projection }
    }

    /// The lowest modes combined so that each has the angle one between two marks and none between the others; then the next modes, each less what it
    /// has of such angles, its own largest being one.
    fn start_of(chain: &Chain, modes: &DMatrix<f64>) -> Option<DMatrix<f64>> {
        let marks = chain.groups().len();
        let chords = chord_slopes(chain, &vec![0.0; chain.count()]) * modes;
        let mut start = modes.clone();
        let seen = modes.columns(0, marks) * chords.columns(0, marks).into_owned().try_inverse()?;
        for k in marks..modes.ncols() {
            let next = (modes.column(k) - &seen * chords.column(k)) / chords.column(k).amax();
            start.set_column(k, &next);
        }
        start.columns_mut(0, marks).copy_from(&seen);
        Some(start)
    }

    /// Angles of the links where a motion starts: a column for each angle between marks, all others being zero, and one for how much there is of each of
    /// the next modes, the highest that a camera sees anything of.
    pub fn start(&self) -> &DMatrix<f64> {
        &self.start
    }

    /// Of each of the next modes of the start: the frequency of the last one for which there is an angle between marks, over its own.
    pub fn slower(&self) -> Vec<f64> {
        let marks = self.start.ncols() - FURTHER_AT_START;
        let [_, last_rad_s] = self.modes.each[marks - 1];
        self.modes.each[marks..self.start.ncols()].iter().map(|[_, own_rad_s]| last_rad_s / own_rad_s).collect()
    }

    fn links(&self) -> usize {
        self.projection.ncols()
    }

    /// Number of shapes.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Inertia of a coordinate.
    pub fn inertia_kg_m2(&self, k: usize) -> f64 {
        self.inertia_kg_m2[k]
    }

    /// The angle between marks (rad) that errors of the coordinates and of their rates are seen as: an error of a mode's rate moves it by that over the mode's own
    /// frequency, or over the swing's if that is faster.
    pub fn seen_rad(&self, angle: &[f64], rate: &[f64], characteristic_rad_s: f64) -> f64 {
        let of = |(k, [seen, pace_rad_s]): (usize, &[f64; 2])| {
            let along =
                |values: &[f64]| self.modes.of_shapes.row(k).iter().zip(values).map(|(a, b)| a * b).sum::<f64>();
            seen * along(angle).abs().max(along(rate).abs() / pace_rad_s.max(characteristic_rad_s))
        };
        self.modes.each.iter().enumerate().map(of).fold(0.0, f64::max)
    }

    /// The links' values of coordinates. What follows the coordinates (the laws' own variables) is handed on.
    pub fn expand(&self, coordinates: &[f64], of_links: &mut [f64]) {
        let (shapes, own) = coordinates.split_at(self.count);
        let (links, own_of_links) = of_links.split_at_mut(self.links());
        links.fill(0.0);
        for (rows, shapes) in self.basis.iter().zip(shapes.chunks(LANES)) {
            let mut lanes = [0.0; LANES];
            lanes[..shapes.len()].copy_from_slice(shapes);
            for (value, row) in links.iter_mut().zip(rows) {
                *value += row.iter().zip(&lanes).map(|(a, b)| a * b).sum::<f64>();
            }
        }
        own_of_links.copy_from_slice(own);
    }

    /// Columns of coordinates as columns of links.
    pub fn expanded(&self, columns: &DMatrix<f64>) -> DMatrix<f64> {
        let links = self.links();
        let mut of_links = DMatrix::zeros(links + columns.nrows() - self.count, columns.ncols());
        for (from, mut to) in columns.column_iter().zip(of_links.column_iter_mut()) {
            self.expand(from.as_slice(), to.as_mut_slice());
        }
        of_links
    }

    /// The coordinates nearest to columns of links, by the energy of their difference's motion. What follows is handed on.
    pub fn coordinates(&self, of_links: &DMatrix<f64>) -> DMatrix<f64> {
        let (links, further) = (self.links(), of_links.nrows() - self.links());
        let mut columns = DMatrix::zeros(self.count + further, of_links.ncols());
        columns.rows_mut(0, self.count).copy_from(&(&self.projection * of_links.rows(0, links)));
        columns.rows_mut(self.count, further).copy_from(&of_links.rows(links, further));
        columns
    }

    /// Φᵀ Q: torques along the coordinates. What follows the links is handed on.
    pub fn reduce(&self, of_links: &[f64], along: &mut [f64]) {
        let (links, own_of_links) = of_links.split_at(self.links());
        let (shapes, own) = along.split_at_mut(self.count);
        for (rows, shapes) in self.basis.iter().zip(shapes.chunks_mut(LANES)) {
            let mut sums = [0.0; LANES];
            for (value, row) in links.iter().zip(rows) {
                sums.iter_mut().zip(row).for_each(|(sum, part)| *sum += part * value);
            }
            shapes.copy_from_slice(&sums[..shapes.len()]);
        }
        own.copy_from_slice(own_of_links);
    }

    /// The derivatives of torques along the coordinates.
    pub fn reduce_partials(&self, of_links: &Partials, along: &mut Partials) {
        self.reduce_matrix(&of_links.theta, &mut along.theta);
        self.reduce_matrix(&of_links.rate, &mut along.rate);
        self.reduce_matrix(&of_links.acceleration, &mut along.acceleration);
        self.reduce(of_links.pivot_velocity.as_slice(), along.pivot_velocity.as_mut_slice());
        self.reduce(of_links.pivot_acceleration.as_slice(), along.pivot_acceleration.as_mut_slice());
    }

    /// Tᵀ A T, T being Φ for the links and one for what follows, as far as A has it.
    fn reduce_matrix(&self, of_links: &DMatrix<f64>, along: &mut DMatrix<f64>) {
        let (links, rows) = (self.links(), along.nrows());
        along.as_mut_slice().fill(0.0);
        let mut column = vec![0.0; rows];
        for (j, of_column) in of_links.column_iter().enumerate() {
            self.reduce(of_column.as_slice(), &mut column);
            if j >= links {
                along.column_mut(self.count + j - links).copy_from_slice(&column);
                continue;
            }
            let shares = self.basis.iter().flat_map(|rows| rows[j]);
            for (share, to) in shares.zip(along.as_mut_slice().chunks_exact_mut(rows)).take(self.count) {
                to.iter_mut().zip(&column).for_each(|(to, from)| *to += share * from);
            }
        }
    }
}

/// Scales shapes, of which only the first moves the first link: that one to turn it by one, the others to one at most; and by how much.
fn with_the_first_link(shapes: &DMatrix<f64>) -> (DMatrix<f64>, DVector<f64>) {
    let (mut shapes, mut scales) = (shapes.clone(), DVector::zeros(shapes.ncols()));
    for (k, mut shape) in shapes.column_iter_mut().enumerate() {
        if k == 0 {
            scales[k] = 1.0 / shape[0];
        } else {
            shape[0] = 0.0;
            scales[k] = 1.0 / shape.amax();
        }
        shape *= scales[k];
    }
    (shapes, scales)
}

fn in_lanes(shapes: &DMatrix<f64>) -> Vec<Vec<[f64; LANES]>> {
    let at = |link: usize, k: usize| if k < shapes.ncols() { shapes[(link, k)] } else { 0.0 };
    let rows =
        |first: usize| (0..shapes.nrows()).map(|link| std::array::from_fn(|lane| at(link, first + lane))).collect();
    (0..shapes.ncols()).step_by(LANES).map(rows).collect()
}

/// g hᵢ on the diagonal, and Kσ between the links of every joint.
fn hanging_stiffness(chain: &Chain, gravity_m_s2: f64, stiffness_n_m_per_rad: f64) -> DMatrix<f64> {
    let n = chain.count();
    let hangs = DVector::from_fn(n, |i, _| gravity_m_s2 * chain.static_moment_kg_m(i));
    let mut stiffness = DMatrix::from_diagonal(&hangs);
    for upper in 0..n - 1 {
        let joint = stiffness_n_m_per_rad * chain.joint_ratio(upper);
        for (row, column, sign) in
            [(upper, upper, 1.0), (upper + 1, upper + 1, 1.0), (upper, upper + 1, -1.0), (upper + 1, upper, -1.0)]
        {
            stiffness[(row, column)] += sign * joint;
        }
    }
    stiffness
}

/// An orthogonal matrix that combines shapes so that only the first moves the first link (Householder's reflection of that link's row).
fn at_the_hinge(shapes: &DMatrix<f64>) -> DMatrix<f64> {
    let mut normal = shapes.row(0).transpose();
    normal[0] += normal.norm().copysign(normal[0]);
    let count = normal.len();
    DMatrix::identity(count, count) - &normal * normal.transpose() * (2.0 / normal.norm_squared())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::experiment::Specimen;

    fn strip() -> Chain {
        Chain::continuous(&Specimen::default(), 6).unwrap()
    }

    fn shapes(stiffness_n_m_per_rad: f64) -> Shapes {
        Shapes::of(&strip(), 9.81, stiffness_n_m_per_rad, 0.0).unwrap()
    }

    /// Squares of the circular frequencies, lowest first.
    fn squares(inertia: &DMatrix<f64>, stiffness: &DMatrix<f64>) -> Vec<f64> {
        let lower = inertia.clone().cholesky().unwrap().l();
        let half = lower.solve_lower_triangular(stiffness).unwrap();
        let whole = lower.solve_lower_triangular(&half.transpose()).unwrap();
        let mut squares = whole.symmetric_eigenvalues().as_slice().to_vec();
        squares.sort_by(f64::total_cmp);
        squares
    }

    fn basis(shapes: &Shapes) -> DMatrix<f64> {
        shapes.expanded(&DMatrix::identity(shapes.count(), shapes.count()))
    }

    #[test]
    fn only_the_first_coordinate_turns_the_first_link() {
        let basis = basis(&shapes(1e-5));
        assert!((basis[(0, 0)] - 1.0).abs() < 1e-14);
        assert!(basis.row(0).iter().skip(1).all(|v| *v == 0.0), "{basis}");
    }

    #[test]
    fn further_modes_are_faster_one_after_the_other() {
        let slower = shapes(1e-5).slower();
        assert_eq!(slower.len(), FURTHER_AT_START);
        assert!(slower[0] < 1.0 && slower.windows(2).all(|pair| 0.0 < pair[1] && pair[1] < pair[0]), "{slower:?}");
    }

    #[test]
    fn angles_that_are_a_sum_of_shapes_come_back_as_they_were() {
        let shapes = shapes(1e-5);
        let q = DMatrix::from_fn(shapes.count() + 2, 3, |i, j| (1.0 + i as f64 * 0.7 - j as f64).sin());
        let there = shapes.expanded(&q);
        assert_eq!(there.rows(12, 2), q.rows(shapes.count(), 2));
        assert!((shapes.coordinates(&there) - q).amax() < 1e-10);
    }

    #[test]
    fn torques_are_reduced_as_the_work_they_do() {
        let shapes = shapes(1e-5);
        let basis = basis(&shapes);
        let whole = DMatrix::from_fn(13, 12, |i, j| ((i * 5 + j * 3) as f64).cos());
        let mut reduced = DMatrix::zeros(shapes.count() + 1, shapes.count());
        shapes.reduce_matrix(&whole, &mut reduced);
        assert!((reduced.rows(0, shapes.count()) - basis.tr_mul(&whole.rows(0, 12)) * &basis).amax() < 1e-12);
        assert!((reduced.row(shapes.count()) - whole.row(12) * &basis).amax() < 1e-12);
    }

    #[test]
    fn a_clamped_strip_can_start_in_its_own_first_modes() {
        let (chain, gravity) = (strip(), 9.81);
        let own = 0.01 * gravity * chain.static_moment_kg_m(0);
        let clamp = 100.0 * own;
        let mut whole = hanging_stiffness(&chain, gravity, own);
        whole[(0, 0)] += clamp;
        let lower = chain.inertia_kg_m2().clone().cholesky().unwrap().l();
        let half = lower.solve_lower_triangular(&whole).unwrap();
        let eigen = lower.solve_lower_triangular(&half.transpose()).unwrap().symmetric_eigen();
        // what is left of a mode, in units of energy, after the start shapes have taken what they can
        let left = |of_hinge: f64, lowest: usize| {
            let mut order: Vec<usize> = (0..eigen.eigenvalues.len()).collect();
            order.sort_by(|a, b| eigen.eigenvalues[*a].total_cmp(&eigen.eigenvalues[*b]));
            let mode = eigen.eigenvectors.column(order[lowest]).into_owned();
            let shapes = Shapes::of(&chain, gravity, own, of_hinge).unwrap();
            let start = lower.transpose() * shapes.start();
            let taken = start.clone().svd(true, true).solve(&mode, 1e-12).unwrap();
            (&mode - start * taken).norm()
        };
        for mode in 0..5 {
            assert!(left(clamp, mode) < 1e-9, "mode {mode}: {}", left(clamp, mode));
        }
        assert!(left(0.0, 0) > 1e-3, "{}", left(0.0, 0));
    }

    #[test]
    fn frequencies_are_the_whole_chains_even_where_the_strip_differs_from_the_one_the_shapes_are_of() {
        let (chain, gravity) = (strip(), 9.81);
        // K is as large as the strip's weight times a hundredth of its length
        let own = 0.01 * gravity * chain.static_moment_kg_m(0);
        let basis = basis(&Shapes::of(&chain, gravity, own, 0.0).unwrap());
        for (stiffness, of_hinge) in
            [(own, 0.0), (2.0 * own, 0.0), (0.5 * own, 0.0), (own, own), (0.5 * own, 4.0 * own)]
        {
            let mut whole = hanging_stiffness(&chain, gravity, stiffness);
            whole[(0, 0)] += of_hinge;
            let exact = squares(chain.inertia_kg_m2(), &whole);
            let found = squares(&(basis.tr_mul(chain.inertia_kg_m2()) * &basis), &(basis.tr_mul(&whole) * &basis));
            for mode in 0..2 {
                let error = (found[mode] / exact[mode]).sqrt() - 1.0;
                assert!(error.abs() < 2e-5, "{stiffness} {of_hinge} mode {mode}: {error:e}");
            }
        }
    }
}
