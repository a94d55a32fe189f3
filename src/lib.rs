//! freeswing measures vibration from video, and holds it against a model.
//!
//! Data flows down this list, and so do the modules below; an import points up.
//!
//! | stage | module | in → out |
//! |---|---|---|
//! | decode | [`video`] | file → frames with their own time stamps |
//! | steady | [`steady`] | frame → how the camera moved, from what stands still |
//! | detect | [`detect`] | frame → blobs, centroids to a small fraction of a pixel |
//! | track | [`track`] | blobs → one track a mark |
//! | calibrate | [`calibrate`] | pixels, y down → metres, y up |
//! | angles | [`angles`] | tracks → θ₁, θ₂ with standard deviations |
//! | look | [`look`] | a recording of which nothing is known → marks, pivot, links |
//! | series | [`series`] | angles.csv → the same as numbers, checked |
//! | overlay | [`overlay`] | recording, tracks and angles → a video that shows them |
//! | model | [`model`] | specimen and effects → the motion at every instant, with its derivatives |
//! | identify | [`identify`] | angles → frequencies, damping and their intervals, without the motion |
//! | fit | [`fit`] | angles and model → parameters, residuals, verdict |
//! | diagnose | [`diagnose`] | angles and model → what the model lacks, how probable, and the proof |
//! | paper | [`paper`] | the published numbers → the published tables, recomputed |
//! | report | [`report`] | what a run left in a folder → one page, figures |
//! | export | [`export`] | angles.csv → the file of another program |
//! | batch | [`batch`] | a folder of recordings → a folder of results, and their summary |
//! | synth | [`synth`] | exact swings, rendered recordings with known truth |

pub mod error;
pub mod experiment;
mod input;
pub mod output;
pub mod progress;
mod digits;
mod digest;
mod statistics;
mod hand_hold;

pub mod video;
pub mod steady;
pub mod area;
pub mod detect;
pub mod track;
pub mod calibrate;
pub mod angles;
pub mod measure;
mod rejected;
mod caution;
pub mod sidecar;
pub mod look;
pub mod overlay;
pub mod series;
pub mod model;
pub mod identify;
pub mod fit;
pub mod diagnose;
pub mod force;
pub mod paper;
pub mod report;
pub mod laser;
pub mod synth;
pub mod export;
pub mod batch;
#[doc(hidden)]
pub mod cli;

pub use error::{Error, Result};
