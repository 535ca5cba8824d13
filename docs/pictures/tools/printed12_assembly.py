"""Draw the assembly of ``printed12`` from its dimensions, with the simulator's renderer.

MUJOCO_GL=osmesa python docs/pictures/tools/printed12_assembly.py docs/pictures/printed12.jpg
"""

import math
import sys
from pathlib import Path

import mujoco
from PIL import Image, ImageDraw

from snakewalk.config.loader import load_robot

SERVO = "0.2 0.2 0.22 1"
PRINT = "0.95 0.6 0.2 1"
BELLY = "0.35 0.6 0.75 1"
BASE_X_MM = 24.5, 28.5
"""Base plate of the bracket, from the joint axis: it is screwed to the rear of the servo."""
ARM_END_MM = 53.0
SIZE = 560, 360


def box(x_mm: tuple[float, float], y_mm: float, z_mm: float, half_mm: str, rgba: str) -> str:
    """Return a box by its ends along x, its middle, and its half sizes in y and z."""
    half_x = (x_mm[1] - x_mm[0]) / 2
    half_y, half_z = half_mm.split()
    return (
        f'<geom type="box" pos="{sum(x_mm) / 2} {y_mm} {z_mm}" '
        f'size="{half_x} {half_y} {half_z}" rgba="{rgba}"/>'
    )


def servo(axis: str) -> str:
    """Return a servo whose horn axis is vertical (y, yaw) or across (p, pitch)."""
    half = "10 13" if axis == "y" else "13 10"
    horns = "".join(
        f'<geom type="cylinder" size="8 1" pos="{pos}" {turn} rgba="0.6 0.6 0.6 1"/>'
        for pos, turn in (
            [("0 0 13.5", ""), ("0 0 -13.5", "")]
            if axis == "y"
            else [("0 13.5 0", 'euler="90 0 0"'), ("0 -13.5 0", 'euler="90 0 0"')]
        )
    )
    return box((-9.5, 24.5), 0, 0, half, SERVO) + horns


def bracket(next_axis: str) -> str:
    """Return the bracket that holds the horns of the next servo."""
    high = "10 17" if next_axis == "y" else "17 10"
    parts = box(BASE_X_MM, 0, 0, high, PRINT)
    for side in (-1, 1):
        y_mm, z_mm = (0, 15.5 * side) if next_axis == "y" else (15.5 * side, 0)
        thin = "8 1.5" if next_axis == "y" else "1.5 8"
        parts += box((BASE_X_MM[1], ARM_END_MM), y_mm, z_mm, thin, PRINT)
    return parts


def belly() -> str:
    """Return the shell under a link: radius 20 mm, 100 degrees, short enough for bent joints."""
    parts = ""
    for number in range(9):
        angle = math.radians(40.0 + 100.0 * (number + 0.5) / 9)
        y_mm, z_mm = 19.25 * math.cos(angle), -19.25 * math.sin(angle)
        parts += (
            f'<geom type="box" pos="22.5 {y_mm} {z_mm}" size="9.5 0.75 2.0" '
            f'euler="{-math.degrees(angle)} 0 0" rgba="{BELLY}"/>'
        )
    return parts


def picture(bodies: str, distance_mm: float, look_mm: tuple[float, float, float]) -> Image.Image:
    """Return a drawing of the bodies."""
    model = mujoco.MjModel.from_xml_string(
        f'<mujoco><compiler angle="degree"/><statistic extent="200" center="0 0 0"/><visual>'
        f'<global offwidth="{SIZE[0]}" offheight="{SIZE[1]}"/><map znear="0.02" zfar="30"/>'
        '<headlight ambient="0.45 0.45 0.45" diffuse="0.5 0.5 0.5"/></visual><asset>'
        '<texture type="skybox" builtin="flat" rgb1="1 1 1" rgb2="1 1 1" width="8" height="8"/>'
        f"</asset><worldbody>{bodies}</worldbody></mujoco>"
    )
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    camera = mujoco.MjvCamera()
    camera.lookat, camera.distance = look_mm, distance_mm
    camera.azimuth, camera.elevation = 125, -28
    with mujoco.Renderer(model, SIZE[1], SIZE[0]) as renderer:
        renderer.update_scene(data, camera)
        return Image.fromarray(renderer.render())


def body(x_mm: float, parts: str, y_mm: float = 0.0, z_mm: float = 0.0) -> str:
    """Return a body at a place."""
    return f'<body pos="{x_mm} {y_mm} {z_mm}">{parts}</body>'


def main() -> None:
    """Write four steps into one picture."""
    robot = load_robot("printed12")
    axes = robot.joint_axes
    pitch_mm = 1e3 * robot.link_lengths_m[0]
    apart = body(0, servo("y")) + body(20, bracket("p")) + body(-12, belly(), z_mm=-30)
    link = servo("y") + bracket("p") + belly()
    second = body(pitch_mm, servo("p") + bracket("y") + belly())
    whole = "".join(
        body(-pitch_mm * number, servo(axis) + bracket(axes[number - 1]) + belly())
        for number, axis in enumerate(axes)
    )
    steps = (
        ("1 a servo, its bracket and its belly", picture(apart, 125, (20, 0, -12))),
        ("2 one link", picture(body(0, link), 115, (20, 0, 0))),
        (
            "3 the next servo, turned by 90 degrees",
            picture(body(0, link) + second, 155, (40, 0, 0)),
        ),
        (f"4 {len(axes)} joints", picture(whole, 610, (-pitch_mm * len(axes) / 2 + 22, 0, 0))),
    )
    sheet = Image.new("RGB", (2 * SIZE[0], 2 * SIZE[1]), "white")
    draw = ImageDraw.Draw(sheet)
    for number, (text, drawn) in enumerate(steps):
        left, top = SIZE[0] * (number % 2), SIZE[1] * (number // 2)
        sheet.paste(drawn, (left, top))
        draw.text((left + 14, top + 10), text, fill="black", font_size=20)
    sheet.save(Path(sys.argv[1]), quality=82)


if __name__ == "__main__":
    main()
