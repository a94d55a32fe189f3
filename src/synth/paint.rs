//! Light, soft edges, and the strip with its marks.
//!
//! All light is linear; the sensor codes it. An edge is the step of a half-plane blurred by lens and pixel together,
//!
//! ```text
//! coverage = Φ(d/σ)      σ² = lens_blur² + 1/12,  d the distance inside the edge
//! ```
//!
//! 1/12 being the variance of a pixel's aperture; σ is at least 0.45 px. A disc drawn so is round to the last digit, so its centroid is its
//! centre: what is left is aliasing, exp(−2π²σ²) of a thin ring, below 0.002 px.

use crate::experiment::Rgb;

/// Linear light, red, green, blue, 1 for full scale.
pub type Light = [f32; 3];

/// The linear light of a gamma-coded colour.
pub fn light_of(rgb: Rgb, gamma: f64) -> Light {
    rgb.0.map(|c| (f64::from(c) / 255.0).powf(gamma) as f32)
}

/// Φ, the blurred step, from a table.
#[derive(Debug, Clone)]
pub struct Edge {
    sigma_px: f64,
    table: Vec<f32>,
}

impl Edge {
    const REACH: f64 = 4.0;
    const STEPS: usize = 2048;
    /// Sharper edges would alias, as no lens before a sensor lets them.
    const SHARPEST_PX: f64 = 0.45;

    /// An edge behind a lens of this blur.
    pub fn new(lens_blur_px: f64) -> Self {
        let sigma_px = (lens_blur_px * lens_blur_px + 1.0 / 12.0).sqrt().max(Self::SHARPEST_PX);
        let z = |i: usize| Self::REACH * (2.0 * i as f64 / Self::STEPS as f64 - 1.0);
        // Φ by the midpoint rule of its density, then scaled so that it reaches 0 and 1 at its ends.
        let mut table = vec![0.0f64];
        for i in 0..Self::STEPS {
            let middle = 0.5 * (z(i) + z(i + 1));
            table.push(table[i] + (-0.5 * middle * middle).exp());
        }
        let total = table[Self::STEPS];
        let mut table: Vec<f32> = table.into_iter().map(|v| (v / total) as f32).collect();
        table.push(1.0);
        Self { sigma_px, table }
    }

    /// How far from an edge its blur is felt.
    pub fn reach_px(&self) -> f64 {
        Self::REACH * self.sigma_px
    }

    /// Coverage at `distance_px` inside the edge.
    #[inline]
    pub fn coverage(&self, distance_px: f64) -> f32 {
        let at = (distance_px / self.sigma_px + Self::REACH) * (Self::STEPS as f64 / (2.0 * Self::REACH));
        if at <= 0.0 {
            return 0.0;
        }
        if at >= Self::STEPS as f64 {
            return 1.0;
        }
        let i = at as usize;
        let (low, high) = (self.table[i], self.table[i + 1]);
        low + (high - low) * (at - i as f64) as f32
    }
}

/// How the strip and its marks look.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StripLook {
    /// Half its visible width.
    pub half_width_px: f64,
    /// How far it reaches beyond the hinge and the last mark.
    pub overhang_px: f64,
    /// Strength of the sheen.
    pub sheen: f64,
    /// Change of brightness from the left edge to the right.
    pub slope: f64,
    /// Radius of a mark.
    pub mark_radius_px: f64,
    /// The first node carries no mark.
    pub hinge_unmarked: bool,
}

/// One short straight piece of the strip, cut off square to the curve at both ends.
#[derive(Debug, Clone, Copy)]
struct Piece {
    upper: [f64; 2],
    lower: [f64; 2],
    /// Unit vector along the piece.
    along: [f64; 2],
    /// Unit tangents of the curve at the two cuts.
    upper_tangent: [f64; 2],
    lower_tangent: [f64; 2],
    /// Sheen of a film turned like this.
    glint: f64,
    top_px: f64,
    bottom_px: f64,
}

/// The strip and its marks at one instant.
#[derive(Debug, Clone)]
pub struct Outline {
    look: StripLook,
    pieces: Vec<Piece>,
    marks: Vec<[f64; 2]>,
}

impl Outline {
    const PIECES_A_LINK: usize = 8;

    /// The strip through these nodes (hinge, joints, tip): a smooth curve, so that the film bends at a joint instead of breaking.
    pub fn new(look: StripLook, nodes: &[[f64; 2]]) -> Self {
        let curve = curve_through(nodes, look.overhang_px, Self::PIECES_A_LINK);
        let last = curve.len() - 1;
        let tangent = |i: usize| direction(curve[i.saturating_sub(1)], curve[(i + 1).min(last)]);
        let reach = look.half_width_px;
        let pieces = (0..last).map(|i| {
            let (upper, lower) = (curve[i], curve[i + 1]);
            let along = direction(upper, lower);
            // A film mirrors the lamps: its brightness follows its slope.
            let glint = 1.0 + look.sheen * (0.45 * along[0] + 0.25 * (7.0 * along[0] + 0.6).sin());
            Piece {
                upper,
                lower,
                along,
                upper_tangent: tangent(i),
                lower_tangent: tangent(i + 1),
                glint,
                top_px: upper[1].min(lower[1]) - reach,
                bottom_px: upper[1].max(lower[1]) + reach,
            }
        });
        Self { look, pieces: pieces.collect(), marks: nodes[usize::from(look.hinge_unmarked)..].to_vec() }
    }

    /// Left, top, right, bottom of everything drawn.
    pub fn bounds_px(&self, edge: &Edge) -> [f64; 4] {
        let margin = self.look.half_width_px.max(self.look.mark_radius_px) + edge.reach_px() + 1.0;
        let points = self.pieces.iter().flat_map(|p| [p.upper, p.lower]).chain(self.marks.iter().copied());
        points.fold([f64::MAX, f64::MAX, f64::MIN, f64::MIN], |b, p| {
            [b[0].min(p[0] - margin), b[1].min(p[1] - margin), b[2].max(p[0] + margin), b[3].max(p[1] + margin)]
        })
    }

    /// Adds this instant's coverage of one picture row to `row`; `at(x)` is the undistorted position of pixel x in the row.
    ///
    /// `span_y` holds the least and the largest undistorted y in the row.
    pub fn add_row(&self, edge: &Edge, row: &mut RowCover, span_y: [f64; 2], at: impl Fn(usize) -> [f64; 2]) {
        let reach = edge.reach_px();
        row.instant_cover.fill(0.0);
        row.instant_light.fill(0.0);
        for piece in &self.pieces {
            if span_y[1] >= piece.top_px - reach && span_y[0] <= piece.bottom_px + reach {
                self.add_piece(piece, edge, row, span_y, &at);
            }
        }
        for (k, mark) in self.marks.iter().enumerate() {
            let far = self.look.mark_radius_px + reach;
            if span_y[1] < mark[1] - far || span_y[0] > mark[1] + far {
                continue;
            }
            for x in row.columns(mark[0] - far, mark[0] + far) {
                let p = at(x);
                let distance = (p[0] - mark[0]).hypot(p[1] - mark[1]);
                let cover = edge.coverage(self.look.mark_radius_px - distance);
                let i = x - row.left;
                row.instant_cover[i] *= 1.0 - cover;
                row.instant_light[i] *= 1.0 - cover;
                row.marks[k][i] += cover;
            }
        }
        for (sum, instant) in row.strip_cover.iter_mut().zip(&row.instant_cover) {
            *sum += instant;
        }
        for (sum, instant) in row.strip_light.iter_mut().zip(&row.instant_light) {
            *sum += instant;
        }
    }

    fn add_piece(
        &self,
        piece: &Piece,
        edge: &Edge,
        row: &mut RowCover,
        span_y: [f64; 2],
        at: &impl Fn(usize) -> [f64; 2],
    ) {
        let reach = edge.reach_px();
        let [left, right] = piece.span_x(self.look.half_width_px + reach, span_y, reach);
        for x in row.columns(left, right) {
            let p = at(x);
            let from_upper = [p[0] - piece.upper[0], p[1] - piece.upper[1]];
            let from_lower = [p[0] - piece.lower[0], p[1] - piece.lower[1]];
            let between = edge.coverage(dot(from_upper, piece.upper_tangent))
                * (1.0 - edge.coverage(dot(from_lower, piece.lower_tangent)));
            if between <= 0.0 {
                continue;
            }
            let across = from_upper[0] * piece.along[1] - from_upper[1] * piece.along[0];
            let half = self.look.half_width_px;
            let cover = between * (edge.coverage(half - across) - edge.coverage(-half - across));
            let q = (across / half.max(1e-9)).clamp(-1.0, 1.0);
            let shade = piece.glint + self.look.sheen * (0.30 - 0.75 * q * q) + 0.5 * self.look.slope * q;
            row.instant_cover[x - row.left] += cover;
            row.instant_light[x - row.left] += cover * shade as f32;
        }
    }
}

impl Piece {
    /// Least and largest x that the piece can reach in rows of this y, widened by `half_px` across and `reach_px` along.
    fn span_x(&self, half_px: f64, span_y: [f64; 2], reach_px: f64) -> [f64; 2] {
        let [x0, x1] = [self.upper[0].min(self.lower[0]), self.upper[0].max(self.lower[0])];
        let all = [x0 - half_px - reach_px, x1 + half_px + reach_px];
        if self.along[1] < 0.3 {
            return all;
        }
        // A steep piece: the slanted band between its two long edges, in these rows.
        let slope = self.along[0] / self.along[1];
        let x_at = |y: f64| self.upper[0] + slope * (y - self.upper[1]);
        let half = half_px / self.along[1];
        let [a, b] = [x_at(span_y[0]), x_at(span_y[1])];
        [(a.min(b) - half).max(all[0]), (a.max(b) + half).min(all[1])]
    }
}

/// Sums of coverage over one picture row, between two columns.
#[derive(Debug, Clone)]
pub struct RowCover {
    left: usize,
    slack_px: f64,
    instant_cover: Vec<f32>,
    instant_light: Vec<f32>,
    /// Share of the instants in which the strip is seen here.
    pub strip_cover: Vec<f32>,
    /// The same, times the strip's shade.
    pub strip_light: Vec<f32>,
    /// The same for each mark.
    pub marks: Vec<Vec<f32>>,
}

impl RowCover {
    /// An empty row of pixels `left..right`.
    pub fn new(left: usize, right: usize, marks: usize) -> Self {
        let zeros = vec![0.0; right.saturating_sub(left)];
        Self {
            left,
            slack_px: 0.0,
            instant_cover: zeros.clone(),
            instant_light: zeros.clone(),
            strip_cover: zeros.clone(),
            strip_light: zeros.clone(),
            marks: vec![zeros; marks],
        }
    }

    /// Lets every span reach this much further: a lens moves columns.
    pub fn widen(&mut self, slack_px: f64) {
        self.slack_px = slack_px;
    }

    /// Empties the sums.
    pub fn clear(&mut self) {
        self.strip_cover.fill(0.0);
        self.strip_light.fill(0.0);
        self.marks.iter_mut().for_each(|m| m.fill(0.0));
    }

    /// Pixels of the row from `left_px` to `right_px`.
    fn columns(&self, left_px: f64, right_px: f64) -> std::ops::Range<usize> {
        let end = self.left + self.strip_cover.len();
        let clamp = |v: f64| (v.max(0.0) as usize).clamp(self.left, end);
        clamp((left_px - self.slack_px).floor())..clamp((right_px + self.slack_px).ceil() + 1.0)
    }
}

/// Points of a Hermite spline through the nodes, with straight ends of `overhang_px`. The tangent at a node is the mean of its links'.
fn curve_through(nodes: &[[f64; 2]], overhang_px: f64, pieces_a_link: usize) -> Vec<[f64; 2]> {
    let n = nodes.len() - 1;
    let of_link: Vec<[f64; 2]> = nodes.windows(2).map(|w| direction(w[0], w[1])).collect();
    let tangent = |i: usize| match i {
        0 => of_link[0],
        i if i == n => of_link[n - 1],
        i => direction([0.0, 0.0], [of_link[i - 1][0] + of_link[i][0], of_link[i - 1][1] + of_link[i][1]]),
    };
    let beyond = |p: [f64; 2], t: [f64; 2], d: f64| [p[0] + d * t[0], p[1] + d * t[1]];
    let mut curve = vec![beyond(nodes[0], tangent(0), -overhang_px)];
    for i in 0..n {
        let length = (nodes[i + 1][0] - nodes[i][0]).hypot(nodes[i + 1][1] - nodes[i][1]);
        for k in 0..pieces_a_link {
            let s = k as f64 / pieces_a_link as f64;
            let (s2, s3) = (s * s, s * s * s);
            let axis = |c: usize| {
                (2.0 * s3 - 3.0 * s2 + 1.0) * nodes[i][c]
                    + (s3 - 2.0 * s2 + s) * length * tangent(i)[c]
                    + (3.0 * s2 - 2.0 * s3) * nodes[i + 1][c]
                    + (s3 - s2) * length * tangent(i + 1)[c]
            };
            curve.push([axis(0), axis(1)]);
        }
    }
    curve.push(nodes[n]);
    curve.push(beyond(nodes[n], tangent(n), overhang_px));
    curve
}

fn direction(from: [f64; 2], to: [f64; 2]) -> [f64; 2] {
    let (dx, dy) = (to[0] - from[0], to[1] - from[1]);
    let length = dx.hypot(dy);
    if length > 0.0 { [dx / length, dy / length] } else { [0.0, 1.0] }
}

fn dot(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_discs_coverage_has_its_centroid_at_the_centre_at_every_pixel_phase() {
        let look = StripLook {
            half_width_px: 40.0,
            overhang_px: 20.0,
            sheen: 0.0,
            slope: 0.0,
            mark_radius_px: 11.0,
            hinge_unmarked: false,
        };
        let mut worst: f64 = 0.0;
        for (blur, phase) in [0.0, 0.4, 0.8].into_iter().flat_map(|b| (0..13).map(move |p| (b, f64::from(p) / 13.0))) {
            let edge = Edge::new(blur);
            let centre = [30.0 + phase, 30.0 + (5.0 * phase).fract()];
            let outline = Outline::new(look, &[centre, [30.0, 400.0]]);
            let mut sum = [0.0f64; 3];
            let mut row = RowCover::new(0, 60, 2);
            for y in 0..60 {
                row.clear();
                outline.add_row(&edge, &mut row, [f64::from(y); 2], |x| [x as f64, f64::from(y)]);
                for (x, cover) in row.marks[0].iter().enumerate() {
                    let cover = f64::from(*cover);
                    sum = [sum[0] + cover * x as f64, sum[1] + cover * f64::from(y), sum[2] + cover];
                }
            }
            worst = worst.max((sum[0] / sum[2] - centre[0]).hypot(sum[1] / sum[2] - centre[1]));
        }
        assert!(worst < 0.002, "{worst}");
    }

    #[test]
    fn the_strips_pieces_join_without_a_seam() {
        let look = StripLook {
            half_width_px: 20.0,
            overhang_px: 20.0,
            sheen: 0.0,
            slope: 0.0,
            mark_radius_px: 5.0,
            hinge_unmarked: false,
        };
        let outline = Outline::new(look, &[[60.0, 20.0], [80.0, 100.0], [70.0, 180.0]]);
        let edge = Edge::new(0.8);
        let mut row = RowCover::new(0, 140, 3);
        outline.add_row(&edge, &mut row, [60.0; 2], |x| [x as f64, 60.0]);
        let inside = row.strip_cover.iter().filter(|c| (**c - 1.0).abs() < 1e-4).count();
        assert!(row.strip_cover.iter().all(|c| *c < 1.0001) && (30..42).contains(&inside), "{inside}");
    }
}
