//! Where a mark is not measured, and why that may be.

use std::ops::Range;

use crate::measure::{Measurement, Options};
use crate::track::Point;

/// Share of the frames in which a mark is measured that calls for no word.
const USUAL_SHARE: f64 = 0.98;

/// The longest run of frames in which a mark is not measured.
pub fn longest_gap(points: &[Point]) -> Range<usize> {
    let mut from = 0;
    points.chunk_by(|a, b| a.measured.is_some() == b.measured.is_some()).fold(0..0, |longest, run| {
        let own = from..from + run.len();
        from = own.end;
        if run[0].measured.is_none() && own.len() > longest.len() { own } else { longest }
    })
}

/// A mark that is not measured in many frames: how many, when the longest run of them is, and what to do.
pub(super) fn unmeasured(m: &Measurement, options: &Options, mark: usize) -> Option<String> {
    let points = &m.tracks.marks[mark];
    let share = points.iter().filter(|p| p.measured.is_some()).count() as f64 / points.len().max(1) as f64;
    let gap = longest_gap(points);
    let time = |frame: usize| m.timing_at(frame);
    (share < USUAL_SHARE).then(|| {
        format!(
            "mark {} ({}) was measured in {:.1} % of the frames, longest gap {} frames, from {:.2} to {:.2} s; {}",
            mark + 1,
            m.marks[mark].name,
            100.0 * share,
            gap.len(),
            time(gap.start),
            time(gap.end.saturating_sub(1)),
            advice(m, options, mark, &gap)
        )
    })
}

/// What to do about a gap.
fn advice(m: &Measurement, options: &Options, mark: usize, gap: &Range<usize>) -> String {
    let points = &m.tracks.marks[mark];
    if options.rig.roi_px.is_some() || options.rig.mask.is_some() {
        return "where it leaves the region of --roi or --mask, widen that".to_owned();
    }
    let (width_px, height_px) = m.stream.orientation.size(m.stream.stored_size_px);
    // where it is one frame farther by its last step lies a part of it outside
    let goes_out = |near: Option<usize>, far: Option<usize>| {
        let seen = |frame: Option<usize>| points.get(frame?)?.measured;
        seen(near).is_some_and(|own| {
            let step = seen(far).map_or([0.0; 2], |far| [0, 1].map(|k| own.position_px[k] - far.position_px[k]));
            let [x, y] = [0, 1].map(|k| own.position_px[k] + step[k]);
            let radius_px = (f64::from(own.area_px2) / std::f64::consts::PI).sqrt();
            x.min(width_px as f64 - x).min(y).min(height_px as f64 - y) < radius_px
        })
    };
    if goes_out(gap.start.checked_sub(1), gap.start.checked_sub(2)) || goes_out(Some(gap.end), Some(gap.end + 1)) {
        return "it leaves the picture there: film it from farther away; what is in sight is measured".to_owned();
    }
    let all_hidden = m.tracks.marks.iter().all(|points| points[gap.clone()].iter().all(|p| p.measured.is_none()));
    match (all_hidden, gap.start == 0, gap.end == points.len()) {
        (true, true, _) => format!("no mark is in sight before: --from {:.2} leaves that out", m.timing_at(gap.end)),
        (true, _, true) => {
            format!(
                "no mark is in sight after: --until {:.2} leaves that out",
                m.timing_at(gap.start.saturating_sub(1))
            )
        }
        _ => "look with --overlay where it is covered, or dark: then a lower --threshold finds it".to_owned(),
    }
}
