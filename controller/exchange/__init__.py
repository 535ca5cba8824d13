"""A run's log for other people's programs: tables, a ROS 2 bag, and a scene for Foxglove.

``flat_table`` makes one table a channel, ``body_frames`` the coordinate frames of the links that
``ros_bag`` and ``foxglove_scene`` share. The frames and joints have the names of ``robot export``.
"""
