//! How a mark's levels differ around its edge.
//!
//! A ball that is lit from one side is brighter there, so that its edge fades into the background from another level on one
//! side than on the other. With one level for all of it, its centre is pulled towards the light, by luma and by the colour
//! differences differently. The first harmonic of the levels just inside the edge,
//!
//! ```text
//! F(φ) = F₀ + a cos φ + b sin φ
//! ```
//!
//! is all that differs between opposite sides, and so all that pulls a centre.

use nalgebra::{Matrix3, Vector3};

use super::super::component::HueAxis;
use super::Silhouette;
use super::outline::{Outline, RING_PX};
use super::patch::{CHANNELS, Patch, Sample};
use super::zones::Zones;
use crate::video::Picture;

/// a and b of luma and both colour differences, 8-bit codes.
pub type Shading = [[f32; 2]; CHANNELS];

/// Parts of the edge, most of which must show their levels, with so many pixels: the others may lie in a highlight, of which there is one.
const PARTS: usize = 8;
const FEWEST_PARTS: usize = 6;
const FEWEST_PIXELS: usize = 3;
/// Distance from where the mark begins to fade: chroma interpolation reaches as far.
const MARGIN_PX: f32 = 1.0;
/// Steps of the fit.
const STEPS: usize = 12;
/// Residual below which a pixel counts in full, codes: noise.
const LEAST_RESIDUAL: f32 = 1.0;

/// Reads the levels just inside the edge where they have the mark's colour, beyond `threshold`, so that no highlight counts. `None` where it has too few such
/// pixels: a mark that is small, or swept by its motion.
pub fn of(picture: &Picture<'_>, axis: HueAxis, threshold: i16, silhouette: &Silhouette) -> Option<Shading> {
    let outline = Outline::of(picture, axis, silhouette);
    let patch = Patch::read(picture, &outline);
    let zones = Zones::of(&patch, &outline);
    let code = |level: f32| (level + 128.0).round() as u8;
    let has_colour = |s: &Sample| axis.is_luma() || axis.of(code(s.levels[1]), code(s.levels[2])) > threshold;
    let is_near_edge = |sample: &&Sample| {
        let inside_px = -sample.depth_px(&outline) - outline.bands_px[usize::from(sample.sector)] - MARGIN_PX;
        (0.0..RING_PX).contains(&inside_px) && has_colour(sample)
    };
    let pixels: Vec<&Sample> = zones.core.into_iter().filter(is_near_edge).collect();
    let mut counts = [0; PARTS];
    pixels.iter().for_each(|sample| counts[usize::from(sample.sector) * PARTS / outline.count()] += 1);
    if counts.iter().filter(|count| **count >= FEWEST_PIXELS).count() < FEWEST_PARTS {
        return None;
    }
    let mut shading = Shading::default();
    for (channel, harmonic) in shading.iter_mut().enumerate() {
        *harmonic = first_harmonic(&pixels, channel)?;
    }
    Some(shading)
}

/// That of one channel, by least absolute residuals: what shines or is printed on a smaller part of the edge does not count.
fn first_harmonic(pixels: &[&Sample], channel: usize) -> Option<[f32; 2]> {
    let row = |s: &Sample| Vector3::new(1.0, s.dx_px / s.distance_px, s.dy_px / s.distance_px);
    let mut weights = vec![1.0; pixels.len()];
    let mut solution = Vector3::zeros();
    for _ in 0..STEPS {
        let (mut normal, mut right) = (Matrix3::<f32>::zeros(), Vector3::<f32>::zeros());
        for (sample, weight) in pixels.iter().zip(&weights) {
            let row = row(sample);
            normal += *weight * row * row.transpose();
            right += *weight * sample.levels[channel] * row;
        }
        solution = normal.cholesky()?.solve(&right);
        for (sample, weight) in pixels.iter().zip(&mut weights) {
            *weight = 1.0 / (sample.levels[channel] - row(sample).dot(&solution)).abs().max(LEAST_RESIDUAL);
        }
    }
    Some([solution[1], solution[2]])
}
