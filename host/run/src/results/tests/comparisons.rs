//! Tables read back, and compared.

use super::Scratch;
use crate::diagnostics::codes;
use crate::results::{CHANNELS_FILE, ChannelInfo, RESULTS_FILE, Table, compare};
use std::path::Path;

fn refused(test: &str, text: &str) -> String {
    let scratch = Scratch::new(test);
    let error = Table::read(&scratch.file("t.csv", text)).unwrap_err();
    assert_eq!(error.code(), codes::CANNOT_READ_RESULTS);
    let text = error.to_string();
    text.replace(&scratch.display().to_string(), "DIR").replace(std::path::MAIN_SEPARATOR, "/")
}

#[test]
fn comments_blanks_and_many_digits_are_read() {
    let scratch = Scratch::new("read");
    let text = "# remark, with a comma\n# another\nx, time ,y\n1,0,2\n\n1.00000000000000000e+00,5e-1,+3\n";
    let table = Table::read(&scratch.file("t.csv", text)).unwrap();
    assert_eq!(table.times, [0.0, 0.5]);
    assert_eq!(table.names, ["x", "y"]);
    assert_eq!(table.columns, [[1.0, 1.0], [2.0, 3.0]]);
    assert_eq!(table.column("y"), Some([2.0, 3.0].as_slice()));
    assert_eq!(table.column("t"), None);
}

/// Tables of other programs and of hands: their separators, and their names of times. Decimals follow a point.
#[test]
fn tables_of_other_programs_are_read() {
    let scratch = Scratch::new("others");
    let read =
        |text: &str| Table::measured(&scratch.file("t.csv", text)).unwrap_or_else(|error| panic!("{text:?}: {error}"));
    for (text, unit) in [
        ("t;x [mm]\n0;1\n0.5;2\n", None),
        ("t\tx [mm]\r\n0\t1\r\n0.5\t2\r\n", None),
        ("# remark\n\nt   x [mm]\n0   1\n 0.5 2\n", None),
        ("\u{feff}Time [s]  x [mm]\n0   1\n 0.5 2\n", Some("s")),
        ("Time,x [mm]\n0,1\n0.5,2\n", None),
        ("Time [s],\"x [mm]\"\n0,1\n0.5,2\n", Some("s")),
        ("T [ms];\"x [mm]\"\n\"0\";1\n0.5;2\n", Some("ms")),
    ] {
        let table = read(text);
        assert_eq!((table.times.as_slice(), table.time_unit.as_deref()), ([0.0, 0.5].as_slice(), unit), "{text:?}");
        assert_eq!(
            (table.names.as_slice(), table.columns.as_slice()),
            (["x [mm]".into()].as_slice(), [vec![1.0, 2.0]].as_slice())
        );
    }
    // Temperatures are no times, and are beside them.
    assert_eq!(read("T,t\n300,0\n301,1\n").times, [0.0, 1.0]);
    assert!(refused("temperature", "T [K],x\n1,2\n").ends_with("no column is called `t` or `time`"));
    let decimals =
        "`DIR/t.csv` (line 2) is not a table of results: `t` is `0,5`, not a number; decimals follow a point, `1.5`";
    assert_eq!(refused("decimals", "t;x\n0,5;1\n"), decimals);
    assert!(
        refused("short-blanks", "t x\n0 1\n1\n")
            .ends_with("(line 3) is not a table of results: 1 columns instead of 2")
    );
}

/// Plain tables are split at their commas; a quoted name makes the general reader read the same numbers.
#[test]
fn plain_tables_have_the_numbers_of_quoted_ones() {
    let scratch = Scratch::new("plain");
    let rows: String =
        (0..200).map(|k| format!("{k},{:e}, {} ,NaN\n", f64::from(k).sin() * 1e20, -0.1 * f64::from(k))).collect();
    let bits = |table: &Table| -> Vec<Vec<u64>> {
        let columns = table.columns.iter().chain([&table.times]);
        columns.map(|column| column.iter().map(|value| value.to_bits()).collect()).collect()
    };
    for rows in
        [rows.clone(), rows.replace('\n', "\r\n"), rows.replace("\n7,", "\n\n# remark, \n7,"), rows.trim_end().into()]
    {
        let plain = Table::read(&scratch.file("plain.csv", &format!("t,x, y ,z\n{rows}"))).unwrap();
        let quoted = Table::read(&scratch.file("quoted.csv", &format!("\"t\",x, y ,z\n{rows}"))).unwrap();
        assert_eq!((&plain.names, bits(&plain)), (&quoted.names, bits(&quoted)));
        assert_eq!(plain.times.len(), 200);
        let some =
            Table::read_columns(&scratch.file("some.csv", &format!("t,x, y ,z\n{rows}")), |name| name == "y").unwrap();
        assert_eq!((&some.names, some.column("y")), (&plain.names, plain.column("y")));
        assert_eq!((some.times.len(), some.column("x")), (200, Some([].as_slice())));
    }
    // Names of programs that write a mark of the order of bytes, and old ends of lines.
    for text in ["\u{feff}t,x\n0,1\n", "t,x\r0,1\r"] {
        assert_eq!(Table::read(&scratch.file("t.csv", text)).unwrap().columns, [[1.0]]);
    }
}

#[test]
fn what_is_no_table_is_refused_with_line_and_reason() {
    assert_eq!(refused("empty", ""), "`DIR/t.csv` is not a table of results: it is empty");
    assert_eq!(
        refused("no-time", "x,y\n1,2\n"),
        "`DIR/t.csv` is not a table of results: no column is called `t` or `time`"
    );
    assert_eq!(refused("twice", "t,x,x\n"), "`DIR/t.csv` is not a table of results: two columns are called `x`");
    assert_eq!(
        refused("word", "# c\nt,x\n0,1\n1,abc\n"),
        "`DIR/t.csv` (line 4) is not a table of results: `x` is `abc`, not a number"
    );
    assert_eq!(refused("hole", "t,x\n0,\n"), "`DIR/t.csv` (line 2) is not a table of results: `x` is ``, not a number");
    assert_eq!(
        refused("short", "t,x\n0,1\n1\n"),
        "`DIR/t.csv` (line 3) is not a table of results: 1 columns instead of 2"
    );
    assert_eq!(
        refused("back", "t,x\n0,1\n2,1\n1,1\n"),
        "`DIR/t.csv` (line 4) is not a table of results: the time goes back from 2 to 1"
    );
    assert_eq!(refused("nan", "t,x\nNaN,1\n"), "`DIR/t.csv` (line 2) is not a table of results: NaN is not a time");
}

#[test]
fn a_missing_file_is_named_with_its_remedy() {
    let error = Table::read(Path::new("no-such-table.csv")).unwrap_err();
    let diagnostic = error.diagnostic();
    assert!(diagnostic.message.starts_with("cannot read `no-such-table.csv`"), "{}", diagnostic.message);
    assert!(diagnostic.help[0].contains("results.csv"), "{}", diagnostic.help[0]);
}

#[test]
fn bytes_that_are_no_text_are_refused() {
    let scratch = Scratch::new("bytes");
    let path = scratch.join("t.csv");
    std::fs::write(&path, b"t,x\n0,\xff\xfe\n").unwrap();
    let text = Table::read(&path).unwrap_err().to_string();
    assert!(text.ends_with("(line 2) is not a table of results: it is not UTF-8 text"), "{text}");
}

#[test]
fn a_table_equals_itself() {
    let scratch = Scratch::new("same");
    let path = scratch.file("a.csv", "t,x,y\n0,1,inf\n1,-2,3\n");
    let same = compare(&path, &path).unwrap();
    assert_eq!((same.rows, same.rows_only_in_a, same.rows_only_in_b), (2, 0, 0));
    assert!(same.columns.iter().all(|column| column.absolute == 0.0 && column.relative == 0.0));
    assert_eq!(same.beyond(0.0).count(), 0);
}

#[test]
fn the_largest_difference_is_found_with_its_time_and_share_of_the_peak() {
    let scratch = Scratch::new("largest");
    let a = scratch.file("a.csv", "t,x,y\n0,1,0\n1,2.5,0\n2,3,1e-3\n");
    let b = scratch.file("b.csv", "time,y,x\n0,0,1\n1,0,2\n2,0,-5\n");
    let found = compare(&a, &b).unwrap();
    let [x, y] = found.columns.as_slice() else { panic!("two columns") };
    assert_eq!((x.name.as_str(), x.absolute, x.t, x.peak_b, x.relative), ("x", 8.0, 2.0, 5.0, 1.6));
    // Without a peak the difference itself is the measure.
    assert_eq!((y.name.as_str(), y.absolute, y.peak_b, y.relative), ("y", 1e-3, 0.0, 1e-3));
    assert_eq!(found.worst().name, "x");
    let beyond = |limit| found.beyond(limit).map(|column| column.name.as_str()).collect::<Vec<_>>();
    assert_eq!(beyond(1e-4), ["x", "y"]);
    assert_eq!(beyond(1.5), ["x"]);
    assert!(beyond(1.6).is_empty());
}

#[test]
fn the_peak_counts_rows_that_are_not_common() {
    let scratch = Scratch::new("peak");
    let a = scratch.file("a.csv", "t,x\n0,1.5\n");
    let b = scratch.file("b.csv", "t,x\n0,1\n9,10\n");
    let found = compare(&a, &b).unwrap();
    assert_eq!(found.columns[0].relative, 0.05);
    assert_eq!((found.rows, found.rows_only_in_b), (1, 1));
}

#[test]
fn rows_are_matched_by_time_up_to_rounding() {
    let scratch = Scratch::new("times");
    let a = scratch.file("a.csv", "t,x\n0,1\n0.30000000000000004,2\n0.45,9\n0.6,3\n1000000,4\n");
    let b = scratch.file("b.csv", "t,x\n0,1\n0.15,9\n0.3,2\n0.6000000001,9\n1000000.0000000001,4\n");
    let found = compare(&a, &b).unwrap();
    // 0.6 and 0.6000000001 lie within a billionth of the (long) mean step.
    assert_eq!((found.rows, found.rows_only_in_a, found.rows_only_in_b), (4, 1, 1));
    let fine_a = scratch.file("fine_a.csv", "t,x\n0,1\n0.1,2\n0.2,3\n");
    let fine_b = scratch.file("fine_b.csv", "t,x\n0,1\n0.1000001,2\n0.2,3\n");
    let found = compare(&fine_a, &fine_b).unwrap();
    assert_eq!((found.rows, found.rows_only_in_a, found.rows_only_in_b), (2, 1, 1));
}

#[test]
fn a_finer_table_is_compared_where_both_have_rows() {
    let scratch = Scratch::new("finer");
    let line = |k: u32, step: f64| format!("{},{}\n", step * f64::from(k), f64::from(k) * step * 2.0);
    let table = |number: u32, step: f64| (0..=number).fold(String::from("t,x\n"), |text, k| text + &line(k, step));
    let a = scratch.file("a.csv", &table(1000, 0.001));
    let b = scratch.file("b.csv", &table(10, 0.1));
    let found = compare(&a, &b).unwrap();
    assert_eq!((found.rows, found.rows_only_in_a, found.rows_only_in_b), (11, 990, 0));
    assert!(found.worst().relative < 1e-15);
    assert_eq!((found.t_first, found.t_last), (0.0, 1.0));
}

#[test]
fn a_value_that_is_not_a_number_is_beyond_every_limit() {
    let scratch = Scratch::new("not-a-number");
    let a = scratch.file("a.csv", "t,x,y\n0,NaN,inf\n");
    let b = scratch.file("b.csv", "t,x,y\n0,NaN,inf\n");
    let found = compare(&a, &b).unwrap();
    assert_eq!(found.columns[0].relative, f64::INFINITY);
    assert_eq!(found.columns[1].relative, 0.0);
    assert_eq!(found.beyond(1e300).count(), 1);
}

#[test]
fn tables_without_anything_in_common_are_refused() {
    let scratch = Scratch::new("apart");
    let a = scratch.file("a.csv", "t,x\n0,1\n");
    let b = scratch.file("b.csv", "t,x\n5,1\n");
    let c = scratch.file("c.csv", "t,y\n0,1\n");
    let empty = scratch.file("empty.csv", "t,x\n");
    for (other, reason) in
        [(&b, "no time is in both"), (&c, "no column besides the time is in both"), (&empty, "no time")]
    {
        let error = compare(&a, other).unwrap_err();
        assert_eq!(error.code(), codes::NOTHING_TO_COMPARE);
        assert!(error.to_string().contains(reason), "{error}");
    }
}

#[test]
fn the_text_is_an_aligned_table() {
    let scratch = Scratch::new("text");
    let a = scratch.file("a.csv", "t,x_p,F\n0,1,1\n1,2.5,0\n3,0,0\n");
    let b = scratch.file("b.csv", "t,x_p,G\n0,1,1\n1,2,0\n2,0,0\n4,0,0\n");
    let text = compare(&a, &b).unwrap().to_string();
    let text = text.replace(&scratch.display().to_string(), "DIR").replace(std::path::MAIN_SEPARATOR, "/");
    let expected = "\
A: DIR/a.csv
B: DIR/b.csv
  column  largest difference  at t  peak of B  relative
  x_p                    0.5     1          2      0.25
2 rows compared, t = 0 to 1; 1 row only in A; 2 rows only in B
columns only in A: F
columns only in B: G
largest relative difference: 0.25 (x_p)
";
    assert_eq!(text, expected);
}

#[test]
fn json_has_null_where_a_number_is_not_finite() {
    let scratch = Scratch::new("json");
    let a = scratch.file("a.csv", "t,x,y\n0,NaN,1\n");
    let b = scratch.file("b.csv", "t,x,y\n0,1,2\n");
    let value: serde_json::Value = serde_json::from_str(&compare(&a, &b).unwrap().to_json()).unwrap();
    assert!(value["columns"][0]["relative"].is_null());
    assert_eq!(value["columns"][1]["relative"], 0.5);
}

/// A folder with the table and the units of a run.
fn folder_of_run(scratch: &Scratch, name: &str, table: &str, units: [(&str, &str, f64); 3]) -> std::path::PathBuf {
    let folder = scratch.join(name);
    std::fs::create_dir_all(&folder).unwrap();
    let [time, columns @ ..] = units.map(|(quantity, unit, factor)| {
        let name = if quantity == "time" { "t" } else { quantity };
        let (name, unit, quantity) = (name.into(), unit.into(), quantity.into());
        ChannelInfo { name, unit, quantity, place: String::new(), factor, unique: true }
    });
    crate::results::channels::write(&folder.join(CHANNELS_FILE), &time, &columns).unwrap();
    let file = folder.join(RESULTS_FILE);
    std::fs::write(&file, table).unwrap();
    file
}

#[test]
fn runs_in_other_units_are_compared_in_those_of_the_first() {
    let scratch = Scratch::new("units");
    let si = [("time", "s", 1.0), ("position", "m", 1.0), ("force", "N", 1.0)];
    let small = [("time", "ms", 1e-3), ("position", "mm", 1e-3), ("force", "N", 1.0)];
    let a = folder_of_run(&scratch, "a", "t,position,force\n0,1,2\n1,3,4\n", si);
    let b = folder_of_run(&scratch, "b", "t,position,force\n0,1000,2\n500,2000,3\n1000,3001.5,4\n", small);
    let found = compare(&a, &b).unwrap();
    assert_eq!((found.rows, found.rows_only_in_b), (2, 1));
    assert_eq!(found.converted, ["t", "position"]);
    assert!((found.columns[0].absolute - 1.5e-3).abs() < 1e-12, "{found}");
    assert!((found.columns[0].peak_b - 3.0015).abs() < 1e-12, "{found}");
    assert_eq!(found.columns[1].absolute, 0.0);
    assert!(found.to_string().contains("in the units of A: t, position\n"), "{found}");
    let timed = scratch.file("timed.csv", "t [ms],position\n0,1\n1000,3\n");
    assert!(compare(&a, &timed).unwrap_err().to_string().contains("a unit of their own, `ms`"));
    assert_eq!(Table::measured(&timed).unwrap().time_unit.as_deref(), Some("ms"));
    // A table without units is taken as it is.
    let plain = scratch.file("plain.csv", "t,position\n0,1\n1,3\n");
    assert!(compare(&a, &plain).unwrap().converted.is_empty());
    let turned = [("time", "s", 1.0), ("position", "m", 1.0), ("torque", "N m", 1.0)];
    let c = folder_of_run(&scratch, "c", "t,position,torque\n0,1,2\n1,3,4\n", turned);
    let text = std::fs::read_to_string(c.with_file_name(CHANNELS_FILE)).unwrap();
    std::fs::write(c.with_file_name(CHANNELS_FILE), text.replace("\"name\": \"torque\"", "\"name\": \"force\""))
        .unwrap();
    std::fs::write(&c, "t,position,force\n0,1,2\n1,3,4\n").unwrap();
    let refused = compare(&a, &c).unwrap_err().to_string();
    assert!(refused.contains("`force` is a force [N] in the first and a torque [N m] in the second"), "{refused}");
}
