"""What may pass to the servos, and what happens when it may not."""
