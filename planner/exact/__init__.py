"""Proven optimal tours for a person with one or two hands, and how close to optimal the best tour is until then.

It serves the planners of sessions and `mjsim plan`, which reach it through `solver.ExactSolver`. The equations are in
`table`, the measurements in docs/planners.md, "How the proof works".

    solver        ExactSolver: up to 18 objects the full table, beyond it the search; OR-Tools for other problems
    task_table    a full table for the successive states of a task
    instance      a routing problem as flat arrays of integers
    table         E, V, W, Y: the recursion and its relaxation; fills small tables without numba
      table_kernels   fills any table; on `simd`, eight sums and minima at once
    search        annealing, then passes of a layered beam search that get wider until the tour is proven
      annealing       a first tour: picks in any order, best places to leave objects by dynamic programming
      multipliers     the bound: groups and Lagrangian prices of the relaxation, by subgradient ascent
      expand, nodes   kernels of a layer: what follows its states, and the most promising of them
    table_regret  what each next visit costs: from a table, or from all tours that are short enough
    warm_start    multipliers, groups and order by name, from one state of a task to the next
"""
