//! A displacement record of a hung strip under a lamp → the push of light with its interval, what else the record holds, and the
//! reflectivity that the push means.
//!
//! | file | does |
//! |---|---|
//! | [`record`] | the table → times and displacements, checked |
//! | [`grid`] | samples → means on an even grid |
//! | [`filter`] | noise of known form → innovations |
//! | [`lamp`] | the lamp's edges → the courses that answer them |
//! | [`learn`] | the record → its noise and the strip's swings |
//! | [`edges`] | the record → the lamp's edges |
//! | [`forms`] | the table of effects, as columns |
//! | [`solve`] | columns → amplitudes |
//! | [`fit`] | a candidate → amplitudes, shapes, evidence |
//! | [`search`] | all candidates → how probable each is |
//! | [`adequacy`] | a candidate → whether it leaves only noise |
//! | [`heldout`] | the last cycles, predicted |
//! | [`verdict`] | candidates and tests → what the record holds |
//! | [`reflectivity`] | push → momentum taken from the light |
//! | [`report`] | all of it, for files and people |
//! | [`plot`](mod@plot) | the same as a figure |
//!
//! The model of a record is linear but for a few shapes:
//!
//! ```text
//! y(t) = offset + P u(t) + lamp's swings + Σ effects + noise
//! ```
//!
//! with u the light (0 or 1), P the push, and noise that holds the background swing, whatever keeps it up, white noise, and a wandering
//! level where the sensor drifts. A swing that an edge of the lamp excites has its own amplitude and phase for on and for off: how fast the lamp switches is not
//! known, and the push must not hang on it.

pub mod adequacy;
pub mod analysis;
pub mod edges;
pub mod filter;
pub mod fit;
pub mod forms;
pub mod grid;
pub mod heldout;
pub mod lamp;
pub mod learn;
pub mod numbers;
pub mod plot;
pub mod record;
pub mod reflectivity;
pub mod report;
pub mod search;
pub mod solve;
pub mod verdict;

pub use analysis::{Analysis, analyse};
pub use plot::plot;
pub use record::LaserRecord;
pub use report::Report;
