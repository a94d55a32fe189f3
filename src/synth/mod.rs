//! Synthetic recordings: a swing whose truth is known, seen by a camera.
//!
//! | file | holds |
//! |---|---|
//! | [`swing`] | the model's motion and where the marks are seen |
//! | [`lens`] | radial distortion |
//! | [`paint`] | light, edges, the strip with its marks |
//! | [`backdrop`] | the chamber, the stand, the knob, burnt-in text |
//! | [`sensor`] | light → samples: gamma, chroma siting, noise |
//! | [`recording`] | all of it: frames with stamps and truth, in memory or to a file |
//! | [`truth`] | the truth as a table |
//!
//! Pixels: the origin is the centre of the top left pixel, y runs down.

pub mod backdrop;
pub mod lens;
mod letters;
pub mod paint;
pub mod recording;
pub mod sensor;
pub mod swing;
pub mod truth;

pub use recording::{Recording, SynthFrame};
pub use swing::Swing;
pub use truth::Truth;
