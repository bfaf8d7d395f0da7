import re
from typing import Any

from hypothesis import HealthCheck, event, given, settings
from hypothesis import strategies as st

from biogrip.errors import BiogripError
from biogrip.keys import built, plain
from biogrip.physics.models import MODELS
from biogrip.study.case_blocks import OVERRIDABLE
from biogrip.study.config import StudyConfig
from biogrip.study.messages import Schema
from biogrip.study.source import overlaid, read_config
from biogrip.study.study import load_study
from tests.helpers.key_reference import STUDY, leaves
from tests.helpers.places import CONFIG

DEFAULTS = read_config(CONFIG)
LINE = re.compile(r"[^:]+: .+: (.|\n)+\.")
# Keys with a value of their own, outside of what the user names.
SINGLE = {
    path: shape
    for path, shape in leaves(STUDY).items()
    if not shape.keys
    and path.partition(".")[0] not in ("cases", "sweeps", "protocol")
    and "[]" not in path
}
OF_A_CASE = [path for path in SINGLE if path.partition(".")[0] in OVERRIDABLE]

JUNK = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(),
    st.floats(),
    st.text(max_size=20),
    st.sampled_from(["1e5", "1e999", "-1", 10**60, [], {}, [[]], {"a": 1}, "calibrated"]),
    st.lists(st.integers(), max_size=3),
    st.dictionaries(st.text(max_size=5), st.integers(), max_size=2),
)


def allowed(shape: Schema) -> st.SearchStrategy[Any]:
    if shape.options:
        return st.one_of(*(allowed(option) for option in shape.options))
    if choices := shape.get("enum"):
        return st.sampled_from(choices)
    match shape.get("type"):
        case "array":
            few, many = shape.get("minItems", 0), min(shape.get("maxItems", 4), 4)
            unique = shape.get("uniqueItems", False)
            return st.lists(allowed(shape.inside(0)), min_size=few, max_size=many, unique=unique)
        case "object":
            names = shape.within({"type": "string"} | shape.get("propertyNames", {}))
            return st.dictionaries(allowed(names), allowed(shape.values), max_size=3)
        case "integer":
            return st.integers(shape.get("minimum"), shape.get("maximum"))
        case "number":
            above = shape.get("exclusiveMinimum")
            low, high = shape.get("minimum", above), shape.get("maximum")
            return st.floats(low, high, exclude_min=low == above is not None, allow_subnormal=False)
        case "boolean":
            return st.booleans()
    return st.from_regex(shape.get("pattern", ".{0,20}"), fullmatch=True)


def block_of(path: str, value: Any) -> dict[str, Any]:
    name, _, rest = path.partition(".")
    return {name: block_of(rest, value) if rest else value}


@st.composite
def overlays(draw: st.DrawFn) -> dict[str, Any]:
    name = draw(st.sampled_from(["unit", "title", "label", "my-case_1", "x" * 65]))
    model = draw(st.sampled_from(sorted(MODELS)))
    parameters = {name: draw(st.floats(1e-6, 1e6)) for name in MODELS[model].names}
    config = block_of(f"cases.{name}.sample", {"model": model, **parameters})
    shapes = SINGLE | {f"cases.{name}.{path}": SINGLE[path] for path in OF_A_CASE}
    for path in draw(st.lists(st.sampled_from(sorted(shapes)), max_size=4, unique=True)):
        config = overlaid(config, block_of(path, draw(allowed(shapes[path]))))
    if draw(st.booleans()):
        path = draw(st.sampled_from(sorted(shapes)))
        # At the key, in a block above it, or under a name that is like it.
        parts = path.split(".")[: draw(st.integers(1, path.count(".") + 1))]
        odd = ".".join(parts) + draw(st.sampled_from(["", "", "x"]))
        config = overlaid(config, block_of(odd, draw(JUNK)))
    return config


@settings(
    max_examples=15,
    deadline=None,
    derandomize=True,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large],
)
@given(overlays())
def test_any_config_is_used_or_ends_in_one_message(overlay: dict[str, Any]) -> None:
    try:
        study = load_study(overlaid(DEFAULTS, overlay), [CONFIG])
    except BiogripError as error:
        event("refused")
        first, *lines = str(error).split("\n")
        assert first == "The study's configuration cannot be used."
        assert 1 <= len(lines) <= 7
        assert all(LINE.fullmatch(line) or line.startswith("... and ") for line in lines), lines
    else:
        event("used")
        assert study.cases
        assert built(StudyConfig, plain(study.config)) == study.config
