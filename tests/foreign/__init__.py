"""Generated files of other programs, each with the correct answer."""
