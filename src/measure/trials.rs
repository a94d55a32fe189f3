//! Which of several ways to see the marks shows things that swing.
//!
//! Hue and threshold are learnt from single pictures. Where those show more than the marks – books that a
//! swinging lath covers and bares, a wall in a light that changes – no single picture tells which is right. The recording does:
//! marks keep their distances and swing on an arc. So every way is tried on some hundred frames in a row, and what it finds is
//! held against what hangs.

use super::{Session, survey};
use crate::detect::{Hue, Trial};
use crate::error::Result;
use crate::progress::Progress;
use crate::track::chain_detection::{self, Chain};
use crate::track::{MarkSlot, things};

/// One way to look for a hue, and what hangs together of what it sees.
struct Way {
    hue: Hue,
    chain: Option<Chain>,
}

impl Session<'_> {
    /// Settles on a way to look for every hue whose trial showed more than the marks, or for `all`, and on the number of marks
    /// where nobody said it.
    pub(super) fn settle(&mut self, trials: &[Option<Trial>], all: bool, progress: &dyn Progress) -> Result<()> {
        // how many there are, where that is known
        let wanted = (!self.options.count_marks).then_some(self.slots.len());
        for (index, trial) in trials.iter().enumerate() {
            let Some(trial) = trial else { continue };
            if all || wanted.is_none() || trial.is_crowded() {
                let ways = self.ways(index, trial, progress)?;
                let lacking = |chain: &Chain| wanted.map_or(0, |wanted| chain.marks.len().abs_diff(wanted));
                let best = best(ways, |chain| chain.worth - lacking(chain) as f64);
                let Some(Way { hue, chain: Some(chain) }) = best else {
                    if wanted.is_none() {
                        self.count(1);
                    }
                    continue;
                };
                self.hues[index] = hue;
                if wanted.is_none() {
                    // a pivot that is known is no mark
                    let hinge = usize::from(chain.hinge_marked && self.options.rig.pivot_px.is_some());
                    self.count(chain.marks.len() - hinge);
                }
            }
        }
        Ok(())
    }

    /// Settles on the ways anew where those of the trials showed no marks. Whether any is another now.
    pub(super) fn seek_otherwise(&mut self, progress: &dyn Progress) -> Result<bool> {
        if self.options.threshold.is_some() {
            return Ok(false);
        }
        let before = self.hues.clone();
        let trials = self.album.calibrate(&mut self.hues, None)?;
        self.settle(&trials, true, progress)?;
        self.pictures = survey::pictures(&self.recording, &self.options.rig)?.0;
        self.survey_light()?;
        Ok(self.hues.iter().zip(&before).any(|(now, before)| now.is_sought_otherwise(before)))
    }

    /// The way of a hue's trial, and others, above ever higher thresholds; the other hues as they are.
    fn ways(&self, index: usize, trial: &Trial, progress: &dyn Progress) -> Result<Vec<Way>> {
        let known = self.hues.len();
        // a threshold that was given stays
        let mut others = if self.options.threshold.is_none() { self.album.others(trial)? } else { Vec::new() };
        others.sort_by(|a, b| a.threshold.total_cmp(&b.threshold));
        let mut hues = self.hues.clone();
        for other in &others {
            let mut hue = self.hues[index].clone();
            hue.adopt(other, self.album.sample_px2());
            hues.push(hue);
        }
        let things = things(&self.glance(&hues, None, progress)?);
        let way = |way: usize| {
            let belongs = |hue: usize| hue == way || hue < known && hue != index;
            let chain = chain_detection::of_hues(&things, &|thing| belongs(usize::from(thing.hue)));
            Way { hue: hues[way].clone(), chain }
        };
        Ok([index].into_iter().chain(known..hues.len()).map(way).collect())
    }

    /// As many marks as hang together; one where nothing does, for more is not known.
    fn count(&mut self, marks: usize) {
        self.hues[0].marks = marks;
        self.slots.resize(marks, MarkSlot { hue: 0 });
    }
}

/// The first of those that are as good as the best: its own, or the one that sees most of the marks.
fn best(ways: Vec<Way>, worth: impl Fn(&Chain) -> f64) -> Option<Way> {
    let worth = |way: &Way| way.chain.as_ref().map(&worth);
    let most = ways.iter().filter_map(worth).fold(f64::NEG_INFINITY, f64::max);
    ways.into_iter().find(|way| worth(way).is_some_and(|worth| worth > most - chain_detection::CHANCE))
}
