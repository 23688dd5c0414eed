//! The way of a library to somebody else's machine, and libraries that are built again while they are in use.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use odyn::catalog::{CatalogError, Package, Store};
use odyn::diagnostics::codes;
use odyn::session::{Session, SessionError, Watched};

use crate::fixtures::{build, build_changed, file};
use crate::support::{Scratch, column, kept, options};

/// A mass of 2 kg on a spring of zero free length, which swings as x = cos(sqrt(k/m) t).
const SCENE: &str = r#"
[plugins]
libraries = [LIBRARY]
[simulation]
t_end = 1
output_step = 0.1
[[body]]
name = "bob"
mass = 2
inertia = [1, 1, 1]
position = [1, 0, 0]
[[force]]
name = "spring"
type = "spring"
bodies = ["ground", "bob"]
params.stiffness = "18 N/m"
[[output]]
name = "x"
quantity = "position"
of = "bob"
component = "x"
"#;

fn open(scene: &Path, plugins: &[PathBuf]) -> Result<Session, Box<SessionError>> {
    Session::open(scene, &options(&[], plugins)).map_err(Box::new)
}

/// The largest difference of the swing from cos(rate t).
fn off(session: Session, rate: f64) -> f64 {
    let report = session.run(None, Box::new(|_| ()), &Default::default()).unwrap();
    let times = report.times.iter().zip(column(&report, "x"));
    times.fold(0.0, |most: f64, (t, x)| most.max((x - (rate * t).cos()).abs()))
}

/// What `odyn plugin pack` and `odyn plugin add` do.
fn packed(library: &Path, scratch: &Scratch) -> PathBuf {
    let licence = ("LICENSE".to_string(), b"MIT".to_vec());
    let package = Package::new(library, "[]".into(), vec![licence]).expect("a sound library");
    scratch.file(&package.info.file_name(), package.to_bytes().expect("memory"))
}

#[test]
fn a_library_is_packed_installed_pinned_verified_and_removed() {
    let scratch = Scratch::new();
    let archive = packed(&file(&build("good-plugin"), "good-plugin"), &scratch);
    let package = Package::read(&archive).expect("it was just written");
    assert_eq!(package.info.elements, ["joint rod", "force spring"]);
    let copies = kept("library-copies");
    let store = Store::of_project(&scratch.path().join("project"));
    let (installed, new) = store.add(&package, Some(&copies)).expect("sound");
    assert!(new && installed.problems().is_empty());
    assert!(!store.add(&package, Some(&copies)).expect("the same again").1);
    assert_eq!(fs::read_dir(store.folder()).unwrap().count(), 1, "no drafts are left");

    // The scene is below the project's folder.
    fs::create_dir_all(scratch.path().join("project/scenes")).unwrap();
    let with = |library: &str| scratch.file("project/scenes/scene.toml", SCENE.replace("LIBRARY", library));
    let (version, hash) = (&package.info.version, package.info.library_sha256());
    let pin = format!("{{ name = \"good-plugin\", version = \"{version}\", sha256 = \"{hash}\" }}");
    for library in ["\"good-plugin\"", &pin] {
        let session = open(&with(library), &[]).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(session.libraries[0].path.as_deref(), Some(installed.library().canonicalize().unwrap().as_path()));
        assert!(off(session, 3.0) < 1e-8);
    }
    let refused = |library: &str| {
        let error = open(&with(library), &[]).err().expect("refused");
        (error.diagnostics[0].code, error.exit_code(), error.render(false))
    };
    let (code, exit, text) = refused("{ name = \"good-plugin\", version = \"^7\" }");
    assert_eq!((code, exit), (codes::PLUGIN_VERSION, 4));
    assert!(text.contains(&format!("found: version {version} in ")) && text.contains("odyn plugin add"), "{text}");
    assert_eq!(refused(&pin.replace(hash, &"0".repeat(64))).0, codes::PLUGIN_CONTENT);
    assert_eq!(refused("\"other-plugin\"").0, codes::PLUGIN_NOT_FOUND);

    // Whatever changed it, it is not run.
    let path = installed.library();
    let bytes = fs::read(&path).unwrap();
    fs::write(&path, [bytes.as_slice(), b"more"].concat()).unwrap();
    assert_eq!(installed.problems().len(), 1);
    assert_eq!(refused("\"good-plugin\"").0, codes::PLUGIN_CONTENT);
    let again = store.add(&package, Some(&copies)).expect_err("what is there is not it");
    assert!(matches!(again, CatalogError::AlreadyInstalled { .. }), "{again}");
    store.remove("good-plugin", None).expect("it is there");
    assert_eq!(refused("\"good-plugin\"").0, codes::PLUGIN_NOT_FOUND);
    store.add(&package, Some(&copies)).expect("there is room again");
}

#[test]
fn what_does_not_load_is_not_installed() {
    let scratch = Scratch::new();
    let archive = packed(&file(&build("other-abi-plugin"), "other-abi-plugin"), &scratch);
    let package = Package::read(&archive).expect("it was just written");
    let store = Store::new(scratch.path().join("store"));
    let error = store.add(&package, Some(&kept("library-copies"))).expect_err("another interface");
    assert_eq!(error.code(), codes::ABI_VERSION);
    let mut other = Package::read(&archive).expect("as before");
    other.info.target = "riscv64gc-unknown-linux-gnu".into();
    let error = store.add(&other, None).expect_err("another machine");
    assert!(error.to_string().contains("it is for riscv64gc-unknown-linux-gnu, this machine is "), "{error}");
    other = Package::read(&archive).expect("as before");
    other.info.name = "another-name".into();
    assert!(
        store.add(&other, None).expect_err("another name").to_string().contains("its library is `other-abi-plugin`")
    );
    assert_eq!(fs::read_dir(store.folder()).unwrap().count(), 0, "nothing is left");
}

/// The library is built with one constant, then with another, into the same file, while the first is in use.
#[test]
fn a_library_that_was_built_again_is_loaded_beside_the_old_one() {
    let scratch = Scratch::new();
    let sources = kept("strangers").join("rebuilt");
    let built = |factor: &str| {
        let change = |source: String| {
            source.replace("S::from(-self.stiffness)", &format!("S::from(-{factor} * self.stiffness)"))
        };
        fs::read(file(&build_changed("good-plugin", "rebuilt", &sources, &change), "rebuilt")).unwrap()
    };
    let (first, second) = (built("1.0"), built("4.0"));
    assert!(first != second);
    let library = file(scratch.path(), "rebuilt");
    fs::write(&library, &first).unwrap();
    let scene = scratch.file("scene.toml", SCENE.replace("LIBRARY", "\"rebuilt\""));
    let options = options(&[], &[scratch.path().to_path_buf()]);
    let mut watched = Watched::new(&scene, &options);
    let plugins = [scratch.path().to_path_buf()];
    let old = open(&scene, &plugins).unwrap_or_else(|error| panic!("{error}"));

    let now = Instant::now();
    let mut look = |seconds: u64| watched.look(now + Duration::from_secs(seconds));
    assert_eq!(look(0), None);
    // A build in progress: half a file, for a while; then all of it.
    fs::write(&library, &second[..second.len() / 2]).unwrap();
    assert_eq!((look(1), look(2), look(9)), (None, None, None));
    fs::write(&library, &second).unwrap();
    assert_eq!(look(9), None, "it may still be written");
    assert_eq!(look(10).as_deref(), library.file_name().unwrap().to_str());
    assert_eq!((look(11), look(12)), (None, None), "once");
    let new = open(&scene, &plugins).unwrap_or_else(|error| panic!("{error}"));
    assert!(off(new, 6.0) < 1e-8, "the new library is in use");
    assert!(off(old, 3.0) < 1e-8, "and so is the old one");

    // Writing the same is no change; other scenes are.
    fs::write(&library, &second).unwrap();
    assert_eq!((look(20), look(21)), (None, None));
    fs::write(&scene, SCENE.replace("LIBRARY", "\"rebuilt\"").replace("t_end = 1", "t_end = 2")).unwrap();
    assert_eq!((look(30), look(31).as_deref()), (None, Some("scene.toml")));
    // What stays broken is reported by the run.
    fs::write(&library, &second[..100]).unwrap();
    assert_eq!((look(40), look(41)), (None, None));
    assert!(look(51).is_some());
    assert!(open(&scene, &plugins).is_err());
    fs::write(&library, &first).unwrap();
    assert_eq!((look(60), look(61).is_some()), (None, true));
    assert!(open(&scene, &plugins).is_ok_and(|session| off(session, 3.0) < 1e-8), "mistakes can be put right");
}

/// Another library of the name, further down the search order, is not taken while the first may be under construction, and not
/// without a word afterwards.
#[test]
fn a_watched_library_that_is_deleted_is_named_with_the_one_that_is_used_instead() {
    let scratch = Scratch::new();
    let [near, far] = ["near", "far"].map(|name| scratch.path().join(name));
    for folder in [&near, &far] {
        fs::create_dir(folder).unwrap();
        fs::copy(file(&build("good-plugin"), "good-plugin"), file(folder, "good-plugin")).unwrap();
    }
    let scene = scratch.file("scene.toml", SCENE.replace("LIBRARY", "\"good-plugin\""));
    let mut watched = Watched::new(&scene, &options(&[], &[near.clone(), far.clone()]));
    let now = Instant::now();
    let mut look = |seconds: u64| watched.look(now + Duration::from_secs(seconds));
    assert_eq!(look(0), None);
    let library = file(&near, "good-plugin");
    let bytes = fs::read(&library).unwrap();
    fs::remove_file(&library).unwrap();
    assert_eq!((look(1), look(2), look(9)), (None, None, None));
    fs::write(&library, &bytes).unwrap();
    assert_eq!((look(10), look(30)), (None, None), "it is back");
    fs::remove_file(&library).unwrap();
    assert_eq!((look(40), look(41)), (None, None));
    let other = file(&far, "good-plugin");
    let words = format!("`{}` (gone; `{}` is used instead)", library.display(), other.display());
    assert_eq!(look(52), Some(words));
}
