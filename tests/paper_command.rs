//! `freeswing paper` as a user types it.

use assert_cmd::Command;
use predicates::str::contains;

fn paper() -> Command {
    let mut command = Command::cargo_bin("freeswing").unwrap();
    command.arg("paper");
    command
}

#[test]
fn every_table_is_there_and_fits_the_terminal() {
    let output = paper().assert().success();
    let text = String::from_utf8(output.get_output().stdout.clone()).unwrap();
    for expected in
        ["Table 1", "Eq", "Fig. 3", "Table 2", "Table 3", "Table 4", "reproduces if", "cannot be: ", "0.025344"]
    {
        assert!(text.contains(expected), "{expected} is missing in\n{text}");
    }
    for point in 1..=12 {
        assert!(text.contains(&format!("(A{point})")), "A{point} is missing in\n{text}");
    }
    assert!(text.lines().all(|line| line.chars().count() <= 100), "{text}");
}

#[test]
fn the_distance_is_an_input() {
    paper().args(["--distance-m", "0.5"]).assert().success().stdout(contains("1273.2"));
}

#[test]
fn the_json_pairs_every_number_with_a_verdict() {
    let output = paper().args(["--json", "-"]).assert().success();
    let json: serde_json::Value = serde_json::from_slice(&output.get_output().stdout).unwrap();
    assert_eq!(json["schema"], "freeswing.paper/1");
    let rows: Vec<&serde_json::Value> =
        json["sections"].as_array().unwrap().iter().flat_map(|s| s["rows"].as_array().unwrap()).collect();
    assert!(rows.len() > 60);
    let verdicts = ["reproduces", "reproduces_if", "cannot_be"];
    assert!(rows.iter().all(|r| verdicts.contains(&r["verdict"].as_str().unwrap())));
    assert!(rows.iter().all(|r| r["computed"]["value"].is_f64()));
}

#[test]
fn a_distance_that_is_none_is_one_line_and_exit_code_2() {
    for distance in ["0", "-2", "nan"] {
        let output = paper().args(["--distance-m", distance]).assert().code(2).stdout("");
        let text = String::from_utf8(output.get_output().stderr.clone()).unwrap();
        assert!(text.contains("--distance-m") && text.lines().count() == 1, "{text}");
    }
}

#[test]
fn an_output_that_cannot_be_written_is_one_line_and_exit_code_2() {
    let output = paper().args(["--json", "/nowhere/at/all.json"]).assert().code(2).stdout("");
    assert_eq!(String::from_utf8(output.get_output().stderr.clone()).unwrap().lines().count(), 1);
}
