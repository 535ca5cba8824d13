"""small_body."""
