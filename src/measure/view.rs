//! One frame → what is seen in it, as displayed, the camera's motion taken out.

use super::Options;
use crate::area::Area;
use crate::detect::{Blob, Detector};
use crate::error::Result;
use crate::steady::{Background, CameraShift};
use crate::track::{FrameBlobs, Measured, Sighting};
use crate::video::{Frame, Orientation, Outcome, StreamInfo};

/// One frame, looked at.
pub struct Seen {
    pub t_s: f64,
    /// Before --from or after --until.
    pub outside: bool,
    pub sightings: Vec<Sighting>,
    pub camera: Option<CameraShift>,
    /// Where the camera looks, in a frame in which it is watched.
    pub watched: Option<CameraShift>,
}

/// From stored to displayed pixels.
pub struct View<'a> {
    pub orientation: Orientation,
    pub size: (usize, usize),
    pub binary: bool,
    /// Rough places are enough.
    pub glance: bool,
    pub area: &'a Area,
    pub background: Option<&'a Background>,
    pub watch: Option<Watch<'a>>,
    pub span_s: [f64; 2],
}

/// A look at where the camera stands, every so often.
#[derive(Clone, Copy)]
pub struct Watch<'a> {
    pub background: &'a Background,
    /// From one look to the next, and from one frame to the next.
    pub every_s: f64,
    pub step_s: f64,
}

impl Watch<'_> {
    /// Whether it is time for a look, as the stamp alone tells: frames are looked at in no order.
    fn is_due(&self, t_s: f64) -> bool {
        (t_s / self.every_s).floor() > ((t_s - self.step_s) / self.every_s).floor()
    }
}

impl<'a> View<'a> {
    /// Of a recording, every frame measured in full.
    pub fn of(stream: &StreamInfo, options: &Options, area: &'a Area, background: Option<&'a Background>) -> Self {
        let rig = &options.rig;
        Self {
            orientation: stream.orientation,
            size: stream.stored_size_px,
            binary: options.binary_centroid,
            glance: false,
            area,
            background,
            watch: None,
            span_s: rig.span_s(),
        }
    }

    /// Time stamp and blobs of a frame, as displayed, the camera's motion taken out.
    pub fn look(&self, detector: &Detector, frame: &Frame<'_>) -> Result<Outcome<Seen>> {
        let outside = !(self.span_s[0]..=self.span_s[1]).contains(&frame.t_s);
        let mut seen = Seen { t_s: frame.t_s, outside, sightings: Vec::new(), camera: None, watched: None };
        if !frame.damaged && !outside {
            seen.camera = self.background.and_then(|b| b.locate(&frame.picture));
            let due = self.watch.filter(|watch| watch.is_due(frame.t_s));
            seen.watched = due.and_then(|watch| watch.background.locate(&frame.picture));
            if self.background.is_none() || seen.camera.is_some() {
                let mut blobs =
                    if self.glance { detector.glance(&frame.picture) } else { detector.detect(&frame.picture) }?;
                if let Some(camera) = seen.camera {
                    blobs.iter_mut().for_each(|b| undo(b, &camera));
                }
                let sightings = blobs.iter().map(|b| self.sighting(b));
                seen.sightings = sightings.filter(|s| self.area.holds(s.measured.position_px)).collect();
            }
        }
        Ok(Outcome { key: frame.key, damaged: frame.damaged, value: seen })
    }

    fn sighting(&self, blob: &Blob) -> Sighting {
        let c = &blob.centroid;
        let stored = if self.binary { blob.binary_px } else { [c.x_px, c.y_px] };
        let [xx, yy, xy] = c.variance_px2;
        let (right, down) = (self.orientation.turn([1.0, 0.0]), self.orientation.turn([0.0, 1.0]));
        let covariance = |i: usize, j: usize| {
            right[i] * right[j] * xx + down[i] * down[j] * yy + (right[i] * down[j] + down[i] * right[j]) * xy
        };
        Sighting {
            hue: blob.hue,
            measured: Measured {
                position_px: self.orientation.point(stored, self.size),
                covariance_px2: [covariance(0, 0), covariance(1, 1), covariance(0, 1)],
                area_px2: c.area_px2 as f32,
            },
            cut: c.cut,
        }
    }
}

/// Puts a blob where it would be had the camera not moved.
fn undo(blob: &mut Blob, camera: &CameraShift) {
    let own = camera.variance_px2([blob.centroid.x_px, blob.centroid.y_px]);
    blob.centroid.variance_px2.iter_mut().zip(own).for_each(|(sum, variance)| *sum += variance);
    [blob.centroid.x_px, blob.centroid.y_px] = camera.undo([blob.centroid.x_px, blob.centroid.y_px]);
    blob.binary_px = camera.undo(blob.binary_px);
}

/// What was seen in a frame and when; nothing is measured in a damaged one.
pub fn frame_blobs(frame: Outcome<Seen>) -> FrameBlobs {
    let Seen { t_s, sightings, .. } = frame.value;
    FrameBlobs { t_s, damaged: frame.damaged, sightings: if frame.damaged { Vec::new() } else { sightings } }
}
