//! The program with libraries behind glass: whatever they do, it ends with the results of a kind library or with a message that
//! names them; and kind libraries give the same bits on both sides.
#![cfg(all(feature = "cli", target_os = "linux"))]
#![allow(clippy::unwrap_used)] // in a test, the panic is the message

// Builds libraries as strangers do.
#[allow(dead_code)] // each test program uses a part
#[path = "../../tests/fixtures.rs"]
mod fixtures;
mod support;

use std::fs;
use std::net::TcpListener;
use std::path::Path;

use support::{Ran, Scratch, root};

const HOSTILE: &str = include_str!("../../tests/fixtures/hostile-plugin/scene.toml");

/// Runs the scene with these parameters of the hostile force.
fn hostile(scratch: &Scratch, params: &str, options: &str) -> Ran {
    scratch.file("scene.toml", &HOSTILE.replace("PARAMS", params));
    let libraries = fixtures::build("hostile-plugin");
    let mut command = scratch.command(&format!("run scene.toml -o out {options}"));
    Ran(command.arg("--plugin").arg(libraries).output().unwrap())
}

/// One misbehaviour in three places. `judge` gets each.
fn in_places(does: &str, judge: impl Fn(&str, &Scratch, &Ran)) {
    let listening = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = listening.local_addr().unwrap().port();
    for place in ["new", "wrench", "drop"] {
        let scratch = Scratch::new(&format!("hostile-{does}-{place}"));
        scratch.file("there.txt", "still the same");
        let file = scratch.0.join("there.txt");
        let params = format!("does = '{does}', place = '{place}', port = {port}, file = '{}'", file.display());
        let ran = hostile(&scratch, &params, "--watchdog 2");
        assert!(!ran.err().contains("nothing kept it"), "{does} in {place}: {}", ran.err());
        assert_eq!(fs::read_to_string(&file).unwrap(), "still the same");
        judge(place, &scratch, &ran);
    }
}

/// What a kind library gives.
fn kind() -> Vec<u8> {
    let scratch = Scratch::new("hostile-kind");
    hostile(&scratch, "does = 'nothing'", "").ends_with(0);
    fs::read(scratch.0.join("out/results.csv")).unwrap()
}

#[test]
fn who_breaks_its_process_is_named() {
    for (does, how) in [
        ("exit", "ended its process in"),
        ("_exit", "ended its process in"),
        ("quick_exit", "ended its process in"),
        ("exit-thread", "ended its process in"),
        ("kill-itself", "ended its process in"),
        ("abort", "crashed in"),
        ("read-nowhere", "crashed in"),
        ("write-nowhere", "crashed in"),
        ("recurse", "crashed in"),
        ("ignore-and-crash", "crashed in"),
        ("memory", "crashed in"),
        // Whether somebody notices is up to the standard library.
        ("close", "ended its process in|crashed in"),
        ("garbage", "answered nonsense in"),
    ] {
        in_places(does, |place, _, ran| {
            let function = match place {
                "new" => "`create`",
                "wrench" => "`record`",
                // The equations were recorded by then.
                _ => return assert!(ran.0.status.success(), "{does}: {}", ran.err()),
            };
            assert_eq!(ran.0.status.code(), Some(4), "{does} in {place}: {}", ran.err());
            let named = how.split('|').any(|how| ran.err().contains(&format!("its code {how} {function}")));
            assert!(named, "{does} in {place}: {}", ran.err());
            assert!(ran.err().contains("hostile-plugin/hostile"), "{does} in {place}: {}", ran.err());
            assert_eq!(ran.err().matches("error[").count(), 1, "{does} in {place}: {}", ran.err());
        });
    }
}

#[test]
fn who_does_not_come_back_is_named() {
    for does in ["spin", "sleep", "stop-itself", "block-signals-and-spin", "long-answer"] {
        in_places(does, |place, _, ran| {
            if place != "drop" {
                assert_eq!(ran.0.status.code(), Some(4), "{does} in {place}: {}", ran.err());
                assert!(ran.err().contains("hostile-plugin/hostile"), "{does} in {place}: {}", ran.err());
            }
        });
    }
}

/// The network, other processes, and files to change.
#[test]
fn who_reaches_out_is_named() {
    let kind = kind();
    for does in [
        "write-file",
        "new-file",
        "remove",
        "rights",
        "rename",
        "connect",
        "datagram",
        "start",
        "system",
        "fork",
        "kill",
        "kill-group",
        "trace",
        "limits",
    ] {
        in_places(does, |place, scratch, ran| {
            let function = match place {
                "new" => "`create`",
                "wrench" => "`record`",
                _ => {
                    assert_eq!(ran.0.status.code(), Some(0), "{does}: {}", ran.err());
                    return assert_eq!(fs::read(scratch.0.join("out/results.csv")).unwrap(), kind, "{does}");
                }
            };
            assert_eq!(ran.0.status.code(), Some(4), "{does} in {place}: {}", ran.err());
            let named = ran.err().contains(&format!("its code reached out of its process in {function}"));
            assert!(named && ran.err().contains("hostile-plugin/hostile"), "{does} in {place}: {}", ran.err());
        });
    }
}

/// What libraries do in good faith fails, or has no effect.
#[test]
fn who_reaches_out_reaches_nothing() {
    let kind = kind();
    for does in [
        "listen",
        "alarm",
        "print",
        "print-much",
        "folder",
        "variables",
        "read-file",
        "list",
        "local",
        "owner",
        "memory-of-others",
        "thread",
        "time",
        "flush",
    ] {
        in_places(does, |place, scratch, ran| {
            assert_eq!(ran.0.status.code(), Some(0), "{does} in {place}: {}", ran.err());
            assert_eq!(fs::read(scratch.0.join("out/results.csv")).unwrap(), kind, "{does} in {place}");
            assert!(ran.err().lines().count() < 120, "{does} in {place}: {}", ran.err());
            assert!(!ran.err().contains('\u{1b}'), "{does} in {place}: {}", ran.err());
        });
    }
}

#[test]
fn numbers_under_another_rounding_mode_or_with_traps_are_refused() {
    let scratch = Scratch::new("hostile-round");
    for (does, place) in [("round", "new"), ("round", "wrench"), ("traps", "new"), ("traps", "wrench")] {
        let ran = hostile(&scratch, &format!("does = '{does}', place = '{place}'"), "").ends_with(4);
        assert!(ran.err().contains("changed rounding, denormals or traps"), "{}", ran.err());
    }
}

#[test]
fn who_ends_the_process_while_it_is_loaded_is_named() {
    let folder = support::kept("strangers").join("hostile-at-load");
    let change = |source: String| source.replace("AT_LOAD: bool = false", "AT_LOAD: bool = true");
    let libraries = fixtures::build_changed("hostile-plugin", "hostile-at-load", &folder, &change);
    let scratch = Scratch::new("hostile-load");
    scratch.file(
        "scene.toml",
        &HOSTILE.replace("PARAMS", "does = 'nothing'").replace("hostile-plugin", "hostile-at-load"),
    );
    let ran = Ran(scratch.command("run scene.toml").arg("--plugin").arg(libraries).output().unwrap()).ends_with(4);
    assert!(ran.err().contains("its code ended its process in `loading the library`"), "{}", ran.err());
    assert!(ran.err().contains("hostile-at-load"), "{}", ran.err());
}

/// The tables of results of a scene with its libraries on this side of the glass and behind it.
#[track_caller]
fn same_on_both_sides(scratch: &Scratch, scene: &Path, libraries: &Path) {
    let run = |out: &str, options: &str| {
        let mut command = scratch.command(&format!("run {} -o {out} --quiet {options}", scene.display()));
        Ran(command.arg("--plugin").arg(libraries).output().unwrap()).ends_with(0);
        fs::read(scratch.0.join(out).join("results.csv")).unwrap()
    };
    assert_eq!(run("here", "--in-process"), run("behind", ""), "{}", scene.display());
}

#[test]
fn results_are_the_same_bits_on_both_sides() {
    let scratch = Scratch::new("sides");
    // Elsewhere than beside the program.
    let libraries = scratch.0.join("libraries");
    fs::create_dir(&libraries).unwrap();
    let program = Path::new(env!("CARGO_BIN_EXE_odyn")).parent().unwrap();
    for name in ["joints", "forces", "controls", "compressor"] {
        let file = format!("libodyn_{name}.so");
        let built = [program.join(&file), program.join("deps").join(&file)].into_iter().find(|path| path.is_file());
        if let Some(built) = built {
            fs::copy(built, libraries.join(&file)).unwrap();
        }
    }
    assert!(libraries.join("libodyn_compressor.so").is_file(), "not built");
    same_on_both_sides(&scratch, &root().join("scenes/compressor.toml"), &libraries);
    // Elements that are called.
    let stubborn = include_str!("../../tests/fixtures/stubborn-plugin/scene.toml");
    scratch.file("called.toml", &stubborn.replace("PARAMS", "does = 'nothing', place = 'nowhere'"));
    same_on_both_sides(&scratch, &scratch.0.join("called.toml"), &fixtures::build("stubborn-plugin"));
}

/// Nothing of a library runs where its answers are known; other parameters are other questions.
#[test]
fn a_second_start_asks_nobody() {
    let scratch = Scratch::new("glass-second");
    let run = |file: &str| {
        let params = format!("does = 'print', file = '{}-{file}'", scratch.0.display());
        scratch.file("scene.toml", &HOSTILE.replace("PARAMS", &params));
        let mut command = scratch.command("run scene.toml -o out");
        command.env("XDG_CACHE_HOME", scratch.0.join("cache")).env("HOME", &scratch.0);
        command.arg("--plugin").arg(fixtures::build("hostile-plugin"));
        let ran = Ran(command.output().unwrap()).ends_with(0);
        (ran.err().contains("`hostile-plugin` prints: hello"), fs::read(scratch.0.join("out/results.csv")).unwrap())
    };
    let (first, second, other) = (run("a"), run("a"), run("b"));
    assert_eq!((first.0, second.0, other.0), (true, false, true));
    assert_eq!(first.1, second.1);
    // What is kept, but damaged, is asked for again.
    for entry in fs::read_dir(scratch.0.join("cache/odyn/plugins")).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|ending| ending == "recorded") {
            let mut bytes = fs::read(&path).unwrap();
            bytes.truncate(bytes.len() - 3);
            fs::write(&path, bytes).unwrap();
        }
    }
    assert_eq!(run("a"), first);
}

/// Libraries of the program are loaded when something is asked that is not known. Whatever is kept, results are the same bits.
#[test]
fn own_libraries_are_loaded_when_they_are_needed() {
    let scratch = Scratch::new("own-libraries");
    let scene = root().join("scenes/compressor.toml");
    let cache = scratch.0.join("cache");
    let run = |options: &str| {
        let mut command = scratch.command(&format!("run {} -o out --quiet {options}", scene.display()));
        // The system's loader reports what it loads.
        command.env("XDG_CACHE_HOME", &cache).env("HOME", &scratch.0).env("LD_DEBUG", "files");
        let ran = Ran(command.output().unwrap()).ends_with(0);
        (ran.err().contains("cache/odyn/plugins"), fs::read(scratch.0.join("out/results.csv")).unwrap())
    };
    let (first, second) = (run(""), run(""));
    assert_eq!((first.0, second.0), (true, false));
    assert!(first.1 == second.1);
    let here = run("--in-process");
    assert!(here.0 && here.1 == first.1);
    let kept = || -> Vec<_> {
        let entries = fs::read_dir(cache.join("odyn/plugins")).unwrap().map(|entry| entry.unwrap().path());
        let mut paths: Vec<_> = entries.filter(|path| path.extension().is_some_and(|end| end == "recorded")).collect();
        paths.sort();
        paths
    };
    assert!(kept().len() > 5, "{:?}", kept());
    for damage in ["checksum", "end", "cut", "empty", "other"] {
        let contents: Vec<Vec<u8>> = kept().iter().map(|path| fs::read(path).unwrap()).collect();
        for (k, path) in kept().iter().enumerate() {
            let mut bytes = contents[k].clone();
            let last = bytes.len() - 1;
            match damage {
                "checksum" => bytes[3] ^= 1,
                "end" => bytes[last] ^= 1,
                "cut" => bytes.truncate(last),
                "empty" => bytes.clear(),
                // Whole, and the answer to another question.
                _ => bytes.clone_from(&contents[(k + 1) % contents.len()]),
            }
            fs::write(path, bytes).unwrap();
        }
        let (damaged, mended) = (run(""), run(""));
        assert_eq!((damaged.0, mended.0), (true, false), "{damage}");
        assert!(damaged.1 == first.1 && mended.1 == first.1, "{damage}");
    }
}

/// Whatever bytes a library has: the system's loader, the layout check or its own code may break on them, the program does not.
#[test]
fn damaged_libraries_break_their_own_process_only() {
    let scratch = Scratch::new("glass-damaged");
    scratch.file("scene.toml", &HOSTILE.replace("PARAMS", "does = 'nothing'"));
    let built = fs::read(fixtures::file(&fixtures::build("hostile-plugin"), "hostile-plugin")).unwrap();
    let library = fixtures::file(&scratch.0, "hostile-plugin");
    let mut state = 2463534242_u64;
    let mut random = move |below: usize| {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        usize::try_from(state % below as u64).unwrap()
    };
    let mut codes = std::collections::BTreeMap::new();
    for k in 0..120 {
        let mut bytes = built.clone();
        // Single bytes, runs of them, and zeros; near the tables of the loader at the front, and anywhere.
        let (near, anywhere) = (random(bytes.len().min(100_000)), random(bytes.len()));
        let at = if k % 2 == 0 { near } else { anywhere };
        let length = [1, 8, 64, 4096][k % 4];
        for byte in bytes.iter_mut().skip(at).take(length) {
            *byte = if k % 3 == 0 { 0 } else { random(256) as u8 };
        }
        fs::write(&library, bytes).unwrap();
        let ran = Ran(scratch.command("run scene.toml -o out --watchdog 5 --plugin .").output().unwrap());
        let code = ran.0.status.code();
        assert!(matches!(code, Some(0 | 3 | 4 | 6 | 7)), "{k}: {:?}: {}", ran.0.status, ran.err());
        *codes.entry(code).or_insert(0) += 1;
    }
    assert!(codes.len() > 1, "{codes:?}");
}

/// Called elements: the one that broke the process is named, not the first one of its type.
#[test]
fn a_called_element_is_named() {
    let scene = include_str!("../../tests/fixtures/stubborn-plugin/scene.toml");
    let scratch = Scratch::new("glass-called");
    for (does, place, how) in [
        ("abort", "wrench", "its code crashed in `evaluate`, SIGABRT"),
        ("read", "wrench", "its code crashed in `evaluate`, SIGSEGV"),
        ("exit", "wrench", "its code ended its process in `evaluate`"),
        ("exit", "accept", "its code ended its process in `accept`"),
        ("round", "accept", "changed rounding, denormals or traps"),
    ] {
        scratch
            .file("scene.toml", &scene.replace("PARAMS", &format!("does = '{does}', place = '{place}', after = 30")));
        let mut command = scratch.command("run scene.toml -o out");
        let ran = Ran(command.arg("--plugin").arg(fixtures::build("stubborn-plugin")).output().unwrap()).ends_with(4);
        assert!(ran.err().contains(how), "{}", ran.err());
        assert!(does == "round" || ran.err().contains("`it` (stubborn-plugin/stubborn)"), "{}", ran.err());
        assert!(fs::read_to_string(scratch.0.join("out/results.csv")).unwrap().lines().count() > 1);
    }
}

/// The word of who sends a scene with a library is not the user's.
#[test]
fn who_trusts_runs_a_library_in_the_process() {
    let scratch = Scratch::new("glass-trust");
    let libraries = fixtures::build("hostile-plugin");
    let scene = |plugins: &str| {
        let head = format!("libraries = [\"hostile-plugin\"]\n{plugins}");
        HOSTILE.replace("PARAMS", "does = 'variables'").replace("libraries = [\"hostile-plugin\"]", &head)
    };
    let named = |plugins: &str, options: &str| {
        scratch.file("scene.toml", &scene(plugins));
        scratch.odyn(&format!("run scene.toml -o out {options}"))
    };
    let given = format!("--plugin {}", libraries.display());
    let sees_variables = |ran: &Ran| ran.err().contains("nothing kept it from that");
    assert!(sees_variables(&named("trust = [\"hostile-plugin\"]", &given)));
    assert!(sees_variables(&named("", &format!("{given} --in-process"))));
    assert!(!sees_variables(&named("", &given)));
    let came_along = format!("path = ['{}']\ntrust = [\"hostile-plugin\"]", libraries.display());
    assert!(!sees_variables(&named(&came_along, "")));
    let wrong = named("trust = [\"hostile\"]", &given).ends_with(3);
    assert!(wrong.err().contains("`hostile` is not one of the `libraries`"), "{}", wrong.err());
}

/// An FMU that crashes ends its process, not the program; a kind one gives the same bits on both sides, and also after its state was
/// carried from one process to another.
#[test]
fn fmus_are_behind_glass() {
    let scratch = Scratch::new("glass-fmu");
    let library = scratch.0.join("model.so");
    let built = std::process::Command::new("cc")
        .args(["-std=c99", "-O1", "-fPIC", "-shared", "-o"])
        .args([&library, &root().join("tests/fmu/model.c")])
        .arg("-lm")
        .status();
    if built.is_err() {
        assert!(
            std::env::var_os("ODYN_SKIP_C").is_some(),
            "there is no compiler `cc`; set ODYN_SKIP_C=1 to leave out what needs it"
        );
        return;
    }
    assert!(built.unwrap().success());
    let text = fs::read_to_string(root().join("tests/fmu/two.xml")).unwrap();
    let binary = fs::read(&library).unwrap();
    let files = [
        ("modelDescription.xml".to_string(), text.as_bytes()),
        ("binaries/linux64/model.so".to_string(), binary.as_slice()),
    ];
    fs::write(scratch.0.join("model.fmu"), odyn::results::zip(&files, odyn::results::Packing::Deflated).unwrap())
        .unwrap();
    scratch.file(
        "scene.toml",
        r#"
[plugins]
libraries = ["odyn-joints", "odyn-forces"]
[simulation]
t_end = 0.5
output_step = 0.025
[[body]]
name = "carriage"
mass = 2
inertia = [1, 1, 1]
[[joint]]
name = "rail"
type = "translational"
bodies = ["ground", "carriage"]
point = [0, 0, 0]
axis = [1, 0, 0]
[[force]]
name = "motor"
type = "translational-actuator"
bodies = ["ground", "carriage"]
axis = [1, 0, 0]
inputs = { signal = "controller.u" }
params.along = "axis"
[[output]]
name = "x"
quantity = "position"
of = "carriage"
component = "x"
[[control]]
name = "controller"
type = "fmu"
inputs = { set_point = 1, measured = "x" }
params = { file = "model.fmu", period = 0.01, parameters = { kp = 40.0, ki = 30.0 } }
"#,
    );
    scratch.odyn("run scene.toml -o glass").ends_with(0);
    scratch.odyn("--in-process run scene.toml -o here").ends_with(0);
    let table = |folder: &str| fs::read(scratch.0.join(folder).join("results.csv")).unwrap();
    assert_eq!(table("glass"), table("here"));
    scratch.odyn("run scene.toml -o half --t-end 0.25").ends_with(0);
    scratch.odyn("run scene.toml -o rest --from half").ends_with(0);
    let last = |folder: &str| {
        let text = String::from_utf8(table(folder)).unwrap();
        text.lines().last().unwrap().split(',').nth(1).unwrap().parse::<f64>().unwrap()
    };
    assert!((last("rest") - last("here")).abs() < 1e-9, "{} {}", last("rest"), last("here"));
    let crashed = scratch.odyn("run scene.toml -o crashed --set controller.params.parameters.fault=7");
    for word in ["ODY0413", "`controller` (model.fmu/fmu)", "crashed in `communicate`", "SIGSEGV"] {
        assert!(crashed.err().contains(word), "{word}: {}", crashed.err());
    }
    assert!(String::from_utf8(table("crashed")).unwrap().lines().count() >= 5, "rows so far");
}
