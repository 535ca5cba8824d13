"""The constants of a servo found from recordings of it, each with an interval."""
