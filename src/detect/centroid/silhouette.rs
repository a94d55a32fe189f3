//! A mark's rough place and shape.

/// A mark's rough place and shape, from the mask.
#[derive(Debug, Clone)]
pub struct Silhouette {
    /// Mean of the mask, luma pixels.
    pub centre_px: [f64; 2],
    /// Masked samples as luma pixels, each sample with its half size, row by row.
    pub points_px: Vec<[f64; 2]>,
    /// Half a chroma sample, luma pixels.
    pub half_sample_px: [f64; 2],
}

impl Silhouette {
    /// Of masked samples, row by row.
    pub fn of(points_px: Vec<[f64; 2]>, half_sample_px: [f64; 2]) -> Self {
        let n = points_px.len().max(1) as f64;
        let centre_px = [0, 1].map(|axis| points_px.iter().map(|p| p[axis]).sum::<f64>() / n);
        Self { centre_px, points_px, half_sample_px }
    }

    /// With all samples of its convex hull. A disc is convex, swept by its motion as well, and so are its samples: what the
    /// hull adds is a highlight, or something that lies over the mark's edge, and no part of its outline.
    pub fn convex(&self) -> Self {
        let rows: Vec<[f64; 3]> = self
            .points_px
            .chunk_by(|a, b| a[1] == b[1])
            .filter_map(|row| Some([row.first()?[1], row.first()?[0], row.last()?[0]]))
            .collect();
        let left = envelope(rows.iter().map(|[y, left, _]| [*y, *left]));
        let right = envelope(rows.iter().map(|[y, _, right]| [*y, -*right]));
        let width_px = 2.0 * self.half_sample_px[0];
        let mut points_px = Vec::with_capacity(self.points_px.len());
        for (([y, first, _], left), right) in rows.iter().zip(left).zip(right) {
            // samples beside the row's own first one
            let step = |x: f64| (x - first) / width_px;
            let (from, to) = ((step(left) - ON_THE_LINE).ceil() as i64, (step(-right) + ON_THE_LINE).floor() as i64);
            points_px.extend((from..=to).map(|k| [first + width_px * k as f64, *y]));
        }
        Self::of(points_px, self.half_sample_px)
    }
}

/// Samples by which a point may lie outside of a line that it is meant to lie on: rounding.
const ON_THE_LINE: f64 = 1e-6;

/// The largest convex function that is nowhere above some points (t, value), t ascending, at each of them
/// (Andrew, Inf. Proc. Lett. 9 (1979) 216).
fn envelope(points: impl Iterator<Item = [f64; 2]> + Clone) -> Vec<f64> {
    let mut corners: Vec<[f64; 2]> = Vec::new();
    for point in points.clone() {
        while let [.., a, b] = corners[..]
            && (b[0] - a[0]) * (point[1] - a[1]) <= (point[0] - a[0]) * (b[1] - a[1])
        {
            corners.pop();
        }
        corners.push(point);
    }
    let mut next = 1;
    let at = |[t, value]: [f64; 2]| {
        while next + 1 < corners.len() && corners[next][0] < t {
            next += 1;
        }
        match (corners.get(next - 1), corners.get(next)) {
            (Some([s, from]), Some([e, to])) => from + (to - from) * (t - s) / (e - s),
            _ => value,
        }
    };
    points.map(at).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn silhouette(inside: impl Fn(f64, f64) -> bool) -> Silhouette {
        let at = |i: i32, j: i32| [0.5 + 2.0 * f64::from(i), 2.0 * f64::from(j)];
        let all = (-20..=20).flat_map(|j| (-20..=20).map(move |i| at(i, j)));
        Silhouette::of(all.filter(|[x, y]| inside(*x, *y)).collect(), [1.0, 1.0])
    }

    #[test]
    fn a_disc_is_its_own_hull() {
        for radius in [3.2, 7.0, 18.3, 31.0] {
            let disc = silhouette(|x, y| x.hypot(y) < radius);
            assert_eq!(disc.convex().points_px, disc.points_px, "{radius}");
        }
        let swept = silhouette(|x, y| (x - 0.6 * x.clamp(-12.0, 12.0)).hypot(y) < 8.0);
        assert_eq!(swept.convex().points_px, swept.points_px);
    }

    #[test]
    fn a_highlight_at_the_edge_is_within_the_hull() {
        let disc = silhouette(|x, y| x.hypot(y) < 24.0);
        let lit = silhouette(|x, y| x.hypot(y) < 24.0 && (x + 3.0).hypot(y + 17.0) > 9.0);
        let missing = |s: &Silhouette| disc.points_px.len() - s.points_px.len();
        let hull = lit.convex();
        assert!(missing(&lit) > 50 && missing(&hull) < 12, "{} {}", missing(&lit), missing(&hull));
        assert!(lit.centre_px[1] > 1.5 && hull.centre_px[1] < 0.6, "{:?}", hull.centre_px);
    }

    #[test]
    fn single_samples_and_lines_stay() {
        for inside in [|x: f64, y: f64| x == 0.5 && y == 0.0, |x: f64, _: f64| x == 0.5, |_: f64, y: f64| y == 4.0] {
            let thin = silhouette(inside);
            assert_eq!(thin.convex().points_px, thin.points_px);
        }
        assert!(silhouette(|_, _| false).convex().points_px.is_empty());
    }
}
