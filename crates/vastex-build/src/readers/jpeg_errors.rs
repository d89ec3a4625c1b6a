//! libjpeg's errors and warnings: errors unwind up to the reader, warnings are counted.
//!
//! A warning means that the compressed data are damaged and that libjpeg goes on with what it could make of them.

use std::cell::Cell;
use std::os::raw::{c_int, c_long};
use std::ptr;

use mozjpeg_sys::{jpeg_common_struct, jpeg_error_mgr, msg_parm_union};

thread_local! {
    /// Warnings of the decoder that runs on this thread, since they were last taken.
    static WARNINGS: Cell<u32> = const { Cell::new(0) };
}

/// What an error unwinds with.
pub(super) struct Fatal;

/// Warnings on this thread since the last call.
pub(super) fn take_warnings() -> u32 {
    WARNINGS.take()
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
extern "C-unwind" fn count(_: &mut jpeg_common_struct, level: c_int) {
    if level < 0 {
        WARNINGS.set(WARNINGS.get().saturating_add(1));
    }
}

extern "C-unwind" fn be_silent(_: &mut jpeg_common_struct) {}
