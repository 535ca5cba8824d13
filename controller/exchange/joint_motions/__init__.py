"""Readers of joint angles over time: plug-ins of the kind ``joints`` for ``snakewalk play``."""
