//! The standard force elements. One file per element: picture, equations, sign convention, singular cases, tests.

#![forbid(unsafe_code)]

pub mod rotational_spring_damper;
pub mod translational_spring_damper;

element_api::export_plugin! {
    about: "Standard force elements",
    forces: [
        translational_spring_damper::TranslationalSpringDamper,
        rotational_spring_damper::RotationalSpringDamper,
    ],
}

#[cfg(test)]
mod tests;
