"""LeRobot plug-in: the robot ``snakewalk`` and the teleoperator ``snakewalk_gait``."""

from lerobot_robot_snakewalk.config_snakewalk import SnakewalkConfig
from lerobot_robot_snakewalk.config_snakewalk_gait import SnakewalkGaitConfig
from lerobot_robot_snakewalk.snakewalk import Snakewalk
from lerobot_robot_snakewalk.snakewalk_gait import SnakewalkGait

__all__ = ["Snakewalk", "SnakewalkConfig", "SnakewalkGait", "SnakewalkGaitConfig"]
