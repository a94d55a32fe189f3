//! Who is who: marks of one colour are told apart by the chain.
//!
//! While a mark is unseen, what is believed of its place spreads until the sightings of its neighbours fit as well.
//! When it is seen again it is *in doubt*, and so are marks that met. Every frame asks under which names the marks
//! seen fit the [`Chain`] best. When one answer has been clearly best for a few frames in a row, the marks are
//! named by it from the beginning of their doubt. A doubt that nothing resolves is flagged in every frame.

use std::ops::Range;

use super::chain::Chain;

/// How much better the best names must fit than the next, squared standard deviations.
const CLEAR_MISFIT: f64 = 10.0;
/// Frames in a row that must say the same.
const FRAMES_AGREED: u32 = 5;
/// Most answers that are tried in a frame (cost): as many as seven names have orders.
const MOST_ANSWERS: usize = 5040;

/// Sightings that belong to another mark.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Renaming {
    /// The mark they were taken for.
    pub from: usize,
    /// The mark they are.
    pub to: usize,
    /// The first frame of them.
    pub since: usize,
}

/// One mark's name.
#[derive(Debug, Clone, Copy, Default)]
struct Name {
    hue: u8,
    /// The frame since which what bears it may be another mark.
    doubted_since: Option<usize>,
    /// The last frame in which something bore it.
    last_assigned: Option<usize>,
    /// The last frame in which what bore it was that mark without doubt.
    certain: Option<usize>,
}

/// The names of all marks.
#[derive(Debug, Clone)]
pub struct Identity {
    chain: Chain,
    names: Vec<Name>,
    /// The best answer of the last frames and how many gave it.
    agreed: (Vec<usize>, u32),
    /// Frames of marks whose doubt nothing resolved.
    unresolved: Vec<(usize, Range<usize>)>,
    frames: usize,
}

impl Identity {
    /// For marks of these hues, top to bottom.
    pub fn new(hues: &[u8], pivot_px: Option<[f64; 2]>) -> Self {
        let names = hues.iter().map(|hue| Name { hue: *hue, ..Name::default() }).collect();
        let chain = Chain::new(hues.len(), pivot_px);
        Self { chain, names, agreed: (Vec::new(), 0), unresolved: Vec::new(), frames: 0 }
    }

    /// Learns what is usual from a frame in which every mark seen is known to be that mark.
    pub fn learn(&mut self, seen_px: &[Option<[f64; 2]>]) {
        self.chain.learn(seen_px);
    }

    /// From `frame` on the mark may be another. What it was doubted for before stays unresolved.
    pub fn doubt(&mut self, mark: usize, frame: usize) {
        let earlier = self.names[mark].doubted_since.replace(frame);
        self.unresolved.extend(earlier.map(|since| (mark, since..frame)));
        self.agreed.1 = 0;
    }

    /// Takes where the marks were seen in `frame`; gives the names that have become clear and differ.
    pub fn see(&mut self, frame: usize, seen_px: &[Option<[f64; 2]>]) -> Vec<Renaming> {
        self.frames = frame + 1;
        self.share_doubt(frame, seen_px);
        let in_doubt: Vec<usize> = (0..self.names.len()).filter(|m| self.names[*m].doubted_since.is_some()).collect();
        for (name, _) in self.names.iter_mut().zip(seen_px).filter(|(_, at)| at.is_some()) {
            name.last_assigned = Some(frame);
            if name.doubted_since.is_none() {
                name.certain = Some(frame);
            }
        }
        if in_doubt.is_empty() {
            self.chain.learn(seen_px);
        }
        if in_doubt.iter().all(|mark| seen_px[*mark].is_none()) {
            return Vec::new();
        }
        match self.clear_answer(seen_px, &in_doubt) {
            Some(answer) => self.settle(frame, seen_px, &in_doubt, &answer),
            None => Vec::new(),
        }
    }

    /// A mark that comes back while its name, or that of another one of its hue, is in doubt may be any of them.
    fn share_doubt(&mut self, frame: usize, seen_px: &[Option<[f64; 2]>]) {
        for mark in (0..seen_px.len()).filter(|m| seen_px[*m].is_some()) {
            let Name { hue, last_assigned, .. } = self.names[mark];
            let is_back = last_assigned.is_some_and(|last| last + 1 < frame);
            if is_back && self.names.iter().any(|name| name.hue == hue && name.doubted_since.is_some()) {
                self.doubt(mark, frame);
            }
        }
    }

    /// Ends the recording: for each mark, frames in which it may be another.
    pub fn finish(self) -> Vec<(usize, Range<usize>)> {
        let open = self.names.iter().enumerate().filter_map(|(m, name)| Some((m, name.doubted_since?..self.frames)));
        let mut unresolved = self.unresolved;
        unresolved.extend(open);
        unresolved
    }

    /// The names of the marks in doubt, once they are clear.
    fn clear_answer(&mut self, seen_px: &[Option<[f64; 2]>], in_doubt: &[usize]) -> Option<Vec<usize>> {
        let choices: Vec<Vec<usize>> = in_doubt.iter().map(|mark| self.names_for(*mark)).collect();
        let mut best: (f64, Vec<usize>) = (f64::INFINITY, Vec::new());
        let mut next = f64::INFINITY;
        let mut left = MOST_ANSWERS;
        let tried_all = for_each_answer(&choices, &mut Vec::new(), &mut |answer| {
            left = left.checked_sub(1)?;
            let misfit = self.chain.misfit(&renamed(seen_px, in_doubt, answer));
            if misfit < best.0 {
                next = std::mem::replace(&mut best, (misfit, answer.to_vec())).0;
            } else {
                next = next.min(misfit);
            }
            Some(())
        });
        tried_all?;
        let (misfit, answer) = best;
        if next == f64::INFINITY {
            // no other name is left: who is seen is known by elimination
            return Some(answer);
        }
        let named_px = renamed(seen_px, in_doubt, &answer);
        let fits = |name: &usize| named_px[*name].is_none() || self.chain.fits(&named_px, *name);
        if next - misfit < CLEAR_MISFIT || !answer.iter().all(fits) {
            self.agreed.1 = 0;
            return None;
        }
        let frames = if self.agreed.0 == answer { self.agreed.1 + 1 } else { 1 };
        self.agreed = (answer, frames);
        (frames >= FRAMES_AGREED).then(|| self.agreed.0.clone())
    }

    /// The names that a mark in doubt may have: its own, and those of its colour that no other bore for certain since.
    fn names_for(&self, mark: usize) -> Vec<usize> {
        let Name { hue, doubted_since, .. } = self.names[mark];
        let free = |name: &Name| name.hue == hue && name.certain.is_some() && name.certain < doubted_since;
        (0..self.names.len()).filter(|other| *other == mark || free(&self.names[*other])).collect()
    }

    fn settle(
        &mut self,
        frame: usize,
        seen_px: &[Option<[f64; 2]>],
        in_doubt: &[usize],
        answer: &[usize],
    ) -> Vec<Renaming> {
        self.agreed.1 = 0;
        let mut renamings = Vec::new();
        for (&from, &to) in in_doubt.iter().zip(answer) {
            let Some(since) = self.names[from].doubted_since.take() else { continue };
            if from != to {
                renamings.push(Renaming { from, to, since });
            }
            if seen_px[from].is_none() {
                // out of sight it had no say in the answer
                self.unresolved.push((to, since..frame));
            }
        }
        for name in answer {
            (self.names[*name].last_assigned, self.names[*name].certain) = (Some(frame), Some(frame));
        }
        renamings
    }
}

/// The marks seen, the in_doubt ones under other names.
fn renamed(seen_px: &[Option<[f64; 2]>], in_doubt: &[usize], answer: &[usize]) -> Vec<Option<[f64; 2]>> {
    let mut renamed = seen_px.to_vec();
    in_doubt.iter().for_each(|mark| renamed[*mark] = None);
    in_doubt.iter().zip(answer).for_each(|(mark, name)| renamed[*name] = seen_px[*mark]);
    renamed
}

/// Visits every way to take one name from each choice, none twice, until a visit gives nothing.
fn for_each_answer(
    choices: &[Vec<usize>],
    answer: &mut Vec<usize>,
    visit: &mut dyn FnMut(&[usize]) -> Option<()>,
) -> Option<()> {
    let Some(names) = choices.get(answer.len()) else { return visit(answer) };
    for name in names {
        if !answer.contains(name) {
            answer.push(*name);
            for_each_answer(choices, answer, visit)?;
            answer.pop();
        }
    }
    Some(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn marks_that_were_never_certain_do_not_hide_how_many_answers_there_are() {
        let mut identity = Identity::new(&[0; 18], None);
        let seen_px: Vec<Option<[f64; 2]>> = (0..18).map(|k| Some([40.0 * f64::from(k), 10.0])).collect();
        (0..9).for_each(|mark| identity.doubt(mark, 0));
        (0..10).for_each(|frame| drop(identity.see(frame, &seen_px)));
        (9..18).for_each(|mark| identity.doubt(mark, 10));
        // of nine marks nine names: 362 880 answers
        assert!((10..60).all(|frame| identity.see(frame, &seen_px).is_empty()));
    }

    #[test]
    fn what_no_one_could_try_in_every_order_is_left_in_doubt() {
        // seven marks of each of two colours, all of which may be any: 5040 answers each, 25 million together
        let mut identity = Identity::new(&[0, 1].repeat(7), None);
        let seen_px: Vec<Option<[f64; 2]>> = (0..14).map(|k| Some([40.0 * f64::from(k), 10.0])).collect();
        (0..10).for_each(|frame| drop(identity.see(frame, &seen_px)));
        (0..14).for_each(|mark| identity.doubt(mark, 10));
        assert!((10..20).all(|frame| identity.see(frame, &seen_px).is_empty()));
        assert_eq!(identity.finish().len(), 14);
    }
}
