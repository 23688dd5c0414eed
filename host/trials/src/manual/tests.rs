//! Tests of the pages with cases made by hand.

use element_api::params::ParamSpec;
use element_api::{Descriptor, Kind, Named, NamedInput};

use super::{INDEX_FILE, Manual, StressPage};
use crate::page::html::{escape, markdown};
use crate::results::Work;
use crate::verification::{Balance, Case, Checked, Coverage, Element, Measured, Rung};

fn element(name: &str, kind: Kind) -> Element {
    Element {
        name: format!("odyn-example/{name}"),
        library: "odyn-example".into(),
        version: "1.2.3".into(),
        descriptor: Descriptor {
            name: name.into(),
            kind,
            summary: "Two arms & a pin <of one axis>.".into(),
            doc: "//! A pin in a hole.\n//!\n//! ## Equations\n//! Phi = a < b, *Haug* (1989)\n//!\n//! ```toml\n//! t_end = 1\n//! ```"
                .into(),
            opaque: false,
            angles: 1,
            mobility: Some(1),
            turns_freely: false,
            glyph: String::new(),
            frames: vec![Named { name: "i".into(), unit: String::new(), doc: "The hole.".into() }],
            rows: vec!["along x".into(), "along y".into()],
            inputs: vec![NamedInput { name: "measured".into(), unit: "rad/s".into(), doc: "A speed.".into(), default: Some(0.5) }],
            joints: Vec::new(),
            channels: vec![Named { name: "angle".into(), unit: "rad".into(), doc: "Turned by.".into() }],
            states: Vec::new(),
            params: vec![
                ParamSpec::new::<f64>("stiffness", "N/m", "Stiffness, `k`.").above(0.0),
                ParamSpec::new::<String>("mode", "", "Which way.").choices(&["up", "down"]).default_value("up".into()),
            ],
            exempt: Vec::new(),
            checks: Vec::new(),
            catalog: String::new(),
            report: String::new(),
            parallel_axes: Vec::new(),
            unknowns: Vec::new(),
            values: Vec::new(),
            more_frames: None,
            most_frames: 0,
        },
    }
}

fn checked(name: &str, tolerance: f64, errors: Vec<(f64, f64)>) -> Checked {
    let (at, largest) = errors.iter().copied().reduce(|a, b| if b.1 > a.1 { b } else { a }).unwrap();
    Checked {
        name: name.into(),
        kind: "position".into(),
        value: "phi".into(),
        reference: "0.5 cos(3 t) < 1".into(),
        unit: "rad".into(),
        tolerance,
        largest,
        at,
        passed: largest <= tolerance,
        problem: None,
        errors,
    }
}

/// A case with a check whose errors grow up to `worst` times its tolerance, and an exact one.
fn case(name: &str, element: &str, worst: f64) -> Case {
    let growing = (0..=1000).map(|k| (f64::from(k) * 0.002, worst * 1e-9 * f64::from(k) / 1000.0)).collect();
    let exact = (0..=1000).map(|k| (f64::from(k) * 0.002, 0.0)).collect();
    let rung = |tolerance: f64, evaluations| Rung {
        tolerance,
        largest: vec![tolerance.max(1e-11), 0.0],
        work: Work { steps: 10, rejected: 1, evaluations, factorisations: 7, ..Work::default() },
    };
    Case {
        name: name.into(),
        file: format!("{name}.toml"),
        title: format!("Case <{name}>"),
        elements: vec![format!("odyn-example/{element}")],
        analysis: None,
        text: "# Problem\nA *rod* swings; <script>alert(1)</script>.".into(),
        source: "title = \"a < b\"\n".into(),
        outcome: Ok(Measured {
            time_unit: "s".into(),
            method: "dop853".into(),
            engine: "interpreted".into(),
            tolerance: 1e-10,
            checks: vec![checked("angle & more", 1e-9, growing), checked("exact", 1e-12, exact)],
            balance: Some(Balance { share: 2.5e-16, body: "rod".into(), torque: true, at: 0.4 }),
            work: Work { steps: 123, rejected: 4, evaluations: 1567, factorisations: 1890, ..Work::default() },
            ladder: vec![rung(1e-4, 150), rung(1e-6, 300), rung(1e-8, 700), rung(1e-10, 1567), rung(1e-12, 4000)],
        }),
    }
}

struct Book {
    cases: Vec<Case>,
    elements: Vec<Element>,
    coverage: Coverage,
}

impl Book {
    fn new(cases: Vec<Case>) -> Self {
        let elements = vec![element("drum", Kind::Joint), element("pin", Kind::Joint), element("rubber", Kind::Force)];
        Self { coverage: Coverage::of(&cases, &elements), cases, elements }
    }

    fn pages(&self) -> Vec<(String, String)> {
        Manual { cases: &self.cases, elements: &self.elements, coverage: &self.coverage }.pages()
    }

    fn page(&self, name: &str) -> String {
        self.pages().into_iter().find(|(file, _)| file == name).unwrap().1
    }
}

fn book() -> Book {
    Book::new(vec![case("pin-swing", "pin", 0.25), case("rubber-pull", "rubber", 3.0)])
}

#[test]
fn the_overview_has_a_row_per_element_with_its_verdict() {
    let index = book().page(INDEX_FILE);
    let row = |element: &str| index.lines().find(|line| line.contains(&format!(">{element}</a>"))).unwrap().to_string();
    assert!(index.contains("2 of 3 elements verified by 2 scenes with 4 checks"), "{index}");
    assert!(index.contains("1 scene failed"));
    assert!(row("pin").contains(">0.25<") && row("pin").contains(">ok<") && row("pin").contains(">1567<"));
    assert!(row("pin").contains("2.5e-16"), "the balance");
    assert!(row("rubber").contains(">3<") && row("rubber").contains(">FAILED<"));
    assert!(row("drum").contains("not verified"));
}

#[test]
fn every_link_leads_to_a_page() {
    let pages = book().pages();
    let mut links = 0;
    for (_, text) in &pages {
        for part in text.split("href=\"").skip(1) {
            let target = part.split('"').next().unwrap();
            assert!(pages.iter().any(|(name, _)| name == target), "`{target}` is no page");
            links += 1;
        }
    }
    assert_eq!(links, 6, "three there, three back");
}

#[test]
fn the_page_of_an_element_has_its_manual_its_tables_and_its_cases() {
    let page = book().page("odyn-example.pin.html");
    for part in [
        "<h2>Equations</h2>",
        "Phi = a &lt; b, <em>Haug</em> (1989)",
        "<td><code>stiffness</code></td><td>number, &gt; 0</td><td>N/m</td><td>required</td><td>Stiffness, <code>k</code>.</td>",
        "<code>up</code> or <code>down</code>",
        "<td>along y</td>",
        "<td><code>angle</code></td><td>rad</td>",
        "<h3>Case &lt;pin-swing&gt;</h3>",
        "<h4>Problem</h4>",
        "0.5 cos(3 t) &lt; 1",
        "2.5e-10",
        "Newton-Euler balance",
        "123 steps, 4 rejected, 1567 evaluations, 1890 factorisations",
        "title = &quot;a &lt; b&quot;",
    ] {
        assert!(page.contains(part), "`{part}` is missing in\n{page}");
    }
    assert!(!page.contains("rubber-pull"), "the case of another element");
    assert_eq!(page.matches("<svg").count(), 2);
}

#[test]
fn html_in_texts_is_shown_not_run() {
    for (name, text) in book().pages() {
        assert!(!text.contains("<script"), "{name}");
    }
    assert_eq!(escape("<a href='x'>&\""), "&lt;a href=&#39;x&#39;&gt;&amp;&quot;");
    assert_eq!(markdown("<b>x</b>\n", 0).trim(), "<p>&lt;b&gt;x&lt;/b&gt;</p>");
}

#[test]
fn a_check_that_had_nothing_to_compare_says_why() {
    let mut missing = case("missing", "pin", 0.1);
    let Ok(measured) = &mut missing.outcome else { panic!("measured above") };
    let check = &mut measured.checks[0];
    (check.largest, check.at, check.passed) = (f64::NAN, f64::NAN, false);
    check.problem = Some("`x.csv` has no column <phi>".into());
    check.errors.clear();
    let page = Book::new(vec![missing]).page("odyn-example.pin.html");
    assert!(page.contains("angle &amp; more: `x.csv` has no column &lt;phi&gt;"), "{page}");
    assert!(page.contains(">NaN<") && page.contains(">FAILED<"));
}

#[test]
fn tolerances_at_which_a_scene_does_not_run_are_told() {
    let mut one = case("hard", "pin", 0.1);
    let Ok(measured) = &mut one.outcome else { panic!("measured above") };
    measured.ladder.pop();
    let told = "Runs at tolerance 1e-12 did not reach their end.";
    assert!(Book::new(vec![one]).page("odyn-example.pin.html").contains(told));
    assert!(!book().page("odyn-example.pin.html").contains("did not reach"));
}

#[test]
fn many_checks_share_a_curve_per_kind() {
    let mut one = case("many", "pin", 0.5);
    let Ok(measured) = &mut one.outcome else { panic!("measured above") };
    let (growing, exact) = (measured.checks[0].clone(), measured.checks[1].clone());
    measured.checks = vec![exact; 12];
    measured.checks[7] = growing;
    measured.checks[11].kind = "energy".into();
    for rung in &mut measured.ladder {
        rung.largest = vec![0.0; 12];
        rung.largest[7] = 2e-9;
    }
    let over_time = super::plot::over_time(measured);
    assert!(over_time.contains("position, largest of 11</li>") && over_time.contains("</i>energy</li>"), "{over_time}");
    let bound = *heights(&over_time, "stroke=\"currentColor\"").last().unwrap();
    let curve = heights(&over_time, "#0084D1");
    assert!(curve.len() > 300, "all samples of the growing error, {}", curve.len());
    let top = curve.into_iter().min().unwrap();
    assert!(top > bound && top < bound + 100, "half the tolerance is below the dashed line, not at the lower end");
    // In each other run the same check is at twice its tolerance.
    let over_tolerance = super::plot::over_tolerance(measured);
    let bound = *heights(&over_tolerance, "stroke-width=\"3\"").last().unwrap();
    assert!(heights(&over_tolerance, "#0084D1").into_iter().all(|height| height < bound));
}

#[test]
fn every_opened_tag_is_closed() {
    const VOID: [&str; 3] = ["meta", "!DOCTYPE", "br"];
    for (name, text) in book().pages() {
        let mut open: Vec<&str> = Vec::new();
        for part in text.split('<').skip(1) {
            let tag = part.split('>').next().unwrap();
            let word = tag.split([' ', '\n']).next().unwrap();
            if let Some(closed) = word.strip_prefix('/') {
                assert_eq!(open.pop(), Some(closed), "in {name}");
            } else if !VOID.contains(&word) && !tag.ends_with('/') {
                open.push(word);
            }
        }
        assert!(open.is_empty(), "{name}: {open:?} stay open");
    }
}

#[test]
fn pages_need_nothing_from_elsewhere_and_are_the_same_each_time() {
    let (once, again) = (book().pages(), book().pages());
    assert_eq!(once, again);
    for (name, text) in once {
        for foreign in ["http:", "https:", "src=", "url(", "@import", "#010203"] {
            assert!(!text.contains(foreign), "{name} has `{foreign}`");
        }
    }
}

#[test]
fn a_scene_that_did_not_run_is_shown_with_the_reason() {
    let mut broken = case("broken", "pin", 0.1);
    broken.outcome = Err("error: no body <rod>".into());
    let mut unread = case("unread", "pin", 0.1);
    unread.elements.clear();
    unread.outcome = Err("error: not TOML".into());
    let book = Book::new(vec![broken, unread]);
    assert!(book.page("odyn-example.pin.html").contains("error: no body &lt;rod&gt;"));
    let index = book.page(INDEX_FILE);
    assert!(index.contains("error: not TOML") && !index.contains("error: no body"), "{index}");
    assert!(index.contains("2 scenes failed"));
}

/// The height at which a drawing has the dashed line, and those of the curves of a colour.
fn heights(svg: &str, color: &str) -> Vec<i32> {
    let mut found = Vec::new();
    for line in svg.lines().filter(|line| line.starts_with("<polyline") && line.contains(color)) {
        let points = line.split("points=\"").nth(1).unwrap().split('"').next().unwrap();
        found.extend(points.split_whitespace().map(|point| point.split(',').nth(1).unwrap().parse::<i32>().unwrap()));
    }
    found
}

#[test]
fn curves_of_failed_checks_cross_the_dashed_line_and_others_stay_below() {
    for (worst, passes) in [(0.9, true), (1.2, false)] {
        let Ok(measured) = case("x", "pin", worst).outcome else { panic!("measured above") };
        let svg = super::plot::over_time(&measured);
        let bound = *heights(&svg, "stroke=\"currentColor\"").last().expect("a dashed line is made of lines");
        // Heights are counted from above.
        let highest = heights(&svg, "#0084D1").into_iter().min().unwrap();
        assert_eq!(highest >= bound, passes, "worst {worst}: {highest}, dashed line at {bound}");
    }
}

#[test]
fn the_page_of_the_stress_suite_shows_what_failed_and_why() {
    use crate::stress::{Measure, Outcome};
    let measure = |found: f64| Measure { what: "way < 1".into(), found, bound: 0.5 };
    let passed = Outcome {
        trial: "swing".into(),
        family: "drift".into(),
        formulation: "joint".into(),
        measures: vec![measure(0.25)],
        ..Outcome::default()
    };
    let failed = Outcome {
        formulation: "cartesian".into(),
        measures: vec![measure(0.75)],
        faults: vec!["stopped <early>".into()],
        seconds: 7.0,
        ..passed.clone()
    };
    let html = |outcomes: &[Outcome]| StressPage { outcomes, full: false }.html();
    let page = html(&[passed.clone(), failed.clone()]);
    for part in [
        "2 runs in the short form",
        "1 failed",
        "way &lt; 1",
        "stopped &lt;early&gt;",
        "<span class=\"bad\">0.75</span>",
    ] {
        assert!(page.contains(part), "{part} is missing:\n{page}");
    }
    assert_eq!(page.matches("<h2>drift</h2>").count(), 1);
    assert_eq!(page.matches("<h3>swing</h3>").count(), 1, "both runs of a trial are shown together");
    assert!(!html(std::slice::from_ref(&passed)).contains("class=\"bad\""));
    assert_eq!(html(std::slice::from_ref(&failed)), html(&[Outcome { seconds: 0.1, ..failed }]));
}
