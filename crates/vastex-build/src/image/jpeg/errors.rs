//! libjpeg's errors and warnings: errors unwind up to the reader, warnings are counted.
//!
//! A warning means that the compressed data are damaged and that libjpeg goes on with what it could make of
//! them. Where it passes over bytes before the marker that ends the file, somebody may have put them there,
//! or the data are damaged and it took fewer of them than there are for the whole picture. So only a few such
//! bytes are no warning.

use std::cell::Cell;
use std::io;
use std::os::raw::{c_int, c_long};
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::ptr;

use mozjpeg_sys::{JWRN_EXTRANEOUS_DATA, jpeg_common_struct, jpeg_error_mgr, msg_parm_union};

/// The marker that ends a file.
const END_OF_IMAGE: u32 = 0xd9;
/// More bytes before it are a warning like any other.
const MOST_STRAY_BYTES: u32 = 16;

thread_local! {
    /// Warnings of the decoder that runs on this thread, since they were last taken.
    static WARNINGS: Cell<u32> = const { Cell::new(0) };
    /// Bytes that it passed over before the end of the file, since they were last taken.
    static STRAY_BYTES: Cell<u32> = const { Cell::new(0) };
}

/// What an error unwinds with.
pub(super) struct Fatal;

/// Warnings on this thread since the last call.
pub(super) fn take_warnings() -> u32 {
    WARNINGS.take()
}

/// Bytes that belong to nothing before the end of the file, passed over on this thread since the last call.
pub(super) fn take_stray_bytes() -> u32 {
    STRAY_BYTES.take()
}

/// Has libjpeg do something on this thread; else says what is wrong with its data, damage that it would go on
/// with included.
pub(super) fn guarded<T>(work: impl FnOnce() -> io::Result<T>) -> Result<T, String> {
    take_warnings();
    take_stray_bytes();
    let result = catch_unwind(AssertUnwindSafe(work));
    let warnings = take_warnings();
    take_stray_bytes();
    match result {
        Ok(Ok(_)) if warnings > 0 => Err("its data end or make no sense".into()),
        Ok(Ok(done)) => Ok(done),
        Ok(Err(error)) => Err(error.to_string()),
        Err(payload) if payload.is::<Fatal>() => Err("it cannot be decoded".into()),
        Err(payload) => resume_unwind(payload),
    }
}

/// Handlers for one decoder. No message is formatted, so there are no tables of them.
pub(super) fn handlers() -> jpeg_error_mgr {
    jpeg_error_mgr {
        error_exit: Some(unwind),
        emit_message: Some(count),
        output_message: Some(be_silent),
        format_message: None,
        reset_error_mgr: Some(be_silent),
        msg_code: 0,
        msg_parm: msg_parm_union { _bindgen_data_: [0; 20] },
        trace_level: 0,
        num_warnings: 0 as c_long,
        jpeg_message_table: ptr::null(),
        last_jpeg_message: 0,
        addon_message_table: ptr::null(),
        first_addon_message: 0,
        last_addon_message: 0,
    }
}

extern "C-unwind" fn unwind(_: &mut jpeg_common_struct) {
    // Not `panic!`: no hook is to print anything.
    std::panic::resume_unwind(Box::new(Fatal));
}

/// Levels from 0 up are remarks on a sound file.
extern "C-unwind" fn count(decoder: &mut jpeg_common_struct, level: c_int) {
    if level >= 0 {
        return;
    }
    match stray_bytes(decoder) {
        Some(bytes) => STRAY_BYTES.set(STRAY_BYTES.get().saturating_add(bytes)),
        None => WARNINGS.set(WARNINGS.get().saturating_add(1)),
    }
}

/// The bytes that the decoder warns of, if they are few that it passed over before the end of the file.
#[allow(unsafe_code, reason = "libjpeg says which warning it is behind a raw pointer only")]
fn stray_bytes(decoder: &jpeg_common_struct) -> Option<u32> {
    // SAFETY: this is called by libjpeg, which calls through that very pointer; nobody else has the handlers
    // meanwhile.
    let said = unsafe { decoder.err.as_ref() }?;
    let [bytes, marker, ..] = said.msg_parm._bindgen_data_;
    let are_stray =
        said.msg_code == JWRN_EXTRANEOUS_DATA && marker == END_OF_IMAGE && bytes <= MOST_STRAY_BYTES;
    are_stray.then_some(bytes)
}

extern "C-unwind" fn be_silent(_: &mut jpeg_common_struct) {}
