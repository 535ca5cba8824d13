"""``snakewalk animal capture``: from a film of an animal to a track that the robot can walk."""

from dataclasses import asdict

from snakewalk.config.reading import answered
from snakewalk.controller.capture.capturing import (
    CaptureFacts,
    correct_recording,
)
from snakewalk.controller.capture.film.film_options import CaptureOptions, FootageChoice
from snakewalk.controller.capture.several.recording import AnimalsFacts
from snakewalk.controller.capture.verification.remedies import capture_film, captures
from snakewalk.controller.console.command import command
from snakewalk.controller.console.options import (
    Json,
    console,
    print_table,
    show,
)


@command(
    "animal capture",
    examples=(
        "animal capture film.mp4 -o track.npz --length-m 0.4 --sheet sheet.png",
        "animal capture frames/ --cropped --overlay overlay.mp4 --force --json",
        "animal capture film.mp4 --review review.html",
        "animal capture plate.mp4 --animals auto --overlay overlay.mp4",
        "animal capture dish.mp4 --animals 3 -o fish.csv --wide",
        "animal capture track.npz --corrections track-corrections.json -o corrected.npz",
    ),
)
def capture(as_json: Json = False, *, options: CaptureOptions) -> None:
    """Find the animal in every frame: silhouette, medial axis, 100 equal chords, head and tail."""
    if options.corrections is not None:
        show(asdict(correct_recording(options)), as_json)
        return
    film = FootageChoice(**options.model_dump(include={*FootageChoice.model_fields}))
    facts = answered(
        options.recording,
        film,
        lambda answers: capture_film(options.model_copy(update=dict(answers))),
    )
    show_facts(facts, as_json=as_json)


def show_facts(facts: CaptureFacts | AnimalsFacts, *, as_json: bool) -> None:
    """Show rows or JSON; exit with code 1 if an animal has no track, or one without good frames."""
    if as_json or isinstance(facts, CaptureFacts):
        show(asdict(facts), as_json)
    else:
        _print_animals(facts)
    for animal in captures(facts):
        if animal is None or animal.frames_used == animal.frames_rough:
            raise SystemExit(1)


def _print_animals(facts: AnimalsFacts) -> None:
    """One row for each animal."""
    rows: list[tuple[object, ...]] = []
    heads = ("animal", "track", "frames used", "in contact", "length, px", "identity uncertain")
    for animal in facts.animals:
        after = ", ".join(map(str, animal.identity_uncertain_after))
        unsure = f"after frame {after}" if after else "no"
        if animal.capture is None:
            rows.append((animal.animal, "-", 0, "-", "-", unsure))
            continue
        used = animal.capture.frames_used
        length = f"{animal.capture.length_px:g}"
        merged = animal.frames_merged
        rows.append((animal.animal, animal.capture.track, used, merged, length, unsure))
    print_table(heads, rows, f"{facts.recording}: {facts.frames} frames")
    console.print(f"other objects, not captured: {facts.left_out}; background: {facts.background}")
