//! How bricks of a picture of a volume are read and sent to the GPU: the words that images have.

use std::path::PathBuf;

use clap::Args as ClapArgs;
use vastex::Settings;

use super::super::reading::ReadingArgs;

/// How bricks are read and sent.
#[derive(Clone, Debug, ClapArgs)]
pub(crate) struct VolumePagingArgs {
    /// Settings of pools and of reading (vastex.toml), but for the sizes of pools and factors on them, since
    /// --pool-mib says how large pools are; may be given several times, and later files override earlier ones
    #[arg(long, value_name = "FILE")]
    pub(crate) settings: Vec<PathBuf>,
    /// KiB of bricks copied to the GPU per frame at most; by default 65536
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=1 << 22))]
    upload_kib_per_frame: Option<u64>,
    /// Load bricks of the same content one by one, each into a slot of its own, to see what sharing saves
    #[arg(long)]
    no_sharing: bool,
    #[command(flatten)]
    reading: ReadingArgs,
}

impl VolumePagingArgs {
    /// Lays what was said over settings.
    pub(crate) fn lay_over(&self, mut settings: Settings) -> anyhow::Result<Settings> {
        self.settings.iter().try_for_each(|file| settings.read(file))?;
        // How large bricks are follows from how large the pool is, so that no file says or scales that.
        settings.pools.default_pool.allow_size_scale = Some(false);
        for rule in &mut settings.pools.rules {
            (rule.tuning.bytes, rule.tuning.allow_size_scale) = (None, None);
        }
        if let Some(kib) = self.upload_kib_per_frame {
            settings.upload_bytes_per_frame = kib << 10;
        }
        settings.share_contents &= !self.no_sharing;
        self.reading.lay_over(&mut settings);
        Ok(settings)
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use clap::Parser;
    use vastex::PoolTuning;

    use super::super::super::{Args, Command, RENDER_VOLUME};
    use super::*;

    fn settings(words: &[&str]) -> anyhow::Result<Settings> {
        let words = [&["vastex", RENDER_VOLUME, "a.zarr", "--on", "volume"], words].concat();
        match Args::try_parse_from(words).unwrap().command {
            Command::RenderVolume(args) => args.paging.lay_over(Settings::default()),
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn what_images_are_told_of_reading_volumes_are_told_too() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("vastex.toml");
        let text = "[reading]\nreads_at_once = 5\nread_time_out_s = 1.5\n[default_pool]\npin_share = 60\n\
                    allow_size_scale = true\n\
                    [[pool]]\nformats = [\"r8\"]\nsize_mib = 3\nallow_size_scale = true\n";
        std::fs::write(&path, text).unwrap();
        let usual = Settings::default();
        let plain = settings(&[]).unwrap();
        assert_eq!((plain.reads_at_once, plain.share_contents), (usual.reads_at_once, true));
        let file = ["--settings", path.to_str().unwrap()];
        let of_file = settings(&file).unwrap();
        assert_eq!((of_file.reads_at_once, of_file.read_time_out), (5, Duration::from_millis(1500)));
        assert_eq!(of_file.pools.default_pool.pin_share, Some(60));
        assert_eq!(of_file.pools.rules[0].tuning.bytes, None, "--pool-mib says how large pools are");
        let pools = &of_file.pools;
        let scales = |tuning: &PoolTuning| tuning.allow_size_scale;
        assert_eq!((scales(&pools.default_pool), scales(&pools.rules[0].tuning)), (Some(false), None));
        let words = ["--reads-at-once", "20", "--upload-kib-per-frame", "7", "--no-sharing"];
        let all = settings(&[&file[..], &words].concat()).unwrap();
        assert_eq!((all.reads_at_once, all.upload_bytes_per_frame, all.share_contents), (20, 7 << 10, false));
        assert!(settings(&["--settings", "nowhere.toml"]).unwrap_err().to_string().contains("nowhere.toml"));
    }
}
