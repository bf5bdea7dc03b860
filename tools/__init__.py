"""Tools of the checkout: the data of `models/`, the pictures of the documentation, generated pages and types.

Serves maintainers; it is not part of the wheel.
"""
