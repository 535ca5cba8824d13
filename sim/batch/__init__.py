"""Many robots of one kind at once, on MuJoCo-Warp, with the friction and motors of one robot."""
