"""Where a person can walk, how far it is, and in which order to fetch objects: the routing problem and its planners.

It knows distances and names only, and serves sessions through `service` and `mjsim plan` through `solver`.
"""
