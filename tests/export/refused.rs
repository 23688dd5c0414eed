//! What cannot be exported is refused with its name and the reason.

use odyn::export::{Choices, Machine};

use crate::support::open;

/// The message that a scene is refused with.
fn refusal(scene: &str) -> String {
    match Machine::new(open(scene, &[]), "refused", Choices::default()) {
        Ok(_) => panic!("{scene} is exported"),
        Err(error) => error.diagnostics.iter().map(|d| format!("{} {}", d.code.code, d.message)).collect(),
    }
}

#[test]
fn what_cannot_be_exported_is_named() {
    for (scene, name, reason) in [
        ("verification/plane-contact.toml", "`", "has a row that only pushes"),
        ("verification/joint-friction.toml", "forces", "depend on accelerations or reactions"),
        ("benchmarks/freebody.toml", "the output `e0`", "cannot be written in the coordinates of joints"),
    ] {
        let message = refusal(scene);
        assert!(message.starts_with("ODY0806"), "{scene}: {message}");
        assert!(message.contains(name) && message.contains(reason), "{scene}: {message}");
    }
}
