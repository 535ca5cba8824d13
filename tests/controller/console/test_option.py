"""An option that is a field of a model: the same default and bounds in Python and in words."""

import inspect
from pathlib import Path
from typing import Annotated, Any, get_args

import pytest
from pydantic import AfterValidator, Field, ValidationError

from snakewalk.config.base import Strict
from snakewalk.config.errors import InputError
from snakewalk.config.key_types import SEED, Seed
from snakewalk.config.run import RunConfig
from snakewalk.controller.animals.fish.synthesis_options import SynthesisOptions
from snakewalk.controller.console.option import Flag, from_words, key_parameter, numbers, parameters


def _even(value: int) -> int:
    if value % 2:
        raise ValueError("must be even")
    return value


class Options(Strict):
    """Options of each kind."""

    count: int = Field(4, ge=1, le=9, description="number of things")
    share: Annotated[float, Flag(("--part",))] = Field(0.5, gt=0.0, description="share")
    files: tuple[Path, ...] = Field((), description="files")
    place: Annotated[tuple[float, float], numbers("give X,Y", 2)] = Field(
        (1.0, 0.5), description="place"
    )
    seed: Annotated[int, AfterValidator(_even)] | None = Field(None, description="seed")
    names: Annotated[dict[str, str], Flag(("--of",))] = Field({}, description="names by key")
    name: Annotated[str, Flag(is_argument=True)] = Field(description="name")


def typer_facts() -> dict[str, tuple[Any, Any, Any]]:
    """Type, default and Typer's declaration of each option."""
    found = {}
    for each in parameters(Options):
        kind, info = get_args(each.annotation)
        found[each.name] = kind, each.default, info
    return found


def words(**given: Any) -> dict[str, Any]:
    """Values as Typer hands them over."""
    defaults = {name: default for name, (_, default, _) in typer_facts().items()}
    return {**defaults, "name": "a", **given}


def test_a_field_becomes_the_option_of_a_command() -> None:
    found = typer_facts()
    kind, default, info = found["count"]
    assert (kind, default, info.min, info.max, info.help) == (int, 4, 1, 9, "number of things")
    assert found["share"][2].default == "--part"
    assert found["files"][:2] == (list[Path] | None, None)
    assert found["place"][:2] == (str, "1,0.5")
    assert found["seed"][:2] == (int | None, None)
    assert found["name"][1] is inspect.Parameter.empty


def test_the_values_of_a_command_line_become_the_model() -> None:
    assert from_words(Options, words()) == Options(name="a")
    given = words(place="2,3", files=[Path("x")], seed=2, names=["a=1", "b=c"])
    made = from_words(Options, given)
    assert (made.place, made.files, made.seed) == ((2.0, 3.0), (Path("x"),), 2)
    assert made.names == {"a": "1", "b": "c"}
    with pytest.raises(InputError, match="--of a: expected KEY=VALUE"):
        from_words(Options, words(names=["a"]))


def test_the_named_type_of_a_key_becomes_an_option() -> None:
    def of(annotation: Any, default: Any) -> tuple[Any, Any, Any]:
        given = inspect.Parameter("one", inspect.Parameter.KEYWORD_ONLY, default=default)
        made = key_parameter(given.replace(annotation=annotation))
        return (*get_args(made.annotation), made.default)

    for annotation, kind, default in ((Seed, int, SEED), (Seed | None, int | None, None)):
        found, info, shown = of(annotation, default)
        assert (found, info.min, shown) == (kind, 0, default)
        assert info.help == RunConfig.model_fields["seed"].description


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"place": "1"}, "--place 1: give X,Y"),
        ({"place": "1,nan"}, "--place 1,nan: give X,Y"),
        ({"share": 0.0}, "--part 0.0: must be over 0"),
        ({"share": float("nan")}, "--part nan: must be a finite number"),
        ({"seed": 3}, "--seed 3: must be even"),
    ],
)
def test_a_rejected_value_is_named_with_its_option(given: dict[str, Any], said: str) -> None:
    with pytest.raises(InputError) as caught:
        from_words(Options, words(**given))
    assert caught.value.faults == (said,)


def test_all_rejected_values_are_named_at_once() -> None:
    with pytest.raises(InputError) as caught:
        from_words(Options, words(share=-1.0, place="x"))
    assert len(caught.value.faults) == 2


@pytest.mark.parametrize(
    "given",
    [
        {"seconds": 0.0},
        {"seconds": float("nan")},
        {"limit_s": float("inf")},
        {"radius": -1.0},
        {"seed": -1},
        {"through": ((1.0, 2.0), (1.0, 2.0))},
        {"tank": (0.0, 0.0, 0.1, 0.1)},
        {"start": (0.0, float("inf"), 0.0)},
        {"unknown": 1},
    ],
)
def test_bounds_hold_from_python(given: dict[str, Any]) -> None:
    with pytest.raises(ValidationError):
        SynthesisOptions(**given)
