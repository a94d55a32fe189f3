//! `freeswing report` as a user types it, and its page in a browser.

mod browser;

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::time::{Duration, Instant};

use assert_cmd::Command;
use freeswing::diagnose;
use freeswing::experiment::Experiment;
use freeswing::fit::{self, Record};
use freeswing::progress::Silent;
use freeswing::report;
use freeswing::series::AngleSeries;
use predicates::prelude::*;
use predicates::str::contains;
use serde_json::json;

use browser::Browser;

fn freeswing(command: &str) -> Command {
    let mut freeswing = Command::cargo_bin("freeswing").unwrap();
    freeswing.arg(command);
    freeswing
}

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// What a run would leave of a recording, but for its page.
fn leave(video: &Path, config: &Path, folder: &Path) {
    fs::create_dir_all(folder.join("figures")).unwrap();
    let at = |name: &str| folder.join(name);
    fs::copy(config, at("experiment.toml")).unwrap();
    let (angles, config) = (at("angles.csv"), at("experiment.toml"));
    freeswing("track")
        .arg(video)
        .arg("--config")
        .arg(&config)
        .arg("--out")
        .arg(&angles)
        .arg("--overlay")
        .arg(at("overlay.mp4"))
        .arg("--quiet")
        .assert()
        .success();
    for (command, json) in [("identify", "identify.json"), ("fit", "fit.json")] {
        freeswing(command)
            .arg(&angles)
            .arg("--config")
            .arg(&config)
            .arg("--json")
            .arg(at(json))
            .arg("--quiet")
            .assert()
            .success();
    }
    let experiment = Experiment::read_with_specimen(&config).unwrap();
    let series = AngleSeries::read(&angles).unwrap();
    let records = [Record::of(&series, series.links()).unwrap()];
    let fitted = fit::fit(&records, &experiment, &fit::base_parameters(&experiment, series.links())).unwrap();
    fs::write(at("figures/fit.csv"), report::fit_curves(&fitted, &records)).unwrap();
    let diagnosis = diagnose::diagnose(&records, &experiment, &diagnose::Options::default(), &Silent).unwrap();
    fs::write(at("diagnosis.json"), serde_json::to_string(&diagnosis).unwrap()).unwrap();
    fs::write(at("figures/diagnosis.csv"), report::diagnosis_curves(&diagnosis).unwrap()).unwrap();
    if let Some(map) = report::where_curves(&diagnosis) {
        fs::write(at("figures/where.csv"), map).unwrap();
    }
    fs::write(
        at("log.txt"),
        "$ track swing.mp4 --config experiment.toml --out angles.csv\nwarning: a word of warning\n",
    )
    .unwrap();
}

/// A folder of a short recording whose hinge rubs, which its experiment file does not know; made once.
fn finished() -> &'static Path {
    static FOLDER: OnceLock<PathBuf> = OnceLock::new();
    FOLDER.get_or_init(|| {
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("report");
        let _ = fs::remove_dir_all(&folder);
        fs::create_dir_all(&folder).unwrap();
        let config = root().join("fixtures/render/first.toml");
        let video = folder.join("swing.mp4");
        freeswing("render").arg("--quiet").arg("--config").arg(&config).arg("--out").arg(&video).assert().success();
        let known = fs::read_to_string(config).unwrap().replace("hinge_coulomb = 6.0e-7", "");
        let base = folder.join("base.toml");
        fs::write(&base, known.split("[render]").next().unwrap()).unwrap();
        let run = folder.join("run");
        leave(&video, &base, &run);
        freeswing("report").arg(&run).assert().success().stdout(contains("report.html"));
        run
    })
}

/// A copy to spoil.
fn copy() -> tempfile::TempDir {
    let copy = tempfile::tempdir().unwrap();
    for entry in fs::read_dir(finished()).unwrap().map(Result::unwrap).filter(|e| e.path().is_file()) {
        fs::copy(entry.path(), copy.path().join(entry.file_name())).unwrap();
    }
    fs::create_dir(copy.path().join("figures")).unwrap();
    for name in ["fit.csv", "diagnosis.csv", "where.csv"].iter().filter(|n| finished().join("figures").join(n).exists())
    {
        fs::copy(finished().join("figures").join(name), copy.path().join("figures").join(name)).unwrap();
    }
    fs::remove_file(copy.path().join("report.html")).unwrap();
    copy
}

fn page(folder: &Path) -> String {
    fs::read_to_string(folder.join("report.html")).unwrap()
}

/// Values of `src` and `href` on a page.
fn addresses(page: &str) -> Vec<&str> {
    let marks = [" src=\"", " href=\""];
    marks.iter().flat_map(|mark| page.split(mark).skip(1).map(|rest| rest.split('"').next().unwrap())).collect()
}

#[test]
fn the_page_holds_everything_it_shows() {
    let page = page(finished());
    assert!(page.len() < 8_000_000, "{}", page.len());
    for address in addresses(&page) {
        assert!(address.starts_with("data:") || address.starts_with('#'), "{}", &address[..address.len().min(80)]);
    }
    assert!(!page.contains("@import") && !page.contains("url("));
    for id in ["warnings", "recording", "frequencies", "model", "missing", "where", "files"] {
        assert!(page.contains(&format!("<section id=\"{id}\"")), "{id}");
    }
    for words in ["a word of warning", "hinge_coulomb", "video/mp4;base64,", "link_lengths_m", "$ track", "SHA-256"] {
        assert!(page.contains(words.trim_start_matches("$ ")), "{words}");
    }
    assert_eq!(page.matches("<img ").count(), page.matches("<img class=\"still\"").count());
    assert!(page.matches(" alt=\"\"").count() == 0 && page.matches("<img ").count() >= 15);
}

#[test]
fn every_plot_is_a_figure_beside_the_page() {
    let (page, figures) = (page(finished()), finished().join("figures"));
    let ids: Vec<&str> = page.split("data-plot=\"").skip(1).map(|rest| rest.split('"').next().unwrap()).collect();
    for id in &ids {
        let svg = fs::read_to_string(figures.join(format!("{id}.svg"))).unwrap();
        assert!(svg.starts_with("<svg") && svg.ends_with("</svg>\n") && !svg.contains("NaN"), "{id}");
        let png = image::open(figures.join(format!("{id}.png"))).unwrap().to_rgb8();
        assert!(png.width() == 1920 && png.pixels().any(|p| p.0[0] < 100), "{id}");
        let csv = fs::read_to_string(figures.join(format!("{id}.csv"))).unwrap();
        // rows of another length than the header's are an error
        let rows: Vec<csv::StringRecord> =
            csv::Reader::from_reader(csv.as_bytes()).records().collect::<Result<_, _>>().unwrap();
        assert!(!rows.is_empty(), "{id}");
    }
    for id in [
        "angles",
        "spectrum",
        "half-power-1",
        "decay",
        "frequency-amplitude-1",
        "damping-amplitude-1",
        "estimators-frequency-1",
        "mode-shapes",
    ] {
        assert!(ids.contains(&id), "{id} of {ids:?}");
    }
    for id in [
        "model-1",
        "residual",
        "residual-spectrum",
        "before-after-1",
        "left-2",
        "inclusion",
        "where-energy",
        "where-time",
        "where-amplitude",
    ] {
        assert!(ids.contains(&id), "{id} of {ids:?}");
    }
}

#[test]
fn the_same_folder_makes_the_same_page() {
    let (first, second) = (copy(), copy());
    let write = |folder: &Path| {
        report::write(folder).unwrap();
        page(folder)
    };
    assert!(write(first.path()) == write(second.path()));
    // what it wrote is no input to the next one
    assert!(write(first.path()) == page(second.path()));
}

#[test]
fn what_a_run_did_not_reach_is_left_out_with_the_reason() {
    let folder = copy();
    for name in ["fit.json", "diagnosis.json", "overlay.mp4"] {
        fs::remove_file(folder.path().join(name)).unwrap();
    }
    fs::write(folder.path().join("log.txt"), "$ freeswing fit\nerror: the hinge fell off; hang it up again\n").unwrap();
    freeswing("report").arg(folder.path()).arg("--quiet").assert().success().stdout("");
    let page = page(folder.path());
    assert!(page.contains("the hinge fell off; hang it up again") && page.contains("diagnosis.json"));
    assert!(
        !page.contains("<video")
            && !page.contains("<section id=\"missing\"")
            && page.contains("<section id=\"frequencies\"")
    );
    assert!(!folder.path().join("figures/model-1.svg").exists());
}

#[test]
fn figures_that_are_no_longer_made_go_and_others_stay() {
    let folder = copy();
    freeswing("report").arg(folder.path()).assert().success();
    let figures = folder.path().join("figures");
    assert!(figures.join("model-1.svg").exists() && figures.join("left-1.png").exists());
    fs::write(figures.join("mine.svg"), "my own").unwrap();
    fs::remove_file(folder.path().join("fit.json")).unwrap();
    freeswing("report").arg(folder.path()).assert().success();
    for extension in ["svg", "png", "csv"] {
        assert!(!figures.join(format!("model-1.{extension}")).exists(), "{extension}");
        assert!(figures.join(format!("left-1.{extension}")).exists(), "{extension}");
    }
    // neither what a person put there nor what another command left
    assert!(figures.join("mine.svg").exists() && figures.join("fit.csv").exists());
}

#[test]
fn a_table_alone_makes_a_page() {
    let folder = tempfile::tempdir().unwrap();
    fs::copy(finished().join("angles.csv"), folder.path().join("angles.csv")).unwrap();
    freeswing("report").arg(folder.path()).assert().success();
    assert!(page(folder.path()).contains("data-plot=\"angles\""));
}

#[test]
fn a_broken_file_is_one_line_and_nothing_is_written() {
    let folder = copy();
    fs::write(folder.path().join("fit.json"), "{\n\"parameters\": ").unwrap();
    freeswing("report")
        .arg(folder.path())
        .assert()
        .code(2)
        .stdout("")
        .stderr(contains("fit.json:2: is no JSON").and(contains("remove it")));
    assert!(!folder.path().join("report.html").exists() && !folder.path().join("figures/angles.svg").exists());
}

#[test]
fn a_folder_of_something_else_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    freeswing("report")
        .arg(folder.path())
        .assert()
        .code(2)
        .stderr(contains("holds nothing that a run leaves").and(predicate::function(|e: &str| e.lines().count() == 1)));
    freeswing("report").arg(folder.path().join("none")).assert().code(2).stderr(contains("cannot be read"));
}

#[test]
fn another_version_of_a_file_leaves_out_its_part_alone() {
    let folder = copy();
    fs::write(folder.path().join("identify.json"), r#"{"modes": "none", "summary": 7}"#).unwrap();
    freeswing("report").arg(folder.path()).assert().success();
    let page = page(folder.path());
    assert!(page.contains("another version of this program wrote it") && page.contains("<section id=\"model\""));
}

#[test]
fn names_from_files_are_text() {
    let folder = copy();
    let hostile = "</script><script>alert(1)</script><img src=x onerror=alert(2)>{{film}}{{script}}\"'";
    for name in ["fit.json", "diagnosis.json"] {
        let path = folder.path().join(name);
        let mut value: serde_json::Value = serde_json::from_str(&fs::read_to_string(&path).unwrap()).unwrap();
        value["specimen"] = json!(hostile);
        if name == "diagnosis.json" {
            value["verdict"]["statement"] = json!(hostile);
            value["verdict"]["effects"] = json!([hostile]);
            value["verdict"]["to_decide"] = json!(hostile);
            let alternatives = json!([{"formula": hostile}]);
            value["verdict"]["law"] = json!({"place": hostile, "formula": hostile, "unit": hostile, "toml": hostile, "alternatives": alternatives});
        }
        fs::write(path, value.to_string()).unwrap();
    }
    fs::write(folder.path().join("log.txt"), format!("$ {hostile}\nwarning: {hostile}\n")).unwrap();
    freeswing("report").arg(folder.path()).assert().success();
    let page = page(folder.path());
    assert!(!page.contains("<img src=x") && !page.contains("<script>alert") && page.contains("&lt;script&gt;alert(1)"));
    assert!(page.contains("The law that was learnt"));
    assert_eq!(page.matches("<video").count(), 1);
    let Some(mut browser) = Browser::start() else { return };
    browser.open(&folder.path().join("report.html"));
    assert_eq!(browser.complaints(), [""; 0]);
    assert!(browser.value("document.title").as_str().unwrap().starts_with("</script>"));
}

#[test]
fn a_recording_that_is_too_large_stays_beside_the_page() {
    let folder = copy();
    let file = fs::OpenOptions::new().write(true).open(folder.path().join("overlay.mp4")).unwrap();
    file.set_len(7_000_000).unwrap();
    freeswing("report").arg(folder.path()).assert().success();
    let page = page(folder.path());
    assert!(
        page.len() < 8_000_000
            && page.contains("src=\"overlay.mp4\"")
            && page.contains("too large to be inside this page")
    );
}

/// Share of a plot's canvas that is drawn on.
const DRAWN: &str = "(f => { const c = f.querySelector('canvas'); if (!c) return 0; const d = c.getContext('2d').getImageData(0, 0, c.width, c.height).data; \
                     let n = 0; for (let i = 3; i < d.length; i += 4) n += d[i] > 40; return n; })";

#[test]
fn in_a_browser_every_plot_is_drawn_and_nothing_is_fetched() {
    let Some(mut browser) = Browser::start() else { return };
    let opened = browser.open(&finished().join("report.html"));
    println!("opened in {opened:.2?}, drawn after {} ms", browser.value("document.documentElement.dataset.readyMs"));
    assert!(opened < Duration::from_secs(4), "{opened:?}");
    // what is in sight is drawn before all of the page is read, everything else without being scrolled to
    let first = browser.value("Number(document.documentElement.dataset.firstMs)").as_f64().unwrap();
    let ready = browser.value("Number(document.documentElement.dataset.readyMs)").as_f64().unwrap();
    assert!(first <= 1e3 * opened.as_secs_f64() && first < ready, "{first} ms, {opened:?}, {ready} ms");
    assert_eq!(browser.value("scrollY"), json!(0));
    assert_eq!(browser.complaints(), [""; 0]);
    for request in browser.requests() {
        assert!(
            request.starts_with("data:") || request.starts_with("blob:") || request.ends_with("/report.html"),
            "{}",
            &request[..request.len().min(90)]
        );
    }
    let empty = browser
        .value(&format!("[...document.querySelectorAll('figure.plot')].filter(f => {DRAWN}(f) < 500).map(f => f.id)"));
    assert_eq!(empty, json!([]));
    let plots = browser.value("document.querySelectorAll('figure.plot').length");
    assert_eq!(browser.value("Number(document.documentElement.dataset.ready)"), plots);
    // every figure, film and moving drawing can be named by a reader of screens
    assert_eq!(browser.value("[...document.querySelectorAll('.live, video, img, #moving-modes svg')].filter(e => !(e.getAttribute('aria-label') || e.alt)).length"), 0);
}

#[test]
fn in_a_browser_a_click_moves_the_recording_and_playing_moves_the_cursor() {
    let Some(mut browser) = Browser::start() else { return };
    browser.open(&finished().join("report.html"));
    browser.wait("document.querySelector('video').readyState >= 2");
    let stamps = AngleSeries::read(&finished().join("angles.csv")).unwrap().t_s;
    let time = "document.querySelector('video').currentTime";
    let head = "(id => new DOMMatrix(getComputedStyle(document.querySelector(`#plot-${id} .playhead`)).transform).m41)";
    for (plot, share) in [("angles", 0.5), ("left-1", 0.8), ("where-time", 0.25)] {
        browser.click(&format!("#plot-{plot} .u-over"), share);
        browser.wait("!document.querySelector('video').seeking");
        let (from, until) = (stamps[0], stamps[stamps.len() - 1]);
        let wanted = from + share * (until - from);
        let got = browser.value(time).as_f64().unwrap();
        assert!((got - wanted).abs() < 0.1, "{plot}: {got} instead of {wanted}");
    }
    // the frame that is shown is the one of the row
    browser.click("#plot-angles .u-over", 0.5);
    browser.wait("!document.querySelector('video').seeking");
    let before = browser.value(&format!("{head}('angles')")).as_f64().unwrap();
    browser.value("document.querySelector('video').play()");
    browser.wait(&format!("{head}('angles') > {before} + 5 && {head}('left-1') > 0"));
    assert!(browser.value("document.getElementById('readout').textContent").as_str().unwrap().contains("θ2 ="));
    browser.value("document.querySelector('video').pause()");
    // arrow keys step single frames
    browser.value("document.querySelector('#plot-angles .live').focus()");
    browser.key("Home");
    browser.wait(&format!("!document.querySelector('video').seeking && {time} < 0.03"));
    for _ in 0..3 {
        browser.key("ArrowRight");
    }
    browser.wait("!document.querySelector('video').seeking");
    let got = browser.value(time).as_f64().unwrap();
    assert!(stamps[3] <= got && got < stamps[4], "{got} between {} and {}", stamps[3], stamps[4]);
    assert_eq!(browser.complaints(), [""; 0]);
}

#[test]
fn in_a_browser_numbers_are_copied_and_tables_saved() {
    let Some(mut browser) = Browser::start() else { return };
    browser.open(&finished().join("report.html"));
    browser.value("navigator.clipboard.writeText = async text => { window.copied = text; }");
    browser.click("#frequencies .n", 0.5);
    browser.wait("window.copied !== undefined");
    assert!(browser.value("window.copied").as_str().unwrap().ends_with("Hz"));
    browser.value(
        "URL.createObjectURL = blob => { blob.text().then(text => window.saved = text); return 'data:,'; }; true",
    );
    browser.click("#plot-angles [data-save=csv]", 0.5);
    browser.wait("window.saved !== undefined");
    let saved = browser.value("window.saved");
    assert!(saved.as_str().unwrap().starts_with("t_s,theta1_rad,theta2_rad\n0,"), "{saved}");
    browser.value("delete window.saved; true");
    browser.click("#plot-where-time [data-save=csv]", 0.5);
    browser.wait("window.saved !== undefined");
    assert_eq!(browser.complaints(), [""; 0]);
}

#[test]
fn in_a_browser_it_can_be_printed_read_in_the_dark_and_on_a_phone() {
    let Some(mut browser) = Browser::start() else { return };
    browser.open(&finished().join("report.html"));
    let seen = "(s => [...document.querySelectorAll(s)].filter(e => e.getClientRects().length).length)";
    let plots = browser.value("document.querySelectorAll('figure.plot').length");
    assert_eq!(
        (browser.value(&format!("{seen}('.live')")), browser.value(&format!("{seen}('.still')"))),
        (plots.clone(), json!(0))
    );
    browser.call("Emulation.setEmulatedMedia", json!({"media": "print"}));
    assert_eq!(
        (browser.value(&format!("{seen}('.live, video, nav')")), browser.value(&format!("{seen}('.still')"))),
        (json!(0), plots.clone())
    );
    browser.wait("[...document.querySelectorAll('.still')].every(i => i.complete && i.naturalWidth === 960)");
    let printed = browser.call("Page.printToPDF", json!({"paperWidth": 8.27, "paperHeight": 11.69}));
    assert!(browser::decoded(printed["data"].as_str().unwrap()).starts_with(b"%PDF"));
    let light = browser.value("getComputedStyle(document.body).backgroundColor");
    let dark_scheme = json!({"media": "", "features": [{"name": "prefers-color-scheme", "value": "dark"}]});
    browser.call("Emulation.setEmulatedMedia", dark_scheme);
    browser.wait(&format!("getComputedStyle(document.body).backgroundColor !== {light} && document.documentElement.dataset.ready !== undefined"));
    browser.wait(&format!("[...document.querySelectorAll('figure.plot')].every(f => {DRAWN}(f) >= 500)"));
    browser.call(
        "Emulation.setDeviceMetricsOverride",
        json!({"width": 375, "height": 800, "deviceScaleFactor": 2, "mobile": true}),
    );
    browser.open(&finished().join("report.html"));
    assert_eq!(browser.value("document.documentElement.scrollWidth"), 375);
    assert_eq!(browser.complaints(), [""; 0]);
}

#[test]
fn a_minute_of_recording_is_reported_quickly_and_fits() {
    let folder = tempfile::tempdir().unwrap();
    let config = root().join("fixtures/render/first.toml");
    let angles = folder.path().join("angles.csv");
    freeswing("simulate")
        .arg("--config")
        .arg(&config)
        .args(["--duration", "60", "--rate", "60", "--noise-rad", "3e-4", "--out"])
        .arg(&angles)
        .assert()
        .success();
    freeswing("identify")
        .arg(&angles)
        .arg("--config")
        .arg(&config)
        .arg("--json")
        .arg(folder.path().join("identify.json"))
        .arg("--quiet")
        .assert()
        .success();
    let begun = Instant::now();
    freeswing("report").arg(folder.path()).assert().success();
    println!("{} bytes in {:.2?}", page(folder.path()).len(), begun.elapsed());
    assert!(page(folder.path()).len() < 3_000_000);
}

/// `cargo test --test report_page -- --ignored --nocapture`: the page of `videos/kapton.mp4`, to be looked at, with pictures of it.
#[test]
#[ignore = "makes pictures to be looked at"]
fn the_page_of_the_recording_that_comes_with_the_program() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("kapton");
    if !folder.join("diagnosis.json").exists() {
        leave(&root().join("videos/kapton.mp4"), &root().join("videos/kapton.base.toml"), &folder);
    }
    let begun = Instant::now();
    report::write(&folder).unwrap();
    println!("{}: {} bytes in {:.2?}", folder.display(), page(&folder).len(), begun.elapsed());
    let Some(mut browser) = Browser::start() else { return };
    let opened = browser.open(&folder.join("report.html"));
    println!("opened in {opened:.2?}, drawn after {} ms", browser.value("document.documentElement.dataset.readyMs"));
    browser.screenshot(&folder.join("light.png"));
    browser.call(
        "Emulation.setEmulatedMedia",
        json!({"media": "", "features": [{"name": "prefers-color-scheme", "value": "dark"}]}),
    );
    browser.screenshot(&folder.join("dark.png"));
    browser.call("Emulation.setEmulatedMedia", json!({"media": "", "features": []}));
    browser.call(
        "Emulation.setDeviceMetricsOverride",
        json!({"width": 375, "height": 800, "deviceScaleFactor": 2, "mobile": true}),
    );
    browser.open(&folder.join("report.html"));
    browser.screenshot(&folder.join("phone.png"));
    browser.call("Emulation.clearDeviceMetricsOverride", json!({}));
    let printed = browser.call("Page.printToPDF", json!({"paperWidth": 8.27, "paperHeight": 11.69}));
    fs::write(folder.join("print.pdf"), browser::decoded(printed["data"].as_str().unwrap())).unwrap();
}
