use std::fs;
use std::io::Read;
use std::path::{Path, PathBuf};

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use flate2::read::DeflateDecoder;
use serde_json::Value;

use crate::pack::pack;
use crate::results::ResultsError;
use crate::{Scripts, Source, report};

/// A folder that goes when it is done with.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("odyn-desk-{}-{name}", std::process::id()));
        let _ = fs::remove_dir_all(&path);
        fs::create_dir_all(&path).unwrap();
        Self(path)
    }

    fn write(&self, name: &str, content: impl AsRef<[u8]>) {
        fs::write(self.0.join(name), content).unwrap();
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

const SUMMARY: &str = r#"{"status": "suspect", "reason": "<b>energy</b>", "scene": "no/such/scene.toml", "title": "A & B",
    "time_unit": "ms", "t_end": 3.0, "t_end_reached": 3.0, "rows": 3, "steps": 7, "method": "dop853", "mobility": 1,
    "audit": {"position_violation": 1e-12, "position_violation_at": 0.002, "energy_error_relative": 0.5, "energy_error_at": 0.003},
    "audit_limits": {"constraints": 1e-8, "energy": 1e-6, "loads": 1e-6},
    "figures": [{"name": "peak", "value": 1.1, "published": 1.0, "unit": "mm"}],
    "warnings": ["ODY0309: no rigid body can have the inertia of `x`"]}"#;
const CHANNELS: &str = r#"{"columns": [{"name": "t", "unit": "ms", "quantity": "time", "si_per_unit": 0.001, "unique": true},
    {"name": "x", "unit": "mm", "quantity": "position", "si_per_unit": 0.001, "unique": true}]}"#;
const TABLE: &str = "t,x\n0,0.1\n1.5,-2.5e-300\n3,NaN\n";

fn run(name: &str) -> Folder {
    let folder = Folder::new(name);
    folder.write("summary.json", SUMMARY);
    folder.write("channels.json", CHANNELS);
    folder.write("results.csv", TABLE);
    folder
}

fn read(path: &Path) -> Source {
    Source::read(path).unwrap_or_else(|error| panic!("{error}"))
}

/// The text and the blocks of packed runs.
fn unpacked(packed: &str) -> (Value, Vec<u8>) {
    let mut bytes = Vec::new();
    DeflateDecoder::new(&STANDARD.decode(packed).unwrap()[..]).read_to_end(&mut bytes).unwrap();
    let length = u32::from_le_bytes(bytes[..4].try_into().unwrap()) as usize;
    let text = serde_json::from_slice(&bytes[4..4 + length]).unwrap();
    (text, bytes[(4 + length).next_multiple_of(8)..].to_vec())
}

fn numbers(block: &Value, blocks: &[u8]) -> Vec<u64> {
    let (at, count) = (block["at"].as_u64().unwrap() as usize, block["count"].as_u64().unwrap() as usize);
    assert!(block["type"] == "f64" && at.is_multiple_of(8));
    blocks[at..at + 8 * count].chunks(8).map(|bytes| u64::from_le_bytes(bytes.try_into().unwrap())).collect()
}

#[test]
fn the_data_are_those_of_the_table_bit_for_bit() {
    let folder = run("bits");
    let motion = b"{\"format\":\"odyn-motion/1\"}\n12345";
    folder.write("motion.bin", motion);
    let sources = [read(&folder.0)];
    let (text, blocks) = unpacked(&pack(&sources));
    let run = &text["runs"][0];
    assert_eq!(run["channels"][1]["name"], "x");
    assert_eq!(numbers(&run["time"], &blocks), [0.0, 1.5, 3.0].map(f64::to_bits));
    let column = numbers(&run["columns"][0], &blocks);
    assert_eq!(column[..2], [0.1, -2.5e-300].map(f64::to_bits));
    assert!(f64::from_bits(column[2]).is_nan());
    let at = run["motion"]["at"].as_u64().unwrap() as usize;
    assert_eq!((&blocks[at..at + motion.len()], &run["motion"]["type"]), (&motion[..], &Value::from("u8")));
}

#[test]
fn the_verdict_comes_first_and_texts_are_texts() {
    let folder = run("verdict");
    let page = report(&[read(&folder.0)], Scripts::Without);
    assert!(
        page.contains("<title>A &amp; B</title>")
            && page.contains("&lt;b&gt;energy&lt;/b&gt;")
            && !page.contains("<b>energy")
    );
    let at = |text: &str| page.find(text).unwrap_or_else(|| panic!("`{text}` is not in the page"));
    let order =
        ["Suspect:", "+10.00 %", "Energy is kept", "ODY0309", ">Motion<", ">Plots<", "How it was computed"].map(at);
    assert!(order.is_sorted(), "{order:?}");
    assert_eq!(page.matches(">violated<").count(), 1, "the energy, and not the constraints");
    assert!(page.contains(">2 ms<"), "times of the audit are in the unit of the table");
}

#[test]
fn a_scene_that_was_changed_since_its_run_is_told() {
    let folder = run("scene");
    let scene = folder.0.join("scene.toml");
    let noted = crate::results::checksum(b"mass = 1 # <i>");
    let known = format!("\"scene\": {:?}, \"scene_sha256\": \"{noted}\", \"overrides\": [\"body.a.mass=2\"]", scene);
    folder.write("summary.json", SUMMARY.replace("\"scene\": \"no/such/scene.toml\"", &known));
    for (text, changed) in [("mass = 1 # <i>", false), ("mass = 2 # <i>", true)] {
        folder.write("scene.toml", text);
        let page = report(&[read(&folder.0)], Scripts::Without);
        assert!(page.contains("# &lt;i&gt;") && page.contains("<code>body.a.mass=2</code>"));
        assert_eq!(page.contains("changed since the run"), changed);
    }
}

#[test]
fn without_scripts_plots_are_drawings() {
    let folder = run("drawings");
    let page = report(&[read(&folder.0)], Scripts::Without);
    assert!(
        page.contains("<svg") && page.contains("aria-label=\"position [mm] over time\"") && !page.contains("<script")
    );
    assert!(page.contains("wrote no motion"));
    folder.write("motion.bin", b"{\"format\":\"odyn-motion/1\"}\n");
    assert!(report(&[read(&folder.0)], Scripts::Without).contains("built without the scripts"));
}

/// Heights of the points of the curve of a page, pixels from the top.
fn heights(page: &str) -> Vec<f64> {
    let lists = page.split("<polyline").skip(1).filter_map(|rest| rest.split("points=\"").nth(1)?.split('"').next());
    // Axes are lines of two points.
    let points: Vec<&str> = lists.map(|list| list.split_whitespace().collect()).max_by_key(Vec::len).unwrap();
    points.iter().map(|point| point.split(',').nth(1).unwrap().parse().unwrap()).collect()
}

#[test]
fn drawings_of_many_samples_show_their_peaks() {
    let folder = run("peak");
    let page = |at: usize| {
        let row = |k: usize| format!("{k},{}\n", if k == at { 50.0 } else { (k % 7) as f64 * 0.1 });
        folder.write("results.csv", (0..20_000).fold(String::from("t,x\n"), |text, k| text + &row(k)));
        report(&[read(&folder.0)], Scripts::Without)
    };
    for at in [5, 6, 7, 12_345, 19_999] {
        let heights = heights(&page(at));
        assert!(heights.len() <= 1500, "{}", heights.len());
        // All else is at the foot of the peak.
        let high = heights.iter().filter(|height| **height < 300.0).count();
        assert_eq!(high, 1, "the peak at row {at} is no point of the curve");
    }
}

#[test]
fn a_level_line_has_its_own_height_at_every_scale() {
    let folder = run("level");
    for height in ["3e-9", "3", "3e9"] {
        folder.write("results.csv", format!("t,x\n0,{height}\n1,{height}\n"));
        let page = report(&[read(&folder.0)], Scripts::Without);
        let digits: String = height.parse::<f64>().map(|x| crate::results::significant(x, 6)).unwrap();
        assert!(page.contains(&format!("\n{digits}\n")), "{digits} is no tick of its axis");
    }
}

#[test]
fn with_scripts_the_page_has_its_data_and_asks_for_nothing() {
    if !Scripts::are_built_in() {
        eprintln!("this build has no scripts: not tried");
        return;
    }
    let folder = run("scripts");
    let page = report(&[read(&folder.0), read(&folder.0)], Scripts::BuiltIn);
    assert!(page.contains("id=\"odyn-data\"") && !page.contains("<svg"));
    assert_eq!(page.matches("</script>").count(), 2, "nothing in the scripts ends their elements");
    assert!(page.contains("default-src 'none'"));
    for asks in [" src=\"http", " href=\"http", "@import", "url(http"] {
        assert!(!page.contains(asks), "{asks}");
    }
}

#[test]
fn damaged_folders_are_refused_with_the_file() {
    let missing = Source::read(Path::new("no/such/folder")).err().unwrap();
    assert!(
        matches!(&missing, ResultsError::Read { path, .. } if *path == Path::new("no/such/folder/summary.json")),
        "{missing}"
    );
    for (name, content, told) in [
        ("summary.json", "{\"status\":", "summary.json"),
        ("channels.json", "[]", "channels.json"),
        ("channels.json", "{\"columns\": []}", "channels.json"),
        ("results.csv", "t,y\n0,1\n", "channels.json"),
        ("results.csv", "t,x\n0,a\n", "results.csv"),
    ] {
        let folder = run("damaged");
        folder.write(name, content);
        let error = Source::read(&folder.0).err().unwrap_or_else(|| panic!("{name}: {content}")).to_string();
        assert!(error.contains(told), "{error}");
    }
    // What is no motion is none; the rest is shown.
    let folder = run("no-motion");
    folder.write("motion.bin", [0, 159, 146, 150]);
    assert!(read(&folder.0).motion.is_none());
    for (bytes, said) in [(&b""[..], "it is empty"), (b"{\"format\":\"odyn-motion/1\"", "its first line does not end")]
    {
        folder.write("motion.bin", bytes);
        let source = read(&folder.0);
        assert!(source.motion.is_none() && source.summary["warnings"].to_string().contains(said), "{}", source.summary);
    }
}

#[test]
fn a_hundred_bodies_over_two_thousand_samples_stay_below_eight_megabytes() {
    let folder = run("large");
    let mut motion = b"{\"format\":\"odyn-motion/1\"}\n".to_vec();
    for row in 0..2000 {
        motion.extend((f64::from(row) * 1e-3).to_le_bytes());
        for body in 0..100 {
            // As smooth as motions are, with all of their digits.
            let phase = 0.003 * f64::from(row) * (1.0 + 0.01 * f64::from(body));
            let pose = [phase.cos(), phase.sin(), 0.1 * phase, (0.5 * phase).cos(), 0.0, 0.0, (0.5 * phase).sin()];
            motion.extend(pose.iter().flat_map(|x| (*x as f32).to_le_bytes()));
        }
    }
    folder.write("motion.bin", &motion);
    let page = report(&[read(&folder.0)], Scripts::BuiltIn);
    assert!(page.len() < 8_000_000, "{} bytes", page.len());
}

#[test]
fn elements_have_sections_whose_texts_only_speak() {
    let folder = run("elements");
    let elements = r#""elements": [{"element": "main <b>", "type": "bearing", "library": "strangers",
        "text": "A **bearing** <script>alert(1)</script> [by us](javascript:alert(2)) and [there](https://example.org/a:b) ![p](https://example.org/p.png)",
        "values": [{"name": "load", "unit": "N", "smallest": 1.5, "smallest_at": 0.0, "largest": null, "largest_at": 2.0}],
        "checks": [
            {"name": "static", "words": "is <i>overloaded</i>", "holds": false, "margin": -3.5, "unit": "N", "at": 2.0, "first": 1.25, "unique": true},
            {"name": "speed", "words": "is too fast", "holds": true, "margin": 7.5, "unit": "rad/s", "at": 0.5, "unique": false}]}],"#;
    folder.write("summary.json", SUMMARY.replacen('{', &format!("{{{elements}"), 1));
    let page = report(&[read(&folder.0)], Scripts::Without);
    for there in [
        "<code>main &lt;b&gt;</code>",
        "<strong>bearing</strong>",
        "&lt;script&gt;alert(1)&lt;/script&gt;",
        "<a href=\"https://example.org/a:b\">there</a>",
        "is &lt;i&gt;overloaded&lt;/i&gt;",
        ">-3.5<",
        ">1.25 ms<",
        "does not hold",
        "holds, from a reaction that is not unique",
        "&ndash;",
    ] {
        assert!(page.contains(there), "{there} is not in the page");
    }
    for missing in ["javascript:", "<script>alert", "p.png", "is too fast"] {
        assert!(!page.contains(missing), "{missing} is in the page");
    }
    // Without, there is no section.
    assert!(!report(&[read(&run("no-elements").0)], Scripts::Without).contains("smallest margin"));
}

/// An analysis has its sentence, notes and tables, texts as texts; and no plots where nothing is over time.
#[test]
fn the_folder_of_an_analysis_shows_its_answers() {
    let folder = Folder::new("analysis");
    folder.write(
        "summary.json",
        r#"{"status": "completed", "analysis": "modes", "words": "It <grows>.", "good": false, "scene": "s.toml", "title": "T",
            "time_unit": "", "rows": 2, "notes": ["a & b"],
            "tables": [{"title": "Modes", "head": ["mode", "it's"], "rows": [["1", "<i>"], ["2", "x"]]}]}"#,
    );
    folder.write(
        "channels.json",
        r#"{"columns": [{"name": "t", "unit": "", "quantity": "time", "si_per_unit": 1.0, "unique": true}]}"#,
    );
    folder.write("results.csv", "t\n0\n1\n");
    let page = report(&[read(&folder.0)], Scripts::Without);
    for part in
        ["It &lt;grows&gt;.", "verdict bad", "a &amp; b", "<h3>Modes</h3>", "it&#39;s", "&lt;i&gt;", "odyn modes"]
    {
        assert!(page.contains(part), "no `{part}` in {page}");
    }
    assert!(!page.contains("<h2>Plots</h2>") && !page.contains("<h2>Motion</h2>") && !page.contains("Completed"));
}

/// What is over an angle is not said to be over time.
#[test]
fn curves_of_an_analysis_are_over_what_it_names() {
    let folder = Folder::new("angle");
    folder.write(
        "summary.json",
        r#"{"status": "completed", "analysis": "balance", "words": "", "good": true, "scene": "s.toml", "title": "T", "over": "angle",
            "time_unit": "deg", "rows": 2, "notes": [], "tables": []}"#,
    );
    folder.write(
        "channels.json",
        r#"{"columns": [{"name": "t", "unit": "deg", "quantity": "time", "si_per_unit": 1.0, "unique": true},
            {"name": "F", "unit": "N", "quantity": "force", "si_per_unit": 1.0, "unique": true}]}"#,
    );
    folder.write("results.csv", "t,F\n0,1\n360,2\n");
    let page = report(&[read(&folder.0)], Scripts::Without);
    assert!(page.contains("aria-label=\"force [N] over angle\"") && page.contains("angle [deg]"), "{page}");
    assert!(!page.contains("over time") && !page.contains("time [deg]"));
}

const EVENTS: &str = "time,element,kind,row,rate_before,rate_after,impulse,energy_lost\n\
                      0.5,\"<floor>, left\",impact,gap,-1,0.5,3,0.375\n\
                      1.25,\"<floor>, left\",impact,gap,-0.5,0,1,0.125\n\
                      1.25,\"<floor>, left\",closes,gap,,,,\n\
                      2,brake,sticks,grip,,,,\n";

/// Whatever was written before a run was killed is shown.
#[test]
fn remedies_are_listed_under_a_head_without_marks() {
    let folder = run("remedies");
    folder
        .write("summary.json", SUMMARY.replace("\"steps\": 7", "\"steps\": 7, \"recoveries\": {\"steps_halved\": 3}"));
    let page = report(&[read(&folder.0)], Scripts::Without);
    assert!(page.contains("<th>what (odyn explain NAME says more)</th>"), "the head of the table");
    assert!(page.contains("<code>steps_halved</code>") && !page.contains("&lt;code&gt;"));
}

#[test]
fn events_of_contacts_are_counted_and_listed() {
    let folder = run("events");
    assert!(!report(&[read(&folder.0)], Scripts::Without).contains(">Events<"));
    folder.write("events.csv", format!("{EVENTS}2.5,bra"));
    let source = read(&folder.0);
    let page = report(std::slice::from_ref(&source), Scripts::Without);
    let at = page.find("&lt;floor&gt;, left").unwrap();
    let row: Vec<&str> = page[at..].split("</tr>").next().unwrap().split('>').skip(1).collect();
    let cells: Vec<&str> = row.iter().filter_map(|part| part.strip_suffix("</td")).collect();
    // Row, impacts, closes, sticks, energy lost, first and last: nothing opened or slid.
    assert_eq!(cells, ["gap", "2", "1", "", "0.5", "0.5", "1.25"]);
    let (text, _) = unpacked(&pack(&[source]));
    let events = text["runs"][0]["events"].as_array().unwrap();
    assert_eq!(events.len(), 4);
    assert_eq!(events[0], serde_json::json!([0.5, "<floor>, left", "gap", "impact", -1.0, 0.5, 3.0, 0.375]));
    assert_eq!(events[3], serde_json::json!([2.0, "brake", "grip", "sticks"]));
    folder.write("events.csv", EVENTS.replace("sticks", "melts"));
    let refused = Source::read(&folder.0).err().unwrap();
    assert!(matches!(&refused, ResultsError::NotATable { line: Some(5), .. }), "{refused}");
}
