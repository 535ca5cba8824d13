"""Check of sentences: patterns, texts and findings."""
