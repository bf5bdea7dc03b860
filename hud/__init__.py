"""The heads-up display: assistance conditions, the HUD state that they make, and its drawing.

Serves sessions, which show it, and authors of conditions; it knows values only, neither physics nor planner.
"""
