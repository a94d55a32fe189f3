//! Residuals in units of their noise: divided by it, less what the noise before and beside foretells, and with errors in step with the swing discounted.
//!
//! A value's noise has the standard deviation σ. The share s of its variance goes on from row to row with the correlation ρ, the rest is white; what is
//! new in it goes with that of the other angles ([`super::angle_correlation`]). Beside it a tracked angle has errors that come again whenever the
//! specimen is where it was: what a mark stands on shifts it by a hundredth of a pixel, and turns with the strip. They are Φb, b normal of unit variance:
//!
//! ```text
//! r ← r/σ                                       of every value
//! r ← (r − ρĉ)/√S,  ĉ ← ρĉ + K(r − ρĉ)          from row to row (ĉ: what goes on, as seen so far; S = P + 1 − s, K = P/S,
//!                                               P ← ρ²(P − KP) + s(1 − ρ²), at first s)
//! r ← (r − βᵀ r_before)/√(1 − βᵀc)              from angle to angle
//! r ← (1 + ΦΦᵀ)^(−1/2) r                        Φ with its rows like r's
//! Φ of an angle: share · σ · [1, u, u³, w]      u: the angle,  w: the next link's less it;  each of root mean square 1
//! (1 + ΦΦᵀ)^(∓1/2) = 1 + Ψ diag(((1 + λ)^(∓1/2) − 1)/λ) Ψᵀ        Ψ = ΦV,  ΦᵀΦ = VΛVᵀ
//! ```
//!
//! so that residuals become independent and of unit variance, and their derivatives with them.

use nalgebra::{DMatrix, DVector};
use smallvec::SmallVec;

use super::Problem;
use super::angle_correlation::{Across, ConditionalCache};
use super::predict::Value;
use super::record::Record;
use crate::statistics::median_step_s;

/// Shapes of an error in step with the swing, of each angle: those of Φ above.
pub const SYNCHRONOUS_TERMS: usize = 4;
/// Correlations from row to row that differ by less than this are one (judgement: less than the uncertainty of one over 1000 values, as of the noise that a
/// diagnosis learns again).
const SAME_CORRELATION: f64 = 0.03;

/// How noise goes on from row to row: a part of it as a first-order autoregression, beside white noise.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Colour {
    /// Correlation of that part from row to row.
    pub rho: f64,
    /// Its share of the variance.
    pub share: f64,
}

impl Colour {
    /// Whether no row says anything of the next.
    pub fn is_white(self) -> bool {
        self.rho * self.share == 0.0
    }

    /// Whether it makes a difference which of the two it is: in the variance that goes on, or for how long.
    pub fn differs_from(self, other: Self) -> bool {
        let first = |colour: Self| colour.rho * colour.share;
        (first(self) - first(other)).abs() > SAME_CORRELATION
            || first(self) > 0.0 && (self.rho - other.rho).abs() > SAME_CORRELATION
    }
}

/// Noise of one recording's angles.
#[derive(Debug, Clone, PartialEq)]
pub struct RecordNoise {
    /// Standard deviation of each angle.
    pub sd_rad: Vec<f64>,
    /// How each angle's noise goes on from row to row.
    pub colour: Vec<Colour>,
    /// Correlations of what is new in the angles' noise at a row.
    pub across: Across,
    /// Errors in step with the swing that each angle may have, as a share of its noise.
    pub synchronous: f64,
}

impl RecordNoise {
    /// White and independent.
    pub fn white(sd_rad: Vec<f64>) -> Self {
        let across = Across::none(sd_rad.len());
        Self { colour: vec![Colour::default(); sd_rad.len()], sd_rad, across, synchronous: 0.0 }
    }

    /// Whether every row is new.
    pub fn is_white(&self) -> bool {
        self.colour.iter().all(|colour| colour.is_white())
    }
}

/// A step of the filter for what goes on in a link's noise.
#[derive(Debug, Clone, Copy)]
struct Foretold {
    /// ρ^(rows since the value before); zero at the first of a link.
    fade: f64,
    /// K.
    gain: f64,
    /// √S.
    sd: f64,
}

/// What other angles of a row say of a value.
#[derive(Debug, Clone)]
struct Beside {
    /// Where their values stand, and by how much each counts.
    of: SmallVec<[(usize, f64); 2]>,
    sd: f64,
}

impl Beside {
    fn said(&self, column: &[f64]) -> f64 {
        self.of.iter().map(|(place, part)| part * column[*place]).sum()
    }
}

/// What makes residuals of some rows of a recording independent and of unit variance.
#[derive(Debug, Clone)]
pub struct Whitening {
    /// 1/σ.
    weights: Vec<f64>,
    /// What the values before say of each; nothing where the noise is white.
    foretold: Vec<Foretold>,
    /// What the values of the angles above at the same row say of each; nothing where no angle says anything of another.
    beside: Vec<Beside>,
    /// Ψ and λ.
    synchronous: Option<(DMatrix<f64>, DVector<f64>)>,
}

impl Whitening {
    /// Of some values of a recording, link after link.
    pub fn of(problem: &Problem<'_>, record: usize, values: &[Value]) -> Self {
        let data = &problem.records[record];
        let mut whitening = Self {
            weights: values.iter().map(|v| 1.0 / problem.sd_rad(record, v.link, v.row)).collect(),
            foretold: foretold(problem, record, values),
            beside: beside(data, &problem.noise[record].across, values),
            synchronous: None,
        };
        if problem.noise[record].synchronous > 0.0 {
            let shapes = synchronous_basis(data, &problem.noise[record]);
            let mut phi = DMatrix::zeros(values.len(), data.links() * SYNCHRONOUS_TERMS);
            for (i, value) in values.iter().enumerate() {
                let own = shapes[value.link][value.row];
                (0..SYNCHRONOUS_TERMS).for_each(|k| phi[(i, value.link * SYNCHRONOUS_TERMS + k)] = own[k]);
            }
            whitening.apply(&mut phi);
            let eigen = phi.tr_mul(&phi).symmetric_eigen();
            whitening.synchronous = Some((phi * &eigen.eigenvectors, eigen.eigenvalues));
        }
        whitening
    }

    /// Whitens columns, each of as many rows as there are values.
    pub fn apply(&self, columns: &mut DMatrix<f64>) {
        columns.column_iter_mut().for_each(|mut column| self.whiten(column.as_mut_slice()));
    }

    /// Whitens one column.
    pub fn whiten(&self, column: &mut [f64]) {
        column.iter_mut().zip(&self.weights).for_each(|(value, weight)| *value *= weight);
        let mut goes_on = 0.0;
        for (value, of) in column.iter_mut().zip(&self.foretold) {
            goes_on *= of.fade;
            let new = *value - goes_on;
            goes_on += of.gain * new;
            *value = new / of.sd;
        }
        // the last angle first, so that those beside are as they were
        for (i, beside) in self.beside.iter().enumerate().rev() {
            column[i] = (column[i] - beside.said(column)) / beside.sd;
        }
        self.stretch(column, -0.5);
    }

    /// Makes noise of as many independent numbers of unit variance: the inverse of [`Whitening::whiten`].
    pub fn colour(&self, column: &mut [f64]) {
        self.stretch(column, 0.5);
        for (i, beside) in self.beside.iter().enumerate() {
            column[i] = beside.sd * column[i] + beside.said(column);
        }
        let mut goes_on = 0.0;
        for (value, of) in column.iter_mut().zip(&self.foretold) {
            goes_on *= of.fade;
            let new = of.sd * *value;
            *value = goes_on + new;
            goes_on += of.gain * new;
        }
        column.iter_mut().zip(&self.weights).for_each(|(value, weight)| *value /= weight);
    }

    /// (1 + ΦΦᵀ)^power of a column.
    fn stretch(&self, column: &mut [f64], power: f64) {
        let Some((shapes, lambda)) = &self.synchronous else { return };
        for (shape, lambda) in shapes.column_iter().zip(lambda.iter().map(|l| l.max(1e-12))) {
            let along: f64 = shape.iter().zip(column.iter()).map(|(a, b)| a * b).sum();
            let size = along * ((1.0 + lambda).powf(power) - 1.0) / lambda;
            column.iter_mut().zip(shape.iter()).for_each(|(value, shape)| *value += size * shape);
        }
    }
}

/// What the values before say of each.
fn foretold(problem: &Problem<'_>, record: usize, values: &[Value]) -> Vec<Foretold> {
    let (noise, t_s) = (&problem.noise[record], &problem.records[record].t_s);
    if noise.is_white() {
        return Vec::new();
    }
    let step_s = median_step_s(t_s).unwrap_or(1.0);
    let mut spread = 0.0;
    let of = |i: usize| {
        let Value { link, row, .. } = values[i];
        let Colour { rho, share } = noise.colour[link];
        let before = i.checked_sub(1).map(|before| &values[before]).filter(|before| before.link == link);
        let fade = before.map_or(0.0, |before| rho.powf((t_s[row] - t_s[before.row]) / step_s));
        // P before the value, S, K, and P after it
        let expected = fade * fade * spread + share * (1.0 - fade * fade);
        let variance = expected + 1.0 - share;
        let gain = expected / variance;
        spread = expected * (1.0 - gain);
        Foretold { fade, gain, sd: variance.sqrt() }
    };
    (0..values.len()).map(of).collect()
}

/// Of each value, what those of the angles above at the same row say.
fn beside(record: &Record, across: &Across, values: &[Value]) -> Vec<Beside> {
    if across.is_none() {
        return Vec::new();
    }
    let mut place = vec![vec![None; record.len()]; record.links()];
    values.iter().enumerate().for_each(|(i, value)| place[value.link][value.row] = Some(i));
    let mut memo = ConditionalCache::new(across);
    let of = |value: &Value| {
        let above: SmallVec<[usize; 4]> = (0..value.link).filter(|link| place[*link][value.row].is_some()).collect();
        let places = above.iter().filter_map(|link| place[*link][value.row]);
        let given = memo.given(value.link, &above);
        Beside { of: places.zip(given.beta.iter().copied()).collect(), sd: given.sd }
    };
    values.iter().map(of).collect()
}

/// Errors in step with the swing that each angle may have (rad), `[link][row]`.
pub fn synchronous_basis(record: &Record, noise: &RecordNoise) -> Vec<Vec<[f64; SYNCHRONOUS_TERMS]>> {
    let of_unit_size = |values: Vec<f64>| -> Vec<f64> {
        let rms = (values.iter().map(|v| v * v).sum::<f64>() / values.len().max(1) as f64).sqrt();
        values.iter().map(|v| v / rms.max(1e-300)).collect()
    };
    let of = |link: usize| {
        let angles = &record.theta_rad[link];
        let next = [link + 1, link.wrapping_sub(1)].into_iter().find_map(|other| record.theta_rad.get(other));
        let angle = of_unit_size(angles.iter().map(|a| a.unwrap_or(0.0)).collect());
        let cube = of_unit_size(angle.iter().map(|a| a.powi(3)).collect());
        let bend = |row: usize| Some(next?[row]? - angles[row]?);
        let bend = of_unit_size((0..record.len()).map(|row| bend(row).unwrap_or(0.0)).collect());
        let size = noise.synchronous * noise.sd_rad[link];
        (0..record.len()).map(|row| [1.0, angle[row], cube[row], bend[row]].map(|shape| size * shape)).collect()
    };
    (0..record.links()).map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::experiment::{Experiment, Specimen};

    /// A recording of two angles that swing at two frequencies.
    fn record() -> Record {
        let t_s: Vec<f64> = (0..200).map(|k| k as f64 / 30.0).collect();
        let angle = |size: f64, other: f64| {
            t_s.iter().map(|t| Some(size * (6.0 * t).cos() + other * (17.0 * t).sin())).collect::<Vec<_>>()
        };
        let theta_rad = vec![angle(0.4, 0.02), angle(0.5, -0.05)];
        Record { synchronous: 0.25, ..Record::uniform("made", t_s, theta_rad) }
    }

    /// The 200 rows of so many angles that are seen.
    fn values(links: usize, seen: impl Fn(usize, usize) -> bool) -> Vec<Value> {
        (0..links)
            .flat_map(|link| (0..200).map(move |row| Value { link, row, predicted_rad: 0.0, rate_rad_s: 0.0 }))
            .filter(|v| seen(v.link, v.row))
            .collect()
    }

    /// Noise of this covariance is white afterwards, and as it was when it is coloured again.
    fn assert_whitens(whitening: &Whitening, covariance: DMatrix<f64>) {
        let count = covariance.nrows();
        let mut once = covariance;
        whitening.apply(&mut once);
        let mut twice = once.transpose();
        whitening.apply(&mut twice);
        let off = (&twice - DMatrix::identity(count, count)).amax();
        assert!(off < 1e-9, "{off}");
        let given: Vec<f64> = (0..count).map(|i| (i * i % 37) as f64).collect();
        let mut back = given.clone();
        whitening.colour(&mut back);
        whitening.whiten(&mut back);
        assert!(given.iter().zip(&back).all(|(a, b)| (a - b).abs() < 1e-9));
    }

    #[test]
    fn whitened_errors_have_unit_variance_in_every_direction() {
        let records = [record()];
        let mut problem = Problem::new(&records, &Experiment::default(), &[]).unwrap();
        let colour = vec![Colour { rho: 0.3, share: 1.0 }, Colour::default()];
        let noise =
            RecordNoise { sd_rad: vec![1e-3, 2e-3], colour, across: Across::of(2, |_, _| -0.6), synchronous: 0.25 };
        problem.noise = vec![noise.clone()];
        let values = values(2, |_, _| true);
        // the covariance as it is stated: coloured noise and errors in step
        let shapes = synchronous_basis(&records[0], &noise);
        let stationary = (1.0 - 0.3f64.powi(2)).sqrt() * -0.6;
        let covariance = DMatrix::from_fn(400, 400, |i, j| {
            let (a, b) =
                if values[i].link <= values[j].link { (&values[i], &values[j]) } else { (&values[j], &values[i]) };
            let (earlier, later) = (a.row.min(b.row), a.row.max(b.row));
            let steps = (later - earlier) as i32;
            let sizes = noise.sd_rad[a.link] * noise.sd_rad[b.link];
            if a.link == b.link {
                let (one, other) = (shapes[a.link][a.row], shapes[b.link][b.row]);
                let synchronous: f64 = one.iter().zip(&other).map(|(x, y)| x * y).sum();
                return sizes * noise.colour[a.link].rho.powi(steps) + synchronous;
            }
            // the first angle remembers what both had at an earlier row, the second one forgets
            let at_once = if b.row == 0 { -0.6 } else { stationary };
            if a.row >= b.row { sizes * at_once * 0.3f64.powi(steps) } else { 0.0 }
        });
        let whitening = Whitening::of(&problem, 0, &values);
        assert_whitens(&whitening, covariance);
    }

    #[test]
    fn the_noise_of_three_angles_that_goes_together_is_whitened_where_some_are_missing() {
        let two = record();
        let mut theta_rad = two.theta_rad.clone();
        theta_rad.push(theta_rad[0].clone());
        theta_rad[0][20..40].fill(None);
        theta_rad[1][30..50].fill(None);
        let records = [Record::uniform("made", two.t_s, theta_rad)];
        let specimen = Specimen { link_lengths_m: vec![0.1; 3], ..Experiment::default().specimen };
        let experiment = Experiment { specimen, ..Experiment::default() };
        let mut problem = Problem::new(&records, &experiment, &[]).unwrap();
        let between = |i: usize, j: usize| [[0.0, 0.8, 0.6], [0.0, 0.0, -0.1]][i][j];
        let sd_rad = [1e-3, 2e-3, 3e-3];
        problem.noise = vec![RecordNoise { across: Across::of(3, between), ..RecordNoise::white(sd_rad.to_vec()) }];
        let seen = |link: usize, row: usize| records[0].theta_rad[link][row].is_some();
        let values = values(3, seen);
        let correlations = &problem.noise[0].across;
        let covariance = DMatrix::from_fn(values.len(), values.len(), |i, j| {
            let (a, b) = (&values[i], &values[j]);
            let correlation = if a.link == b.link { 1.0 } else { correlations.between(a.link, b.link) };
            if a.row == b.row { correlation * sd_rad[a.link] * sd_rad[b.link] } else { 0.0 }
        });
        let whitening = Whitening::of(&problem, 0, &values);
        assert_whitens(&whitening, covariance);
    }

    #[test]
    fn white_noise_beside_coloured_noise_is_whitened_across_a_gap() {
        let mut record = record();
        record.theta_rad[0][70..95].fill(None);
        let records = [record];
        let mut problem = Problem::new(&records, &Experiment::default(), &[]).unwrap();
        let colour = vec![Colour { rho: 0.9, share: 0.6 }, Colour { rho: 0.97, share: 0.3 }];
        problem.noise = vec![RecordNoise { colour: colour.clone(), ..RecordNoise::white(vec![1e-3, 2e-3]) }];
        let seen = |link: usize, row: usize| link == 1 || !(70..95).contains(&row);
        let values = values(2, seen);
        let covariance = DMatrix::from_fn(values.len(), values.len(), |i, j| {
            let (a, b) = (&values[i], &values[j]);
            if a.link != b.link {
                return 0.0;
            }
            let Colour { rho, share } = colour[a.link];
            let white = if a.row == b.row { 1.0 - share } else { 0.0 };
            let sd_rad: f64 = [1e-3, 2e-3][a.link];
            sd_rad.powi(2) * (share * rho.powi(a.row.abs_diff(b.row) as i32) + white)
        });
        let whitening = Whitening::of(&problem, 0, &values);
        assert_whitens(&whitening, covariance);
    }
}
