//! A [`Plot`] as SVG: for print, for `figures/`, and for whoever has no script.

use std::fmt::Write;
use std::ops::Range;

use super::plot::{Axis, Ink, Line, Map, Plot, Series, Style};
use super::svg::{Panel, line, text};

/// Size of the page, px; of names up the side each takes [`ROW_PX`].
const SIZE_PX: [f64; 2] = [960.0, 420.0];
const ROW_PX: f64 = 34.0;
/// Left edge of the panel, px, and where names stand up the side.
const LEFT_PX: f64 = 88.0;
const LEFT_OF_NAMES_PX: f64 = 250.0;
/// From the panel to the page's edge: right, top, bottom, px.
const MARGIN_PX: [f64; 3] = [24.0, 78.0, 56.0];
/// Columns in which a long curve is drawn: highest and lowest value of each.
const COLUMNS: usize = 800;

/// Without `@`: the name of a colour and its value.
const INKS: [(Ink, &str); 8] = [
    (Ink::Ink, "#222222"),
    (Ink::Blue, "#0072b2"),
    (Ink::Vermillion, "#d55e00"),
    (Ink::Green, "#009e73"),
    (Ink::Orange, "#e69f00"),
    (Ink::Purple, "#b0508a"),
    (Ink::Sky, "#56b4e9"),
    (Ink::Grey, "#8a8a8a"),
];

/// The drawing.
pub fn svg(plot: &Plot) -> String {
    let named = plot.y.rows.len() as f64;
    let height = if named > 0.0 { MARGIN_PX[1] + MARGIN_PX[2] + ROW_PX * named } else { SIZE_PX[1] };
    let mut svg = head(height);
    text(&mut svg, "title", [24.0, 32.0], &plot.title);
    legend(&mut svg, plot);
    let panel = panel(plot, height);
    let canvas = Canvas { panel: &panel, plot };
    canvas.draw(&mut svg);
    svg.push_str("</svg>\n");
    svg
}

fn head(height: f64) -> String {
    let mut svg = format!(
        r##"<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {w} {height}" width="{w}" height="{height}" font-family="Helvetica, Arial, 'DejaVu Sans', sans-serif" font-size="14" fill="#222">
<style>
.title {{ font-size: 19px }} .heading {{ font-size: 14px }} .number, .note {{ font-size: 13px; fill: #555 }} .middle {{ text-anchor: middle }} .end {{ text-anchor: end }}
.outline {{ fill: none; stroke: #888 }} .grid {{ stroke: #e6e6e6 }} .zero {{ stroke: #aaa }} .mark {{ stroke: #777; stroke-dasharray: 5 4 }}
.curve {{ fill: none; stroke-width: 1.8; stroke-linejoin: round }} .broken {{ stroke-dasharray: 7 5 }} .dot {{ fill: none; stroke-width: 4.5; stroke-linecap: round }} .whisker {{ fill: none; stroke-width: 2 }}
"##,
        w = SIZE_PX[0]
    );
    for (ink, value) in INKS {
        let id = ink.id();
        let _ = writeln!(
            svg,
            ".{id} {{ stroke: {value} }} .fill-{id} {{ fill: {value}; fill-opacity: 0.16 }} .bar-{id} {{ fill: {value} }}"
        );
    }
    let _ = writeln!(svg, "</style>\n<rect width=\"{}\" height=\"{height}\" fill=\"#fff\"/>", SIZE_PX[0]);
    svg
}

fn legend(svg: &mut String, plot: &Plot) {
    let (mut x_px, y_px) = (26.0, 58.0);
    let mut entry = |svg: &mut String, sample: &dyn Fn(&mut String, f64), words: &str| {
        sample(svg, x_px);
        text(svg, "note", [x_px + 32.0, y_px], words);
        x_px += 32.0 + 7.4 * words.chars().count() as f64 + 24.0;
    };
    for series in plot.series.iter().filter(|s| plot.series.len() > 1 && !s.name.is_empty()) {
        let class = classes(series);
        let is_dot = matches!(series.style, Style::Dots | Style::Interval);
        let sample = |svg: &mut String, x_px: f64| {
            let (from, to) = if is_dot { (x_px + 12.0, x_px + 12.0) } else { (x_px, x_px + 24.0) };
            if is_dot {
                let _ = writeln!(svg, r#"<path class="{class}" d="M{from:.1} {:.1}h0"/>"#, y_px - 5.0);
            } else {
                line(svg, &class, [from, y_px - 5.0], [to, y_px - 5.0]);
            }
        };
        entry(svg, &sample, &series.name);
    }
    for band in plot.bands.iter().filter(|b| !b.name.is_empty()) {
        let sample = |svg: &mut String, x_px: f64| {
            let _ = writeln!(
                svg,
                r#"<rect class="fill-{}" x="{x_px:.1}" y="{:.1}" width="24" height="12"/>"#,
                band.ink.id(),
                y_px - 11.0
            );
        };
        entry(svg, &sample, &band.name);
    }
    if let Some(map) = &plot.map {
        let reach = map.reach();
        for (share, words) in [
            (-1.0, format!("−{reach:.2e} {}", map.unit)),
            (0.0, "0".to_owned()),
            (1.0, format!("{reach:.2e} {}", map.unit)),
        ] {
            let sample = |svg: &mut String, x_px: f64| {
                let _ = writeln!(
                    svg,
                    r##"<rect fill="{}" stroke="#888" x="{x_px:.1}" y="{:.1}" width="24" height="12"/>"##,
                    colour(share),
                    y_px - 11.0
                );
            };
            entry(svg, &sample, &words);
        }
    }
}

fn classes(series: &Series) -> String {
    let shape = match series.style {
        Style::Line => "curve",
        Style::Dashed => "curve broken",
        Style::Dots | Style::Interval => "dot",
        Style::Bars => "whisker",
    };
    format!("{shape} {}", series.ink.id())
}

/// The scale, from what is to be drawn.
fn panel(plot: &Plot, height: f64) -> Panel {
    let named = plot.y.rows.len();
    let left_px = if named > 0 { LEFT_OF_NAMES_PX } else { LEFT_PX };
    let along = |axis: &Axis, values: &mut dyn Iterator<Item = f64>, margin: f64| -> Range<f64> {
        if let Some([from, to]) = axis.first.or(axis.range) {
            return scaled(axis, from)..scaled(axis, to);
        }
        let (low, high) = values
            .filter(|v| v.is_finite())
            .map(|v| scaled(axis, v))
            .filter(|v| v.is_finite())
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)));
        if low > high {
            return 0.0..1.0;
        }
        let room = if high > low { margin * (high - low) } else { 0.5 * high.abs().max(1e-9) };
        low - room..high + room
    };
    let ends = || plot.series.iter().flat_map(|s| s.ends.iter().flatten().flatten().copied());
    let (x, y) = if let Some(map) = &plot.map {
        let over = |edges: &[f64]| edges.first().copied().unwrap_or(0.0)..edges.last().copied().unwrap_or(1.0);
        (over(&map.x_edges), over(&map.y_edges))
    } else if named > 0 {
        let zero = plot.series.iter().any(|s| s.style == Style::Bars).then_some(0.0);
        // rows count from the top
        (along(&plot.x, &mut plot.at.iter().copied().chain(ends()).chain(zero), 0.04), -(named as f64) - 0.5..-0.5)
    } else {
        let margin = if plot.is_time || plot.series.iter().all(|s| matches!(s.style, Style::Line | Style::Dashed)) {
            0.0
        } else {
            0.04
        };
        let across = plot.bands.iter().filter(|b| b.is_across).flat_map(|b| b.ends);
        let in_sight = |x: f64| plot.x.first.is_none_or(|[from, to]| from <= x && x <= to);
        let values = plot
            .series
            .iter()
            .flat_map(|s| plot.at.iter().zip(&s.values).filter(|(x, _)| in_sight(**x)).filter_map(|(_, y)| *y));
        (
            along(&plot.x, &mut plot.at.iter().copied(), margin),
            along(&plot.y, &mut values.chain(ends()).chain(across), 0.06),
        )
    };
    Panel { x_px: left_px..SIZE_PX[0] - MARGIN_PX[0], y_px: MARGIN_PX[1]..height - MARGIN_PX[2], x, y }
}

fn scaled(axis: &Axis, value: f64) -> f64 {
    if axis.is_logarithmic { value.log10() } else { value }
}

struct Canvas<'p> {
    panel: &'p Panel,
    plot: &'p Plot,
}

impl Canvas<'_> {
    fn draw(&self, svg: &mut String) {
        let (panel, plot) = (self.panel, self.plot);
        for band in &plot.bands {
            let axis = if band.is_across { &plot.y } else { &plot.x };
            let ends = scaled(axis, band.ends[0])..scaled(axis, band.ends[1]);
            let class = format!("fill-{}", band.ink.id());
            if band.is_across {
                panel.rectangle(svg, &class, &panel.x, &ends);
            } else if ends.start < panel.x.end && ends.end > panel.x.start {
                panel.rectangle(svg, &class, &ends, &panel.y);
            }
        }
        if let Some(map) = &plot.map {
            cells(svg, panel, map);
        }
        self.axes(svg);
        for Line { name, at } in &plot.lines {
            if let Some(x_px) = panel.vertical(svg, "mark", scaled(&plot.x, *at)) {
                let is_late = x_px > 0.8 * SIZE_PX[0];
                let (class, x_px) = if is_late { ("note end", x_px - 5.0) } else { ("note", x_px + 5.0) };
                text(svg, class, [x_px, panel.y_px.start + 15.0], name);
            }
        }
        for series in &plot.series {
            self.series(svg, series);
        }
        panel.outline(svg);
        text(svg, "heading end", [panel.x_px.end, panel.y_px.end + 42.0], &plot.x.words());
        if plot.y.rows.is_empty() {
            let middle_px = 0.5 * (panel.y_px.start + panel.y_px.end);
            let _ = writeln!(svg, r#"<g transform="translate(22 {middle_px:.1}) rotate(-90)">"#);
            text(svg, "heading middle", [0.0, 0.0], &plot.y.words());
            svg.push_str("</g>\n");
        }
    }

    fn axes(&self, svg: &mut String) {
        let (panel, plot) = (self.panel, self.plot);
        if plot.x.is_logarithmic {
            panel.powers_along(svg)
        } else {
            panel.numbers_along(svg)
        }
        if plot.y.is_logarithmic {
            panel.powers_up(svg);
        } else if let Some(step) = plot.y.step {
            panel.numbers_up_by(svg, step);
        } else if plot.y.rows.is_empty() {
            panel.numbers_up(svg);
        }
        for (row, name) in plot.y.rows.iter().enumerate() {
            let [_, y_px] = panel.place(panel.x.start, -(row as f64 + 1.0));
            line(svg, "grid", [panel.x_px.start, y_px], [panel.x_px.end, y_px]);
            text(svg, "heading end", [panel.x_px.start - 10.0, y_px + 4.5], name);
        }
    }

    fn series(&self, svg: &mut String, series: &Series) {
        let (panel, plot) = (self.panel, self.plot);
        let named = !plot.y.rows.is_empty();
        let up = |y: f64| if named { -y } else { scaled(&plot.y, y) };
        let points: Vec<Option<(f64, f64)>> = plot
            .at
            .iter()
            .zip(&series.values)
            .map(|(x, y)| Some((scaled(&plot.x, *x), up((*y)?))).filter(|(x, y)| x.is_finite() && y.is_finite()))
            .collect();
        let class = classes(series);
        for (point, ends) in points.iter().zip(&series.ends) {
            let (Some((x, y)), Some(ends)) = (point, ends) else { continue };
            let [from, to] = ends.map(|end| {
                if named {
                    panel.place(scaled(&plot.x, end).clamp(panel.x.start, panel.x.end), *y)
                } else {
                    panel.place(*x, up(end).clamp(panel.y.start, panel.y.end))
                }
            });
            line(svg, &format!("whisker {}", series.ink.id()), from, to);
        }
        match series.style {
            Style::Line | Style::Dashed => panel.polyline(svg, &class, &thinned(&points, panel)),
            Style::Dots | Style::Interval => {
                panel.dots(svg, &class, &points.iter().flatten().copied().collect::<Vec<_>>())
            }
            Style::Bars => {
                for (x, y) in points.iter().flatten() {
                    panel.rectangle(svg, &format!("bar-{}", series.ink.id()), &(0.0..*x), &(y - 0.3..y + 0.3));
                }
            }
        }
    }
}

/// A long curve by the first, lowest, highest and last value of each column of the page; short ones as they are.
fn thinned(points: &[Option<(f64, f64)>], panel: &Panel) -> Vec<Option<(f64, f64)>> {
    if points.len() < 4 * COLUMNS {
        return points.to_vec();
    }
    let width = (panel.x.end - panel.x.start) / COLUMNS as f64;
    let column = |p: &Option<(f64, f64)>| p.map(|(x, _)| ((x - panel.x.start) / width) as i64);
    let mut kept = Vec::new();
    for run in points.chunk_by(|a, b| column(a) == column(b)) {
        let order = |a: &&Option<(f64, f64)>, b: &&Option<(f64, f64)>| {
            a.map(|p| p.1).partial_cmp(&b.map(|p| p.1)).unwrap_or(std::cmp::Ordering::Equal)
        };
        let extremes = [run.first(), run.iter().min_by(order), run.iter().max_by(order), run.last()];
        kept.extend(extremes.into_iter().flatten().copied());
    }
    kept
}

fn cells(svg: &mut String, panel: &Panel, map: &Map) {
    let reach = map.reach();
    for (column, values) in map.values.iter().enumerate() {
        for (row, value) in values.iter().enumerate() {
            let Some(value) = value else { continue };
            let [left, bottom] = panel.place(map.x_edges[column], map.y_edges[row]);
            let [right, top] = panel.place(map.x_edges[column + 1], map.y_edges[row + 1]);
            let _ = writeln!(
                svg,
                r#"<rect fill="{}" x="{left:.1}" y="{top:.1}" width="{:.1}" height="{:.1}"/>"#,
                colour(value / reach),
                right - left + 0.3,
                bottom - top + 0.3
            );
        }
    }
}

/// Blue at −1, white at 0, vermillion at 1.
fn colour(share: f64) -> String {
    let end = if share < 0.0 { [0x00, 0x72, 0xb2] } else { [0xd5, 0x5e, 0x00] };
    let share = share.abs().min(1.0);
    let mixed = end.map(|c| (255.0 + share * (f64::from(c) - 255.0)).round() as u8);
    format!("#{:02x}{:02x}{:02x}", mixed[0], mixed[1], mixed[2])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_curve_keeps_its_peaks() {
        let panel = Panel { x_px: 0.0..960.0, y_px: 0.0..100.0, x: 0.0..1e5, y: -1.0..9.0 };
        let mut points: Vec<Option<(f64, f64)>> = (0..100_000).map(|k| Some((f64::from(k), 0.0))).collect();
        points[54_321] = Some((54_321.0, 8.0));
        points[777] = None;
        let kept = thinned(&points, &panel);
        assert!(kept.len() < 5 * COLUMNS && kept.contains(&Some((54_321.0, 8.0))));
    }

    #[test]
    fn the_colours_of_a_map_go_from_blue_over_white_to_vermillion() {
        assert_eq!([-1.0, 0.0, 1.0].map(colour), ["#0072b2", "#ffffff", "#d55e00"]);
    }
}
