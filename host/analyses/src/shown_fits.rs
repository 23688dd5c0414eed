//! What `odyn report` shows of derivatives and fits.

use crate::fit::Fit;
use crate::folder::{Page, Shown};
use crate::results::significant;
use crate::sensitivity::Sensitivities;
use crate::shown::{number, words};

/// Of derivatives.
#[must_use]
pub fn sensitivity(found: &Sensitivities) -> Page {
    let figures = found.figures.iter().map(|one| {
        vec![
            one.figure.clone(),
            one.parameter.clone(),
            number(one.value),
            number(one.derivative),
            significant(one.error, 2),
            one.unit.clone(),
        ]
    });
    let mut tables = vec![Shown {
        title: "Figures".into(),
        head: words(&["figure", "number of the scene", "value", "derivative", "error", "unit"]),
        rows: figures.collect(),
    }];
    tables.retain(|table| !table.rows.is_empty());
    Page {
        analysis: "sensitivity",
        words: format!("Derivatives are {}; {}.", found.status, found.how),
        good: found.status == "certain",
        notes: found.notes.clone(),
        tables,
        ..Page::default()
    }
}

/// Of a fit: its numbers; the curves of the folder are what was measured, fitted and left.
#[must_use]
pub fn fit(found: &Fit) -> Page {
    let parameters = found.parameters.iter().map(|one| {
        let remark = match () {
            () if one.at_bound => "at its bound",
            () if one.undetermined => "not determined",
            () => "",
        };
        vec![
            one.key.clone(),
            number(one.value),
            significant(one.error, 2),
            number(one.low),
            number(one.high),
            one.unit.clone(),
            number(one.start),
            remark.into(),
        ]
    });
    let columns = found.columns.iter().map(|one| {
        vec![
            one.name.clone(),
            one.output.clone(),
            significant(one.rms, 4),
            significant(one.noise, 4),
            if one.estimated { "estimated".into() } else { "given".into() },
            one.unit.clone(),
        ]
    });
    Page {
        analysis: "fit",
        words: format!("The fit is {} after {} iterations; {}.", found.status, found.iterations, found.how),
        good: found.status == "converged",
        notes: found.notes.clone(),
        tables: vec![
            Shown {
                title: "Numbers of the scene".into(),
                head: words(&["", "value", "standard error", "95 % from", "to", "unit", "began at", ""]),
                rows: parameters.collect(),
            },
            Shown {
                title: "Measured".into(),
                head: words(&["column", "output", "left, root mean square", "noise", "", "unit"]),
                rows: columns.collect(),
            },
        ],
        kinds: found.columns.iter().flat_map(|_| ["", "", "residual"]).collect(),
        ..Page::default()
    }
}
