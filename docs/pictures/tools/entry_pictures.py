"""Draw the small pictures of the entry points in README and on the landing page.

python docs/pictures/tools/entry_pictures.py
"""

from pathlib import Path

import matplotlib.font_manager as fonts
from PIL import Image, ImageDraw, ImageFont

from snakewalk.config.colours import INK, SKY

PICTURES = Path(__file__).resolve().parents[1]
SIZE = 240, 135
CROPS = {
    "simulation": ("traverse.jpg", (0.06, 0.13, 0.5, 1.0)),
    "bench": ("view.jpg", (0.27, 0.1, 1.0, 0.88)),
    "rehearsal": ("view-two.jpg", (0.08, 0.2, 0.7, 0.86)),
    "animals": ("capture-worm.jpg", (0.0, 0.0, 0.5, 0.45)),
}
"""Picture of the site, and left, top, right and bottom of the part that is shown."""
CODE = {
    "ci": """def test_my_robot(servo_bus):
  bus = servo_bus("1-6")
  my_driver.open(bus.path)
  assert bus["Torque Enable"].all()""",
    "ros": """$ ros2 topic list
/robot_joint_states
/robot_joint_command
/robot_gait""",
    "library": """import snakewalk as sw

robot = sw.load_robot("yaw16")
print(robot.length_m)""",
}


def main() -> None:
    """Write one JPEG for each entry point."""
    (PICTURES / "entry").mkdir(exist_ok=True)
    for name, (file, part) in CROPS.items():
        with Image.open(PICTURES / file) as picture:
            wide, high = picture.size
            box = tuple(
                round(share * side) for share, side in zip(part, (wide, high) * 2, strict=True)
            )
            cut = picture.convert("RGB").crop(box)
        scale = max(SIZE[0] / cut.width, SIZE[1] / cut.height)
        shown = cut.resize((round(cut.width * scale), round(cut.height * scale)), Image.LANCZOS)
        save(shown.crop((0, 0, *SIZE)), name)
    mono = fonts.findfont("DejaVu Sans Mono")
    for name, text in CODE.items():
        card = Image.new("RGB", SIZE, INK)
        font = ImageFont.truetype(mono, 10)
        ImageDraw.Draw(card).multiline_text((10, 28), text, fill=SKY, font=font, spacing=7)
        save(card, name)


def save(picture: Image.Image, name: str) -> None:
    """Write a picture of less than 60 kB."""
    picture.save(PICTURES / "entry" / f"{name}.jpg", quality=85, optimize=True)


if __name__ == "__main__":
    main()
