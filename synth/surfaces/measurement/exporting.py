"""Export: the heights of a surface as NPY or X3P.

Stage   SURFACES, to files.
Model   NPY: the array of heights in m, float32, rows along y and columns along x. It holds no distances.
        X3P: a ZIP file with main.xml (axes with their increments in m, and the number of points), the heights as
        float32 with x fastest, and an MD5 sum of each. A profile is a surface of one row, because not every program
        reads the feature type of profiles.
Source  ISO 25178-72 (X3P, formerly ISO 5436-2); openGPS, http://www.opengps.eu.
Limits  The mean height is 0: the zero of the instrument is lost. The X3P does not name an instrument.
"""

from __future__ import annotations

import hashlib
import io
import zipfile
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from synth.errors import CannotRender, Fault, InvalidRequest, shown
from synth.surfaces.surface_data import SurfaceData

FORMATS = ("npy", "x3p")
NAMESPACE = "http://www.opengps.eu/2008/ISO5436_2"
HEIGHTS = "bindata/data.bin"
CHECKSUM = "md5checksum.hex"
FIXED_DATE = (1980, 1, 1, 0, 0, 0)  # of all entries of the ZIP file, so that the same surface gives the same bytes


def format_of_ending(path: Path) -> str:
    """Return the format of the file name `path`. Raises InvalidRequest for another ending."""
    found = path.suffix.removeprefix(".").lower()
    if found not in FORMATS:
        raise InvalidRequest(
            [Fault("/export", shown(str(path)), "a file name that ends in .npy or .x3p", "Write NAME.x3p.")]
        )
    return found


def exported(surface: SurfaceData | None, file_format: str) -> bytes:
    """Return the file of `surface`. Raises CannotRender if there is none."""
    if surface is None:
        raise CannotRender("the heights of this texture are not in the store.")
    return x3p_file(surface) if file_format == "x3p" else npy_file(surface)


def npy_file(surface: SurfaceData) -> bytes:
    """Return the NPY file of the heights (m)."""
    written = io.BytesIO()
    np.save(written, surface.heights)
    return written.getvalue()


def x3p_file(surface: SurfaceData) -> bytes:
    """Return the X3P file of `surface`."""
    heights = np.atleast_2d(surface.heights).astype("<f4").tobytes()
    document = _document(surface, hashlib.md5(heights, usedforsecurity=False).hexdigest())
    main = ElementTree.tostring(document, "utf-8", xml_declaration=True)
    checksum = f"{hashlib.md5(main, usedforsecurity=False).hexdigest()} *main.xml\n".encode()
    written = io.BytesIO()
    with zipfile.ZipFile(written, "w", zipfile.ZIP_DEFLATED) as packed:
        for name, content in (("main.xml", main), (HEIGHTS, heights), (CHECKSUM, checksum)):
            entry = zipfile.ZipInfo(name, FIXED_DATE)
            entry.compress_type = zipfile.ZIP_DEFLATED
            packed.writestr(entry, content)
    return written.getvalue()


def _document(surface: SurfaceData, checksum: str) -> ElementTree.Element:
    """Return main.xml. checksum: MD5 of the heights."""
    rows, columns = np.atleast_2d(surface.heights).shape
    along_x, along_y = surface.spacing[0], surface.spacing[-1]
    ElementTree.register_namespace("p", NAMESPACE)
    root = ElementTree.Element(f"{{{NAMESPACE}}}ISO5436_2")
    record1 = _added(root, "Record1", Revision="ISO5436 - 2000", FeatureType="SUR")
    axes = _added(record1, "Axes")
    for name, step in (("CX", along_x), ("CY", along_y)):
        _added(axes, name, AxisType="I", DataType="D", Increment=repr(step), Offset="0.0")
    _added(axes, "CZ", AxisType="A", DataType="F", Increment="1.0", Offset="0.0")
    record3 = _added(root, "Record3")
    _added(record3, "MatrixDimension", SizeX=str(columns), SizeY=str(rows), SizeZ="1")
    _added(record3, "DataLink", PointDataLink=HEIGHTS, MD5ChecksumPointData=checksum)
    _added(root, "Record4", ChecksumFile=CHECKSUM)
    return root


def _added(above: ElementTree.Element, name: str, **texts: str) -> ElementTree.Element:
    """Add the element `name` with an element for each text, and return it."""
    element = ElementTree.SubElement(above, name)
    for key, text in texts.items():
        ElementTree.SubElement(element, key).text = text
    return element
