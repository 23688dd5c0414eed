//! [`Head`]: what a study is; another one cannot continue it, and parts of two make no table.

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::runner::StudyOptions;
use super::series::Series;
use crate::results::checksum;

/// What this version writes. 2: points by their SHA-256; what the scene and its libraries are.
const FORMAT: u32 = 2;

/// See the module documentation.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Head {
    format: u32,
    odyn: String,
    /// SHA-256 of the scene file; empty where it cannot be read.
    scene: String,
    /// See [`crate::session::Session::fingerprint`]: that of the first run of the study; empty where it cannot be opened.
    fingerprint: String,
    keys: Vec<String>,
    /// Number of runs, all shards together.
    runs: usize,
    /// SHA-256 of the keys and values.
    points: String,
    /// Changes that all runs share.
    set: Vec<String>,
    audit_tolerance: Option<String>,
    /// Whether the runs leave results of their own.
    results: bool,
    /// Outputs that are kept over time.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    series: Option<Series>,
}

impl Head {
    /// `fingerprint` is that of the first run.
    pub(super) fn of(scene: &Path, options: &StudyOptions, fingerprint: String) -> Self {
        Self {
            format: FORMAT,
            odyn: env!("CARGO_PKG_VERSION").into(),
            scene: std::fs::read(scene).map(|bytes| checksum(&bytes)).unwrap_or_default(),
            fingerprint,
            keys: options.points.keys().to_vec(),
            runs: options.points.len(),
            points: options.points.checksum(),
            set: options.common.overrides.iter().map(|one| one.text.clone()).collect(),
            audit_tolerance: options.common.audit_tolerance.map(|tolerance| format!("{tolerance:?}")),
            results: options.folder.is_some(),
            series: options.series.clone(),
        }
    }

    /// Number of runs, all shards together.
    pub(super) fn runs(&self) -> usize {
        self.runs
    }

    /// Whether outputs are kept over time.
    pub(super) fn series(&self) -> bool {
        self.series.is_some()
    }

    /// The keys that are varied.
    pub(super) fn keys(&self) -> &[String] {
        &self.keys
    }

    /// What is not the same, in words.
    pub(super) fn difference(&self, now: &Self) -> Option<String> {
        let differs = [
            (self.format != now.format, "it was written in another format".into()),
            (self.odyn != now.odyn, format!("it is one of odyn {}, this is {}", self.odyn, now.odyn)),
            (
                (&self.keys, self.runs, &self.points) != (&now.keys, now.runs, &now.points),
                "it varies other keys or values".into(),
            ),
            (self.set != now.set, "it changes the scene otherwise (`--set`)".into()),
            (self.audit_tolerance != now.audit_tolerance, "it has another `--audit-tol`".into()),
            (self.results != now.results, "only one of the two keeps the results of its runs (`--results`)".into()),
            (self.series != now.series, "it keeps other series, or at other samples".into()),
            (self.scene != now.scene, "the scene file is not what it was".into()),
            (self.fingerprint != now.fingerprint, "a library, or a data file of the scene, is not what it was".into()),
        ];
        differs.into_iter().find_map(|(differs, words)| differs.then_some(words))
    }
}
