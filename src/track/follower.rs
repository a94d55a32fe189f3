//! One followed thing of a mark's colour, while frames come in.

use super::kalman::{Belief, Measurement, Motion};
use super::{Measured, Sighting};
use nalgebra::{Matrix2, Vector2};

/// Gate on the squared Mahalanobis distance: 99.9996 % for two dimensions.
pub const GATE: f64 = 25.0;
/// One standard deviation of ln(area) from frame to frame, blur included.
const LN_AREA_SD: f64 = 0.5;
/// A sighting more than five times as large or as small is something else.
const MOST_LN_AREA: f64 = 1.61;
/// Most that a change of area adds to the cost of a sighting.
pub const MOST_AREA_COST: f64 = 8.0;

/// Seconds after which something that is no mark is forgotten.
pub const FORGET_S: f64 = 2.0;
/// Most things followed that are no marks.
pub const MOST_OTHERS: usize = 24;

/// Frames beside all marks of its hue after which something that is no mark counts as furniture. Beside them, for a
/// newcomer that appears while a mark is missed may be that mark.
pub const NEWCOMER_FRAMES: u32 = 30;
/// What has kept to its place for so long within this part of its radius, or this many px, stands still (judgement).
const STANDS_RADII: f64 = 0.1;
const STANDS_PX: f64 = 1.0;

/// Steps between frames over which a course is straight enough to tell marks apart.
const LONGEST_COURSE_STEPS: f64 = 3.5;

/// One followed thing, while frames come in.
#[derive(Debug, Clone)]
pub struct Follower {
    pub hue: u8,
    belief: Belief,
    motion: Motion,
    area_px2: f64,
    t_s: f64,
    /// When it was last seen.
    pub seen_s: f64,
    /// Frames in which it was seen beside all marks of its hue.
    pub age: u32,
    /// Frames since it was last seen, the one it waits for included.
    unseen_frames: u32,
    step_s: f64,
    /// Where it was first seen, and how far from there it has been since.
    first_px: Vector2<f64>,
    farthest_px: f64,
    /// It has stood still for long, and has not left its place since.
    is_still: bool,
    /// How well it keeps to its place once it has stood still for long.
    keeping: Keeping,
}

/// How well something keeps to the place where it has stood still for long.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Keeping {
    /// A mark moves when it is let go.
    No,
    /// It may be a mark.
    Likely,
    /// It is no mark, and is sought nowhere else.
    Always,
}

impl Follower {
    /// At rest at its first sighting.
    pub fn start(sighting: &Sighting, t_s: f64, step_s: f64, keeping: Keeping) -> Self {
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
            unseen_frames: 0,
            step_s,
            first_px: Vector2::from(sighting.measured.position_px),
            farthest_px: 0.0,
            is_still: false,
            keeping,
        }
    }

    /// It is known to be furniture that stands where it was first seen.
    pub fn into_furniture(self) -> Self {
        Self { age: NEWCOMER_FRAMES, is_still: true, ..self }
    }

    /// Whether a sighting is where it was first seen.
    pub fn is_at_its_place(&self, sighting: &Sighting) -> bool {
        self.hue == sighting.hue && self.off_px(sighting) < self.still_px()
    }

    /// How far from its place what stands still may be.
    fn still_px(&self) -> f64 {
        (STANDS_RADII * self.radius_px()).max(STANDS_PX)
    }

    /// Whether it keeps to a place where it has stood still for long.
    pub fn stands(&self) -> bool {
        self.keeping != Keeping::No && self.is_still
    }

    /// It is known to stand at its place.
    pub fn stand_there(&mut self) {
        self.is_still = true;
    }

    /// Whether a sighting of something else covers a part of it, where it stands.
    pub fn is_covered_by(&self, sighting: &Sighting) -> bool {
        let reach_px = self.radius_px() + radius_px(f64::from(sighting.measured.area_px2));
        self.hue == sighting.hue && self.stands() && self.off_px(sighting) < reach_px
    }

    /// Waits for what is seen at `t_s`.
    pub fn predict(&mut self, t_s: f64) {
        self.belief = self.belief.predict(&self.motion, (t_s - self.t_s).max(0.0));
        self.t_s = t_s;
        self.unseen_frames += 1;
    }

    /// How widely what is believed of its place is spread: ln of the determinant of its covariance.
    pub fn ln_spread(&self) -> f64 {
        let place = Matrix2::identity() * self.radius_px().powi(2) + self.belief.position_covariance_px2();
        place.determinant().max(f64::MIN_POSITIVE).ln()
    }

    /// It was not seen in the frame before the one it waits for, and may have gone anywhere.
    pub fn was_lost(&self) -> bool {
        self.unseen_frames > 1 && !self.stands() || self.is_long_lost()
    }

    /// It has not been seen for so long that its course says nothing about where it is.
    pub fn is_long_lost(&self) -> bool {
        self.t_s - self.seen_s > LONGEST_COURSE_STEPS * self.step_s && !self.stands()
    }

    fn radius_px(&self) -> f64 {
        radius_px(self.area_px2)
    }

    /// Cost of a sighting, `None` outside the gate. The gate is never narrower than the mark itself, so that a
    /// specimen released after minutes of rest is not lost.
    pub fn cost(&self, sighting: &Sighting) -> Option<f64> {
        if sighting.hue != self.hue {
            return None;
        }
        let d2 = self.distance2(sighting)?;
        let ln_area = (f64::from(sighting.measured.area_px2) / self.area_px2).ln();
        if ln_area.abs() > MOST_LN_AREA {
            return None;
        }
        let cost = d2 + (ln_area / LN_AREA_SD).powi(2).min(MOST_AREA_COST);
        (d2 <= GATE).then_some(cost)
    }

    /// The squared Mahalanobis distance of a sighting. What has stood still in n frames leaves its place in the next one with a probability of about 1/n, −2 ln of which is added:
    /// so what passes there does not take its name. Once it is hidden it is waited for at its place.
    fn distance2(&self, sighting: &Sighting) -> Option<f64> {
        let at_place = (self.off_px(sighting) / self.still_px()).powi(2);
        if self.stands() && (self.keeping == Keeping::Always || self.unseen_frames > 1) {
            return Some(at_place);
        }
        let (moved, _) = self.belief.distance2(&measurement(&sighting.measured, self.radius_px()))?;
        if !self.stands() || moved > GATE {
            return Some(moved);
        }
        Some(at_place.min(moved + 2.0 * f64::from(self.age.max(NEWCOMER_FRAMES)).ln()).min(GATE))
    }

    /// How far a sighting is from where it was first seen.
    fn off_px(&self, sighting: &Sighting) -> f64 {
        (Vector2::from(sighting.measured.position_px) - self.first_px).norm()
    }

    /// Takes the sighting that was assigned to it.
    pub fn update(&mut self, sighting: &Sighting) {
        let z = measurement(&sighting.measured, 0.1);
        if let Some(belief) = self.belief.update(&z) {
            self.belief = belief;
        }
        self.area_px2 += 0.05 * (f64::from(sighting.measured.area_px2) - self.area_px2);
        self.farthest_px = self.farthest_px.max(self.off_px(sighting));
        // what passes draws the place of both together aside, and no farther than the gate
        let within_px = if self.is_still { GATE.sqrt() } else { 1.0 } * self.still_px();
        self.is_still = self.farthest_px < within_px && (self.is_still || self.age >= NEWCOMER_FRAMES);
        self.seen_s = self.t_s;
        self.unseen_frames = 0;
    }
}

/// Of a disc of this area.
fn radius_px(area_px2: f64) -> f64 {
    0.56 * area_px2.sqrt()
}

/// A centroid as the filter takes it, with some extra uncertainty.
pub fn measurement(measured: &Measured, extra_sd_px: f64) -> Measurement {
    let [xx, yy, xy] = measured.covariance_px2;
    let extra = extra_sd_px * extra_sd_px + 1e-8;
    Measurement {
        position_px: Vector2::from(measured.position_px),
        covariance_px2: Matrix2::new(xx + extra, xy, xy, yy + extra),
    }
}
