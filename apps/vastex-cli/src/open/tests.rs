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
    let mut data: Vec<u8> = (0..65_536u32).map(|n| (n % 256) as u8).collect();
    [8, 65_536].into_iter().for_each(|word: u32| data.extend(word.to_le_bytes().repeat(count as usize)));
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
    tiff_of(&data, &entries)
}

/// A TIFF file of one tile of 16x16 texels, of three floats of 32 bits each.
#[cfg(feature = "build")]
fn tiff_of_floats(value: f32) -> Vec<u8> {
    let tile = value.to_le_bytes().repeat(16 * 16 * 3);
    let (bytes, words) = (tile.len() as u32, 8 + tile.len() as u32);
    let data = [tile, 32u16.to_le_bytes().repeat(3), 3u16.to_le_bytes().repeat(3)].concat();
    let entries = [
        (256, 4, 1, 16),
        (257, 4, 1, 16),
        (258, 3, 3, words),
        (259, 3, 1, 1),
        (262, 3, 1, 2),
        (277, 3, 1, 3),
        (322, 4, 1, 16),
        (323, 4, 1, 16),
        (324, 4, 1, 8),
        (325, 4, 1, bytes),
        (339, 3, 3, words + 6),
    ];
    tiff_of(&data, &entries)
}

/// A TIFF file of one tile of 16x16 texels, of five bands, with metadata as GDAL writes them.
#[cfg(all(feature = "view", feature = "build"))]
fn tiff_of_bands() -> Vec<u8> {
    let metadata = b"<GDALMetadata><Item name=\"converted\">from film</Item></GDALMetadata>\0";
    let tile = vec![7; 16 * 16 * 5];
    let (bytes, words) = (tile.len() as u32, 8 + tile.len() as u32);
    let data = [tile, 8u16.to_le_bytes().repeat(5), vec![0; 8], metadata.to_vec()].concat();
    let entries = [
        (256, 4, 1, 16),
        (257, 4, 1, 16),
        (258, 3, 5, words),
        (259, 3, 1, 1),
        (262, 3, 1, 1),
        (277, 3, 1, 5),
        (322, 4, 1, 16),
        (323, 4, 1, 16),
        (324, 4, 1, 8),
        (325, 4, 1, bytes),
        (338, 3, 4, words + 10),
        (42112, 2, metadata.len() as u32, words + 18),
    ];
    tiff_of(&data, &entries)
}

/// What a file says in words is not what its values were converted from.
#[cfg(all(feature = "view", feature = "build"))]
#[test]
fn a_word_of_a_file_is_no_conversion() {
    use crate::commands::info::said_of;

    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("a.tif");
    let about = |file: &[u8]| {
        std::fs::write(&path, file).unwrap();
        let looked = Looked::at(&path);
        file_about(&path, &looked, said_of(&path, &looked).unwrap())
    };
    let from_film = about(&tiff_of_bands());
    assert!(from_film.rows.iter().any(|row| *row == ("converted".to_owned(), "from film".to_owned())));
    assert_eq!(from_film.converted, "");
    let mut inverted = tiled_tiff(1, 1);
    let photometric = inverted.windows(4).rposition(|bytes| bytes == [6, 1, 3, 0]).unwrap();
    inverted[photometric + 8] = 0;
    assert_eq!(about(&inverted).converted, "from grey of which 0 is white");
}

/// The first image of a file is the same by any of its names: others of its bands can be chosen.
#[cfg(all(feature = "view", feature = "build"))]
#[test]
fn bands_of_the_first_image_are_chosen_by_any_of_its_names() {
    use crate::args::{Args, Command};
    use clap::Parser as _;

    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("a.tif");
    std::fs::write(&path, tiff_of_bands()).unwrap();
    let named = |name: &str| PathBuf::from(format!("{}:{name}", path.display()));
    let bands = |path: &Path| {
        let bands = file_about(path, &Looked::at(path), Default::default()).bands;
        bands.map(|bands| (PathBuf::from(bands.file), bands.names.len(), bands.shown))
    };
    for (name, shown) in [(None, [1, 2, 3]), (Some("first"), [1, 2, 3]), (Some("bands=5,4,1"), [5, 4, 1])] {
        let named = name.map_or(path.clone(), named);
        assert_eq!(bands(&named), Some((path.clone(), 5, shown.to_vec())), "{name:?}");
        let words = ["vastex", "render", named.to_str().unwrap(), "--layer", ":bands=4,2,1", "-o", "a.png"];
        let Command::Render(mut args) = Args::parse_from(words).command else { panic!("no render") };
        let picked = pick_bands(&mut args.scene).map(|()| args.scene.source);
        match name {
            // Of those that are chosen the fourth is none.
            Some("bands=5,4,1") => assert_eq!(picked.unwrap(), named),
            _ => assert_eq!(picked.unwrap(), path.with_file_name("a.tif:bands=4,2,1")),
        }
    }
}

/// A TIFF file of some data and, after that, its one directory: tags, kinds, counts and values.
#[cfg(feature = "build")]
fn tiff_of(data: &[u8], entries: &[(u16, u16, u32, u32)]) -> Vec<u8> {
    let mut file = [b"II\x2a\0".as_slice(), &(8 + data.len() as u32).to_le_bytes(), data].concat();
    file.extend((entries.len() as u16).to_le_bytes());
    for (tag, kind, count, value) in entries {
        file.extend([tag, kind].map(|word| word.to_le_bytes()).concat());
        file.extend([count, value].map(|word| word.to_le_bytes()).concat());
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
    // Where it is too large for that, it is decoded into memory.
    let large = directory.path().join("large.tif");
    std::fs::write(&large, tiled_tiff(64, 17)).unwrap();
    let cache = CacheArgs { cache: Some(nowhere.clone()), cache_gib: 1 };
    let image = OpenImage { cache: &cache, wraps: false, observer: &hears };
    let decoded = open_tiles(&large, false, Some(image)).unwrap();
    assert_eq!(decoded.description().geometry.size(), [16384, 4352, 1]);
    let said = hears.notes.take();
    // Nobody is told to do without a cache, which is done.
    let is_said = |note: &String| note.contains("cannot hold built images") && !note.contains("--cache off");
    assert_eq!(said.iter().filter(|note| is_said(note)).count(), 1, "{said:?}");
    // One that lies over another file, too, which was looked at.
    let other = Looked::at(&directory.path().join("other.tif"));
    assert!(is_better_built(&path, &Looked::at(&path)) && is_better_built(&path, &other));
}

/// Is told of two steps, and breaks off what is opened at the second.
#[cfg(feature = "build")]
#[derive(Default)]
struct BreaksOff(std::cell::RefCell<Vec<f64>>);

#[cfg(feature = "build")]
impl OpenObserver for BreaksOff {
    fn advance(&self, share: f64) -> std::ops::ControlFlow<()> {
        self.0.borrow_mut().push(share);
        match self.0.borrow().len() {
            1 => std::ops::ControlFlow::Continue(()),
            _ => std::ops::ControlFlow::Break(()),
        }
    }
}

/// Levels are made at opening of all that a small image has.
#[cfg(feature = "build")]
#[test]
fn tiles_that_are_read_where_they_lie_can_be_broken_off() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("tiles.tif");
    std::fs::write(&path, tiled_tiff(2, 4)).unwrap();
    let cache = CacheArgs { cache: Some("off".into()), cache_gib: 1 };
    let breaks_off = BreaksOff::default();
    let image = OpenImage { cache: &cache, wraps: false, observer: &breaks_off };
    let said = format!("{:#}", open_tiles(&path, false, Some(image)).err().unwrap());
    assert!(said.contains("tiles.tif: opening it was broken off"), "{said}");
    let heard = breaks_off.0.take();
    assert!(heard.len() == 2 && heard[0] == 0.0 && (0.1..0.5).contains(&heard[1]), "{heard:?}");
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

/// What floats of 16 bits cannot hold is said as a build says it.
#[cfg(feature = "build")]
#[test]
fn what_is_lost_of_numbers_is_said_where_they_are_read_in_place() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("floats.tif");
    let cache = CacheArgs { cache: Some("off".into()), cache_gib: 1 };
    for (value, said) in [(0.1, Some("numbers are rounded")), (1e6, Some("became infinite")), (0.5, None)] {
        std::fs::write(&path, tiff_of_floats(value)).unwrap();
        let hears = Hears::default();
        open_tiles(&path, false, Some(OpenImage { cache: &cache, wraps: false, observer: &hears })).unwrap();
        let later = hears.later.lock().unwrap();
        assert_eq!(later.len(), usize::from(said.is_some()), "{value}: {later:?}");
        assert!(said.is_none_or(|said| later[0].contains("floats.tif: ") && later[0].contains(said)));
    }
}

/// Keeps what it is told.
#[cfg(feature = "build")]
#[derive(Default)]
struct Hears {
    notes: std::cell::RefCell<Vec<String>>,
    later: Arc<std::sync::Mutex<Vec<String>>>,
}

#[cfg(feature = "build")]
impl OpenObserver for Hears {
    fn note(&self, note: &str) {
        self.notes.borrow_mut().push(note.to_owned());
    }

    fn later_notes(&self) -> Option<observer::NoteObserver> {
        let later = self.later.clone();
        Some(Arc::new(move |note| later.lock().unwrap().push(note.to_owned())))
    }
}

/// The window goes by the file that it displays, not by the one that the command line names first.
#[cfg(feature = "view")]
#[test]
fn a_file_that_comes_later_may_be_a_generated_planet() {
    let is_generated =
        |path: &str| file_about(Path::new(path), &Looked::default(), Default::default()).is_generated;
    assert!(is_generated("planet:12") && is_generated("planet:31:earth.vastex"));
    assert!(!is_generated("earth.vastex") && !is_generated("./planet:12"));
}

/// The scale bar and coordinates of a container are those of the file that it was built of.
#[cfg(all(feature = "view", feature = "build"))]
#[test]
fn of_a_container_it_is_known_where_texels_lie() {
    let directory = tempfile::tempdir().unwrap();
    let assets = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/tiff");
    let of = |path: &Path| file_about(path, &Looked::at(path), Default::default());
    for name in ["cog-deflate-u16.tif", "slide-jpeg.svs"] {
        let (file, built) = (assets.join(name), directory.path().join("built.vastex"));
        let inputs = [vastex_build::LayerInput::from(&*file)];
        vastex_build::build(&inputs, &built, &vastex_build::BuildOptions::default(), &()).unwrap();
        let (said, kept) = (of(&file), of(&built));
        assert!(said.texel_size.is_some() && kept.texel_size == said.texel_size, "{name}");
        assert_eq!(kept.map.map(|map| map.system().to_owned()), said.map.map(|map| map.system().to_owned()));
    }
}
