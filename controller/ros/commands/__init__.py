"""The command that holds a robot for a ROS 2 graph."""
