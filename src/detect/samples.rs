//! Pictures of a recording, kept at chroma resolution, and what moves between them.

use super::LEAST_AREA_PX2;
use super::component::{HueAxis, luma_row};
use super::scene::median_plane;
use crate::statistics::median;
use crate::steady::CameraShift;
use crate::video::{Matrix, Picture};

/// One picture: luma and both colour differences at every chroma sample, 8-bit codes.
#[derive(Debug, Clone)]
pub struct Samples {
    pub width: usize,
    pub height: usize,
    pub luma: Vec<u8>,
    pub cb: Vec<u8>,
    pub cr: Vec<u8>,
}

impl Samples {
    /// Of a picture.
    pub fn of(picture: &Picture<'_>) -> Self {
        let (width, height) = picture.layout.chroma_size();
        let down = picture.layout.low_bits + picture.layout.bits - 8;
        let empty = || Vec::with_capacity(width * height);
        let mut samples = Self { width, height, luma: empty(), cb: empty(), cr: empty() };
        for y in 0..height {
            luma_row(picture, y, 0..width, &mut samples.luma, |code| code);
            for (codes, plane) in [(&mut samples.cb, &picture.cb), (&mut samples.cr, &picture.cr)] {
                if picture.wide() || plane.step != 1 {
                    codes.extend((0..width).map(|x| (plane.code(picture.wide(), x, y) >> down) as u8));
                } else {
                    codes.extend_from_slice(&plane.bytes[y * plane.stride..][..width]);
                }
            }
        }
        samples
    }

    /// The components of row `y`, added to `row`.
    pub fn row(&self, axis: HueAxis, y: usize, row: &mut Vec<i16>) {
        let range = y * self.width..(y + 1) * self.width;
        if axis.is_luma() {
            row.extend(self.luma[range].iter().map(|v| axis.of_luma(*v)));
        } else {
            row.extend(self.cb[range.clone()].iter().zip(&self.cr[range]).map(|(b, r)| axis.of(*b, *r)));
        }
    }

    /// C_b and C_r about neutral.
    pub fn chroma(&self, at: usize) -> [f64; 2] {
        [f64::from(self.cb[at]) - 128.0, f64::from(self.cr[at]) - 128.0]
    }

    fn channels(&self) -> [&[u8]; 3] {
        [&self.luma, &self.cb, &self.cr]
    }
}

/// Codes of luma, and of a colour difference, by which a sample must differ from what usually is there.
const LEAST_CHANGE: [u8; 3] = [14, 7, 7];
/// Codes of luma above black from which a sample tells the light of a picture; a code's rounding is a fiftieth of it.
const LEAST_LIGHT: f64 = 25.0;
/// The code of a colour difference without colour.
const NO_CHROMA: f64 = 128.0;
/// Pictures below which nothing is known about what moves.
const LEAST_PICTURES: usize = 3;

/// Some pictures of one recording.
#[derive(Debug, Clone, Default)]
pub struct Album {
    /// The pictures.
    pub pictures: Vec<Samples>,
    /// For every picture, where it differs from what usually is there.
    pub moved: Vec<Vec<bool>>,
    /// How colours are coded.
    pub matrix: Matrix,
    /// log₂ of luma columns and rows in a chroma sample.
    pub shifts: [u32; 2],
    /// Codes go from 0 to 255 rather than from 16 to 235.
    pub full_range: bool,
    /// Which samples are looked at; all where absent.
    pub allowed: Option<Vec<bool>>,
    /// Where the camera looks in every picture; empty where that is not known, or it stands still.
    pub camera: Vec<CameraShift>,
}

impl Album {
    /// Adds a picture; one of another size than the first is passed over.
    pub fn see(&mut self, picture: &Picture<'_>) {
        let samples = Samples::of(picture);
        if self.pictures.first().is_none_or(|p| (p.width, p.height) == (samples.width, samples.height)) {
            self.matrix = picture.layout.matrix;
            self.full_range = picture.layout.full_range;
            self.shifts = [picture.layout.chroma_shift_x, picture.layout.chroma_shift_y];
            self.pictures.push(samples);
        }
    }

    /// Looks only at these samples.
    pub fn allow(&mut self, samples: Option<Vec<bool>>) {
        self.allowed = samples;
    }

    /// A sample is looked at.
    pub(super) fn allows(&self, at: usize) -> bool {
        self.allowed.as_ref().is_none_or(|a| a[at])
    }

    /// Finds what moves, once all pictures are there: what differs from what usually is there in the light of the picture. Where the camera moves, what usually is there
    /// is known to a sample, so that what a picture shows must differ from the neighbours of its place as well.
    pub fn compare(&mut self) {
        self.moved.clear();
        if self.pictures.len() < LEAST_PICTURES {
            return;
        }
        let usual = self.usual();
        let around = (!self.camera.is_empty()).then(|| usual.each_ref().map(|plane| self.around(plane)));
        for (index, picture) in self.pictures.iter().enumerate() {
            // where every sample of the picture lies in the first one
            let places = self.camera.get(index).map(|camera| self.places(picture, |p| camera.undo(p)));
            let seen = places.as_ref().map(|places| usual.each_ref().map(|plane| at_places(plane, places)));
            let seen = seen.as_ref().unwrap_or(&usual);
            let light = self.light(picture, &seen[0]);
            let bounds = around.as_ref().zip(places.as_ref()).map(|(planes, places)| {
                planes.each_ref().map(|bounds| bounds.each_ref().map(|plane| at_places(plane, places)))
            });
            let mut moved = vec![false; seen[0].len()];
            for (channel, codes) in picture.channels().into_iter().enumerate() {
                let zero = if channel == 0 { self.black() } else { NO_CHROMA };
                let lit: [u8; 256] = std::array::from_fn(|code| (zero + light * (code as f64 - zero)).round() as u8);
                let [least, most] = bounds.as_ref().map_or([&seen[channel]; 2], |bounds| bounds[channel].each_ref());
                let change = LEAST_CHANGE[channel];
                for ((moved, code), (least, most)) in moved.iter_mut().zip(codes).zip(least.iter().zip(most)) {
                    let [least, most] = [least, most].map(|usual| lit[usize::from(*usual)]);
                    *moved |= *code > most.saturating_add(change) || *code < least.saturating_sub(change);
                }
            }
            self.moved.push(moved);
        }
    }

    /// Where the camera looks in every picture. What moves is found anew where that is as much as half a sample, below which all stays where it is; whether it is.
    pub fn steady(&mut self, shifts: Vec<CameraShift>) -> bool {
        if shifts.len() != self.pictures.len() {
            return false;
        }
        let half_px = 0.5 * f64::from(1u32 << self.shifts[0].max(self.shifts[1]));
        let moves = shifts.iter().any(|shift| shift.size_px() > half_px);
        self.camera = shifts;
        if moves {
            self.compare();
        }
        moves
    }

    /// Least and greatest code within a sample of every sample.
    fn around(&self, plane: &[u8]) -> [Vec<u8>; 2] {
        let width = self.pictures.first().map_or(1, |p| p.width).max(1);
        let of = |pick: fn(u8, u8) -> u8| {
            let mut rows = Vec::with_capacity(plane.len());
            for row in plane.chunks(width) {
                let near = |x: usize| row[x.saturating_sub(1)..(x + 2).min(row.len())].iter().copied().reduce(pick);
                rows.extend((0..row.len()).filter_map(near));
            }
            let last = plane.len() - 1;
            (0..plane.len())
                .map(|at| {
                    let above = if at >= width { at - width } else { at };
                    let below = if at + width <= last { at + width } else { at };
                    pick(rows[at], pick(rows[above], rows[below]))
                })
                .collect()
        };
        [of(u8::min), of(u8::max)]
    }

    /// For every sample of a picture, the sample to which its place is shifted, at the border the nearest.
    fn places(&self, picture: &Samples, shifted: impl Fn([f64; 2]) -> [f64; 2]) -> Vec<usize> {
        let middle = |v: usize, shift: u32| (v << shift) as f64 + 0.5 * f64::from((1u32 << shift) - 1);
        let within = |v: f64, shift: u32, size: usize| ((v + 0.5).max(0.0) as usize >> shift).min(size - 1);
        let [across, down] = self.shifts;
        let place = |at: usize| {
            let [x, y] = shifted([middle(at % picture.width, across), middle(at / picture.width, down)]);
            within(y, down, picture.height) * picture.width + within(x, across, picture.width)
        };
        (0..picture.width * picture.height).map(place).collect()
    }

    /// Whether a picture differs at a point (of the first picture, where the camera moves) from what others usually show there; `None` where there are none, or the
    /// point lies outside.
    pub fn differs(&self, picture: usize, point_px: [f64; 2], others: &[usize]) -> Option<bool> {
        let at = |k: usize| {
            let own = self.pictures.get(k)?;
            let [x, y] = self.camera.get(k).map_or(point_px, |camera| camera.apply(point_px));
            let [column, row] =
                [(x, self.shifts[0]), (y, self.shifts[1])].map(|(v, shift)| v.max(0.0) as usize >> shift);
            Some((own, row * own.width + column)).filter(|_| column < own.width && row < own.height)
        };
        let (own, here) = at(picture)?;
        let elsewhere: Vec<(&Samples, usize)> = others.iter().filter_map(|k| at(*k)).collect();
        let changes = |channel: usize| {
            let of = |(picture, at): &(&Samples, usize)| f64::from(picture.channels()[channel][*at]);
            let usual = median(&mut elsewhere.iter().map(of).collect::<Vec<_>>())?;
            Some((of(&(own, here)) - usual).abs() > f64::from(LEAST_CHANGE[channel]))
        };
        Some([0, 1, 2].into_iter().map(changes).collect::<Option<Vec<bool>>>()?.contains(&true))
    }

    /// The light of a picture over that of the usual one: the median ratio of luma. A camera that sets its exposure anew, and a lamp on the mains, change all
    /// samples alike, and nothing that swings covers half of them. Samples too dark to tell count as unchanged: before a dark wall all that is bright may swing.
    fn light(&self, picture: &Samples, usual: &[u8]) -> f64 {
        let ratio = |(code, usual): (&u8, &u8)| {
            let [code, usual] = [code, usual].map(|code| f64::from(*code) - self.black());
            if usual >= LEAST_LIGHT { code / usual } else { 1.0 }
        };
        let mut ratios: Vec<f64> = picture.luma.iter().zip(usual).map(ratio).collect();
        median(&mut ratios).unwrap_or(1.0)
    }

    /// The code of luma without any light.
    const fn black(&self) -> f64 {
        if self.full_range { 0.0 } else { 16.0 }
    }

    /// The median picture, as the camera sees it in the first: luma, C_b, C_r; of an even number of pictures the upper one of the two in the middle.
    fn usual(&self) -> [Vec<u8>; 3] {
        let shifted = self.pictures.iter().zip(&self.camera);
        let places: Vec<Vec<usize>> =
            shifted.map(|(picture, camera)| self.places(picture, |p| camera.apply(p))).collect();
        [0, 1, 2].map(|channel| {
            let steadied = self.pictures.iter().zip(&places);
            let steadied: Vec<Vec<u8>> = steadied.map(|(p, places)| at_places(p.channels()[channel], places)).collect();
            let planes: Vec<&[u8]> = if steadied.is_empty() {
                self.pictures.iter().map(|p| p.channels()[channel]).collect()
            } else {
                steadied.iter().map(Vec::as_slice).collect()
            };
            median_plane(&planes)
        })
    }

    /// Area of a chroma sample.
    pub fn sample_px2(&self) -> f64 {
        f64::from(1u32 << (self.shifts[0] + self.shifts[1]))
    }
}

/// The samples of a plane at these places.
fn at_places(plane: &[u8], places: &[usize]) -> Vec<u8> {
    places.iter().map(|at| plane[*at]).collect()
}

/// A hue that things in the pictures have.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HuePeak {
    /// From C_b towards C_r.
    pub angle_rad: f64,
    /// Chroma of all samples that have it.
    pub weight: f64,
}

const BINS: usize = 72;
/// Chroma below which a sample has no hue, codes.
const LEAST_CHROMA: f64 = 8.0;
/// What counts a sample that does not move, against one that does.
const STILL_SHARE: f64 = 0.02;
/// Half width of a hue, rad: shading, texture and the codec spread it.
const HALF_PEAK_RAD: f64 = 0.22;

impl Album {
    /// The hues within `half_width_rad` of `centre_rad`, strongest first: of what moves above all.
    pub fn hues(&self, centre_rad: f64, half_width_rad: f64) -> Vec<HuePeak> {
        let bin_rad = std::f64::consts::TAU / BINS as f64;
        let mut weights = [0.0f64; BINS];
        let mut samples: Vec<(f64, f64, bool)> = Vec::new();
        for (n, picture) in self.pictures.iter().enumerate() {
            for at in 0..picture.cb.len() {
                let [b, r] = picture.chroma(at);
                // most samples are grey: they go before anything is asked of a root or an angle
                if b * b + r * r < LEAST_CHROMA * LEAST_CHROMA || !self.allows(at) {
                    continue;
                }
                let chroma = b.hypot(r);
                let off = turn(r.atan2(b) - centre_rad);
                if off.abs() > half_width_rad {
                    continue;
                }
                let moves = self.moved.get(n).is_none_or(|m| m[at]);
                let weight = chroma * if moves { 1.0 } else { STILL_SHARE };
                let bin = ((off / bin_rad).round() as i64).rem_euclid(BINS as i64) as usize;
                weights[bin] += weight;
                samples.push((off, weight, moves));
            }
        }
        let smooth: Vec<f64> =
            (0..BINS).map(|i| weights[(i + BINS - 1) % BINS] + 2.0 * weights[i] + weights[(i + 1) % BINS]).collect();
        let mut peaks: Vec<HuePeak> = (0..BINS)
            .filter(|i| {
                let [before, after] = [(i + BINS - 1) % BINS, (i + 1) % BINS];
                smooth[*i] > 0.0 && smooth[*i] >= smooth[before] && smooth[*i] > smooth[after]
            })
            .map(|i| {
                let middle = turn(i as f64 * bin_rad);
                let near = || samples.iter().filter(|(off, ..)| turn(off - middle).abs() < HALF_PEAK_RAD);
                let weight = near().map(|(_, weight, _)| weight).sum();
                // a wall of nearly the marks' hue does not turn it: where enough moves to be marks, that alone tells
                let enough = near().filter(|(.., moves)| *moves).count() as f64 * self.sample_px2()
                    >= LEAST_AREA_PX2 * self.pictures.len() as f64;
                let telling = near().filter(|(.., moves)| *moves || !enough);
                let (sum, told) =
                    telling.fold((0.0, 0.0), |(s, w), (off, weight, _)| (s + weight * turn(off - middle), w + weight));
                HuePeak { angle_rad: turn(centre_rad + middle + sum / f64::max(told, 1e-9)), weight }
            })
            .collect();
        peaks.sort_by(|a, b| b.weight.total_cmp(&a.weight));
        peaks
    }

    /// The usual colour of some samples, (picture, sample): red, green, blue, 0 to 255.
    pub fn colour_of(&self, samples: &[(usize, usize)]) -> Option<[u8; 3]> {
        let code = |channel: usize| {
            let mut codes: Vec<f64> =
                samples.iter().map(|(n, at)| f64::from(self.pictures[*n].channels()[channel][*at])).collect();
            median(&mut codes)
        };
        Some(self.rgb_of([code(0)?, code(1)?, code(2)?]))
    }

    /// Codes of luma, C_b and C_r → red, green, blue, 0 to 255.
    pub fn rgb(&self, codes: [u8; 3]) -> [u8; 3] {
        self.rgb_of(codes.map(f64::from))
    }

    fn rgb_of(&self, [y, cb, cr]: [f64; 3]) -> [u8; 3] {
        let (luma_span, chroma_span) = if self.full_range { (255.0, 255.0) } else { (219.0, 224.0) };
        let ycbcr = [(y - self.black()) / luma_span, (cb - NO_CHROMA) / chroma_span, (cr - NO_CHROMA) / chroma_span];
        self.matrix.rgb(ycbcr).map(|c| (255.0 * c).round().clamp(0.0, 255.0) as u8)
    }
}

/// An angle in −π..π.
pub fn turn(angle_rad: f64) -> f64 {
    let tau = std::f64::consts::TAU;
    angle_rad - tau * (angle_rad / tau).round()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A grey picture of 40×40 samples with a square of a colour difference at (x, y).
    fn picture(x: usize, cb: u8, cr: u8) -> Samples {
        let mut samples =
            Samples { width: 40, height: 40, luma: vec![100; 1600], cb: vec![128; 1600], cr: vec![128; 1600] };
        for j in 10..16 {
            for i in x..x + 6 {
                (samples.cb[40 * j + i], samples.cr[40 * j + i]) = (cb, cr);
            }
            // what stands still and has a hue as well
            (samples.cb[40 * j + 39], samples.cr[40 * j + 39]) = (100, 170);
        }
        samples
    }

    #[test]
    fn a_wall_of_nearly_the_marks_hue_does_not_turn_it() {
        let mut pictures: Vec<Samples> = (0..5).map(|i| picture(6 * i, 68, 193)).collect();
        for (cb, cr) in pictures.iter_mut().flat_map(|p| p.cb.iter_mut().zip(&mut p.cr)) {
            if (*cb, *cr) == (128, 128) {
                (*cb, *cr) = (98, 153);
            }
        }
        let mut album = Album { pictures, ..Album::default() };
        album.compare();
        let moving = 65.0f64.atan2(-60.0);
        let peaks = album.hues(moving, 0.35);
        assert!(turn(peaks[0].angle_rad - moving).abs() < 0.01, "{peaks:?}");
    }

    #[test]
    fn light_that_changes_moves_nothing() {
        let mut pictures: Vec<Samples> = (0..5).map(|i| picture(6 * i, 68, 193)).collect();
        for (n, picture) in pictures.iter_mut().enumerate() {
            let light = 0.8 + 0.1 * n as f64;
            let lit = |code: &mut u8, zero: f64| *code = (zero + light * (f64::from(*code) - zero)).round() as u8;
            picture.luma.iter_mut().for_each(|code| lit(code, 16.0));
            picture.cb.iter_mut().chain(&mut picture.cr).for_each(|code| lit(code, NO_CHROMA));
        }
        let mut album = Album { pictures, ..Album::default() };
        album.compare();
        for (n, moved) in album.moved.iter().enumerate() {
            let own = |at: usize| (6 * n..6 * n + 6).contains(&(at % 40)) && (10..16).contains(&(at / 40));
            assert!(moved.iter().enumerate().all(|(at, moved)| *moved == own(at)), "{n}");
        }
    }

    #[test]
    fn a_picture_differs_from_the_others_where_something_is_that_they_do_not_show_there() {
        let mut album = Album { pictures: (0..5).map(|i| picture(6 * i, 168, 108)).collect(), ..Album::default() };
        album.shifts = [1, 1];
        // the square of picture 2, in pixels of luma, and the wall beside it
        let (own, wall) = ([2.0 * 14.0, 2.0 * 12.0], [2.0 * 35.0, 2.0 * 4.0]);
        assert_eq!(album.differs(2, own, &[0, 1, 3, 4]), Some(true));
        assert_eq!(album.differs(2, wall, &[0, 1, 3, 4]), Some(false));
        assert_eq!(album.differs(0, own, &[1, 3, 4]), Some(false));
        // nothing to compare with, and no such point
        assert_eq!(album.differs(2, own, &[]), None);
        assert_eq!(album.differs(2, [900.0, 0.0], &[0, 1]), None);
    }

    #[test]
    fn the_hue_of_what_moves_comes_before_that_of_what_stands() {
        let mut album = Album { pictures: (0..5).map(|i| picture(6 * i, 168, 108)).collect(), ..Album::default() };
        album.compare();
        let peaks = album.hues(0.0, std::f64::consts::PI);
        let moving = (-20.0f64).atan2(40.0);
        assert!(turn(peaks[0].angle_rad - moving).abs() < 0.02, "{peaks:?}");
        assert!(album.moved[0][40 * 12 + 2] && !album.moved[0][40 * 12 + 39]);
    }
}
