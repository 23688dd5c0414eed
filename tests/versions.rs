//! Libraries built against other versions of the contract, or in other ways, run and give the same bits. The rule is
//! `docs/versioning.md`.

use std::fs;
use std::path::Path;

use element_api::descriptor::Kind;
use element_api::manifest::INTERFACE;
use element_api::params::Table as Params;
use element_api::recording::Recording;
use element_api::set::{Batch, ElementClass, Layout, Wanted};
use odyn::catalog::{Catalog, SearchPath};

use crate::fixtures::{build, build_variant, file};
use crate::support::{Scratch, kept, root};

/// The catalog of one library, and the version of the contract that it was built with.
fn load(library: &Path) -> (Catalog, String) {
    let mut catalog = Catalog::new().with_copies_in(kept("library-copies"));
    let added = catalog.add(library.to_str().unwrap(), &SearchPath::default());
    let info = added.unwrap_or_else(|error| panic!("{}", error.diagnostic().message));
    (catalog, info.interface.clone())
}

/// The equations of an instance, and what it gives for some numbers, as bits.
fn bits(class: &dyn ElementClass, params: &str) -> (Recording, Vec<u64>) {
    let mut set = class.new_set();
    set.add(&params.parse::<Params>().unwrap()).unwrap();
    let recording = set.record(0).unwrap();
    let joint = class.descriptor().kind == Kind::Joint;
    let values = class.descriptor().rows.len() + class.descriptor().channels.len();
    let layout = Layout { frames: 2, angles: 0, states: 0, memory: 0, signals: 0, joints: 0, values };
    let inputs: Vec<f64> = (0..layout.inputs()).map(|k| (k as f64).sin() + 0.1).collect();
    let mut out = vec![0.0; if joint { layout.joint_results() } else { layout.force_results() }];
    let wanted = Wanted { jacobian: true, second: true };
    set.evaluate(&Batch { instances: &[0], inputs: &inputs, wanted }, &mut out).unwrap();
    (recording, out.iter().map(|x| x.to_bits()).collect())
}

/// Both elements of `good-plugin` are described, recorded and evaluated alike.
#[track_caller]
fn assert_alike(a: &Catalog, b: &Catalog) {
    for (name, params) in [("rod", "length = 0.3"), ("spring", "stiffness = 0.7")] {
        let [a, b] = [a, b].map(|catalog| catalog.find(name, None).unwrap().class);
        assert_eq!(a.descriptor(), b.descriptor());
        let (ours, theirs) = (bits(&*a, params), bits(&*b, params));
        assert!(!ours.0.ops.is_empty() && ours.1.iter().any(|bits| *bits != 0));
        assert_eq!(ours, theirs, "{name}");
    }
}

#[cfg(all(target_os = "linux", target_arch = "x86_64"))]
mod earlier {
    use std::io::Read;
    use std::path::PathBuf;

    use odyn::catalog::sha256;
    use odyn::session::{RunReport, Session};

    use super::*;
    use crate::c_plugin::recent::{SCENE, STRIKING, run_with};
    use crate::fixtures::build_crate;
    use crate::plugins::STRANGERS_SCENE;
    use crate::support::options;

    /// Unpacks a kept library to the folder, under the name that it had. `made`: the hash that `make.sh`, which says how the file
    /// was made, printed.
    fn unpack(kept: &str, made: &str, package: &str, folder: &Path) -> PathBuf {
        let packed = fs::read(root().join(format!("tests/fixtures/earlier/{kept}.so.gz"))).unwrap();
        let mut library = Vec::new();
        flate2::read::GzDecoder::new(&packed[..]).read_to_end(&mut library).unwrap();
        assert_eq!(sha256(&library), made, "the kept library is not the one that was made");
        let path = file(folder, package);
        fs::write(&path, library).unwrap();
        path
    }

    fn run(folder: &Path) -> RunReport {
        let scratch = Scratch::new();
        let scene = STRANGERS_SCENE.replace("\"stranger", "\"good-plugin");
        let scene = scene.replace("\"LIBRARIES\"", &format!("'{}'", folder.display()));
        let path = scratch.file("scene.toml", scene);
        let session = Session::open(&path, &options(&[], &[])).unwrap_or_else(|error| panic!("{error}"));
        session.run(None, Box::new(|_| ()), &Default::default()).unwrap()
    }

    #[test]
    fn a_library_of_contract_1_0_gives_the_bits_of_today() {
        let scratch = Scratch::new();
        let made = "1adbcb6f7ba857e2e07822880a1d4c2dd3077d957078264ba1aa6edbe6fc5b79";
        let path = unpack("good-plugin-1.0", made, "good-plugin", scratch.path());

        let (earlier, interface) = load(&path);
        let (today, own) = load(&file(&build("good-plugin"), "good-plugin"));
        assert_eq!((interface.as_str(), own.as_str()), ("1.0.0", INTERFACE));
        assert_alike(&earlier, &today);

        let (earlier, today) = (run(scratch.path()), run(&build("good-plugin")));
        assert_eq!(earlier.exit_code(), 0);
        assert_ne!(earlier.summary.libraries[0].sha256, today.summary.libraries[0].sha256);
        assert_eq!(earlier.columns, today.columns);
    }

    /// All that contract 1.1 has: joints in time and of several bodies, states, memory, tables, called elements, controls.
    #[test]
    fn a_library_of_contract_1_1_gives_the_bits_of_today() {
        let scratch = Scratch::new();
        let made = "dc9bd779dd2e72456316c702b90cdd99014fe51a0f8d3a29659e50c4c8f7b5ca";
        let path = unpack("cookbook-1.1", made, "cookbook", scratch.path());
        let example = root().join("docs/book/examples/cookbook");
        let today = build_crate(&example);
        let ((earlier, interface), (now, _)) = (load(&path), load(&file(&today, "cookbook")));
        assert_eq!(interface, "1.1.0");
        let names = |catalog: &Catalog| -> Vec<String> {
            catalog.elements().map(|element| element.descriptor().name.clone()).collect()
        };
        // Some came later.
        let newer: Vec<String> = names(&now).into_iter().filter(|name| !names(&earlier).contains(name)).collect();
        assert_eq!(newer, ["tether"]);
        let mut scenes = 0;
        for entry in fs::read_dir(example.join("scenes")).unwrap() {
            let scene = entry.unwrap().path();
            let text = fs::read_to_string(&scene).unwrap();
            if newer.iter().any(|name| text.contains(&format!("type = \"{name}\""))) {
                continue;
            }
            let run = |folder: &Path| {
                let session = Session::open(&scene, &options(&[], &[folder.to_path_buf()]));
                let session = session.unwrap_or_else(|error| panic!("{error}"));
                session.run(None, Box::new(|_| ()), &Default::default()).unwrap()
            };
            let (earlier, today) = (run(scratch.path()), run(&today));
            assert_eq!(earlier.exit_code(), 0);
            assert_ne!(earlier.summary.libraries, today.summary.libraries);
            assert_eq!(earlier.columns, today.columns, "{}", scene.display());
            scenes += 1;
        }
        assert!(scenes > 5, "{scenes}");
    }

    /// What came with contract 1.2: joints with states, memory and signals, over any number of points, that strike and slide; internal
    /// unknowns, surfaces, slopes, checks, catalogues.
    #[test]
    fn a_library_of_contract_1_2_gives_the_bits_of_today() {
        let scratch = Scratch::new();
        let made = "92418efefdd0317c2a44b3a2af55eca03b9afd6f1f3c398b531bb39418631727";
        let path = unpack("recent-plugin-1.2", made, "recent-plugin", scratch.path());
        let today = file(&build("recent-plugin"), "recent-plugin");
        let ((earlier, interface), (now, _)) = (load(&path), load(&today));
        assert_eq!(interface, "1.2.0");
        assert_eq!(earlier.elements().count(), 4);
        for element in earlier.elements() {
            let name = &element.descriptor().name;
            assert_eq!(element.descriptor(), now.find(name, None).unwrap().descriptor(), "{name}");
        }
        for scene in [SCENE, STRIKING] {
            let [earlier, today] = [&path, &today].map(|library| run_with(scene, "recent-plugin", library));
            assert_eq!(earlier.exit_code(), 0, "{}", earlier.summary.reason);
            assert_ne!(earlier.summary.libraries, today.summary.libraries);
            assert_eq!(earlier.columns, today.columns);
        }
    }
}

/// Debug and optimised forms, for speed and for size, with and without symbols. A release build with link-time
/// optimisation is the kept library of an earlier version.
#[test]
fn optimisation_and_stripping_change_no_bit() {
    let contract = root().join("element-api");
    let plain = load(&build_variant("form-plain", &contract, &[])).0;
    for (package, flags) in [
        ("form-debug", &["-C", "opt-level=0", "-C", "debuginfo=2", "-C", "debug-assertions=on"][..]),
        ("form-fast", &["-C", "opt-level=3", "-C", "codegen-units=1", "-C", "debug-assertions=off"]),
        ("form-small", &["-C", "opt-level=z", "-C", "strip=symbols", "-C", "debug-assertions=off"]),
    ] {
        assert_alike(&plain, &load(&build_variant(package, &contract, flags)).0);
    }
}

/// Exchanges a text that must be there.
fn exchange(file: &Path, from: &str, to: &str) {
    let text = fs::read_to_string(file).unwrap();
    assert!(text.contains(from), "{} has no `{from}`", file.display());
    fs::write(file, text.replacen(from, to, 1)).unwrap();
}

/// Files that are there with the same content stay as they are, so that cargo does not build them again.
fn copy_folder(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap() {
        let entry = entry.unwrap();
        let (path, target) = (entry.path(), to.join(entry.file_name()));
        if path.is_dir() {
            copy_folder(&path, &target);
        } else if fs::read(&path).ok() != fs::read(&target).ok() {
            fs::copy(&path, &target).unwrap();
        }
    }
}

/// A copy of the contract, which needs nothing around it, as a later minor version might have it: more at the end of the root and
/// of the methods of a set, and a field more in descriptors.
fn later_contract(folder: &Path) {
    let api = folder.join("element-api");
    copy_folder(&root().join("element-api"), &api);
    let version = format!("\nversion = \"{INTERFACE}\"");
    exchange(&api.join("Cargo.toml"), &version, "\nversion = \"1.9.0\"");
    let root_field = "pub extension: extern \"C\" fn(RStr<'_>) -> *const (),";
    let more = "/// More.\n        pub more: extern \"C\" fn(u32) -> u32,";
    exchange(&api.join("src/abi.rs"), root_field, &format!("{root_field}\n        {more}"));
    let method = "fn load(&mut self, instance: u32, memory: RSlice<'_, u8>) -> ROption<ErrorV1>";
    exchange(
        &api.join("src/abi.rs"),
        &format!("{method};"),
        &format!("{method};\n        /// More.\n        fn more(&self, x: u32) -> u32;"),
    );
    let plugin = api.join("src/abi/plugin.rs");
    exchange(&plugin, "extension: no_extension }", "extension: no_extension, more }");
    exchange(&plugin, "struct PluginClass(", "extern \"C\" fn more(x: u32) -> u32 {\n    x\n}\n\nstruct PluginClass(");
    exchange(
        &plugin,
        &format!("{method} {{"),
        &format!("fn more(&self, x: u32) -> u32 {{\n        x\n    }}\n\n    {method} {{"),
    );
    let descriptor = api.join("src/descriptor.rs");
    exchange(
        &descriptor,
        "pub turns_freely: bool,",
        "pub turns_freely: bool,\n    /// More.\n    #[serde(default)]\n    pub more: f64,",
    );
    exchange(&api.join("src/adapt.rs"), "turns_freely: false,", "turns_freely: false,\n        more: 7.5,");
}

#[test]
fn a_library_of_a_later_minor_version_loads() {
    let (scratch, folder) = (Scratch::new(), kept("contract-alone"));
    later_contract(scratch.path());
    copy_folder(scratch.path(), &folder);
    let library = build_variant("later", &folder.join("element-api"), &[]);
    let (later, interface) = load(&library);
    assert_eq!(interface, "1.9.0");
    // It says more than this host knows: the text is in the file.
    let known = load(&file(&build("good-plugin"), "good-plugin")).0;
    assert_alike(&later, &known);
}
