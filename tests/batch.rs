//! A folder of experiments, as a laboratory has it: good recordings, bad ones among them, kills, changes in between.

#[allow(dead_code, reason = "only a whole film is wanted of it")]
mod clips;
mod nobody;

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::{Duration, SystemTime};

use assert_cmd::cargo::CommandCargoExt;
use clips::{Clip, Scene};
use nobody::{Nobody, set_mode};
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};
use tempfile::TempDir;

const SPECIMEN: &str = "[specimen]\nname = \"strip\"\nmass_kg = 0.0004\nlength_m = 0.2\nlink_lengths_m = [0.1, 0.1]\n";

/// A folder of recordings, and one for results.
struct Laboratory {
    folder: TempDir,
}

impl Laboratory {
    fn new() -> Self {
        let own = Self { folder: tempfile::tempdir().unwrap() };
        fs::create_dir(own.folder.path().join("in")).unwrap();
        own
    }

    /// Tables of swings that differ in frequency.
    fn with_tables(self, count: usize) -> Self {
        (0..count).for_each(|k| self.write(&format!("in/day {}/swing{k:02}.csv", k % 3), table(1.0 + 0.05 * k as f64)));
        self.write("in/experiment.toml", SPECIMEN);
        self
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn write(&self, name: &str, contents: impl AsRef<[u8]>) {
        let path = self.path(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, contents).unwrap();
    }

    fn film(&self, name: &str) {
        let path = self.path(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        Clip { frames: 90, ..Clip::default() }.write(&path);
    }

    fn command(&self, out: &str) -> Command {
        let mut command = Command::cargo_bin("freeswing").unwrap();
        command.current_dir(self.folder.path()).args([
            "batch",
            "in",
            "--out",
            out,
            "--until",
            "identify",
            "--no-overlay",
        ]);
        command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
        command
    }

    /// Exit code and standard error.
    fn batch(&self, out: &str, more: &[&str]) -> (Option<i32>, String) {
        let output = self.command(out).args(more).output().unwrap();
        (output.status.code(), said(&output))
    }

    /// The summary's rows by recording.
    fn rows(&self, out: &str) -> BTreeMap<String, BTreeMap<String, String>> {
        let mut reader = csv::Reader::from_path(self.path(out).join("summary.csv")).unwrap();
        let rows = reader.deserialize().map(|row| row.unwrap());
        rows.map(|row: BTreeMap<String, String>| (row["recording"].clone(), row)).collect()
    }

    fn summary(&self, out: &str) -> Vec<Vec<u8>> {
        ["summary.csv", "summary.parquet", "index.html"].map(|file| fs::read(self.path(out).join(file)).unwrap()).into()
    }

    /// When each finished recording was.
    fn finished(&self, out: &str) -> BTreeMap<PathBuf, SystemTime> {
        let mut found = BTreeMap::new();
        let mut folders = vec![self.path(out)];
        while let Some(folder) = folders.pop() {
            for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
                let path = entry.path();
                if path.is_dir() {
                    folders.push(path);
                } else if path.ends_with("run.json") {
                    found.insert(path.clone(), fs::metadata(&path).unwrap().modified().unwrap());
                }
            }
        }
        found
    }
}

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// A decaying swing at 30 Hz.
fn table(frequency_hz: f64) -> String {
    let mut text = String::from("t_s,theta1_rad,theta2_rad\n");
    for row in 0..450 {
        let t_s = f64::from(row) / 30.0;
        let swing = (std::f64::consts::TAU * frequency_hz * t_s).cos() * (-0.06 * t_s).exp();
        // what two sines that never repeat leave looks like noise
        let noise = 1e-4 * ((1.7 * f64::from(row * row)).sin() + (0.3 * f64::from(row * row + row)).sin());
        text += &format!("{t_s:.6},{:.8},{:.8}\n", 0.2 * swing + noise, 0.25 * swing - noise);
    }
    text
}

#[test]
fn every_recording_has_a_row_and_a_bad_one_says_why_as_its_command_alone_does() {
    let lab = Laboratory::new().with_tables(3);
    lab.film("in/films/good.mp4");
    let film = fs::read(lab.path("in/films/good.mp4")).unwrap();
    lab.write("in/films/cut.mp4", &film[..film.len() / 3]);
    lab.write("in/films/empty.mov", "");
    lab.write("in/films/text.avi", "not a film");
    lab.write("in/films/wrong.mp4", &film);
    lab.write("in/films/wrong.toml", "[rig]\npivot = [1.0, 2.0]\n");
    lab.write("in/day 0/short.csv", "t_s,theta1_rad\n0,0.1\n");
    lab.write("in/day 0/volts.csv", "time,volts\n0,1\n");
    Clip { scene: Scene { marks: Vec::new(), ..Scene::default() }, frames: 30, ..Clip::default() }
        .write(&lab.path("in/films/no marks.mp4"));
    let (code, told) = lab.batch("out", &[]);
    assert_eq!(code, Some(1), "{told}");
    let rows = lab.rows("out");
    let failed: Vec<&str> =
        rows.values().filter(|row| row["status"] == "failed").map(|row| row["recording"].as_str()).collect();
    let bad = [
        "day 0/short.csv",
        "films/cut.mp4",
        "films/empty.mov",
        "films/no marks.mp4",
        "films/text.avi",
        "films/wrong.mp4",
    ];
    assert_eq!(failed, bad, "{told}");
    assert_eq!(rows.len(), bad.len() + 4, "{told}");
    assert!(told.contains("/10] films/good.mp4: done"), "{told}");
    for name in bad {
        let mut alone = Command::cargo_bin("freeswing").unwrap();
        alone.current_dir(lab.folder.path()).args([
            "run",
            &format!("in/{name}"),
            "--out",
            "alone",
            "--until",
            "identify",
        ]);
        let config =
            if name == "films/wrong.mp4" { "out/films/wrong.mp4/experiment.toml" } else { "in/experiment.toml" };
        let output = alone.args(["--config", config]).output().unwrap();
        assert_eq!(output.status.code(), Some(2), "{name}");
        let told = said(&output);
        assert_eq!(
            Some(rows[name]["reason"].as_str()),
            told.lines().rev().find(|line| line.starts_with("error: ")),
            "{name}"
        );
    }
    let good = &rows["films/good.mp4"];
    assert!((good["f1_hz"].parse::<f64>().unwrap() - 1.2).abs() < 0.01, "{good:?}");
    assert_eq!((good["frames"].as_str(), good["specimen"].as_str(), good["sha256"].len()), ("90", "strip", 64));
    let f1 = |name: &str| rows[name]["f1_hz"].parse::<f64>().unwrap();
    assert!((f1("day 1/swing01.csv") - 1.05).abs() < 1e-3 && (f1("day 2/swing02.csv") - 1.1).abs() < 1e-3);
    for file in ["angles.csv", "angles.json", "identify.json", "log.txt"] {
        assert!(lab.path("out/films/good.mp4").join(file).is_file(), "{file}");
    }
}

#[test]
fn what_may_not_be_read_has_a_row_that_says_so_and_is_done_once_it_may_be() {
    let lab = Laboratory::new().with_tables(1);
    let program = Command::cargo_bin("freeswing").unwrap().get_program().to_owned();
    let film = "in/films/good.mp4";
    lab.film(film);
    for copy in ["in/films/closed.mp4", "in/films/config.mp4", "in/closed/film.mp4"] {
        lab.write(copy, fs::read(lab.path(film)).unwrap());
    }
    lab.write("in/closed.csv", table(1.3));
    lab.write("in/films/config.toml", SPECIMEN);
    // the file, its row, and what else its command needs
    let closed = [
        ("closed", "closed", &[][..]),
        ("closed.csv", "closed.csv", &[]),
        ("films/closed.mp4", "films/closed.mp4", &[]),
        ("films/config.toml", "films/config.mp4", &["--config", "in/films/config.toml"]),
    ];
    let Some(nobody) = Nobody::at(lab.folder.path(), Path::new(&program)) else { return };
    let set_modes = |mode| closed.iter().for_each(|(file, _, _)| set_mode(&lab.path("in").join(file), mode));
    let start = |words: &[&str]| nobody.command().args(words).output().unwrap();
    let batch = ["batch", "in", "--out", "out", "--until", "track", "--no-overlay"];
    set_modes(0o000);
    let output = start(&batch);
    assert_eq!(output.status.code(), Some(1), "{}", said(&output));
    let rows = lab.rows("out");
    let failed: Vec<&str> =
        rows.values().filter(|row| row["status"] == "failed").map(|row| row["recording"].as_str()).collect();
    assert_eq!(failed, closed.map(|(_, row, _)| row));
    assert_eq!(rows["films/good.mp4"]["status"], "done");
    for (file, row, more) in closed {
        let alone = start(&[&["track", &format!("in/{row}"), "--out", "alone.csv"], more].concat());
        let line =
            format!("in/{file}: cannot be read: Permission denied (os error 13); check the path and its permissions");
        assert_eq!((alone.status.code(), said(&alone)), (Some(2), format!("error: {line}\n")), "{row}");
        assert_eq!(rows[row]["reason"], format!("error: {line}"));
    }
    set_modes(0o755);
    let output = start(&batch);
    assert_eq!(output.status.code(), Some(0), "{}", said(&output));
    assert_eq!(lab.rows("out")["closed/film.mp4"]["status"], "done");
}

#[test]
fn started_again_after_any_kill_it_ends_as_if_undisturbed_and_does_nothing_twice() {
    kills(4, 12);
}

#[test]
#[ignore = "a minute or more"]
fn started_again_after_fifty_kills_it_ends_as_if_undisturbed() {
    kills(50, 60);
}

fn kills(count: usize, tables: usize) {
    let lab = Laboratory::new().with_tables(tables);
    lab.film("in/film.mp4");
    let (code, told) = lab.batch("undisturbed", &[]);
    assert_eq!(code, Some(0), "{told}");
    let mut random = StdRng::seed_from_u64(19);
    for _ in 0..count {
        let before = lab.finished("out");
        let mut child = lab.command("out").stderr(Stdio::null()).stdout(Stdio::null()).spawn().unwrap();
        std::thread::sleep(Duration::from_millis(random.random_range(5..700)));
        child.kill().unwrap();
        child.wait().unwrap();
        let after = lab.finished("out");
        for (path, when) in before {
            assert_eq!(after.get(&path), Some(&when), "{} was done again", path.display());
        }
    }
    let before = lab.finished("out");
    let (code, told) = lab.batch("out", &[]);
    assert_eq!(code, Some(0), "{told}");
    let after = lab.finished("out");
    assert!(before.iter().all(|(path, when)| after[path] == *when));
    assert_eq!(lab.summary("out"), lab.summary("undisturbed"));
    let left = walk(&lab.path("out")).into_iter().filter(|path| path.to_string_lossy().contains(".freeswing-"));
    assert_eq!(left.collect::<Vec<_>>(), Vec::<PathBuf>::new());
}

fn walk(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    entries.flat_map(|path| if path.is_dir() { walk(&path) } else { vec![path] }).collect()
}

#[test]
fn parts_on_several_machines_come_to_the_same_summary() {
    let lab = Laboratory::new().with_tables(7);
    assert_eq!(lab.batch("whole", &[]).0, Some(0));
    for part in ["1/3", "2/3", "3/3"] {
        let (code, told) = lab.batch("parts", &["--shard", part]);
        assert_eq!(code, Some(0), "{told}");
        assert!(!lab.path("parts/summary.csv").exists());
    }
    let (code, told) = lab.batch("parts", &[]);
    assert!(code == Some(0) && told.contains("0 to run"), "{told}");
    assert_eq!(lab.summary("parts"), lab.summary("whole"));
    for wrong in ["0/3", "4/3", "x", "1/2/3"] {
        assert_eq!(lab.batch("parts", &["--shard", wrong]).0, Some(2), "{wrong}");
    }
}

#[test]
fn a_run_that_is_killed_alone_is_done_again_without_being_asked_for() {
    let lab = Laboratory::new();
    Clip { frames: 900, ..Clip::default() }.write(&lab.path("in/film.mp4"));
    assert_eq!(lab.batch("undisturbed", &[]).0, Some(0));
    let batch = lab.command("out").stderr(Stdio::piped()).spawn().unwrap();
    let began = std::time::Instant::now();
    let run = loop {
        let children = fs::read_to_string(format!("/proc/{0}/task/{0}/children", batch.id())).unwrap_or_default();
        let threads = fs::read_dir(format!("/proc/{}/task", batch.id())).unwrap().flatten();
        let all = threads.map(|own| fs::read_to_string(own.path().join("children")).unwrap_or_default());
        let all: String = all.chain([children]).collect();
        if let Some(run) = all.split_whitespace().next() {
            break run.to_owned();
        }
        assert!(began.elapsed() < Duration::from_secs(60), "no run has begun");
        std::thread::sleep(Duration::from_millis(2));
    };
    // as a machine that goes down kills them, one after the other
    Command::new("kill").args(["-KILL", &run]).status().unwrap();
    let output = batch.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(1), "{}", said(&output));
    let reason = &lab.rows("out")["film.mp4"]["reason"];
    assert!(reason.contains("ended from outside (signal: 9"), "{reason}");
    let (code, told) = lab.batch("out", &[]);
    assert!(code == Some(0) && told.contains("1 to run"), "{told}");
    assert_eq!(lab.summary("out"), lab.summary("undisturbed"));
}

#[test]
fn what_has_changed_is_done_again_and_nothing_else() {
    let lab = Laboratory::new().with_tables(4);
    lab.write("in/day 0/bad.csv", "t_s,theta1_rad\n0,0.1\n");
    assert_eq!(lab.batch("out", &[]).0, Some(1));
    let first = lab.finished("out");
    let again = |lab: &Laboratory, more: &[&str]| -> Vec<String> {
        let before = lab.finished("out");
        lab.batch("out", more);
        let changed = lab.finished("out").into_iter().filter(|(path, when)| before.get(path) != Some(when));
        changed.map(|(path, _)| path.parent().unwrap().file_name().unwrap().to_string_lossy().into_owned()).collect()
    };
    assert_eq!(again(&lab, &[]), Vec::<String>::new());
    assert_eq!(first, lab.finished("out"));
    assert_eq!(again(&lab, &["--retry-failed"]), ["bad.csv"]);
    lab.write("in/day 1/swing01.csv", table(1.7));
    assert_eq!(again(&lab, &[]), ["swing01.csv"]);
    assert!((lab.rows("out")["day 1/swing01.csv"]["f1_hz"].parse::<f64>().unwrap() - 1.7).abs() < 1e-3);
    lab.write("in/day 2/experiment.toml", "[rig]\ngravity_m_s2 = 9.81\n");
    assert_eq!(again(&lab, &[]), ["swing02.csv"]);
    lab.write("in/day 0/swing03.csv", table(1.3));
    lab.write("in/day 1/swing01.csv", table(1.8));
    assert_eq!(again(&lab, &["--only", "day 0/*"]), ["swing03.csv"]);
    let rows = lab.rows("out");
    assert!((rows["day 1/swing01.csv"]["f1_hz"].parse::<f64>().unwrap() - 1.7).abs() < 1e-3, "what it was stands");
    // a recording that is gone has no row
    fs::remove_file(lab.path("in/day 0/bad.csv")).unwrap();
    let (code, told) = lab.batch("out", &[]);
    assert_eq!((code, lab.rows("out").len()), (Some(0), 4), "{told}");
}

#[test]
fn a_second_batch_on_the_same_results_is_refused_by_the_name_of_the_first() {
    let lab = Laboratory::new().with_tables(30);
    let mut first = lab.command("out").stderr(Stdio::null()).spawn().unwrap();
    let began = std::time::Instant::now();
    while lab.finished("out").is_empty() && began.elapsed() < Duration::from_secs(60) {
        std::thread::sleep(Duration::from_millis(5));
    }
    let (code, told) = lab.batch("out", &[]);
    let holder = format!("another batch (process {}", first.id());
    first.kill().unwrap();
    first.wait().unwrap();
    assert!(code == Some(2) && told.contains(&holder) && told.lines().count() == 1, "{told}");
}

#[test]
fn what_would_be_done_is_said_and_not_done() {
    let lab = Laboratory::new().with_tables(2);
    lab.write("in/day 0/swing00.toml", "[rig]\ngravity_m_s2 = 9.81\n");
    let output = lab.command("out").arg("--dry-run").output().unwrap();
    let told = String::from_utf8(output.stdout).unwrap();
    assert!(output.status.success() && !lab.path("out").exists(), "{told}");
    let line = told.lines().find(|line| line.contains("swing00")).unwrap();
    assert!(line.contains("run") && line.contains("experiment.toml, day 0/swing00.toml"), "{line}");
    let planned = |part: &[&str]| -> Vec<(String, String)> {
        let output = lab.command("out").args(["--dry-run", "--json", "-"]).args(part).output().unwrap();
        let told: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        assert_eq!(told["recordings"][0]["files"][2], "in/day 0/swing00.toml", "{told}");
        let text = |value: &serde_json::Value| value.as_str().unwrap().to_owned();
        let all = told["recordings"].as_array().unwrap().iter();
        all.map(|own| (text(&own["recording"]), text(&own["plan"]))).collect()
    };
    let expected = |plans: [&str; 2]| {
        ["day 0/swing00.csv", "day 1/swing01.csv"]
            .into_iter()
            .zip(plans)
            .map(|(a, b)| (a.to_owned(), b.to_owned()))
            .collect::<Vec<_>>()
    };
    assert_eq!(planned(&[]), expected(["run", "run"]));
    // the second in order is part 2 of 2
    assert_eq!(planned(&["--shard", "2/2"]), expected(["skipped", "run"]));
    assert_eq!(lab.batch("out", &["--shard", "2/2"]).0, Some(0));
    assert_eq!(planned(&[]), expected(["run", "done"]));
    assert_eq!(lab.batch("out", &["--json", "plan.json"]).0, Some(2), "only with --dry-run");
}

#[test]
fn nothing_that_can_be_run_is_one_clear_line() {
    let lab = Laboratory::new();
    let (code, told) = lab.batch("out", &[]);
    assert_eq!(
        (code, told.as_str()),
        (Some(2), "error: in: holds no recording and no table of angles; give the folder above them\n")
    );
    let (code, told) = lab.batch("in", &[]);
    assert!(code == Some(2) && told.contains("--out: must be another folder"), "{told}");
    fs::remove_dir(lab.path("in")).unwrap();
    let (code, told) = lab.batch("out", &[]);
    assert!(code == Some(2) && told.starts_with("error: in: cannot be read"), "{told}");
    lab.write("in", "a file");
    let (code, told) = lab.batch("out", &[]);
    assert!(code == Some(2) && told.starts_with("error: in: is a file, not a folder; use `freeswing run`"), "{told}");
    assert!(!lab.path("out").exists(), "nothing is written where nothing is done");
}

#[test]
fn a_pattern_that_matches_nothing_is_refused() {
    let lab = Laboratory::new().with_tables(2);
    for more in [&["--only", "none/**"][..], &["--only", "none/**", "--dry-run"]] {
        let (code, said) = lab.batch("out", more);
        assert!(code == Some(2) && said.contains("'none/**' matches none of the 2 recordings"), "{said}");
        assert!(!lab.path("out/summary.csv").exists());
    }
}

#[cfg(unix)]
#[test]
fn who_stops_a_batch_is_told_that_it_goes_on() {
    let lab = Laboratory::new().with_tables(40);
    let batch = lab.command("out").args(["--jobs", "1"]).spawn().unwrap();
    while lab.finished("out").is_empty() {
        std::thread::sleep(Duration::from_millis(5));
    }
    // SAFETY: a signal to a process of this test
    assert_eq!(unsafe { libc::kill(batch.id().cast_signed(), libc::SIGINT) }, 0);
    let output = batch.wait_with_output().unwrap();
    let said = said(&output);
    assert!(output.status.code() == Some(2) && said.contains("what was finished is kept"), "{said}");
    assert!(!lab.finished("out").is_empty() && !said.contains("nothing was written"), "{said}");
}

#[test]
fn results_that_cannot_be_written_end_the_batch_with_one_line_and_lose_nothing() {
    let lab = Laboratory::new().with_tables(6);
    lab.film("in/day 0/film.mp4");
    // files may grow to 8 blocks of 512 bytes: results do not fit, as on a full disk
    let mut limited = Command::new("sh");
    let program = lab.command("out").get_program().to_owned();
    limited.current_dir(lab.folder.path()).stdin(Stdio::null());
    limited.args(["-c", "trap '' XFSZ; ulimit -f 8; exec \"$@\"", "sh"]).arg(program);
    limited.args(["batch", "in", "--out", "out", "--until", "identify", "--no-overlay"]);
    let output = limited.output().unwrap();
    let told = said(&output);
    let errors: Vec<&str> = told.lines().filter(|line| line.starts_with("error: ")).collect();
    assert!(output.status.code() == Some(2) && errors.len() == 1, "{told}");
    assert!(errors[0].contains("cannot be written") && errors[0].contains("what was finished is kept"), "{told}");
    let (code, told) = lab.batch("out", &[]);
    assert_eq!(code, Some(0), "{told}");
    assert_eq!(lab.rows("out").len(), 7);
}

#[test]
fn recordings_of_one_specimen_are_fitted_together() {
    let lab = Laboratory::new();
    let config =
        format!("{SPECIMEN}[rig]\ngravity_m_s2 = 9.81\n[model]\nk_eq_n_m_per_rad = 2e-4\nc_eq_n_m_s_per_rad = 2e-6\n");
    for (name, release) in [("small", "[0.1, 0.12]"), ("large", "[0.4, 0.45]")] {
        lab.write("simulated.toml", format!("{config}release_rad = {release}\n"));
        let mut simulate = Command::cargo_bin("freeswing").unwrap();
        simulate.current_dir(lab.folder.path()).args(["simulate", "--config", "simulated.toml", "--duration", "10"]);
        let output = simulate.args(["--noise-rad", "1e-4", "--out", &format!("in/{name}.csv")]).output().unwrap();
        assert!(output.status.success(), "{}", said(&output));
    }
    lab.write("in/experiment.toml", config.replace("2e-4", "1e-4"));
    // how a recording was filmed does not make another specimen of it
    lab.write("in/small.toml", "[rig]\npivot_px = [1.0, 2.0]\n");
    let mut command = Command::cargo_bin("freeswing").unwrap();
    let output = command
        .current_dir(lab.folder.path())
        .args(["batch", "in", "--out", "out", "--until", "fit"])
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(0), "{}", said(&output));
    let fit: serde_json::Value =
        serde_json::from_slice(&fs::read(lab.path("out/together/strip/fit.json")).unwrap()).unwrap();
    assert_eq!(fit["recordings"].as_array().unwrap().len(), 2);
    let k = fit["parameters"]["k_eq_n_m_per_rad"]["value"].as_f64().unwrap();
    assert!((k - 2e-4).abs() < 2e-6, "{k}");
    let page = fs::read_to_string(lab.path("out/index.html")).unwrap();
    assert!(page.contains("fitted and diagnosed together") && page.contains("together/strip"), "no table of specimens");
}

/// `freeswing run` in the laboratory.
fn run(lab: &Laboratory, words: &str) -> Output {
    let mut run = Command::cargo_bin("freeswing").unwrap();
    run.current_dir(lab.folder.path()).arg("run").args(words.split(' ')).stdin(Stdio::null()).output().unwrap()
}

#[test]
fn a_run_removes_what_a_run_left_and_nothing_else() {
    let lab = Laboratory::new();
    lab.write("a.csv", table(1.2));
    let own = ["figures/mine.svg", "identify.json", "overlay.mp4"];
    own.iter().for_each(|file| lab.write(&format!("mine/{file}"), "of my own"));
    let output = run(&lab, "a.csv --until identify --out mine");
    let told = said(&output);
    assert_eq!((output.status.code(), told.lines().count()), (Some(2), 1), "{told}");
    assert!(told.contains("--out: mine holds overlay.mp4, identify.json, figures, and no log of a run"), "{told}");
    let all: Vec<PathBuf> = walk(&lab.path("mine"));
    assert!(all.iter().all(|file| !file.is_file() || fs::read(file).unwrap() == b"of my own"), "{all:?}");
    assert!(!lab.path("mine/log.txt").exists());
    // in a run's own folder figures of others stay, those of the run go
    assert!(run(&lab, "a.csv --out kept").status.success());
    lab.write("kept/figures/mine.svg", "of my own");
    let made = fs::read_dir(lab.path("kept/figures")).unwrap().count();
    assert!(made > 1, "the page has figures");
    assert!(run(&lab, "a.csv --until track --out kept").status.success());
    let left: Vec<_> = fs::read_dir(lab.path("kept/figures")).unwrap().map(|own| own.unwrap().file_name()).collect();
    assert_eq!(left, ["mine.svg"]);
    assert!(!lab.path("kept/report.html").exists() && !lab.path("kept/identify.json").exists());
}

#[test]
fn a_run_that_cannot_begin_leaves_an_earlier_one_as_it_is() {
    let lab = Laboratory::new();
    lab.write("a.csv", table(1.2));
    lab.write("notes.mp4", "Dear all,");
    lab.write("short.csv", "t_s,theta1_rad\n0,0.1\n");
    let output = run(&lab, "a.csv --until identify --out good");
    let told = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(
        output.status.success() && told.contains("f₁ = 1.2") && told.contains("a.csv: done; see good/log.txt"),
        "{told}"
    );
    let before: Vec<(PathBuf, Vec<u8>)> =
        walk(&lab.path("good")).into_iter().map(|file| (file.clone(), fs::read(&file).unwrap_or_default())).collect();
    for (words, says) in [
        ("notes.mp4 --out good", "notes.mp4: not a video that can be opened"),
        ("short.csv --out good", "short.csv: holds one row"),
        ("in --out good", "in: holds no PNG, JPEG"),
        ("a.csv ./a.csv --out good", "./a.csv: holds the same angles as a.csv; give each recording once"),
        ("in --out never", "in: holds no PNG, JPEG"),
        ("a.csv --out short.csv", "short.csv: cannot be written: it is a file, not a folder"),
    ] {
        let output = run(&lab, words);
        let told = said(&output);
        assert_eq!((output.status.code(), told.lines().count()), (Some(2), 1), "{words}: {told}");
        assert!(told.contains(says), "{words}: {told}");
    }
    let after: Vec<(PathBuf, Vec<u8>)> =
        walk(&lab.path("good")).into_iter().map(|file| (file.clone(), fs::read(&file).unwrap_or_default())).collect();
    assert!(before == after && !lab.path("never").exists());
}

#[test]
fn what_another_run_left_in_the_results_is_not_taken_for_the_batch_s() {
    let lab = Laboratory::new().with_tables(2);
    assert_eq!(lab.batch("out", &[]).0, Some(0));
    lab.write("other.csv", table(1.9));
    let mut alone = Command::cargo_bin("freeswing").unwrap();
    alone.current_dir(lab.folder.path()).args([
        "run",
        "other.csv",
        "--until",
        "identify",
        "--out",
        "out/day 0/swing00.csv",
    ]);
    assert!(alone.output().unwrap().status.success());
    let (code, told) = lab.batch("out", &[]);
    assert!(code == Some(0) && told.contains("2 recordings: 1 to run, 1 finished before, 0 left out"), "{told}");
    assert!((lab.rows("out")["day 0/swing00.csv"]["f1_hz"].parse::<f64>().unwrap() - 1.0).abs() < 1e-3);
}

#[test]
fn what_is_passed_over_left_out_or_bound_to_fail_is_said_beforehand() {
    let lab = Laboratory::new();
    lab.write("in/plain.csv", table(1.2));
    lab.write("in/broken.csv", table(1.3));
    lab.write("in/broken.toml", "[rig\n");
    lab.write("in/typo.csv", table(1.4));
    lab.write("in/typo.toml", "[rig]\nmirored = true\n");
    lab.write("in/other.csv", "t_s,theta_1\n0,0.1\n");
    lab.write("in/nothing.csv", "");
    (0..9).for_each(|k| lab.write(&format!("in/stills/{k}.png"), "a picture"));
    let batch = |more: &[&str]| {
        let mut batch = Command::cargo_bin("freeswing").unwrap();
        let output =
            batch.current_dir(lab.folder.path()).args(["batch", "in", "--out", "out"]).args(more).output().unwrap();
        (String::from_utf8(output.stdout.clone()).unwrap(), said(&output))
    };
    let (plan, _) = batch(&["--until", "fit", "--dry-run"]);
    let passed_over = [
        "passed over: in/nothing.csv: the file is empty",
        "passed over: in/other.csv:1: no column `theta1_rad` among t_s, theta_1",
        "passed over: in/stills: holds 9 stills and says when none of them was taken; put times.csv beside them",
    ];
    for says in [
        "run; no experiment file: not fitted, not diagnosed",
        "run; fails: in/broken.toml:1: ",
        "run; fails: in/typo.toml:2: unknown key `mirored`",
    ]
    .iter()
    .chain(&passed_over)
    {
        assert!(plan.contains(says), "{says} is missing in\n{plan}");
    }
    let (_, told) = batch(&["--until", "fit"]);
    assert!(passed_over.iter().all(|says| told.contains(says)), "{told}");
    assert!(told.contains("plain.csv: done in ") && told.contains(" s; no experiment file: not fitted"), "{told}");
    let rows = lab.rows("out");
    assert_eq!(rows["plain.csv"]["status"], "done");
    assert_eq!(rows["plain.csv"]["reason"], "no experiment file: not fitted, not diagnosed");
    assert!(rows["typo.csv"]["reason"].starts_with("error: in/typo.toml:2: unknown key"), "{rows:?}");
    let page = fs::read_to_string(lab.path("out/index.html")).unwrap();
    assert!(page.contains("done<br><small>no experiment file: not fitted, not diagnosed</small>"));
    // and why what was finished is done again
    let (plan, _) = batch(&["--until", "track", "--dry-run"]);
    assert!(plan.contains("run; again: other options were given"), "{plan}");
    lab.write("in/plain.csv", table(1.5));
    lab.write("in/plain.toml", SPECIMEN);
    let (plan, _) = batch(&["--until", "fit", "--dry-run"]);
    assert!(plan.contains("run; again: the recording has changed, its experiment file has changed"), "{plan}");
    assert!(plan.contains("left, it failed (--retry-failed)"), "{plan}");
    let (plan, _) = batch(&["--until", "fit", "--dry-run", "--retry-failed"]);
    assert!(plan.contains("run; again: it failed (--retry-failed); fails: in/typo.toml:2"), "{plan}");
    let before = fs::read(lab.path("in/plain.toml")).unwrap();
    let (_, told) = batch(&["--dry-run", "--json", "in/plain.toml"]);
    assert!(
        told.contains("--json: in/plain.toml is an input") && fs::read(lab.path("in/plain.toml")).unwrap() == before
    );
}
