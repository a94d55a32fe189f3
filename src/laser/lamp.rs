//! The lamp's course, and what answers it: light, warmth, gas, the swings that it excites.

use super::filter::Swing;
use super::grid::Grid;

/// Instants of a cell at which a course is evaluated; their mean is that of the cell.
const PARTS: usize = 4;

/// When the lamp is on.
#[derive(Debug, Clone, PartialEq)]
pub struct Lamp {
    /// On, off, on, …
    pub edges_s: Vec<f64>,
}

/// A time seen from the lamp.
#[derive(Debug, Clone, Copy)]
pub struct Instant {
    /// Number of edges so far.
    pub edges: usize,
    /// Since the last one.
    pub since_s: f64,
    /// Whether the lamp is on.
    pub is_lit: bool,
}

impl Lamp {
    /// Number of times the lamp goes on.
    pub fn cycles(&self) -> usize {
        self.edges_s.len().div_ceil(2)
    }

    /// How long it was on before each edge.
    fn lit_before_s(&self) -> Vec<f64> {
        let mut lit = 0.0;
        let mut all = Vec::with_capacity(self.edges_s.len());
        for (k, edge) in self.edges_s.iter().enumerate() {
            if k % 2 == 1 {
                lit += edge - self.edges_s[k - 1];
            }
            all.push(lit);
        }
        all
    }

    /// Whether it is on.
    pub fn is_lit(&self, t_s: f64) -> bool {
        self.edges_s.partition_point(|edge| *edge <= t_s) % 2 == 1
    }

    /// Distance to the nearest edge.
    pub fn nearest_s(&self, t_s: f64) -> f64 {
        self.edges_s.iter().map(|edge| (edge - t_s).abs()).fold(f64::INFINITY, f64::min)
    }

    /// The mean over each cell of what `value` is at an instant; a part in which the lamp switches counts before and after by their lengths.
    pub fn course(&self, grid: &Grid, mut value: impl FnMut(f64, Instant) -> f64) -> Vec<f64> {
        let mut edges = 0;
        let part_s = grid.step_s / PARTS as f64;
        let mut at = |t_s: f64, edges: usize| {
            let since_s = if edges > 0 { t_s - self.edges_s[edges - 1] } else { 0.0 };
            value(t_s, Instant { edges, since_s, is_lit: edges % 2 == 1 })
        };
        let mut cell_of = |cell: usize| {
            let mut sum = 0.0;
            for part in 0..PARTS {
                let mut from_s = grid.time_s(cell) - 0.5 * grid.step_s + part as f64 * part_s;
                let to_s = from_s + part_s;
                while let Some(edge) = self.edges_s.get(edges).copied().filter(|edge| *edge <= to_s) {
                    if edge > from_s {
                        sum += at(0.5 * (from_s + edge), edges) * (edge - from_s) / part_s;
                        from_s = edge;
                    }
                    edges += 1;
                }
                sum += at(0.5 * (from_s + to_s), edges) * (to_s - from_s) / part_s;
            }
            sum / PARTS as f64
        };
        (0..grid.len()).map(&mut cell_of).collect()
    }

    /// The light: 1 while the lamp is on, of a cell in which it switches the lit share.
    pub fn light(&self, grid: &Grid) -> Vec<f64> {
        self.course(grid, |_, i| f64::from(i.is_lit))
    }

    /// First-order answer: x' = (u − x)/τ.
    pub fn low_pass(&self, grid: &Grid, tau_s: f64) -> Vec<f64> {
        let mut at_edge = vec![0.0];
        for (k, edge) in self.edges_s.iter().enumerate() {
            let before = if k == 0 { 0.0 } else { edge - self.edges_s[k - 1] };
            let (from, to) = (at_edge[k], f64::from(k % 2 == 1));
            at_edge.push(to + (from - to) * (-before / tau_s).exp());
        }
        self.course(grid, |_, i| {
            let to = f64::from(i.is_lit);
            to + (at_edge[i.edges] - to) * (-i.since_s / tau_s).exp()
        })
    }

    /// Warmth of a film that loses it by radiation, scaled to 1 where it settles; `rise` is that temperature over the wall's, less 1.
    ///
    /// ```text
    /// 4τ x' = u ((1+r)⁴ − 1) − ((1+x)⁴ − 1),   warmth = x/r        (r → 0: τ w' = u − w)
    /// ```
    pub fn warmth(&self, grid: &Grid, tau_s: f64, rise: f64) -> Vec<f64> {
        if rise < 1e-4 {
            return self.low_pass(grid, tau_s);
        }
        let step_s = grid.step_s / PARTS as f64;
        let full = (1.0 + rise).powi(4) - 1.0;
        let rate = |x: f64, lit: f64| (lit * full - ((1.0 + x).powi(4) - 1.0)) / (4.0 * tau_s);
        let light = self.light(grid);
        let mut x = 0.0;
        let mut all = Vec::with_capacity(grid.len());
        for lit in light {
            let mut sum = 0.0;
            for _ in 0..PARTS {
                let k1 = rate(x, lit);
                let k2 = rate(x + 0.5 * step_s * k1, lit);
                sum += x + 0.5 * step_s * k1;
                x += step_s * k2;
            }
            all.push(sum / (PARTS as f64 * rise));
        }
        all
    }

    /// What an oscillator makes of a first-order answer, its swings included: u − κ exp(−t/τ) − (1−κ) cos ωt − κ/(ωτ) sin ωt after each edge.
    pub fn swung_low_pass(&self, grid: &Grid, tau_s: f64, swing: &Swing) -> Vec<f64> {
        let carried = swing.carried(tau_s);
        let [cos, sin] = self.rings_of(grid, swing, &self.to_and_fro());
        let quarter = carried / (swing.pole()[1] * tau_s);
        let slow = self.low_pass(grid, tau_s).into_iter().zip(self.light(grid));
        slow.zip(cos.into_iter().zip(sin))
            .map(|((w, u), (c, s))| u + carried * (w - u) - (1.0 - carried) * c - quarter * s)
            .collect()
    }

    /// What an oscillator makes of a force that jumps at each edge and dies away with exp(−t/τ): κ times its course, and the swings.
    pub fn swung(&self, grid: &Grid, course: &[f64], jump: &[f64], tau_s: f64, swing: &Swing) -> Vec<f64> {
        let carried = swing.carried(tau_s);
        let quarter = 1.0 / (swing.pole()[1] * tau_s);
        let [cos, sin] = self.rings_of(grid, swing, jump);
        course.iter().zip(cos.iter().zip(sin)).map(|(x, (c, s))| carried * (x - c + quarter * s)).collect()
    }

    /// The jumps of `warm_up` at each edge.
    pub fn warm_up_all_jumps(&self, tau_s: f64) -> Vec<f64> {
        let rings = self.warm_up_jumps(tau_s);
        rings.iter().enumerate().map(|(k, jump)| if k % 2 == 0 { -1.0 } else { *jump }).collect()
    }

    /// How a film creeps by the logarithm of time: Σ ± ln(1 + t/s)/ln(1 + T/s) since every edge, T the record's length.
    pub fn log_creep(&self, grid: &Grid, span_s: f64) -> Vec<f64> {
        let whole = (grid.duration_s() / span_s).ln_1p();
        self.course(grid, |t_s, i| {
            let ratio = |pair: &[f64]| {
                let crept = |edge: f64| (t_s - edge).max(0.0) + span_s;
                crept(pair[0]) / pair.get(1).map_or(span_s, |off| crept(*off))
            };
            self.edges_s[..i.edges].chunks(2).map(ratio).product::<f64>().ln() / whole
        })
    }

    /// What a lamp that warms up lacks: −exp(−t/τ) since it went on, 0 in the dark.
    pub fn warm_up(&self, grid: &Grid, tau_s: f64) -> Vec<f64> {
        self.course(grid, |_, i| if i.is_lit { -(-i.since_s / tau_s).exp() } else { 0.0 })
    }

    /// A push that dies away within each lit time and from one to the next with all the time lit before.
    pub fn gas(&self, grid: &Grid, tau_s: f64, store_s: f64) -> Vec<f64> {
        let before = self.lit_before_s();
        self.course(grid, |_, i| match i.is_lit {
            true => (-i.since_s / tau_s - before[i.edges - 1] / store_s).exp(),
            false => 0.0,
        })
    }

    /// A push that dies away within each lit time, and is smaller by exp(−loss) each time than the time before.
    pub fn gas_train(&self, grid: &Grid, tau_s: f64, loss: f64) -> Vec<f64> {
        self.course(grid, |_, i| match i.is_lit {
            true => (-i.since_s / tau_s - loss * ((i.edges - 1) / 2) as f64).exp(),
            false => 0.0,
        })
    }

    /// The jumps of `gas_train` at each edge.
    pub fn gas_train_jumps(&self, tau_s: f64, loss: f64) -> Vec<f64> {
        let jump = |k: usize| match k % 2 {
            0 => (-loss * (k / 2) as f64).exp(),
            _ => -(-(self.edges_s[k] - self.edges_s[k - 1]) / tau_s - loss * (k / 2) as f64).exp(),
        };
        (0..self.edges_s.len()).map(jump).collect()
    }

    /// The light of each cycle alone.
    pub fn each(&self, grid: &Grid) -> Vec<Vec<f64>> {
        let alone = |pair: &[f64]| Lamp { edges_s: pair.to_vec() }.light(grid);
        self.edges_s.chunks(2).map(alone).collect()
    }

    /// The jumps of the light at each edge: 1 and −1 in turn.
    pub fn to_and_fro(&self) -> Vec<f64> {
        (0..self.edges_s.len()).map(|k| if k % 2 == 0 { 1.0 } else { -1.0 }).collect()
    }

    /// The swings that a force excites which jumps by `jump` at each edge: cosine, sine.
    pub fn rings_of(&self, grid: &Grid, swing: &Swing, jump: &[f64]) -> [Vec<f64>; 2] {
        let edges: Vec<(f64, f64)> = self.edges_s.iter().copied().zip(jump.iter().copied()).collect();
        weighted_rings(&edges, grid, swing)
    }

    /// Σ over the on edges of what `warm_up` is at each switch-off, 0 at each switch-on.
    pub fn warm_up_jumps(&self, tau_s: f64) -> Vec<f64> {
        let jump = |k: usize| if k % 2 == 1 { (-(self.edges_s[k] - self.edges_s[k - 1]) / tau_s).exp() } else { 0.0 };
        (0..self.edges_s.len()).map(jump).collect()
    }

    /// The jumps of `gas` at each edge.
    pub fn gas_jumps(&self, tau_s: f64, store_s: f64) -> Vec<f64> {
        let before = self.lit_before_s();
        let jump = |k: usize| match k % 2 {
            0 => (-before[k] / store_s).exp(),
            _ => -(-(self.edges_s[k] - self.edges_s[k - 1]) / tau_s - before[k - 1] / store_s).exp(),
        };
        (0..self.edges_s.len()).map(jump).collect()
    }

    /// The decaying swings that begin at the edges: where it goes on (cosine, sine), where it goes off (the same).
    pub fn rings(&self, grid: &Grid, swing: &Swing) -> [Vec<f64>; 4] {
        let every = |first: usize| self.edges_s.iter().skip(first).step_by(2).copied().collect::<Vec<_>>();
        let [on_cos, on_sin] = rings_from(&every(0), grid, swing);
        let [off_cos, off_sin] = rings_from(&every(1), grid, swing);
        [on_cos, on_sin, off_cos, off_sin]
    }
}

/// Σ exp(−δ(t−tₑ)) cos, sin ω(t−tₑ) over the edges before t.
pub fn rings_from(edges_s: &[f64], grid: &Grid, swing: &Swing) -> [Vec<f64>; 2] {
    let edges: Vec<(f64, f64)> = edges_s.iter().map(|edge| (*edge, 1.0)).collect();
    weighted_rings(&edges, grid, swing)
}

fn weighted_rings(edges: &[(f64, f64)], grid: &Grid, swing: &Swing) -> [Vec<f64>; 2] {
    let [decay, turn] = swing.pole();
    let part_s = grid.step_s / PARTS as f64;
    let size = (-decay * part_s).exp();
    let (c, s) = (size * (turn * part_s).cos(), size * (turn * part_s).sin());
    let (mut cos, mut sin) = (Vec::with_capacity(grid.len()), Vec::with_capacity(grid.len()));
    // what the parts of a cell without an edge come to, Σ zᵏ, and the whole of it, zⁿ
    let ((mut all_c, mut all_s), (mut whole_c, mut whole_s)) = ((0.0, 0.0), (1.0, 0.0));
    for _ in 0..PARTS {
        (whole_c, whole_s) = (c * whole_c - s * whole_s, s * whole_c + c * whole_s);
        (all_c, all_s) = (all_c + whole_c, all_s + whole_s);
    }
    let (mut x, mut y, mut next) = (0.0, 0.0, 0);
    for cell in 0..grid.len() {
        if edges.get(next).is_none_or(|edge| edge.0 > grid.time_s(cell) + 0.5 * grid.step_s) {
            cos.push((all_c * x - all_s * y) / PARTS as f64);
            sin.push((all_s * x + all_c * y) / PARTS as f64);
            (x, y) = (whole_c * x - whole_s * y, whole_s * x + whole_c * y);
            continue;
        }
        let (mut sum_x, mut sum_y) = (0.0, 0.0);
        for part in 0..PARTS {
            let t_s = grid.time_s(cell) + (part as f64 + 0.5) * part_s - 0.5 * grid.step_s;
            (x, y) = (c * x - s * y, s * x + c * y);
            while let Some((edge, weight)) = edges.get(next).filter(|edge| edge.0 <= t_s + 0.5 * part_s) {
                let ring = |since: f64| {
                    [(turn * since).cos(), (turn * since).sin()].map(|v| v * weight * (-decay * since).exp())
                };
                let (whole, length) = (ring(t_s - edge), t_s + 0.5 * part_s - edge);
                let part = ring(0.5 * length).map(|v| v * length / part_s);
                (x, y) = (x + whole[0], y + whole[1]);
                (sum_x, sum_y) = (sum_x + part[0] - whole[0], sum_y + part[1] - whole[1]);
                next += 1;
            }
            sum_x += x;
            sum_y += y;
        }
        cos.push(sum_x / PARTS as f64);
        sin.push(sum_y / PARTS as f64);
    }
    [cos, sin]
}

/// 0 before a time and 1 after it, of its cell the share after it.
pub fn step_at(at_s: f64, grid: &Grid) -> Vec<f64> {
    let edge = (at_s - grid.start_s) / grid.step_s;
    (0..grid.len()).map(|cell| (cell as f64 + 0.5 - edge).clamp(0.0, 1.0)).collect()
}
