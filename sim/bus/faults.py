"""What a bad cable does to answers, repeatably: a ``Tamper`` for ``SimLine``."""

import random


class Noise:
    """Loses whole answers and flips single bits, each with its own chance, from one seed."""

    def __init__(self, *, lost: float = 0.0, damaged: float = 0.0, seed: int = 0) -> None:
        self._chance_lost = lost
        self._chance_damaged = damaged
        self._random = random.Random(seed)
        self.lost = 0
        """Answers that did not arrive."""
        self.damaged = 0
        """Answers with one wrong bit."""

    def __call__(self, answer: bytes) -> list[bytes]:
        """Say what arrives of ``answer``."""
        draw = self._random.random()
        if draw < self._chance_lost:
            self.lost += 1
            return []
        if draw < self._chance_lost + self._chance_damaged:
            self.damaged += 1
            at, bit = self._random.randrange(len(answer)), self._random.randrange(8)
            return [answer[:at] + bytes((answer[at] ^ 1 << bit,)) + answer[at + 1 :]]
        return [answer]
