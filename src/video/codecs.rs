//! What FFmpeg's libraries were built with.

use ffmpeg_the_third::codec::{decoder, encoder};

/// Decoders of what cameras write, with the name a person knows.
const DECODERS: [(&str, &str); 10] = [
    ("h264", "H.264"),
    ("hevc", "HEVC"),
    ("mpeg4", "MPEG-4"),
    ("mjpeg", "MJPEG"),
    ("vp9", "VP9"),
    ("av1", "AV1"),
    ("prores", "ProRes"),
    ("dvvideo", "DV"),
    ("ffv1", "FFV1"),
    ("rawvideo", "uncompressed"),
];
/// Encoders of overlays and synthetic recordings.
const ENCODERS: [(&str, &str); 4] = [("libx264", "H.264"), ("libx265", "HEVC"), ("mjpeg", "MJPEG"), ("ffv1", "FFV1")];

/// Decoders, each with whether it is there.
pub fn decoders() -> Vec<(&'static str, bool)> {
    super::initialise();
    // AV1's decoder has the name of its library
    let is_there = |name: &str| {
        decoder::find_by_name(name).is_some() || name == "av1" && decoder::find_by_name("libdav1d").is_some()
    };
    DECODERS.map(|(own, name)| (name, is_there(own))).into()
}

/// Encoders, each with whether it is there.
pub fn encoders() -> Vec<(&'static str, bool)> {
    super::initialise();
    ENCODERS.map(|(own, name)| (name, encoder::find_by_name(own).is_some())).into()
}

/// Version of libavcodec.
pub fn version() -> String {
    let version = ffmpeg_the_third::codec::version();
    format!("{}.{}.{}", version >> 16, version >> 8 & 0xff, version & 0xff)
}
