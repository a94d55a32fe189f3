//! What a record may hold beside push, swings and noise: the forms of each effect, as columns of a linear model with a few shape numbers.
//!
//! | effect | form | displacement |
//! |---|---|---|
//! | `heat` | warmth | curl in proportion to the film's warmth, which follows the lamp within 0.4 to 50 s and loses heat by T⁴ |
//! | `lamp_warm_up` | lag | the push lacks exp(−t/τ) after each switch-on, nothing after a switch-off |
//! | `gas` | pulse, train | a push only while lit, that dies away within a cycle, and from cycle to cycle by the time lit before or by their number |
//! | `sensor_drift` | line, curve, warming, walk | in no step with the lamp: t; t and t²; 1 − exp(−t/τ) from the record's start; a random walk |
//! | `tilt` | step, slow, creep | the support or the sensor moves: at once, not at an edge of the lamp, with swings of its own; or warmed by the lamp within minutes; or creeping from an instant on |
//! | not in the table | log_creep | ln(1 + t/s) after every edge of the lamp, as a film creeps that has no time constant of its own |

use serde::Serialize;

use super::filter::Swing;
use super::grid::Grid;
use super::lamp::{Lamp, rings_from, step_at};

/// Between a film and a support: the slowest film cools in so many seconds, the fastest support warms in so many.
const SLOWEST_FILM_S: f64 = 50.0;

/// How far from the record's ends a step must be, so that level and swing are known before and after (s).
pub const FROM_ENDS_S: f64 = 2.0;
/// Modes of the strip that a force of its own excites.
const RINGING: usize = 2;

/// What a record may hold.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Effect {
    /// The film curls as it warms.
    Heat,
    /// The lamp's flux rises slowly.
    LampWarmUp,
    /// Gas leaves the lit face.
    Gas,
    /// The sensor drifts.
    SensorDrift,
    /// Support or sensor move.
    Tilt,
    /// Something that is not in the table.
    Other,
}

impl Effect {
    /// The table.
    pub const ALL: [Self; 5] = [Self::Heat, Self::LampWarmUp, Self::Gas, Self::SensorDrift, Self::Tilt];

    /// Its name in files.
    pub fn id(self) -> &'static str {
        match self {
            Self::Heat => "heat",
            Self::LampWarmUp => "lamp_warm_up",
            Self::Gas => "gas",
            Self::SensorDrift => "sensor_drift",
            Self::Tilt => "tilt",
            Self::Other => "other",
        }
    }

    /// In words.
    pub fn words(self) -> &'static str {
        match self {
            Self::Heat => "the film curls as it warms",
            Self::LampWarmUp => "the lamp warms up",
            Self::Gas => "gas leaves the lit face",
            Self::SensorDrift => "the sensor drifts",
            Self::Tilt => "the support tilts or the sensor moves",
            Self::Other => "something that is not in the table",
        }
    }
}

/// One form of an effect.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Form {
    Warmth,
    Lag,
    Pulse,
    Train,
    Line,
    Curve,
    Warming,
    Walk,
    Step,
    Slow,
    Creep,
    LogCreep,
}

/// A number of a form's shape.
#[derive(Debug, Clone, Copy)]
pub struct Shape {
    /// Its key in files.
    pub key: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// Whether the coordinate is the number's logarithm.
    pub is_logarithm: bool,
    /// Bounds of the coordinate.
    pub bounds: [f64; 2],
}

impl Shape {
    fn logarithm(key: &'static str, from: f64, to: f64) -> Self {
        Self { key, unit: "s", is_logarithm: true, bounds: [from.ln(), to.max(1.5 * from).ln()] }
    }

    /// The number of a coordinate.
    pub fn number(&self, coordinate: f64) -> f64 {
        if self.is_logarithm { coordinate.exp() } else { coordinate }
    }

    /// Standard deviation of the number.
    pub fn sd(&self, coordinate: f64, sd: f64) -> f64 {
        if self.is_logarithm { coordinate.exp() * sd } else { sd }
    }

    /// From bound to bound.
    pub fn width(&self) -> f64 {
        self.bounds[1] - self.bounds[0]
    }
}

/// What forms are columns over.
#[derive(Debug, Clone, Copy)]
pub struct Setting<'a> {
    /// The grid.
    pub grid: &'a Grid,
    /// The lamp.
    pub lamp: &'a Lamp,
    /// The slowest first; at least one.
    pub swings: &'a [Swing],
    /// Length of the whole record, by which times of the slow forms are scaled.
    pub lasts_s: f64,
}

impl Setting<'_> {
    /// Means over the period of the slowest swing.
    pub fn smoothed(&self, values: &[f64]) -> Vec<f64> {
        let period = ((1.0 / self.swings[0].hz) / self.grid.step_s).round().max(1.0) as usize;
        let half = period / 2;
        (0..values.len())
            .map(|k| {
                let part = &values[k.saturating_sub(half)..(k + half + 1).min(values.len())];
                part.iter().sum::<f64>() / part.len() as f64
            })
            .collect()
    }
}

impl Form {
    /// All.
    pub const ALL: [Self; 12] = [
        Self::Warmth,
        Self::Lag,
        Self::Pulse,
        Self::Train,
        Self::Line,
        Self::Curve,
        Self::Warming,
        Self::Walk,
        Self::Step,
        Self::Slow,
        Self::Creep,
        Self::LogCreep,
    ];

    /// Of which effect.
    pub fn effect(self) -> Effect {
        match self {
            Self::Warmth => Effect::Heat,
            Self::Lag => Effect::LampWarmUp,
            Self::Pulse | Self::Train => Effect::Gas,
            Self::Line | Self::Curve | Self::Warming | Self::Walk => Effect::SensorDrift,
            Self::Step | Self::Slow | Self::Creep => Effect::Tilt,
            Self::LogCreep => Effect::Other,
        }
    }

    /// Its name in files.
    pub fn id(self) -> &'static str {
        match self {
            Self::Warmth => "warmth",
            Self::Lag => "lag",
            Self::Pulse => "pulse",
            Self::Train => "train",
            Self::Line => "line",
            Self::Curve => "curve",
            Self::Warming => "warming",
            Self::Walk => "walk",
            Self::Step => "step",
            Self::Slow => "slow",
            Self::Creep => "creep",
            Self::LogCreep => "log_creep",
        }
    }

    /// Share of its effect's prior.
    pub fn share(self) -> f64 {
        1.0 / Self::ALL.iter().filter(|form| form.effect() == self.effect()).count() as f64
    }

    /// The numbers of its shape.
    pub fn shapes(self, with: &Setting<'_>) -> Vec<Shape> {
        let lasts_s = with.lasts_s;
        let lit_s: f64 =
            with.lamp.edges_s.chunks(2).map(|c| c.get(1).copied().unwrap_or(with.grid.end_s()) - c[0]).sum();
        match self {
            Self::Warmth => vec![
                Shape::logarithm("time_constant_s", 0.4, SLOWEST_FILM_S),
                Shape { key: "relative_rise", unit: "1", is_logarithm: false, bounds: [0.0, 0.4] },
            ],
            Self::Lag => vec![Shape::logarithm("time_constant_s", 0.4, 60.0)],
            Self::Pulse => vec![
                Shape::logarithm("time_constant_s", 0.5, (0.5 * lit_s).max(10.0)),
                Shape::logarithm("store_s", 2.0, (20.0 * lit_s).max(40.0)),
            ],
            Self::Train => vec![
                Shape::logarithm("time_constant_s", 0.5, 120.0),
                Shape { key: "ln_loss_a_cycle", unit: "1", is_logarithm: false, bounds: [0.0, 3.0] },
            ],
            Self::Line | Self::Curve | Self::Walk => Vec::new(),
            Self::Warming => vec![Shape::logarithm("time_constant_s", 0.02 * lasts_s, lasts_s)],
            Self::Step => vec![Shape {
                key: "at_s",
                unit: "s",
                is_logarithm: false,
                bounds: [with.grid.start_s + FROM_ENDS_S, with.grid.end_s() - FROM_ENDS_S],
            }],
            Self::Slow => vec![Shape::logarithm("time_constant_s", SLOWEST_FILM_S, 900.0)],
            Self::Creep => vec![
                Shape { key: "from_s", unit: "s", is_logarithm: false, bounds: [with.grid.start_s, with.grid.end_s()] },
                Shape::logarithm("time_constant_s", 0.05 * lasts_s, 3.0 * lasts_s),
            ],
            Self::LogCreep => vec![Shape::logarithm("span_s", 0.05, 10.0)],
        }
    }

    /// Shapes from which a descent begins; of a step they come from the record.
    pub fn starts(self, with: &Setting<'_>) -> Vec<Vec<f64>> {
        let between = |shape: &Shape, count: usize| -> Vec<f64> {
            (0..count).map(|k| shape.bounds[0] + (k as f64 + 0.5) / count as f64 * shape.width()).collect()
        };
        let shapes = self.shapes(with);
        match self {
            Self::Warmth => between(&shapes[0], 10).into_iter().map(|tau| vec![tau, 0.05]).collect(),
            Self::Pulse | Self::Train => between(&shapes[0], 7)
                .into_iter()
                .flat_map(|tau| between(&shapes[1], 4).into_iter().map(move |store| vec![tau, store]))
                .collect(),
            Self::Creep => between(&shapes[0], 10)
                .into_iter()
                .flat_map(|from| between(&shapes[1], 3).into_iter().map(move |tau| vec![from, tau]))
                .collect(),
            Self::Lag => between(&shapes[0], 9).into_iter().map(|tau| vec![tau]).collect(),
            Self::Warming | Self::Slow | Self::LogCreep => {
                between(&shapes[0], 5).into_iter().map(|tau| vec![tau]).collect()
            }
            Self::Line | Self::Curve | Self::Walk => vec![Vec::new()],
            Self::Step => Vec::new(),
        }
    }

    /// Whether an amplitude beyond the first bears a size of its own, not a swing.
    pub fn is_size(self, amplitude: usize) -> bool {
        amplitude == 0 || self == Self::Curve
    }

    /// Its columns with the swings that they excite and the lamp's own columns hold otherwise.
    pub fn swung_columns(self, shape: &[f64], with: &Setting<'_>) -> Vec<Vec<f64>> {
        let Setting { grid, lamp, swings, .. } = *with;
        let tau_s = shape.first().map_or(1.0, |x| x.exp());
        let swung = |course: Vec<f64>, jump: Vec<f64>| vec![lamp.swung(grid, &course, &jump, tau_s, &swings[0])];
        match self {
            Self::Warmth => vec![lamp.swung_low_pass(grid, tau_s, &swings[0])],
            Self::Lag => swung(lamp.warm_up(grid, tau_s), lamp.warm_up_all_jumps(tau_s)),
            Self::Pulse => {
                let store_s = shape[1].exp();
                swung(lamp.gas(grid, tau_s, store_s), lamp.gas_jumps(tau_s, store_s))
            }
            Self::Train => swung(lamp.gas_train(grid, tau_s, shape[1]), lamp.gas_train_jumps(tau_s, shape[1])),
            _ => self.columns(shape, with),
        }
    }

    /// Number of its columns.
    pub fn count(self, with: &Setting<'_>) -> usize {
        match self {
            Self::Walk => 0,
            Self::Curve => 2,
            Self::Step => 1 + 2 * with.swings.len(),
            Self::Lag | Self::Pulse | Self::Train => 1 + 2 * RINGING.min(with.swings.len()),
            Self::Warmth | Self::Line | Self::Warming | Self::Slow | Self::Creep | Self::LogCreep => 1,
        }
    }

    /// Its columns, the first of which bears its size.
    pub fn columns(self, shape: &[f64], with: &Setting<'_>) -> Vec<Vec<f64>> {
        let Setting { grid, lamp, swings, lasts_s } = *with;
        let swing = &swings[0];
        // a force that does not jump alike at every edge excites swings of its own
        let ringing = |course: Vec<f64>, jump: Vec<f64>| {
            let rings = swings.iter().take(RINGING).flat_map(|swing| lamp.rings_of(grid, swing, &jump));
            std::iter::once(course).chain(rings).collect::<Vec<_>>()
        };
        let over_time = |value: &dyn Fn(f64) -> f64| {
            (0..grid.len()).map(|cell| value((grid.time_s(cell) - grid.start_s) / lasts_s)).collect::<Vec<_>>()
        };
        match self {
            Self::Warmth => {
                let tau_s = shape[0].exp();
                let mut warmth = lamp.warmth(grid, tau_s, shape[1]);
                let carried = swing.carried(tau_s);
                // of a warmth as fast as the swing the strip follows exp(−t/τ) by another part
                if carried != 1.0 {
                    let light = lamp.light(grid);
                    warmth.iter_mut().zip(light).for_each(|(w, u)| *w = u + carried * (*w - u));
                }
                vec![warmth]
            }
            Self::Lag => ringing(lamp.warm_up(grid, shape[0].exp()), lamp.warm_up_jumps(shape[0].exp())),
            Self::Pulse => {
                let [tau_s, store_s] = [shape[0].exp(), shape[1].exp()];
                ringing(lamp.gas(grid, tau_s, store_s), lamp.gas_jumps(tau_s, store_s))
            }
            Self::Train => {
                let (tau_s, loss) = (shape[0].exp(), shape[1]);
                ringing(lamp.gas_train(grid, tau_s, loss), lamp.gas_train_jumps(tau_s, loss))
            }
            Self::Line => vec![over_time(&|x| x)],
            Self::Curve => vec![over_time(&|x| x), over_time(&|x| x * x)],
            Self::Warming => {
                let tau = shape[0].exp() / lasts_s;
                vec![over_time(&|x| 1.0 - (-x / tau).exp())]
            }
            Self::Walk => Vec::new(),
            Self::Step => {
                let rings = swings.iter().flat_map(|swing| rings_from(&shape[..1], grid, swing));
                std::iter::once(step_at(shape[0], grid)).chain(rings).collect()
            }
            Self::Slow => vec![lamp.low_pass(grid, shape[0].exp())],
            Self::LogCreep => vec![lamp.log_creep(grid, shape[0].exp())],
            Self::Creep => {
                let (from, tau) = ((shape[0] - grid.start_s) / lasts_s, shape[1].exp() / lasts_s);
                vec![over_time(&|x| -f64::exp_m1(-(x - from).max(0.0) / tau))]
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_form_has_as_many_columns_as_it_says() {
        let grid = Grid { start_s: 0.0, step_s: 0.25, y_m: vec![0.0; 400], count: vec![1.0; 400], origin_m: 0.0 };
        let lamp = Lamp { edges_s: vec![10.0, 30.0, 50.0, 70.0] };
        let swing = |hz| Swing { hz, damping: 0.01, drive_m2_s: 0.0, sense: 1.0 };
        for swings in [&[swing(1.35)][..], &[swing(1.35), swing(3.1), swing(4.8)]] {
            let with = Setting { grid: &grid, lamp: &lamp, swings, lasts_s: grid.duration_s() };
            for form in Form::ALL {
                let shape: Vec<f64> =
                    form.shapes(&with).iter().map(|shape| shape.bounds[0] + 0.5 * shape.width()).collect();
                assert_eq!(form.columns(&shape, &with).len(), form.count(&with), "{}", form.id());
            }
        }
    }
}
