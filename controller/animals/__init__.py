"""Bodies of animals: mesh, skin, legs, fish, and their synthesis."""
