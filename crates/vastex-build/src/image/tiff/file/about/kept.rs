//! What a container keeps of what a TIFF file says of its texels: how large they are, where they lie, through
//! which magnification they were seen. Lines of words, as docs/format.md has them.

use std::path::Path;

use vastex_tiles::Container;

use super::{GeoPlace, PixelSize, TiffAbout, positive, read};
use crate::image::tiff::file::TiffFile;
use crate::image::tiff::file::image::{HEIGHT, ORIENTATION, WIDTH};
use crate::image::tiff::file::pyramid::bands_in_path;

/// Characters of a name that are kept.
const MOST_NAME: usize = 256;
/// By how many times a texture may be finer than the image.
const MOST_FINER: u32 = 31;

impl TiffAbout {
    /// What a container keeps of the file that it was built of: the size and the place of its texels, and the
    /// magnification. Nothing of containers of other files, and of those of older versions.
    pub fn of_container(container: &Container) -> TiffAbout {
        TiffAbout::of_kept(container.about())
    }

    /// What a container of a file keeps, if its texture has so many texels; nothing where the file is no
    /// TIFF, has another size or is stored turned, and where it says nothing.
    pub(crate) fn kept_of_file(path: &Path, texture: [u32; 2]) -> String {
        kept_of_file(path, texture).unwrap_or_default()
    }

    /// What lines say. What makes no sense is left out.
    fn of_kept(lines: &str) -> TiffAbout {
        let mut about = TiffAbout::default();
        for (word, rest) in lines.lines().filter_map(|line| line.split_once(' ')) {
            let mut numbers = rest.split(' ').map_while(|number| number.parse::<f64>().ok());
            let mut number = || numbers.next().filter(|number| number.is_finite());
            match word {
                "texel" => {
                    let size = [number(), number()].map(|side| side.and_then(positive));
                    let unit = rest.splitn(3, ' ').nth(2).map(name).filter(|unit| !unit.is_empty());
                    if let ([Some(width), Some(height)], Some(unit)) = (size, unit) {
                        about.pixel_size = Some(PixelSize { size: [width, height], unit });
                    }
                }
                "magnification" => about.magnification = number().and_then(positive),
                "place" => {
                    let all: Vec<f64> = std::iter::from_fn(number).collect();
                    about.place = all.try_into().ok().map(|from_texels| GeoPlace {
                        from_texels,
                        epsg: None,
                        name: None,
                        radius: None,
                    });
                }
                _ => {}
            }
            let Some(place) = &mut about.place else { continue };
            match word {
                "epsg" => place.epsg = rest.parse().ok(),
                "system" => place.name = Some(name(rest)).filter(|name| !name.is_empty()),
                "radius" => place.radius = rest.parse().ok().and_then(positive),
                _ => {}
            }
        }
        about
    }

    /// Lines that say it, of a texture that is finer than the image by so many times two.
    fn kept(&self, finer: u32) -> String {
        let times = f64::from(finer).exp2();
        let mut lines = Vec::new();
        if let Some(PixelSize { size, unit }) = &self.pixel_size {
            let [width, height] = size.map(|side| side / times);
            lines.push(format!("texel {width} {height} {}", name(unit)));
        }
        lines.extend(self.magnification.map(|magnification| format!("magnification {magnification}")));
        if let Some(GeoPlace { from_texels, epsg, name: system, radius }) = &self.place {
            let [a, b, east, d, e, north] = from_texels;
            let [a, b, d, e] = [a, b, d, e].map(|step| step / times);
            lines.push(format!("place {a} {b} {east} {d} {e} {north}"));
            lines.extend(epsg.map(|epsg| format!("epsg {epsg}")));
            lines.extend(system.as_ref().map(|system| format!("system {}", name(system))));
            lines.extend(radius.map(|radius| format!("radius {radius}")));
        }
        lines.join("\n")
    }
}

/// A name in one line, without what controls a terminal.
fn name(name: &str) -> String {
    let words = name.split_whitespace().collect::<Vec<_>>().join(" ");
    words.chars().filter(|letter| !letter.is_control()).take(MOST_NAME).collect()
}

fn kept_of_file(path: &Path, texture: [u32; 2]) -> Option<String> {
    let file = bands_in_path(path).map_or(path, |(file, _)| file);
    let file = TiffFile::open(file).ok()??;
    let first = file.directory(file.first).ok()?;
    let number = |tag| first.number(&file, tag).ok();
    let is_turned = number(ORIENTATION)?.is_some_and(|orientation| (2..=8).contains(&orientation));
    let size = [number(WIDTH)??, number(HEIGHT)??];
    let is_of = |finer: &u32| {
        (0..2).all(|axis| {
            u64::from(texture[axis]) >> finer == size[axis] && u64::from(texture[axis]) == size[axis] << finer
        })
    };
    let finer = (0..=MOST_FINER).find(is_of).filter(|_| !is_turned)?;
    let (_, about) = read(&file, &first).ok()?;
    Some(about.kept(finer))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_kept_says_the_same() {
        let place = GeoPlace {
            from_texels: [10.0, 0.0, 500_000.25, 0.0, -10.0, 5_200_000.0],
            epsg: Some(32633),
            name: Some("WGS 84 / UTM zone 33N".into()),
            radius: Some(6_371_008.77),
        };
        let pixel_size = Some(PixelSize { size: [0.1 + 0.2, 10.0], unit: "µm".into() });
        let about =
            TiffAbout { pixel_size, place: Some(place), magnification: Some(20.0), ..TiffAbout::default() };
        assert_eq!(TiffAbout::of_kept(&about.kept(0)), about);
        assert_eq!(TiffAbout::default().kept(0), "");
        assert_eq!(TiffAbout::of_kept(""), TiffAbout::default());
        // Of a texture that is four times as fine.
        let finer = TiffAbout::of_kept(&about.kept(2));
        assert_eq!(finer.pixel_size.unwrap().size[1], 2.5);
        assert_eq!(finer.place.unwrap().from_texels, [2.5, 0.0, 500_000.25, 0.0, -2.5, 5_200_000.0]);
        // Neither what is kept nor who reads it takes over what controls a terminal.
        let hostile = TiffAbout::of_kept("texel 1 1 \u{1b}[2Jm\nplace 1 0 0 0 1 0\nsystem a\u{1b}]0;b\u{7}");
        assert_eq!(hostile.pixel_size.as_ref().unwrap().unit, "[2Jm");
        assert_eq!(hostile.place.unwrap().name.unwrap(), "a]0;b");
        let unit = "\u{1b}[31mm\u{9b}".to_owned();
        let pixel_size = Some(PixelSize { size: [1.0; 2], unit });
        assert_eq!(TiffAbout { pixel_size, ..TiffAbout::default() }.kept(0), "texel 1 1 [31mm");
        // A line more does no harm, and nonsense is left out.
        let name = TiffAbout { magnification: None, pixel_size: None, ..about };
        let lines = format!("{}\nof later 1\n\ntexel 0 1 m\ntexel 1 1\nmagnification inf\n", name.kept(0));
        assert_eq!(TiffAbout::of_kept(&lines), name);
        assert_eq!(TiffAbout::of_kept("place 1 2 3\nepsg 4326\nplace 1 2 3 4 5 nan"), TiffAbout::default());
    }
}
