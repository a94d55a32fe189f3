//! What lasts in a recording, whatever it is: paths of things of which it is not known yet which are marks.

use super::FrameBlobs;
use super::choose::{candidates, stretch_of};
use super::tracklet::{link, standing};
use crate::statistics::{median, median_step_s};

/// A lasting thing in a recording, whatever it is.
#[derive(Debug, Clone, PartialEq)]
pub struct TrackedObject {
    /// Index of its hue.
    pub hue: u8,
    /// Share of the frames that show it.
    pub presence: f64,
    /// Usual area.
    pub area_px2: f64,
    /// Half the range of its motion.
    pub travel_px: f64,
    /// It swings.
    pub moves: bool,
    /// It does so by more than it would seem to where it stands still and something covers it in part.
    pub moves_whole: bool,
    /// How well its past foretells its place, 0 to 1 (`steadiness`).
    pub steadiness: f64,
    /// Position by frame.
    pub path: Vec<Option<[f64; 2]>>,
}

impl TrackedObject {
    /// How much its distance from another changes, as a share of how they move against each other; 1 where they do
    /// not, or are never seen together.
    pub fn stretch(&self, other: &Self) -> f64 {
        stretch_of(&self.path, &other.path, self.travel_px.max(other.travel_px))
    }

    /// How far it moves against another, as a share of how far both move: next to nothing where one is the other's shadow
    /// or a part of it, and all of it where one stands still.
    pub fn moves_against(&self, other: &Self) -> f64 {
        let apart: Vec<[f64; 2]> = self
            .path
            .iter()
            .zip(&other.path)
            .filter_map(|(p, q)| p.zip(*q))
            .map(|(p, q)| [q[0] - p[0], q[1] - p[1]])
            .collect();
        let n = apart.len().max(1) as f64;
        let mean = [0, 1].map(|axis| apart.iter().map(|d| d[axis]).sum::<f64>() / n);
        let motion_px = apart.iter().map(|d| (d[0] - mean[0]).hypot(d[1] - mean[1])).sum::<f64>() / n;
        motion_px / self.travel_px.max(other.travel_px).max(f64::MIN_POSITIVE)
    }

    /// Correlation with another of the places along the axis along which each moves farther, where both are seen.
    pub fn correlation(&self, other: &Self) -> f64 {
        let both = self.path.iter().zip(&other.path).filter_map(|(p, q)| (*p).zip(*q));
        let (own, theirs): (Vec<[f64; 2]>, Vec<[f64; 2]>) = both.unzip();
        let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let deviations = |places: &[[f64; 2]]| {
            let [x, y] = [0, 1].map(|axis| {
                let mean = places.iter().map(|p| p[axis]).sum::<f64>() / places.len().max(1) as f64;
                places.iter().map(|p| p[axis] - mean).collect::<Vec<f64>>()
            });
            if product(&x, &x) < product(&y, &y) { y } else { x }
        };
        let (own, theirs) = (deviations(&own), deviations(&theirs));
        product(&own, &theirs) / (product(&own, &own) * product(&theirs, &theirs)).sqrt().max(f64::MIN_POSITIVE)
    }

    /// Usual distance from another; `None` where they are never seen together.
    pub fn distance_px(&self, other: &Self) -> Option<f64> {
        let apart = |(p, q): (&Option<[f64; 2]>, &Option<[f64; 2]>)| {
            let (p, q) = (p.as_ref()?, q.as_ref()?);
            Some((p[0] - q[0]).hypot(p[1] - q[1]))
        };
        median(&mut self.path.iter().zip(&other.path).filter_map(apart).collect::<Vec<_>>())
    }

    /// Where the rarer of the two is seen, the other is as well, more often than not: they are two.
    pub fn is_seen_beside(&self, other: &Self) -> bool {
        let seen = |thing: &Self| thing.path.iter().flatten().count();
        let both = self.path.iter().zip(&other.path).filter(|(p, q)| p.is_some() && q.is_some()).count();
        2 * both > seen(self).min(seen(other))
    }

    /// Radius of a disc of its area.
    pub fn radius_px(&self) -> f64 {
        (self.area_px2 / std::f64::consts::PI).sqrt()
    }

    /// With columns this many times as wide; its area and how far it moves stay.
    #[must_use]
    pub fn widened(mut self, times: f64) -> Self {
        self.path.iter_mut().flatten().for_each(|place| place[0] *= times);
        self
    }

    /// Where it was seen.
    pub fn places_px(&self) -> Vec<[f64; 2]> {
        self.path.iter().flatten().copied().collect()
    }

    /// Usual place.
    pub fn place_px(&self) -> [f64; 2] {
        [0, 1].map(|axis| median(&mut self.path.iter().flatten().map(|p| p[axis]).collect::<Vec<_>>()).unwrap_or(0.0))
    }
}

/// Everything that lasts in these frames.
pub fn things(window: &[FrameBlobs]) -> Vec<TrackedObject> {
    let stamps: Vec<f64> = window.iter().map(|frame| frame.t_s).collect();
    let Some(step_s) = median_step_s(&stamps) else { return Vec::new() };
    let tracklets = link(window, &standing(window, step_s), step_s);
    candidates(&tracklets, window, None)
        .into_iter()
        .map(|c| TrackedObject {
            hue: c.hue,
            presence: c.presence,
            area_px2: c.ln_area.exp(),
            travel_px: c.travel_px,
            moves: c.moves,
            moves_whole: c.moves_whole,
            steadiness: c.steadiness,
            path: c.path,
        })
        .collect()
}
