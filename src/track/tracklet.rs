//! The first frames' sightings, linked into one tracklet a thing.

use super::FrameBlobs;
use super::assign::assign_frame;
use super::follower::{FORGET_S, Follower, MOST_OTHERS};

/// Sightings of one thing over the window: (frame, blob).
#[derive(Debug, Clone, PartialEq)]
pub struct Tracklet {
    /// Index of its hue.
    pub hue: u8,
    /// Where it was seen.
    pub sightings: Vec<(usize, usize)>,
}

/// Links the sightings of a window into tracklets.
pub fn link(window: &[FrameBlobs], step_s: f64) -> Vec<Tracklet> {
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
