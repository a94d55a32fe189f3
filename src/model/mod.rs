//! What the model says: the chain of rigid links, its effects, and its motion in time.
//!
//! | file | holds |
//! |---|---|
//! | [`chain`] | the links: inertia matrix and static moments |
//! | [`effects`] | every further torque, one law each |
//! | [`forward`] | the equations of motion |
//! | [`integrate`] | their solution in time |
//! | [`modes`] | small vibrations: frequencies, damping ratios, shapes |
//! | [`strip`] | the strip as a beam in gravity, by finite elements |
//! | [`radiation`] | the pressure of light |

pub mod chain;
pub mod effects;
pub mod forward;
pub mod integrate;
pub mod modes;
pub mod radiation;
pub mod strip;

pub use chain::{Chain, Motion};
pub use effects::Effect;
pub use forward::ForwardModel;
pub use integrate::{State, Trajectory};
