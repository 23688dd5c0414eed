#[cfg(all(feature = "abi", unix))]
mod known;
#[cfg(all(feature = "abi", target_os = "linux"))]
mod packages;
#[cfg(all(feature = "abi", target_os = "linux"))]
mod places;

use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};

use element_api::descriptor::Kind;
use element_api::params::Table;
use element_api::set::{CreateError, Fault};

use super::*;
use odyn_diagnostics::codes;

/// A folder that exists as long as the value.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("odyn-catalog-{}-{name}", std::process::id()));
        fs::create_dir_all(&path).expect("temporary files can be written");
        Self(path)
    }

    fn file(&self, name: &str, bytes: impl AsRef<[u8]>) -> PathBuf {
        let path = self.0.join(name);
        fs::create_dir_all(path.parent().expect("a file is in a folder")).expect("temporary files can be written");
        fs::write(&path, bytes).expect("temporary files can be written");
        path
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

/// The platform's file name of a library crate.
fn file_name(krate: &str) -> String {
    format!("{}{krate}{}", std::env::consts::DLL_PREFIX, std::env::consts::DLL_SUFFIX)
}

/// Two libraries that share a name, as crates export them.
mod first {
    use element_api::prelude::*;

    element_api::export_plugin! { about: "first of the tests", joints: [Point], forces: [Pull] }

    /// One point of j stays in the plane z = 0 of i.
    pub struct Point;

    impl Element for Point {
        const NAME: &'static str = "point-in-plane";
        const SUMMARY: &'static str = "a point stays in a plane";
        const FRAMES: &'static [FrameSpec] = &[FrameSpec::new("i", "plane"), FrameSpec::new("j", "point")];
        type Parameters = NoParameters;
        fn new(_: NoParameters) -> Result<Self, ParamError> {
            Ok(Self)
        }
    }

    impl Constraint for Point {
        const ROWS: &'static [&'static str] = &["along z"];
        fn residual<S: Scalar>(&self, at: &Configuration<'_, S>, rows: &mut Rows<'_, S>) {
            blocks::no_offset_along(at.frames[0].z(), &at.frames[0], &at.frames[1], rows);
        }
    }

    /// Panics when it is built.
    pub struct Pull;

    impl Element for Pull {
        const NAME: &'static str = "pull";
        const SUMMARY: &'static str = "never works";
        const FRAMES: &'static [FrameSpec] = &[FrameSpec::new("j", "body")];
        type Parameters = NoParameters;
        fn new(_: NoParameters) -> Result<Self, ParamError> {
            panic!("no hands");
        }
    }

    impl Force for Pull {
        fn wrench<S: Scalar>(&self, _: &Motion<'_, S>, _: &mut Wrenches<'_, S>) {}
    }
}

fn linked(package: &str) -> Library {
    Library { package: package.into(), ..first::library() }
}

fn two_libraries() -> Catalog {
    let mut catalog = Catalog::new();
    catalog.add_library(linked("a")).expect("the first");
    catalog.add_library(linked("b")).expect("another");
    catalog
}

#[test]
fn a_short_name_is_enough_while_it_is_unique() {
    let mut catalog = Catalog::new();
    catalog.add_library(linked("a")).expect("the first");
    let found = catalog.find("pull", None).expect("unique");
    assert_eq!((found.full_name().as_str(), found.descriptor().kind), ("a/pull", Kind::Force));
    catalog.add_library(linked("b")).expect("another");
    let error = catalog.find("pull", None).expect_err("two of them");
    assert_eq!(error.code(), codes::AMBIGUOUS_TYPE);
    assert_eq!(error.help(), ["write one of a/pull, b/pull"]);
    assert_eq!(catalog.find("b/pull", None).expect("full name").full_name(), "b/pull");
}

#[test]
fn an_unknown_name_comes_with_the_most_similar_one() {
    let catalog = two_libraries();
    let error = catalog.find("point-in-plain", None).expect_err("mistyped");
    assert_eq!((error.code(), error.help()), (codes::UNKNOWN_TYPE, vec!["did you mean `point-in-plane`?".to_string()]));
    let error = catalog.find("in-plane", None).expect_err("a part of a name");
    assert_eq!(error.help(), ["did you mean `point-in-plane`?"]);
    let error = catalog.find("gearbox", Some(Kind::Force)).expect_err("unknown");
    assert_eq!(error.help(), ["known types: pull"]);
    assert!(catalog.find("c/pull", None).is_err());
    assert_eq!(
        Catalog::new().find("rod", None).expect_err("empty").help(),
        [
            "no library is loaded: write those of its elements under `[plugins]`; the standard ones are `libraries = [\"joints\", \"forces\", \"controls\"]`"
        ]
    );
}

#[test]
fn an_element_of_the_other_kind_is_told_apart() {
    let mut catalog = Catalog::new();
    catalog.add_library(linked("a")).expect("the first");
    let error = catalog.find("pull", Some(Kind::Joint)).expect_err("a force");
    assert_eq!(error.to_string(), "`pull` is a force, not a joint");
    assert_eq!((error.code(), error.help()), (codes::WRONG_KIND, vec!["write it below `[[force]]`".to_string()]));
}

#[test]
fn a_package_is_added_once() {
    let mut catalog = two_libraries();
    let error = catalog.add_library(linked("a")).expect_err("twice");
    assert_eq!(error.code(), codes::DUPLICATE_ELEMENT);
    assert_eq!(catalog.libraries().count(), 2);
}

#[test]
fn a_panic_of_a_linked_element_becomes_an_error() {
    let catalog = two_libraries();
    let mut set = catalog.find("a/pull", None).expect("known").class.new_set();
    match set.add(&Table::new()) {
        Err(CreateError::Fault(message)) => assert!(message.starts_with("panicked: no hands at "), "{message}"),
        other => panic!("{other:?}"),
    }
    let fault: Fault = set.record(0).expect_err("there is no instance");
    assert!(fault.message.contains("panicked"), "{fault}");
}

#[test]
fn diagnostics_carry_code_text_and_advice() {
    let diagnostic = CatalogError::NoManifest { path: "x.so".into() }.diagnostic();
    assert_eq!(diagnostic.code, codes::NO_MANIFEST);
    assert_eq!(diagnostic.message, "`x.so` is not an O-DYN element library: it has no manifest");
    assert_eq!(diagnostic.help.len(), 1);
}

#[test]
fn places_are_searched_in_the_documented_order() {
    let folder = Folder::new("order");
    let (file, beside) = (file_name("odyn_joints"), file_name("joints"));
    let places = ["command", "scene", "environment", "program"].map(|name| folder.0.join(name));
    let [command, scene, environment, program] = &places;
    let search = SearchPath::of(
        std::slice::from_ref(command),
        std::slice::from_ref(scene),
        Some(environment.as_os_str()),
        &program.join("odyn"),
    );
    for place in places.iter().rev() {
        let path = folder.file(place.join(&file).to_str().expect("UTF-8"), "");
        assert_eq!(search.locate("joints").expect("it was just written"), path);
    }
    // The order of places counts more than that of names.
    fs::remove_file(command.join(&file)).expect("it was just written");
    let path = folder.file(command.join(&beside).to_str().expect("UTF-8"), "");
    assert_eq!(search.locate("joints").expect("found"), path);
}

#[test]
fn programs_of_tests_look_beside_themselves_first() {
    let folder = Folder::new("deps");
    let file = file_name("my_elements");
    let above = folder.file(&format!("target/debug/{file}"), "");
    let search = |program: &str| SearchPath::of(&[], &[], None, &folder.0.join(program));
    let found = |program: &str| search(program).locate("my-elements").expect("found");
    assert_eq!(found("target/debug/deps/tests-0123"), above);
    assert_eq!(found("target/debug/odyn"), above);
    let beside = folder.file(&format!("target/debug/deps/{file}"), "");
    assert_eq!(found("target/debug/deps/tests-0123"), beside);
    assert_eq!(found("target/debug/odyn"), above);
    fs::remove_file(above).expect("it was just written");
    assert_eq!(found("target/debug/odyn"), beside);
}

#[test]
fn a_file_is_named_by_path_or_on_the_command_line() {
    let folder = Folder::new("paths");
    let path = folder.file(&file_name("rods"), "");
    let none = SearchPath::of(&[], &[], None, Path::new(""));
    assert_eq!(none.locate(path.to_str().expect("UTF-8")).expect("absolute"), path);
    let search = SearchPath::of(&[], std::slice::from_ref(&folder.0), None, Path::new(""));
    assert_eq!(search.locate(&file_name("rods")).expect("relative to the folder"), path);
    let search = SearchPath::of(std::slice::from_ref(&path), &[], None, Path::new(""));
    assert_eq!(search.locate("rods").expect("the file itself"), path);
    assert_eq!(search.folders().count(), 0);
}

#[test]
fn a_library_that_is_not_there_is_reported_with_the_places() {
    let folder = Folder::new("absent");
    let places = [folder.0.join("one"), folder.0.join("two")];
    let error = SearchPath::of(&places, &[], None, Path::new("")).locate("joints").expect_err("absent");
    assert_eq!(
        (error.code(), error.to_string().as_str()),
        (codes::PLUGIN_NOT_FOUND, "the library `joints` was not found")
    );
    let help = error.help().join("\n");
    for part in [file_name("odyn_joints").as_str(), "one", "two", "--plugin", "`cargo build`"] {
        assert!(help.contains(part), "{help}");
    }
}

#[test]
fn empty_entries_of_the_environment_are_no_folders() {
    let search = SearchPath::of(&[], &[], Some(OsStr::new("")), Path::new(""));
    assert_eq!(search.folders().count(), 0);
}

#[cfg(not(feature = "abi"))]
#[test]
fn without_the_loader_a_request_is_refused() {
    let errors = Catalog::load(&["joints"], &SearchPath::default()).expect_err("no loader");
    assert!(matches!(errors[0].1, CatalogError::NoLoader { .. }));
}

/// The program of these tests is a dynamic file with a manifest, that of `first`, so it serves as a library as far as
/// nothing is run.
#[cfg(all(feature = "abi", target_os = "linux"))]
mod files {
    use super::super::file::manifest;
    use super::super::float_control::{floating_point_control, set_floating_point_control};
    use super::super::loader::check;
    use super::super::private_copy::{copy_into, remove_old};
    use super::*;
    use object::{Object, ObjectSection};
    use std::time::{Duration, SystemTime};

    fn own() -> Vec<u8> {
        fs::read(std::env::current_exe().expect("the program has a path")).expect("the program is a file")
    }

    /// The program with a part of its manifest replaced by another of the same length.
    fn forged(part: &str, replacement: &str) -> Vec<u8> {
        assert_eq!(part.len(), replacement.len());
        let mut bytes = own();
        let (from, length) = object::File::parse(bytes.as_slice())
            .expect("the program is an ELF file")
            .section_by_name(".odyn")
            .and_then(|section| section.file_range())
            .expect("the program holds its manifest");
        let section = from as usize..(from + length) as usize;
        let text = std::str::from_utf8(&bytes[section.clone()]).expect("text");
        let at = section.start + text.find(part).expect("the part is in it");
        bytes[at..at + part.len()].copy_from_slice(replacement.as_bytes());
        bytes
    }

    fn load(bytes: &[u8], name: &str) -> CatalogError {
        let folder = Folder::new(name);
        let path = folder.file(&file_name(name), bytes);
        let search = SearchPath::of(&[], std::slice::from_ref(&folder.0), None, Path::new(""));
        let error = Catalog::new().add(name, &search).expect_err("nothing of this can be loaded");
        assert!(error.to_string().contains(path.to_str().expect("UTF-8")), "{error}");
        error
    }

    #[test]
    fn the_manifest_is_read_without_running_anything() {
        let manifest = read_manifest(&std::env::current_exe().expect("a path")).expect("a manifest");
        assert_eq!((manifest.package.as_str(), manifest.abi), (env!("CARGO_PKG_NAME"), ABI));
        assert_eq!(manifest.about, "first of the tests");
        assert!(manifest.elements[0].is(Kind::Joint, "point-in-plane"));
        assert!(manifest.elements[1].is(Kind::Force, "pull"));
        assert_eq!(manifest.entry, format!("odyn_plugin_v1_{}", env!("CARGO_CRATE_NAME")));
        assert_eq!(manifest.profile, Profile::OWN);
    }

    #[test]
    fn what_is_not_a_library_is_refused() {
        for (bytes, expected) in [(&b""[..], "empty"), (b"[plugins]\nlibraries = []\n", "may be truncated")] {
            let error = load(bytes, "text");
            assert_eq!(error.code(), codes::NOT_A_LIBRARY);
            assert!(error.to_string().contains(expected), "{error}");
        }
        let mut other_machine = own();
        // e_machine of the ELF header: 183 is AArch64, 62 is x86-64.
        other_machine[18] = if cfg!(target_arch = "aarch64") { 62 } else { 183 };
        assert!(load(&other_machine, "machine").to_string().contains("processors"));
        let mut relocatable = own();
        // e_type: 1 is an object file.
        relocatable[16] = 1;
        assert!(load(&relocatable, "object").to_string().contains("not a dynamic library"));
    }

    #[test]
    fn a_truncated_file_is_refused_wherever_it_ends() {
        let bytes = own();
        for k in 0..64 {
            let length = bytes.len() / 64 * k + bytes.len() / 128;
            let error = manifest(Path::new("cut.so"), &bytes[..length]).expect_err("truncated");
            assert_eq!(error.code(), codes::NOT_A_LIBRARY, "cut to {length}: {error}");
        }
        assert!(manifest(Path::new("cut.so"), &bytes[..bytes.len() - 1]).is_err());
        assert_eq!(load(&bytes[..bytes.len() / 2], "truncated").code(), codes::NOT_A_LIBRARY);
    }

    #[test]
    fn damaged_headers_are_errors_and_not_panics() {
        let mut bytes = own();
        let length = bytes.len();
        let mut refused = 0;
        for k in (0..1024).chain(length - 1024..length) {
            let kept = std::mem::replace(&mut bytes[k], 0xff);
            refused += usize::from(manifest(Path::new("damaged.so"), bytes.as_slice()).is_err());
            bytes[k] = kept;
        }
        assert!(refused > 0);
    }

    #[test]
    fn a_library_without_a_manifest_is_not_ours() {
        let error = load(&forged_section_name(), "foreign");
        assert_eq!(error.code(), codes::NO_MANIFEST);
    }

    /// The program with its section called otherwise.
    fn forged_section_name() -> Vec<u8> {
        let mut bytes = own();
        let at = bytes.windows(7).rposition(|window| window == b"\0.odyn\0").expect("the section has a name");
        bytes[at + 2] = b'x';
        bytes
    }

    #[test]
    fn manifests_are_judged_before_anything_runs() {
        let cases = [
            ("ODYN-MANIFEST 1", "ODYN-MANIFEST 2", codes::NO_MANIFEST, "format is 2"),
            ("abi=1", "abi=2", codes::ABI_VERSION, "interface version 2, this host version 1"),
            ("interface=1", "interface=2", codes::ABI_VERSION, "interface version 2."),
            ("interface=1", "interface=0", codes::ABI_VERSION, "interface version 0."),
            ("conventions=1", "conventions=7", codes::ABI_CONVENTIONS, "conventions number 7, this host number 1"),
        ];
        for (part, replacement, code, expected) in cases {
            let error = load(&forged(part, replacement), "forged");
            assert_eq!(error.code(), code);
            assert!(error.to_string().contains(expected), "{error}");
        }
        let mut sound = read_manifest(&std::env::current_exe().expect("a path")).expect("a manifest");
        let foreign = if cfg!(target_arch = "x86_64") { "neon" } else { return };
        sound.features = vec!["sse4.2".into(), "a-feature-of-2040".into()];
        assert_eq!(check(Path::new("x.so"), &sound), Ok(()));
        sound.features.push(foreign.into());
        let error = check(Path::new("x.so"), &sound).expect_err("another processor");
        assert_eq!(
            (error.code(), error.to_string().ends_with("needs a processor with neon")),
            (codes::CPU_FEATURES, true)
        );
    }

    #[test]
    #[cfg(target_arch = "x86_64")]
    fn the_floating_point_mode_is_seen_and_restored() {
        let tiny = std::hint::black_box(1e-310_f64);
        let before = floating_point_control();
        // Bit 15 flushes denormal results to zero, as code built with -ffast-math sets it for its whole process.
        set_floating_point_control(before | 1 << 15);
        let (changed, flushed) = (floating_point_control(), tiny * std::hint::black_box(0.5));
        set_floating_point_control(before);
        assert_eq!((changed, flushed), (before | 1 << 15, 0.0));
        assert_eq!(floating_point_control(), before);
        assert!(tiny * std::hint::black_box(0.5) > 0.0);
    }

    #[test]
    fn scanning_shows_libraries_of_elements_only() {
        let folder = Folder::new("scan");
        folder.file(&file_name("b"), own());
        folder.file(&file_name("c"), forged("abi=1", "abi=x"));
        folder.file(&file_name("a"), forged_section_name());
        folder.file(&file_name("d"), "text");
        folder.file("notes.txt", "text");
        let found = scan(&folder.0);
        let names: Vec<_> = found.iter().map(|(path, m)| (path.file_name().expect("a file"), m.is_ok())).collect();
        assert_eq!(names, [(OsStr::new(&file_name("b")), true), (OsStr::new(&file_name("c")), false)]);
        assert!(scan(&folder.0.join("absent")).is_empty());
    }

    #[test]
    fn the_library_a_scene_forgot_is_named() {
        let folder = Folder::new("forgotten");
        let path = folder.file(&file_name("anything"), own());
        let search = SearchPath::of(std::slice::from_ref(&folder.0), &[], None, Path::new(""));
        let mut catalog = Catalog::new();
        let error = catalog.add("anythink", &search).expect_err("mistyped");
        assert_eq!(error.code(), codes::PLUGIN_NOT_FOUND);
        let error = catalog.find("pull", None).expect_err("nothing is loaded");
        let package = env!("CARGO_PKG_NAME");
        let expected = format!(
            "`pull` is provided by `{package}` ({}), which `[plugins] libraries` does not name",
            path.display()
        );
        assert_eq!(error.help(), [expected]);
        let error = catalog.add(&package[..package.len() - 1], &search).expect_err("mistyped");
        let short = package.strip_prefix("odyn-").unwrap_or(package);
        assert_eq!(error.help()[0], format!("did you mean `{short}`?"));
    }

    /// Copies a library of these bytes in both ways: looked for first, and not.
    fn copied(folder: &Path, bytes: &[u8]) -> PathBuf {
        let own = Folder::new("original");
        let library = own.0.join("library.so");
        fs::write(&library, bytes).expect("writable");
        let likely = crate::sha256(bytes);
        let copy = copy_into(folder, &library, Some(&likely)).expect("a copy");
        assert_eq!(copy_into(folder, &library, None).expect("a copy"), copy);
        assert_eq!(copy.sha256, likely);
        copy.path
    }

    #[test]
    fn a_copy_is_made_once_and_repaired_when_it_was_changed() {
        let folder = Folder::new("copies");
        let made = |path: &Path| fs::metadata(path).and_then(|m| m.created().or(m.modified())).expect("it is there");
        let first = copied(&folder.0, b"library");
        let time = made(&first);
        assert_eq!(copied(&folder.0, b"library"), first);
        assert_eq!(made(&first), time);
        fs::write(&first, b"exchanged").expect("writable");
        copied(&folder.0, b"library");
        assert_eq!(fs::read(&first).expect("it is there"), b"library");
        assert_eq!(fs::read_dir(&folder.0).expect("a folder").count(), 1, "no drafts are left");
        let gone = folder.0.join("gone.so");
        copy_into(&folder.0, &gone, None).expect_err("there is no such library");
        assert_eq!(fs::read_dir(&folder.0).expect("a folder").count(), 1, "no drafts are left");
    }

    #[test]
    fn every_byte_of_a_copy_counts() {
        let folder = Folder::new("long-copies");
        let library: Vec<u8> = (0..300_000_u32).map(|k| (k % 251) as u8).collect();
        let copy = copied(&folder.0, &library);
        for place in [0, 131_071, 131_072, 299_999] {
            let mut exchanged = library.clone();
            exchanged[place] ^= 1;
            fs::write(&copy, &exchanged).expect("writable");
            copied(&folder.0, &library);
            assert!(fs::read(&copy).expect("it is there") == library, "byte {place}");
        }
        for length in [0, 1, 131_072, 300_001] {
            let mut exchanged = library.clone();
            exchanged.resize(length, 0);
            fs::write(&copy, &exchanged).expect("writable");
            copied(&folder.0, &library);
            assert!(fs::read(&copy).expect("it is there") == library, "{length} bytes");
        }
    }

    #[test]
    fn copies_that_nobody_used_for_weeks_are_removed() {
        let folder = Folder::new("old");
        let path = copied(&folder.0, b"library");
        remove_old(&folder.0, SystemTime::now() + Duration::from_secs(13 * 24 * 3600));
        assert!(path.exists());
        remove_old(&folder.0, SystemTime::now() + Duration::from_secs(15 * 24 * 3600));
        assert!(!path.exists());
    }
}
