//! Frames with their time stamps: a container is split at key frames and decoded on all cores, in order;
//! a folder of stills is read likewise.

pub mod codecs;
mod container;
mod damage;
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
pub use damage::{DamageSpread, Outcome};
pub use decode::{Decoded, DecoderRecipe, StreamDecoder, decode_in_order, decode_one_by_one};
pub use encode::{TICKS_PER_SECOND, VideoWriter};
pub use frame::Frame;
pub use orientation::Orientation;
pub use picture::{Layout, Matrix, OwnedPicture, Picture, Plane};
pub use recording::{Recording, WHOLE_S};
pub use still_times::StillTimes;
pub use stills::{Stills, stills_in};
pub use timing::{Gap, Timing};

/// Longest picture side that is measured.
pub const MAX_SIDE_PX: u32 = 16384;

/// Registers FFmpeg and keeps its own messages off the terminal: every failure is reported once, by [`Error`](crate::Error).
fn initialise() {
    static ONCE: std::sync::Once = std::sync::Once::new();
    ONCE.call_once(|| {
        let _ = ffmpeg_the_third::init();
        ffmpeg_the_third::log::set_level(ffmpeg_the_third::log::Level::Quiet);
    });
}
