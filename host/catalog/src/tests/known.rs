//! What is known of a library holds for the content that was hashed, and for no other.

use std::fs;
use std::path::PathBuf;

use element_api::manifest::Manifest;

use super::super::known::{Identity, find, note, write};
use super::super::private_copy::{copy_into, name};
use crate::sha256;

/// What a library says of itself.
const MANIFEST: &str = "ODYN-MANIFEST 1\npackage=known\nversion=0.1.0\nabout=For tests\nabi=1\nconventions=1\n\
    interface=1.2.0\nentry=known\nfeatures=\nprofile=release\nelement=joint hinge\nend\n";

struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("odyn-known-{name}-{}", std::process::id()));
        let _ = fs::remove_dir_all(&path);
        fs::create_dir_all(path.join("copies")).expect("a folder");
        Self(path)
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

#[test]
fn a_library_is_known_until_it_or_its_copy_changes() {
    let folder = Folder::new("changes");
    let (library, copies) = (folder.0.join("library.so"), folder.0.join("copies"));
    let known = || find(&library, Some(&copies)).map(|known| (known.sha256, known.copy));
    fs::write(&library, b"first").expect("writable");
    let hash = sha256(b"first");
    let content = (hash.as_str(), MANIFEST.as_bytes());
    let copied = || copy_into(&copies, &library, Some(&hash)).expect("a copy").path;
    let copy = copied();
    assert_eq!(known(), None);
    let identity = Identity::of(&library);
    // A file of this moment may change once more without another time.
    note(&library, identity.as_ref(), content, &copy);
    assert_eq!(known(), None);
    write(identity.as_ref(), content, &copy);
    assert_eq!(known(), Some((hash.clone(), copies.join(name(&hash)))));
    let manifest = find(&library, Some(&copies)).map(|known| known.manifest).expect("known");
    assert_eq!(manifest, Manifest::parse(MANIFEST.as_bytes()).expect("a manifest").swap_remove(0));
    // Taken again, the copy stays as it is.
    copied();
    assert!(known().is_some());

    // The same length, and times set back to what they were.
    let then = fs::metadata(&library).and_then(|data| data.modified()).expect("a time");
    fs::write(&library, b"other").expect("writable");
    fs::File::options().write(true).open(&library).and_then(|file| file.set_modified(then)).expect("settable");
    assert_eq!(known(), None);

    write(Identity::of(&library).as_ref(), content, &copy);
    assert!(known().is_some());
    let then = fs::metadata(&copy).and_then(|data| data.modified()).expect("a time");
    fs::write(&copy, b"wrong").expect("writable");
    fs::File::options().write(true).open(&copy).and_then(|file| file.set_modified(then)).expect("settable");
    assert_eq!(known(), None, "a copy that was exchanged");

    write(Identity::of(&library).as_ref(), content, &copy);
    fs::remove_file(&copy).expect("removable");
    assert_eq!(known(), None, "a copy that is gone");
    fs::write(&library, b"first").expect("writable");
    copied();
    write(Identity::of(&library).as_ref(), (&hash, b"ODYN-MANIFEST 1\npackage=known\n"), &copy);
    assert_eq!(known(), None, "an entry that was cut off");
    // What is no entry is none.
    for entry in fs::read_dir(&copies).expect("a folder").filter_map(Result::ok) {
        fs::write(entry.path(), b"\xff\xff").expect("writable");
    }
    assert_eq!(known(), None);
}
