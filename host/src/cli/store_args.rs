//! What can be written behind `odyn plugin pack`, `add`, `remove`, `list` and `verify`; examples are in `args.rs`.

use std::path::PathBuf;

use clap::Args;

use super::args::PlacesArgs;

#[derive(Debug, Args)]
pub(super) struct ListArgs {
    #[command(flatten)]
    pub(super) places: PlacesArgs,
    /// Print lines for `[plugins]` of a scene that pin the libraries which names lead to now
    #[arg(long, conflicts_with = "json")]
    pub(super) pins: bool,
}

#[derive(Debug, Args)]
pub(super) struct PackArgs {
    /// Library of elements
    #[arg(value_name = "LIB")]
    pub(super) library: PathBuf,
    /// File to write [default: NAME-VERSION-TARGET.odynplugin]
    #[arg(short, long, value_name = "FILE")]
    pub(super) output: Option<PathBuf>,
    /// Folder with documentation, taken along with all below it
    #[arg(long, value_name = "DIR")]
    pub(super) docs: Option<PathBuf>,
    /// Text of the licence, in place of those beside the Cargo.toml of the library
    #[arg(long, alias = "license", value_name = "FILE")]
    pub(super) licence: Option<PathBuf>,
}

/// Where libraries are installed.
#[derive(Debug, Args)]
pub(super) struct StoreArgs {
    /// For the scenes in and below this folder, in its .odyn/plugins
    #[arg(long, value_name = "DIR", conflicts_with = "user")]
    pub(super) project: Option<PathBuf>,
    /// For all scenes of this user (default)
    #[arg(long)]
    pub(super) user: bool,
}

#[derive(Debug, Args)]
pub(super) struct AddArgs {
    /// File of `odyn plugin pack`
    pub(super) file: PathBuf,
    #[command(flatten)]
    pub(super) store: StoreArgs,
}

#[derive(Debug, Args)]
pub(super) struct RemoveArgs {
    /// Package, with its version where several are installed
    #[arg(value_name = "NAME[@VERSION]")]
    pub(super) name: String,
    #[command(flatten)]
    pub(super) store: StoreArgs,
}

#[derive(Debug, Args)]
pub(super) struct VerifyInstalledArgs {
    /// Package; all if left out
    pub(super) name: Option<String>,
    /// Only what is installed in .odyn/plugins of this folder
    #[arg(long, value_name = "DIR")]
    pub(super) project: Option<PathBuf>,
}
