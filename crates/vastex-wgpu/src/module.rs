//! Where shader text is handed to a device: the one place of the project that does so.

use std::borrow::Cow;

use crate::needed::only_needed;

/// Names a directory that gets a copy of every shader text handed over, so that a suite can tell whether it
/// knows them all.
#[cfg(not(target_family = "wasm"))]
const LOG: &str = "VASTEX_SHADER_LOG";

/// Makes a shader module of what the entry points of a text need ([`only_needed`]); the lines of messages are
/// those of the whole text.
///
/// Where the environment variable `VASTEX_SHADER_LOG` names a directory, the text is written there, under a
/// name made of its hash; each text once, whatever number of processes hand it over. A text that cannot be
/// written is said in the log of `tracing`.
pub fn shader_module<'a>(
    device: &wgpu::Device,
    label: Option<&str>,
    text: impl Into<Cow<'a, str>>,
) -> wgpu::ShaderModule {
    let text = text.into();
    let text = only_needed(&text);
    #[cfg(not(target_family = "wasm"))]
    if let Some(directory) = std::env::var_os(LOG)
        && let Err(error) = log::write(std::path::Path::new(&directory), &text)
    {
        tracing::warn!("{LOG}={}: {error}", directory.display());
    }
    device
        .create_shader_module(wgpu::ShaderModuleDescriptor { label, source: wgpu::ShaderSource::Wgsl(text) })
}

#[cfg(not(target_family = "wasm"))]
mod log {
    use std::path::Path;
    use std::sync::atomic::{AtomicU32, Ordering};
    use std::{fs, io};

    /// Files of this process that have no name of their own yet.
    static UNNAMED: AtomicU32 = AtomicU32::new(0);

    /// Whole or not at all, whoever else writes the same.
    pub(super) fn write(directory: &Path, text: &str) -> io::Result<()> {
        let file = directory.join(format!("{:016x}.wgsl", hash(text)));
        if file.exists() {
            return Ok(());
        }
        fs::create_dir_all(directory)?;
        let nth = UNNAMED.fetch_add(1, Ordering::Relaxed);
        let unnamed = directory.join(format!("{}-{nth}.part", std::process::id()));
        fs::write(&unnamed, text)?;
        fs::rename(&unnamed, &file)
    }

    /// FNV-1a.
    pub(super) fn hash(text: &str) -> u64 {
        const START: u64 = 0xcbf2_9ce4_8422_2325;
        const PRIME: u64 = 0x0100_0000_01b3;
        text.bytes().fold(START, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(PRIME))
    }
}

#[cfg(all(test, not(target_family = "wasm")))]
mod tests {
    use super::log::{hash, write};

    #[test]
    fn a_text_is_written_once_and_whole() {
        let directory = std::env::temp_dir().join(format!("vastex-shader-log-{}", std::process::id()));
        std::thread::scope(|scope| {
            for _ in 0..4 {
                scope.spawn(|| (0..20).for_each(|n| write(&directory, &format!("// {}", n % 5)).unwrap()));
            }
        });
        let files: Vec<_> =
            std::fs::read_dir(&directory).unwrap().map(|entry| entry.unwrap().path()).collect();
        for file in &files {
            let text = std::fs::read_to_string(file).unwrap();
            assert_eq!(file.file_name().unwrap().to_string_lossy(), format!("{:016x}.wgsl", hash(&text)));
        }
        std::fs::remove_dir_all(&directory).unwrap();
        assert_eq!(files.len(), 5, "{files:?}");
    }

    #[test]
    fn the_hash_is_fnv_1a() {
        assert_eq!(hash(""), 0xcbf2_9ce4_8422_2325);
        assert_eq!(hash("a"), 0xaf63_dc4c_8601_ec8c);
    }
}
