//! Damage spreads: a frame predicted from a damaged one is as wrong, and the decoder does not say so.
//!
//! ```text
//! shown     I  B  B  P  B  B  P  P  P  I
//! reported           ×
//! spoilt       ×  ×  ×  ×  ×  ×  ×  ×
//! ```
//! All later frames up to the next key frame may refer to it, and so may those few shown before it that the codec
//! decodes after it.

use std::collections::VecDeque;

/// What came of one frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome<T> {
    /// The frame refers to no other.
    pub key: bool,
    /// The decoder reported damage, or the damage has spread to it.
    pub damaged: bool,
    /// What was made of it.
    pub value: T,
}

/// Frames held back until it is known whether damage reaches them.
#[derive(Debug)]
pub struct DamageSpread<T> {
    delay: usize,
    waiting: VecDeque<Outcome<T>>,
    spoilt: bool,
}

impl<T> DamageSpread<T> {
    /// For a codec that shows frames up to `delay` places after others decoded before them.
    pub fn new(delay: usize) -> Self {
        Self { delay, waiting: VecDeque::new(), spoilt: false }
    }

    /// Takes the next frame shown and gives back the one that nothing can reach any more.
    pub fn push(&mut self, mut frame: Outcome<T>) -> Option<Outcome<T>> {
        if frame.damaged {
            self.waiting.iter_mut().rev().take_while(|earlier| !earlier.key).for_each(|earlier| earlier.damaged = true);
        }
        self.spoilt = frame.damaged || (self.spoilt && !frame.key);
        frame.damaged = self.spoilt;
        self.waiting.push_back(frame);
        if self.waiting.len() > self.delay { self.waiting.pop_front() } else { None }
    }

    /// The frames still held back.
    pub fn finish(self) -> impl Iterator<Item = Outcome<T>> {
        self.waiting.into_iter()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Frames as letters: `I` key, `×` damaged, `i` both, `.` neither; spoilt ones come back as `×`.
    fn spread(delay: usize, shown: &str) -> String {
        let mut spread = DamageSpread::new(delay);
        let frame = |c| Outcome { key: c == 'I' || c == 'i', damaged: c == '×' || c == 'i', value: c };
        let mut out: Vec<Outcome<char>> = shown.chars().filter_map(|c| spread.push(frame(c))).collect();
        out.extend(spread.finish());
        out.iter().map(|f| if f.damaged { '×' } else { f.value }).collect()
    }

    #[test]
    fn damage_lasts_until_the_next_key_frame() {
        assert_eq!(spread(0, "I..×...I..×.I"), "I..××××I..××I");
        assert_eq!(spread(0, "I...I..."), "I...I...");
    }

    #[test]
    fn a_damaged_key_frame_heals_nothing() {
        assert_eq!(spread(0, "I.×.i..I."), "I.×××××I.");
    }

    #[test]
    fn frames_shown_before_the_damaged_one_may_refer_to_it() {
        assert_eq!(spread(2, "I...×..I"), "I.×××××I");
        assert_eq!(spread(2, "..I×"), "..I×");
    }
}
