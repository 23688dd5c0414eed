use super::*;

const TEXT: &str = "ODYN-MANIFEST 1\npackage=my-elements\nversion=0.3.1\nabout=One rod\nabi=1\nconventions=1\n\
    interface=1.0.0\nentry=odyn_plugin_v1_my_elements\nfeatures=sse4.2 avx\nprofile=debug\nelement=joint rod\n\
    element=force spring\nend\n";

fn read(text: &str) -> Result<Manifest, String> {
    Manifest::parse(text.as_bytes()).map(|mut list| list.remove(0))
}

#[test]
fn every_key_is_read() {
    let element = |kind: &str, name: &str| ManifestElement { kind: kind.into(), name: name.into() };
    let expected = Manifest {
        package: "my-elements".into(),
        version: "0.3.1".into(),
        about: "One rod".into(),
        abi: 1,
        table: EntryTable::Rust,
        conventions: 1,
        interface: "1.0.0".into(),
        entry: "odyn_plugin_v1_my_elements".into(),
        features: vec!["sse4.2".into(), "avx".into()],
        profile: Profile::Debug,
        elements: vec![element("joint", "rod"), element("force", "spring")],
    };
    assert_eq!(read(TEXT), Ok(expected));
}

#[test]
fn joining_parts_gives_a_manifest_of_this_version() {
    const PARTS: &[&str] = &[OPENING, "p", "\nversion=2.0.0\nentry=e", "\nend\n"];
    static BYTES: [u8; joined_len(PARTS)] = joined(PARTS);
    let manifest = &Manifest::parse(&BYTES).expect("a manifest")[0];
    assert_eq!((manifest.abi, manifest.conventions, manifest.interface.as_str()), (ABI, CONVENTIONS, INTERFACE));
    assert_eq!(manifest.package, "p");
}

#[test]
fn a_c_before_the_number_stands_for_the_c_table() {
    let manifest = read(&TEXT.replace("abi=1", "abi=c7")).expect("a manifest");
    assert_eq!((manifest.table, manifest.abi), (EntryTable::C, 7));
}

#[test]
fn unknown_keys_and_kinds_of_a_later_version_are_no_obstacle() {
    let text = TEXT.replace("profile=debug\n", "colour=blue = green\nelement=driver crank\n");
    let manifest = read(&text).expect("a manifest");
    assert_eq!(manifest.profile, Profile::Release);
    assert_eq!(manifest.elements[0].kind, "driver");
}

#[test]
fn several_manifests_and_padding_are_read() {
    let bytes = format!("\0\0{TEXT}\0\0\0{}\0\0", TEXT.replace("my-elements", "others"));
    let packages: Vec<String> =
        Manifest::parse(bytes.as_bytes()).expect("two manifests").into_iter().map(|m| m.package).collect();
    assert_eq!(packages, ["my-elements", "others"]);
}

#[test]
fn each_defect_is_named() {
    let cases: [(&str, &str, &str); 11] = [
        ("ODYN-MANIFEST 1", "ODYN-MANIFEST 2", "format is 2, this host reads format 1"),
        ("ODYN-MANIFEST 1", "ODYN 1", "does not begin with `ODYN-MANIFEST`"),
        ("end\n", "", "does not finish with `end`"),
        ("package=my-elements\n", "", "`package` is missing"),
        ("package=my-elements", "package=../x", "`../x` is not the name of a package"),
        ("abi=1", "abi=one", "`abi` is `one`, which is not a whole number"),
        ("abi=1", "abi=c", "`abi` is `c`, which is not a whole number"),
        ("abi=1\n", "abi=1\nabi=2\n", "`abi` is given twice"),
        ("about=One rod", "about", "the line `about` has no `=`"),
        ("force spring", "force rod", "the element `rod` is named twice"),
        ("profile=debug", "profile=fast", "the profile is `fast`"),
    ];
    for (part, replacement, expected) in cases {
        let error = read(&TEXT.replacen(part, replacement, 1)).expect_err(expected);
        assert!(error.contains(expected), "{error} / {expected}");
    }
    assert!(Manifest::parse(b"").expect_err("empty").contains("empty"));
    assert!(Manifest::parse(b"\xff\xfe").expect_err("binary").contains("UTF-8"));
    assert!(Manifest::parse(&vec![b' '; LONGEST + 1]).expect_err("long").contains("at most"));
}

#[test]
fn every_truncation_is_an_error() {
    for length in 1..TEXT.trim_end().len() {
        assert!(read(&TEXT[..length]).is_err(), "cut to {length} bytes");
    }
}

#[test]
#[should_panic(expected = "same NAME")]
fn two_elements_of_one_name_fail_the_build() {
    check_names(&["rod", "spring", "rod"]);
}

#[test]
#[should_panic(expected = "a-z, 0-9 and `-`")]
fn names_that_scenes_cannot_write_fail_the_build() {
    check_names(&["fixed-2", "big_Rod"]);
}
