//! `freeswing simulate` and `freeswing fit` as a user types them.

use std::fs;
use std::path::PathBuf;

use assert_cmd::Command;
use predicates::prelude::*;
use predicates::str::contains;

const SWING: &str = "
[specimen]
mass_kg = 0.3606e-3
length_m = 0.20
width_m = 0.05
link_lengths_m = [0.10, 0.10]
[model]
k_eq_n_m_per_rad = 2.0e-4
c_eq_n_m_s_per_rad = 2.0e-6
release_rad = [0.5, 0.62]
[model.effects]
hinge_viscous = 1.0e-7
";

struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn write(&self, name: &str, text: &str) -> PathBuf {
        fs::write(self.path(name), text).unwrap();
        self.path(name)
    }

    /// A simulated table of 10 s.
    fn angles(&self, config: &str) -> PathBuf {
        let config = self.write("simulated.toml", config);
        let out = self.path("angles.csv");
        freeswing("simulate")
            .args(["--duration", "10", "--rate", "30", "--noise-rad", "1e-3"])
            .arg("--config")
            .arg(config)
            .arg("--out")
            .arg(&out)
            .assert()
            .success();
        out
    }
}

fn freeswing(command: &str) -> Command {
    let mut freeswing = Command::cargo_bin("freeswing").unwrap();
    freeswing.arg(command);
    freeswing
}

#[test]
fn what_simulate_writes_fit_reads() {
    let folder = Folder::new();
    let angles = folder.angles(SWING);
    let config = folder.write("start.toml", &SWING.replace("1.0e-7", "3.0e-7"));
    let json = folder.path("fit.json");
    freeswing("fit")
        .arg(&angles)
        .arg("--config")
        .arg(config)
        .arg("--json")
        .arg(&json)
        .assert()
        .success()
        .stdout(contains("k_eq_n_m_per_rad").and(contains("Fitted: reproduced")))
        .stdout(contains("With the file's values: not reproduced"));
    let report: serde_json::Value = serde_json::from_str(&fs::read_to_string(json).unwrap()).unwrap();
    assert_eq!(report["schema"], "freeswing.fit/1");
    let stiffness = &report["parameters"]["k_eq_n_m_per_rad"];
    let (low, high) = (stiffness["low95"].as_f64().unwrap(), stiffness["high95"].as_f64().unwrap());
    assert!(low < 2.02e-4 && high > 1.98e-4 && high - low < 2e-5, "{stiffness}");
    assert_eq!(report["recordings"][0]["fitted"]["reproduced"], true);
}

#[test]
fn values_that_stand_apart_are_counted() {
    let folder = Folder::new();
    let angles = folder.angles(SWING);
    let text = fs::read_to_string(&angles).unwrap();
    let mut rows: Vec<String> = text.lines().map(str::to_owned).collect();
    for row in [60, 180] {
        let mut fields: Vec<&str> = rows[row].split(',').collect();
        fields[2] = "0.9";
        rows[row] = fields.join(",");
    }
    let spoilt = folder.write("spoilt.csv", &(rows.join("\n") + "\n"));
    let config = folder.write("start.toml", SWING);
    let said = contains("2 values stand apart from the neighbours and were left out");
    freeswing("fit").arg(spoilt).arg("--config").arg(config).assert().success().stdout(said);
}

#[test]
fn one_link_is_read_and_fitted() {
    let folder = Folder::new();
    let one = "
[specimen]
[[specimen.links]]
length_m = 0.66
mass_kg = 0.1
com_m = 0.66
inertia_kg_m2 = 1e-5
[model]
release_rad = [0.6]
[model.effects]
hinge_viscous = 1e-3
";
    let angles = folder.angles(one);
    let config = folder.write("one.toml", one);
    freeswing("fit").arg(angles).arg("--config").arg(config).assert().success().stdout(contains("hinge_viscous"));
}

const PENDULUM: &str = "
[[specimen.links]]
length_m = 0.26
mass_kg = 0.1
com_m = 0.26
inertia_kg_m2 = 1e-5
[model]
release_rad = [0.3]
[model.effects]
hinge_viscous = 1e-4
";

#[test]
fn a_wrong_length_is_told_with_the_factor_and_does_not_inflate_the_noise() {
    let folder = Folder::new();
    let angles = folder.angles(PENDULUM);
    let config = folder.write("longer.toml", &PENDULUM.replace("0.26", "0.62"));
    let json = folder.path("fit.json");
    freeswing("fit")
        .arg(&angles)
        .arg("--config")
        .arg(config)
        .arg("--json")
        .arg(&json)
        .assert()
        .success()
        .stdout(contains("Fitted: not reproduced"));
    let report: serde_json::Value = serde_json::from_str(&fs::read_to_string(json).unwrap()).unwrap();
    let recording = &report["recordings"][0];
    let noise_rad = recording["fitted"]["noise_rad"][0].as_f64().unwrap();
    assert!((noise_rad / 1e-3 - 1.0).abs() < 0.15, "{noise_rad}");
    let pace = &recording["pace"];
    assert!((pace["ratio"].as_f64().unwrap() / (0.62f64 / 0.26).sqrt() - 1.0).abs() < 1e-2, "{pace}");
    let statement = pace["statement"].as_str().unwrap();
    assert!(
        statement.contains("times faster than a pendulum of 0.62 m") && statement.contains(" m would"),
        "{statement}"
    );
    assert_eq!(recording["fitted"]["reproduced"], false);
}

#[test]
fn a_table_in_milliseconds_is_not_fitted_but_told() {
    let folder = Folder::new();
    let angles = folder.angles(PENDULUM);
    let text = fs::read_to_string(&angles).unwrap();
    let in_milliseconds = |line: &str| {
        let mut fields: Vec<String> = line.split(',').map(str::to_owned).collect();
        if let Ok(t_s) = fields[1].parse::<f64>() {
            fields[1] = (1e3 * t_s).to_string();
        }
        fields.join(",")
    };
    let table = folder.write("ms.csv", &text.lines().map(in_milliseconds).collect::<Vec<_>>().join("\n"));
    freeswing("fit")
        .arg(table)
        .arg("--config")
        .arg(folder.path("simulated.toml"))
        .assert()
        .code(2)
        .stdout("")
        .stderr(contains("times slower than a pendulum of 0.26 m").and(contains("(t_s looks like milliseconds)")));
}

#[test]
fn json_on_standard_output_is_all_there_is() {
    let folder = Folder::new();
    let angles = folder.angles(SWING);
    let config = folder.path("simulated.toml");
    let output = freeswing("fit").arg(angles).arg("--config").arg(config).args(["--json", "-"]).output().unwrap();
    assert!(output.status.success());
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(json["schema"], "freeswing.fit/1");
}

#[test]
fn bad_input_is_one_line_and_exit_code_2() {
    let folder = Folder::new();
    let angles = folder.angles(SWING);
    let config = folder.write("good.toml", SWING);
    let nan = folder.write("nan.csv", "t_s,theta1_rad,theta2_rad\n0,0.1,NaN\n");
    let one = folder.write("one.csv", &fs::read_to_string(&angles).unwrap().replace("theta2_rad", "other"));
    let massless = folder.write("massless.toml", "[specimen]\nmass_kg = 0.0\n");
    let cases = [
        (vec![nan.clone()], config.clone(), vec![], "nan.csv:2: "),
        (vec![one], config.clone(), vec![], "has 1 angle, and the specimen 2 links"),
        (vec![folder.path("absent.csv")], config.clone(), vec![], "absent.csv: cannot be read"),
        (vec![angles.clone()], massless, vec![], "specimen.mass_kg = 0: must be a positive number"),
        (vec![angles.clone()], folder.path("absent.toml"), vec![], "absent.toml: cannot be read"),
        (
            vec![angles.clone()],
            config.clone(),
            vec!["--free", "hinge_colomb"],
            "the nearest known one is `hinge_coulomb`",
        ),
        (vec![angles.clone()], config.clone(), vec!["--from", "9.9"], "rows between --from and --until; widen them"),
        (vec![angles.clone()], config.clone(), vec!["--json", "/nowhere/fit.json"], "cannot be written"),
        (
            vec![angles.clone(), folder.write("copy.csv", &fs::read_to_string(&angles).unwrap())],
            config.clone(),
            vec![],
            "give each recording once",
        ),
        (
            vec![angles.clone()],
            config.clone(),
            vec!["--free", "hinge_coulomb", "--fix", "hinge_coulomb"],
            "--free: hinge_coulomb is to be kept as well (--fix)",
        ),
        (vec![angles.clone()], config.clone(), vec!["--from", "5", "--until", "2"], "--until: 2 s does not lie after"),
    ];
    for (tables, config, options, message) in cases {
        freeswing("fit")
            .args(tables)
            .arg("--config")
            .arg(config)
            .args(options)
            .assert()
            .code(2)
            .stdout("")
            .stderr(contains(message).and(predicate::function(|text: &str| text.trim_end().lines().count() == 1)));
    }
    for (options, message) in [
        ("--duration=-1", "--duration: -1: must be a positive number"),
        ("--rate=0", "--rate: 0: must be a positive number"),
        ("--noise-rad=-1", "--noise-rad: -1 is no standard deviation"),
        ("--duration=1e12", "give a shorter --duration"),
    ] {
        let out = folder.path("never.csv");
        freeswing("simulate")
            .arg("--config")
            .arg(&config)
            .arg("--out")
            .arg(&out)
            .arg(options)
            .assert()
            .code(2)
            .stderr(contains(message));
        assert!(!out.exists());
    }
}

#[test]
fn a_joint_parameter_of_one_link_is_refused() {
    let folder = Folder::new();
    let one = "[specimen]\nmass_kg = 0.3606e-3\nlink_lengths_m = [0.2]\n[model]\nrelease_rad = [0.4]\n";
    let angles = folder.angles(one);
    let config = folder.path("simulated.toml");
    freeswing("fit")
        .arg(angles)
        .arg("--config")
        .arg(config)
        .args(["--free", "joint_cubic_stiffness"])
        .assert()
        .code(2)
        .stderr(contains("this specimen has one link and no joint"));
}

#[test]
fn the_name_of_an_effect_frees_all_its_parameters() {
    let folder = Folder::new();
    let one = "[[specimen.links]]\nlength_m = 0.2\nmass_kg = 0.1\ncom_m = 0.1\ninertia_kg_m2 = 4e-4\n[model]\nrelease_rad = [0.4]\n\
               [model.effects]\nhinge_viscous = 1e-4\n";
    let angles = folder.angles(&format!("{one}support_motion = {{ amplitude_m = 2e-3, frequency_hz = 0.8 }}\n"));
    let config = folder.write("start.toml", one);
    let json = folder.path("fit.json");
    let mut fit = freeswing("fit");
    fit.arg(&angles).arg("--config").arg(&config).args(["--free", "support_motion"]).arg("--json").arg(&json);
    fit.assert().success();
    let report: serde_json::Value = serde_json::from_str(&fs::read_to_string(json).unwrap()).unwrap();
    let value = |id: &str| report["parameters"][id]["value"].as_f64().unwrap();
    let [sine_m, cosine_m] = ["support_motion.sine_m", "support_motion.cosine_m"].map(value);
    assert!((sine_m.hypot(cosine_m) - 2e-3).abs() < 1e-4 && (value("support_motion.frequency_hz") - 0.8).abs() < 0.01);
    // of one link its centre of mass and its inertia are one number
    let said = contains("shows only (I + mc²)/(mc)");
    let known = folder.path("simulated.toml");
    freeswing("fit")
        .arg(angles)
        .arg("--config")
        .arg(known)
        .args(["--free", "links.1.com_m"])
        .assert()
        .success()
        .stdout(said);
}

#[test]
fn the_bending_stiffness_of_a_strip_is_fitted() {
    let folder = Folder::new();
    let strip = "
[specimen]
mass_kg = 0.3606e-3
length_m = 0.20
width_m = 0.05
link_lengths_m = [0.10, 0.10]
[model]
c_eq_n_m_s_per_rad = 5.0e-7
release_rad = [0.5, 0.62]
[model.effects]
distributed_flexibility = 2.0e-5
";
    let angles = folder.angles(strip);
    let config = folder.write("start.toml", &strip.replace("2.0e-5", "2.6e-5"));
    let json = folder.path("fit.json");
    freeswing("fit").arg(&angles).arg("--config").arg(config).arg("--json").arg(&json).assert().success();
    let report: serde_json::Value = serde_json::from_str(&fs::read_to_string(json).unwrap()).unwrap();
    let stiffness = &report["parameters"]["distributed_flexibility"];
    let (value, sd) = (stiffness["value"].as_f64().unwrap(), stiffness["sd"].as_f64().unwrap());
    assert!((value - 2.0e-5).abs() < 4.0 * sd && sd < 1e-6, "{value} {sd}");
}

#[test]
fn the_published_model_of_a_real_pendulum_is_told_where_it_fails() {
    let table = PathBuf::from("../shared/data/multiarm_double.csv");
    if !table.exists() {
        println!("skipped: {} is not there", table.display());
        return;
    }
    let folder = Folder::new();
    let config = folder.write(
        "published.toml",
        "
[[specimen.links]]
length_m = 0.1727
mass_kg = 0.0938
com_m = 0.1086
inertia_kg_m2 = 4.375e-4
[[specimen.links]]
length_m = 0.23
mass_kg = 0.1376
com_m = 0.1168
inertia_kg_m2 = 1.269e-3
[rig]
gravity_m_s2 = 9.809
[model]
k_eq_n_m_per_rad = 0.0
c_eq_n_m_s_per_rad = 1e-5
release_rad = [-0.5, 0.4]
[model.effects]
hinge_viscous = 2.371e-4
",
    );
    freeswing("fit")
        .arg(table)
        .arg("--config")
        .arg(config)
        .args(["--from", "60"])
        .assert()
        .success()
        .stdout(contains("With the file's values: not reproduced: from"));
}

#[test]
fn a_beginning_that_a_hand_holds_is_left_out_unless_it_is_asked_for() {
    let folder = Folder::new();
    let angles = folder.angles(SWING);
    let text = fs::read_to_string(&angles).unwrap();
    let (header, rows) = text.split_once('\n').unwrap();
    let columns: Vec<&str> = header.split(',').collect();
    let at = |name: &str| columns.iter().position(|column| *column == name).unwrap();
    let value = |row: &str, name: &str| row.split(',').nth(at(name)).unwrap().parse::<f64>().unwrap();
    let first = rows.lines().next().unwrap();
    let mut held = "t_s,theta1_rad,theta2_rad\n".to_owned();
    for k in 0..60 {
        let tremble = 1e-3 * f64::from(k * k).sin();
        let (t, a, b) = (f64::from(k) / 30.0, value(first, "theta1_rad"), value(first, "theta2_rad"));
        held += &format!("{t:.6},{:.6},{:.6}\n", a + tremble, b + tremble);
    }
    for row in rows.lines() {
        let angle = |name: &str| value(row, name);
        held += &format!("{:.6},{:.6},{:.6}\n", 2.0 + angle("t_s"), angle("theta1_rad"), angle("theta2_rad"));
    }
    let (held, config) = (folder.write("held.csv", &held), folder.write("config.toml", SWING));
    let fit = |more: &[&str]| freeswing("fit").arg(&held).arg("--config").arg(&config).args(more).assert().success();
    fit(&[])
        .stderr(contains("held still until t = 2.").and(contains("left out")))
        .stdout(contains("Fitted: reproduced"));
    let kept = fit(&["--from", "0.5"]);
    kept.stderr(contains("leave that out with --from 2.")).stdout(contains("not reproduced"));
}

#[test]
fn a_strip_is_fitted_with_as_many_rods_as_its_recording_asks_for() {
    let folder = Folder::new();
    let strip = |pieces: &str| {
        format!(
            "[specimen]\nlink_lengths_m = [0.12, 0.12]\nwidth_m = 0.04\nthickness_m = 50e-6\ndensity_kg_m3 = 1420.0\nyoung_modulus_pa = 2.9e9\n\
             [model]\n{pieces}release_rad = [0.6, 0.6]\nc_eq_n_m_s_per_rad = 2e-8\n[model.effects]\nhinge_viscous = 1e-7\n"
        )
    };
    let (made, asked) = (folder.write("made.toml", &strip("pieces = 16\n")), folder.write("asked.toml", &strip("")));
    let (angles, json) = (folder.path("angles.csv"), folder.path("fit.json"));
    let mut simulate = freeswing("simulate");
    simulate.args(["--duration", "8", "--noise-rad", "2e-4"]).arg("--config").arg(made).arg("--out").arg(&angles);
    simulate.assert().success();
    let told = contains("taken as 16 rods between two marks, which follow the recording better than the usual");
    freeswing("fit").arg(&angles).arg("--config").arg(asked).arg("--json").arg(&json).assert().success().stdout(told);
    let fit: serde_json::Value = serde_json::from_str(&fs::read_to_string(json).unwrap()).unwrap();
    assert!(fit["pieces"].as_u64().unwrap() >= 12, "{}", fit["pieces"]);
    assert_eq!(fit["intervals_valid"], true);
    // E w t³/12
    let bending_n_m2 = fit["parameters"]["distributed_flexibility"]["value"].as_f64().unwrap();
    assert!((bending_n_m2 / 1.208_333e-6 - 1.0).abs() < 2e-3, "{bending_n_m2:e}");
}
