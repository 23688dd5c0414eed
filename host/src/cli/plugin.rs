//! `odyn plugin new` and `odyn plugin check`

use odyn::catalog::SearchPath;
use odyn::workshop::{Contract, Created, NewPlugin, Template, WorkshopError, create};

use super::args::NewPluginArgs;
use super::exit;
use super::failure::Failure;
use super::terminal;

/// Makes a crate, and tells what to do next.
pub(super) fn new(args: &NewPluginArgs) -> Result<u8, Failure> {
    let contract = match &args.api {
        Some(text) => Contract::of_text(text),
        None => {
            Contract::found_from(&[std::env::current_exe(), std::env::current_dir()].map(Result::unwrap_or_default))
        }
    };
    let template = Template::of_word(&args.kind).unwrap_or(Template::Joint);
    let made = create(&NewPlugin { folder: args.name.clone(), template, contract: contract.clone() })?;
    if let (Contract::Version(version), None) = (&contract, &args.api) {
        eprintln!(
            "note: `element-api` {version} is to come from the package registry; if it is not there, name its folder with --api"
        );
    }
    for told in made.collisions(&SearchPath::standard(&[], &[]).manifests()) {
        eprintln!("note: {told}");
    }
    terminal::print(&report(&made))?;
    Ok(exit::DONE)
}

/// What was written, and the next commands.
fn report(made: &Created) -> String {
    let folder = made.folder.display();
    let mut text = format!("{folder}: a library of elements, `{}`\n", made.package);
    let width = made.files.iter().map(|(file, _)| file.as_os_str().len()).max().unwrap_or(0);
    for (file, lines) in &made.files {
        text.push_str(&format!("  {:width$}  {lines:>3} lines\n", file.display().to_string()));
    }
    text.push_str(&format!(
        "\nnext:\n  cd {folder}\n  cargo test && cargo build --release\n  odyn run scene.toml\n  odyn plugin check target/release/{}\n",
        made.library
    ));
    text
}

impl From<WorkshopError> for Failure {
    fn from(error: WorkshopError) -> Self {
        let exit = match error {
            WorkshopError::Name { .. } | WorkshopError::NoContract { .. } => exit::USAGE,
            _ => exit::FILES,
        };
        Self::new(exit, error.diagnostic())
    }
}
