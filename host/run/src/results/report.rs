//! [`report`]: the text at the end of a run.

use std::path::Path;

use crate::diagnostics::{Code, codes, shown, shown_on_one_line};

use super::text::{Side, aligned, count, duration, significant};
use super::{
    AuditLimits, CHANNELS_FILE, CheckResult, FigureResult, Measure, RESULTS_FILE, Released, SUMMARY_FILE, Status,
    Summary,
};

/// Warnings that come at the end of a run.
const END_CODES: [Code; 5] =
    [codes::ELEMENT_CHECK, codes::LEFT_GRID, codes::NOTHING_MOVED, codes::LEFT_OPEN, codes::OTHER_STEP];
/// Said of a failed check.
const FAILED: &str = "FAILED";
/// Said of an audit that found too much.
const ABOVE: &str = "above its limits";
/// Names of redundant rows printed before the rest is only counted.
const MOST_NAMES: usize = 6;

/// What a run says at its end: how it went, audit, figures beside published ones, checks, work, times, files. `folder` is where
/// the results are, if they were written; `color` adds terminal escapes.
#[must_use]
pub fn report(summary: &Summary, folder: Option<&Path>, color: bool) -> String {
    let mut out = outcome(summary);
    out.push_str(&start(summary));
    out.push_str(&releases(summary));
    out.push_str(&audit(summary));
    out.push_str(&figures(&summary.figures));
    out.push_str(&checks(&summary.checks));
    out.push_str(&elements(summary));
    if let Some(verified) = &summary.verified {
        out.push_str(&verified.report(&summary.time_unit));
    }
    if let Some(digits) = &summary.digits {
        out.push_str(&digits.report(&summary.time_unit));
    }
    out.push_str(&work(summary));
    if let Some(folder) = folder {
        let table = folder.join(RESULTS_FILE);
        out.push_str(&format!("results: {} (with {CHANNELS_FILE}, {SUMMARY_FILE})\n", table.display()));
    }
    // Painted last: in titles and notes of the scene, escapes are not to be obeyed.
    let out = shown(&out);
    if color { painted_report(&out, summary.status) } else { out.into_owned() }
}

/// The report with its verdicts in colours.
fn painted_report(text: &str, status: Status) -> String {
    let verdict = format!(": {}, t = ", status.words());
    let paint = if status == Status::Completed { Paint::Good } else { Paint::Bad };
    let mut out = String::with_capacity(text.len() + 64);
    for (k, line) in text.lines().enumerate() {
        // A title may have the same words; what the report says of itself comes last.
        let painted = match line.rfind(&verdict).filter(|_| k == 0) {
            Some(at) => {
                let (front, behind) = (&line[..at + 2], &line[at + 2 + status.words().len()..]);
                format!("{front}{}{behind}", painted(status.words(), paint))
            }
            None if line.starts_with("audit: ") => line.replace(ABOVE, &painted(ABOVE, Paint::Bad)),
            None => match line.strip_suffix(FAILED) {
                Some(front) => format!("{front}{}", painted(FAILED, Paint::Bad)),
                None => line.to_owned(),
            },
        };
        out.push_str(&painted);
        out.push('\n');
    }
    out
}

/// `Pendulum: completed, t = 2 s`
fn outcome(summary: &Summary) -> String {
    let name = shown_on_one_line(if summary.title.is_empty() { &summary.scene } else { &summary.title });
    let status = summary.status.words();
    let reached = with_unit(significant(summary.t_end_reached, 9), &summary.time_unit);
    let mut line = format!("{name}: {status}, t = {reached}");
    if !summary.status.reached_end() {
        line.push_str(&format!(" of {}", with_unit(significant(summary.t_end, 9), &summary.time_unit)));
    }
    if summary.status != Status::Completed {
        let code = summary.code.map_or_else(String::new, |code| format!("[{code}] "));
        if !summary.reason.is_empty() {
            line.push_str(&format!("\nreason: {code}{}", summary.reason));
        }
    }
    line.push('\n');
    line
}

/// `audit: constraints 2e-16, rates 3e-15, energy 4e-11; mobility 1; 2 redundant rows (...)`. The energy at the samples is reported
/// where it is beyond its limit and that of the steps is not.
fn audit(summary: &Summary) -> String {
    let audit = &summary.audit;
    let mut line = format!(
        "constraints {}, rates {}, energy {}; mobility {}",
        significant(audit.position_violation, 2),
        significant(audit.velocity_violation, 2),
        significant(audit.energy_error_relative, 2),
        summary.mobility
    );
    let beyond = summary.audit_limits.map(|limits| audit.beyond(&limits)).unwrap_or_default();
    if beyond.iter().any(|excess| excess.measure == Measure::SampleEnergy) {
        line.push_str(&format!("; energy at samples {}", significant(audit.sample_energy_error_relative, 2)));
    }
    if beyond.iter().any(|excess| excess.measure == Measure::Loads) {
        line.push_str(&format!("; loads of bodies {}", significant(audit.load_imbalance, 2)));
    }
    if summary.redundant_rows > 0 {
        line.push_str(&format!("; {}", count(summary.redundant_rows, "redundant row")));
        line.push_str(&listed(&summary.redundant_row_names));
    }
    if !summary.not_unique.is_empty() {
        line.push_str(&format!("; {} not unique", count(summary.not_unique.len() as u64, "output")));
        line.push_str(&listed(&summary.not_unique));
    }
    let verdict = match &summary.audit_limits {
        Some(limits) if !summary.audit_passed() => {
            format!("; {ABOVE} ({})", limits_in_words(limits))
        }
        // Those that belong to the tolerance are not worth a word while they are kept.
        Some(_) => String::new(),
        None => "; not judged".into(),
    };
    format!("audit: {line}{verdict}\n{}", energy(summary))
}

/// `start: chosen by least kinetic energy: lower: angular velocity z = -3.8 rad/s`; nothing where nothing was chosen.
fn start(summary: &Summary) -> String {
    let chosen: Vec<String> = summary.chosen_velocities.iter().map(ToString::to_string).collect();
    match chosen.is_empty() {
        true => String::new(),
        false => format!("start: velocities chosen by least kinetic energy: {}\n", first_of(&chosen)),
    }
}

/// `released: sling at t = 0.512 s (angle = 0.524 rad)`; nothing where no joint has let go.
fn releases(summary: &Summary) -> String {
    let one = |release: &Released| {
        let at = with_unit(significant(release.time, 9), &summary.time_unit);
        format!("{} at t = {at} ({})", release.joint, release.by)
    };
    let named: Vec<String> = summary.releases.iter().map(one).collect();
    match named.is_empty() {
        true => String::new(),
        false => format!("released: {}\n", first_of(&named)),
    }
}

/// `constraints 1e-8, energy 1e-6`
fn limits_in_words(limits: &AuditLimits) -> String {
    let limit = |limit| significant(limit, 2);
    let AuditLimits { constraints, energy, loads } = *limits;
    format!("constraints {}, energy {}, loads {}", limit(constraints), limit(energy), limit(loads))
}

/// `energy: kinetic 1.2 J, ...`; nothing where no work was done.
fn energy(summary: &Summary) -> String {
    let audit = &summary.audit;
    if audit.work == 0.0 && audit.dissipated == 0.0 {
        return String::new();
    }
    let parts = [
        ("kinetic", audit.kinetic_energy),
        ("potential", audit.potential_energy),
        ("dissipated", audit.dissipated),
        ("work in", audit.work_in),
    ];
    let mut parts = parts.map(|(name, energy)| format!("{name} {} J", significant(energy, 3))).to_vec();
    // Three digits are printed.
    for (part, energy) in parts[2..].iter_mut().zip([audit.dissipated, audit.work_in]) {
        if audit.dissipated_error > 5e-3 * energy.abs() {
            part.push_str(&format!(" (to {} J)", significant(audit.dissipated_error, 1)));
        }
    }
    if audit.impacts > 0 {
        let (count, lost) = (audit.impacts, significant(audit.lost_in_impacts, 3));
        let impacts = if count == 1 { "impact" } else { "impacts" };
        parts.insert(3, format!("lost in {count} {impacts} {lost} J"));
    }
    format!("energy at the end: {}\n", parts.join(", "))
}

/// ` (a, b, and 3 more)`; nothing without names.
fn listed(names: &[String]) -> String {
    if names.is_empty() { String::new() } else { format!(" ({})", first_of(names)) }
}

/// `a, b, and 3 more`
fn first_of(names: &[String]) -> String {
    let shown = names[..names.len().min(MOST_NAMES)].join(", ");
    match names.len().saturating_sub(MOST_NAMES) {
        0 => shown,
        more => format!("{shown}, and {more} more"),
    }
}

/// The figures under each other, then why some have no value.
fn figures(figures: &[FigureResult]) -> String {
    if figures.is_empty() {
        return String::new();
    }
    let mut rows = vec![["figure", "published", "here", "difference", ""].map(String::from).to_vec()];
    let mut problems = String::new();
    for figure in figures {
        let number = |value: Option<f64>| value.map_or_else(|| "-".into(), |value| significant(value, 6));
        let difference = figure.relative_difference().map(|share| format!("{:+.2} %", 100.0 * share));
        let mut remarks = figure.unit.clone();
        if !figure.note.is_empty() {
            let gap = if remarks.is_empty() { "" } else { "  " };
            remarks.push_str(&format!("{gap}({})", figure.note));
        }
        rows.push(vec![
            figure.name.clone(),
            number(figure.published),
            number(figure.value),
            difference.unwrap_or_default(),
            remarks,
        ]);
        if let Some(problem) = &figure.problem {
            problems.push_str(&format!("  {}: {problem}\n", figure.name));
        }
    }
    aligned(&[Side::Left, Side::Right, Side::Right, Side::Right, Side::Left], &rows) + &problems
}

/// The checks under each other, then why some could not be made.
fn checks(checks: &[CheckResult]) -> String {
    if checks.is_empty() {
        return String::new();
    }
    let mut rows = vec![["check", "largest error", "tolerance", "at t", "", ""].map(String::from).to_vec()];
    let mut problems = String::new();
    for check in checks {
        let verdict = if check.passed { "ok" } else { FAILED };
        let cells = [significant(check.largest, 3), significant(check.tolerance, 3), significant(check.at, 7)];
        let [largest, tolerance, at] = cells;
        rows.push(vec![check.name.clone(), largest, tolerance, at, check.unit.clone(), verdict.into()]);
        if let Some(problem) = &check.problem {
            problems.push_str(&format!("  {}: {problem}\n", check.name));
        }
        if let Some(part) = &check.part {
            problems.push_str(&format!("  warning: {}: {part}\n", check.name));
        }
    }
    aligned(&[Side::Left, Side::Right, Side::Right, Side::Right, Side::Left, Side::Left], &rows) + &problems
}

/// What elements have to say of how they were used; nothing where all is well.
fn elements(summary: &Summary) -> String {
    let mut lines = String::new();
    let said = |warning: &&String| END_CODES.iter().any(|code| warning.starts_with(code.code));
    let all: Vec<&String> = summary.warnings.iter().filter(said).collect();
    for warning in all.iter().take(MOST_NAMES) {
        lines.push_str(&format!("warning: {}\n", shown_on_one_line(warning)));
    }
    match all.len().saturating_sub(MOST_NAMES) {
        0 => lines,
        more => lines + &format!("  and {more} more of them (`warnings` in {SUMMARY_FILE})\n"),
    }
}

/// Counters and times.
fn work(summary: &Summary) -> String {
    let mut parts = vec![
        count(summary.steps, "step"),
        format!("{} rejected", summary.rejected),
        count(summary.evaluations, "evaluation"),
        count(summary.factorisations, "factorisation"),
        count(summary.projections, "projection"),
    ];
    if summary.jacobians > 0 {
        parts.push(count(summary.jacobians, "Jacobian"));
        parts.push(count(summary.newton_iterations, "Newton iteration"));
    }
    if summary.enclosures > 0 {
        parts.push(count(summary.enclosures, "enclosure"));
    }
    if let Some(time) = summary.stiff_from {
        parts.push(format!("stiff from {}", with_unit(significant(time, 4), &summary.time_unit)));
    }
    if summary.resumed > 0 {
        parts.push(count(summary.resumed, "resumption"));
    }
    let how = [&summary.method, &summary.engine].map(String::as_str);
    let how = how.into_iter().filter(|word| !word.is_empty()).collect::<Vec<_>>().join(", ");
    let by = if how.is_empty() { String::new() } else { format!(" ({how})") };
    format!(
        "work: {}{by}\n{}{}time: load {}, compile {}, integrate {}, in all {}\n",
        parts.join(", "),
        recoveries(summary),
        islands(summary),
        duration(summary.load_time_s),
        duration(summary.compile_time_s),
        duration(summary.integration_time_s),
        duration(summary.wall_time_s)
    )
}

/// What was done where the plain way did not get on, by name; nothing where it did.
fn recoveries(summary: &Summary) -> String {
    let mut rows = Vec::new();
    for (remedy, count) in summary.recoveries.taken() {
        rows.push(vec![remedy.name().into(), count.to_string(), remedy.counted().into()]);
    }
    if rows.is_empty() {
        return String::new();
    }
    format!("recoveries (`odyn explain NAME` says more):\n{}", aligned(&[Side::Left, Side::Right, Side::Left], &rows))
}

/// A line for each island that was integrated apart.
fn islands(summary: &Summary) -> String {
    let mut lines = String::new();
    for island in summary.islands.iter().take(MOST_NAMES) {
        let others = match island.bodies.len() {
            0 | 1 => String::new(),
            bodies => format!(" and {} more", bodies - 1),
        };
        let end = match island.status {
            status if status.reached_end() => String::new(),
            status => {
                let time = with_unit(significant(island.t_end_reached, 9), &summary.time_unit);
                format!("; {} at t = {time}: {}", status.words(), island.reason)
            }
        };
        lines.push_str(&format!(
            "  island of {}{others}: {}, {} rejected, {} ({}, {}), {}{end}\n",
            island.bodies.first().map_or("?", String::as_str),
            count(island.steps, "step"),
            island.rejected,
            count(island.evaluations, "evaluation"),
            island.method,
            island.engine,
            duration(island.integration_time_s)
        ));
    }
    match summary.islands.len().saturating_sub(MOST_NAMES) {
        0 => lines,
        more => lines + &format!("  and {more} islands more\n"),
    }
}

fn with_unit(number: String, unit: &str) -> String {
    if unit.is_empty() { number } else { format!("{number} {unit}") }
}

#[derive(Clone, Copy)]
enum Paint {
    Good,
    Bad,
}

fn painted(text: &str, paint: Paint) -> String {
    let code = match paint {
        Paint::Good => 32,
        Paint::Bad => 31,
    };
    format!("\x1b[1;{code}m{text}\x1b[0m")
}
