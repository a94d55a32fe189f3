//! Frames with their time stamps.

/// Longest picture side that is measured.
pub const MAX_SIDE_PX: u32 = 16384;
