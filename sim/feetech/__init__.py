"""Feetech servos: STS, SCS and HLS, on the bytes of Feetech's serial protocol."""
