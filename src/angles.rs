//! Tracks → θ₁, θ₂, … with standard deviations, and the table `angles.csv`.
//!
//! ```text
//! θ = atan2(Δx, −Δy),   σ_θ² = (Δy² σ_Δx² + Δx² σ_Δy² − 2 Δx Δy σ_ΔxΔy) / (Δx² + Δy²)²
//! ```
//! with Δ from the upper mark (or pivot) to the lower one, in the rig's frame. The measured centroids are used, or
//! the fixed-interval smoother's positions; never the filter's, which lag.

use std::fmt::Write as _;

use crate::calibrate::Calibration;
use crate::error::Result;
use crate::track::{Flags, Measured, Tracks};

/// Where the positions behind the angles come from.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum AngleSource {
    /// Centroids, one frame each, independent errors; gaps stay gaps.
    #[default]
    Measured,
    /// The fixed-interval smoother; gaps are bridged with growing standard deviation.
    Smoothed,
}

/// One angle in one frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Angle {
    /// From the downward vertical, unwrapped along the recording.
    pub theta_rad: f64,
    /// Standard deviation.
    pub sd_rad: f64,
}

/// The angles of every link in every frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Angles {
    /// Time stamps.
    pub t_s: Vec<f64>,
    /// For each link, top to bottom, an angle a frame where it was measured.
    pub links: Vec<Vec<Option<Angle>>>,
}

/// Angles of the links between consecutive marks, from the pivot where one is given.
///
/// # Errors
/// [`crate::Error::OpenCv`] from the lens correction.
pub fn angles_from_tracks(
    tracks: &Tracks,
    calibration: &Calibration,
    pivot_px: Option<[f64; 2]>,
    source: AngleSource,
) -> Result<Angles> {
    let mut nodes: Vec<Vec<Option<Measured>>> = Vec::new();
    if let Some(position_px) = pivot_px {
        let fixed = Measured { position_px, covariance_px2: [0.0; 3], area_px2: 0.0 };
        nodes.push(vec![Some(fixed); tracks.t_s.len()]);
    }
    for mark in 0..tracks.marks.len() {
        nodes.push(match source {
            AngleSource::Measured => tracks.marks[mark].iter().map(|p| p.measured).collect(),
            AngleSource::Smoothed => tracks.smoothed(mark),
        });
    }
    if let Some(lens) = &calibration.lens {
        for node in &mut nodes {
            let points: Vec<[f64; 2]> = node.iter().flatten().map(|m| m.position_px).collect();
            let straight = lens.straighten(&points)?;
            for (m, p) in node.iter_mut().flatten().zip(straight) {
                m.position_px = p;
            }
        }
    }
    let links = nodes
        .windows(2)
        .map(|pair| {
            let mut angles: Vec<Option<Angle>> =
                pair[0].iter().zip(&pair[1]).map(|(a, b)| angle(calibration, a.as_ref()?, b.as_ref()?)).collect();
            unwrap_turns(angles.iter_mut().flatten().map(|angle| &mut angle.theta_rad));
            angles
        })
        .collect();
    Ok(Angles { t_s: tracks.t_s.clone(), links })
}

fn angle(calibration: &Calibration, upper: &Measured, lower: &Measured) -> Option<Angle> {
    let vector = calibration.vector(upper.position_px, lower.position_px);
    let length2 = vector[0] * vector[0] + vector[1] * vector[1];
    if length2 <= 0.0 {
        return None;
    }
    // σ along the normal of the link is the same in the picture's axes as in the rig's, aspect apart
    let dx = calibration.pixel_aspect * (lower.position_px[0] - upper.position_px[0]);
    let dy = lower.position_px[1] - upper.position_px[1];
    let sum = |k: usize| upper.covariance_px2[k] + lower.covariance_px2[k];
    let a = calibration.pixel_aspect;
    let variance = (dy * dy * a * a * sum(0) + dx * dx * sum(1) - 2.0 * dx * dy * a * sum(2)) / (length2 * length2);
    Some(Angle { theta_rad: Calibration::angle_rad(vector), sd_rad: variance.max(0.0).sqrt() })
}

/// Removes jumps of whole turns between one angle and the next.
pub(crate) fn unwrap_turns<'a>(angles_rad: impl Iterator<Item = &'a mut f64>) {
    let mut last: Option<f64> = None;
    for angle_rad in angles_rad {
        if let Some(last) = last {
            let turns = ((last - *angle_rad) / std::f64::consts::TAU).round();
            *angle_rad += turns * std::f64::consts::TAU;
        }
        last = Some(*angle_rad);
    }
}

/// The table (its columns: `docs/outputs.md`), with the standard deviations and the filter's positions behind it.
pub fn to_csv(tracks: &Tracks, angles: &Angles) -> String {
    let marks = tracks.marks.len();
    let links = angles.links.len();
    let mut header = vec!["frame".to_owned(), "t_s".to_owned()];
    header.extend((1..=marks).flat_map(|m| [format!("m{m}_x_px"), format!("m{m}_y_px")]));
    header.extend((1..=links).map(|l| format!("theta{l}_rad")));
    header.extend((1..=links).map(|l| format!("theta{l}_sd_rad")));
    let displacement = (links == 0).then(|| displacements(tracks));
    if displacement.is_some() {
        header.extend(["displacement_px".to_owned(), "displacement_sd_px".to_owned()]);
    }
    header.push("flags".to_owned());
    header.extend((1..=marks).flat_map(|m| {
        ["x_sd_px", "y_sd_px", "filtered_x_px", "filtered_y_px", "filtered_x_sd_px", "filtered_y_sd_px"]
            .map(|c| format!("m{m}_{c}"))
    }));
    let mut text = header.join(",");
    text.push('\n');
    for (frame, t) in tracks.t_s.iter().enumerate() {
        let _ = write!(text, "{frame},{t:.9}");
        for mark in &tracks.marks {
            optional(&mut text, mark[frame].measured.map(|m| m.position_px), 4);
        }
        for link in &angles.links {
            optional(&mut text, link[frame].map(|a| [a.theta_rad]), 7);
        }
        for link in &angles.links {
            optional(&mut text, link[frame].map(|a| [a.sd_rad]), 7);
        }
        if let Some(displacement) = &displacement {
            optional(&mut text, displacement.get(frame).copied().flatten(), 4);
        }
        let _ = write!(text, ",{}", flags(tracks, frame));
        for mark in &tracks.marks {
            let p = &mark[frame];
            optional(&mut text, p.measured.map(|m| [m.covariance_px2[0].sqrt(), m.covariance_px2[1].sqrt()]), 4);
            optional(&mut text, p.filtered.map(|f| [f.state[0], f.state[1]]), 4);
            optional(&mut text, p.filtered.map(|f| f.sd_px()), 4);
        }
        text.push('\n');
    }
    text
}

/// The displacement of a mark that hangs from nothing known, with its standard deviation, px: from its mean place along
/// the line on which it moves most, positive to the right, or down where that line is upright.
///
/// ```text
/// s = (p − p̄)·e,   e the first principal axis of the positions,   σ_s² = eᵀ Σ e
/// ```
fn displacements(tracks: &Tracks) -> Vec<Option<[f64; 2]>> {
    let Some(points) = tracks.marks.first() else { return Vec::new() };
    let seen: Vec<Measured> = points.iter().filter_map(|p| p.measured).collect();
    let n = seen.len().max(1) as f64;
    let mean = [0, 1].map(|axis| seen.iter().map(|m| m.position_px[axis]).sum::<f64>() / n);
    let moment = |i: usize, j: usize| {
        seen.iter().map(|m| (m.position_px[i] - mean[i]) * (m.position_px[j] - mean[j])).sum::<f64>() / n
    };
    let angle = 0.5 * (2.0 * moment(0, 1)).atan2(moment(0, 0) - moment(1, 1));
    let (sin, cos) = angle.sin_cos();
    let sign = if cos.abs() > 1e-6 { cos.signum() } else { sin.signum() };
    let (ex, ey) = (sign * cos, sign * sin);
    let along = |m: Measured| {
        let [xx, yy, xy] = m.covariance_px2;
        let variance = ex * ex * xx + ey * ey * yy + 2.0 * ex * ey * xy;
        [ex * (m.position_px[0] - mean[0]) + ey * (m.position_px[1] - mean[1]), variance.max(0.0).sqrt()]
    };
    points.iter().map(|p| p.measured.map(along)).collect()
}

fn optional<const N: usize>(text: &mut String, values: Option<[f64; N]>, decimals: usize) {
    for k in 0..N {
        match values {
            Some(v) => {
                let _ = write!(text, ",{:.decimals$}", v[k]);
            }
            None => text.push(','),
        }
    }
}

/// `lost:m2 partial:m3`, and `damaged` for a frame that the decoder reported.
fn flags(tracks: &Tracks, frame: usize) -> String {
    let mut words: Vec<String> = Vec::new();
    if tracks.damaged_frames.binary_search(&frame).is_ok() {
        words.push("damaged".to_owned());
    }
    for (m, mark) in tracks.marks.iter().enumerate() {
        let set: Flags = mark[frame].flags;
        words.extend(set.names().map(|name| format!("{name}:m{}", m + 1)));
    }
    words.join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn full_turns_are_unwrapped_over_a_gap() {
        let a = |t| Some(Angle { theta_rad: t, sd_rad: 0.1 });
        let mut angles = [a(3.0), a(-3.1), None, a(-2.9)];
        unwrap_turns(angles.iter_mut().flatten().map(|angle| &mut angle.theta_rad));
        let theta: Vec<f64> = angles.iter().flatten().map(|a| a.theta_rad).collect();
        assert!((theta[1] - 3.183).abs() < 1e-3 && (theta[2] - 3.383).abs() < 1e-3, "{theta:?}");
    }
}
