//! A link keeps its length: what it means where it does not, and which way it hangs.

use super::FEWEST_FRAMES;
use crate::measure::{Measurement, Options};
use crate::statistics::median;
use crate::track::Point;

/// A link whose length scatters by more than this share is no rigid link in the plane of the picture: lenses bend by
/// less.
pub const MOST_LENGTH_SPREAD: f64 = 0.01;
/// And by more than so many times what the marks' scatter explains.
const LENGTH_SCATTERS: f64 = 4.0;
/// A plane of swing turned by less than this share of x does not show.
const LEAST_SQUEEZE: f64 = 0.03;
/// A swing about an angle beyond this is none of a hung body in an upright picture (judgement: half a right angle).
const ASKEW_DEG: f64 = 45.0;

/// The ends of a link in every frame that shows both: (Δx, Δy, variance of the distance).
fn spans(m: &Measurement, options: &Options, link: usize, first: usize) -> Vec<[f64; 3]> {
    let aspect = options.rig.pixel_aspect.unwrap_or(m.stream.pixel_aspect);
    let node = |index: usize, frame: usize| -> Option<([f64; 2], f64)> {
        if first == 0 && index == 0 {
            return options.rig.pivot_px.map(|p| (p, 0.0));
        }
        let point: &Point = &m.tracks.marks[index - (1 - first)][frame];
        let usual = point.flags == crate::track::Flags::default();
        let measured = point.measured.filter(|_| usual)?;
        let c = measured.covariance_px2;
        Some((measured.position_px, 0.5 * (c[0] + c[1])))
    };
    (0..m.tracks.t_s.len())
        .filter_map(|frame| {
            let ((p, v), (q, w)) = (node(link, frame)?, node(link + 1, frame)?);
            Some([aspect * (q[0] - p[0]), q[1] - p[1], v + w])
        })
        .collect()
}

/// A link keeps its length; where it changes with the angle alone, the plane of the swing is turned.
pub(super) fn link_length(m: &Measurement, options: &Options, link: usize, first: usize) -> Option<String> {
    let spans = spans(m, options, link, first);
    // a calibrated lens is taken out of the angles, not of these positions, whose distances it changes
    if spans.len() < FEWEST_FRAMES || options.rig.lens_calibration.is_some() {
        return None;
    }
    let mut lengths: Vec<f64> = spans.iter().map(|s| s[0].hypot(s[1])).collect();
    let usual = median(&mut lengths)?;
    let mut off: Vec<f64> = lengths.iter().map(|l| (l - usual).abs()).collect();
    let spread = 1.4826 * median(&mut off)?;
    let expected = (spans.iter().map(|s| s[2]).sum::<f64>() / spans.len() as f64).sqrt();
    if spread <= LENGTH_SCATTERS * expected {
        return None;
    }
    let number = link + 1;
    let [short, long] =
        [lengths.iter().copied().fold(f64::INFINITY, f64::min), lengths.iter().copied().fold(0.0, f64::max)];
    // an ellipse is known by how the length goes with the swing
    if is_ellipse(&spans) && long - short > MOST_LENGTH_SPREAD * usual {
        return Some(format!(
            "link {number} looks longer the farther it swings, by up to {:.1} % of its {usual:.0} px: it swings out of the plane of the picture as well, by up to {:.0}°, in an ellipse; its frequency and damping are those of both swings together; release it without a push to the side, or hang it on two strings",
            100.0 * (long - short) / usual,
            (short / long).acos().to_degrees()
        ));
    }
    if spread <= MOST_LENGTH_SPREAD * usual {
        return None;
    }
    let per_cent = 100.0 * spread / usual;
    if let Some(squeeze) = squeeze(&spans).filter(|s| *s < 1.0 - LEAST_SQUEEZE) {
        let aspect = options.rig.pixel_aspect.unwrap_or(m.stream.pixel_aspect) / squeeze;
        let turn_deg = squeeze.acos().to_degrees();
        return Some(format!(
            "link {number} looks shorter the farther it swings, by {per_cent:.1} % of its {usual:.0} px: it swings in a plane turned by about {turn_deg:.0}° out of the picture, and its angles are up to {:.0} % too small; face the camera to the swing, or write pixel_aspect = {aspect:.3} in [rig]",
            100.0 * (1.0 - squeeze),
        ));
    }
    Some(format!(
        "link {number} is {usual:.1} ± {spread:.1} px long, where the marks' scatter explains ± {expected:.2}: its ends are not on one rigid link, it swings out of the plane of the picture as well, a mark was taken for another, or the pivot is elsewhere; look at --overlay, and name the marks with --markers or --roi"
    ))
}

/// β of Δy² = α + β Δx² by least squares, where that explains most of the change of the length.
fn length_against_swing(spans: &[[f64; 3]]) -> Option<f64> {
    let n = spans.len() as f64;
    let mean = |f: &dyn Fn(&[f64; 3]) -> f64| spans.iter().map(f).sum::<f64>() / n;
    let (mx, my) = (mean(&|s| s[0] * s[0]), mean(&|s| s[1] * s[1]));
    let xx = mean(&|s| (s[0] * s[0] - mx).powi(2));
    let xy = mean(&|s| (s[0] * s[0] - mx) * (s[1] * s[1] - my));
    let slope = xy / xx.max(1e-12);
    let length2 = my - slope * mx;
    let rest = |factor: f64, of: f64| mean(&|s| (s[1] * s[1] + factor * s[0] * s[0] - of).powi(2)).sqrt();
    let explained = rest(-slope, length2) < 0.5 * rest(1.0, mx + my);
    (explained && mx.sqrt() > 0.05 * length2.max(0.0).sqrt()).then_some(slope)
}

/// The factor c by which x is shortened, from Δy² = L² − Δx²/c²; `None` where the link does not swing far enough, or where this does not explain most of the
/// change.
fn squeeze(spans: &[[f64; 3]]) -> Option<f64> {
    length_against_swing(spans).filter(|slope| *slope < -1.0).map(|slope| (-1.0 / slope).sqrt())
}

/// Whether the link swings in an ellipse of half axes a in the picture and b < a across it, about the vertical: Δy² = L² − b² − (1 − b²/a²) Δx².
fn is_ellipse(spans: &[[f64; 3]]) -> bool {
    let n = spans.len() as f64;
    let middle = spans.iter().map(|s| s[0]).sum::<f64>() / n;
    let spread = (spans.iter().map(|s| (s[0] - middle).powi(2)).sum::<f64>() / n).sqrt();
    // a pivot beside the true one makes the link longer to one side
    let is_even = middle.abs() < 0.5 * spread;
    is_even && length_against_swing(spans).is_some_and(|slope| (-1.0..0.0).contains(&slope))
}

/// Which way the first link hangs: a film may be upside down, or lie on its side.
pub(super) fn hangs(m: &Measurement, options: &Options) -> Option<String> {
    options.rig.pivot_px?;
    let angles = m.angles.links.first()?.iter().flatten().map(|angle| angle.theta_rad);
    let middle_deg = median(&mut angles.collect::<Vec<_>>())?.to_degrees();
    let turned = match middle_deg.abs() {
        near if near < ASKEW_DEG => return None,
        near if near < 180.0 - ASKEW_DEG => "to the side",
        _ => "upwards",
    };
    Some(format!(
        "link 1 hangs {turned} in the picture (its middle is at {middle_deg:.0}°): the film lies on its side or is upside down, or the pivot is another; turn the film, as with ffmpeg's transpose, or give the pivot"
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn swing(factor: f64) -> Vec<[f64; 3]> {
        (0..200)
            .map(|i| {
                let theta = 0.5 * (0.1 * f64::from(i)).sin();
                [factor * 200.0 * theta.sin(), 200.0 * theta.cos(), 0.01]
            })
            .collect()
    }

    #[test]
    fn a_swing_in_an_ellipse_is_told_from_one_in_a_turned_plane() {
        let in_ellipse: Vec<[f64; 3]> = (0..200)
            .map(|i| {
                let (sin, cos) = (0.1 * f64::from(i)).sin_cos();
                let (x, across) = (200.0 * 0.3 * cos, 200.0 * 0.2 * sin);
                [x, (200.0_f64.powi(2) - x * x - across * across).sqrt(), 0.01]
            })
            .collect();
        assert!(is_ellipse(&in_ellipse) && squeeze(&in_ellipse).is_none());
        assert!(!is_ellipse(&swing(0.75)));
    }

    #[test]
    fn a_turned_plane_of_swing_is_told_from_a_link_that_is_none() {
        assert!((squeeze(&swing(0.75)).unwrap() - 0.75).abs() < 1e-6);
        assert!(squeeze(&swing(1.0)).is_none_or(|c| (c - 1.0).abs() < 1e-6));
        let loose: Vec<[f64; 3]> =
            swing(1.0).iter().enumerate().map(|(i, s)| [s[0], s[1] * (1.0 + 0.1 * (i as f64).sin()), s[2]]).collect();
        assert!(squeeze(&loose).is_none_or(|c| c > 0.97));
    }
}
