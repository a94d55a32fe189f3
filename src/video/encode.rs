//! Pictures → a video file, written whole or not at all.

use std::io;
use std::path::{Path, PathBuf};

use ffmpeg::codec::{self, encoder};
use ffmpeg::ffi;
use ffmpeg::format::Pixel;
use ffmpeg::{Dictionary, Rational, color, format, frame};
use ffmpeg_the_third as ffmpeg;
use tempfile::TempPath;

use super::picture::{Layout, Matrix, OwnedPicture};
use crate::error::{Error, Result};
use crate::experiment::{Codec, CodecName, PixelFormat};
use crate::output;

/// The stamps' unit in MP4, MOV and MKV: an exact number of ticks a frame at 24, 25, 30, 50, 60 and 30/1.001 a second, and within
/// MPEG-4's limit of 65535. (MKV rounds to a millisecond.)
pub const TICKS_PER_SECOND: i32 = 60_000;

/// A video file being written.
///
/// Pictures go to a temporary file beside the target, which takes the target's name in [`VideoWriter::finish`]. Dropped before that, it
/// leaves nothing behind.
pub struct VideoWriter {
    target: PathBuf,
    layout: Layout,
    pixel: Pixel,
    encoder: encoder::video::Encoder,
    /// Closed before the temporary file is renamed or removed: fields drop in this order.
    output: format::context::Output,
    temporary: TempPath,
    time_base: Rational,
    frame_ticks: i64,
    last_pts: Option<i64>,
}

impl VideoWriter {
    /// Opens a file for pictures of `layout` at about `fps` a second. The extension chooses the container: `.mp4`, `.mov`, `.mkv`,
    /// `.avi`.
    ///
    /// # Errors
    /// [`Error::Unwritable`] for the folder or the file, [`Error::Encode`] for an unknown extension, or a codec that refuses the options.
    pub fn create(target: &Path, codec: &Codec, layout: Layout, fps: f64) -> Result<Self> {
        super::initialise();
        let refused = |detail: String| Error::Encode { path: target.to_owned(), detail };
        let avi = container(target).map_err(refused)? == Container::Avi;
        let temporary = temporary_beside(target)?;
        let failed = |error: ffmpeg::Error| write_error(target, error);

        let mut output = format::output(&*temporary).map_err(failed)?;
        let time_base = if avi { frame_period(fps) } else { Rational(1, TICKS_PER_SECOND) };
        let name = encoder_name(codec.name);
        let library = encoder::find_by_name(name).ok_or_else(|| refused(format!("FFmpeg was built without {name}")))?;
        let pixel = pixel_of(codec).map_err(refused)?;
        let global_header = output.format().flags().contains(format::Flags::GLOBAL_HEADER);
        let stream = Stream { library, pixel, time_base, rate: frame_period(fps).invert(), global_header };
        let context = stream.configured(codec, &layout).map_err(failed)?;
        let opened = context.open_as_with(library, encoder_options(codec));
        let encoder = opened.map_err(|e| refused(format!("{name} refuses the options: {e}")))?;

        let mut stream = output.add_stream(library).map_err(failed)?;
        stream.set_time_base(time_base);
        stream.copy_parameters_from_context(&encoder);
        stream.set_avg_frame_rate(frame_period(fps).invert());
        set_rotation(&mut stream, codec.rotation_deg).map_err(refused)?;
        // Edit lists count in the movie's own ticks; the default, a millisecond, would round the first stamp.
        let header = match target.extension().and_then(|e| e.to_str()) {
            Some(e) if e.eq_ignore_ascii_case("mkv") || avi => Dictionary::new(),
            _ => ffmpeg::dict!("movie_timescale" => TICKS_PER_SECOND.to_string()),
        };
        output.write_header_with(header).map_err(failed)?;

        let seconds_per_tick = f64::from(time_base.0) / f64::from(time_base.1);
        let frame_ticks = (1.0 / fps / seconds_per_tick).round().max(1.0) as i64;
        let target = target.to_owned();
        Ok(Self { target, layout, pixel, encoder, output, temporary, time_base, frame_ticks, last_pts: None })
    }

    /// The stamp a picture gets that is due at `t_s`: (ticks, their seconds). AVI counts frames, so the stamp is the nearest frame's.
    pub fn stamp(&self, t_s: f64) -> (i64, f64) {
        let seconds_per_tick = f64::from(self.time_base.0) / f64::from(self.time_base.1);
        let ticks = (t_s / seconds_per_tick).round();
        (ticks as i64, ticks * seconds_per_tick)
    }

    /// Encodes one picture with its stamp in ticks; stamps must rise.
    ///
    /// # Errors
    /// [`Error::Encode`] for a stamp that does not rise or a picture of another layout, [`Error::Unwritable`] when the file cannot grow.
    pub fn write(&mut self, picture: &OwnedPicture, pts: i64) -> Result<()> {
        let refused = |detail: String| Err(Error::Encode { path: self.target.clone(), detail });
        if self.last_pts.is_some_and(|last| pts <= last) {
            return refused(format!("time stamp {pts} follows {}; stamps must rise", self.last_pts.unwrap_or(pts)));
        }
        if picture.layout != self.layout {
            return refused("a picture differs in layout from the first; convert it".to_owned());
        }
        self.last_pts = Some(pts);
        let frame = self.frame_of(picture, pts)?;
        let sent = self.encoder.send_frame(&frame);
        sent.map_err(|e| write_error(&self.target, e))?;
        self.drain()
    }

    /// Flushes the encoder, closes the file and gives it its name.
    ///
    /// # Errors
    /// [`Error::Unwritable`] when the disk is full or the target cannot be replaced; then nothing remains.
    pub fn finish(mut self) -> Result<()> {
        let target = self.target.clone();
        self.encoder.send_eof().map_err(|e| write_error(&target, e))?;
        self.drain()?;
        self.output.write_trailer().map_err(|e| write_error(&target, e))?;
        flush(&mut self.output).map_err(|e| write_error(&target, e))?;
        let Self { output, temporary, .. } = self;
        drop(output);
        temporary.persist(&target).map_err(|e| Error::unwritable(&target, e.error))
    }

    fn drain(&mut self) -> Result<()> {
        let mut packet = ffmpeg::Packet::empty();
        loop {
            match self.encoder.receive_packet(&mut packet) {
                Ok(()) => {}
                Err(ffmpeg::Error::Eof) => return Ok(()),
                Err(ffmpeg::Error::Other { errno }) if would_block(errno) => return Ok(()),
                Err(error) => return Err(write_error(&self.target, error)),
            }
            packet.set_stream(0);
            // Without a length the last frame would take no time, and an edit list could cut it.
            packet.set_duration(self.frame_ticks);
            let stream_base = self.output.stream(0).map_or(self.time_base, |s| s.time_base());
            packet.rescale_ts(self.time_base, stream_base);
            packet.write_interleaved(&mut self.output).map_err(|e| write_error(&self.target, e))?;
        }
    }

    /// A fresh frame each time: the encoder keeps references to the ones it was given.
    fn frame_of(&self, picture: &OwnedPicture, pts: i64) -> Result<frame::Video> {
        let mut frame = frame::Video::new(self.pixel, self.layout.width_px as u32, self.layout.height_px as u32);
        if frame.planes() == 0 {
            return Err(Error::Encode { path: self.target.clone(), detail: "no memory for a picture".to_owned() });
        }
        let sample = if self.layout.bits > 8 { 2 } else { 1 };
        let (chroma_width, chroma_height) = self.layout.chroma_size();
        copy_rows(&picture.planes[0], self.layout.width_px * sample, &mut frame, 0);
        if self.pixel == Pixel::NV12 {
            let pairs: Vec<u8> = picture.planes[1].iter().zip(&picture.planes[2]).flat_map(|(b, r)| [*b, *r]).collect();
            debug_assert_eq!(pairs.len(), 2 * chroma_width * chroma_height);
            copy_rows(&pairs, 2 * chroma_width, &mut frame, 1);
        } else {
            copy_rows(&picture.planes[1], chroma_width * sample, &mut frame, 1);
            copy_rows(&picture.planes[2], chroma_width * sample, &mut frame, 2);
        }
        frame.set_pts(Some(pts));
        frame.set_color_range(range_of(&self.layout));
        frame.set_color_space(space_of(&self.layout));
        Ok(frame)
    }
}

fn copy_rows(from: &[u8], width: usize, frame: &mut frame::Video, plane: usize) {
    let stride = frame.stride(plane);
    for (source, row) in from.chunks_exact(width).zip(frame.data_mut(plane).chunks_mut(stride)) {
        row[..width].copy_from_slice(source);
    }
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Container {
    Stamped,
    Avi,
}

fn container(target: &Path) -> std::result::Result<Container, String> {
    match target.extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase).as_deref() {
        Some("mp4" | "mov" | "mkv") => Ok(Container::Stamped),
        Some("avi") => Ok(Container::Avi),
        Some(other) => Err(format!("unknown extension .{other}; use .mp4, .mov, .mkv or .avi")),
        None => Err("no extension; use .mp4, .mov, .mkv or .avi".to_owned()),
    }
}

/// A file of the same extension in the same folder, so that the muxer is right and the rename is atomic.
fn temporary_beside(target: &Path) -> Result<TempPath> {
    if target.is_dir() {
        return Err(Error::unwritable(target, io::Error::other("it is a folder")));
    }
    Ok(output::temporary_beside(target)?.into_path())
}

/// 1/fps as a fraction, exact for whole rates and for n·1000/1001.
fn frame_period(fps: f64) -> Rational {
    let thousandths = fps * 1000.0;
    let ntsc = fps * 1.001;
    if (ntsc - ntsc.round()).abs() < 1e-4 && (fps - fps.round()).abs() > 1e-4 {
        Rational(1001, (ntsc.round() * 1000.0) as i32)
    } else {
        Rational(1000, thousandths.round().max(1.0) as i32).reduce()
    }
}

fn encoder_name(name: CodecName) -> &'static str {
    match name {
        CodecName::H264 => "libx264",
        CodecName::Hevc => "libx265",
        CodecName::Mpeg4 => "mpeg4",
        CodecName::Mjpeg => "mjpeg",
    }
}

fn pixel_of(codec: &Codec) -> std::result::Result<Pixel, String> {
    let jpeg = codec.name == CodecName::Mjpeg;
    match (codec.pixel_format, jpeg) {
        (PixelFormat::Yuv420p, false) => Ok(Pixel::YUV420P),
        (PixelFormat::Yuv422p, false) => Ok(Pixel::YUV422P),
        (PixelFormat::Yuv444p, false) => Ok(Pixel::YUV444P),
        (PixelFormat::Yuv420p, true) => Ok(Pixel::YUVJ420P),
        (PixelFormat::Yuv422p, true) => Ok(Pixel::YUVJ422P),
        (PixelFormat::Yuv444p, true) => Ok(Pixel::YUVJ444P),
        (PixelFormat::Yuv420p10le, false) => Ok(Pixel::YUV420P10LE),
        (PixelFormat::Nv12, false) => Ok(Pixel::NV12),
        (other, true) => Err(format!("MJPEG has no {other:?}; use yuv420p, yuv422p or yuv444p")),
    }
}

fn range_of(layout: &Layout) -> color::Range {
    if layout.full_range { color::Range::JPEG } else { color::Range::MPEG }
}

fn space_of(layout: &Layout) -> color::Space {
    match layout.matrix {
        Matrix::Bt601 => color::Space::SMPTE170M,
        Matrix::Bt709 => color::Space::BT709,
        Matrix::Bt2020 => color::Space::BT2020NCL,
    }
}

fn encoder_options(codec: &Codec) -> Dictionary {
    let mut options = Dictionary::new();
    match codec.name {
        CodecName::H264 => {
            options.set("crf", codec.crf.to_string());
            options.set("preset", &codec.preset);
            options.set("x264-params", "open-gop=0");
            if let Some(most) = codec.most_bits_per_s {
                options.set("maxrate", most.to_string());
                options.set("bufsize", most.to_string());
            }
        }
        CodecName::Hevc => {
            options.set("crf", codec.crf.to_string());
            options.set("preset", &codec.preset);
            options.set("x265-params", "open-gop=0:log-level=none");
        }
        // FFmpeg's encoder closes its groups only when it looks for no scene changes.
        CodecName::Mpeg4 => options.set("sc_threshold", "1000000000"),
        CodecName::Mjpeg => {}
    }
    options
}

/// What the container and the pictures ask of the encoder.
struct Stream {
    library: ffmpeg::Codec,
    pixel: Pixel,
    time_base: Rational,
    rate: Rational,
    global_header: bool,
}

impl Stream {
    fn configured(&self, codec: &Codec, layout: &Layout) -> std::result::Result<encoder::video::Video, ffmpeg::Error> {
        let mut video = codec::Context::new_with_codec(self.library).encoder().video()?;
        video.set_width(layout.width_px as u32);
        video.set_height(layout.height_px as u32);
        video.set_format(self.pixel);
        video.set_time_base(self.time_base);
        video.set_frame_rate(Some(self.rate));
        video.set_aspect_ratio(Rational(1, 1));
        video.set_gop(codec.gop);
        if let Some(b_frames) = codec.b_frames {
            video.set_max_b_frames(b_frames as usize);
        }
        video.set_colorspace(space_of(layout));
        video.set_color_range(range_of(layout));
        let mut flags = codec::Flags::empty();
        flags.set(codec::Flags::GLOBAL_HEADER, self.global_header);
        flags.set(codec::Flags::CLOSED_GOP, codec.name == CodecName::Mpeg4);
        if matches!(codec.name, CodecName::Mpeg4 | CodecName::Mjpeg) {
            flags |= codec::Flags::QSCALE;
            video.set_global_quality((codec.crf * f64::from(ffi::FF_QP2LAMBDA)).round() as i32);
        }
        video.set_flags(flags);
        set_colour_tags(&mut video, layout);
        Ok(video)
    }
}

/// Primaries, transfer and chroma siting, for which the binding has no setters.
fn set_colour_tags(video: &mut encoder::video::Video, layout: &Layout) {
    use ffi::{AVChromaLocation, AVColorPrimaries, AVColorTransferCharacteristic};
    let (primaries, transfer) = match layout.matrix {
        Matrix::Bt601 => (AVColorPrimaries::SMPTE170M, AVColorTransferCharacteristic::SMPTE170M),
        Matrix::Bt709 => (AVColorPrimaries::BT709, AVColorTransferCharacteristic::BT709),
        Matrix::Bt2020 => (AVColorPrimaries::BT2020, AVColorTransferCharacteristic::BT2020_10),
    };
    let location = match layout.chroma_site_px {
        _ if (layout.chroma_shift_x, layout.chroma_shift_y) != (1, 1) => AVChromaLocation::UNSPECIFIED,
        [0.0, 0.0] => AVChromaLocation::TOPLEFT,
        [0.0, _] => AVChromaLocation::LEFT,
        _ => AVChromaLocation::CENTER,
    };
    // SAFETY: the context is allocated, not yet opened, and borrowed mutably; these are plain fields.
    unsafe {
        let context = video.as_mut_ptr();
        (*context).color_primaries = primaries;
        (*context).color_trc = transfer;
        (*context).chroma_sample_location = location;
    }
}

/// The display matrix of a clockwise turn.
fn set_rotation(stream: &mut format::stream::StreamMut<'_>, rotation_deg: i32) -> std::result::Result<(), String> {
    if rotation_deg % 360 == 0 {
        return Ok(());
    }
    // SAFETY: FFmpeg allocates the nine numbers, aligned for any type, and owns them with the stream, which is borrowed mutably.
    unsafe {
        let kind = ffi::AVPacketSideDataType::DISPLAYMATRIX;
        let matrix = ffi::av_stream_new_side_data(stream.as_mut_ptr(), kind, 9 * size_of::<i32>());
        if matrix.is_null() {
            return Err("no memory for the display matrix".to_owned());
        }
        ffi::av_display_rotation_set(matrix.cast(), f64::from(rotation_deg));
    }
    Ok(())
}

/// Writes what is still buffered, and reports what the muxer let pass.
fn flush(output: &mut format::context::Output) -> std::result::Result<(), ffmpeg::Error> {
    // SAFETY: the context is open and borrowed mutably; its byte stream lives until it is dropped.
    let code = unsafe {
        let bytes = (*output.as_mut_ptr()).pb;
        if bytes.is_null() {
            return Ok(());
        }
        ffi::avio_flush(bytes);
        (*bytes).error
    };
    if code < 0 { Err(ffmpeg::Error::from(code)) } else { Ok(()) }
}

fn write_error(target: &Path, error: ffmpeg::Error) -> Error {
    match error {
        ffmpeg::Error::Other { errno } => Error::unwritable(target, io::Error::from_raw_os_error(errno)),
        other => Error::Encode { path: target.to_owned(), detail: other.to_string() },
    }
}

/// The encoder wants more pictures before it gives a packet.
fn would_block(errno: i32) -> bool {
    io::Error::from_raw_os_error(errno).kind() == io::ErrorKind::WouldBlock
}
