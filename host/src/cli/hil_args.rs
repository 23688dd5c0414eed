//! What can be written on the command line behind `odyn hil`. The texts here are the program's help.

use std::path::PathBuf;

use clap::Args;

#[derive(Debug, Args)]
pub(super) struct HilArgs {
    /// Scene file
    #[arg(value_name = "SCENE")]
    pub(super) scene: PathBuf,
    /// Ticks of the clock: at each one the inputs are read, the motion is computed to the next one, and the outputs are sent; with its
    /// unit, such as "1kHz" or "500 Hz"
    #[arg(long, value_name = "FREQUENCY", default_value = "1kHz")]
    pub(super) rate: String,
    /// Take packets on this UDP port, of this machine only, or on ADDRESS:PORT; 0 takes a free port
    #[arg(long, value_name = "PORT", conflicts_with = "shm", required_unless_present_any = ["shm", "describe"])]
    pub(super) udp: Option<String>,
    /// Exchange packets through shared memory of this name
    #[arg(long, value_name = "NAME")]
    pub(super) shm: Option<String>,
    /// Method of integration; its cost per step is fixed
    #[arg(long, value_name = "NAME", default_value = "rk4", value_parser = ["rk4", "dopri5"])]
    pub(super) method: String,
    /// Steps of the method between two ticks
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    pub(super) substeps: u32,
    /// How long, such as "60 s" [default: the duration of the scene]
    #[arg(long = "for", value_name = "TIME", conflicts_with = "endless")]
    pub(super) duration: Option<String>,
    /// Until Ctrl-C
    #[arg(long)]
    pub(super) endless: bool,
    /// Start with the first packet that arrives, not at once
    #[arg(long)]
    pub(super) wait: bool,
    /// Inputs in the packets, by the names of `[[input]]`; all if left out. The others stay at their values at the start
    #[arg(long, value_name = "NAME,...", value_delimiter = ',')]
    pub(super) inputs: Option<Vec<String>>,
    /// Outputs in the packets, by the names of `[[output]]`; all if left out
    #[arg(long, value_name = "NAME,...", value_delimiter = ',')]
    pub(super) outputs: Option<Vec<String>>,
    /// Print what the packets hold, as JSON, and end
    #[arg(long)]
    pub(super) describe: bool,
    /// Priority among SCHED_FIFO, 1 to 99, where the system allows it; 0 does not ask for it
    #[arg(long, value_name = "N", default_value_t = 50, value_parser = clap::value_parser!(i32).range(0..=99))]
    pub(super) priority: i32,
    /// Change a parameter, a setting, or a key of a body or element; may be repeated
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub(super) sets: Vec<String>,
    /// Library of elements, or folder to look for libraries in; may be repeated
    #[arg(long = "plugin", value_name = "PATH")]
    pub(super) plugins: Vec<PathBuf>,
    /// Folder of the report, hil.txt and hil.json [default: results/NAME-hil]
    #[arg(short, long, value_name = "DIR")]
    pub(super) output: Option<PathBuf>,
    /// Print the report as JSON
    #[arg(long)]
    pub(super) json: bool,
}
