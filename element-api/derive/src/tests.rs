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
