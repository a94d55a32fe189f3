//! The last third of the lamp's cycles, predicted by what was fitted before.

use serde::Serialize;

use super::filter::Noise;
use super::fit::{Bench, Fit, Member, columns_of};
use super::forms::Setting;
use super::grid::Grid;

/// Root mean squares over what was not fitted, swings averaged out over their period.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Heldout {
    /// Fitted before.
    pub from_s: f64,
    /// Push alone.
    pub baseline_rmse_m: f64,
    /// With the effects of the likeliest candidate.
    pub augmented_rmse_m: f64,
}

/// What is named predicts worse by this factor: no chance of a few cycles.
const WORSE: f64 = 1.5;

impl Heldout {
    /// Whether what is named predicts clearly worse than the push alone.
    pub fn is_against(&self) -> bool {
        self.augmented_rmse_m > WORSE * self.baseline_rmse_m
    }
}

/// The proof, where there are at least two cycles.
pub fn heldout(bench: &Bench<'_>, fit: &Fit) -> Option<Heldout> {
    let Setting { grid, lamp, swings, lasts_s } = bench.with;
    let cycles = lamp.cycles();
    if cycles < 2 {
        return None;
    }
    let kept = (cycles - cycles.div_ceil(3)).max(1);
    // a second before the lamp goes on again
    let border = grid.cell(*lamp.edges_s.get(2 * kept)? - 1.0);
    let first = Grid { y_m: grid.y_m[..border].to_vec(), count: grid.count[..border].to_vec(), ..grid.clone() };
    let noise: &Noise = bench.noise;
    let early = Bench::of(Setting { grid: &first, lamp, swings, lasts_s }, noise);
    let rmse = |members: Vec<Member>| -> Option<f64> {
        let own = early.fit(members)?;
        let mut columns = bench.base.clone();
        columns.extend(columns_of(&own.members, &bench.with));
        let mut left = grid.y_m.clone();
        for (column, amplitude) in columns.iter().zip(&own.amplitude) {
            left.iter_mut().zip(column).for_each(|(l, c)| *l -= amplitude * c);
        }
        let level = early.stage(own.walk_m2_s).filter.level(&left[..border]).last().copied()?;
        let calm = bench.with.smoothed(&left);
        let squares: f64 = calm[border..].iter().map(|v| (v - level).powi(2)).sum();
        Some((squares / (grid.len() - border).max(1) as f64).sqrt())
    };
    Some(Heldout {
        from_s: grid.time_s(border),
        baseline_rmse_m: rmse(Vec::new())?,
        augmented_rmse_m: rmse(fit.members.clone())?,
    })
}
