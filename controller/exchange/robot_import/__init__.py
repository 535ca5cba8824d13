"""Robot models of other programs (URDF, MJCF, xacro) as robot files."""
