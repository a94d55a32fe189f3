//! The noise of the recordings, learnt anew from what a fit leaves where the motion has no power.

use super::context::FitContext;
use super::noise;
use super::refit::Refit;
use crate::fit::angle_correlation::Across;
use crate::fit::noise::least_noise_rad;
use crate::fit::whitening::{Colour, RecordNoise};
use crate::model::observe::chord_angles_rad;

/// What a fit leaves where the motion has no power, if it differs from the noise by which that fit was judged in anything that counts: all fits that are to be
/// compared must then be judged by it.
pub fn residual_noise(context: &FitContext<'_>, by: &Refit<'_>) -> Option<Vec<RecordNoise>> {
    let settings = &context.settings.noise;
    // what has names must not be judged by a noise that they made, and what has lost step leaves something at every frequency
    let has_lost_step = by.has_lost_step(&context.settings.misfit);
    let is_suspect = !by.hypothesis.effects.is_empty() || has_lost_step;
    let mut all = context.noise_of(by);
    let mut changed = false;
    for (record, known) in all.iter_mut().enumerate() {
        let prediction = by.problem.predict(record, &by.x, false).ok()?;
        let (model, swing, true_s) = by.motion(record)?;
        let data = &context.records[record];
        let ticks = noise::ticks(&data.t_s);
        // the motion's own lines, without what a jump of the stamps would make of them
        let last = data.len() - 1;
        let tick_s = (true_s[last] - true_s[0]) / ticks[last] as f64;
        let chords: Vec<Vec<f64>> = (0..=ticks[last])
            .map(|k| chord_angles_rad(model.chain(), &swing.at(true_s[0] + tick_s * k as f64).theta_rad))
            .collect();
        let mut angles = vec![(vec![0.0; chords.len()], Vec::new()); data.links()];
        for value in &prediction.values {
            let measured_rad = data.theta_rad[value.link][value.row].unwrap_or(value.predicted_rad);
            angles[value.link].0[ticks[value.row]] =
                (measured_rad - value.predicted_rad) / data.relative_sd[value.link][value.row];
        }
        // whether hardly more than noise is left of an angle, where that is found anew
        let mut is_noise = vec![None; data.links()];
        for (link, (left, motion)) in angles.iter_mut().enumerate() {
            motion.extend(chords.iter().map(|chord| chord[link]));
            let (known_rad, known_colour) = (&mut known.sd_rad[link], &mut known.colour[link]);
            let whole = noise::of_all(left);
            let noise = match noise::off_the_lines(left, motion, settings) {
                Some(noise) if is_suspect && noise.sd > settings.grows * *known_rad => continue,
                Some(noise) => noise,
                // a motion with power everywhere, as one with a jump has: what is left at most
                None if whole.sd < *known_rad => whole,
                None => continue,
            };
            // where far more is left its colour is no weight for the rows, nor what it shares with other angles
            let plain = whole.sd <= settings.beyond * noise.sd;
            is_noise[link] = Some(plain);
            let colour = if plain { noise.colour } else { Colour::default() };
            let sd_rad = noise.sd.max(least_noise_rad(context.records, record, link));
            changed |= (sd_rad / *known_rad - 1.0).abs() > settings.changes || colour.differs_from(*known_colour);
            (*known_rad, *known_colour) = (sd_rad, colour);
        }
        let across = Across::of(angles.len(), |i, j| match (is_noise[i], is_noise[j]) {
            (Some(true), Some(true)) => {
                noise::across([i, j].map(|link| (&angles[link].0[..], &angles[link].1[..])), settings)
            }
            (Some(_), Some(_)) => 0.0,
            _ => known.across.between(i, j),
        });
        changed |= across.difference(&known.across) > settings.changes;
        known.across = across;
    }
    changed.then_some(all)
}
