//! Follows every mark through the recording.
//!
//! The first frames are gathered and linked into tracklets, from which the marks are chosen (see
//! [`super::choose`]). From then on each frame is assigned as it comes and only the marks' own measurements are kept.
//! Whatever else has the marks' colour (a knob, a lamp) is followed too, so that a mark that is hidden for a while
//! does not settle on it. When the recording ends, the stated variances are held against the tracks' own scatter
//! and the Kalman filter runs over the measurements, with the true time steps.

use super::assign::assign_frame;
use super::choose::{Choice, choose};
use super::follower::{FORGET_S, Follower, Keeping, MOST_OTHERS};
use super::identity::{Identity, Renaming};
use super::noise::scatters;
use super::tracklet::{MOSTLY, Tracklet, link, standing};
use super::{Flags, FrameBlobs, Measured, Sighting, Tracks};
use crate::statistics::median_step_s;

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
    identity: Identity,
}

impl Tracker {
    /// For marks top to bottom, with the pivot where it is known.
    pub fn new(slots: Vec<MarkSlot>, pivot_px: Option<[f64; 2]>) -> Self {
        let n = slots.len();
        let hues: Vec<u8> = slots.iter().map(|slot| slot.hue).collect();
        let identity = Identity::new(&hues, pivot_px);
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
            identity,
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
        let stamps: Vec<f64> = self.window.iter().map(|frame| frame.t_s).collect();
        self.step_s = median_step_s(&stamps).unwrap_or(self.step_s);
        let standing = standing(&self.window, self.step_s);
        let tracklets = link(&self.window, &standing, self.step_s);
        let choice = choose(&tracklets, &self.window, &self.slots, self.pivot_px);
        if may_wait && (choice.chosen.iter().any(Option::is_none) || !choice.moves) {
            return;
        }
        self.learn(&choice, &tracklets);
        if choice.moves {
            self.begin_furniture(standing, &choice, &tracklets);
        }
        self.choice = Some(choice);
        for frame in std::mem::take(&mut self.window).iter().enumerate() {
            self.start_due(frame.0, frame.1, &tracklets);
            self.follow(frame.1);
        }
    }

    /// The tracklets by which the marks were chosen show first what is usual about the marks.
    fn learn(&mut self, choice: &Choice, tracklets: &[Tracklet]) {
        let mut seen_px = vec![vec![None; self.slots.len()]; self.window.len()];
        for (mark, chosen) in choice.chosen.iter().enumerate() {
            for &(frame, blob) in chosen.iter().flat_map(|c| &tracklets[*c].sightings) {
                seen_px[frame][mark] = Some(self.window[frame].sightings[blob].measured.position_px);
            }
        }
        seen_px.iter().for_each(|seen_px| self.identity.learn(seen_px));
    }

    /// What stands still through most of the first frames, where no mark does, is known from the first one on.
    fn begin_furniture(&mut self, standing: Vec<Follower>, choice: &Choice, tracklets: &[Tracklet]) {
        let is_of = |place: &Follower, tracklet: &Tracklet| {
            let all = tracklet.sightings.iter().map(|(frame, blob)| &self.window[*frame].sightings[*blob]);
            let there = all.filter(|own| place.is_at_its_place(own)).count() as f64;
            there > MOSTLY * tracklet.sightings.len() as f64
        };
        let is_mark = |place: &Follower| choice.chosen.iter().flatten().any(|chosen| is_of(place, &tracklets[*chosen]));
        let furniture = standing.into_iter().filter(|place| !is_mark(place));
        self.others.extend(furniture.map(Follower::into_furniture).take(MOST_OTHERS));
    }

    /// Starts the followers of marks that are first seen in frame `index`.
    fn start_due(&mut self, index: usize, frame: &FrameBlobs, tracklets: &[Tracklet]) {
        let Some(choice) = &self.choice else { return };
        for (mark, chosen) in self.marks.iter_mut().zip(&choice.chosen) {
            let Some(tracklet) = chosen.map(|c| &tracklets[c]) else { continue };
            if let Some(&(first, blob)) = tracklet.sightings.first()
                && first == index
            {
                *mark = Some(Follower::start(&frame.sightings[blob], frame.t_s, self.step_s, Keeping::No));
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
        let ambiguous = assigned.ambiguous(&rows[..marks.len()]);
        let doubted = assigned.doubted(&rows[..marks.len()]);
        let unseen = |mark: &usize| marks.iter().position(|m| m == mark).is_none_or(|r| assigned.columns[r].is_none());
        let missed: Vec<u8> = (0..self.slots.len()).filter(unseen).map(|mark| self.slots[mark].hue).collect();
        // what stands still and is not seen lies behind, or in front of, what passes there
        let hidden: Vec<usize> = (marks.len()..rows.len()).filter(|row| assigned.columns[*row].is_none()).collect();
        let covers = |sighting: &Sighting| hidden.iter().any(|row| rows[*row].is_covered_by(sighting));
        let merged: Vec<bool> = sightings.iter().map(covers).collect();
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
                if merged[column] {
                    flags.insert(Flags::MERGED);
                }
                self.points[*mark][index] = (Some(sightings[column].measured), flags);
                if doubted[row] {
                    self.identity.doubt(*mark, index);
                }
            }
        }
        let seen_px: Vec<Option<[f64; 2]>> = self.points.iter().map(|p| p[index].0.map(|m| m.position_px)).collect();
        let renamings = self.identity.see(index, &seen_px);
        self.rename(&renamings);
        self.others.retain(|o| frame.t_s - o.seen_s < FORGET_S);
        for (sighting, _) in sightings.iter().zip(&taken).filter(|(_, taken)| !**taken) {
            if self.others.len() < MOST_OTHERS {
                self.others.push(Follower::start(sighting, frame.t_s, self.step_s, Keeping::Always));
            }
        }
    }

    /// Gives sightings, and what follows them, to the marks they are of.
    fn rename(&mut self, renamings: &[Renaming]) {
        let mut moving = Vec::new();
        for renaming in renamings {
            let sightings = &mut self.points[renaming.from][renaming.since..];
            moving.push((sightings.to_vec(), self.marks[renaming.from].take()));
            sightings.fill((None, Flags::LOST));
        }
        let mut displaced = Vec::new();
        for (renaming, (sightings, follower)) in renamings.iter().zip(moving) {
            self.points[renaming.to][renaming.since..].copy_from_slice(&sightings);
            displaced.extend(std::mem::replace(&mut self.marks[renaming.to], follower));
        }
        for renaming in renamings {
            if self.marks[renaming.from].is_none() {
                self.marks[renaming.from] = displaced.pop();
            }
        }
    }

    /// Ends the recording: scatter, flags, filter. The second value counts the marks of each hue that were found.
    pub fn finish(mut self) -> (Tracks, Vec<MarkFound>) {
        if self.choice.is_none() {
            self.begin(false);
        }
        for (mark, frames) in self.identity.finish() {
            let seen = self.points[mark][frames].iter_mut().filter(|(measured, _)| measured.is_some());
            seen.for_each(|(_, flags)| flags.insert(Flags::AMBIGUOUS));
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
            spares: choice.spares,
            moves: choice.moves,
            t_s: self.t_s,
        };
        let scatters = scatters(&self.points, &tracks.t_s);
        for (points, scatter) in self.points.into_iter().zip(scatters) {
            tracks.add_mark(points, scatter, self.step_s);
        }
        (tracks, found)
    }
}

/// How often a mark was seen.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MarkFound {
    /// Its hue.
    pub hue: u8,
    /// Frames in which it was measured.
    pub frames: usize,
}
