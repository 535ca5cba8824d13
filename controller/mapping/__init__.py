"""Maps: from files and stereo pictures to height fields that know where they are unknown."""
