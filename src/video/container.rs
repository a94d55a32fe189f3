//! The container: which stream, in which orientation, and its packets one after the other.

use std::io::Read as _;
use std::path::{Path, PathBuf};

use ffmpeg_the_third as ffmpeg;

use ffmpeg::codec::{Id, Parameters};
use ffmpeg::{Packet, Rational, media};

use super::orientation::Orientation;
use crate::error::{Error, Result};

/// What the container says of its video stream.
#[derive(Debug, Clone)]
pub struct StreamInfo {
    /// Index of the stream in the file.
    pub stream: usize,
    /// Streams of all kinds in the file.
    pub streams: usize,
    /// Video streams beside the measured one, cover pictures apart.
    pub other_videos: usize,
    /// Short name of the container format.
    pub container: String,
    /// Name of the codec.
    pub codec: String,
    /// Stored picture size.
    pub stored_size_px: (usize, usize),
    /// How the stored picture is turned for display.
    pub orientation: Orientation,
    /// Width of a displayed pixel over its height.
    pub pixel_aspect: f64,
    /// Frames per second that the file states, if any.
    pub nominal_rate_hz: Option<f64>,
    /// Seconds in one tick of the time stamps.
    pub tick_s: f64,
    /// Places by which a frame may be shown after others that were decoded before it.
    pub delay_frames: usize,
    /// Frames that the file states, if any; for progress only.
    pub stated_frames: Option<u64>,
}

/// An opened container, positioned at its first packet.
pub struct Container {
    path: PathBuf,
    input: ffmpeg::format::context::Input,
    /// What it says of its video stream.
    pub info: StreamInfo,
    /// Parameters from which decoders are made.
    pub parameters: Parameters,
    /// Which codec.
    pub codec: Id,
    /// Time base of the stream.
    pub time_base: Rational,
    /// Length of the size field before each NAL unit, or `None` for start codes.
    pub nal_length_bytes: Option<usize>,
}

impl Container {
    /// Opens a file and picks its main video stream.
    ///
    /// # Errors
    /// [`Error::Unreadable`], [`Error::EmptyFile`], [`Error::NotAVideo`], [`Error::NoVideoStream`],
    /// [`Error::NoDecoder`] and [`Error::PictureSize`].
    pub fn open(path: &Path) -> Result<Self> {
        super::initialise();
        check_file(path)?;
        // the prefix keeps names with a colon from being taken for a network protocol
        let mut url = std::ffi::OsString::from("file:");
        url.push(path);
        let input = ffmpeg::format::input(&url).map_err(|e| not_a_video(path, &e))?;
        let stream = main_video(&input)
            .ok_or_else(|| Error::NoVideoStream { path: path.to_owned(), found: describe_streams(&input) })?;
        let parameters = owned_parameters(&stream).map_err(|e| not_a_video(path, &e))?;
        let codec = parameters.id();
        if ffmpeg::decoder::find(codec).is_none() {
            return Err(Error::NoDecoder { path: path.to_owned(), stream: stream.index(), codec: codec.name().into() });
        }
        let (width, height) = (parameters.width(), parameters.height());
        if !(16..=super::MAX_SIDE_PX).contains(&width) || !(16..=super::MAX_SIDE_PX).contains(&height) {
            return Err(Error::PictureSize { path: path.to_owned(), width, height });
        }
        let time_base = stream.time_base();
        let info = StreamInfo {
            stream: stream.index(),
            streams: input.nb_streams() as usize,
            other_videos: other_videos(&input, stream.index()),
            container: input.format().name().to_owned(),
            codec: codec.name().to_owned(),
            stored_size_px: (width as usize, height as usize),
            orientation: display_orientation(&stream),
            pixel_aspect: pixel_aspect(&stream, &parameters, display_orientation(&stream)),
            nominal_rate_hz: ratio(stream.avg_frame_rate()).or_else(|| ratio(stream.rate())),
            tick_s: f64::from(time_base),
            delay_frames: delay_frames(&parameters),
            stated_frames: stated_frames(&input, &stream),
        };
        let nal_length_bytes = nal_length(&parameters, codec);
        Ok(Self { path: path.to_owned(), info, parameters, codec, time_base, nal_length_bytes, input })
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The next packet of the video stream; `Ok(None)` at the end, and a read error where the file is damaged.
    pub fn next_packet(&mut self) -> std::result::Result<Option<Packet>, ffmpeg::Error> {
        loop {
            let mut packet = Packet::empty();
            match packet.read(&mut self.input) {
                Ok(()) if packet.stream() == self.info.stream => return Ok(Some(packet)),
                Ok(()) => {}
                Err(ffmpeg::Error::Eof) => return Ok(None),
                Err(error) => return Err(error),
            }
        }
    }

    /// Goes to the key frame at or before `t_s` from the start of the recording.
    pub fn seek(&mut self, t_s: f64) -> std::result::Result<(), ffmpeg::Error> {
        let target = (t_s * 1e6) as i64;
        self.input.seek(target, ..target + 1)
    }

    /// Length the container states.
    pub fn stated_duration_s(&self) -> Option<f64> {
        let micros = self.input.duration();
        (micros > 0).then_some(micros as f64 * 1e-6)
    }
}

/// A file that can be read, with something in it. A pipe is none: it is read twice.
fn check_file(path: &Path) -> Result<()> {
    let failed = |e| Error::unreadable(path, e);
    let kind = std::fs::metadata(path).map_err(failed)?;
    if !kind.is_file() {
        let detail = if kind.is_dir() { "it is a folder" } else { "it is a pipe or a device" }.to_owned();
        return Err(Error::NotAVideo { path: path.to_owned(), detail });
    }
    let mut file = std::fs::File::open(path).map_err(failed)?;
    if kind.len() == 0 {
        return Err(Error::EmptyFile { path: path.to_owned() });
    }
    let mut head = [0; 256];
    let read = file.read(&mut head).map_err(failed)?;
    if is_table(&head[..read]) {
        let detail = "it is a table of text; `freeswing identify`, `fit` and `diagnose` read those".to_owned();
        return Err(Error::NotAVideo { path: path.to_owned(), detail });
    }
    Ok(())
}

/// Whether a file begins with lines of names or numbers separated by commas, semicolons or tabs.
fn is_table(head: &[u8]) -> bool {
    let is_text = |b: &u8| b.is_ascii_graphic() || matches!(b, b' ' | b'\t' | b'\r' | b'\n') || !b.is_ascii();
    let line = head.split(|b| *b == b'\n').next().unwrap_or_default();
    let separators = line.iter().filter(|b| matches!(b, b',' | b';' | b'\t')).count();
    // FFmpeg reads a list of files, which begins with a word and no separator, as a video
    head.iter().all(is_text) && line.len() < head.len() && separators > 0
}

fn not_a_video(path: &Path, error: &ffmpeg::Error) -> Error {
    let detail = match error {
        ffmpeg::Error::InvalidData => {
            "no container or codec is recognised in it, or it was cut off before its index was written".to_owned()
        }
        other => other.to_string(),
    };
    Error::NotAVideo { path: path.to_owned(), detail }
}

fn owned_parameters(stream: &ffmpeg::Stream<'_>) -> std::result::Result<Parameters, ffmpeg::Error> {
    let mut owned = Parameters::new();
    // SAFETY: both pointers are valid for the call, which makes a deep copy.
    let status = unsafe { ffmpeg::ffi::avcodec_parameters_copy(owned.as_mut_ptr(), stream.parameters().as_ptr()) };
    if status < 0 { Err(status.into()) } else { Ok(owned) }
}

fn describe_streams(input: &ffmpeg::format::context::Input) -> String {
    let kinds: Vec<String> = input.streams().map(|s| format!("{:?}", s.parameters().medium()).to_lowercase()).collect();
    if kinds.is_empty() { "no stream at all".to_owned() } else { format!("only {}", kinds.join(", ")) }
}

/// The video stream with the largest picture, the first of several; cover pictures do not count.
fn main_video(input: &ffmpeg::format::context::Input) -> Option<ffmpeg::Stream<'_>> {
    let picture = ffmpeg::format::stream::Disposition::ATTACHED_PIC;
    let area = |s: &ffmpeg::Stream<'_>| u64::from(s.parameters().width()) * u64::from(s.parameters().height());
    input
        .streams()
        .filter(|s| s.parameters().medium() == media::Type::Video && !s.disposition().contains(picture))
        .max_by_key(|s| (area(s), std::cmp::Reverse(s.index())))
}

fn other_videos(input: &ffmpeg::format::context::Input, chosen: usize) -> usize {
    let picture = ffmpeg::format::stream::Disposition::ATTACHED_PIC;
    let is_other = |s: &ffmpeg::Stream<'_>| {
        s.index() != chosen && s.parameters().medium() == media::Type::Video && !s.disposition().contains(picture)
    };
    input.streams().filter(is_other).count()
}

fn display_orientation(stream: &ffmpeg::Stream<'_>) -> Orientation {
    stream
        .side_data()
        .find(|d| d.kind() == ffmpeg::codec::packet::side_data::Type::DisplayMatrix)
        .and_then(|d| Orientation::from_display_matrix(d.data()))
        .unwrap_or_default()
}

fn pixel_aspect(stream: &ffmpeg::Stream<'_>, parameters: &Parameters, orientation: Orientation) -> f64 {
    let stored = ratio(stream.sample_aspect_ratio()).or_else(|| ratio(parameters.sample_aspect_ratio())).unwrap_or(1.0);
    if orientation.swaps_axes() { 1.0 / stored } else { stored }
}

fn ratio(r: Rational) -> Option<f64> {
    (r.numerator() > 0 && r.denominator() > 0).then(|| f64::from(r))
}

fn stated_frames(input: &ffmpeg::format::context::Input, stream: &ffmpeg::Stream<'_>) -> Option<u64> {
    let stated = u64::try_from(stream.frames()).ok().filter(|n| *n > 0);
    stated.or_else(|| {
        let seconds = input.duration() as f64 * 1e-6;
        let frames = seconds * ratio(stream.avg_frame_rate())?;
        (1.0..1e9).contains(&frames).then_some(frames as u64)
    })
}

/// The codec's reordering depth.
fn delay_frames(parameters: &Parameters) -> usize {
    // SAFETY: the parameters are valid while borrowed; this is a plain field.
    usize::try_from(unsafe { (*parameters.as_ptr()).video_delay }).unwrap_or(0)
}

/// From `avcC` and `hvcC` records: how NAL units are delimited.
fn nal_length(parameters: &Parameters, codec: Id) -> Option<usize> {
    // SAFETY: extradata points at extradata_size bytes or is null.
    let extradata = unsafe {
        let p = &*parameters.as_ptr();
        let size = usize::try_from(p.extradata_size).unwrap_or(0);
        if p.extradata.is_null() || size == 0 { &[][..] } else { std::slice::from_raw_parts(p.extradata, size) }
    };
    let at = match codec {
        Id::H264 => 4,
        Id::HEVC => 21,
        _ => return None,
    };
    (extradata.first() == Some(&1)).then(|| extradata.get(at).map(|b| usize::from(b & 3) + 1)).flatten()
}
