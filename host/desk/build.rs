//! Bundles the scripts of the page, if that is possible here. Without them a report has its plots as drawings and no motion.

use std::env;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// What is bundled, as files of this crate.
const SOURCES: [&str; 3] = ["page/package.json", "page/package-lock.json", "page/.npmrc"];

/// What is made of them: the scripts of a report, and of the studio.
const BUNDLES: [&str; 2] = ["report.js", "studio.js"];

fn main() {
    println!("cargo:rerun-if-env-changed=ODYN_DESK");
    println!("cargo:rerun-if-changed=page/src");
    SOURCES.iter().for_each(|file| println!("cargo:rerun-if-changed={file}"));
    let out = PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets it"));
    let bundles = bundle(&out).unwrap_or_else(|reason| {
        println!(
            "cargo:warning=reports will have their plots as drawings and show no motion, and there will be no studio: {reason}"
        );
        BUNDLES.map(|_| String::new())
    });
    for (name, text) in BUNDLES.iter().zip(bundles) {
        fs::write(out.join(name), text).expect("the folder of the build can be written");
    }
}

/// The scripts of each page in one, or why there are none.
fn bundle(out: &Path) -> Result<[String; 2], String> {
    if env::var("ODYN_DESK").is_ok_and(|value| value == "off") {
        return Err("ODYN_DESK=off; unset it to have them".into());
    }
    // The sources of the crate stay as they are.
    let work = out.join("page");
    let copy = |from: &str, to: &Path| {
        fs::create_dir_all(to.parent().unwrap_or(out)).map_err(|error| error.to_string())?;
        fs::copy(from, to).map(drop).map_err(|error| format!("{from} cannot be copied: {error}"))
    };
    for file in SOURCES {
        copy(file, &out.join(file))?;
    }
    let _ = fs::remove_dir_all(work.join("src"));
    for folder in ["page/src", "page/src/studio"] {
        for entry in fs::read_dir(folder).map_err(|error| error.to_string())? {
            let path = entry.map_err(|error| error.to_string())?.path();
            if path.is_file() {
                copy(&path.to_string_lossy(), &out.join(&path))?;
            }
        }
    }
    npm(&work, &["ci", "--omit=dev", "--ignore-scripts", "--no-audit", "--no-fund", "--prefer-offline"])?;
    npm(&work, &["run", "build", "--silent"])?;
    let read = |name: &str| {
        let script = work.join(name);
        fs::read_to_string(&script).map_err(|error| format!("{} cannot be read: {error}", script.display()))
    };
    let [report, studio] = BUNDLES.map(read);
    // The first stands inside an element of a page.
    Ok([report?.replace("</script", "<\\/script"), studio?])
}

fn npm(folder: &Path, arguments: &[&str]) -> Result<(), String> {
    let program = if cfg!(windows) { "npm.cmd" } else { "npm" };
    let help = "install Node.js with npm, connect to the network once, and build again";
    let output = Command::new(program)
        .args(arguments)
        .current_dir(folder)
        .env("npm_config_fetch_retries", "1")
        .env("npm_config_fetch_timeout", "60000")
        .stdin(Stdio::null())
        .output()
        .map_err(|error| format!("npm cannot be run ({error}); {help}"))?;
    if output.status.success() {
        return Ok(());
    }
    let text = String::from_utf8_lossy(&output.stderr);
    let reason = text.lines().filter(|line| line.contains("npm error") || line.contains("rror:")).take(2);
    Err(format!("npm {} failed ({}); {help}", arguments[0], reason.collect::<Vec<_>>().join("; ")))
}
