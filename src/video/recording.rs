//! What is measured: a container, or a folder of stills.

use std::ops::ControlFlow;
use std::path::Path;

use super::container::{Container, StreamInfo};
use super::decode::{self, Decoded, DecoderRecipe, StreamDecoder};
use super::frame::Frame;
use super::still_times::StillTimes;
use super::stills::Stills;
use crate::error::{Error, Result};

/// A span of time from the beginning of a recording to its end.
pub const WHOLE_S: [f64; 2] = [f64::NEG_INFINITY, f64::INFINITY];

/// A recording, opened.
pub enum Recording {
    /// One file.
    Container(Box<Container>),
    /// A folder.
    Stills(Box<Stills>),
}

/// Frames decoded after a seek to get one whole picture.
const SAMPLE_FRAMES: usize = 2;
/// Frames from one sample to the next where a seek leads back to where the last one did: a recording with few key
/// frames is still seen at different times.
const FRAMES_BETWEEN: usize = 8;

impl Recording {
    /// Opens a file, or a folder of stills with their times.
    ///
    /// # Errors
    /// As [`Container::open`] and [`Stills::open`]; [`Error::Option`] for times given to a file, which has its own.
    pub fn open(path: &Path, times: &StillTimes) -> Result<Self> {
        if path.is_dir() {
            return Stills::open(path, times).map(|s| Self::Stills(Box::new(s)));
        }
        let option = match times {
            StillTimes::Beside => return Container::open(path).map(|c| Self::Container(Box::new(c))),
            StillTimes::File(_) => "--times",
            StillTimes::Rate(_) => "--rate",
        };
        let message = format!(
            "is for a folder of stills, and {} carries its own time stamps; leave it out, or say --true-rate for slow motion",
            path.display()
        );
        Err(Error::Option { option: option.to_owned(), message })
    }

    /// The file or folder.
    pub fn path(&self) -> &Path {
        match self {
            Self::Container(container) => container.path(),
            Self::Stills(stills) => stills.path(),
        }
    }

    /// Its stream.
    pub fn info(&self) -> &StreamInfo {
        match self {
            Self::Container(container) => &container.info,
            Self::Stills(stills) => &stills.info,
        }
    }

    /// Every frame once, on all cores, in order; see [`decode::decode_in_order`].
    ///
    /// # Errors
    /// As there.
    pub fn decode_in_order<T: Send>(
        &mut self,
        workers: usize,
        measure: &(dyn Fn(Frame<'_>) -> T + Sync),
        sink: &mut dyn FnMut(T) -> Result<()>,
    ) -> Result<Decoded> {
        match self {
            Self::Container(container) => decode::decode_in_order(container, workers, measure, sink),
            Self::Stills(stills) => stills.decode_in_order(workers, measure, sink),
        }
    }

    /// Every frame once, in order, a few at a time; see [`decode::decode_one_by_one`].
    ///
    /// # Errors
    /// As there.
    pub fn decode_one_by_one<T: Send>(
        &mut self,
        threads: usize,
        measure: &(dyn Fn(Frame<'_>) -> T + Sync),
        sink: &mut dyn FnMut(T) -> Result<()>,
    ) -> Result<Decoded> {
        match self {
            Self::Container(container) => decode::decode_one_by_one(container, threads, measure, sink),
            Self::Stills(stills) => stills.decode_in_order(threads, measure, sink),
        }
    }

    /// Shows `count` pictures at even distances between two time stamps; where seeking fails, fewer of them.
    ///
    /// # Errors
    /// As [`Container::open`]; [`Error::NotAVideo`] where no decoder can be opened.
    pub fn sample(&self, count: usize, span_s: [f64; 2], see: &mut dyn FnMut(&Frame<'_>)) -> Result<()> {
        match self {
            Self::Container(container) => sample_container(container.path(), count, span_s, see),
            Self::Stills(stills) => {
                let within = |i: &usize| (span_s[0]..=span_s[1]).contains(&stills.stamps_s()[*i]);
                let shown: Vec<usize> = (0..stills.files().len()).filter(within).collect();
                let mut places: Vec<usize> = (0..count).map(|i| i * shown.len() / count).collect();
                places.dedup();
                places.into_iter().filter_map(|place| shown.get(place)).for_each(|i| stills.show(*i, see));
                Ok(())
            }
        }
    }

    /// Shows every frame from `from_s` on, in order, until `see` breaks off; from the first one where there is no time.
    ///
    /// # Errors
    /// As [`Recording::sample`].
    pub fn stretch(
        &self,
        from_s: Option<f64>,
        threads: usize,
        see: &mut dyn FnMut(&Frame<'_>) -> ControlFlow<()>,
    ) -> Result<()> {
        match self {
            Self::Container(container) => stretch_of_container(container.path(), from_s, threads, see),
            Self::Stills(stills) => {
                let late_enough = |t_s: &f64| from_s.is_none_or(|from_s| *t_s >= from_s);
                let mut flow = ControlFlow::Continue(());
                for index in (0..stills.files().len()).filter(|i| late_enough(&stills.stamps_s()[*i])) {
                    stills.show(index, &mut |frame| flow = see(frame));
                    if flow.is_break() {
                        break;
                    }
                }
                Ok(())
            }
        }
    }

    /// Shows the frame with this very time stamp; says whether there is one.
    ///
    /// # Errors
    /// As [`Recording::sample`].
    pub fn show(&self, t_s: f64, see: &mut dyn FnMut(&Frame<'_>)) -> Result<bool> {
        match self {
            Self::Container(container) => {
                // a seek may land behind a frame that is shown early: then everything is decoded
                Ok(show_container(container.path(), t_s, true, see)?
                    || show_container(container.path(), t_s, false, see)?)
            }
            Self::Stills(stills) => {
                let index = stills.stamps_s().iter().position(|t| *t == t_s);
                index.into_iter().for_each(|i| stills.show(i, see));
                Ok(index.is_some())
            }
        }
    }
}

/// A container at its first packet, with a decoder of its stream.
fn opened(path: &Path, threads: usize) -> Result<(Container, StreamDecoder)> {
    let container = Container::open(path)?;
    let decoder = DecoderRecipe::new(&container).decoder(threads).map_err(|e| decode::cannot_open(&container, &e))?;
    Ok((container, decoder))
}

fn sample_container(
    path: &Path,
    count: usize,
    [from_s, until_s]: [f64; 2],
    see: &mut dyn FnMut(&Frame<'_>),
) -> Result<()> {
    let (mut container, mut decoder) = opened(path, 1)?;
    let begin_s = from_s.max(0.0);
    let duration_s = container.stated_duration_s().unwrap_or(0.0).min(until_s) - begin_s;
    let mut last_s = f64::NEG_INFINITY;
    // the packet that the decoder began with, and how many it has had
    let (mut began, mut sent) = (None, 0);
    for sample in 0..count {
        let at_s = begin_s + duration_s * sample as f64 / count as f64;
        let sought = at_s <= 0.0 || container.seek(at_s).is_ok();
        // where there is nothing to seek by, what comes first is all that is seen
        if sample > 0 && !(sought && duration_s > 0.0) {
            break;
        }
        let mut next = || container.next_packet().ok().flatten();
        let Some(first) = next() else { continue };
        let place = Some((first.pts(), first.dts(), first.position(), first.size()));
        // a seek that leads back to where the last one did: the decoder goes on from where it stands
        let goes_on = began == place;
        let mut waiting = Some(first).filter(|_| !goes_on);
        if goes_on {
            (1..sent).for_each(|_| drop(next()));
        } else {
            decoder.begin_anew();
            (began, sent) = (place, 0);
        }
        let (mut later, mut repeated) = (0, goes_on && last_s > 0.0);
        let mut packets = || {
            let packet = waiting.take().or_else(&mut next);
            sent += usize::from(packet.is_some());
            packet
        };
        let _ = decoder.go_on(&mut packets, &mut |frame| {
            later += usize::from(frame.t_s > last_s);
            repeated |= last_s > 0.0 && later == 0;
            if frame.t_s < from_s {
                return ControlFlow::Continue(());
            }
            if frame.t_s > until_s {
                return ControlFlow::Break(());
            }
            if later < if repeated { FRAMES_BETWEEN } else { SAMPLE_FRAMES } {
                return ControlFlow::Continue(());
            }
            last_s = frame.t_s;
            see(&frame);
            ControlFlow::Break(())
        });
    }
    Ok(())
}

fn stretch_of_container(
    path: &Path,
    from_s: Option<f64>,
    threads: usize,
    see: &mut dyn FnMut(&Frame<'_>) -> ControlFlow<()>,
) -> Result<()> {
    let (mut container, mut decoder) = opened(path, threads)?;
    // a file that cannot be sought in is decoded up to there
    let sought = from_s.is_none_or(|from_s| container.seek(from_s).is_ok());
    if !sought {
        container = Container::open(path)?;
    }
    let _ = decoder.decode(&mut || container.next_packet().ok().flatten(), &mut |frame| {
        if from_s.is_some_and(|from_s| frame.t_s < from_s) {
            return ControlFlow::Continue(());
        }
        see(&frame)
    });
    Ok(())
}

fn show_container(path: &Path, t_s: f64, seek: bool, see: &mut dyn FnMut(&Frame<'_>)) -> Result<bool> {
    let (mut container, mut decoder) = opened(path, 1)?;
    if seek && container.seek(t_s).is_err() {
        return Ok(false);
    }
    let mut shown = false;
    let _ = decoder.decode(&mut || container.next_packet().ok().flatten(), &mut |frame| {
        if frame.t_s == t_s {
            see(&frame);
            shown = true;
        }
        let passed = seek && frame.t_s > t_s;
        if shown || passed { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    Ok(shown)
}
