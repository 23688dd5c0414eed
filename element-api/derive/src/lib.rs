//! `#[derive(Parameters)]`: one struct is the single source of an element's parameters.
//!
//! From the fields, their doc comments and their `#[param(...)]` attributes come the validation of scenes, the text of
//! `odyn elements describe`, and the reading of the values inside the plugin.
//!
//! ```ignore
//! #[derive(Parameters)]
//! struct SpringDamper {
//!     /// Stiffness along the line of action.
//!     #[param(unit = "N/m", min = 0.0)]
//!     stiffness: f64,
//!     /// Length without force.
//!     #[param(unit = "m", default = 0.0)]
//!     free_length: f64,
//! }
//! ```
//!
//! Keys of `#[param(...)]`: `unit` (default `"1"`), `default`, `example` (what `odyn plugin check` takes), `min`, `max` (inclusive), `above`, `below` (exclusive),
//! `choices = ["a", "b"]` for texts, `variable = "t"` for functions.
//! A field of type `Option<T>` may be left out of a scene.
//!
//! Numbers that stand there are in SI units, whatever scenes write; another unit beside them is refused, as are symbols that no
//! scene knows, and defaults outside their range.

use proc_macro::TokenStream;
use quote::quote;
use syn::{Attribute, Data, DeriveInput, Expr, Field, Fields, Lit, Meta, UnOp, parse_macro_input};

use units::Symbol;

mod units;

/// See the crate documentation.
#[proc_macro_derive(Parameters, attributes(param))]
pub fn derive_parameters(input: TokenStream) -> TokenStream {
    let input = parse_macro_input!(input as DeriveInput);
    expand(&input).unwrap_or_else(|error| error.to_compile_error()).into()
}

fn expand(input: &DeriveInput) -> syn::Result<proc_macro2::TokenStream> {
    let name = &input.ident;
    let Data::Struct(data) = &input.data else {
        return Err(syn::Error::new_spanned(name, "Parameters can be derived for a struct with named fields"));
    };
    let fields: Vec<&Field> = match &data.fields {
        Fields::Named(named) => named.named.iter().collect(),
        Fields::Unit => Vec::new(),
        Fields::Unnamed(_) => {
            return Err(syn::Error::new_spanned(name, "Parameters need names: use a struct with named fields"));
        }
    };
    let specs = fields.iter().map(|field| spec(field)).collect::<syn::Result<Vec<_>>>()?;
    let reads = fields.iter().map(|field| {
        let ident = &field.ident;
        let key = ident.as_ref().map(ToString::to_string).unwrap_or_default();
        quote! { #ident: ::element_api::params::read(table, #key)? }
    });
    Ok(quote! {
        impl ::element_api::params::Parameters for #name {
            fn specs() -> ::std::vec::Vec<::element_api::params::ParamSpec> {
                ::std::vec![#(#specs),*]
            }
            fn read(
                table: &::element_api::params::Table,
            ) -> ::std::result::Result<Self, ::element_api::params::ParamError> {
                let _ = table;
                Ok(Self { #(#reads),* })
            }
        }
    })
}

/// The tokens of one `ParamSpec`.
fn spec(field: &Field) -> syn::Result<proc_macro2::TokenStream> {
    let ident = field.ident.as_ref().ok_or_else(|| syn::Error::new_spanned(field, "a parameter needs a name"))?;
    let key = ident.to_string();
    let ty = &field.ty;
    let doc = doc_text(&field.attrs);
    if doc.is_empty() {
        return Err(syn::Error::new_spanned(ident, "a parameter needs a doc comment: it is what users will read"));
    }
    let mut unit = quote! { "1" };
    let mut extras = Vec::new();
    let mut values: Vec<(String, Expr)> = Vec::new();
    for attribute in field.attrs.iter().filter(|a| a.path().is_ident("param")) {
        attribute.parse_nested_meta(|meta| {
            let value: Expr = meta.value()?.parse()?;
            let path = meta.path.get_ident().map(ToString::to_string).unwrap_or_default();
            values.push((path.clone(), value.clone()));
            match path.as_str() {
                "unit" => unit = quote! { #value },
                "default" => extras.push(
                    quote! { .default_value(<#ty as ::element_api::params::ParamType>::write(&(#value).into())) },
                ),
                "example" => extras.push(
                    quote! { .example_value(<#ty as ::element_api::params::ParamType>::write(&(#value).into())) },
                ),
                "min" => extras.push(quote! { .min(#value) }),
                "max" => extras.push(quote! { .max(#value) }),
                "above" => extras.push(quote! { .above(#value) }),
                "below" => extras.push(quote! { .below(#value) }),
                "choices" => extras.push(quote! { .choices(&#value) }),
                "variable" => extras.push(quote! { .variable(#value) }),
                other => {
                    return Err(meta.error(format!(
                        "unknown key `{other}`: expected unit, default, example, min, max, above, below, choices or variable"
                    )));
                }
            }
            Ok(())
        })?;
    }
    judge(&values)?;
    Ok(quote! { ::element_api::params::ParamSpec::new::<#ty>(#key, #unit, #doc) #(#extras)* })
}

/// Refuses what can be seen to be a mistake. Values that are not written out are left to [`ParamSpec`]'s reader.
fn judge(values: &[(String, Expr)]) -> syn::Result<()> {
    let number =
        |key: &str| values.iter().find(|(k, _)| k == key).and_then(|(_, value)| Some((literal(value)?, value)));
    let bounds = ["min", "max", "above", "below"];
    let unit = values.iter().find(|(key, _)| key == "unit").map(|(_, value)| value);
    if let Some(Expr::Lit(written)) = unit
        && let Lit::Str(text) = &written.lit
        && let text = text.value()
        && let Some((symbol, what)) = units::not_si(&text)
    {
        match what {
            Symbol::Unknown(meant) => {
                let meant = if meant.is_empty() { String::new() } else { format!("; did you mean `{meant}`?") };
                return Err(syn::Error::new_spanned(written, format!("`{symbol}` is no unit that scenes know{meant}")));
            }
            Symbol::Other(si) => {
                let beside = ["default", "example"].into_iter().chain(bounds).find_map(|key| Some((key, number(key)?)));
                if let Some((key, (_, value))) = beside {
                    let text = format!(
                        "`{key}` is in SI units, as all that the element gets: with `unit = \"{text}\"` it is read as if it were \
                         in {symbol}; write the unit in {si} (scenes may still use {symbol})"
                    );
                    return Err(syn::Error::new_spanned(value, text));
                }
            }
            Symbol::Si => {}
        }
    }
    judge_choices(values)?;
    for (least, most) in [("min", "max"), ("min", "below"), ("above", "max"), ("above", "below")] {
        let (Some((low, _)), Some((high, value))) = (number(least), number(most)) else { continue };
        let open = least == "above" || most == "below";
        if low > high || open && low == high {
            let text = format!("no number fits: `{least}` is {low}, `{most}` is {high}");
            return Err(syn::Error::new_spanned(value, text));
        }
    }
    for what in ["default", "example"] {
        let Some((x, value)) = number(what) else { continue };
        for key in bounds {
            let Some((bound, _)) = number(key) else { continue };
            let (fits, sign) = match key {
                "min" => (x >= bound, ">="),
                "max" => (x <= bound, "<="),
                "above" => (x > bound, ">"),
                _ => (x < bound, "<"),
            };
            if !fits {
                let text = format!("the {what} {x} is outside the range: it must be {sign} {bound}");
                return Err(syn::Error::new_spanned(value, text));
            }
        }
    }
    Ok(())
}

/// Choices that stand there each once, with the default among them.
fn judge_choices(values: &[(String, Expr)]) -> syn::Result<()> {
    let Some((_, Expr::Array(list))) = values.iter().find(|(key, _)| key == "choices") else { return Ok(()) };
    let texts: Vec<(String, &Expr)> = list.elems.iter().filter_map(|one| Some((text(one)?, one))).collect();
    if texts.len() < list.elems.len() {
        return Ok(());
    }
    for (k, (choice, place)) in texts.iter().enumerate() {
        if texts[..k].iter().any(|(other, _)| other == choice) {
            return Err(syn::Error::new_spanned(place, format!("the choice {choice:?} stands here twice")));
        }
    }
    for (what, value) in values.iter().filter(|(key, _)| key == "default" || key == "example") {
        if let Some(given) = text(value)
            && !texts.iter().any(|(choice, _)| *choice == given)
        {
            let known: Vec<&str> = texts.iter().map(|(choice, _)| choice.as_str()).collect();
            let message = format!("the {what} {given:?} is none of the choices: {}", known.join(", "));
            return Err(syn::Error::new_spanned(value, message));
        }
    }
    Ok(())
}

/// A text that is written out.
fn text(value: &Expr) -> Option<String> {
    match value {
        Expr::Lit(literal) => match &literal.lit {
            Lit::Str(text) => Some(text.value()),
            _ => None,
        },
        _ => None,
    }
}

/// A number that is written out.
fn literal(value: &Expr) -> Option<f64> {
    match value {
        Expr::Lit(literal) => match &literal.lit {
            Lit::Float(number) => number.base10_parse().ok(),
            Lit::Int(number) => number.base10_parse().ok(),
            _ => None,
        },
        Expr::Unary(minus) if matches!(minus.op, UnOp::Neg(_)) => literal(&minus.expr).map(|number| -number),
        _ => None,
    }
}

/// The doc comment of a field as one paragraph.
fn doc_text(attributes: &[Attribute]) -> String {
    let mut lines = Vec::new();
    for attribute in attributes {
        let Meta::NameValue(pair) = &attribute.meta else { continue };
        let Expr::Lit(literal) = &pair.value else { continue };
        if let (true, Lit::Str(text)) = (pair.path.is_ident("doc"), &literal.lit) {
            lines.push(text.value().trim().to_string());
        }
    }
    lines.join(" ").trim().to_string()
}

#[cfg(test)]
mod tests;
