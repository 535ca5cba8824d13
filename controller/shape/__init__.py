"""Shapes: states from tangent angles, the library of states, and walks on graphs of them."""
