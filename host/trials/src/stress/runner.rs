//! [`run`]: the trials, one after the other or on several threads.

use std::collections::HashMap;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use super::judge::{Columns, judge};
use super::outcome::Outcome;
use super::suite::{Expected, Suite, Trial};
use crate::diagnostics::Diagnostic;
use crate::pool;
use crate::scene::Override;
use crate::session::{RunOptions, Session};
use crate::statics;

/// How trials are run.
#[derive(Debug, Clone, Default)]
pub struct Settings {
    /// Files and folders in which libraries are looked for first.
    pub plugins: Vec<PathBuf>,
    /// Folder for private copies of libraries; the user's cache folder where absent.
    pub library_copies: Option<PathBuf>,
    /// The full form instead of the short one.
    pub full: bool,
    /// Trials at the same time; 0 = as many as the machine has processors.
    pub jobs: usize,
}

/// A trial in one formulation.
#[derive(Debug, Clone, Copy)]
struct Task<'a> {
    /// Place of the trial in the suite, and of the formulation in the trial.
    place: (usize, usize),
    trial: &'a Trial,
    formulation: &'a str,
}

/// What is kept of a task: its outcome, and its outputs where others are compared with them.
type Done = (Outcome, Option<Columns>);

/// Outputs by trial and formulation.
type Known<'a> = HashMap<(&'a str, &'a str), Columns>;

/// Runs the trials of these names (all that belong to the form where there are none), each in its formulations. Outcomes are in
/// the order of the suite; `told` hears of each when it has ended, from any thread; `stop` ends the runs under way after their
/// steps and begins no others.
///
/// # Errors
/// A name that no trial has. What goes wrong in a trial is in its outcome.
pub fn run(
    suite: &Suite,
    names: &[String],
    settings: &Settings,
    told: &(dyn Fn(&Outcome) + Sync),
    stop: &Arc<AtomicBool>,
) -> Result<Vec<Outcome>, Box<Diagnostic>> {
    let chosen = suite.select(names, settings.full)?;
    let mut tasks = Vec::new();
    for place in chosen {
        let trial = &suite.trials[place];
        let each = trial.formulations.iter().enumerate();
        tasks.extend(each.map(|(k, formulation)| Task { place: (place, k), trial, formulation }));
    }
    // Trials that are compared with others come behind those.
    let (later, first): (Vec<Task<'_>>, Vec<Task<'_>>) = tasks.into_iter().partition(|t| t.trial.equals.is_some());
    let awaited = |task: &Task<'_>| {
        let mut compared = later.iter().filter_map(|other| other.trial.equals.as_ref());
        compared.any(|equals| equals.trial == task.trial.name)
    };
    let mut known = Known::new();
    let mut outcomes: Vec<((usize, usize), Outcome)> = Vec::new();
    for wave in [&first, &later] {
        let one = |task: &Task<'_>| {
            let (outcome, columns) = attempt(*task, &known, settings, stop);
            told(&outcome);
            (outcome, columns.filter(|_| awaited(task)))
        };
        let done = pool::each(wave.iter().collect(), settings.jobs, one);
        for (task, (outcome, columns)) in wave.iter().zip(done) {
            outcomes.push((task.place, outcome));
            if let Some(columns) = columns {
                known.insert((task.trial.name.as_str(), task.formulation), columns);
            }
        }
    }
    outcomes.sort_by_key(|(place, _)| *place);
    Ok(outcomes.into_iter().map(|(_, outcome)| outcome).collect())
}

/// Runs a task and judges it.
fn attempt(task: Task<'_>, known: &Known<'_>, settings: &Settings, stop: &Arc<AtomicBool>) -> Done {
    let started = Instant::now();
    let Task { trial, formulation, .. } = task;
    let mut set = trial.set.clone();
    if !settings.full {
        set.extend(trial.short.iter().cloned());
    }
    let mut outcome = Outcome {
        trial: trial.name.clone(),
        family: trial.family.clone(),
        text: trial.text.clone(),
        why: trial.why.clone(),
        scene: trial.named.clone(),
        formulation: formulation.to_owned(),
        expected: words(&trial.expected),
        ..Outcome::default()
    };
    if stop.load(Ordering::Relaxed) {
        outcome.faults.push("not begun".into());
        return (outcome, None);
    }
    let overrides = set.iter().cloned().chain([format!("simulation.formulation={formulation}")]);
    let options = RunOptions {
        overrides: overrides.map(Override::new).collect(),
        plugins: settings.plugins.clone(),
        library_copies: settings.library_copies.clone(),
        equilibrium: Some(statics::start),
        ..RunOptions::default()
    };
    outcome.set = set;
    let other = trial
        .equals
        .as_ref()
        .and_then(|equals| known.get(&(equals.trial.as_str(), equals.formulation.as_deref().unwrap_or(formulation))));
    let columns = judge(trial, Session::open(&trial.scene, &options), other, stop, &mut outcome);
    outcome.seconds = started.elapsed().as_secs_f64();
    (outcome, columns)
}

/// What must come out, for people.
fn words(expected: &Expected) -> String {
    match expected {
        Expected::Completed(_) => "completed within its bounds".into(),
        Expected::Refused(message) => format!("refused with {}", message.code),
        Expected::Stopped(message, _) => format!("stopped early with {}", message.code),
    }
}
