"""The running robot: forecast, control loop, drive, derating and slip monitor."""
