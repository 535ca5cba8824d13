"""The ranges of a gait's parameters, as its model states them."""

from dataclasses import dataclass

from controller.gaits.gait import GaitParameters


@dataclass(frozen=True, slots=True)
class Range:
    """One parameter."""

    kind: type
    """float, int or bool."""
    default: float
    low: float
    high: float
    said: str
    """Its description."""

    @property
    def step(self) -> float:
        """What one press of a key changes: a fortieth of the range, 1 for whole numbers."""
        return (self.high - self.low) / 40.0 if self.kind is float else 1.0


def ranges(model: type[GaitParameters]) -> dict[str, Range]:
    """Ranges by parameter, in the order of the model; 0 to 1 for a switch."""
    found: dict[str, Range] = {}
    kinds: dict[object, type] = {int: int, bool: bool}
    for name, field in model.model_fields.items():
        bounds = {
            key: float(value)
            for rule in field.metadata
            for key in ("ge", "gt", "le", "lt")
            if (value := getattr(rule, key, None)) is not None
        }
        found[name] = Range(
            kind=kinds.get(field.annotation, float),
            default=float(field.default),
            low=bounds.get("ge", bounds.get("gt", 0.0)),
            high=bounds.get("le", bounds.get("lt", 1.0)),
            said=field.description or "",
        )
    return found
