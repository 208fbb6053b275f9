"""Scene files as documents: written, changed in one place, and refused by name."""

import copy
import json

import pytest
from hypothesis import strategies as st

from viewcam_addon.errors import InputError
from viewcam_addon.tracer.scene import scene_file


@pytest.fixture
def read_document(tmp_path):
    """read_document(document) → Scene: write it as JSON, read it as a scene. document : parsed, or as text."""

    def read(document):
        path = tmp_path / "scene.json"
        path.write_text(document if isinstance(document, str) else json.dumps(document), encoding="utf-8")
        return scene_file.read(path)

    return read


@pytest.fixture(scope="session")
def changed():
    """changed(document, path, value) → a copy in which the value at the path is another, or gone where it is None."""

    def change(document, path, value):
        document = copy.deepcopy(document)
        inner = document
        for key in path[:-1]:
            inner = inner[key]
        if value is None:
            del inner[path[-1]]
        else:
            inner[path[-1]] = value
        return document

    return change


@pytest.fixture
def assert_refused(read_document):
    """assert_refused(document, words): reading it fails with one sentence that names the file and has these words."""

    def check(document, words):
        with pytest.raises(InputError) as caught:
            read_document(document)
        message = str(caught.value)
        assert all(word in message for word in ["scene.json: ", *words]), message
        assert "\n" not in message

    return check


@pytest.fixture(scope="session")
def meet_replaced(tmp_path_factory):
    """(example, draw, value): an example with a value at some place of it is read, or refused in a sentence."""
    file = tmp_path_factory.mktemp("replaced") / "scene.json"

    def meet(example, draw, value):
        inner, path = example, []
        while isinstance(inner, dict | list) and len(inner) and (not path or draw(st.booleans())):
            path.append(draw(st.sampled_from(sorted(inner) if isinstance(inner, dict) else range(len(inner)))))
            inner = inner[path[-1]]
        document = copy.deepcopy(example)
        target = document
        for key in path[:-1]:
            target = target[key]
        target[path[-1]] = value
        file.write_text(json.dumps(document), encoding="utf-8")
        try:
            scene_file.read(file)
        except InputError as error:
            assert "\n" not in str(error) and len(str(error)) < 400, str(error)

    return meet
