"""Files that hold no heights that can be read, or that can be read in two ways: what the refusal has to say."""

from __future__ import annotations

import gzip
import io
import json
import struct
import zipfile
from typing import Any

import numpy as np
import tifffile
from PIL import Image

from tests.synth.surfaces.readers.usual_arrays import npy
from tests.synth.surfaces.readers.usual_files import GRID, UsualFile, X, Z
from tests.synth.surfaces.readers.usual_pictures import chunk, packed, png
from tests.synth.surfaces.readers.usual_profiles import lines, rows


def refused(name: str, writer: str, content: bytes | str, says: str, **more: Any) -> UsualFile:
    return UsualFile(name, writer, content.encode() if isinstance(content, str) else content, refusal=says, **more)


def zipped(**parts: bytes) -> bytes:
    written = io.BytesIO()
    with zipfile.ZipFile(written, "w") as file:
        for name, content in parts.items():
            file.writestr(name.replace("__", "/").replace("_xml", ".xml").replace("_npy", ".npy"), content)
    return written.getvalue()


def tiff(pixels: Any, **how: Any) -> bytes:
    written = io.BytesIO()
    tifffile.imwrite(written, pixels, **how)
    return written.getvalue()


def photograph() -> Any:
    """Return colours that are no unit vectors."""
    across, down = np.meshgrid(np.arange(16), np.arange(12))
    return np.stack([16 * across, 20 * down, 255 - 16 * across], axis=2).astype(np.uint8)


def saved(kind: str, mode: str = "RGB", **how: Any) -> bytes:
    written = io.BytesIO()
    Image.fromarray(photograph()).convert(mode).save(written, kind, **how)
    return written.getvalue()


WAV = (
    b"RIFF"
    + struct.pack("<I", 40)
    + b"WAVEfmt "
    + struct.pack("<IHHIIHH", 16, 1, 1, 8000, 16000, 2, 16)
    + b"data\x04\0\0\0"
    + bytes(4)
)
COLOURS = bytes((255, 0, 0, 0, 255, 0, 0, 0, 255, 255, 255, 0))
PLY = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nend_header\n0 0 0\n"

REFUSED: tuple[UsualFile, ...] = (
    # Text that is no table of heights
    refused("empty.csv", "a copy that failed", b"", "an empty file"),
    refused("header-only.csv", "an export without data", "X [mm];Z [um]\n", "no numbers"),
    refused("json.txt", "a program for the web: JSON", json.dumps({"z": Z}), "JSON"),
    refused("json-list.txt", "Python, json.dump of a list", json.dumps([list(X), list(Z)]), "JSON"),
    refused("page.txt", "a saved web page: HTML", "<!DOCTYPE html>\n<table><tr><td>1.5</td></tr></table>\n", "HTML"),
    refused("page-lower.csv", "a table saved as HTML", "\n  <HTML><body><table></table></body></HTML>\n", "HTML"),
    refused("letter.txt", "WordPad: RTF", r"{\rtf1\ansi 1.5 2.5}", "RTF"),
    refused("data.txt", "an instrument: XML", '<?xml version="1.0"?>\n<z>1.5</z>\n', "XML"),
    refused(
        "smd.txt",
        "ISO 5436-2, SMD: a profile as records",
        "ISO5436 - 2000\nPRF 0 scan\nCX I 8 MM 0.125 D\n\x03\n1.5\n\x03\n",
        "ISO 5436",
    ),
    refused(
        "voltages.txt", "an oscilloscope: a column in volts", lines("t [s]\tU [V]", rows=rows()), "a unit of length"
    ),
    refused(
        "comma-or-two.csv",
        "numbers that are one or two",
        "".join(f"{place},{place}\n" for place in range(8)),
        "1.5 with a point, or 1;5",
    ),
    refused(
        "one-or-thousand.txt",
        "numbers that are 1 or 1,000",
        lines("X [mm]\tZ [um]", rows=[f"{x}\t{place + 1},250" for place, x in enumerate(X)]),
        "separators of thousands",
    ),
    refused(
        "ragged.csv",
        "a table with a short line",
        lines("a;b;c;d", rows=["1;2;3;4", "5;6;7", "8;9;10;11"]),
        "line 2 of the numbers has 3 columns",
    ),
    refused(
        "scattered.xyz",
        "a laser scanner: scattered points",
        lines(rows=[f"{place * 0.37 % 1:.4f} {place * 0.61 % 1:.4f} {place}" for place in range(40)]),
        "Resample",
        options={"unit": "um"},
    ),
    refused(
        "unequal-steps.txt",
        "a stylus with unequal steps",
        lines("X [mm]\tZ [um]", rows=[f"{place**1.3:.6f}\t{z}" for place, z in enumerate(Z)]),
        "resample",
    ),
    refused("no-unit.txt", "a stylus without units", lines(rows=rows()), "mm, um"),
    refused("unit-of-heights-only.txt", "a header with one of two units", lines("X\tZ [um]", rows=rows()), "two units"),
    refused(
        "units-in-cells.txt",
        "a report: a unit in each cell",
        lines("X\tZ", rows=[f"{x} mm\t{z} um" for x, z in zip(X, Z, strict=True)]),
        "Write the units once",
    ),
    refused(
        "two-profiles-below.txt",
        "gnuplot: two blocks, one below the other",
        lines("# x [mm] z [um]", rows=[*rows(" "), "", *rows(" ", z=[2 * z for z in Z])]),
        "2 profiles, one below the other",
    ),
    refused(
        "commas-everywhere.csv",
        "a program with German settings: decimal commas, separated by commas",
        lines(rows=[f"{place},05,{place + 1},25" for place in range(8)]),
        "1.5 with a point, or 1;5",
    ),
    refused(
        "step-without-unit.txt",
        "heights in um, with a step in an unknown unit",
        lines("Spacing: 0.125", "Height [um]", rows=[str(z) for z in Z]),
        "two units",
    ),
    refused(
        "points-and-colours.xyz",
        "a laser scanner: x, y, z, red, green and blue without names",
        lines(rows=[f"{x} {y} {x + y} 9 9 9" for x in range(3) for y in range(4)]),
        "x;y;z;r;g;b",
    ),
    # Pictures
    refused("photo.png", "a camera", saved("PNG"), "picture in colour"),
    refused("photo.jpg", "a camera", saved("JPEG"), "picture in colour"),
    refused("cmyk.jpg", "a print shop: JPEG in CMYK", saved("JPEG", "CMYK"), "CMYK"),
    refused(
        "palette-of-colours.png",
        "GIMP: a palette of colours",
        png(packed(np.arange(12).reshape(3, 4) % 4, 2), 4, 2, 3, chunk(b"PLTE", COLOURS)),
        "picture in colour",
    ),
    refused("animation.gif", "GIF", saved("GIF", "P"), "GIF"),
    refused("map.exr", "Blender, Poly Haven: OpenEXR", b"\x76\x2f\x31\x01\x02" + bytes(60), "OpenEXR"),
    refused(
        "sky.hdr", "Radiance HDR", b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 1\n\x80\x80\x80\x80", "Radiance HDR"
    ),
    refused("map.psd", "Photoshop", b"8BPS\0\x01" + bytes(40), "Photoshop"),
    refused("map.jp2", "JPEG 2000", b"\0\0\0\x0cjP  \r\n\x87\n" + bytes(40), "JPEG 2000"),
    refused("map.dds", "games: DDS", b"DDS |" + bytes(130), "DDS"),
    refused(
        "degrees.tif",
        "QGIS: a GeoTIFF in degrees",
        tiff(
            np.array(GRID, np.float32),
            extratags=[(33550, "d", 3, (1e-5, 1e-5, 0.0), True), (34735, "H", 8, (1, 1, 0, 1, 1024, 0, 1, 2), True)],
        ),
        "in degrees",
        options={"unit": "um"},
    ),
    refused(
        "volts.tif",
        "ImageJ: a calibration to volts",
        tiff(np.array(GRID, np.float32), metadata=None, description="ImageJ=1.54f\ncf=0\nc0=0\nc1=1\nvunit=V\n"),
        "a unit of length",
    ),
    refused(
        "complex.tif", "radar: complex numbers", tiff(np.ones((3, 4), np.complex64), photometric="minisblack"), "TIFF"
    ),
    refused(
        "cmyk.tif",
        "a print shop: TIFF in CMYK",
        saved("TIFF", "CMYK"),
        "CMYK",
    ),
    refused(
        "scale-without-unit.tif",
        "a TIFF with the size of a pixel, without its unit",
        tiff(np.array(GRID, np.float32), extratags=[(33550, "d", 3, (0.05, 0.05, 0.0), True)]),
        "has no unit",
        options={"unit": "um"},
    ),
    refused("map.pam", "Netpbm: PAM", b"P7\nWIDTH 4\nHEIGHT 3\nDEPTH 1\nMAXVAL 255\nENDHDR\n" + bytes(12), "PAM"),
    # Arrays, tables, meshes, sounds, packed files
    refused("scalar.npy", "NumPy: one number", npy(np.float64(1.0)), "dimensions"),
    refused("cube.npy", "NumPy: three dimensions", npy(np.zeros((2, 3, 4))), "3 dimensions"),
    refused("objects.npy", "NumPy: objects", npy(np.array([None, 1], dtype=object)), "real numbers"),
    refused("complex.npy", "NumPy: complex numbers", npy(np.ones(4, complex)), "real numbers"),
    refused(
        "arrays.npz", "NumPy, savez: several arrays", zipped(a_npy=npy(np.array(GRID)), b_npy=npy(np.array(Z))), "NPZ"
    ),
    refused("sheet.xlsx", "Excel: a workbook", zipped(xl__workbook_xml=b"<workbook/>"), "XLSX"),
    refused("sheet.ods", "LibreOffice Calc", zipped(content_xml=b"<office/>"), "LibreOffice"),
    refused("old.xls", "Excel 97: a workbook", b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + bytes(500), "XLS"),
    refused(
        "variables.mat",
        "MATLAB, save",
        b"MATLAB 5.0 MAT-file, Platform: GLNXA64".ljust(124) + b"\0\x01IM" + bytes(20),
        "MATLAB",
    ),
    refused("arrays.h5", "HDF5", b"\x89HDF\r\n\x1a\n" + bytes(90), "HDF5"),
    refused("image.dcm", "DICOM", bytes(128) + b"DICM" + bytes(40), "DICOM"),
    refused(
        "field.gsf", "Gwyddion, simple field", b"Gwyddion Simple Field 1.0\nXRes = 2\nYRes = 2\n\0\0" + bytes(16), "GSF"
    ),
    refused(
        "mesh.bin", "CAD: STL as bytes, named otherwise", b"binary".ljust(80) + struct.pack("<I", 1) + bytes(50), "STL"
    ),
    refused("mesh-text.stl", "CAD: STL as text", "solid part\nfacet normal 0 0 1\nouter loop\n", "STL"),
    refused("mesh.obj", "Blender: OBJ", "# Blender\nmtllib a.mtl\no a\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "OBJ"),
    refused("mesh.ply", "scanners: PLY", PLY, "PLY"),
    refused("model.glb", "web: GLB", b"glTF\x02\0\0\0" + bytes(20), "glTF"),
    refused("sound.wav", "a recorder", WAV, "WAV"),
    refused("files.zip", "a download of a material library: ZIP", zipped(map_png=b"1"), "ZIP"),
    refused("scan.csv.gz", "gzip", gzip.compress(b"1\n2\n3\n"), "gzip"),
    refused("report.pdf", "a report: PDF", b"%PDF-1.7\n1 0 obj\n", "PDF"),
    refused("noise.bin", "bytes of nothing", bytes(range(256)) * 4, "no known format"),
)
