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
//! Keys of `#[param(...)]`: `unit` (default `"1"`), `default`, `min`, `max` (inclusive), `above`, `below` (exclusive),
//! `choices = ["a", "b"]` for texts, `variable = "t"` for functions.
//! A field of type `Option<T>` may be left out of a scene.

use proc_macro::TokenStream;
use quote::quote;
use syn::{Attribute, Data, DeriveInput, Expr, Field, Fields, Lit, Meta, parse_macro_input};

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
    for attribute in field.attrs.iter().filter(|a| a.path().is_ident("param")) {
        attribute.parse_nested_meta(|meta| {
            let value: Expr = meta.value()?.parse()?;
            let path = meta.path.get_ident().map(ToString::to_string).unwrap_or_default();
            match path.as_str() {
                "unit" => unit = quote! { #value },
                "default" => extras.push(
                    quote! { .default_value(<#ty as ::element_api::params::ParamType>::write(&(#value).into())) },
                ),
                "min" => extras.push(quote! { .min(#value) }),
                "max" => extras.push(quote! { .max(#value) }),
                "above" => extras.push(quote! { .above(#value) }),
                "below" => extras.push(quote! { .below(#value) }),
                "choices" => extras.push(quote! { .choices(&#value) }),
                "variable" => extras.push(quote! { .variable(#value) }),
                other => {
                    return Err(meta.error(format!(
                        "unknown key `{other}`: expected unit, default, min, max, above, below, choices or variable"
                    )));
                }
            }
            Ok(())
        })?;
    }
    Ok(quote! { ::element_api::params::ParamSpec::new::<#ty>(#key, #unit, #doc) #(#extras)* })
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
