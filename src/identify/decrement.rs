//! The logarithmic decrement over all peaks.
//!
//! ```text
//! ln |θₖ − o| = c − δ k/2,   ξ = δ / √(4π² + δ²)          (paper Eq. 27, there for two peaks n cycles apart)
//! ```
//! k counts the extremes, those of both signs, half a cycle each. Every extreme is the vertex of a parabola through the samples of a quarter
//! cycle around it. The regression weighs each logarithm with the square of its peak, for an error s of a peak is s/|θₖ| in the logarithm;
//! extremes below five such errors are left out, where noise would be taken for peaks. Their times give the frequency, weighted alike.

use nalgebra::{DMatrix, DVector};
use serde::Serialize;

use super::estimate::{Estimate, chi_squared_tail};
use super::signal::LinkSamples;

/// A peak must exceed this many of its standard deviations.
const CLEAR_OF_NOISE: f64 = 5.0;

/// The decay of one link's peaks.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Decrement {
    /// Extremes of both signs that were used.
    pub peaks: usize,
    /// δ, a cycle.
    pub decrement: Estimate,
    /// ξ.
    pub damping_ratio: Estimate,
    /// Undamped natural frequency.
    pub frequency_hz: Estimate,
    /// Probability that the logarithms scatter this far about a straight line by noise; small: the decay is not exponential.
    pub p_straight: f64,
}

/// One extreme.
struct Extreme {
    index: f64,
    vertex: Vertex,
}

/// The top of a parabola.
#[derive(Clone, Copy)]
struct Vertex {
    t_s: f64,
    height_rad: f64,
    /// Standard deviation of the height over the samples' noise: 1.5/√m for m samples spread evenly.
    spread: f64,
}

impl Decrement {
    /// Of a link's samples with the offset (and any other mode) taken away, that oscillate at about `frequency_hz` with this noise.
    ///
    /// # Errors
    /// In words, with the number of peaks, when there are fewer than four.
    pub fn of(link: &LinkSamples, frequency_hz: f64, noise_rad: f64) -> Result<Self, String> {
        let rate_hz =
            (link.t_s.len() as f64 - 1.0) / (link.t_s.last().unwrap_or(&1.0) - link.t_s.first().unwrap_or(&0.0));
        let samples = 0.25 * rate_hz / frequency_hz;
        if samples < 3.0 {
            return Err(format!("{:.1} samples per cycle; a peak needs 12", 4.0 * samples));
        }
        let extremes = follow(link, frequency_hz, noise_rad);
        if extremes.len() < 4 {
            return Err(format!("{} peaks stand clear of the noise; at least 4 are needed", extremes.len()));
        }
        let weights: Vec<f64> =
            extremes.iter().map(|e| (e.vertex.height_rad / (e.vertex.spread * noise_rad)).powi(2)).collect();
        let index: Vec<f64> = extremes.iter().map(|e| e.index).collect();
        let logs =
            Line::through(&index, &extremes.iter().map(|e| e.vertex.height_rad.ln()).collect::<Vec<_>>(), &weights);
        let times = Line::through(&index, &extremes.iter().map(|e| e.vertex.t_s).collect::<Vec<_>>(), &weights);
        let free = extremes.len() as f64 - 2.0;
        let p_straight = chi_squared_tail(logs.chi2, free);
        // scatter beyond the noise widens the interval
        let widened = if p_straight < 0.01 { (logs.chi2 / free).sqrt() } else { 1.0 };
        let decrement = Estimate::new(-2.0 * logs.slope, 2.0 * logs.sd * widened, free);
        let damping = |d: f64| d / d.hypot(std::f64::consts::TAU);
        let tau2 = std::f64::consts::TAU.powi(2);
        let damping_ratio = decrement.map(damping, tau2 / (tau2 + decrement.value.powi(2)).powf(1.5));
        // the vertex's slope error over its curvature: √(12/m)/(quarter cycle) s over (2πf)²·height
        let per_weight = time_error_s(frequency_hz);
        let scale = if free > 0.0 { (times.chi2 / free).sqrt() } else { 1.0 };
        let period = Estimate::new(2.0 * times.slope, 2.0 * times.sd * scale.max(per_weight), free);
        let natural = (1.0 - damping_ratio.value.powi(2)).sqrt();
        let frequency_hz = period.map(|p| 1.0 / (p * natural), 1.0 / (period.value.powi(2) * natural));
        Ok(Self { peaks: extremes.len(), decrement, damping_ratio, frequency_hz, p_straight })
    }
}

/// Error of a vertex's time per relative error of its height: √(12/m)·s/(¼T) for the slope over (2π/T)²A for the curvature, the height's
/// error being 1.5 s/√m.
fn time_error_s(frequency_hz: f64) -> f64 {
    let slope_per_height = 12f64.sqrt() * 4.0 * frequency_hz / 1.5;
    slope_per_height / (std::f64::consts::TAU * frequency_hz).powi(2)
}

/// Steps from extreme to extreme, half a cycle each, until they sink into the noise or the record ends.
fn follow(link: &LinkSamples, frequency_hz: f64, noise_rad: f64) -> Vec<Extreme> {
    let half_s = 0.5 / frequency_hz;
    let (Some(first_s), Some(last_s)) = (link.t_s.first(), link.t_s.last()) else { return Vec::new() };
    // the first whole quarter cycle around an extreme lies within the first cycle
    let until = link.t_s.partition_point(|t| *t < first_s + 2.25 * half_s);
    let from = link.t_s.partition_point(|t| *t < first_s + 0.25 * half_s);
    let largest = (from..until).max_by(|a, b| link.theta_rad[*a].abs().total_cmp(&link.theta_rad[*b].abs()));
    let Some(largest) = largest else { return Vec::new() };
    let mut sign = link.theta_rad[largest].signum();
    let mut expected_s = link.t_s[largest];
    let (mut extremes, mut index, mut misses) = (Vec::new(), 0.0, 0);
    while expected_s + 0.25 * half_s <= *last_s {
        match vertex(link, expected_s, half_s, sign) {
            Some(vertex) if vertex.height_rad > CLEAR_OF_NOISE * vertex.spread * noise_rad => {
                extremes.push(Extreme { index, vertex });
                expected_s = vertex.t_s;
                misses = 0;
            }
            Some(_) => break,
            // a gap; after long ones the half cycles cannot be counted
            None if misses < 8 => misses += 1,
            None => break,
        }
        expected_s += half_s;
        index += 1.0;
        sign = -sign;
    }
    extremes
}

/// Time and height of the parabola through a quarter cycle of samples about an expected extreme; `None` where too many are missing.
fn vertex(link: &LinkSamples, expected_s: f64, half_s: f64, sign: f64) -> Option<Vertex> {
    let mut found = Vertex { t_s: expected_s, height_rad: 0.0, spread: 1.0 };
    for _ in 0..3 {
        let centre_s = found.t_s;
        let from = link.t_s.partition_point(|t| *t < centre_s - 0.25 * half_s);
        let until = link.t_s.partition_point(|t| *t <= centre_s + 0.25 * half_s);
        let (t, a) = (&link.t_s[from..until], &link.theta_rad[from..until]);
        let both_sides = t.first().is_some_and(|t| *t < centre_s) && t.last().is_some_and(|t| *t > centre_s);
        if t.len() < 3 || !both_sides {
            return None;
        }
        let basis = DMatrix::from_fn(t.len(), 3, |i, j| ((t[i] - centre_s) / half_s).powi(j as i32));
        let values = DVector::from_iterator(a.len(), a.iter().map(|a| sign * a));
        let inverse = basis.tr_mul(&basis).try_inverse()?;
        let fit = &inverse * basis.tr_mul(&values);
        let move_by = -0.5 * fit[1] / fit[2];
        if !(fit[2] < 0.0 && move_by.abs() < 0.35) {
            // no hill of this sign here: nothing but noise is left
            return Some(Vertex { t_s: centre_s, height_rad: 0.0, spread: 1.0 });
        }
        found = Vertex {
            t_s: centre_s + move_by * half_s,
            height_rad: fit[0] - 0.25 * fit[1] * fit[1] / fit[2],
            spread: inverse[(0, 0)].sqrt(),
        };
    }
    Some(found)
}

/// A weighted straight line, weights being inverse variances.
struct Line {
    slope: f64,
    sd: f64,
    chi2: f64,
}

impl Line {
    fn through(x: &[f64], y: &[f64], weights: &[f64]) -> Self {
        let sum = |f: &dyn Fn(usize) -> f64| (0..x.len()).map(|i| weights[i] * f(i)).sum::<f64>();
        let total = sum(&|_| 1.0);
        let (mx, my) = (sum(&|i| x[i]) / total, sum(&|i| y[i]) / total);
        let sxx = sum(&|i| (x[i] - mx).powi(2));
        let slope = sum(&|i| (x[i] - mx) * (y[i] - my)) / sxx;
        let chi2 = sum(&|i| (y[i] - my - slope * (x[i] - mx)).powi(2));
        Self { slope, sd: sxx.recip().sqrt(), chi2 }
    }
}
