//! What no form explains, as a state-space model: a level that may wander, swings that are kept up at random, white noise.
//!
//! ```text
//! y = level + Σ aₖ + white;   level' = level + walk;   (a, b)ₖ' = ρₖ R(ωₖ h) (a, b)ₖ + drive
//! ```
//!
//! with b = −ȧ/ω: what keeps a swing up is a force, so it drives b alone and a moves smoothly.
//! The Kalman filter turns it into independent innovations of variance 1. It depends on no datum, so the same filter whitens the record and
//! every column of a model, and least squares of the whitened are generalised least squares. Level and swings start anywhere.

use std::f64::consts::TAU;

use super::grid::Grid;

/// Level and three swings.
pub const MOST_STATES: usize = 7;
/// Standard deviation of the states' start, of the record's spread.
const START_SPREAD: f64 = 100.0;

/// Parts of a step over which a drive is integrated.
const DRIVEN_PARTS: usize = 16;
/// Columns whitened side by side.
pub const LANES: usize = 4;

type State = [f64; MOST_STATES];
type Matrix = [State; MOST_STATES];

/// A swing of the strip.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Swing {
    /// Frequency of the damped swing.
    pub hz: f64,
    /// Damping ratio.
    pub damping: f64,
    /// Variance that its speed over ω gains, kept up by a random force (m²/s).
    pub drive_m2_s: f64,
    /// To which side that force drives it where it drives the first swing to the positive one: 1 or −1.
    pub sense: f64,
}

impl Swing {
    /// Decay rate and angular frequency (1/s, rad/s).
    pub fn pole(&self) -> [f64; 2] {
        let damped = TAU * self.hz;
        [self.damping / (1.0 - self.damping * self.damping).sqrt() * damped, damped]
    }

    /// The part κ by which an oscillator follows a drive of exp(−t/τ), over that by which it follows a constant one: 1/(1 − 2ζ/ωτ + 1/(ωτ)²).
    pub fn carried(&self, tau_s: f64) -> f64 {
        let turns = self.pole()[1] * tau_s;
        1.0 / (1.0 - 2.0 * self.damping / turns + 1.0 / (turns * turns))
    }

    /// Root mean square at which the force keeps the swing: √(q/4δ).
    pub fn kept_up_m(&self) -> f64 {
        (self.drive_m2_s / (4.0 * self.pole()[0])).sqrt()
    }
}

/// Noise of known form.
#[derive(Debug, Clone, PartialEq)]
pub struct Noise {
    /// Standard deviation of a sample.
    pub white_m: f64,
    /// Variance that the level gains (m²/s).
    pub walk_m2_s: f64,
    /// The slowest first.
    pub swings: Vec<Swing>,
}

impl Noise {
    /// The same with another walk.
    #[must_use]
    pub fn with_walk(&self, walk_m2_s: f64) -> Self {
        Self { walk_m2_s, ..self.clone() }
    }

    /// Number of states.
    pub fn states(&self) -> usize {
        1 + 2 * self.swings.len()
    }

    /// Covariance that walk and force add to the states in a time: ∫ exp(Aτ) g gᵀ exp(Aᵀτ) dτ. One force, a building that shakes the hinge, drives all swings.
    fn driven(&self, step_s: f64) -> Matrix {
        let mut sum = [[0.0; MOST_STATES]; MOST_STATES];
        sum[0][0] = self.walk_m2_s * step_s;
        let part_s = step_s / DRIVEN_PARTS as f64;
        for part in 0..DRIVEN_PARTS {
            let since_s = (part as f64 + 0.5) * part_s;
            let mut driven: State = [0.0; MOST_STATES];
            for (k, swing) in self.swings.iter().enumerate() {
                let [decay, turn] = swing.pole();
                let size = swing.sense * (swing.drive_m2_s * part_s).sqrt() * (-decay * since_s).exp();
                let (s, c) = (turn * since_s).sin_cos();
                (driven[1 + 2 * k], driven[2 + 2 * k]) = (-size * s, size * c);
            }
            for (row, own) in sum.iter_mut().zip(driven) {
                row.iter_mut().zip(driven).for_each(|(cell, other)| *cell += own * other);
            }
        }
        sum
    }
}

/// The gains of the Kalman filter for a grid.
#[derive(Debug, Clone)]
pub struct Filter {
    states: usize,
    turns: Vec<[f64; 2]>,
    /// Of each cell: gain and 1/√(variance of the innovation); that is 0 where the cell holds nothing.
    cells: Vec<(State, f64)>,
    /// Σ ln of the innovations' variances.
    pub ln_determinant: f64,
}

impl Filter {
    /// The filter of a noise on a grid.
    pub fn of(noise: &Noise, grid: &Grid) -> Self {
        let states = noise.states();
        let turns: Vec<[f64; 2]> = noise
            .swings
            .iter()
            .map(|swing| {
                let [decay, turn] = swing.pole();
                let size = (-decay * grid.step_s).exp();
                [size * (turn * grid.step_s).cos(), size * (turn * grid.step_s).sin()]
            })
            .collect();
        let start = (START_SPREAD * grid.spread_m().max(noise.white_m)).powi(2);
        let mut p: Matrix = [[0.0; MOST_STATES]; MOST_STATES];
        for k in 0..states {
            p[k][k] = start;
        }
        let mut filter = Self { states, turns, cells: Vec::with_capacity(grid.len()), ln_determinant: 0.0 };
        let driven = noise.driven(grid.step_s);
        for count in &grid.count {
            let seen = |row: &State| row[0] + row[1..states].iter().step_by(2).sum::<f64>();
            let mut gain = [0.0; MOST_STATES];
            let mut scale = 0.0;
            if *count > 0.0 {
                let mut across = [0.0; MOST_STATES];
                (0..states).for_each(|k| across[k] = seen(&p[k]));
                let variance = seen(&across) + noise.white_m.powi(2) / count;
                for k in 0..states {
                    gain[k] = across[k] / variance;
                }
                for i in 0..states {
                    for j in 0..states {
                        p[i][j] -= gain[i] * across[j];
                    }
                }
                scale = 1.0 / variance.sqrt();
                filter.ln_determinant += variance.ln();
            }
            filter.cells.push((gain, scale));
            filter.advance_covariance(&mut p, &driven);
        }
        filter
    }

    /// P ← T P Tᵀ + Q.
    fn advance_covariance(&self, p: &mut Matrix, driven: &Matrix) {
        for row in &mut p[..self.states] {
            self.turn(row);
        }
        for column in 0..self.states {
            for (k, [c, s]) in self.turns.iter().enumerate() {
                let (a, b) = (p[1 + 2 * k][column], p[2 + 2 * k][column]);
                p[1 + 2 * k][column] = c * a - s * b;
                p[2 + 2 * k][column] = s * a + c * b;
            }
        }
        for (row, added) in p.iter_mut().zip(driven) {
            row.iter_mut().zip(added).for_each(|(cell, more)| *cell += more);
        }
    }

    fn turn(&self, state: &mut State) {
        for (k, [c, s]) in self.turns.iter().enumerate() {
            let (a, b) = (state[1 + 2 * k], state[2 + 2 * k]);
            state[1 + 2 * k] = c * a - s * b;
            state[2 + 2 * k] = s * a + c * b;
        }
    }

    fn turn_back(&self, state: &mut State) {
        for (k, [c, s]) in self.turns.iter().enumerate() {
            let (a, b) = (state[1 + 2 * k], state[2 + 2 * k]);
            state[1 + 2 * k] = c * a + s * b;
            state[2 + 2 * k] = c * b - s * a;
        }
    }

    /// Whether a state is seen.
    fn is_seen(state: usize) -> bool {
        state == 0 || state % 2 == 1
    }

    /// The innovations of a column, each over its standard deviation.
    pub fn whiten(&self, column: &[f64]) -> Vec<f64> {
        let [white] = self.states_of([column], |_| ());
        white
    }

    /// The same of several columns, some side by side: nothing takes more time than this loop, and each of its steps waits for the one before.
    pub fn whiten_all<C: AsRef<[f64]>>(&self, columns: &[C]) -> Vec<Vec<f64>> {
        let some = |columns: &[C]| match columns {
            [only] => vec![self.whiten(only.as_ref())],
            _ => {
                // a lane without a column of its own follows the first
                let lanes: [&[f64]; LANES] = std::array::from_fn(|k| columns.get(k).unwrap_or(&columns[0]).as_ref());
                self.states_of(lanes, |_| ()).into_iter().take(columns.len()).collect()
            }
        };
        columns.chunks(LANES).flat_map(some).collect()
    }

    /// The levels that columns lead to, after each cell, beside the innovations.
    fn states_of<const N: usize>(&self, columns: [&[f64]; N], after: impl FnMut([f64; N])) -> [Vec<f64>; N] {
        match self.turns.len() {
            1 => self.followed::<1, N>(columns, after),
            2 => self.followed::<2, N>(columns, after),
            _ => self.followed::<3, N>(columns, after),
        }
    }

    /// The same with so many swings, known when this is compiled.
    fn followed<const SWINGS: usize, const N: usize>(
        &self,
        columns: [&[f64]; N],
        mut after: impl FnMut([f64; N]),
    ) -> [Vec<f64>; N] {
        let turns: [[f64; 2]; SWINGS] = std::array::from_fn(|k| self.turns.get(k).copied().unwrap_or([0.0; 2]));
        let (mut level, mut a, mut b) = ([0.0; N], [[0.0; N]; SWINGS], [[0.0; N]; SWINGS]);
        let mut white = columns.map(|column| Vec::with_capacity(column.len()));
        for (cell, (gain, scale)) in self.cells.iter().enumerate() {
            let off: [f64; N] = std::array::from_fn(|lane| {
                let foreseen = level[lane] + a.iter().map(|a| a[lane]).sum::<f64>();
                if *scale > 0.0 { columns[lane][cell] - foreseen } else { 0.0 }
            });
            for lane in 0..N {
                level[lane] += gain[0] * off[lane];
            }
            for k in 0..SWINGS {
                let [c, s] = turns[k];
                for lane in 0..N {
                    let (x, y) = (a[k][lane] + gain[1 + 2 * k] * off[lane], b[k][lane] + gain[2 + 2 * k] * off[lane]);
                    (a[k][lane], b[k][lane]) = (c * x - s * y, s * x + c * y);
                }
            }
            white.iter_mut().zip(off).for_each(|(white, off)| white.push(off * scale));
            after(level);
        }
        white
    }

    /// The level after each cell, from what came before and the cell itself.
    pub fn level(&self, column: &[f64]) -> Vec<f64> {
        let mut all = Vec::with_capacity(column.len());
        self.states_of([column], |[level]| all.push(level));
        all
    }

    /// How much a jump of the level at each cell (`free` = 1), or of the level and the first swing (3), would take from the sum of squares: rᵀN⁻¹r of the disturbance smoother
    /// (de Jong and Penzer, 1998); and the jump of the level.
    pub fn jumps(&self, white: &[f64], free: usize) -> Vec<(f64, f64)> {
        let (mut r, mut n): (State, Matrix) = ([0.0; MOST_STATES], [[0.0; MOST_STATES]; MOST_STATES]);
        let mut found = vec![(0.0, 0.0); white.len()];
        let free = free.min(self.states);
        for cell in (0..white.len()).rev() {
            let (gain, scale) = &self.cells[cell];
            // back through the transition, T'r and T'NT
            self.turn_back(&mut r);
            for row in &mut n[..self.states] {
                self.turn_back(row);
            }
            for column in 0..self.states {
                let mut whole = [0.0; MOST_STATES];
                (0..self.states).for_each(|k| whole[k] = n[k][column]);
                self.turn_back(&mut whole);
                (0..self.states).for_each(|k| n[k][column] = whole[k]);
            }
            if *scale > 0.0 {
                // back through the update, (I − KZ)'
                let along: f64 = (0..self.states).map(|k| gain[k] * r[k]).sum();
                let mut across = [0.0; MOST_STATES];
                (0..self.states).for_each(|k| across[k] = (0..self.states).map(|i| n[k][i] * gain[i]).sum());
                let both: f64 = (0..self.states).map(|k| across[k] * gain[k]).sum();
                for i in 0..self.states {
                    let seen_i = f64::from(Self::is_seen(i));
                    r[i] += seen_i * (white[cell] * scale - along);
                    for j in 0..self.states {
                        let seen_j = f64::from(Self::is_seen(j));
                        n[i][j] += -seen_i * across[j] - seen_j * across[i] + seen_i * seen_j * (both + scale * scale);
                    }
                }
            }
            found[cell] = match free {
                1 => (r[0] * r[0] / n[0][0].max(f64::MIN_POSITIVE), r[0] / n[0][0].max(f64::MIN_POSITIVE)),
                _ => {
                    let block = nalgebra::Matrix3::from_fn(|i, j| n[i][j]);
                    let score = nalgebra::Vector3::from_fn(|i, _| r[i]);
                    block
                        .cholesky()
                        .map(|c| c.solve(&score))
                        .map_or((0.0, 0.0), |solved| (solved.dot(&score), solved[0]))
                }
            };
        }
        found
    }
}
