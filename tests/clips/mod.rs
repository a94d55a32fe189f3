//! Small clips of three discs on a swinging strip, painted sample by sample.

use std::path::Path;

use freeswing::experiment::Codec;
use freeswing::video::{OwnedPicture, VideoWriter};

pub type Rgb = [f32; 3];

pub const RED: Rgb = [200.0, 30.0, 30.0];
pub const GREEN: Rgb = [30.0, 150.0, 50.0];
pub const BLUE: Rgb = [38.0, 66.0, 170.0];
const STRIP: Rgb = [176.0, 174.0, 168.0];
const SIZE: [usize; 2] = [320, 240];
const RATE_HZ: f64 = 30.0;
const HINGE_PX: [f64; 2] = [160.0, 30.0];
const LINKS_PX: [f64; 2] = [90.0, 85.0];
const SWINGS_HZ: [f64; 2] = [1.2, 2.9];

/// What is before the camera.
pub struct Scene {
    /// Nodes with a mark, and its colour.
    pub marks: Vec<(usize, Rgb)>,
    pub radius_px: f64,
    pub amplitude_rad: f64,
    /// Factor of x: the plane of the swing is turned.
    pub squeeze: f64,
    /// Discs on the wall.
    pub still: Vec<([f64; 2], f64, Rgb)>,
    pub exposure_s: f64,
    pub shake_px: f64,
    /// From this time on the camera looks so far beside.
    pub knocked: (f64, f64),
    /// The camera turns away, so far to the left a second.
    pub drift_px_s: f64,
    /// A wall of one grey shows no shift.
    pub plain_wall: bool,
    /// From when to when the two lower marks are to be seen.
    pub uncovered_s: [f64; 2],
    /// A second pendulum beside the first.
    pub twin: bool,
    /// A red thing that walks across.
    pub passing: bool,
    /// How far the second mark slides on the strip.
    pub loose_px: f64,
    pub light: f32,
}

impl Default for Scene {
    fn default() -> Self {
        Self {
            marks: vec![(0, RED), (1, RED), (2, RED)],
            radius_px: 7.0,
            amplitude_rad: 0.3,
            squeeze: 1.0,
            still: Vec::new(),
            exposure_s: 0.002,
            shake_px: 0.0,
            knocked: (f64::MAX, 0.0),
            drift_px_s: 0.0,
            plain_wall: false,
            uncovered_s: [0.0, f64::MAX],
            twin: false,
            passing: false,
            loose_px: 0.0,
            light: 1.0,
        }
    }
}

impl Scene {
    /// Hinge, joint and tip.
    pub fn nodes_px(&self, t_s: f64) -> [[f64; 2]; 3] {
        let phase = SWINGS_HZ.map(|f| std::f64::consts::TAU * f * t_s);
        let first = self.amplitude_rad * (phase[0].cos() + 0.15 * phase[1].cos());
        let second = self.amplitude_rad * (1.2 * phase[0].cos() - 0.25 * phase[1].cos());
        let below = |[x, y]: [f64; 2], length_px: f64, theta: f64| {
            [x + self.squeeze * length_px * theta.sin(), y + length_px * theta.cos()]
        };
        let slid_px = self.loose_px * (5.0 * t_s).sin();
        let joint = below(HINGE_PX, LINKS_PX[0] + slid_px, first);
        [HINGE_PX, joint, below(below(HINGE_PX, LINKS_PX[0], first), LINKS_PX[1], second)]
    }

    fn picture(&self, frame: usize) -> Canvas {
        let t_s = frame as f64 / RATE_HZ;
        let shaken = [1.0, 0.7].map(|part| part * self.shake_px * (7.0 * t_s + part).sin());
        let knocked_px = if t_s > self.knocked.0 { self.knocked.1 } else { 0.0 };
        let shift = moved(shaken, [self.drift_px_s * t_s + knocked_px, 0.0]);
        let mut canvas = Canvas::wall(shift, if self.plain_wall { 0.0 } else { 1.0 });
        for (at, radius_px, colour) in &self.still {
            canvas.disc(moved(*at, shift), *radius_px, *colour, 1.0);
        }
        let steps = if self.exposure_s > 0.01 { 9 } else { 1 };
        let wall = canvas.clone();
        let mut sum = vec![[0.0; 3]; wall.rgb.len()];
        for step in 0..steps {
            let mut exposure = wall.clone();
            let when_s = t_s + self.exposure_s * ((f64::from(step) + 0.5) / f64::from(steps) - 0.5);
            self.paint_pendulum(&mut exposure, when_s, shift, 0.0);
            if self.twin {
                self.paint_pendulum(&mut exposure, when_s, shift, 110.0);
            }
            sum.iter_mut().zip(&exposure.rgb).for_each(|(s, p)| (0..3).for_each(|k| s[k] += p[k] / steps as f32));
        }
        canvas.rgb = sum;
        if self.passing {
            canvas.disc([10.0 + 110.0 * t_s, 170.0 + 8.0 * (9.0 * t_s).sin()], 14.0, RED, 1.0);
        }
        canvas.rgb.iter_mut().flatten().for_each(|v| *v *= self.light);
        canvas
    }

    fn paint_pendulum(&self, canvas: &mut Canvas, t_s: f64, shift: [f64; 2], aside_px: f64) {
        let nodes = self.nodes_px(t_s).map(|p| moved(p, [shift[0] + aside_px, shift[1]]));
        for pair in nodes.windows(2) {
            canvas.bar(pair[0], pair[1], 14.0);
        }
        for (node, colour) in &self.marks {
            let seen = *node == 0 || (self.uncovered_s[0]..=self.uncovered_s[1]).contains(&t_s);
            canvas.disc(nodes[*node], self.radius_px, *colour, if seen { 1.0 } else { 0.0 });
        }
    }
}

fn moved(p: [f64; 2], by: [f64; 2]) -> [f64; 2] {
    [p[0] + by[0], p[1] + by[1]]
}

/// A scene for as many frames.
pub struct Clip {
    pub frames: usize,
    /// Frames from one key frame to the next.
    pub gop: u32,
    pub scene: Scene,
}

impl Default for Clip {
    fn default() -> Self {
        Self { frames: 75, gop: 25, scene: Scene::default() }
    }
}

impl Clip {
    pub fn with(self, scene: Scene) -> Self {
        Self { scene, ..self }
    }

    pub fn write(&self, path: &Path) {
        let codec = Codec { preset: "ultrafast".to_owned(), gop: self.gop, ..Codec::default() };
        let layout = codec.layout(SIZE[0] as u32, SIZE[1] as u32);
        let mut writer = VideoWriter::create(path, &codec, layout, RATE_HZ).unwrap();
        for frame in 0..self.frames {
            let mut picture = OwnedPicture::black(layout);
            self.scene.picture(frame).fill(&mut picture);
            let (pts, _) = writer.stamp(frame as f64 / RATE_HZ);
            writer.write(&picture, pts).unwrap();
        }
        writer.finish().unwrap();
    }
}

/// Random values at whole numbers, −1 to 1, smoothly joined.
fn stain(x: f64, y: f64) -> f64 {
    let random = |i: f64, j: f64| {
        let mixed =
            ((i as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ (j as u64).wrapping_mul(0xc2b2_ae3d_27d4_eb4f)) >> 7;
        (mixed.wrapping_mul(0xff51_afd7_ed55_8ccd) >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    };
    let smooth = |v: f64| v * v * (3.0 - 2.0 * v);
    let (i, j, a, b) = (x.floor(), y.floor(), smooth(x.fract()), smooth(y.fract()));
    let row = |j: f64| random(i, j) * (1.0 - a) + random(i + 1.0, j) * a;
    row(j) * (1.0 - b) + row(j + 1.0) * b
}

#[derive(Clone)]
struct Canvas {
    rgb: Vec<Rgb>,
}

impl Canvas {
    /// A grey wall with stains of many sizes, no two alike.
    fn wall(shift: [f64; 2], stains: f64) -> Self {
        let at = |i: usize| {
            let [x, y] = [(i % SIZE[0]) as f64 - shift[0] + 40.0, (i / SIZE[0]) as f64 - shift[1] + 40.0];
            (118.0 + stains * (7.0 * stain(x / 9.0, y / 9.0) + 5.0 * stain(x / 31.0, y / 31.0))) as f32
        };
        Self { rgb: (0..SIZE[0] * SIZE[1]).map(at).map(|v| [v, v * 0.99, v * 0.97]).collect() }
    }

    fn cover(&mut self, colour: Rgb, near: [[f64; 2]; 2], share: impl Fn(f64, f64) -> f64) {
        let range = |axis: usize| {
            let low = near[0][axis].max(0.0) as usize;
            low..(near[1][axis].max(0.0) as usize + 1).clamp(low, SIZE[axis])
        };
        for y in range(1) {
            for x in range(0) {
                let a = share(x as f64, y as f64).clamp(0.0, 1.0) as f32;
                let pixel = &mut self.rgb[y * SIZE[0] + x];
                (0..3).for_each(|k| pixel[k] += a * (colour[k] - pixel[k]));
            }
        }
    }

    fn disc(&mut self, [cx, cy]: [f64; 2], radius_px: f64, colour: Rgb, strength: f64) {
        let reach = radius_px + 2.0;
        self.cover(colour, [[cx - reach, cy - reach], [cx + reach, cy + reach]], |x, y| {
            strength * (radius_px + 0.5 - (x - cx).hypot(y - cy)).clamp(0.0, 1.0)
        });
    }

    /// A piece of the strip with round ends.
    fn bar(&mut self, a: [f64; 2], b: [f64; 2], half_px: f64) {
        let along = [b[0] - a[0], b[1] - a[1]];
        let square = along[0].powi(2) + along[1].powi(2);
        let reach = half_px + 2.0;
        let near = [[a[0].min(b[0]) - reach, a[1].min(b[1]) - reach], [a[0].max(b[0]) + reach, a[1].max(b[1]) + reach]];
        self.cover(STRIP, near, |x, y| {
            let share = (((x - a[0]) * along[0] + (y - a[1]) * along[1]) / square).clamp(0.0, 1.0);
            half_px + 0.5 - (x - a[0] - share * along[0]).hypot(y - a[1] - share * along[1])
        });
    }

    fn fill(&self, picture: &mut OwnedPicture) {
        let layout = picture.layout;
        let code = |rgb: Rgb| layout.matrix.ycbcr(rgb.map(|v| f64::from(v.clamp(0.0, 255.0)) / 255.0));
        for (i, rgb) in self.rgb.iter().enumerate() {
            picture.set(0, i, (16.5 + 219.0 * code(*rgb)[0]) as u16);
        }
        let (columns, rows) = layout.chroma_size();
        for (i, (y, x)) in (0..rows).flat_map(|y| (0..columns).map(move |x| (y, x))).enumerate() {
            // the site of these samples: on the left column, between two rows
            let at = |dx: isize, dy: usize| {
                let column = (2 * x).saturating_add_signed(dx).min(SIZE[0] - 1);
                self.rgb[(2 * y + dy).min(SIZE[1] - 1) * SIZE[0] + column]
            };
            let near = [(-1, 0, 1.0), (0, 0, 2.0), (1, 0, 1.0), (-1, 1, 1.0), (0, 1, 2.0), (1, 1, 1.0)];
            let mean = [0, 1, 2].map(|k| near.iter().map(|(dx, dy, w)| w * at(*dx, *dy)[k]).sum::<f32>() / 8.0);
            let [_, cb, cr] = code(mean);
            picture.set(1, i, (128.5 + 224.0 * cb) as u16);
            picture.set(2, i, (128.5 + 224.0 * cr) as u16);
        }
    }
}
