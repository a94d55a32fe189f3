//! The marks' tracks: measured positions with the variances that their own scatter shows, and the paper's filter over
//! them, with the true time steps.

use super::choose::UnusedObject;
use super::follower::measurement;
use super::kalman::{Belief, Motion};
use super::noise::{Scatter, speeds_along};
use super::smooth::smooth;
use super::{Filtered, Flags, Measured, Point};
use crate::statistics::median;

/// A mark that has merged with a like thing, of which it covers most, is off by about this part of its radius (judgement).
const MERGED_RADII: f64 = 0.3;
/// Frames of a speed that show how large a mark is at it, and the least difference of speeds (px a frame) that does.
const FEWEST_OF_A_SPEED: usize = 10;
const LEAST_SPEED_PX: f64 = 1.0;
/// Frames between two of a speed that belong to one time (judgement: a tracker's noise), and fewest times that tell more than all frames together (statistics).
const MOST_APART: usize = 3;
const FEWEST_TIMES: usize = 5;

/// The marks' tracks over the whole recording.
#[derive(Debug, Clone, PartialEq)]
pub struct Tracks {
    /// Time stamp of every frame.
    pub t_s: Vec<f64>,
    /// For each mark, a point a frame.
    pub marks: Vec<Vec<Point>>,
    /// The process noise each mark was filtered with.
    pub motion: Vec<Motion>,
    /// Factors by which each mark's stated standard deviations were multiplied to match its scatter.
    pub scatter: Vec<Scatter>,
    /// Median area of each mark.
    pub area_px2: Vec<f64>,
    /// Frames that the decoder reported as damaged.
    pub damaged_frames: Vec<usize>,
    /// Lasting things of a mark's colour that were seen beside the marks when they were chosen.
    pub spares: Vec<UnusedObject>,
    /// Something that was chosen swings.
    pub moves: bool,
}

impl Tracks {
    /// Adds a mark's points of every frame.
    pub(super) fn add_mark(&mut self, points: Vec<(Option<Measured>, Flags)>, scatter: Scatter, step_s: f64) {
        let (mut measured, mut flags): (Vec<_>, Vec<_>) = points.into_iter().unzip();
        let mut areas: Vec<f64> = measured.iter().flatten().map(|m| f64::from(m.area_px2)).collect();
        let area = median(&mut areas).unwrap_or(0.0);
        let along = [0, 1].map(|axis| speeds_along(&measured, axis));
        let speeds: Vec<f64> = along[0].iter().zip(&along[1]).map(|(x, y)| x.hypot(*y)).collect();
        let usual_px2 = usual_area(&measured, &speeds, area);
        for (i, ((m, f), speed)) in measured.iter_mut().zip(&mut flags).zip(speeds).enumerate() {
            if let Some(m) = m {
                let factor = |axis: usize| scatter.variance_factor(along[axis][i], axis);
                let [x, y] = [0, 1].map(factor);
                m.covariance_px2[0] *= x;
                m.covariance_px2[1] *= y;
                m.covariance_px2[2] *= (x * y).sqrt();
                flag_area_change(m, f, usual_px2(speed));
            }
        }
        let motion = Motion { acceleration_psd_px2_s3: acceleration_psd(&measured, &self.t_s, step_s) };
        let filtered = filter(&measured, &self.t_s, &motion, area);
        self.marks.push(
            measured
                .into_iter()
                .zip(filtered)
                .zip(flags)
                .map(|((measured, filtered), flags)| Point { measured, filtered, flags })
                .collect(),
        );
        self.motion.push(motion);
        self.scatter.push(scatter);
        self.area_px2.push(area);
    }

    /// Makes every second `scale` seconds: a recording played slower than it was taken.
    pub fn scale_time(&mut self, scale: f64) {
        if scale == 1.0 {
            return;
        }
        self.t_s.iter_mut().for_each(|t| *t *= scale);
        self.motion.iter_mut().for_each(|m| m.acceleration_psd_px2_s3 /= scale.powi(3));
        for filtered in self.marks.iter_mut().flatten().filter_map(|p| p.filtered.as_mut()) {
            filtered.state[2] /= scale;
            filtered.state[3] /= scale;
            // the upper triangle, row by row: one velocity in 2, 3, 5, 6, two of them in 7, 8, 9
            for (k, value) in filtered.covariance.iter_mut().enumerate() {
                let powers = [0, 0, 1, 1, 0, 1, 1, 2, 2, 2][k];
                *value /= (scale as f32).powi(powers);
            }
        }
    }

    /// The fixed-interval smoothed track of mark `mark`.
    pub fn smoothed(&self, mark: usize) -> Vec<Option<Measured>> {
        let filtered: Vec<Option<Filtered>> = self.marks[mark].iter().map(|p| p.filtered).collect();
        smooth(&filtered, &self.t_s, &self.motion[mark])
    }
}

/// The area that a mark usually has at a speed: the exposure smears it the more the faster it is (or takes its edges below the threshold).
///
/// ```text
/// A(v) = A_s + (A_f − A_s) (v − v_s)/(v_f − v_s)      medians of the slowest third of its frames and of the fastest
/// ```
///
/// Each time that it is slow counts once, however long it lasts: while a hand holds it, and covers a part of it, nothing shows how large it is where it turns.
fn usual_area(measured: &[Option<Measured>], speeds_px: &[f64], median_px2: f64) -> impl Fn(f64) -> f64 + use<> {
    let area_px2 = |i: usize| Some(f64::from(measured[i].as_ref()?.area_px2));
    let mut rows: Vec<usize> = (0..measured.len()).filter(|i| measured[*i].is_some()).collect();
    rows.sort_by(|a, b| speeds_px[*a].total_cmp(&speeds_px[*b]));
    // one time that is longer than all others together leaves the others too few
    while let Some(longest) = longest_time(&rows[..rows.len() / 3]) {
        rows.retain(|row| longest.binary_search(row).is_err());
    }
    let third = rows.len() / 3;
    let of = |some: &[usize]| {
        let mut in_time = some.to_vec();
        in_time.sort_unstable();
        let times = in_time.chunk_by(together);
        let middle = |frames: &[usize]| median(&mut frames.iter().filter_map(|i| area_px2(*i)).collect::<Vec<_>>());
        let mut each: Vec<f64> = times.filter_map(middle).collect();
        let area_px2 = if each.len() < FEWEST_TIMES { middle(some) } else { median(&mut each) };
        let speed_px = median(&mut some.iter().map(|i| speeds_px[*i]).collect::<Vec<_>>());
        [speed_px.unwrap_or(0.0), area_px2.unwrap_or(0.0)]
    };
    let [[slow_px, slow_px2], [fast_px, fast_px2]] = [of(&rows[..third]), of(&rows[rows.len() - third..])];
    let tells = third >= FEWEST_OF_A_SPEED && fast_px - slow_px > LEAST_SPEED_PX;
    let slope = if tells { (fast_px2 - slow_px2) / (fast_px - slow_px) } else { 0.0 };
    let at_rest = if tells { slow_px2 - slope * slow_px } else { median_px2 };
    // beyond the speeds that were seen often nothing is known
    move |speed_px| (at_rest + slope * speed_px.min(fast_px)).max(0.5 * median_px2)
}

fn together(before: &usize, after: &usize) -> bool {
    after - before <= MOST_APART
}

/// Of some frames, in any order, those of one time that is longer than all others together and leaves enough; `None` where there is none.
fn longest_time(frames: &[usize]) -> Option<Vec<usize>> {
    let mut in_time = frames.to_vec();
    in_time.sort_unstable();
    let longest = in_time.chunk_by(together).max_by_key(|time| time.len())?;
    let is_most = 2 * longest.len() > in_time.len() && in_time.len() > FEWEST_OF_A_SPEED;
    is_most.then(|| longest.to_vec())
}

/// A mark that is partly hidden has its centroid off by up to the hidden share of its radius; one that has grown
/// holds something else as well. Both are flagged and their variance grows accordingly.
fn flag_area_change(m: &mut Measured, flags: &mut Flags, usual_px2: f64) {
    let ratio = f64::from(m.area_px2) / usual_px2.max(1e-9);
    let deficit = if ratio < 0.85 {
        flags.insert(Flags::PARTIAL);
        1.0 - ratio
    } else if ratio > 1.35 {
        flags.insert(Flags::MERGED);
        1.0 - 1.0 / ratio
    } else if flags.contains(Flags::MERGED) {
        MERGED_RADII
    } else if flags.contains(Flags::CUT) {
        0.1
    } else {
        return;
    };
    let extra = (deficit * (usual_px2 / std::f64::consts::PI).sqrt()).powi(2);
    m.covariance_px2[0] += extra;
    m.covariance_px2[1] += extra;
}

/// The paper's filter over the measurements of one mark.
fn filter(measured: &[Option<Measured>], t_s: &[f64], motion: &Motion, area_px2: f64) -> Vec<Option<Filtered>> {
    let mut belief: Option<Belief> = None;
    let step = |i: usize| if i == 0 { 0.0 } else { (t_s[i] - t_s[i - 1]).max(0.0) };
    let speed_sd = (motion.acceleration_psd_px2_s3 * 1.0).sqrt().max(area_px2.sqrt());
    measured
        .iter()
        .enumerate()
        .map(|(i, m)| {
            let predicted = belief.map(|b| b.predict(motion, step(i)));
            belief = match (predicted, m) {
                (Some(p), Some(m)) => p.update(&measurement(m, 0.0)).or(Some(p)),
                (Some(p), None) => Some(p),
                (None, Some(m)) => Some(Belief::from_measurement(&measurement(m, 0.0), speed_sd)),
                (None, None) => None,
            };
            belief.as_ref().map(Filtered::pack)
        })
        .collect()
}

/// q = a²·Δt with a the root mean square second difference of the measured positions.
fn acceleration_psd(measured: &[Option<Measured>], t_s: &[f64], step_s: f64) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0f64);
    for i in 2..measured.len() {
        if let (Some(a), Some(b), Some(c)) = (&measured[i - 2], &measured[i - 1], &measured[i]) {
            let (h, k) = (t_s[i - 1] - t_s[i - 2], t_s[i] - t_s[i - 1]);
            if h <= 0.0 || k <= 0.0 {
                continue;
            }
            for axis in 0..2 {
                let (p, q, r) = (a.position_px[axis], b.position_px[axis], c.position_px[axis]);
                sum += (2.0 * ((r - q) / k - (q - p) / h) / (h + k)).powi(2);
                count += 1.0;
            }
        }
    }
    // never below a hundredth of a pixel a step, so that the filter does not freeze on a mark at rest
    let floor = 3.0 * 1e-4 / step_s.powi(3);
    (sum / count.max(1.0) * step_s).max(floor)
}
