//! Recording, tracks and angles → a video that shows what was measured.
//!
//! A second pass over the recording, one picture at a time: around each mark the blue rectangle of the paper's
//! Fig. 8 and the mark's number, behind it the trail of the last second, between the marks the links, in a corner
//! time and angles. A lost mark has a dashed amber rectangle where the filter takes it to be. The pictures stand as
//! they are displayed and keep their own time stamps.

mod canvas;
mod lettering;
mod marks;
mod panel;

use std::path::Path;

use canvas::Canvas;
use lettering::Lettering;
use marks::Seen;
use panel::Panel;

use crate::angles::{Angle, Angles};
use crate::error::{Error, Result};
use crate::experiment::Codec;
use crate::progress::Progress;
use crate::track::Tracks;
use crate::video::{Layout, Recording, VideoWriter};

/// How far back a trail reaches.
const TRAIL_S: f64 = 1.0;
/// Pictures per second where the recording has a single one.
const USUAL_RATE_HZ: f64 = 30.0;

/// Bits a pixel at which H.264 shows a still scene and a few marks without blocks.
const BITS_PER_PIXEL: f64 = 0.05;
/// In pictures with smaller sides nobody can tell whether a mark was followed.
const LEAST_SIDE_PX: f64 = 480.0;

/// What is drawn.
#[derive(Debug, Clone, Copy)]
pub struct Overlay<'a> {
    /// Where the marks were.
    pub tracks: &'a Tracks,
    /// What the links did.
    pub angles: &'a Angles,
    /// The fixed, unmarked pivot, displayed pixels.
    pub pivot_px: Option<[f64; 2]>,
    /// Pictures per second, about; the stamps are the recording's own.
    pub rate_hz: Option<f64>,
    /// Bytes that the file stays below, nearly: its pictures are made smaller where that must be.
    pub most_bytes: Option<u64>,
}

/// How a file stays below some bytes.
#[derive(Debug, Clone, Copy)]
struct Room {
    /// Sides of its pictures.
    size_px: [usize; 2],
    bits_per_s: u64,
}

impl Room {
    /// For pictures of a size, at a rate, over a time.
    fn for_bytes(bytes: u64, size_px: [usize; 2], rate_hz: f64, duration_s: f64) -> Self {
        // a tenth for what is not pictures, and for a rate that is held only on average
        let bits_per_s = 0.9 * 8.0 * bytes as f64 / duration_s.max(1.0);
        let [width, height] = size_px.map(|side| side as f64);
        let scale = (bits_per_s / (BITS_PER_PIXEL * rate_hz * width * height)).sqrt();
        let scale = scale.max(LEAST_SIDE_PX / width.max(height)).min(1.0);
        let size_px = size_px.map(|side| ((scale * side as f64 / 2.0).round() as usize * 2).max(16));
        Self { size_px, bits_per_s: bits_per_s as u64 }
    }
}

/// Sizes of lines and letters, from the size of the picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Look {
    /// Width of a line.
    line_px: f64,
    /// Height of a capital.
    letter_px: f64,
}

impl Look {
    /// For a picture of this width and height.
    fn for_size(size_px: [usize; 2]) -> Self {
        let side = size_px[0].max(size_px[1]) as f64;
        Self { line_px: (side / 720.0).max(1.0), letter_px: (side / 76.0).clamp(7.0, 60.0).round() }
    }

    fn thin(&self) -> i32 {
        (0.8 * self.line_px).round().max(1.0) as i32
    }

    fn lettering(&self) -> Lettering {
        Lettering { height_px: self.letter_px, stroke_px: (self.letter_px / 8.0).round().max(1.0) as i32 }
    }

    fn thick(&self) -> i32 {
        (1.2 * self.line_px).round().max(1.0) as i32
    }
}

/// Refuses a target that could not be written, before any work is done.
///
/// # Errors
/// [`Error::Unwritable`] and [`Error::Encode`].
pub fn check_target(target: &Path) -> Result<()> {
    let layout = Codec::default().layout(16, 16);
    VideoWriter::create(target, &codec(), layout, USUAL_RATE_HZ).map(|_| ())
}

/// No look-ahead: the encoder holds a few pictures, not forty.
fn codec() -> Codec {
    Codec { crf: 22.0, preset: "superfast".to_owned(), b_frames: Some(0), ..Codec::default() }
}

impl Overlay<'_> {
    /// Draws every frame of a recording into a new video, which appears finished or not at all.
    ///
    /// # Errors
    /// Whatever decoding and encoding report, [`Error::Interrupted`].
    pub fn write(&self, mut source: Recording, target: &Path, threads: usize, progress: &dyn Progress) -> Result<()> {
        progress.begin("overlay", Some(self.tracks.t_s.len() as u64));
        let orientation = source.info().orientation;
        let mut film = Film { overlay: self, target, writer: None, frame: 0, last_pts: i64::MIN };
        source.decode_one_by_one(
            threads,
            &|frame| (frame.t_s, Canvas::of(&frame.picture, orientation)),
            &mut |(t_s, canvas)| {
                if progress.is_cancelled() {
                    return Err(Error::Interrupted);
                }
                progress.advance(1);
                film.push(t_s, canvas)
            },
        )?;
        film.writer.map_or(Ok(()), |(writer, ..)| writer.finish())
    }

    fn draw(&self, canvas: &mut Canvas, look: &Look, panel: &Panel, frame: usize) -> Result<()> {
        let seen: Vec<Option<Seen>> = (0..self.tracks.marks.len()).map(|m| self.seen_at(m, frame, look)).collect();
        let marked = seen.iter().map(|s| s.map(|s| s.centre_px));
        let nodes: Vec<Option<[f64; 2]>> = self.pivot_px.map(Some).into_iter().chain(marked).collect();
        for pair in nodes.windows(2) {
            if let [Some(upper), Some(lower)] = *pair {
                marks::link(canvas, look, upper, lower)?;
            }
        }
        for mark in 0..seen.len() {
            marks::trail(canvas, look, &self.trail_of(mark, frame))?;
        }
        if let Some(pivot) = self.pivot_px {
            marks::pivot(canvas, look, pivot)?;
        }
        for (i, mark) in seen.iter().enumerate() {
            if let Some(mark) = mark {
                marks::mark(canvas, look, i + 1, *mark)?;
            }
        }
        let angles: Vec<Option<Angle>> = self.angles.links.iter().map(|l| l.get(frame).copied().flatten()).collect();
        panel.draw(canvas, self.tracks.t_s[frame], &angles)
    }

    /// Around the centroid, or around the filter's belief where the mark was not seen.
    fn seen_at(&self, mark: usize, frame: usize, look: &Look) -> Option<Seen> {
        let point = self.tracks.marks.get(mark)?.get(frame)?;
        let area_px2 = self.tracks.area_px2.get(mark).copied().unwrap_or(0.0).max(1.0);
        // a disc of that area, with air around it
        let half_px = 1.25 * (area_px2 / std::f64::consts::PI).sqrt() + 2.0 * look.line_px;
        match (point.measured, point.filtered) {
            (Some(m), _) => Some(Seen { centre_px: m.position_px, half_px, measured: true }),
            (None, Some(f)) => Some(Seen { centre_px: [f.state[0], f.state[1]], half_px, measured: false }),
            (None, None) => None,
        }
    }

    /// Age (0 now, 1 oldest) and place of a mark in the frames of the last second.
    fn trail_of(&self, mark: usize, frame: usize) -> Vec<(f64, Option<[f64; 2]>)> {
        let t_s = &self.tracks.t_s;
        let age = |i: usize| (t_s[frame] - t_s[i]) / TRAIL_S;
        let first = (0..=frame).rev().take_while(|i| (0.0..1.0).contains(&age(*i))).last().unwrap_or(frame);
        let place = |i: usize| self.tracks.marks[mark][i].measured.map(|m| m.position_px);
        (first..=frame).map(|i| (age(i), place(i))).collect()
    }
}

/// The video being drawn.
struct Film<'a> {
    overlay: &'a Overlay<'a>,
    target: &'a Path,
    /// Made for the first picture, with the panel's place.
    writer: Option<(VideoWriter, (Look, Panel), Option<Room>)>,
    /// The next frame of the tracks.
    frame: usize,
    last_pts: i64,
}

impl Film<'_> {
    fn push(&mut self, t_s: f64, mut canvas: Canvas) -> Result<()> {
        let (writer, (look, panel), room) = match &mut self.writer {
            Some(film) => film,
            none => none.insert(Self::begin(self.overlay, self.target, &canvas)?),
        };
        let stamps = &self.overlay.tracks.t_s;
        // a damaged file may decode to other frames with other threads: stamps tell which is which
        if let Some(ahead) = stamps[self.frame..].iter().take(1000).position(|t| *t == t_s) {
            let frame = self.frame + ahead;
            self.overlay.draw(&mut canvas, look, panel, frame)?;
            self.frame = frame + 1;
        }
        // a stamp that repeats or runs backwards is shown one tick later
        let pts = writer.stamp(t_s).0.max(self.last_pts.saturating_add(1));
        self.last_pts = pts;
        match room {
            Some(room) => writer.write(&canvas.at_size(room.size_px)?, pts),
            None => writer.write(canvas.picture(), pts),
        }
    }

    fn begin(
        overlay: &Overlay<'_>,
        target: &Path,
        canvas: &Canvas,
    ) -> Result<(VideoWriter, (Look, Panel), Option<Room>)> {
        let look = Look::for_size(canvas.size_px());
        let everywhere: Vec<[f64; 2]> =
            overlay.tracks.marks.iter().flatten().filter_map(|p| p.measured).map(|m| m.position_px).collect();
        let panel = Panel::new(&look, canvas, overlay.angles, &everywhere);
        let rate_hz = overlay.rate_hz.filter(|r| (0.1..=1000.0).contains(r)).unwrap_or(USUAL_RATE_HZ);
        let stamps = &overlay.tracks.t_s;
        let duration_s = stamps.last().zip(stamps.first()).map_or(0.0, |(last, first)| last - first);
        let room = overlay.most_bytes.map(|most| Room::for_bytes(most, canvas.size_px(), rate_hz, duration_s));
        let codec = Codec { most_bits_per_s: room.map(|room| room.bits_per_s), ..codec() };
        let [width_px, height_px] = room.map_or(canvas.size_px(), |room| room.size_px);
        let layout = Layout { width_px, height_px, ..canvas.picture().layout };
        let writer = VideoWriter::create(target, &codec, layout, rate_hz)?;
        Ok((writer, (look, panel), room))
    }
}
