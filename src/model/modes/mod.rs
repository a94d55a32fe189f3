//! Small free vibrations: natural frequencies, damping ratios, mode shapes.
//!
//! | file | of |
//! |---|---|
//! | [`linear`] | the chain near its rest position: M, C, K |
//! | [`poles`] | the eigenvalues of M, C, K: modes that swing, poles that only decay |
//! | [`rods`] | two rods in closed form (paper Eq. 33, 34), corrected and as printed |
//! | [`hanging`] | the hung strip without stiffness, and without flexibility |
//! | [`beam`] | the hung strip as a beam, hinged or clamped |
//! | [`survey`] | all of them for one experiment |

pub mod beam;
pub mod hanging;
pub mod linear;
pub mod poles;
pub mod rods;
pub mod survey;

pub use beam::beam_frequencies_hz;
pub use hanging::{limp_frequency_hz, rigid_frequency_hz};
pub use linear::Linearised;
pub use poles::{Component, Mode, Modes, Overdamped};
pub use rods::{RodMode, TwoRods};
pub use survey::Survey;
