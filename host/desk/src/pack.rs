//! The data of a report for its scripts: base64 of deflated bytes, which are
//!
//! - the length of a JSON text (u32, little endian), the text, zeros up to a multiple of 8,
//! - blocks of numbers that the text refers to as `{"at", "count", "type"}`: the byte after the zeros that they begin at, how many
//!   they are, and whether they are `f64` (little endian) or `u8`. Every block begins at a multiple of 8.

use std::io::Write;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use flate2::Compression;
use flate2::write::DeflateEncoder;
use serde_json::{Value, json};

use crate::results::{Event, EventKind};
use crate::source::Source;

/// What the text says it is.
const FORMAT: &str = "odyn-report/1";

/// The data of runs for the scripts of a page, as text.
///
/// # Panics
/// Never: memory can be written.
#[must_use]
pub fn pack(sources: &[Source]) -> String {
    let mut blocks = Vec::new();
    let runs: Vec<Value> = sources
        .iter()
        .map(|source| {
            json!({
                "name": source.name,
                "summary": source.summary,
                "channels": source.channels,
                "time": numbers(&mut blocks, &source.table.times),
                "columns": source.table.columns.iter().map(|column| numbers(&mut blocks, column)).collect::<Vec<_>>(),
                "events": source.events.iter().map(event).collect::<Vec<_>>(),
                "motion": source.motion.as_ref().map(|motion| bytes(&mut blocks, motion)),
            })
        })
        .collect();
    let text = json!({ "format": FORMAT, "runs": runs }).to_string();
    let mut whole = u32::try_from(text.len()).unwrap_or(u32::MAX).to_le_bytes().to_vec();
    whole.extend_from_slice(text.as_bytes());
    whole.resize(whole.len().next_multiple_of(8), 0);
    whole.extend(blocks);
    let mut encoder = DeflateEncoder::new(Vec::new(), Compression::default());
    let deflated = encoder.write_all(&whole).and_then(|()| encoder.finish());
    STANDARD.encode(deflated.expect("memory can be written"))
}

/// Time in the unit of the table, element, row and kind; of an impact what is known of it, in SI units.
fn event(event: &Event) -> Value {
    let Event { time, element, row, kind, rates: [before, after], impulse, lost } = event;
    match kind {
        EventKind::Impact => json!([time, element, row, kind.name(), before, after, impulse, lost]),
        _ => json!([time, element, row, kind.name()]),
    }
}

fn numbers(blocks: &mut Vec<u8>, values: &[f64]) -> Value {
    let at = blocks.len();
    blocks.extend(values.iter().flat_map(|value| value.to_le_bytes()));
    json!({ "at": at, "count": values.len(), "type": "f64" })
}

fn bytes(blocks: &mut Vec<u8>, values: &[u8]) -> Value {
    let at = blocks.len();
    blocks.extend_from_slice(values);
    blocks.resize(blocks.len().next_multiple_of(8), 0);
    json!({ "at": at, "count": values.len(), "type": "u8" })
}
