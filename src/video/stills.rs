//! A folder of stills as a recording: PNG, JPEG, TIFF, BMP and PNM in the natural order of their names.

use std::cmp::Ordering;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use crossbeam_channel::unbounded;
use image::{DynamicImage, ImageDecoder, ImageReader, RgbImage};

use super::container::StreamInfo;
use super::decode::Decoded;
use super::frame::{self, Frame};
use super::orientation::Orientation;
use super::picture::{Layout, Matrix, OwnedPicture, Plane};
use super::still_times::StillTimes;
use crate::error::{Error, Result};

/// Endings of names that are taken for stills, and the codec they stand for.
const ENDINGS: [(&str, &str); 11] = [
    ("png", "png"),
    ("jpg", "jpeg"),
    ("jpeg", "jpeg"),
    ("tif", "tiff"),
    ("tiff", "tiff"),
    ("bmp", "bmp"),
    ("pnm", "pnm"),
    ("ppm", "pnm"),
    ("pgm", "pnm"),
    ("pbm", "pnm"),
    ("pam", "pnm"),
];

/// The stills of a folder with their time stamps.
#[derive(Debug, Clone)]
pub struct Stills {
    folder: PathBuf,
    files: Vec<PathBuf>,
    t_s: Vec<f64>,
    /// Described as a stream.
    pub info: StreamInfo,
}

/// A still, read.
enum Still {
    Whole(OwnedPicture),
    OfAnotherSize,
    Damaged,
}

impl Stills {
    /// Lists a folder and learns the time stamps and, from the first still that can be read, the size.
    ///
    /// # Errors
    /// [`Error::Unreadable`], [`Error::NoStills`], [`Error::StillTimes`], [`Error::PictureSize`], and
    /// [`Error::NoFrames`] where not one still can be read.
    pub fn open(folder: &Path, times: &StillTimes) -> Result<Self> {
        let files = stills_in(folder)?;
        let t_s = times.stamps_s(folder, &files)?;
        let first = files.iter().find_map(|f| read_rgb(f).ok());
        let packets = files.len() as u64;
        let first = first.ok_or_else(|| Error::NoFrames { path: folder.to_owned(), packets })?;
        let (width, height) = first.dimensions();
        let sides = 16..=super::MAX_SIDE_PX;
        if !sides.contains(&width) || !sides.contains(&height) {
            return Err(Error::PictureSize { path: folder.to_owned(), width, height });
        }
        let info = StreamInfo {
            stream: 0,
            streams: 1,
            other_videos: 0,
            delay_frames: 0,
            container: "stills".to_owned(),
            codec: codec_of(&files[0]).unwrap_or_default().to_owned(),
            stored_size_px: (width as usize, height as usize),
            orientation: Orientation::default(),
            pixel_aspect: 1.0,
            nominal_rate_hz: if let StillTimes::Rate(rate_hz) = times { Some(*rate_hz) } else { None },
            tick_s: 0.0,
            stated_frames: Some(packets),
        };
        Ok(Self { folder: folder.to_owned(), files, t_s, info })
    }

    /// The folder.
    pub fn path(&self) -> &Path {
        &self.folder
    }

    /// The stills of a folder, in order.
    pub fn files(&self) -> &[PathBuf] {
        &self.files
    }

    /// Time stamps, one a still.
    pub fn stamps_s(&self) -> &[f64] {
        &self.t_s
    }

    /// Reads every still once, as [`super::decode_in_order`] does with a container, at most `2 × workers` ahead.
    ///
    /// # Errors
    /// Whatever `sink` returns.
    pub fn decode_in_order<T: Send>(
        &self,
        workers: usize,
        measure: &(dyn Fn(Frame<'_>) -> T + Sync),
        sink: &mut dyn FnMut(T) -> Result<()>,
    ) -> Result<Decoded> {
        let (workers, count) = (workers.max(1), self.files.len());
        std::thread::scope(|scope| {
            let (todo, work) = unbounded::<usize>();
            let (done, finished) = unbounded();
            for _ in 0..workers {
                let (work, done) = (work.clone(), done.clone());
                scope
                    .spawn(move || work.iter().try_for_each(|index| done.send((index, self.measured(index, measure)))));
            }
            drop((work, done));
            let mut early = BTreeMap::new();
            let mut decoded = Decoded { packets: count as u64, segments: 1, ..Decoded::default() };
            let mut sent = 0;
            for next in 0..count {
                while sent < count.min(next + 2 * workers) {
                    let _ = todo.send(sent);
                    sent += 1;
                }
                while !early.contains_key(&next) {
                    // only a worker that panicked leaves nothing to receive, and the scope passes its panic on
                    let Ok((index, value)) = finished.recv() else { return Ok(decoded) };
                    early.insert(index, value);
                }
                if let Some((value, one)) = early.remove(&next) {
                    decoded.frames += one.frames;
                    decoded.damaged_packets += one.damaged_packets;
                    decoded.resized_frames += one.resized_frames;
                    value.map_or(Ok(()), &mut *sink)?;
                }
            }
            Ok(decoded)
        })
    }

    /// Shows one still, unless it cannot be read.
    pub fn show(&self, index: usize, see: &mut dyn FnMut(&Frame<'_>)) {
        if let Some(Still::Whole(picture)) = self.files.get(index).map(|_| self.read(index)) {
            see(&Frame { picture: picture.view(), t_s: self.t_s[index], key: true, damaged: false });
        }
    }

    fn measured<T>(&self, index: usize, measure: &(dyn Fn(Frame<'_>) -> T + Sync)) -> (Option<T>, Decoded) {
        let mut one = Decoded { frames: 1, ..Decoded::default() };
        let value = |picture: &OwnedPicture, damaged| {
            Some(measure(Frame { picture: picture.view(), t_s: self.t_s[index], key: true, damaged }))
        };
        match self.read(index) {
            Still::Whole(picture) => (value(&picture, false), one),
            Still::Damaged => {
                one.damaged_packets = 1;
                (value(&OwnedPicture::black(layout(self.info.stored_size_px)), true), one)
            }
            Still::OfAnotherSize => (None, Decoded { frames: 0, resized_frames: 1, ..Decoded::default() }),
        }
    }

    fn read(&self, index: usize) -> Still {
        let Ok(rgb) = read_rgb(&self.files[index]) else { return Still::Damaged };
        let size = (rgb.width() as usize, rgb.height() as usize);
        if size != self.info.stored_size_px {
            return Still::OfAnotherSize;
        }
        let plane = |c: usize| Plane { bytes: &rgb.as_raw()[c..], stride: 3 * size.0, step: 3 };
        Still::Whole(frame::from_rgb(layout(size), [plane(0), plane(1), plane(2)]))
    }
}

/// Reads a still upright, 8 bits a channel.
fn read_rgb(file: &Path) -> image::ImageResult<RgbImage> {
    let mut decoder = ImageReader::open(file)?.with_guessed_format()?.into_decoder()?;
    let orientation = decoder.orientation()?;
    let mut still = DynamicImage::from_decoder(decoder)?;
    still.apply_orientation(orientation);
    Ok(still.into_rgb8())
}

/// Full range, each pixel with its own colour.
fn layout((width_px, height_px): (usize, usize)) -> Layout {
    Layout {
        width_px,
        height_px,
        bits: 8,
        low_bits: 0,
        chroma_shift_x: 0,
        chroma_shift_y: 0,
        chroma_site_px: [0.0, 0.0],
        full_range: true,
        matrix: Matrix::Bt601,
    }
}

fn codec_of(file: &Path) -> Option<&'static str> {
    let ending = file.extension()?.to_str()?;
    ENDINGS.iter().find(|(e, _)| e.eq_ignore_ascii_case(ending)).map(|(_, codec)| *codec)
}

/// The stills of a folder, in the natural order of their names.
///
/// # Errors
/// [`Error::Unreadable`] and [`Error::NoStills`].
pub fn stills_in(folder: &Path) -> Result<Vec<PathBuf>> {
    let failed = |e| Error::unreadable(folder, e);
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(failed)? {
        let path = entry.map_err(failed)?.path();
        let hidden = path.file_name().is_some_and(|n| n.to_string_lossy().starts_with('.'));
        if !hidden && codec_of(&path).is_some() && path.is_file() {
            files.push(path);
        }
    }
    if files.is_empty() {
        return Err(Error::NoStills { path: folder.to_owned() });
    }
    let name = |p: &PathBuf| p.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    files.sort_by(|a, b| natural_order(&name(a), &name(b)));
    Ok(files)
}

/// Numbers within names count as numbers: 2 comes before 10.
fn natural_order(a: &str, b: &str) -> Ordering {
    let (mut left, mut right) = (a, b);
    while let (Some(l), Some(r)) = (left.chars().next(), right.chars().next()) {
        let (run_l, run_r) = (digits(left), digits(right));
        if run_l > 0 && run_r > 0 {
            let (x, y) = (left[..run_l].trim_start_matches('0'), right[..run_r].trim_start_matches('0'));
            let order = x.len().cmp(&y.len()).then_with(|| x.cmp(y));
            if order.is_ne() {
                return order;
            }
            (left, right) = (&left[run_l..], &right[run_r..]);
        } else if l == r {
            (left, right) = (&left[l.len_utf8()..], &right[r.len_utf8()..]);
        } else {
            return l.cmp(&r);
        }
    }
    left.len().cmp(&right.len()).then_with(|| a.cmp(b))
}

/// Length of the run of digits at the start.
fn digits(text: &str) -> usize {
    text.bytes().take_while(u8::is_ascii_digit).count()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_comes_before_ten_and_padding_does_not_matter() {
        let mut names =
            ["f10.png", "f2.png", "f.png", "f02b.png", "e99.png", "f1é.png", "f00000000000000000000003.png"];
        names.sort_by(|a, b| natural_order(a, b));
        assert_eq!(
            names,
            ["e99.png", "f.png", "f1é.png", "f2.png", "f02b.png", "f00000000000000000000003.png", "f10.png"]
        );
    }
}
