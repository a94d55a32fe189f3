//! Commands, versions, hashes, configuration: what it takes to do it again.

use super::Chapter;
use crate::report::html::{escaped, table, verbatim, verbatim_copyable};
use crate::report::left::Left;

/// The chapter.
pub fn chapter(left: &Left) -> Chapter {
    let mut chapter = Chapter::new("files", "How it was made");
    let commands = left.log.as_ref().map(|log| log.commands.join("\n")).unwrap_or_default();
    if !commands.is_empty() {
        chapter.words(format!("<h3>Commands</h3>\n{}", verbatim(&commands)));
    }
    chapter.words(versions(left));
    chapter.words(digests(left));
    if let Some(configuration) = &left.configuration {
        chapter.words(format!("<h3>Configuration: <code>experiment.toml</code></h3>\n{}", verbatim(configuration)));
    }
    if let Some(log) = left.log.as_ref().filter(|log| !log.text.trim().is_empty()) {
        chapter.words(format!(
            "<details><summary>Log: <code>log.txt</code></summary>\n{}</details>\n",
            verbatim(&log.text)
        ));
    }
    chapter
}

fn versions(left: &Left) -> String {
    let tracked = left
        .track
        .as_ref()
        .filter(|t| !t.version.is_empty())
        .map(|t| ("tracked by", format!("freeswing {}", t.version)));
    let rows = tracked.into_iter().chain([("this page", format!("freeswing {}", env!("CARGO_PKG_VERSION")))]);
    let rows = rows.map(|(what, version)| vec![what.to_owned(), verbatim_copyable(&version)]);
    format!("<h3>Versions</h3>\n{}", table(&["what", "program"], rows))
}

fn digests(left: &Left) -> String {
    let code = |name: &str| format!("<code>{}</code>", escaped(name));
    let source = left.track.as_ref().map(|t| &t.source).filter(|s| !s.sha256.is_empty());
    let source = source.map(|s| vec![format!("the recording, {}", code(&s.file)), verbatim_copyable(&s.sha256)]);
    let rows = left.digests.iter().map(|(name, digest)| vec![code(name), verbatim_copyable(digest)]);
    let rows: Vec<Vec<String>> = source.into_iter().chain(rows).collect();
    format!("<h3>SHA-256</h3>\n<div class=\"hashes\">{}</div>", table(&["file", "digest"], rows))
}
