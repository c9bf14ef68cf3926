"""The catalogue over HTTP: each entry with its numbers and scenes, and a picture that browsers keep."""

from __future__ import annotations

import io

import numpy as np
from fastapi import FastAPI
from PIL import Image

from synth.scene.catalogue import catalogue
from synth.scene.scene import parse_scene
from synth.surfaces import profile_of
from synth.surfaces.lit_picture import lit_picture
from tests.service.harness import ask, problem

LARGEST = {False: 1_000, True: 58_000}
"""Bytes of a picture, by whether its surface varies across the scan: then a byte a pixel and the header of the file."""


def test_the_catalogue_is_listed_and_each_entry_is_a_scene(app: FastAPI) -> None:
    entries = ask(app, "GET", "/v1/textures").json()["textures"]
    assert [entry["name"] for entry in entries] == [entry.name for entry in catalogue()]
    for entry in entries:
        assert entry["title"] and entry["group"]
    for entry in entries[:: len(entries) // 5]:
        whole = ask(app, "GET", f"/v1/textures/{entry['name']}").json()
        numbers = whole.pop("numbers")
        assert whole == entry
        assert numbers["scan.speed"]["value"] == entry["everyday"]["scan"]["speed"]
        assert all(number["source"] for number in numbers.values())
        assert ask(app, "POST", "/v1/explain", json=entry["scene"]).status_code == 200
        assert ask(app, "POST", "/v1/explain", json=entry["everyday"]).status_code == 200


def test_an_unknown_texture_names_the_nearest(app: FastAPI) -> None:
    for path in ("/v1/textures/grating-800um", "/v1/textures/grating-800um/picture"):
        document = problem(ask(app, "GET", path), 404, "not-found")
        assert "grating-800um-40um" in document["errors"][0]["hint"]


def test_a_picture_is_a_small_png_of_the_heights(app: FastAPI) -> None:
    for entry in catalogue():
        profile = profile_of(parse_scene(entry.name))
        answer = ask(app, "GET", f"/v1/textures/{entry.name}/picture")
        assert answer.headers["content-type"] == "image/png"
        assert len(answer.content) == int(answer.headers["content-length"]) < LARGEST[profile.of_area]
        drawn = np.asarray(Image.open(io.BytesIO(answer.content)))
        np.testing.assert_array_equal(drawn, lit_picture(profile))


def test_a_browser_keeps_a_picture_and_asks_again_with_its_tag(app: FastAPI) -> None:
    path = ask(app, "GET", "/v1/textures/denim-72x56").json()["picture"]
    answer = ask(app, "GET", path)
    assert "max-age=86400" in answer.headers["cache-control"]
    again = ask(app, "GET", path, headers={"If-None-Match": answer.headers["etag"]})
    assert (again.status_code, again.content, again.headers["etag"]) == (304, b"", answer.headers["etag"])
    head = ask(app, "HEAD", path)
    assert (head.status_code, head.content) == (200, b"")
    assert head.headers["content-length"] == str(len(answer.content))
