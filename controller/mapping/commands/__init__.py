"""Commands that make worlds from files and images, one command per file."""
