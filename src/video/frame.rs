//! A decoder's frame seen as a [`Picture`], without copying its planes.
//!
//! The only `unsafe` of the decoding side: FFmpeg hands out plane pointers with a stride that may be negative.

use ffmpeg_the_third as ffmpeg;

use ffmpeg::codec::Id;
use ffmpeg::format::Pixel;
use ffmpeg::util::chroma::Location;
use ffmpeg::util::color::{Range, Space};

use super::picture::{Layout, Matrix, OwnedPicture, Picture, Plane};

/// One frame of a recording with its own time stamp.
#[derive(Debug, Clone, Copy)]
pub struct Frame<'a> {
    /// The samples.
    pub picture: Picture<'a>,
    /// Presentation time stamp of the container.
    pub t_s: f64,
    /// The frame refers to no other.
    pub key: bool,
    /// The decoder reported damage in this frame, or refused a packet before it.
    pub damaged: bool,
}

/// Where the samples of a pixel format lie.
#[derive(Debug, Clone, Copy)]
enum Packing {
    /// Three planes.
    Planar,
    /// Luma, then interleaved pairs; `true` where C_r comes first.
    SemiPlanar { cr_first: bool },
    /// Packed 4:2:2; offsets of Y, C_b, C_r in four bytes.
    Packed422 { y: usize, cb: usize, cr: usize },
    /// Luma alone.
    Grey,
    /// Packed R′G′B′; offsets and bytes a pixel.
    PackedRgb { offsets: [usize; 3], step: usize },
    /// Planes G, B, R.
    PlanarGbr,
}

/// Bits, bits below, chroma shifts, forced full range, packing.
fn describe(format: Pixel) -> Option<(u32, u32, u32, u32, bool, Packing)> {
    use Packing::{Grey, Packed422, PackedRgb, Planar, PlanarGbr, SemiPlanar};
    let nv = SemiPlanar { cr_first: false };
    let rgb = |offsets, step| (8, 0, 0, 0, true, PackedRgb { offsets, step });
    Some(match format {
        Pixel::YUV420P | Pixel::YUVA420P => (8, 0, 1, 1, false, Planar),
        Pixel::YUV422P | Pixel::YUVA422P => (8, 0, 1, 0, false, Planar),
        Pixel::YUV444P | Pixel::YUVA444P => (8, 0, 0, 0, false, Planar),
        Pixel::YUV440P => (8, 0, 0, 1, false, Planar),
        Pixel::YUV411P => (8, 0, 2, 0, false, Planar),
        Pixel::YUV410P => (8, 0, 2, 2, false, Planar),
        Pixel::YUVJ420P => (8, 0, 1, 1, true, Planar),
        Pixel::YUVJ422P => (8, 0, 1, 0, true, Planar),
        Pixel::YUVJ444P => (8, 0, 0, 0, true, Planar),
        Pixel::YUVJ440P => (8, 0, 0, 1, true, Planar),
        Pixel::YUV420P10LE => (10, 0, 1, 1, false, Planar),
        Pixel::YUV422P10LE => (10, 0, 1, 0, false, Planar),
        Pixel::YUV444P10LE => (10, 0, 0, 0, false, Planar),
        Pixel::YUV420P12LE => (12, 0, 1, 1, false, Planar),
        Pixel::YUV422P12LE => (12, 0, 1, 0, false, Planar),
        Pixel::YUV444P12LE => (12, 0, 0, 0, false, Planar),
        Pixel::NV12 => (8, 0, 1, 1, false, nv),
        Pixel::NV21 => (8, 0, 1, 1, false, SemiPlanar { cr_first: true }),
        Pixel::NV16 => (8, 0, 1, 0, false, nv),
        Pixel::P010LE => (10, 6, 1, 1, false, nv),
        Pixel::YUYV422 => (8, 0, 1, 0, false, Packed422 { y: 0, cb: 1, cr: 3 }),
        Pixel::UYVY422 => (8, 0, 1, 0, false, Packed422 { y: 1, cb: 0, cr: 2 }),
        Pixel::GRAY8 => (8, 0, 0, 0, true, Grey),
        Pixel::RGB24 => rgb([0, 1, 2], 3),
        Pixel::BGR24 => rgb([2, 1, 0], 3),
        Pixel::RGBA | Pixel::RGBZ => rgb([0, 1, 2], 4),
        Pixel::BGRA | Pixel::BGRZ => rgb([2, 1, 0], 4),
        Pixel::ARGB | Pixel::ZRGB => rgb([1, 2, 3], 4),
        Pixel::ABGR | Pixel::ZBGR => rgb([3, 2, 1], 4),
        Pixel::GBRP | Pixel::GBRAP => (8, 0, 0, 0, true, PlanarGbr),
        _ => return None,
    })
}

/// The samples of a frame: the decoder's own where they can be used as they lie, else a converted copy.
pub enum Samples<'a> {
    /// The decoder's planes.
    Borrowed(Picture<'a>),
    /// Converted from R′G′B′, grey or bottom-up rows.
    Converted(OwnedPicture),
}

impl Samples<'_> {
    /// The picture.
    pub fn picture(&self) -> Picture<'_> {
        match self {
            Self::Borrowed(picture) => *picture,
            Self::Converted(owned) => owned.view(),
        }
    }
}

/// The samples of a decoded frame; `None` where the pixel format is not supported.
pub fn samples<'a>(frame: &'a ffmpeg::frame::Video, codec: Id) -> Option<Samples<'a>> {
    let (bits, low_bits, chroma_shift_x, chroma_shift_y, full, packing) = describe(frame.format())?;
    let layout = Layout {
        width_px: frame.width() as usize,
        height_px: frame.height() as usize,
        bits,
        low_bits,
        chroma_shift_x,
        chroma_shift_y,
        chroma_site_px: chroma_site(frame.chroma_location(), codec, full, chroma_shift_x, chroma_shift_y),
        full_range: full || frame.color_range() == Range::JPEG,
        matrix: matrix(frame.color_space(), frame.height()),
    };
    let bytes = if bits > 8 { 2 } else { 1 };
    let (_, chroma_rows) = layout.chroma_size();
    match packing {
        Packing::Planar | Packing::SemiPlanar { .. } | Packing::Packed422 { .. } => {
            let chroma = |index: usize, offset: usize, step: usize| plane(frame, index, offset, step, chroma_rows);
            let (luma, cb, cr) = match packing {
                Packing::SemiPlanar { cr_first } => {
                    let (b, r) = if cr_first { (bytes, 0) } else { (0, bytes) };
                    (plane(frame, 0, 0, bytes, layout.height_px)?, chroma(1, b, 2 * bytes)?, chroma(1, r, 2 * bytes)?)
                }
                Packing::Packed422 { y, cb, cr } => {
                    (plane(frame, 0, y, 2, layout.height_px)?, chroma(0, cb, 4)?, chroma(0, cr, 4)?)
                }
                _ => (plane(frame, 0, 0, bytes, layout.height_px)?, chroma(1, 0, bytes)?, chroma(2, 0, bytes)?),
            };
            Some(Samples::Borrowed(Picture { layout, luma, cb, cr }))
        }
        Packing::Grey => {
            let luma = plane(frame, 0, 0, 1, layout.height_px)?;
            let mut owned = OwnedPicture::black(layout);
            for row in 0..layout.height_px {
                let at = row * layout.width_px;
                owned.planes[0][at..at + layout.width_px]
                    .copy_from_slice(&luma.bytes[row * luma.stride..][..layout.width_px]);
            }
            Some(Samples::Converted(owned))
        }
        Packing::PackedRgb { offsets, step } => {
            let planes = [0, 1, 2].map(|c| plane(frame, 0, offsets[c], step, layout.height_px));
            Some(Samples::Converted(from_rgb(layout, [planes[0]?, planes[1]?, planes[2]?])))
        }
        Packing::PlanarGbr => {
            let planes = [2, 0, 1].map(|index| plane(frame, index, 0, 1, layout.height_px));
            Some(Samples::Converted(from_rgb(layout, [planes[0]?, planes[1]?, planes[2]?])))
        }
    }
}

/// Eight-bit R′G′B′ planes → full-range Y′C_bC_r 4:4:4.
pub fn from_rgb(layout: Layout, rgb: [Plane<'_>; 3]) -> OwnedPicture {
    let mut owned = OwnedPicture::black(layout);
    for row in 0..layout.height_px {
        for column in 0..layout.width_px {
            let value = rgb.map(|p| f64::from(p.code(false, column, row)) / 255.0);
            let [y, cb, cr] = layout.matrix.ycbcr(value);
            let index = row * layout.width_px + column;
            owned.planes[0][index] = (255.0 * y).round() as u8;
            owned.planes[1][index] = (128.0 + 255.0 * cb).round().clamp(0.0, 255.0) as u8;
            owned.planes[2][index] = (128.0 + 255.0 * cr).round().clamp(0.0, 255.0) as u8;
        }
    }
    owned
}

/// A plane of a frame; `None` where the frame has no such plane or keeps its rows bottom-up.
fn plane<'a>(
    frame: &'a ffmpeg::frame::Video,
    index: usize,
    offset: usize,
    step: usize,
    rows: usize,
) -> Option<Plane<'a>> {
    // SAFETY: the frame owns its buffers for 'a; FFmpeg guarantees `linesize` bytes for each of the plane's rows.
    unsafe {
        let raw = &*frame.as_ptr();
        let stride = usize::try_from(raw.linesize[index]).ok().filter(|s| *s > 0)?;
        let start = raw.data[index];
        if start.is_null() {
            return None;
        }
        let bytes = std::slice::from_raw_parts(start, stride * rows);
        Some(Plane { bytes: bytes.get(offset..)?, stride, step })
    }
}

/// Where chroma sample (0, 0) lies, in luma pixels.
fn chroma_site(location: Location, codec: Id, full: bool, shift_x: u32, shift_y: u32) -> [f64; 2] {
    let centre = |shift: u32| (f64::from(1u32 << shift) - 1.0) / 2.0;
    let (left, top) = match location {
        Location::Left => (true, false),
        Location::TopLeft => (true, true),
        Location::Top => (false, true),
        Location::Center => (false, false),
        // what the codecs mean when they say nothing: JPEG puts chroma in the middle, MPEG at the left
        _ => (codec != Id::MJPEG && codec != Id::MPEG1VIDEO && !full, false),
    };
    [if left { 0.0 } else { centre(shift_x) }, if top { 0.0 } else { centre(shift_y) }]
}

/// The declared matrix, or the customary one for the size.
fn matrix(space: Space, height: u32) -> Matrix {
    match space {
        Space::BT709 => Matrix::Bt709,
        Space::BT2020NCL | Space::BT2020CL => Matrix::Bt2020,
        Space::BT470BG | Space::SMPTE170M | Space::FCC => Matrix::Bt601,
        _ if height >= 720 => Matrix::Bt709,
        _ => Matrix::Bt601,
    }
}

/// The decoder concealed errors in this frame or marked it as corrupt.
pub fn is_damaged(frame: &ffmpeg::frame::Video) -> bool {
    // SAFETY: the frame is valid while borrowed.
    frame.is_corrupt() || unsafe { (*frame.as_ptr()).decode_error_flags != 0 }
}
