//! What is exchanged: packets of numbers behind a head of 32 bytes, little-endian throughout.
//!
//! | bytes | content |
//! |---|---|
//! | 0..4 | `ODYN` |
//! | 4..6 | version of this format: 1 |
//! | 6..8 | 1: inputs, to `odyn`; 2: outputs, from it |
//! | 8..16 | number of the packet: of inputs, counted by the controller from 1; of outputs, the tick |
//! | 16..24 | time of the scene, s, as a double; of inputs not looked at |
//! | 24..28 | number of values |
//! | 28..32 | signature of names and units; 0 in inputs: not compared |
//! | 32.. | the values, doubles, in the units and the order that `odyn hil --describe` says |

use odyn::export::{Machine, Port, Twin};
use serde::Serialize;

/// Version of the format.
pub(super) const VERSION: u16 = 1;
/// Kinds of packets.
pub(super) const INPUTS: u16 = 1;
pub(super) const OUTPUTS: u16 = 2;
/// Bytes before the values.
pub(super) const HEAD: usize = 32;
const MAGIC: &[u8; 4] = b"ODYN";

/// A number in a packet.
#[derive(Debug, Serialize)]
pub(super) struct Value {
    pub(super) name: String,
    pub(super) unit: String,
    pub(super) start: f64,
    pub(super) about: String,
}

/// What packets hold.
#[derive(Debug, Serialize)]
pub(super) struct Description {
    pub(super) format: u16,
    pub(super) signature: u32,
    pub(super) period_s: f64,
    pub(super) substeps: u32,
    pub(super) inputs: Vec<Value>,
    pub(super) outputs: Vec<Value>,
    /// Which inputs of the machine those of the packets are.
    #[serde(skip)]
    pub(super) input_numbers: Vec<usize>,
}

impl Description {
    pub(super) fn of(machine: &Machine, period: f64, substeps: u32) -> Self {
        let value = |port: &Port| Value {
            name: port.name.clone(),
            unit: port.unit.clone(),
            start: port.start,
            about: port.about.clone(),
        };
        let open = machine.inputs.iter().enumerate().filter(|(_, port)| !port.is_fixed);
        let (input_numbers, inputs): (Vec<usize>, Vec<Value>) = open.map(|(k, port)| (k, value(port))).unzip();
        let mut twin = Twin::new(machine.clone());
        let starts = machine.outputs.iter().zip(twin.outputs());
        let outputs: Vec<Value> = starts.map(|(port, start)| Value { start: *start, ..value(port) }).collect();
        let lists = [("i", &inputs), ("o", &outputs)];
        let words =
            lists.iter().flat_map(|(word, list)| list.iter().map(move |v| format!("{word} {} [{}]\n", v.name, v.unit)));
        // FNV-1a, never 0.
        let signature = words
            .collect::<String>()
            .bytes()
            .fold(0x811c_9dc5_u32, |hash, byte| (hash ^ u32::from(byte)).wrapping_mul(0x0100_0193))
            .max(1);
        Self { format: VERSION, signature, period_s: period, substeps, inputs, outputs, input_numbers }
    }
}

/// Bytes of one packet, and its values.
#[derive(Debug)]
pub(super) struct Packet {
    pub(super) bytes: Vec<u8>,
    /// How many of them are used.
    pub(super) length: usize,
    values: Vec<f64>,
}

impl Packet {
    /// With room for so many values.
    pub(super) fn new(most: usize) -> Self {
        // One more, so that packets that are too long are seen.
        let bytes = vec![0; HEAD + 8 * most + 8];
        Self { bytes, length: 0, values: vec![0.0; most] }
    }

    fn part<const N: usize>(&self, at: usize) -> [u8; N] {
        let mut part = [0; N];
        part.copy_from_slice(&self.bytes[at..at + N]);
        part
    }

    /// Whether it is of this kind, has so many values and fits the signature.
    pub(super) fn is_for(&self, kind: u16, signature: u32, count: usize) -> bool {
        let whole = self.length == HEAD + 8 * count && self.bytes.starts_with(MAGIC);
        whole
            && u16::from_le_bytes(self.part(4)) == VERSION
            && u16::from_le_bytes(self.part(6)) == kind
            && u32::from_le_bytes(self.part(24)) as usize == count
            && matches!(u32::from_le_bytes(self.part(28)), own if own == signature || own == 0 && kind == INPUTS)
    }

    pub(super) fn sequence(&self) -> u64 {
        u64::from_le_bytes(self.part(8))
    }

    #[cfg(test)]
    pub(super) fn time(&self) -> f64 {
        f64::from_le_bytes(self.part(16))
    }

    /// Its first values.
    pub(super) fn values(&mut self, count: usize) -> &[f64] {
        let bytes = self.bytes[HEAD..].chunks_exact(8).take(count);
        for (value, bytes) in self.values.iter_mut().zip(bytes) {
            *value =
                f64::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3], bytes[4], bytes[5], bytes[6], bytes[7]]);
        }
        &self.values[..count]
    }

    /// Makes it one with these values.
    pub(super) fn fill(&mut self, kind: u16, signature: u32, sequence: u64, time: f64, values: &[f64]) {
        self.bytes[..4].copy_from_slice(MAGIC);
        self.bytes[4..6].copy_from_slice(&VERSION.to_le_bytes());
        self.bytes[6..8].copy_from_slice(&kind.to_le_bytes());
        self.bytes[8..16].copy_from_slice(&sequence.to_le_bytes());
        self.bytes[16..24].copy_from_slice(&time.to_le_bytes());
        self.bytes[24..28].copy_from_slice(&(values.len() as u32).to_le_bytes());
        self.bytes[28..32].copy_from_slice(&signature.to_le_bytes());
        for (bytes, value) in self.bytes[HEAD..].chunks_exact_mut(8).zip(values) {
            bytes.copy_from_slice(&value.to_le_bytes());
        }
        self.length = HEAD + 8 * values.len();
    }
}
