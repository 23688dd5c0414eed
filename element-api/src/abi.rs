//! The binary interface: how an [`ElementClass`] crosses from a library file into the host.
//!
//! This module and its children are the only place that names `abi_stable`, which is pinned exactly (one hidden item of
//! it is used) and no longer maintained; replacing it means rewriting this file. What crosses is plain data in C layout,
//! text and recordings; `abi_stable` adds boxed objects with method tables and the check that both sides have the same
//! layout.
//!
//! [`v1`] never changes: `abi_stable` refuses a library whose tables are *shorter* than the host's, so
//! a method added here would lock out every library built before. Additions are a `v2` module beside it, or an ability
//! behind [`v1::PluginV1::extension`]. `abi-v1.layout.txt` is a dump of the types; a test compares it.
//!
//! | side | what |
//! |---|---|
//! | library | [`header`], made by [`export_plugin!`](crate::export_plugin): wraps each class, fences every call |
//! | host | [`open`]: checks version and layout, gives classes that look as if they were linked in |
//!
//! Text for text: parameters and descriptors travel as TOML, whose numbers are written with enough digits to come back
//! bit by bit.

// `unsafe`: exporting and reading a root module is a promise about its type that no compiler can check.
// The two lints complain about what the macros of `abi_stable` generate.
#![allow(unsafe_code, non_local_definitions, non_camel_case_types)]

mod host;
mod layout;
mod plugin;

#[cfg(test)]
mod tests;

pub use host::{OpenError, UnreadClass, decode, open, open_unread};
pub use layout::v1_layout_text;
pub use plugin::{Exported, header};

/// What [`export_plugin!`](crate::export_plugin) exports.
pub use abi_stable::library::LibHeader as Header;

#[cfg(doc)]
use crate::set::ElementClass;

/// Version 1 of the interface; it does not change any more.
pub mod v1 {
    use abi_stable::library::RootModule;
    use abi_stable::sabi_types::VersionStrings;
    use abi_stable::std_types::{RBox, ROption, RResult, RSlice, RSliceMut, RStr, RString, RVec};
    use abi_stable::{StableAbi, package_version_strings, sabi_trait};

    /// What a library exports.
    #[repr(C)]
    #[derive(StableAbi)]
    #[sabi(kind(Prefix(prefix_ref = PluginV1_Ref)))]
    pub struct PluginV1 {
        /// See [`crate::manifest::CONVENTIONS`].
        pub conventions: u32,
        /// The elements.
        pub classes: extern "C" fn() -> RResult<RVec<ClassBoxV1>, ErrorV1>,
        /// Optional abilities by name, agreed upon outside this module; null for those the library lacks.
        #[sabi(last_prefix_field)]
        pub extension: extern "C" fn(RStr<'_>) -> *const (),
    }

    impl RootModule for PluginV1_Ref {
        abi_stable::declare_root_module_statics! {PluginV1_Ref}
        const BASE_NAME: &'static str = "odyn_plugin";
        const NAME: &'static str = "odyn_plugin";
        const VERSION_STRINGS: VersionStrings = package_version_strings!();
    }

    /// A class in the host's hands.
    pub type ClassBoxV1 = ClassV1_TO<'static, RBox<()>>;
    /// A set in the host's hands.
    pub type SetBoxV1 = SetV1_TO<'static, RBox<()>>;

    /// [`crate::ElementClass`].
    #[sabi_trait]
    pub trait ClassV1: Send + Sync {
        /// The [`crate::Descriptor`] as TOML text.
        fn descriptor(&self) -> RResult<RString, ErrorV1>;
        /// An empty set.
        #[sabi(last_prefix_field)]
        fn new_set(&self) -> RResult<SetBoxV1, ErrorV1>;
    }

    /// [`crate::ElementSet`], function by function.
    #[sabi_trait]
    pub trait SetV1: Send {
        /// `params`: TOML text. Gives the number of the instance.
        fn add(&mut self, params: RStr<'_>) -> RResult<u32, ErrorV1>;
        /// The equations of an instance.
        fn record(&self, instance: u32) -> RResult<RecordingV1, ErrorV1>;
        /// Results into `out`.
        fn evaluate(&self, batch: BatchV1<'_>, out: RSliceMut<'_, f64>) -> ROption<ErrorV1>;
        /// A step was accepted.
        fn accept(&mut self, instance: u32, inputs: RSlice<'_, f64>) -> ROption<ErrorV1>;
        /// The private memory of an instance.
        fn save(&self, instance: u32) -> RResult<RVec<u8>, ErrorV1>;
        /// Restores a private memory.
        #[sabi(last_prefix_field)]
        fn load(&mut self, instance: u32, memory: RSlice<'_, u8>) -> ROption<ErrorV1>;
    }

    /// [`ErrorV1::kind`]: the element failed.
    pub const FAULT: u32 = 0;
    /// [`ErrorV1::kind`]: the element refuses a parameter.
    pub const PARAMETER: u32 = 1;

    /// What went wrong on the library's side.
    #[repr(C)]
    #[derive(StableAbi, Debug, Clone)]
    pub struct ErrorV1 {
        /// [`FAULT`] or [`PARAMETER`].
        pub kind: u32,
        /// Which instance, where it is about one.
        pub instance: u32,
        /// Name of the parameter; empty otherwise.
        pub path: RString,
        /// What happened.
        pub message: RString,
    }

    /// [`crate::recording::RawOp`].
    #[repr(C)]
    #[derive(StableAbi, Debug, Clone, Copy)]
    pub struct OpV1 {
        /// Which operation.
        pub code: u32,
        /// Its arguments.
        pub args: [u32; 4],
    }

    /// [`crate::Table`].
    #[repr(C)]
    #[derive(StableAbi, Debug, Clone)]
    pub struct TableV1 {
        /// Break points.
        pub breaks: RVec<f64>,
        /// Four coefficients per piece, piece after piece.
        pub pieces: RVec<f64>,
        /// [`crate::Outside::encode`].
        pub outside: u32,
    }

    /// [`crate::recording::Output`]; role and index as [`crate::recording::Role::encode`] gives them.
    #[repr(C)]
    #[derive(StableAbi, Debug, Clone, Copy)]
    pub struct OutputV1 {
        /// What it means.
        pub role: u32,
        /// Which of that meaning.
        pub index: u32,
        /// The operation whose value it is.
        pub node: u32,
    }

    /// [`crate::Recording`].
    #[repr(C)]
    #[derive(StableAbi, Debug, Clone)]
    pub struct RecordingV1 {
        /// Operations.
        pub ops: RVec<OpV1>,
        /// Numbers that operations refer to.
        pub constants: RVec<f64>,
        /// Tables that operations refer to.
        pub tables: RVec<TableV1>,
        /// Results.
        pub outputs: RVec<OutputV1>,
        /// Values of the continuous states at the start.
        pub initial_states: RVec<f64>,
        /// Values of the discrete states at the start.
        pub initial_discrete: RVec<f64>,
    }

    /// [`BatchV1::wanted`]: derivatives with respect to frames and time.
    pub const JACOBIAN: u32 = 1;
    /// [`BatchV1::wanted`]: second derivative along the motion.
    pub const SECOND: u32 = 2;

    /// [`crate::set::Batch`].
    #[repr(C)]
    #[derive(StableAbi)]
    pub struct BatchV1<'a> {
        /// Numbers of the instances.
        pub instances: RSlice<'a, u32>,
        /// Their inputs.
        pub inputs: RSlice<'a, f64>,
        /// Sum of [`JACOBIAN`] and [`SECOND`].
        pub wanted: u32,
        /// Where the library writes, atomically, which instance it works on, so that a watchdog can name it. May be null.
        pub progress: *mut u32,
    }
}
