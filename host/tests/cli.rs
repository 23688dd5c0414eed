//! The program as a user meets it: exit codes, what goes to which stream, files that are left. The scenes here need no
//! library of elements.
#![cfg(feature = "cli")]
#![allow(clippy::unwrap_used)] // in a test, the panic is the message

use std::fs;
use std::process::Command;

mod support;

use support::{BRICK, Ran, Scratch, rows};

#[test]
fn a_run_leaves_its_files_and_says_how_it_went() {
    let scratch = Scratch::new("run");
    let ran = scratch.odyn("run brick.toml").ends_with(0);
    let text = ran.out();
    assert!(text.starts_with("Brick: completed, t = 2000 ms\naudit: constraints "), "{text}");
    assert!(text.contains("  spin "), "{text}");
    assert!(!text.contains('\x1b'), "no colours where there is no terminal");
    assert_eq!(ran.err(), "");
    assert_eq!(scratch.json("results/brick/summary.json")["status"], "completed");
    assert_eq!(scratch.json("results/brick/channels.json")["columns"][0]["unit"], "ms");
    assert_eq!(rows(&scratch.0.join("results/brick/results.csv")), 21);
}

#[test]
fn quiet_is_silent_and_json_is_the_summary() {
    let scratch = Scratch::new("quiet");
    let quiet = scratch.odyn("run brick.toml -q -o out").ends_with(0);
    assert_eq!((quiet.out(), quiet.err()), (String::new(), String::new()));
    let json = scratch.odyn("run brick.toml --json -o out").ends_with(0).json();
    assert_eq!(json, scratch.json("out/summary.json"));
    assert_eq!(json["rows"], 21);
}

#[test]
fn options_change_the_run() {
    let scratch = Scratch::new("options");
    let json = scratch.odyn("run brick.toml --json --t-end 0.5s --tol 1e-6 --set brick.mass=2").ends_with(0).json();
    assert_eq!((&json["t_end"], &json["tolerance"], &json["rows"]), (&500.0.into(), &1e-6.into(), &6.into()));
}

#[test]
fn a_time_to_look_at_may_have_a_unit() {
    let scratch = Scratch::new("at");
    // The scene is in milliseconds.
    let [plain, with_unit, other] = ["500", "0.5s", "0.6s"]
        .map(|at| scratch.odyn(&format!("linearise brick.toml --at {at} --json")).ends_with(0).out());
    assert!(plain == with_unit && plain != other, "{plain}");
    let refused = scratch.odyn("linearise brick.toml --at 0.5kg").ends_with(2);
    assert!(refused.err().contains("such as `0.2 s`"), "{}", refused.err());
}

#[test]
fn verbose_shows_the_plan_on_the_error_stream() {
    let scratch = Scratch::new("verbose");
    let ran = scratch.odyn("run brick.toml -v").ends_with(0);
    assert!(ran.err().contains("island 1: 1 body (brick)"), "{}", ran.err());
    assert!(!ran.out().contains("island"), "{}", ran.out());
}

#[test]
fn an_early_end_keeps_its_results_and_has_its_code() {
    let scratch = Scratch::new("early");
    let ran =
        scratch.odyn("run brick.toml --set simulation.max_steps=3 --set simulation.max_step=150 -o out").ends_with(6);
    assert!(ran.out().contains("stopped early"), "{}", ran.out());
    let summary = scratch.json("out/summary.json");
    assert_eq!((&summary["status"], &summary["code"]), (&"stopped_early".into(), &"ODY0604".into()));
    let written = rows(&scratch.0.join("out/results.csv"));
    assert!(written > 0 && written < 21, "{written} rows");
    assert_eq!(summary["rows"], written);
    let quiet = scratch.odyn("run brick.toml --set simulation.max_steps=3 -q").ends_with(6);
    assert!(quiet.out().is_empty() && quiet.err().contains("stopped early"), "{}", quiet.err());
}

#[test]
fn checks_are_told_and_a_failed_one_has_its_code() {
    let scratch = Scratch::new("checks");
    let check = |name: &str, reference: &str| {
        format!(
            "[[check]]\nname = \"{name}\"\nkind = \"velocity\"\nvalue = \"w1\"\nreference = {reference}\n\
             tolerance = 1e-3\nto = 0\n"
        )
    };
    // The table of the reference is beside the scene, not beside the user.
    fs::create_dir(scratch.0.join("below")).unwrap();
    scratch.file("below/ref.csv", "t,w\n0,10\n");
    let good = check("start", "10") + &check("table", "{ csv = \"ref.csv\", column = \"w\" }");
    scratch.file("below/good.toml", &format!("{BRICK}{}", good.replace("\"w1\"", "\"1000 w1\"")));
    let ran = scratch.odyn("run below/good.toml -o out").ends_with(0);
    assert!(ran.out().contains("  check  largest error  tolerance  at t\n"), "{}", ran.out());
    assert!(ran.out().contains("  ok\n") && !ran.out().contains("FAILED"), "{}", ran.out());
    scratch.file("bad.toml", &format!("{BRICK}{}", check("off", "\"0.5 + t\"")));
    let ran = scratch.odyn("run bad.toml -o out").ends_with(7);
    assert!(ran.out().contains("FAILED"), "{}", ran.out());
    let summary = scratch.json("out/summary.json");
    assert_eq!((&summary["checks"][0]["name"], &summary["checks"][0]["passed"]), (&"off".into(), &false.into()));
    let quiet = scratch.odyn("run bad.toml -q -o out").ends_with(7);
    assert_eq!((quiet.out().as_str(), quiet.err().as_str()), ("", "error: failed checks: off\n"));
}

#[test]
fn an_audit_above_its_limit_has_its_code() {
    let scratch = Scratch::new("audit");
    scratch.odyn("run brick.toml --audit-tol 0.1").ends_with(0);
    let ran = scratch.odyn("run brick.toml --audit-tol 1e-300").ends_with(7);
    assert!(
        ran.out().contains("; above its limits (constraints 1e-300, energy 1e-300, loads 1e-300)"),
        "{}",
        ran.out()
    );
}

#[test]
fn an_inertia_that_no_body_has_is_refused_only_when_strict() {
    let scratch = Scratch::new("strict");
    scratch.file("odd.toml", &BRICK.replace("[1, 2, 2.5]", "[1, 2, 4]"));
    for command in ["run", "check"] {
        scratch.odyn(&format!("{command} odd.toml")).ends_with(0);
        let refused = scratch.odyn(&format!("{command} odd.toml --strict")).ends_with(3);
        assert!(refused.err().contains("ODY0309") && refused.out().is_empty(), "{}", refused.err());
    }
}

#[test]
fn a_check_and_a_plan_are_results() {
    let scratch = Scratch::new("inspect");
    assert!(scratch.odyn("check brick.toml").ends_with(0).out().contains("mobility 6"));
    assert_eq!(scratch.odyn("check brick.toml --json").ends_with(0).json()["report"]["mobility"], 6);
    assert!(scratch.odyn("plan brick.toml").ends_with(0).out().contains("island 1"));
    assert!(scratch.odyn("plan brick.toml --json").ends_with(0).json()["report"]["islands"].is_array());
    assert!(!scratch.0.join("results").exists(), "nothing was run");
}

#[test]
fn mistakes_have_place_and_code() {
    let scratch = Scratch::new("mistakes");
    scratch.file("typo.toml", &BRICK.replace("mass = 1", "mas = 1"));
    let ran = scratch.odyn("run typo.toml --json").ends_with(3);
    assert!(ran.err().contains("typo.toml:10:1"), "{}", ran.err());
    let json = ran.json();
    let typo = json["diagnostics"].as_array().unwrap().iter().find(|one| one["code"] == "ODY0102").unwrap();
    assert_eq!((&typo["line"], &typo["column"], &typo["file"]), (&10.into(), &1.into(), &"typo.toml".into()));
    assert_eq!((&typo["severity"], &json["exit_code"]), (&"error".into(), &3.into()));
    scratch.odyn("run nowhere.toml").ends_with(8);
    scratch.odyn("run brick.toml --method magic").ends_with(3);
    scratch.odyn("run brick.toml --tol zero").ends_with(2);
    scratch.odyn("dance").ends_with(2);
    scratch.odyn("").ends_with(2);
}

#[test]
fn nobody_has_to_read_what_is_said() {
    let scratch = Scratch::new("unread");
    scratch.file("typo.toml", &BRICK.replace("mass = 1", "mas = 1"));
    for (line, code) in [("run typo.toml", 3), ("run brick.toml --verbose", 0)] {
        // As behind `2>&1 | head`.
        let (reader, writer) = std::io::pipe().unwrap();
        drop(reader);
        let (out, err) = (writer.try_clone().unwrap(), writer);
        let ended = scratch.command(line).stdout(out).stderr(err).status().unwrap();
        assert_eq!(ended.code(), Some(code), "{line}");
    }
}

#[test]
fn a_missing_library_has_its_code() {
    let scratch = Scratch::new("library");
    scratch.file("needs.toml", &format!("plugins.libraries = [\"no-such-library\"]\n{BRICK}"));
    let ran = scratch.odyn("run needs.toml").ends_with(4);
    assert!(ran.err().contains("ODY0401") && ran.err().contains("needs.toml:1:"), "{}", ran.err());
    scratch.odyn("elements describe no-such-element").ends_with(4);
}

#[test]
fn packages_that_are_none_and_stores_with_nothing_are_told() {
    let scratch = Scratch::new("packages");
    let bad = scratch.odyn("plugin add brick.toml").ends_with(4);
    assert!(bad.err().contains("ODY0423") && bad.err().contains("brick.toml"), "{}", bad.err());
    scratch.odyn("plugin add not-there.odynplugin --project .").ends_with(4);
    scratch.odyn("plugin add brick.toml --project . --user").ends_with(2);
    assert!(!scratch.0.join(".odyn").exists() && !scratch.0.join("data").exists(), "nothing was written");
    let bad = scratch.odyn("plugin pack brick.toml").ends_with(4);
    assert!(bad.err().contains("ODY0402"), "{}", bad.err());
    let absent = scratch.odyn("plugin remove acme-wobble").ends_with(4);
    assert!(absent.err().contains("ODY0424") && absent.err().contains("odyn plugin list"), "{}", absent.err());
    scratch.odyn("plugin remove acme-wobble@new").ends_with(2);
    assert_eq!(scratch.odyn("plugin verify").ends_with(0).err(), "nothing is installed\n");
    fs::create_dir_all(scratch.0.join(".odyn/plugins/acme-wobble/1.0.0")).unwrap();
    let broken = scratch.odyn("plugin verify acme-wobble").ends_with(4);
    assert!(broken.out().starts_with("acme-wobble 1.0.0: NOT AS INSTALLED\n"), "{}", broken.out());
    let listed = scratch.odyn("plugin list").ends_with(0);
    assert!(listed.out().contains("unusable: ") && listed.out().contains("(project)"), "{}", listed.out());
    assert!(scratch.odyn("plugin list --pins").ends_with(0).out().starts_with("[plugins]\nlibraries = [\n"));
}

/// Runs as often as the scene changes, also after a mistake, and ends with Ctrl-C.
#[cfg(unix)]
#[test]
fn a_watched_scene_runs_again_when_it_changes() {
    let scratch = Scratch::new("watch");
    let told = scratch.0.join("told");
    let mut command = scratch.command("run brick.toml --watch -o out");
    let output = fs::File::create(&told).unwrap();
    let mut run = command.stdout(std::process::Stdio::null()).stderr(output).spawn().unwrap();
    let wait_for = |text: &str, times: usize| {
        for _ in 0..1200 {
            if fs::read_to_string(&told).unwrap().matches(text).count() >= times {
                return;
            }
            std::thread::sleep(std::time::Duration::from_millis(25));
        }
        panic!("no `{text}` in: {}", fs::read_to_string(&told).unwrap());
    };
    wait_for("watching brick.toml", 1);
    assert_eq!(scratch.json("out/summary.json")["rows"], 21);
    scratch.file("brick.toml", &BRICK.replace("mass = 1", "mass = \"1 s\""));
    wait_for("brick.toml changed: running again", 1);
    wait_for("error[ODY0203]", 1);
    wait_for("watching brick.toml", 2);
    scratch.file("brick.toml", &BRICK.replace("t_end = 2000", "t_end = 1000"));
    wait_for("watching brick.toml", 3);
    assert_eq!(scratch.json("out/summary.json")["rows"], 11);
    let sent = Command::new("kill").args(["-INT", &run.id().to_string()]).status().unwrap();
    assert!(sent.success());
    assert_eq!(run.wait().unwrap().code(), Some(130));
}

#[test]
fn the_schema_is_printed_or_written() {
    let scratch = Scratch::new("schema");
    let printed = scratch.odyn("schema brick.toml").ends_with(0).json();
    assert_eq!(printed["$schema"], "https://json-schema.org/draft/2020-12/schema");
    assert_eq!(printed["properties"]["simulation"]["required"][0], "t_end");
    // The scene names no library.
    assert_eq!(printed["properties"]["joint"]["items"]["properties"]["type"]["enum"], serde_json::json!([]));
    scratch.odyn("schema brick.toml -o scene.json").ends_with(0);
    assert_eq!(scratch.json("scene.json"), printed);
    scratch.odyn("schema -o .").ends_with(8);
    scratch.odyn("schema nowhere.toml").ends_with(8);
}

#[test]
fn shells_and_manuals_know_the_commands() {
    let scratch = Scratch::new("shell");
    for shell in ["bash", "zsh", "fish", "powershell"] {
        let script = scratch.odyn(&format!("completions {shell}")).ends_with(0).out();
        assert!(script.contains("odyn") && script.contains("audit-tol"), "{shell}: {script}");
    }
    scratch.odyn("completions tcl").ends_with(2);
    assert!(scratch.odyn("man").ends_with(0).out().contains(".TH odyn 1"));
    scratch.odyn("man -o pages").ends_with(0);
    let page = fs::read_to_string(scratch.0.join("pages/odyn-run.1")).unwrap();
    assert!(page.contains("odyn run scenes/compressor.toml"), "{page}");
    assert!(scratch.0.join("pages/odyn-elements-describe.1").is_file());
}

#[test]
fn results_that_cannot_be_written_have_their_code() {
    let scratch = Scratch::new("blocked");
    let ran = scratch.odyn("run brick.toml -o brick.toml").ends_with(8);
    assert!(ran.err().contains("ODY0801") && ran.err().contains("brick.toml"), "{}", ran.err());
}

#[test]
fn a_study_leaves_its_table_and_has_the_code_of_its_first_failure() {
    let scratch = Scratch::new("study");
    let ran = scratch.odyn("study brick.toml --vary brick.mass=1:2:3 --jobs 2 --results").ends_with(0);
    assert!(ran.out().ends_with("table: results/brick-study/study.csv\n"), "{}", ran.out());
    assert!(ran.err().contains("3/3 brick.mass="), "{}", ran.err());
    let table = fs::read_to_string(scratch.0.join("results/brick-study/study.csv")).unwrap();
    assert!(table.starts_with("run,brick.mass,status,problem,figure.spin"), "{table}");
    assert_eq!(rows(&scratch.0.join("results/brick-study/study.csv")), 3);
    assert_eq!(rows(&scratch.0.join("results/brick-study/run-2/results.csv")), 21);
    let ran = scratch.odyn("study brick.toml --vary brick.mass=1,-1 --json").ends_with(3);
    assert_eq!(ran.json()["rows"][1][2], "failed");
    assert!(ran.err().contains("brick.mass=-1: failed"), "{}", ran.err());
    let ran = scratch.odyn("study brick.toml --vary brick.mass=1,2 -o brick.toml").ends_with(8);
    assert!(ran.err().contains("ODY0801"), "{}", ran.err());
    let ran = scratch.odyn("study brick.toml --vary brick.mass").ends_with(2);
    assert!(ran.err().contains("no `=`"), "{}", ran.err());
}

#[test]
fn tables_are_compared() {
    let scratch = Scratch::new("compare");
    scratch.odyn("run brick.toml -o a -q").ends_with(0);
    scratch.odyn("run brick.toml -o b -q --set brick.angular_velocity=[0.011,5,0.01]").ends_with(0);
    assert!(scratch.odyn("compare a a/results.csv --tol 0").ends_with(0).out().contains("w1"));
    let apart = scratch.odyn("compare a b --tol 1e-6").ends_with(7);
    assert!(apart.err().contains("beyond 1e-6: w1"), "{}", apart.err());
    scratch.odyn("compare a b").ends_with(0);
    assert!(scratch.odyn("compare a b --json").ends_with(0).json()["columns"][0]["relative"].is_number());
    scratch.odyn("compare a nowhere").ends_with(8);
}

#[test]
fn a_table_that_lacks_what_it_is_judged_by_does_not_pass() {
    let scratch = Scratch::new("compare-missing");
    scratch.odyn("run brick.toml -o whole -q").ends_with(0);
    let table = fs::read_to_string(scratch.0.join("whole/results.csv")).unwrap();
    let lines: Vec<&str> = table.lines().collect();
    fs::write(scratch.0.join("short.csv"), lines[..lines.len() - 2].join("\n") + "\n").unwrap();
    let wider: Vec<String> = (lines.iter().enumerate())
        .map(|(k, line)| format!("{line},{}", if k == 0 { "more".into() } else { k.to_string() }))
        .collect();
    fs::write(scratch.0.join("wide.csv"), wider.join("\n") + "\n").unwrap();
    let short = scratch.odyn("compare short.csv wide.csv --tol 0").ends_with(7);
    assert!(short.err().contains("A lacks of B: 2 rows, column more"), "{}", short.err());
    scratch.odyn("compare short.csv wide.csv --tol 0 --allow-missing").ends_with(0);
    scratch.odyn("compare wide.csv short.csv --tol 0").ends_with(0);
    scratch.odyn("compare short.csv wide.csv").ends_with(0);
    scratch.odyn("compare short.csv wide.csv --allow-missing").ends_with(2);
}

#[test]
fn codes_are_explained() {
    let scratch = Scratch::new("explain");
    assert!(scratch.odyn("explain ody0203").ends_with(0).out().starts_with("ODY0203: "));
    assert!(scratch.odyn("explain").ends_with(0).out().lines().count() > 60);
    assert!(scratch.odyn("explain ODY0299").ends_with(2).err().contains("no code or remedy `ODY0299`"));
}

#[cfg(unix)]
#[test]
fn an_interrupt_leaves_valid_results() {
    leaves_valid_results("INT");
}

/// As the end of a job's time has it.
#[cfg(unix)]
#[test]
fn being_asked_to_end_leaves_valid_results() {
    leaves_valid_results("TERM");
}

#[cfg(unix)]
fn leaves_valid_results(signal: &str) {
    let scratch = Scratch::new(&format!("interrupt-{signal}"));
    // Far more than any machine computes while this test waits.
    let mut command = scratch.command("run brick.toml --t-end 1e9 -o out --set simulation.max_steps=2000000000");
    let mut run = command.stdout(std::process::Stdio::null()).stderr(std::process::Stdio::null()).spawn().unwrap();
    let table = scratch.0.join("out/results.csv");
    for _ in 0..600 {
        if rows(&table) > 0 {
            break;
        }
        std::thread::sleep(std::time::Duration::from_millis(50));
    }
    let sent = Command::new("kill").args([&format!("-{signal}"), &run.id().to_string()]).status().unwrap();
    assert!(sent.success());
    assert_eq!(run.wait().unwrap().code(), Some(130));
    let summary = scratch.json("out/summary.json");
    assert_eq!((&summary["status"], &summary["code"]), (&"stopped_early".into(), &"ODY0603".into()));
    assert_eq!(summary["rows"], rows(&table));
    let text = fs::read_to_string(&table).unwrap();
    assert!(text.ends_with('\n') && text.lines().all(|line| line.split(',').count() == 2));
}

/// A stone that flies straight on, at a speed that a check gets right or wrong.
fn flight(checked_speed: f64) -> String {
    format!(
        r#"
title = "Flight"
[simulation]
t_end = 1
output_step = 0.1
[[body]]
name = "stone"
mass = 1
inertia = [1, 1, 1]
velocity = [2, 0, 0]
[[output]]
name = "x"
quantity = "position"
of = "stone"
component = "x"
[[check]]
name = "straight on"
kind = "position"
value = "x"
reference = "{checked_speed} t"
tolerance = 1e-9
"#
    )
}

#[test]
fn verify_goes_through_all_scenes_and_writes_the_manual() {
    let scratch = Scratch::new("verify");
    fs::create_dir_all(scratch.0.join("scenes/verification")).unwrap();
    scratch.file("scenes/verification/flight.toml", &flight(2.0));
    let good = scratch.odyn("verify").ends_with(0);
    assert_eq!(good.err(), "1/1 flight: ok\n");
    assert!(good.out().contains("1 scene, all ok"), "{}", good.out());
    let manual = fs::read_to_string(scratch.0.join("results/verification/index.html")).unwrap();
    assert!(manual.contains("<h3>Flight</h3>") && manual.matches("<svg").count() == 2, "{manual}");

    scratch.file("scenes/verification/broken.toml", "title = 1");
    scratch.file("scenes/verification/wrong.toml", &flight(2.5));
    let bad = scratch.odyn("verify --quick -o manual").ends_with(7);
    for told in
        ["wrong: `straight on`: off by 0.5 m at t = 1 s, allowed 1e-9", "broken: error[ODY", "3 scenes, 2 FAILED"]
    {
        assert!(bad.out().contains(told), "`{told}` is not in {}", bad.out());
    }
    // Scenes run side by side and are reported as they end.
    assert!(bad.err().contains("/3 flight: ok") && bad.err().contains("3/3 "), "{}", bad.err());
    let manual = fs::read_to_string(scratch.0.join("manual/index.html")).unwrap();
    assert!(manual.contains("2 scenes failed"), "{manual}");

    scratch.odyn("verify scenes/verification/flight.toml --quick").ends_with(0);
    scratch.odyn("verify nowhere").ends_with(8);
}

#[test]
fn a_new_crate_is_told_with_the_next_commands() {
    let scratch = Scratch::new("plugin-new");
    let made = scratch.odyn("plugin new acme-rod --kind joint --api 1.0").ends_with(0);
    assert!(made.out().starts_with("acme-rod: a library of elements, `acme-rod`\n"), "{}", made.out());
    for command in
        ["cd acme-rod", "cargo test", "cargo build --release", "odyn run scene.toml", "odyn plugin check target/"]
    {
        assert!(made.out().contains(command), "{}", made.out());
    }
    assert!(scratch.0.join("acme-rod/src/lib.rs").is_file());
    let again = scratch.odyn("plugin new acme-rod --api 1.0").ends_with(8);
    assert!(again.err().contains("ODY0425") && again.err().contains("exists already"), "{}", again.err());
    let keyword = scratch.odyn("plugin new loop --api 1.0").ends_with(2);
    assert!(keyword.err().contains("for example `loop-element`"), "{}", keyword.err());
    let nowhere = scratch.odyn("plugin new rod --api nowhere").ends_with(2);
    assert!(nowhere.err().contains("is not the folder of `element-api`"), "{}", nowhere.err());
    assert!(!scratch.0.join("rod").exists());
}

#[test]
fn a_file_that_is_no_library_is_not_examined() {
    let scratch = Scratch::new("plugin-check");
    let refused = scratch.odyn("plugin check ./brick.toml --json").ends_with(4);
    assert_eq!(refused.json()["diagnostics"][0]["code"], "ODY0402");
    scratch.odyn("plugin check nothing-of-this-name").ends_with(4);
}

#[test]
fn an_output_that_would_stand_beside_the_time_is_refused() {
    let scratch = Scratch::new("output-t");
    scratch.file(
        "t.toml",
        &support::BRICK.replace("name = \"w1\"", "name = \"t\"").replace("channel = \"w1\"", "channel = \"t\""),
    );
    let ran = scratch.odyn("check t.toml").ends_with(3);
    for words in ["ODY0108", "an output cannot be called `t`", "t.toml:14", "choose another name"] {
        assert!(ran.err().contains(words), "{words}: {}", ran.err());
    }
}

#[cfg(target_os = "linux")]
#[test]
fn what_a_library_prints_does_not_reach_standard_output() {
    let scratch = Scratch::new("printing");
    let library = scratch.0.join("libprinting.so");
    let source = support::root().join("tests/fixtures/c-plugin/printing.c");
    let mut cc = std::process::Command::new("cc");
    cc.args(["-std=c99", "-D_POSIX_C_SOURCE=200809L", "-fPIC", "-shared", "-I"])
        .arg(support::root().join("element-api/include"));
    match cc.arg("-o").arg(&library).arg(&source).status() {
        Err(_) if std::env::var_os("ODYN_SKIP_C").is_some() => return,
        Err(error) => panic!("`cc`: {error}; set ODYN_SKIP_C=1 to leave out the tests that need a C compiler"),
        Ok(status) => assert!(status.success()),
    }
    let force = "[[force]]\nname = \"drag\"\ntype = \"loud-drag\"\nbodies = [\"brick\"]\n";
    scratch.file("loud.toml", &format!("{}[plugins]\nlibraries = [\"printing\"]\n{force}", support::BRICK));
    for line in [
        "run loud.toml --json -o out",
        "check loud.toml --json",
        "study loud.toml --vary brick.mass=1,2 --json -o study",
    ] {
        for side in ["", "--in-process"] {
            let ran = scratch.odyn(&format!("{line} --plugin . {side}")).ends_with(0);
            assert!(ran.json().is_object(), "{line}");
            assert!(!ran.out().contains("by a library"), "{line}");
            // Behind glass, its code runs only where its answers are not known.
            for words in ["printed by a library: create", "written by a library"] {
                assert!(side.is_empty() || ran.err().contains(words), "{line}: {}", ran.err());
            }
        }
    }
}

#[test]
fn what_is_exported_as_c_is_warned_of_and_written_over_with_care() {
    let scratch = Scratch::new("export-c");
    let ran = scratch.odyn("export c brick.toml -o c --step 1000 --json").ends_with(0);
    assert!(ran.err().contains("ODY0842") && ran.json()["files"].is_array(), "{}", ran.err());
    scratch.odyn("export c brick.toml -o c --step 10").ends_with(0);
    fs::write(scratch.0.join("c/main.c"), "/* mine */\n").unwrap();
    let refused = scratch.odyn("export c brick.toml -o c --step 10").ends_with(8);
    assert!(
        refused.err().contains("c/main.c is there already") && refused.err().contains("--force"),
        "{}",
        refused.err()
    );
    assert_eq!(fs::read_to_string(scratch.0.join("c/main.c")).unwrap(), "/* mine */\n");
    scratch.odyn("export c brick.toml -o c --step 10 --force").ends_with(0);
    assert!(fs::read_to_string(scratch.0.join("c/main.c")).unwrap().contains("main(int argc"));
}

#[test]
fn parameters_are_exported_with_their_ranges() {
    let scratch = Scratch::new("export-ranges");
    let text = fs::read_to_string(scratch.0.join("brick.toml")).unwrap();
    scratch.file(
        "brick.toml",
        &format!("parameters.J = \"1 kg m^2\"\n{}", text.replace("[1, 2, 2.5]", "[\"J\", 2, 2.5]")),
    );
    let ran = scratch.odyn("export c brick.toml -o c --step 10 --parameters all").ends_with(0);
    assert!(ran.out().contains("parameters: J (0.5 to 2.0 kg m^2)\n"), "{}", ran.out());
    let header = fs::read_to_string(scratch.0.join("c/brick.h")).unwrap();
    assert!(header.contains("/* J [kg m^2] parameter of the scene, 0.5 to 2.0 kg m^2 */"), "{header}");
    let json = scratch.odyn("export c brick.toml -o d --step 10 --parameters all --json").ends_with(0).json();
    assert_eq!(json["parameter_ranges"], serde_json::json!([[0.5, 2.0]]));
}

#[test]
fn commands_that_are_shown_can_be_given() {
    let scratch = Scratch::new("blanks");
    let ran = Ran(scratch.command("run brick.toml -o").arg("the results").output().unwrap()).ends_with(0);
    assert!(ran.out().ends_with("to see it: odyn report 'the results'\n"), "{}", ran.out());
}

#[test]
fn a_motion_is_written_where_it_is_asked_for_and_exported() {
    let scratch = Scratch::new("motion");
    scratch.odyn("run brick.toml -q -o plain").ends_with(0);
    scratch.odyn("run brick.toml -q -o shown --motion").ends_with(0);
    let table = |folder: &str| fs::read(scratch.0.join(folder).join("results.csv")).unwrap();
    assert_eq!(table("plain"), table("shown"));
    assert!(!scratch.0.join("plain/motion.bin").exists());
    let ran = scratch.odyn("export glb shown").ends_with(0);
    assert!(ran.out().ends_with("motion.glb: 1 body in motion, 21 samples\n"), "{}", ran.out());
    assert_eq!(&fs::read(scratch.0.join("shown/motion.glb")).unwrap()[..4], b"glTF");
    scratch.odyn("export glb shown -o other.glb --speed 0.1").ends_with(0);
    assert!(scratch.0.join("other.glb").exists());
    let none = scratch.odyn("export glb plain").ends_with(8);
    assert!(none.err().contains("motion.bin") && none.err().contains("--motion"), "{}", none.err());
    scratch.odyn("export glb shown --speed 0").ends_with(2);
}
