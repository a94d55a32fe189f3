//! Words and numbers as HTML. Whatever comes from a file is text, never markup.

use std::fmt::Write;

use base64::prelude::{BASE64_STANDARD, Engine};

use super::left::Interval;
use crate::digits::number;

/// Text that cannot be taken for markup; control characters are left out.
pub fn escaped(words: &str) -> String {
    let mut safe = String::with_capacity(words.len());
    for c in words.chars() {
        match c {
            '&' => safe.push_str("&amp;"),
            '<' => safe.push_str("&lt;"),
            '>' => safe.push_str("&gt;"),
            '"' => safe.push_str("&quot;"),
            '\'' => safe.push_str("&#39;"),
            '\n' | '\t' => safe.push(c),
            c if c.is_control() => {}
            c => safe.push(c),
        }
    }
    safe
}

/// A paragraph.
pub fn paragraph(words: &str) -> String {
    format!("<p>{}</p>\n", escaped(words))
}

/// A list; nothing of nothing.
pub fn list(class: &str, items: impl IntoIterator<Item = String>) -> String {
    let items: String = items.into_iter().map(|item| format!("<li>{}</li>\n", escaped(&item))).collect();
    if items.is_empty() { items } else { format!("<ul class=\"{class}\">\n{items}</ul>\n") }
}

/// A number that a click copies, with its unit.
pub fn copyable(words: &str, unit: &str) -> String {
    // degrees and exponents as people write them; a program reads what is copied
    let unit = if unit == "1" { "" } else { unit };
    let gap = if unit.is_empty() || unit == "°" { "" } else { " " };
    let raised_unit = unit.replace('2', "²").replace('3', "³");
    let shown = format!("{}{gap}{raised_unit}", minus(&powers(words)));
    let copied = format!("{words}{gap}{unit}");
    button(&shown, &copied)
}

/// What is copied as it stands: a digest, a version, a formula.
pub fn verbatim_copyable(words: &str) -> String {
    button(words, words)
}

fn button(shown: &str, copied: &str) -> String {
    let (shown, copied) = (escaped(shown), escaped(copied));
    format!("<button type=\"button\" class=\"n\" data-copy=\"{copied}\" title=\"copy\">{shown}</button>")
}

/// A sign in front as a sign, not a hyphen.
fn minus(words: &str) -> String {
    match words.strip_prefix("(-").map(|rest| ("(−", rest)).or_else(|| words.strip_prefix('-').map(|rest| ("−", rest)))
    {
        Some((sign, rest)) => format!("{sign}{rest}"),
        None => words.to_owned(),
    }
}

/// With a capital in front, as a sentence begins.
pub fn capitalised(words: &str) -> String {
    let mut letters = words.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

/// A value alone.
pub fn value(value: Option<f64>, digits: usize, unit: &str) -> String {
    value.filter(|v| v.is_finite()).map_or_else(|| "–".to_owned(), |v| copyable(&number(v, digits), unit))
}

/// Values of each angle, with the prefix milli.
pub fn milli(values: &[Option<f64>], link: usize, unit: &str) -> String {
    value(values.get(link).copied().flatten().map(|v| 1e3 * v), 3, unit)
}

/// A value and half the width of its 95 % interval.
pub fn interval(of: &Interval, unit: &str) -> String {
    with_half(of.value, of.half(), unit)
}

/// A value and what stands behind ±, to two digits of that.
pub fn with_half(value: Option<f64>, half: Option<f64>, unit: &str) -> String {
    let Some(value) = value.filter(|v| v.is_finite()) else { return "–".to_owned() };
    let Some(half) = half.filter(|h| h.is_finite() && *h > 0.0) else { return copyable(&number(value, 5), unit) };
    copyable(&plus_minus(value, half), unit)
}

/// `value ± half`, to two digits of the half.
pub fn plus_minus(value: f64, half: f64) -> String {
    let magnitude = |v: f64| if v == 0.0 { 0 } else { v.abs().log10().floor() as i32 };
    let first = magnitude(value).max(magnitude(half));
    let last = magnitude(half) - 1;
    if (-4..6).contains(&first) && last >= -7 {
        let digits = (-last).max(0) as usize;
        return format!("{value:.digits$} ± {half:.digits$}");
    }
    let (scale, digits) = (10f64.powi(first), (first - last).clamp(0, 12) as usize);
    format!("({:.digits$} ± {:.digits$})e{first}", value / scale, half / scale)
}

/// `2.0e-7` → `2.0·10⁻⁷`.
fn powers(words: &str) -> String {
    let mut shown = String::new();
    let mut rest = words;
    while let Some(at) = rest.find('e') {
        let (before, after) = rest.split_at(at);
        let exponent: String = after[1..].chars().take_while(|c| c.is_ascii_digit() || *c == '-').collect();
        let follows_number = before.ends_with(|c: char| c.is_ascii_digit() || c == ')');
        shown.push_str(before);
        if follows_number && exponent.parse::<i32>().is_ok() {
            shown.push_str("·10");
            shown.extend(exponent.chars().map(raised));
            rest = &after[1 + exponent.len()..];
        } else {
            shown.push('e');
            rest = &after[1..];
        }
    }
    shown + rest
}

fn raised(c: char) -> char {
    match c {
        '-' => '⁻',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        c => c.to_digit(10).and_then(|d| char::from_u32(0x2070 + d)).unwrap_or(c),
    }
}

/// A table whose cells are HTML already.
pub fn table(headings: &[&str], rows: impl IntoIterator<Item = Vec<String>>) -> String {
    let mut html = "<div class=\"table\"><table>\n<thead><tr>".to_owned();
    headings.iter().for_each(|h| _ = write!(html, "<th scope=\"col\">{}</th>", escaped(h)));
    html.push_str("</tr></thead>\n<tbody>\n");
    for row in rows {
        let mut cells = row.into_iter();
        let _ = write!(html, "<tr><th scope=\"row\">{}</th>", cells.next().unwrap_or_default());
        cells.for_each(|cell| _ = write!(html, "<td>{cell}</td>"));
        html.push_str("</tr>\n");
    }
    html + "</tbody></table></div>\n"
}

/// A text as it stands in a file.
pub fn verbatim(text: &str) -> String {
    format!("<pre tabindex=\"0\">{}</pre>\n", escaped(text))
}

/// Bytes as base64, for `data:` addresses.
pub fn base64(bytes: &[u8]) -> String {
    BASE64_STANDARD.encode(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn markup_in_a_name_is_text() {
        assert_eq!(escaped("<b a='\"'>&\u{7}"), "&lt;b a=&#39;&quot;&#39;&gt;&amp;");
    }

    #[test]
    fn a_number_is_shown_with_a_power_of_ten_and_copied_as_programs_read_it() {
        let html = copyable("(2.00 ± 0.03)e-7", "N m");
        assert!(
            html.contains("data-copy=\"(2.00 ± 0.03)e-7 N m\"") && html.contains(">(2.00 ± 0.03)·10⁻⁷ N m<"),
            "{html}"
        );
        assert!(copyable("-1.5", "kg/m2").contains("data-copy=\"-1.5 kg/m2\" title=\"copy\">−1.5 kg/m²<"));
        assert_eq!(powers("1.5e-12 made"), "1.5·10⁻¹² made");
    }

    #[test]
    fn a_digest_is_no_number() {
        assert!(verbatim_copyable("b46e925").contains(">b46e925<"));
    }

    #[test]
    fn two_digits_of_the_interval_are_kept() {
        assert_eq!(plus_minus(1.35964, 0.00172), "1.3596 ± 0.0017");
        assert_eq!(plus_minus(2.0e-7, 3.4e-10), "(2.0000 ± 0.0034)e-7");
        assert_eq!(plus_minus(1234.5, 20.0), "1234 ± 20");
    }

    #[test]
    fn base64_agrees_with_its_definition() {
        assert_eq!(
            ["", "f", "fo", "foo", "foob"].map(|t| base64(t.as_bytes())),
            ["", "Zg==", "Zm8=", "Zm9v", "Zm9vYg=="]
        );
    }
}
