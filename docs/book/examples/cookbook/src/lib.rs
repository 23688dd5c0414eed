//! Elements that show one thing each: the cookbook of the book (`docs/book`).

#![forbid(unsafe_code)]

mod deadbeat;
mod differential;
mod lag;
mod maxwell;
mod progressive_spring;
mod propeller;
mod rope;
mod shaker;
mod tether;
mod thermostat;

#[cfg(test)]
mod tests;

pub use deadbeat::Deadbeat;
pub use differential::Differential;
pub use lag::Lag;
pub use maxwell::Maxwell;
pub use progressive_spring::ProgressiveSpring;
pub use propeller::Propeller;
pub use rope::Rope;
pub use shaker::Shaker;
pub use tether::Tether;
pub use thermostat::Thermostat;

element_api::export_plugin! {
    about: "Elements that show one thing each",
    joints: [Shaker, Differential, Tether],
    forces: [Maxwell, ProgressiveSpring, Rope, Propeller, Deadbeat],
    controls: [Lag, Thermostat],
}
