"""Pictures as material libraries, scanners and microscopes write them, each with its heights by own arithmetic."""

from __future__ import annotations

import io
import struct
import zlib
from collections.abc import Sequence
from typing import Any

import numpy as np
import tifffile
from PIL import Image

from tests.synth.surfaces.readers.usual_files import UsualFile

HEIGHT = 120.0  # um, of a displacement map
GREY = np.array([[0, 17, 34, 51], [255, 68, 85, 102], [119, 136, 153, 170]], np.uint8)  # multiples of 17: also 4 bits
GREY16 = GREY.astype(np.uint16) * 257 + np.arange(12, dtype=np.uint16).reshape(3, 4) % 2  # needs all 16 bits
REAL = np.array([[1.5, -2.25, 0.5, 3.75], [-1.0, 0.0, 2.5, -0.25], [4.0, 1.25, -3.5, 0.75]], np.float32)  # um
MAP = {"height": "120 um", "pixel": "50 um"}
NUMBERS = {"unit": "um", "pixel": "50 um"}
SPACING = (50e-6, 50e-6)


def chunk(kind: bytes, body: bytes) -> bytes:
    return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))


def png(rows: Sequence[bytes], width: int, bits: int, colour: int, *before: bytes) -> bytes:
    """Return a PNG. rows: packed bytes of each. colour: 0 grey, 2 RGB, 3 palette, 4 grey and alpha, 6 RGBA."""
    header = chunk(b"IHDR", struct.pack(">IIBBBBB", width, len(rows), bits, colour, 0, 0, 0))
    pixels = chunk(b"IDAT", zlib.compress(b"".join(b"\0" + row for row in rows)))
    return b"\x89PNG\r\n\x1a\n" + header + b"".join(before) + pixels + chunk(b"IEND", b"")


def packed(values: np.ndarray[Any, Any], bits: int) -> list[bytes]:
    """Return rows of whole numbers below 2 ** bits, packed as PNG has them."""
    wide = (values[..., np.newaxis] >> np.arange(bits)[::-1]) & 1
    return [np.packbits(row.ravel().astype(np.uint8)).tobytes() for row in wide]


def channels(*parts: Any, kind: str = "u1") -> list[bytes]:
    """Return rows of pixels with channels `parts`, each [3, 4] or a number."""
    stacked = np.stack([np.broadcast_to(part, GREY.shape) for part in parts], axis=2).astype(kind)
    return [row.tobytes() for row in stacked]


def grey_png(*before: bytes) -> bytes:
    """Return a PNG of 16 bits with chunks before its pixels."""
    return png(channels(GREY16, kind=">u2"), 4, 16, 0, *before)


def saved(kind: str, mode: str = "L", pixels: Any = GREY, **how: Any) -> bytes:
    written = io.BytesIO()
    Image.fromarray(pixels).convert(mode).save(written, kind, **how)
    return written.getvalue()


def tiff(pixels: Any, **how: Any) -> bytes:
    written = io.BytesIO()
    tifffile.imwrite(written, pixels, **{"photometric": "minisblack", "metadata": None} | how)
    return written.getvalue()


def texts(**tags: str) -> list[tuple[int, str, int, str, bool]]:
    """Return text tags for tifffile: their numbers follow a letter."""
    return [(int(name[1:]), "s", 0, text, True) for name, text in tags.items()]


def picture(name: str, writer: str, content: bytes, **given: Any) -> UsualFile:
    """Return a displacement map of 8 bits, whose heights are GREY of HEIGHT."""
    more: dict[str, Any] = {"heights": HEIGHT * GREY / 255.0, "spacing": SPACING, "options": MAP} | given
    return UsualFile(name, writer, content, **more)


WIDE = HEIGHT * GREY16 / 65535.0
TWO_BITS = GREY // 85
FALLING = bytes(255 - 17 * index for index in range(16) for _ in range(3))  # a palette whose greys fall
GEO_KEYS = (1, 1, 0, 2, 1024, 0, 1, 1, 3076, 0, 1, 9001)
PIXEL_SCALE = (33550, "d", 3, (50e-6, 100e-6, 0.0), True)
OME = '<OME><Image><Pixels PhysicalSizeX="{}" PhysicalSizeY="{}"{} SizeX="4" SizeY="3"/></Image></OME>'
EXIF = Image.Exif()
EXIF[274] = 6  # the right side of the stored rows is the top
SMOOTH = np.add.outer(20 * np.arange(24), 4 * np.arange(32)).clip(0, 255).astype(np.uint8)
SMOOTH_HEIGHTS = {"heights": HEIGHT * SMOOTH / 255.0, "within": 0.02}

PICTURES: tuple[UsualFile, ...] = (
    picture(
        "grey-1.png",
        "scanners, bitmaps: PNG of 1 bit",
        png(packed(GREY // 128, 1), 4, 1, 0),
        heights=HEIGHT * (GREY // 128),
        shows=("displacement map of 1 bit",),
    ),
    picture("grey-2.png", "PNG of 2 bits", png(packed(TWO_BITS, 2), 4, 2, 0), heights=HEIGHT * TWO_BITS / 3.0),
    picture(
        "grey-4.png",
        "pngcrush and oxipng, which save bits: PNG of 4 bits",
        png(packed(GREY // 17, 4), 4, 4, 0),
        shows=("4 bits has 16 heights",),
    ),
    picture("grey-8.png", "Substance, Photoshop: PNG of 8 bits", png(channels(GREY), 4, 8, 0)),
    picture("grey-16.png", "Blender, Substance: PNG of 16 bits", grey_png(), heights=WIDE),
    picture(
        "palette.png",
        "GIMP and pngquant, indexed colours: a palette of greys that fall",
        png(packed(15 - GREY // 17, 4), 4, 4, 3, chunk(b"PLTE", FALLING)),
    ),
    picture("grey-alpha.png", "GIMP: grey and alpha", png(channels(GREY, 255), 4, 8, 4)),
    picture(
        "grey-alpha-16.png",
        "GIMP: grey and alpha of 16 bits",
        png(channels(GREY16, 65535, kind=">u2"), 4, 16, 4),
        heights=WIDE,
    ),
    picture(
        "grey-alpha-clear.png",
        "GIMP: a transparent pixel is a missing point",
        png(channels(GREY, np.where(GREY == 85, 0, 255)), 4, 8, 4),
        heights=HEIGHT / 255.0 * np.where(GREY == 85, (34 + 153 + 68 + 102) / 4.0, GREY),
        options=MAP | {"missing": "fill"},
    ),
    picture(
        "rgb.png",
        "ambientCG, Poly Haven: displacement as RGB",
        png(channels(GREY, GREY, GREY), 4, 8, 2),
        shows=("three channels are equal",),
    ),
    picture(
        "rgb-16.png",
        "ambientCG: displacement as RGB of 16 bits",
        png(channels(GREY16, GREY16, GREY16, kind=">u2"), 4, 16, 2),
        heights=WIDE,
    ),
    picture("rgba.png", "Blender: RGBA, opaque", png(channels(GREY, GREY, GREY, 255), 4, 8, 6)),
    picture(
        "transparent-grey.png",
        "libpng, tRNS: one grey is transparent",
        png(channels(GREY), 4, 8, 0, chunk(b"tRNS", struct.pack(">H", 85))),
        heights=HEIGHT / 255.0 * np.where(GREY == 85, (34 + 153 + 68 + 102) / 4.0, GREY),
        options=MAP | {"missing": "fill"},
    ),
    picture(
        "gamma.png",
        "Photoshop, gAMA and sRGB: the curve is not applied, and a note says so",
        grey_png(chunk(b"gAMA", struct.pack(">I", 45455)), chunk(b"sRGB", b"\0")),
        heights=WIDE,
        shows=("profile was not applied",),
    ),
    picture(
        "profile.png",
        "Photoshop, iCCP: the profile is not applied, and a note says so",
        grey_png(chunk(b"iCCP", b"grey\0\0" + zlib.compress(bytes(128)))),
        heights=WIDE,
        shows=("profile was not applied",),
    ),
    picture(
        "scale.png",
        "PNG with sCAL: the size of a pixel in m",
        grey_png(chunk(b"sCAL", b"\x015e-05\x001e-04")),
        heights=WIDE,
        options={"height": "120 um"},
        spacing=(50e-6, 100e-6),
    ),
    picture(
        "resolution.png",
        "microscopes, pHYs: 200,000 dots per metre",
        grey_png(chunk(b"pHYs", struct.pack(">IIB", 200000, 200000, 1))),
        heights=WIDE,
        options={"height": "120 um"},
        spacing=(5e-6, 5e-6),
        shows=("that of its resolution tag, 5080 dots per inch",),
    ),
    picture(
        "screen.png",
        "Photoshop, pHYs of 72 dots per inch: no distance",
        grey_png(chunk(b"pHYs", struct.pack(">IIB", 2835, 2835, 1))),
        heights=WIDE,
        shows=("72.009 dots per inch may be a setting",),
    ),
    picture(
        "grey.jpg",
        "ambientCG, Poly Haven: JPEG in grey",
        saved("JPEG", pixels=SMOOTH, quality=95),
        shows=("compressed with loss",),
        **SMOOTH_HEIGHTS,
    ),
    picture("rgb.jpg", "ambientCG: JPEG in RGB", saved("JPEG", "RGB", SMOOTH, quality=95), **SMOOTH_HEIGHTS),
    picture(
        "progressive.jpg",
        "web exports: progressive JPEG",
        saved("JPEG", pixels=SMOOTH, quality=95, progressive=True),
        **SMOOTH_HEIGHTS,
    ),
    picture(
        "turned.jpg",
        "cameras: JPEG with an orientation of EXIF",
        saved("JPEG", pixels=SMOOTH, quality=95, exif=EXIF),
        heights=HEIGHT * np.rot90(SMOOTH, -1) / 255.0,
        within=0.02,
        shows=("turned",),
    ),
    picture(
        "bits.bmp",
        "Windows Paint, monochrome: BMP of 1 bit",
        saved("BMP", "1", np.where(GREY > 127, 255, 0).astype(np.uint8)),
        heights=HEIGHT * (GREY // 128),
    ),
    picture("grey.bmp", "microscopes: BMP of 8 bits", saved("BMP")),
    picture("rgb.bmp", "microscopes: BMP of 24 bits", saved("BMP", "RGB")),
    picture("rgba.bmp", "GIMP: BMP of 32 bits", saved("BMP", "RGBA")),
    picture("lossless.webp", "web exports: WebP without loss", saved("WEBP", "RGB", lossless=True)),
    picture(
        "lossy.webp",
        "web exports: WebP with loss",
        saved("WEBP", "RGB", SMOOTH, quality=95),
        shows=("compressed with loss",),
        **SMOOTH_HEIGHTS,
    ),
    picture(
        "grey.pgm",
        "ImageMagick: PGM of 16 bits",
        b"P5\n# heights\n4 3\n65535\n" + GREY16.astype(">u2").tobytes(),
        heights=WIDE,
    ),
    picture("grey-8.tif", "Photoshop: TIFF of 8 bits", tiff(GREY)),
    picture(
        "big-endian.tif", "Macintosh, ImageJ: big-endian TIFF of 16 bits", tiff(GREY16, byteorder=">"), heights=WIDE
    ),
    picture("lzw.tif", "Photoshop: TIFF with LZW", saved("TIFF", compression="tiff_lzw")),
    picture("deflate.tif", "GIMP: TIFF with Deflate", tiff(GREY16, compression="zlib", predictor=True), heights=WIDE),
    picture(
        "white-is-zero.tif",
        "scanners and fax: TIFF where 0 is white",
        tiff(255 - GREY, photometric="miniswhite"),
        shows=("0 is white",),
    ),
    picture(
        "planar.tif",
        "remote sensing: RGB in separate planes",
        tiff(np.stack([GREY] * 3), photometric="rgb", planarconfig="separate"),
    ),
    picture(
        "whole-32.tif",
        "ImageJ: TIFF of 32-bit whole numbers with signs, which are heights",
        tiff((1000 * REAL).astype(np.int32)),
        heights=1e-3 * (1000 * REAL).astype(np.int32),
        options=NUMBERS | {"unit": "nm"},
    ),
    picture(
        "real-32.tif", "MountainsMap, Gwyddion: TIFF of 32-bit real numbers", tiff(REAL), heights=REAL, options=NUMBERS
    ),
    picture(
        "real-64.tif", "tifffile: TIFF of 64-bit real numbers", tiff(REAL.astype(float)), heights=REAL, options=NUMBERS
    ),
    picture("tiled.tif", "GDAL: a tiled TIFF", tiff(SMOOTH, tile=(16, 16)), heights=HEIGHT * SMOOTH / 255.0),
    picture("big.tif", "GDAL: BigTIFF", tiff(REAL, bigtiff=True), heights=REAL, options=NUMBERS),
    picture(
        "pages.tif",
        "microscopes: several pages, of which the first is read",
        tiff(np.stack([GREY, 255 - GREY])),
        shows=("Of its 2 pages the first was read",),
    ),
    picture(
        "no-data.tif",
        "GDAL: the number of missing points in tag 42113",
        tiff(np.where(REAL == 0.0, -9999.0, REAL).astype(np.float32), extratags=texts(t42113="-9999")),
        heights=np.where(REAL == 0.0, (-2.25 + 1.25 - 1.0 + 2.5) / 4.0, REAL),
        options=NUMBERS | {"missing": "fill"},
    ),
    picture(
        "scaled.tif",
        "GDAL: factor, offset and unit of whole numbers in tag 42112",
        tiff(
            GREY16,
            extratags=texts(
                t42112='<GDALMetadata><Item name="SCALE" sample="0" role="scale">0.001</Item>'
                '<Item name="OFFSET" sample="0" role="offset">-5</Item>'
                '<Item name="UNITTYPE" sample="0" role="unittype">um</Item></GDALMetadata>'
            ),
        ),
        heights=0.001 * GREY16 - 5.0,
        options={"pixel": "50 um"},
        shows=("factor of 0.001",),
    ),
    picture(
        "geo.tif",
        "GDAL, QGIS: a GeoTIFF with the size of a pixel in m",
        tiff(REAL, extratags=[PIXEL_SCALE, (34735, "H", len(GEO_KEYS), GEO_KEYS, True)]),
        heights=REAL[::-1],
        options={"unit": "um"},
        spacing=(50e-6, 100e-6),
    ),
    picture(
        "ome.tif",
        "OME-TIFF: PhysicalSizeX in um by default",
        tiff(REAL, description=OME.format(50, 100, "")),
        heights=REAL,
        options={"unit": "um"},
        spacing=(50e-6, 100e-6),
    ),
    picture(
        "ome-mm.tif",
        "OME-TIFF: PhysicalSizeX in mm",
        tiff(REAL, description=OME.format(0.05, 0.1, ' PhysicalSizeXUnit="mm" PhysicalSizeYUnit="mm"')),
        heights=REAL,
        options={"unit": "um"},
        spacing=(50e-6, 100e-6),
    ),
    picture(
        "imagej.tif",
        "ImageJ, Fiji: pixels per micron in the resolution tags",
        tiff(REAL, resolution=(0.02, 0.01), resolutionunit="NONE", description="ImageJ=1.54f\nunit=micron\n"),
        heights=REAL,
        options={"unit": "um"},
        spacing=(50e-6, 100e-6),
    ),
    picture(
        "imagej-calibrated.tif",
        "ImageJ, Calibrate: a straight line from whole numbers to um",
        tiff(GREY16, description="ImageJ=1.54f\ncf=0\nc0=-2.0\nc1=0.002\nvunit=um\n"),
        heights=0.002 * GREY16 - 2.0,
        options={"pixel": "50 um"},
    ),
    picture(
        "turned.tif",
        "scanners: TIFF with an orientation",
        tiff(GREY16, extratags=[(274, "H", 1, 6, True)]),
        heights=HEIGHT * np.rot90(GREY16, -1) / 65535.0,
        shows=("turned",),
    ),
    picture(
        "lzw-16.tif",
        "Photoshop: TIFF of 16 bits with LZW",
        saved("TIFF", "I;16", GREY16, compression="tiff_lzw"),
        heights=WIDE,
    ),
    picture(
        "group4.tif",
        "fax and scanners: TIFF of 1 bit, CCITT group 4",
        saved("TIFF", "1", np.where(GREY > 127, 255, 0).astype(np.uint8), compression="group4"),
        heights=HEIGHT * (GREY // 128),
        shows=("1 bit has 2 heights",),
    ),
    picture(
        "palette.tif",
        "GIMP: TIFF with a palette of greys that fall",
        tiff(255 - GREY, photometric="palette", colormap=np.stack([np.arange(255, -1, -1, dtype=np.uint16) * 257] * 3)),
    ),
    picture(
        "jpeg.tif",
        "slide scanners: TIFF with JPEG inside, in YCbCr",
        saved("TIFF", "RGB", SMOOTH, compression="jpeg", quality=95),
        shows=("compressed with loss",),
        **SMOOTH_HEIGHTS,
    ),
    picture(
        "real.pfm",
        "HDRI tools and stereo vision: PFM of real numbers, from the bottom up",
        b"Pf\n4 3\n-1.0\n" + REAL[::-1].astype("<f4").tobytes(),
        heights=REAL,
        options=NUMBERS,
    ),
    picture(
        "real-16.tif",
        "PyTorch and game engines: TIFF of 16-bit real numbers",
        tiff(REAL.astype(np.float16)),
        heights=REAL,
        options=NUMBERS,
    ),
    picture(
        "imagej-two-units.tif",
        "ImageJ: x in um and y in mm",
        tiff(REAL, resolution=(0.02, 10.0), resolutionunit="NONE", description="ImageJ=1.54f\nunit=um\nyunit=mm\n"),
        heights=REAL,
        options={"unit": "um"},
        spacing=(50e-6, 100e-6),
    ),
)
