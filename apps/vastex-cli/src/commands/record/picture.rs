//! Pictures of a record: texels as they are, coverage in the place of alpha, as PNG.

use std::fs;
use std::path::Path;

use anyhow::{Context, Result, ensure};
use vastex_scenes::Picture;

pub(super) fn encode(picture: &Picture) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, picture.size[0], picture.size[1]);
    encoder.set_color(png::ColorType::Rgba);
    encoder.set_compression(png::Compression::Fast);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(&picture.rgba)?;
    writer.finish()?;
    Ok(bytes)
}

fn decode(file: &Path) -> Result<Picture> {
    let decode = || -> Result<Picture> {
        let mut reader = png::Decoder::new(std::io::Cursor::new(fs::read(file)?)).read_info()?;
        let mut rgba = vec![0; reader.output_buffer_size().context("too large")?];
        let info = reader.next_frame(&mut rgba)?;
        ensure!(info.color_type == png::ColorType::Rgba, "no picture of a record");
        Ok(Picture { size: [info.width, info.height], rgba })
    };
    decode().with_context(|| file.display().to_string())
}

/// How many texels are others, by how much at most, and where the first is; `None` if none is.
pub(super) fn difference(was: &Path, is: &Path) -> Result<Option<String>> {
    let (was, is) = (decode(was)?, decode(is)?);
    if was.size != is.size {
        let [[width, height], [now_width, now_height]] = [was.size, is.size];
        return Ok(Some(format!("{width}x{height} texels were, {now_width}x{now_height} are")));
    }
    let texels = was.rgba.chunks_exact(4).zip(is.rgba.chunks_exact(4));
    let largest = |(a, b): (&[u8], &[u8])| a.iter().zip(b).map(|(a, b)| a.abs_diff(*b)).max().unwrap_or(0);
    let differences: Vec<u8> = texels.map(largest).collect();
    let others = differences.iter().filter(|difference| **difference > 0).count();
    let Some(first) = differences.iter().position(|difference| *difference > 0) else { return Ok(None) };
    let width = was.size[0] as usize;
    let most = differences.iter().max().copied().unwrap_or(0);
    let (all, x, y) = (differences.len(), first % width, first / width);
    Ok(Some(format!("{others} of {all} texels differ, by {most}/255 at most, the first at {x},{y}")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texels_that_differ_are_counted_and_those_of_equal_pictures_are_none() {
        let directory = tempfile::tempdir().unwrap();
        let mut picture = Picture { size: [5, 3], rgba: (0..60).collect() };
        let [was, is] = ["was", "is"].map(|name| directory.path().join(name));
        fs::write(&was, encode(&picture).unwrap()).unwrap();
        assert_eq!(difference(&was, &was).unwrap(), None);
        picture.rgba[4 * 7 + 3] += 9;
        picture.rgba[59] -= 1;
        fs::write(&is, encode(&picture).unwrap()).unwrap();
        let told = "2 of 15 texels differ, by 9/255 at most, the first at 2,1";
        assert_eq!(difference(&was, &is).unwrap().as_deref(), Some(told));
    }
}
