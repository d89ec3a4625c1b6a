//! Where pictures of `render` go: the last one into a PNG file, or all of a path into numbered files or,
//! pixel by pixel, into a pipe.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use vastex_scenes::Picture;

use crate::args::{PictureFormat, RenderArgs};
use crate::output::{Output, PngRows};

/// The most digits of a number in a file's name.
const MOST_DIGITS: usize = 9;

/// What becomes of pictures.
pub(crate) enum PictureOutput {
    Nothing,
    /// The last one, as PNG.
    Last(Output),
    /// Each one, as PNG.
    Numbered(NumberedName),
    /// Each one, pixel by pixel.
    Raw(RawFrames),
}

impl PictureOutput {
    /// Finds out whether the files can be written.
    pub(crate) fn new(args: &RenderArgs) -> Result<PictureOutput> {
        PictureOutput::at(args.output.as_deref(), args.format)
    }

    /// The same for pictures of a format that are written there, if anywhere.
    pub(crate) fn at(output: Option<&Path>, format: PictureFormat) -> Result<PictureOutput> {
        let Some(path) = output else { return Ok(PictureOutput::Nothing) };
        if format == PictureFormat::Raw {
            return Ok(PictureOutput::Raw(RawFrames::new(path)?));
        }
        match NumberedName::of(path)? {
            Some(name) => {
                Output::at(&name.path(0))?;
                Ok(PictureOutput::Numbered(name))
            }
            None => Ok(PictureOutput::Last(Output::at(path)?)),
        }
    }

    /// Returns true if every picture of a path is wanted.
    pub(crate) fn is_sequence(&self) -> bool {
        matches!(self, PictureOutput::Numbered(_) | PictureOutput::Raw(_))
    }

    /// Writes a picture of a path, counted from 0. Breaks where nobody reads any more.
    pub(crate) fn write_frame(&mut self, number: u64, picture: &Picture) -> Result<ControlFlow<()>> {
        match self {
            PictureOutput::Numbered(name) => {
                Output::at(&name.path(number))?.write_picture(picture)?;
                Ok(ControlFlow::Continue(()))
            }
            PictureOutput::Raw(frames) => frames.write(picture),
            PictureOutput::Nothing | PictureOutput::Last(_) => Ok(ControlFlow::Continue(())),
        }
    }

    /// Begins a picture of a path, counted from 0, or the last one, whose rows come one after the other.
    pub(crate) fn rows(&mut self, number: u64, size: [u32; 2]) -> Result<PictureRows<'_>> {
        Ok(match self {
            PictureOutput::Nothing => PictureRows::Nothing,
            PictureOutput::Last(output) => PictureRows::Png(Box::new(output.png_rows(size)?)),
            PictureOutput::Numbered(name) => {
                PictureRows::Png(Box::new(Output::at(&name.path(number))?.png_rows(size)?))
            }
            PictureOutput::Raw(frames) => PictureRows::Raw(frames),
        })
    }

    /// Writes the last picture, where that is the one that is wanted.
    pub(crate) fn write_last(&self, picture: impl FnOnce() -> Result<Picture>) -> Result<()> {
        match self {
            PictureOutput::Last(output) => output.write_picture(&picture()?),
            _ => Ok(()),
        }
    }
}

/// A picture whose rows are written as they come.
pub(crate) enum PictureRows<'a> {
    Nothing,
    Png(Box<PngRows>),
    Raw(&'a mut RawFrames),
}

impl PictureRows<'_> {
    /// Writes the next rows. Breaks where nobody reads any more.
    pub(crate) fn add(&mut self, rows: &Picture) -> Result<ControlFlow<()>> {
        match self {
            PictureRows::Nothing => Ok(ControlFlow::Continue(())),
            PictureRows::Png(png) => png.add(rows).map(ControlFlow::Continue),
            PictureRows::Raw(frames) => frames.write(rows),
        }
    }

    /// Puts the picture in its place.
    pub(crate) fn finish(self) -> Result<()> {
        match self {
            PictureRows::Png(png) => png.finish(),
            PictureRows::Nothing | PictureRows::Raw(_) => Ok(()),
        }
    }
}

/// A file's name with a number in it, as `frame-%04d.png`.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct NumberedName {
    directory: PathBuf,
    before: String,
    digits: usize,
    after: String,
}

impl NumberedName {
    /// The name, where it has a place for a number; `None` if it has none.
    pub(crate) fn of(path: &Path) -> Result<Option<NumberedName>> {
        let Some(name) = path.file_name().and_then(|name| name.to_str()) else { return Ok(None) };
        let mut found = None;
        for (at, _) in name.match_indices('%') {
            let rest = &name[at + 1..];
            let digits = rest.len() - rest.trim_start_matches(|c: char| c.is_ascii_digit()).len();
            let is_number = rest[digits..].starts_with('d') && (digits == 0 || rest.starts_with('0'));
            if !is_number {
                continue;
            }
            let width = rest[..digits].trim_start_matches('0');
            let width = if width.is_empty() { Some(0) } else { width.parse().ok() };
            let Some(width) = width.filter(|width| *width <= MOST_DIGITS) else {
                bail!("{}: a number has at most {MOST_DIGITS} digits, as in frame-%04d.png", path.display());
            };
            if found.replace((at, at + 1 + digits + 1, width)).is_some() {
                bail!("{}: a name has one place for a number, as in frame-%04d.png", path.display());
            }
        }
        Ok(found.map(|(begin, end, digits)| NumberedName {
            directory: path.parent().map(Path::to_owned).unwrap_or_default(),
            before: name[..begin].to_owned(),
            digits,
            after: name[end..].to_owned(),
        }))
    }

    /// Returns true if a file has a name that a picture may get.
    pub(crate) fn may_name(&self, file: &Path) -> bool {
        let directory = |path: &Path| {
            let path = if path.as_os_str().is_empty() { Path::new(".") } else { path };
            path.canonicalize().ok()
        };
        let (here, there) = (directory(&self.directory), file.parent().and_then(directory));
        let name = file.file_name().and_then(|name| name.to_str()).unwrap_or_default();
        let number =
            name.strip_prefix(self.before.as_str()).and_then(|rest| rest.strip_suffix(self.after.as_str()));
        let is_number = |digits: &str| !digits.is_empty() && digits.bytes().all(|b| b.is_ascii_digit());
        here.is_some() && here == there && number.is_some_and(is_number)
    }

    fn path(&self, number: u64) -> PathBuf {
        let NumberedName { directory, before, digits, after } = self;
        directory.join(format!("{before}{number:0digits$}{after}"))
    }
}

/// Pictures as bytes, one after the other.
pub(crate) struct RawFrames {
    /// Opened for the first picture, so that what goes wrong before leaves an older file as it is.
    writer: Option<Box<dyn Write>>,
    path: PathBuf,
}

impl RawFrames {
    /// Into a file or a pipe, or into stdout for `-`.
    fn new(path: &Path) -> Result<RawFrames> {
        let directory = path.parent().filter(|parent| !parent.as_os_str().is_empty());
        if path.as_os_str() != "-" && directory.is_some_and(|directory| !directory.is_dir()) {
            bail!("{}: cannot be written: its directory does not exist", path.display());
        }
        Ok(RawFrames { writer: None, path: path.to_owned() })
    }

    fn writer(&mut self) -> io::Result<&mut Box<dyn Write>> {
        if self.writer.is_none() {
            self.writer = Some(match self.path.to_str() {
                Some("-") => Box::new(io::stdout()),
                _ => Box::new(BufWriter::new(File::create(&self.path)?)),
            });
        }
        self.writer.as_mut().ok_or_else(|| io::ErrorKind::NotFound.into())
    }

    /// Writes all pixels, opaque: what the texture does not cover shows the background. Breaks where nobody
    /// reads any more.
    fn write(&mut self, picture: &Picture) -> Result<ControlFlow<()>> {
        let mut bytes = picture.rgba.clone();
        bytes.iter_mut().skip(3).step_by(4).for_each(|alpha| *alpha = 255);
        let written = self.writer().and_then(|writer| writer.write_all(&bytes).and_then(|()| writer.flush()));
        match written {
            Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(ControlFlow::Break(())),
            written => written
                .map(|()| ControlFlow::Continue(()))
                .with_context(|| format!("{}: cannot be written", self.path.display())),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_has_a_place_in_a_name() {
        let name = |text: &str| NumberedName::of(Path::new(text)).unwrap();
        let paths = |text: &str| [0, 12345].map(|n| name(text).unwrap().path(n).display().to_string());
        assert_eq!(paths("a%02d/frame-%04d.png"), ["a%02d/frame-0000.png", "a%02d/frame-12345.png"]);
        assert_eq!(paths("%d.png"), ["0.png", "12345.png"]);
        assert_eq!(paths("100%-%03d"), ["100%-000", "100%-12345"]);
        for plain in ["frame.png", "100%.png", "%4d.png", "%s.png", "%", "-"] {
            assert_eq!(name(plain), None, "{plain}");
        }
        let frames = name("frame-%04d.png").unwrap();
        assert!(frames.may_name(Path::new("./frame-0003.png")) && frames.may_name(Path::new("frame-3.png")));
        for other in ["frame-.png", "frame-a.png", "nowhere/frame-0003.png", "frame-0003.jpg"] {
            assert!(!frames.may_name(Path::new(other)), "{other}");
        }
        for bad in ["%d-%d.png", "%010d.png"] {
            assert!(NumberedName::of(Path::new(bad)).is_err(), "{bad}");
        }
    }
}
