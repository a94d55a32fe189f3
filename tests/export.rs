//! Angles for other programs, and what a person expects of a command besides its work.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use assert_cmd::cargo::CommandCargoExt;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::record::RowAccessor;

const TABLE: &str = "t_s,theta1_rad,flags\n0.0,0.25,\n0.1,,lost:m2\n0.2,-0.25,\n";

fn freeswing(folder: &Path, words: &[&str]) -> Output {
    Command::cargo_bin("freeswing").unwrap().current_dir(folder).args(words).output().unwrap()
}

fn folder_with_table() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("angles.csv"), TABLE).unwrap();
    folder
}

#[test]
fn a_columnar_table_has_every_column_and_missing_values() {
    let folder = folder_with_table();
    assert!(freeswing(folder.path(), &["export", "angles.csv", "--out", "a.parquet"]).status.success());
    let reader = SerializedFileReader::new(fs::File::open(folder.path().join("a.parquet")).unwrap()).unwrap();
    let rows: Vec<_> = reader.get_row_iter(None).unwrap().map(|row| row.unwrap()).collect();
    assert_eq!(
        (rows.len(), rows[0].get_double(1).unwrap(), rows[1].get_string(2).unwrap().as_str()),
        (3, 0.25, "lost:m2")
    );
    assert!(rows[1].get_double(1).is_err(), "a missing angle is null");
}

#[test]
fn what_cannot_be_exported_is_said_in_one_line_and_nothing_is_written() {
    let folder = folder_with_table();
    fs::write(folder.path().join("ragged.csv"), "t_s,theta1_rad\n0,1\n2\n").unwrap();
    fs::write(folder.path().join("readme.txt"), "Dear all,\n").unwrap();
    fs::write(folder.path().join("other.csv"), "time,volts\n0,1\n").unwrap();
    for (words, said) in [
        (
            ["export", "readme.txt", "--out", "a.json"],
            "error: readme.txt: not a table of angles: it has no rows; give what `track` wrote",
        ),
        (["export", "other.csv", "--out", "a.json"], "error: other.csv: not a table of angles: it has no column `t_s`"),
        (
            ["export", "angles.csv", "--out", "a.xlsx"],
            "error: --out: a.xlsx: name it .parquet, .mat, .json (SEP005) or .h5",
        ),
        (["export", "none.csv", "--out", "a.mat"], "error: none.csv: cannot be read"),
        (["export", "ragged.csv", "--out", "a.mat"], "error: ragged.csv:3: has 1 fields where the header has 2"),
    ] {
        let output = freeswing(folder.path(), &words);
        let told = String::from_utf8(output.stderr).unwrap();
        assert!(output.status.code() == Some(2) && told.starts_with(said) && told.lines().count() == 1, "{told}");
    }
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 4);
}

#[test]
fn a_table_may_come_from_standard_input() {
    let folder = folder_with_table();
    let table = fs::File::open(folder.path().join("angles.csv")).unwrap();
    let mut export = Command::cargo_bin("freeswing").unwrap();
    export.current_dir(folder.path()).args(["export", "-", "--out", "a.json"]).stdin(table);
    assert!(export.status().unwrap().success());
    assert!(fs::read_to_string(folder.path().join("a.json")).unwrap().contains("theta1_rad"));
}

/// `cargo test --features hdf5 --test export`
#[cfg(feature = "hdf5")]
#[test]
fn an_hdf5_file_has_every_column_and_missing_values() {
    use hdf5_metno::types::VarLenUnicode;
    let folder = folder_with_table();
    let output = freeswing(folder.path(), &["export", "angles.csv", "--out", "a.h5"]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let file = hdf5_metno::File::open(folder.path().join("a.h5")).unwrap();
    let mut names = file.member_names().unwrap();
    names.sort();
    assert_eq!(names, ["flags", "t_s", "theta1_rad"]);
    let numbers = |name: &str| file.dataset(name).unwrap().read_raw::<f64>().unwrap();
    assert_eq!(numbers("t_s"), [0.0, 0.1, 0.2]);
    let angles = numbers("theta1_rad");
    assert!(angles[0] == 0.25 && angles[1].is_nan() && angles[2] == -0.25, "{angles:?}");
    let flags = file.dataset("flags").unwrap().read_raw::<VarLenUnicode>().unwrap();
    assert_eq!(flags.iter().map(VarLenUnicode::as_str).collect::<Vec<_>>(), ["", "lost:m2", ""]);
}

#[test]
fn the_account_beside_the_table_is_not_replaced() {
    let folder = folder_with_table();
    fs::write(folder.path().join("angles.json"), "the account").unwrap();
    let own = folder.path().join("angles.json");
    for out in ["angles.json", "./angles.json", own.to_str().unwrap()] {
        let output = freeswing(folder.path(), &["export", "angles.csv", "--out", out]);
        let told = String::from_utf8(output.stderr).unwrap();
        assert!(
            output.status.code() == Some(2) && told.contains("account") && told.contains("series.json"),
            "{out}: {told}"
        );
        assert_eq!(fs::read_to_string(&own).unwrap(), "the account");
    }
    // nor is its name taken before it is there
    fs::remove_file(&own).unwrap();
    assert_eq!(freeswing(folder.path(), &["export", "angles.csv", "--out", "angles.json"]).status.code(), Some(2));
    assert!(!own.exists());
    fs::create_dir(folder.path().join("other")).unwrap();
    for out in ["series.json", "other/angles.json"] {
        assert!(freeswing(folder.path(), &["export", "angles.csv", "--out", out]).status.success(), "{out}");
    }
}

#[test]
fn shells_and_manuals_know_every_command() {
    let folder = tempfile::tempdir().unwrap();
    for shell in ["bash", "zsh", "fish"] {
        let output = freeswing(folder.path(), &["completions", shell]);
        let text = String::from_utf8(output.stdout).unwrap();
        assert!(
            output.status.success() && ["track", "batch", "retry-failed"].iter().all(|word| text.contains(word)),
            "{shell}"
        );
        let output = freeswing(folder.path(), &["completions", shell, "--of", "track"]);
        assert!(String::from_utf8(output.stdout).unwrap().contains("overlay"), "{shell}");
    }
    assert!(freeswing(folder.path(), &["man", "--out", "man1"]).status.success());
    let help = String::from_utf8(freeswing(folder.path(), &["--help"]).stdout).unwrap();
    let commands =
        help.lines().skip_while(|line| !line.starts_with("Commands:")).skip(1).take_while(|line| !line.is_empty());
    // a description that goes on in the next line stands further in
    let commands = commands.filter(|line| !line.starts_with("   "));
    let commands: Vec<&str> =
        commands.filter_map(|line| line.split_whitespace().next()).filter(|own| *own != "help").collect();
    assert!(commands.contains(&"batch") && commands.len() > 12, "{commands:?}");
    for command in commands {
        let text = fs::read_to_string(folder.path().join(format!("man1/freeswing-{command}.1"))).unwrap();
        assert!(text.contains(".SH SYNOPSIS") && text.contains("help"), "{command}");
    }
}

#[test]
fn the_doctor_measures_what_it_should() {
    let folder = tempfile::tempdir().unwrap();
    let output = freeswing(folder.path(), &["doctor", "--json", "-"]);
    let found: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert!(output.status.success() && found["self_test"]["passed"] == true, "{found}");
    assert!(found["self_test"]["median_error_rad"].as_f64().unwrap() < 1e-3, "{found}");
    assert!(found["decoders"].as_array().unwrap().contains(&"H.264".into()), "{found}");
}
