"""A hardware-in-the-loop controller for a robotic snake made of DYNAMIXEL servos."""
