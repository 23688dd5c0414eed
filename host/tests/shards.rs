//! `odyn study` in shards: by hand, by schedulers, killed and continued.
#![cfg(feature = "cli")]
#![allow(clippy::unwrap_used)] // in a test, the panic is the message

use std::fs;
#[cfg(unix)]
use std::{fs::Permissions, os::unix::fs::PermissionsExt, process::Command};

mod support;

use support::Scratch;

/// The bytes of a study do not depend on how it is divided, and a row is the run that its values make.
#[test]
fn shards_of_a_study_make_its_table() {
    let scratch = Scratch::new("shards");
    let study = "study brick.toml --lhs 7 --seed 3 --vary brick.mass=1:2 --vary simulation.tolerance=1e-6,1e-9";
    scratch.odyn(&format!("{study} -q -o whole")).ends_with(0);
    let merge = "study merge parts";
    for shard in ["3/3", "1/3"] {
        let ran = scratch.odyn(&format!("{study} --shard {shard} -o parts --jobs 1")).ends_with(0);
        assert!(ran.out().starts_with("part: parts/part-0000"), "{}", ran.out());
    }
    let ran = scratch.odyn(merge).ends_with(2);
    assert!(ran.err().contains("1 of 3 are missing: 2"), "{}", ran.err());
    scratch.odyn(&format!("{study} --shard 2/3 -o parts -q")).ends_with(0);
    let ran = scratch.odyn(&format!("{study} --shard 2/3 -o parts --resume")).ends_with(0);
    assert_eq!(ran.out(), "part: parts/part-00002-of-00003.csv (finished before)\n");
    let ran = scratch.odyn(merge).ends_with(0);
    assert_eq!(ran.out(), "table: parts/study.csv (7 runs of 3 parts)\n");
    let read = |path: &str| fs::read_to_string(scratch.0.join(path)).unwrap();
    assert_eq!(read("parts/study.csv"), read("whole/study.csv"));
    // One row by hand, as its values are in the table.
    let table = read("whole/study.csv");
    let row: Vec<&str> = table.lines().nth(5).unwrap().split(',').collect();
    let set = format!("run brick.toml --set brick.mass={} --set simulation.tolerance={} -o alone", row[1], row[2]);
    scratch.odyn(&set).ends_with(0);
    let alone = read("alone/results.csv");
    let last: Vec<&str> = alone.lines().last().unwrap().split(',').collect();
    let first = table.lines().next().unwrap().split(',').position(|title| title.starts_with("final.")).unwrap();
    assert_eq!(last[1..], row[first..first + last.len() - 1]);
    // Another study, and the same in the same folder.
    let ran = scratch.odyn(&format!("{study} --set brick.mass=3 --shard 2/3 -o parts --resume")).ends_with(2);
    assert!(ran.err().contains("changes the scene otherwise"), "{}", ran.err());
    for (wrong, what) in [
        ("study brick.toml --vary brick.mass=1,2 --seed 3", "belongs to `--lhs`"),
        ("study brick.toml --sobol 8 --vary brick.mass=1:2:3", "number of points"),
        ("study brick.toml --vary brick.mass=1,2 --shard 3/2", "17/64"),
        ("study brick.toml", "--vary"),
        ("study merge", "DIR"),
    ] {
        let ran = scratch.odyn(wrong).ends_with(2);
        assert!(ran.err().contains(what), "{wrong}: {}", ran.err());
    }
    // Files that are not there, and outputs that the scene does not have, as everywhere.
    assert!(scratch.odyn("study brick.toml --csv none.csv").ends_with(8).err().contains("none.csv"));
    scratch.odyn("study merge nowhere").ends_with(8);
    let ran = scratch.odyn("study brick.toml --vary brick.mass=1,2 --series spim").ends_with(3);
    assert!(ran.err().contains("there is no output `spim`"), "{}", ran.err());
}

/// The scripts do what they say, with a folder's name that a shell would take apart.
#[cfg(unix)]
#[test]
fn scripts_for_schedulers_do_all_shards() {
    let scratch = Scratch::new("scripts");
    fs::write(
        scratch.0.join("points.csv"),
        "brick.mass,brick.position\n1,\"[0, 0, 0]\"\n2,\"[1, 0, 0]\"\n-3,\"[0, 0, 0]\"\n",
    )
    .unwrap();
    let odyn = |arguments: &[&str]| scratch.command("").args(arguments).output().unwrap();
    odyn(&["study", "brick.toml", "--csv", "points.csv", "-o", "whole"]);
    let read = |path: &str| fs::read_to_string(scratch.0.join(path)).unwrap();
    // What `hq submit` does with an array of tasks.
    let hq = scratch.0.join("hq");
    fs::write(&hq, "#!/bin/bash\nwhile [ \"$1\" != -- ]; do shift; done; shift\nfor HQ_TASK_ID in 1 2; do export HQ_TASK_ID; \"$@\" || exit; done\n").unwrap();
    fs::set_permissions(&hq, Permissions::from_mode(0o755)).unwrap();
    for (scheduler, starts, output) in [("slurm", "sbatch", "-o"), ("hq", "bash", "-o"), ("hq", "", "-qo")] {
        let _ = fs::remove_dir_all(scratch.0.join("it's a study"));
        let points = ["study", "--emit", scheduler, "--csv", "points.csv", "--shards", "2"];
        let ran = odyn(&[&points[..], &[output, "it's a study", "--", "brick.toml"]].concat());
        assert!(ran.status.success(), "{}", String::from_utf8_lossy(&ran.stderr));
        let told = String::from_utf8_lossy(&ran.stdout).into_owned();
        let says = told.starts_with(&format!("3 runs in 2 shards: {starts} ")) && told.contains(" study merge ");
        assert!(says || output == "-qo" && told.is_empty(), "{told}");
        let script = scratch.0.join(format!("it's a study/study.{scheduler}.sh"));
        let tasks: &[&str] = if scheduler == "slurm" { &["1", "2"] } else { &["none"] };
        for task in tasks {
            let path = format!("{}:{}", scratch.0.display(), std::env::var("PATH").unwrap());
            let mut command = Command::new("bash");
            command.arg(&script).env("SLURM_ARRAY_TASK_ID", task).env("PATH", path).current_dir("/");
            let ran = command.output().unwrap();
            assert!(ran.status.success(), "{scheduler}: {}", String::from_utf8_lossy(&ran.stderr));
        }
        // A mass is negative.
        let merged = odyn(&["study", "merge", "it's a study"]);
        assert_eq!(merged.status.code(), Some(3), "{}", String::from_utf8_lossy(&merged.stderr));
        assert_eq!(read("it's a study/study.csv"), read("whole/study.csv"));
    }
}

/// A study that is killed loses nothing that was finished.
#[cfg(unix)]
#[test]
fn a_killed_shard_continues_with_the_runs_that_are_missing() {
    let scratch = Scratch::new("killed");
    let study =
        "study brick.toml --vary brick.mass=1:2:40 --set simulation.output_step=0.05 --shard 1/1 --jobs 1 -o parts";
    let mut child = scratch.command(study).stderr(std::process::Stdio::piped()).spawn().unwrap();
    let mut lines = std::io::BufRead::lines(std::io::BufReader::new(child.stderr.take().unwrap()));
    let seen = lines.by_ref().map(Result::unwrap).take_while(|line| !line.starts_with("5/40")).count();
    assert!(seen >= 4);
    child.kill().unwrap();
    child.wait().unwrap();
    assert!(!scratch.0.join("parts/part-00001-of-00001.csv").exists());
    let finished = fs::read_to_string(scratch.0.join("parts/part-00001-of-00001.journal")).unwrap();
    let finished = finished.lines().filter(|line| line.contains("{\"Run\":")).count();
    assert!((5..40).contains(&finished), "{finished}");
    let ran = scratch.odyn(&format!("{study} --resume")).ends_with(0);
    let text = format!("{finished} of 40 runs were finished before");
    assert!(ran.err().contains(&text), "{}", ran.err());
    scratch.odyn("study merge parts").ends_with(0);
    scratch.odyn(&study.replace(" --shard 1/1", "").replace("-o parts", "-o whole -q")).ends_with(0);
    let read = |path: &str| fs::read(scratch.0.join(path)).unwrap();
    assert!(read("parts/study.csv") == read("whole/study.csv"));
}
