//! Wrong recordings and wrong options for `track` and `init`: each is refused in one line that says what to do, or
//! measured with a warning that has the number and the remedy, or right all the same; never silently wrong.

mod clips;

use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::LazyLock;

use assert_cmd::cargo::CommandCargoExt;
use clips::{BLUE, Clip, GREEN, RED, Scene};
use tempfile::TempDir;

/// What a careful colleague would do.
enum Wanted {
    /// Not measure it, and say all of this in one line.
    Refuses(&'static [&'static str]),
    /// Measure it, with all of this in one warning.
    Warns(&'static [&'static str]),
    /// Measure these marks to a third of a pixel, whatever is warned of.
    Right(&'static [usize]),
    /// The same, and no warning.
    Silent(&'static [usize]),
}
use Wanted::{Refuses, Right, Silent, Warns};

type Case = (&'static str, &'static str, Vec<&'static str>, Wanted);

/// Every clip once, in one folder.
static FOLDER: LazyLock<TempDir> = LazyLock::new(|| {
    let folder = tempfile::tempdir().unwrap();
    for (name, clip) in clips() {
        clip.write(&folder.path().join(name).with_extension("mp4"));
    }
    write_other_files(folder.path());
    folder
});

fn clips() -> Vec<(&'static str, Clip)> {
    let swing = Clip::default;
    let knob = Scene { still: vec![([250.0, 60.0], 7.0, RED)], ..Scene::default() };
    let furniture = vec![([60.0, 50.0], 8.0, RED), ([90.0, 190.0], 7.0, RED), ([270.0, 120.0], 9.0, RED)];
    vec![
        ("swing", swing()),
        ("knob", swing().with(knob)),
        ("furniture", swing().with(Scene { marks: vec![], still: furniture.clone(), ..Scene::default() })),
        (
            "green",
            swing().with(Scene {
                marks: vec![(0, GREEN), (1, GREEN), (2, GREEN)],
                still: furniture,
                ..Scene::default()
            }),
        ),
        ("standing", swing().with(Scene { amplitude_rad: 0.0, ..Scene::default() })),
        ("bare", swing().with(Scene { marks: vec![], ..Scene::default() })),
        ("turned", swing().with(Scene { squeeze: 0.6, amplitude_rad: 0.6, ..Scene::default() })),
        (
            "smeared",
            swing().with(Scene { radius_px: 4.0, exposure_s: 1.0 / 30.0, amplitude_rad: 0.7, ..Scene::default() }),
        ),
        ("shaken", swing().with(Scene { shake_px: 4.0, ..Scene::default() })),
        (
            "drifting",
            Clip {
                frames: 150,
                gop: 25,
                scene: Scene { marks: vec![(1, RED), (2, RED)], drift_px_s: 1.5, plain_wall: true, ..Scene::default() },
            },
        ),
        // with one key frame for all of it
        ("knocked", Clip { frames: 240, gop: 250, scene: Scene { knocked: (4.0, 6.0), ..Scene::default() } }),
        ("stops", swing().with(Scene { uncovered_s: [0.0, 1.2], ..Scene::default() })),
        ("late", swing().with(Scene { uncovered_s: [1.2, 9.0], ..Scene::default() })),
        ("twin", swing().with(Scene { twin: true, ..Scene::default() })),
        ("passing", swing().with(Scene { marks: vec![], passing: true, ..Scene::default() })),
        ("loose", swing().with(Scene { loose_px: 3.0, ..Scene::default() })),
        ("dark", swing().with(Scene { light: 0.0, ..Scene::default() })),
        ("dim", swing().with(Scene { light: 0.25, ..Scene::default() })),
        ("ball", swing().with(Scene { marks: vec![(1, BLUE)], radius_px: 40.0, ..Scene::default() })),
        ("one_frame", Clip { frames: 1, ..swing() }),
        ("two_frames", Clip { frames: 2, ..swing() }),
        ("short", Clip { frames: 6, ..swing() }),
    ]
}

fn write_other_files(folder: &Path) {
    let whole = std::fs::read(folder.join("swing.mp4")).unwrap();
    std::fs::write(folder.join("cut.mp4"), &whole[..whole.len() / 2]).unwrap();
    std::fs::write(folder.join("empty.mp4"), b"").unwrap();
    std::fs::write(folder.join("text.mp4"), "t_s,theta1_rad\n0,0.1\n").unwrap();
    let mask = |name: &str, width: u32, height: u32, white: &dyn Fn(u32, u32) -> bool| {
        let picture = image::GrayImage::from_fn(width, height, |x, y| image::Luma([if white(x, y) { 255 } else { 0 }]));
        picture.save(folder.join(name)).unwrap();
    };
    mask("small.png", 160, 120, &|_, _| true);
    mask("black.png", 320, 240, &|_, _| false);
    mask("upper.png", 320, 240, &|_, y| y < 80);
    mask("without_knob.png", 320, 240, &|x, _| x < 235);
    std::fs::write(folder.join("not_a_picture.png"), "white").unwrap();
    for (name, text) in [
        ("no_marks.toml", "[rig]\nmarks = []\n"),
        ("blue.toml", "[rig]\nmarks = [\"blue\", \"blue\", \"blue\"]\n"),
        ("mixed.toml", "[rig]\nmarks = [\"red\", \"blue\", \"red\"]\n"),
        ("grey.toml", "[rig]\nmarks = [\"#808080\"]\n"),
        ("unknown_key.toml", "[rig]\nmakrs = [\"red\"]\n"),
        ("reversed.toml", "[rig]\nfrom_s = 2.0\nuntil_s = 1.0\n"),
        ("plumb.toml", "[rig]\nplumb_px = [[10, 10], [10, 10]]\n"),
        ("aspect.toml", "[rig]\npixel_aspect = -1.0\n"),
        ("mask.toml", "[rig]\nmask = \"nowhere.png\"\n"),
        ("pivot.toml", "[rig]\npivot_px = [160]\n"),
        ("slow.toml", "[rig]\ntrue_rate_hz = 0\n"),
    ] {
        std::fs::write(folder.join(name), text).unwrap();
    }
}

fn recordings() -> Vec<Case> {
    let case = |name, clip, wanted| (name, clip, vec![], wanted);
    vec![
        case("what it should be", "swing.mp4", Silent(&[0, 1, 2])),
        case("a red knob on the stand", "knob.mp4", Right(&[0, 1, 2])),
        case("red things but no marks", "furniture.mp4", Refuses(&["no red mark", "still"])),
        case("green marks and red things", "green.mp4", Refuses(&["no red mark", "still", "--color '#"])),
        case("marks that never move", "standing.mp4", Refuses(&["stands still throughout"])),
        case("no marks at all", "bare.mp4", Refuses(&["no red mark", "--color"])),
        case("a swing out of the picture's plane", "turned.mp4", Warns(&["turned by about 5", "pixel_aspect = 1."])),
        case(
            "an exposure longer than the marks are wide",
            "smeared.mp4",
            Warns(&["mark 2 is smeared over", "the exposure is about 1/", "more light"]),
        ),
        case(
            "marks covered half-way",
            "stops.mp4",
            Warns(&["mark 3 (red) was measured in 49", "longest gap 38 frames", "--overlay"]),
        ),
        case(
            "marks uncovered half-way",
            "late.mp4",
            Warns(&["mark 3 (red) was measured in 52", "longest gap 36 frames", "--overlay"]),
        ),
        case(
            "a second pendulum with red marks",
            "twin.mp4",
            Warns(&["more things of the marks' colour move", "--markers", "--roi"]),
        ),
        case("somebody in red walks by", "passing.mp4", Refuses(&["found 1 red mark where 3 are needed"])),
        case("marks that slide on the strip", "loose.mp4", Warns(&["link 1 is", "not on one rigid link", "--overlay"])),
        case("the lens cap is on", "dark.mp4", Refuses(&["no red mark"])),
        case("hardly any light", "dim.mp4", Right(&[0, 1, 2])),
        case("one frame", "one_frame.mp4", Warns(&["only 1 frame of", "give a longer recording"])),
        case("two frames", "two_frames.mp4", Warns(&["only 2 frames of", "give a longer recording"])),
        case("six frames", "short.mp4", Warns(&["only 6 frames of", "give a longer recording"])),
        case("a file cut in half", "cut.mp4", Refuses(&["cut.mp4", "cut off before its index"])),
        case("a file of nothing", "empty.mp4", Refuses(&["the file is empty", "copy it again"])),
        case("a table named .mp4", "text.mp4", Refuses(&["not a video that can be opened", "give an MP4"])),
        case("a file that is not there", "nowhere.mp4", Refuses(&["nowhere.mp4", "check the path"])),
    ]
}

fn marks() -> Vec<Case> {
    let swing = |name, arguments: &[&'static str], wanted| (name, "swing.mp4", arguments.to_vec(), wanted);
    let knob = |name, arguments: &[&'static str], wanted| (name, "knob.mp4", arguments.to_vec(), wanted);
    vec![
        ("a ball a third of the picture high", "ball.mp4", vec!["--color", "blue", "--markers", "1"], Right(&[1])),
        knob(
            "four marks with a static knob",
            &["--markers", "4"],
            Refuses(&["found 3 red marks where 4", "(250, 60) px", "--markers 3"]),
        ),
        swing("four marks of three", &["--markers", "4"], Refuses(&["found 3 red marks where 4", "--markers 3"])),
        swing(
            "two marks of three",
            &["--markers", "2"],
            Warns(&["(160, 30) px", "if it is the hinge, say --markers 3"]),
        ),
        swing(
            "one mark of three",
            &["--markers", "1"],
            Warns(&["1 more thing of the marks' colour moves", "--markers 2"]),
        ),
        swing("no marks wanted", &["--markers", "0"], Refuses(&["--markers", "1 to 12"])),
        swing("thirteen marks", &["--markers", "13"], Refuses(&["--markers", "1 to 12"])),
        swing("another colour", &["--color", "blue"], Refuses(&["no blue mark", "--color '#"])),
        swing("dark marks where they are red", &["--color", "dark"], Right(&[0, 1, 2])),
        swing("an unknown colour", &["--color", "reddish"], Refuses(&["unknown colour `reddish`", "#rrggbb"])),
        swing("a grey", &["--color", "#808080"], Refuses(&["is a grey", "say dark or light"])),
        swing(
            "two colours for three marks",
            &["--color", "red", "--color", "green", "--markers", "3"],
            Refuses(&["3 marks asked for, 2 colours given"]),
        ),
        swing(
            "a colour that only some marks have",
            &["--color", "red", "--color", "blue", "--color", "red"],
            Refuses(&["no blue mark"]),
        ),
        swing("a threshold above every mark", &["--threshold", "250"], Refuses(&["below the threshold 250"])),
        swing("a threshold of nothing", &["--threshold", "0"], Refuses(&["--threshold", "between 0 and 255"])),
        swing("a threshold that is no number", &["--threshold", "NaN"], Refuses(&["--threshold", "between 0 and 255"])),
        swing("marks asked for in a file that lists none", &["--config", "no_marks.toml"], Silent(&[0, 1, 2])),
        swing("a file that says blue", &["--config", "blue.toml"], Refuses(&["no blue mark", "--color '#"])),
        swing("a file that mixes colours", &["--config", "mixed.toml"], Refuses(&["no blue mark"])),
        swing("a file with a grey", &["--config", "grey.toml"], Refuses(&["grey.toml:2", "is a grey"])),
        swing(
            "a file with a misspelt key",
            &["--config", "unknown_key.toml"],
            Refuses(&["unknown_key.toml:2", "makrs"]),
        ),
    ]
}

fn places() -> Vec<Case> {
    let swing = |name, arguments: &[&'static str], wanted| (name, "swing.mp4", arguments.to_vec(), wanted);
    let knob = |name, arguments: &[&'static str], wanted| (name, "knob.mp4", arguments.to_vec(), wanted);
    vec![
        swing(
            "a region beside the picture",
            &["--roi", "400,0,50,50"],
            Refuses(&["--roi", "beside the picture of 320×240"]),
        ),
        swing("a region smaller than a mark", &["--roi", "10,10,4,4"], Refuses(&["roi", "at least 8 px"])),
        swing("a region of negative width", &["--roi", "200,0,-50,50"], Refuses(&["roi", "at least 8 px"])),
        swing("a region of three numbers", &["--roi", "0,0,50"], Refuses(&["--roi", "X,Y,W,H"])),
        swing(
            "a region without marks",
            &["--roi", "0,0,60,240"],
            Refuses(&["no red mark", "region of --roi is looked at: widen it"]),
        ),
        swing(
            "a region that cuts the swing",
            &["--roi", "150,0,170,240"],
            Refuses(&["found 2 red marks where 3", "region of --roi"]),
        ),
        knob("a region that leaves the knob out", &["--roi", "0,0,235,240"], Silent(&[0, 1, 2])),
        knob("a mask that leaves the knob out", &["--mask", "without_knob.png"], Silent(&[0, 1, 2])),
        swing(
            "a mask of another size",
            &["--mask", "small.png"],
            Refuses(&["160×120", "320×240", "as large as the picture"]),
        ),
        swing(
            "a mask that is black",
            &["--mask", "black.png"],
            Refuses(&["black.png", "white where marks are sought"]),
        ),
        swing(
            "a mask over the lower marks",
            &["--mask", "upper.png"],
            Refuses(&["no red mark", "stands still", "white of the mask is looked at: widen it"]),
        ),
        swing(
            "a mask that is no picture",
            &["--mask", "not_a_picture.png"],
            Refuses(&["not a picture", "white where marks"]),
        ),
        swing("a mask that is not there", &["--mask", "nowhere.png"], Refuses(&["nowhere.png"])),
        swing("a mask that the file names and is not there", &["--config", "mask.toml"], Refuses(&["nowhere.png"])),
        swing(
            "a pivot in the wrong place",
            &["--pivot", "60,60", "--markers", "3"],
            Warns(&["link 1 turns by no more than", "leave --pivot out", "--markers 2"]),
        ),
        swing(
            "a pivot in the wrong place for the lower marks",
            &["--pivot", "60,60", "--markers", "2"],
            Warns(&["link 1 is", "the pivot is elsewhere"]),
        ),
        swing(
            "a pivot where the first mark is",
            &["--pivot", "160,30", "--markers", "3"],
            Refuses(&["--pivot", "(160, 30)"]),
        ),
        swing("a pivot of one number", &["--pivot", "160"], Refuses(&["--pivot", "X,Y"])),
        swing("a pivot that is no number", &["--pivot", "nan,30"], Refuses(&["--pivot", "X,Y"])),
        swing("a file with half a pivot", &["--config", "pivot.toml"], Refuses(&["pivot.toml:2"])),
        swing("a plumb line of one point", &["--config", "plumb.toml"], Refuses(&["plumb_px", "a pixel apart"])),
        swing("a negative pixel aspect", &["--config", "aspect.toml"], Refuses(&["pixel_aspect", "positive"])),
        swing(
            "a reference mark beside the picture",
            &["--reference", "900,40"],
            Refuses(&["--reference", "(900, 40)"]),
        ),
        swing("a reference mark on a swinging one", &["--reference", "160,200"], Warns(&["reference"])),
    ]
}

fn shaking() -> Vec<Case> {
    vec![
        ("a camera that shakes", "shaken.mp4", vec![], Warns(&["camera moved by up to", "px", "--steady never"])),
        (
            "shaking left in",
            "shaken.mp4",
            vec!["--steady", "never"],
            Warns(&["camera moved by up to", "--steady always"]),
        ),
        (
            "a camera that is knocked in the middle",
            "knocked.mp4",
            vec![],
            Warns(&["camera moved by up to 6.", "taken out"]),
        ),
        (
            "a camera that drifts before a plain wall",
            "drifting.mp4",
            vec!["--markers", "2", "--pivot", "160,30"],
            Warns(&["arc moves aside by", "the camera or the stand moves", "--reference"]),
        ),
        (
            "a plain wall that is to show the camera's motion",
            "drifting.mp4",
            vec!["--markers", "2", "--pivot", "160,30", "--steady", "always"],
            Refuses(&["--steady always", "clear edges", "--reference"]),
        ),
    ]
}

fn times() -> Vec<Case> {
    let swing = |name, arguments: &[&'static str], wanted| (name, "swing.mp4", arguments.to_vec(), wanted);
    vec![
        swing(
            "a beginning after the end",
            &["--from", "90"],
            Refuses(&["no frame lies between --from and --until", "75 frames"]),
        ),
        swing(
            "an end before the beginning",
            &["--until", "-1"],
            Refuses(&["no frame lies between --from and --until"]),
        ),
        swing("an end before --from", &["--from", "2", "--until", "1"], Refuses(&["until", "later than"])),
        swing("a beginning that is no number", &["--from", "NaN"], Refuses(&["--from", "number of seconds"])),
        swing(
            "a file with an end before its beginning",
            &["--config", "reversed.toml"],
            Refuses(&["until_s = 1", "later than"]),
        ),
        swing("a negative true rate", &["--true-rate=-240"], Refuses(&["--true-rate", "positive"])),
        swing("a true rate of nothing", &["--config", "slow.toml"], Refuses(&["true_rate_hz", "positive"])),
        swing("a true rate that is no number", &["--true-rate", "inf"], Refuses(&["--true-rate", "positive"])),
        swing("a true rate in words", &["--true-rate", "fast"], Refuses(&["--true-rate", "fast"])),
        swing(
            "a true rate slower than the file's",
            &["--true-rate", "3"],
            Warns(&["true_rate_hz = 3", "slower", "30"]),
        ),
        swing("stills per second for a video", &["--rate", "50"], Refuses(&["--rate", "stills", "--true-rate"])),
        swing("a table of times for a video", &["--times", "no_marks.toml"], Refuses(&["--times", "stills"])),
        swing("no thread", &["--threads", "0"], Refuses(&["--threads", "at least 1"])),
    ]
}

/// A red thing that the strip covers from time to time.
fn covered() -> Vec<Case> {
    let wanted = Refuses(&["nothing in 75 frames swings like marks", "stand still"]);
    vec![("red things but no marks", "furniture.mp4", vec![], wanted)]
}

fn first_looks() -> Vec<Case> {
    let init = |name, clip, wanted| (name, clip, vec![], wanted);
    vec![
        init("nothing that swings", "bare.mp4", Refuses(&["nothing in 75 frames swings like marks", "--color"])),
        init(
            "marks that never move",
            "standing.mp4",
            Refuses(&["nothing in 75 frames swings like marks", "stand still"]),
        ),
        init("somebody in red walks by", "passing.mp4", Refuses(&["nothing in 75 frames swings like marks"])),
        init("the lens cap is on", "dark.mp4", Refuses(&["nothing in 75 frames swings like marks"])),
        init("one frame", "one_frame.mp4", Refuses(&["1 frame"])),
        init("a file cut in half", "cut.mp4", Refuses(&["cut.mp4", "cut off before its index"])),
        init("a file of nothing", "empty.mp4", Refuses(&["the file is empty"])),
        init("a table named .mp4", "text.mp4", Refuses(&["not a video that can be opened"])),
        init("a file that is not there", "nowhere.mp4", Refuses(&["nowhere.mp4"])),
        (
            "an experiment file that exists",
            "swing.mp4",
            vec!["--out", "taken.toml"],
            Refuses(&["taken.toml exists already", "--force"]),
        ),
        ("a folder that is not there", "swing.mp4", vec!["--out", "nowhere/e.toml"], Refuses(&["nowhere/e.toml"])),
        ("a preview that is no PNG", "swing.mp4", vec!["--preview", "seen.jpg"], Refuses(&["--preview", ".png"])),
        (
            "a preview in the file's place",
            "swing.mp4",
            vec!["--out", "e.toml", "--preview", "e.toml"],
            Refuses(&["--preview"]),
        ),
        (
            "the film as the output",
            "swing.mp4",
            vec!["--out", "swing.mp4", "--force"],
            Refuses(&["--out", "swing.mp4"]),
        ),
    ]
}

/// One run in a folder of its own.
struct Run {
    folder: TempDir,
    output: Output,
}

impl Run {
    fn of(command: &[&str], clip: &str, arguments: &[&str]) -> Self {
        let folder = tempfile::tempdir().unwrap();
        for entry in std::fs::read_dir(FOLDER.path()).unwrap() {
            let from = entry.unwrap().path();
            let name = from.file_name().unwrap();
            let is_video = from.extension().is_some_and(|e| e == "mp4");
            if !is_video || name == clip {
                std::fs::copy(&from, folder.path().join(name)).unwrap();
            }
        }
        std::fs::write(folder.path().join("taken.toml"), "mine").unwrap();
        let mut run = Command::cargo_bin(command[0]).unwrap();
        run.current_dir(folder.path()).args(&command[1..]).arg(clip).args(arguments);
        let output = run.output().unwrap();
        Self { folder, output }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn said(&self) -> String {
        String::from_utf8(self.output.stderr.clone()).unwrap()
    }

    fn warnings(&self) -> Vec<String> {
        self.said().lines().filter_map(|l| l.strip_prefix("warning: ").map(str::to_owned)).collect()
    }

    /// What is wrong with it, or nothing.
    fn fault(&self, wanted: &Wanted, written: &str) -> Option<String> {
        let said = self.said();
        let holds = |text: &str, words: &[&str]| words.iter().all(|w| text.contains(w));
        let code = self.output.status.code();
        if impossible(&said) {
            return Some("an impossible number".to_owned());
        }
        match wanted {
            Refuses(words) => {
                let one_line = said.starts_with("error: ") && said.trim_end().lines().count() == 1;
                let usage = said.contains("--help");
                let nothing = !self.path(written).exists();
                (code != Some(2) || !(one_line || usage) || !holds(&said, words) || !nothing)
                    .then(|| format!("wanted a refusal with {words:?}; exit {code:?}, written {}", !nothing))
            }
            Warns(words) => (code != Some(0) || !self.warnings().iter().any(|w| holds(w, words)))
                .then(|| format!("wanted a warning with {words:?}; exit {code:?}")),
            Right(marks) | Silent(marks) => {
                let quiet = matches!(wanted, Right(_)) || self.warnings().is_empty();
                let off_px = (code == Some(0)).then(|| self.off_px(marks));
                (!quiet || off_px.is_none_or(|off| off > 0.33))
                    .then(|| format!("wanted marks {marks:?}; exit {code:?}, off by {off_px:?} px"))
            }
        }
    }

    /// Root mean square distance of the tracks from where the marks were painted.
    fn off_px(&self, marks: &[usize]) -> f64 {
        let table = std::fs::read_to_string(self.path("angles.csv")).unwrap();
        let names: Vec<&str> = table.lines().next().unwrap().split(',').collect();
        let column = |name: &str| names.iter().position(|n| *n == name).unwrap();
        let mut squares = Vec::new();
        for row in table.lines().skip(1) {
            let fields: Vec<Option<f64>> = row.split(',').map(|f| f.parse().ok()).collect();
            let nodes = Scene::default().nodes_px(fields[column("t_s")].unwrap());
            for (k, node) in marks.iter().enumerate() {
                for (axis, letter) in ["x", "y"].iter().enumerate() {
                    let seen = fields[column(&format!("m{}_{letter}_px", k + 1))];
                    squares.push(seen.map_or(1.0, |v| (v - nodes[*node][axis]).powi(2)));
                }
            }
        }
        (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
    }
}

/// No number that is printed is infinite, not a number, or longer than any picture or recording.
fn impossible(said: &str) -> bool {
    let numbers = said.split(|c: char| !(c.is_ascii_alphanumeric() || ".+-#".contains(c)));
    let quoted = |n: &str| said.contains(&format!("'{n}'")) || said.contains(&format!("= {n}"));
    numbers
        .filter(|n| n.starts_with(|c: char| c.is_ascii_digit()))
        .filter_map(|n| n.parse::<f64>().ok())
        .any(|v| v > 1e5)
        || said.split_whitespace().any(|w| matches!(w, "NaN" | "inf" | "-inf") && !quoted(w))
}

fn hold(command: &[&str], written: &str, cases: Vec<Case>) {
    let mut faults = Vec::new();
    for (name, clip, mut arguments, wanted) in cases {
        if command[0] == "track" {
            arguments.extend(["--out", "angles.csv"]);
        }
        let run = Run::of(command, clip, &arguments);
        if let Some(fault) = run.fault(&wanted, written) {
            faults.push(format!("{name}: {fault}\n    {}", run.said().trim_end().replace('\n', "\n    ")));
        }
    }
    assert!(faults.is_empty(), "{} cases\n{}", faults.len(), faults.join("\n"));
}

#[test]
fn wrong_recordings() {
    hold(&["track"], "angles.csv", recordings());
}

#[test]
fn wrong_marks() {
    hold(&["track"], "angles.csv", marks());
}

#[test]
fn wrong_places() {
    hold(&["track"], "angles.csv", places());
}

#[test]
fn a_camera_that_shakes() {
    hold(&["track"], "angles.csv", shaking());
}

#[test]
fn wrong_times() {
    hold(&["track"], "angles.csv", times());
}

#[test]
fn wrong_first_looks() {
    hold(&["freeswing", "init"], "experiment.toml", first_looks());
}

#[test]
fn a_thing_that_is_covered_from_time_to_time() {
    hold(&["freeswing", "init"], "experiment.toml", covered());
}
