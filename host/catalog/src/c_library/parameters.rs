//! What an instance is given by the scene: the functions behind `odyn_parameters`.

// The functions get back, as a plain pointer, what `create` made for them.
#![allow(unsafe_code)]

use std::ffi::{CString, c_char, c_void};
use std::ptr;

use element_api::descriptor::Descriptor;
use element_api::params::{FRAME_COUNT, ParamError, ParamKind, ParamSpec, ParamType, Table as Params};
use element_api::set::CreateError;

use super::describe::optional;
use super::table;

/// The pointer to a new instance, and its number of frames.
///
/// # Errors
/// What the element says, or that it asked for parameters that it does not declare.
pub fn create(
    element: &table::Element,
    descriptor: &Descriptor,
    params: &Params,
) -> Result<(*mut c_void, usize), CreateError> {
    let (least, most) = descriptor.frame_counts();
    let count = params.get(FRAME_COUNT).map_or(Some(least), |count| usize::try_from(count.as_integer()?).ok());
    let Some(count) = count.filter(|count| (least..=most).contains(count)) else {
        let message = format!("`{}` takes {least} to {most} frames", descriptor.name);
        return Err(CreateError::Parameter(ParamError::new("bodies", message)));
    };
    let instance = create_one(element, descriptor, params)?;
    let Some(with_frames) = element.with_frames else { return Ok((instance, count)) };
    let mut error = table::Error::empty();
    let status = with_frames(instance, count as u32, &raw mut error);
    if status == table::OK {
        return Ok((instance, count));
    }
    if let Some(destroy) = element.destroy {
        destroy(instance);
    }
    let (path, message) = error.texts();
    Err(match status {
        table::REFUSED => CreateError::Parameter(ParamError { path, message }),
        _ => CreateError::Fault(message),
    })
}

fn create_one(element: &table::Element, descriptor: &Descriptor, params: &Params) -> Result<*mut c_void, CreateError> {
    let Some(function) = element.create else { return Ok(ptr::null_mut()) };
    let curve =
        |spec: &&ParamSpec| spec.kind == ParamKind::Curve && params.get(&spec.name).is_some_and(|p| p.is_table());
    if let Some(spec) = descriptor.params.iter().find(curve) {
        let message = "must be a list of [argument, value] pairs: an element in C joins them in its own way";
        return Err(CreateError::Parameter(ParamError::new(spec.name.clone(), message)));
    }
    let mut given = Given { descriptor, params, mistake: None, numbers: Vec::new(), texts: Vec::new() };
    let parameters = table::Parameters {
        size: size_of::<table::Parameters>() as u32,
        reserved: 0,
        context: (&raw mut given).cast(),
        number,
        integer,
        text,
        numbers,
    };
    let mut error = table::Error::empty();
    let mut instance = ptr::null_mut();
    let status = function(&raw const parameters, &raw mut instance, &raw mut error);
    if status != table::OK {
        let (path, message) = error.texts();
        return Err(match given.mistake {
            Some(mistake) => CreateError::Fault(mistake),
            None if status == table::REFUSED => CreateError::Parameter(ParamError { path, message }),
            None => CreateError::Fault(message),
        });
    }
    let Some(mistake) = given.mistake else { return Ok(instance) };
    if let Some(destroy) = element.destroy {
        destroy(instance);
    }
    Err(CreateError::Fault(mistake))
}

struct Given<'a> {
    descriptor: &'a Descriptor,
    params: &'a Params,
    mistake: Option<String>,
    /// What was given out stays where it is.
    numbers: Vec<Box<[f64]>>,
    texts: Vec<CString>,
}

impl Given<'_> {
    /// A parameter, read by `read`; where there is none, the code to return.
    fn find<T>(&mut self, name: *const c_char, what: &str, read: fn(&toml::Value) -> Option<T>) -> Result<T, i32> {
        // SAFETY: a text of the header, or null.
        let name = match unsafe { optional(name, "name of a parameter") } {
            Ok(name) => name.unwrap_or_default(),
            Err(error) => return Err(self.wrong(error)),
        };
        match self.params.get(&name) {
            Some(value) => read(value).ok_or_else(|| self.wrong(format!("asks for the parameter `{name}` as {what}"))),
            None if self.descriptor.params.iter().any(|known| known.name == name) => Err(table::ABSENT),
            None => Err(self.wrong(format!("asks for the parameter `{name}`, which it does not declare"))),
        }
    }

    fn wrong(&mut self, message: String) -> i32 {
        self.mistake.get_or_insert(message);
        table::FAULT
    }
}

/// Lets a function work on what was given.
fn with(context: *mut c_void, body: impl FnOnce(&mut Given<'_>) -> Result<(), i32>) -> i32 {
    if context.is_null() {
        return table::FAULT;
    }
    // SAFETY: what `create` passed, alive until the library's `create` returns, used on one thread as the header demands.
    let given = unsafe { &mut *context.cast::<Given<'_>>() };
    body(given).err().unwrap_or(table::OK)
}

/// Writes what was asked for.
fn put<T>(slot: *mut T, value: T) -> Result<(), i32> {
    if slot.is_null() {
        return Err(table::FAULT);
    }
    // SAFETY: a place for it, as the header says.
    unsafe { slot.write(value) };
    Ok(())
}

extern "C" fn number(context: *mut c_void, name: *const c_char, value: *mut f64) -> i32 {
    with(context, |given| put(value, given.find(name, "a number", f64::read_value)?))
}

extern "C" fn integer(context: *mut c_void, name: *const c_char, value: *mut i64) -> i32 {
    let read = |value: &toml::Value| i64::read_value(value).or_else(|| bool::read_value(value).map(i64::from));
    with(context, |given| put(value, given.find(name, "a whole number", read)?))
}

extern "C" fn text(context: *mut c_void, name: *const c_char, value: *mut *const c_char) -> i32 {
    let read = |value: &toml::Value| CString::new(value.as_str()?).ok();
    with(context, |given| {
        let text = given.find(name, "a text without zeros", read)?;
        put(value, text.as_ptr())?;
        given.texts.push(text);
        Ok(())
    })
}

extern "C" fn numbers(context: *mut c_void, name: *const c_char, values: *mut *const f64, count: *mut usize) -> i32 {
    let read = |value: &toml::Value| {
        let pairs = || Vec::<[f64; 2]>::read_value(value).map(|pairs| pairs.into_iter().flatten().collect());
        Vec::<f64>::read_value(value).or_else(pairs)
    };
    with(context, |given| {
        let list = given.find(name, "a list of numbers", read)?.into_boxed_slice();
        put(values, list.as_ptr())?;
        put(count, list.len())?;
        given.numbers.push(list);
        Ok(())
    })
}
