//! A plot, before anyone draws it: [`figure`](super::figure) makes SVG of it for print and for `figures/`, `page.js` draws it on the screen, and its
//! columns are its CSV.

use std::collections::HashMap;
use std::fmt::Write;

use serde::Serialize;
use serde_json::{Value, json};

/// Rows of a plot on the page; of a longer one every second, third, … is drawn there, and all stand in its CSV.
const MOST_ROWS: usize = 12_000;

/// Up to so many rows a plot's table stands on the page as it is; longer ones the page makes of the columns.
const FEW_ROWS: usize = 400;

/// A plot.
#[derive(Debug, Clone, Default)]
pub struct Plot {
    /// Its name in files and on the page.
    pub id: String,
    /// Above it.
    pub title: String,
    /// What it shows, in words, for whoever does not see it.
    pub alternative: String,
    /// Below it.
    pub caption: String,
    /// Along.
    pub x: Axis,
    /// Up.
    pub y: Axis,
    /// Whether `at` is the recording's time, so that the film moves with it.
    pub is_time: bool,
    /// Where each row stands along x, not falling.
    pub at: Vec<f64>,
    /// What is drawn over `at`.
    pub series: Vec<Series>,
    /// Regions.
    pub bands: Vec<Band>,
    /// Lines at one value of x.
    pub lines: Vec<Line>,
    /// A map in the place of series.
    pub map: Option<Map>,
}

/// An axis.
#[derive(Debug, Clone, Default)]
pub struct Axis {
    /// What it is.
    pub label: String,
    /// In which unit; empty of a pure number.
    pub unit: &'static str,
    /// Powers of ten.
    pub is_logarithmic: bool,
    /// Names in the place of numbers: row 1, row 2, … from the top.
    pub rows: Vec<String>,
    /// From where to where, if not as the values go.
    pub range: Option<[f64; 2]>,
    /// The part that is looked at first, if not all.
    pub first: Option<[f64; 2]>,
    /// From number to number, if not as it fits.
    pub step: Option<f64>,
}

impl Axis {
    /// A linear one.
    pub fn of(label: impl Into<String>, unit: &'static str) -> Self {
        Self { label: label.into(), unit, ..Self::default() }
    }

    /// Label and unit.
    pub fn words(&self) -> String {
        if self.unit.is_empty() { self.label.clone() } else { format!("{} ({})", self.label, self.unit) }
    }
}

/// A colour, of those that everyone tells apart (Okabe and Ito), by its name in the style sheets.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Ink {
    /// Measured.
    #[default]
    Ink,
    Blue,
    Vermillion,
    Green,
    Orange,
    Purple,
    Sky,
    /// What only marks.
    Grey,
}

impl Ink {
    /// Of an angle or a mode by its number from 0.
    pub fn number(k: usize) -> Self {
        [Self::Blue, Self::Vermillion, Self::Green, Self::Purple, Self::Orange, Self::Sky][k % 6]
    }

    /// Its name in the style sheets.
    pub fn id(self) -> &'static str {
        match self {
            Self::Ink => "ink",
            Self::Blue => "blue",
            Self::Vermillion => "vermillion",
            Self::Green => "green",
            Self::Orange => "orange",
            Self::Purple => "purple",
            Self::Sky => "sky",
            Self::Grey => "grey",
        }
    }
}

/// How a series is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Style {
    /// From value to value.
    #[default]
    Line,
    /// The same, broken.
    Dashed,
    /// One a value.
    Dots,
    /// With the ends of its interval: along x where y has names, else along y.
    Interval,
    /// From zero along x, where y has names.
    Bars,
}

/// Values over `at`.
#[derive(Debug, Clone, Default)]
pub struct Series {
    /// In the legend, and with the unit of y in the CSV.
    pub name: String,
    /// Its colour.
    pub ink: Ink,
    /// How it is drawn.
    pub style: Style,
    /// One a row; absent where there is none.
    pub values: Vec<Option<f64>>,
    /// Ends of each interval.
    pub ends: Vec<Option<[f64; 2]>>,
}

/// A region: between two values of x, or of y.
#[derive(Debug, Clone, Default, Serialize)]
pub struct Band {
    /// What it is.
    pub name: String,
    /// Its colour.
    pub ink: Ink,
    /// Whether the ends are values of y.
    pub is_across: bool,
    /// From where to where.
    pub ends: [f64; 2],
}

/// A line at one value of x.
#[derive(Debug, Clone, Default, Serialize)]
pub struct Line {
    /// What it is.
    pub name: String,
    /// Where.
    pub at: f64,
}

/// Values on a grid, drawn as colours: blue below zero, vermillion above.
#[derive(Debug, Clone, Default, Serialize)]
pub struct Map {
    /// What a colour stands for.
    pub name: String,
    /// Of the values.
    pub unit: &'static str,
    /// Edges of the columns along x.
    pub x_edges: Vec<f64>,
    /// Edges of the rows along y.
    pub y_edges: Vec<f64>,
    /// `[column][row]`; absent where nothing was.
    pub values: Vec<Vec<Option<f64>>>,
}

impl Map {
    /// The largest value to either side of zero.
    pub fn reach(&self) -> f64 {
        self.values.iter().flatten().flatten().fold(f64::MIN_POSITIVE, |most, v| most.max(v.abs()))
    }
}

impl Plot {
    /// Whether there is anything to draw.
    pub fn is_empty(&self) -> bool {
        let drawn = self.series.iter().any(|s| s.values.iter().any(Option::is_some));
        !drawn && self.map.as_ref().is_none_or(|m| m.values.iter().flatten().flatten().next().is_none())
    }

    /// Its columns as a table.
    pub fn csv(&self) -> String {
        if let Some(map) = &self.map {
            return self.csv_of(map);
        }
        let named = !self.y.rows.is_empty();
        let mut csv = self.header() + "\n";
        for (row, at) in self.at.iter().enumerate() {
            if named {
                let name = self.series.iter().find_map(|s| s.values[row]).map_or(0, |y| y.round() as usize);
                let _ = write!(
                    csv,
                    "\"{}\",",
                    self.y.rows.get(name.wrapping_sub(1)).map_or("", String::as_str).replace('"', "'")
                );
            }
            let _ = write!(csv, "{at}");
            for series in self.series.iter().filter(|_| !named) {
                csv.push(',');
                series.values[row].iter().for_each(|v| _ = write!(csv, "{v}"));
            }
            for series in self.series.iter().filter(|s| !s.ends.is_empty()) {
                let [low, high] = series.ends[row].map_or([const { String::new() }; 2], |e| e.map(|v| v.to_string()));
                let _ = write!(csv, ",{low},{high}");
            }
            csv.push('\n');
        }
        csv
    }

    /// Names of the columns.
    fn header(&self) -> String {
        let named = !self.y.rows.is_empty();
        let mut header = column_name(&self.x.label, self.x.unit);
        if named {
            header = format!("{},{header}", column_name(&self.y.label, ""));
        }
        for series in self.series.iter().filter(|_| !named) {
            let _ = write!(header, ",{}", column_name(&series.name, self.y.unit));
        }
        let unit = if named { self.x.unit } else { self.y.unit };
        for series in self.series.iter().filter(|s| !s.ends.is_empty()) {
            for end in ["low", "high"] {
                let _ = write!(header, ",{}", column_name(&format!("{} {end}", series.name), unit));
            }
        }
        header
    }

    fn csv_of(&self, map: &Map) -> String {
        let (x, y) = (column_name(&self.x.label, self.x.unit), column_name(&self.y.label, self.y.unit));
        let mut csv = format!("{x}_from,{x}_to,{y}_from,{y}_to,{}\n", column_name(&map.name, map.unit));
        for (column, values) in map.values.iter().enumerate() {
            for (row, value) in values.iter().enumerate() {
                let (x, y) = (&map.x_edges[column..column + 2], &map.y_edges[row..row + 2]);
                let value = value.map_or(String::new(), |v| format!("{v:.6e}"));
                let _ = writeln!(csv, "{},{},{},{},{value}", x[0], x[1], y[0], y[1]);
            }
        }
        csv
    }
}

/// `measured θ1`, `rad` → `measured_theta1_rad`.
fn column_name(words: &str, unit: &str) -> String {
    let latin = words.replace('θ', "theta").replace('ξ', "xi").replace('Δ', "delta ");
    let unit =
        unit.replace('·', " ").replace('/', " per ").replace('²', "2").replace('°', "deg").replace('%', "percent");
    let both = format!("{latin} {unit}");
    let plain: String = both.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { ' ' }).collect();
    plain.split_whitespace().collect::<Vec<_>>().join("_").to_lowercase()
}

/// Columns that several plots share, each written once.
#[derive(Debug, Default)]
pub struct Columns {
    columns: Vec<Value>,
    known: HashMap<Vec<u64>, usize>,
}

impl Columns {
    /// The number of a column.
    fn keep(&mut self, values: &[Option<f64>]) -> usize {
        let key = values.iter().map(|v| v.map_or(u64::MAX, f64::to_bits)).collect();
        *self.known.entry(key).or_insert_with(|| {
            self.columns.push(values.iter().map(|v| v.map_or(Value::Null, rounded)).collect());
            self.columns.len() - 1
        })
    }

    /// All of them, `[column][row]`.
    pub fn into_json(self) -> Value {
        Value::Array(self.columns)
    }

    /// A plot as `page.js` reads it.
    pub fn plot(&mut self, plot: &Plot) -> Value {
        let every = plot.at.len().div_ceil(MOST_ROWS).max(1);
        let thinned = |values: &mut dyn Iterator<Item = Option<f64>>| values.step_by(every).collect::<Vec<_>>();
        let axis = |axis: &Axis| json!({"label": axis.label, "unit": axis.unit, "log": axis.is_logarithmic, "rows": axis.rows, "range": axis.range, "first": axis.first, "step": axis.step});
        let at = self.keep(&thinned(&mut plot.at.iter().copied().map(Some)));
        let series: Vec<Value> = plot
            .series
            .iter()
            .map(|s| {
                let values = self.keep(&thinned(&mut s.values.iter().copied()));
                let ends = (!s.ends.is_empty())
                    .then(|| [0, 1].map(|side| self.keep(&thinned(&mut s.ends.iter().map(|e| e.map(|e| e[side]))))));
                json!({"name": s.name, "ink": s.ink, "style": s.style, "values": values, "ends": ends})
            })
            .collect();
        json!({
            "id": plot.id, "title": plot.title, "time": plot.is_time, "x": axis(&plot.x), "y": axis(&plot.y), "at": at,
            "csv": (plot.at.len() <= FEW_ROWS || plot.map.is_some()).then(|| plot.csv()), "header": plot.header(),
            "series": series, "bands": plot.bands, "lines": plot.lines, "map": plot.map, "every": every,
        })
    }
}

/// Seven digits, which is more than a screen shows and less than a file wants to hold.
fn rounded(value: f64) -> Value {
    format!("{value:.6e}").parse::<f64>().ok().filter(|v| v.is_finite()).map_or(Value::Null, Value::from)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plot() -> Plot {
        let values = vec![Some(0.1), None];
        Plot {
            x: Axis::of("t", "s"),
            y: Axis::of("angle", "rad"),
            at: vec![0.0, 1.0],
            series: vec![Series { name: "measured θ1".into(), values, ..Series::default() }],
            ..Plot::default()
        }
    }

    #[test]
    fn the_columns_bear_their_units_and_gaps_are_empty() {
        assert_eq!(plot().csv(), "t_s,measured_theta1_rad\n0,0.1\n1,\n");
    }

    #[test]
    fn a_column_that_two_plots_share_is_written_once() {
        let mut columns = Columns::default();
        let [first, second] = [columns.plot(&plot()), columns.plot(&plot())];
        assert_eq!(first, second);
        assert_eq!(columns.into_json(), json!([[0.0, 1.0], [0.1, null]]));
    }

    #[test]
    fn a_long_recording_is_thinned_on_the_page_alone() {
        let rows = 30_000;
        let long = Plot {
            at: (0..rows).map(f64::from).collect(),
            series: vec![Series { values: vec![Some(1.0); rows as usize], ..Series::default() }],
            ..plot()
        };
        let mut columns = Columns::default();
        assert_eq!(columns.plot(&long)["every"], 3);
        assert_eq!(columns.into_json()[0].as_array().map(Vec::len), Some(10_000));
        assert_eq!(long.csv().lines().count(), rows as usize + 1);
    }
}
