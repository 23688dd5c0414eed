//! The numerical methods of O-DYN: what would be the same if the equations came from elsewhere.
//!
//! - **Takes**: numbers, patterns, functions to call.
//! - **Gives**: solutions of linear systems with their rank ([`linalg`]), steps of differential equations ([`integrate`]),
//!   bounds that hold on a whole stretch ([`interval`]), numbers of twice the precision ([`precise`]), reproducible random numbers ([`draw`]).
//! - **May touch**: its own storage, and the states it is handed.
//! - **Must not know**: mechanics, plugins, files.

pub mod draw;
pub mod integrate;
pub mod interval;
pub mod linalg;
pub mod precise;

#[cfg(test)]
#[path = "../../testing/random.rs"]
mod random;
