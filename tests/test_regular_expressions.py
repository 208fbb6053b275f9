"""The regular expressions of the package: none that some Pythons match wrongly, none that takes time by a text's square."""

import ast
import re
import time
from functools import cache
from pathlib import Path

import pytest

import viewcam_addon

FUNCTIONS = {"compile", "search", "match", "fullmatch", "split", "findall", "finditer", "sub", "subn", "without"}
ROOT = Path(viewcam_addon.__file__).parent
REFUSED = {"POSSESSIVE_REPEAT", "ATOMIC_GROUP"}


def constants(tree):
    """The texts that names stand for at the top of a module."""
    known = {}
    for statement in tree.body:
        if isinstance(statement, ast.Assign) and isinstance(statement.targets[0], ast.Name):
            known[statement.targets[0].id] = text_of(statement.value, known)
    return known


def text_of(node, known):
    """The text of an expression of constants; x in place of what only a run knows."""
    if isinstance(node, ast.Constant) and isinstance(node.value, str | bytes):
        return node.value
    if isinstance(node, ast.JoinedStr):
        return "".join(str(text_of(part, known)) for part in node.values)
    if isinstance(node, ast.FormattedValue):
        return text_of(node.value, known)
    if isinstance(node, ast.Name):
        return known.get(node.id, "x")
    if isinstance(node, ast.BinOp):
        return f"{text_of(node.left, known)}{text_of(node.right, known)}"
    return "x"


def patterns_in(source):
    """(line, pattern, whether it is only matched where it is put) of each call of re, and of what takes a pattern for it."""
    tree = ast.parse(source)
    known, used = constants(tree), {}
    for node in ast.walk(tree):  # _NAME.search(…), re.compile(…).search(…)
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name | ast.Call):
            used.setdefault(getattr(node.value, "id", node.value), set()).add(node.attr)
    names = {
        node.value: node.targets[0].id for node in tree.body if isinstance(node, ast.Assign) and hasattr(node.targets[0], "id")
    }
    for node in ast.walk(tree):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr in FUNCTIONS:
            methods = {node.func.attr}
            if methods == {"compile"}:
                methods = used.get(names.get(node), set()) | used.get(node, set())
            if getattr(node.func.value, "id", "") in ("re", "texts"):
                yield node.lineno, text_of(node.args[0], known), bool(methods) and methods <= {"match", "fullmatch"}


@cache
def patterns():
    result = {}
    for path in sorted(ROOT.rglob("*.py")):
        for line, pattern, is_put in patterns_in(path.read_text("utf-8")):
            result[f"{path.relative_to(ROOT)}:{line}"] = (pattern, is_put)
    return result


def nodes(parsed):
    """Each (operator, arguments) of a parsed expression, those inside others as well."""
    for operator, arguments in parsed:
        yield operator, arguments
        for inner in arguments if isinstance(arguments, tuple) else ():
            for each in inner if isinstance(inner, list) else [inner]:
                if isinstance(each, re._parser.SubPattern):
                    yield from nodes(each)


def refused_in(pattern):
    return {str(operator) for operator, _ in nodes(re._parser.parse(pattern))} & REFUSED


def test_all_expressions_are_read():
    assert len(patterns()) > 100
    assert not [place for place, (pattern, _) in patterns().items() if pattern == "x" and "texts.py" not in place], (
        "an expression that only a run knows is judged by nobody"
    )


def test_no_expression_has_possessive_quantifiers_or_atomic_groups():
    """CPython 3.11.0 to 3.11.4 match them wrongly where what repeats backtracks (its issue 106052)."""
    result = {place: (pattern, refused_in(pattern)) for place, (pattern, _) in patterns().items() if refused_in(pattern)}
    assert not result, "\n".join(f"{place}: {names} in {pattern!r}" for place, (pattern, names) in result.items())


@pytest.mark.parametrize("pattern", [r"a++", r"(?:ab?c)*+d", r"x(?=[^y]?+)", r"(?>a)b", r"(a|(?:b{1,3}+))", r"(?<!a|(?>b))c"])
def test_what_is_refused_is_found_wherever_it_stands(pattern):
    assert refused_in(pattern)
    (result,) = patterns_in(f"import re\n_A = {pattern!r}\n_B = re.compile(rf'{{_A}}|b')")
    assert refused_in(result[1])


# ---- time


def alone(parsed, operator, arguments):
    return re._compiler.compile(re._parser.SubPattern(parsed.state, [(operator, arguments)]), parsed.state.flags)


def sample(parsed):
    """A short text that a parsed expression matches, but for what it asks of its neighbors."""
    result = ""
    for operator, arguments in parsed:
        name = str(operator)
        if name == "LITERAL":
            result += chr(arguments)
        elif name in ("NOT_LITERAL", "ANY", "IN"):
            sampled = alone(parsed, operator, arguments)
            result += next(letter for letter in " a0.(," + "".join(map(chr, range(256))) if sampled.match(letter))
        elif name == "BRANCH":
            result += sample(arguments[1][0])
        elif name == "SUBPATTERN":
            result += sample(arguments[3])
        elif name in ("MAX_REPEAT", "MIN_REPEAT"):
            result += sample(arguments[2]) * max(arguments[0], 1)
    return result


LONG, SECONDS = 20_000, 0.2  # calibrated: what goes over a text once takes 1 ms, what tries all pairs of its places 0.5 s


def attacks(parsed, before=""):
    """Texts that are long where an expression repeats something, and then end otherwise."""
    for operator, arguments in parsed:
        name = str(operator)
        inner = arguments[1] if name == "BRANCH" else arguments[3:] if name == "SUBPATTERN" else ()
        if name in ("MAX_REPEAT", "MIN_REPEAT"):
            inner = arguments[2:]
            if arguments[1] > 100:
                yield from (
                    before + unit * (LONG // len(unit)) + "\0" for unit in {sample(arguments[2]), " ", "a", "0"} if unit
                )
        for each in inner:
            yield from attacks(each, before)
        before += sample(re._parser.SubPattern(parsed.state, [(operator, arguments)]))


def seconds_of(pattern, is_put, text):
    compiled = re.compile(pattern)
    text = text.encode("latin-1") if isinstance(pattern, bytes) else text
    started = time.process_time()
    compiled.match(text) if is_put else compiled.search(text)
    return time.process_time() - started


def slowest(pattern, is_put):
    """Seconds, and the text that took them."""
    parsed = re._parser.parse(pattern.decode("latin-1") if isinstance(pattern, bytes) else pattern)
    return max(((seconds_of(pattern, is_put, text), text[:40]) for text in attacks(parsed)), default=(0.0, ""))


def test_no_expression_takes_time_by_the_square_of_a_text():
    result = {place: slowest(pattern, is_put) for place, (pattern, is_put) in patterns().items()}
    slow = {place: each for place, each in result.items() if each[0] > SECONDS}
    assert not slow, "\n".join(f"{place}: {seconds:.2g} s of {text!r}…" for place, (seconds, text) in slow.items())


@pytest.mark.parametrize("pattern", [r"\s*['\"]?\s*x", r"a(b*)c?(b*)d"])
def test_an_expression_that_tries_everything_twice_is_found(pattern):
    seconds, text = slowest(pattern, True)
    assert seconds > SECONDS, f"{seconds:.2g} s of {text!r}…"
