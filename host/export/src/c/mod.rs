//! Machines as C99.

mod header;
mod listing;
mod package;
mod source;

pub use package::{Cost, EXAMPLE, Package, package};

/// Kind of the numbers of a C program.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Real {
    /// 64 bits: the digits of the interpreter.
    Double,
    /// 32 bits.
    Float,
}

impl Real {
    /// The type in C.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Double => "double",
            Self::Float => "float",
        }
    }

    /// Bytes of one number.
    #[must_use]
    pub fn size(self) -> usize {
        match self {
            Self::Double => 8,
            Self::Float => 4,
        }
    }

    /// A number as it is read back without loss.
    fn number(self, value: f64) -> String {
        let text = match self {
            Self::Double if value.is_nan() => "NAN".into(),
            Self::Double if value.is_infinite() => "INFINITY".into(),
            Self::Double => format!("{:?}", value.abs()),
            Self::Float if value.is_nan() => "NAN".into(),
            Self::Float if (value as f32).is_infinite() => "INFINITY".into(),
            Self::Float => format!("{:?}f", (value as f32).abs()),
        };
        if value.is_sign_negative() && !value.is_nan() { format!("(-{text})") } else { text }
    }

    /// A function of `math.h`.
    fn function(self, name: &str) -> String {
        match self {
            Self::Double => name.into(),
            Self::Float => format!("{name}f"),
        }
    }
}
