"""Geodesics on a grid navmesh and the capacitated pickup-and-delivery planner."""
