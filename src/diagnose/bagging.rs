//! The bagged posterior of sets of effects, where something remains beside them.
//!
//! Where no model is right, the plain evidence picks one with certainty and another on the next recording. The bagged posterior (BayesBag; Huggins and Miller,
//! Bayesian Analysis 18 (2023) 79) is the mean of the posteriors of recordings put together from blocks of this one, drawn with replacement:
//!
//! ```text
//! P(S) = mean over draws of  w_S exp(−½ Σ_b n_b Q_Sb / v) / Σ_S' …        Q_Sb: Σr² of block b, n_b: how often it is drawn
//! ```
//! with v the variance that the best fit leaves, over the noise's, and w_S the prior times the part of the coefficients' room that is used. Blocks are longer
//! than what remains goes together.

use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};

use super::evidence::normalised;
use super::refit::Refit;

/// Recordings put together (cost).
const DRAWS: usize = 200;
/// Blocks of a recording, at least (judgement) and at most (cost).
const BLOCKS: [usize; 2] = [12, 200];
/// Fits that leave this many times what the best one does are in no draw (cost).
const FAR: f64 = 20.0;

/// The bagged posterior of some fits, 0 of those that are far from the best; `ln_weight` is what each has beside its χ². `scatter` is v, and how many
/// values go together.
pub fn bagged_posterior(fits: &[Refit<'_>], ln_weight: &[f64], scatter: (f64, f64)) -> Vec<f64> {
    let mut probability = vec![0.0; fits.len()];
    let possible = |i: &usize| ln_weight[*i].is_finite();
    let least = (0..fits.len()).filter(possible).map(|i| fits[i].chi2).fold(f64::INFINITY, f64::min);
    let near: Vec<usize> = (0..fits.len()).filter(possible).filter(|i| fits[*i].chi2 < FAR * least).collect();
    let left: Vec<Option<Vec<f64>>> = near.iter().map(|i| fits[*i].left()).collect();
    let Some(values) = left.iter().flatten().map(Vec::len).min().filter(|n| *n > 0) else { return probability };
    let (variance, together) = scatter;
    let blocks = ((values as f64 / (2.0 * together)) as usize).clamp(BLOCKS[0], BLOCKS[1]).min(values);
    let of_blocks = |left: &Option<Vec<f64>>| -> Vec<f64> {
        let Some(left) = left else { return vec![f64::INFINITY; blocks] };
        let border = |b: usize| b * values / blocks;
        (0..blocks).map(|b| left[border(b)..border(b + 1)].iter().map(|r| r * r).sum::<f64>() / variance).collect()
    };
    let squares: Vec<Vec<f64>> = left.iter().map(of_blocks).collect();
    let mut random = StdRng::seed_from_u64(1);
    for _ in 0..DRAWS {
        let drawn: Vec<usize> = (0..blocks).map(|_| random.random_range(0..blocks)).collect();
        let ln = |(fit, squares): (&usize, &Vec<f64>)| {
            ln_weight[*fit] - 0.5 * drawn.iter().map(|b| squares[*b]).sum::<f64>()
        };
        let ln: Vec<f64> = near.iter().zip(&squares).map(ln).collect();
        for (fit, share) in near.iter().zip(normalised(&ln)) {
            probability[*fit] += share / DRAWS as f64;
        }
    }
    probability
}
