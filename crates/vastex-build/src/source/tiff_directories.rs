//! The directories of a TIFF file, read once for all that is asked of it: its tiles, its other images, and
//! what it says of itself.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use vastex_tiles::SourceKey;

use super::SourceError;
use super::identity::identity_of_file;
use super::pages::{Shape, unwatched};
use super::pyramid::{TiffFacts, TiffSource};
use crate::image::tiff::file::TiffImage;
use crate::image::tiff::file::pyramid::{
    TiffOther, TiffPyramid, bands_in_name, image_in_file, without_first,
};
use crate::image::{InputFault, TiffAbout};

/// Texels of an image without coarser levels that are read at opening without making a person wait.
const MOST_READ_AT_ONCE: u64 = 1 << 23;

/// A TIFF file whose directories were read. Whoever asks several things of a file asks this instead of the
/// file; its tiles are opened once, however often they are asked for.
pub struct TiffDirectories {
    path: PathBuf,
    identity: Option<SourceKey>,
    /// All images of the file.
    all: TiffPyramid,
    /// What the path names in the file, if it names anything.
    name: Option<String>,
    opened: Mutex<Option<Arc<TiffSource>>>,
}

impl TiffDirectories {
    /// Reads the directories of a file, or of that in which a path means another image or bands
    /// ([`image_in_file`]), but neither texels nor lists of tiles. Fails where a file is no TIFF
    /// ([`InputFault::NoTiles`]) or cannot be read as one.
    pub fn read(path: &Path) -> Result<TiffDirectories, SourceError> {
        let at_path = |fault| SourceError::Input { path: path.into(), fault };
        // Of the file that is opened, whatever takes its place later.
        let identity = identity_of_file(path).ok();
        let named = without_first(path);
        let (file, name) = image_in_file(named).map_or((named, None), |(file, name)| (file, Some(name)));
        let all = TiffPyramid::open_file(file).and_then(|found| found.ok_or(InputFault::NoTiles));
        let (path, name, opened) = (path.to_owned(), name.map(str::to_owned), Mutex::default());
        Ok(TiffDirectories { all: all.map_err(at_path)?, path, identity, name, opened })
    }

    /// The path that they were read by.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The images of the file that are no levels of its first one.
    pub fn others(&self) -> &[TiffOther] {
        &self.all.others
    }

    /// What the file says of its first image besides the values of texels.
    pub fn about(&self) -> &TiffAbout {
        &self.all.about
    }

    /// How many bands the first image has, where they are more than a picture shows and so some may be
    /// chosen, as in `landsat.tif:bands=5,4,3`.
    pub fn bands_to_choose(&self) -> Option<u16> {
        self.all.first().and_then(TiffImage::bands_to_choose)
    }

    /// Returns true if the path means a first image of tiles, or bands of it, that has no coarser levels and
    /// more texels than most screens have pixels: [`TiffDirectories::open`] reads all of it, and a build
    /// takes about as long, but can be watched and broken off, and is needed once.
    pub fn lacks_levels(&self) -> bool {
        let is_first = self.name.as_ref().is_none_or(|name| bands_in_name(name).is_some());
        let texels = |image: &TiffImage| image.size.map(u64::from).iter().product::<u64>();
        let is_large = |image: &TiffImage| texels(image) > MOST_READ_AT_ONCE;
        let is_alone = self.all.levels.len() == 1;
        is_first && is_alone && self.is_tiled() && self.all.first().is_some_and(is_large)
    }

    /// Returns true if the first image of the file is stored in tiles, and not in strips.
    pub fn is_tiled(&self) -> bool {
        self.all.first().is_some_and(|image| image.is_tiled)
    }

    /// The tiles of what the path means, as [`TiffSource::open`] opens them: the same source at every call.
    pub fn open(&self) -> Result<Arc<TiffSource>, SourceError> {
        self.open_while(&unwatched)
    }

    /// Opens the tiles as [`TiffDirectories::open`] does as long as `watch`, which hears how much of what is
    /// read for it is there, 0 to 1, does not break it off ([`SourceError::BrokenOff`]). Of an image without
    /// coarser levels all of it is read.
    pub fn open_while(&self, watch: &dyn Fn(f64) -> ControlFlow<()>) -> Result<Arc<TiffSource>, SourceError> {
        let mut opened = self.opened.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(opened) = &*opened {
            return Ok(opened.clone());
        }
        let source = TiffSource::of(self.meant()?, (&self.path, self.identity), (&Shape::default(), watch))?;
        Ok(opened.insert(Arc::new(source)).clone())
    }

    /// What the path means has to show, however long it would take to open its tiles: of an image without
    /// coarser levels, too, of which all are read for that, or which is too large for it.
    pub fn facts(&self) -> Result<TiffFacts, SourceError> {
        let (_, _, facts) = TiffFacts::of(self.meant()?, &self.path, &Shape::default())?;
        Ok(facts)
    }

    /// The image that the path means, with its levels.
    fn meant(&self) -> Result<TiffPyramid, SourceError> {
        let Some(name) = &self.name else { return Ok(self.all.clone()) };
        let meant = self.all.clone().named(name);
        meant.map_err(|fault| SourceError::Input { path: self.path.clone(), fault })
    }
}

#[cfg(test)]
mod tests {
    use vastex_tiles::TileSource as _;

    use super::*;

    #[test]
    fn directories_are_read_once() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/tiff/slide-jpeg.svs");
        let read = TiffDirectories::read(&path).unwrap();
        let reads = |read: &TiffDirectories| read.all.first().unwrap().file().reads().reads;
        let before = reads(&read);
        assert_eq!(read.others().len(), 3);
        assert_eq!((read.about().magnification, read.bands_to_choose()), (Some(20.0), None));
        let facts = read.facts().unwrap();
        assert_eq!((facts.levels().len(), facts.others().len()), (3, 3));
        assert_eq!(reads(&read), before, "what is known is not read again, and no texel is");
        let source = read.open().unwrap();
        let opened = reads(&read);
        // The coarsest level, of 12x8 texels: the places and the bytes of its one tile.
        assert!(opened - before <= 3, "{}", opened - before);
        assert!(Arc::ptr_eq(&source, &read.open().unwrap()));
        assert_eq!(reads(&read), opened);
        assert_eq!((source.levels(), source.description()), (facts.levels(), facts.description()));
        assert_eq!(source.others(), read.others());
        let label = PathBuf::from(format!("{}:label", path.display()));
        let label = TiffDirectories::read(&label).unwrap();
        assert_eq!(label.others().len(), 3, "of the file");
        assert!(label.open().unwrap().others().is_empty());
        assert!(TiffDirectories::read(Path::new("gone.tif")).is_err());
    }
}
