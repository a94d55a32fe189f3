//! What does not move: the dark chamber, the stand, the knob, burnt-in text.

use super::lens::Distortion;
use super::letters::inked;
use super::paint::{Edge, Light, light_of};
use crate::experiment::{Caption, Render, Rgb};

/// The scene behind the strip.
#[derive(Debug)]
pub struct Backdrop<'a> {
    render: &'a Render,
    edge: &'a Edge,
    hinge_px: [f64; 2],
    /// Roll of the stand about the hinge, anticlockwise.
    roll_rad: f64,
    wall: Light,
    steel: Light,
}

impl<'a> Backdrop<'a> {
    /// The backdrop of a recording whose stand holds `hinge_px` and is rolled with the scene.
    pub fn new(render: &'a Render, edge: &'a Edge, hinge_px: [f64; 2], roll_rad: f64) -> Self {
        let wall = light_of(render.background_rgb, render.gamma);
        let steel = light_of(Rgb([104, 108, 114]), render.gamma);
        Self { render, edge, hinge_px, roll_rad, wall, steel }
    }

    /// The light of every pixel, row after row.
    pub fn paint(&self, distortion: &Distortion) -> Vec<Light> {
        let (width, height) = (self.render.width_px as usize, self.render.height_px as usize);
        let mut picture = Vec::with_capacity(width * height);
        for y in 0..height {
            for x in 0..width {
                let seen = [x as f64, y as f64];
                picture.push(self.light_at(distortion.undistort(seen), seen));
            }
        }
        picture
    }

    fn light_at(&self, p: [f64; 2], seen: [f64; 2]) -> Light {
        let mut light = self.wall(seen);
        if self.render.stand {
            self.stand(p, &mut light);
        }
        if let Some(knob) = &self.render.distractor {
            self.knob(p, knob.centre_px, 0.5 * knob.diameter_px, knob.rgb, &mut light);
        }
        for caption in &self.render.captions {
            self.text(seen, caption, &mut light);
        }
        light
    }

    /// A wall lit from the upper left, darker towards the corners: a round glow with a soft rim, and a rail out of focus.
    fn wall(&self, p: [f64; 2]) -> Light {
        let (w, h) = (f64::from(self.render.width_px), f64::from(self.render.height_px));
        let (u, v) = ((p[0] - 0.47 * w) / w, (p[1] - 0.44 * h) / w);
        let r2 = u * u + 1.3 * v * v;
        let glow = (-r2 / 0.075).exp();
        let rim = 0.12 * (-((r2.sqrt() - 0.31) / 0.02).powi(2)).exp();
        let rail = 0.14 * (-((p[0] - 0.845 * w) / (0.012 * w)).powi(2)).exp();
        let shade = 1.0 - self.render.vignette * (1.0 - glow - rim - rail);
        self.wall.map(|c| c * shade.max(0.0) as f32)
    }

    /// A crossbeam above the picture's subject, and the bracket that holds the hinge.
    fn stand(&self, p: [f64; 2], light: &mut Light) {
        let (sin, cos) = self.roll_rad.sin_cos();
        let (dx, dy) = (p[0] - self.hinge_px[0], p[1] - self.hinge_px[1]);
        let q = [cos * dx - sin * dy, sin * dx + cos * dy];
        // Sizes follow the marks, so that a small picture gets a small stand.
        let unit = self.render.mark_diameter_px / 22.0;
        let grey = |level: f64| self.steel.map(|c| c * level as f32);

        let beam = box_distance(q, [0.0, -66.0 * unit], [1e5, 17.0 * unit], 0.0);
        let across = (q[1] / unit + 66.0) / 17.0;
        let brushed = 0.42 + 0.30 * (-(across + 0.35).powi(2) / 0.12).exp() - 0.12 * across;
        let lit = (-(q[0] / (620.0 * unit)).powi(2)).exp();
        blend(light, grey(brushed * (0.35 + 0.65 * lit)), self.edge.coverage(-beam));

        let bracket = box_distance(q, [0.0, -34.0 * unit], [46.0 * unit, 30.0 * unit], 7.0 * unit);
        let level = 0.50 - 0.10 * (q[1] / unit + 34.0) / 30.0 + 0.05 * q[0] / (46.0 * unit);
        blend(light, [0.0; 3], 0.55 * self.edge.coverage((3.0 * unit - bracket) / 2.0));
        blend(light, grey(level), self.edge.coverage(-bracket));
        for side in [-1.0, 1.0] {
            let screw = (q[0] - side * 31.0 * unit).hypot(q[1] + 48.0 * unit);
            blend(light, grey(0.22), self.edge.coverage(6.0 * unit - screw));
            blend(light, grey(0.85), self.edge.coverage(4.4 * unit - screw));
            let slot =
                box_distance([q[0] - side * 31.0 * unit, q[1] + 48.0 * unit], [0.0; 2], [4.0 * unit, 0.8 * unit], 0.0);
            blend(light, grey(0.2), self.edge.coverage(-slot));
        }
    }

    /// A turned knob: a dark rim, a domed face, a highlight.
    fn knob(&self, p: [f64; 2], centre: [f64; 2], radius: f64, rgb: Rgb, light: &mut Light) {
        let (dx, dy) = ((p[0] - centre[0]) / radius, (p[1] - centre[1]) / radius);
        let r = dx.hypot(dy);
        if r > 1.2 + self.edge.reach_px() / radius {
            return;
        }
        let colour = light_of(rgb, self.render.gamma);
        let dome = 0.9 - 0.45 * r * r - 0.25 * (dx + dy);
        let glint = 0.5 * (-((dx + 0.35).powi(2) + (dy + 0.4).powi(2)) / 0.03).exp();
        blend(light, [0.0; 3], 0.5 * self.edge.coverage(radius * (1.12 - r)));
        blend(
            light,
            colour.map(|c| c * dome.max(0.1) as f32 + (0.5 * glint) as f32),
            self.edge.coverage(radius * (1.0 - r)),
        );
    }

    /// Text belongs to the picture, not to the scene: no lens bends it.
    fn text(&self, p: [f64; 2], caption: &Caption, light: &mut Light) {
        let cell = caption.height_px / 7.0;
        let (u, v) = ((p[0] - caption.corner_px[0]) / cell, (p[1] - caption.corner_px[1]) / cell);
        if u < -1.0 || !(-1.0..8.0).contains(&v) || u > 6.0 * caption.text.chars().count() as f64 {
            return;
        }
        // Sixteen samples a pixel: letters have many corners.
        let hits = (0..16).filter(|k| {
            let du = (f64::from(k % 4) - 1.5) / 4.0 / cell;
            let dv = (f64::from(k / 4) - 1.5) / 4.0 / cell;
            let (u, v) = (u + du, v + dv);
            let letter = (u >= 0.0 && v >= 0.0).then(|| caption.text.chars().nth((u / 6.0) as usize)).flatten();
            letter.is_some_and(|l| inked(l, (u % 6.0) as usize, v as usize))
        });
        blend(light, light_of(caption.rgb, self.render.gamma), 0.85 * hits.count() as f32 / 16.0);
    }
}

/// Lays a colour over the light with a coverage of 0 to 1.
pub fn blend(light: &mut Light, over: Light, coverage: f32) {
    for (below, above) in light.iter_mut().zip(over) {
        *below += coverage * (above - *below);
    }
}

/// Signed distance to a box with rounded corners, negative inside.
pub fn box_distance(p: [f64; 2], centre: [f64; 2], half: [f64; 2], corner: f64) -> f64 {
    let dx = (p[0] - centre[0]).abs() - half[0] + corner;
    let dy = (p[1] - centre[1]).abs() - half[1] + corner;
    dx.max(0.0).hypot(dy.max(0.0)) + dx.max(dy).min(0.0) - corner
}
