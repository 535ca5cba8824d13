"""Rules for commands to the servos, and the reaction to a violation."""
