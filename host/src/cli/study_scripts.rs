//! `odyn study --emit`: scripts that make a scheduler do the shards of a study.

use std::ffi::{OsStr, OsString};
use std::path::{Path, PathBuf};

use odyn::diagnostics::{Diagnostic, codes};
use odyn::results::replace;

use super::exit;
use super::failure::Failure;
use super::study_args::{Scheduler, StudyArgs};
use super::terminal::{self, quoted, word_of};

/// Writes the script into the folder of the study, and says how it is used.
pub(super) fn emit(args: &StudyArgs, scheduler: Scheduler, folder: &Path, runs: usize) -> Result<u8, Failure> {
    let shards = args.shards.unwrap_or(1);
    let here =
        std::env::current_dir().map_err(|cause| unusable(&format!("the current folder is not known: {cause}")))?;
    let words = words(&here, folder, args)?;
    let (name, script) = match scheduler {
        Scheduler::Slurm => ("study.slurm.sh", slurm(&words, shards, args.jobs.unwrap_or(1))),
        Scheduler::Hq => ("study.hq.sh", hq(&words, shards, args.jobs.unwrap_or(1))),
    };
    let path = folder.join(name);
    std::fs::create_dir_all(folder).map_err(|cause| super::failure::cannot_write(folder, &cause))?;
    replace(&path, script.as_bytes(), false)?;
    if !args.quiet {
        let start = match scheduler {
            Scheduler::Slurm => "sbatch",
            Scheduler::Hq => "bash",
        };
        let path = word_of(&path);
        terminal::print(&format!("{runs} runs in {shards} shards: {start} {path}\nthen {}\n", words.merge))?;
    }
    Ok(exit::DONE)
}

/// What scripts are made of, for a shell.
struct Words {
    /// Where the command was given.
    here: String,
    /// Folder of the study.
    folder: PathBuf,
    /// What the jobs are called.
    name: String,
    /// The command before its shard, and after it.
    command: [String; 2],
    merge: String,
}

impl Words {
    /// The command that does a shard; its number is in a variable.
    fn shard(&self, variable: &str, shards: u32) -> String {
        let [before, after] = &self.command;
        format!("exec {before} --shard \"${variable}/{shards}\" {after}")
    }
}

fn words(here: &Path, folder: &Path, args: &StudyArgs) -> Result<Words, Failure> {
    let text =
        |text: &OsStr| text.to_str().map(str::to_string).ok_or_else(|| unusable("a name has bytes that are no text"));
    let absolute = here.join(folder);
    if text(absolute.as_os_str())?.contains(['\n', '"', '%', '\\']) {
        return Err(unusable("the name of the folder has signs that schedulers give a meaning"));
    }
    let mut all = std::env::args_os();
    let program = text(&all.next().unwrap_or_else(|| "odyn".into()))?;
    let arguments: Vec<String> = without_emission(all).iter().map(|one| text(one)).collect::<Result<_, _>>()?;
    // What is added comes behind the command's name: the scene may stand behind a `--`.
    let name = arguments.iter().position(|one| one == "study").map_or(0, |at| at + 1);
    let (before, after) = arguments.split_at(name);
    let joined =
        |words: &mut dyn Iterator<Item = &String>| words.map(|word| quoted(word)).collect::<Vec<_>>().join(" ");
    let mut before = joined(&mut std::iter::once(&program).chain(before));
    for (added, word) in [(args.jobs.is_none(), "--jobs 1"), (!args.quiet, "--quiet"), (!args.resume, "--resume")] {
        if added {
            before = format!("{before} {word}");
        }
    }
    let stem = args.scene.scene.file_stem().unwrap_or_default().to_string_lossy();
    let plain = |c: char| if c.is_ascii_alphanumeric() || c == '-' || c == '_' { c } else { '_' };
    Ok(Words {
        here: quoted(&text(here.as_os_str())?),
        folder: absolute,
        name: format!("odyn-{}", stem.chars().map(plain).collect::<String>()),
        command: [before, joined(&mut after.iter())],
        merge: format!("{} study merge {}", quoted(&program), quoted(&text(folder.as_os_str())?)),
    })
}

/// The arguments but `--emit` and `--shards` with their values.
fn without_emission(arguments: impl Iterator<Item = OsString>) -> Vec<OsString> {
    let mut kept = Vec::new();
    let mut arguments = arguments;
    while let Some(one) = arguments.next() {
        match one.to_str() {
            Some("--emit" | "--shards") => drop(arguments.next()),
            Some(text) if text.starts_with("--emit=") || text.starts_with("--shards=") => {}
            _ => kept.push(one),
        }
    }
    kept
}

fn slurm(words: &Words, shards: u32, jobs: u16) -> String {
    let Words { here, folder, name, merge, .. } = words;
    let one = words.shard("SLURM_ARRAY_TASK_ID", shards);
    format!(
        "#!/bin/bash\n\
         # When all shards have ended: {merge}\n\
         #SBATCH --job-name={name}\n\
         #SBATCH --array=1-{shards}\n\
         #SBATCH --ntasks=1\n\
         #SBATCH --cpus-per-task={jobs}\n\
         #SBATCH --output=\"{}/part-%a.log\"\n\
         cd {here} || exit\n\
         {one}\n",
        folder.display()
    )
}

fn hq(words: &Words, shards: u32, jobs: u16) -> String {
    let Words { here, folder, name, merge, .. } = words;
    let one = quoted(&words.shard("HQ_TASK_ID", shards));
    let log = quoted(&format!("{}/part-%{{TASK_ID}}.log", folder.display()));
    format!(
        "#!/bin/bash\n\
         # When all shards have ended: {merge}\n\
         cd {here} || exit\n\
         exec hq submit --name {name} --array 1-{shards} --cpus {jobs} --stdout none --stderr {log} -- bash -c {one}\n"
    )
}

fn unusable(what: &str) -> Failure {
    Failure::new(
        Diagnostic::error(codes::CANNOT_WRITE, format!("cannot write the script: {what}")).help("use other names"),
    )
    .exit(exit::USAGE)
}
