//! `odyn plugin new` and `odyn plugin check`

use std::path::Path;

use element_api::descriptor::{Descriptor, Kind};
use element_api::manifest::{ABI, INTERFACE};
use serde::Serialize;

use odyn::catalog::{Catalog, ElementHandle, LibraryInfo, SearchPath};
use odyn::diagnostics::{Diagnostic, codes, counted};
use odyn::workshop::{
    BadValues, CheckVerdict, Contract, Cost, Created, Exemption, Given, NewPlugin, Origin, Outcome, Template, Value,
    Verdict, WorkshopError, add, cost, create, examine,
};

use super::elements::parameter;
use super::exit;
use super::failure::{self, Failure};
use super::terminal;
use super::workshop_args::{CheckPluginArgs, NewPluginArgs};

/// Makes a crate, and says what to do next.
pub(super) fn new(args: &NewPluginArgs) -> Result<u8, Failure> {
    let contract = match &args.api {
        Some(text) => Contract::of_text(text),
        None => {
            Contract::found_from(&[std::env::current_exe(), std::env::current_dir()].map(Result::unwrap_or_default))
        }
    };
    let template = Template::of_word(&args.kind).unwrap_or(Template::Joint);
    if let Some(into) = &args.into {
        let made = add(&args.name.to_string_lossy(), template, into)?;
        terminal::print(&report(&made, template))?;
        return Ok(exit::DONE);
    }
    let made = create(&NewPlugin { folder: args.name.clone(), template, contract: contract.clone() })?;
    if let (Contract::Version(version), None, true) = (&contract, &args.api, template != Template::C) {
        eprintln!(
            "note: `element-api` {version} is to come from the package registry; if it is not there, name its folder with --api"
        );
    }
    for told in made.collisions(&SearchPath::standard(&[], &[]).manifests()) {
        eprintln!("note: {told}");
    }
    terminal::print(&report(&made, template))?;
    Ok(exit::DONE)
}

/// What was written, and the next commands.
fn report(made: &Created, template: Template) -> String {
    let folder = made.folder.display();
    let mut text = format!("{folder}: a library of elements, `{}`\n", made.package);
    let width = made.files.iter().map(|(file, _)| file.as_os_str().len()).max().unwrap_or(0);
    for (file, lines) in &made.files {
        text.push_str(&format!("  {:width$}  {lines:>3} lines\n", file.display().to_string()));
    }
    let (build, place) = template.next();
    text.push_str(&format!(
        "\nnext:\n  cd {folder}\n  {build}\n  odyn run scene.toml\n  odyn plugin check {place}{}\n",
        made.library
    ));
    text
}

/// Examines the elements of a library.
pub(super) fn check(args: &CheckPluginArgs) -> Result<u8, Failure> {
    let watchdog = failure::watchdog(args.watchdog, args.json);
    let new_catalog = || Catalog::new().watched_by(watchdog.clone());
    let mut catalog = new_catalog();
    let library = catalog.add(&args.library, &SearchPath::standard(&[], &[]))?;
    let elements = chosen(&catalog, &args.elements)?;
    let descriptors: Vec<&Descriptor> = elements.iter().map(ElementHandle::descriptor).collect();
    let given = Given::read(&texts(&args.params)?)?;
    given.check(&descriptors).map_err(|mistake| usage(*mistake))?;
    let exempt: Result<Vec<Exemption>, _> =
        args.exempt.iter().map(|text| Exemption::read(text, &descriptors)).collect();
    let exempt = exempt.map_err(|mistake| usage(*mistake))?;
    let verdicts: Result<Vec<Verdict>, BadValues> =
        elements.iter().map(|element| examine(element, &given, &exempt)).collect();
    let verdicts = verdicts?;
    let beside = beside(&args.beside, new_catalog());
    let failed = verdicts.iter().filter(|verdict| !verdict.passed()).count();
    let text = if args.json {
        json(&library, &elements, &verdicts, &args.beside, beside.as_ref())
    } else {
        let mut text = head(&library);
        for warning in catalog.warnings() {
            text.push_str(&format!("  {}: {}\n", warning.severity.word(), warning.message));
        }
        for (element, verdict) in elements.iter().zip(&verdicts) {
            text.push('\n');
            text.push_str(&table(element.descriptor(), verdict));
        }
        if let Some(cost) = &beside {
            text.push_str(&format!("\ncost of `{}`, to compare: {}\n", args.beside, cost_text(cost)));
        }
        text.push_str(&format!("\n{} examined, {failed} FAILED\n", counted(verdicts.len(), "element")));
        text
    };
    terminal::print(&text)?;
    Ok(if failed > 0 { exit::AUDIT } else { exit::DONE })
}

/// The elements of these names; all without names.
fn chosen(catalog: &Catalog, names: &[String]) -> Result<Vec<ElementHandle>, Failure> {
    if names.is_empty() {
        return Ok(catalog.elements().collect());
    }
    names.iter().map(|name| catalog.find(name, None).map_err(Failure::from)).collect()
}

/// Parameters as texts: files are read.
fn texts(params: &[String]) -> Result<Vec<String>, Failure> {
    let read = |text: &String| {
        if text.contains('=') && !Path::new(text).is_file() {
            return Ok(text.clone());
        }
        std::fs::read_to_string(text).map_err(|error| {
            let message = format!("cannot read `{text}`: {error}");
            Failure::new(Diagnostic::error(codes::UNREADABLE, message).help("or write KEY=VALUE"))
        })
    };
    params.iter().map(read).collect()
}

/// What an evaluation of another element costs; `None` where its library is not found.
fn beside(name: &str, mut catalog: Catalog) -> Option<Cost> {
    let (package, _) = name.split_once('/')?;
    catalog.add(package, &SearchPath::standard(&[], &[])).ok()?;
    cost(&catalog.find(name, None).ok()?)
}

/// The library as it presents itself.
fn head(library: &LibraryInfo) -> String {
    let features = if library.features.is_empty() { "none".into() } else { library.features.join(" ") };
    let glass =
        "  behind glass: each call crosses to another process, some 50 us; --in-process measures calls in this one\n";
    format!(
        "{} {}: {}\n  {}\n  interface {} (this program {ABI}), contract {} (this program {INTERFACE}), conventions {}\n  \
         {} build, processor features: {features}\n{}",
        library.package,
        library.version,
        library.about,
        library.origin(),
        library.abi,
        library.interface,
        library.conventions,
        library.profile.word(),
        if library.glass { glass } else { "" },
    )
}

/// One element: its schema in short, the verdicts, its cost.
fn table(descriptor: &Descriptor, verdict: &Verdict) -> String {
    let called = if verdict.opaque { ", called at run time" } else { "" };
    let mut text = format!("{} ({}{called}): {}\n", verdict.element, verdict.kind, descriptor.summary);
    let list = |names: Vec<&str>| names.join(", ");
    let channels = match descriptor.kind {
        Kind::Joint => "coordinates",
        Kind::Force => "channels",
        Kind::Control => "outputs",
    };
    for (what, names) in [
        ("frames", list(descriptor.frames.iter().map(|named| named.name.as_str()).collect())),
        ("further frames", list(descriptor.more_frames.iter().map(|named| named.name.as_str()).collect())),
        ("rows", list(descriptor.rows.iter().map(String::as_str).collect())),
        ("inputs", list(descriptor.inputs.iter().map(|named| named.name.as_str()).collect())),
        (channels, list(descriptor.channels.iter().map(|named| named.name.as_str()).collect())),
        ("channels", list(descriptor.values.iter().map(|named| named.name.as_str()).collect())),
        ("states", list(descriptor.states.iter().map(|named| named.name.as_str()).collect())),
    ] {
        if !names.is_empty() {
            text.push_str(&format!("  {what}: {names}\n"));
        }
    }
    for spec in &descriptor.params {
        let (name, remark) = parameter(spec);
        let value = verdict.parameters.iter().find(|value| value.name == name).map_or("left out".into(), taken);
        text.push_str(&format!("  parameter {name}: {remark}\n    examined with {value}\n"));
    }
    let width = verdict.checks.iter().map(|check| check.check.len()).max().unwrap_or(0);
    for CheckVerdict { check, meaning, outcome, findings } in &verdict.checks {
        let word = match outcome {
            Outcome::Ok => "ok",
            Outcome::Failed => "FAILED",
            Outcome::Exempt => "exempt",
        };
        text.push_str(&format!("  {check:width$}  {word:<6}  {meaning}\n"));
        for finding in findings {
            text.push_str(&format!("  {:width$}          - {finding}\n", ""));
        }
    }
    if let Some(cost) = &verdict.cost {
        text.push_str(&format!("  cost of an evaluation: {}\n", cost_text(cost)));
    }
    text
}

/// `1 m (not given: taken from its range)`
fn taken(value: &Value) -> String {
    let unit = if value.unit.is_empty() { String::new() } else { format!(" {}", value.unit) };
    let origin = match value.origin {
        Origin::Given => "given",
        Origin::Default => "its default",
        Origin::Example => "its example",
        Origin::Taken => "not given; taken from its range",
    };
    format!("{}{unit} ({origin})", value.value)
}

fn cost_text(cost: &Cost) -> String {
    let traced = cost.traced.as_ref().map_or_else(
        || "opaque".to_string(),
        |traced| {
            let how = if traced.machine_code { "machine code" } else { "interpreted" };
            format!("traced {} in {:.1} ns ({how})", counted(traced.operations, "operation"), traced.ns)
        },
    );
    format!("{traced}; called {:.0} ns, with derivatives {:.0} ns", cost.called_ns, cost.called_derivatives_ns)
}

/// The same for programs.
fn json(
    library: &LibraryInfo,
    elements: &[ElementHandle],
    verdicts: &[Verdict],
    other: &str,
    beside: Option<&Cost>,
) -> String {
    #[derive(Serialize)]
    struct Examined<'a> {
        package: &'a str,
        version: &'a str,
        path: String,
        sha256: Option<&'a str>,
        abi: u32,
        interface: &'a str,
        conventions: u32,
        profile: &'static str,
        features: &'a [String],
        passed: bool,
        elements: Vec<Element<'a>>,
        beside: Option<Beside<'a>>,
    }
    #[derive(Serialize)]
    struct Element<'a> {
        passed: bool,
        #[serde(flatten)]
        verdict: &'a Verdict,
        schema: &'a [element_api::params::ParamSpec],
    }
    #[derive(Serialize)]
    struct Beside<'a> {
        element: &'a str,
        cost: &'a Cost,
    }
    let elements: Vec<Element<'_>> = elements
        .iter()
        .zip(verdicts)
        .map(|(element, verdict)| Element { passed: verdict.passed(), verdict, schema: &element.descriptor().params })
        .collect();
    terminal::json(&Examined {
        package: &library.package,
        version: &library.version,
        path: library.origin(),
        sha256: library.sha256.as_deref(),
        abi: library.abi,
        interface: &library.interface,
        conventions: library.conventions,
        profile: library.profile.word(),
        features: &library.features,
        passed: verdicts.iter().all(Verdict::passed),
        elements,
        beside: beside.map(|cost| Beside { element: other, cost }),
    })
}

/// A mistake on the command line.
fn usage(diagnostic: Diagnostic) -> Failure {
    Failure::new(diagnostic).exit(exit::USAGE)
}

impl From<BadValues> for Failure {
    fn from(bad: BadValues) -> Self {
        Self::of_source(exit::USAGE, bad.diagnostics, &bad.source)
    }
}

impl From<WorkshopError> for Failure {
    fn from(error: WorkshopError) -> Self {
        let failure = Self::new(error.diagnostic());
        match error {
            WorkshopError::Name { .. } | WorkshopError::NoContract { .. } => failure.exit(exit::USAGE),
            _ => failure,
        }
    }
}
