//! The grammar of laws: the formulas that a torque may have which no law of the table describes.
//!
//! ```text
//! a · place × state × shape × modulation
//! place       hinge, joint (all of them, or one of several), strip, tip
//! state       the angle there, its rate, the wind across the strip
//! shape       |u|^p sgn u (p = 0 … 3), u², constant, one-sided, with play, a stop on one side, a bump, a pull near the middle, a sign that fades with speed
//! modulation  1, growing with time, fading with time, from an instant on; of what goes with a rate also with the angle, as of a magnet at the lowest point;
//!             of a dry friction with the load of its bearing
//! ```
//!
//! Each term has the amplitude `a` and at most two further coefficients, whose starts are parts of the largest state that the recordings visit.

use std::collections::BTreeMap;

use crate::experiment::{Coefficient, Law, LawPlace};

/// One term.
#[derive(Debug, Clone, PartialEq)]
pub struct Term {
    /// As a file would state it, its amplitude 0.
    pub law: Law,
    /// `angle`, `rate`, `wind`.
    pub state: &'static str,
    /// Its shape, in words.
    pub shape: &'static str,
    /// How it changes with time or place, in words.
    pub modulation: &'static str,
    /// Whether it changes with time.
    pub drifts: bool,
}

/// Place, the only joint, state, shape and modulation of a term.
pub type Form = (LawPlace, Option<usize>, &'static str, &'static str, &'static str);

impl Term {
    /// What it is, whatever its coefficients are: place, state, shape and modulation.
    pub fn form(&self) -> Form {
        (self.law.place, self.law.joint, self.state, self.shape, self.modulation)
    }

    /// The same under the name of the place at which it stands in a law.
    #[must_use]
    pub fn named(&self, place: usize) -> Self {
        let law = Law { name: format!("learnt {}", place + 1), ..self.law.clone() };
        Self { law, ..self.clone() }
    }

    /// The same at one joint alone.
    #[must_use]
    pub fn at_joint(mut self, joint: usize) -> Self {
        self.law.joint = Some(joint);
        self
    }

    /// What it becomes where its further coefficients say nothing, or where it does not change: a sign that fades at a speed beyond all that were seen is a sign.
    pub fn plainer(&self) -> Option<Self> {
        let shapes = || shapes_of(self.state);
        let words = match self.modulation {
            NO_MODULATION => shapes().find(|shape| shape.words == self.shape)?.plainer?,
            _ => self.shape,
        };
        let shape = shapes().find(|shape| shape.words == words)?;
        let mut plain = term(self.law.place, self.state, (shape, &[]), None);
        plain.law.joint = self.law.joint;
        plain.law.parameters.get_mut("a")?.start = self.law.parameters.get("a")?.start;
        Some(plain)
    }

    /// Whether it goes with its state alone.
    pub fn is_unchanging(&self) -> bool {
        self.modulation == NO_MODULATION
    }

    /// Whether it goes with a rate, and so with what is lost.
    pub fn is_loss(&self) -> bool {
        self.state != "angle"
    }

    /// Whether it is dry friction that acts in a part of the swing.
    pub fn acts_in_a_part(&self) -> bool {
        self.shape == "sign" && [BESIDE, NEAR, AT_THE_MIDDLE].contains(&self.modulation)
    }

    /// Whether it sets in at an instant.
    pub fn sets_in(&self) -> bool {
        self.modulation == SETTING_IN
    }

    /// Whether it goes with the load of its bearing.
    pub fn is_by_load(&self) -> bool {
        self.modulation == WITH_LOAD.words
    }

    /// Its formula with the numbers of its coefficients.
    pub fn formula_with_values(&self) -> String {
        let number = |word: &str| self.law.parameters.get(word).map(|own| format!("{:.3e}", own.start));
        // a negative number turns the sign before it
        with_words(&self.law.formula, number).replace("--", "").replace("- -", "+ ")
    }
}

/// The largest values of the state at a place, and the length of the recordings.
#[derive(Debug, Clone, Copy)]
pub struct StateRange {
    /// Of the angle (rad); of a strip or tip 0.
    pub angle: f64,
    /// Of the rate (rad/s), or of the wind (m/s).
    pub rate: f64,
    /// Seconds.
    pub time_s: f64,
}

/// A shape of one state.
struct Shape {
    words: &'static str,
    /// Of the state u; b and c are further coefficients.
    formula: &'static str,
    /// The power of the state's unit that it has.
    power: i32,
    /// Starts of b and c, as parts of the largest u. A width or a threshold has no meaning below nothing; where b is a place, it may start there.
    starts: &'static [&'static [f64]],
    /// The shape that it becomes where b says nothing.
    plainer: Option<&'static str>,
}

impl Shape {
    /// Whether b is a place among the states, on either side.
    fn has_place(&self) -> bool {
        self.starts.iter().any(|start| start[0] <= 0.0)
    }
}

const fn plain(words: &'static str, formula: &'static str, power: i32) -> Shape {
    Shape { words, formula, power, starts: &[], plainer: None }
}

/// Of any state.
const POWERS: [Shape; 5] = [
    plain("in proportion", "u", 1),
    plain("sign", "sign(u)", 0),
    plain("square with its sign", "u * abs(u)", 2),
    plain("cube", "u ^ 3", 3),
    plain("one-sided", "max(u, 0)", 1),
];
/// Of an angle.
const OF_ANGLE: [Shape; 7] = [
    plain("square", "u ^ 2", 2),
    plain("constant", "1", 0),
    Shape {
        words: "with play",
        formula: "(max(u - b, 0) + min(u + b, 0))",
        power: 1,
        starts: &[&[0.15], &[0.4], &[0.7]],
        plainer: Some("in proportion"),
    },
    Shape { words: STOP, formula: "max(u - b, 0)", power: 1, starts: PLACES_OF_STOPS, plainer: None },
    Shape { words: STOP, formula: "min(u + b, 0)", power: 1, starts: PLACES_OF_STOPS, plainer: None },
    Shape {
        words: "bump",
        formula: "exp(-((u - b) / c) ^ 2 / 2)",
        power: 0,
        starts: &[&[-0.5, 0.15], &[0.0, 0.15], &[0.5, 0.15], &[-0.5, 0.4], &[0.0, 0.4], &[0.5, 0.4]],
        plainer: None,
    },
    Shape {
        words: "pull near the middle",
        formula: "u * exp(-(u / b) ^ 2 / 2)",
        power: 1,
        starts: &[&[0.15], &[0.4]],
        plainer: Some("in proportion"),
    },
];
/// It may stand on either side.
const STOP: &str = "stop on one side";
/// Touched before the middle, or beyond it.
const PLACES_OF_STOPS: &[&[f64]] = &[&[-0.3], &[0.2], &[0.5], &[0.75]];
/// Of a rate.
const OF_RATE: [Shape; 1] = [Shape {
    words: "sign that fades with speed",
    formula: "sign(u) * exp(-abs(u) / b)",
    power: 0,
    starts: &[&[0.05], &[0.2], &[1.0], &[4.0]],
    plainer: Some("sign"),
}];

/// How an amplitude changes.
struct Modulation {
    words: &'static str,
    /// What the shape is multiplied by; d is a time or an angle, or a width about the angle c.
    formula: &'static str,
    /// Starts of d, or of c and d, as parts of the recordings' length, or of the largest angle.
    starts: &'static [&'static [f64]],
    /// The powers of rad, s and N that it has.
    powers: [i32; 3],
}

/// It does not.
const NO_MODULATION: &str = "none";
const SETTING_IN: &str = "from an instant on";
/// With time.
const WITH_TIME: [Modulation; 3] = [
    Modulation { words: "growing with time", formula: "t", starts: &[], powers: [0, 1, 0] },
    Modulation { words: "fading with time", formula: "exp(-t / d)", starts: &[&[0.3]], powers: [0, 0, 0] },
    // within some steps of an integrator, without which no derivative tells where the instant lies
    Modulation {
        words: SETTING_IN,
        formula: "(1 + tanh((t - d) / 0.1)) / 2",
        starts: &[&[0.25], &[0.5], &[0.75]],
        powers: [0, 0, 0],
    },
];
/// Of what goes with a rate, with the angle: a magnet; of dry friction also a brush, or a thread that touches in a part of the swing.
const WITH_ANGLE: [Modulation; 5] = [
    Modulation { words: "growing with the square of the angle", formula: "angle ^ 2", starts: &[], powers: [2, 0, 0] },
    Modulation {
        words: AT_THE_MIDDLE,
        formula: "exp(-(angle / d) ^ 2)",
        starts: &[&[0.15], &[0.5]],
        powers: [0, 0, 0],
    },
    Modulation {
        words: NEAR,
        formula: "exp(-((angle - c) / d) ^ 2)",
        starts: &[&[-0.2, 0.25], &[0.2, 0.25]],
        powers: [0, 0, 0],
    },
    // within some steps of an integrator, as in time
    Modulation {
        words: BESIDE,
        formula: "(1 + tanh((angle - d) / 0.02)) / 2",
        starts: PLACES_OF_SIDES,
        powers: [0, 0, 0],
    },
    Modulation {
        words: BESIDE,
        formula: "(1 - tanh((angle - d) / 0.02)) / 2",
        starts: PLACES_OF_SIDES,
        powers: [0, 0, 0],
    },
];
const AT_THE_MIDDLE: &str = "strongest at the middle";
/// On either side of it.
const NEAR: &str = "strongest beside the middle";
/// On either.
const BESIDE: &str = "on one side of an angle";
/// From the middle on, or beyond it.
const PLACES_OF_SIDES: &[&[f64]] = &[&[-0.4], &[0.05], &[0.4]];

/// Of dry friction, with the load of its bearing: the amplitude is the coefficient of friction times the radius at which it rubs.
const WITH_LOAD: Modulation =
    Modulation { words: "in proportion to the load", formula: "load", starts: &[], powers: [0, 0, 1] };

/// Every term at a place.
pub fn terms(place: LawPlace, largest: StateRange) -> Vec<Term> {
    let states = place.variables().iter().filter(|variable| !["load", "t"].contains(variable));
    states.flat_map(|state| of_state(place, state, largest)).collect()
}

/// The shapes that a state may have.
fn shapes_of(state: &str) -> impl Iterator<Item = &'static Shape> {
    let own: &[Shape] = match state {
        "angle" => &OF_ANGLE,
        "rate" => &OF_RATE,
        _ => &[],
    };
    POWERS.iter().chain(own)
}

fn of_state(place: LawPlace, state: &'static str, largest: StateRange) -> Vec<Term> {
    let size = if state == "angle" { largest.angle } else { largest.rate };
    let mut all = Vec::new();
    for shape in shapes_of(state) {
        let none: &[&[f64]] = &[&[]];
        for starts in if shape.starts.is_empty() { none } else { shape.starts } {
            let starts: Vec<f64> = starts.iter().map(|part| part * size).collect();
            all.push(term(place, state, (shape, &starts), None));
        }
        // what changes is plain: a damper, a spring, a dry friction
        let is_plain = shape.starts.is_empty() && shape.words != "one-sided";
        let of_time = WITH_TIME.iter().filter(|_| is_plain && shape.power < 2);
        // a magnet's brake goes with the rate, and has its place; what rubs on the first link may do so in any part of the swing
        let acts = |own: &&Modulation| match (own.starts.is_empty(), shape.power) {
            (true, _) => true,
            (false, 0) => place == LawPlace::Hinge,
            (false, 1) => own.words == AT_THE_MIDDLE,
            _ => false,
        };
        let of_angle = WITH_ANGLE.iter().filter(|_| is_plain && state == "rate").filter(acts);
        let of_time = of_time.map(|modulation| (modulation, largest.time_s));
        let is_dry = shape.formula == "sign(u)" && state == "rate";
        let of_load = is_dry.then_some((&WITH_LOAD, 0.0));
        for (modulation, most) in of_time.chain(of_angle.map(|modulation| (modulation, largest.angle))).chain(of_load) {
            let none: &[&[f64]] = &[&[]];
            for starts in if modulation.starts.is_empty() { none } else { modulation.starts } {
                let starts: Vec<f64> = starts.iter().map(|part| part * most).collect();
                all.push(term(place, state, (shape, &[]), Some((modulation, &starts))));
            }
        }
    }
    all
}

/// A shape of a state, its further coefficients b, c beginning as given, and how it changes, with the start of d, or of c and d.
fn term(
    place: LawPlace,
    state: &'static str,
    (shape, starts): (&Shape, &[f64]),
    changes: Option<(&Modulation, &[f64])>,
) -> Term {
    let coefficient = |start: f64, min: Option<f64>, unit: &str| Coefficient { start, min, unit: unit.to_owned() };
    let times = changes.map_or(String::new(), |(modulation, _)| format!(" * {}", modulation.formula));
    let of_its_state = with_words(shape.formula, |word| (word == "u").then(|| state.to_owned()));
    let of_its_state = if shape.formula == "1" { String::new() } else { format!(" * {of_its_state}") };
    let formula = format!("-a{of_its_state}{times}");
    let of_state = match state {
        "angle" => "rad",
        "rate" => "rad/s",
        _ => "m/s",
    };
    let powers = changes.map_or([0; 3], |(modulation, _)| modulation.powers);
    let amplitude = coefficient(0.0, None, &unit_of(place, state, shape.power, powers));
    let mut parameters = BTreeMap::from([("a".to_owned(), amplitude)]);
    for (name, start) in ["b", "c"].into_iter().zip(starts) {
        let least = (name == "c" || !shape.has_place()).then_some(1e-3 * start.abs());
        parameters.insert(name.to_owned(), coefficient(*start, least, of_state));
    }
    for (name, start) in changes.iter().flat_map(|(_, starts)| ["c", "d"][2 - starts.len()..].iter().zip(*starts)) {
        let of_angle = times.contains("angle");
        // a place may lie on either side, a width or a time has no meaning below nothing
        let is_place = *name == "c" || times.contains("tanh((angle");
        let least = (!is_place).then_some(1e-3 * start);
        parameters.insert((*name).to_owned(), coefficient(*start, least, if of_angle { "rad" } else { "s" }));
    }
    let law = Law { name: "learnt".to_owned(), place, joint: None, formula, parameters };
    let modulation = changes.map_or(NO_MODULATION, |(modulation, _)| modulation.words);
    let drifts = WITH_TIME.iter().any(|own| own.words == modulation);
    Term { law, state, shape: shape.words, modulation, drifts }
}

/// A formula with other text in the place of some of its words.
fn with_words(formula: &str, of_word: impl Fn(&str) -> Option<String>) -> String {
    let is_word = |c: char| c.is_alphanumeric() || c == '_';
    let mut text = String::new();
    let mut rest = formula;
    while let Some(begin) = rest.find(is_word) {
        let (between, from_word) = rest.split_at(begin);
        let (word, after) = from_word.split_at(from_word.find(|c| !is_word(c)).unwrap_or(from_word.len()));
        text.push_str(between);
        text.push_str(of_word(word).as_deref().unwrap_or(word));
        rest = after;
    }
    text + rest
}

/// The unit of an amplitude: the place's own over that of a power of the state and of what it changes with, powers of rad, s and N.
fn unit_of(place: LawPlace, state: &str, power: i32, [rad, s, newton]: [i32; 3]) -> String {
    // the torque of a force at a radius
    let own = if place.unit() == "N m" && newton == 1 { "m" } else { place.unit() };
    let of_wind = state == "wind";
    let exponents = [
        ("rad", -rad - if of_wind { 0 } else { power }),
        ("m", if of_wind { -power } else { 0 }),
        ("s", if state == "angle" { 0 } else { power } - s),
    ];
    let raised = |(unit, exponent): &(&str, i32)| match exponent.abs() {
        1 => (*unit).to_owned(),
        more => format!("{unit}{more}"),
    };
    let above = exponents.iter().filter(|e| e.1 > 0).map(|e| format!(" {}", raised(e)));
    let below = exponents.iter().filter(|e| e.1 < 0).map(|e| format!("/{}", raised(e)));
    std::iter::once(own.to_owned()).chain(above).chain(below).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::effects::Effect;
    use crate::model::effects::formula::Formula;
    use crate::model::{Chain, Motion};

    const LARGEST: StateRange = StateRange { angle: 0.5, rate: 4.0, time_s: 30.0 };
    const PLACES: [LawPlace; 4] = [LawPlace::Hinge, LawPlace::Joint, LawPlace::Strip, LawPlace::Tip];

    #[test]
    fn every_term_is_a_law_that_a_file_could_state_and_exerts_something() {
        let chain = Chain::of(&crate::experiment::Specimen::default()).unwrap();
        let mut motion = Motion::zero(2, 0);
        motion.place(&[0.3, -0.1]);
        motion.rate.copy_from_slice(&[2.0, 3.5]);
        motion.t_s = 25.0;
        let mut on_the_other_side = motion.clone();
        on_the_other_side.place(&[-0.3, 0.1]);
        for place in PLACES {
            let mut formulas = Vec::new();
            for mut term in terms(place, LARGEST) {
                term.law.parameters.get_mut("a").unwrap().start = 1.0;
                let formula = Formula::of(&term.law).unwrap_or_else(|| panic!("{:?}", term.law.expression()));
                let acts = |motion: &Motion| {
                    let mut q = [0.0; 2];
                    formula.add_torque(&chain, motion, &mut q);
                    q.iter().any(|q| *q != 0.0)
                };
                let one_sided_or_far = matches!(term.shape, "one-sided" | "bump" | "with play" | STOP);
                let acts = acts(&motion) || term.acts_in_a_part() && acts(&on_the_other_side);
                assert!(acts || one_sided_or_far, "{} does nothing", term.law.formula);
                let starts: Vec<String> = term.law.parameters.values().map(|own| own.start.to_string()).collect();
                formulas.push(format!("{} {starts:?}", term.law.formula));
            }
            let count = formulas.len();
            formulas.sort();
            formulas.dedup();
            assert_eq!(formulas.len(), count, "a term stands twice");
        }
    }

    #[test]
    fn numbers_stand_for_the_words_that_are_coefficients_and_for_no_part_of_another() {
        let bump = terms(LawPlace::Hinge, LARGEST).into_iter().find(|term| term.shape == "bump").unwrap();
        let of = |a: f64| {
            let mut term = bump.clone();
            term.law.parameters.get_mut("a").unwrap().start = a;
            term.formula_with_values()
        };
        assert_eq!(of(0.002), "-2.000e-3 * exp(-((angle + 2.500e-1) / 7.500e-2) ^ 2 / 2)");
        assert_eq!(of(-0.002), "2.000e-3 * exp(-((angle + 2.500e-1) / 7.500e-2) ^ 2 / 2)");
        assert_eq!(with_words("a * ab + 2", |word| (word == "a").then(|| "x".to_owned())), "x * ab + 2");
    }

    #[test]
    fn a_term_whose_scale_says_nothing_is_a_plainer_one() {
        let all = terms(LawPlace::Joint, LARGEST);
        let plainer = |shape: &str, modulation: &str| {
            let mut term = all.iter().find(|own| own.shape == shape && own.modulation == modulation).unwrap().clone();
            term.law.parameters.get_mut("a").unwrap().start = 0.3;
            term.plainer().map(|plain| (plain.formula_with_values(), plain.law.parameters.len()))
        };
        let plain = |formula: &str| Some((formula.to_owned(), 1));
        assert_eq!(plainer("sign that fades with speed", NO_MODULATION), plain("-3.000e-1 * sign(rate)"));
        assert_eq!(plainer("with play", NO_MODULATION), plain("-3.000e-1 * angle"));
        assert_eq!(plainer("sign", "fading with time"), plain("-3.000e-1 * sign(angle)"));
        assert_eq!(plainer("sign", "growing with time"), plain("-3.000e-1 * sign(angle)"));
        assert_eq!(plainer("bump", NO_MODULATION), None);
        assert_eq!(plainer("cube", NO_MODULATION), None);
    }

    #[test]
    fn a_stop_stands_on_either_side_and_before_the_middle_or_beyond_it() {
        let stops: Vec<Term> = terms(LawPlace::Joint, LARGEST).into_iter().filter(|own| own.shape == STOP).collect();
        let touches = |stop: &Term, angle: f64| {
            let b = stop.law.parameters["b"].start;
            if stop.law.formula.contains("max") { angle > b } else { angle < -b }
        };
        for angle in [-0.45, -0.2, 0.2, 0.45] {
            let touched = stops.iter().filter(|stop| touches(stop, angle)).count();
            assert!(touched > 0 && touched < stops.len(), "{angle}");
        }
        assert!(stops.iter().all(|stop| stop.law.parameters["b"].min.is_none()));
    }

    #[test]
    fn amplitudes_have_the_units_that_make_the_place_s_own() {
        let unit = |place, formula: &str| {
            let term = terms(place, LARGEST).into_iter().find(|term| term.law.formula == formula).unwrap();
            term.law.parameters["a"].unit.clone()
        };
        assert_eq!(unit(LawPlace::Hinge, "-a * rate"), "N m s/rad");
        assert_eq!(unit(LawPlace::Hinge, "-a * sign(rate)"), "N m");
        assert_eq!(unit(LawPlace::Hinge, "-a * rate ^ 3"), "N m s3/rad3");
        assert_eq!(unit(LawPlace::Joint, "-a * angle ^ 2"), "N m/rad2");
        assert_eq!(unit(LawPlace::Hinge, "-a * angle * t"), "N m/rad/s");
        assert_eq!(unit(LawPlace::Hinge, "-a * sign(rate) * angle ^ 2"), "N m/rad2");
        assert_eq!(unit(LawPlace::Hinge, "-a"), "N m");
        assert_eq!(unit(LawPlace::Hinge, "-a * sign(rate) * load"), "m");
        assert_eq!(unit(LawPlace::Hinge, "-a * rate * exp(-(angle / d) ^ 2)"), "N m s/rad");
        assert_eq!(unit(LawPlace::Strip, "-a * wind * abs(wind)"), "N/m s2/m2");
    }

    #[test]
    fn friction_that_rubs_in_a_part_of_the_swing_is_plainly_friction() {
        let all = terms(LawPlace::Hinge, LARGEST);
        let of_a_part: Vec<&Term> = all.iter().filter(|term| term.acts_in_a_part()).collect();
        let words: std::collections::BTreeSet<&str> = of_a_part.iter().map(|term| term.modulation).collect();
        assert_eq!(words.into_iter().collect::<Vec<_>>(), [BESIDE, AT_THE_MIDDLE, NEAR]);
        for term in of_a_part {
            let plain = term.plainer().unwrap();
            assert_eq!((plain.shape, plain.modulation, plain.is_loss()), ("sign", NO_MODULATION, true));
        }
        assert!(terms(LawPlace::Joint, LARGEST).iter().all(|term| !term.acts_in_a_part()));
    }
}
