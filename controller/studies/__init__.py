"""Studies: many runs measured, tuned, replayed and compared, on one pool of spawned processes.

``sweep_points`` chooses what to try, ``sweep_measure`` tries one point, ``pool`` tries many at
once, ``sweep_table`` keeps every finished point, ``tune`` searches, ``trials`` repeats a run over
seeds, ``replay`` runs a log again, ``graph_study`` compares walks on graphs, and ``repertoire_*``
records actions and plans with them.
"""
