//! `freeswing laser` as a user types it: records of another maker, `fixtures/laser/generate.py`, and inputs that are none.
//!
//! `cargo test` takes twelve records; `make accuracy` two hundred, and prints the figures.

use std::path::{Path, PathBuf};
use std::process::Command;

use assert_cmd::cargo::cargo_bin;
use serde_json::Value;

const CONFIG: &str = "[specimen]\nname = \"strip\"\nmass_kg = 0.3606e-3\nlength_m = 0.2\nwidth_m = 0.05\n\
    reflectivity = { specular = 0.60, diffuse = 0.26, absorbed = 0.14 }\n\
    [light]\npower_w = 2000.0\ndistance_m = 1.0\non_s = [10.0, 30.0, 50.0, 70.0]\n[laser]\n";

/// Python with numpy: Debian's packages are for its own, which need not be the first on the path.
fn python() -> &'static str {
    let has_numpy = |python: &str| {
        Command::new(python).args(["-c", "import numpy"]).output().is_ok_and(|output| output.status.success())
    };
    ["python3", "/usr/bin/python3"].into_iter().find(|p| has_numpy(p)).expect("no numpy: run scripts/setup")
}

fn bank() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/laser")
}

fn laser(record: &Path, config: &Path, more: &[&str]) -> std::process::Output {
    Command::new(cargo_bin("freeswing"))
        .arg("laser")
        .arg(record)
        .arg("--config")
        .arg(config)
        .args(more)
        .output()
        .unwrap()
}

/// A push of 1 µm on a damped oscillator of 1.35 Hz that is lit from 10 to 30 and from 50 to 70 s; noise that repeats itself.
fn displacement_um(t_s: f64) -> f64 {
    let (turn, decay): (f64, f64) = (std::f64::consts::TAU * 1.35, 0.1);
    let ring = |since: f64| if since > 0.0 { 1.0 - (-decay * since).exp() * (turn * since).cos() } else { 0.0 };
    let push = ring(t_s - 10.0) - ring(t_s - 30.0) + ring(t_s - 50.0) - ring(t_s - 70.0);
    // a hash of the time in place of a random number: 0.1 µm, almost normal
    let noise: f64 =
        (1..=12).map(|k| (f64::from(k) * 12.9898 * (t_s + 1.0)).sin() * 43_758.545).map(|v| v - v.floor()).sum();
    push + 5.0 * (-decay * t_s).exp() * (turn * t_s + 1.0).cos() + 0.1 * (noise - 6.0)
}

struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn file(&self, name: &str, text: impl AsRef<[u8]>) -> PathBuf {
        let path = self.0.path().join(name);
        std::fs::write(&path, text).unwrap();
        path
    }

    /// A record of 90 s at 50 Hz; each row as `row` writes it.
    fn record(&self, header: &str, row: impl Fn(f64, f64) -> String) -> PathBuf {
        let rows: String = (0..4500).map(|k| f64::from(k) / 50.0).map(|t| row(t, displacement_um(t)) + "\n").collect();
        self.file("record.csv", header.to_owned() + &rows)
    }

    fn config(&self, more: &str) -> PathBuf {
        self.file("experiment.toml", CONFIG.to_owned() + more)
    }

    fn json(&self, record: &Path, config: &Path) -> Value {
        let output = laser(record, config, &["--json", "-"]);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        serde_json::from_slice(&output.stdout).unwrap()
    }

    /// The one line of a refusal.
    fn refusal(&self, record: &Path, config: &Path) -> String {
        let output = laser(record, config, &[]);
        let text = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{text}");
        assert!(output.stdout.is_empty() && text.lines().count() == 1, "{text}");
        text
    }
}

fn push_um(json: &Value) -> [f64; 2] {
    ["value", "sd"].map(|key| 1e6 * json["push_m"][key].as_f64().unwrap())
}

#[test]
fn a_push_is_found_with_its_interval_and_its_reflectivity() {
    let folder = Folder::new();
    let record = folder.record("time_s,displacement_um\n", |t, y| format!("{t},{y:.3}"));
    let config = folder.config("");
    let json = folder.json(&record, &config);
    let [push, sd] = push_um(&json);
    assert!((push - 1.0).abs() < 3.0 * sd && sd < 0.02, "{push} ± {sd}");
    assert_eq!(json["schema"], "freeswing.laser/1");
    assert_eq!(json["verdict"]["status"], "adequate", "{}", json["verdict"]);
    // y = s F/W at the free end: F = 1e-6/0.2 · m g
    let force = 1e-6 / 0.2 * 0.3606e-3 * 9.80665 * push;
    assert!((json["reflectivity"]["force_n"].as_f64().unwrap() / force - 1.0).abs() < 1e-6);
    assert!((json["reflectivity"]["stated"].as_f64().unwrap() - 1.7733).abs() < 1e-3);
    let text = String::from_utf8(laser(&record, &config, &[]).stdout).unwrap();
    assert!(text.contains("Push of light: ") && text.lines().all(|line| line.chars().count() <= 100), "{text}");
}

#[test]
fn units_separators_and_headers_are_all_the_same_record() {
    let folder = Folder::new();
    let plain =
        folder.json(&folder.record("time_s,displacement_um\n", |t, y| format!("{t},{y:.3}")), &folder.config(""));
    let config = folder.config("scale_m_per_v = 1e-4\n");
    let others = [
        folder.json(&folder.record("t_ms;y_mm\n", |t, y| format!("{};{:.6}", 1e3 * t, 1e-3 * y)), &config),
        folder.json(&folder.record("t_s\tsensor_volt\tlamp\n", |t, y| format!("{t}\t{:.5}\t1", 1e-2 * y)), &config),
        folder.json(&folder.record("", |t, y| format!("{t},{y:.3}")), &folder.config("column = \"displacement_um\"\n")),
    ];
    for other in others {
        assert!((push_um(&other)[0] - push_um(&plain)[0]).abs() < 1e-4, "{:?} {:?}", push_um(&other), push_um(&plain));
    }
}

#[test]
fn the_lamp_is_found_where_its_times_are_not_given() {
    let folder = Folder::new();
    let record = folder.record("time_s,displacement_um\n", |t, y| format!("{t},{y:.3}"));
    let config = folder.file("found.toml", CONFIG.replace("on_s = [10.0, 30.0, 50.0, 70.0]\n", ""));
    let json = folder.json(&record, &config);
    let edges: Vec<f64> = json["lamp"]["edges_s"].as_array().unwrap().iter().map(|e| e.as_f64().unwrap()).collect();
    assert_eq!(edges.len(), 4, "{edges:?}");
    assert!(edges.iter().zip([10.0, 30.0, 50.0, 70.0]).all(|(a, b)| (a - b).abs() < 0.1), "{edges:?}");
    assert!((push_um(&json)[0] - 1.0).abs() < 0.03);
}

#[test]
fn one_cycle_is_enough_for_a_push_and_proves_nothing() {
    let folder = Folder::new();
    let record = folder
        .record("time_s,displacement_um\n", |t, y| if t < 45.0 { format!("{t},{y:.3}") } else { format!("{t},") });
    let config = folder.file("one.toml", CONFIG.replace("30.0, 50.0, 70.0", "30.0"));
    let json = folder.json(&record, &config);
    assert!((push_um(&json)[0] - 1.0).abs() < 0.05);
    assert_eq!(json["heldout"], Value::Null);
}

#[test]
fn a_figure_is_drawn_and_a_missing_key_is_named() {
    let folder = Folder::new();
    let record = folder.record("time_s,displacement_um\n", |t, y| format!("{t},{y:.3}"));
    let config = folder.file("dark.toml", CONFIG.replace("distance_m = 1.0\n", ""));
    let drawn = folder.0.path().join("laser.svg");
    let output = laser(&record, &config, &["--figure", drawn.to_str().unwrap()]);
    assert!(String::from_utf8(output.stdout).unwrap().contains("light.distance_m is not given"));
    assert!(std::fs::read_to_string(&drawn).unwrap().contains("lamp on"));
}

#[test]
fn what_is_no_record_is_one_line_and_exit_code_2() {
    let folder = Folder::new();
    let config = folder.config("");
    let good = |t: f64, y: f64| format!("{t},{y:.3}");
    let bad = [
        (folder.file("empty.csv", ""), "empty"),
        (folder.file("text.csv", "Dear all,\nthe record follows\n"), "no row of numbers"),
        (folder.file("bytes.csv", [0x89, 0x50, 0x00, 0x01]), "not text"),
        (folder.file("short.csv", "t_s,y_um\n0,1\n1,2\n"), "2 samples"),
        (folder.file("one.csv", "y_um\n1\n2\n"), "one column"),
        (folder.file("word.csv", "t_s,y_um\n0,1\n1,two\n"), "`two` is not a number"),
        (folder.file("back.csv", "t_s,y_um\n0,1\n2,1\n1,1\n"), "times must rise"),
        (folder.file("unit.csv", "t_s,reading\n0,1\n1,1\n"), "no unit"),
        (folder.file("bare.csv", "0,1\n1,1\n"), "no header"),
        (folder.file("volt.csv", "t_s,y_volt\n0,1\n1,1\n"), "scale_m_per_v"),
        (folder.0.path().join("nowhere.csv"), "cannot be read"),
    ];
    for (record, expected) in bad {
        let text = folder.refusal(&record, &config);
        assert!(text.contains(expected), "{text}");
    }
    let record = folder.record("time_s,displacement_um,lamp\n", |t, y| good(t, y) + ",0");
    let text = folder.refusal(&record, &folder.config("column = \"displacment_um\"\n"));
    assert!(
        text.contains("has no column `displacment_um`") && text.contains("set laser.column = \"displacement_um\""),
        "{text}"
    );
    let text = folder.refusal(&record, &folder.config("range_m = [-1e-7, 1e-7]\n"));
    assert!(text.contains("laser.range_m"), "{text}");
    let text = folder.refusal(&record, &folder.config("height_m = 0.25\n"));
    assert!(text.contains("laser.height_m = 0.25: not on the strip"), "{text}");
    let late = folder.file("late.toml", CONFIG.replace("10.0, 30.0, 50.0, 70.0", "1000.0, 1010.0"));
    assert!(folder.refusal(&record, &late).contains("give light.on_s in the record's time"));
    let once = folder.file("once.toml", CONFIG.replace("10.0, 30.0, 50.0, 70.0", "20.0"));
    assert!(folder.refusal(&record, &once).contains("switched once within the record, at 20 s"));
    let calm =
        folder.record("t_s,y_um\n", |t, y| format!("{t},{:.3}", y - displacement_um(t) + 0.01 * (37.0 * t * t).sin()));
    let found = folder.file("found.toml", CONFIG.replace("on_s = [10.0, 30.0, 50.0, 70.0]\n", ""));
    assert!(folder.refusal(&calm, &found).contains("the lamp's edges are not found"));
}

#[test]
fn samples_out_of_range_are_left_out_and_said() {
    let folder = Folder::new();
    let record = folder.record("time_s,displacement_um\n", |t, y| format!("{t},{:.3}", y.min(4.0)));
    let config = folder.config("range_m = [-1e-5, 4e-6]\nresolution_m = 1e-9\n");
    let output = laser(&record, &config, &["--json", "-"]);
    assert!(String::from_utf8_lossy(&output.stderr).contains("at or beyond the sensor's range were left out"));
    let json: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert!((push_um(&json)[0] - 1.0).abs() < 0.05, "{:?}", push_um(&json));
}

/// Makes records of the bank and has each judged; of each the truth and the report.
fn judged(folder: &Path, seed: u32, kinds: &str, count: usize) -> Vec<(Value, Value)> {
    let made = Command::new(python())
        .arg(bank().join("generate.py"))
        .arg("--out")
        .arg(folder)
        .args(["--seed", &seed.to_string(), "--count", &count.to_string(), "--only", kinds])
        .status();
    assert!(made.unwrap().success());
    (0..count)
        .map(|k| folder.join(format!("{k:04}")))
        .map(|name| {
            let truth = std::fs::read(name.with_extension("json")).unwrap();
            let output = laser(&name.with_extension("csv"), &name.with_extension("toml"), &["--json", "-"]);
            assert!(output.status.success(), "{name:?}: {}", String::from_utf8_lossy(&output.stderr));
            (serde_json::from_slice(&truth).unwrap(), serde_json::from_slice(&output.stdout).unwrap())
        })
        .collect()
}

/// Twelve records with strong effects: the pushes hold, the names are right.
#[test]
fn what_another_maker_conceals_is_named() {
    let folder = Folder::new();
    let kinds = ["none", "heat", "sensor_drift", "tilt", "gas", "none"];
    let cases = judged(folder.0.path(), 77, &kinds.join(","), 2 * kinds.len());
    let named = |(truth, report): &&(Value, Value)| {
        let (wanted, verdict) = (truth["effects"].as_array().unwrap(), &report["verdict"]);
        let said =
            |name: &Value| ["effects", "class"].iter().any(|list| verdict[list].as_array().unwrap().contains(name));
        if wanted.is_empty() { verdict["status"] == "adequate" } else { wanted.iter().all(said) }
    };
    let holds = |(truth, report): &&(Value, Value)| {
        let end = |k: usize| report["push_m"]["interval"][k].as_f64().unwrap();
        let push = truth["push_m"].as_f64().unwrap();
        end(0) <= push && push <= end(1)
    };
    let of = |test: &dyn Fn(&&(Value, Value)) -> bool| cases.iter().filter(|case| test(case)).count();
    let said: Vec<String> = cases.iter().map(|(t, r)| format!("{} {}", t["kind"], r["verdict"]["statement"])).collect();
    assert!(of(&named) >= 10, "{} of 12 named: {said:#?}", of(&named));
    assert!(of(&holds) >= 10, "{} of 12 pushes hold: {said:#?}", of(&holds));
}

/// The whole bank, with its score; `make accuracy` takes it.
#[test]
#[ignore = "two hundred records take a quarter of an hour"]
fn the_whole_bank() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("laser");
    let run = Command::new(bank().join("run.sh"))
        .arg(&folder)
        .args(["3001", "200"])
        .env("FREESWING", cargo_bin("freeswing"))
        .output()
        .unwrap();
    let text = String::from_utf8_lossy(&run.stdout);
    println!("{text}");
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
}
