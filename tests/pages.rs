//! The pages for people hold: their examples run as they stand, their tables name what the program knows.
//!
//! Of a page's fenced blocks those marked `sh` are run, one after the other, in a folder of their own that has the
//! repository's `videos` and `fixtures` and the recording `swing.mp4`. A block marked `toml NAME` is written there as a
//! file, as a reader would. `shell` is for what builds or installs and is not run.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

use assert_cmd::cargo::cargo_bin;
use freeswing::experiment::Experiment;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn page(name: &str) -> String {
    std::fs::read_to_string(root().join(name)).unwrap()
}

fn pages() -> Vec<String> {
    let docs = std::fs::read_dir(root().join("docs")).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap());
    let docs = docs.filter(|name| name.ends_with(".md")).map(|name| format!("docs/{name}"));
    std::iter::once("README.md".to_owned()).chain(docs).collect()
}

/// Fenced blocks: what stands behind the fence, and the text.
fn blocks(text: &str) -> Vec<(&str, &str)> {
    let fenced = text.split("\n```").skip(1).step_by(2);
    fenced.filter_map(|block| block.split_once('\n')).map(|(mark, text)| (mark.trim(), text)).collect()
}

/// Without its fenced blocks.
fn prose(text: &str) -> String {
    text.split("\n```").step_by(2).collect::<Vec<_>>().join("\n")
}

fn path_with_binaries() -> String {
    let binaries = cargo_bin("track").parent().map(PathBuf::from).unwrap();
    format!("{}:{}", binaries.display(), std::env::var("PATH").unwrap())
}

/// The short recording that stands for a reader's own.
fn swing() -> &'static Path {
    static RECORDING: OnceLock<PathBuf> = OnceLock::new();
    RECORDING.get_or_init(|| {
        let recording = Path::new(env!("CARGO_TARGET_TMPDIR")).join("swing.mp4");
        let config = root().join("fixtures/render/first.toml");
        let mut render = Command::new(cargo_bin("freeswing"));
        render.args(["render", "--quiet", "--config"]).arg(config).arg("--out").arg(&recording);
        assert!(render.status().unwrap().success());
        recording
    })
}

/// Runs a page's examples; the folder holds what they made.
fn run(name: &str) -> tempfile::TempDir {
    let text = page(name);
    let folder = tempfile::tempdir().unwrap();
    for name in ["videos", "fixtures"] {
        std::os::unix::fs::symlink(root().join(name), folder.path().join(name)).unwrap();
    }
    if text.contains("swing.mp4") {
        std::fs::copy(swing(), folder.path().join("swing.mp4")).unwrap();
    }
    let mut count = 0;
    for (mark, block) in blocks(&text) {
        if let Some(file) = mark.strip_prefix("toml ") {
            std::fs::write(folder.path().join(file), block).unwrap();
        }
        if mark == "sh" {
            let mut shell = Command::new("sh");
            shell.current_dir(folder.path()).env("PATH", path_with_binaries()).args(["-e", "-c", block]);
            let output = shell.output().unwrap();
            assert!(output.status.success(), "{name}:\n{block}{}", String::from_utf8_lossy(&output.stderr));
            count += 1;
        }
    }
    assert!(count > 0, "{name} has no example marked sh");
    folder
}

/// First cells of the rows of all tables below a heading that holds `word`.
fn first_cells(text: &str, word: &str) -> Vec<String> {
    let mut inside = false;
    let mut cells = Vec::new();
    for line in text.lines() {
        if line.starts_with('#') {
            inside = line.contains(word);
        }
        let cell = line.strip_prefix("| `").and_then(|rest| rest.split_once('`')).map(|(cell, _)| cell);
        cells.extend(cell.filter(|_| inside).map(str::to_owned));
    }
    cells
}

#[test]
fn the_readme_runs() {
    let folder = run("README.md");
    let table = std::fs::read_to_string(folder.path().join("angles.csv")).unwrap();
    let header = "frame,t_s,m1_x_px,m1_y_px,m2_x_px,m2_y_px,m3_x_px,m3_y_px,theta1_rad,theta2_rad";
    assert!(table.starts_with(header) && table.lines().count() == 301, "{} rows", table.lines().count());
}

#[test]
fn the_first_recording_runs() {
    let folder = run("docs/first-recording.md");
    let diagnosis = std::fs::read_to_string(folder.path().join("diagnosis.json")).unwrap();
    let diagnosis: serde_json::Value = serde_json::from_str(&diagnosis).unwrap();
    assert_eq!(diagnosis["verdict"]["effects"], serde_json::json!(["hinge_coulomb"]));
}

#[test]
fn the_filming_advice_runs() {
    run("docs/filming.md");
}

#[test]
fn the_page_on_the_experiment_file_runs() {
    run("docs/experiment-file.md");
}

#[test]
fn the_page_on_troubleshooting_runs() {
    run("docs/troubleshooting.md");
}

#[test]
fn the_page_on_light_runs_and_its_numbers_are_true() {
    let folder = run("docs/light.md");
    let force = std::fs::read_to_string(folder.path().join("force.json")).unwrap();
    let force: serde_json::Value = serde_json::from_str(&force).unwrap();
    let tip = &force["points"][1];
    let um = |key: &str| format!("{:.1} µm", 1e6 * tip[key].as_f64().unwrap());
    let text = page("docs/light.md");
    assert!(text.contains(&format!("{:.2} µm", 1e6 * tip["strip_m"].as_f64().unwrap())), "{tip}");
    assert!(text.contains(&um("heat_m")), "{tip}");
}

#[test]
fn the_page_on_folders_runs() {
    let folder = run("docs/folders.md");
    let summary = std::fs::read_to_string(folder.path().join("results/summary.csv")).unwrap();
    let header: Vec<&str> = summary.lines().next().unwrap().split(',').collect();
    let text = page("docs/folders.md");
    let named: Vec<&str> = text
        .lines()
        .filter_map(|line| line.strip_prefix("| `").and_then(|rest| rest.split_once(" |")))
        .flat_map(|(cell, _)| cell.trim_end_matches('`').split("`, `"))
        .collect();
    assert!(header.iter().all(|column| named.contains(column)), "{header:?} are not all in the table");
    assert!(folder.path().join("results/kapton/small.mp4/identify.json").is_file());
}

#[test]
fn the_page_on_diagnosis_runs() {
    let folder = run("docs/diagnosis.md");
    let diagnosis = std::fs::read_to_string(folder.path().join("diagnosis.json")).unwrap();
    let diagnosis: serde_json::Value = serde_json::from_str(&diagnosis).unwrap();
    let mut named: Vec<&str> =
        diagnosis["verdict"]["effects"].as_array().unwrap().iter().filter_map(|name| name.as_str()).collect();
    named.sort_unstable();
    assert_eq!(named, ["air_quadratic", "hinge_coulomb"]);
    assert_eq!(diagnosis["verdict"]["status"], "identified");
}

#[test]
fn the_page_on_the_push_of_light_runs() {
    let folder = run("docs/laser.md");
    let report = std::fs::read_to_string(folder.path().join("laser.json")).unwrap();
    let report: serde_json::Value = serde_json::from_str(&report).unwrap();
    assert_eq!(report["verdict"]["effects"], serde_json::json!(["heat"]));
    let end = |k: usize| 1e6 * report["push_m"]["interval"][k].as_f64().unwrap();
    assert!(end(0) < 1.011 && 1.011 < end(1), "{}", report["push_m"]);
}

#[test]
fn the_page_on_outputs_names_what_is_in_them() {
    let folder = run("docs/outputs.md");
    let text = page("docs/outputs.md");
    for file in ["angles.json", "identify.json", "fit.json", "diagnosis.json"] {
        let json = std::fs::read_to_string(folder.path().join(file)).unwrap();
        let json: serde_json::Value = serde_json::from_str(&json).unwrap();
        let named = first_cells(&text, file);
        assert!(named.len() > 4, "{file}: {named:?}");
        for path in named {
            assert!(holds(&json, &path), "{file} holds no {path}");
        }
    }
}

/// A path of keys; a list is looked into at its first entry, and an `ID` is any key.
fn holds(json: &serde_json::Value, path: &str) -> bool {
    let mut here = json;
    for key in path.split('.') {
        let name = key.trim_end_matches("[]");
        let next = match name {
            "ID" => here.as_object().and_then(|o| o.values().next()),
            _ => here.get(name),
        };
        let Some(next) = next else { return false };
        here = if key.ends_with("[]") { next.get(0).unwrap_or(&serde_json::Value::Null) } else { next };
    }
    true
}

#[test]
fn the_page_on_the_experiment_file_holds_every_key_and_no_other() {
    let known: BTreeSet<String> = Experiment::known_keys().into_iter().collect();
    let described: BTreeSet<String> = described_keys().into_iter().map(|(key, _)| key).collect();
    let missing: Vec<_> = known.difference(&described).collect();
    let unknown: Vec<_> = described.difference(&known).collect();
    assert!(
        missing.is_empty() && unknown.is_empty(),
        "not described: {missing:?}; described but not known: {unknown:?}"
    );
}

#[test]
fn the_stated_defaults_are_those_of_the_program() {
    let parse = |text: &str| {
        let e = Experiment::parse(text, Path::new("e.toml")).unwrap_or_else(|e| panic!("{text}: {e}"));
        // what of the specimen is stated changes what is still missing, not its values
        (e.rig, e.model, e.render, e.specimen.inertia)
    };
    let mut count = 0;
    for (key, default) in described_keys() {
        let Some(value) = default else { continue };
        let (table, name) = key.rsplit_once('.').unwrap();
        let mut with = parse(&format!("[{table}]\n{name} = {value}\n"));
        // whether a damper, or the number of rods, is stated is remembered, not a value
        with.1.states_damping = false;
        with.1.states_pieces = false;
        assert_eq!(with, parse(""), "{key} = {value}");
        count += 1;
    }
    assert!(count > 20, "{count} defaults");
}

/// Keys of the tables `| key | unit | default | meaning |`, each below a heading that ends in its table: `` `[rig]` ``;
/// with the default where it stands in backticks.
fn described_keys() -> Vec<(String, Option<String>)> {
    let text = page("docs/experiment-file.md");
    let mut table = String::new();
    let mut keys = Vec::new();
    for line in prose(&text).lines() {
        if let Some(name) = line.strip_prefix('#').and_then(|l| l.rsplit_once("`[")).map(|(_, name)| name) {
            name.trim_end_matches(['`', ']']).trim_start_matches('[').clone_into(&mut table);
        }
        let cells: Vec<&str> = line.split('|').map(str::trim).collect();
        if let ["", key, _, default, _, ""] = cells[..]
            && let Some(key) = key.strip_prefix('`').and_then(|k| k.strip_suffix('`'))
        {
            let default = default.strip_prefix('`').and_then(|d| d.strip_suffix('`'));
            keys.push((format!("{table}.{key}"), default.map(str::to_owned)));
        }
    }
    keys
}

#[test]
fn every_option_that_a_page_names_exists() {
    let help = |program: &str, command: &[&str]| {
        let output = Command::new(cargo_bin(program)).args(command).arg("--help").output().unwrap();
        String::from_utf8(output.stdout).unwrap()
    };
    let commands = [
        "init", "track", "identify", "fit", "diagnose", "simulate", "render", "modes", "paper", "run", "batch",
        "report", "export", "doctor", "force", "laser",
    ];
    let help: String = commands.iter().map(|command| help("freeswing", &[command])).collect();
    for name in pages() {
        let text = prose(&page(&name));
        let spans = text.split('`').skip(1).step_by(2).filter(|span| span.starts_with("--"));
        for option in spans.filter_map(|span| span.split([' ', '=', '\n']).next()) {
            assert!(help.contains(&format!("{option} ")) || help.contains(&format!("{option}\n")), "{name}: {option}");
        }
    }
}

#[test]
fn no_page_has_examples_that_are_not_run() {
    let run = [
        "README",
        "first-recording",
        "filming",
        "experiment-file",
        "outputs",
        "folders",
        "troubleshooting",
        "diagnosis",
        "light",
        "laser",
    ];
    for name in pages() {
        let has_examples = blocks(&page(&name)).iter().any(|(mark, _)| *mark == "sh");
        let stem = Path::new(&name).file_stem().unwrap().to_str().unwrap();
        assert!(!has_examples || run.contains(&stem), "{name} has examples that no test here runs");
    }
}

#[test]
fn no_page_names_a_missing_file_or_heading() {
    for name in pages() {
        let text = page(&name);
        let folder = root().join(&name).parent().unwrap().to_owned();
        let links = text.split("](").skip(1).filter_map(|after| after.split(')').next());
        for link in links.filter(|l| !l.starts_with("http")) {
            let (file, heading) = link.split_once('#').unwrap_or((link, ""));
            let target = if file.is_empty() { root().join(&name) } else { folder.join(file) };
            assert!(target.exists(), "{name}: {link}");
            if !heading.is_empty() {
                let headings = std::fs::read_to_string(&target).unwrap();
                let mut headings = headings.lines().filter(|l| l.starts_with('#')).map(anchor);
                assert!(headings.any(|h| h == heading), "{name}: {link}");
            }
        }
    }
}

/// The anchor that a heading gets on the web: letters and digits in lower case, hyphens for spaces, nothing else.
fn anchor(heading: &str) -> String {
    let text = heading.trim_start_matches('#').trim().to_lowercase();
    let kept = text.chars().filter(|c| c.is_alphanumeric() || matches!(c, ' ' | '-' | '_'));
    kept.map(|c| if c == ' ' { '-' } else { c }).collect()
}

#[test]
fn the_readme_is_short() {
    let lines = page("README.md").lines().count();
    assert!(lines <= 150, "{lines} lines");
}
