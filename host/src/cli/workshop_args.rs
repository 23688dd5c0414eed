//! What can be written behind `odyn plugin new` and `plugin check`; examples are in `args.rs`.

use std::path::PathBuf;

use clap::Args;

use super::scene_args::patience;

#[derive(Debug, Args)]
pub(super) struct CheckPluginArgs {
    /// File of the library, or its name where it can be found
    pub(super) library: String,
    /// Parameters, with units as in a scene: KEY=VALUE or ELEMENT.KEY=VALUE, or a file of such lines in TOML; may be repeated
    #[arg(long, value_name = "FILE|KEY=VALUE")]
    pub(super) params: Vec<String>,
    /// Examine this element only; may be repeated
    #[arg(long = "element", value_name = "NAME")]
    pub(super) elements: Vec<String>,
    /// A check that does not apply, by its name: to all elements, or to one (ELEMENT.CHECK); may be repeated
    #[arg(long = "except", value_name = "CHECK")]
    pub(super) exempt: Vec<String>,
    /// Element to compare costs with, where its library is found
    #[arg(long, value_name = "NAME", default_value = "odyn-joints/revolute")]
    pub(super) beside: String,
    /// End the program, with exit code 4, when a call into the library takes longer
    #[arg(long, value_name = "SECONDS", value_parser = patience)]
    pub(super) watchdog: Option<f64>,
    /// Print JSON
    #[arg(long)]
    pub(super) json: bool,
}

#[derive(Debug, Args)]
pub(super) struct NewPluginArgs {
    /// Folder of the crate, named as the crate; with --into the name of the element
    pub(super) name: PathBuf,
    /// What it provides: joint, force, control, library (several elements and a machine made of them), or c (a joint in C)
    #[arg(long, value_name = "KIND", default_value = "joint", value_parser = ["joint", "force", "control", "library", "c"])]
    pub(super) kind: String,
    /// Add the element (a joint, a force or a control) to the crate in this folder instead of making one
    #[arg(long, value_name = "CRATE", conflicts_with = "api")]
    pub(super) into: Option<PathBuf>,
    /// Folder or version of `element-api`, the contract of elements [default: that of the sources around this program or the
    /// working folder; without such, the version that this program was built with]
    #[arg(long, value_name = "PATH|VERSION")]
    pub(super) api: Option<String>,
}
