"""Write the stored help: ``python -m tests.help``."""

from tests.help.shown import write

write()
