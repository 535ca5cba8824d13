"""The plugin's fixture, also where the package's entry points are not installed."""

from sim.bus.pytest_plugin import servo_bus

__all__ = ["servo_bus"]
