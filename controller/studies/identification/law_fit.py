"""The law of friction that explains logs of runs best.

The friction is fitted under each law. A log decides if the motion that is left over differs enough.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from snakewalk.config.friction_law import LAWS, LawName
from snakewalk.controller.studies.identification.friction_fit import FrictionLog, friction_misfit

_DECIDING_LIKELIHOOD = 5.0
"""Difference of log-likelihoods that decides for a law (ours): odds of 150."""


@dataclass(frozen=True, slots=True)
class LawFit:
    """How well each law of friction explains the logs."""

    misfit: dict[LawName, float]
    """Negative logarithm of the likelihood above that of the best law, with the friction that fits
    best under each; 3 are odds of 20."""

    @property
    def best(self) -> LawName:
        """The law with the least misfit."""
        return min(self.misfit, key=lambda law: self.misfit[law])

    @property
    def is_decided(self) -> bool:
        """Whether the logs decide between the best law and the others."""
        return sorted(self.misfit.values())[1] > _DECIDING_LIKELIHOOD

    def text(self) -> str:
        """A line for a person."""
        others = ", ".join(
            f"{law} {value:.1f}" for law, value in self.misfit.items() if law != self.best
        )
        if self.is_decided:
            return f"law of friction: {self.best}; worse by (log-likelihood): {others}"
        return (
            f"law of friction: these logs cannot decide it; {self.best} fits best; worse by "
            f"(log-likelihood, {_DECIDING_LIKELIHOOD:g} decide): {others}"
        )


def fit_laws(
    logs: Sequence[FrictionLog], on_progress: Callable[[int, int], None] = lambda done, total: None
) -> LawFit:
    """Fit the friction under each law, and compare how well they explain the logs."""
    misfits: dict[LawName, float] = {}
    for count, law in enumerate(LAWS):
        there = [log.under(law) for log in logs]

        def report(done: int, total: int, before: int = count) -> None:
            on_progress(before * total + done, len(LAWS) * total)

        misfits[law] = friction_misfit(there, report)
    least = min(misfits.values())
    return LawFit({law: value - least for law, value in misfits.items()})
