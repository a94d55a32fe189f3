//! Frames with their time stamps: a container is split at key frames and decoded on all cores, in order;
//! a folder of stills is read likewise.

mod container;
mod decode;
mod encode;
mod frame;
mod orientation;
mod picture;
mod recording;
mod segments;
mod still_times;
mod stills;
mod timing;

pub use container::{Container, StreamInfo};
pub use decode::{Decoded, DecoderRecipe, StreamDecoder, decode_in_order, decode_one_by_one};
pub use encode::{TICKS_PER_SECOND, VideoWriter};
pub use frame::Frame;
pub use orientation::Orientation;
pub use picture::{Layout, Matrix, OwnedPicture, Picture, Plane};
pub use recording::Recording;
pub use still_times::StillTimes;
pub use stills::{Stills, stills_in};
pub use timing::{Gap, Timing};

/// Longest picture side that is measured.
pub const MAX_SIDE_PX: u32 = 16384;
