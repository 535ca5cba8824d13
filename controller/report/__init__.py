"""Files for a person from a run's log alone: numbers, figures, page and film."""
