//! What paths turn into, and what is said of those that turn into nothing.

use clap::Parser as _;

use super::*;
use crate::args::{Args, Command};

#[test]
fn a_generated_planet_is_drawn_in_fixed_point_wherever_it_is_named() {
    let is_fixed = |words: &str| {
        let words = format!("vastex render {words} -o a.png");
        let Command::Render(args) = Args::parse_from(words.split(' ')).command else {
            panic!("{words}: is another command")
        };
        shown(&args.scene).always_fixed
    };
    assert!(is_fixed("planet:12") && is_fixed("planet:12:earth.vastex"));
    assert!(is_fixed("earth.vastex --over planet:12") && is_fixed("a.tif --over b.tif --over planet:9"));
    assert!(is_fixed("planet:12 --over earth.vastex"));
    assert!(!is_fixed("earth.vastex") && !is_fixed("planet.tif --over earth.vastex"));
}

/// Whoever opens what is called a picture hears what is wrong with the picture, and of no container.
#[cfg(feature = "build")]
#[test]
fn nonsense_that_is_called_a_picture_is_refused_as_one() {
    let directory = tempfile::tempdir().unwrap();
    let (text, noise) = (&b"no picture"[..], &b"\x3e\xa7\x67\xa2\xc8\x01\xc8\x1c"[..]);
    for ending in ["jpg", "tif", "png"] {
        // What each begins with, and nothing after it.
        let begun: &[u8] = match ending {
            "jpg" => b"\xff\xd8\xff\xe0",
            "tif" => b"II\x2a\0\x08\0\0\0",
            _ => b"\x89PNG\r\n\x1a\n",
        };
        let cases = [
            (text, "is a text file, not an image"),
            (noise, "is of no known image format"),
            (begun, "truncated"),
        ];
        for (bytes, why) in cases {
            let path = directory.path().join(format!("nonsense.{ending}"));
            std::fs::write(&path, bytes).unwrap();
            for cache in ["off".into(), directory.path().join("cache")] {
                let cache = CacheArgs { cache: Some(cache), cache_gib: 1 };
                let image = OpenImage { cache: &cache, wraps: false, observer: &() };
                let error = open_tiles(&path, false, Some(image)).err().unwrap();
                let said = format!("{error:#}");
                assert!(said.contains(&format!("nonsense.{ending}")) && said.contains(why), "{said}");
                assert!(!said.contains("ontainer"), "{said}");
            }
            // Where nothing may be built, too.
            let said = format!("{:#}", open_tiles(&path, false, None).err().unwrap());
            assert!(said.contains(&format!("nonsense.{ending}")), "{said}");
        }
    }
    // By its name it may be a container that is damaged.
    let path = directory.path().join("nonsense.vastex");
    std::fs::write(&path, noise).unwrap();
    let said = format!("{:#}", open_tiles(&path, false, None).err().unwrap());
    assert!(said.contains("not a Vastex container"), "{said}");
}

/// A grey TIFF file of tiles of 256x256 texels and no coarser levels. All of its tiles are one.
#[cfg(feature = "build")]
pub(super) fn tiled_tiff(columns: u32, rows: u32) -> Vec<u8> {
    let count = columns * rows;
    let lists = 8 + 65_536;
    let mut file = b"II\x2a\0".to_vec();
    file.extend((lists + 8 * count).to_le_bytes());
    file.extend((0..65_536u32).map(|n| (n % 256) as u8));
    [8, 65_536].into_iter().for_each(|word: u32| file.extend(word.to_le_bytes().repeat(count as usize)));
    let entries = [
        (256, 4, 1, columns * 256),
        (257, 4, 1, rows * 256),
        (258, 3, 1, 8),
        (259, 3, 1, 1),
        (262, 3, 1, 1),
        (277, 3, 1, 1),
        (322, 4, 1, 256),
        (323, 4, 1, 256),
        (324, 4, count, lists),
        (325, 4, count, lists + 4 * count),
    ];
    file.extend((entries.len() as u16).to_le_bytes());
    for (tag, kind, count, value) in entries {
        let [tag, kind]: [u16; 2] = [tag, kind];
        file.extend([tag, kind].map(u16::to_le_bytes).concat());
        file.extend([count, value].map(u32::to_le_bytes).concat());
    }
    file.extend([0; 4]);
    file
}

/// Looks on while a file is opened, and breaks that off once there is something to look at.
#[cfg(feature = "build")]
#[derive(Default)]
struct LooksOn {
    /// Width, height and rows of previews, and the size of the image that they are of.
    previews: std::cell::RefCell<Vec<([u32; 3], [u32; 2])>>,
}

#[cfg(feature = "build")]
impl OpenObserver for LooksOn {
    fn wants_preview(&self) -> bool {
        true
    }

    fn preview(&self, picture: &Arc<vastex_build::MemoryImage>, size: [u32; 2]) {
        let [width, height, _] = picture.description().geometry.size();
        self.previews.borrow_mut().push(([width, height, picture.rows()], size));
    }

    fn advance(&self, _: f64) -> std::ops::ControlFlow<()> {
        match self.previews.borrow().is_empty() {
            true => std::ops::ControlFlow::Continue(()),
            false => std::ops::ControlFlow::Break(()),
        }
    }
}

/// Without coarser levels all of a file is read before it is shown where it lies.
#[cfg(feature = "build")]
#[test]
fn tiles_without_levels_are_seen_at_once_and_can_be_broken_off() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("tiles.tif");
    let caches = [directory.path().join("cache"), "off".into()];
    let open = |cache: &PathBuf, observer: &dyn OpenObserver| {
        let cache = CacheArgs { cache: Some(cache.clone()), cache_gib: 1 };
        let image = OpenImage { cache: &cache, wraps: false, observer };
        open_tiles(&path, false, Some(image))
    };
    // A little more than most screens have pixels, and as many as they have.
    std::fs::write(&path, tiled_tiff(13, 10)).unwrap();
    for cache in &caches {
        let looks_on = LooksOn::default();
        assert!(open(cache, &looks_on).is_err(), "it is broken off");
        let [(picture, size)] = looks_on.previews.take()[..] else { panic!("there is one preview") };
        assert_eq!((picture[0], size), (1110, [3328, 2560]));
        assert!(picture[2] > 0);
    }
    std::fs::write(&path, tiled_tiff(8, 16)).unwrap();
    let looks_on = LooksOn::default();
    let tiles = open(&caches[0], &looks_on).unwrap();
    assert_eq!(tiles.description().geometry.size(), [2048, 4096, 1]);
    assert!(looks_on.previews.take().is_empty());
    // Where nothing can be kept it is shown where it lies.
    std::fs::write(&path, tiled_tiff(13, 10)).unwrap();
    let nowhere = path.join("cache");
    let hears = Hears::default();
    assert_eq!(open(&nowhere, &hears).unwrap().description().geometry.size(), [3328, 2560, 1]);
    let said = hears.notes.take();
    let of_cache = said.iter().filter(|note| note.contains("cannot hold built images"));
    assert_eq!(of_cache.count(), 1, "{said:?}");
    // One that lies over another file, too, which was looked at.
    let other = Looked::at(&directory.path().join("other.tif"));
    assert!(is_better_built(&path, &Looked::at(&path)) && is_better_built(&path, &other));
}

/// What hinders a build of an image that can be read where it lies, and what is wrong with the image itself.
#[cfg(feature = "build")]
#[test]
fn only_faults_of_an_image_keep_it_from_being_read_where_it_lies() {
    use vastex_build::{BuildError, CacheError, InputFault, WriteError};

    fn path() -> PathBuf {
        PathBuf::from("a.tif")
    }
    let input: fn() -> BuildError =
        || BuildError::Input { path: path(), fault: InputFault::Truncated { place: "here".into() } };
    let memory = || BuildError::Memory { path: path(), needed: 2, limit: 1, remedy: "split it" };
    let full = || std::io::Error::from(std::io::ErrorKind::StorageFull);
    let output = || BuildError::Output(WriteError::Io { name: "a".into(), error: full() });
    let cancelled: fn() -> BuildError = || BuildError::Cancelled;
    for of_image in [input, cancelled] {
        assert!(is_of_image(&of_image().into()) && is_of_image(&CacheError::from(of_image()).into()));
    }
    assert!(is_of_image(&CacheError::Changed(path()).into()));
    for (n, of_place) in [memory(), output()].into_iter().enumerate() {
        assert!(!is_of_image(&of_place.into()), "{n}");
    }
    assert!(!is_of_image(&CacheError::from(memory()).into()));
    assert!(!is_of_image(&CacheError::Unusable { directory: path(), error: full() }.into()));
}

/// Keeps what it is told.
#[cfg(feature = "build")]
#[derive(Default)]
struct Hears {
    notes: std::cell::RefCell<Vec<String>>,
}

#[cfg(feature = "build")]
impl OpenObserver for Hears {
    fn note(&self, note: &str) {
        self.notes.borrow_mut().push(note.to_owned());
    }
}

/// The window goes by the file that it displays, not by the one that the command line names first.
#[cfg(feature = "view")]
#[test]
fn a_file_that_comes_later_may_be_a_generated_planet() {
    let is_generated = |path: &str| file_about(Path::new(path), &Looked::default(), Vec::new()).is_generated;
    assert!(is_generated("planet:12") && is_generated("planet:31:earth.vastex"));
    assert!(!is_generated("earth.vastex") && !is_generated("./planet:12"));
}

/// The scale bar and coordinates of a container are those of the file that it was built of.
#[cfg(all(feature = "view", feature = "build"))]
#[test]
fn of_a_container_it_is_known_where_texels_lie() {
    let directory = tempfile::tempdir().unwrap();
    let assets = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/tiff");
    let of = |path: &Path| file_about(path, &Looked::at(path), Vec::new());
    for name in ["cog-deflate-u16.tif", "slide-jpeg.svs"] {
        let (file, built) = (assets.join(name), directory.path().join("built.vastex"));
        let inputs = [vastex_build::LayerInput::from(&*file)];
        vastex_build::build(&inputs, &built, &vastex_build::BuildOptions::default(), &()).unwrap();
        let (said, kept) = (of(&file), of(&built));
        assert!(said.texel_size.is_some() && kept.texel_size == said.texel_size, "{name}");
        assert_eq!(kept.map.map(|map| map.system().to_owned()), said.map.map(|map| map.system().to_owned()));
    }
}
