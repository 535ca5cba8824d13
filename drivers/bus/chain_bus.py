"""Bus of a chain: one port, or one port per segment."""

from snakewalk.drivers.bus.control_cycle import ControlCycle
from snakewalk.drivers.bus.dynamixel_bus import DynamixelBus
from snakewalk.drivers.bus.segmented_bus import SegmentedBus, SegmentedCycle

ChainBus = DynamixelBus | SegmentedBus
"""Bus for start-up, cycle and shutdown of a chain."""
GroupCycle = ControlCycle | SegmentedCycle
"""Group read of servos, and write of their goals."""
