//! Frames with their time stamps.

pub mod picture;

pub use picture::{Layout, Matrix, OwnedPicture, Picture, Plane};

/// Longest picture side that is measured.
pub const MAX_SIDE_PX: u32 = 16384;
