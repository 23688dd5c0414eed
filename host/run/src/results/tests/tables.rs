//! What is written, and that it reads back.

use super::{Scratch, channel};
use crate::diagnostics::codes;
use crate::results::{
    CHANNELS_FILE, ChannelInfo, CsvWriter, EVENTS_FILE, Event, EventKind, Events, Folder, RESULTS_FILE, ResultsError,
    SUMMARY_FILE, Status, Summary, Table,
};
use std::fs;

fn json(path: &std::path::Path) -> serde_json::Value {
    serde_json::from_str(&fs::read_to_string(path).unwrap()).unwrap()
}

#[test]
fn every_bit_pattern_reads_back() {
    let mut values = vec![
        0.0,
        -0.0,
        1.0 / 3.0,
        0.1 + 0.2,
        f64::MIN_POSITIVE,
        f64::from_bits(1),
        f64::from_bits(0x000f_ffff_ffff_ffff),
        f64::MAX,
        f64::MIN,
        f64::EPSILON,
        9007199254740993.0,
        5e-324,
        1e23,
        8.41e21,
        f64::INFINITY,
        f64::NEG_INFINITY,
    ];
    // A generator of odd patterns (Marsaglia 2003, "Xorshift RNGs").
    let mut bits = 0x9e37_79b9_7f4a_7c15_u64;
    for _ in 0..5000 {
        bits ^= bits << 13;
        bits ^= bits >> 7;
        bits ^= bits << 17;
        let value = f64::from_bits(bits);
        if !value.is_nan() {
            values.push(value);
        }
    }
    let scratch = Scratch::new("bits");
    let path = scratch.join("bits.csv");
    let mut writer = CsvWriter::create(&path, &[channel("x", "m", 1.0)]).unwrap();
    for (k, value) in values.iter().enumerate() {
        writer.row(k as f64, &[*value]).unwrap();
    }
    drop(writer);
    let text = fs::read_to_string(&path).unwrap();
    for (line, value) in text.lines().skip(1).zip(&values).filter(|(_, value)| value.abs() >= 1e16) {
        let (_, written) = line.split_once(',').unwrap();
        assert_eq!(written, if value.is_finite() { format!("{value:e}") } else { format!("{value}") });
    }
    let back = Table::read(&path).unwrap();
    let bits = |values: &[f64]| values.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
    assert_eq!(bits(back.column("x").unwrap()), bits(&values));
    assert_eq!(back.times.len(), values.len());
}

#[test]
fn a_value_that_is_not_a_number_stays_one() {
    let scratch = Scratch::new("nan");
    let path = scratch.join("nan.csv");
    CsvWriter::create(&path, &[channel("x", "m", 1.0)]).unwrap().row(0.0, &[f64::NAN]).unwrap();
    assert!(Table::read(&path).unwrap().columns[0][0].is_nan());
}

#[test]
fn values_are_divided_by_their_unit_and_times_are_not() {
    let scratch = Scratch::new("units");
    let path = scratch.join("x.csv");
    let channels = [channel("x", "mm", 1e-3), channel("n", "", 1.0)];
    let mut writer = CsvWriter::create(&path, &channels).unwrap();
    writer.row(0.5, &[0.0085, 7.0]).unwrap();
    assert_eq!(writer.rows(), 1);
    writer.flush().unwrap();
    assert_eq!(fs::read_to_string(&path).unwrap(), "t,x,n\n0.5,8.5,7.0\n");
    assert_eq!(channels[0].from_si(0.0085), 8.5);
}

#[test]
fn names_with_commas_are_quoted() {
    let scratch = Scratch::new("quotes");
    let path = scratch.join("x.csv");
    drop(CsvWriter::create(&path, &[channel("a,b", "", 1.0)]).unwrap());
    assert_eq!(fs::read_to_string(&path).unwrap(), "t,\"a,b\"\n");
    assert_eq!(Table::read(&path).unwrap().names, ["a,b"]);
}

#[test]
fn the_file_ends_with_a_whole_row_at_every_moment() {
    let scratch = Scratch::new("whole");
    let path = scratch.join("x.csv");
    let mut writer = CsvWriter::create(&path, &[channel("x", "m", 1.0)]).unwrap();
    let (mut seen, mut length) = (0, fs::metadata(&path).unwrap().len());
    for k in 0..20_000 {
        writer.row(f64::from(k), &[1.0 / 3.0]).unwrap();
        let now = fs::metadata(&path).unwrap().len();
        if now != length {
            length = now;
            seen += 1;
            let text = fs::read_to_string(&path).unwrap();
            assert!(text.ends_with("0.3333333333333333\n"), "after row {k}");
        }
    }
    assert!(seen > 2, "rows were written on the way");
    drop(writer);
    assert_eq!(Table::read(&path).unwrap().times.len(), 20_000);
}

#[test]
fn a_late_row_is_written_at_once() {
    let scratch = Scratch::new("late");
    let path = scratch.join("x.csv");
    let mut writer = CsvWriter::create(&path, &[channel("x", "m", 1.0)]).unwrap();
    std::thread::sleep(std::time::Duration::from_millis(210));
    writer.row(0.0, &[1.0]).unwrap();
    assert_eq!(fs::read_to_string(&path).unwrap(), "t,x\n0.0,1.0\n");
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_named_with_its_remedy() {
    let mut writer = match CsvWriter::create(std::path::Path::new("/dev/full"), &[channel("x", "m", 1.0)]) {
        Err(error) => return assert_full(&error),
        Ok(writer) => writer,
    };
    writer.row(0.0, &[1.0]).unwrap();
    assert_full(&writer.flush().unwrap_err());
}

#[cfg(target_os = "linux")]
fn assert_full(error: &ResultsError) {
    let diagnostic = error.diagnostic();
    assert_eq!(diagnostic.code, codes::CANNOT_WRITE);
    assert!(diagnostic.message.contains("/dev/full"), "{}", diagnostic.message);
    assert!(diagnostic.help[0].contains("make room"), "{}", diagnostic.help[0]);
}

#[test]
fn a_run_leaves_three_files_that_say_running_until_the_end() {
    let scratch = Scratch::new("folder");
    let folder = scratch.join("results").join("pendulum");
    let time = ChannelInfo::time("ms", 1e-3);
    let channels = [channel("x", "mm", 1e-3)];
    let mut run = Folder::create(&folder, &time, &channels, None, &Summary::default()).unwrap();
    run.row(0.0, &[1e-3]).unwrap();
    assert_eq!(json(&folder.join(SUMMARY_FILE))["status"], "running");
    assert_eq!(run.rows(), 1);
    let mut end = Summary { status: Status::Completed, steps: 17, rows: run.rows(), ..Summary::default() };
    run.finish(&mut end).unwrap();
    assert!(end.results_sha256.is_some_and(|sum| sum.len() == 64));
    let summary = json(&folder.join(SUMMARY_FILE));
    assert_eq!((&summary["status"], &summary["steps"]), (&"completed".into(), &17.into()));
    assert_eq!(fs::read_to_string(folder.join(RESULTS_FILE)).unwrap(), "t,x\n0.0,1.0\n");
    let columns = &json(&folder.join(CHANNELS_FILE))["columns"];
    assert_eq!((&columns[0]["name"], &columns[0]["unit"]), (&"t".into(), &"ms".into()));
    assert_eq!(columns[1]["si_per_unit"], 1e-3);
    assert_eq!(columns[1]["place"], "origin of `piston`, ground axes");
    assert_eq!(fs::read_dir(&folder).unwrap().count(), 3, "nothing else is left behind");
}

#[test]
fn a_new_run_never_stands_beside_an_old_summary() {
    let scratch = Scratch::new("again");
    let (time, channels) = (ChannelInfo::time("s", 1.0), [channel("x", "m", 1.0)]);
    let mut completed = Summary { status: Status::Completed, ..Summary::default() };
    let mut first = Folder::create(&scratch, &time, &channels, None, &Summary::default()).unwrap();
    first.row(0.0, &[1.0]).unwrap();
    first.finish(&mut completed).unwrap();
    let second = Folder::create(&scratch, &time, &channels, None, &Summary::default()).unwrap();
    assert_eq!(json(&scratch.join(SUMMARY_FILE))["status"], "running");
    assert_eq!(fs::read_to_string(scratch.join(RESULTS_FILE)).unwrap(), "t,x\n");
    drop(second);
}

/// The metadata of columns belong to the table beside them, whatever a former run left; where they are the same they stay.
#[cfg(unix)]
#[test]
fn metadata_of_columns_are_replaced_where_they_differ() {
    use std::os::unix::fs::MetadataExt;
    let scratch = Scratch::new("metadata");
    let time = ChannelInfo::time("s", 1.0);
    let begin = |channels: &[ChannelInfo]| {
        drop(Folder::create(&scratch, &time, channels, None, &Summary::default()).unwrap());
        let file = scratch.join(CHANNELS_FILE);
        (json(&file)["columns"][1]["unit"].as_str().unwrap().to_owned(), fs::metadata(file).unwrap().ino())
    };
    let (unit, first) = begin(&[channel("x", "m", 1.0)]);
    assert_eq!((unit, begin(&[channel("x", "m", 1.0)])), ("m".to_owned(), ("m".to_owned(), first)));
    let (unit, other) = begin(&[channel("x", "mm", 1e-3)]);
    assert!(unit == "mm" && other != first);
    fs::write(scratch.join(CHANNELS_FILE), "{ \"columns\"").unwrap();
    assert_eq!(begin(&[channel("x", "mm", 1e-3)]).0, "mm");
    assert_eq!(fs::read_dir(scratch.join(".")).unwrap().count(), 3, "nothing else is left behind");
}

#[test]
fn a_file_where_the_folder_should_be_is_named_with_its_remedy() {
    let scratch = Scratch::new("blocked");
    let blocked = scratch.file("results", "");
    let time = ChannelInfo::time("s", 1.0);
    let error = Folder::create(&blocked.join("run"), &time, &[], None, &Summary::default()).unwrap_err();
    let diagnostic = error.diagnostic();
    assert_eq!(diagnostic.code, codes::CANNOT_WRITE);
    assert!(diagnostic.message.contains("results"), "{}", diagnostic.message);
    assert!(diagnostic.help[0].contains("a file stands where a folder is needed"), "{}", diagnostic.help[0]);
    // As a callback's error and back.
    let carried: std::io::Error = error.into();
    assert_eq!(carried.downcast::<ResultsError>().unwrap().code(), codes::CANNOT_WRITE);
}

#[test]
fn a_summary_that_cannot_be_moved_leaves_nothing_behind() {
    let scratch = Scratch::new("moved");
    fs::create_dir_all(scratch.join(SUMMARY_FILE).join("occupied")).unwrap();
    let error = Summary::default().write(&scratch.join(SUMMARY_FILE)).unwrap_err();
    assert_eq!(error.code(), codes::CANNOT_WRITE);
    assert_eq!(fs::read_dir(&*scratch).unwrap().count(), 1);
}

#[test]
fn the_summary_has_the_promised_keys() {
    let summary: serde_json::Value = serde_json::from_str(&Summary::default().to_json()).unwrap();
    for key in [
        "status",
        "steps",
        "rejected",
        "evaluations",
        "factorisations",
        "load_time_s",
        "compile_time_s",
        "integration_time_s",
        "wall_time_s",
        "redundant_rows",
    ] {
        assert!(!summary[key].is_null(), "{key}");
    }
    for key in ["position_violation", "velocity_violation", "energy_error_relative"] {
        assert!(summary["audit"][key].is_number(), "{key}");
    }
}

#[test]
fn every_status_has_its_word_in_the_summary() {
    let statuses = [Status::Running, Status::Completed, Status::Suspect, Status::StoppedEarly, Status::Failed];
    let words = statuses.map(|status| serde_json::to_value(status).unwrap());
    assert_eq!(words, ["running", "completed", "suspect", "stopped_early", "failed"].map(serde_json::Value::from));
}

/// The real bounds are a gigabyte.
#[test]
fn tables_that_do_not_fit_into_memory_are_refused() {
    let scratch = Scratch::new("large-tables");
    let path = scratch.0.join("table.csv");
    fs::write(&path, "t,x\n0,1\n1,2\n2,3\n").unwrap();
    assert_eq!(Table::read_at_most(&path, 6, 19).unwrap().times.len(), 3);
    let message = |most, longest| Table::read_at_most(&path, most, longest).unwrap_err().to_string();
    assert!(message(5, 100).contains("more than 5e0 numbers"), "{}", message(5, 100));
    assert!(message(6, 12).contains("longer than"), "{}", message(6, 12));
}

#[test]
fn numbers_of_events_are_short_and_read_back() {
    let scratch = Scratch::new("events");
    let (least, most) = (f64::from_bits(1), f64::MAX);
    let event = |time: f64, rates: [f64; 2]| Event {
        time,
        element: "tap".into(),
        row: "gap".into(),
        kind: EventKind::Impact,
        rates,
        impulse: -0.25,
        lost: 1e-5,
    };
    let events = [event(0.0, [-2.25, 4.930380657631324e-32]), event(1e-7, [-most, -least]), event(3.0, [0.0, -0.0])];
    let mut file = Events::default();
    file.begin(&scratch, 1.0).unwrap();
    events.iter().for_each(|event| file.take(event).unwrap());
    let text = fs::read_to_string(scratch.join(EVENTS_FILE)).unwrap();
    let lines: Vec<&str> = text.lines().skip(1).collect();
    assert_eq!(lines[0], "0,tap,impact,gap,-2.25,4.930380657631324e-32,-0.25,0.00001");
    assert_eq!(lines[1], "1e-7,tap,impact,gap,-1.7976931348623157e308,-5e-324,-0.25,0.00001");
    assert_eq!(lines[2], "3,tap,impact,gap,0,-0,-0.25,0.00001");
    assert_eq!(*file.all().unwrap(), events);
}
