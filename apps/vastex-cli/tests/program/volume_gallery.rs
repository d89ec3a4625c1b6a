//! The pictures of volumes that the README shows are what `vastex render` draws of the volumes in `assets`.
//!
//! `VASTEX_ACCEPT=1 cargo test -p vastex-cli volume_gallery` replaces them by what is drawn now.

use std::path::{Path, PathBuf};

use crate::tool::Sandbox;

/// Names, volumes, and views, as the window copies them.
const PICTURES: [(&str, &str, &str); 2] = [
    (
        "brain",
        "head.zip",
        "volume:x=49,y=56,z=47,zoom=1.75,yaw=148,pitch=-52;mode=iso;iso=120;channel=2:color=a8d0ff",
    ),
    (
        "nuclei",
        "nuclei.zip",
        "volume:x=64,y=64,z=26,zoom=1.35,yaw=30,pitch=-35;mode=emission;\
         channel=0:color=80c0ff:range=8000..40000:opacity=0.15;labels=nuclei",
    ),
];
/// Drivers differ in how they round; below this it is another picture.
const LEAST_PSNR_DB: f64 = 38.0;

fn repository(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").join(path)
}

#[test]
fn the_readme_shows_volumes_as_they_are_drawn() {
    let sandbox = Sandbox::new();
    for (name, volume, view) in PICTURES {
        let (volume, drawn) = (repository(&format!("assets/volumes/{volume}")), format!("{name}.png"));
        let volume = volume.to_string_lossy();
        let render = ["render", "--view", view, "--size", "448x252", &volume, "-o", &drawn];
        sandbox.run(&render).expect_code(0);
        let golden = repository(&format!("docs/images/{name}.png"));
        if std::env::var_os("VASTEX_ACCEPT").is_some() {
            std::fs::copy(sandbox.path(&drawn), &golden).unwrap();
        }
        let kept = format!("kept-{drawn}");
        std::fs::copy(&golden, sandbox.path(&kept)).unwrap();
        let (drawn, kept) = (sandbox.read_rgb(&drawn), sandbox.read_rgb(&kept));
        assert_eq!(drawn.len(), kept.len());
        let errors = drawn.iter().flatten().zip(kept.iter().flatten()).map(|(a, b)| {
            let error = f64::from(*a) - f64::from(*b);
            error * error
        });
        let mean = errors.sum::<f64>() / (3 * drawn.len()) as f64;
        let psnr = 10.0 * (255.0 * 255.0 / mean.max(1e-9)).log10();
        assert!(psnr >= LEAST_PSNR_DB, "{} is not what is drawn: {psnr:.1} dB", golden.display());
        assert!(drawn.iter().filter(|pixel| pixel[2] > 60).count() > 10_000, "{name}: something is seen");
    }
}
