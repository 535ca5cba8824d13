"""The ground as the planner sees it: height field in, safe path out."""
