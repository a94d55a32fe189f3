//! freeswing measures vibration from video.
//!
//! | stage | module | in → out |
//! |---|---|---|
//! | decode | [`video`] | file → frames with their own time stamps |
//! | detect | `detect` | frame → blobs, centroids to a small fraction of a pixel |
//! | track | `track` | blobs → one track a mark |
//! | calibrate | `calibrate` | pixels, y down → metres, y up |
//! | angles | `angles` | tracks → θ₁, θ₂ with standard deviations |
//! | overlay | `overlay` | recording, tracks and angles → a video that shows them |
//! | model | `model` | the forward model of the swing |
//! | synth | `synth` | exact swings, rendered recordings with known truth |

pub mod angles;
pub mod calibrate;
#[doc(hidden)]
pub mod cli;
pub mod detect;
pub mod error;
pub mod experiment;
pub mod measure;
pub mod model;
pub mod output;
pub mod overlay;
pub mod progress;
pub mod sidecar;
mod statistics;
pub mod synth;
pub mod track;
pub mod video;

pub use error::{Error, Result};
