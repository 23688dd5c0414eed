//! `odyn hil`: a scene in real time, its inputs and outputs exchanged with a controller.
//!
//! The steps are those of `odyn export c`, by the interpreter: the same number of operations in each, no step control. At every
//! tick of the clock the newest inputs are taken (held where none came), the motion is computed up to the next tick, and the
//! outputs at that time are sent at once. A step that ends after its tick is an overrun: it is counted, the steps that follow are
//! made without waiting until the clock is met again, and none is left out.
//!
//! | file | content |
//! |---|---|
//! | `packet.rs` | what is exchanged |
//! | `link.rs`, `shared.rs` | by UDP; by shared memory |
//! | `clock.rs` | the clock of the system, its priorities, locked memory |
//! | `statistics.rs` | histograms of times |
//! | `report.rs` | what was measured |

mod clock;
mod link;
mod packet;
mod report;
mod shared;
mod statistics;

#[cfg(test)]
#[allow(clippy::unwrap_used)] // in a test, the panic is the message
mod tests;

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};

use odyn::analyses::statics;
use odyn::diagnostics::{Diagnostic, codes};
use odyn::export::c::{Real, package};
use odyn::export::{Choices, Failed, METHODS, Machine, Method, Twin};
use odyn::scene::{Dimension, Override, number_and_unit, parse_unit};
use odyn::session::{RunOptions, Session};

use self::clock::Clock;
use self::link::Link;
use self::packet::{Description, INPUTS, OUTPUTS, Packet};
use self::report::Report;
use super::analyses::{warn, write};
use super::exit;
use super::export::tried;
use super::failure::Failure;
use super::hil_args::HilArgs;
use super::{interrupt, terminal};

/// Runs a scene in real time.
pub(super) fn hil(args: &HilArgs) -> Result<u8, Failure> {
    let period = 1.0 / quantity(&args.rate, "--rate", Dimension::FREQUENCY)?;
    if !(1e-6..=1e3).contains(&period) {
        return Err(refused(format!("a period of {period} s cannot be kept"), "rates from 1 mHz to 1 MHz are taken"));
    }
    let step = period / f64::from(args.substeps);
    let machine = machine(args, step)?;
    let description = Description::of(&machine, period, args.substeps);
    if args.describe {
        terminal::print_as_it_is(&terminal::json(&description))?;
        return Ok(exit::DONE);
    }
    let cost = package(&machine, Real::Double).ok().map(|package| package.cost);
    if let Some(cost) = &cost {
        let _ = tried(&machine, cost);
    }
    let ticks = if args.endless {
        u64::MAX
    } else {
        let duration = match &args.duration {
            Some(text) => quantity(text, "--for", Dimension::TIME)?,
            None => machine.t_end - machine.t_start,
        };
        ((duration / period).round() as u64).max(1)
    };
    let mut link = Link::open(args.udp.as_deref(), args.shm.as_deref(), &description)
        .map_err(|(message, help)| refused(message, help))?;
    let folder = args.output.clone().unwrap_or_else(|| default_folder(&args.scene));
    // Before time matters.
    write(&folder, "hil.json", b"{}\n")?;
    let stop = interrupt::stop_on_interrupt();
    eprintln!(
        "{}: {} inputs, {} outputs, signature {:08x}; a tick each {} us; Ctrl-C ends it",
        link.place(),
        description.inputs.len(),
        description.outputs.len(),
        description.signature,
        period * 1e6
    );
    let rights = clock::ask_for_rights(args.priority);
    let mut report = Report::new(&machine, &description, &link.place(), rights);
    report.operations_per_step = cost.map(|cost| cost.step);
    let failed = in_time(
        machine,
        &description,
        &mut link,
        &mut report,
        &Plan { period, substeps: args.substeps, ticks, waits: args.wait },
        &stop,
    );
    clock::give_back();
    let text = report.text();
    write(&folder, "hil.json", (terminal::json(&report) + "\n").as_bytes())?;
    write(&folder, "hil.txt", text.as_bytes())?;
    if args.json {
        terminal::print_as_it_is(&terminal::json(&report))?;
    } else {
        terminal::print(&text)?;
    }
    match failed {
        Some(reason) => {
            let message = format!("the step from t = {} s could not be computed: {}", report.reached_s, words(reason));
            let help = "use more --substeps or --method dopri5; `odyn run` with error control says whether the scene is at fault";
            Err(Failure::new(Diagnostic::error(codes::HIL_ENDED, message).help(help)))
        }
        None if report.interrupted => Ok(exit::INTERRUPTED),
        None => Ok(exit::DONE),
    }
}

/// When is what.
struct Plan {
    /// s
    period: f64,
    substeps: u32,
    ticks: u64,
    /// The clock starts with the first packet.
    waits: bool,
}

/// The loop in time; gives why a step failed, if one did.
fn in_time(
    machine: Machine,
    description: &Description,
    link: &mut Link,
    report: &mut Report,
    plan: &Plan,
    stop: &AtomicBool,
) -> Option<Failed> {
    let step = plan.period / f64::from(plan.substeps);
    let mut twin = Twin::new(machine);
    let numbers = description.input_numbers.clone();
    let mut packet = Packet::new(description.outputs.len().max(description.inputs.len()));
    let mut newest = 0_u64;
    // Everything is touched once before time matters, on a copy of the machine.
    let mut warm = Twin::new(twin.machine().clone());
    for _ in 0..plan.substeps {
        let _ = warm.step(step);
    }
    let _ = warm.outputs();
    drop(warm);
    if plan.waits {
        while !take(link, &mut packet, description, &mut twin, &numbers, &mut newest, report) {
            if stop.load(Ordering::Relaxed) {
                report.interrupted = true;
                return None;
            }
            clock::sleep(1e-3);
        }
    }
    send(link, &mut packet, description, &mut twin, 0, report);
    let clock = Clock::start(plan.period);
    for tick in 0..plan.ticks {
        if stop.load(Ordering::Relaxed) {
            report.interrupted = true;
            break;
        }
        let waited = clock.wait_for(tick);
        let begun = clock.now();
        if waited {
            report.late.add(begun - clock.at(tick));
        }
        if !take(link, &mut packet, description, &mut twin, &numbers, &mut newest, report) {
            report.inputs_held += 1;
        }
        for _ in 0..plan.substeps {
            if let Err(failed) = twin.step(step) {
                report.ended(clock.now());
                return Some(failed);
            }
        }
        report.steps += 1;
        send(link, &mut packet, description, &mut twin, tick + 1, report);
        let end = clock.now();
        report.compute.add(end - begun);
        let behind = end - clock.at(tick + 1);
        if behind > 0.0 {
            report.overruns += 1;
            report.worst_behind_us = report.worst_behind_us.max(behind * 1e6);
        }
        report.reached_s = twin.time();
    }
    report.ended(clock.now());
    None
}

/// Takes the newest inputs that have come; whether there were any. What is no packet for this scene is counted and left.
fn take(
    link: &mut Link,
    packet: &mut Packet,
    description: &Description,
    twin: &mut Twin,
    numbers: &[usize],
    newest: &mut u64,
    report: &mut Report,
) -> bool {
    let mut any = false;
    while link.receive(packet) {
        report.packets_received += 1;
        let fits = packet.is_for(INPUTS, description.signature, description.inputs.len());
        let sequence = packet.sequence();
        let values = packet.values(description.inputs.len());
        if !fits || values.iter().any(|value| !value.is_finite()) {
            report.packets_refused += 1;
            continue;
        }
        // Sequence numbers start anew where a controller does: with 0 or 1.
        if sequence <= *newest && sequence > 1 {
            report.packets_out_of_order += 1;
            continue;
        }
        *newest = sequence;
        for (number, value) in numbers.iter().zip(values) {
            twin.set_input(*number, *value);
        }
        any = true;
    }
    any
}

/// Sends the outputs of this time.
fn send(
    link: &mut Link,
    packet: &mut Packet,
    description: &Description,
    twin: &mut Twin,
    tick: u64,
    report: &mut Report,
) {
    let time = twin.time();
    packet.fill(OUTPUTS, description.signature, tick, time, twin.outputs());
    if link.send(packet) {
        report.packets_sent += 1;
    } else {
        report.packets_unsent += 1;
    }
}

/// A scene as it is exported, its steps of this size, s.
fn machine(args: &HilArgs, step: f64) -> Result<Machine, Failure> {
    let options = RunOptions {
        overrides: args.sets.iter().cloned().map(Override::new).collect(),
        plugins: args.plugins.clone(),
        equilibrium: Some(statics::start),
        ..RunOptions::default()
    };
    let session = Session::open(&args.scene, &options)?;
    warn(&session, args.describe);
    let name = args.scene.file_stem().unwrap_or(args.scene.as_os_str()).to_string_lossy().into_owned();
    let method = Method::named(&args.method).unwrap_or(&METHODS[0]);
    let (inputs, outputs) = (args.inputs.clone(), args.outputs.clone());
    let choices = Choices { step: Some(step), method, inputs, outputs, ..Choices::default() };
    Ok(Machine::new(session, &name, choices)?)
}

fn default_folder(scene: &std::path::Path) -> PathBuf {
    let name = scene.file_stem().unwrap_or(scene.as_os_str()).to_string_lossy().into_owned();
    PathBuf::from("results").join(name + "-hil")
}

/// A quantity of the command line, SI.
fn quantity(text: &str, option: &str, wanted: Dimension) -> Result<f64, Failure> {
    let wrong = |what: String| {
        let diagnostic = Diagnostic::error(codes::NO_HIL, format!("{option} {text}: {what}"));
        Failure::new(diagnostic.help("for example --rate 1kHz --for \"60 s\"")).exit(exit::USAGE)
    };
    let (number, unit) = number_and_unit(text).ok_or_else(|| wrong("no number with a unit".into()))?;
    let (dimension, factor) = parse_unit(unit).map_err(|error| wrong(error.message))?;
    let value = number * factor;
    if !(dimension.compatible(wanted) && value > 0.0 && value.is_finite()) {
        return Err(wrong(format!("expected {wanted} above zero")));
    }
    Ok(value)
}

fn refused(message: String, help: &str) -> Failure {
    Failure::new(Diagnostic::error(codes::NO_HIL, message).help(help))
}

/// Why a step failed, in words.
fn words(failed: Failed) -> &'static str {
    match failed {
        Failed::Singular => "rows of joints became dependent (a singular position)",
        Failed::NotFinite => "a rate is not a finite number",
        Failed::OffConstraints => "the corrections do not bring it back to the joints",
        Failed::Contradiction => "rows that are left out contradict the others",
        Failed::TurnsThinAxis => "something turns a body about an axis about which it has no moment of inertia",
        Failed::TurnsTooFar => "an angle that is counted over full turns may have turned by half a turn in one step",
        Failed::OutOfRange => "a parameter is outside of the range in which the equations are known",
        Failed::StepTooSmall => "the tolerance cannot be met by steps of a reasonable size",
    }
}
