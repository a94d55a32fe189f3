//! What a careful colleague would say about a measurement: each with the number and what to do.

use crate::angles::Angle;
use crate::experiment::Experiment;
use crate::hand_hold::{caught_of, released_of};
use crate::measure::{Measurement, Options, Steadying};
use crate::statistics::median;
use crate::track::chain_detection::{LEAST_TURN, MOST_MARKS};
use crate::track::{Flags, Point, UnusedObject};

mod gap;
mod link;
mod path;
mod pivot;

pub use gap::longest_gap;
pub use link::MOST_LENGTH_SPREAD;

/// Frames below which nothing is said about a link or a mark.
const FEWEST_FRAMES: usize = 30;
/// Noise of a mark that calls for a word: a quarter of a pixel, and half a hundredth of the mark's width.
const MOST_NOISE_PX: f64 = 0.25;
const NOISE_OF_WIDTH: f64 = 0.005;
/// Steps of a mark that show whether it moves, and the part of its neighbours' that is none; where more than so many, and more than this part of them, are none,
/// pictures are repeated (from 24 to 30 a second one in five is, from 25 to 30 one in six).
const LEAST_STEP_PX: f64 = 2.0;
const STILL_STEP: f64 = 0.15;
const FEWEST_REPEATS: usize = 5;
const LEAST_REPEATED: f64 = 0.05;
/// Cosine between the steps before and after one, from which on the mark has not turned round between them (judgement: 60°).
const GOES_ON: f64 = 0.5;
/// Share of the marks' own motion from which another thing's is no trembling.
const LEAST_TRAVEL: f64 = 0.05;
/// Change of the distance from a still thing, over the motion, up to which that is the hinge.
const HINGE_STRETCH: f64 = 0.1;
/// Standard deviations of a row beyond which an error that all rows share is worth a word.
const SHARED_DEVIATIONS: f64 = 3.0;
/// Standard deviations of a link's own angle below which it does not turn.
const STILL_DEVIATIONS: f64 = 4.0;
/// Things that are listed one by one.
const LISTED: usize = 4;
/// Rates at which cameras record slow motion, and rates at which they play it.
const SLOW_MOTION: [(f64, f64); 12] = [
    (120.0, 30.0),
    (240.0, 30.0),
    (120.0, 60.0),
    (240.0, 60.0),
    (120.0, 25.0),
    (240.0, 25.0),
    (960.0, 30.0),
    (480.0, 30.0),
    (120.0, 24.0),
    (240.0, 24.0),
    (120.0, 50.0),
    (240.0, 50.0),
];
/// A specimen swings so many times as fast as a mass at the end of a thread: from 1.0 to 1.4 times (physics).
const OVER_LEAST: f64 = 1.15;
/// Rates are the same within this share (judgement)…
const SAME_RATE: f64 = 0.02;
/// … and factors within what the specimen leaves open (physics).
const SAME_FACTOR: f64 = 0.3;

/// Every caution about a measurement.
pub fn cautions(m: &Measurement, options: &Options) -> Vec<String> {
    let mut cautions = Vec::new();
    cautions.extend(spares(m, options));
    let first = usize::from(options.rig.pivot_px.is_none());
    for link in 0..m.angles.links.len() {
        cautions.extend(link::link_length(m, options, link, first));
        cautions.extend(turns(m, options, link));
    }
    cautions.extend(link::hangs(m, options));
    cautions.extend(path::open(m));
    let held = held(m);
    for mark in 0..m.tracks.marks.len() {
        // a hand's trembling is no noise of a mark's
        cautions.extend(mark_noise(m, mark).filter(|_| held.is_none()));
        cautions.extend(blur(m, mark));
        cautions.extend(gap::unmeasured(m, options, mark));
    }
    cautions.extend(held);
    cautions.extend(caught(m));
    cautions.extend(pivot::uncertain(m, options));
    cautions.extend(pivot::moves(m, options));
    cautions.extend(camera(m, options));
    cautions.extend(repeats(m));
    cautions.extend(time(m, options));
    cautions
}

/// Pictures that repeat the one before, as a converter of frame rates makes them: a mark stands still for a step amid motion.
fn repeats(m: &Measurement) -> Option<String> {
    let share = m.tracks.marks.iter().filter_map(|points| repeated_share(points)).fold(0.0, f64::max);
    (share > LEAST_REPEATED).then(|| {
        format!(
            "about one picture in {:.0} repeats the one before: a converter has changed the frame rate, and the stamps are not those of the motion; measure the film as it came from the camera, or take the repeats out with `ffmpeg -vf mpdecimate`",
            share.recip().max(2.0)
        )
    })
}

/// The part of the steps amid motion in which a mark stands still. Where it turns round, as at the end of a swing, it may stand still by itself.
fn repeated_share(points: &[Point]) -> Option<f64> {
    let steps: Vec<Option<[f64; 2]>> = points
        .windows(2)
        .map(|pair| {
            let (a, b) = (pair[0].measured?, pair[1].measured?);
            Some([b.position_px[0] - a.position_px[0], b.position_px[1] - a.position_px[1]])
        })
        .collect();
    let length = |step: [f64; 2]| step[0].hypot(step[1]);
    let amid = |k: usize| {
        let [before, after] = [steps[k - 1]?, steps[k + 1]?];
        let goes_on = before[0] * after[0] + before[1] * after[1] >= GOES_ON * length(before) * length(after);
        let mut near = [steps[k - 2]?, before, after, steps[k + 2]?].map(length);
        goes_on.then_some((length(steps[k]?), median(&mut near)?))
    };
    let moving: Vec<(f64, f64)> =
        (2..steps.len().saturating_sub(2)).filter_map(amid).filter(|(_, near)| *near > LEAST_STEP_PX).collect();
    let still = moving.iter().filter(|(step, near)| *step < STILL_STEP * near).count();
    (still >= FEWEST_REPEATS).then(|| still as f64 / moving.len() as f64)
}

/// A span too short to show a swing, and a true rate that is none of slow motion.
fn time(m: &Measurement, options: &Options) -> Vec<String> {
    let mut said = Vec::new();
    let frames = m.timing.frames;
    if frames < FEWEST_FRAMES {
        let span_s = m.timing.last_s - m.timing.first_s;
        said.push(format!(
            "only {frames} frame{} of {span_s:.2} s were measured, too few to show how it swings; give a longer recording, or widen --from and --until",
            if frames == 1 { "" } else { "s" }
        ));
    }
    if let Some(true_hz) = options.rig.true_rate_hz.filter(|_| m.time_scale > 1.0) {
        said.push(format!(
            "true_rate_hz = {true_hz} is slower than the file's {:.3} frames per second, so every second counts {:.2} times; slow motion has the faster rate: leave it out unless this is a time lapse",
            true_hz * m.time_scale,
            m.time_scale
        ));
    }
    said
}

/// Things of the marks' colour that were not used.
fn spares(m: &Measurement, options: &Options) -> Vec<String> {
    let range = |points: &[Point]| {
        let x = points.iter().filter_map(|p| p.measured).map(|m| m.position_px[0]);
        0.5 * (x.clone().fold(f64::MIN, f64::max) - x.fold(f64::MAX, f64::min))
    };
    let widest_px = m.tracks.marks.iter().map(|points| range(points)).fold(0.0, f64::max);
    let listed = |moves: bool| -> Vec<String> {
        let swings = |s: &UnusedObject| s.moves && s.travel_px > LEAST_TRAVEL * widest_px;
        let chosen = m.tracks.spares.iter().filter(|s| swings(s) == moves);
        chosen.map(|s| format!("({:.0}, {:.0})", s.position_px[0], s.position_px[1])).collect()
    };
    let places = |all: &[String]| {
        let more = if all.len() > LISTED { ", …" } else { "" };
        format!("{}{more}", all[..all.len().min(LISTED)].join(", "))
    };
    let (moving, still) = (listed(true), listed(false));
    let marks = m.tracks.marks.len();
    let mut said = Vec::new();
    if !moving.is_empty() {
        let (one, all) = (moving.len() == 1, marks + moving.len());
        let hang_on = m.tracks.spares.iter().any(|s| s.moves && s.keeps_distance);
        let remedy = match (all <= MOST_MARKS, one) {
            (true, _) if !hang_on => format!(
                "{} no distance from {}, or something of that colour lies in the way: measure what swings by itself in a run of its own, with --roi around it; hide what lies in the way, or leave it out with --mask",
                if one { "it keeps" } else { "they keep" },
                if marks == 1 { "the mark" } else { "the marks" }
            ),
            (true, true) => format!("say --markers {all} if it is a mark, or leave it out with --roi"),
            (true, false) => format!("say --markers {all} if they are marks, or leave them out with --roi"),
            (false, _) => {
                "leave them out with --roi or --mask, or name the marks' colour closer with --color".to_owned()
            }
        };
        said.push(format!(
            "{} more thing{} of the marks' colour move{} about {} px and {} not used; {remedy}",
            moving.len(),
            if one { "" } else { "s" },
            if one { "s" } else { "" },
            places(&moving),
            if one { "was" } else { "were" },
        ));
    }
    if !still.is_empty() {
        said.push(format!(
            "{} thing{} of the marks' colour never move{} and {} taken for no mark: about {} px{}",
            still.len(),
            if still.len() == 1 { "" } else { "s" },
            if still.len() == 1 { "s" } else { "" },
            if still.len() == 1 { "was" } else { "were" },
            places(&still),
            hinge_among(m).filter(|_| options.rig.pivot_px.is_none()).map_or(String::new(), |[x, y]| format!(
                "; the first mark swings about the one at ({x:.0}, {y:.0}): if it is the hinge, say --markers {}",
                marks + 1
            )),
        ));
    }
    said
}

/// A thing that stands still and from which the first mark keeps its distance.
fn hinge_among(m: &Measurement) -> Option<[f64; 2]> {
    let path: Vec<[f64; 2]> = m.tracks.marks.first()?.iter().filter_map(|p| Some(p.measured?.position_px)).collect();
    let range = |values: &dyn Fn(&[f64; 2]) -> f64| {
        let mut sorted: Vec<f64> = path.iter().map(values).collect();
        sorted.sort_unstable_by(f64::total_cmp);
        let last = sorted.len().saturating_sub(1);
        sorted.get(last * 19 / 20).zip(sorted.get(last / 20)).map_or(0.0, |(high, low)| high - low)
    };
    let travel_px = range(&|p| p[0]).max(range(&|p| p[1]));
    let keeps = |s: &&UnusedObject| {
        let [x, y] = s.position_px;
        range(&|p| (p[0] - x).hypot(p[1] - y)) < HINGE_STRETCH * travel_px
    };
    m.tracks.spares.iter().filter(|s| !s.moves).find(keeps).map(|s| s.position_px)
}

/// Half the range of an angle.
fn half_range_rad(angles: &[Option<Angle>]) -> f64 {
    let theta_rad = angles.iter().flatten().map(|a| a.theta_rad);
    0.5 * (theta_rad.clone().fold(f64::MIN, f64::max) - theta_rad.fold(f64::MAX, f64::min))
}

/// The usual standard deviation of its rows.
fn usual_sd_rad(angles: &[Option<Angle>]) -> Option<f64> {
    median(&mut angles.iter().flatten().map(|a| a.sd_rad).collect::<Vec<_>>())
}

/// A link between two things that stand still says nothing, and the marks were counted from the wrong one.
fn turns(m: &Measurement, options: &Options, link: usize) -> Option<String> {
    let sd_rad = usual_sd_rad(&m.angles.links[link])?;
    let own = half_range_rad(&m.angles.links[link]);
    let most = m.angles.links.iter().map(|angles| half_range_rad(angles)).fold(0.0, f64::max);
    let measured = m.angles.links[link].iter().flatten().count();
    let still = measured >= FEWEST_FRAMES && own < (LEAST_TURN * most).max(STILL_DEVIATIONS * sd_rad).min(0.2 * most);
    let remedy = if options.rig.pivot_px.is_some() && link == 0 {
        format!(
            "its ends, the pivot and the first mark, both stand still; leave --pivot out, or put it where the strip turns and say --markers {}",
            m.tracks.marks.len().saturating_sub(1).max(1)
        )
    } else {
        "both its ends stand still; name the marks that swing with --markers, --roi or --mask".to_owned()
    };
    still.then(|| {
        format!(
            "link {} turns by no more than ± {:.2}°, where another turns by ± {:.1}°: {remedy}",
            link + 1,
            own.to_degrees(),
            most.to_degrees()
        )
    })
}

/// Times and coordinates of each mark.
fn paths(m: &Measurement) -> impl Iterator<Item = (Vec<f64>, Vec<f64>)> {
    let along = |points: &Vec<Point>, axis: usize| -> (Vec<f64>, Vec<f64>) {
        let seen = m.file_t_s.iter().zip(points);
        seen.filter_map(|(t, point)| Some((*t, point.measured?.position_px[axis]))).unzip()
    };
    m.tracks.marks.iter().flat_map(move |points| [0, 1].map(|axis| along(points, axis)))
}

/// A hand at the beginning covers and holds what swings.
fn held(m: &Measurement) -> Option<String> {
    released_of(paths(m)).map(|held_s| {
        format!(
            "the specimen is held still until t = {held_s:.2} s, probably by a hand, which covers marks and is no free motion: leave that out with --from {held_s:.2}"
        )
    })
}

/// And one at the end.
fn caught(m: &Measurement) -> Option<String> {
    caught_of(paths(m)).map(|caught_s| {
        format!(
            "the specimen is caught after t = {caught_s:.2} s and held still to the end, probably by a hand: leave that out with --until {caught_s:.2}"
        )
    })
}

/// The scatter of a mark, held against its size.
fn mark_noise(m: &Measurement, mark: usize) -> Option<String> {
    let measured = m.tracks.marks[mark].iter().filter_map(|p| p.measured).map(|m| m.covariance_px2);
    let mut measured: Vec<f64> = measured.map(|c| 0.5 * (c[0] + c[1])).collect();
    // usually: where a hand or the picture's edge cuts it, it scatters more
    let noise_px = median(&mut measured)?.sqrt();
    let width_px = 2.0 * (m.tracks.area_px2[mark] / std::f64::consts::PI).sqrt();
    let expected_px = MOST_NOISE_PX + NOISE_OF_WIDTH * width_px;
    (noise_px > expected_px && measured.len() >= FEWEST_FRAMES).then(|| {
        format!(
            "mark {} scatters by {noise_px:.2} px, where one {width_px:.0} px wide should by less than {expected_px:.2}: look at it with --debug-frames; light it evenly, or name its colour closer with --color '#rrggbb'",
            mark + 1
        )
    })
}

/// How far a mark is smeared by the exposure, from how its area grows with its speed.
///
/// ```text
/// A = A₀ + d v t_e,   d the width of the mark at rest, v its speed, t_e the exposure
/// ```
fn blur(m: &Measurement, mark: usize) -> Option<String> {
    let points = &m.tracks.marks[mark];
    let t_s = &m.file_t_s;
    let mut rows: Vec<[f64; 2]> = Vec::new();
    for i in 1..points.len().saturating_sub(1) {
        let (Some(a), Some(b), Some(c)) = (points[i - 1].measured, points[i].measured, points[i + 1].measured) else {
            continue;
        };
        let step_s = t_s[i + 1] - t_s[i - 1];
        // a mark in plain view: what a hand covers is small while it is held
        let is_plain = ![Flags::CUT, Flags::PARTIAL, Flags::MERGED].iter().any(|flag| points[i].flags.contains(*flag));
        if step_s > 0.0 && is_plain {
            let path_px = (c.position_px[0] - a.position_px[0]).hypot(c.position_px[1] - a.position_px[1]);
            rows.push([path_px / step_s, f64::from(b.area_px2)]);
        }
    }
    if rows.len() < FEWEST_FRAMES {
        return None;
    }
    rows.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let third = rows.len() / 3;
    let of = |rows: &[[f64; 2]], k: usize| median(&mut rows.iter().map(|r| r[k]).collect::<Vec<_>>());
    let (slow, fast) = (&rows[..third], &rows[rows.len() - third..]);
    let (v0, v1, a0, a1) = (of(slow, 0)?, of(fast, 0)?, of(slow, 1)?, of(fast, 1)?);
    let slope = (a1 - a0) / (v1 - v0).max(1e-9);
    let rest_px2 = (a0 - slope * v0).max(0.3 * a0);
    let width_px = 2.0 * (rest_px2 / std::f64::consts::PI).sqrt();
    let exposure_s = slope / width_px;
    let fastest = rows[rows.len() - 1 - rows.len() / 50][0];
    let blur_px = exposure_s * fastest;
    // an exposure is no longer than a frame
    let step_s = m.timing.median_step_s / m.time_scale;
    let possible = a1 > 1.15 * a0 && exposure_s > 0.0 && exposure_s < 1.1 * step_s;
    (blur_px > width_px && possible).then(|| {
        format!(
            "mark {} is smeared over {blur_px:.0} px where it is fastest, more than its width of {width_px:.0} px: the exposure is about 1/{:.0} s; set it to 1/{:.0} s or shorter, with more light",
            mark + 1,
            1.0 / exposure_s,
            (1.0 / exposure_s * blur_px / (0.5 * width_px)).ceil(),
        )
    })
}

fn camera(m: &Measurement, options: &Options) -> Vec<String> {
    let camera = &m.camera;
    let mut said = Vec::new();
    let named = options.rig.reference_marks.len();
    if camera.taken_out && camera.greatest_shift_px > 0.0 {
        let against = if named > 0 {
            format!("against {named} reference mark{}", if named == 1 { "" } else { "s" })
        } else {
            format!("with {} patches of what stands still (to {:.2} px)", camera.patches, camera.sd_px)
        };
        said.push(format!(
            "the camera moved by up to {:.1} px; taken out {against}; --steady never leaves it in",
            camera.greatest_shift_px
        ));
    } else if named > 0 && options.steadying != Steadying::Never {
        said.push(format!(
            "the {named} reference mark{} cannot be found again throughout the recording, so the camera's motion is left in; name a corner or a dot with clear edges on what stands still",
            if named == 1 { "" } else { "s" }
        ));
    } else if camera.greatest_shift_px > 0.3 {
        said.push(format!(
            "the camera moved by up to {:.1} px and that is left in; --steady always takes it out with the background",
            camera.greatest_shift_px
        ));
    }
    if camera.lost_frames > 0 {
        said.push(format!(
            "in {} frames too little of {} was found again to say where the camera looked; nothing is measured there: {}",
            camera.lost_frames,
            if named > 0 { "the reference marks" } else { "the background" },
            if named > 0 { "name others with --reference, on what stands still" } else { "--steady never measures them with the camera's motion in" },
        ));
    }
    said
}

/// Slow motion shows where the length is known: a pendulum of that length cannot swing so slowly.
///
/// ```text
/// f ≥ √(g/L)/2π: that of a mass at the end of a light thread; of rods and hanging chains 1.0 to 1.4 times that
/// ```
pub fn slow_motion(m: &Measurement, experiment: &Experiment) -> Option<String> {
    if experiment.rig.true_rate_hz.is_some() {
        return None;
    }
    let length_m: f64 = experiment.specimen.link_lengths_m.iter().sum();
    let file_hz = m.timing.real_rate_hz?;
    let seen_hz = crossing_rate_hz(m)?;
    if !(length_m > 0.0) {
        return None;
    }
    let least_hz = (experiment.rig.gravity_m_s2 / length_m).sqrt() / std::f64::consts::TAU;
    let factor = least_hz * OVER_LEAST / seen_hz;
    let (true_hz, played_hz) = SLOW_MOTION
        .into_iter()
        .filter(|(_, played)| (played / file_hz - 1.0).abs() < SAME_RATE)
        .find(|(taken, played)| (factor / (taken / played) - 1.0).abs() < SAME_FACTOR)?;
    Some(format!(
        "it swings at {seen_hz:.3} Hz, where {length_m:.3} m of pendulum swing at {least_hz:.2} Hz or faster: this looks like {true_hz:.0} frames per second played at {played_hz:.0}; write true_rate_hz = {true_hz:.0} in [rig]"
    ))
}

/// Full turns a second of the first link's motion about its middle.
fn crossing_rate_hz(m: &Measurement) -> Option<f64> {
    let rows: Vec<(f64, f64)> =
        m.angles.links.first()?.iter().zip(&m.tracks.t_s).filter_map(|(a, t)| a.map(|a| (*t, a.theta_rad))).collect();
    let middle = median(&mut rows.iter().map(|r| r.1).collect::<Vec<_>>())?;
    let rises: Vec<f64> = rows.windows(2).filter(|w| w[0].1 < middle && w[1].1 >= middle).map(|w| w[1].0).collect();
    let (first, last) = (rises.first()?, rises.last()?);
    (rises.len() >= 3 && last > first).then(|| (rises.len() - 1) as f64 / (last - first))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::track::Measured;

    /// Points of a swing of 100 px, one for each instant.
    fn swing(hz: f64, t_s: impl Iterator<Item = f64>) -> Vec<Point> {
        let at = |t: f64| Measured {
            position_px: [300.0 + 100.0 * (std::f64::consts::TAU * hz * t).cos(), 200.0],
            covariance_px2: [1e-3, 1e-3, 0.0],
            area_px2: 300.0,
        };
        t_s.map(|t| Point { measured: Some(at(t)), filtered: None, flags: Flags::default() }).collect()
    }

    #[test]
    fn a_mark_that_turns_round_between_two_pictures_repeats_none() {
        // both pictures lie on either side of the end of a swing of 15 pictures
        let points = swing(2.0, (0..330).map(|k| (f64::from(k) + 0.5) / 30.0));
        assert_eq!(repeated_share(&points), None);
    }

    #[test]
    fn one_picture_in_five_is_seen_to_repeat_another() {
        let points = swing(0.8, (0..330).map(|k| f64::from(k * 4 / 5) / 24.0));
        assert!((repeated_share(&points).unwrap() - 0.2).abs() < 0.05);
    }
}
