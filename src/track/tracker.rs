//! Follows every mark through the recording.
//!
//! The first frames are gathered and linked into tracklets, from which the marks are chosen (see
//! [`super::choose`]). From then on each frame is assigned as it comes and only the marks' own measurements are kept.
//! Whatever else has the marks' colour (a knob, a lamp) is followed too, so that a mark that is hidden for a while
//! does not settle on it. When the recording ends, the stated variances are held against the tracks' own scatter
//! and the Kalman filter runs over the measurements, with the true time steps.

use super::assign::assign;
use super::choose::{Choice, Tracklet, choose};
use super::kalman::{Belief, Measurement, Motion};
use super::noise::{REST_SHARE, moving_factor, resting_factor, speeds_px, variance_factor};
use super::smooth::smooth;
use super::{Filtered, Flags, Measured, Point};
use nalgebra::{Matrix2, Vector2};

/// A blob in displayed pixels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sighting {
    /// Which hue.
    pub hue: u8,
    /// Where and how well.
    pub measured: Measured,
    /// Reaches over the picture's edge.
    pub cut: bool,
}

/// The blobs of one frame.
#[derive(Debug, Clone, PartialEq)]
pub struct FrameBlobs {
    /// Presentation time stamp.
    pub t_s: f64,
    /// The decoder reported damage; the frame is not measured.
    pub damaged: bool,
    /// What was seen.
    pub sightings: Vec<Sighting>,
}

/// A mark to be followed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MarkSlot {
    /// Index of its hue.
    pub hue: u8,
}

/// Frames from which the marks are chosen.
const WINDOW: usize = 256;
/// Frames after which the choice is made even where some mark has hardly been seen.
const LONGEST_WINDOW: usize = 4096;
/// Gate on the squared Mahalanobis distance: 99.9996 % for two dimensions.
const GATE: f64 = 25.0;
/// What it costs to leave a newcomer that is no mark unseen.
const YOUNG_MISS: f64 = 6.0;
/// Frames beside all marks of its hue after which something that is no mark counts as furniture. Beside them, for a
/// newcomer that appears while a mark is missed may be that mark.
const YOUNG_FRAMES: u32 = 30;
/// Seconds after which something that is no mark is forgotten.
const FORGET_S: f64 = 2.0;
/// Most things followed that are no marks.
const MOST_OTHERS: usize = 24;
/// One standard deviation of ln(area) from frame to frame, blur included.
const LN_AREA_SD: f64 = 0.5;

/// A sighting more than five times as large or as small is something else.
const MOST_LN_AREA: f64 = 1.61;

/// One followed thing, while frames come in.
#[derive(Debug, Clone)]
pub(super) struct Follower {
    pub hue: u8,
    belief: Belief,
    motion: Motion,
    area_px2: f64,
    t_s: f64,
    seen_s: f64,
    age: u32,
}

impl Follower {
    pub(super) fn start(sighting: &Sighting, t_s: f64, step_s: f64) -> Self {
        let area = f64::from(sighting.measured.area_px2);
        let diameter = area.sqrt() * 1.13;
        // a mark moves about its own diameter off a straight course between two frames, until more is known
        let motion = Motion { acceleration_psd_px2_s3: 3.0 * diameter.powi(2) / step_s.powi(3) };
        let speed = 2.0 * diameter / step_s;
        Self {
            hue: sighting.hue,
            belief: Belief::from_measurement(&measurement(&sighting.measured, 0.0), speed),
            motion,
            area_px2: area,
            t_s,
            seen_s: t_s,
            age: 0,
        }
    }

    fn predict(&mut self, t_s: f64) {
        self.belief = self.belief.predict(&self.motion, (t_s - self.t_s).max(0.0));
        self.t_s = t_s;
    }

    /// Cost of a sighting, `None` outside the gate. The gate is never narrower than the mark itself, so that a
    /// specimen released after minutes of rest is not lost.
    fn cost(&self, sighting: &Sighting) -> Option<f64> {
        if sighting.hue != self.hue {
            return None;
        }
        let radius = 0.56 * self.area_px2.sqrt();
        let (d2, _) = self.belief.distance2(&measurement(&sighting.measured, radius))?;
        let ln_area = (f64::from(sighting.measured.area_px2) / self.area_px2).ln();
        if ln_area.abs() > MOST_LN_AREA {
            return None;
        }
        let cost = d2 + (ln_area / LN_AREA_SD).powi(2).min(8.0);
        (d2 <= GATE).then_some(cost)
    }

    fn update(&mut self, sighting: &Sighting) {
        let z = measurement(&sighting.measured, 0.1);
        if let Some(belief) = self.belief.update(&z) {
            self.belief = belief;
        }
        self.area_px2 += 0.05 * (f64::from(sighting.measured.area_px2) - self.area_px2);
        self.seen_s = self.t_s;
    }
}

fn measurement(measured: &Measured, extra_sd_px: f64) -> Measurement {
    let [xx, yy, xy] = measured.covariance_px2;
    let extra = extra_sd_px * extra_sd_px + 1e-8;
    Measurement {
        position_px: Vector2::from(measured.position_px),
        covariance_px2: Matrix2::new(xx + extra, xy, xy, yy + extra),
    }
}

/// Turns frames of blobs into tracks, as they come.
#[derive(Debug)]
pub struct Tracker {
    slots: Vec<MarkSlot>,
    pivot_px: Option<[f64; 2]>,
    window: Vec<FrameBlobs>,
    marks: Vec<Option<Follower>>,
    others: Vec<Follower>,
    choice: Option<Choice>,
    t_s: Vec<f64>,
    points: Vec<Vec<(Option<Measured>, Flags)>>,
    damaged: Vec<usize>,
    step_s: f64,
}

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
    /// How many things of a mark's colour were seen beside the marks when they were chosen.
    pub other_candidates: usize,
}

impl Tracker {
    /// For marks top to bottom, with the pivot where it is known.
    pub fn new(slots: Vec<MarkSlot>, pivot_px: Option<[f64; 2]>) -> Self {
        let n = slots.len();
        Self {
            slots,
            pivot_px,
            window: Vec::new(),
            marks: vec![None; n],
            others: Vec::new(),
            choice: None,
            t_s: Vec::new(),
            points: vec![Vec::new(); n],
            damaged: Vec::new(),
            step_s: 1.0 / 30.0,
        }
    }

    /// Takes the next frame.
    pub fn push(&mut self, frame: FrameBlobs) {
        if self.choice.is_some() {
            self.follow(&frame);
            return;
        }
        self.window.push(frame);
        let length = self.window.len();
        if length == LONGEST_WINDOW || (length >= WINDOW && length.is_multiple_of(WINDOW)) {
            self.begin(length < LONGEST_WINDOW);
        }
    }

    /// Chooses the marks and follows them through the frames gathered so far. With `may_wait`, only if all are seen.
    fn begin(&mut self, may_wait: bool) {
        self.step_s = median_step(&self.window);
        let tracklets = link(&self.window, self.step_s);
        let choice = choose(&tracklets, &self.window, &self.slots, self.pivot_px);
        if may_wait && choice.chosen.iter().any(Option::is_none) {
            return;
        }
        self.choice = Some(choice);
        for frame in std::mem::take(&mut self.window).iter().enumerate() {
            self.start_due(frame.0, frame.1, &tracklets);
            self.follow(frame.1);
        }
    }

    /// Starts the followers of marks that are first seen in frame `index`.
    fn start_due(&mut self, index: usize, frame: &FrameBlobs, tracklets: &[Tracklet]) {
        let Some(choice) = &self.choice else { return };
        for (mark, chosen) in self.marks.iter_mut().zip(&choice.chosen) {
            let Some(tracklet) = chosen.map(|c| &tracklets[c]) else { continue };
            if let Some(&(first, blob)) = tracklet.sightings.first()
                && first == index
            {
                *mark = Some(Follower::start(&frame.sightings[blob], frame.t_s, self.step_s));
            }
        }
    }

    fn follow(&mut self, frame: &FrameBlobs) {
        let index = self.t_s.len();
        self.t_s.push(frame.t_s);
        if frame.damaged {
            self.damaged.push(index);
        }
        let sightings: &[Sighting] = if frame.damaged { &[] } else { &frame.sightings };
        let marks: Vec<usize> = (0..self.marks.len()).filter(|m| self.marks[*m].is_some()).collect();
        let mut rows: Vec<&mut Follower> = Vec::new();
        rows.extend(self.marks.iter_mut().flatten());
        rows.extend(self.others.iter_mut());
        let assigned = assign_frame(&mut rows, marks.len(), sightings, frame.t_s);
        let ambiguous = ambiguous_rows(&rows[..marks.len()], sightings, &assigned.before, &assigned.columns);
        let missed: Vec<u8> =
            (0..marks.len()).filter(|r| assigned.columns[*r].is_none()).map(|r| rows[r].hue).collect();
        let mut taken = vec![false; sightings.len()];
        for (row, column) in assigned.columns.iter().enumerate() {
            if let Some(column) = column {
                taken[*column] = true;
                rows[row].update(&sightings[*column]);
                rows[row].age += u32::from(!missed.contains(&rows[row].hue));
            }
        }
        for points in &mut self.points {
            points.push((None, Flags::LOST));
        }
        for (row, mark) in marks.iter().enumerate() {
            if let Some(column) = assigned.columns[row] {
                let mut flags = Flags::default();
                if sightings[column].cut {
                    flags.insert(Flags::CUT);
                }
                if ambiguous[row] {
                    flags.insert(Flags::AMBIGUOUS);
                }
                self.points[*mark][index] = (Some(sightings[column].measured), flags);
            }
        }
        self.others.retain(|o| frame.t_s - o.seen_s < FORGET_S);
        for (sighting, _) in sightings.iter().zip(&taken).filter(|(_, taken)| !**taken) {
            if self.others.len() < MOST_OTHERS {
                self.others.push(Follower::start(sighting, frame.t_s, self.step_s));
            }
        }
    }

    /// Ends the recording: scatter, flags, filter. The second value counts the marks of each hue that were found.
    pub fn finish(mut self) -> (Tracks, Vec<MarkFound>) {
        if self.choice.is_none() {
            self.begin(false);
        }
        let choice = self.choice.take().unwrap_or_default();
        let found = self
            .slots
            .iter()
            .zip(&self.points)
            .map(|(slot, points)| MarkFound {
                hue: slot.hue,
                frames: points.iter().filter(|(m, _)| m.is_some()).count(),
            })
            .collect();
        let mut tracks = Tracks {
            marks: Vec::new(),
            motion: Vec::new(),
            scatter: Vec::new(),
            area_px2: Vec::new(),
            damaged_frames: self.damaged,
            other_candidates: choice.others,
            t_s: self.t_s,
        };
        let scatters = scatters(&self.points, &tracks.t_s);
        for (points, scatter) in self.points.into_iter().zip(scatters) {
            tracks.add_mark(points, scatter, self.step_s);
        }
        (tracks, found)
    }
}

/// Factors (x, y) on the stated standard deviation of a mark.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scatter {
    /// At rest.
    pub resting: [f64; 2],
    /// In motion.
    pub moving: [f64; 2],
}

/// The factors of all marks; a mark that never moves takes over what the moving ones show.
fn scatters(marks: &[Vec<(Option<Measured>, Flags)>], t_s: &[f64]) -> Vec<Scatter> {
    let tracks: Vec<Vec<Option<Measured>>> =
        marks.iter().map(|points| points.iter().map(|(m, _)| *m).collect()).collect();
    let speeds: Vec<Vec<f64>> = tracks.iter().map(|t| speeds_px(t)).collect();
    let moving: Vec<[Option<f64>; 2]> =
        tracks.iter().zip(&speeds).map(|(t, v)| [0, 1].map(|axis| moving_factor(t, v, t_s, axis))).collect();
    let shown: Vec<f64> = moving.iter().flatten().flatten().copied().collect();
    let usual = shown.iter().sum::<f64>() / shown.len().max(1) as f64;
    tracks
        .iter()
        .zip(&speeds)
        .zip(&moving)
        .map(|((track, speed), moving)| {
            let rest = |axis| resting_factor(track, speed, t_s, axis).unwrap_or(1.0);
            Scatter {
                resting: [0, 1].map(|axis| rest(axis).max(REST_SHARE * moving[axis].unwrap_or(usual)).max(1.0)),
                moving: moving.map(|k| k.unwrap_or(usual).max(1.0)),
            }
        })
        .collect()
}

/// How often a mark was seen.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MarkFound {
    /// Its hue.
    pub hue: u8,
    /// Frames in which it was measured.
    pub frames: usize,
}

impl Tracks {
    fn add_mark(&mut self, points: Vec<(Option<Measured>, Flags)>, scatter: Scatter, step_s: f64) {
        let (mut measured, mut flags): (Vec<_>, Vec<_>) = points.into_iter().unzip();
        let area = median(measured.iter().flatten().map(|m| f64::from(m.area_px2))).unwrap_or(0.0);
        let speeds = speeds_px(&measured);
        for ((m, f), speed) in measured.iter_mut().zip(&mut flags).zip(speeds) {
            if let Some(m) = m {
                let [x, y] = [0, 1].map(|axis| variance_factor(speed, scatter.resting[axis], scatter.moving[axis]));
                m.covariance_px2[0] *= x;
                m.covariance_px2[1] *= y;
                m.covariance_px2[2] *= (x * y).sqrt();
                mind_area(m, f, area);
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

    /// The fixed-interval smoothed track of mark `mark`.
    pub fn smoothed(&self, mark: usize) -> Vec<Option<Measured>> {
        let filtered: Vec<Option<Filtered>> = self.marks[mark].iter().map(|p| p.filtered).collect();
        smooth(&filtered, &self.t_s, &self.motion[mark])
    }
}

/// A mark that is partly hidden has its centroid off by up to the hidden share of its radius; one that has grown
/// holds something else as well. Both are flagged and their variance grows accordingly.
fn mind_area(m: &mut Measured, flags: &mut Flags, usual_px2: f64) {
    let ratio = f64::from(m.area_px2) / usual_px2.max(1e-9);
    let deficit = if ratio < 0.85 {
        flags.insert(Flags::PARTIAL);
        1.0 - ratio
    } else if ratio > 1.35 {
        flags.insert(Flags::MERGED);
        1.0 - 1.0 / ratio
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

struct Assigned {
    columns: Vec<Option<usize>>,
    /// Cost of every pair before the update.
    before: Vec<Vec<Option<f64>>>,
}

/// Predicts every follower to `t_s` and assigns the sightings. The first `marks` rows are marks.
fn assign_frame(rows: &mut [&mut Follower], marks: usize, sightings: &[Sighting], t_s: f64) -> Assigned {
    for row in rows.iter_mut() {
        row.predict(t_s);
    }
    let before: Vec<Vec<Option<f64>>> =
        rows.iter().map(|row| sightings.iter().map(|s| row.cost(s)).collect()).collect();
    // a newcomer that is no mark gives way, which is written as a dearer sighting: the sum decides
    let costs: Vec<Vec<Option<f64>>> = before
        .iter()
        .enumerate()
        .map(|(i, row)| {
            let handicap = if i < marks || rows[i].age >= YOUNG_FRAMES { 0.0 } else { GATE + 8.0 - YOUNG_MISS };
            row.iter().map(|c| c.map(|c| c + handicap)).collect()
        })
        .collect();
    Assigned { columns: assign(&costs, GATE + 8.0), before }
}

/// Marks that could have been exchanged with another of the same hue at hardly more cost.
fn ambiguous_rows(
    marks: &[&mut Follower],
    sightings: &[Sighting],
    costs: &[Vec<Option<f64>>],
    columns: &[Option<usize>],
) -> Vec<bool> {
    let mut ambiguous = vec![false; marks.len()];
    for i in 0..marks.len() {
        for j in i + 1..marks.len() {
            let (Some(a), Some(b)) = (columns[i], columns[j]) else { continue };
            if sightings[a].hue != sightings[b].hue {
                continue;
            }
            let (Some(ia), Some(jb), Some(ib), Some(ja)) = (costs[i][a], costs[j][b], costs[i][b], costs[j][a]) else {
                continue;
            };
            if ib + ja - ia - jb < 6.0 {
                ambiguous[i] = true;
                ambiguous[j] = true;
            }
        }
    }
    ambiguous
}

/// Links the sightings of a window into tracklets.
fn link(window: &[FrameBlobs], step_s: f64) -> Vec<Tracklet> {
    let mut followers: Vec<(usize, Follower)> = Vec::new();
    let mut tracklets: Vec<Tracklet> = Vec::new();
    for (index, frame) in window.iter().enumerate() {
        if frame.damaged {
            continue;
        }
        followers.retain(|(_, f)| frame.t_s - f.seen_s < FORGET_S);
        let mut rows: Vec<&mut Follower> = followers.iter_mut().map(|(_, f)| f).collect();
        let marks = rows.len();
        let assigned = assign_frame(&mut rows, marks, &frame.sightings, frame.t_s);
        let mut taken = vec![false; frame.sightings.len()];
        for (row, column) in assigned.columns.iter().enumerate() {
            if let Some(column) = column {
                taken[*column] = true;
                followers[row].1.update(&frame.sightings[*column]);
                tracklets[followers[row].0].sightings.push((index, *column));
            }
        }
        for (column, sighting) in frame.sightings.iter().enumerate() {
            if !taken[column] && followers.len() < 4 * MOST_OTHERS {
                followers.push((tracklets.len(), Follower::start(sighting, frame.t_s, step_s)));
                tracklets.push(Tracklet { hue: sighting.hue, sightings: vec![(index, column)] });
            }
        }
    }
    tracklets
}

fn median_step(window: &[FrameBlobs]) -> f64 {
    median(window.windows(2).map(|w| w[1].t_s - w[0].t_s)).filter(|s| *s > 0.0).unwrap_or(1.0 / 30.0)
}

pub(super) fn median(values: impl Iterator<Item = f64>) -> Option<f64> {
    let mut values: Vec<f64> = values.collect();
    let middle = values.len().checked_sub(1)? / 2;
    let (_, median, _) = values.select_nth_unstable_by(middle, f64::total_cmp);
    Some(*median)
}
