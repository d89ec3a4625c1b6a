//! Settings of pools, from text: what they give, and what is said where they are wrong.

use std::time::Duration;

use crate::common::{Mapping, Screen, property, settings};
use vastex::diagnostics::{Integrator, PoolEstimate};
use vastex::{
    AddressMode, BiasRule, Event, LayerFormat, Platform, PoolRule, PoolSettings, PoolTuning, ScaleGroups,
    Settings, Textures, ViewId,
};
use vastex_wgpu::test_device::TestDevice;

const SIZE: [u32; 2] = [1000, 777];

const FIRST: &str = r#"
[default_pool]
size_mib = 3
residency_mip_bias = true

[scale_groups]
1 = 0.5

[[pool]]
formats = ["rgba8"]
tile_max = 64
size_mib = 2
allow_size_scale = true
scale_group = 1

[[pool]]
tile_min = 100
size_mib = 0.5

[platform.windows]
default_pool = { size_mib = 9 }
[[platform.windows.pool]]
tile_min = 100
residency_mip_bias = false
"#;

fn parsed(texts: &[&str], platform: Option<Platform>) -> PoolSettings {
    let mut settings = Settings::default();
    texts.iter().for_each(|text| settings.read_toml("vastex.toml", text, platform).unwrap());
    settings.pools
}

/// Bytes of the pool that a texture of these pages gets.
fn bytes_of(pools: &PoolSettings, page: u32) -> u64 {
    let gpu = TestDevice::new();
    let settings = Settings { pools: pools.clone(), ..settings() };
    let mut textures = Textures::new(&gpu.device, &gpu.queue, settings).unwrap();
    textures.add_blocking(property(SIZE, page, AddressMode::Clamp)).unwrap();
    textures.stats().pool_bytes
}

/// At most as many bytes, and no slot fewer than a tenth below.
fn check_size(pools: &PoolSettings, page: u32, expected: u64) {
    let bytes = bytes_of(pools, page);
    assert!(bytes <= expected && bytes * 10 >= expected * 9, "{bytes} of {expected} bytes, pages of {page}");
}

#[test]
fn text_and_code_say_the_same() {
    let in_code = PoolSettings {
        default_pool: PoolTuning {
            bytes: Some(3 << 20),
            residency_mip_bias: Some(true),
            ..PoolTuning::default()
        },
        rules: vec![
            PoolRule {
                formats: Some(vec![LayerFormat::Rgba8]),
                tile_max: Some(64),
                tuning: PoolTuning {
                    bytes: Some(2 << 20),
                    allow_size_scale: Some(true),
                    scale_group: Some(1),
                    residency_mip_bias: None,
                    mip_bias_rule: None,
                    pin_share: None,
                },
                ..PoolRule::default()
            },
            PoolRule {
                tile_min: Some(100),
                tuning: PoolTuning { bytes: Some(1 << 19), ..PoolTuning::default() },
                ..PoolRule::default()
            },
        ],
        scale_groups: ScaleGroups([1.0, 0.5, 1.0]),
    };
    assert_eq!(parsed(&[FIRST], Some(Platform::Linux)), in_code);
    assert_eq!(parsed(&[""], None), PoolSettings::default());
}

#[test]
fn a_file_says_how_tiles_are_read() {
    let text = "[reading]\nreads_at_once = 3\nread_time_out_s = 2.5\n[default_pool]\nsize_mib = 3\n\
                [platform.web.reading]\ndecode_time_per_frame_ms = 0.5\nreads_at_once = 6\nloader_threads = 9\n";
    let read = |platform| {
        let mut settings = Settings { loader_threads: 4, ..Settings::default() };
        settings.read_toml("vastex.toml", text, platform).unwrap();
        assert_eq!(settings.pools.default_pool.bytes, Some(3 << 20));
        let Settings { loader_threads, reads_at_once, read_time_out, decode_time_per_frame, .. } = settings;
        (loader_threads, reads_at_once, read_time_out, decode_time_per_frame)
    };
    let usual = Settings::default();
    let time_out = Duration::from_millis(2500);
    assert_eq!(read(Some(Platform::Linux)), (4, 3, time_out, usual.decode_time_per_frame));
    assert_eq!(read(Some(Platform::Web)), (9, 6, time_out, Duration::from_micros(500)));
    assert_eq!(parsed(&[text], None).default_pool.bytes, Some(3 << 20), "pools alone leave the rest out");
    for (line, words) in [
        ("reads_at_once = 0", "give it 1 to 4096"),
        ("loader_threads = 0", "it is 0; give it 1 to 4096"),
        ("loader_threads = -1", "give it 1 to 4096"),
        ("read_time_out_s = 0", "give it 0.001 to 86400"),
        ("decode_time_per_frame_ms = nan", "give it 0 to 1000"),
        ("read_time_out = 3", "read_time_out_s"),
    ] {
        let mut settings = Settings::default();
        let error = settings.read_toml("vastex.toml", &format!("[reading]\n{line}\n"), None).unwrap_err();
        let error = error.to_string();
        assert!(error.starts_with("vastex.toml:2: ") && error.contains(words), "{error}");
        assert_eq!(settings, Settings::default());
    }
}

#[test]
fn a_pool_gets_what_suits_its_tiles_and_no_byte_more() {
    let pools = parsed(&[FIRST], None);
    check_size(&pools, 32, 1 << 20); // 2 MiB, halved by its scale group
    check_size(&pools, 80, 3 << 20); // tiles of 88 texels: neither rule
    check_size(&pools, 100, 1 << 19);
}

#[test]
fn a_platform_and_a_later_file_have_the_last_word_on_what_they_name() {
    let on_windows = parsed(&[FIRST], Some(Platform::Windows));
    check_size(&on_windows, 80, 9 << 20);
    check_size(&on_windows, 100, 1 << 19);
    let second = "scale_groups = { 1 = 2 }\n[[pool]]\ntile_min = 100\nsize_mib = 1.5";
    let both = parsed(&[FIRST, second], None);
    check_size(&both, 32, 4 << 20);
    check_size(&both, 100, 3 << 19);
    let mut command_line = both;
    command_line.set_bytes(700_000);
    [32, 80, 100].into_iter().for_each(|page| check_size(&command_line, page, 700_000));
}

#[test]
fn a_pool_without_a_size_is_made_for_the_picture() {
    let source = property(SIZE, 32, AddressMode::Clamp);
    for picture in [[160, 120], [640, 480]] {
        let estimate = PoolEstimate::new(source.description(), picture);
        let gpu = TestDevice::new();
        let settings = Settings { picture, ..settings() };
        let mut textures = Textures::new(&gpu.device, &gpu.queue, settings).unwrap();
        textures.add_blocking(source.clone()).unwrap();
        let bytes = textures.stats().pool_bytes;
        assert!(bytes <= estimate.bytes() && bytes * 10 >= estimate.bytes() * 9, "{bytes} of {estimate}");
    }
}

#[test]
fn a_pool_made_for_the_picture_needs_no_bias() {
    for page in [32, 48] {
        let source = property([4000, 3000], page, AddressMode::Wrap);
        let mut screen = Screen::new(&[source], Settings { picture: crate::common::PICTURE, ..settings() });
        // The most that one picture shows: just under two texels of the wanted level on a pixel, turned.
        for angle in [0.0, 0.4, 0.8] {
            screen.set_mapping(0, &Mapping::new([4000, 3000], [0.4, 0.4], 1.96, 1.0, angle));
            screen.textures.view_mut(ViewId::MAIN).unwrap().cut();
            screen.converge();
            let stats = screen.textures.stats().pager;
            assert!(
                stats.bias_eighths == 0 && 2 * stats.wanted > stats.slots,
                "neither too little nor far too much: {stats:?}"
            );
        }
    }
}

#[test]
fn without_the_bias_what_came_first_stays() {
    let pools = parsed(&["[default_pool]\nsize_mib = 0.05\nresidency_mip_bias = false"], None);
    let mut screen = Screen::new(&[property(SIZE, 32, AddressMode::Clamp)], Settings { pools, ..settings() });
    screen.set_mapping(0, &Mapping::new(SIZE, [0.5, 0.5], 1.1, 1.0, 0.2));
    for _ in 0..80 {
        let events = screen.frame().unwrap();
        assert!(!events.iter().any(|event| matches!(event, Event::Oversubscribed { .. })));
    }
    let stats = screen.textures.stats().pager;
    assert_eq!((stats.bias_eighths, stats.reloaded, stats.in_flight), (0, 0, 0), "{stats:?}");
    assert!(stats.missing > 0 && stats.occupied == stats.slots, "{stats:?}");
}

#[test]
fn the_bias_may_be_hunted_for_comparison() {
    let text = "[default_pool]\nsize_mib = 0.05\nmip_bias_rule = \"integrating\"\n";
    let pools = parsed(&[text], None);
    let hunted = BiasRule::Integrating(Integrator::default());
    assert_eq!(pools.default_pool.mip_bias_rule, Some(hunted));
    let mut screen = Screen::new(&[property(SIZE, 32, AddressMode::Clamp)], Settings { pools, ..settings() });
    screen.set_mapping(0, &Mapping::new(SIZE, [0.5, 0.5], 1.1, 1.0, 0.2));
    let mut biases = Vec::new();
    for _ in 0..60 {
        screen.frame().unwrap();
        biases.push(screen.textures.stats().pager.bias_eighths);
    }
    assert!(biases.is_sorted() && biases.windows(2).all(|pair| pair[1] - pair[0] <= 1), "{biases:?}");
    assert!((3..=5).contains(biases.last().unwrap()), "an eighth in about 12 frames: {biases:?}");
    let last_word = parsed(&[text, "[[pool]]\nmip_bias_rule = \"solved\""], None);
    assert_eq!(last_word.rules[0].tuning.mip_bias_rule, Some(BiasRule::Solved));
}

#[test]
fn what_is_wrong_is_said_with_its_line_and_a_remedy() {
    let cases = [
        ("\n[[pool]]\nsize_mb = 3", 3, "size_mib"),
        ("[pol]\n", 1, "default_pool"),
        ("[platform.amiga]\n", 1, "linux"),
        ("[default_pool]\nformats = [\"r8\"]", 2, "size_mib"),
        ("[default_pool]\nsize_mib = 0", 2, "more than 0"),
        ("[default_pool]\nsize_mib = -1", 2, "more than 0"),
        ("[default_pool]\nsize_mib = nan", 2, "more than 0"),
        ("[default_pool]\nsize_mib = 1e300", 2, "at most"),
        ("[default_pool]\nsize_mib = \"big\"", 2, "f64"),
        ("[[pool]]\n\nformats = [\"rgba9\"]", 3, "rgba8-srgb"),
        ("[[pool]]\nformats = []", 2, "leave formats out"),
        ("[default_pool]\nmip_bias_rule = \"hunted\"", 2, "`integrating`"),
        ("[[pool]]\nscale_group = 3", 2, "0, 1 and 2"),
        ("[default_pool]\npin_share = 81", 2, "0 to 80"),
        ("[[pool]]\npin_share = -1", 2, "0 to 80"),
        ("[scale_groups]\n0 = 1\n3 = 1", 3, "`2`"),
        ("[scale_groups]\n0 = 0", 2, "more than 0"),
        ("[[pool]]\ntile_min = 9\ntile_max = 8", 3, "make it larger"),
        ("[[platform.web.pool]]\ntile_min = 9\ntile_max = 8", 3, "make it larger"),
        ("[[pool]]\ntile_min = -9", 2, "u32"),
        ("[[pool]\n", 1, "]"),
        ("a\nb = ", 1, "="),
    ];
    for (text, line, remedy) in cases {
        let mut settings = Settings::default();
        let error = settings.read_toml("my.toml", text, None).unwrap_err().to_string();
        assert!(error.starts_with(&format!("my.toml:{line}: ")), "{text:?}: {error}");
        assert!(error.contains(remedy) && !error.contains('\n'), "{text:?}: {error}");
        assert_eq!(settings.pools, PoolSettings::default());
    }
}

#[test]
fn a_file_that_cannot_be_read_is_named() {
    let directory = std::env::temp_dir();
    for path in [directory.join("there is no such vastex.toml"), directory] {
        let error = Settings::default().read(&path).unwrap_err().to_string();
        assert!(error.starts_with(&path.display().to_string()), "{error}");
    }
}
