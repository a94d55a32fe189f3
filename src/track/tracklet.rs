//! The first frames' sightings, linked into one tracklet a thing.

use super::FrameBlobs;
use super::assign::assign_frame;
use super::follower::{FORGET_S, Follower, Keeping, MOST_OTHERS};

/// Sightings of one thing over the window: (frame, blob).
#[derive(Debug, Clone, PartialEq)]
pub struct Tracklet {
    /// Index of its hue.
    pub hue: u8,
    /// Where it was seen.
    pub sightings: Vec<(usize, usize)>,
}

/// Frames of a window in which places are sought where something stands, and in which they are looked at (cost).
const SEEKING_FRAMES: usize = 8;
const COUNTED_FRAMES: usize = 128;
/// What stands still is seen at its place in this part of the frames, at least: in others something passes, and hides it (judgement).
pub const MOSTLY: f64 = 0.5;

/// Things that stand at their place through most of a window.
pub fn standing(window: &[FrameBlobs], step_s: f64) -> Vec<Follower> {
    let every = |frames: usize| window.iter().step_by(window.len().div_ceil(frames).max(1));
    let counted: Vec<&FrameBlobs> = every(COUNTED_FRAMES).collect();
    let mut places: Vec<Follower> = Vec::new();
    for sighting in every(SEEKING_FRAMES).flat_map(|frame| &frame.sightings) {
        let place = Follower::start(sighting, window[0].t_s, step_s, Keeping::Always);
        let is_seen = |frame: &&&FrameBlobs| frame.sightings.iter().any(|own| place.is_at_its_place(own));
        let is_known = places.iter().any(|known| known.is_at_its_place(sighting));
        if !is_known && counted.iter().filter(is_seen).count() as f64 > MOSTLY * counted.len() as f64 {
            places.push(place);
        }
    }
    places
}

/// Links the sightings of a window, in which these things stand, into tracklets.
pub fn link(window: &[FrameBlobs], standing: &[Follower], step_s: f64) -> Vec<Tracklet> {
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
        let doubted = assigned.doubted(&rows);
        let mut taken = vec![false; frame.sightings.len()];
        for (row, column) in assigned.columns.iter().enumerate() {
            if let Some(column) = column {
                if doubted[row] && followers[row].1.was_lost() {
                    // it may be another thing that came back: what follows is a tracklet of its own
                    continue;
                }
                taken[*column] = true;
                followers[row].1.update(&frame.sightings[*column]);
                followers[row].1.age += 1;
                tracklets[followers[row].0].sightings.push((index, *column));
            }
        }
        for (column, sighting) in frame.sightings.iter().enumerate() {
            if !taken[column] && followers.len() < 4 * MOST_OTHERS {
                let mut follower = Follower::start(sighting, frame.t_s, step_s, Keeping::Likely);
                if standing.iter().any(|place| place.is_at_its_place(sighting)) {
                    follower.stand_there();
                }
                followers.push((tracklets.len(), follower));
                tracklets.push(Tracklet { hue: sighting.hue, sightings: vec![(index, column)] });
            }
        }
    }
    tracklets
}
