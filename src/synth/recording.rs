//! A whole synthetic recording: frames with their stamps and their truth.

use std::collections::VecDeque;
use std::path::Path;

use rand::SeedableRng;
use rand::rngs::Xoshiro256PlusPlus;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;

use super::backdrop::{Backdrop, blend, box_distance};
use super::lens::Distortion;
use super::paint::{Edge, Light, Outline, RowCover, StripLook, light_of};
use super::sensor::{Exposure, Region, Sensor};
use super::swing::Swing;
use super::truth::{PendingTable, Truth};
use crate::error::{Error, Result};
use crate::experiment::{Experiment, MarkColour, Render, Rgb};
use crate::video::TICKS_PER_SECOND;
use crate::video::{Layout, OwnedPicture, VideoWriter};

/// One frame of a synthetic recording.
#[derive(Debug, Clone, PartialEq)]
pub struct SynthFrame {
    /// The samples, as a decoder of a lossless file would give them.
    pub picture: OwnedPicture,
    /// Its stamp, and what a perfect measurement reads.
    pub truth: Truth,
}

/// A recording that can be rendered, frame by frame, in any order.
#[derive(Debug)]
pub struct Recording {
    render: Render,
    swing: Swing,
    distortion: Distortion,
    /// Undistorted position of every pixel, where the lens distorts.
    undistorted_px: Option<Vec<[f32; 2]>>,
    edge: Edge,
    look: StripLook,
    strip: Light,
    marks: Vec<Light>,
    sensor: Sensor,
    backdrop: Vec<Light>,
    whole: Exposure,
    stamps_s: Vec<f64>,
}

impl Recording {
    /// Simulates the swing and paints what does not move.
    ///
    /// # Errors
    /// [`Error::Option`] for a value outside its interval, [`Error::Simulation`] for a motion that cannot be simulated.
    pub fn of(experiment: &Experiment) -> Result<Self> {
        let render = experiment.render.clone();
        render.validate().map_err(|message| Error::Option { option: "[render]".to_owned(), message })?;
        let swing = Swing::of(experiment)?;
        let hinge_unmarked = experiment.rig.pivot_px.is_some();
        let mark_count = experiment.specimen.lengths_m().len() + usize::from(!hinge_unmarked);
        let marks = mark_lights(&experiment.rig.marks, mark_count, render.gamma)?;
        let distortion = Distortion::of(&render);
        let edge = Edge::new(render.lens_blur_px);
        let backdrop = Backdrop::new(&render, &edge, swing.hinge_px(), swing.roll_rad()).paint(&distortion);
        let sensor = Sensor::new(&render);
        let whole = Region { left: 0, top: 0, right: render.width_px as usize, bottom: render.height_px as usize };
        let look = StripLook {
            half_width_px: 0.5 * render.strip_width_px,
            overhang_px: 0.9 * render.mark_diameter_px,
            sheen: render.strip_sheen,
            slope: render.strip_slope,
            mark_radius_px: 0.5 * render.mark_diameter_px,
            hinge_unmarked,
        };
        Ok(Self {
            undistorted_px: (!distortion.is_identity()).then(|| undistorted(&distortion, whole)),
            whole: sensor.expose(whole, &backdrop),
            strip: light_of(render.strip_rgb, render.gamma),
            stamps_s: stamps(&render),
            swing,
            distortion,
            edge,
            look,
            marks,
            sensor,
            backdrop,
            render,
        })
    }

    /// Frames in the file, dropped ones left out.
    pub fn len(&self) -> usize {
        self.stamps_s.len()
    }

    /// Never: a recording has a frame.
    pub fn is_empty(&self) -> bool {
        self.stamps_s.is_empty()
    }

    /// How the samples lie.
    pub fn layout(&self) -> Layout {
        self.sensor.layout()
    }

    /// The stamps of the frames.
    pub fn stamps_s(&self) -> &[f64] {
        &self.stamps_s
    }

    /// What a perfect measurement reads in frame `index`; the last frame's where there are not as many.
    pub fn truth(&self, index: usize) -> Truth {
        let index = index.min(self.len() - 1);
        let t_s = self.stamps_s[index];
        let first = usize::from(self.look.hinge_unmarked);
        let nodes = self.swing.nodes_px(t_s);
        let marks_px = (first..nodes.len()).map(|node| self.node_seen_px(node, nodes[node], t_s)).collect();
        Truth { frame: index as u64, t_s, marks_px, theta_rad: self.swing.angles_rad(t_s) }
    }

    /// Renders frame `index`; the last one where there are not as many. The same index gives the same frame to the bit.
    pub fn frame(&self, index: usize) -> SynthFrame {
        let truth = self.truth(index);
        let changed = self.expose_strip(truth.t_s);
        SynthFrame { picture: self.sensor.read_out(truth.frame, &self.whole, &changed), truth }
    }

    /// All frames in order, rendered on all cores a few ahead.
    pub fn frames(&self) -> impl Iterator<Item = SynthFrame> + '_ {
        let ahead = 2 * rayon::current_num_threads();
        let mut ready = VecDeque::with_capacity(ahead);
        let mut next = 0;
        std::iter::from_fn(move || {
            if ready.is_empty() {
                let until = (next + ahead).min(self.len());
                let batch: Vec<SynthFrame> = (next..until).into_par_iter().map(|i| self.frame(i)).collect();
                ready.extend(batch);
                next = until;
            }
            ready.pop_front()
        })
    }

    /// Writes the video and, where asked for, its truth. Both appear finished or not at all. `after_frame` is told how many frames are
    /// done, and stops the work by an error.
    ///
    /// # Errors
    /// [`Error::Unwritable`] and [`Error::Encode`] from the files, and whatever `after_frame` returns.
    pub fn write(
        &self,
        video: &Path,
        truth: Option<&Path>,
        after_frame: &mut dyn FnMut(usize) -> Result<()>,
    ) -> Result<()> {
        if self.render.jitter_s > 0.0 && video.extension().is_some_and(|e| e.eq_ignore_ascii_case("avi")) {
            let detail = "AVI keeps no time stamps; set render.jitter_s = 0, or use .mp4, .mov or .mkv".to_owned();
            return Err(Error::Encode { path: video.to_owned(), detail });
        }
        let table = truth.map(|path| Ok((PendingTable::beside(path)?, path))).transpose()?;
        let mut writer = VideoWriter::create(video, &self.render.codec, self.layout(), self.render.fps)?;
        let mut rows = Vec::with_capacity(self.len());
        for frame in self.frames() {
            let (pts, _) = writer.stamp(frame.truth.t_s);
            writer.write(&frame.picture, pts)?;
            rows.push(frame.truth);
            after_frame(rows.len())?;
        }
        writer.finish()?;
        table.map_or(Ok(()), |(table, path)| table.finish(&rows, path))
    }

    /// Stamp of a row's own exposure, from that of the picture.
    fn row_stamp_s(&self, t_s: f64, y_px: f64) -> f64 {
        t_s + self.render.row_time_s * (y_px - 0.5 * (f64::from(self.render.height_px) - 1.0))
    }

    /// Where a node is seen: with a rolling shutter, in the row that is exposed just when the node is there.
    fn node_seen_px(&self, node: usize, at_stamp: [f64; 2], t_s: f64) -> [f64; 2] {
        let mut seen = self.distortion.distort(at_stamp);
        if self.render.row_time_s > 0.0 {
            // A contraction by speed × row time, some hundredths.
            for _ in 0..12 {
                let nodes = self.swing.nodes_px(self.row_stamp_s(t_s, seen[1]));
                seen = self.distortion.distort(nodes[node]);
            }
        }
        seen
    }

    /// The strip at the instants of one exposure, close enough together that their blurred edges merge.
    fn outlines(&self, t_s: f64) -> Vec<Outline> {
        let exposure_s = self.render.exposure_s;
        let (before, after) =
            (self.swing.nodes_px(t_s - 0.5 * exposure_s), self.swing.nodes_px(t_s + 0.5 * exposure_s));
        let path = |(a, b): (&[f64; 2], &[f64; 2])| (a[0] - b[0]).hypot(a[1] - b[1]);
        let longest_px = before.iter().zip(&after).map(path).fold(0.0, f64::max);
        let count = (longest_px / (0.25 * self.edge.reach_px())).ceil().clamp(1.0, 64.0);
        let instant = |i: usize| t_s + exposure_s * ((i as f64 + 0.5) / count - 0.5);
        (0..count as usize).map(|i| Outline::new(self.look, &self.swing.nodes_px(instant(i)))).collect()
    }

    /// Exposes the part of the picture in which something moves.
    fn expose_strip(&self, t_s: f64) -> Exposure {
        let occlusions: Vec<_> =
            self.render.occlusions.iter().filter(|o| (o.from_s..o.until_s).contains(&t_s)).collect();
        let mut outlines = self.outlines(t_s);
        let rolling = self.render.row_time_s > 0.0;
        let mut boxes: Vec<[f64; 4]> = outlines.iter().map(|o| self.seen_bounds(o.bounds_px(&self.edge))).collect();
        if rolling {
            let rows = (0..=8).map(|i| f64::from(i * self.render.height_px) / 8.0);
            let shifted = rows.flat_map(|y| self.outlines(self.row_stamp_s(t_s, y)));
            boxes.extend(shifted.map(|o| self.seen_bounds(o.bounds_px(&self.edge)).map(|v| v)));
        }
        boxes.extend(occlusions.iter().map(|o| {
            let [left, top, width, height] = o.rect_px;
            let reach = self.edge.reach_px();
            [left - reach, top - reach, left + width + reach, top + height + reach]
        }));
        let region = self.region_around(&boxes);
        let mut light = Vec::with_capacity(region.width() * region.height());
        let mut row = RowCover::new(region.left, region.right, self.marks.len());
        row.widen(self.largest_shift_px(region));
        for y in region.top..region.bottom {
            if rolling {
                outlines = self.outlines(self.row_stamp_s(t_s, y as f64));
            }
            self.cover_row(&outlines, &mut row, region, y);
            self.light_row(&row, outlines.len() as f32, region, y, &mut light);
        }
        for occlusion in occlusions {
            let [left, top, width, height] = occlusion.rect_px;
            let (half, centre) = ([0.5 * width, 0.5 * height], [left + 0.5 * width, top + 0.5 * height]);
            let over = light_of(occlusion.rgb, self.render.gamma);
            for (i, pixel) in light.iter_mut().enumerate() {
                let p = [(region.left + i % region.width()) as f64, (region.top + i / region.width()) as f64];
                blend(pixel, over, self.edge.coverage(-box_distance(p, centre, half, 0.0)));
            }
        }
        self.sensor.expose(region, &light)
    }

    fn cover_row(&self, outlines: &[Outline], row: &mut RowCover, region: Region, y: usize) {
        row.clear();
        let width = self.render.width_px as usize;
        match &self.undistorted_px {
            None => {
                for outline in outlines {
                    outline.add_row(&self.edge, row, [y as f64; 2], |x| [x as f64, y as f64]);
                }
            }
            Some(map) => {
                let of_row = &map[y * width..][..width];
                let span = of_row[region.left..region.right]
                    .iter()
                    .fold([f64::MAX, f64::MIN], |s, p| [s[0].min(f64::from(p[1])), s[1].max(f64::from(p[1]))]);
                for outline in outlines {
                    outline.add_row(&self.edge, row, span, |x| of_row[x].map(f64::from));
                }
            }
        }
    }

    fn light_row(&self, row: &RowCover, instants: f32, region: Region, y: usize, light: &mut Vec<Light>) {
        let behind = &self.backdrop[y * self.render.width_px as usize..][region.left..region.right];
        for (i, backdrop) in behind.iter().enumerate() {
            let shade = row.strip_light[i] / instants;
            let marked: f32 = row.marks.iter().map(|m| m[i]).sum::<f32>() / instants;
            let bare = 1.0 - row.strip_cover[i] / instants - marked;
            let mut pixel = [0.0; 3];
            for (c, value) in pixel.iter_mut().enumerate() {
                *value = backdrop[c] * bare + self.strip[c] * shade;
                for (mark, cover) in self.marks.iter().zip(&row.marks) {
                    *value += mark[c] * cover[i] / instants;
                }
            }
            light.push(pixel);
        }
    }

    /// The smallest region around these boxes, with the margin the chroma filter needs, on even pixels.
    fn region_around(&self, boxes: &[[f64; 4]]) -> Region {
        let (width, height) = (self.render.width_px as usize, self.render.height_px as usize);
        let all = boxes.iter().fold([f64::MAX, f64::MAX, f64::MIN, f64::MIN], |a, b| {
            [a[0].min(b[0]), a[1].min(b[1]), a[2].max(b[2]), a[3].max(b[3])]
        });
        let low = |v: f64, side: usize| ((v - 4.0).max(0.0) as usize).min(side.saturating_sub(2)) & !1;
        let high = |v: f64, side: usize| (((v + 4.0).max(2.0) as usize).min(side) + 1) & !1;
        let (left, top) = (low(all[0], width), low(all[1], height));
        Region {
            left,
            top,
            right: high(all[2], width).clamp(left + 2, width.max(left + 2)),
            bottom: high(all[3], height).clamp(top + 2, height.max(top + 2)),
        }
    }

    /// A box of the undistorted picture, as seen.
    fn seen_bounds(&self, [left, top, right, bottom]: [f64; 4]) -> [f64; 4] {
        if self.distortion.is_identity() {
            return [left, top, right, bottom];
        }
        let along = |i: i32| f64::from(i) / 8.0;
        let border = (0..=8).flat_map(|i| {
            let (x, y) = (left + along(i) * (right - left), top + along(i) * (bottom - top));
            [[x, top], [x, bottom], [left, y], [right, y]]
        });
        let seen = border.map(|p| self.distortion.distort(p)).fold([f64::MAX, f64::MAX, f64::MIN, f64::MIN], |b, p| {
            [b[0].min(p[0]), b[1].min(p[1]), b[2].max(p[0]), b[3].max(p[1])]
        });
        // Between the sampled points a border bulges by less than this.
        [seen[0] - 4.0, seen[1] - 4.0, seen[2] + 4.0, seen[3] + 4.0]
    }

    /// How far the lens moves a column in a region, at most.
    fn largest_shift_px(&self, region: Region) -> f64 {
        let Some(map) = &self.undistorted_px else { return 0.0 };
        let width = self.render.width_px as usize;
        let rows = (region.top..region.bottom).map(|y| &map[y * width..][..width]);
        let shift = |(x, p): (usize, &[f32; 2])| (f64::from(p[0]) - (region.left + x) as f64).abs();
        rows.flat_map(|row| row[region.left..region.right].iter().enumerate().map(shift)).fold(0.0, f64::max)
    }
}

fn mark_lights(colours: &[MarkColour], count: usize, gamma: f64) -> Result<Vec<Light>> {
    if !colours.is_empty() && colours.len() != count {
        let message = format!("names {} colours for {count} marks; name one a mark, top to bottom", colours.len());
        return Err(Error::Option { option: "rig.marks".to_owned(), message });
    }
    // Paint, not light: no channel is quite black or quite white.
    let paint = |c: u8| 20 + (f64::from(c) * 0.76) as u8;
    let red = MarkColour::red();
    let colour = |i: usize| Rgb(colours.get(i).unwrap_or(&red).rgb.map(paint));
    Ok((0..count).map(|i| light_of(colour(i), gamma)).collect())
}

fn undistorted(distortion: &Distortion, whole: Region) -> Vec<[f32; 2]> {
    let at = |i: usize| [(i % whole.width()) as f64, (i / whole.width()) as f64];
    (0..whole.width() * whole.height()).map(|i| distortion.undistort(at(i)).map(|v| v as f32)).collect()
}

/// The stamps of the frames that are not dropped, on the file's ticks.
fn stamps(render: &Render) -> Vec<f64> {
    let tick_s = 1.0 / f64::from(TICKS_PER_SECOND);
    let stamp = |n: u64| {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(!render.seed ^ n.wrapping_mul(0x2545_f491_4f6c_dd1d));
        let draw: f64 = StandardNormal.sample(&mut rng);
        let jitter_s = (render.jitter_s * draw).clamp(-0.4 / render.fps, 0.4 / render.fps);
        let t_s = (render.start_s + n as f64 / render.fps + jitter_s).max(0.0);
        (t_s / tick_s).round() * tick_s
    };
    (0..render.nominal_frames()).filter(|n| !render.dropped_frames.contains(n)).map(stamp).collect()
}
