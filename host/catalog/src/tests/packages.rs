//! Packages: what goes in comes out, and nothing else does. The libraries here are no libraries: nothing is loaded.

use std::io::{Cursor, Write};

use super::super::archive::Package;
use super::super::hash::sha256;
use super::super::package::{INFO_FILE, PackageInfo, check_file_name, target};

const HASH: &str = "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855";

fn package(name: &str, version: &str, library: &[u8]) -> Package {
    let files =
        [("librod.so", library), ("README.md", b"# Rods"), ("docs/more/theory.md", b"r = 1"), ("LICENSE", b"MIT")];
    let text = |(name, content): &(&str, &[u8])| format!("\"{name}\" = \"{}\"\n", sha256(content));
    let text = format!(
        "format = 1\nname = \"{name}\"\nversion = \"{version}\"\nabout = \"Rods\"\ncontract = \"1.0.0\"\nabi = 1\n\
         conventions = 1\ntarget = \"{}\"\nprofile = \"release\"\nlibrary = \"librod.so\"\nelements = [\"joint rod\"]\n[files]\n{}",
        target(),
        files.iter().map(text).collect::<String>()
    );
    let info = PackageInfo::parse(&text).expect("sound");
    Package { info, files: files.iter().map(|(name, content)| (name.to_string(), content.to_vec())).collect() }
}

fn rods() -> Package {
    package("acme-rods", "1.2.0", b"a library")
}

fn read(bytes: &[u8]) -> Result<Package, String> {
    Package::from_reader(Cursor::new(bytes))
}

/// An archive of these entries: name, type, content. Names are written as they are, whatever the crate thinks of them.
fn archive(entries: &[(&str, tar::EntryType, &[u8])]) -> Vec<u8> {
    let mut plain = Vec::new();
    for (name, kind, content) in entries {
        let mut header = tar::Header::new_ustar();
        header.as_old_mut().name[..name.len()].copy_from_slice(name.as_bytes());
        header.set_entry_type(*kind);
        header.set_size(content.len() as u64);
        header.set_mode(0o644);
        header.set_cksum();
        plain.extend(header.as_bytes());
        plain.extend(*content);
        plain.resize(plain.len().next_multiple_of(512), 0);
    }
    plain.resize(plain.len() + 1024, 0);
    compressed(&plain)
}

fn compressed(plain: &[u8]) -> Vec<u8> {
    let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    encoder.write_all(plain).expect("memory");
    encoder.finish().expect("memory")
}

/// The entries of a package with one more, or one changed.
fn with(name: &str, kind: tar::EntryType, content: &[u8]) -> Result<Package, String> {
    let package = rods();
    let info = package.info.to_toml();
    let mut entries: Vec<(&str, tar::EntryType, &[u8])> = vec![(INFO_FILE, tar::EntryType::Regular, info.as_bytes())];
    entries.extend(
        package.files.iter().map(|(name, content)| (name.as_str(), tar::EntryType::Regular, content.as_slice())),
    );
    entries.retain(|(known, ..)| *known != name);
    entries.push((name, kind, content));
    read(&archive(&entries))
}

#[test]
fn a_package_comes_out_as_it_went_in() {
    let package = rods();
    let bytes = package.to_bytes().expect("memory");
    assert_eq!(read(&bytes).expect("sound"), package);
    assert_eq!(rods().to_bytes().expect("memory"), bytes, "the same content gives the same bytes");
    assert_eq!(package.info.file_name(), format!("acme-rods-1.2.0-{}.odynplugin", target()));
    assert_eq!(with("LICENSE", tar::EntryType::Regular, b"MIT").expect("as above"), package);
}

#[test]
fn files_cannot_leave_their_folder() {
    for name in [
        "../x",
        "a/../../x",
        "/x",
        "a//x",
        "./x",
        "a/./x",
        "",
        "a/",
        "a\\..\\x",
        "C:x",
        ".hidden",
        "a/.x",
        "x.",
        "x ",
        "line\nbreak",
        "a\u{0}b",
        "nul?",
        &"x".repeat(101),
    ] {
        assert!(check_file_name(name).is_err(), "{name:?}");
    }
    for name in ["x", "docs/größe.md", "LICENSE-MIT", "a/b/c/d.png", "x..y"] {
        assert_eq!(check_file_name(name), Ok(()));
    }
    for name in ["../evil", "/etc/evil", "docs/../../evil"] {
        let error = with(name, tar::EntryType::Regular, b"x").expect_err("out of the folder");
        assert!(error.contains("cannot be called"), "{error}");
    }
}

#[test]
fn only_plain_files_are_taken() {
    use tar::EntryType;
    for kind in [
        EntryType::Symlink,
        EntryType::Link,
        EntryType::Directory,
        EntryType::Char,
        EntryType::Block,
        EntryType::Fifo,
        EntryType::GNULongName,
        EntryType::GNULongLink,
        EntryType::GNUSparse,
        EntryType::XHeader,
        EntryType::XGlobalHeader,
    ] {
        let error = with("odd", kind, b"").expect_err("no plain file");
        assert_eq!(error, "`odd` is not a plain file", "{kind:?}");
    }
}

#[test]
fn what_was_changed_is_found() {
    use tar::EntryType::Regular;
    let error = with("README.md", Regular, b"# Nods").expect_err("changed");
    assert!(error.contains("`README.md` was changed"), "{error}");
    let error = with("stray.md", Regular, b"").expect_err("one more");
    assert!(error.contains("does not name the file `stray.md`"), "{error}");
    let mut fewer = rods();
    fewer.files.remove("LICENSE");
    let error = read(&fewer.to_bytes().expect("memory")).expect_err("one less");
    assert_eq!(error, "the file `LICENSE` is missing");
    let file: (&str, _, &[u8]) = ("a", Regular, b"1");
    assert_eq!(read(&archive(&[file, file])).expect_err("twice"), "it has two files `a`");
    assert_eq!(read(&archive(&[file])).expect_err("nothing says what it is"), "it has no `plugin.toml`");
}

#[test]
fn damaged_packages_are_errors_and_not_panics() {
    let bytes = rods().to_bytes().expect("memory");
    for length in 0..bytes.len() {
        assert!(read(&bytes[..length]).is_err(), "cut to {length}");
    }
    for k in 0..bytes.len() {
        let mut damaged = bytes.clone();
        damaged[k] ^= 0x55;
        // Some bytes of the head of the compressed file mean nothing.
        if let Ok(package) = read(&damaged) {
            assert_eq!(package, rods(), "byte {k}");
        }
    }
    assert!(read(b"[plugins]\n").is_err());
}

#[test]
fn sizes_are_bounded_before_anything_is_read() {
    let mut header = tar::Header::new_ustar();
    header.set_path("big").expect("short");
    header.set_size(1 << 40);
    header.set_cksum();
    let error = read(&compressed(header.as_bytes())).expect_err("a terabyte");
    assert!(error.contains("larger than 512 MB"), "{error}");
    let names: Vec<String> = (0..1100).map(|k| format!("f{k}")).collect();
    let many: Vec<(&str, _, &[u8])> = names.iter().map(|n| (n.as_str(), tar::EntryType::Regular, &b""[..])).collect();
    assert_eq!(read(&archive(&many)).expect_err("too many"), "it has more than 1000 files");
}

#[test]
fn descriptions_are_judged() {
    let sound = rods().info.to_toml();
    assert_eq!(PackageInfo::parse(&sound), Ok(rods().info));
    let later = sound.replace("[files]", "later_key = 1\n[files]");
    assert_eq!(
        PackageInfo::parse(&later),
        Ok(rods().info),
        "keys of later versions of the format's first form are skipped"
    );
    for (from, to, expected) in [
        ("format = 1", "format = 2", "its format is 2, this host reads format 1"),
        ("format = 1\n", "", "it has no `format`"),
        ("acme-rods", "../rods", "`../rods` cannot be the name of a package"),
        ("\"1.2.0\"", "\"1.2\"", "unexpected end of input while parsing minor version number"),
        ("librod.so\"", "docs/lib.so\"", "its library `docs/lib.so` is not among its files"),
        ("[files]", "[files]\n\"readme.MD\" = \"HASH\"", "two of its files are called `readme.md`, but for capitals"),
        (
            "[files]",
            "[files]\n\"Plugin.toml\" = \"HASH\"",
            "two of its files are called `plugin.toml`, but for capitals",
        ),
        ("[files]", "[files]\nx = \"12\"", "the SHA-256 of `x` is not one: `12`"),
        ("[files]", "[files]\n\"../x\" = \"HASH\"", "a file of a package cannot be called `../x`"),
    ] {
        assert!(sound.contains(from), "{from}");
        let error = PackageInfo::parse(&sound.replacen(from, &to.replace("HASH", HASH), 1)).expect_err(to);
        assert!(error.contains(expected), "{error}");
    }
}
