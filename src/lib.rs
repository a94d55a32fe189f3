//! freeswing measures vibration from video.
//!
//! | stage | module | in → out |
//! |---|---|---|
//! | decode | [`video`] | file → frames with their own time stamps |
//! | detect | `detect` | frame → blobs, centroids to a small fraction of a pixel |
//! | track | `track` | blobs → one track a mark |
//! | calibrate | `calibrate` | pixels, y down → metres, y up |
//! | angles | `angles` | tracks → θ₁, θ₂ with standard deviations |
//! | series | [`series`] | angles.csv → the same as numbers, checked |
//! | overlay | `overlay` | recording, tracks and angles → a video that shows them |
//! | identify | [`identify`] | angles → frequencies, damping and their intervals, without a model |
//! | model | `model` | the forward model of the swing |
//! | paper | `paper` | the published tables, recomputed |
//! | synth | `synth` | exact swings, rendered recordings with known truth |

pub mod angles;
pub mod calibrate;
#[doc(hidden)]
pub mod cli;
pub mod detect;
pub mod error;
pub mod experiment;
pub mod fit;
pub mod identify;
pub mod measure;
pub mod model;
pub mod output;
pub mod overlay;
pub mod paper;
pub mod progress;
pub mod series;
pub mod sidecar;
mod statistics;
pub mod synth;
pub mod track;
pub mod video;

pub use error::{Error, Result};
