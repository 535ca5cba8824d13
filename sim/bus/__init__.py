"""Simulated servos behind a simulated half-duplex line: bytes in, bytes out, time moved."""
