//! From the structs of a library to [`Descriptor`]s: every pointer is looked at before it is followed, every size has a bound.

// Following the pointers of a library can't be expressed safely. They are what `odyn_element.h` says or null; a library
// that hands over anything else runs its own code in this process anyway.
#![allow(unsafe_code)]

use std::ffi::c_char;

use element_api::descriptor::{Descriptor, Kind, Named, NamedInput};
use element_api::manifest::{C_ABI, CONVENTIONS};
use element_api::params::{ParamKind, ParamSpec};

use super::table;
use crate::declared::check_parameters;
use element_api::abi::OpenError;

/// Largest number of anything that an element declares.
const MOST: usize = 1000;
/// Longest text that is read; manual pages are the longest.
const LONGEST: usize = 1 << 18;

/// The element structs of a library's root, those of a shorter form completed with zeros.
///
/// # Safety
/// `root` is null or what an entry function of `odyn_element.h` gave.
pub unsafe fn elements(root: *const table::Plugin) -> Result<Vec<table::Element>, OpenError> {
    let wrong = |message: String| OpenError::Root(message);
    if root.is_null() {
        return Err(wrong("its entry gave a null pointer".into()));
    }
    // SAFETY: not null, so a struct that begins with its size.
    let size = unsafe { root.cast::<u32>().read() } as usize;
    if size < size_of::<table::Plugin>() {
        let whole = size_of::<table::Plugin>();
        return Err(wrong(format!("`odyn_plugin.size` is {size}, at least {whole} are needed")));
    }
    // SAFETY: it is at least as long as the host's.
    let plugin = unsafe { root.read() };
    if plugin.abi != C_ABI {
        return Err(OpenError::Version { host: format!("c{C_ABI}"), library: format!("c{}", plugin.abi) });
    }
    if plugin.conventions != CONVENTIONS {
        return Err(OpenError::Conventions(plugin.conventions));
    }
    // SAFETY: a list of the header.
    let pointers = unsafe { list(plugin.elements, plugin.element_count, "elements") }.map_err(wrong)?;
    let mut found = Vec::with_capacity(pointers.len());
    for (k, pointer) in pointers.into_iter().enumerate() {
        if pointer.is_null() {
            return Err(wrong(format!("element {k} is a null pointer")));
        }
        // SAFETY: as above.
        let size = unsafe { pointer.cast::<u32>().read() } as usize;
        if size < table::Element::SHORTEST {
            let whole = table::Element::SHORTEST;
            return Err(wrong(format!("`odyn_element.size` of element {k} is {size}, at least {whole} are needed")));
        }
        // SAFETY: null pointers, no functions, and zeros are values of all its fields.
        let mut element: table::Element = unsafe { std::mem::zeroed() };
        let known = size.min(size_of::<table::Element>());
        // SAFETY: both have so many bytes, and are of one type as far as they go.
        unsafe { std::ptr::copy_nonoverlapping(pointer.cast::<u8>(), (&raw mut element).cast(), known) };
        found.push(element);
    }
    Ok(found)
}

/// Whether elements can be called so: as [`element_api::manifest`] asks of those in Rust.
///
/// # Errors
/// In words.
pub fn check_element_name(name: &str) -> Result<(), String> {
    let good = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-';
    if name.starts_with(|c: char| c.is_ascii_lowercase()) && name.chars().all(good) {
        return Ok(());
    }
    let name = name.escape_debug();
    Err(format!("`{name}` can't be the name of an element: a-z, 0-9 and `-`, beginning with a letter"))
}

/// The descriptor of an element.
///
/// # Safety
/// The struct is one that [`elements`] gave.
pub unsafe fn describe(element: &table::Element) -> Result<Descriptor, String> {
    // SAFETY: texts and lists of the header, here and below.
    let name = unsafe { needed(element.name, "name") }?;
    let inside = |message: String| format!("`{name}`: {message}");
    check_element_name(&name)?;
    let kind = match element.kind {
        0 => Kind::Joint,
        1 => Kind::Force,
        2 => Kind::Control,
        other => return Err(inside(format!("kind {other} is unknown"))),
    };
    for (what, count) in [("angles", element.angles), ("mobility", element.mobility), ("memory", element.memory)] {
        if count as usize > MOST {
            return Err(inside(format!("`{what}` is {count}; at most {MOST}")));
        }
    }
    check_functions(element, kind).map_err(inside)?;
    let flag = |flag: u32| element.flags & flag != 0;
    let named = |from, count, what: &str| -> Result<Vec<Named>, String> {
        // SAFETY: as above.
        let list = unsafe { list::<table::Named>(from, count, what) }.map_err(inside)?;
        // SAFETY: as above.
        list.iter().map(|one| unsafe { named(one, what) }.map_err(inside)).collect()
    };
    // SAFETY: as above.
    let rows = unsafe { list(element.rows, element.row_count, "rows") }.map_err(inside)?;
    // SAFETY: as above.
    let inputs = unsafe { list(element.inputs, element.input_count, "inputs") }.map_err(inside)?;
    // SAFETY: as above.
    let params = unsafe { list(element.parameters, element.parameter_count, "parameters") }.map_err(inside)?;
    let texts = |from, count, what: &str| -> Result<Vec<(String, String)>, String> {
        // SAFETY: as above.
        let list = unsafe { list::<table::Text>(from, count, what) }.map_err(inside)?;
        // SAFETY: as above.
        list.iter()
            .map(|one| unsafe { Ok((needed(one.name, what)?, needed(one.text, what)?)) }.map_err(inside))
            .collect()
    };
    // SAFETY: as above.
    let mut params: Vec<ParamSpec> =
        params.iter().map(|one| unsafe { parameter(one) }.map_err(inside)).collect::<Result<_, _>>()?;
    for (name, text) in texts(element.examples, element.example_count, "examples")? {
        let spec = params.iter_mut().find(|spec| spec.name == name);
        let spec = spec.ok_or_else(|| inside(format!("gives an example of `{name}`, which is no parameter of it")))?;
        spec.example = Some(default(&name, &text).map_err(inside)?);
    }
    check_parameters(&params).map_err(inside)?;
    Ok(Descriptor {
        kind,
        // SAFETY: as above.
        summary: unsafe { needed(element.summary, "summary") }.map_err(inside)?,
        // SAFETY: as above.
        doc: unsafe { optional(element.doc, "doc") }.map_err(inside)?.unwrap_or_default(),
        opaque: flag(table::OPAQUE),
        angles: element.angles as usize,
        mobility: flag(table::HAS_MOBILITY).then_some(element.mobility as usize),
        turns_freely: flag(table::TURNS_FREELY),
        glyph: String::new(),
        frames: named(element.frames, element.frame_count, "frames")?,
        more_frames: named(element.more_frames, usize::from(!element.more_frames.is_null()), "further frames")?.pop(),
        most_frames: if element.more_frames.is_null() { 0 } else { element.most_frames as usize },
        // SAFETY: as above.
        rows: rows.into_iter().map(|row| unsafe { needed(row, "rows") }.map_err(inside)).collect::<Result<_, _>>()?,
        // SAFETY: as above.
        inputs: inputs.iter().map(|one| unsafe { signal(one) }.map_err(inside)).collect::<Result<_, _>>()?,
        joints: named(element.joints, element.joint_count, "joints")?,
        channels: named(element.channels, element.channel_count, "channels")?,
        states: named(element.states, element.state_count, "states")?,
        params,
        unknowns: named(element.unknowns, element.unknown_count, "unknowns")?,
        values: named(element.values, element.value_count, "values")?,
        exempt: texts(element.exempt, element.exempt_count, "exemptions")?,
        checks: named(element.checks, element.check_count, "checks")?,
        // SAFETY: as above.
        catalog: unsafe { optional(element.catalog, "catalog") }.map_err(inside)?.unwrap_or_default(),
        // SAFETY: as above.
        report: unsafe { optional(element.report, "report") }.map_err(inside)?.unwrap_or_default(),
        parallel_axes: Vec::new(),
        name: name.clone(),
    })
}

/// What an element of its kind and flags needs and must not have.
fn check_functions(element: &table::Element, kind: Kind) -> Result<(), String> {
    let flag = |flag: u32| element.flags & flag != 0;
    let joint = kind == Kind::Joint;
    let rules = [
        (element.flags & !table::FLAGS != 0, "has flags that this host does not know"),
        (joint && element.frame_count == 0 && element.more_frames.is_null(), "is a joint without frames"),
        (flag(table::OPAQUE) && element.evaluate.is_none(), "is opaque, but `evaluate` is null"),
        (!flag(table::OPAQUE) && element.record.is_none(), "`record` is null"),
        (!flag(table::OPAQUE) && element.accept.is_some(), "`accept` is for opaque elements only"),
        (element.create.is_none() && element.parameter_count > 0, "has parameters, but `create` is null"),
        (element.save.is_some() != element.load.is_some(), "has only one of `save` and `load`"),
        (!joint && element.row_count > 0, "has rows, but is no joint"),
        (element.velocity_row_count > element.row_count, "has more rows on velocities than rows"),
        (
            flag(table::OPAQUE) && element.velocity_row_count > 0,
            "is opaque; only recorded joints have rows on velocities",
        ),
        (
            joint && flag(table::OPAQUE) && (element.state_count > 0 || element.memory > 0),
            "is an opaque joint, which has no states",
        ),
        (joint && flag(table::OPAQUE) && element.input_count > 0, "is an opaque joint, which takes no signals"),
        (!joint && element.value_count > 0, "has values, but is no joint: give channels"),
        (joint && flag(table::OPAQUE) && element.value_count > 0, "is an opaque joint, which has no values"),
        (joint && element.check_count > 0, "has checks, but is a joint"),
        (flag(table::OPAQUE) && element.unknown_count > 0, "is opaque; only recorded elements have internal unknowns"),
        (element.guess.is_some() && element.unknown_count == 0, "has `guess`, but no internal unknowns"),
        (element.with_frames.is_some() && element.more_frames.is_null(), "has `with_frames`, but no `more_frames`"),
        (kind != Kind::Force && element.joint_count > 0, "takes reactions, but is no force"),
        (!joint && flag(table::HAS_MOBILITY), "has a mobility, but is no joint"),
        (flag(table::OPAQUE) && flag(table::HAS_MOBILITY), "is opaque; only recorded joints have a mobility"),
        (flag(table::TURNS_FREELY) && !flag(table::HAS_MOBILITY), "turns freely, but has no mobility"),
        (flag(table::HAS_MOBILITY) && element.frame_count != 2, "has a mobility, which needs two frames"),
    ];
    let lengths = [element.difference_length, element.difference_time];
    if lengths.iter().any(|length| !(length.is_finite() && *length >= 0.0)) {
        return Err("`difference_length` and `difference_time` must not be negative".into());
    }
    rules.into_iter().find(|(broken, _)| *broken).map_or(Ok(()), |(_, message)| Err(message.into()))
}

unsafe fn named(one: &table::Named, what: &str) -> Result<Named, String> {
    // SAFETY: texts of the header.
    unsafe {
        Ok(Named {
            name: needed(one.name, what)?,
            unit: optional(one.unit, "unit")?.unwrap_or_default(),
            doc: optional(one.doc, "doc")?.unwrap_or_default(),
        })
    }
}

unsafe fn signal(one: &table::Signal) -> Result<NamedInput, String> {
    // SAFETY: texts of the header.
    let (Named { name, unit, doc }, value) = unsafe {
        (
            named(&table::Named { name: one.name, unit: one.unit, doc: one.doc }, "inputs")?,
            optional(one.value, "value")?,
        )
    };
    let number = |text: String| {
        let number = text.trim().parse::<f64>().ok().filter(|number| number.is_finite());
        number.ok_or_else(|| format!("the default `{text}` of the signal `{name}` is no number"))
    };
    let default = value.map(number).transpose()?;
    Ok(NamedInput { name, unit, doc, default })
}

unsafe fn parameter(one: &table::Parameter) -> Result<ParamSpec, String> {
    // SAFETY: texts of the header.
    let (name, [unit, doc, value, range, choices, variable]) = unsafe {
        let fields = [one.unit, one.doc, one.value, one.range, one.choices, one.variable];
        let mut texts: [Option<String>; 6] = Default::default();
        for (text, field) in texts.iter_mut().zip(fields) {
            *text = optional(field, "a parameter")?;
        }
        (needed(one.name, "parameters")?, texts)
    };
    let kind = match one.kind {
        0 => ParamKind::Number,
        1 => ParamKind::Integer,
        2 => ParamKind::Boolean,
        3 => ParamKind::Text,
        4 => ParamKind::Vector,
        5 => ParamKind::List,
        6 => ParamKind::Curve,
        7 => ParamKind::Function,
        8 => ParamKind::Surface,
        other => return Err(format!("the parameter `{name}` has the unknown kind {other}")),
    };
    let mut spec = ParamSpec::new::<f64>(&name, &unit.unwrap_or_default(), &doc.unwrap_or_default());
    spec.kind = kind;
    spec.optional = one.optional != 0;
    spec.default = value.map(|text| default(&name, &text)).transpose()?;
    spec.choices = choices.iter().flat_map(|text| text.split('|')).map(|word| word.trim().to_string()).collect();
    spec.variable = variable.unwrap_or_default();
    if let Some(range) = range {
        read_range(&mut spec, &range).map_err(|()| {
            format!("the range `{range}` of the parameter `{name}` can't be read; write it like \"> 0 and <= 1\"")
        })?;
    }
    Ok(spec)
}

/// A default, as it is written in TOML.
fn default(name: &str, text: &str) -> Result<toml::Value, String> {
    let table = format!("x = {text}").parse::<toml::Table>();
    let value = table.ok().filter(|table| table.len() == 1).and_then(|mut table| table.remove("x"));
    value.ok_or_else(|| format!("the default `{text}` of the parameter `{name}` can't be read as TOML"))
}

/// The inverse of [`ParamSpec::range_text`].
fn read_range(spec: &mut ParamSpec, text: &str) -> Result<(), ()> {
    for part in text.split(" and ") {
        let part = part.trim();
        let slots = [(">=", &mut spec.min), ("<=", &mut spec.max), (">", &mut spec.above), ("<", &mut spec.below)];
        let (slot, number) =
            slots.into_iter().find_map(|(sign, slot)| Some((slot, part.strip_prefix(sign)?))).ok_or(())?;
        let number = number.trim().parse::<f64>().ok().filter(|number| number.is_finite()).ok_or(())?;
        if slot.replace(number).is_some() {
            return Err(());
        }
    }
    Ok(())
}

/// A list of the header.
unsafe fn list<T: Copy>(from: *const T, count: usize, what: &str) -> Result<Vec<T>, String> {
    if count > MOST {
        return Err(format!("declares {count} {what}; at most {MOST}"));
    }
    if count == 0 {
        return Ok(Vec::new());
    }
    if from.is_null() {
        return Err(format!("declares {count} {what}, but the list is a null pointer"));
    }
    // SAFETY: as many entries as the library says.
    Ok(unsafe { std::slice::from_raw_parts(from, count) }.to_vec())
}

unsafe fn needed(text: *const c_char, what: &str) -> Result<String, String> {
    // SAFETY: as the caller's.
    let text = unsafe { optional(text, what) }?;
    text.ok_or_else(|| format!("a text that must be there is a null pointer: {what}"))
}

/// A text that ends with a zero; `None` for a null pointer.
pub unsafe fn optional(text: *const c_char, what: &str) -> Result<Option<String>, String> {
    if text.is_null() {
        return Ok(None);
    }
    let mut bytes = Vec::new();
    // Not `CStr`: a text without its zero is given up somewhere.
    for k in 0..LONGEST {
        // SAFETY: all bytes before were not zero, so the text continues here.
        match unsafe { text.add(k).read() }.cast_unsigned_byte() {
            0 => return String::from_utf8(bytes).map(Some).map_err(|_| format!("a text is not UTF-8: {what}")),
            byte => bytes.push(byte),
        }
    }
    Err(format!("a text has no end within {LONGEST} bytes: {what}"))
}

/// `c_char` is signed on some processors.
trait Byte {
    fn cast_unsigned_byte(self) -> u8;
}

impl Byte for c_char {
    fn cast_unsigned_byte(self) -> u8 {
        self.to_ne_bytes()[0]
    }
}
