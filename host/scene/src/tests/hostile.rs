//! Input that nobody writes on purpose, or only on purpose: no panic, no overflow of the stack, no endless
//! work.

use super::*;

#[test]
fn an_empty_file_says_what_is_missing() {
    for text in ["", "\n\n", "# nothing\n", "\u{feff}"] {
        let rejected = reject(text);
        assert_eq!(rejected.codes(), [codes::MISSING_KEY], "{text:?}");
        assert!(rejected.rendered().contains("no `[simulation]`"));
    }
}

#[test]
fn deep_nesting_is_refused() {
    let lists = format!("x = {}1{}", "[".repeat(100_000), "]".repeat(100_000));
    let tables = format!("x = {}1{}", "{a=".repeat(100_000), "}".repeat(100_000));
    let keys = format!("x{} = 1", ".a".repeat(100_000));
    let header = format!("[x{}]\nb = 1", ".a".repeat(100_000));
    // Below the limits of the parser for keys and for brackets, 6000 levels together.
    let levels = format!("{{a{}=", ".a".repeat(75)).repeat(75);
    let mixed = format!("x = {levels}1{}", "}".repeat(75));
    for text in [&lists, &tables, &keys, &header, &mixed] {
        let found = reject(text).codes();
        assert_eq!(found, [codes::TOO_DEEP]);
    }
    let found = reject_with(SIMULATION, &[&mixed.replace("x =", "title =")]).codes();
    assert_eq!(found, [codes::TOO_DEEP]);
}

#[test]
fn deep_expressions_are_refused() {
    for expression in [
        format!("{}1{}", "(".repeat(100_000), ")".repeat(100_000)),
        format!("{}1", "-".repeat(100_000)),
        format!("1{}", "^1".repeat(100_000)),
        format!("{}1{}", "sin(".repeat(100_000), ")".repeat(100_000)),
    ] {
        let rejected = reject(&with_parameter("", &format!("\"{expression}\"")));
        assert_eq!(rejected.codes(), [codes::EXPRESSION_TOO_DEEP]);
    }
    let nested = format!("{}m{}", "(".repeat(100_000), ")".repeat(100_000));
    let rejected = reject(&with_parameter("", &format!("\"1 N/{nested}\"")));
    assert_eq!(rejected.codes(), [codes::EXPRESSION_TOO_DEEP]);
}

#[test]
fn long_expressions_are_computed() {
    let sum = format!("\"1{}\"", "+1".repeat(100_000));
    let scene = accept(&with_parameter("", &sum));
    assert_eq!(scene.parameters.get("x").unwrap().value.si, 100_001.0);
}

#[test]
fn long_chains_and_circles_of_parameters_end() {
    let mut chain = String::from("[parameters]\n");
    for k in 0..20_000 {
        chain.push_str(&format!("p{k} = \"p{} + 1\"\n", k + 1));
    }
    let end = format!("p20000 = 0\n{SIMULATION}");
    let scene = accept(&format!("{chain}{end}"));
    assert_eq!(scene.parameters.get("p0").unwrap().value.si, 20_000.0);
    let rejected = reject(&format!("{chain}p20000 = \"p0\"\n{SIMULATION}"));
    assert_eq!(rejected.codes(), [codes::PARAMETER_CYCLE]);
}

#[test]
fn huge_numbers_are_refused_not_wrapped() {
    for value in ["1e400", "-1e400", "1_0e4_00", "inf", "+inf", "nan", "-nan"] {
        assert_eq!(reject(&with_parameter("", value)).codes(), [codes::NOT_FINITE], "{value}");
    }
    let scene = accept(&with_parameter("", "100_000_000_000_000_000_000_000"));
    assert_eq!(scene.parameters.get("x").unwrap().value.si, 1e23);
    // Finite as written, not in SI.
    let text = format!("[units]\nlength = \"Tm\"\n{SIMULATION}gravity = [1e300, 0, 0]\n");
    assert_eq!(reject(&text).codes(), [codes::NOT_FINITE]);
    let text = text.replace("1e300", "\"1e300\"");
    assert_eq!(reject(&text).codes(), [codes::NOT_FINITE]);
}

#[test]
fn units_of_absurd_size_are_refused() {
    for unit in ["Tm^12 Tm^12", "km^12 km^12 km^12 km^12 km^12 km^12 km^12 km^12 km^12 km^12 km^12"] {
        let result = parse_unit(unit);
        assert!(result.is_err() || result.is_ok_and(|(_, factor)| factor.is_normal()), "{unit}");
    }
    let many = vec!["%"; 1000].join(" ");
    assert!(parse_unit(&many).is_err());
    let nested = format!("{}m{}", "(".repeat(100_000), ")".repeat(100_000));
    assert!(parse_unit(&nested).is_err());
    let speculative = format!("\"1 N{}\"", "/(m".repeat(30));
    assert!(!reject(&with_parameter("", &speculative)).diagnostics.is_empty());
}

#[test]
fn many_mistakes_are_all_reported() {
    let mut text = String::from(SIMULATION);
    for k in 0..2000 {
        text.push_str(&format!("wrong{k} = 1\n"));
    }
    assert_eq!(reject(&text).diagnostics.len(), 2000);
}

/// Every prefix of a good scene, and the scene with each single byte removed or doubled, is read without a
/// panic, and every diagnostic can be rendered.
#[test]
fn mutilated_scenes_never_panic() {
    let text = "title = \"é\"\n[units]\nlength = \"mm\"\n[parameters]\na.b = \"2*(1 mm + 3 µm)\"\n\
                [simulation]\nt_end = 1\noutput_times = [0.5, 1]\n[[body]]\nname = \"b\"\nmass = 1\n\
                inertia = {xx=1, yy=1, zz=1}\norientation = {axis=[0,0,1], angle=\"30 deg\"}\n\
                [[joint]]\nname = \"j\"\ntype = \"t\"\nbodies = [\"b\"]\nframes = [{position=[1,\"a.b\",0]}]\n";
    accept(text);
    let cuts: Vec<usize> = (0..=text.len()).filter(|&i| text.is_char_boundary(i)).collect();
    let mut accepted = 0;
    for pair in cuts.windows(2) {
        let (start, end) = (pair[0], pair[1]);
        let removed = format!("{}{}", &text[..start], &text[end..]);
        let doubled = format!("{}{}", &text[..end], &text[start..]);
        for mutilated in [text[..start].to_owned(), removed, doubled] {
            match parse(Source::new("m.toml", mutilated), &[Override::new("a.b=[")]) {
                Ok(_) => accepted += 1,
                Err(rejected) => assert!(!rejected.rendered().is_empty()),
            }
        }
    }
    assert_eq!(accepted, 0, "`[` is no length");
}

#[test]
fn files_that_cannot_be_read_are_named() {
    let folder = std::env::temp_dir().join(format!("odyn-scene-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder for the test");
    let missing = folder.join("missing.toml");
    let rejected = read(&missing, &[]).expect_err("there is no such file");
    assert_eq!(rejected.codes(), [codes::UNREADABLE]);
    assert!(rejected.diagnostics[0].message.contains("missing.toml"));
    let binary = folder.join("binary.toml");
    std::fs::write(&binary, b"title = 1\n\xff\xfe").expect("a file for the test");
    let rejected = read(&binary, &[]).expect_err("not UTF-8");
    assert_eq!(rejected.codes(), [codes::UNREADABLE]);
    assert!(rejected.diagnostics[0].message.contains("line 2"));
    std::fs::write(&binary, b"\xff\xfet\0").expect("a file for the test");
    assert!(read(&binary, &[]).expect_err("UTF-16").rendered().contains("iconv -f utf16"));
    assert!(read(&folder, &[]).is_err());
    let endless = folder.join("endless.toml");
    let file = std::fs::File::create(&endless).and_then(|file| file.set_len(1 << 34));
    file.expect("a file of zeros, none of which is written");
    let rejected = read(&endless, &[]).expect_err("16 GB");
    assert!(rejected.diagnostics[0].message.contains("longer than 64 MB"), "{:?}", rejected.diagnostics);
    let good = folder.join("good.toml");
    std::fs::write(&good, SIMULATION).expect("a file for the test");
    let (scene, _) = read(&good, &[]).expect("a good scene");
    assert!(scene.source.name.ends_with("good.toml"));
    std::fs::remove_dir_all(&folder).expect("the folder was made above");
}
