//! What the layout check compares: as a text to commit, and as two lines for the user.

use abi_stable::StableAbi;
use abi_stable::abi_stability::abi_checking::{AbiInstability, check_layout_compatibility};
use abi_stable::type_layout::{TLData, TLField, TLFieldOrFunction, TypeLayout};

use super::v1::PluginV1_Ref;

/// The layout of everything that version 1 lets cross, as text: each type with size, alignment and fields, each method
/// with its arguments. Equal texts mean equal layouts on one kind of processor.
#[must_use]
pub fn v1_layout_text() -> String {
    layout_text(PluginV1_Ref::LAYOUT)
}

pub(super) fn layout_text(root: &'static TypeLayout) -> String {
    let mut known = vec![root];
    let mut next = 0;
    while let Some(layout) = known.get(next).copied() {
        for part in lines(layout).into_iter().flatten() {
            if let Part::Type(found) = part
                && position(&known, found).is_none()
            {
                known.push(found);
            }
        }
        next += 1;
    }
    let labels = labels(&known);
    let mut text = String::new();
    for (layout, label) in known.iter().copied().zip(&labels) {
        text += &format!(
            "{label}: size {}, alignment {}, {:?} of {}, {:?}\n",
            layout.size(),
            layout.alignment(),
            layout.data_discriminant(),
            layout.package(),
            layout.repr_attr(),
        );
        for line in lines(layout) {
            text += "    ";
            for part in line {
                match part {
                    Part::Text(words) => text += &words,
                    Part::Type(part) => text += position(&known, part).map_or("?", |k| &labels[k]),
                }
            }
            text.push('\n');
        }
    }
    text
}

/// A piece of a line of the dump.
enum Part {
    Text(String),
    Type(&'static TypeLayout),
}

fn position(known: &[&'static TypeLayout], layout: &'static TypeLayout) -> Option<usize> {
    known.iter().position(|other| other.get_utypeid() == layout.get_utypeid())
}

/// Names of types, numbered where several have the same: `abi_stable` leaves out arguments, so each `RVec` is `RVec`.
fn labels(known: &[&'static TypeLayout]) -> Vec<String> {
    let names: Vec<String> = known
        .iter()
        .map(|layout| layout.full_type().to_string().split_whitespace().collect::<Vec<_>>().join(" "))
        .collect();
    let label = |(k, name): (usize, &String)| match names[..k].iter().filter(|earlier| *earlier == name).count() {
        0 => name.clone(),
        earlier => format!("{name} #{}", earlier + 1),
    };
    names.iter().enumerate().map(label).collect()
}

/// What a type consists of.
fn lines(layout: &'static TypeLayout) -> Vec<Vec<Part>> {
    let mut lines = Vec::new();
    match layout.data() {
        TLData::Struct { fields } | TLData::Union { fields } => fields.iter().for_each(|f| put_field(&mut lines, f)),
        TLData::PrefixType(prefix) => {
            let count = prefix.first_suffix_field;
            lines.push(vec![Part::Text(format!("the first {count} of {} fields are fixed", prefix.fields.len()))]);
            prefix.fields.iter().for_each(|f| put_field(&mut lines, f));
        }
        TLData::Enum(variants) => {
            let text = format!("variants {} {:?}", variants.variant_names, variants.discriminants);
            lines.push(vec![Part::Text(text)]);
            variants.fields.iter().for_each(|f| put_field(&mut lines, f));
        }
        TLData::Primitive(_) | TLData::Opaque => {}
    }
    let mut about: Vec<_> = layout.phantom_fields().iter().map(|field| field.layout()).collect();
    for argument in layout.generics().type_params().iter().map(|get| get()) {
        if position(&about, argument).is_none() {
            about.push(argument);
        }
    }
    lines.extend(about.into_iter().map(|part| vec![Part::Text("about ".into()), Part::Type(part)]));
    lines
}

fn put_field(lines: &mut Vec<Vec<Part>>, field: TLField) {
    lines.push(vec![Part::Text(format!("{}: ", field.name())), Part::Type(field.layout())]);
    for function in field.function_range().iter() {
        let qualifier = if function.fn_qualifs.is_unsafe() { "unsafe " } else { "" };
        let mut line = vec![Part::Text(format!("    {qualifier}fn("))];
        for (k, get) in function.param_type_layouts.iter().enumerate() {
            if k > 0 {
                line.push(Part::Text(", ".into()));
            }
            line.push(Part::Type(get()));
        }
        line.push(Part::Text(") -> ".into()));
        match function.return_type_layout() {
            Some(get) => line.push(Part::Type(get())),
            None => line.push(Part::Text("nothing".into())),
        }
        lines.push(line);
    }
}

/// The first two differences between two layouts, one line each; `abi_stable` itself prints up to 1500 lines.
pub(super) fn explain_mismatch(host: &'static TypeLayout, library: &'static TypeLayout) -> String {
    let Err(found) = check_layout_compatibility(host, library) else { return String::new() };
    let mut lines: Vec<String> = Vec::new();
    for group in &found.errors {
        let place = match group.stack_trace.last().map(|pair| pair.expected) {
            None => host.full_type().to_string(),
            Some(TLFieldOrFunction::Field(field)) => field.full_type().to_string(),
            Some(TLFieldOrFunction::Function(function)) => format!("function {}", function.name),
        };
        for error in &group.errs {
            let line = format!("   in {place}: {}", difference(error));
            if !lines.contains(&line) {
                lines.push(line);
            }
        }
    }
    if lines.is_empty() {
        lines.push("   the layouts differ".into());
    }
    lines.truncate(2);
    lines.join("\n")
}

/// One difference in words.
fn difference(error: &AbiInstability) -> String {
    let differs =
        |what: &str, host: String, library: String| format!("host expects {what}{host}, library has {library}");
    match error {
        AbiInstability::Size(v) => differs("", format!("{} bytes", v.expected), v.found.to_string()),
        AbiInstability::Alignment(v) => differs("alignment ", v.expected.to_string(), v.found.to_string()),
        AbiInstability::FieldCountMismatch(v) => differs("", format!("{} fields", v.expected), v.found.to_string()),
        AbiInstability::UnexpectedField(v) => {
            let text = |field: &TLField| format!("`{}: {}`", field.name(), field.full_type());
            differs("", text(&v.expected), text(&v.found))
        }
        AbiInstability::Name(v) => differs("type ", v.expected.to_string(), v.found.to_string()),
        AbiInstability::Package(v) => differs("a type of ", v.expected.to_string(), v.found.to_string()),
        AbiInstability::PackageVersion(v) => differs("version ", v.expected.to_string(), v.found.to_string()),
        AbiInstability::MismatchedPrimitive(v) => differs("", format!("{:?}", v.expected), format!("{:?}", v.found)),
        AbiInstability::MismatchedPrefixSize(v) => differs("a prefix of ", v.expected.to_string(), v.found.to_string()),
        AbiInstability::TooManyVariants(v) => differs("", format!("{} variants", v.expected), v.found.to_string()),
        AbiInstability::UnexpectedVariant(v) => differs("variant ", v.expected.to_string(), v.found.to_string()),
        _ => "the definitions differ".into(),
    }
}
