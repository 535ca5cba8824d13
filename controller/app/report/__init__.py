"""From a log to something a person can read: numbers, figures, one page; nothing but the log.

``build.build_report`` makes the page, ``summary.summary`` the numbers, ``compare.compare`` says
where a replay departs from its original.
"""
