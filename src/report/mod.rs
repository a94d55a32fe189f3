//! One self-contained page, and figures, from what a run left in its folder.
//!
//! | file | holds |
//! |---|---|
//! | [`left`] | what is in the folder, read back |
//! | [`curves`] | tables that a run leaves for the page, and how they are read |
//! | [`chapters`] | what the page says |
//! | [`plot`] | a plot before anyone draws it |
//! | [`figure`], [`svg`], [`mod@png`] | the plot as SVG and as PNG |
//! | [`html`], [`page`] | words and numbers as HTML; the whole page |
//!
//! Nothing is analysed anew: numbers come from the JSON files. Only spectra, which those do not hold, are computed from the angles.

pub mod chapters;
pub mod curves;
pub mod figure;
pub mod html;
pub mod left;
pub mod page;
pub mod plot;
pub mod png;
pub mod svg;

use std::path::{Path, PathBuf};

use rayon::prelude::*;

pub use curves::{diagnosis_curves, fit_curves, where_curves};

use crate::error::{Error, Result};
use crate::output::{self, OutputFile};
use chapters::Part;
use left::Left;
use page::Drawn;

/// Writes `report.html` and, for every plot on it, `figures/*.svg`, `*.png` and `*.csv`, from what a run left in the folder; all of them or none.
/// Figures of an earlier page that are no longer made are removed.
///
/// # Errors
/// [`Error::Left`] of a folder that holds nothing of a run, or a JSON file that is none; [`Error::Unreadable`], [`Error::Unwritable`].
pub fn write(folder: &Path) -> Result<()> {
    let left = Left::read(folder)?;
    let chapters = chapters::chapters(&left);
    let plots = chapters.iter().flat_map(|c| &c.parts).filter_map(|part| match part {
        Part::Plot(plot) => Some(plot),
        _ => None,
    });
    // pictures take most of the time, and each is by itself
    let drawn: Vec<(Drawn, Vec<u8>)> = plots
        .collect::<Vec<_>>()
        .into_par_iter()
        .map(|plot| {
            let svg = figure::svg(plot);
            let png = png::png(&svg)?;
            Ok((Drawn { id: plot.id.clone(), svg, csv: plot.csv() }, png))
        })
        .collect::<Result<_>>()?;
    let figures = folder.join("figures");
    if !drawn.is_empty() {
        output::make_folder(&figures)?;
    }
    let page = page::page(&left, &chapters, drawn.iter().map(|d| &d.0))?;
    let mut files = Vec::new();
    let mut keep = |path: &Path, contents: &[u8]| -> Result<()> {
        let mut file = OutputFile::create(path)?;
        file.write(contents)?;
        files.push(file);
        Ok(())
    };
    for (figure, png) in &drawn {
        let named = |extension: &str| figures.join(format!("{}.{extension}", figure.id));
        keep(&named("svg"), figure.svg.as_bytes())?;
        keep(&named("png"), png)?;
        keep(&named("csv"), figure.csv.as_bytes())?;
    }
    let gone = no_longer_made(&folder.join("report.html"), &drawn);
    keep(&folder.join("report.html"), page.as_bytes())?;
    files.into_iter().try_for_each(OutputFile::appear)?;
    for path in gone.iter().flat_map(|id| files_of(&figures, id)) {
        match std::fs::remove_file(&path) {
            Err(error) if error.kind() != std::io::ErrorKind::NotFound => return Err(Error::unwritable(&path, error)),
            _ => {}
        }
    }
    Ok(())
}

/// What the run of a folder has found, in a line; nothing where it has found nothing.
///
/// # Errors
/// As [`write()`].
pub fn results(folder: &Path) -> Result<Option<String>> {
    let results = chapters::results(&Left::read(folder)?);
    Ok((!results.is_empty()).then(|| results.join(". ") + "."))
}

/// Every figure of the page in a folder, be it there or not.
pub fn figures_on_page(folder: &Path) -> Vec<PathBuf> {
    let Ok(page) = std::fs::read_to_string(folder.join("report.html")) else { return Vec::new() };
    page::plots_of(&page).flat_map(|id| files_of(&folder.join("figures"), id)).collect()
}

/// A figure's files.
fn files_of(figures: &Path, id: &str) -> [PathBuf; 3] {
    ["svg", "png", "csv"].map(|extension| figures.join(format!("{id}.{extension}")))
}

/// Figures that stand on an earlier page and are not among those drawn now: what this program made, and nothing else.
fn no_longer_made(page: &Path, drawn: &[(Drawn, Vec<u8>)]) -> Vec<String> {
    let Ok(earlier) = std::fs::read_to_string(page) else { return Vec::new() };
    let ids = page::plots_of(&earlier).filter(|id| drawn.iter().all(|(own, _)| own.id != *id));
    ids.map(str::to_owned).collect()
}
