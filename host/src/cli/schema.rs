//! `odyn schema`

use std::path::PathBuf;

use clap::Args;

use odyn::catalog::{Catalog, SearchPath};
use odyn::diagnostics::render;
use odyn::integrate::Methods;
use odyn::session::{RunOptions, catalog_of_scene, scene_page, scene_schema};

use super::exit;
use super::failure::{Failure, cannot_write};
use super::terminal::{self, Stream};

#[derive(Debug, Args)]
pub(super) struct SchemaArgs {
    /// Scene file whose libraries are meant; all libraries that are found if left out
    pub(super) scene: Option<PathBuf>,
    /// File to write; standard output if left out
    #[arg(short, long, value_name = "FILE")]
    pub(super) output: Option<PathBuf>,
    /// The same as a page for people, in Markdown: the reference of the scene format
    #[arg(long)]
    pub(super) markdown: bool,
    /// Library of elements, or folder to look for libraries in; may be repeated
    #[arg(long = "plugin", value_name = "PATH")]
    pub(super) plugins: Vec<PathBuf>,
}

/// Writes the JSON schema of scenes, or the page of reference made of it, with the elements of a scene's libraries, or of all that can be found.
pub(super) fn schema(args: &SchemaArgs) -> Result<u8, Failure> {
    let catalog = match &args.scene {
        Some(scene) => catalog_of_scene(scene, &RunOptions { plugins: args.plugins.clone(), ..RunOptions::default() })?,
        None => everything_found(args),
    };
    let catalog = catalog.with_fmus();
    let text = match args.markdown {
        true => scene_page(&catalog, &Methods::default()),
        false => terminal::json(&scene_schema(&catalog, &Methods::default())),
    };
    match &args.output {
        Some(path) => std::fs::write(path, text).map_err(|error| cannot_write(path, &error))?,
        None => terminal::print_as_it_is(&text)?,
    }
    Ok(exit::DONE)
}

/// All libraries that can be opened; of the others it is reported that they are left out.
fn everything_found(args: &SchemaArgs) -> Catalog {
    let search = SearchPath::standard(&args.plugins, &[]);
    let (catalog, left_out) = Catalog::everything(&search);
    for error in left_out {
        let diagnostic = error.diagnostic().help("its elements are not in the schema");
        let source = odyn::diagnostics::Source::new("", "");
        eprintln!("{}", render(&[diagnostic], &source, terminal::color(Stream::Error)).trim_end());
    }
    catalog
}
