//! Axes and curves as SVG.

use std::fmt::Write;
use std::ops::Range;

/// Most dots of one series in a panel; of a longer one every second, third, … is drawn.
const MOST_DOTS: usize = 4000;

/// A rectangle on the page with a scale along each edge.
#[derive(Debug, Clone)]
pub struct Panel {
    /// Of the page, px.
    pub x_px: Range<f64>,
    /// Of the page, px; y runs down.
    pub y_px: Range<f64>,
    /// What the left and the right edge stand for.
    pub x: Range<f64>,
    /// What the lower and the upper edge stand for.
    pub y: Range<f64>,
}

impl Panel {
    /// Where a value stands on the page.
    pub fn place(&self, x: f64, y: f64) -> [f64; 2] {
        let along = |value: f64, of: &Range<f64>| (value - of.start) / (of.end - of.start);
        [
            self.x_px.start + along(x, &self.x) * (self.x_px.end - self.x_px.start),
            self.y_px.end - along(y, &self.y) * (self.y_px.end - self.y_px.start),
        ]
    }

    /// Grid, numbers along the left edge, and along the lower one if they are wanted.
    pub fn axes(&self, svg: &mut String, with_x_numbers: bool) {
        if with_x_numbers {
            self.numbers_along(svg);
        } else {
            self.grid_along(svg);
        }
        self.numbers_up(svg);
    }

    /// Upright lines, and below them their numbers.
    pub fn numbers_along(&self, svg: &mut String) {
        self.grid_along(svg);
        for tick in self.ticks_along() {
            let [x_px, _] = self.place(tick, self.y.start);
            text(svg, "number middle", [x_px, self.y_px.end + 18.0], &label(tick));
        }
    }

    fn grid_along(&self, svg: &mut String) {
        for tick in self.ticks_along() {
            let [x_px, _] = self.place(tick, self.y.start);
            line(svg, "grid", [x_px, self.y_px.start], [x_px, self.y_px.end]);
        }
    }

    fn ticks_along(&self) -> Vec<f64> {
        ticks(&self.x, (self.x_px.end - self.x_px.start) / 70.0)
    }

    /// Level lines, and to the left of them their numbers.
    pub fn numbers_up(&self, svg: &mut String) {
        for tick in ticks(&self.y, (self.y_px.end - self.y_px.start) / 30.0) {
            let class = if tick == 0.0 { "zero" } else { "grid" };
            self.level(svg, class, tick, &label(tick));
        }
    }

    /// The same at multiples of a step.
    pub fn numbers_up_by(&self, svg: &mut String, step: f64) {
        let (first, last) = ((self.y.start / step).ceil() as i64, (self.y.end / step).floor() as i64);
        for tick in (first..=last).map(|k| k as f64 * step) {
            self.level(svg, "grid", tick, &label(tick));
        }
    }

    /// The same where the edges stand for logarithms.
    pub fn powers_up(&self, svg: &mut String) {
        for (power, words) in powers(&self.y) {
            self.level(svg, "grid", power, &words);
        }
    }

    /// Upright lines where the edges stand for logarithms.
    pub fn powers_along(&self, svg: &mut String) {
        for (power, words) in powers(&self.x) {
            let [x_px, _] = self.place(power, self.y.start);
            line(svg, "grid", [x_px, self.y_px.start], [x_px, self.y_px.end]);
            text(svg, "number middle", [x_px, self.y_px.end + 18.0], &words);
        }
    }

    fn level(&self, svg: &mut String, class: &str, at: f64, words: &str) {
        let [_, y_px] = self.place(self.x.start, at);
        line(svg, class, [self.x_px.start, y_px], [self.x_px.end, y_px]);
        text(svg, "number end", [self.x_px.start - 8.0, y_px + 4.5], words);
    }

    /// The rectangle's outline.
    pub fn outline(&self, svg: &mut String) {
        self.rectangle(svg, "outline", &self.x.clone(), &self.y.clone());
    }

    /// A rectangle between values, cut off at the edges.
    pub fn rectangle(&self, svg: &mut String, class: &str, x: &Range<f64>, y: &Range<f64>) {
        let [left_px, top_px] = self.place(x.start.max(self.x.start), y.end.min(self.y.end));
        let [right_px, bottom_px] = self.place(x.end.min(self.x.end), y.start.max(self.y.start));
        let (width, height) = ((right_px - left_px).max(0.0), (bottom_px - top_px).max(0.0));
        let _ = writeln!(
            svg,
            r#"<rect class="{class}" x="{left_px:.1}" y="{top_px:.1}" width="{width:.1}" height="{height:.1}"/>"#
        );
    }

    /// A vertical line at a value; whether it lies within the panel.
    pub fn vertical(&self, svg: &mut String, class: &str, x: f64) -> Option<f64> {
        if !self.x.contains(&x) {
            return None;
        }
        let [x_px, _] = self.place(x, self.y.start);
        line(svg, class, [x_px, self.y_px.start], [x_px, self.y_px.end]);
        Some(x_px)
    }

    /// One dot a value; what lies above or below is drawn at the edge.
    pub fn dots(&self, svg: &mut String, class: &str, values: &[(f64, f64)]) {
        let mut path = String::new();
        let inside = |v: &&(f64, f64)| self.x.start <= v.0 && v.0 <= self.x.end;
        for (x, y) in values.iter().filter(inside).step_by(values.len() / MOST_DOTS + 1) {
            let [x_px, y_px] = self.place(*x, y.clamp(self.y.start, self.y.end));
            let _ = write!(path, "M{x_px:.1} {y_px:.1}h0");
        }
        let _ = writeln!(svg, r#"<path class="{class}" d="{path}"/>"#);
    }

    /// Straight from value to value, broken where one is absent; what lies above or below is drawn at the edge.
    pub fn polyline(&self, svg: &mut String, class: &str, values: &[Option<(f64, f64)>]) {
        let mut path = String::new();
        let mut goes_on = false;
        for value in values {
            let inside = value.filter(|(x, _)| self.x.start <= *x && *x <= self.x.end);
            if let Some((x, y)) = inside {
                let [x_px, y_px] = self.place(x, y.clamp(self.y.start, self.y.end));
                let _ = write!(path, "{}{x_px:.1} {y_px:.1}", if goes_on { 'L' } else { 'M' });
            }
            goes_on = inside.is_some();
        }
        let _ = writeln!(svg, r#"<path class="{class}" d="{path}"/>"#);
    }

    /// A smooth curve through values with their slopes, broken where two neighbours are more than `gap` apart.
    pub fn curve(&self, svg: &mut String, class: &str, values: &[(f64, f64, f64)], gap: f64) {
        let mut path = String::new();
        for pair in values.windows(2).filter(|p| p[0].0 >= self.x.start && p[1].0 <= self.x.end) {
            let third = (pair[1].0 - pair[0].0) / 3.0;
            if third > gap / 3.0 {
                continue;
            }
            // the cubic with these values and slopes, as a Bézier curve
            let points = [
                self.place(pair[0].0, pair[0].1),
                self.place(pair[0].0 + third, pair[0].1 + third * pair[0].2),
                self.place(pair[1].0 - third, pair[1].1 - third * pair[1].2),
                self.place(pair[1].0, pair[1].1),
            ];
            let [a, b, c, d] = points.map(|p| format!("{:.1} {:.1}", p[0], p[1]));
            if path.ends_with(&a) {
                let _ = write!(path, "C{b} {c} {d}");
            } else {
                let _ = write!(path, "M{a}C{b} {c} {d}");
            }
        }
        let _ = writeln!(svg, r#"<path class="{class}" d="{path}"/>"#);
    }
}

/// A straight line on the page.
pub fn line(svg: &mut String, class: &str, from_px: [f64; 2], to_px: [f64; 2]) {
    let ([x1, y1], [x2, y2]) = (from_px, to_px);
    let _ = writeln!(svg, r#"<line class="{class}" x1="{x1:.1}" y1="{y1:.1}" x2="{x2:.1}" y2="{y2:.1}"/>"#);
}

/// Letters on the page.
pub fn text(svg: &mut String, class: &str, at_px: [f64; 2], words: &str) {
    let [x, y] = at_px;
    let _ = writeln!(svg, r#"<text class="{class}" x="{x:.1}" y="{y:.1}">{}</text>"#, escaped(words));
}

fn escaped(words: &str) -> String {
    // control characters cannot stand in XML at all
    let words: String = words.chars().filter(|c| !c.is_control()).collect();
    words.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

/// Round values within a range, `most` at most.
fn ticks(range: &Range<f64>, most: f64) -> Vec<f64> {
    let rough = (range.end - range.start) / most.max(2.0);
    if !(rough.is_finite() && rough > 0.0) {
        return Vec::new();
    }
    let power = 10f64.powf(rough.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0].map(|m| m * power).into_iter().find(|s| *s >= rough).unwrap_or(rough);
    let (first, last) = ((range.start / step).ceil(), (range.end / step).floor());
    (0..=(last - first) as usize).map(|k| (first + k as f64) * step).collect()
}

/// Powers of ten within a range of logarithms, with 2 and 5 times them where there are few.
fn powers(range: &Range<f64>) -> Vec<(f64, String)> {
    if !(range.end - range.start).is_finite() {
        return Vec::new();
    }
    let parts: &[f64] = if range.end - range.start > 3.0 { &[1.0] } else { &[1.0, 2.0, 5.0] };
    let whole = (range.start.floor() as i32)..=(range.end.ceil() as i32);
    let all = whole.flat_map(|power| parts.iter().map(move |part| part * 10f64.powi(power)));
    all.filter(|value| range.contains(&value.log10())).map(|value| (value.log10(), label(value))).collect()
}

/// A tick's number, without the digits that rounding adds.
fn label(tick: f64) -> String {
    let rounded: f64 = format!("{tick:.9e}").parse().unwrap_or(tick);
    let words = match rounded.abs() {
        0.0 => "0".to_owned(),
        size if (1e-4..1e6).contains(&size) => rounded.to_string(),
        _ => format!("{rounded:e}"),
    };
    words.replace('-', "−")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_few() {
        assert_eq!(ticks(&(-0.31..0.29), 4.0).into_iter().map(label).collect::<Vec<_>>(), ["−0.2", "0", "0.2"]);
        assert_eq!(ticks(&(0.0..25.0), 10.0), [0.0, 5.0, 10.0, 15.0, 20.0, 25.0]);
        assert!(ticks(&(1.0..1.0), 10.0).is_empty());
        assert!(ticks(&(f64::NAN..1.0), 10.0).is_empty());
    }

    #[test]
    fn a_few_powers_of_ten_have_steps_between_them() {
        let words = |range| powers(&range).into_iter().map(|p| p.1).collect::<Vec<_>>();
        assert_eq!(words(-1.1..0.2), ["0.1", "0.2", "0.5", "1"]);
        assert_eq!(words(-6.5..-1.9), ["1e−6", "1e−5", "0.0001", "0.001", "0.01"]);
    }

    #[test]
    fn a_curve_is_broken_where_a_value_is_absent() {
        let panel = Panel { x_px: 0.0..10.0, y_px: 0.0..10.0, x: 0.0..10.0, y: 0.0..10.0 };
        let mut svg = String::new();
        panel.polyline(&mut svg, "c", &[Some((0.0, 0.0)), Some((1.0, 1.0)), None, Some((3.0, 3.0))]);
        assert_eq!(svg, "<path class=\"c\" d=\"M0.0 10.0L1.0 9.0M3.0 7.0\"/>\n");
    }

    #[test]
    fn a_name_cannot_break_the_page() {
        let mut svg = String::new();
        text(&mut svg, "title", [0.0, 0.0], "a<b & \u{7}c");
        assert!(svg.contains("a&lt;b &amp; c"), "{svg}");
    }

    #[test]
    fn what_lies_outside_stays_within_the_panel() {
        let panel = Panel { x_px: 0.0..10.0, y_px: 0.0..10.0, x: 0.0..1.0, y: 0.0..1.0 };
        let mut svg = String::new();
        panel.dots(&mut svg, "dots", &[(0.5, 7.0), (2.0, 0.5)]);
        assert_eq!(svg, "<path class=\"dots\" d=\"M5.0 0.0h0\"/>\n");
    }
}
