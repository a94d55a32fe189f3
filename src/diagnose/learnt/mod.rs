//! A law that is not in the table: sought in a grammar of formulas where the known effects leave more than noise, and validated on what was held out.
//!
//! 1. Along the motion of the likeliest fit, which follows the recordings, every term of the [`grammar`](super::grammar) is a torque, and the linearised motion
//!    says what it adds to the angles. With everything else that is free projected out, its fall of χ² is that of Rao's score test.
//! 2. The same with a name taken away, or all of them: what it explains is then the term's to explain, which may be the law that the name stands for.
//!    A term that exerts nearly the torque of a name begins in its place, whatever it promises: friction that fades with speed follows the motion of dry friction,
//!    and is far from it in no step that is linear.
//! 3. The terms, and pairs of them, that promise most are fitted, as laws of the file would be: first a few steps of all, then a few more of the better half, and so
//!    on. Where none of them leaves only noise, so are those that act in a part of the swing, and those that [short stretches](super::stretches) of the recordings ask for:
//!    where the likeliest fit is wrong, its motion shows nothing.
//! 4. The description length chooses among them, and among all that the table has been fitted with; with v the variance that the best one leaves, over the noise's,
//!    of n values of which τ go together,
//!
//! ```text
//! L = χ²/(2vτ) + ½ k ln(n/τ) + Σ ln N − ln p     k: coefficients, two for the instant of a jump; N: out of how many effects, or terms, each was chosen
//!                                                p: odds of a term, that something outside the table is at work
//! ```
//!    A term that exerts the torque of an effect of the table is that effect. One that goes with a rate and gives energy is no law of what hangs and is let go.
//! 5. The shortest are fitted to a part, and predict the rest. With what they predict in the length,
//!
//! ```text
//! P(effect) = Σ exp(−L) of the descriptions with it / Σ exp(−L) of all
//! ```
//!
//! A term that has the shape of an effect's law, and nearly its torque along the motion, is that law: dry friction that reverses smoothly is dry friction.
//! The shortest is the law, if it leaves clearly less of what was not fitted than the names do, or where these leave only noise there, if it is far shorter than any
//! description without a law.
//!
//! | file | holds |
//! |---|---|
//! | `term_screening` | 1 and 2: what promises most |
//! | `substitutes` | 2: what exerts nearly the torque of a name |
//! | `term_fitting` | 3: what is fitted, within a budget |
//! | `description_length` | 4: how long each description is |
//! | `term_torques` | which effects a term stands for, and whether it gives energy |
//! | `validation` | 5: what they predict, and the law that stands |

mod description_length;
mod substitutes;
mod term_fitting;
mod term_screening;
mod term_torques;
mod validation;

use super::context::FitContext;
use super::effect::Effect;
use super::heldout::HeldOut;
use super::posterior::{Needed, Posterior};
use description_length::{Description, descriptions, needed};
use validation::{foretold, proven};

pub use validation::Learnt;

/// Learns what the likeliest fit leaves, where that is more than noise, where one of its names often stands for something else, or where it takes so many names that one
/// law may do as well; the effects are those that may be at work. A strip's fits are too dear for it.
pub fn beside<'a>(
    context: &FitContext<'a>,
    posterior: &Posterior<'a>,
    effects: &[Effect],
    proof: Option<&HeldOut>,
    from_s: Option<f64>,
) -> (Vec<Needed>, Option<Learnt<'a>>) {
    let settings = context.settings;
    let many = posterior.best().hypothesis.effects.len() > settings.search.main_effects;
    let remains = posterior.remains > settings.verdict.even || posterior.may_be_imitation(settings) || many;
    let is_worth = remains && !context.is_strip();
    let found = if is_worth { descriptions(context, posterior, effects) } else { None };
    let Some((order, along)) = found else { return (Vec::new(), None) };
    let needed = |order: &[Description<'_>]| needed(context, order, posterior, effects, &along);
    let Some(proof) = proof else { return (needed(&order), None) };
    let without_law = order.iter().filter(|own| own.terms.is_empty()).map(|own| own.length);
    let long = without_law.reduce(f64::min);
    let foretold = foretold(context, order, (posterior.best(), proof), from_s);
    let noise_rad = posterior.best().noise_rad(proof.record);
    let learnt = proven(context, &foretold, (proof, &noise_rad), long, &along);
    let order: Vec<Description<'a>> = foretold.into_iter().map(|own| own.0).collect();
    // where no motion could be integrated, that says nothing of any effect
    let needed = if order.is_empty() { Vec::new() } else { needed(&order) };
    (needed, learnt)
}
