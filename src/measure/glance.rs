//! A quick look at a stretch of a recording: some hundred frames in a row, to see what moves before all is measured.

use std::ops::ControlFlow;

use rayon::iter::{IntoParallelRefIterator, ParallelIterator};

use super::Session;
use super::view::{View, frame_blobs};
use crate::detect::{Detector, Hue};
use crate::error::{Error, Result};
use crate::progress::Progress;
use crate::track::FrameBlobs;
use crate::video::{Frame, OwnedPicture, Recording};

/// Frames of a stretch: eight seconds at 30 a second, a few turns of anything that a camera sees swing.
const MOST_FRAMES: usize = 240;
/// Frames that are closer than this tell nothing more about a swing, s.
const LEAST_STEP_S: f64 = 0.008;
/// Pictures held at a time, for each core.
const HELD_PICTURES: usize = 6;

/// A frame that is kept until it is looked at.
struct Held {
    picture: OwnedPicture,
    t_s: f64,
    key: bool,
    damaged: bool,
}

impl Session<'_> {
    /// Rough places of everything of these hues in some hundred frames from `from_s` on, or from the first.
    ///
    /// # Errors
    /// As [`super::measure`].
    pub fn glance(&self, hues: &[Hue], from_s: Option<f64>, progress: &dyn Progress) -> Result<Vec<FrameBlobs>> {
        progress.begin("looking", Some(MOST_FRAMES as u64));
        let detector = Detector::new(hues.to_vec());
        let view = View { glance: true, ..View::of(&self.stream, self.options, &self.area, self.background.as_ref()) };
        let (mut held, mut frames) = (Vec::new(), Vec::new());
        let mut outcome = Ok(());
        let mut last_s = f64::NEG_INFINITY;
        let most_held = HELD_PICTURES * self.options.workers;
        self.recording.stretch(from_s, self.options.workers, &mut |frame: &Frame<'_>| {
            let [begin_s, end_s] = view.span_s;
            if frame.t_s > end_s {
                return ControlFlow::Break(());
            }
            if frame.t_s < begin_s || frame.t_s - last_s < LEAST_STEP_S {
                return ControlFlow::Continue(());
            }
            last_s = frame.t_s;
            held.push(Held {
                picture: frame.picture.to_owned(),
                t_s: frame.t_s,
                key: frame.key,
                damaged: frame.damaged,
            });
            let is_enough = frames.len() + held.len() >= MOST_FRAMES;
            if is_enough || held.len() >= most_held {
                progress.advance(held.len() as u64);
                outcome = look_at(&mut held, &view, &detector, &mut frames);
            }
            if progress.is_cancelled() {
                outcome = Err(Error::Interrupted);
            }
            if is_enough || outcome.is_err() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        })?;
        outcome?;
        look_at(&mut held, &view, &detector, &mut frames)?;
        Ok(frames)
    }

    /// From when to when, as stamps of the file, the recording is looked at, as far as that is known beforehand.
    pub fn span_s(&self, first_s: f64) -> Option<[f64; 2]> {
        let rig = &self.options.rig;
        let length_s = match &self.recording {
            Recording::Container(container) => container.stated_duration_s(),
            Recording::Stills(stills) => stills.stamps_s().last().map(|last| last - stills.stamps_s()[0]),
        };
        let end_s = length_s.map(|length| first_s + length).or(rig.until_s)?;
        Some([first_s, end_s.min(rig.span_s()[1])])
    }
}

/// Looks at the pictures that are held, side by side.
fn look_at(held: &mut Vec<Held>, view: &View<'_>, detector: &Detector, frames: &mut Vec<FrameBlobs>) -> Result<()> {
    let look = |held: &Held| {
        let Held { t_s, key, damaged, .. } = *held;
        view.look(detector, &Frame { picture: held.picture.view(), t_s, key, damaged })
    };
    let seen = held.par_iter().map(look).collect::<Result<Vec<_>>>()?;
    frames.extend(seen.into_iter().map(frame_blobs));
    held.clear();
    Ok(())
}
