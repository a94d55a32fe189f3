//! Which of several ways to see the marks shows things that swing.
//!
//! Hue and threshold are learnt from single pictures. Where those show more than the marks – books that a
//! swinging lath covers and bares, a wall in a light that changes – no single picture tells which is right. The recording does:
//! marks keep their distances and swing on an arc. So every way is tried on some hundred frames in a row, and what it finds is
//! held against what hangs.

use super::Session;
use crate::detect::{Hue, Trial};
use crate::error::Result;
use crate::progress::Progress;
use crate::track::{hanging, things};

impl Session<'_> {
    /// Settles on a way to look for every hue whose trial showed more than the marks.
    pub(super) fn settle(&mut self, trials: &[Option<Trial>], progress: &dyn Progress) -> Result<()> {
        for (index, trial) in trials.iter().enumerate() {
            let Some(trial) = trial else { continue };
            let mut ways = self.hues.clone();
            for other in self.album.others(trial)? {
                let mut hue = self.hues[index].clone();
                hue.adopt(&other, self.album.sample_px2());
                ways.push(hue);
            }
            if ways.len() > self.hues.len() {
                let best = self.best_way(index, &ways, progress)?;
                self.hues[index] = ways.swap_remove(best);
            }
        }
        Ok(())
    }

    /// The best way to look for hue `index`, of its own and those that follow the hues; the others as they are.
    fn best_way(&mut self, index: usize, ways: &[Hue], progress: &dyn Progress) -> Result<usize> {
        let things = things(&self.glance(ways, None, progress)?);
        let worth = |way: usize| {
            let belongs =
                |hue: u8| usize::from(hue) == way || usize::from(hue) < self.hues.len() && usize::from(hue) != index;
            hanging::worth(&things, &|thing| belongs(thing.hue), self.slots.len())
        };
        let mut worths: Vec<(f64, usize)> =
            (self.hues.len()..ways.len()).filter_map(|w| Some((worth(w)?, w))).collect();
        worths.sort_by(|a, b| ways[a.1].threshold.total_cmp(&ways[b.1].threshold));
        // its own way where that is as good, or the one that sees most of the marks
        worths.splice(0..0, worth(index).map(|worth| (worth, index)));
        let most = worths.iter().map(|(worth, _)| *worth).fold(f64::NEG_INFINITY, f64::max);
        let as_good = worths.iter().find(|(worth, _)| *worth > most - hanging::CHANCE);
        Ok(as_good.map_or(index, |(_, way)| *way))
    }
}
