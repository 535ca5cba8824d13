"""People: a jointed skeleton, a skin of PDE surfaces, and a walk and a run by [GC] Eq. 9 and 10."""
