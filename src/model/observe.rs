//! The angles between marks, of a chain that may have several links between two marks.

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

/// The links' angles for given angles between marks, and their derivatives (links × marks): the bend is spread evenly along the strip,
/// from the middle of one stretch between marks to the middle of the next.
pub fn links_from_chords(chain: &Chain, chords_rad: &[f64]) -> (Vec<f64>, DMatrix<f64>) {
    let groups = chain.groups();
    let middle = |g: usize| 0.5 * (groups[g].start + groups[g].end) as f64;
    let mut slopes = DMatrix::zeros(chain.count(), groups.len());
    for link in 0..chain.count() {
        let at = link as f64 + 0.5;
        let own = groups.iter().position(|g| g.contains(&link)).unwrap_or(0);
        if groups.len() == 1 || chain.count() == groups.len() {
            slopes[(link, own)] = 1.0;
            continue;
        }
        // the pair of middles that encloses the link, or the nearest pair beyond the ends
        let lower = if at < middle(own) { own.max(1) } else { (own + 1).min(groups.len() - 1) };
        let share = (at - middle(lower - 1)) / (middle(lower) - middle(lower - 1));
        slopes[(link, lower - 1)] = 1.0 - share;
        slopes[(link, lower)] = share;
    }
    let theta_rad = (0..chain.count()).map(|link| (0..groups.len()).map(|g| slopes[(link, g)] * chords_rad[g]).sum());
    (theta_rad.collect(), slopes)
}
