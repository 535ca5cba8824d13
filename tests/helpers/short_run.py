"""The shortest run along waypoints, as the text of its file."""

SHORT_RUN = """
name = "short"
robot = "yaw16"
world = "flat"
motion = "serpenoid"
waypoints_m = [[0.5, 0.0]]
waypoint_radius_m = 0.3
"""
