"""Contact of tracked feet: measured errors next to the least possible ones.

python -m benchmarks.contact_bound

The least standard deviation of an unbiased estimator is the Cramer-Rao bound of the model that
``stride`` fits: contact, touch-down and middle of each foot, and one shape of the way in the air.
"""

import numpy as np

from benchmarks.provenance import provenance
from snakewalk.config.arrays import Floats
from snakewalk.controller.animals.legged.contact_fit import step
from snakewalk.controller.animals.legged.stride import measure_stride
from tests.controller.animals.legged.test_stride import walker

STRIDE, CYCLES, FRAMES = 0.5, 10, 30
DOWN = (0.0, 0.5, 0.25, 0.75)
DRAWS = 12
ROWS = (
    ("cubic", 2.0, (0.63, 0.66), 0.005),
    ("least jerk", 3.0, (0.63, 0.66), 0.005),
    ("least jerk", 3.0, (0.45, 0.5), 0.005),
    ("least jerk", 3.0, (0.45, 0.5), 0.002),
)


def bound(p: float, duty: tuple[float, float], noise: float, known_shape: bool) -> float:
    """Least standard deviation of the contact of a front foot, of the cycle."""
    phase = np.arange(CYCLES * FRAMES) / FRAMES + 0.13
    duties = np.repeat(duty, 2)
    true = np.concatenate([duties, DOWN, np.zeros(4), [p, p]])

    def ways(x: Floats) -> Floats:
        shape = float(x[12]), float(x[13])
        return np.concatenate(
            [x[8 + k] + step((phase - x[4 + k]) % 1.0, STRIDE, x[k], shape) for k in range(4)]
        )

    small = 1e-5
    slopes = np.array(
        [(ways(true + small * e) - ways(true - small * e)) / (2.0 * small) for e in np.eye(14)]
    )
    if known_shape:
        slopes = slopes[:12]
    return float(noise * np.sqrt(np.linalg.inv(slopes @ slopes.T)[0, 0]))


def errors(swing: str, duty: tuple[float, float], noise: float) -> Floats:
    """Errors (draws, 4) of the measured contact."""
    found = []
    for seed in range(DRAWS):
        spine, feet, _ = walker(swing, duty, noise, seed, FRAMES)
        stride = measure_stride(spine, feet, (1, 3), float(FRAMES), "above")
        found.append([foot.duty - duty[k // 2] for k, foot in enumerate(stride.feet)])
    return np.array(found)


def main() -> None:
    print("| way in the air | contact | noise | bound | bound, known shape | measured | worst |")
    print("| --- | ---: | ---: | ---: | ---: | ---: | ---: |")
    for swing, p, duty, noise in ROWS:
        off = errors(swing, duty, noise)
        print(
            f"| {swing} | {duty[0]:.2f} | {100 * noise:.1f} % | {bound(p, duty, noise, False):.4f} "
            f"| {bound(p, duty, noise, True):.4f} | {off[:, :2].std():.4f} "
            f"| {np.abs(off).max():.3f} |",
            flush=True,
        )
    print(provenance("python -m benchmarks.contact_bound"))


if __name__ == "__main__":
    main()
