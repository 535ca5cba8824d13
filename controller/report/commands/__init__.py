"""The command that draws a run's report and film."""
