//! Nothing is lost when things go wrong: runs that are killed, disks that are full, folders that are not there.
#![cfg(feature = "cli")]
#![allow(clippy::unwrap_used)] // in a test, the panic is the message

use std::fs;
use std::path::Path;
use std::process::{Child, Stdio};
use std::time::{Duration, Instant};

mod support;

use support::{Scratch, rows};

/// Far more than any machine computes while a test waits.
const LONG: &str = "--t-end 1e9 --set simulation.max_steps=2000000000 --set simulation.output_step=10000";

/// Starts the program and leaves it alone.
fn start(scratch: &Scratch, line: &str) -> Child {
    scratch.command(line).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap()
}

#[track_caller]
fn wait_until(what: &str, mut is_so: impl FnMut() -> bool) {
    for _ in 0..1200 {
        if is_so() {
            return;
        }
        std::thread::sleep(Duration::from_millis(25));
    }
    panic!("{what} did not happen");
}

/// Ends a process and gives what it printed.
fn end_of(run: Child) -> (Option<i32>, String) {
    let output = run.wait_with_output().unwrap();
    (output.status.code(), String::from_utf8(output.stderr).unwrap())
}

#[test]
fn a_run_that_is_killed_is_resumed_with_the_same_bytes() {
    let scratch = Scratch::new("killed");
    let line = "run brick.toml --t-end 3s --set simulation.output_step=5 --checkpoint every=500 -q -o";
    let started = Instant::now();
    scratch.odyn(&format!("{line} alone")).ends_with(0);
    let whole = started.elapsed();
    let expected = fs::read(scratch.0.join("alone/results.csv")).unwrap();
    let mut command = format!("{line} killed");
    let (mut kills, mut checkpoint) = (0, false);
    let ended_well = (1..400).any(|attempt| {
        let mut run = start(&scratch, &command);
        // Ten kills, and the run that is left alone after them is a resumed one.
        if kills < 10 || !checkpoint {
            // Spread over the run without a pattern: multiples of the golden ratio.
            std::thread::sleep(whole.mul_f64((0.618_034 * f64::from(attempt)).fract()));
            kills += i32::from(run.try_wait().unwrap().is_none());
            let _ = run.kill();
        }
        let (code, told) = end_of(run);
        let resumed = checkpoint;
        checkpoint = scratch.0.join("killed/checkpoint.toml").exists();
        if code == Some(0) {
            assert!(fs::read(scratch.0.join("killed/results.csv")).unwrap() == expected, "after {kills} kills");
        } else {
            assert_eq!(code, None, "{told}");
            if rows(&scratch.0.join("killed/results.csv")) > 0 {
                scratch.odyn("compare killed alone --tol 0 --allow-missing").ends_with(0);
            }
        }
        command = if checkpoint { "resume killed -q".into() } else { format!("{line} killed") };
        code == Some(0) && resumed && kills >= 10
    });
    assert!(ended_well, "{kills} kills");
    let summary = scratch.json("killed/summary.json");
    assert!(summary["resumed"].as_u64().unwrap() > 0 && summary["checkpoints"] == 5, "{summary}");
    assert_eq!(summary["steps"], scratch.json("alone/summary.json")["steps"]);
    // Nothing is left to do, and that is no error.
    assert!(scratch.odyn("resume killed").ends_with(0).out().contains("nothing is left to do"));
}

/// What `--verify`, `--digits` and `--report` ask for is not forgotten by a run that is killed, be it on its way or while it is judged.
#[test]
fn a_run_that_is_resumed_is_judged_as_it_was_to_be() {
    let scratch = Scratch::new("judged");
    scratch.odyn("run brick.toml --t-end 200 --set simulation.output_step=100 -q -o before").ends_with(0);
    for (more, name) in [("--digits --report", "whole"), ("--from before", "on")] {
        let line = format!(
            "run brick.toml {more} --t-end 1s --tol 1e-4 --set simulation.output_step=50 --checkpoint every=100 --verify -q -o"
        );
        // Such a tolerance is none for an axis that tumbles.
        scratch.odyn(&format!("{line} {name}")).ends_with(7);
        let file = |folder: &str, name: &str| scratch.0.join(folder).join(name);
        let checkpoint = |folder: &str| file(folder, "checkpoint.toml").exists();
        assert!(!checkpoint(name));
        let killed = format!("{name}-killed");
        let is_killed = (0..50).any(|_| {
            let mut run = start(&scratch, &format!("{line} {killed}"));
            wait_until("a checkpoint", || checkpoint(&killed) || run.try_wait().unwrap().is_some());
            let _ = run.kill();
            run.wait().unwrap();
            checkpoint(&killed)
        });
        assert!(is_killed, "each run was at its end before it was killed");
        scratch.odyn(&format!("resume {killed} -q")).ends_with(7);
        assert!(!checkpoint(&killed));
        let [alone, resumed] = [name, &killed].map(|folder| scratch.json(&format!("{folder}/summary.json")));
        assert_eq!(resumed["resumed"], 1);
        assert!(alone["verified"].is_object() && resumed["verified"] == alone["verified"], "{}", resumed["verified"]);
        assert_eq!(resumed["digits"], alone["digits"]);
        for written in ["digits.csv", "report.html"] {
            let [alone, resumed] = [name, &killed].map(|folder| file(folder, written).exists());
            assert_eq!((alone, resumed), (more.contains("digits"), more.contains("digits")), "{written}");
        }
    }
}

#[test]
fn what_cannot_be_resumed_is_told_with_its_reason() {
    let scratch = Scratch::new("refused");
    let none = scratch.odyn("resume nowhere").ends_with(8);
    assert!(none.err().contains("ODY0804") && none.err().contains("checkpoint.toml"), "{}", none.err());
    scratch.odyn("run brick.toml --checkpoint 20s").ends_with(2);
    scratch.odyn("run brick.toml --checkpoint every=20kg").ends_with(3);
    // It ends after its first checkpoint.
    let early = "--set simulation.max_steps=30 --set simulation.max_step=10";
    scratch.odyn(&format!("run brick.toml --checkpoint every=100ms {early} -o out")).ends_with(6);
    let text = fs::read_to_string(scratch.0.join("brick.toml")).unwrap();
    scratch.file("brick.toml", &text.replace("mass = 1", "mass = 2"));
    let other = scratch.odyn("resume out").ends_with(3);
    assert!(other.err().contains("ODY0804") && other.err().contains("the scene file"), "{}", other.err());
    scratch.file("brick.toml", &text);
    let same = scratch.odyn("resume out").ends_with(6);
    assert!(same.out().contains("the limit of 30 steps") && same.out().contains("1 resumption"), "{}", same.out());
    // A new run in the folder has nothing to do with the checkpoint of the old one.
    scratch.odyn("run brick.toml -o out -q").ends_with(0);
    assert!(!scratch.0.join("out/checkpoint.toml").exists());
}

#[test]
fn a_folder_takes_one_run_at_a_time() {
    let scratch = Scratch::new("busy");
    let mut run = start(&scratch, &format!("run brick.toml {LONG} -o out"));
    wait_until("a row", || rows(&scratch.0.join("out/results.csv")) > 0);
    let second = scratch.odyn("run brick.toml -o out").ends_with(8);
    assert!(second.err().contains("another run writes it"), "{}", second.err());
    // Readers are welcome.
    scratch.odyn("run brick.toml -o other -q").ends_with(0);
    scratch.odyn("compare out other --tol 1e-6 --allow-missing").ends_with(0);
    run.kill().unwrap();
    run.wait().unwrap();
    scratch.odyn("run brick.toml -o out -q").ends_with(0);
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_told_and_what_is_there_stays() {
    let scratch = Scratch::new("full");
    // The device that is always full in place of the table.
    fs::create_dir(scratch.0.join("full")).unwrap();
    std::os::unix::fs::symlink("/dev/full", scratch.0.join("full/results.csv")).unwrap();
    let full = scratch.odyn("run brick.toml -o full").ends_with(8);
    for told in ["ODY0801", "full/results.csv", "make room on the disk"] {
        assert!(full.err().contains(told), "`{told}` is not in {}", full.err());
    }
    // A limit of the size of files, 16 kB, which is reached during the run.
    let program = env!("CARGO_BIN_EXE_odyn");
    let line = "run brick.toml --t-end 20s --set simulation.output_step=10 -o small --checkpoint every=2s";
    let script = format!("trap '' XFSZ; ulimit -f 32; exec {program} {line}");
    let limited = std::process::Command::new("sh").args(["-c", &script]).current_dir(&scratch.0).output().unwrap();
    let told = String::from_utf8(limited.stderr).unwrap();
    assert_eq!(limited.status.code(), Some(8), "{told}");
    for text in ["ODY0801", "small/results.csv", "the rows up to here are kept"] {
        assert!(told.contains(text), "`{text}` is not in {told}");
    }
    let summary = scratch.json("small/summary.json");
    assert_eq!((&summary["status"], &summary["code"]), (&"failed".into(), &"ODY0801".into()));
    let table = fs::read_to_string(scratch.0.join("small/results.csv")).unwrap();
    assert!(table.ends_with('\n') && table.lines().all(|line| line.split(',').count() == 2));
    assert!(rows(&scratch.0.join("small/results.csv")) > 300);
    assert_eq!(summary["rows"], rows(&scratch.0.join("small/results.csv")));
    // What was not yet in the file when it could take no more is there as far as it fits.
    let fast = "run brick.toml --t-end 20s --set simulation.output_step=10 -o fast";
    let script = format!("trap '' XFSZ; ulimit -f 32; exec {program} {fast}");
    let limited = std::process::Command::new("sh").args(["-c", &script]).current_dir(&scratch.0).output().unwrap();
    assert_eq!(limited.status.code(), Some(8));
    let table = fs::read_to_string(scratch.0.join("fast/results.csv")).unwrap();
    assert!(table.len() > 15_000 && table.ends_with('\n'), "{}", table.len());
    assert_eq!(scratch.json("fast/summary.json")["rows"], rows(&scratch.0.join("fast/results.csv")));
    // With room again, the run continues, and nothing shows.
    scratch.odyn("resume small -q").ends_with(0);
    scratch.odyn(&format!("{} -q", line.replace("small", "roomy"))).ends_with(0);
    let bytes = |folder: &str| fs::read(scratch.0.join(folder).join("results.csv")).unwrap();
    assert!(bytes("small") == bytes("roomy"));
}

#[cfg(unix)]
#[test]
fn a_folder_that_may_not_be_written_is_named_with_its_remedy() {
    use std::os::unix::fs::PermissionsExt;
    let scratch = Scratch::new("locked");
    let folder = scratch.0.join("locked");
    fs::create_dir(&folder).unwrap();
    fs::set_permissions(&folder, fs::Permissions::from_mode(0o555)).unwrap();
    let may = fs::write(folder.join("probe"), "").is_ok();
    // Who may write everywhere (root) meets a folder of the system that nobody may write.
    let target = if may { "/proc/odyn" } else { "locked/below" };
    assert!(
        !may || Path::new("/proc/self").exists(),
        "there is no folder that root may not write: run as another user"
    );
    let ran = scratch.odyn(&format!("run brick.toml -o {target}")).ends_with(8);
    assert!(
        ran.err().contains("ODY0801") && ran.err().contains(target) && ran.err().contains("-o DIR"),
        "{}",
        ran.err()
    );
    fs::set_permissions(&folder, fs::Permissions::from_mode(0o755)).unwrap();
}

#[test]
fn a_file_in_place_of_the_folder_is_named_with_its_remedy() {
    let scratch = Scratch::new("file");
    for target in ["brick.toml", "brick.toml/below"] {
        let ran = scratch.odyn(&format!("run brick.toml -o {target}")).ends_with(8);
        assert!(ran.err().contains("a file stands where a folder is needed"), "{}", ran.err());
    }
    fs::create_dir_all(scratch.0.join("odd/results.csv")).unwrap();
    let ran = scratch.odyn("run brick.toml -o odd").ends_with(8);
    assert!(ran.err().contains("a folder stands where the file is needed"), "{}", ran.err());
}

#[cfg(unix)]
#[test]
fn a_folder_that_is_removed_during_the_run_ends_it() {
    let scratch = Scratch::new("removed");
    for (name, more) in [("plain", ""), ("with", "--checkpoint every=20s")] {
        let run = start(&scratch, &format!("run brick.toml {LONG} -o {name} {more}"));
        let folder = scratch.0.join(name);
        wait_until("a row", || rows(&folder.join("results.csv")) > 0);
        fs::remove_dir_all(&folder).unwrap();
        let (code, told) = end_of(run);
        assert_eq!(code, Some(8), "{told}");
        for text in ["ODY0801", name, "not there any more"] {
            assert!(told.contains(text), "`{text}` is not in {told}");
        }
    }
}

#[test]
fn a_verified_run_tells_how_far_off_it_is() {
    let scratch = Scratch::new("verify-run");
    // More than the tolerance explains: such tumbling is too sensitive for it.
    let ran = scratch.odyn("run brick.toml --t-end 4000 --tol 1e-6 --verify -o out").ends_with(7);
    for told in [
        "verified with radau5 instead of dop853, tolerance 1e-7 instead of 1e-6",
        "ODY0704",
        "  output  difference  of its peak",
        "  w1 ",
    ] {
        assert!(ran.out().contains(told), "`{told}` is not in {}", ran.out());
    }
    let verified = scratch.json("out/summary.json")["verified"].clone();
    let w1 = &verified["outputs"][0];
    assert_eq!((&w1["name"], &verified["t_last"]), (&"w1".into(), &4000.0.into()));
    let absolute = w1["absolute"].as_f64().unwrap();
    // 20 000 rad of tumbling amplify what the tolerance allows.
    assert!(absolute > 0.02 && absolute < 0.1, "{absolute}");
    // Without the option nothing is said of it.
    scratch.odyn("run brick.toml -o out -q").ends_with(0);
    assert!(scratch.json("out/summary.json")["verified"].is_null());
    // A second run that does not get there is reported, and verifies nothing.
    let early =
        scratch.odyn("run brick.toml --t-end 20 --tol 1e-4 --set simulation.max_steps=53 --verify -o out").ends_with(7);
    assert!(early.out().contains("the second run ended early (the limit of 53 steps"), "{}", early.out());
}

/// Twelve runs that take a while each.
const STUDY: &str = "study brick.toml --t-end 2s --set simulation.output_step=1000 --set simulation.tolerance=1e-11 \
                     --vary brick.mass=1:12:12 --audit-tol 1e-3 -o";

#[test]
fn a_study_that_is_killed_is_resumed_with_the_same_bytes() {
    let scratch = Scratch::new("study-killed");
    scratch.odyn(&format!("{STUDY} alone --jobs 1 -q")).ends_with(0);
    let expected = fs::read(scratch.0.join("alone/study.csv")).unwrap();
    assert_eq!(rows(&scratch.0.join("alone/study.csv")), 12);
    assert!(!scratch.0.join("alone/study.journal").exists());
    for jobs in [1, 2] {
        let folder = format!("killed-{jobs}");
        let journal = scratch.0.join(&folder).join("study.journal");
        let mut kept = Vec::new();
        for _ in 0..100 {
            let mut run = start(&scratch, &format!("{STUDY} {folder} --jobs {jobs} --resume"));
            if kept.len() < 4 {
                // As soon as it has finished another run, or all.
                let before = kept.last().copied().unwrap_or(1);
                while rows(&journal) <= before && run.try_wait().unwrap().is_none() {
                    std::thread::sleep(Duration::from_millis(1));
                }
                let _ = run.kill();
            }
            let (code, told) = end_of(run);
            if code == Some(0) {
                assert!(fs::read(scratch.0.join(&folder).join("study.csv")).unwrap() == expected);
                break;
            }
            assert_eq!(code, None, "{told}");
            kept.push(rows(&journal));
        }
        assert!(!journal.exists(), "{kept:?}");
        assert!(kept.windows(2).all(|w| w[0] <= w[1]) && kept.iter().any(|count| *count > 1), "{kept:?}");
    }
}

#[test]
fn what_a_study_has_is_not_lost_and_not_mistaken_for_another() {
    let scratch = Scratch::new("study-kept");
    let line = "study brick.toml --vary brick.mass=1:6:6 --jobs 1";
    scratch.odyn(&format!("{line} -o alone -q")).ends_with(0);
    // A journal with two runs: that of a study whose last four were never done.
    let mut run = start(&scratch, &format!("{line} --t-end 1e9 --set simulation.max_steps=2000000000 -o endless"));
    wait_until("a journal", || scratch.0.join("endless/study.journal").exists());
    run.kill().unwrap();
    run.wait().unwrap();
    // Nothing was finished there: it begins as a new one does.
    scratch.odyn(&format!("{line} -o endless -q")).ends_with(0);
    let table = |folder: &str| fs::read(scratch.0.join(folder).join("study.csv")).unwrap();
    assert!(table("endless") == table("alone"));

    let journal = scratch.0.join("part/study.journal");
    let long = format!("{line} --set simulation.tolerance=1e-12 --t-end 3s -o part");
    let mut run = start(&scratch, &long);
    wait_until("a finished run", || rows(&journal) > 2);
    run.kill().unwrap();
    run.wait().unwrap();
    let text = fs::read_to_string(&journal).unwrap();
    let refused = |line: &str, words: &str| {
        let ran = scratch.odyn(line).ends_with(2);
        assert!(ran.err().contains(words), "{}", ran.err());
        assert!(fs::read_to_string(&journal).unwrap() == text, "a refusal changes nothing");
    };
    refused(&long, "holds a study that has not ended");
    refused(&format!("{long} --resume --vary simulation.gravity=[0,0,0],[0,1,0]"), "it varies other keys or values");
    refused(&format!("{long} --resume --audit-tol 1e-3"), "it has another `--audit-tol`");
    scratch.file("brick.toml", &support::BRICK.replace("2.5]", "2.6]"));
    refused(&format!("{long} --resume"), "the scene file is not what it was");
    scratch.file("brick.toml", support::BRICK);
    // One digit of a finished row.
    let at = text.rfind("completed").unwrap() + 14;
    let digit = text[at..].find(|c: char| c.is_ascii_digit()).unwrap() + at;
    let other = if &text[digit..=digit] == "5" { "6" } else { "5" };
    fs::write(&journal, format!("{}{other}{}", &text[..digit], &text[digit + 1..])).unwrap();
    let ran = scratch.odyn(&format!("{long} --resume")).ends_with(2);
    assert!(ran.err().contains("`study.journal` is damaged at line"), "{}", ran.err());
    assert!(ran.err().contains("to begin anew, remove"), "{}", ran.err());
    // What a kill leaves of a line is not counted.
    fs::write(&journal, format!("{text}0123 {{\"Run\"")).unwrap();
    let ran = scratch.odyn(&format!("{long} --resume")).ends_with(0);
    assert!(ran.err().contains("of 6 runs were finished before"), "{}", ran.err());
    assert!(!journal.exists());
}

/// Exchanges the first digit behind a text.
fn flip(path: &Path, behind: &str) {
    let text = fs::read_to_string(path).unwrap();
    let at = text.find(behind).unwrap() + behind.len();
    let digit = text[at..].find(|c: char| ('1'..='9').contains(&c)).unwrap() + at;
    let other = if &text[digit..=digit] == "5" { "6" } else { "5" };
    fs::write(path, format!("{}{other}{}", &text[..digit], &text[digit + 1..])).unwrap();
}

#[test]
fn what_was_damaged_is_refused_by_name() {
    let scratch = Scratch::new("damaged");
    let whole = |folder: &str| scratch.odyn(&format!("run brick.toml -q -o {folder}")).ends_with(0);
    whole("a");
    whole("b");
    let refused = |line: &str, words: &[&str]| {
        let ran = scratch.odyn(line);
        assert_ne!(ran.0.status.code(), Some(0), "{line}");
        words.iter().for_each(|words| assert!(ran.err().contains(words), "{words}: {}", ran.err()));
    };
    // A table: in the folder, and as a reference of a check.
    scratch.odyn("compare a b").ends_with(0);
    flip(&scratch.0.join("b/results.csv"), "\n200.0,");
    refused("compare a b", &["b/results.csv", "its checksum is not the one in `summary.json`", "run again"]);
    let checked = format!(
        "{}[[check]]\nname = \"spin\"\nkind = \"velocity\"\nvalue = \"w1\"\nreference = {{ csv = \"b/results.csv\", column = \"w1\" }}\ntolerance = 1\n",
        support::BRICK
    );
    scratch.file("checked.toml", &checked);
    let ran = scratch.odyn("run checked.toml -o c").ends_with(7);
    assert!(format!("{}{}", ran.out(), ran.err()).contains("its checksum is not the one"), "{}", ran.out());
    // The same without a summary is a table like any other.
    fs::remove_file(scratch.0.join("b/summary.json")).unwrap();
    scratch.odyn("compare a b --tol 1e9").ends_with(0);
    // A cut table.
    let text = fs::read_to_string(scratch.0.join("a/results.csv")).unwrap();
    fs::write(scratch.0.join("a/results.csv"), &text[..text.len() - 30]).unwrap();
    refused("compare a a", &["its checksum is not the one"]);
    // A state.
    scratch.odyn("run brick.toml --from a --t-end 3s -q -o d").ends_with(0);
    flip(&scratch.0.join("a/state.toml"), "working = [");
    refused(
        "run brick.toml --from a --t-end 3s -q -o d",
        &["a/state.toml", "its checksum does not fit", "run that one again"],
    );
    let text = fs::read_to_string(scratch.0.join("d/state.toml")).unwrap();
    fs::write(scratch.0.join("d/state.toml"), &text[..text.len() - 100]).unwrap();
    refused("run brick.toml --from d --t-end 4s -q -o e", &["it has no checksum at its end"]);
}

#[test]
fn a_damaged_checkpoint_or_table_is_not_resumed() {
    let scratch = Scratch::new("damaged-checkpoint");
    let mut run = start(&scratch, &format!("run brick.toml {LONG} --checkpoint every=1000 -q -o out"));
    let checkpoint = scratch.0.join("out/checkpoint.toml");
    // The twelfth has the first row behind the start.
    let taken = |text: &str| text.lines().find_map(|line| line.strip_prefix("taken = ")?.parse::<u64>().ok());
    wait_until("a checkpoint", || fs::read_to_string(&checkpoint).is_ok_and(|text| taken(&text) >= Some(12)));
    run.kill().unwrap();
    run.wait().unwrap();
    let (sound, table) = (fs::read(&checkpoint).unwrap(), fs::read(scratch.0.join("out/results.csv")).unwrap());
    let refused = |words: &str| {
        let ran = scratch.odyn("resume out -q");
        assert_ne!(ran.0.status.code(), Some(0));
        assert!(ran.err().contains(words), "{words}: {}", ran.err());
    };
    flip(&checkpoint, "working = [");
    refused("its checksum does not fit");
    fs::write(&checkpoint, &sound).unwrap();
    flip(&scratch.0.join("out/results.csv"), "\n10000.0,");
    refused("it is not what it was at the last checkpoint");
    refused("begin the run anew");
    fs::write(scratch.0.join("out/results.csv"), &table[..10]).unwrap();
    refused("out/results.csv` cannot be used: it is shorter than at the last checkpoint");
    fs::write(scratch.0.join("out/results.csv"), &table).unwrap();
    // A checkpoint of the format before.
    let text = String::from_utf8(sound).unwrap();
    let older = text.replacen("format = 6", "format = 2", 1);
    assert_ne!(older, text);
    fs::write(&checkpoint, older).unwrap();
    refused("its format is 2, that of an older odyn");
}
