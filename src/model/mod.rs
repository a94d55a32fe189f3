//! What the model says: the chain of rigid links, its effects, and its motion in time.
//!
//! | file | holds |
//! |---|---|
//! | [`chain`] | the links: inertia matrix and static moments |
//! | [`motion`] | one instant of the motion |
//! | [`parameter`] | the numbers a fit may change |
//! | [`effects`] | every further torque, one law each |
//! | [`expression`] | formulas of stated laws, with their derivatives |
//! | [`forward`] | the equations of motion, and their derivatives |
//! | [`shapes`] | the few shapes of a strip of many links |
//! | [`balance`] | the equations along the coordinates that are integrated |
//! | [`collocation`] | the integrator's nodes and weights |
//! | `elimination` | small dense systems |
//! | [`step`] | one step of it |
//! | [`integrate`] | step after step, from reversal to reversal |
//! | [`trajectory`] | the motion at every instant, with its sensitivities |
//! | [`work`] | what integrations have cost |
//! | [`observe`] | the angles between marks |
//! | `rest` | the chain at rest |
//! | [`camera`] | what a camera, or another sensor, makes of them |
//! | [`view`] | of these, a camera that looks askew |
//! | `encoder` | an encoder off its axis |
//! | [`modes`] | small vibrations: frequencies, damping ratios, shapes |
//! | [`strip`] | the strip as a beam in gravity, by finite elements |
//! | [`light`] | the pressure of light |
//! | [`heat`] | what light warms, and how that curls a strip |

pub mod balance;
pub mod camera;
pub mod chain;
pub mod collocation;
pub mod effects;
mod elimination;
mod encoder;
pub mod expression;
pub mod forward;
pub mod integrate;
pub mod modes;
pub mod motion;
pub mod observe;
pub mod parameter;
mod partials;
mod rest;
pub mod heat;
pub mod light;
pub mod shapes;
pub mod step;
pub mod strip;
#[cfg(test)]
mod tests;
pub mod trajectory;
pub mod view;
pub mod work;

pub use camera::Camera;
pub use chain::Chain;
pub use effects::Effect;
pub use encoder::EncoderShape;
pub use expression::Expression;
pub use forward::ForwardModel;
pub use integrate::Accuracy;
pub use motion::{Hinge, Motion};
pub use parameter::{LawCoefficient, LinkProperty, Parameter};
pub use partials::Partials;
pub use trajectory::{State, Trajectory};
pub use work::Work;
