//! The element of a loaded library under the test kit, through its binary interface.

use std::sync::Arc;

use element_api::descriptor::Descriptor;
use element_api::fence::fenced;
use element_api::params::{FRAME_COUNT, Table};
use element_api::set::{ElementClass, ElementSet};
use element_api::testkit::{Check, Options, examine_class};
use serde::Serialize;

use super::cost::{Cost, measure};
use super::values::{BadValues, Given, Value, complete};
use crate::catalog::ElementHandle;
use crate::diagnostics::{Diagnostic, codes, help_for};
use crate::model;

/// A check that its author says does not apply.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Exemption {
    /// The element; `None`: every one.
    element: Option<String>,
    check: Check,
}

impl Exemption {
    /// From `CHECK` or `ELEMENT.CHECK`.
    ///
    /// # Errors
    /// When there is no such element or check.
    pub fn read(text: &str, elements: &[&Descriptor]) -> Result<Self, Box<Diagnostic>> {
        let (element, name) = match text.rsplit_once('.') {
            Some((element, name)) => (Some(element), name),
            None => (None, text),
        };
        if let Some(unknown) = element.filter(|name| elements.iter().all(|known| known.name != *name)) {
            let names: Vec<&str> = elements.iter().map(|known| known.name.as_str()).collect();
            let help = help_for(unknown, &names, "elements");
            let text = format!("no element `{unknown}` is examined");
            return Err(Box::new(Diagnostic::error(codes::EXAMINED_WITH, text).help_if(help)));
        }
        let Some(check) = Check::ALL.into_iter().find(|check| check.name() == name) else {
            let names = Check::ALL.map(Check::name);
            let help = help_for(name, &names, "checks");
            return Err(Box::new(
                Diagnostic::error(codes::EXAMINED_WITH, format!("there is no check `{name}`")).help_if(help),
            ));
        };
        Ok(Self { element: element.map(str::to_string), check })
    }
}

/// What a check came to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Outcome {
    /// Nothing was found.
    Ok,
    /// Something was found.
    Failed,
    /// It does not apply: so says the library, or, of what was found, the caller.
    Exempt,
}

/// A check of one element.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct CheckVerdict {
    /// Name of the check.
    pub check: &'static str,
    /// What is to hold.
    pub meaning: &'static str,
    /// What it came to.
    pub outcome: Outcome,
    /// What was found.
    pub findings: Vec<String>,
}

/// One element under the test kit.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Verdict {
    /// Full name of the element.
    pub element: String,
    /// Its kind.
    pub kind: &'static str,
    /// Whether it is called at run time.
    pub opaque: bool,
    /// The parameters it was examined with.
    pub parameters: Vec<Value>,
    /// All checks that were made.
    pub checks: Vec<CheckVerdict>,
    /// What an evaluation costs, where it could be measured.
    pub cost: Option<Cost>,
}

impl Verdict {
    /// Whether no check failed.
    #[must_use]
    pub fn passed(&self) -> bool {
        self.checks.iter().all(|check| check.outcome != Outcome::Failed)
    }
}

/// Examines an element with the given parameters.
///
/// An element with less than two frames acts between a body and the world, so that neither action and reaction nor
/// independence of the ground frame is asked of it.
///
/// # Errors
/// When the parameters cannot be had; what the element does wrong with them is a finding.
pub fn examine(element: &ElementHandle, given: &Given, exempt: &[Exemption]) -> Result<Verdict, BadValues> {
    let descriptor = element.descriptor();
    let (full_name, kind, opaque) = (element.full_name(), descriptor.kind.word(), descriptor.opaque);
    let units = declared_units(descriptor);
    let (mut params, values) = match complete(descriptor, given) {
        Ok(found) => found,
        // Nobody gave a wrong value, so the description is wrong.
        Err(bad) if given.of(descriptor).is_empty() => {
            let check = CheckVerdict {
                check: "parameters",
                meaning: "parameters are described so that values can be found",
                outcome: Outcome::Failed,
                findings: bad.diagnostics.into_iter().map(|diagnostic| diagnostic.message).collect(),
            };
            return Ok(Verdict {
                element: full_name,
                kind,
                opaque,
                parameters: Vec::new(),
                checks: vec![units, check],
                cost: None,
            });
        }
        Err(bad) => return Err(bad),
    };
    if descriptor.more_frames.is_some() {
        // One more than the fewest, so that what is done with further frames is examined.
        params.insert(FRAME_COUNT.into(), (descriptor.frames.len() as i64 + 1).into());
    }
    // Tables of plain numbers and texts have a text.
    let text = toml::to_string(&params).unwrap_or_default();
    let between = descriptor.frame_counts().1 > 1;
    let options = Options { internal: between, invariant: between, ..Options::default() };
    let class = || Box::new(Shared(Arc::clone(&element.class)));
    let mut checks = vec![units, panic_fence(element.class.as_ref(), &params)];
    // The kit is made for the tests of an author and stops on what it does not expect.
    match fenced(|| examine_class(class(), &text, &options)) {
        Ok(report) => checks.extend(report.examined.iter().map(|check| {
            let found = report.findings.iter().filter(|finding| finding.check == *check);
            let findings: Vec<String> = found.map(|finding| advised(&finding.detail)).collect();
            let waived = exempt
                .iter()
                .any(|one| one.check == *check && one.element.as_ref().is_none_or(|name| *name == descriptor.name));
            let reason = descriptor.exempt.iter().find(|(name, _)| name == check.name()).map(|(_, reason)| reason);
            if let Some(reason) = reason {
                let findings = vec![format!("by its library: {reason}")];
                return CheckVerdict {
                    check: check.name(),
                    meaning: check.meaning(),
                    outcome: Outcome::Exempt,
                    findings,
                };
            }
            let outcome = match (findings.is_empty(), waived) {
                (true, _) => Outcome::Ok,
                (false, true) => Outcome::Exempt,
                (false, false) => Outcome::Failed,
            };
            CheckVerdict { check: check.name(), meaning: check.meaning(), outcome, findings }
        })),
        Err(message) => checks.push(CheckVerdict {
            check: "examination",
            meaning: "the test kit reaches its end",
            outcome: Outcome::Failed,
            findings: vec![message],
        }),
    }
    let cost = fenced(|| measure(element.class.as_ref(), &params)).ok().flatten();
    Ok(Verdict { element: full_name, kind, opaque, parameters: values, checks, cost })
}

/// A finding, with what to do where that is not for the element's author.
fn advised(detail: &str) -> String {
    let refused = detail.starts_with("the parameters are refused");
    if refused { format!("{detail}; give values that it takes (--params)") } else { detail.to_string() }
}

/// What an evaluation of an element costs, with the parameters of [`examine`], to compare others with; `None` when it cannot be
/// measured.
#[must_use]
pub fn cost(element: &ElementHandle) -> Option<Cost> {
    let (params, _) = complete(element.descriptor(), &Given::default()).ok()?;
    fenced(|| measure(element.class.as_ref(), &params)).ok().flatten()
}

/// What scenes refuse before they create an element.
fn declared_units(descriptor: &Descriptor) -> CheckVerdict {
    let told = |unit: model::DeclaredUnit| format!("{}; {}", unit.message, unit.remedy);
    let findings: Vec<String> = model::declared_units(descriptor).into_iter().map(told).collect();
    let outcome = if findings.is_empty() { Outcome::Ok } else { Outcome::Failed };
    let meaning = "units are declared in SI, in which numbers reach elements and come from them";
    CheckVerdict { check: "units", meaning, outcome, findings }
}

/// A call that no author provides for must come back as an error, and leave everything as it was.
fn panic_fence(class: &dyn ElementClass, params: &Table) -> CheckVerdict {
    let wrong = || {
        let mut set = class.new_set();
        // What is wrong with the parameters, or with `new`, is found by other checks.
        let added = set.add(params);
        let absent = set.record(usize::from(u16::MAX));
        if absent.is_ok() {
            return Err("an instance that does not exist has equations".to_string());
        }
        match added {
            Ok(instance) => set.save(instance).map(|_| ()).map_err(|fault| format!("`save` fails: {fault}")),
            Err(_) => Ok(()),
        }
    };
    let findings: Vec<String> = fenced(wrong).unwrap_or_else(Err).err().into_iter().collect();
    let outcome = if findings.is_empty() { Outcome::Ok } else { Outcome::Failed };
    let meaning = "a call that fails is reported as an error, and the program continues";
    CheckVerdict { check: "panic-fence", meaning, outcome, findings }
}

/// A class of a catalog, for those who want their own.
struct Shared(Arc<dyn ElementClass>);

impl ElementClass for Shared {
    fn descriptor(&self) -> &Descriptor {
        self.0.descriptor()
    }
    fn new_set(&self) -> Box<dyn ElementSet> {
        self.0.new_set()
    }
}
