"""Studies: many runs measured, tuned, replayed and compared, on one pool of spawned processes.

``sweep_points`` chooses parameters, ``sweep_measure`` measures one point, ``pool`` measures many at
once, and ``sweep_table`` stores every finished point. ``tune`` searches, ``trials`` repeats a run
over seeds, ``replay`` runs a log again, and ``graph_study`` compares walks on graphs.
``repertoire_*`` records actions and plans with them.
"""
