//! What the interpreter calls, as functions with an address.

use element_api::Table;

use super::super::turn;

pub(super) extern "C" fn sin(a: f64) -> f64 {
    turn::sin(a)
}
pub(super) extern "C" fn cos(a: f64) -> f64 {
    turn::cos(a)
}
/// Two numbers, which the System V calling convention returns in vector registers 0 and 1.
#[repr(C)]
pub(super) struct Pair {
    sine: f64,
    cosine: f64,
}
pub(super) extern "C" fn sin_cos(a: f64) -> Pair {
    let (sine, cosine) = turn::sin_cos(a);
    Pair { sine, cosine }
}
/// Computes sines and cosines of so many angles, which lie in `numbers`, from the first on; then the sines follow, then the cosines.
pub(super) type AtOnce = unsafe extern "C" fn(numbers: *mut f64, lanes: u32);
/// The one for so many angles, on this machine.
pub(super) fn turns_of(lanes: u32) -> AtOnce {
    #[cfg(target_arch = "x86_64")]
    if lanes.is_multiple_of(4) && std::arch::is_x86_feature_detected!("avx2") {
        return turn::all_in_fours;
    }
    if lanes == 1 { single } else { turns }
}
extern "C" fn single(numbers: *mut f64, _: u32) {
    // SAFETY: as for `turns`.
    let [angle, sine, cosine] = unsafe { &mut *numbers.cast::<[f64; 3]>() };
    (*sine, *cosine) = turn::sin_cos(*angle);
}
extern "C" fn turns(numbers: *mut f64, lanes: u32) {
    let lanes = lanes as usize;
    // SAFETY: called by machine code only, which passes a place in the workspace that was given to `MachineCode::run`; that three
    // times as many numbers follow there was looked at when the code was made.
    let numbers = unsafe { std::slice::from_raw_parts_mut(numbers, 3 * lanes) };
    let (angles, results) = numbers.split_at_mut(lanes);
    let (sines, cosines) = results.split_at_mut(lanes);
    turn::all(angles, sines, cosines);
}
pub(super) extern "C" fn exp(a: f64) -> f64 {
    a.exp()
}
pub(super) extern "C" fn ln(a: f64) -> f64 {
    a.ln()
}
pub(super) extern "C" fn tanh(a: f64) -> f64 {
    a.tanh()
}
pub(super) extern "C" fn atan2(a: f64, b: f64) -> f64 {
    a.atan2(b)
}
pub(super) extern "C" fn powf(a: f64, exponent: f64) -> f64 {
    a.powf(exponent)
}
pub(super) extern "C" fn powi(a: f64, n: i32) -> f64 {
    a.powi(n)
}
pub(super) extern "C" fn look_up(a: f64, tables: *const Table, table: u32, order: u32) -> f64 {
    // SAFETY: called by machine code only, which passes the pointer to the program's tables that `MachineCode::run` was
    // given and numbers that the makers found below their count.
    let table = unsafe { &*tables.add(table as usize) };
    table.derivative(a, order)
}

/// Whole powers up to this are multiplied out.
pub(super) const INLINE_POWER: u32 = 8;
