//! One error type for the whole library. Every message is one line that says what is wrong, where, and what to do.

use std::path::{Path, PathBuf};

/// What can go wrong, with the numbers a person needs to mend it.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// An input that cannot be opened or read.
    #[error("{}: cannot be read: {source}; check the path and its permissions", path.display())]
    Unreadable { path: PathBuf, source: std::io::Error },

    /// A file of zero bytes.
    #[error("{}: the file is empty (0 bytes); record or copy it again", path.display())]
    EmptyFile { path: PathBuf },

    /// A file that no demultiplexer understands.
    #[error(
        "{}: not a video that can be opened: {detail}; give an MP4, MOV, AVI or MKV file, or a folder of stills",
        path.display()
    )]
    NotAVideo { path: PathBuf, detail: String },

    /// A container without a video stream.
    #[error("{}: holds no video stream ({found}); give the file that carries the pictures", path.display())]
    NoVideoStream { path: PathBuf, found: String },

    /// A codec for which FFmpeg was built without a decoder.
    #[error("{}: stream {stream}: no decoder for {codec}; convert it first, for example with `ffmpeg -i IN -c:v libx264 -qp 0 OUT.mp4`", path.display())]
    NoDecoder { path: PathBuf, stream: usize, codec: String },

    /// A picture size that cannot be measured.
    #[error("{}: pictures of {width}×{height} px cannot be measured; the limits are 16×16 and {} px a side", path.display(), crate::video::MAX_SIDE_PX)]
    PictureSize { path: PathBuf, width: u32, height: u32 },

    /// A pixel layout outside the supported planar and semi-planar ones.
    #[error("{}: pixel format {format} is not supported; convert it to yuv420p, yuv422p, yuv444p (8 or 10 bit), nv12 or rgb24", path.display())]
    PixelFormat { path: PathBuf, format: String },

    /// A video from which not one frame decodes.
    #[error("{}: not one frame of {packets} packets can be decoded; the file is damaged or cut off, copy it again", path.display())]
    NoFrames { path: PathBuf, packets: u64 },

    /// A folder that holds no stills.
    #[error("{}: holds no PNG, JPEG, TIFF, BMP or PNM stills; give a video file or a folder of stills", path.display())]
    NoStills { path: PathBuf },

    /// Stills and time stamps that do not belong together.
    #[error("{}: {detail}", path.display())]
    StillTimes { path: PathBuf, detail: String },

    /// No mark of the wanted colour: what was found instead, and what would accept it.
    #[error("{}: no {colour} mark in any of {frames} frames: {found}; {remedy}", path.display())]
    NoMarks { path: PathBuf, colour: String, frames: u64, found: String, remedy: String },

    /// A recording in which nothing looks like marks that swing.
    #[error("{}: nothing in {frames} frames swings like marks: {found}; leave out a hand at the beginning with --from, put round marks of one clear colour on what swings, or name what is there with `track --color`", path.display())]
    NothingSwings { path: PathBuf, frames: usize, found: String },

    /// Fewer marks than asked for.
    #[error("{}: found {found} {colour} mark{} where {wanted} are needed{beside}; {remedy}", path.display(), if *found == 1 { "" } else { "s" })]
    TooFewMarks { path: PathBuf, colour: String, found: usize, wanted: usize, beside: String, remedy: String },

    /// A configuration file that cannot be used.
    #[error("{}{}: {message}", path.display(), line.map(|l| format!(":{l}")).unwrap_or_default())]
    Config { path: PathBuf, line: Option<usize>, message: String },

    /// Words of a command that cannot be understood.
    #[error("{detail}; see --help for all options")]
    Words { detail: String },

    /// An option that cannot be used.
    #[error("{option}: {message}")]
    Option { option: String, message: String },

    /// A table of angles that cannot be used.
    #[error("{}{}: {message}", path.display(), line.map(|l| format!(":{l}")).unwrap_or_default())]
    Table { path: PathBuf, line: Option<u64>, message: String },

    /// A folder of a run, or a file in it, that cannot be read back.
    #[error("{}{}: {message}", path.display(), line.map(|l| format!(":{l}")).unwrap_or_default())]
    Left { path: PathBuf, line: Option<usize>, message: String },

    /// An output that cannot be written.
    #[error("{}: cannot be written: {source}; check that the folder exists, is writable and has room", path.display())]
    Unwritable { path: PathBuf, source: std::io::Error },

    /// An encoder that failed.
    #[error("{}: the picture stream cannot be encoded: {detail}; `freeswing doctor` tests the encoders", path.display())]
    Encode { path: PathBuf, detail: String },

    /// A failure inside OpenCV.
    #[error("OpenCV failed while {doing}: {detail}")]
    OpenCv { doing: &'static str, detail: String },

    /// A motion that cannot be simulated.
    #[error("the motion cannot be simulated: {detail}")]
    Simulation { detail: String },

    /// An experiment file that does not say what a command needs.
    #[error("the experiment file: {detail}")]
    Missing { detail: String },

    /// A file in the place of a folder of recordings.
    #[error("{}: is a file, not a folder; use `freeswing run` for one recording", path.display())]
    NotAFolder { path: PathBuf },

    /// A folder below which there is no recording.
    #[error("{}: holds no recording and no table of angles; give the folder above them", path.display())]
    NothingToDo { path: PathBuf },

    /// An output folder in which another batch works.
    #[error("{}: in use by {holder}; wait until it has finished, or give another --out", path.display())]
    Busy { path: PathBuf, holder: String },

    /// Results that cannot be kept, as the run of a recording says.
    #[error("{line}; what was finished is kept, and the batch goes on from there when it is started again")]
    Results { line: String },

    /// A self-test that measured something else than the truth.
    #[error("the self-test measured angles that are {:.2} mrad off, where {:.2} are allowed; FFmpeg or OpenCV of this machine is broken, reinstall them", 1e3 * error_rad, 1e3 * most_rad)]
    SelfTest { error_rad: f64, most_rad: f64 },

    /// A figure that cannot be made a picture.
    #[error("a figure cannot be drawn: {detail}; report it with the folder, and leave the figures out meanwhile")]
    Drawing { detail: String },

    /// Stopped by the user.
    #[error("interrupted; nothing was written")]
    Interrupted,

    /// A batch stopped by the user.
    #[error("interrupted; what was finished is kept, and the same command goes on from there")]
    Stopped,
}

impl Error {
    /// An input error at `path`.
    pub fn unreadable(path: &Path, source: std::io::Error) -> Self {
        Self::Unreadable { path: path.to_owned(), source }
    }

    /// An output error at `path`.
    pub fn unwritable(path: &Path, source: std::io::Error) -> Self {
        Self::Unwritable { path: path.to_owned(), source }
    }

    /// An OpenCV error with what was being done.
    pub fn opencv(doing: &'static str) -> impl FnOnce(opencv::Error) -> Self {
        move |error| Self::OpenCv { doing, detail: error.message.replace('\n', " ") }
    }
}

/// The library's result.
pub type Result<T> = std::result::Result<T, Error>;
