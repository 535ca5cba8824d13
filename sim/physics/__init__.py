"""The body and the ground in MuJoCo, with the snake's anisotropic friction applied by us."""
