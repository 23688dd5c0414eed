//! `odyn export`

use std::fmt::Write as _;
use std::path::Path;

use odyn::analyses::statics;
use odyn::diagnostics::{Diagnostic, Source, codes, render, shown};
use odyn::export::c::{Cost, EXAMPLE, Package, Real, package};
use odyn::export::fmu::{Binary, Fmu, Kinds, TARGETS, Version, build};
use odyn::export::{Choices, METHODS, Machine, Method, Trial};
use odyn::results::{MOTION_FILE, Motion, ResultsError, glb, replace};
use odyn::scene::{Override, parse_unit};
use odyn::session::{RunOptions, Session, SessionError};
use serde::Serialize;

use super::analyses::{warn, write};
use super::exit;
use super::export_args::{CArgs, FmuArgs, GlbArgs, MachineArgs};
use super::failure::Failure;
use super::terminal::{self, Stream};

/// Writes the motion of a run as glTF.
pub(super) fn export_glb(args: &GlbArgs) -> Result<u8, Failure> {
    let path = args.folder.join(MOTION_FILE);
    let motion = Motion::read(&path)?;
    // A unit that is not known, of a file that somebody else wrote, is taken for a second.
    let unit = parse_unit(&motion.header.time_unit).map_or(1.0, |(_, factor)| factor);
    let bytes = glb(&motion, unit / args.speed).map_err(|reason| {
        Failure::new(Diagnostic::error(codes::CANNOT_WRITE, reason).help("run with fewer output times"))
            .exit(exit::FILES)
    })?;
    let file = args.output.clone().unwrap_or_else(|| args.folder.join("motion.glb"));
    replace(&file, &bytes, false)?;
    terminal::print(&told(&motion, &file))?;
    Ok(exit::DONE)
}

/// What was written.
fn told(motion: &Motion, file: &Path) -> String {
    let (bodies, samples) = (motion.header.moving(), motion.times.len());
    let bodies = if bodies == 1 { "1 body".to_owned() } else { format!("{bodies} bodies") };
    format!("{}: {bodies} in motion, {samples} samples\n", shown(&file.display().to_string()))
}

/// Writes a scene as C.
pub(super) fn export_c(args: &CArgs) -> Result<u8, Failure> {
    let real = if args.float { Real::Float } else { Real::Double };
    let machine = machine(&args.machine, None, (args.derivatives, false))?;
    let Package { files, cost } = package(&machine, real).map_err(Failure::new)?;
    let trial = tried(&machine, &cost);
    let changed = |(name, text): &&(String, String)| {
        name == EXAMPLE && std::fs::read(args.output.join(name)).is_ok_and(|there| there != text.as_bytes())
    };
    if let Some((name, _)) = files.iter().find(changed).filter(|_| !args.force) {
        let file = args.output.join(name).display().to_string();
        let message = format!("{} is there already, and not as it would be written", shown(&file));
        let help = "it may have changes of yours: write elsewhere, or over it with --force";
        return Err(Failure::new(Diagnostic::error(codes::CANNOT_WRITE, message).help(help)).exit(exit::FILES));
    }
    for (name, text) in &files {
        write(&args.output, name, text.as_bytes())?;
    }
    if args.machine.json {
        let names: Vec<&str> = files.iter().map(|(name, _)| name.as_str()).collect();
        terminal::print_as_it_is(&terminal::json(&CWritten { files: names, cost: Costs::of(&machine, &cost, trial) }))?;
    } else {
        terminal::print(&format!(
            "{}: {}\n{}",
            shown(&args.output.display().to_string()),
            listed(&files),
            words(&machine, &cost, trial.as_ref())
        ))?;
    }
    Ok(exit::DONE)
}

/// Writes a scene as an FMU.
pub(super) fn export_fmu(args: &FmuArgs) -> Result<u8, Failure> {
    let machine = machine(&args.machine, args.inputs.as_deref(), (false, true))?;
    let version = if args.fmi == "2" { Version::Two } else { Version::Three };
    let any = args.cs || args.me;
    let kinds = Kinds { co_simulation: args.cs || !any, model_exchange: args.me || !any };
    let fmu = Fmu::new(&machine, version, kinds).map_err(Failure::new)?;
    let trial = if kinds.co_simulation { tried(&machine, &fmu.cost) } else { None };
    let (binaries, missing) = binaries(&fmu)?;
    let archive = fmu.archive(&binaries).map_err(|error| ResultsError::write(&args.output, error))?;
    replace(&args.output, &archive, false)?;
    if args.machine.json {
        let platforms = binaries.iter().map(|binary| binary.target.folder_2).collect();
        let file = args.output.display().to_string();
        let written = FmuWritten { file, platforms, missing, cost: Costs::of(&machine, &fmu.cost, trial) };
        terminal::print_as_it_is(&terminal::json(&written))?;
        return Ok(exit::DONE);
    }
    let platforms: Vec<&str> = binaries.iter().map(|binary| binary.target.folder_2).collect();
    let mut text = format!("{}: FMI {}.0, sources", shown(&args.output.display().to_string()), args.fmi);
    for platform in platforms {
        let _ = write!(text, ", {platform}");
    }
    text.push('\n');
    for (platform, compiler) in missing {
        let _ = writeln!(text, "without {platform}: there is no compiler `{compiler}`");
    }
    terminal::print(&(text + &words(&machine, &fmu.cost, trial.as_ref())))?;
    Ok(exit::DONE)
}

/// A platform without its compiler.
type Missing = (&'static str, &'static str);

/// Binaries for all platforms whose compilers are there, and the other ones.
fn binaries(fmu: &Fmu) -> Result<(Vec<Binary>, Vec<Missing>), Failure> {
    let folder = std::env::temp_dir().join(format!("odyn-fmu-{}", std::process::id()));
    std::fs::create_dir_all(&folder).map_err(|error| ResultsError::write(&folder, error))?;
    let (mut found, mut missing) = (Vec::new(), Vec::new());
    let mut failed = None;
    for target in TARGETS {
        match build(fmu, target, &folder) {
            Ok(Some(binary)) => found.push(binary),
            Ok(None) => missing.push((target.folder_2, target.compilers[0])),
            Err(reason) => failed = Some(reason),
        }
    }
    let _ = std::fs::remove_dir_all(&folder);
    match failed {
        None => Ok((found, missing)),
        Some(reason) => {
            let diagnostic =
                Diagnostic::error(codes::CANNOT_WRITE, format!("the compiler fails: {}", reason.trim_end()));
            Err(Failure::new(diagnostic.help("`odyn export c` writes the same program, to be built by hand"))
                .exit(exit::FILES))
        }
    }
}

#[derive(Serialize)]
struct FmuWritten<'a> {
    file: String,
    platforms: Vec<&'static str>,
    missing: Vec<Missing>,
    #[serde(flatten)]
    cost: Costs<'a>,
}

/// A scene as it is exported, after its warnings.
fn machine(
    args: &MachineArgs,
    inputs: Option<&[String]>,
    (derivatives, all_parameters): (bool, bool),
) -> Result<Machine, Failure> {
    let step = args.step.iter().map(|step| format!("simulation.fixed_step={step}"));
    let options = RunOptions {
        overrides: args.sets.iter().cloned().chain(step).map(Override::new).collect(),
        plugins: args.plugins.clone(),
        ..equilibrium()
    };
    let session = Session::open(&args.scene, &options)?;
    warn(&session, false);
    let name = args.scene.file_stem().unwrap_or(args.scene.as_os_str()).to_string_lossy().into_owned();
    let method = args.method.as_deref().unwrap_or(if args.tolerance.is_some() { "dopri5" } else { "rk4" });
    let method = Method::named(method).unwrap_or(&METHODS[0]);
    let (inputs, outputs) = (inputs.map(<[String]>::to_vec), args.outputs.clone());
    let choices = Choices { step: None, method, tolerance: args.tolerance, inputs, outputs, derivatives };
    let source = session.scene.source.clone();
    let machine = Machine::new(session, &name, choices.clone())?;
    let names: Option<&[String]> = match args.parameters.as_deref() {
        None if !all_parameters => return Ok(machine),
        Some([word]) if word == "none" => return Ok(machine),
        None => None,
        Some([word]) if word == "all" => None,
        Some(names) => Some(names),
    };
    let mut reopen = |changes: &[Override]| {
        let overrides = [&options.overrides[..], changes].concat();
        Session::open(&args.scene, &RunOptions { overrides, plugins: args.plugins.clone(), ..equilibrium() })
    };
    let machine = machine.with_parameters(&mut reopen, &choices, names)?;
    match machine.parameters.fixed.first() {
        Some((name, reason)) if names.is_some() => {
            let message = format!("the parameter `{name}` cannot be set in what is exported: {reason}");
            let help = "change it by --set before the export, or leave it out of --parameters";
            Err(SessionError::one(&source, Diagnostic::error(codes::FIXED_PARAMETER, message).help(help)).into())
        }
        _ => Ok(machine),
    }
}

/// Scenes may start at an equilibrium.
fn equilibrium() -> RunOptions {
    RunOptions { equilibrium: Some(statics::start), ..RunOptions::default() }
}

fn listed(files: &[(String, String)]) -> String {
    files.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>().join(", ")
}

/// Operations that may be spent on a trial.
const TRIAL: usize = 1_000_000_000;

/// What steps of a fixed size are good for; a warning where they are too long.
pub(super) fn tried(machine: &Machine, cost: &Cost) -> Option<Trial> {
    if machine.tolerance.is_some() {
        return None;
    }
    let trial = machine.tried((TRIAL / (3 * cost.step.max(1))).clamp(10, 20_000));
    if !trial.is_good() {
        let (h, method) = (machine.step, machine.method.name);
        let message = match trial.failed {
            Some((time, _)) => format!("a step of {h:?} s by {method} fails at {time:?} s"),
            None => format!(
                "steps of {h:?} s by {method} are too long: they differ from ones of half the size by {:.1e} of the sizes of what moves",
                trial.off
            ),
        };
        let help = "choose a shorter --step (or more --substeps), --method rodas for stiff scenes, or --tolerance";
        let warning = Diagnostic::warning(codes::STEPS_TOO_LONG, message).help(help);
        eprint!("{}", render(&[warning], &Source::new("", ""), terminal::color(Stream::Error)));
    }
    Some(trial)
}

/// What a step costs, in words.
fn words(machine: &Machine, cost: &Cost, trial: Option<&Trial>) -> String {
    let (step, method, order) = (machine.step, machine.method.name, machine.method.order);
    let mut text = match machine.tolerance {
        None => format!("step: {step} s by {method} (order {order}), {} operations\n", cost.step),
        Some(tolerance) => format!(
            "steps: of variable size by {method} (order {order}), tolerance {tolerance:?}, {step} s at the longest; {} operations for each \
             that is tried, their number has no bound\n",
            cost.step
        ),
    };
    if cost.most > cost.step {
        let switches = machine.switches.as_ref().map(|_| format!("{} switches are located", machine.located));
        let clocks = &machine.sampled.clocks;
        let samples = (!clocks.is_empty()).then(|| format!("{} elements sample", clocks.len()));
        let what: Vec<String> = switches.into_iter().chain(samples).collect();
        let _ = writeln!(text, "    at most {} where {} in it", cost.most, what.join(" and "));
    }
    if let Some(trial) = trial.filter(|trial| trial.failed.is_none()) {
        let (off, steps) = (trial.off, trial.steps);
        let _ = writeln!(
            text,
            "    {off:.1e} of the sizes of what moves from ones of half the size, tried over {steps} of them"
        );
    }
    let settable = machine.parameters.settable.iter().map(|one| format!("{} ({})", one.port.name, one.span()));
    let settable: Vec<String> = settable.collect();
    if !settable.is_empty() {
        let _ = writeln!(text, "parameters: {}", settable.join(", "));
    }
    for (name, reason) in &machine.parameters.fixed {
        let _ = writeln!(text, "fixed: {name}: {reason}");
    }
    let programs: Vec<String> = cost.programs.iter().map(|(name, count)| format!("{name} {count}")).collect();
    let _ = writeln!(text, "programs: {} operations", programs.join(", "));
    let _ = writeln!(text, "outputs: {} operations", cost.outputs);
    let _ = writeln!(text, "memory: {} bytes; stack: {} bytes at most, in optimised code", cost.memory, cost.stack);
    if !cost.library.is_empty() {
        let names = cost.library.join(", ");
        let _ = writeln!(text, "library: {names} of math.h, whose last digits are those of the library in use");
    }
    text
}

#[derive(Serialize)]
struct CWritten<'a> {
    files: Vec<&'a str>,
    #[serde(flatten)]
    cost: Costs<'a>,
}

/// What a step costs, for programs.
#[derive(Serialize)]
struct Costs<'a> {
    method: &'a str,
    step_s: f64,
    /// Difference from steps of half the size, as a share of the sizes of what moves; none: a step failed, or was not tried.
    tried_off: Option<f64>,
    tolerance: Option<f64>,
    operations_per_step: usize,
    most_operations_per_step: usize,
    operations_per_output: usize,
    memory_bytes: usize,
    stack_bytes: usize,
    library: &'a [&'static str],
    parameters: Vec<&'a str>,
    /// The least and the largest value of each, in its unit.
    parameter_ranges: Vec<[f64; 2]>,
    fixed_parameters: &'a [(String, String)],
}

impl<'a> Costs<'a> {
    fn of(machine: &'a Machine, cost: &'a Cost, trial: Option<Trial>) -> Self {
        Self {
            method: machine.method.name,
            step_s: machine.step,
            tried_off: trial.filter(|trial| trial.failed.is_none()).map(|trial| trial.off),
            tolerance: machine.tolerance,
            operations_per_step: cost.step,
            most_operations_per_step: cost.most,
            operations_per_output: cost.outputs,
            memory_bytes: cost.memory,
            stack_bytes: cost.stack,
            library: &cost.library,
            parameters: machine.parameters.settable.iter().map(|one| one.port.name.as_str()).collect(),
            parameter_ranges: machine.parameters.settable.iter().map(|one| one.range).collect(),
            fixed_parameters: &machine.parameters.fixed,
        }
    }
}
