"""Exact planning for a capacity of one or two: a proven optimal tour, or the best known tour with a bound.

The entry point is `solver.ExactSolver`. The equations are in `table`, and the section "How the proof works" of
docs/planners.md explains the method.

    solver        the full table for up to 18 objects, else the search; OR-Tools for other problems
    full_table    the table over all subsets of objects, and shortest tours in it
    task_table    a full table for successive states of a task
    instance      a routing problem as integer arrays
    table         the recursion and its relaxation; fills small tables without numba
      table_kernels   fills any table, eight entries at once
    search        annealing, then beam searches of increasing width until the tour is proven
      annealing       a first tour, with objects placed optimally for each order of picks
      multipliers     the lower bound, from Lagrangian prices fitted by subgradient ascent
      expand, nodes   kernels that expand a layer of states and keep the best
    table_regret  costs of possible next visits, from a table or an exhaustive pass
    warm_start    results of earlier plans, reused in later states of a task
"""
