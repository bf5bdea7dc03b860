"""Branch and cut for more objects than the search of `planner.exact` can prove.

branch_and_cut  the search, which yields better tours and bounds
graph           states as nodes, so that a tour is a connected flow, and tours from integer flows
connectivity    cuts that flows other than tours violate
flow_model      models of flows for the solvers of OR-Tools
root_bound      an exact bound from a solver's multipliers
"""
