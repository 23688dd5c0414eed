//! `odyn completions` and `odyn man`

use clap::CommandFactory;

use super::args::{Arguments, CompletionsArgs, ManArgs};
use super::exit;
use super::failure::{Failure, cannot_write};
use super::terminal;

/// Prints the script with which a shell completes the command line.
pub(super) fn completions(args: &CompletionsArgs) -> Result<u8, Failure> {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut Arguments::command(), "odyn", &mut script);
    terminal::print_as_it_is(&String::from_utf8_lossy(&script))?;
    Ok(exit::DONE)
}

/// Prints the manual page, or writes it and those of all commands into a folder.
pub(super) fn man(args: &ManArgs) -> Result<u8, Failure> {
    let command = Arguments::command();
    let Some(folder) = &args.output else {
        let mut page = Vec::new();
        clap_mangen::Man::new(command).render(&mut page)?;
        terminal::print_as_it_is(&String::from_utf8_lossy(&page))?;
        return Ok(exit::DONE);
    };
    let written = std::fs::create_dir_all(folder).and_then(|()| clap_mangen::generate_to(command, folder));
    written.map_err(|error| cannot_write(folder, &error))?;
    Ok(exit::DONE)
}
