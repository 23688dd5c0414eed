//! What was measured.

use odyn::export::Machine;
use serde::Serialize;

use super::clock::Rights;
use super::packet::Description;
use super::statistics::Times;

/// See the module documentation.
#[derive(Debug, Serialize)]
pub(super) struct Report {
    scene: String,
    method: &'static str,
    /// Between ticks, s.
    period_s: f64,
    substeps: u32,
    /// Operations of a step of the method, the same in all of them.
    pub(super) operations_per_step: Option<usize>,
    link: String,
    signature: u32,
    rights: Rights,
    /// Ticks that were computed.
    pub(super) steps: u64,
    /// Steps that ended after the next tick.
    pub(super) overruns: u64,
    /// By how much at most.
    pub(super) worst_behind_us: f64,
    /// Time from a tick to when the program was awake; of ticks that were waited for.
    pub(super) late: Times,
    /// Time from then to when the outputs were sent.
    pub(super) compute: Times,
    /// Ticks without a new packet.
    pub(super) inputs_held: u64,
    pub(super) packets_received: u64,
    /// No packets of inputs for this scene.
    pub(super) packets_refused: u64,
    pub(super) packets_out_of_order: u64,
    pub(super) packets_sent: u64,
    /// Nobody was there to send them to.
    pub(super) packets_unsent: u64,
    /// Time of the scene, s.
    pub(super) reached_s: f64,
    /// Time of the clock, s.
    elapsed_s: f64,
    pub(super) interrupted: bool,
}

impl Report {
    pub(super) fn new(machine: &Machine, description: &Description, link: &str, rights: Rights) -> Self {
        Self {
            scene: machine.title.clone(),
            method: machine.method.name,
            period_s: description.period_s,
            substeps: description.substeps,
            operations_per_step: None,
            link: link.into(),
            signature: description.signature,
            rights,
            steps: 0,
            overruns: 0,
            worst_behind_us: 0.0,
            late: Times::new(),
            compute: Times::new(),
            inputs_held: 0,
            packets_received: 0,
            packets_refused: 0,
            packets_out_of_order: 0,
            packets_sent: 0,
            packets_unsent: 0,
            reached_s: machine.t_start,
            elapsed_s: 0.0,
            interrupted: false,
        }
    }

    /// Takes note of the time of the clock, s.
    pub(super) fn ended(&mut self, elapsed: f64) {
        self.elapsed_s = elapsed;
    }

    /// In words.
    pub(super) fn text(&self) -> String {
        let share = |count: u64| 100.0 * count as f64 / self.steps.max(1) as f64;
        let operations = self.operations_per_step.map_or(String::new(), |count| format!(", {count} operations each"));
        let ended = if self.interrupted { ", ended by Ctrl-C" } else { "" };
        format!(
            "{}: {} ticks of {} us, {} {} steps each{operations}; {} s of the scene in {:.3} s{ended}\n\
             link: {}\n\
             rights: {}\n\
             overruns: {} of {} steps ({:.3} %) ended after the next tick, by {:.1} us at most\n\
             late at the tick: {}\n\
             computing and sending: {}\n\
             inputs: held at {} ticks ({:.2} %) without a new packet; {} packets came, {} were none for this scene, {} out of order\n\
             outputs: {} packets sent, {} without anybody to send them to\n",
            self.scene,
            self.steps,
            self.period_s * 1e6,
            self.substeps,
            self.method,
            self.reached_s,
            self.elapsed_s,
            self.link,
            self.rights.words(),
            self.overruns,
            self.steps,
            share(self.overruns),
            self.worst_behind_us,
            self.late.words(),
            self.compute.words(),
            self.inputs_held,
            share(self.inputs_held),
            self.packets_received,
            self.packets_refused,
            self.packets_out_of_order,
            self.packets_sent,
            self.packets_unsent,
        )
    }
}
