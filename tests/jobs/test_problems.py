"""Problems of a list of shots are told at once, whole, and with their places."""

import json
import sys
import time

import pytest
from hypothesis import given
from hypothesis import strategies as st

from viewcam_addon.errors import InputError
from viewcam_addon.jobs import lists
from viewcam_addon.jobs.lists import COLUMNS, MOST_SHOWN, ShotsError

pytestmark = pytest.mark.slow

HEADER = "name,camera,eye_x,eye_y,eye_z,look_at,up,d,width,height,frame,engine,samples,level"
GOOD = {
    "name": "shot{line}",
    "camera": "",
    "eye_x": "3",
    "eye_y": "-6",
    "eye_z": "2.5",
    "look_at": '"0,0,1"',
    "up": '"0,0,1"',
    "d": "400",
    "width": "320",
    "height": "180",
    "frame": "",
    "engine": "CYCLES",
    "samples": "16",
    "level": "",
}

# Changes of a good row → (columns as they are named, what is said) of each problem.
KINDS = [
    ({"name": ""}, [("name", "missing")]),
    ({"name": "SHOT2"}, [("name", "line 2 has this name already as 'shot2'")]),
    ({"name": "shot2"}, [("name", "line 2 has this name already, give another")]),
    ({"name": "a/b"}, [("name", "holds /")]),
    ({"name": r"a\b"}, [("name", r"holds \:")]),
    ({"name": "a:b"}, [("name", "holds :")]),
    ({"name": "a?"}, [("name", "holds ?")]),
    ({"name": "a#"}, [("name", "holds #")]),
    ({"name": "NUL"}, [("name", "device on Windows")]),
    ({"name": "com7.left"}, [("name", "device on Windows")]),
    ({"name": ".."}, [("name", "dot")]),
    ({"name": ".hidden"}, [("name", "hidden")]),
    ({"name": "end."}, [("name", "ends with a dot")]),
    ({"name": "a\tb"}, [("name", "can't be seen")]),
    ({"name": "x" * 201}, [("name", "201 bytes")]),
    ({"name": "summary"}, [("name", "the batch itself")]),
    ({"name": "caf\udce9"}, [("name", "not UTF-8")]),
    ({"eye_y": ""}, [("eye_y", "missing, give a number")]),
    ({"eye_y": "west"}, [("eye_y", "is 'west': give a number")]),
    ({"eye_y": "1,5"}, None),  # one cell too many
    ({"eye_y": '"1,5"'}, [("eye_y", "is '1,5': give a number")]),
    ({"eye_y": "1_0"}, [("eye_y", "give a number")]),
    ({"eye_y": "0x10"}, [("eye_y", "give a number")]),
    ({"eye_y": "١"}, [("eye_y", "give a number")]),
    ({"eye_y": "−1"}, [("eye_y", "give a number")]),
    ({"eye_z": "nan"}, [("eye_z", "finite")]),
    ({"eye_z": "-inf"}, [("eye_z", "finite")]),
    ({"eye_z": "1e999"}, [("eye_z", "finite")]),
    ({"eye_z": "9" * 5000}, [("eye_z", "finite")]),
    ({"eye_z": "1e39"}, [("eye_x, eye_y, eye_z", "3.40282e+38")]),
    ({"eye_x": "a", "eye_z": "b"}, [("eye_x", "is 'a'"), ("eye_z", "is 'b'")]),
    ({"eye_x": "0", "eye_y": "0", "eye_z": "1"}, [("eye_x, eye_y, eye_z, look_at", "the same point")]),
    ({"look_at": ""}, [("look_at", "missing")]),
    ({"look_at": '"0,0"'}, [("look_at", "give 3 numbers")]),
    ({"look_at": '"0,0,0,0"'}, [("look_at", "give 3 numbers")]),
    ({"look_at": '"0,,0,0"'}, [("look_at", "give 3 numbers")]),
    ({"look_at": '"0,0,nan"'}, [("look_at", "finite")]),
    ({"look_at": '"0,0,z"'}, [("look_at", "give 3 numbers")]),
    ({"look_at": '"0,0,1'}, None),  # not closed
    ({"look_at": '"0,0,1"x'}, None),
    ({"up": ""}, [("up", "missing")]),
    ({"up": "0 0 0"}, [("up", "no direction")]),
    ({"up": '"-0,0.0,0e9"'}, [("up", "no direction")]),
    ({"d": ""}, [("d", "missing")]),
    ({"d": "0"}, [("d", "d > 0")]),
    ({"d": "-400"}, [("d", "d > 0")]),
    ({"d": "1e-60"}, [("d", "1.17549e-38")]),
    ({"d": "400px"}, [("d", "give a number")]),
    ({"d": "true"}, [("d", "give a number")]),
    ({"look_at": "", "up": "", "d": ""}, [("look_at, up, d", "missing")]),
    ({"camera": "Camera"}, [("camera, eye_x, eye_y, eye_z, look_at, up, d", "either")]),
    ({"camera": "Camera", "eye_x": "", "eye_y": "", "eye_z": "", "look_at": "", "up": ""}, [("camera, d", "either")]),
    (dict.fromkeys(("eye_x", "eye_y", "eye_z", "look_at", "up", "d")), [("eye_x, eye_y, eye_z, look_at, up, d", "missing")]),
    (
        dict.fromkeys(("eye_x", "eye_y", "eye_z", "look_at", "up", "d")) | {"camera": "Camra"},
        [("camera", "no camera 'Camra', but Camera")],
    ),
    ({"width": ""}, [("width", "give height and width, or neither")]),
    ({"height": ""}, [("height", "give width and height, or neither")]),
    ({"width": "3"}, [("width", "from 4 to 65536")]),
    ({"height": "65537"}, [("height", "from 4 to 65536")]),
    ({"width": "320.5"}, [("width", "whole number")]),
    ({"width": "320x180"}, [("width", "give a number")]),
    ({"width": "", "height": "0"}, [("height", "from 4 to 65536"), ("width", "or neither")]),
    ({"frame": "1048575"}, [("frame", "1048574")]),
    ({"frame": "-1048575"}, [("frame", "1048574")]),
    ({"frame": "1.5"}, [("frame", "whole number")]),
    ({"frame": "first"}, [("frame", "give a number")]),
    ({"engine": "BLENDER_EEVEE"}, [("engine", "CYCLES, EEVEE, VIEWCAM")]),
    ({"engine": "cycles"}, [("engine", "CYCLES, EEVEE, VIEWCAM")]),
    ({"samples": "0"}, [("samples", "from 1 to 16777216")]),
    ({"samples": "16777217"}, [("samples", "from 1 to 16777216")]),
    ({"samples": "many"}, [("samples", "give a number")]),
    ({"level": "full"}, [("level", "geometry, direct, path, auto")]),
    ({"level": "", "d": "x", "up": "0 0 0", "name": "a|b"}, [("name", "holds |"), ("up", "no direction"), ("d", "is 'x'")]),
]


def line_of(changes, line):
    return ",".join((GOOD | changes)[column] or "" for column in HEADER.split(",")).format(line=line)


def problems_of(path, cameras=None):
    with pytest.raises(ShotsError) as raised:
        lists.read(path, cameras)
    return raised.value.problems


def problems_in(tmp_path, name, text, cameras=None):
    (tmp_path / name).write_text(text, encoding="utf-8")
    return problems_of(tmp_path / name, cameras)


def test_a_thousand_rows_with_every_kind_of_bad_one_name_each_by_line_and_column(tmp_path):
    assert len(KINDS) >= 40
    lines = [HEADER, *(line_of({}, line) for line in range(2, 1002))]
    expected = []
    for number, (changes, problem) in enumerate(KINDS):
        line = 7 + 13 * number
        lines[line - 1] = line_of(changes, line)
        if problem is None:
            expected.append((f"line {line} ", ""))
        for columns, sentence in problem or ():
            expected.append((f"line {line}, column{'s' * (', ' in columns)} {columns}", sentence))
    path = tmp_path / "thousand.csv"
    path.write_bytes("\r\n".join(lines).encode("utf-8", "surrogateescape"))
    problems = list(problems_of(path, ["Camera"]))
    for place, sentence in expected:
        result = [
            problem
            for problem in problems
            if problem.startswith((place + " ", place + ":")) or (not sentence and problem.startswith(place))
        ]
        assert len(result) == 1 and sentence in result[0], f"{place} … {sentence}: told was {result}"
        problems.remove(result[0])
    assert not problems, f"more was told than is wrong: {problems}"


def test_each_problem_is_one_printable_line_in_the_order_of_the_file(tmp_path):
    lines = [HEADER, *(line_of(changes, number) for number, (changes, _) in enumerate(KINDS, start=2))]
    (tmp_path / "bad.csv").write_bytes("\n".join(lines).encode("utf-8", "surrogateescape"))
    problems = problems_of(tmp_path / "bad.csv", ["Camera"])
    assert all(problem.isprintable() and len(problem) < 300 for problem in problems)
    shapeless = {number for number, (_, entries) in enumerate(KINDS, start=2) if entries is None}
    entries = [int(problem.split()[1].rstrip(",")) for problem in problems]
    assert [line for line in entries if line not in shapeless] == sorted(line for line in entries if line not in shapeless)
    assert {*entries} == {*range(2, len(KINDS) + 2)} - {line_of_first_good()}


def line_of_first_good():
    """The line of the first of two rows called alike, which is right: here rows of one name stand below none of that name."""
    return next(number for number, (changes, _) in enumerate(KINDS, start=2) if changes == {"name": "SHOT2"})


@given(st.integers(2, 30), st.sampled_from(list(GOOD)), st.text(st.characters(blacklist_characters='\r\n",;\t|'), max_size=8))
def test_a_row_is_wrong_for_itself_alone(tmp_path_factory, line, column, text):
    folder = tmp_path_factory.getbasetemp()
    lines = [HEADER, *(line_of({}, number) for number in range(2, 31))]
    lines[line - 1] = line_of({column: text.replace("{", "").replace("}", "")}, line)
    path = folder / "one.csv"
    path.write_bytes("\n".join(lines).encode("utf-8", "surrogatepass"))
    try:
        assert len(lists.read(path)) == 29
    except ShotsError as error:
        assert all(problem.startswith(f"line {line}") for problem in error.problems), error.problems


def test_more_than_a_hundred_problems_are_counted(tmp_path):
    lines = [HEADER, *(line_of({"d": "x"}, line) for line in range(2, 252))]
    (tmp_path / "bad.csv").write_text("\n".join(lines), encoding="utf-8")
    with pytest.raises(ShotsError) as raised:
        lists.read(tmp_path / "bad.csv")
    sentences = str(raised.value).splitlines()
    assert len(raised.value.problems) == 250
    assert "250 problems" in sentences[0] and len(sentences) == MOST_SHOWN + 2
    assert sentences[-1] == f"  … and {250 - MOST_SHOWN} more"


@pytest.mark.parametrize(
    ("header", "sentence"),
    [
        ("name,camera,color", ["line 1, column 'color' is unknown: take it out"]),
        ("name,camera,Frame", ["line 1, column 'Frame' is unknown: write frame"]),
        ("name,camera,EYE X", ["line 1, column 'EYE X' is unknown: write eye_x"]),
        ("name,camera,,frame", ["line 1, column '' is unknown: take it out"]),
        ("camera,name,name", ["line 1, column 'name' is there twice: take one out"]),
        ("name,eye,look_at,up,distance,d", ["line 1, column 'd' says the same as distance: take one out"]),
        ("name,camera,up,up_x,up_y,up_z", [f"line 1, column 'up_{axis}' says the same as up: take one out" for axis in "xyz"]),
        ("camera,frame", ["line 1: there is no column name, add it"]),
        ("name,eye,up", ["line 1: there is no column look_at, add it", "line 1: there is no column d, add it"]),
        ("name,eye_x,eye_z,look_at,up,d", ["line 1: there is no column eye_y, add it"]),
        (
            'name,"camera',
            [
                "line 1 is no row of cells (unexpected end of data): "
                "open and close each quote on one line, and double those inside"
            ],
        ),
    ],
)
def test_what_is_wrong_with_the_header_is_told_once_and_not_in_each_row(tmp_path, header, sentence):
    values = {"name": "a{}", "camera": "Camera", "frame": "1", "eye": "1 2 3", "eye_x": "1", "eye_z": "3", "look_at": "0 0 1"}
    values |= {"up": "0 0 1", "d": "5"}
    rows = [",".join(values.get(column, "") for column in header.split(",")).replace("{}", str(i)) for i in range(3)]
    if "up_x" in header or "color" in header:
        rows = [row.replace("0 0 1", "") for row in rows]
    assert list(problems_in(tmp_path, "list.csv", "\n".join([header, *rows]))) == sentence


def test_with_a_wrong_header_the_rows_are_looked_at_all_the_same(tmp_path):
    problems = problems_in(tmp_path, "list.csv", "name,camera,color,frame\na,Camera,red,1\nb,Camera,red,x\n")
    assert [problem.split(" is ")[0] for problem in problems] == ["line 1, column 'color'", "line 3, column frame"]


def test_a_row_of_too_few_or_too_many_cells_is_told_and_rows_and_columns_of_nothing_are_not(tmp_path):
    text = "name,camera,frame,,\na,C,1,,\n\nb,C\nc,C,2,3,\n,,,,\n,,\nd,C,1,5,,\ne,C,1,,,\n"
    problems = problems_in(tmp_path, "list.csv", text)
    assert [problem.split(":")[0] for problem in problems] == [
        "line 4 has 2 cells under 5 columns",
        "line 5 has a cell under no column",
        "line 8 has 6 cells under 5 columns",
        "line 9 has 6 cells under 5 columns",
    ]


DEEP = "[" * 100_000 + "]" * 100_000


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("7", ["no list of shots"]),
        ('"a"', ["no list of shots"]),
        ("null", ["no list of shots"]),
        ("{}", ["no list of shots"]),
        ('{"shots": {"a": 1}}', ["no list of shots"]),
        ('{"shots": [], "shot": 1}', ["key 'shot' is unknown"]),
        ('{"shots": [], "shots": []}', ["key shots is there twice"]),
        ('{"shots": [], "defaults": []}', ["defaults is []: give an object"]),
        ('{"shots": [], "defaults": {"name": "a"}}', ["defaults, key name: take it out"]),
        ('{"shots": [], "defaults": {"color": 1}}', ["defaults, key 'color' is unknown"]),
        (
            '{"shots": [{"name": "a"}, {"name": "b"}], "defaults": {"camera": "C", "frame": 0.5}}',
            ["defaults, key frame is 0.5: give a whole number"],
        ),
        (
            '{"shots": [{"name": "a"}, {"name": "b"}], "defaults": {"camera": "D"}}',
            ["defaults, key camera: the file has no camera 'D', but C"],
        ),
        ("[1, [2], null]", ["shot 1 is 1: give an object", "shot 2 is [2]: give", "shot 3 is None: give"]),
        ('[{"name": "a", "camera": "D", "camera": "C"}]', ["shot 1 ('a'), key 'camera' is there twice"]),
        ('[{"name": "a", "camera": "C", "color": {}}]', ["shot 1 ('a'), key 'color' is unknown"]),
        ('[{"name": 7, "camera": "C"}]', ["shot 1, key name is 7: give a text"]),
        ('[{"name": "", "camera": ""}]', ["shot 1 (''), key name is ''", "shot 1 (''), key camera is ''"]),
        ('[{"name": "a", "camera": ["C"]}]', ["shot 1 ('a'), key camera is ['C']: give a text"]),
        ('[{"name": "a", "camera": "C", "frame": "1"}]', ["shot 1 ('a'), key frame is '1': give a number"]),
        ('[{"name": "a", "camera": "C", "frame": true}]', ["shot 1 ('a'), key frame is True: give a number"]),
        ('[{"name": "a", "camera": "C", "frame": NaN}]', ["shot 1 ('a'), key frame is nan: give a finite"]),
        ('[{"name": "a", "camera": "C", "frame": 1e999}]', ["shot 1 ('a'), key frame is inf: give a finite"]),
        ('[{"name": "\\ud800", "camera": "C"}]', ["can't be seen"]),
        ('[{"name": "a", "eye": "123", "look_at": [0, 0], "up": [0, 0, "1"], "d": [4]}]', ["eye", "look_at", "up", "d is"]),
        ('[{"name": "a", "eye": {"x": 1}, "look_at": [0, 0, 1], "up": [0, 0, -Infinity], "d": 4}]', ["eye is", "finite"]),
        (
            '[{"name": "a", "eye_x": 1, "look_at": [0, 0, 1], "up": [0, 0, 1], "d": 4}]',
            ["key eye_y: missing", "key eye_z: missing"],
        ),
        ('[{"name": "a", "camera": "C"},\n{"name": "b" "camera": "C"}]', ["line 2, column 14: this is no JSON"]),
        ("[1, 2", ["line 1, column 6: this is no JSON"]),
        (DEEP, ["nested too deeply"]),
    ],
    ids=lambda value: value[:30] if isinstance(value, str) else "",
)
def test_what_is_wrong_with_a_document_is_told(tmp_path, text, sentence):
    problems = problems_in(tmp_path, "list.json", text, ["C"])
    assert len(problems) == len(sentence), problems
    for problem, part in zip(problems, sentence, strict=True):
        assert part in problem and problem.isprintable() and len(problem) < 300, problem


json_values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: (
        st.lists(inner, max_size=3)
        | st.dictionaries(st.sampled_from([*COLUMNS, "shots", "defaults", "é\n"]), inner, max_size=6)
    ),
    max_leaves=12,
)


@given(
    st.lists(json_values, max_size=4)
    | st.fixed_dictionaries({"shots": st.lists(json_values)}, optional={"defaults": json_values})
)
def test_whatever_a_document_holds_it_is_shots_or_printable_sentences(tmp_path_factory, document):
    path = tmp_path_factory.getbasetemp() / "any.json"
    path.write_text(json.dumps(document), encoding="utf-8")
    try:
        assert lists.read(path)
    except ShotsError as error:
        assert all(problem.isprintable() for problem in error.problems), error.problems
    except InputError as error:
        assert "holds no shots" in str(error)


def test_json_lines_name_the_line_and_each_is_read_whatever_the_others_are(tmp_path):
    good = json.dumps({"name": "a", "camera": "C"})
    lines = [good, "", "{", good, "[]", '{"name": "b", "camera": "C", "d": 0, "d": 1}', '{"name": "c", "camera": "D"}']
    problems = problems_in(tmp_path, "list.jsonl", "\r\n".join(lines), ["C"])
    for problem, part in zip(
        problems,
        [
            "line 3, column 2: this is no JSON",
            "line 4, key name is 'a': line 1 has this name already, give another",
            "line 5 is []",
            "line 6, key 'd' is there twice",
            "line 6, keys camera, d: a shot has either",
            "line 7, key camera: the file has no camera 'D', but C",
        ],
        strict=True,
    ):
        assert problem.startswith(part), problem


def test_unknown_cameras_are_guessed_at_for_the_problems_that_are_shown_and_no_others(tmp_path, monkeypatch):
    """A guess looks at every camera: 20,000 unknown names in a file of many cameras took 25 s, four times as long for twice."""
    looked_at = []
    guess = lists.difflib.get_close_matches
    monkeypatch.setattr(
        lists.difflib, "get_close_matches", lambda name, names: looked_at.append(len(names)) or guess(name, names)
    )

    class Names(tuple):
        """Counts how often all of it is looked through for one."""

        scans = 0

        def __contains__(self, name):
            Names.scans += 1
            return super().__contains__(name)

    cameras = Names(f"Camera.{number:03d}" for number in range(50))
    path = tmp_path / "shots.csv"
    costs = []
    for count in (2000, 4000):
        looked_at.clear()
        path.write_text("name,camera\n" + "".join(f"s{number},Camra.{number:04d}\n" for number in range(count)))
        with pytest.raises(ShotsError) as raised:
            lists.read(path, cameras)
        assert len(raised.value.problems) == count and all("but Camera." in problem for problem in raised.value.problems)
        costs.append(sum(looked_at))
    assert costs[0] == costs[1] == 100 * len(cameras) and Names.scans == 0


def steps_of(run):
    """The number of functions that a call calls, Python's and C's: the same in every run, on any machine."""
    steps = 0

    def count(_frame, event, _argument):
        nonlocal steps
        steps += event in ("call", "c_call")

    sys.setprofile(count)
    try:
        run()
    finally:
        sys.setprofile(None)
    return steps


def _row(number):
    return {"name": f"s{number}", "eye": [number, -5, 1], "look_at": [number, 0, 0], "up": [0, 0, 1], "d": 400}


@pytest.mark.parametrize("right", [True, False])
@pytest.mark.parametrize("suffix", ["csv", "json", "jsonl"])
def test_twice_as_many_rows_are_twice_the_work(tmp_path, suffix, right):
    costs = []
    for count in (400, 800):
        listed = [_row(number) | ({} if right else {"d": -1}) for number in range(count)]
        if suffix == "csv":
            cells = ([json.dumps(value).strip("[]") for value in row.values()] for row in listed)
            text = "\n".join([",".join(listed[0]), *(",".join(f'"{cell.strip(chr(34))}"' for cell in row) for row in cells)])
        else:
            text = json.dumps(listed) if suffix == "json" else "\n".join(map(json.dumps, listed))
        path = tmp_path / f"{count}.{suffix}"
        path.write_text(text)

        def read(path=path, count=count):
            if right:
                assert len(lists.read(path)) == count
            else:
                with pytest.raises(ShotsError):
                    lists.read(path)

        costs.append(steps_of(read))
    assert costs[1] <= 2.05 * costs[0], f"{costs[0]} calls for 400 rows, {costs[1]} for 800"


def test_a_key_that_is_there_100000_times_is_told_in_the_time_that_reading_takes(tmp_path):
    path = tmp_path / "shots.json"
    path.write_text("{" + ", ".join(['"shots": 0'] * 100_000) + "}")
    started = time.process_time()
    with pytest.raises(InputError, match="key shots is there twice"):
        lists.read(path)
    assert time.process_time() - started < 3, "to count all keys for each of them takes 7 s, in linear time 0.1 s"
