//! [`export_plugin!`](crate::export_plugin): the one line that makes a crate a library of elements.

/// Makes the crate a library of elements. Call it once, in `lib.rs`, with the names of the types:
///
/// ```
/// # use element_api::prelude::*;
/// # struct Rod;
/// # impl Element for Rod {
/// #     const NAME: &'static str = "rod";
/// #     const SUMMARY: &'static str = "";
/// #     const FRAMES: &'static [FrameSpec] = &[FrameSpec::new("i", ""), FrameSpec::new("j", "")];
/// #     type Parameters = NoParameters;
/// #     fn new(_: NoParameters) -> Result<Self, ParamError> { Ok(Self) }
/// # }
/// # impl Constraint for Rod {
/// #     const ROWS: &'static [&'static str] = &["distance"];
/// #     fn residual<S: Scalar>(&self, at: &Configuration<'_, S>, rows: &mut Rows<'_, S>) {
/// #         rows.push(length(at.frames[1].position - at.frames[0].position) - 1.0);
/// #     }
/// # }
/// element_api::export_plugin! { about: "Bars and ropes", joints: [Rod], forces: [] }
/// # fn main() { assert_eq!(library().classes.len(), 1); }
/// ```
///
/// `joints` are types that implement [`Constraint`](crate::Constraint), `forces` types that implement
/// [`Force`](crate::Force), `controls` types that implement [`Control`](crate::Control); any list may be left out. With `crate-type = ["cdylib"]` the crate becomes a file that the
/// host loads; with `["cdylib", "rlib"]` it can also be linked into a program. The crate needs no other dependency than
/// `element-api` and may forbid `unsafe`.
///
/// It makes `pub fn library() -> Library` (the elements, for programs that link the crate) and, with the feature `abi` of
/// `element-api`, the exported symbol and the manifest through which the host finds them in the file. The symbol carries
/// the name of the crate, so any number of such crates can be linked into one program.
///
/// The build fails when two elements have the same name, when a name can't be written in scenes, and with
/// `panic = "abort"`, which would let one panic of an element end the host.
#[macro_export]
macro_rules! export_plugin {
    (
        about: $about:expr
        $(, joints: [$($joint:ty),* $(,)?])?
        $(, forces: [$($force:ty),* $(,)?])?
        $(, controls: [$($control:ty),* $(,)?])?
        $(,)?
    ) => {
        /// The elements of this library, for programs that link it.
        #[must_use]
        pub fn library() -> $crate::manifest::Library {
            $crate::manifest::Library {
                package: env!("CARGO_PKG_NAME").into(),
                version: env!("CARGO_PKG_VERSION").into(),
                about: $about.into(),
                classes: ::std::vec![
                    $($($crate::adapt::joint::<$joint>(),)*)?
                    $($($crate::adapt::force::<$force>(),)*)?
                    $($($crate::adapt::control::<$control>(),)*)?
                ],
            }
        }

        const _: () = $crate::manifest::check_names(&[
            $($(<$joint as $crate::Element>::NAME,)*)?
            $($(<$force as $crate::Element>::NAME,)*)?
            $($(<$control as $crate::Element>::NAME,)*)?
        ]);

        $crate::__export_binary! {
            $about;
            $($("\nelement=joint ", <$joint as $crate::Element>::NAME,)*)?
            $($("\nelement=force ", <$force as $crate::Element>::NAME,)*)?
            $($("\nelement=control ", <$control as $crate::Element>::NAME,)*)?
        }
    };
}

/// The part of [`export_plugin!`](crate::export_plugin) that makes the crate loadable.
#[cfg(feature = "abi")]
#[doc(hidden)]
#[macro_export]
macro_rules! __export_binary {
    ($about:expr; $($element:expr,)*) => {
        #[cfg(panic = "abort")]
        compile_error!(
            "a library of elements must be built with panic = \"unwind\": a panic would otherwise end the host; \
             remove panic = \"abort\" from the profile"
        );

        const _: () = {
            struct __OdynExported;

            impl $crate::abi::Exported for __OdynExported {
                fn library() -> $crate::manifest::Library {
                    library()
                }
            }

            // Exporting a symbol counts as unsafe because two of the same name would collide: the name of the crate
            // keeps them apart.
            #[unsafe(export_name = concat!("odyn_plugin_v1_", env!("CARGO_CRATE_NAME")))]
            pub static __ODYN_HEADER: $crate::abi::Header = $crate::abi::header::<__OdynExported>();

            const __ODYN_PARTS: &[&str] = &[
                $crate::manifest::OPENING,
                env!("CARGO_PKG_NAME"),
                "\nversion=",
                env!("CARGO_PKG_VERSION"),
                "\nabout=",
                $crate::manifest::one_line($about),
                "\nentry=odyn_plugin_v1_",
                env!("CARGO_CRATE_NAME"),
                "\nprofile=",
                if cfg!(debug_assertions) { "debug" } else { "release" },
                "\nfeatures=",
                // Here and not in `element-api`, so that the flags of the author's crate count.
                if cfg!(target_feature = "sse4.2") { "sse4.2 " } else { "" },
                if cfg!(target_feature = "avx") { "avx " } else { "" },
                if cfg!(target_feature = "avx2") { "avx2 " } else { "" },
                if cfg!(target_feature = "fma") { "fma " } else { "" },
                if cfg!(target_feature = "avx512f") { "avx512f " } else { "" },
                if cfg!(target_feature = "neon") { "neon " } else { "" },
                $($element,)*
                "\nend\n",
            ];

            #[used]
            #[cfg_attr(target_vendor = "apple", unsafe(link_section = "__DATA,__odyn"))]
            #[cfg_attr(not(target_vendor = "apple"), unsafe(link_section = ".odyn"))]
            static __ODYN_MANIFEST: [u8; $crate::manifest::joined_len(__ODYN_PARTS)] =
                $crate::manifest::joined(__ODYN_PARTS);
        };
    };
}

/// Without the feature `abi` a library can only be linked in.
#[cfg(not(feature = "abi"))]
#[doc(hidden)]
#[macro_export]
macro_rules! __export_binary {
    ($about:expr; $($element:expr,)*) => {};
}
