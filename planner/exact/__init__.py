"""The exact planner for a capacity of one or two, which finds tours and proves that they are optimal.

The entry point is `solver.ExactSolver`. The module `table` contains the equations, and the section "How the exact
planner works" in docs/planners.md explains the methods.

    solver        the planner, which uses a full table, a search, branch and cut, or OR-Tools
    full_table    tables over all subsets of the objects, which are reused for successive states of a task
    instance      a routing problem as integer arrays
    moves         all moves of a tour, from which costs of next visits and a tour's actions follow
    table         the recursion and its relaxation, and NumPy code for small tables
      table_kernels   compiled code for tables of any size
    search        annealing, followed by beam searches of increasing width
      annealing       a first tour from simulated annealing
      multipliers     a lower bound from fitted Lagrangian multipliers
      expand, nodes   kernels that expand a layer of states and keep the best states
    cuts          branch and cut, for more than 24 objects
    task_search   searches for successive states of a task, with one budget
    table_regret  costs of possible next visits
    warm_start    results of earlier plans that can be reused
"""
