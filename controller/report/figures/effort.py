"""Load of the servos: current and torque, temperature, voltage."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from snakewalk.config.arrays import Floats
from snakewalk.config.colours import GREY, HIGHEST, MEAN, RED, SUPPLY
from snakewalk.controller.figures.style import canvas, legend_above, trace
from snakewalk.controller.runlog.column import by_rows
from snakewalk.controller.runlog.record import RunRecord
from snakewalk.controller.runlog.topics import FLAT_V


def effort_figure(record: RunRecord) -> Figure | None:
    """Current of the chain, and the slow values; None without a cycle."""
    if len(record.cycle.time_s) == 0:
        return None
    slow = bool(np.isfinite(record.slow.temperature_c).any())
    figure, panels = canvas(2 if slow else 1, 5.2 if slow else 3.0)
    _current(panels[0], record)
    if slow:
        _draw_slow_values(panels[1], record)
    panels[-1].set_xlabel("time (s)")
    panels[-1].set_xlim(0.0, max(record.end_s, 1e-3))
    return figure


def _current(axes: Axes, record: RunRecord) -> None:
    cycle = record.cycle

    def sizes(current_a: Floats) -> Floats:
        size = np.abs(current_a)
        columns = size.max(axis=1), size.mean(axis=1), np.fmax.reduce(size, axis=1)
        return np.stack(columns, axis=1)

    highest, mean, known = by_rows(sizes, cycle.current_a).T
    for values, colour, label in (
        (highest, HIGHEST, "highest joint"),
        (mean, MEAN, "mean of all joints"),
    ):
        trace(axes, cycle.time_s, values, colour, label)
    peak = float(np.nanmax(np.append(known, 0.0)))
    limit = record.header.run.safety.current_limit_of_a(record.header.robot)
    axes.set_ylim(0.0, max(1.15 * peak, 0.05))
    if peak > 0.5 * limit:
        axes.axhline(limit, color=RED, linewidth=1.0, linestyle=(0, (4, 3)), label="limit")
        axes.set_ylim(0.0, 1.1 * max(peak, limit))
        axes.set_title("Current")
    else:
        axes.set_title(f"Current (limit {limit:g} A, above this panel)")
    axes.set_ylabel("current (A)")
    constant = record.header.torque_constant_n_m_a
    if np.isfinite(constant):
        torque = axes.secondary_yaxis(
            "right",
            functions=(
                lambda ampere: np.asarray(ampere, float) * constant,
                lambda newton_m: np.asarray(newton_m, float) / constant,
            ),
        )
        torque.set_ylabel("torque (N m)")
        torque.spines["right"].set_visible(True)
    legend_above(axes)


def _draw_slow_values(axes: Axes, record: RunRecord) -> None:
    slow = record.slow
    time = np.append(slow.time_s, record.end_s)
    for k, joint in enumerate(slow.temperature_c.T):
        axes.step(
            time,
            np.append(joint, joint[-1]),
            where="post",
            color=MEAN,
            linewidth=0.8,
            alpha=0.7,
            label="each servo" if k == 0 else None,
        )
    hottest = np.nanmax(np.where(np.isnan(slow.temperature_c), -1.0, slow.temperature_c), axis=1)
    hottest[hottest < 0.0] = np.nan
    axes.step(time, np.append(hottest, hottest[-1]), where="post", color=HIGHEST, label="hottest")
    axes.set_ylabel("temperature (°C)")
    limit = record.header.run.safety.temperature_limit_c
    axes.set_title(f"Temperature (limit {limit:g} °C) and supply")
    coolest = np.nanmin(slow.temperature_c)
    warmest = np.nanmax(slow.temperature_c)
    axes.set_ylim(coolest - 2.0, max(warmest + 0.4 * (warmest - coolest), coolest + 10.0))
    lowest = np.where(np.isnan(slow.voltage_v), np.inf, slow.voltage_v).min(axis=1)
    lowest[np.isinf(lowest)] = np.nan
    if not np.isfinite(lowest).any() or np.nanmax(lowest) - np.nanmin(lowest) <= FLAT_V:
        supply_text = f", supply {np.nanmedian(lowest):.1f} V throughout" if len(lowest) else ""
        axes.set_title(f"Temperature (limit {limit:g} °C){supply_text}")
        legend_above(axes)
        return
    volts = axes.twinx()
    volts.step(time, np.append(lowest, lowest[-1]), where="post", color=SUPPLY, linewidth=1.2)
    volts.set_ylabel("lowest supply (V)", color=SUPPLY)
    volts.tick_params(axis="y", colors=SUPPLY)
    volts.grid(visible=False)
    if np.isfinite(lowest).any():
        volts.set_ylim(np.nanmin(lowest) - 1.0, np.nanmax(lowest) + 0.15)
    volts.spines["right"].set_visible(True)
    volts.spines["right"].set_color(GREY)
    axes.plot([], [], color=SUPPLY, label="lowest supply")
    legend_above(axes)
