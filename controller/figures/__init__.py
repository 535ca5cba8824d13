"""Style and shared drawings of figures."""
