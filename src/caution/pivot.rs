//! The pivot: how well it is known, and whether it stays where it is.

use super::{SHARED_DEVIATIONS, half_range_rad, usual_sd_rad};
use crate::measure::{Measurement, Options};
use crate::statistics::median;
use crate::track::Arc;

/// Standard deviations by which the centre of an arc moves (statistics: one in ten thousand by chance).
const PIVOT_MOVES: f64 = 4.0;

/// A pivot that is known to some pixels makes the angles of the first link wrong all alike: across the link by a shift, along it
/// by a factor.
pub(super) fn uncertain(m: &Measurement, options: &Options) -> Option<String> {
    let ([x, y], [sx, sy]) = (options.rig.pivot_px?, options.rig.pivot_sd_px?);
    let place = |axis: usize| {
        let mut at: Vec<f64> =
            m.tracks.marks.first()?.iter().filter_map(|p| Some(p.measured?.position_px[axis])).collect();
        median(&mut at)
    };
    let [dx, dy] = [place(0)? - x, place(1)? - y];
    let length_px = dx.hypot(dy);
    let (cos, sin) = (dx / length_px, dy / length_px);
    let [factor, shift_rad] = [(cos * sx).hypot(sin * sy), (sin * sx).hypot(cos * sy)].map(|sd_px| sd_px / length_px);
    let angles = m.angles.links.first()?;
    let sd_rad = usual_sd_rad(angles)?;
    (shift_rad.max(factor * half_range_rad(angles)) > SHARED_DEVIATIONS * sd_rad).then(|| {
        format!(
            "the standard deviation of the pivot is {sx:.1} px (x) and {sy:.1} px (y), for a camera that faces the swing to 1.5°. All angles of link 1 may be too large or too small by {:.1} % and shifted by {:.2}°, in addition to the standard deviations in the table; frequency and damping are not affected. A mark on the hinge, or a wider swing, reduces this. A camera turned aside by 10° puts the pivot 3 % of the link's length too near",
            100.0 * factor,
            shift_rad.to_degrees()
        )
    })
}

/// A pivot that moves in the picture with the camera, where nothing that stands still tells: the centre of the first mark's arc in the last third of the recording lies
/// aside of that in the first. Along the link a lens moves it, and a swing that dies away.
pub(super) fn moves(m: &Measurement, options: &Options) -> Option<String> {
    let pivot_px = options.rig.pivot_px.filter(|_| !m.camera.taken_out)?;
    let points: Vec<[f64; 2]> = m.tracks.marks.first()?.iter().filter_map(|p| Some(p.measured?.position_px)).collect();
    let third = points.len() / 3;
    let (width_px, height_px) = m.stream.orientation.size(m.stream.stored_size_px);
    let radius_px = (m.tracks.area_px2.first()? / std::f64::consts::PI).sqrt();
    let arc = |points: &[[f64; 2]]| {
        Some(Arc::of(points, radius_px)?.through_a_camera(points, radius_px, [width_px as f64, height_px as f64]))
    };
    let (first, last) = (arc(points.get(..third)?)?, arc(points.get(points.len() - third..)?)?);
    let middle = [0, 1].map(|k| points.iter().map(|p| p[k]).sum::<f64>() / points.len() as f64);
    let [dx, dy] = [0, 1].map(|k| middle[k] - pivot_px[k]);
    let length_px = dx.hypot(dy);
    let (cos, sin) = (dx / length_px, dy / length_px);
    let aside_px =
        (cos * (last.centre_px[1] - first.centre_px[1]) - sin * (last.centre_px[0] - first.centre_px[0])).abs();
    let sd_px = first.sd_across_px([cos, sin]).hypot(last.sd_across_px([cos, sin]));
    let sd_rad = usual_sd_rad(m.angles.links.first()?)?;
    (aside_px > PIVOT_MOVES * sd_px && aside_px / length_px > SHARED_DEVIATIONS * sd_rad).then(|| {
        format!(
            "the centre of mark 1's arc moves aside by {aside_px:.1} px from the first third of the recording to the last: the camera or the stand moves, and the angles drift by {:.2}° with it; put a mark on the hinge, or name dots or corners of what stands still with --reference",
            (aside_px / length_px).to_degrees()
        )
    })
}
