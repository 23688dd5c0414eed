//! The processor's floating-point control register: foreign code must leave rounding, denormals and traps as they were.

// Registers can't be read and written safely; each use says why it holds.
#![allow(unsafe_code)]

/// `[hot]` What `body` gives, and whether it left the register as it was. It is so afterwards in any case.
pub(super) fn kept<T>(body: impl FnOnce() -> T) -> (T, bool) {
    let before = floating_point_control();
    let result = body();
    let kept = floating_point_control() == before;
    if !kept {
        set_floating_point_control(before);
    }
    (result, kept)
}

/// The bits of MXCSR that decide results: masks, rounding, denormals; not the sticky flags. A few cycles.
#[cfg(target_arch = "x86_64")]
pub(super) fn floating_point_control() -> u64 {
    let mut value = 0_u32;
    // SAFETY: writes the register to the variable.
    unsafe { std::arch::asm!("stmxcsr [{}]", in(reg) &raw mut value, options(nostack, preserves_flags)) };
    u64::from(value & !0x3f)
}

#[cfg(target_arch = "x86_64")]
pub(super) fn set_floating_point_control(value: u64) {
    let value = value as u32;
    // SAFETY: a value that the register had before.
    unsafe { std::arch::asm!("ldmxcsr [{}]", in(reg) &raw const value, options(nostack, preserves_flags)) };
}

#[cfg(target_arch = "aarch64")]
pub(super) fn floating_point_control() -> u64 {
    let value: u64;
    // SAFETY: reads a register.
    unsafe { std::arch::asm!("mrs {}, fpcr", out(reg) value, options(nostack, nomem, preserves_flags)) };
    value
}

#[cfg(target_arch = "aarch64")]
pub(super) fn set_floating_point_control(value: u64) {
    // SAFETY: a value that the register had before.
    unsafe { std::arch::asm!("msr fpcr, {}", in(reg) value, options(nostack, nomem, preserves_flags)) };
}

#[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
pub(super) fn floating_point_control() -> u64 {
    0
}

#[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
pub(super) fn set_floating_point_control(_: u64) {}
