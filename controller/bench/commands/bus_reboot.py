"""``snakewalk bus reboot``: restarts servos."""

from snakewalk.config.constants import DEFAULT_BAUD
from snakewalk.controller.bench.commands.bus_options import Baud, Ids, Yes, confirmed
from snakewalk.controller.bench.port_lines import open_lines
from snakewalk.controller.bench.servo_settings import restart
from snakewalk.controller.console.command import command
from snakewalk.controller.console.options import ChainPort, Json, show


@command("bus reboot", examples=("bus reboot --id 3 --id 4",))
def reboot(
    servo_id: Ids,
    port: ChainPort = None,
    baud: Baud = DEFAULT_BAUD,
    yes: Yes = False,
    as_json: Json = False,
) -> None:
    """Restart servos and clear their alarms; torque goes off, so a held load falls."""
    facts: dict[str, object] = {}
    with open_lines(port, baud) as lines:
        buses = {reboot_id: lines.open_servo(reboot_id) for reboot_id in servo_id}
        question = "torque goes off, and a load that these servos hold falls; reboot them?"
        if yes or confirmed("bus reboot", question, as_json=as_json):
            for reboot_id, bus in buses.items():
                before, after = restart(bus, reboot_id)
                facts[f"ID {reboot_id}"] = (
                    f"rebooted; alarm before: {before or 'none'}; now: {after or 'none'}"
                )
    show(facts or {"rebooted": "none"}, as_json)
