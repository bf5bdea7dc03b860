"""Payments to participants: rules, payouts and the interface of recruitment platforms."""
