"""The joints of a robot on a bus: radians to raw values and back."""
