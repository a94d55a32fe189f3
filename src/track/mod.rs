//! Blobs → one track a mark (paper Section III.II).

mod arc;
mod assign;
mod chain;
pub mod chain_detection;
mod choose;
mod follower;
mod identity;
mod kalman;
mod noise;
mod sighting;
mod smooth;
mod steadiness;
mod thing;
mod tracker;
mod tracklet;
mod tracks;

pub use arc::Arc;
pub use choose::UnusedObject;
pub use kalman::{Belief, Measurement, Motion};
pub use noise::Scatter;
pub use sighting::{FrameBlobs, Sighting};
pub use thing::{TrackedObject, things};
pub use tracker::{MarkFound, MarkSlot, Tracker};
pub use tracks::Tracks;

/// One mark in one frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    /// Centroid as measured, displayed pixels, with covariance (xx, yy, xy) in px².
    pub measured: Option<Measured>,
    /// What the filter believed after this frame.
    pub filtered: Option<Filtered>,
    /// What is unusual.
    pub flags: Flags,
}

/// A measured centroid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measured {
    /// px, centre of the top-left displayed pixel at (0, 0), y down.
    pub position_px: [f64; 2],
    /// Covariance (xx, yy, xy), px².
    pub covariance_px2: [f64; 3],
    /// Area of the mark.
    pub area_px2: f32,
}

impl Measured {
    /// With columns this many times as wide; its area stays.
    pub fn widen(&mut self, times: f64) {
        self.position_px[0] *= times;
        self.covariance_px2[0] *= times * times;
        self.covariance_px2[2] *= times;
    }
}

/// The filter's state, kept small.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Filtered {
    /// (x, y, ẋ, ẏ).
    pub state: [f64; 4],
    /// Upper triangle of the covariance, row by row.
    pub covariance: [f32; 10],
}

impl Filtered {
    fn pack(belief: &Belief) -> Self {
        let mut covariance = [0.0; 10];
        let mut k = 0;
        for row in 0..4 {
            for column in row..4 {
                covariance[k] = belief.covariance[(row, column)] as f32;
                k += 1;
            }
        }
        Self { state: [0, 1, 2, 3].map(|i| belief.state[i]), covariance }
    }

    fn unpack(&self) -> Belief {
        let mut covariance = nalgebra::Matrix4::zeros();
        let mut k = 0;
        for row in 0..4 {
            for column in row..4 {
                covariance[(row, column)] = f64::from(self.covariance[k]);
                covariance[(column, row)] = f64::from(self.covariance[k]);
                k += 1;
            }
        }
        Belief { state: nalgebra::Vector4::from(self.state), covariance }
    }

    /// Standard deviations of the position.
    pub fn sd_px(&self) -> [f64; 2] {
        [f64::from(self.covariance[0]).max(0.0).sqrt(), f64::from(self.covariance[4]).max(0.0).sqrt()]
    }
}

/// What is unusual about a mark in a frame.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Flags(u8);

impl Flags {
    /// Not seen; the filter coasts.
    pub const LOST: Self = Self(1);
    /// Smaller than usual: partly hidden.
    pub const PARTIAL: Self = Self(2);
    /// Larger than usual: merged with something, or badly blurred.
    pub const MERGED: Self = Self(4);
    /// Reaches over the picture's edge.
    pub const CUT: Self = Self(8);
    /// Could as well have been another mark of the same colour.
    pub const AMBIGUOUS: Self = Self(16);

    const NAMES: [(Self, &'static str); 5] = [
        (Self::LOST, "lost"),
        (Self::PARTIAL, "partial"),
        (Self::MERGED, "merged"),
        (Self::CUT, "cut"),
        (Self::AMBIGUOUS, "ambiguous"),
    ];

    /// All of `other` are set.
    pub fn contains(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }

    /// Sets `other`.
    pub fn insert(&mut self, other: Self) {
        self.0 |= other.0;
    }

    /// Names of what is set.
    pub fn names(self) -> impl Iterator<Item = &'static str> {
        Self::NAMES.into_iter().filter(move |(flag, _)| self.contains(*flag)).map(|(_, name)| name)
    }
}
