"""Help of every command at 80 columns, stored; ``python -m tests.help`` writes the pages."""
