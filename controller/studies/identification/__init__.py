"""Constants of a servo from recordings, each with an interval."""
