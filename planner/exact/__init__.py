"""Exact planning for one or two hands: optimal tours with proof, or the best tour so far with a bound.

Planners of sessions and `mjsim plan` use this package through `solver.ExactSolver`. The equations are in `table`,
and docs/planners.md, "How the proof works", explains the method.

    solver        ExactSolver: the full table for up to 18 objects, else the search; OR-Tools for other problems
    full_table    fills the full table and follows a shortest tour in it
    task_table    a full table for the successive states of a task
    instance      a routing problem as flat arrays of integers
    table         E, V, W, Y: the recursion and its relaxation; fills small tables without numba
      table_kernels   fills any table, eight sums and minima at once
    search        annealing, then passes of a layered beam search that widen until the tour is proven
      annealing       a first tour: any order of picks, with optimal placing by dynamic programming
      multipliers     the bound: groups and Lagrangian prices of the relaxation, by subgradient ascent
      expand, nodes   kernels of a layer: the successors of its states, and the most promising of them
    table_regret  costs of possible next visits, from a table or from all tours that are short enough
    warm_start    multipliers, groups and order by name, from one state of a task to the next
"""
