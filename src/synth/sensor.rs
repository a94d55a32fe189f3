//! Light → samples: gamma, colour differences with their siting, noise, rounding.

use rand::rngs::Xoshiro256PlusPlus;
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};

use super::paint::Light;
use crate::experiment::{Noise, Render};
use crate::video::{Layout, OwnedPicture};

/// A rectangle of pixels, left and top inclusive, right and bottom exclusive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Region {
    /// First column.
    pub left: usize,
    /// First row.
    pub top: usize,
    /// One past the last column.
    pub right: usize,
    /// One past the last row.
    pub bottom: usize,
}

impl Region {
    /// Columns.
    pub fn width(&self) -> usize {
        self.right - self.left
    }

    /// Rows.
    pub fn height(&self) -> usize {
        self.bottom - self.top
    }
}

/// Noiseless samples of a region: codes before rounding, and the noise's standard deviation in codes.
#[derive(Debug, Clone)]
pub struct Exposure {
    /// Where it lies in the picture, in luma pixels. Even sides where the chroma is subsampled.
    pub region: Region,
    /// Luma, C_b, C_r.
    codes: [Vec<f32>; 3],
    noise: [Vec<f32>; 3],
}

/// A camera's sensor and its coding.
#[derive(Debug)]
pub struct Sensor {
    layout: Layout,
    gamma_table: Vec<f32>,
    noise: Noise,
    /// Share of the sensor's noise that each plane keeps.
    noise_gain: [f32; 3],
    /// A long draw of the normal distribution; every row of every frame starts at its own place in it.
    normal: Vec<f32>,
    seed: u64,
}

impl Sensor {
    const GAMMA_STEPS: usize = 8192;
    const NORMAL_LENGTH: usize = 1 << 18;

    /// The sensor of a recording. `seed` makes its noise.
    pub fn new(render: &Render) -> Self {
        let layout = render.codec.layout(render.width_px, render.height_px);
        // Stepped in √light, where the coded signal is nearly straight.
        let step = |i: usize| (i as f64 / Self::GAMMA_STEPS as f64).powf(2.0 / render.gamma) as f32;
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(render.seed);
        let length = Self::NORMAL_LENGTH + layout.width_px;
        Self {
            layout,
            gamma_table: (0..=Self::GAMMA_STEPS + 1).map(step).collect(),
            noise: render.noise,
            noise_gain: noise_gain(&layout),
            normal: (0..length).map(|_| StandardNormal.sample(&mut rng)).collect(),
            seed: render.seed,
        }
    }

    /// How its samples lie.
    pub fn layout(&self) -> Layout {
        self.layout
    }

    /// Exposes a region to light, row after row. Chroma samples whose filter reaches over the region's border, inside the picture, are
    /// only right where the border's light repeats: leave a margin of two pixels that did not change.
    pub fn expose(&self, region: Region, light: &[Light]) -> Exposure {
        let (black, span) = self.layout.luma_scale();
        let (neutral, chroma_span) = self.layout.chroma_scale();
        let mut luma = Vec::with_capacity(light.len());
        let mut blue = Vec::with_capacity(light.len());
        let mut red = Vec::with_capacity(light.len());
        let (kr, kb) = self.layout.matrix.luma_weights();
        let (kr, kb) = (kr as f32, kb as f32);
        for pixel in light {
            let [r, g, b] = pixel.map(|c| self.coded(c));
            let y = kr * r + (1.0 - kr - kb) * g + kb * b;
            luma.push(y);
            blue.push((b - y) / (2.0 * (1.0 - kb)));
            red.push((r - y) / (2.0 * (1.0 - kr)));
        }
        let signal = self.subsampled(&luma, region);
        let noise = |plane: usize, values: &[f32]| -> Vec<f32> {
            let scale = if plane == 0 { span } else { chroma_span } as f32 * self.noise_gain[plane];
            let (read2, shot2) =
                ((self.noise.read * self.noise.read) as f32, (self.noise.shot * self.noise.shot) as f32);
            values.iter().map(|v| scale * (read2 + shot2 * v.max(0.0)).sqrt()).collect()
        };
        let noise = [noise(0, &luma), noise(1, &signal), noise(2, &signal)];
        let code = |values: Vec<f32>, zero: f64, span: f64| -> Vec<f32> {
            values.into_iter().map(|v| zero as f32 + span as f32 * v).collect()
        };
        let blue = code(self.subsampled(&blue, region), neutral, chroma_span);
        let red = code(self.subsampled(&red, region), neutral, chroma_span);
        Exposure { region, codes: [code(luma, black, span), blue, red], noise }
    }

    /// Reads frame `frame` out: the whole picture's exposure with a changed part laid over it, noise, and rounding.
    pub fn read_out(&self, frame: u64, whole: &Exposure, changed: &Exposure) -> OwnedPicture {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(self.seed ^ frame.wrapping_mul(0x9e37_79b9_7f4a_7c15));
        let most = ((1u32 << self.layout.bits) - 1) as f32;
        let noisy = self.noise.read > 0.0 || self.noise.shot > 0.0;
        let planes = [0, 1, 2].map(|plane| {
            let (width, height) = self.plane_size(plane);
            let patch = self.patch(plane, changed.region, whole.region);
            let sample = if self.layout.bits > 8 { 2 } else { 1 };
            let mut bytes = vec![0u8; width * height * sample];
            let mut row = vec![0f32; width];
            for (y, out) in bytes.chunks_exact_mut(width * sample).enumerate() {
                let normal = &self.normal[rng.random_range(0..Self::NORMAL_LENGTH)..][..width];
                let from_whole = y * width;
                let mut put = |columns: std::ops::Range<usize>, source: &Exposure, first: usize| {
                    let codes = &source.codes[plane][first..first + columns.len()];
                    let noise = &source.noise[plane][first..first + columns.len()];
                    let normal = &normal[columns.clone()];
                    for (((out, code), noise), normal) in row[columns].iter_mut().zip(codes).zip(noise).zip(normal) {
                        *out = if noisy { code + noise * normal } else { *code };
                    }
                };
                put(0..width, whole, from_whole);
                if (patch.rows.top..patch.rows.bottom).contains(&y) {
                    let first = (y - patch.origin[1]) * patch.width + patch.rows.left - patch.origin[0];
                    put(patch.rows.left..patch.rows.right, changed, first);
                }
                round_into(&row, most, out);
            }
            bytes
        });
        OwnedPicture { layout: self.layout, planes }
    }

    /// V = light^(1/gamma), from the table.
    fn coded(&self, light: f32) -> f32 {
        let at = light.clamp(0.0, 1.0).sqrt() * Self::GAMMA_STEPS as f32;
        let i = at as usize;
        let (low, high) = (self.gamma_table[i], self.gamma_table[i + 1]);
        low + (high - low) * (at - i as f32)
    }

    fn plane_size(&self, plane: usize) -> (usize, usize) {
        if plane == 0 { (self.layout.width_px, self.layout.height_px) } else { self.layout.chroma_size() }
    }

    /// Where a changed region lies in a plane, without the chroma samples on its inner borders.
    fn patch(&self, plane: usize, region: Region, whole: Region) -> Patch {
        if plane == 0 {
            return Patch { rows: region, origin: [region.left, region.top], width: region.width() };
        }
        let (sx, sy) = (self.layout.chroma_shift_x, self.layout.chroma_shift_y);
        let inner = |border: usize, outer: usize, shift: u32| usize::from(border != outer && shift == 1);
        let (left, top) = (region.left >> sx, region.top >> sy);
        let (right, bottom) = ((region.right + (1 << sx) - 1) >> sx, (region.bottom + (1 << sy) - 1) >> sy);
        let rows = Region {
            left: left + inner(region.left, whole.left, sx),
            top: top + inner(region.top, whole.top, sy),
            right: right - inner(region.right, whole.right, sx),
            bottom: bottom - inner(region.bottom, whole.bottom, sy),
        };
        Patch { rows, origin: [left, top], width: right - left }
    }

    /// Halves a plane in the directions the layout asks for. On a co-sited axis the filter is [1 2 1]/4, between two samples [1 1]/2;
    /// at the border the outermost sample repeats.
    fn subsampled(&self, full: &[f32], region: Region) -> Vec<f32> {
        let (width, height) = (region.width(), region.height());
        let narrow = if self.layout.chroma_shift_x == 0 {
            full.to_vec()
        } else {
            let cosited = self.layout.chroma_site_px[0] == 0.0;
            full.chunks_exact(width)
                .flat_map(|row| (0..width.div_ceil(2)).map(move |i| halved(row, i, cosited)))
                .collect()
        };
        if self.layout.chroma_shift_y == 0 {
            return narrow;
        }
        let width = narrow.len() / height;
        let cosited = self.layout.chroma_site_px[1] == 0.0;
        let row = |y: usize| &narrow[y.min(height - 1) * width..][..width];
        let mut low = Vec::with_capacity(width * height.div_ceil(2));
        for j in 0..height.div_ceil(2) {
            let (here, below) = (row(2 * j), row(2 * j + 1));
            if cosited {
                let above = row((2 * j).saturating_sub(1));
                low.extend((0..width).map(|x| 0.25 * above[x] + 0.5 * here[x] + 0.25 * below[x]));
            } else {
                low.extend((0..width).map(|x| 0.5 * (here[x] + below[x])));
            }
        }
        low
    }
}

/// A changed region in one plane.
struct Patch {
    /// The samples to replace.
    rows: Region,
    /// The plane sample at which the exposure's own rows begin.
    origin: [usize; 2],
    /// Samples in a row of the exposure.
    width: usize,
}

fn halved(row: &[f32], i: usize, cosited: bool) -> f32 {
    let (here, after) = (row[2 * i], row[(2 * i + 1).min(row.len() - 1)]);
    if cosited { 0.25 * row[(2 * i).saturating_sub(1)] + 0.5 * here + 0.25 * after } else { 0.5 * (here + after) }
}

/// Equal, independent noise in R′, G′ and B′ of standard deviation 1, as it arrives in Y′, C_b and C_r after subsampling.
fn noise_gain(layout: &Layout) -> [f32; 3] {
    let (kr, kb) = layout.matrix.luma_weights();
    let kg = 1.0 - kr - kb;
    let filter = |shift: u32, site: f64| match (shift, site == 0.0) {
        (0, _) => 1.0,
        (_, true) => (0.0625f64 + 0.25 + 0.0625).sqrt(),
        (_, false) => 0.5f64.sqrt(),
    };
    let [sx, sy] = layout.chroma_site_px;
    let kept = filter(layout.chroma_shift_x, sx) * filter(layout.chroma_shift_y, sy);
    let difference = |k: f64, a: f64, b: f64| kept * ((1.0 - k).powi(2) + a * a + b * b).sqrt() / (2.0 * (1.0 - k));
    [(kr * kr + kg * kg + kb * kb).sqrt() as f32, difference(kb, kr, kg) as f32, difference(kr, kg, kb) as f32]
}

fn round_into(row: &[f32], most: f32, out: &mut [u8]) {
    if out.len() == row.len() {
        for (byte, value) in out.iter_mut().zip(row) {
            *byte = (value + 0.5).clamp(0.0, most) as i32 as u8;
        }
    } else {
        for (pair, value) in out.chunks_exact_mut(2).zip(row) {
            pair.copy_from_slice(&((value + 0.5).clamp(0.0, most) as u16).to_le_bytes());
        }
    }
}
