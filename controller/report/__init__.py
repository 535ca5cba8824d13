"""Files for a person, made from a run's log alone: numbers, figures, one page, a film.

``artifacts.make_artifacts`` makes all of them, ``page`` writes the HTML, ``film`` draws the film;
``figures`` are those of the page, ``plots`` those of the other commands.
"""
