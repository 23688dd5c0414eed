//! `odyn studio`

use std::path::PathBuf;

use clap::Args;

use odyn::analyses::statics;
use odyn::session::RunOptions;
use odyn::studio::{Settings, Studio};

use super::exit;
use super::failure::{Failure, watchdog};
use super::interrupt::on_interrupt;
use super::terminal;

#[derive(Debug, Args)]
pub(super) struct StudioArgs {
    /// Scene file to edit; a new one is begun where it does not exist. Without it nothing can be saved
    pub(super) scene: Option<PathBuf>,
    /// Port to listen at; any that is free if left out
    #[arg(long, value_name = "PORT", default_value_t = 0, hide_default_value = true)]
    pub(super) port: u16,
    /// Library of elements, or folder to look for libraries in; may be repeated
    #[arg(long = "plugin", value_name = "PATH")]
    pub(super) plugins: Vec<PathBuf>,
}

/// Serves the studio until Ctrl-C.
pub(super) fn studio(args: &StudioArgs) -> Result<u8, Failure> {
    let options = RunOptions {
        plugins: args.plugins.clone(),
        watchdog: Some(watchdog(None, false)),
        equilibrium: Some(statics::start),
        ..RunOptions::default()
    };
    let settings = Settings { scene: args.scene.clone(), port: args.port, options };
    let studio = Studio::start(settings).map_err(Failure::new)?;
    let stop = on_interrupt("the studio ends");
    terminal::print(&format!("studio: {}\n", studio.address()))?;
    eprintln!("open this address in a browser on this machine; Ctrl-C ends");
    studio.serve(&stop);
    Ok(exit::DONE)
}
