//! The checks as assertions: they panic with the whole report.

use crate::adapt;
use crate::element::{Constraint, Control, Force};
use crate::testkit::examine::{Examination, examine_control, examine_force_with, examine_joint};
use crate::testkit::report::{Options, Report};
use crate::testkit::{Random, Setting, acting};

/// [`examine_joint`]; nothing may be found.
///
/// # Panics
/// With the report, when something is found.
pub fn check_joint<T: Constraint>(params: &str) {
    examine_joint::<T>(params).assert_sound();
}

/// [`examine_force_with`] for any force element: action and reaction, and the power, are left to [`check_internal`] and
/// [`check_power`].
///
/// # Panics
/// With the report, when something is found.
pub fn check_force<T: Force>(params: &str) {
    let options = Options { internal: false, accounted: false, ..Options::default() };
    examine_force_with::<T>(params, &options).assert_sound();
}

/// [`examine_control`]; nothing may be found.
///
/// # Panics
/// With the report, when something is found.
pub fn check_control<T: Control>(params: &str) {
    examine_control::<T>(params).assert_sound();
}

/// Checks that action equals reaction: no resultant force, no resultant moment, at random settings.
///
/// # Panics
/// With the report, when there is one.
pub fn check_internal<T: Force>(params: &str) {
    only::<T>(params, &Options::default(), acting::examine_third_law).assert_sound();
}

/// Checks the power balance: the loads' power is -dV/dt - dissipation, and the dissipation is not negative, at the
/// settings that `setting` makes (some force elements are made for aligned axes only).
///
/// # Panics
/// With the report, when it does not hold, or the element gives neither potential nor dissipation.
pub fn check_power<T: Force>(params: &str, setting: impl Fn(&mut Random) -> Setting) {
    let options = Options { anywhere: Some(&setting), ..Options::default() };
    only::<T>(params, &options, |x| acting::examine_power(x, true)).assert_sound();
}

fn only<T: Force>(params: &str, options: &Options<'_>, check: impl FnOnce(&mut Examination<'_>)) -> Report {
    let (report, examination) = Examination::begin(adapt::force::<T>(), params, options);
    let Some(mut x) = examination else { return report };
    check(&mut x);
    x.judged()
}
