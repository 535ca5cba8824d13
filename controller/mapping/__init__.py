"""Maps from files and stereo pictures: height fields that mark unknown ground."""
