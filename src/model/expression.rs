//! Formulas of a law: text with variables, and their values with exact derivatives.
//!
//! ```text
//! sum     = product { (+ | −) product }
//! product = power { (* | /) power }
//! power   = [ − ] value [ ^ power ]
//! value   = number | variable | function ( sum { , sum } ) | ( sum )
//! ```
//!
//! Functions: `abs sign step max min exp sin cos sqrt tanh`. `sign` and `step` rise in a straight line within ±10⁻³ of the unit of what they are of: an integrator
//! cannot step over a jump, unless it is told on which side it is ([`Expression::with_sign_given`]). Derivatives are taken forward, with some variables at once.

use smallvec::SmallVec;

/// Most variables of one formula: the state and the coefficients.
pub const MOST_VARIABLES: usize = 13;
/// Half the width over which a sign goes from −1 to 1, in the unit of what it is of.
const SIGN_WIDTH: f64 = 1e-3;
/// The variables, and a sign that is given.
pub const MOST_VALUES: usize = MOST_VARIABLES + 1;

/// A formula, ready to be evaluated.
#[derive(Debug, Clone, PartialEq)]
pub struct Expression {
    /// In the order of evaluation: operands before what takes them.
    nodes: Vec<Node>,
    variables: usize,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Node {
    Number(f64),
    Variable(usize),
    Negate,
    Add,
    Subtract,
    Multiply,
    Divide,
    Power,
    /// To a small whole power.
    Raise(i32),
    Call(Function),
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Function {
    Abs,
    Sign,
    Step,
    Max,
    Min,
    Exp,
    Sin,
    Cos,
    Sqrt,
    Tanh,
}

const FUNCTIONS: [(&str, Function, usize); 10] = [
    ("abs", Function::Abs, 1),
    ("sign", Function::Sign, 1),
    ("step", Function::Step, 1),
    ("max", Function::Max, 2),
    ("min", Function::Min, 2),
    ("exp", Function::Exp, 1),
    ("sin", Function::Sin, 1),
    ("cos", Function::Cos, 1),
    ("sqrt", Function::Sqrt, 1),
    ("tanh", Function::Tanh, 1),
];

/// Largest whole power that is multiplied out.
const MOST_MULTIPLIED: f64 = 8.0;

/// A value with its derivatives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dual<const K: usize> {
    /// The value.
    pub value: f64,
    /// With each of some variables.
    pub slopes: [f64; K],
}

/// What a formula is evaluated with: values alone, or values with derivatives.
trait Number: Copy {
    fn constant(value: f64) -> Self;

    /// A variable; its place among those with which derivatives are taken, of which it need not be.
    fn variable(place: usize, value: f64) -> Self;

    fn value(self) -> f64;

    /// A function of this one with a value and a slope.
    fn chain(self, value: f64, slope: f64) -> Self;

    /// A function of two with a value and both slopes.
    fn join(self, other: Self, value: f64, slopes: [f64; 2]) -> Self;
}

impl Number for f64 {
    fn constant(value: f64) -> Self {
        value
    }

    fn variable(_: usize, value: f64) -> Self {
        value
    }

    fn value(self) -> f64 {
        self
    }

    fn chain(self, value: f64, _: f64) -> Self {
        value
    }

    fn join(self, _: Self, value: f64, _: [f64; 2]) -> Self {
        value
    }
}

impl<const K: usize> Number for Dual<K> {
    fn constant(value: f64) -> Self {
        Self { value, slopes: [0.0; K] }
    }

    fn variable(place: usize, value: f64) -> Self {
        Self { value, slopes: std::array::from_fn(|own| f64::from(u8::from(own == place))) }
    }

    fn value(self) -> f64 {
        self.value
    }

    fn chain(self, value: f64, slope: f64) -> Self {
        Self { value, slopes: self.slopes.map(|s| slope * s) }
    }

    fn join(self, other: Self, value: f64, [own, others]: [f64; 2]) -> Self {
        Self { value, slopes: std::array::from_fn(|i| own * self.slopes[i] + others * other.slopes[i]) }
    }
}

/// Operands that wait for their operator; a few are kept without asking for memory.
type Stack<N> = SmallVec<[N; 8]>;

impl Expression {
    /// Reads a formula of some variables.
    ///
    /// # Errors
    /// What is wrong and where, in words.
    pub fn parse(text: &str, variables: &[&str]) -> Result<Self, String> {
        if variables.len() > MOST_VARIABLES {
            return Err(format!("a formula has at most {MOST_VARIABLES} variables and coefficients"));
        }
        let mut parser = Parser { text, rest: text, variables, nodes: Vec::new(), depth: 0 };
        parser.sum()?;
        parser.skip_space();
        if !parser.rest.is_empty() {
            return Err(parser.unexpected("an operator or the end"));
        }
        Ok(Self { nodes: parser.nodes, variables: variables.len() })
    }

    /// How many numbers, variables, operators and functions it has.
    pub fn operations(&self) -> usize {
        self.nodes.len()
    }

    /// Whether a variable occurs.
    pub fn uses(&self, variable: usize) -> bool {
        self.nodes.contains(&Node::Variable(variable))
    }

    /// The same with a further variable, the last one, in the place of a variable's sign: whoever knows on which side of a jump he is need not smooth it. `None`
    /// where that sign does not occur.
    pub fn with_sign_given(&self, of: usize) -> Option<Self> {
        let is_its_sign = |pair: &[Node]| pair == [Node::Variable(of), Node::Call(Function::Sign)];
        let mut nodes = self.nodes.clone();
        while let Some(place) = nodes.windows(2).position(is_its_sign) {
            nodes.splice(place..place + 2, [Node::Variable(self.variables)]);
        }
        (nodes != self.nodes).then_some(Self { nodes, variables: self.variables + 1 })
    }

    /// The value.
    pub fn value(&self, variables: &[f64]) -> f64 {
        self.evaluate(variables, 0, |_| ())
    }

    /// Adds the quantities at whose zeros it bends, in the order of evaluation: the difference of what a `max` or a `min` is of, what an `abs` is of, and how far
    /// what a `sign` or a `step` is of lies from either edge of its rise.
    pub fn add_kinks(&self, variables: &[f64], kinks: &mut Vec<f64>) {
        _ = self.evaluate::<f64>(variables, 0, |difference| kinks.push(difference));
    }

    /// The value and its derivatives with K variables from one on.
    pub fn at<const K: usize>(&self, variables: &[f64], from: usize) -> Dual<K> {
        self.evaluate(variables, from, |_| ())
    }

    /// With derivatives from a variable on; the quantities at whose zeros it bends are handed to `bent`.
    fn evaluate<N: Number>(&self, variables: &[f64], from: usize, mut bent: impl FnMut(f64)) -> N {
        let mut stack: Stack<N> = Stack::new();
        for node in &self.nodes {
            let result = match *node {
                Node::Number(value) => N::constant(value),
                Node::Variable(i) => N::variable(i.wrapping_sub(from), variables.get(i).copied().unwrap_or(f64::NAN)),
                Node::Negate => of_one(pop(&mut stack), |v| (-v, -1.0)),
                Node::Raise(power) => {
                    of_one(pop(&mut stack), |v| (v.powi(power), f64::from(power) * v.powi(power - 1)))
                }
                Node::Call(function) if function.takes_one() => {
                    let operand: N = pop(&mut stack);
                    function.bends_at().iter().for_each(|at| bent(operand.value() - at));
                    of_one(operand, |v| function.of(v))
                }
                two => {
                    let (b, a) = (pop(&mut stack), pop(&mut stack));
                    if matches!(two, Node::Call(_)) {
                        bent(a.value() - b.value());
                    }
                    of_two(two, a, b)
                }
            };
            stack.push(result);
        }
        debug_assert!(stack.len() == 1 && variables.len() == self.variables);
        pop(&mut stack)
    }
}

/// The parser leaves no operator without its operands.
fn pop<N: Number>(stack: &mut Stack<N>) -> N {
    stack.pop().unwrap_or(N::constant(f64::NAN))
}

fn of_one<N: Number>(operand: N, function: impl Fn(f64) -> (f64, f64)) -> N {
    let (value, slope) = function(operand.value());
    operand.chain(value, slope)
}

fn of_two<N: Number>(node: Node, a: N, b: N) -> N {
    let (x, y) = (a.value(), b.value());
    match node {
        Node::Add => a.join(b, x + y, [1.0, 1.0]),
        Node::Subtract => a.join(b, x - y, [1.0, -1.0]),
        Node::Multiply => a.join(b, x * y, [y, x]),
        Node::Divide => a.join(b, x / y, [1.0 / y, -x / (y * y)]),
        Node::Power => {
            let value = x.powf(y);
            let own = if y == 0.0 { 0.0 } else { y * x.powf(y - 1.0) };
            a.join(b, value, [own, if x > 0.0 { value * x.ln() } else { 0.0 }])
        }
        Node::Call(Function::Max) => {
            if x >= y {
                a
            } else {
                b
            }
        }
        Node::Call(Function::Min) => {
            if x <= y {
                a
            } else {
                b
            }
        }
        _ => N::constant(f64::NAN),
    }
}

impl Function {
    fn takes_one(self) -> bool {
        !matches!(self, Self::Max | Self::Min)
    }

    /// Where a function of one value bends.
    fn bends_at(self) -> &'static [f64] {
        match self {
            Self::Abs => &[0.0],
            Self::Sign | Self::Step => &[-SIGN_WIDTH, SIGN_WIDTH],
            _ => &[],
        }
    }

    /// The value and the slope of a function of one value.
    fn of(self, v: f64) -> (f64, f64) {
        match self {
            Self::Abs => (v.abs(), if v < 0.0 { -1.0 } else { 1.0 }),
            Self::Sign => sign(v),
            Self::Step => {
                let (sign, slope) = sign(v);
                (0.5 * (1.0 + sign), 0.5 * slope)
            }
            Self::Exp => (v.exp(), v.exp()),
            Self::Sin => (v.sin(), v.cos()),
            Self::Cos => (v.cos(), -v.sin()),
            Self::Sqrt => (v.sqrt(), 0.5 / v.sqrt()),
            Self::Tanh => (v.tanh(), 1.0 - v.tanh().powi(2)),
            Self::Max | Self::Min => (f64::NAN, f64::NAN),
        }
    }
}

/// A sign that rises in a straight line, and its slope.
fn sign(v: f64) -> (f64, f64) {
    if v.abs() < SIGN_WIDTH { (v / SIGN_WIDTH, 1.0 / SIGN_WIDTH) } else { (v.signum(), 0.0) }
}

/// Brackets within brackets, at most.
const DEEPEST: usize = 64;

struct Parser<'t> {
    text: &'t str,
    rest: &'t str,
    variables: &'t [&'t str],
    nodes: Vec<Node>,
    depth: usize,
}

impl Parser<'_> {
    fn sum(&mut self) -> Result<(), String> {
        self.depth += 1;
        if self.depth > DEEPEST {
            return Err(format!("\"{}\" has more than {DEEPEST} brackets within brackets", self.text));
        }
        self.product()?;
        while let Some(operator) = self.one_of(&['+', '-', '−']) {
            self.product()?;
            self.nodes.push(if operator == '+' { Node::Add } else { Node::Subtract });
        }
        self.depth -= 1;
        Ok(())
    }

    fn product(&mut self) -> Result<(), String> {
        self.power()?;
        while let Some(operator) = self.one_of(&['*', '/']) {
            self.power()?;
            self.nodes.push(if operator == '*' { Node::Multiply } else { Node::Divide });
        }
        Ok(())
    }

    fn power(&mut self) -> Result<(), String> {
        self.depth += 1;
        if self.depth > DEEPEST {
            return Err(format!("\"{}\" has too many signs and powers in a row", self.text));
        }
        let is_negative = self.one_of(&['-', '−']).is_some();
        if is_negative {
            self.power()?;
            self.nodes.push(Node::Negate);
        } else {
            self.value()?;
            if self.one_of(&['^']).is_some() {
                self.power()?;
                self.raise();
            }
        }
        self.depth -= 1;
        Ok(())
    }

    /// To the power that was read last.
    fn raise(&mut self) {
        let is_small = |power: f64| power == power.trunc() && (1.0..=MOST_MULTIPLIED).contains(&power);
        match self.nodes.last() {
            Some(&Node::Number(power)) if is_small(power) => {
                self.nodes.pop();
                self.nodes.push(Node::Raise(power as i32));
            }
            _ => self.nodes.push(Node::Power),
        }
    }

    fn value(&mut self) -> Result<(), String> {
        if self.one_of(&['(']).is_some() {
            self.sum()?;
            return self.close();
        }
        if let Some(number) = self.number() {
            self.nodes.push(Node::Number(number));
            return Ok(());
        }
        let name = self.name();
        if name.is_empty() {
            return Err(self.unexpected("a number, a variable or a bracket"));
        }
        if let Some((_, function, operands)) = FUNCTIONS.iter().find(|(known, _, _)| *known == name) {
            return self.call(*function, *operands);
        }
        let place = self.variables.iter().position(|variable| *variable == name);
        let known = || [self.variables, &FUNCTIONS.map(|(name, _, _)| name)].concat().join(", ");
        let place =
            place.ok_or_else(|| format!("\"{name}\" in \"{}\" is not known; there are {}", self.text, known()))?;
        self.nodes.push(Node::Variable(place));
        Ok(())
    }

    fn call(&mut self, function: Function, operands: usize) -> Result<(), String> {
        if self.one_of(&['(']).is_none() {
            return Err(self.unexpected("a bracket after the function"));
        }
        for operand in 0..operands {
            if operand > 0 && self.one_of(&[',']).is_none() {
                return Err(self.unexpected("a comma"));
            }
            self.sum()?;
        }
        self.close()?;
        self.nodes.push(Node::Call(function));
        Ok(())
    }

    fn close(&mut self) -> Result<(), String> {
        self.one_of(&[')']).map(|_| ()).ok_or_else(|| self.unexpected("a closing bracket"))
    }

    fn number(&mut self) -> Option<f64> {
        self.skip_space();
        let is_digit = |c: char| c.is_ascii_digit() || c == '.';
        let digits = self.rest.find(|c| !is_digit(c)).unwrap_or(self.rest.len());
        let exponent = self.rest[digits..].strip_prefix(['e', 'E']).map_or(0, |rest| {
            let sign = usize::from(rest.starts_with(['+', '-']));
            let power = rest[sign..].find(|c: char| !c.is_ascii_digit()).unwrap_or(rest.len() - sign);
            if power == 0 { 0 } else { 1 + sign + power }
        });
        let number = self.rest[..digits + exponent].parse().ok().filter(|_| digits > 0)?;
        self.rest = &self.rest[digits + exponent..];
        Some(number)
    }

    fn name(&mut self) -> String {
        self.skip_space();
        let end = self.rest.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(self.rest.len());
        let name = self.rest[..end].to_owned();
        self.rest = &self.rest[end..];
        name
    }

    fn one_of(&mut self, wanted: &[char]) -> Option<char> {
        self.skip_space();
        let next = self.rest.chars().next().filter(|c| wanted.contains(c))?;
        self.rest = &self.rest[next.len_utf8()..];
        Some(next)
    }

    fn skip_space(&mut self) {
        self.rest = self.rest.trim_start();
    }

    fn unexpected(&self, wanted: &str) -> String {
        let found = self.rest.chars().next().map_or("the end".to_owned(), |c| format!("\"{c}\""));
        format!("\"{}\": expected {wanted}, found {found}", self.text)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn value(text: &str, variables: &[(&str, f64)]) -> f64 {
        let names: Vec<&str> = variables.iter().map(|(name, _)| *name).collect();
        let values: Vec<f64> = variables.iter().map(|(_, value)| *value).collect();
        Expression::parse(text, &names).unwrap().value(&values)
    }

    #[test]
    fn a_formula_bends_where_two_sides_are_equal_and_at_the_edges_of_a_sign() {
        let kinks = |text: &str| {
            let mut kinks = Vec::new();
            Expression::parse(text, &["angle", "b"]).unwrap().add_kinks(&[-0.3, 0.1], &mut kinks);
            kinks
        };
        assert_eq!(kinks("b * max(abs(angle) - b, 0)"), [-0.3, 0.3 - 0.1]);
        assert_eq!(kinks("sign(angle) + step(b)"), [-0.3 + 1e-3, -0.3 - 1e-3, 0.1 + 1e-3, 0.1 - 1e-3]);
        assert_eq!(kinks("max(angle, b) + 2 * min(angle + b, 0)"), [-0.4, -0.3 + 0.1]);
        assert!(kinks("angle * tanh(angle) / b").is_empty());
    }

    #[test]
    fn operators_bind_as_on_paper() {
        assert_eq!(value("1 + 2 * 3 ^ 2", &[]), 19.0);
        assert_eq!(value("-2 ^ 2", &[]), -4.0);
        assert_eq!(value("2 ^ 3 ^ 0", &[]), 2.0);
        assert_eq!(value("(1 - 2) - 3 / 4 / 2", &[]), -1.375);
        assert_eq!(value("2 * -x", &[("x", 3.0)]), -6.0);
        assert_eq!(value("1.5e-3*x", &[("x", 2.0)]), 3e-3);
        assert_eq!(value("max(x, 0) + min(x, 1)", &[("x", 3.0)]), 4.0);
    }

    #[test]
    fn derivatives_are_those_of_differences() {
        let text = "-a * max(rate, 0) + b * exp(-abs(rate) / c) * tanh(angle) ^ 3 - sin(angle) / cos(rate) + sqrt(abs(angle)) * step(rate) + a * sign(angle)";
        let names = ["angle", "rate", "a", "b", "c"];
        let formula = Expression::parse(text, &names).unwrap();
        for at in [[0.3, 0.7, 2.0, 0.5, 0.2], [-0.4, -0.9, 1.0, -2.0, 0.6], [0.002, 0.0012, 1.0, 1.0, 1.0]] {
            let exact = formula.at::<5>(&at, 0);
            assert_eq!(formula.value(&at), exact.value);
            assert_eq!(formula.at::<2>(&at, 1).slopes, exact.slopes[1..3]);
            for variable in 0..names.len() {
                let step = 1e-7;
                let moved = |by: f64| {
                    let mut moved = at;
                    moved[variable] += by;
                    formula.value(&moved)
                };
                let difference = (moved(step) - moved(-step)) / (2.0 * step);
                let error = (exact.slopes[variable] - difference).abs();
                assert!(error < 1e-5 * (1.0 + difference.abs()), "{variable}: {} {difference}", exact.slopes[variable]);
            }
        }
    }

    #[test]
    fn a_sign_that_is_given_is_not_smoothed_and_no_other_is_touched() {
        let formula =
            Expression::parse("-a * sign(rate) * exp(-abs(rate)) + sign(angle)", &["angle", "rate", "a"]).unwrap();
        let given = formula.with_sign_given(1).unwrap();
        assert_eq!(given.value(&[1.0, 1e-9, 2.0, -1.0]), 2.0 * (-1e-9f64).exp() + 1.0);
        assert_eq!(given.value(&[1.0, 0.0, 2.0, 0.0]), 1.0);
        assert_eq!(given.at::<1>(&[1.0, 0.0, 2.0, 1.0], 2).slopes[0], -1.0);
        assert_eq!(formula.with_sign_given(2), None);
    }

    #[test]
    fn what_is_wrong_is_said_with_its_place() {
        let wrong = |text: &str| Expression::parse(text, &["rate", "a"]).unwrap_err();
        assert!(wrong("-a * rat").starts_with("\"rat\" in \"-a * rat\" is not known; there are rate, a, abs"));
        assert_eq!(wrong("a * (rate"), "\"a * (rate\": expected a closing bracket, found the end");
        assert_eq!(wrong("a rate"), "\"a rate\": expected an operator or the end, found \"r\"");
        assert_eq!(wrong("max(rate)"), "\"max(rate)\": expected a comma, found \")\"");
        assert_eq!(wrong(""), "\"\": expected a number, a variable or a bracket, found the end");
        assert!(wrong(&"(".repeat(100_000)).contains("brackets"));
        assert!(wrong(&"-".repeat(100_000)).contains("in a row"));
    }
}
