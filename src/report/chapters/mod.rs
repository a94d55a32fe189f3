//! What the page says, chapter by chapter, from what the run left.

mod files;
mod frequencies;
mod lacking;
mod model;
mod recording;
mod top;

pub use frequencies::moving as moving_modes;
pub use top::{results, sentence};

use super::left::Left;
use super::plot::Plot;

/// A chapter.
#[derive(Debug, Default)]
pub struct Chapter {
    /// Its address within the page.
    pub id: &'static str,
    /// Its heading.
    pub title: &'static str,
    /// From top to bottom.
    pub parts: Vec<Part>,
}

/// A piece of a chapter.
#[derive(Debug)]
pub enum Part {
    /// HTML.
    Words(String),
    /// A figure.
    Plot(Box<Plot>),
    /// The recording.
    Film,
    /// The modes as the strip, moving.
    MovingModes,
}

impl Chapter {
    fn new(id: &'static str, title: &'static str) -> Self {
        Self { id, title, parts: Vec::new() }
    }

    fn words(&mut self, html: impl Into<String>) {
        let html = html.into();
        if !html.is_empty() {
            self.parts.push(Part::Words(html));
        }
    }

    /// Adds a figure that shows something.
    fn plot(&mut self, plot: Plot) {
        if !plot.is_empty() {
            self.parts.push(Part::Plot(Box::new(plot)));
        }
    }
}

/// All chapters that have something to say.
pub fn chapters(left: &Left) -> Vec<Chapter> {
    let all = [
        top::warnings(left),
        recording::chapter(left),
        frequencies::chapter(left),
        model::chapter(left),
        lacking::chapter(left),
        lacking::places(left),
        files::chapter(left),
    ];
    all.into_iter().filter(|chapter| !chapter.parts.is_empty()).collect()
}

/// Values of one unit in another.
fn times(values: &[Option<f64>], factor: f64) -> Vec<Option<f64>> {
    values.iter().map(|v| v.map(|v| factor * v)).collect()
}
