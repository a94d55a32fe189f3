//! The law that no table holds: sought where the names leave more than noise, fitted in full simulation, proven on what was not fitted.
//!
//! 1. Along the motion of the likeliest fit, which follows the recordings, every term of the [`grammar`](super::grammar) is a torque, and the linearised motion
//!    says what it adds to the angles. With everything else that is free projected out, its fall of χ² is that of Rao's score test.
//! 2. The same with a name taken away, or all of them: what it explains is then the term's to explain, which may be the law that the name stands for.
//! 3. The terms, and pairs of them, that promise most are fitted, as laws of the file would be: first a few steps of all, then the best to the end.
//! 4. The description length chooses among them; with v the variance that the best one leaves, over the noise's, of n values of which τ go together,
//!
//! ```text
//! L = χ²/(2vτ) + ½ k ln(n/τ)        k: coefficients
//! P(name | something remains) = Σ exp(−L) of the fits with it / Σ exp(−L) of all
//! ```
//!
//! A term that has the shape of a name's law, and nearly its torque along the motion, is that law: dry friction that reverses smoothly is dry friction.
//! 5. Of the shortest the one stands that leaves least of what was not fitted, or nearly so, if that is clearly less than the names do.
//!
//! | file | holds |
//! |---|---|
//! | `sought` | 1 and 2: what promises most |
//! | `described` | 3 and 4: what is fitted, and how long its description is |
//! | `proven` | 5: the law that stands |

mod described;
mod proven;
mod sought;

use super::context::FitContext;
use super::effect::Effect;
use super::heldout::HeldOut;
use super::posterior::Posterior;
use described::{descriptions, needed};
use proven::best_proven;

pub use proven::Learnt;

/// How probable each name of the likeliest fit is where any law may stand in its place; nothing where that was not asked.
pub type Needed = Vec<(Effect, f64)>;

/// Learns what the likeliest fit leaves, where that is more than noise. A strip's fits are too dear for it.
pub fn beside<'a>(
    context: &FitContext<'a>,
    posterior: &Posterior<'a>,
    proof: Option<&HeldOut>,
    from_s: Option<f64>,
) -> (Needed, Option<Learnt<'a>>) {
    let is_worth = posterior.remains > context.settings.verdict.even && !context.is_strip();
    let order = if is_worth { descriptions(context, posterior.best()) } else { None };
    let Some(order) = order else { return (Needed::new(), None) };
    let needed = needed(&order, posterior.best(), context.settings.law.the_same_law);
    (needed, proof.and_then(|proof| best_proven(context, &order, proof, from_s)))
}
