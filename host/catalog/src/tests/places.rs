//! Which library is taken where several places, versions or builds answer to a name. The files have a manifest and nothing
//! else: nothing is loaded.

use super::super::archive::Package;
use super::super::hash::sha256;
use super::super::package::target;
use super::super::store::Store;
use super::*;

/// The smallest file that passes for a library: an ELF header, a section with the manifest, no code. `build` distinguishes builds of
/// one version apart.
fn library(package: &str, version: &str, build: &str) -> Vec<u8> {
    let manifest = format!(
        "ODYN-MANIFEST 1\npackage={package}\nversion={version}\nabout=build {build}\nabi=1\nconventions=1\ninterface=1.0.0\n\
         entry=none\nfeatures=\nprofile=release\nelement=joint wobble\nend\n"
    );
    let names = b"\0.odyn\0.shstrtab\0";
    let machine: u16 = if cfg!(target_arch = "aarch64") { 183 } else { 62 };
    let mut bytes = b"\x7fELF\x02\x01\x01\0\0\0\0\0\0\0\0\0".to_vec();
    let sections_at = 64 + manifest.len() + names.len();
    bytes.extend([3_u16, machine].iter().flat_map(|half| half.to_le_bytes())); // ET_DYN
    bytes.extend(1_u32.to_le_bytes());
    bytes.extend([0, 0, sections_at as u64].iter().flat_map(|long| long.to_le_bytes()));
    bytes.extend(0_u32.to_le_bytes());
    bytes.extend([64_u16, 0, 0, 64, 3, 2].iter().flat_map(|half| half.to_le_bytes()));
    bytes.extend(manifest.as_bytes());
    bytes.extend(names);
    // Name, type, then flags, address, offset, size, then link and info, then alignment and entry size.
    for (name, kind, at, size) in [(0, 0, 0, 0), (1, 1, 64, manifest.len()), (7, 3, 64 + manifest.len(), names.len())] {
        bytes.extend([name, kind].iter().flat_map(|word: &u32| word.to_le_bytes()));
        bytes.extend([0, 0, at as u64, size as u64].iter().flat_map(|long| long.to_le_bytes()));
        bytes.extend([0_u32, 0].iter().flat_map(|word| word.to_le_bytes()));
        bytes.extend([1_u64, 0].iter().flat_map(|long| long.to_le_bytes()));
    }
    bytes
}

/// Installs a library without its being loaded.
fn install(folder: &Folder, store: &str, package: &str, version: &str, build: &str) -> PathBuf {
    let (bytes, name) = (library(package, version, build), file_name(&package.replace('-', "_")));
    let info = format!(
        "format = 1\nname = \"{package}\"\nversion = \"{version}\"\nabout = \"\"\ncontract = \"1.0.0\"\nabi = 1\n\
         conventions = 1\ntarget = \"{}\"\nprofile = \"release\"\nlibrary = \"{name}\"\nelements = []\n[files]\n\"{name}\" = \"{}\"\n",
        target(),
        sha256(&bytes)
    );
    folder.file(&format!("{store}/{package}/{version}/plugin.toml"), info);
    folder.file(&format!("{store}/{package}/{version}/{name}"), bytes)
}

fn put(folder: &Folder, place: &str, package: &str, version: &str, build: &str) -> PathBuf {
    folder.file(&format!("{place}/{}", file_name(&package.replace('-', "_"))), library(package, version, build))
}

fn search(folder: &Folder) -> SearchPath {
    let at = |name: &str| folder.0.join(name);
    let path =
        SearchPath::of(&[at("command")], &[at("scene")], Some(at("environment").as_os_str()), &at("program/odyn"));
    path.with_store(Origin::User, Some(at("user"))).with_store(Origin::Project, Some(at("project")))
}

fn pinned(version: &str) -> Request {
    Request { version: Some(version.parse().expect("a range")), ..Request::named("acme-wobble") }
}

#[test]
fn stores_have_their_places_in_the_order() {
    let folder = Folder::new("six-places");
    let search = search(&folder);
    let order: Vec<&str> = search.places().map(|place| place.origin.words()).collect();
    assert_eq!(order, ["command line", "scene", "project", "ODYN_PLUGIN_PATH", "user", "program", "program"]);
    // Each one that comes is asked before those that were there.
    for place in ["program", "user", "environment", "project", "scene", "command"] {
        let path = match place {
            "user" | "project" => install(&folder, place, "acme-wobble", "1.0.0", place),
            _ => put(&folder, place, "acme-wobble", "1.0.0", place),
        };
        assert_eq!(search.locate("acme-wobble").expect("it was just written"), path, "{place}");
    }
}

#[test]
fn the_highest_version_of_a_store_is_taken_and_a_pin_may_want_another() {
    let folder = Folder::new("versions");
    let search = search(&folder);
    for version in ["1.9.0", "1.10.0", "0.9.0", "2.0.0-rc.1"] {
        install(&folder, "user", "acme-wobble", version, "");
    }
    let taken = |request: &Request| {
        let choice = search.choose(request).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(choice.note(request), None, "versions side by side are no surprise");
        choice.found.path.parent().and_then(|p| p.file_name()).expect("a version").to_string_lossy().into_owned()
    };
    assert_eq!(taken(&Request::named("acme-wobble")), "2.0.0-rc.1");
    assert_eq!(taken(&Request::named("acme_wobble")), "2.0.0-rc.1");
    for (range, version) in
        [("1", "1.10.0"), ("^1.2", "1.10.0"), ("=1.9.0", "1.9.0"), ("<1", "0.9.0"), (">=2.0.0-rc.1", "2.0.0-rc.1")]
    {
        assert_eq!(taken(&pinned(range)), version, "{range}");
    }
    // The other places count as well: the highest that fits, wherever it is.
    put(&folder, "command", "acme-wobble", "1.1.0", "");
    let higher = put(&folder, "program", "acme-wobble", "1.11.0", "");
    assert_eq!(search.find(&pinned("1")).expect("in the last place"), higher);
    assert_eq!(taken(&pinned("=1.9.0")), "1.9.0");
}

#[test]
fn a_pin_that_nothing_fits_tells_what_there_is() {
    let folder = Folder::new("none-fits");
    let search = search(&folder);
    install(&folder, "project", "acme-wobble", "1.0.0", "");
    put(&folder, "program", "acme-wobble", "0.3.0", "");
    folder.file(&format!("command/{}", file_name("acme_wobble")), "half");
    let error = search.choose(&pinned("^1.2")).expect_err("too old");
    assert_eq!(
        (error.code(), error.to_string().as_str()),
        (codes::PLUGIN_VERSION, "no library `acme-wobble` is of version ^1.2")
    );
    let help = error.help().join("\n");
    for part in [
        "version 1.0.0 in ",
        "(project)",
        "version 0.3.0 in ",
        "(program)",
        "(command line): ",
        "truncated",
        "odyn plugin add acme-wobble-",
    ] {
        assert!(help.contains(part), "{part}: {help}");
    }
    let absent = search.choose(&Request { name: "acme-wobbly".into(), ..pinned("1") }).expect_err("no such name");
    assert_eq!(absent.code(), codes::PLUGIN_NOT_FOUND);
    assert!(absent.help().iter().any(|line| line.contains("odyn plugin add")), "{:?}", absent.help());
    assert!(absent.help().iter().any(|line| line == "did you mean `acme-wobble`?"), "{:?}", absent.help());
}

/// Folders that are named and not there, links that lead nowhere, and files that the system does not give.
#[cfg(unix)]
#[test]
fn what_cannot_be_looked_at_is_named() {
    let folder = Folder::new("unreadable");
    let search = search(&folder);
    let link = folder.file("scene/readme", "").with_file_name(file_name("acme_wobble"));
    std::os::unix::fs::symlink("nowhere", &link).expect("writable");
    let help = search.choose(&Request::named("acme-wobble")).expect_err("not there").help();
    let at = |name: &str| folder.0.join(name).display().to_string();
    for (place, said) in [
        (at("command"), "(command line) cannot be read: "),
        (at("environment"), "(ODYN_PLUGIN_PATH) cannot be read: "),
        (link.display().to_string(), "is a link that leads nowhere: "),
    ] {
        assert!(help.iter().any(|line| line.starts_with(&format!("`{place}` {said}"))), "{place}: {help:?}");
    }
    assert!(!help.iter().any(|line| line.starts_with(&format!("`{}`", at("program")))), "{help:?}");
    let error = read_manifest(&link).expect_err("not there");
    assert!(error.to_string().contains("cannot be read: ") && error.help().is_empty(), "{error}");
}

#[test]
fn to_replace_what_a_project_has_the_project_is_named() {
    let folder = Folder::new("replace");
    install(&folder, ".odyn/plugins", "acme-wobble", "1.0.0", "old");
    let built = put(&folder, "build", "acme-wobble", "1.0.0", "new");
    let package = Package::new(&built, "[]".into(), Vec::new()).expect("sound");
    let store = Store::of_project(&folder.0);
    for (store, of) in
        [(Store::new(store.folder()), String::new()), (store, format!(" --project {}", folder.0.display()))]
    {
        let help = store.add(&package, None).expect_err("another build").help();
        assert!(help[0].ends_with(&format!("`odyn plugin remove acme-wobble@1.0.0{of}`")), "{help:?}");
    }
}

#[test]
fn a_hash_is_exact() {
    let folder = Folder::new("hashes");
    let search = search(&folder);
    put(&folder, "command", "acme-wobble", "1.0.0", "first");
    let second = put(&folder, "scene", "acme-wobble", "1.0.0", "second");
    let hash = sha256(&fs::read(&second).expect("it was just written"));
    let request = Request { sha256: Some(hash.clone()), ..Request::named("acme-wobble") };
    let choice = search.choose(&request).expect("the second place has it");
    assert_eq!((choice.found.path.as_path(), choice.note(&request)), (second.as_path(), None));
    fs::write(&second, library("acme-wobble", "1.0.0", "third")).expect("writable");
    let error = search.choose(&request).expect_err("gone");
    assert_eq!(error.code(), codes::PLUGIN_CONTENT);
    assert!(error.to_string().contains(&hash), "{error}");
    // A file that is exchanged between the choice and the loading.
    let error = Catalog::new().add_request(&request, &search).expect_err("gone");
    assert_eq!(error.code(), codes::PLUGIN_CONTENT);
}

#[test]
fn a_path_begins_at_the_scene() {
    let folder = Folder::new("beside");
    let scene = folder.0.join("scene");
    let own = put(&folder, "scene/libs", "acme-wobble", "1.0.0", "own");
    let path = format!("./libs/{}", file_name("acme_wobble"));
    let found = |command: &[PathBuf]| SearchPath::for_scene(command, &[], &scene).locate(&path);
    assert_eq!(found(&[]).expect("beside the scene").canonicalize().ok(), own.canonicalize().ok());
    // One of the command line begins where that was given.
    let error = found(&[PathBuf::from(&path)]).expect_err("not there");
    assert!(error.help().iter().any(|line| line.contains(&scene.display().to_string())), "{:?}", error.help());
}

#[test]
fn there_is_no_silent_winner() {
    let folder = Folder::new("winner");
    let search = search(&folder);
    let request = Request::named("acme-wobble");
    let winner = install(&folder, "project", "acme-wobble", "1.0.0", "one");
    put(&folder, "program", "acme-wobble", "1.0.0", "one");
    let note = |request: &Request| search.choose(request).expect("several").note(request);
    assert_eq!(note(&request), None, "two copies of one file are one library");
    let loser = install(&folder, "user", "acme-wobble", "1.5.0", "two");
    let told = note(&request).expect("two libraries");
    assert_eq!(told.code, codes::PASSED_OVER);
    assert!(!told.is_error() && told.message.contains(&format!("taken is {} (project)", winner.display())), "{told:?}");
    assert_eq!(told.help[0], format!("passed over: {} (user)", loser.display()));
    assert_eq!(note(&pinned("^1.2")), None, "a pin that only one fits has no rivals");
    // Two builds of one version.
    let rival = put(&folder, "scene", "acme-wobble", "1.5.0", "three");
    let told = note(&pinned("^1.2")).expect("two builds of 1.5.0");
    assert!(told.message.contains(&rival.display().to_string()), "{told:?}");
    // `wobble` stands for two packages.
    put(&folder, "program", "odyn-wobble", "1.0.0", "");
    put(&folder, "program", "wobble", "1.0.0", "");
    let told = Request::named("wobble");
    assert_eq!(note(&told), None, "copies beside a program are a build's");
    put(&folder, "command", "odyn-wobble", "1.0.0", "other");
    put(&folder, "command", "wobble", "1.0.0", "");
    assert!(note(&told).is_some_and(|told| told.message.contains("odyn_wobble")));
}

#[test]
fn of_the_folders_of_a_scene_the_first_is_meant_unless_another_is_newer() {
    let folder = Folder::new("listed");
    let scene = [folder.0.join("release"), folder.0.join("debug")];
    let search = SearchPath::of(&[], &scene, None, Path::new(""));
    let debug = put(&folder, "debug", "acme-wobble", "1.0.0", "debug");
    let release = put(&folder, "release", "acme-wobble", "1.0.0", "release");
    let request = Request::named("acme-wobble");
    let note = || search.choose(&request).expect("two").note(&request);
    let written = |path: &Path, seconds: u64| {
        let file = fs::File::options().write(true).open(path).expect("a file");
        file.set_modified(std::time::UNIX_EPOCH + std::time::Duration::from_secs(seconds)).expect("a time");
    };
    written(&debug, 1000);
    written(&release, 2000);
    assert_eq!(note(), None);
    written(&debug, 3000);
    let told = note().expect("a newer one");
    assert!(told.message.contains(&format!("taken is {} (scene)", release.display())), "{told:?}");
}

#[test]
fn a_broken_installation_is_no_reason_to_take_another() {
    let folder = Folder::new("broken");
    let search = search(&folder);
    install(&folder, "user", "acme-wobble", "1.0.0", "");
    put(&folder, "program", "acme-wobble", "1.0.0", "");
    folder.file("user/acme-wobble/1.1.0/plugin.toml", "format = 1\n");
    let error = search.locate("acme-wobble").expect_err("the highest version is broken");
    assert_eq!(error.code(), codes::BAD_PACKAGE);
    assert!(search.find(&pinned("=1.0.0")).is_ok());
    // What was changed after it was installed is not run.
    let path = install(&folder, "project", "acme-wobble", "3.0.0", "as installed");
    fs::write(path, library("acme-wobble", "3.0.0", "changed")).expect("writable");
    let error = Catalog::new().add("acme-wobble", &search).expect_err("changed");
    assert_eq!(error.code(), codes::PLUGIN_CONTENT);
    assert!(error.help()[0].contains("odyn plugin verify"));
}

#[test]
fn stores_list_verify_and_remove() {
    let folder = Folder::new("store");
    let store = Store::new(folder.0.join("user"));
    assert!(store.installed().is_empty());
    for version in ["1.9.0", "1.10.0"] {
        install(&folder, "user", "acme-wobble", version, "");
    }
    install(&folder, "user", "acme-rods", "0.1.0", "");
    folder.file("user/acme-wobble/notes/readme", "not a version");
    let names =
        |store: &Store| store.installed().iter().map(|one| format!("{}@{}", one.name, one.version)).collect::<Vec<_>>();
    assert_eq!(names(&store), ["acme-rods@0.1.0", "acme-wobble@1.10.0", "acme-wobble@1.9.0"]);
    let wobble = &store.installed()[1];
    assert_eq!(wobble.problems(), Vec::<String>::new());
    fs::write(wobble.library(), "changed").expect("writable");
    folder.file("user/acme-wobble/1.10.0/docs/stray", "");
    let found = wobble.problems();
    assert_eq!(
        found,
        [format!("`{}` was changed", file_name("acme_wobble")), "`docs/stray` does not belong to it".into()]
    );

    let several = store.remove("acme-wobble", None).expect_err("two of them");
    assert_eq!(several.help(), ["installed are acme-wobble@1.10.0, acme-wobble@1.9.0"]);
    assert_eq!(several.code(), codes::INSTALLATION);
    assert!(store.remove("acme-wobble", Some(&"3.0.0".parse().expect("a version"))).is_err());
    assert!(store.remove("..", None).is_err());
    store.remove("acme-wobble", Some(&"1.10.0".parse().expect("a version"))).expect("one of them");
    store.remove("acme-rods", None).expect("the only one");
    assert_eq!(names(&store), ["acme-wobble@1.9.0"]);
    assert!(!store.folder().join("acme-rods").exists());
}
