#!/usr/bin/env python3
"""Makes the TIFF pyramids of this directory, each by a program that people have them from.

Needs numpy, pillow, tifffile, imagecodecs, openslide-python with openslide-bin, and rasterio (which contains GDAL) from PyPI,
`vips` (Debian: libvips-tools) and `maketx` (Debian: openimageio-tools). Run it in this directory; other versions write
other bytes, of the same texels. `make.py slides_ycbcr ome_slide` makes those of these functions alone.
"""

import re
import subprocess
import sys
from pathlib import Path

import imagecodecs
import numpy as np
import openslide
import rasterio
import rasterio.shutil
import tifffile
from PIL import Image
from rasterio.io import MemoryFile
from rasterio.transform import from_origin

WIDTH, HEIGHT = 203, 141


def picture(width=WIDTH, height=HEIGHT, channels=3):
    """A picture of flat areas and edges, of 8 bits, which takes few bytes."""
    y, x = np.mgrid[0:height, 0:width].astype(np.float64)
    waves = [np.sin(x / 23 + c) * np.cos(y / (17 + 3 * c)) for c in range(channels)]
    texels = np.stack([128 + 90 * wave for wave in waves], axis=-1)
    texels[(x // 40 + y // 30) % 5 == 0] += 30
    return (np.clip(np.rint(texels), 0, 255) // 32 * 32 + 9).astype(np.uint8)


def heights():
    """Heights of 16 bits, in steps."""
    return (picture(channels=1)[..., 0].astype(np.uint16) * 113 + 1000) // 1024 * 1024 + 77


def halved(texels):
    """Each texel the mean of four, sizes rounded down."""
    h, w = texels.shape[0] // 2 * 2, texels.shape[1] // 2 * 2
    four = texels[:h, :w].astype(np.float64)
    four = four.reshape(h // 2, 2, w // 2, 2, *texels.shape[2:]).mean(axis=(1, 3))
    return np.rint(four).astype(texels.dtype) if texels.dtype.kind in "iu" else four.astype(texels.dtype)


def cog(name, bands, mask=None, **options):
    """A Cloud Optimized GeoTIFF by GDAL; bands come first."""
    count, height, width = bands.shape
    place = from_origin(500000.0, 4600000.0, 10.0, 10.0)
    profile = dict(driver="GTiff", width=width, height=height, count=count, dtype=bands.dtype, crs="EPSG:32633", transform=place)
    if count == 3:
        profile["photometric"] = "RGB"
    with rasterio.Env(GDAL_TIFF_INTERNAL_MASK=True), MemoryFile() as memory:
        with memory.open(**profile) as out:
            out.write(bands)
            if mask is not None:
                out.write_mask(mask)
        with memory.open() as source:
            rasterio.shutil.copy(source, name, driver="COG", BLOCKSIZE=128, **options)


def slide(name, compression, levels, encode, subsampling=1):
    """An SVS file as Aperio's scanners lay it out: levels of a quarter, a thumbnail, a label, a macro image."""
    base = levels[0]
    words = f"Aperio Image Library v12.0.15\r\n{WIDTH}x{HEIGHT} [0,0 {WIDTH}x{HEIGHT}] ({{0}}x{{1}})|AppMag = 20|MPP = 0.4990"
    photometric = "rgb" if compression != 33003 else "ycbcr"

    def tiles(texels, side):
        rows, columns = -(-texels.shape[0] // side), -(-texels.shape[1] // side)
        padded = np.pad(texels, ((0, rows * side - texels.shape[0]), (0, columns * side - texels.shape[1]), (0, 0)), "edge")
        for row in range(rows):
            for column in range(columns):
                yield encode(np.ascontiguousarray(padded[row * side:][:side, column * side:][:, :side]))

    def strips(out, texels, words, subfile):
        out.write(texels, photometric="rgb", compression="lzw", description=words, metadata=None, subfiletype=subfile, rowsperstrip=16)

    with tifffile.TiffWriter(name) as out:
        for number, texels in enumerate(levels):
            out.write(
                tiles(texels, 64), shape=texels.shape, dtype=texels.dtype, tile=(64, 64), photometric=photometric,
                compression=compression, description=words.format(*texels.shape[1::-1]), metadata=None,
                **({"subsampling": (subsampling, subsampling)} if photometric == "ycbcr" else {}),
            )
            if number == 0:
                strips(out, base[::8, ::8], words, 0)
        strips(out, base[::10, ::12], "Aperio Image Library v12.0.15\r\nlabel 17x15", 1)
        strips(out, base[::12, ::10], "Aperio Image Library v12.0.15\r\nmacro 21x12", 9)


def ycbcr(rgb):
    """The YCbCr of JFIF, rounded to whole numbers."""
    r, g, b = np.moveaxis(rgb.astype(np.float64), -1, 0)
    y = 0.299 * r + 0.587 * g + 0.114 * b
    return np.clip(np.rint(np.stack([y, 128 + (b - y) / 1.772, 128 + (r - y) / 1.402], axis=-1)), 0, 255).astype(np.uint8)


def slides_ycbcr():
    """Aperio's compression 33003, YCbCr in JPEG 2000: colours as fine as the luma, and of half its columns and rows.

    Beside each lies a PNG with the texels of level 0 as OpenSlide shows them, by OpenJPEG and its own conversion.
    """

    def half_colours(tile):
        tifffile.imwrite("tile.tmp.tif", tile, photometric="rgb")
        subprocess.run(["vips", "jp2ksave", "tile.tmp.tif", "tile.tmp.jp2", "--subsample-mode", "on", "--lossless"], check=True)
        boxed = Path("tile.tmp.jp2").read_bytes()
        Path("tile.tmp.tif").unlink()
        Path("tile.tmp.jp2").unlink()
        return boxed[boxed.index(b"\xff\x4f\xff\x51"):]

    rgb = picture()
    levels = [rgb, halved(halved(rgb))]
    whole = lambda tile: imagecodecs.jpeg2k_encode(ycbcr(tile), level=0, codecformat="j2k", reversible=True, mct=False)
    for name, encode, subsampling in [("slide-jpeg2000-ycbcr", whole, 1), ("slide-jpeg2000-ycbcr-420", half_colours, 2)]:
        slide(f"{name}.svs", 33003, levels, encode, subsampling)
        with openslide.OpenSlide(f"{name}.svs") as shown:
            shown.read_region((0, 0), 0, shown.dimensions).convert("RGB").save(f"{name}.png", optimize=True)


def ome_slide():
    """An OME-TIFF with a label and a macro image, as Bio-Formats names them, and an image of another name."""
    rgb = picture()
    options = dict(photometric="rgb", compression="zlib", predictor=2)
    with tifffile.TiffWriter("ome-slide.ome.tif", ome=True) as out:
        size = dict(PhysicalSizeX=0.25, PhysicalSizeXUnit="µm", PhysicalSizeY=0.25, PhysicalSizeYUnit="µm")
        out.write(rgb, subifds=1, tile=(64, 64), metadata=dict(axes="YXS", Name="slide 1", **size), **options)
        out.write(halved(rgb), subfiletype=1, tile=(64, 64), **options)
        # Of half the size of the slide: by its size alone it would be a level.
        out.write(np.ascontiguousarray(halved(rgb)[::-1]), tile=(64, 64), metadata=dict(axes="YXS", Name="macro image"), **options)
        out.write(np.ascontiguousarray(rgb[::10, ::12]), metadata=dict(axes="YXS", Name="label image"), **options)
        out.write(np.ascontiguousarray(rgb[:40, :50]), metadata=dict(axes="YXS", Name="detail & edge"), **options)
    without_machine("ome-slide.ome.tif")


def without_machine(name):
    """What tifffile writes into OME-XML of the machine that it runs on, replaced."""
    ome = Path(name)
    ome.write_bytes(re.sub(rb"urn:uuid:[0-9a-f-]{36}", b"urn:uuid:" + b"0" * 8 + b"-0000" * 3 + b"-" + b"0" * 12, ome.read_bytes()))


def vips_numbers():
    """Pyramids of floats and of signed numbers, of which libvips says that they are such in the first directory alone."""
    numbers = dict(f32=(heights() / 16 - 500).astype(np.float32) / 8, i16=heights().astype(np.int16) - 9000)
    options = ["--tile", "--pyramid", "--tile-width", "64", "--tile-height", "64", "--compression", "deflate"]
    for (name, texels), more in zip(numbers.items(), [["--predictor", "float"], ["--predictor", "horizontal", "--subifd"]]):
        tifffile.imwrite("numbers.tmp.tif", texels)
        subprocess.run(["vips", "tiffsave", "numbers.tmp.tif", f"vips-{name}.tif", *options, *more], check=True)
    Path("numbers.tmp.tif").unlink()


def land_cover():
    """A Cloud Optimized GeoTIFF of classes, whose colours are in a palette, as of land cover, and a PNG of them."""
    classes = (picture(channels=1)[..., 0] // 32).astype(np.uint8)
    profile = dict(driver="GTiff", width=WIDTH, height=HEIGHT, count=1, dtype="uint8", photometric="palette", nodata=0)
    place = dict(crs="EPSG:32633", transform=from_origin(500000.0, 4600000.0, 10.0, 10.0))
    with MemoryFile() as memory:
        with memory.open(**profile, **place) as out:
            out.write(classes, 1)
            out.write_colormap(1, {n: (255 - 20 * n, 30 + 25 * n, n * 97 % 256, 255) for n in range(8)})
        with memory.open() as source:
            rasterio.shutil.copy(source, "cog-palette.tif", driver="COG", BLOCKSIZE=128, COMPRESS="DEFLATE")
    with rasterio.open("cog-palette.tif") as found:
        colors = np.array([found.colormap(1)[n][:3] for n in range(256)], dtype=np.uint8)
        Image.fromarray(colors[found.read(1)]).save("cog-palette.png", optimize=True)


def scan():
    """A scan of one bit, compressed as fax does (Group 4), and a PNG of what GDAL reads of it."""
    black = picture(channels=1)[..., 0] < 128
    profile = dict(driver="GTiff", width=WIDTH, height=HEIGHT, count=1, dtype="uint8", nbits=1, compress="ccittfax4", photometric="miniswhite")
    with rasterio.open("scan-fax4.tif", "w", blockysize=32, **profile) as out:
        out.write(black.astype(np.uint8), 1)
    with rasterio.open("scan-fax4.tif") as found:
        Image.fromarray((255 * (1 - found.read(1))).astype(np.uint8)).save("scan-fax4.png", optimize=True)


def main():
    if sys.argv[1:]:
        functions = dict(slides_ycbcr=slides_ycbcr, ome_slide=ome_slide, vips_numbers=vips_numbers, land_cover=land_cover, scan=scan)
        for function in sys.argv[1:]:
            functions[function]()
        return
    land_cover()
    scan()
    slides_ycbcr()
    ome_slide()
    vips_numbers()
    rgb, grey = picture(), heights()
    bands = np.moveaxis(rgb, -1, 0)
    mask = np.where(np.hypot(*np.mgrid[-70:71, -101:102]) < 95, 255, 0).astype(np.uint8)
    cog("cog-jpeg.tif", bands, mask, COMPRESS="JPEG", QUALITY=80)
    cog("cog-deflate-u16.tif", grey[None], COMPRESS="DEFLATE", PREDICTOR="STANDARD", LEVEL=9)
    cog("cog-zstd-f32.tif", (grey[None] / 16 - 500).astype(np.float32) / 8, COMPRESS="ZSTD", PREDICTOR="FLOATING_POINT")
    cog("cog-lzw-i16.tif", grey[None].astype(np.int16) - 9000, COMPRESS="LZW", PREDICTOR="STANDARD")

    with tifffile.TiffWriter("ome-subifds.ome.tif") as out:
        levels = [grey, halved(grey), halved(halved(grey))]
        options = dict(tile=(64, 64), compression="zlib", predictor=2, photometric="minisblack")
        size = dict(PhysicalSizeX=0.325, PhysicalSizeXUnit="µm", PhysicalSizeY=0.325, PhysicalSizeYUnit="µm")
        out.write(levels[0], subifds=2, metadata=dict(axes="YX", **size), **options)
        for level in levels[1:]:
            out.write(level, subfiletype=1, **options)

    without_machine("ome-subifds.ome.tif")

    with tifffile.TiffWriter("planes-big-endian.tif", bigtiff=True, byteorder=">") as out:
        wide = bands.astype(np.uint16) * 257
        for level in (wide, wide[:, ::2, ::2], wide[:, ::4, ::4]):
            subfile = 0 if level is wide else 1
            out.write(level, tile=(64, 64), photometric="rgb", planarconfig="separate", compression="lzw", predictor=2, subfiletype=subfile, metadata=None)

    # Streams that end without the code that ends them, by which some readers stumble.
    tifffile.imwrite("lzw-imagecodecs.tif", picture(64, 64, 1)[..., 0], tile=(32, 48), compression="lzw", predictor=2, photometric="minisblack", metadata=None)

    tifffile.imwrite("picture.tmp.tif", rgb, photometric="rgb")
    vips = ["vips", "tiffsave", "picture.tmp.tif"]
    shape = ["--tile", "--pyramid", "--tile-width", "64", "--tile-height", "64"]
    subprocess.run([*vips, "vips-chained.tif", *shape, "--compression", "deflate", "--predictor", "horizontal"], check=True)
    subprocess.run([*vips, "vips-subifd-jpeg.tif", *shape, "--subifd", "--compression", "jpeg", "--Q", "80"], check=True)
    subprocess.run([*vips, "vips-rgb-jpeg.tif", *shape, "--compression", "jpeg", "--Q", "60", "--rgbjpeg"], check=True)
    subprocess.run(["maketx", "--tile", "64", "64", "--nchannels", "3", "-o", "maketx.tx", "picture.tmp.tif"], check=True)
    tifffile.imwrite("picture.tmp.tif", heights()[:57, :83])
    subprocess.run(["maketx", "--tile", "32", "32", "-d", "half", "-o", "maketx-half.tx", "picture.tmp.tif"], check=True)
    Path("picture.tmp.tif").unlink()

    levels = [rgb, halved(halved(rgb)), halved(halved(halved(halved(rgb))))]
    jpeg = lambda tile: imagecodecs.jpeg8_encode(tile, level=80, colorspace="RGB", outcolorspace="RGB")
    slide("slide-jpeg.svs", 7, levels, jpeg)
    slide("slide-jpeg2000.svs", 33005, levels, lambda tile: imagecodecs.jpeg2k_encode(tile, level=0, codecformat="j2k", reversible=True, mct=False))


if __name__ == "__main__":
    main()
