//! Start values: the matrix pencil.
//!
//! Hua and Sarkar, IEEE Trans. Acoust. Speech Signal Process. 38 (1990) 814. The rows of a Hankel matrix H of an evenly sampled sum of p damped
//! exponentials span the space of (1, z, z², …) for the p poles z = e^{sΔt}. With V the p leading eigenvectors of HᵀH, V↓ without its last and V↑
//! without its first row, the poles are the eigenvalues of V↓⁺ V↑. Several links with common poles share HᵀH.

use nalgebra::DMatrix;

use super::pole::Pole;
use super::signal::{LinkSamples, Signal};

/// Grid points taken, at most: the cost rises with their cube.
const MOST_POINTS: usize = 300;

/// Poles of the strongest oscillations up to `highest_hz`, unordered; empty when the record is too short.
pub fn matrix_pencil(signal: &Signal, modes: usize, highest_hz: f64) -> Vec<Pole> {
    // averaged into cells a few to the shortest period, which is also where noise and gaps are dealt with
    let cell_s = (1.0 / (5.0 * highest_hz)).max(signal.step_s);
    let cells = ((signal.duration_s() / cell_s) as usize).min(MOST_POINTS);
    // two poles a mode; two more take up the offset and what is not sinusoidal
    let order = 2 * modes + 2;
    let columns = cells / 3;
    if columns < order + 1 {
        return Vec::new();
    }
    let mut gram = DMatrix::<f64>::zeros(columns, columns);
    for link in &signal.links {
        let values = cell_means(link, signal.span_s[0], cell_s, cells);
        let hankel = DMatrix::from_fn(cells - columns + 1, columns, |i, j| values[i + j]);
        gram += hankel.tr_mul(&hankel);
    }
    let eigen = gram.symmetric_eigen();
    let mut order_by_size: Vec<usize> = (0..columns).collect();
    order_by_size.sort_by(|a, b| eigen.eigenvalues[*b].total_cmp(&eigen.eigenvalues[*a]));
    let space = DMatrix::from_fn(columns, order, |i, j| eigen.eigenvectors[(i, order_by_size[j])]);
    let (upper, lower) = (space.rows(0, columns - 1), space.rows(1, columns - 1));
    let Ok(shift) = upper.into_owned().svd(true, true).solve(&lower.into_owned(), 1e-12) else { return Vec::new() };
    let eigenvalues = shift.complex_eigenvalues();
    let poles = eigenvalues.iter().filter(|z| z.im > 0.0 && z.norm() > 1e-6).map(|z| {
        let s = z.ln() / cell_s;
        Pole { omega_rad_s: s.im, decay_per_s: (-s.re).max(0.0) }
    });
    let lowest_rad_s = std::f64::consts::TAU * 0.7 / signal.duration_s();
    let mut poles: Vec<Pole> = poles.filter(|p| p.omega_rad_s > lowest_rad_s).collect();
    // the strongest oscillations are the lightest damped ones of so few poles
    poles.sort_by(|a, b| a.decay_per_s.total_cmp(&b.decay_per_s));
    poles.truncate(modes);
    poles
}

/// Means over cells of time; a cell without a sample takes the line between its neighbours.
fn cell_means(link: &LinkSamples, start_s: f64, cell_s: f64, cells: usize) -> Vec<f64> {
    let mean = link.mean_rad();
    let (mut sums, mut counts) = (vec![0.0; cells], vec![0.0; cells]);
    for (t, a) in link.t_s.iter().zip(&link.theta_rad) {
        let cell = ((t - start_s) / cell_s) as usize;
        if cell < cells {
            sums[cell] += a - mean;
            counts[cell] += 1.0;
        }
    }
    let known: Vec<(usize, f64)> = (0..cells).filter(|c| counts[*c] > 0.0).map(|c| (c, sums[c] / counts[c])).collect();
    let between = |cell: usize| {
        let after = known.partition_point(|(c, _)| *c < cell);
        match (after.checked_sub(1).map(|k| known[k]), known.get(after)) {
            (_, Some((c, v))) if *c == cell => *v,
            (Some((a, va)), Some((b, vb))) => va + (vb - va) * (cell - a) as f64 / (b - a) as f64,
            _ => 0.0,
        }
    };
    (0..cells).map(between).collect()
}
