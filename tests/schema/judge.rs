//! A validator for the part of JSON Schema that the schema of scenes uses; any other keyword panics, so that nothing in a
//! schema is passed over.
//!
//! Own code, because the crates that do this bring forty others, one of which changes the features of a dependency of the
//! compiler backend, which would then be compiled once for the program and once more for the tests.

use serde_json::{Map, Value};

/// Keywords that tell and judge nothing.
const REMARKS: [&str; 6] = ["$schema", "$defs", "default", "x-dimension", "x-order", "x-taplo"];

/// What is wrong with a value, by place; nothing if it is valid.
pub fn faults(value: &Value, schema: &Value, root: &Value, place: &str) -> Vec<String> {
    let Some(schema) = schema.as_object() else { panic!("{place}: {schema} is no schema") };
    let mut faults = Vec::new();
    for (word, rule) in schema {
        let fault = match word.as_str() {
            remark if REMARKS.contains(&remark) => None,
            "title" | "description" => {
                assert!(rule.as_str().is_some_and(|text| !text.is_empty()), "{place} has an empty {word}");
                None
            }
            "if" => {
                let holds = valid(value, rule, root, place);
                faults.extend(
                    schema
                        .get("then")
                        .filter(|_| holds)
                        .into_iter()
                        .flat_map(|then| self::faults(value, then, root, place)),
                );
                None
            }
            "then" => None,
            "allOf" => {
                faults.extend(list(rule).iter().flat_map(|rule| self::faults(value, rule, root, place)));
                None
            }
            "anyOf" => (count(value, rule, root, place) == 0).then(|| "is none of what is possible".into()),
            "oneOf" => (count(value, rule, root, place) != 1).then(|| "is not exactly one of what is possible".into()),
            "$ref" => {
                let pointer = rule.as_str().and_then(|rule| rule.strip_prefix('#')).unwrap();
                faults.extend(self::faults(value, root.pointer(pointer).unwrap(), root, place));
                None
            }
            "type" => (!is_of(value, rule)).then(|| format!("is no {rule}")),
            "enum" => (!list(rule).contains(value)).then(|| "is none of the words".into()),
            "minimum" => number_fault(value, |x| x >= rule.as_f64().unwrap()),
            "maximum" => number_fault(value, |x| x <= rule.as_f64().unwrap()),
            "exclusiveMinimum" => number_fault(value, |x| x > rule.as_f64().unwrap()),
            "exclusiveMaximum" => number_fault(value, |x| x < rule.as_f64().unwrap()),
            "minLength" => value.as_str().is_some_and(|text| text.is_empty()).then(|| "is empty".into()),
            "pattern" => value.as_str().filter(|text| !matches(text, rule)).map(|_| format!("does not match {rule}")),
            "minItems" => length_fault(value, |length| length >= rule.as_u64().unwrap()),
            "maxItems" => length_fault(value, |length| length <= rule.as_u64().unwrap()),
            "items" => {
                let items = value.as_array().into_iter().flatten().enumerate();
                faults.extend(items.flat_map(|(k, item)| self::faults(item, rule, root, &format!("{place}[{k}]"))));
                None
            }
            "required" => value.as_object().and_then(|table| missing(table, rule)),
            "propertyNames" => {
                let names = value.as_object().into_iter().flatten();
                faults.extend(names.flat_map(|(name, _)| self::faults(&name.as_str().into(), rule, root, place)));
                None
            }
            "properties" | "additionalProperties" => None,
            other => panic!("the keyword `{other}` is not known here"),
        };
        faults.extend(fault.map(|fault| format!("{place} {fault}")));
    }
    faults.extend(faults_of_properties(value, schema, root, place));
    faults
}

fn valid(value: &Value, schema: &Value, root: &Value, place: &str) -> bool {
    faults(value, schema, root, place).is_empty()
}

fn count(value: &Value, rules: &Value, root: &Value, place: &str) -> usize {
    list(rules).iter().filter(|rule| valid(value, rule, root, place)).count()
}

fn list(rule: &Value) -> &[Value] {
    rule.as_array().unwrap()
}

fn faults_of_properties(value: &Value, schema: &Map<String, Value>, root: &Value, place: &str) -> Vec<String> {
    let Some(table) = value.as_object() else { return Vec::new() };
    let known = schema.get("properties").and_then(Value::as_object);
    let rest = schema.get("additionalProperties");
    let mut faults = Vec::new();
    for (key, value) in table {
        let place = format!("{place}.{key}");
        match (known.and_then(|known| known.get(key)), rest) {
            (Some(schema), _) => faults.extend(self::faults(value, schema, root, &place)),
            (None, None) => {}
            (None, Some(Value::Bool(false))) => faults.push(format!("{place} is not known")),
            (None, Some(schema)) => faults.extend(self::faults(value, schema, root, &place)),
        }
    }
    faults
}

fn is_of(value: &Value, rule: &Value) -> bool {
    let words: Vec<&str> = match rule {
        Value::Array(words) => words.iter().filter_map(Value::as_str).collect(),
        word => word.as_str().into_iter().collect(),
    };
    words.iter().any(|word| match *word {
        "object" => value.is_object(),
        "array" => value.is_array(),
        "string" => value.is_string(),
        "boolean" => value.is_boolean(),
        "number" => value.is_number(),
        // 2.0 is an integer, too.
        "integer" => value.as_f64().is_some_and(|x| x.fract() == 0.0),
        other => panic!("the type `{other}` is not known here"),
    })
}

fn number_fault(value: &Value, holds: impl Fn(f64) -> bool) -> Option<String> {
    value.as_f64().filter(|x| !holds(*x)).map(|_| "is out of range".into())
}

fn length_fault(value: &Value, holds: impl Fn(u64) -> bool) -> Option<String> {
    value.as_array().filter(|items| !holds(items.len() as u64)).map(|_| "has too few or too many entries".into())
}

fn missing(table: &Map<String, Value>, rule: &Value) -> Option<String> {
    let absent = list(rule).iter().filter_map(Value::as_str).find(|key| !table.contains_key(*key))?;
    Some(format!("has no `{absent}`"))
}

/// The patterns of the schema, `^[..]+$` and `^[..][..]*$` of ASCII letters, digits and some signs.
fn matches(text: &str, rule: &Value) -> bool {
    let letter = |c: char| c.is_ascii_alphanumeric() || c == '_';
    match rule.as_str().unwrap() {
        "^[A-Za-z0-9_-]+$" => !text.is_empty() && text.chars().all(|c| letter(c) || c == '-'),
        "^[A-Za-z0-9_.-]+$" => !text.is_empty() && text.chars().all(|c| letter(c) || matches!(c, '.' | '-')),
        "^[A-Za-z_][A-Za-z0-9_]*$" => {
            text.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_') && text.chars().all(letter)
        }
        "^[0-9a-fA-F]{64}$" => text.len() == 64 && text.chars().all(|c| c.is_ascii_hexdigit()),
        "^#[0-9a-fA-F]{6}$" => text
            .strip_prefix('#')
            .is_some_and(|digits| digits.len() == 6 && digits.chars().all(|c| c.is_ascii_hexdigit())),
        other => panic!("the pattern `{other}` is not known here"),
    }
}
