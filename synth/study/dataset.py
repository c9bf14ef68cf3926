"""The result of a study as one labelled dataset, and its files: Zarr, NetCDF, Parquet, CSV.

Stage   STUDY.
Model   The dimensions are the axes of a grid, or `sample`, and `line` and `quantity`. Units are attributes; the spec is
        an attribute of the dataset. A table has a row for each scene. A file is made under another name and renamed.
        The same study gives the same bytes, whether it was interrupted or not.
Limits  NetCDF is version 3, which every reader knows; a variable may have 2 GB there.
"""

from __future__ import annotations

import json
import os
import shutil
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from synth.encode.part_file import check_folder
from synth.errors import CannotRender, Fault, InvalidRequest
from synth.study.axes import label
from synth.study.chunks import REASON, chunks_of, read
from synth.study.spec import StudySpec
from synth.study.variables import LINE, QUANTITIES, QUANTITY, UNITS, VARIABLES, shape_of

if TYPE_CHECKING:
    from pandas import DataFrame
    from xarray import Dataset

NEEDS = {".zarr": ("xarray", "zarr"), ".nc": ("xarray",), ".parquet": ("pandas", "pyarrow"), ".csv": ("pandas",)}
ENDINGS = tuple(NEEDS)
SAMPLE = "sample"


def numbers_of(spec: StudySpec, folder: Path) -> dict[str, Any]:
    """Return every variable of every scene [scenes, ...] from the parts in `folder`."""
    parts = [read(chunk, folder) for chunk in chunks_of(spec)]
    if any(part is None for part in parts):
        raise CannotRender("A part of the study is missing. Run the study again: what is finished is not solved again.")
    names = (*(one.name for one in VARIABLES), REASON)
    return {name: np.concatenate([part[name] for part in parts if part is not None]) for name in names}


def dataset_of(spec: StudySpec, numbers: dict[str, Any]) -> Dataset:
    """Return the labelled dataset of a study. Raises CannotRender without the extra `study`."""
    xarray = needed("xarray")
    grid = spec.sample is None
    over = tuple(axis.name for axis in spec.axes) if grid else (SAMPLE,)
    columns = {axis.name: list(axis.values) for axis in spec.axes} if grid else spec.columns()
    coordinates = {}
    for axis in spec.axes:
        values = np.array([label(one) for one in columns[axis.name]])
        coordinates[axis.name] = ((axis.name,) if grid else (SAMPLE,), values, {"units": axis.unit})
    coordinates[LINE] = (LINE,), np.arange(1, spec.lines + 1), {"long_name": "multiple of the fundamental"}
    coordinates[QUANTITY] = (QUANTITY,), np.array(QUANTITIES), {}
    variables = {}
    for one in VARIABLES:
        values = numbers[one.name].reshape(*spec.shape, *numbers[one.name].shape[1:])
        told = {"long_name": one.description, "units": one.unit}
        if one.name in ("rms", "peak"):
            told["units_of_quantities"] = json.dumps(dict(zip(QUANTITIES, UNITS, strict=True)))
        variables[one.name] = ((*over, *((one.along,) if one.along else ())), values, told)
    reasons = sorted({reason for reason in numbers[REASON].tolist() if reason})
    index = np.array([reasons.index(one) + 1 if one else 0 for one in numbers[REASON].tolist()], np.int32)
    told = {"long_name": "why a scene is not solved: 0, or its place in `reasons`", "reasons": json.dumps(reasons)}
    variables[REASON] = over, index.reshape(spec.shape), told
    attributes = {"title": "ridgewave study", "spec": json.dumps(spec.document()), "key": spec.key}
    attributes |= {} if spec.figure is None else {"figure": spec.figure}
    found: Dataset = xarray.Dataset(variables, coordinates, attributes)
    return found


def blank(spec: StudySpec) -> Dataset:
    """Return the dataset of a study before anything is solved: every number is NaN, of one line."""
    short = replace(spec, lines=1)
    numbers = {one.name: np.full((spec.count, *shape_of(one, 1)), np.nan) for one in VARIABLES}
    return dataset_of(short, numbers | {REASON: np.full(spec.count, "")})


def table_of(spec: StudySpec, numbers: dict[str, Any]) -> DataFrame:
    """Return a row for each scene: its axes, then its numbers; lines and quantities as columns of their own."""
    pandas = needed("pandas")
    columns: dict[str, Any] = {name: [label(one) for one in values] for name, values in spec.columns().items()}
    for one in VARIABLES:
        values = numbers[one.name]
        if one.along == QUANTITY:
            columns |= {f"{one.name}_{name}": values[:, place] for place, name in enumerate(QUANTITIES)}
        elif one.along == LINE:
            columns |= {f"{one.name}_{place + 1}": values[:, place] for place in range(spec.lines)}
        else:
            columns[one.name if one.name not in columns else f"{one.name}_"] = values
    found: DataFrame = pandas.DataFrame(columns | {REASON: numbers[REASON]})
    return found


def opened(path: Path) -> Any:
    """Return the dataset in `path` (.nc or .zarr), as a context. Raises InvalidRequest for another file."""
    xarray = needed("xarray")
    try:
        found = xarray.open_zarr(path) if path.suffix == ".zarr" else xarray.open_dataset(path, engine="scipy")
    except (OSError, ValueError, TypeError, KeyError) as error:
        hint = "Write the file that a study has made."
        raise InvalidRequest([Fault("/spec", str(path), "a finished study that exists", hint)]) from error
    if "spec" not in found.attrs or not {"rms", "reason"} <= set(found):
        found.close()
        hint = "Write the file that a study has made."
        raise InvalidRequest([Fault("/spec", str(path), "a dataset of ridgewave study", hint)])
    return found


def checked_path(path: Path, *, overwrite: bool) -> None:
    """Refuse a file that cannot be written: of another ending, that exists, without a folder, or without a library."""
    if path.suffix not in ENDINGS:
        allowed = f"a name that ends in {', '.join(ENDINGS)}"
        raise InvalidRequest([Fault("/output", str(path), allowed, "Write map.nc or map.csv.")])
    if path.exists() and not overwrite:
        hint = "Write another name, or --overwrite."
        raise InvalidRequest([Fault("/output", str(path), "a name that does not exist", hint)])
    check_folder(path, "/output")
    for name in NEEDS[path.suffix]:
        needed(name)


def write_result(spec: StudySpec, numbers: dict[str, Any], path: Path) -> None:
    """Write the result to `path`, in the form of its ending. Raises OSError, and CannotRender without the extra."""
    made = path.with_name(f".{path.name}.part{path.suffix}")
    _remove(made)
    try:
        if path.suffix == ".zarr":
            dataset_of(spec, numbers).to_zarr(made, mode="w", zarr_format=2, consolidated=True)
        elif path.suffix == ".nc":
            dataset_of(spec, numbers).to_netcdf(made, engine="scipy", format="NETCDF3_64BIT")
        elif path.suffix == ".parquet":
            table_of(spec, numbers).to_parquet(made, engine="pyarrow", index=False)
        else:
            table_of(spec, numbers).to_csv(made, index=False, lineterminator="\n")
        _remove(path)
        os.replace(made, path)
    finally:
        _remove(made)


def _remove(path: Path) -> None:
    if path.is_dir():
        shutil.rmtree(path)
    elif path.exists():
        path.unlink()


def needed(name: str) -> Any:
    """Return a library of the extra `study`. Raises CannotRender without it."""
    from importlib import import_module

    try:
        return import_module(name)
    except ModuleNotFoundError:
        reason = f"The result of a study needs {name}, which is not installed: pip install 'ridgewave[study]'."
        raise CannotRender(reason) from None
