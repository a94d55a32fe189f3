//! Packets → frames, in order, on all cores.
//!
//! ```text
//! reader ──segments──▶ worker 1 (decoder) ──values──▶ sink, in order
//!                      worker 2 (decoder)
//! ```
//! The caller's `measure` runs in the worker, on the decoder's own samples while they are warm; only what it
//! returns travels on. A recording with one entry point is decoded by one decoder with threads of its own, and so are
//! the last segments, for which there would be cores without work.

use std::collections::{BTreeMap, VecDeque};
use std::ops::ControlFlow;

use crossbeam_channel::{Receiver, Sender, bounded};
use ffmpeg_the_third as ffmpeg;

use ffmpeg::codec::{Id, Parameters, threading};
use ffmpeg::{Packet, Rational};

use super::container::Container;
use super::frame::{self, Frame};
use super::segments::{Segment, Segmenter};
use crate::error::{Error, Result};

/// What decoding met.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Decoded {
    /// Packets of the video stream.
    pub packets: u64,
    /// Frames handed on.
    pub frames: u64,
    /// Packets that the decoder refused.
    pub damaged_packets: u64,
    /// Frames of another size than the first, not handed on.
    pub resized_frames: u64,
    /// Frames without a time stamp, not handed on.
    pub unstamped_frames: u64,
    /// Why reading ended early, if it did.
    pub read_error: Option<String>,
    /// Segments decoded alone; 1 where the recording was decoded as a whole.
    pub segments: u64,
    /// A frame's pixel format that is not supported.
    pub unsupported_format: Option<String>,
}

impl Decoded {
    fn absorb(&mut self, other: Decoded) {
        self.frames += other.frames;
        self.damaged_packets += other.damaged_packets;
        self.resized_frames += other.resized_frames;
        self.unstamped_frames += other.unstamped_frames;
        self.unsupported_format = self.unsupported_format.take().or(other.unsupported_format);
    }
}

/// How a decoder is made and its frames are read.
#[derive(Clone)]
pub struct DecoderRecipe {
    parameters: Parameters,
    codec: Id,
    time_base: Rational,
    size_px: (usize, usize),
}

impl DecoderRecipe {
    /// For the video stream of `container`.
    pub fn new(container: &Container) -> Self {
        Self {
            parameters: container.parameters.clone(),
            codec: container.codec,
            time_base: container.time_base,
            size_px: container.info.stored_size_px,
        }
    }

    /// A decoder with `threads` threads.
    pub fn decoder(&self, threads: usize) -> std::result::Result<StreamDecoder, ffmpeg::Error> {
        let mut context = ffmpeg::codec::Context::from_parameters(self.parameters.clone())?;
        let kind = if threads > 1 { threading::Type::Frame } else { threading::Type::None };
        context.set_threading(threading::Config { kind, count: threads, ..Default::default() });
        let mut decoder = context.decoder();
        set_packet_time_base(&mut decoder, self.time_base);
        let (video, frame) = (decoder.video()?, ffmpeg::frame::Video::empty());
        Ok(StreamDecoder { video, frame, recipe: self.clone(), refused: false })
    }
}

fn set_packet_time_base(decoder: &mut ffmpeg::codec::decoder::Decoder, time_base: Rational) {
    // SAFETY: the context is owned by `decoder` and not yet opened.
    unsafe { (*decoder.as_mut_ptr()).pkt_timebase = time_base.into() }
}

/// One decoder and the frame it fills.
pub struct StreamDecoder {
    video: ffmpeg::decoder::Video,
    frame: ffmpeg::frame::Video,
    recipe: DecoderRecipe,
    /// A packet was refused since the last frame.
    refused: bool,
}

impl StreamDecoder {
    /// Sends packets until `packets` ends, drains, and makes the decoder ready for another stretch. `on_frame` may
    /// break off.
    pub fn decode(
        &mut self,
        packets: &mut dyn FnMut() -> Option<Packet>,
        on_frame: &mut dyn FnMut(Frame<'_>) -> ControlFlow<()>,
    ) -> (Decoded, ControlFlow<()>) {
        let decoded = self.go_on(packets, on_frame);
        self.begin_anew();
        decoded
    }

    /// As [`StreamDecoder::decode`], but where `on_frame` breaks off, the next call goes on with the frame after.
    pub fn go_on(
        &mut self,
        packets: &mut dyn FnMut() -> Option<Packet>,
        on_frame: &mut dyn FnMut(Frame<'_>) -> ControlFlow<()>,
    ) -> (Decoded, ControlFlow<()>) {
        let mut decoded = Decoded::default();
        let mut flow = self.receive(&mut decoded, on_frame);
        while flow.is_continue()
            && let Some(packet) = packets()
        {
            if self.video.send_packet(&packet).is_err() {
                self.refuse(&mut decoded);
            }
            flow = self.receive(&mut decoded, on_frame);
        }
        if flow.is_continue() && self.video.send_eof().is_ok() {
            flow = self.receive(&mut decoded, on_frame);
        }
        (decoded, flow)
    }

    /// Forgets every packet, for another stretch.
    pub fn begin_anew(&mut self) {
        self.video.flush();
        self.refused = false;
    }

    fn receive(
        &mut self,
        decoded: &mut Decoded,
        on_frame: &mut dyn FnMut(Frame<'_>) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        loop {
            match self.video.receive_frame(&mut self.frame) {
                Ok(()) => self.hand_on(decoded, on_frame)?,
                Err(ffmpeg::Error::Other { errno }) if errno == libc::EAGAIN => break,
                Err(ffmpeg::Error::Eof) => break,
                // with threads of its own a decoder reports a damaged packet here, frames later
                Err(_) => self.refuse(decoded),
            }
        }
        ControlFlow::Continue(())
    }

    fn refuse(&mut self, decoded: &mut Decoded) {
        decoded.damaged_packets += 1;
        self.refused = true;
    }

    fn hand_on(
        &mut self,
        decoded: &mut Decoded,
        on_frame: &mut dyn FnMut(Frame<'_>) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        if (self.frame.width() as usize, self.frame.height() as usize) != self.recipe.size_px {
            decoded.resized_frames += 1;
            return ControlFlow::Continue(());
        }
        let Some(stamp) = self.frame.timestamp() else {
            decoded.unstamped_frames += 1;
            return ControlFlow::Continue(());
        };
        let Some(samples) = frame::samples(&self.frame, self.recipe.codec) else {
            decoded.unsupported_format = Some(format!("{:?}", self.frame.format()).to_lowercase());
            return ControlFlow::Break(());
        };
        decoded.frames += 1;
        let (numerator, denominator) =
            (f64::from(self.recipe.time_base.numerator()), f64::from(self.recipe.time_base.denominator()));
        on_frame(Frame {
            picture: samples.picture(),
            t_s: stamp as f64 * numerator / denominator,
            key: self.frame.is_key(),
            damaged: std::mem::take(&mut self.refused) || frame::is_damaged(&self.frame),
        })
    }
}

/// Decodes every frame of `container` once, calls `measure` on each (in any worker) and `sink` with each value in
/// order. `sink` may end the work with an error.
///
/// The values and their order do not depend on `workers`.
///
/// # Errors
/// [`Error::NotAVideo`] where no decoder can be opened, [`Error::PixelFormat`], and whatever `sink` returns.
pub fn decode_in_order<T: Send>(
    container: &mut Container,
    workers: usize,
    measure: &(dyn Fn(Frame<'_>) -> T + Sync),
    sink: &mut dyn FnMut(T) -> Result<()>,
) -> Result<Decoded> {
    let recipe = DecoderRecipe::new(container);
    let mut segmenter = Segmenter::new(container);
    let decoded = if segmenter.can_split(container) {
        split(container, &mut segmenter, &recipe, workers.max(1), measure, sink)?
    } else {
        whole(container, &mut segmenter, &recipe, workers.max(1), measure, sink)?
    };
    all_supported(container, decoded)
}

/// As [`decode_in_order`], by one decoder with `threads` threads of its own: a value is handed on before the next
/// frame is decoded, so that values as large as pictures never pile up.
///
/// # Errors
/// As [`decode_in_order`].
pub fn decode_one_by_one<T>(
    container: &mut Container,
    threads: usize,
    measure: &(dyn Fn(Frame<'_>) -> T + Sync),
    sink: &mut dyn FnMut(T) -> Result<()>,
) -> Result<Decoded> {
    let recipe = DecoderRecipe::new(container);
    let mut segmenter = Segmenter::new(container);
    let decoded = whole(container, &mut segmenter, &recipe, threads.max(1), measure, sink)?;
    all_supported(container, decoded)
}

fn all_supported(container: &Container, decoded: Decoded) -> Result<Decoded> {
    match decoded.unsupported_format {
        Some(format) => Err(Error::PixelFormat { path: container.path().to_owned(), format }),
        None => Ok(decoded),
    }
}

/// A decoder that cannot be opened for a container.
pub(super) fn cannot_open(container: &Container, error: &ffmpeg::Error) -> Error {
    Error::NotAVideo {
        path: container.path().to_owned(),
        detail: format!("the {} decoder cannot be opened: {error}", container.info.codec),
    }
}

/// One decoder with threads of its own.
fn whole<T>(
    container: &mut Container,
    segmenter: &mut Segmenter,
    recipe: &DecoderRecipe,
    threads: usize,
    measure: &(dyn Fn(Frame<'_>) -> T + Sync),
    sink: &mut dyn FnMut(T) -> Result<()>,
) -> Result<Decoded> {
    let mut decoder = recipe.decoder(threads).map_err(|e| cannot_open(container, &e))?;
    let mut outcome = Ok(());
    let (mut decoded, _) = decoder.decode(&mut || segmenter.next_packet(container), &mut |frame| {
        outcome = sink(measure(frame));
        if outcome.is_ok() { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
    });
    outcome?;
    decoded.segments = 1;
    decoded.packets = segmenter.packets;
    decoded.read_error = segmenter.read_error.take();
    Ok(decoded)
}

/// A segment's place in the order, and what came of it.
struct Done<T> {
    index: u64,
    values: Vec<T>,
    decoded: Decoded,
}

/// One decoder a worker, one segment at a time.
fn split<T: Send>(
    container: &mut Container,
    segmenter: &mut Segmenter,
    recipe: &DecoderRecipe,
    workers: usize,
    measure: &(dyn Fn(Frame<'_>) -> T + Sync),
    sink: &mut dyn FnMut(T) -> Result<()>,
) -> Result<Decoded> {
    let decoders = (0..workers)
        .map(|_| recipe.decoder(1))
        .collect::<std::result::Result<Vec<_>, _>>()
        .map_err(|e| cannot_open(container, &e))?;
    std::thread::scope(|scope| {
        let (todo, work) = bounded::<Task>(1);
        let (done, finished) = bounded::<Done<T>>(workers);
        // a segment starts only against a permit, and its permit returns when its values have reached the sink
        let permits = 2 * workers;
        let (give, take) = bounded::<()>(permits);
        for _ in 0..permits {
            let _ = give.send(());
        }
        let segmenter = &mut *segmenter;
        let container = &mut *container;
        let reader = scope.spawn(move || {
            let mut sent = 0;
            let mut ahead = VecDeque::new();
            while take.recv().is_ok() {
                while ahead.len() <= workers
                    && let Some(segment) = segmenter.next(container)
                {
                    ahead.push_back(segment);
                }
                let is_late = ahead.len() <= workers;
                let Some(segment) = ahead.pop_front() else { break };
                if todo.send(Task { index: sent, segment, is_late }).is_err() {
                    break;
                }
                sent += 1;
            }
            drop(todo);
            sent
        });
        for decoder in decoders {
            let (work, done) = (work.clone(), done.clone());
            scope.spawn(move || decode_segments(decoder, workers, &work, &done, measure));
        }
        drop((work, done));
        let mut order = InOrder { next: 0, early: BTreeMap::new(), total: Decoded::default() };
        while let Ok(result) = finished.recv() {
            order.early.insert(result.index, result);
            while let Some(values) = order.pop() {
                let _ = give.send(());
                values.into_iter().try_for_each(&mut *sink)?;
            }
        }
        drop(give);
        order.total.segments = reader.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
        Ok(order.total)
    })
    .map(|mut total| {
        total.packets = segmenter.packets;
        total.read_error = segmenter.read_error.take();
        total
    })
}

/// A segment, its place in the order, and whether cores will soon be without work.
struct Task {
    index: u64,
    segment: Segment,
    is_late: bool,
}

fn decode_segments<T>(
    mut decoder: StreamDecoder,
    threads: usize,
    work: &Receiver<Task>,
    done: &Sender<Done<T>>,
    measure: &(dyn Fn(Frame<'_>) -> T + Sync),
) {
    while let Ok(Task { index, segment, is_late }) = work.recv() {
        let is_intact = segment.packets.iter().all(|packet| !packet.is_corrupt());
        let late = if is_late && is_intact && threads > 1 { decoder.recipe.decoder(threads).ok() } else { None };
        // with threads of its own a decoder reports damage some frames later, or not at all: then it is decoded again alone
        let packets = segment.packets.len();
        let is_whole = |(values, decoded, damaged): &(Vec<T>, Decoded, bool)| {
            values.len() == packets && decoded.damaged_packets == 0 && !damaged
        };
        let quickly =
            late.map(|mut quick| decode_segment(&mut quick, segment.packets.clone(), measure)).filter(is_whole);
        let (values, decoded, _) = quickly.unwrap_or_else(|| decode_segment(&mut decoder, segment.packets, measure));
        if done.send(Done { index, values, decoded }).is_err() {
            break;
        }
    }
}

/// The values of a segment's frames, what decoding met, and whether a frame is damaged.
fn decode_segment<T>(
    decoder: &mut StreamDecoder,
    mut packets: VecDeque<Packet>,
    measure: &(dyn Fn(Frame<'_>) -> T + Sync),
) -> (Vec<T>, Decoded, bool) {
    let mut values = Vec::with_capacity(packets.len());
    let mut damaged = false;
    let (decoded, _) = decoder.decode(&mut || packets.pop_front(), &mut |frame| {
        damaged |= frame.damaged;
        values.push(measure(frame));
        ControlFlow::Continue(())
    });
    (values, decoded, damaged)
}

/// Puts results back in order.
struct InOrder<T> {
    next: u64,
    early: BTreeMap<u64, Done<T>>,
    total: Decoded,
}

impl<T> InOrder<T> {
    /// The values of the next segment, if it is done.
    fn pop(&mut self) -> Option<Vec<T>> {
        let result = self.early.remove(&self.next)?;
        self.next += 1;
        self.total.absorb(result.decoded);
        Some(result.values)
    }
}
