//! [`Common`]: what variants of one scene have in common.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use crate::catalog::{Catalog, Request, SearchPath};
use crate::program::{SharedCode, Structures};
use crate::results::{ResultsError, Table};

/// What runs share that are variants of one scene: libraries are loaded once, tables of checks read once, programs of one structure
/// compiled once, and machine code made once for them. Results do not depend on it. Copies share what they hold.
#[derive(Clone, Default)]
pub struct Common(Arc<Parts>);

#[derive(Default)]
struct Parts {
    code: SharedCode,
    structures: Structures,
    tables: Tables,
    catalogs: Mutex<Vec<(Vec<Request>, SearchPath, Catalog)>>,
}

/// A table, or why there is none.
pub(super) type ReadTable = Arc<Result<Table, ResultsError>>;

/// By file, and the columns that were asked for.
type TablesByFile = HashMap<(PathBuf, Vec<String>), ReadTable>;

/// Tables that checks compare with, each read once. Copies share what they hold.
#[derive(Clone, Default)]
pub(super) struct Tables(Arc<Mutex<TablesByFile>>);

impl Tables {
    /// Columns of the table of a file as it was when they were first asked for; others may be empty.
    pub(super) fn read(&self, path: &Path, columns: &[String]) -> ReadTable {
        let mut tables = locked(&self.0);
        let wanted = |name: &str| columns.iter().any(|column| column == name);
        let read = || Arc::new(Table::read_columns(path, wanted));
        Arc::clone(tables.entry((path.into(), columns.into())).or_insert_with(read))
    }
}

impl Common {
    pub(super) fn code(&self) -> SharedCode {
        self.0.code.clone()
    }

    /// Does what these runs do, on this thread.
    pub fn during<T>(&self, work: impl FnOnce() -> T) -> T {
        self.0.structures.during(work)
    }

    pub(super) fn tables(&self) -> Tables {
        self.0.tables.clone()
    }

    /// The libraries that are asked for, loaded by `load` where they have not been yet.
    ///
    /// # Errors
    /// That of `load`.
    pub(super) fn catalog<E>(
        &self,
        requests: Vec<Request>,
        search: SearchPath,
        load: impl FnOnce(&[Request], &SearchPath) -> Result<Catalog, E>,
    ) -> Result<Catalog, E> {
        let mut catalogs = locked(&self.0.catalogs);
        let known = catalogs.iter().find(|(asked, at, _)| *asked == requests && *at == search);
        if let Some((.., catalog)) = known {
            return Ok(catalog.clone());
        }
        let catalog = load(&requests, &search)?;
        catalogs.push((requests, search, catalog.clone()));
        Ok(catalog)
    }
}

impl std::fmt::Debug for Common {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Common").finish_non_exhaustive()
    }
}

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
