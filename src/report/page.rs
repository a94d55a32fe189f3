//! The page: one file that holds everything it shows.

use std::fmt::Write;

use serde_json::json;

use super::chapters::{self, Chapter, Part};
use super::html::{base64, escaped};
use super::left::Left;
use super::plot::{Columns, Plot};
use crate::error::{Error, Result};

const TEMPLATE: &str = include_str!("assets/page.html");
const STYLE: &str = include_str!("assets/page.css");
const SCRIPT: &str = include_str!("assets/page.js");
const PLOTTER: &str = include_str!("assets/uPlot.iife.min.js");
const PLOTTER_STYLE: &str = include_str!("assets/uPlot.min.css");
const PLOTTER_LICENCE: &str = include_str!("assets/uPlot.LICENSE");

/// The page may be this large; the recording is inside it where there is room.
const MOST_BYTES: usize = 8_000_000;

/// A figure that was drawn.
#[derive(Debug)]
pub struct Drawn {
    /// Its name.
    pub id: String,
    /// The drawing.
    pub svg: String,
    /// Its columns.
    pub csv: String,
}

/// The page's text.
///
/// # Errors
/// [`Error::Unreadable`] of an overlay that cannot be read.
pub fn page<'d>(left: &Left, chapters: &[Chapter], drawn: impl Iterator<Item = &'d Drawn>) -> Result<String> {
    let mut drawn = drawn;
    let mut columns = Columns::default();
    let (mut plots, mut body, mut contents, mut film_at) = (Vec::new(), String::new(), String::new(), None);
    for chapter in chapters {
        let _ = writeln!(contents, "<li><a href=\"#{}\">{}</a></li>", chapter.id, chapter.title);
        let _ = writeln!(
            body,
            "<section id=\"{id}\" aria-labelledby=\"{id}-title\">\n<h2 id=\"{id}-title\">{}</h2>",
            chapter.title,
            id = chapter.id
        );
        for part in &chapter.parts {
            match part {
                Part::Words(html) => body.push_str(html),
                Part::Film => film_at = Some(body.len()),
                Part::MovingModes => body.push_str(MOVING_MODES),
                Part::Plot(plot) => {
                    let described = columns.plot(plot);
                    body.push_str(&figure(plot, described["every"].as_u64().unwrap_or(1), drawn.next()));
                    plots.push(described);
                }
            }
        }
        body.push_str("</section>\n");
    }
    let stamps = left.track.as_ref();
    let data = json!({
        "columns": columns.into_json(),
        "plots": plots,
        "modes": chapters::moving_modes(left),
        "links": left.angles.as_ref().map_or(0, crate::series::AngleSeries::links),
        "time_scale": stamps.and_then(|t| t.options.time_scale).filter(|s| *s > 0.0).unwrap_or(1.0),
    });
    // within a script nothing but `</` and `<!--` ends or opens anything
    let data = data.to_string().replace('<', "\\u003c");
    let title = left.title();
    let sentence = chapters::sentence(left);
    let mut fields = vec![
        ("title", escaped(&title)),
        ("sentence", escaped(&sentence)),
        ("about", about(left)),
        ("contents", contents),
        ("plotter_style", PLOTTER_STYLE.to_owned()),
        ("style", STYLE.to_owned()),
        ("plotter_licence", PLOTTER_LICENCE.trim().to_owned()),
        ("plotter", PLOTTER.to_owned()),
        ("script", SCRIPT.to_owned()),
        ("data", data),
        ("version", env!("CARGO_PKG_VERSION").to_owned()),
    ];
    let body_size = body.len() + fields.iter().map(|f| f.1.len()).sum::<usize>() + TEMPLATE.len();
    let mut film_data = String::new();
    if let Some(at) = film_at {
        let [place, data] = film(left, MOST_BYTES.saturating_sub(body_size))?;
        body.insert_str(at, &place);
        film_data = data;
    }
    fields.push(("film", film_data));
    Ok(filled(&fields, &body))
}

/// The template with its fields, each put in once, so that nothing in them is taken for a field.
fn filled(fields: &[(&str, String)], body: &str) -> String {
    let mut page = String::new();
    let mut rest = TEMPLATE;
    while let Some((before, after)) = rest.split_once("{{") {
        let (name, after) = after.split_once("}}").unwrap_or(("", after));
        page.push_str(before);
        let own = fields.iter().find(|f| f.0 == name).map(|f| f.1.as_str());
        page.push_str(if name == "body" { body } else { own.unwrap_or_default() });
        rest = after;
    }
    page + rest
}

fn about(left: &Left) -> String {
    let source = left.track.as_ref().map(|t| t.source.file.clone()).filter(|f| !f.is_empty());
    let length = left.angles.as_ref().map(|a| {
        format!(
            "{:.2} s, {} rows, {} angle{}",
            a.duration_s(),
            a.len(),
            a.links(),
            if a.links() == 1 { "" } else { "s" }
        )
    });
    let together = left.together();
    let together =
        (!together.is_empty()).then(|| format!("{} recordings together: {}", together.len(), together.join(", ")));
    let parts: Vec<String> = [source, length, together].into_iter().flatten().collect();
    escaped(&parts.join(" · "))
}

const MOVING_MODES: &str = "<div class=\"modes screen\" id=\"moving-modes\"><p class=\"note\">Mode shapes as the specimen moves, amplitudes enlarged, without damping. \
<button type=\"button\" id=\"modes-play\" aria-pressed=\"false\">Move</button></p><div class=\"row\"></div></div>\n";

fn figure(plot: &Plot, every: u64, drawn: Option<&Drawn>) -> String {
    let (id, title, words) = (escaped(&plot.id), escaped(&plot.title), escaped(&plot.alternative));
    let still = drawn.map(|d| base64(d.svg.as_bytes())).unwrap_or_default();
    let thinned = if every > 1 {
        format!(" Every {every}th row is drawn and saved here; all stand in <code>figures/{id}.csv</code>.")
    } else {
        String::new()
    };
    let keys = if plot.is_time {
        "Arrow keys move frame by frame, space plays, + and − enlarge, Escape shows all."
    } else {
        "Arrow keys move along the values, + and − enlarge, Escape shows all."
    };
    format!(
        "<figure class=\"plot\" id=\"plot-{id}\" data-plot=\"{id}\">\n<h3>{title}</h3>\n\
         <div class=\"live screen\" tabindex=\"0\" role=\"application\" aria-roledescription=\"plot\" aria-label=\"{title}. {words}. {keys}\"></div>\n\
         <img class=\"still\" loading=\"lazy\" src=\"data:image/svg+xml;base64,{still}\" alt=\"{title}. {words}.\">\n\
         <figcaption>{caption}{thinned}</figcaption>\n\
         <p class=\"save screen\">Save: <button type=\"button\" data-save=\"csv\">CSV</button> <button type=\"button\" data-save=\"svg\">SVG</button> \
         <button type=\"button\" data-save=\"png\">PNG</button></p>\n</figure>\n",
        caption = escaped(&plot.caption),
    )
}

/// Where the recording is shown, and the recording itself for the end of the page, where there is room; else it stays beside the page.
fn film(left: &Left, room: usize) -> Result<[String; 2]> {
    let path = left.path("overlay.mp4");
    let fits = left.overlay_bytes.is_some_and(|bytes| bytes.div_ceil(3) * 4 + 2000 <= room as u64);
    let (source, note, data) = if fits {
        let bytes = std::fs::read(&path).map_err(|e| Error::unreadable(&path, e))?;
        // at the end, so that everything else is seen before so much is read
        let data =
            format!("<script type=\"text/plain\" id=\"film-data\">data:video/mp4;base64,{}</script>\n", base64(&bytes));
        ("", "", data)
    } else {
        let note = "<p class=\"note\">The recording is too large to be inside this page: keep <a href=\"overlay.mp4\">overlay.mp4</a> beside it.</p>\n";
        (" src=\"overlay.mp4\"", note, String::new())
    };
    let [width, height] = left.track.as_ref().map_or([16, 9], |t| [t.video.width_px.max(1), t.video.height_px.max(1)]);
    let place = format!(
        "<div class=\"film\" id=\"film\"><div class=\"frame\">\n<video controls muted playsinline preload=\"auto\"{source} style=\"aspect-ratio: {width} / {height}\" \
         aria-label=\"The recording with the marks, their trails and the angles drawn in. Comma and full stop, or the arrow keys, step frame by frame.\"></video>\n\
         <p class=\"readout\" id=\"readout\"></p></div></div>\n{note}"
    );
    Ok([place, data])
}

/// The plots that stand on a page which [`page`] wrote. What comes from files is escaped on it and cannot look like one.
pub fn plots_of(page: &str) -> impl Iterator<Item = &str> {
    let ids = page.split(" data-plot=\"").skip(1).filter_map(|rest| rest.split('"').next());
    ids.filter(|id| !id.is_empty() && id.bytes().all(|b| b.is_ascii_alphanumeric() || b == b'-'))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_names_of_figures_are_read_off_a_page() {
        let page = r#"<figure class="plot" data-plot="decay"> data-plot="../angles" data-plot="" data-plot="left-1">"#;
        assert_eq!(plots_of(page).collect::<Vec<_>>(), ["decay", "left-1"]);
    }

    #[test]
    fn what_looks_like_a_field_in_a_name_stays_as_it_is() {
        let page = filled(&[("title", "{{script}}".to_owned()), ("script", "own()".to_owned())], "{{data}}");
        assert!(page.contains("<title>{{script}}") && page.contains("own()") && page.contains("{{data}}"), "{page}");
    }
}
