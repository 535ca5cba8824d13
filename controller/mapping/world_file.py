"""A world file for a map, with the map in the same folder."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.ndimage import distance_transform_edt

from snakewalk.config.heightfield import HeightField, write_map
from snakewalk.config.loader import checked
from snakewalk.config.template import template
from snakewalk.config.world import WorldConfig
from snakewalk.controller.console.result_files import atomic_write
from snakewalk.controller.terrain.relief import Relief


def map_beside(world: Path) -> Path:
    """Map file of a world's file."""
    return world.with_name(f"{world.stem}-map.npz")


@dataclass(frozen=True, slots=True)
class MapWorld:
    """A world from a map, not yet written."""

    file: Path
    """Path of the world's TOML file."""
    config: WorldConfig
    ground: HeightField
    relief: Relief

    @classmethod
    def of(cls, file: Path, ground: HeightField) -> "MapWorld":
        """Name a map's world after its file; the planner has default limits.

        Raises:
            InputError: the file's name cannot name a world.

        """
        source = {"kind": "map", "source": map_beside(file).name}
        config = checked(WorldConfig, {"name": file.stem, "ground": source}, str(file))
        return cls(file, config, ground, Relief(ground, config.planner))

    @property
    def map_file(self) -> Path:
        """The map file in the same folder."""
        return map_beside(self.file)

    def write(self, comment: Sequence[str]) -> None:
        """Write both files, with a head comment."""
        with atomic_write(self.file) as part:
            write_map(part.with_name(self.map_file.name), self.ground)
            text = template(self.config, "\n".join([*comment, self._holes()]))
            part.write_text(text, encoding="utf-8")

    def facts(self) -> dict[str, object]:
        """Extent, holes, share of safe ground, and the most open place."""
        ground = self.ground
        rows, columns = ground.z_m.shape
        x, y = ground.axes_m
        safe = self.relief.safe(*np.meshgrid(x, y))
        room = distance_transform_edt(np.pad(safe, 1))[1:-1, 1:-1]
        row, column = np.unravel_index(int(room.argmax()), room.shape)
        return {
            "world": str(self.file),
            "map": str(self.map_file),
            "size_m": [round(float(size), 3) for size in ground.size_m],
            "samples": [columns, rows],
            "spacing_m": ground.spacing_m,
            "height_m": round(float(np.ptp(ground.z_m)), 4),
            "known_share": round(self.known_share, 4),
            "safe_share": round(float(safe.mean()), 4),
            "most_room_at_m": [round(float(x[column]), 2), round(float(y[row]), 2)]
            if safe.any()
            else None,
        }

    @property
    def known_share(self) -> float:
        """Share of measured samples."""
        return 1.0 if self.ground.known is None else float(self.ground.known.mean())

    def _holes(self) -> str:
        if self.known_share == 1.0:
            return "Every sample was measured."
        return (
            f"{100.0 * self.known_share:.1f} % of the samples are known; the others are filled in, "
            "and no path leads over them."
        )
