//! [`Watched`]: whether the files that a run depends on have changed since it began.
//!
//! A library that was built again has another content, so the catalog loads a private copy under a new name beside the old
//! one, which stays loaded; nothing has to be done here but to notice that it is complete.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant, SystemTime};

use super::libraries::{requests, search_path};
use super::options::RunOptions;
use crate::catalog::{Request, SearchPath, read_manifest, sha256_of};
use crate::scene::read;

/// A library that stays missing or unreadable for so long is not being built any more: the run will say what is wrong.
const PATIENCE: Duration = Duration::from_secs(10);

/// The files that a run depends on, as they were when it began.
pub struct Watched {
    scene: PathBuf,
    options: RunOptions,
    /// The libraries that the scene names, as it was when it could last be read, and where they are looked for.
    libraries: Vec<Request>,
    /// Files of curves and grids.
    files: Vec<PathBuf>,
    search: SearchPath,
    /// What the last run used.
    used: Vec<Seen>,
    /// What the last look saw, and since when it has been like this.
    last: Vec<Seen>,
    since: Option<Instant>,
}

/// A file as it was seen.
#[derive(Clone, PartialEq, Eq)]
struct Seen {
    /// The file; or the name of a library that is not there.
    path: PathBuf,
    is_library: bool,
    /// Length and time of the last change; `None` where it is not there.
    stamp: Option<(u64, Option<SystemTime>)>,
    /// Of the content.
    hash: Option<String>,
}

impl Watched {
    /// What the run that begins now will use.
    #[must_use]
    pub fn new(scene: &Path, options: &RunOptions) -> Self {
        let mut watched = Self {
            scene: scene.to_path_buf(),
            options: options.clone(),
            libraries: Vec::new(),
            files: Vec::new(),
            search: SearchPath::default(),
            used: Vec::new(),
            last: Vec::new(),
            since: None,
        };
        watched.read_scene();
        watched.used = watched.see(&[]);
        watched.last = watched.used.clone();
        watched
    }

    /// One look. Gives what has changed since the last run began, once it has stayed the same between two looks and its
    /// libraries can be read; what is seen is then what the next run uses.
    pub fn look(&mut self, now: Instant) -> Option<String> {
        let mut seen = self.see(&self.last);
        let scene_changed = seen.first().map(|s| &s.hash) != self.last.first().map(|s| &s.hash);
        if scene_changed {
            self.read_scene();
            seen = self.see(&seen);
        }
        let steady = seen == self.last;
        self.last = seen;
        if content(&self.last).eq(content(&self.used)) {
            self.since = None;
            return None;
        }
        let since = *self.since.get_or_insert(now);
        let new =
            || self.last.iter().filter(|file| !content(&self.used).any(|known| known == (&file.path, &file.hash)));
        // A library may be gone for a moment while it is built; that another of its name is installed is no reason to take that.
        let is_gone = |file: &&Seen| file.is_library && file.stamp.is_some() && !file.path.is_file();
        let gone: Vec<&Seen> = self.used.iter().filter(is_gone).collect();
        let built =
            gone.is_empty() && new().filter(|file| file.is_library).all(|file| read_manifest(&file.path).is_ok());
        if !steady || (!built && now.duration_since(since) < PATIENCE) {
            return None;
        }
        let instead = |file: &Seen| {
            let same = |other: &&Seen| other.path.file_name() == file.path.file_name() && other.stamp.is_some();
            let other = new().find(same).map(|other| format!("; `{}` is used instead", other.path.display()));
            format!("`{}` (gone{})", file.path.display(), other.unwrap_or_default())
        };
        let replaced = |file: &&Seen| gone.iter().any(|gone| gone.path.file_name() == file.path.file_name());
        let rest = in_words(new().filter(|file| !replaced(file)));
        let rest = Some(rest).filter(|rest| !rest.is_empty());
        let changed: Vec<String> = gone.iter().map(|file| instead(file)).chain(rest).collect();
        let changed = if changed.is_empty() { "the list of libraries".into() } else { changed.join(", ") };
        self.used = self.last.clone();
        self.since = None;
        Some(changed)
    }

    /// What is watched, in words.
    #[must_use]
    pub fn names(&self) -> String {
        in_words(self.used.iter())
    }

    fn read_scene(&mut self) {
        // A scene that can't be read leaves the libraries as they were; the run reports what is wrong with it.
        if let Ok((scene, _)) = read(&self.scene, &self.options.overrides) {
            self.search = search_path(&scene, &self.scene, &self.options.plugins);
            self.libraries = requests(&scene);
            self.files = scene.files.iter().map(|file| scene.source.beside(file)).collect();
        }
    }

    /// The files as they are now; hashes of files that look the same as before are not computed again.
    fn see(&self, before: &[Seen]) -> Vec<Seen> {
        let named =
            |request: &Request| (self.search.find(request).unwrap_or_else(|_| request.name.clone().into()), true);
        let files = self.options.plugins.iter().filter(|path| path.is_file()).map(|path| (path.clone(), true));
        let points = self.files.iter().map(|path| (path.clone(), false));
        let all = std::iter::once((self.scene.clone(), false));
        let all = all.chain(self.libraries.iter().map(named)).chain(files).chain(points);
        let mut seen: Vec<Seen> = Vec::new();
        for (path, is_library) in all {
            if seen.iter().any(|known| known.path == path) {
                continue;
            }
            let data = std::fs::metadata(&path).ok().filter(std::fs::Metadata::is_file);
            let stamp = data.map(|data| (data.len(), data.modified().ok()));
            let known = before.iter().find(|known| known.path == path && known.stamp == stamp && stamp.is_some());
            let hash = known.map_or_else(|| sha256_of(&path), |known| known.hash.clone());
            seen.push(Seen { path, is_library, stamp, hash });
        }
        seen
    }
}

/// What counts: a file that was only touched is the same.
fn content(seen: &[Seen]) -> impl Iterator<Item = (&PathBuf, &Option<String>)> {
    seen.iter().map(|file| (&file.path, &file.hash))
}

fn in_words<'a>(files: impl Iterator<Item = &'a Seen>) -> String {
    let names = files.map(|file| match (&file.stamp, file.path.file_name()) {
        (Some(_), Some(name)) => name.to_string_lossy().into_owned(),
        _ => format!("{} (not there)", file.path.display()),
    });
    names.collect::<Vec<_>>().join(", ")
}
