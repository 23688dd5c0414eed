use super::*;

#[test]
fn a_panic_becomes_its_message_and_place() {
    let error = fenced(|| {
        let empty: [u8; 0] = [];
        empty[std::hint::black_box(3)]
    })
    .expect_err("a panic");
    assert!(error.starts_with("panicked: index out of bounds: the len is 0 but the index is 3 at "), "{error}");
    assert!(error.contains("tests.rs:"), "{error}");
}

#[test]
fn a_value_passes_and_nothing_is_left_of_an_earlier_panic() {
    assert!(fenced(|| panic!("first")).is_err());
    assert_eq!(fenced(|| 3), Ok(3));
    let error = fenced(|| std::panic::resume_unwind(Box::new(1))).expect_err("no hook runs for this one");
    assert_eq!(error, "panicked");
}

#[test]
fn a_payload_whose_drop_panics_is_not_dropped() {
    struct Bomb;
    impl Drop for Bomb {
        fn drop(&mut self) {
            panic!("in drop");
        }
    }
    assert!(fenced(|| std::panic::panic_any(Bomb)).expect_err("a panic").starts_with("panicked: no message at "));
}

#[test]
fn fences_nest() {
    let message = fenced(|| {
        let inner = fenced(|| panic!("inner")).expect_err("a panic");
        assert!(inner.contains("inner"), "{inner}");
        assert!(inner.is_empty(), "outer");
    })
    .expect_err("a panic");
    assert!(message.contains("outer"), "{message}");
}
