//! [`Equations`]: the recording of an element whose parameters are inputs, as text and ready to be given numbers.
//!
//! | line | meaning |
//! |---|---|
//! | `v0 = position 1 2` | an input: `time`; of a frame `position`, `velocity`, `angular-velocity` and a component, `rotation`, row and column; `angle-reference`, `state`, `memory`, `signal`, `coordinate`, `unknown` and a number; `reaction-force`, `reaction-torque`, joint and component |
//! | `v1 = param length` | a parameter; of a vector, with the component |
//! | `v2 = mul v0 v1` | `add`, `sub`, `mul`, `div`, `atan2` of two values; `neg`, `sqrt`, `sin`, `cos`, `exp`, `ln`, `tanh` of one; a number may stand in the place of a value |
//! | `v3 = powi v2 3`, `v4 = powf v2 v1` | powers; of the second, the exponent depends on parameters only |
//! | `v5 = select v0 v1 v2 v3` | v2 where v0 < v1, otherwise v3 |
//! | `v6 = table 0 v5` | a table of the file |
//! | `v7 = function f v6` | a parameter that is a function; `slope f v6` its derivative; `surface f v5 v6` |
//! | `residual 0 = v7` | a result: the words are those of [`Role`] |
//! | `start 0 = v1` | value of a state at the start, `remember 0 = v1` of memory; they depend on parameters only |
//!
//! Values are numbered in their order. What follows `#` is for the reader.

use element_api::descriptor::{Descriptor, Kind};
use element_api::params::ParamKind;
use element_api::recording::{Input, MOST_OPS, Role};
use element_api::{Scalar, Table};

/// Lines that look up a function of a scene, which may be long.
const MOST_FUNCTIONS: usize = 100;
/// Discrete states that an element may have.
const MOST_MEMORY: usize = 1000;

/// A value: an earlier one, or a number.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Operand {
    Value(u32),
    Number(f64),
}

/// What a value is.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Step {
    Input(Input),
    /// A parameter, and which component of a vector.
    Parameter(usize, usize),
    Unary(Unary, Operand),
    Binary(Binary, [Operand; 2]),
    Powi(Operand, i32),
    Powf([Operand; 2]),
    Select([Operand; 4]),
    Table(usize, Operand),
    /// A parameter that is a function of one variable.
    Function(usize, Operand),
    Slope(usize, Operand),
    Surface(usize, [Operand; 2]),
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Unary {
    Neg,
    Sqrt,
    Sin,
    Cos,
    Exp,
    Ln,
    Tanh,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Binary {
    Add,
    Sub,
    Mul,
    Div,
    Atan2,
}

const UNARY: [(&str, Unary); 7] = [
    ("neg", Unary::Neg),
    ("sqrt", Unary::Sqrt),
    ("sin", Unary::Sin),
    ("cos", Unary::Cos),
    ("exp", Unary::Exp),
    ("ln", Unary::Ln),
    ("tanh", Unary::Tanh),
];

const BINARY: [(&str, Binary); 5] =
    [("add", Binary::Add), ("sub", Binary::Sub), ("mul", Binary::Mul), ("div", Binary::Div), ("atan2", Binary::Atan2)];

impl Unary {
    pub(super) fn of<S: Scalar>(self, a: S) -> S {
        match self {
            Self::Neg => -a,
            Self::Sqrt => a.sqrt(),
            Self::Sin => a.sin(),
            Self::Cos => a.cos(),
            Self::Exp => a.exp(),
            Self::Ln => a.ln(),
            Self::Tanh => a.tanh(),
        }
    }
}

impl Binary {
    pub(super) fn of<S: Scalar>(self, a: S, b: S) -> S {
        match self {
            Self::Add => a + b,
            Self::Sub => a - b,
            Self::Mul => a * b,
            Self::Div => a / b,
            Self::Atan2 => a.atan2(b),
        }
    }
}

impl Step {
    pub(super) fn operands(&self) -> impl Iterator<Item = Operand> {
        let list: [Option<Operand>; 4] = match *self {
            Self::Input(_) | Self::Parameter(..) => [None; 4],
            Self::Unary(_, a) | Self::Powi(a, _) => [Some(a), None, None, None],
            Self::Table(_, a) | Self::Function(_, a) | Self::Slope(_, a) => [Some(a), None, None, None],
            Self::Binary(_, [a, b]) | Self::Powf([a, b]) | Self::Surface(_, [a, b]) => [Some(a), Some(b), None, None],
            Self::Select(all) => all.map(Some),
        };
        list.into_iter().flatten()
    }

    /// Whether it is computed before there are equations, from operands that are.
    fn is_arithmetic(&self) -> bool {
        matches!(
            self,
            Self::Parameter(..) | Self::Unary(..) | Self::Binary(..) | Self::Powi(..) | Self::Powf(_) | Self::Select(_)
        )
    }
}

/// See the module documentation. What it refers to is there.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Equations {
    pub steps: Vec<Step>,
    pub tables: Vec<Table>,
    pub results: Vec<(Role, Operand)>,
    /// Values of the states at the start.
    pub starts: Vec<Operand>,
    /// Values of the memory at the start.
    pub memory: Vec<Operand>,
}

/// Where a result goes.
enum Place {
    Result(Role),
    Start(u32),
    Memory(u32),
}

/// A meaning that is counted.
type Numbered = fn(u32) -> Role;

type Words<'a> = std::vec::IntoIter<&'a str>;

struct Reader<'a> {
    descriptor: &'a Descriptor,
    tables: usize,
    steps: Vec<Step>,
    /// Whether a value depends on parameters only.
    known: Vec<bool>,
    functions: usize,
}

impl Equations {
    /// The equations in a text, of an element with this description.
    ///
    /// # Errors
    /// The line, from 0, and what is wrong with it; the line behind the last one where something is missing.
    pub fn parse(text: &str, descriptor: &Descriptor, tables: Vec<Table>) -> Result<Self, (usize, String)> {
        let mut reader =
            Reader { descriptor, tables: tables.len(), steps: Vec::new(), known: Vec::new(), functions: 0 };
        let mut results: Vec<(Role, Operand)> = Vec::new();
        let (mut starts, mut memory) = (Vec::new(), Vec::new());
        let mut places = Vec::new();
        for (number, line) in text.lines().enumerate() {
            let line = line.split('#').next().unwrap_or_default();
            if line.trim().is_empty() {
                continue;
            }
            let wrong = |reason: String| (number, reason);
            let (left, right) = line.split_once('=').ok_or_else(|| wrong("it has no `=`".into()))?;
            let (left, right) = (words(left), words(right));
            if let [name] = left[..]
                && number_of(name).is_some()
            {
                reader.step(name, right.into_iter()).map_err(wrong)?;
                continue;
            }
            let place = reader.place(&left).map_err(wrong)?;
            let [value] = right[..] else { return Err(wrong("a result is one value".into())) };
            let value = reader.operand(value).map_err(wrong)?;
            if place.is_known() && !reader.is_known(value) {
                return Err(wrong(format!("`{}` must depend on parameters only", left.join(" "))));
            }
            match place {
                Place::Result(role) => {
                    places.push((role, number));
                    results.push((role, value));
                }
                // In their order, so that none is missing and none is given twice.
                Place::Start(k) | Place::Memory(k) => {
                    let list = if matches!(place, Place::Start(_)) { &mut starts } else { &mut memory };
                    if k as usize != list.len() {
                        return Err(wrong(format!("expected number {}, found {k}", list.len())));
                    }
                    list.push(value);
                }
            }
        }
        let last = text.lines().count();
        places.sort_unstable();
        if let Some(pair) = places.windows(2).find(|pair| pair[0].0 == pair[1].0) {
            return Err((pair[1].1, format!("{:?} is given twice", pair[1].0)));
        }
        if memory.len() > MOST_MEMORY {
            return Err((last, format!("{} discrete states; at most {MOST_MEMORY}", memory.len())));
        }
        let found = Self { steps: reader.steps, tables, results, starts, memory };
        found.complete(descriptor).map_err(|reason| (last.saturating_sub(1), reason))?;
        Ok(found)
    }

    /// Whether a result is given.
    fn gives(&self, role: Role) -> bool {
        self.results.iter().any(|(given, _)| *given == role)
    }

    /// Number of flexible coordinates.
    pub fn flexible(&self) -> usize {
        self.results.iter().filter(|(role, _)| matches!(role, Role::FlexibleForce(_))).count()
    }

    /// The rows of one kind, ascending.
    pub fn rows(&self, of: fn(u32) -> Role, count: usize) -> Vec<usize> {
        (0..count).filter(|row| self.gives(of(*row as u32))).collect()
    }

    /// Whether everything is given that the description promises.
    fn complete(&self, d: &Descriptor) -> Result<(), String> {
        let missing = |count: usize, role: fn(u32) -> Role| (0..count).find(|k| !self.gives(role(*k as u32)));
        let either = |k: &usize| self.gives(Role::Residual(*k as u32)) || self.gives(Role::VelocityResidual(*k as u32));
        if let Some(k) = (0..d.rows.len()).find(|k| !either(k)) {
            return Err(format!("the row `{}` is not given", d.rows[k]));
        }
        if self.starts.len() != d.states.len() {
            let (found, expected) = (self.starts.len(), d.states.len());
            return Err(format!("{found} states have a value at the start, {expected} are declared"));
        }
        let remembered = self.memory.len() as u32;
        let beyond = |step: &Step| matches!(step, Step::Input(Input::Discrete(k)) if *k >= remembered);
        let given = |(role, _): &(Role, Operand)| matches!(role, Role::NextDiscrete(k) if *k >= remembered);
        if self.steps.iter().any(beyond) || self.results.iter().any(given) {
            return Err(format!("takes or gives memory beyond the {remembered} numbers that it is given at the start"));
        }
        let coordinates = if d.kind == Kind::Joint { d.channels.len() } else { 0 };
        let flexible = self.flexible();
        if 2 * flexible > d.states.len() {
            return Err(format!("{flexible} flexible coordinates need {} states, q and q'", 2 * flexible));
        }
        let rate = (0..d.states.len()).find(|k| *k >= 2 * flexible && !self.gives(Role::StateRate(*k as u32)));
        let pose = d.mobility.is_some();
        let checks = [
            ("coordinate", missing(coordinates, Role::Coordinate)),
            ("channel", missing(d.reported().len(), Role::Channel)),
            ("rate of state", rate),
            ("flexible force", missing(flexible, Role::FlexibleForce)),
            ("memory after a step", missing(self.memory.len(), Role::NextDiscrete)),
            ("check", missing(d.checks.len(), Role::Check)),
            ("condition", missing(d.unknowns.len(), Role::Condition)),
            ("starting guess", missing(d.unknowns.len(), Role::Guess)),
            ("angle", missing(d.angles, Role::Angle)),
            ("position of the pose", missing(if pose { 3 } else { 0 }, Role::PosePosition)),
            ("rotation of the pose", missing(if pose { 9 } else { 0 }, Role::PoseRotation)),
        ];
        match checks.iter().find_map(|(what, missing)| Some((what, (*missing)?))) {
            Some((what, k)) => Err(format!("{what} {k} is not given")),
            None => Ok(()),
        }
    }
}

impl Place {
    /// Whether it is a number that the motion does not change.
    fn is_known(&self) -> bool {
        match self {
            Self::Start(_) | Self::Memory(_) => true,
            Self::Result(role) => matches!(
                role,
                Role::SamplePeriod | Role::Unilateral(_) | Role::SticksWith(_) | Role::SlidesWith(_) | Role::Guess(_)
            ),
        }
    }
}

fn words(text: &str) -> Vec<&str> {
    text.split_ascii_whitespace().collect()
}

/// The number of `v12`.
fn number_of(name: &str) -> Option<u32> {
    let digits = name.strip_prefix('v')?;
    digits.bytes().all(|byte| byte.is_ascii_digit()).then(|| digits.parse().ok()).flatten()
}

fn next<'a>(words: &mut Words<'a>, what: &str) -> Result<&'a str, String> {
    words.next().ok_or_else(|| format!("{what} is missing"))
}

/// A number below a bound.
fn index(word: &str, what: &str, bound: usize) -> Result<u32, String> {
    let number = word.parse::<u32>().map_err(|_| format!("`{}` is no {what}", word.escape_debug()))?;
    if (number as usize) < bound { Ok(number) } else { Err(format!("there is no {what} {number}; there are {bound}")) }
}

impl Reader<'_> {
    fn step(&mut self, name: &str, mut words: Words<'_>) -> Result<(), String> {
        if number_of(name) != Some(self.steps.len() as u32) {
            return Err(format!(
                "values are numbered in their order: expected `v{}`, found `{name}`",
                self.steps.len()
            ));
        }
        if self.steps.len() >= MOST_OPS {
            return Err(format!("more than {MOST_OPS} operations"));
        }
        let step = self.operation(next(&mut words, "an operation")?, &mut words)?;
        if let Some(more) = words.next() {
            return Err(format!("`{}` is one word too many", more.escape_debug()));
        }
        let known = step.is_arithmetic() && step.operands().all(|operand| self.is_known(operand));
        self.steps.push(step);
        self.known.push(known);
        Ok(())
    }

    fn is_known(&self, operand: Operand) -> bool {
        match operand {
            Operand::Value(k) => self.known[k as usize],
            Operand::Number(_) => true,
        }
    }

    /// A value that is there already, or a number.
    fn operand(&self, word: &str) -> Result<Operand, String> {
        if word.starts_with('v') {
            return match number_of(word) {
                Some(k) if (k as usize) < self.steps.len() => Ok(Operand::Value(k)),
                _ => Err(format!("`{}` is no value that comes before", word.escape_debug())),
            };
        }
        let number = word.parse::<f64>().ok().filter(|number| number.is_finite());
        number.map(Operand::Number).ok_or_else(|| format!("`{}` is neither a value nor a number", word.escape_debug()))
    }

    fn operands<const N: usize>(&self, words: &mut Words<'_>) -> Result<[Operand; N], String> {
        let mut found = [Operand::Number(0.0); N];
        for operand in &mut found {
            *operand = self.operand(next(words, "an operand")?)?;
        }
        Ok(found)
    }

    fn operation(&mut self, word: &str, words: &mut Words<'_>) -> Result<Step, String> {
        if let Some((_, operation)) = UNARY.iter().find(|(name, _)| *name == word) {
            let [a] = self.operands(words)?;
            return Ok(Step::Unary(*operation, a));
        }
        if let Some((_, operation)) = BINARY.iter().find(|(name, _)| *name == word) {
            return Ok(Step::Binary(*operation, self.operands(words)?));
        }
        match word {
            "param" => {
                let of =
                    [ParamKind::Number, ParamKind::Integer, ParamKind::Boolean, ParamKind::Text, ParamKind::Vector];
                let parameter = self.parameter(words, &of)?;
                if self.descriptor.params[parameter].kind != ParamKind::Vector {
                    return Ok(Step::Parameter(parameter, 0));
                }
                Ok(Step::Parameter(parameter, index(next(words, "a component")?, "component", 3)? as usize))
            }
            "powi" => {
                let [a] = self.operands(words)?;
                let word = next(words, "an exponent")?;
                let exponent = word.parse().map_err(|_| format!("`{}` is no whole exponent", word.escape_debug()))?;
                Ok(Step::Powi(a, exponent))
            }
            "powf" => {
                let [a, exponent] = self.operands(words)?;
                if !self.is_known(exponent) {
                    return Err("the exponent of `powf` must depend on parameters only".into());
                }
                Ok(Step::Powf([a, exponent]))
            }
            "select" => Ok(Step::Select(self.operands(words)?)),
            "table" => {
                let table = index(next(words, "a table")?, "table", self.tables)? as usize;
                let [a] = self.operands(words)?;
                Ok(Step::Table(table, a))
            }
            "function" | "slope" | "surface" => {
                self.functions += 1;
                if self.functions > MOST_FUNCTIONS {
                    return Err(format!("more than {MOST_FUNCTIONS} values of functions that scenes give"));
                }
                if word == "surface" {
                    return Ok(Step::Surface(self.parameter(words, &[ParamKind::Surface])?, self.operands(words)?));
                }
                let function = self.parameter(words, &[ParamKind::Function])?;
                let [a] = self.operands(words)?;
                Ok(if word == "slope" { Step::Slope(function, a) } else { Step::Function(function, a) })
            }
            _ => self.input(word, words).map(Step::Input),
        }
    }

    /// A parameter of one of these kinds.
    fn parameter(&self, words: &mut Words<'_>, kinds: &[ParamKind]) -> Result<usize, String> {
        let name = next(words, "the name of a parameter")?;
        let found = self.descriptor.params.iter().position(|param| param.name == name);
        let found = found.ok_or_else(|| format!("there is no parameter `{}`", name.escape_debug()))?;
        let kind = self.descriptor.params[found].kind;
        if kinds.contains(&kind) { Ok(found) } else { Err(format!("the parameter `{name}` is a {}", kind.text())) }
    }

    fn input(&self, word: &str, words: &mut Words<'_>) -> Result<Input, String> {
        let d = self.descriptor;
        let mut index = |what: &str, bound: usize| index(next(words, what)?, what, bound);
        Ok(match word {
            "time" => Input::Time,
            "position" => Input::Position { frame: index("frame", d.frames.len())?, component: index("component", 3)? },
            "rotation" => Input::Rotation {
                frame: index("frame", d.frames.len())?,
                row: index("row", 3)?,
                column: index("column", 3)?,
            },
            "velocity" => Input::Velocity { frame: index("frame", d.frames.len())?, component: index("component", 3)? },
            "angular-velocity" => {
                Input::AngularVelocity { frame: index("frame", d.frames.len())?, component: index("component", 3)? }
            }
            "angle-reference" => Input::AngleReference(index("angle", d.angles)?),
            "state" => Input::State(index("state", d.states.len())?),
            // As many as have a value at the start, which may come later; a recording is checked for that.
            "memory" => Input::Discrete(index("discrete state", MOST_MEMORY)?),
            "signal" => Input::Signal(index("signal", d.inputs.len())?),
            "coordinate" => Input::Coordinate(index("coordinate", d.mobility.unwrap_or(0))?),
            "unknown" => Input::Unknown(index("unknown", d.unknowns.len())?),
            "reaction-force" => {
                Input::ReactionForce { joint: index("joint", d.joints.len())?, component: index("component", 3)? }
            }
            "reaction-torque" => {
                Input::ReactionTorque { joint: index("joint", d.joints.len())?, component: index("component", 3)? }
            }
            _ => return Err(format!("`{}` is no operation", word.escape_debug())),
        })
    }

    /// What the words before `=` stand for.
    fn place(&self, left: &[&str]) -> Result<Place, String> {
        let d = self.descriptor;
        let frames = 3 * d.frames.len();
        let coordinates = if d.kind == Kind::Joint { d.channels.len() } else { 0 };
        let numbered: [(&str, Numbered, usize); 19] = [
            ("residual", Role::Residual, d.rows.len()),
            ("velocity-residual", Role::VelocityResidual, d.rows.len()),
            ("unilateral", Role::Unilateral, d.rows.len()),
            ("sticks-with", Role::SticksWith, d.rows.len()),
            ("limit", Role::Limit, d.rows.len()),
            ("slides-with", Role::SlidesWith, d.rows.len()),
            ("force", Role::Force, frames),
            ("torque", Role::Torque, frames),
            ("angle", Role::Angle, d.angles),
            ("coordinate", Role::Coordinate, coordinates),
            ("rate", Role::StateRate, d.states.len()),
            ("next", Role::NextDiscrete, MOST_MEMORY),
            ("channel", Role::Channel, d.reported().len()),
            ("check", Role::Check, d.checks.len()),
            ("condition", Role::Condition, d.unknowns.len()),
            ("guess", Role::Guess, d.unknowns.len()),
            ("flexible-force", Role::FlexibleForce, d.states.len() / 2),
            ("pose-position", Role::PosePosition, if d.mobility.is_some() { 3 } else { 0 }),
            ("pose-rotation", Role::PoseRotation, if d.mobility.is_some() { 9 } else { 0 }),
        ];
        match left {
            ["potential"] => Ok(Place::Result(Role::Potential)),
            ["dissipation"] => Ok(Place::Result(Role::Dissipation)),
            ["kinetic"] => Ok(Place::Result(Role::Kinetic)),
            ["sample-period"] => Ok(Place::Result(Role::SamplePeriod)),
            ["start", k] => index(k, "state", d.states.len()).map(Place::Start),
            ["remember", k] => index(k, "discrete state", MOST_MEMORY).map(Place::Memory),
            [word, k] => match numbered.iter().find(|(name, ..)| name == word) {
                Some((name, role, bound)) => index(k, name, *bound).map(|k| Place::Result(role(k))),
                None => Err(format!("`{}` is no result", word.escape_debug())),
            },
            _ => Err(format!("`{}` is neither a value nor a result", left.join(" ").escape_debug())),
        }
    }
}
