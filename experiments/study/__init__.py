"""Studies between subjects: simulate one from its design file, analyse its tables, work out its power and cost.

Serves researchers through `mjsim study`; the designs that ship with the package are in `designs/`.
"""
