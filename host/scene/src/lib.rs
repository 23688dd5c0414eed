//! Scene: from the text of a scene file to plain records.
//!
//! - **Takes**: a TOML text and the `--set` texts of the command line.
//! - **Gives**: a [`Scene`] with units converted to SI, expressions computed, directions normalised, and a byte range
//!   wherever a later room may have to point; or all mistakes of the text at once.
//! - **May touch**: the scene file ([`read`]) and the files of curves and grids that it names, nothing else.
//! - **Must not know**: plugins (types and parameters of elements are passed on as written), bodies by index,
//!   mathematics beyond arithmetic and rotations.
//!
//! The format, in short (every number may also be a text with a unit or an expression):
//! ```toml
//! title = "Pendulum"
//! [units]
//! length = "mm"                           # also mass, time, angle; force, torque, energy, pressure
//! [plugins]
//! libraries = ["joints"]                  # or { name = "joints", version = "^0.1", sha256 = "..." }
//! [parameters]
//! rod.length = "0.4 m"
//! [simulation]
//! gravity = [0, "-9.81 m/s^2", 0]
//! t_end = 2
//! output_step = 0.01
//! [[body]]
//! name = "rod"
//! mass = 0.3
//! inertia = [1, 1, 1]
//! position = ["rod.length/2", 0, 0]
//! [[body.shape]]                          # what it looks like, of no influence
//! kind = "capsule"
//! radius = 10
//! length = "rod.length"
//! axis = [1, 0, 0]
//! [[joint]]
//! name = "pivot"
//! type = "revolute"
//! bodies = ["ground", "rod"]
//! point = [0, 0, 0]
//! axis = [0, 0, 1]
//! [[force]]                               # and [[control]]
//! name = "motor"
//! type = "torque"
//! bodies = ["ground", "rod"]
//! inputs = { command = "pid.output" }     # a signal by name, or a constant
//! [[input]]                               # a signal that a program gives while the scene runs
//! name = "gust"
//! unit = "N"                              # of its values
//! value = 0                               # until another is given
//! [[output]]
//! name = "x"
//! quantity = "position"
//! of = "rod"
//! component = "x"
//! [[check]]                               # fails the run where it does not hold
//! name = "swing"
//! kind = "position"
//! value = "x"
//! reference = "rod.length/2 cos(3 t)"
//! tolerance = 1e-9
//! ```

mod bodies;
mod columns;
mod dimension;
mod elements;
mod expression;
mod files;
mod formula;
mod function;
mod grid;
mod inputs;
mod outputs;
mod overrides;
pub mod page;
mod parameters;
mod quantity;
mod raw;
mod reader;
mod record;
mod release;
mod rotation;
mod rounding;
pub mod schema;
mod settings;
mod shapes;
mod slips;
mod unit_system;
mod units;
mod verification;

#[cfg(test)]
#[allow(clippy::unwrap_used)] // in a test, the panic is the message
mod tests;

pub use bodies::{GROUND, PointMass};
pub use columns::{column_of_times, unit_of_times, with_commas};
pub use dimension::Dimension;
pub use formula::Formula;
pub use overrides::Override;
pub use parameters::{Parameter, Parameters};
pub use quantity::Quantity;
pub use raw::{RawKind, RawTable, RawValue, Spanned};
pub use record::{
    AnalysisRecord, AuditTolerance, BodyRecord, CheckKind, CheckRecord, Crossing, ElementKind, ElementRecord, Expected,
    ExternalInput, FigureRecord, InputRecord, InputSource, LibraryRecord, LocalFrame, NumberRecord, OutputRecord,
    OutputTimes, Placement, PluginRequest, Reference, SampleTime, Scene, Simulation, Take, VerificationRecord,
};
pub use release::{ReleaseRecord, ReleaseWhen};
pub use shapes::{ShapeKind, ShapeRecord};
pub use unit_system::UnitSystem;
pub use units::{UnitError, counts_cycles, name_and_unit, number_and_unit, parse_unit};

use odyn_diagnostics::{Diagnostic, Source, codes, suggest};
use reader::{NamesTaken, Reader, Record, Scope};
use std::io::Read;
use std::path::Path;

/// Keys of a scene.
const KEYS: &[&str] = &[
    "title",
    "units",
    "plugins",
    "parameters",
    "simulation",
    "body",
    "joint",
    "force",
    "control",
    "input",
    "output",
    "figure",
    "check",
    "verification",
];

/// Longest scene that is read, bytes. Ten thousand bodies with their joints take six million.
const LONGEST: u64 = 64 << 20;
/// Files of a folder that are looked at for a name that is near.
const MOST_FILES: usize = 10_000;

/// A scene that could not be read: its text and everything that is wrong with it.
#[derive(Clone, Debug, PartialEq)]
pub struct Rejected {
    /// The text that the diagnostics point into, with the command-line texts.
    pub source: Source,
    /// Errors, and warnings found on the way.
    pub diagnostics: Vec<Diagnostic>,
}

/// Reads a scene file; the path as given becomes the name of the source. See [`parse`].
///
/// # Errors
/// The file cannot be read or is not UTF-8 (then the source is empty), or as [`parse`].
pub fn read(path: &Path, overrides: &[Override]) -> Result<(Scene, Vec<Diagnostic>), Box<Rejected>> {
    Document::open(path)?.scene(overrides)
}

/// Reads the text of a scene: the scene with warnings, or everything that is wrong with it.
///
/// Overrides are applied in their order before anything is read; their texts are added to the source.
///
/// # Errors
/// One diagnostic per mistake. If the text is not TOML, only that is reported, at all places.
pub fn parse(source: Source, overrides: &[Override]) -> Result<(Scene, Vec<Diagnostic>), Box<Rejected>> {
    Document::parse(source)?.scene(overrides)
}

/// A text that is TOML: what the scenes share that are made of it by overrides.
#[derive(Clone, Debug)]
pub struct Document {
    source: Source,
    root: RawTable,
    diagnostics: Vec<Diagnostic>,
}

/// What to do about a file that cannot be read: the nearest name in its folder, the scenes of a folder.
fn advice(path: &Path, error: &std::io::Error) -> String {
    let scenes = |folder: &Path| -> Vec<String> {
        let entries = std::fs::read_dir(folder).into_iter().flatten().take(MOST_FILES).filter_map(Result::ok);
        let names = entries.filter_map(|entry| entry.file_name().into_string().ok());
        let mut found: Vec<String> = names.filter(|name| name.ends_with(".toml")).collect();
        found.sort();
        found
    };
    match error.kind() {
        std::io::ErrorKind::IsADirectory if path.join("state.toml").exists() => {
            "this folder has results; name the scene, and continue from here with `--from FOLDER`".into()
        }
        std::io::ErrorKind::IsADirectory | std::io::ErrorKind::PermissionDenied if path.is_dir() => {
            match scenes(path).first() {
                Some(first) => format!("name a scene in this folder, such as `{}`", path.join(first).display()),
                None => "name a scene: a file, usually `*.toml`".into(),
            }
        }
        std::io::ErrorKind::PermissionDenied => "it may not be read: see who it belongs to, and `chmod u+r`".into(),
        std::io::ErrorKind::NotFound => {
            let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
            let name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
            let all = scenes(folder);
            let bare = |name: &str| name.trim_end_matches(".toml").to_owned();
            let near = suggest(&bare(&name), all.iter().map(|one| one.trim_end_matches(".toml")));
            match near.filter(|_| folder.is_dir()) {
                Some(near) => format!("did you mean `{}`?", path.with_file_name(format!("{near}.toml")).display()),
                None if !folder.is_dir() => format!("there is no folder `{}`; check the path", folder.display()),
                None => "check the path, which is relative to the folder that the command is started in".into(),
            }
        }
        _ => "check the path, and that it is a file".into(),
    }
}

impl Document {
    /// Reads a file; the path as given becomes the name of the source.
    ///
    /// # Errors
    /// The file cannot be read or is not UTF-8 (then the source is empty), or as [`Document::parse`].
    pub fn open(path: &Path) -> Result<Self, Box<Rejected>> {
        let name = path.display().to_string();
        let unreadable = |message: String, help: String| {
            Box::new(Rejected {
                source: Source::new(name.clone(), ""),
                diagnostics: vec![Diagnostic::error(codes::UNREADABLE, message).help(help)],
            })
        };
        let mut bytes = Vec::new();
        let file = std::fs::File::open(path).and_then(|file| {
            // One more, so that the end of the file is seen without room for what follows.
            let length = file.metadata().map_or(0, |data| data.len().min(LONGEST));
            bytes.reserve(length as usize + 1);
            file.take(LONGEST + 1).read_to_end(&mut bytes)
        });
        file.map_err(|error| unreadable(format!("cannot read `{name}`: {error}"), advice(path, &error)))?;
        if bytes.len() as u64 > LONGEST {
            let message = format!("`{name}` is no scene: it is longer than {} MB", LONGEST >> 20);
            return Err(unreadable(message, "name a scene: a text file, usually `*.toml`".into()));
        }
        let text = String::from_utf8(bytes).map_err(|error| {
            let good = error.utf8_error().valid_up_to();
            let line = error.as_bytes()[..good].iter().filter(|b| **b == b'\n').count() + 1;
            let message = format!("`{name}` is not UTF-8 text, line {line} has other bytes");
            let from = match error.as_bytes() {
                [0xff, 0xfe, ..] | [0xfe, 0xff, ..] => "utf16",
                _ => "latin1",
            };
            let help = format!("save it as UTF-8 (`iconv -f {from} -t utf8`, or the encoding that your editor shows)");
            unreadable(message, help)
        })?;
        Self::parse(Source::new(name, text))
    }

    /// Takes a text.
    ///
    /// # Errors
    /// It is not TOML: that, at all places.
    pub fn parse(source: Source) -> Result<Self, Box<Rejected>> {
        let mut diagnostics = Vec::new();
        match raw::parse_document(&source, &mut diagnostics) {
            Ok(root) => Ok(Self { source, root, diagnostics }),
            Err(diagnostics) => Err(Box::new(Rejected { source, diagnostics })),
        }
    }

    /// The text.
    #[must_use]
    pub fn source(&self) -> &Source {
        &self.source
    }

    /// What the text, with overrides, has at a key that `--set` could set: a parameter, a key of a body or element, an entry of a
    /// list (`rotor.velocity.x`). `None` where nothing is given there.
    ///
    /// # Errors
    /// There is no such key.
    pub fn setting(&self, key: &str, overrides: &[Override]) -> Result<Option<RawValue>, Box<Diagnostic>> {
        let (mut root, mut source) = (self.root.clone(), self.source.clone());
        overrides::apply(&mut root, overrides, &mut source, &mut Vec::new());
        Ok(overrides::get(&root, key, 0..0)?.cloned())
    }

    /// All keys of which [`Self::setting`] finds a value that is no table and no list, in the order of the text.
    #[must_use]
    pub fn settings(&self, overrides: &[Override]) -> Vec<(String, RawValue)> {
        let (mut root, mut source) = (self.root.clone(), self.source.clone());
        overrides::apply(&mut root, overrides, &mut source, &mut Vec::new());
        overrides::values(&root)
    }

    /// The scene with overrides; see [`parse`].
    ///
    /// # Errors
    /// One diagnostic per mistake.
    pub fn scene(self, overrides: &[Override]) -> Result<(Scene, Vec<Diagnostic>), Box<Rejected>> {
        let Self { mut source, mut root, mut diagnostics } = self;
        let stripped = overrides::apply(&mut root, overrides, &mut source, &mut diagnostics);
        let files = files::expand(&mut root, &mut source, &mut diagnostics);
        let mut parts = read_parts(&root, &source, diagnostics);
        overrides::explain(&stripped, &source, &mut parts.diagnostics);
        let (Some(simulation), false) = (parts.simulation, parts.diagnostics.iter().any(Diagnostic::is_error)) else {
            return Err(Box::new(Rejected { source, diagnostics: parts.diagnostics }));
        };
        parameters::warn_of_unused(&root, &parts.parameters, &mut parts.diagnostics);
        let scene = Scene {
            source,
            files,
            title: parts.title,
            units: parts.units,
            parameters: parts.parameters,
            plugins: parts.plugins,
            simulation,
            bodies: parts.bodies,
            elements: parts.elements,
            inputs: parts.inputs,
            outputs: parts.outputs,
            figures: parts.figures,
            checks: parts.checks,
            verification: parts.verification,
        };
        Ok((scene, parts.diagnostics))
    }
}

/// Everything that was read, usable or not.
struct Parts {
    diagnostics: Vec<Diagnostic>,
    title: String,
    units: UnitSystem,
    parameters: Parameters,
    plugins: PluginRequest,
    simulation: Option<Simulation>,
    bodies: Vec<BodyRecord>,
    elements: Vec<ElementRecord>,
    inputs: Vec<ExternalInput>,
    outputs: Vec<OutputRecord>,
    figures: Vec<FigureRecord>,
    checks: Vec<CheckRecord>,
    verification: Option<VerificationRecord>,
}

fn read_parts(root: &RawTable, source: &Source, mut diagnostics: Vec<Diagnostic>) -> Parts {
    let before = diagnostics.len();
    let units = settings::read_units(root, source, &mut diagnostics);
    let are_wrong = diagnostics[before..].iter().any(Diagnostic::is_error);
    let parameters = match root.get("parameters").map(|raw| (raw, raw.as_table())) {
        None => Parameters::default(),
        Some((_, Some(table))) => parameters::read(table, &units, source, &mut diagnostics),
        Some((raw, None)) => {
            diagnostics.push(
                Diagnostic::error(codes::WRONG_TYPE, "`parameters` must be a table `[parameters]`")
                    .at(raw.span.clone(), format!("this is {}", raw.kind.describe())),
            );
            Parameters::default()
        }
    };
    let scope = Scope { source, units: &units, parameters: &parameters };
    let mut reader = Reader { scope, diagnostics };
    let whole = Record { table: root, what: String::new() };
    reader.check_keys(&whole, KEYS);
    let title = reader.text(&whole, "title");
    let plugins = settings::read_plugins(root, &mut reader);
    let simulation = settings::read_simulation(root, &mut reader);
    let mut names = NamesTaken::default();
    let bodies = bodies::read(root, &mut names, &mut reader);
    let elements = elements::read(root, &mut names, &mut reader);
    // Elements take both by their names.
    let mut signals = NamesTaken::default();
    let inputs = inputs::read(root, &mut signals, &mut reader);
    let outputs = outputs::read_outputs(root, &mut signals, &mut reader);
    let figures = outputs::read_figures(root, &mut reader);
    let checks = verification::read_checks(root, &outputs, &mut reader);
    let verification = verification::read_verification(root, &mut reader);
    let mut diagnostics = reader.diagnostics;
    // Numbers are not those of another unit where the unit that they are in is not known.
    diagnostics.retain(|diagnostic| !(are_wrong && diagnostic.code == codes::OTHER_UNIT));
    // In the order of the text; what points nowhere comes first.
    diagnostics.sort_by_key(|diagnostic| diagnostic.span().map(|span| span.start));
    Parts {
        diagnostics,
        title: title.map(|text| text.value).unwrap_or_default(),
        units,
        parameters,
        plugins,
        simulation,
        bodies,
        elements,
        inputs,
        outputs,
        figures,
        checks,
        verification,
    }
}

impl Scene {
    /// The value of a raw value in SI, as a quantity of dimension `expected`: a plain number is taken in scene
    /// units, a text as an expression.
    ///
    /// # Errors
    /// The value is neither, has another dimension, or its expression is wrong.
    pub fn quantity(&self, raw: &RawValue, expected: Dimension) -> Result<f64, Diagnostic> {
        let scope = Scope { source: &self.source, units: &self.units, parameters: &self.parameters };
        scope
            .quantity(raw, expected)
            .map_err(|diagnostic| diagnostic.expect("the parameters of a scene that was accepted have values"))
    }
    /// The value of a raw value in SI with the dimension it has; a plain number is dimensionless.
    ///
    /// # Errors
    /// The value is neither a number nor a text, or its expression is wrong.
    pub fn any_quantity(&self, raw: &RawValue) -> Result<(f64, Dimension), Box<Diagnostic>> {
        let scope = Scope { source: &self.source, units: &self.units, parameters: &self.parameters };
        let found = scope
            .any_quantity(raw)
            .map_err(|diagnostic| diagnostic.expect("the parameters of a scene that was accepted have values"))?;
        Ok((found.si, found.dimension))
    }
    /// A function of one variable as `element_api::Function` reads it, in SI: a float, pairs, a table with `points` (and
    /// `interpolation` where the scene names one), or `{ postfix = [...] }`. `argument` and `value` are the dimensions of the variable and of the values.
    ///
    /// An expression in which nothing has a dimension is in scene units throughout, with radians in trigonometric
    /// functions; in any other one the variable is a quantity.
    ///
    /// # Errors
    /// The value is none of these, an expression is wrong, or arguments don't increase.
    pub fn function(
        &self,
        raw: &RawValue,
        variable: &str,
        argument: Dimension,
        value: Dimension,
    ) -> Result<toml::Value, Box<Diagnostic>> {
        let scope = Scope { source: &self.source, units: &self.units, parameters: &self.parameters };
        function::read(raw, function::Wanted { variable, argument, value }, &scope).map_err(|diagnostic| {
            Box::new(diagnostic.expect("the parameters of a scene that was accepted have values"))
        })
    }

    /// A function of two variables as `element_api::Surface` reads it, in SI: a table with `x`, `y`, `z`, and `interpolation` where the
    /// scene names one. `dimensions` are those of x, y and z, where they are not any; `name` is that of the parameter, for messages.
    ///
    /// # Errors
    /// The value is no such table, arguments don't increase, or lengths don't fit.
    pub fn surface(
        &self,
        raw: &RawValue,
        name: &str,
        dimensions: [Option<Dimension>; 3],
    ) -> Result<toml::Value, Box<Diagnostic>> {
        let scope = Scope { source: &self.source, units: &self.units, parameters: &self.parameters };
        grid::read(raw, name, dimensions, &scope).map_err(|diagnostic| {
            Box::new(diagnostic.expect("the parameters of a scene that was accepted have values"))
        })
    }

    /// Points with their interpolation as `element_api::Curve` reads them, in SI: a table with `points`, and `interpolation`
    /// where the scene names one. `None` if the value is no table.
    ///
    /// # Errors
    /// There are no points, arguments don't increase, or a key or word is unknown.
    pub fn curve(
        &self,
        raw: &RawValue,
        argument: Dimension,
        value: Dimension,
    ) -> Option<Result<toml::Value, Box<Diagnostic>>> {
        let scope = Scope { source: &self.source, units: &self.units, parameters: &self.parameters };
        let wanted = function::Wanted { variable: "x", argument, value };
        let curve = function::read_curve(raw, raw.as_table()?, wanted, &scope);
        Some(curve.map_err(|diagnostic| {
            Box::new(diagnostic.expect("the parameters of a scene that was accepted have values"))
        }))
    }
}
