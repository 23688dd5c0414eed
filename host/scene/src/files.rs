//! Curves and grids from files: `params.torque = { file = "motor.csv", columns = ["speed", "throttle", "torque"] }` becomes what it
//! would be with the numbers of the file written in the scene. The text of the file is added to the source, so that mistakes point
//! into it and everything that depends on the text of a scene depends on it too.
//!
//! A file is CSV: fields between commas, semicolons, tabs or blanks, lines that begin with `#` are remarks, the first other line names the
//! columns, `speed [rpm]` with the unit of plain numbers below. Two `columns` are a curve, three a grid; one, or four and more, a list of
//! their numbers, line by line. Without `columns`, the first two are a curve; a file of three and more with numbers in its first line is a
//! grid with the values of y there and those of x in its first column.

use super::columns;
use super::dimension::Dimension;
use super::quantity::Quantity;
use super::raw::{RawKind, RawTable, RawValue, Spanned};
use super::units::{name_and_unit, parse_unit};
use odyn_diagnostics::{Diagnostic, Source, codes, help_for};
use std::io::Read;
use std::ops::Range;

const KEYS: [&str; 3] = ["file", "columns", "units"];
/// Stands for a list of numbers among what a file becomes: no key of a scene.
const LIST: &str = "";
/// Longest file that is read, bytes.
const LONGEST: u64 = 16 << 20;

/// Replaces the files that parameters of elements name by what is in them.
/// Gives the names of the files.
pub(super) fn expand(root: &mut RawTable, source: &mut Source, diagnostics: &mut Vec<Diagnostic>) -> Vec<String> {
    let mut files = Vec::new();
    for kind in ["joint", "force", "control"] {
        let Some(RawKind::Array(records)) = root.get_mut(kind).map(|raw| &mut raw.kind) else { continue };
        for record in records {
            let RawKind::Table(record) = &mut record.kind else { continue };
            let Some(RawKind::Table(params)) = record.get_mut("params").map(|raw| &mut raw.kind) else { continue };
            for (_, value) in &mut params.entries {
                let RawKind::Table(table) = &mut value.kind else { continue };
                let Some(file) = table.get("file") else { continue };
                files.extend(file.as_text().map(ToOwned::to_owned));
                match entries(table, source) {
                    Ok(mut found) if found.len() == 1 && found[0].0.value == LIST => {
                        *value = found.remove(0).1;
                    }
                    Ok(found) => {
                        table.entries.retain(|(key, _)| !KEYS.contains(&key.value.as_str()));
                        table.entries.extend(found);
                    }
                    Err(diagnostic) => {
                        diagnostics.push(*diagnostic);
                        *value = RawValue { span: value.span.clone(), kind: RawKind::Number(0.0) };
                    }
                }
            }
        }
    }
    files
}

type Found<T> = Result<T, Box<Diagnostic>>;
/// Texts of a list, with their places.
type Texts = Vec<(String, Range<usize>)>;
/// Keys with their values.
type Entries = Vec<(Spanned<String>, RawValue)>;

/// A field of a file: its text without blanks and quotes, and where it stands.
#[derive(Clone)]
struct Cell {
    text: String,
    span: Range<usize>,
}

/// A column: its name, and what follows plain numbers in it.
struct Column {
    name: Cell,
    unit: String,
}

fn wrong(message: impl Into<String>, span: Range<usize>) -> Diagnostic {
    Diagnostic::error(codes::BAD_TABLE_FILE, message).at(span, "")
}

/// What stands for `file`: `points`, or `x`, `y` and `z`.
fn entries(table: &RawTable, source: &mut Source) -> Found<Entries> {
    let place = table.get("file").expect("the caller has seen it");
    for key in ["points", "x", "y", "z"] {
        if let Some((key, _)) = table.entry(key) {
            let message = format!("`file` and `{}` cannot be given together", key.value);
            return Err(Box::new(Diagnostic::error(codes::CONFLICTING_KEYS, message).at(key.span.clone(), "")));
        }
    }
    let Some(name) = place.as_text() else {
        let message = format!("`file` must be a text, found {}", place.kind.describe());
        return Err(Box::new(Diagnostic::error(codes::WRONG_TYPE, message).at(place.span.clone(), "")));
    };
    let text = read(name, source).map_err(|problem| {
        let from = if problem.contains("UTF-16") { "utf16" } else { "latin1" };
        let help = match problem.contains("UTF-8") {
            true => format!("save it as UTF-8 (`iconv -f {from} -t utf8`, or the encoding that your editor shows)"),
            false => "a path is relative to the folder of the scene".into(),
        };
        Box::new(wrong(problem, place.span.clone()).help(help))
    })?;
    let start = source.add(name, text.as_str());
    let mut lines = fields(&text, start);
    let empty = || Box::new(wrong(format!("`{name}` has no line with the names of its columns"), place.span.clone()));
    if lines.is_empty() {
        return Err(empty());
    }
    let head = lines.remove(0);
    if lines.is_empty() {
        return Err(Box::new(wrong(format!("`{name}` has no numbers"), head[0].span.clone())));
    }
    if let Some(line) = lines.iter().find(|line| line.len() != head.len()) {
        let message = format!("this line has {} fields, the first one has {}", line.len(), head.len());
        return Err(Box::new(wrong(message, line[0].span.clone())));
    }
    let units = texts(table, "units")?;
    let wanted = texts(table, "columns")?;
    // Numbers in the first line, however they are written, are no names.
    let is_number = |field: &Cell| field.text.replace(',', ".").parse::<f64>().is_ok();
    if wanted.is_none() && head.len() > 2 && head[1..].iter().any(is_number) {
        return matrix(&head, &lines, units);
    }
    check_names(&head, wanted.is_none())?;
    let mut columns: Vec<Column> = head.into_iter().map(column).collect();
    let chosen: Vec<usize> = match &wanted {
        None => (0..columns.len().min(2)).collect(),
        Some(names) => {
            let known: Vec<&str> = columns.iter().map(|column| column.name.text.as_str()).collect();
            let place = |(wanted, span): &(String, Range<usize>)| {
                known.iter().position(|name| name == wanted).ok_or_else(|| {
                    let missing = wrong(format!("`{name}` has no column `{wanted}`"), span.clone());
                    Box::new(missing.help_if(help_for(wanted, &known, "columns")))
                })
            };
            names.iter().map(place).collect::<Found<_>>()?
        }
    };
    if let Some(units) = units {
        check_count(&units, chosen.len(), place)?;
        for (column, (unit, span)) in chosen.iter().zip(units) {
            columns[*column].unit = checked_unit(unit, span)?;
        }
    }
    for column in chosen.iter().map(|k| &columns[*k]) {
        checked_unit(column.unit.clone(), column.name.span.clone())?;
    }
    let cell = |line: &Vec<Cell>, k: usize| number(&line[k], &columns[k].unit);
    match chosen[..] {
        [x, y] => {
            let pairs = lines.iter().map(|line| {
                let span = line[x].span.start..line[y].span.end.max(line[x].span.end);
                Ok(RawValue { span, kind: RawKind::Array(vec![cell(line, x)?, cell(line, y)?]) })
            });
            let pairs = pairs.collect::<Found<Vec<_>>>()?;
            Ok(vec![entry("points", pairs, place)])
        }
        [x, y, z] => {
            let cells = lines.iter().map(|line| Ok([cell(line, x)?, cell(line, y)?, cell(line, z)?]));
            grid(name, cells.collect::<Found<Vec<_>>>()?, place)
        }
        [_] | [_, _, _, _, ..] => {
            let numbers = lines.iter().flat_map(|line| chosen.iter().map(|k| cell(line, *k)));
            Ok(vec![entry(LIST, numbers.collect::<Found<Vec<_>>>()?, place)])
        }
        [] => {
            let message = "no column is named";
            let help = "name them: `columns = [\"speed\", \"torque\"]`, the arguments first";
            Err(Box::new(wrong(message, place.span.clone()).help(help)))
        }
    }
}

/// That the first line has names, not the first numbers, which would be lost; and that time is no value where no columns are
/// named.
fn check_names(head: &[Cell], as_they_stand: bool) -> Found<()> {
    if head.iter().all(|field| field.text.parse::<f64>().is_ok()) {
        let message = "the first line has numbers where the names of the columns are needed";
        let help = "put a line with names above it, such as `t [s], force [N]`";
        return Err(Box::new(wrong(message, head[0].span.clone()).help(help)));
    }
    let is_time = |field: &Cell| columns::unit_of_times(&field.text).is_some();
    if let [first, second, ..] = head
        && as_they_stand
        && is_time(second)
        && !is_time(first)
    {
        let message = format!("`{}` is the second column, which has the values of the function", second.text);
        let help = "the argument stands first; or name the columns in this order: `columns = [\"t\", \"force\"]`";
        return Err(Box::new(wrong(message, second.span.clone()).help(help)));
    }
    Ok(())
}

/// The grid of lines `x, y, z` in any order.
fn grid(name: &str, lines: Vec<[RawValue; 3]>, place: &RawValue) -> Found<Entries> {
    let plain = |raw: &RawValue| match &raw.kind {
        RawKind::Number(value) => *value,
        RawKind::Quantity(quantity) => quantity.si,
        _ => f64::NAN,
    };
    let axis = |k: usize| {
        let mut all: Vec<&RawValue> = lines.iter().map(|line| &line[k]).collect();
        all.sort_by(|a, b| plain(a).total_cmp(&plain(b)));
        all.dedup_by(|a, b| plain(a) == plain(b));
        all.into_iter().cloned().collect::<Vec<RawValue>>()
    };
    let (x, y) = (axis(0), axis(1));
    let find = |list: &[RawValue], raw: &RawValue| list.iter().position(|one| plain(one) == plain(raw));
    let mut values: Vec<Vec<Option<RawValue>>> = vec![vec![None; y.len()]; x.len()];
    for line in &lines {
        let (Some(i), Some(j)) = (find(&x, &line[0]), find(&y, &line[1])) else { continue };
        if values[i][j].replace(line[2].clone()).is_some() {
            let message = format!("the point {}, {} is there twice", plain(&line[0]), plain(&line[1]));
            return Err(Box::new(wrong(message, line[0].span.clone())));
        }
    }
    let mut rows = Vec::with_capacity(x.len());
    for (i, row) in values.into_iter().enumerate() {
        if let Some(j) = row.iter().position(Option::is_none) {
            let message =
                format!("`{name}` has no value at {}, {}: a grid needs one at all pairs", plain(&x[i]), plain(&y[j]));
            return Err(Box::new(wrong(message, place.span.clone())));
        }
        rows.push(RawValue { span: place.span.clone(), kind: RawKind::Array(row.into_iter().flatten().collect()) });
    }
    Ok(vec![entry("x", x, place), entry("y", y, place), entry("z", rows, place)])
}

/// The grid of a file that has y in its first line and x in its first column.
fn matrix(head: &[Cell], lines: &[Vec<Cell>], units: Option<Texts>) -> Found<Entries> {
    let corner = RawValue { span: head[0].span.clone(), kind: RawKind::Bool(true) };
    let units = match units {
        None => [const { String::new() }; 3],
        Some(units) => {
            check_count(&units, 3, &corner)?;
            let checked = units.into_iter().map(|(unit, span)| checked_unit(unit, span));
            let list = checked.collect::<Found<Vec<String>>>()?;
            <[String; 3]>::try_from(list).unwrap_or_default()
        }
    };
    let y = head[1..].iter().map(|field| {
        let hint = "without `columns`, the first line has the values of y and the first column those of x; \
                    otherwise name the columns, the arguments first";
        number(field, &units[1]).map_err(|diagnostic| Box::new(diagnostic.help(hint)))
    });
    let y = y.collect::<Found<Vec<_>>>()?;
    let x = lines.iter().map(|line| number(&line[0], &units[0])).collect::<Found<Vec<_>>>()?;
    let rows = lines.iter().map(|line| {
        let row = line[1..].iter().map(|field| number(field, &units[2])).collect::<Found<Vec<_>>>()?;
        Ok(RawValue { span: line[0].span.clone(), kind: RawKind::Array(row) })
    });
    let rows = rows.collect::<Found<Vec<_>>>()?;
    Ok(vec![entry("x", x, &corner), entry("y", y, &corner), entry("z", rows, &corner)])
}

fn entry(key: &str, items: Vec<RawValue>, place: &RawValue) -> (Spanned<String>, RawValue) {
    let span = place.span.clone();
    (Spanned::new(key.to_owned(), span.clone()), RawValue { span, kind: RawKind::Array(items) })
}

fn check_count(units: &[(String, Range<usize>)], wanted: usize, place: &RawValue) -> Found<()> {
    if units.len() == wanted {
        return Ok(());
    }
    let span = units.first().map_or(place.span.clone(), |(_, span)| span.clone());
    Err(Box::new(wrong(format!("`units` needs {wanted} units, found {}", units.len()), span)))
}

/// A key with a list of texts.
fn texts(table: &RawTable, key: &str) -> Found<Option<Texts>> {
    let Some(raw) = table.get(key) else { return Ok(None) };
    let items = raw.as_array().unwrap_or(std::slice::from_ref(raw));
    let text = |item: &RawValue| {
        item.as_text().map(|text| (text.to_owned(), item.span.clone())).ok_or_else(|| {
            let message = format!("`{key}` must be a list of texts, found {}", item.kind.describe());
            Box::new(Diagnostic::error(codes::WRONG_TYPE, message).at(item.span.clone(), ""))
        })
    };
    items.iter().map(text).collect::<Found<_>>().map(Some)
}

fn checked_unit(unit: String, span: Range<usize>) -> Found<String> {
    if !unit.is_empty()
        && unit != "1"
        && let Err(error) = parse_unit(&unit)
    {
        return Err(Box::new(wrong(format!("the unit `{unit}` can't be read: {}", error.message), span)));
    }
    Ok(unit)
}

/// `speed [rpm]`
fn column(field: Cell) -> Column {
    let (name, unit) = name_and_unit(&field.text);
    Column { name: Cell { text: name.to_owned(), span: field.span.clone() }, unit: unit.unwrap_or_default().to_owned() }
}

/// A number with the unit of its column, as a scene would have it.
fn number(field: &Cell, unit: &str) -> Found<RawValue> {
    let number = field.text.parse::<f64>().ok().filter(|number| number.is_finite());
    let Some(number) = number else {
        let what =
            if field.text.is_empty() { "this field is empty".into() } else { format!("`{}` is no number", field.text) };
        let comma = field.text.replace(',', ".").parse::<f64>().is_ok();
        let help = comma.then(|| "decimals follow a point: `1.5`".to_owned());
        return Err(Box::new(wrong(what, field.span.clone()).help_if(help)));
    };
    let kind = match unit {
        "" => RawKind::Number(number),
        // A quantity, so that it is refused where another dimension belongs.
        "1" => RawKind::Quantity(Quantity::derived(number, Dimension::DIMENSIONLESS)),
        unit => {
            let unreadable = |_| Box::new(wrong(format!("the unit `{unit}` can't be read"), field.span.clone()));
            let (dimension, factor) = parse_unit(unit).map_err(unreadable)?;
            let quantity = Quantity::derived(number * factor, dimension);
            RawKind::Quantity(Quantity { cycles: unit.contains("Hz"), ..quantity })
        }
    };
    Ok(RawValue { span: field.span.clone(), kind })
}

/// The fields of all lines that are not empty and no remarks.
fn fields(text: &str, start: usize) -> Vec<Vec<Cell>> {
    let separator = columns::separator(text);
    let mut at = start;
    let mut found: Vec<Vec<Cell>> = Vec::new();
    for line in text.split_inclusive('\n') {
        let from = at;
        at += line.len();
        if columns::content(line).is_none() {
            continue;
        }
        let cell = |range: Range<usize>| {
            let field = &line[range.clone()];
            let trimmed = field.trim_matches(|c: char| c.is_whitespace() || c == columns::BYTE_ORDER_MARK);
            let offset = from + range.start + (trimmed.as_ptr() as usize - field.as_ptr() as usize);
            Cell { text: trimmed.trim_matches('"').trim().to_owned(), span: offset..offset + trimmed.len() }
        };
        found.push(columns::fields(line, separator).into_iter().map(cell).collect());
    }
    found
}

fn read(name: &str, source: &Source) -> Result<String, String> {
    let path = source.beside(name);
    let shown = path.display();
    let mut bytes = Vec::new();
    let file = std::fs::File::open(&path).and_then(|file| file.take(LONGEST + 1).read_to_end(&mut bytes));
    file.map_err(|error| format!("cannot read `{shown}`: {error}"))?;
    if bytes.len() as u64 > LONGEST {
        return Err(format!("`{shown}` is longer than {} MB", LONGEST >> 20));
    }
    String::from_utf8(bytes).map_err(|error| match error.as_bytes() {
        [0xff, 0xfe, ..] | [0xfe, 0xff, ..] => format!("`{shown}` is UTF-16, not UTF-8 text"),
        _ => format!("`{shown}` is not UTF-8 text"),
    })
}
