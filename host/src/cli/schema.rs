//! `odyn schema`

use odyn::catalog::{Catalog, SearchPath};
use odyn::diagnostics::render;
use odyn::integrate::Methods;
use odyn::session::{RunOptions, catalog_of_scene, scene_page, scene_schema};

use super::args::SchemaArgs;
use super::elements::first_of_each;
use super::exit;
use super::failure::{Failure, cannot_write};
use super::terminal::{self, Stream};

/// Writes the JSON schema of scenes, or the page of reference made of it, with the elements of a scene's libraries, or of all that can be found.
pub(super) fn schema(args: &SchemaArgs) -> Result<u8, Failure> {
    let catalog = match &args.scene {
        Some(scene) => catalog_of_scene(scene, &RunOptions { plugins: args.plugins.clone(), ..RunOptions::default() })?,
        None => everything_found(args),
    };
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

/// All libraries that can be opened; of the others it is told that they are left out.
fn everything_found(args: &SchemaArgs) -> Catalog {
    let search = SearchPath::standard(&args.plugins, &[]);
    let mut catalog = Catalog::new();
    for (path, _) in first_of_each(search.manifests()) {
        if let Err(error) = catalog.add(&path.display().to_string(), &search) {
            let help = "its elements are not in the schema";
            let diagnostic = error.diagnostic().help(help);
            let source = odyn::diagnostics::Source::new("", "");
            eprintln!("{}", render(&[diagnostic], &source, terminal::color(Stream::Error)).trim_end());
        }
    }
    catalog
}
