"""The central pattern generator: coupled oscillators that run any gait and change between them."""
