//! The angles between marks, of a chain that may have several links between two marks.

use std::f64::consts::PI;

use nalgebra::DMatrix;

use super::Chain;

/// Angles of the chords between consecutive marks, from the downward vertical.
///
/// ```text
/// φ = atan2(Σ Lᵢ sin θᵢ, Σ Lᵢ cos θᵢ)      over the links between the marks
/// ```
/// The turn nearest to the first of these links is chosen.
pub fn chord_angles_rad(chain: &Chain, theta_rad: &[f64]) -> Vec<f64> {
    chain.groups().iter().map(|group| chord(chain, theta_rad, group.clone()).0).collect()
}

/// ∂φ/∂θ: marks − 1 rows, one column a link. ∂φ/∂θᵢ = Lᵢ cos(θᵢ − φ)/chord.
pub fn chord_slopes(chain: &Chain, theta_rad: &[f64]) -> DMatrix<f64> {
    let mut slopes = DMatrix::zeros(chain.groups().len(), chain.count());
    for (row, group) in chain.groups().iter().enumerate() {
        let (phi_rad, length_m) = chord(chain, theta_rad, group.clone());
        for link in group.clone() {
            slopes[(row, link)] = chain.length_m(link) * (theta_rad[link] - phi_rad).cos() / length_m;
        }
    }
    slopes
}

fn chord(chain: &Chain, theta_rad: &[f64], group: std::ops::Range<usize>) -> (f64, f64) {
    if group.len() == 1 {
        return (theta_rad[group.start], chain.length_m(group.start));
    }
    // relative to the first link, so that full turns are kept
    let first_rad = theta_rad[group.start];
    let (mut across_m, mut along_m) = (0.0, 0.0);
    for link in group {
        let (sin, cos) = (theta_rad[link] - first_rad).sin_cos();
        across_m += chain.length_m(link) * sin;
        along_m += chain.length_m(link) * cos;
    }
    (first_rad + f64::atan2(across_m, along_m), f64::hypot(across_m, along_m))
}

/// The links' angles for angles between marks: links × marks. Of several links between two marks the smoothest shapes with free ends are taken,
///
/// ```text
/// θ(s) = Σₖ bₖ cos(kπ s/L),   k = 0 … marks − 2
/// ```
///
/// as many as there are angles; θ′ = 0 at both ends, where no moment acts.
pub fn links_from_chords(chain: &Chain) -> DMatrix<f64> {
    let (n, groups) = (chain.count(), chain.groups());
    if n == groups.len() {
        return DMatrix::identity(n, n);
    }
    let whole_m: f64 = (0..n).map(|link| chain.length_m(link)).sum();
    let mut above_m = 0.0;
    let middles: Vec<f64> = (0..n)
        .map(|link| {
            above_m += chain.length_m(link);
            (above_m - 0.5 * chain.length_m(link)) / whole_m
        })
        .collect();
    let shapes = DMatrix::from_fn(n, groups.len(), |link, k| (k as f64 * PI * middles[link]).cos());
    let chords = DMatrix::from_fn(groups.len(), groups.len(), |row, k| {
        let across_m: f64 = groups[row].clone().map(|link| chain.length_m(link) * shapes[(link, k)]).sum();
        across_m / groups[row].clone().map(|link| chain.length_m(link)).sum::<f64>()
    });
    // a sum of m such cosines has less than m zeros, so its means over m stretches do not all vanish: there is an inverse
    let inverse = chords.try_inverse().unwrap_or_else(|| DMatrix::identity(groups.len(), groups.len()));
    shapes * inverse
}
