//! An element more in a crate that is there: its files, and a place in the list that the library exports.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use super::create::Created;
use super::error::WorkshopError;
use super::names;
use super::templates::{Template, fill};

/// Adds an element to the crate in the folder `into`: `src/NAME.rs`, its tests where the crate has the test kit, `pub mod` and an entry
/// of `export_plugin!` in `src/lib.rs`.
///
/// # Errors
/// See [`WorkshopError`]; nothing is changed then.
pub fn add(name: &str, template: Template, into: &Path) -> Result<Created, WorkshopError> {
    names::check(name)?;
    let not = |reason: String| WorkshopError::NoCrate { path: into.into(), reason };
    let read = |file: &str| fs::read_to_string(into.join(file)).map_err(|error| not(format!("its {file}: {error}")));
    let (manifest, lib) = (read("Cargo.toml")?, read("src/lib.rs")?);
    let manifest: toml::Table = manifest.parse().map_err(|_| not("its Cargo.toml is not TOML".into()))?;
    let package = manifest.get("package").and_then(|package| package.get("name")).and_then(toml::Value::as_str);
    let package = package.ok_or_else(|| not("its Cargo.toml names no package".into()))?.to_string();
    let kit = manifest.get("dev-dependencies").and_then(|table| table.get("element-api"));
    let has_kit = kit.is_some_and(|entry| entry.to_string().contains("testkit"));
    let (module, type_name, element) = (names::crate_name(name), names::type_name(name), names::element_name(name));
    let (source, tests) =
        template.element().ok_or_else(|| not("only a joint, a force or a control can be added".into()))?;
    let words: &[(&str, &str)] = &[("element", &element), ("Type", &type_name)];
    let own_file = format!("include_str!(\"{module}.rs\")");
    let mut source = alone(&fill(source, words)).replace("include_str!(\"lib.rs\")", &own_file);
    let mut files = Vec::new();
    if has_kit {
        let tests = fill(tests, words).replace("use crate::", "use super::");
        files.push((PathBuf::from(format!("src/{module}/tests.rs")), tests));
    } else {
        source = source.replace("\n#[cfg(test)]\nmod tests;\n", "");
    }
    files.insert(0, (PathBuf::from(format!("src/{module}.rs")), source));
    let lib =
        listed(&lib, template.list(), &module, &type_name).map_err(|reason| not(format!("its src/lib.rs {reason}")))?;
    for (file, _) in &files {
        let path = into.join(file);
        if path.exists() {
            return Err(WorkshopError::Exists { path });
        }
    }
    if let Err((path, source)) = write(into, &files, &lib) {
        // The first error is the one to tell.
        files.iter().for_each(|(file, _)| drop(fs::remove_file(into.join(file))));
        return Err(WorkshopError::Write { path, source });
    }
    files.push(("src/lib.rs".into(), lib));
    Ok(Created {
        library: super::create::library_file(&package),
        package,
        elements: vec![element],
        folder: into.into(),
        files: files.into_iter().map(|(path, text)| (path, text.lines().count())).collect(),
    })
}

fn write(into: &Path, files: &[(PathBuf, String)], lib: &str) -> Result<(), (PathBuf, io::Error)> {
    for (file, text) in files {
        let path = into.join(file);
        let folder = path.parent().unwrap_or(into);
        fs::create_dir_all(folder).and_then(|()| fs::write(&path, text)).map_err(|error| (path, error))?;
    }
    // The list last, and whole or not at all.
    let (draft, path) = (into.join("src/lib.rs.new"), into.join("src/lib.rs"));
    fs::write(&draft, lib).and_then(|()| fs::rename(&draft, &path)).map_err(|error| (path, error))
}

/// The source of an element without what belongs to its crate.
fn alone(text: &str) -> String {
    let of_crate = |line: &str| line.starts_with("#![") || line.starts_with("element_api::export_plugin!");
    let mut lines: Vec<&str> = Vec::new();
    for line in text.lines().filter(|line| !of_crate(line)) {
        if !(line.is_empty() && lines.last().is_some_and(|last| last.is_empty())) {
            lines.push(line);
        }
    }
    lines.join("\n") + "\n"
}

/// The text of `lib.rs` with a module and its element in the list (`joints`, ...) of `export_plugin!`.
fn listed(lib: &str, list: &str, module: &str, type_name: &str) -> Result<String, String> {
    let code = |at: &usize| {
        let line = lib[..*at].rfind('\n').map_or(0, |end| end + 1);
        !lib[line..].trim_start().starts_with("//")
    };
    let start = lib.match_indices("export_plugin!").map(|(at, _)| at).find(code).ok_or("has no `export_plugin!`")?;
    let open = start + lib[start..].find(['{', '(', '[']).ok_or("has an `export_plugin!` without a list")?;
    let close = closing(lib, open).ok_or("has an `export_plugin!` that does not end")?;
    let (body, item) = (&lib[open + 1..close], format!("{module}::{type_name}"));
    let body = match body.find(&format!("{list}:")) {
        Some(key) => {
            let from = key + body[key..].find('[').ok_or_else(|| format!("has `{list}` without a list"))?;
            let to = closing(body, from).ok_or_else(|| format!("has a list `{list}` that does not end"))?;
            let entries = body[from + 1..to].trim_end().trim_end_matches(',');
            let comma = if entries.trim().is_empty() { "" } else { ", " };
            format!("{}{entries}{comma}{item}{}", &body[..=from], &body[from + 1 + entries.len()..])
        }
        None if later(list).any(|key| body.contains(key)) => {
            let at = later(list).filter_map(|key| body.find(key)).min().unwrap_or_default();
            let after = if body.contains('\n') { ",\n    " } else { ", " };
            format!("{}{list}: [{item}]{after}{}", &body[..at], &body[at..])
        }
        None => {
            let known = body.trim_end();
            let comma = if known.is_empty() || known.ends_with(',') { "" } else { "," };
            let (before, after) = if body.contains('\n') { ("\n    ", ",\n") } else { (" ", " ") };
            format!("{known}{comma}{before}{list}: [{item}]{after}")
        }
    };
    let (head, rest) = (&lib[..=open], &lib[close..]);
    let is_module =
        |line: &&str| line.starts_with("pub mod ") || (line.starts_with("mod ") && !line.starts_with("mod tests"));
    let head = match head.lines().rfind(is_module) {
        Some(last) => head.replacen(&format!("{last}\n"), &format!("{last}\npub mod {module};\n"), 1),
        None => {
            let line = head[..start].rfind('\n').map_or(0, |end| end + 1);
            format!("{}pub mod {module};\n\n{}", &head[..line], &head[line..])
        }
    };
    Ok(format!("{head}{body}{rest}"))
}

/// What the lists behind this one begin with; the macro wants them in order.
fn later(list: &str) -> impl Iterator<Item = &'static str> {
    let lists = ["joints:", "forces:", "controls:"];
    let own = lists.iter().position(|key| key.trim_end_matches(':') == list).map_or(lists.len(), |k| k + 1);
    lists.into_iter().skip(own)
}

/// Where the bracket that opens at `open` closes; texts are passed over.
fn closing(text: &str, open: usize) -> Option<usize> {
    let (mut depth, mut quoted, mut escaped) = (0_i32, false, false);
    for (at, c) in text[open..].char_indices() {
        match (quoted, c) {
            (true, _) if escaped => escaped = false,
            (true, '\\') => escaped = true,
            (_, '"') => quoted = !quoted,
            (false, '{' | '(' | '[') => depth += 1,
            (false, '}' | ')' | ']') => {
                depth -= 1;
                if depth == 0 {
                    return Some(open + at);
                }
            }
            _ => {}
        }
    }
    None
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // in a test, the panic is the message
mod tests {
    use super::*;

    #[test]
    fn lists_grow_however_they_are_written() {
        let one = "//! A library. `export_plugin!` is below.\n\n// element_api::export_plugin! { about: \"old\", joints: [] }\n\
                   element_api::export_plugin! { about: \"Braces } and ] in a text\", joints: [Rod] }\n\npub struct Rod;\n";
        let joint = listed(one, "joints", "wobble", "Wobble").unwrap();
        assert!(joint.contains("pub mod wobble;\n\nelement_api::export_plugin! { about"), "{joint}");
        assert!(joint.contains("in a text\", joints: [Rod, wobble::Wobble] }\n\npub struct Rod;"), "{joint}");
        let both = listed(&joint, "forces", "pull", "Pull").unwrap();
        assert!(both.contains("joints: [Rod, wobble::Wobble], forces: [pull::Pull] }"), "{both}");
        assert!(both.contains("pub mod wobble;\npub mod pull;\n"), "{both}");
        let many = "mod gas;\n\nexport_plugin! {\n    about: \"x\",\n    forces: [\n        gas::Gas,\n    ],\n}\n\n#[cfg(test)]\nmod tests;\n";
        let force = listed(many, "forces", "pull", "Pull").unwrap();
        assert!(force.contains("        gas::Gas, pull::Pull,\n    ],\n}\n"), "{force}");
        let joint = listed(many, "joints", "rod", "Rod").unwrap();
        assert!(joint.contains("\"x\",\n    joints: [rod::Rod],\n    forces: [\n"), "{joint}");
        let control = listed(many, "controls", "lag", "Lag").unwrap();
        assert!(control.contains("    ],\n    controls: [lag::Lag],\n}\n"), "{control}");
        assert!(control.starts_with("mod gas;\npub mod lag;\n"), "{control}");
        assert!(listed("export_plugin! { joints: [] }", "joints", "a", "A").unwrap().contains("joints: [a::A] }"));
        assert!(listed("export_plugin! {}", "joints", "a", "A").unwrap().contains("{ joints: [a::A] }"));
        for (broken, words) in
            [("", "has no"), ("export_plugin!", "without"), ("export_plugin! { joints: [", "does not end")]
        {
            assert!(listed(broken, "joints", "a", "A").unwrap_err().contains(words), "{broken}");
        }
    }
}
