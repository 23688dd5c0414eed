//! What the derive writes, and what it refuses in words.

use syn::{DeriveInput, parse_quote};

use super::expand;

fn refusal(input: &DeriveInput) -> String {
    expand(input).expect_err("must be refused").to_string()
}

#[test]
fn keys_become_calls_in_the_order_in_which_they_stand() {
    let input: DeriveInput = parse_quote! {
        struct P {
            /// Which
            /// motion.
            #[param(choices = ["rotation", "translation"], default = "rotation")]
            kind: String,
            /// A function.
            #[param(unit = "s -> rad", variable = "t")]
            angle: Function,
            /// A number.
            #[param(above = 0.0, below = 2.0, min = 0.5, max = 1.5)]
            x: f64,
        }
    };
    let text: String = expand(&input).expect("accepted").to_string().split_whitespace().collect();
    let expected = [
        r#"ParamSpec::new::<String>("kind","1","Whichmotion.").choices(&["rotation","translation"]).default_value("#,
        r#"ParamSpec::new::<Function>("angle","s->rad","Afunction.").variable("t"),"#,
        r#"ParamSpec::new::<f64>("x","1","Anumber.").above(0.0).below(2.0).min(0.5).max(1.5)]"#,
        r#"kind:::element_api::params::read(table,"kind")?"#,
    ];
    for part in expected {
        assert!(text.contains(part), "{part} is not in {text}");
    }
}

#[test]
fn unknown_keys_are_refused_with_the_known_ones() {
    let message = refusal(&parse_quote! {
        struct P {
            /// A number.
            #[param(units = "m")]
            x: f64,
        }
    });
    assert!(message.starts_with("unknown key `units`: expected unit, default,"), "{message}");
    assert!(message.ends_with("choices or variable"), "{message}");
}

#[test]
fn a_parameter_without_a_text_is_refused() {
    assert!(refusal(&parse_quote! { struct P { x: f64 } }).contains("needs a doc comment"));
}

#[test]
fn only_structs_with_named_fields_are_parameters() {
    assert!(refusal(&parse_quote! { struct P(f64); }).contains("use a struct with named fields"));
    assert!(refusal(&parse_quote! { enum P { A } }).contains("a struct with named fields"));
    expand(&parse_quote! { struct P; }).expect("no parameters");
}

/// What is refused of a field with these keys.
fn field(keys: &str) -> Result<String, String> {
    let text = format!("struct P {{ /// A number.\n #[param({keys})] x: f64 }}");
    let input: DeriveInput = syn::parse_str(&text).expect("a struct");
    expand(&input).map(|tokens| tokens.to_string()).map_err(|error| error.to_string())
}

#[test]
fn numbers_beside_a_unit_that_is_not_si_are_refused() {
    for unit in ["mm", "N/mm", "rpm", "deg", "kN s/m", "mm -> N", "%"] {
        for key in ["default", "example", "min", "max", "above", "below"] {
            let said = field(&format!("unit = \"{unit}\", {key} = 5.0")).expect_err(unit);
            assert!(said.starts_with(&format!("`{key}` is in SI units")), "{said}");
        }
        field(&format!("unit = \"{unit}\"")).expect("no number beside it");
    }
    for unit in ["m", "N m/rad", "kg m^2", "1/s", "m -> N", "1", "", "J/(kg s)"] {
        field(&format!("unit = \"{unit}\", default = 5.0, min = -1")).expect(unit);
    }
    assert!(field("unit = \"N/mm\", default = 5").expect_err("not SI").contains("write the unit in m "));
}

#[test]
fn symbols_that_no_scene_knows_are_refused() {
    assert_eq!(field("unit = \"Nm\""), Err("`Nm` is no unit that scenes know; did you mean `N m`?".into()));
    assert_eq!(field("unit = \"m/sec\""), Err("`sec` is no unit that scenes know".into()));
    // Worse than one that is not SI.
    assert!(field("unit = \"mm Nm\", default = 1").expect_err("unknown").starts_with("`Nm`"));
}

#[test]
fn defaults_outside_their_range_are_refused() {
    for keys in [
        "above = 0, default = -5",
        "above = 0.0, default = 0.0",
        "below = 1, default = 1.0",
        "min = 2, default = 1",
        "max = -1.5, default = -1",
    ] {
        let said = field(keys).expect_err(keys);
        assert!(said.contains("outside the range"), "{keys}: {said}");
    }
    for keys in
        ["min = 0, default = 0", "max = 1.0, default = 1", "above = -1, default = -0.5", "below = LIMIT, default = 7"]
    {
        field(keys).expect(keys);
    }
}

#[test]
fn choices_stand_once_and_have_the_default_among_them() {
    let said = |keys: &str| field(keys).expect_err(keys);
    assert_eq!(said(r#"choices = ["a", "b", "a"]"#), "the choice \"a\" stands here twice");
    assert_eq!(said(r#"choices = ["a", "b"], default = "c""#), "the default \"c\" is none of the choices: a, b");
    assert_eq!(said(r#"choices = ["a"], example = "A""#), "the example \"A\" is none of the choices: a");
    for keys in [
        r#"choices = ["a", "b"], default = "b""#,
        "choices = KNOWN, default = \"c\"",
        r#"choices = ["a", B], default = "c""#,
    ] {
        field(keys).expect(keys);
    }
}

#[test]
fn ranges_that_no_number_fits_are_refused() {
    for keys in ["min = 5, max = 1", "min = 1, below = 1", "above = 1, max = 1.0", "above = 2, below = -2"] {
        let said = field(keys).expect_err(keys);
        assert!(said.starts_with("no number fits"), "{keys}: {said}");
    }
    for keys in ["min = 1, max = 1", "above = 1, below = 1.5", "above = LEAST, below = 0"] {
        field(keys).expect(keys);
    }
}
