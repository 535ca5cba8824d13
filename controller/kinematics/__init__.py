"""Kinematics: where the links of a body are, frames that go with it, and angles from its shape."""
