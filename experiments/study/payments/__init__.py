"""Payments of a study: rules, payouts and the platform's client."""
