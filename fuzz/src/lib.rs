//! What every target of cargo-fuzz consists of: a target of `vastex-fuzz`, and its mutations beside the
//! fuzzer's own.

pub use libfuzzer_sys;
pub use vastex_fuzz;

/// Makes the fuzzer's entry points for the target of that name.
#[macro_export]
macro_rules! fuzz {
    ($name:literal) => {
        $crate::libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
            $crate::target($name).check(bytes);
        });
        $crate::libfuzzer_sys::fuzz_mutator!(|data: &mut [u8], size: usize, max_size: usize, seed: u32| {
            $crate::mutate($name, data, size, max_size, seed)
        });
    };
}

/// The target of that name.
pub fn target(name: &str) -> &'static vastex_fuzz::Target {
    vastex_fuzz::Target::named(name).expect("the target is in vastex-fuzz")
}

/// One mutation in three is the fuzzer's own, which knows what was compared with what; the others know the
/// formats.
pub fn mutate(name: &str, data: &mut [u8], size: usize, max_size: usize, seed: u32) -> usize {
    if seed % 3 == 0 {
        return libfuzzer_sys::fuzzer_mutate(data, size, max_size);
    }
    let mutated = vastex_fuzz::mutate(target(name), &data[..size], u64::from(seed));
    let len = mutated.len().min(max_size);
    data[..len].copy_from_slice(&mutated[..len]);
    len
}
