//! Frames with their time stamps.

pub mod encode;
pub mod picture;

pub use encode::VideoWriter;
pub use picture::{Layout, Matrix, OwnedPicture, Picture, Plane};

/// Longest picture side that is measured.
pub const MAX_SIDE_PX: u32 = 16384;
